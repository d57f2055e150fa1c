//! One alarm: [`Alarm`], from its coming to its end.

use std::fmt;

use super::{look::Because, table::AlarmKind};

/// Where an alarm is in its life, in the words of ISA-18.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum AlarmState {
    /// It is so, and nobody has taken note of it.
    Unacknowledged,
    /// It is so, and somebody has taken note of it.
    Acknowledged,
    /// It is so no more, and nobody has taken note of it.
    Returned,
    /// Its drive or line has left the configuration, and nobody has taken note of that.
    Gone,
    /// Somebody has put it aside for a time.
    Shelved,
    /// It follows from another alarm, which stands for it.
    Suppressed,
    /// It is at its end, and kept no more.
    Over,
}

drive_core::named! { AlarmState {
    Unacknowledged => "unacknowledged",
    Acknowledged => "acknowledged",
    Returned => "returned",
    Gone => "gone",
    Shelved => "shelved",
    Suppressed => "suppressed",
    Over => "over",
} }

impl AlarmState {
    /// Whether it waits for somebody to take note of it.
    #[must_use]
    pub const fn waits(self) -> bool {
        matches!(self, Self::Unacknowledged | Self::Returned | Self::Gone)
    }
}

/// Who has taken note of an alarm.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Acknowledged {
    /// Who.
    pub by: String,
    /// When, in milliseconds since 1970.
    pub unix_ms: u64,
    /// What he has noted.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub note: Option<String>,
}

/// Who has put an alarm aside, and until when.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Shelved {
    /// Who.
    pub by: String,
    /// When, in milliseconds since 1970.
    pub unix_ms: u64,
    /// Until when.
    pub until_unix_ms: u64,
    /// Why.
    pub why: String,
}

/// An alarm: one thing that troubles a drive, a line or the program, from its first coming until it has returned and somebody has taken
/// note of it. What comes again meanwhile is the same alarm, counted once more.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Alarm {
    /// Its number, which no other alarm has had or gets.
    pub id: u64,
    /// What.
    pub kind: AlarmKind,
    /// The drive that it is of.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub drive: Option<String>,
    /// The line that it is of, or that its drive is on; without either it is of the program.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub line: Option<String>,
    /// Which of several of its kind it is.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub mark: Option<String>,
    /// What is known of it besides, such as the fault.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub detail: Option<String>,
    /// The codes of the faults that it is of, as far as they are known: one that was not among them is another alarm.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub faults: Vec<u16>,
    /// What to do first.
    pub remedy: String,
    /// Since when it was so at its first coming, in milliseconds since 1970.
    pub first_unix_ms: u64,
    /// The same at its last coming.
    pub last_unix_ms: u64,
    /// How often it has come.
    pub count: u32,
    /// When it was so no more; `None`: it is.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub returned_unix_ms: Option<u64>,
    /// Whether its drive or line is not configured any more.
    #[cfg_attr(feature = "serde", serde(default))]
    pub gone: bool,
    /// Who has taken note of it since it came last.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub acknowledged: Option<Acknowledged>,
    /// Until when it is put aside.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub shelved: Option<Shelved>,
    /// The alarm that it follows from.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub suppressed_by: Option<u64>,
    /// Since when it would have returned, if all that follows from it had.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub(super) ending_unix_ms: Option<u64>,
    /// By what its detail was told.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) because: Option<Because>,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) is_over: bool,
}

impl Alarm {
    /// Where it is in its life.
    #[must_use]
    pub const fn state(&self) -> AlarmState {
        if self.is_over {
            return AlarmState::Over;
        }
        match (self.is_active(), self.acknowledged.is_some()) {
            _ if self.gone => AlarmState::Gone,
            _ if self.suppressed_by.is_some() => AlarmState::Suppressed,
            _ if self.shelved.is_some() => AlarmState::Shelved,
            (true, false) => AlarmState::Unacknowledged,
            (true, true) => AlarmState::Acknowledged,
            (false, _) => AlarmState::Returned,
        }
    }

    /// Whether it is so, whatever somebody has done about it.
    #[must_use]
    pub const fn is_active(&self) -> bool {
        self.returned_unix_ms.is_none() && !self.gone
    }

    /// What it is of, as a person says it.
    #[must_use]
    pub fn of(&self) -> String {
        match (&self.drive, &self.line) {
            (Some(drive), _) => drive.clone(),
            (None, Some(line)) => format!("line {line}"),
            (None, None) => "the program".to_owned(),
        }
    }
}

/// It in a sentence.
impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.words())?;
        self.detail.as_ref().map_or(Ok(()), |detail| write!(f, ": {detail}"))
    }
}

/// What has become of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Became {
    /// It came.
    Came,
    /// It came again before its end.
    CameAgain,
    /// What is known of it is another.
    Explained,
    /// It is so no more; nobody has taken note of it.
    Returned,
    /// Somebody has taken note of it.
    Acknowledged,
    /// Somebody has put it aside.
    Shelved,
    /// It is put aside no more.
    Unshelved,
    /// Another alarm stands for it.
    Suppressed,
    /// No other alarm stands for it any more.
    Released,
    /// Its drive or line has left the configuration.
    Gone,
    /// It is at its end.
    Over,
    /// It is kept no more, though nobody has taken note of it: there are too many.
    Dropped,
}

drive_core::named! { Became {
    Came => "came",
    CameAgain => "came again",
    Explained => "explained",
    Returned => "returned",
    Acknowledged => "acknowledged",
    Shelved => "shelved",
    Unshelved => "unshelved",
    Suppressed => "suppressed",
    Released => "released",
    Gone => "gone",
    Over => "over",
    Dropped => "dropped",
} }

/// A change of an alarm, with the alarm as it is since.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct AlarmChange {
    /// What has become of it.
    pub became: Became,
    /// The alarm.
    pub alarm: Alarm,
}
