//! An alarm as programs write it and read it back: [`AlarmView`].

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    Alarms,
    alarm::{Alarm, AlarmState},
};
use crate::concern::Severity;

/// An alarm, with what follows from its kind and from the other alarms.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct AlarmView {
    /// The alarm.
    #[serde(flatten)]
    pub alarm: Alarm,
    /// Where it is in its life.
    pub state: AlarmState,
    /// How badly it troubles.
    pub severity: Severity,
    /// Whether a motor moves that should not, or may: it wakes somebody, and cannot be shelved. Of a cause that is so where it is of
    /// something that follows from it.
    pub of_motion: bool,
    /// It in a sentence.
    pub text: String,
    /// How many alarms are suppressed by it.
    #[serde(default)]
    pub members: usize,
}

impl AlarmView {
    /// An alarm among the others.
    #[must_use]
    pub fn of(alarm: &Alarm, all: &Alarms) -> Self {
        Self {
            state: alarm.state(),
            severity: alarm.kind.severity(),
            of_motion: all.shelving_refused(alarm).is_some(),
            text: alarm.to_string(),
            members: all.members(alarm.id).count(),
            alarm: alarm.clone(),
        }
    }
}

/// It in a line.
impl fmt::Display for AlarmView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.alarm.of(), self.text)?;
        if self.members > 0 {
            write!(f, ", {} follow from it", self.members)?;
        }
        Ok(())
    }
}
