//! What whoever asks was shown of the drives that he means: a command is carried out so, or refused in words that say what has changed.
//!
//! A name is who it is by the configuration of the moment, and a question to a person may stand for long. What stays with a motor
//! is its place: the port, the family and the address at which it is asked.

use std::fmt;

use drive_core::{Direction, Frequency, Motion, Setpoint, Status};
use drive_fleet::{DriveHandle, Place};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Plant, Target};
use drived_config::config::Group;

/// Between a reference that was shown and the one of now, where the drive follows what it was given elsewhere: an analog input
/// trembles by more than its last digit.
const TREMBLES: Frequency = Frequency::from_centihertz(50);

/// What was shown: the command is carried out so, or refused with the reason `not_as_shown`. A stop is never refused for it, and
/// stops besides whoever stands at these places by another name.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expects {
    /// Every drive that is meant, as `/api/v1/state` has shown it.
    #[schemars(length(min = 1))]
    drives: Vec<AsShown>,
}

/// A drive as it was shown.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AsShown {
    name: String,
    /// Its `place`.
    #[schemars(with = "String")]
    place: Place,
    /// The setpoint that was shown: the drive's `setpoint`, or else the `reference_hz` of its status. Not looked at unless it is said.
    setpoint: Option<Setpoint>,
    /// Whether its motor was shown as driven, by the `motion` and the `direction` of its status. Not looked at unless it is said.
    driven: Option<Driven>,
}

/// Whether a motor is driven, and which way it turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Driven {
    Forward,
    Reverse,
    Not,
}

impl Driven {
    /// `None`: the words do not tell.
    fn of(status: &Status) -> Option<Self> {
        match (status.motion, status.direction) {
            (Motion::NotKnown, _) | (Motion::Driven, None) => None,
            (Motion::Driven, Some(Direction::Forward)) => Some(Self::Forward),
            (Motion::Driven, Some(Direction::Reverse)) => Some(Self::Reverse),
            _ => Some(Self::Not),
        }
    }
}

impl fmt::Display for Driven {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Forward => "driven forward now",
            Self::Reverse => "driven in reverse now",
            Self::Not => "not driven any more",
        })
    }
}

/// What is otherwise than it was shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Otherwise {
    #[error("the drive that was called {was} is called {now} now")]
    Renamed { was: String, now: String },
    #[error("{0} is the name of another drive now")]
    Another(String),
    #[error("the drive that was called {0} is there no more")]
    Gone(String),
    #[error("{0} has come to those that are meant")]
    Joined(String),
    #[error("{0} is none of those that are meant any more")]
    Left(String),
    #[error("the setpoint of {drive} is {now} now")]
    Setpoint { drive: String, now: Setpoint },
    #[error("the setpoint of {0} is not known any more")]
    NoSetpoint(String),
    #[error("{drive} is {now}")]
    Driven { drive: String, now: Driven },
    #[error("another setpoint is on its way to {drive}: {coming}")]
    SetpointComing { drive: String, coming: Setpoint },
}

impl Expects {
    /// This drive, whatever its setpoint: for what may have to wait before it is begun.
    pub fn of(drive: &DriveHandle) -> Self {
        Self { drives: vec![AsShown::of(drive)] }
    }
}

impl AsShown {
    fn of(drive: &DriveHandle) -> Self {
        Self { name: drive.name().to_string(), place: drive.place().clone(), setpoint: None, driven: None }
    }
}

impl Plant {
    /// Those that are meant now, for a command that has to wait before it is begun; `None`: one of them is not there.
    pub fn as_it_is(&self, target: &Target) -> Option<Expects> {
        let (fleet, names) = (self.fleet(), self.named(&self.groups(), target).ok()?);
        let shown = |name: String| Some(AsShown::of(&fleet.drive(&name)?));
        Some(Expects { drives: names.into_iter().map(shown).collect::<Option<_>>()? })
    }

