//! Why something happened: [`Cause`], with the [`Act`] of whoever commanded it.

use std::sync::Arc;

/// One act of somebody: who, through which door, and its id. Behind the stops of every drive by one STOP ALL stands one act.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Act {
    /// Who: the name by which the settings say who may command a drive.
    pub commander: Arc<str>,
    /// The door that it came through, such as the name of a page, a broker or a gateway; `None` where nobody said.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub door: Option<Arc<str>>,
    /// Its id, the same for every drive that it is for; `None` where nobody gave it one.
    #[cfg_attr(feature = "serde", serde(rename = "act", skip_serializing_if = "Option::is_none"))]
    pub id: Option<Arc<str>>,
}

impl Act {
    /// An act of somebody.
    #[must_use]
    pub fn of(commander: &str) -> Self {
        Self { commander: Arc::from(commander), door: None, id: None }
    }

    /// The same, through this door.
    #[must_use]
    pub fn through(self, door: &str) -> Self {
        Self { door: Some(Arc::from(door)), ..self }
    }

    /// The same, by this id.
    #[must_use]
    pub fn with_id(self, id: &str) -> Self {
        Self { id: Some(Arc::from(id)), ..self }
    }
}

impl From<&str> for Act {
    fn from(commander: &str) -> Self {
        Self::of(commander)
    }
}

/// What a fleet does by itself, because it was told so once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Policy {
    /// [`OnLoss`](crate::OnLoss): a drive that comes back is stopped.
    OnLoss,
    /// [`OnFault`](crate::OnFault): a trip by the watchdog is reset.
    OnFault,
    /// [`OnControlTaken`](crate::OnControlTaken): the run command is withdrawn when somebody else takes control.
    ControlTaken,
    /// The run command is withdrawn because the motor follows another reference.
    ReferenceTaken,
    /// The run command is withdrawn because something cuts, brakes or holds the output.
    OutputBlocked,
    /// The run command of a drive that has tripped is withdrawn.
    Tripped,
    /// A start that is not confirmed is taken back.
    StartNotConfirmed,
    /// A start whose ticket was dropped before its outcome was heard is taken back.
    StartWithdrawn,
    /// A stop goes on, because the value that confirmed it was withdrawn.
    ValueWithdrawn,
    /// A stop that an earlier run of the program was given, and was ended before it was confirmed, goes on.
    StopOfBefore,
    /// [`OnExit`](crate::OnExit), because the fleet shuts down.
    Exit,
    /// [`OnExit`](crate::OnExit), because the drive leaves the fleet: it was removed, or became another.
    Removal,
    /// The communication watchdog is set up as the contract says.
    Watchdog,
    /// Other settings hold from now on.
    Settings,
}

drive_core::named! { Policy {
    OnLoss => "on loss",
    OnFault => "on fault",
    ControlTaken => "control taken",
    ReferenceTaken => "reference taken",
    OutputBlocked => "output blocked",
    Tripped => "tripped",
    StartNotConfirmed => "start not confirmed",
    StartWithdrawn => "start withdrawn",
    ValueWithdrawn => "value withdrawn",
    StopOfBefore => "stop of before",
    Exit => "exit",
    Removal => "removal",
    Watchdog => "watchdog",
    Settings => "settings",
} }

/// Why something happened, as far as this side knows.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "by", rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Cause {
    /// Somebody commanded it.
    Command(Act),
    /// The fleet did it by itself.
    Policy {
        /// By which of its policies.
        policy: Policy,
    },
    /// Nobody here: the drive, its line, its terminals, its panel or another master.
    Drive,
    /// It was found so when the drive was seen first, or again. When it happened, and why, is not known.
    Found,
}

impl Cause {
    pub(crate) const fn policy(policy: Policy) -> Self {
        Self::Policy { policy }
    }
}

/// A word that a drive showed, and shows otherwise now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ChangedWord {
    /// The word as it is now.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub word: drive_core::RawWord,
    /// As it was; `None` where it was not read before.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub before: Option<u16>,
}
