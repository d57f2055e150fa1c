//! What is kept in words: [`Record`], one for each thing that happened, [`LineMinute`] and [`LineFrames`].

use std::sync::Arc;

use drive_bus::capture::{Captured, Dissector};
use drived_plant::plant::past::ParameterRead;

/// When something happened, by both clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// By the daemon's own clock, in milliseconds since it began: it is never set.
    pub steady_ms: i64,
    /// By the wall's clock as that stood then, in milliseconds since 1970.
    pub wall_ms: i64,
}

/// What sort of thing it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something that happened to a drive.
    Event,
    /// A command, with what became of it.
    Command,
    /// What became of an alarm.
    Alarm,
    /// Something that happened to the program.
    Notice,
    /// The black box tells of itself: its beginnings and ends, and what it does not know.
    History,
}

impl Kind {
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Event => "event",
            Self::Command => "command",
            Self::Alarm => "alarm",
            Self::Notice => "notice",
            Self::History => "history",
        }
    }
}

/// One thing that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    pub at: Moment,
    pub kind: Kind,
    /// In one word, as the API names it: the event, the action, the state of the alarm.
    pub what: String,
    pub drive: Option<String>,
    pub line: Option<String>,
    /// Whether somebody had to see to it.
    pub is_alarm: bool,
    /// In a sentence.
    pub text: String,
    /// As the API told it.
    pub body: Option<String>,
    /// Of what is told again as it becomes known, such as a command: by which it is the same.
    pub act: Option<String>,
    /// Of what has a freeze-frame: what its line had said until then, as JSON.
    pub exchanges: Option<String>,
}

impl Record {
    /// What the black box tells of itself.
    #[must_use]
    pub fn of_history(at: Moment, what: &str, text: impl Into<String>) -> Self {
        Self {
            at,
            kind: Kind::History,
            what: what.to_owned(),
            drive: None,
            line: None,
            is_alarm: false,
            text: text.into(),
            body: None,
            act: None,
            exchanges: None,
        }
    }
}

/// What was counted of a line within a minute.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineMinute {
    /// When it ended, by the wall's clock.
    pub wall_ms: i64,
    pub line: Arc<str>,
    pub sent: u64,
    pub answered: u64,
    pub damaged: u64,
    pub missing: u64,
    /// Whole frames of somebody else.
    pub foreign: u64,
    /// Silences that were kept before requests, and their mean.
    pub silences: u64,
    pub silence_us: Option<u64>,
    /// Thousandths of the minute in which it was needed.
    pub busy_permille: u64,
    pub is_open: bool,
}

/// What a capture has heard of a line around something that has a freeze-frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineFrames {
    pub line: Arc<str>,
    /// What the line speaks.
    pub dissector: Dissector,
    /// When the first and the last of them were heard, by the daemon's own clock.
    pub first_ms: i64,
    pub last_ms: i64,
    pub frames: Vec<Captured>,
    /// So many others there were between them, for which there was no room.
    pub left_out: u64,
    /// Whether there were others before them, for which there was no room.
    pub is_cut: bool,
}

/// A setting of a drive that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// When, by the wall's clock.
    pub wall_ms: i64,
    pub read: ParameterRead,
}