    /// Whether the drives of these names are those that were shown, and as they were.
    ///
    /// # Errors
    /// What is otherwise.
    pub fn is_as_shown(&self, expects: &Expects, names: &[String]) -> Result<(), Otherwise> {
        self.is_as_shown_among(&self.groups(), expects, names)
    }

    /// The same while the groups are held.
    pub(super) fn is_as_shown_among(
        &self,
        groups: &[Group],
        expects: &Expects,
        names: &[String],
    ) -> Result<(), Otherwise> {
        let fleet = self.fleet();
        let coming = self.0.commands.setpoints_under_way();
        for shown in &expects.drives {
            let drive = match fleet.drive(&shown.name) {
                Some(drive) if *drive.place() == shown.place => drive,
                other => {
                    let was = shown.name.clone();
                    return Err(match (fleet.drive_at(&shown.place), other) {
                        (Some(now), _) => Otherwise::Renamed { was, now: now.name().to_string() },
                        (None, Some(_)) => Otherwise::Another(was),
                        (None, None) => Otherwise::Gone(was),
                    });
                }
            };
            if !names.contains(&shown.name) {
                return Err(Otherwise::Left(shown.name.clone()));
            }
            if let Some(driven) = shown.driven {
                is_driven_so(driven, &drive)?;
            }
            let Some(setpoint) = shown.setpoint else { continue };
            is_still(setpoint, &drive)?;
            let theirs =
                |target: &Target| self.named(groups, target).is_ok_and(|all| all.contains(&shown.name));
            if let Some((_, coming)) =
                coming.iter().find(|(target, coming)| *coming != setpoint && theirs(target))
            {
                return Err(Otherwise::SetpointComing { drive: shown.name.clone(), coming: *coming });
            }
        }
        match names.iter().find(|name| !expects.drives.iter().any(|shown| shown.name == **name)) {
            Some(joined) => Err(Otherwise::Joined(joined.clone())),
            None => Ok(()),
        }
    }

    /// Whom a stop means: who is named, and whoever stands where one was shown that is called otherwise by now. One too many is
    /// better than none.
    pub(super) fn stopped_by(&self, groups: &[Group], target: Target, expects: &Expects) -> Target {
        if target == Target::All {
            return target;
        }
        let mut names = self.named(groups, &target).unwrap_or_default();
        let (named, fleet) = (names.len(), self.fleet());
        for drive in expects.drives.iter().filter_map(|shown| fleet.drive_at(&shown.place)) {
            if !names.iter().any(|name| **name == **drive.name()) {
                names.push(drive.name().to_string());
            }
        }
        if names.len() == named { target } else { Target::Selected(names) }
    }
}

/// Whether a motor is driven as it was shown, as far as its words tell.
fn is_driven_so(shown: Driven, drive: &DriveHandle) -> Result<(), Otherwise> {
    let snapshot = drive.snapshot();
    let now = snapshot.status.as_ref().and_then(|status| Driven::of(&status.value));
    let otherwise = now.filter(|now| *now != shown);
    otherwise.map_or(Ok(()), |now| Err(Otherwise::Driven { drive: drive.name().to_string(), now }))
}

/// Whether a setpoint that was shown is the one of now.
fn is_still(shown: Setpoint, drive: &DriveHandle) -> Result<(), Otherwise> {
    let snapshot = drive.snapshot();
    let reference = || snapshot.status.as_ref().and_then(|status| status.value.reference).map(Setpoint::from);
    let Some(now) = snapshot.setpoint.or_else(reference) else {
        return Err(Otherwise::NoSetpoint(drive.name().to_string()));
    };
    let is_near = match (snapshot.setpoint, shown, now) {
        (None, Setpoint::Frequency(shown), Setpoint::Frequency(now)) => {
            shown.centihertz().abs_diff(now.centihertz()) <= TREMBLES.centihertz()
        }
        _ => false,
    };
    if now == shown || is_near {
        Ok(())
    } else {
        Err(Otherwise::Setpoint { drive: drive.name().to_string(), now })
    }
}
