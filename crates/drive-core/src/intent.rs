//! What a write by another master asks of a drive.

use crate::{
    error::{Error, Result},
    setpoint::{Direction, Setpoint, StopMode},
};

/// What a word in one of a drive's command registers asks, as its manual has it: for whoever stands between a drive and
/// another master, and carries out what that one asks by the drive's own methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Intent {
    /// Run in a direction.
    Start(Direction),
    /// No run: a motor that runs stops so.
    Stop(StopMode),
    /// A quick stop of the state chart: no run, and none is taken behind it before the voltage was disabled, by a
    /// [`Stop`](Self::Stop) that is a freewheel.
    QuickStop,
    /// A step on the way to a run command, which moves nothing; a motor that runs stops so.
    Prepare(StopMode),
    /// Reset the present fault; where there is none, a motor that runs stops so.
    ResetFaults(StopMode),
    /// Hold a setpoint.
    Setpoint(Setpoint),
}

impl Intent {
    /// How it stops a motor that runs, if it does.
    #[must_use]
    pub const fn stops(self) -> Option<StopMode> {
        match self {
            Self::Stop(mode) | Self::Prepare(mode) | Self::ResetFaults(mode) => Some(mode),
            Self::QuickStop => Some(StopMode::Fast),
            Self::Start(_) | Self::Setpoint(_) => None,
        }
    }

    /// This intent, or that its word is none that the family understands.
    ///
    /// # Errors
    /// [`Error::Unsupported`] without one.
    pub fn understood(intent: Option<Self>) -> Result<Option<Self>> {
        intent.map(Some).ok_or(Error::Unsupported {
            what: "this word by another master",
            reason: "bits are set whose effect on the motor the manual leaves to settings, or does not tell",
        })
    }

    /// That a register moves the motor, or writes its memory, in ways that no method stands for.
    ///
    /// # Errors
    /// [`Error::Unsupported`], always.
    pub const fn kept() -> Result<Option<Self>> {
        Err(Error::Unsupported {
            what: "this register for another master",
            reason: "it acts on the motor or on the drive's memory behind the rules of motion",
        })
    }
}
