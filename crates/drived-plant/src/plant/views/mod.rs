//! What every face tells of the plant, as JSON: units in the names of the keys, an age and a quality with every value.
//!
//! A key whose value is not known, or that a family does not have, is left out: nothing is 0 because it is missing.

mod command;
mod drive;
mod exchange;
mod line;
mod measured;
mod notice;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

use drive_fleet::alarms::AlarmView;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::{
    command::{CommandView, SeveralView},
    drive::{DriveView, Gist, Shown},
    exchange::{ExchangeView, LineDetailView, ResultWord},
    line::{AnswerTimes, FindingView, LineErrors, LineLink, LineView, SlaveView},
    measured::{AnswersView, MeasuredLineView, PlannedLineView, SettingsView, StepView, TimesView},
    notice::{HappenedView, NoticeView},
};
use drived_config::{config::Group, names::KnownAs, rights::Rights};

/// Everything at one moment.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
pub struct StateView {
    /// The last revision that is in it: events after this one complete it.
    pub revision: u64,
    /// Now, in milliseconds since 1970.
    pub time_unix_ms: u64,
    pub daemon: DaemonView,
    pub lines: Vec<LineView>,
    pub drives: Vec<DriveView>,
    pub groups: Vec<GroupView>,
    /// All alarms that are not over, in the order in which they came first.
    #[serde(default)]
    pub alarms: Vec<AlarmView>,
}

/// A group: who is in it, and by what it is known that keeps over another name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GroupView {
    pub name: String,
    #[serde(flatten)]
    pub known_as: KnownAs,
    /// In the order in which they start.
    pub drives: Vec<String>,
}

impl GroupView {
    pub(super) fn of(Group { name, drives }: Group, known_as: KnownAs) -> Self {
        Self { name, known_as, drives }
    }
}

/// The program that answers, and what it lets the asker do.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct DaemonView {
    pub version: Cow<'static, str>,
    pub started_unix_ms: u64,
    /// The zone of its clock, such as `Europe/Paris`; absent where the host does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<String>,
    /// Whether its drives are simulated.
    pub demo: bool,
    /// What the asker may do.
    pub rights: Rights,
    /// Who the asker is: the name of his token, `local` on the socket, or `anonymous`.
    pub caller: String,
    /// The drives that the asker's token is for; absent where it is for all. He may stop the others, too, where he may stop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<Vec<String>>,
    /// Which order of the drives holds, as the head of a virtual unit and `drived export gateway-map` have it: another number when a drive
    /// has come, left, or has another name. Absent where nobody has a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub names_revision: Option<u16>,
    /// Why nobody has a number, such as that `names.json` was lost; absent where all is well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub names_problem: Option<String>,
}
