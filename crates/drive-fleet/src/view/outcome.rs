//! What became of what was asked of a drive, as programs read it: of a command, of a stop, and of the drive when it ended.

use std::sync::Arc;

use drive_core::{Command, Setpoint, Status, StopMode};
use serde::{Deserialize, Serialize, Serializer};

use super::{ErrorView, whole_ms};
use crate::{
    event::ExitAction,
    outcome::{Became, LastSeen, Outcome, Refused, Started, StopModes, Unconfirmed},
};

/// A command that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct CommandedView {
    /// Which.
    #[serde(flatten)]
    pub command: Command,
    /// The setpoint that a start was given with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub given: Option<Setpoint>,
    /// By whom.
    pub commander: Arc<str>,
    /// How.
    #[serde(flatten)]
    pub outcome: OutcomeView,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OutcomeView {
    /// In one word.
    pub outcome: Became,
    /// Why, in one word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Why, in a sentence; of a start that is in force, at what.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// What went wrong, where something did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorView>,
    /// Of a start that is in force: which way, and the setpoint that it uses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started: Option<Started>,
    /// Of a stop: how it was asked for, and how the drive stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<StopModesView>,
    /// What the drive said last, where that matters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<Box<SeenView>>,
}

impl From<&Outcome> for OutcomeView {
    fn from(outcome: &Outcome) -> Self {
        let (error, last) = match outcome {
            Outcome::NotConfirmed(Unconfirmed::Denied(error) | Unconfirmed::StopDenied { error, .. })
            | Outcome::Refused(Refused::Drive(error)) => (Some(error), None),
            Outcome::NotConfirmed(
                Unconfirmed::TimeOver { last, .. } | Unconfirmed::NotStarted { last, .. },
            ) => (None, last.as_ref()),
            Outcome::OutcomeUnknown(unknown) => (unknown.error.as_ref(), unknown.last.as_ref()),
            _ => (None, None),
        };
        Self {
            outcome: outcome.became(),
            reason: outcome.reason().map(str::to_owned),
            text: outcome.text(),
            error: error.map(ErrorView::from),
            started: outcome.started(),
            stop: outcome.stop().map(StopModesView::from),
            last: last.map(|last| Box::new(SeenView::from(last))),
        }
    }
}

/// How a stop was asked for, and how the drive stops.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StopModesView {
    /// The mode that was asked for.
    pub asked: StopMode,
    /// The mode by which the drive stops; absent while it has shown none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub used: Option<StopMode>,
    /// Why it is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// For how long direct current was to be held, in milliseconds, where somebody has said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub injection_asked_ms: Option<u64>,
    /// For how long it is held, in milliseconds, where it is injected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub injection_used_ms: Option<u64>,
}

impl From<StopModes> for StopModesView {
    fn from(stop: StopModes) -> Self {
        Self {
            asked: stop.asked,
            used: stop.used,
            why: stop.why.map(str::to_owned),
            injection_asked_ms: stop.injection_asked.map(whole_ms),
            injection_used_ms: stop.injection_used.map(whole_ms),
        }
    }
}

/// A status that may be old.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SeenView {
    /// How old it was then.
    pub seen_before_ms: u64,
    /// What it said.
    #[serde(flatten)]
    pub status: Status,
}

impl From<&LastSeen> for SeenView {
    fn from(seen: &LastSeen) -> Self {
        Self {
            seen_before_ms: whole_ms(seen.age),
            status: Status { at: None, ..Status::clone(&seen.status) },
        }
    }
}

/// What was done to a drive when it ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExitView {
    /// In one word.
    pub action: Ended,
    /// How a stop or a release ended.
    #[serde(flatten)]
    pub outcome: Option<OutcomeView>,
}

/// What was done to a drive when it ended, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
#[expect(missing_docs, reason = "they are those of ExitAction")]
pub enum Ended {
    Left,
    LeftTurning,
    Stopped,
    Released,
    TimeOver,
}

impl From<&ExitAction> for ExitView {
    fn from(action: &ExitAction) -> Self {
        let (action, outcome) = match action {
            ExitAction::Left => (Ended::Left, None),
            ExitAction::LeftTurning => (Ended::LeftTurning, None),
            ExitAction::Stopped(outcome) => (Ended::Stopped, Some(outcome)),
            ExitAction::Released(outcome) => (Ended::Released, Some(outcome)),
            ExitAction::TimeOver => (Ended::TimeOver, None),
        };
        Self { action, outcome: outcome.map(OutcomeView::from) }
    }
}

/// What became of a drive of a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OfDrive {
    /// The drive.
    pub drive: Arc<str>,
    /// What became of it.
    #[serde(flatten)]
    pub outcome: OutcomeView,
}

pub(crate) fn by_drive<S: Serializer>(
    outcomes: &[(Arc<str>, Outcome)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let told = |(drive, outcome): &(Arc<str>, Outcome)| OfDrive {
        drive: Arc::clone(drive),
        outcome: outcome.into(),
    };
    serializer.collect_seq(outcomes.iter().map(told))
}
