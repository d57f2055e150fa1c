//! What became of a stop: [`Stopped`].

use std::{fmt, time::Duration};

use crate::{error::Error, motion::Shaft, setpoint::StopMode, state::Control, status::Status};

/// The end that a [drive tells](crate::Drive::follow_stops): what was heard of it last, once there is anything.
pub type Follower = tokio::sync::watch::Sender<Option<Followed>>;

/// What a stop that does not show yet has heard of its drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Followed {
    /// The status that was read behind it.
    pub status: Status,
    /// The exception by which the drive has answered the last word that was written for it; `None` where it took that, or said nothing.
    pub denied: Option<Error>,
}

/// A stop that the drive shows: no run command is in force any more. The motor may still be coming down.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Stopped {
    /// The status in which it shows.
    pub status: Status,
    /// How the motor is stopped: the mode that was asked for, or the one that took its place.
    pub mode: StopMode,
    /// Why another mode took the place of the one that was asked for, such as a setting that keeps it from acting; `None`
    /// where the mode is the one that was asked for.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub instead: Option<&'static str>,
    /// Who commanded the drive until this stop took the command from him; it is kept until it is released. `None` where
    /// nothing was taken.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub taken_from: Option<Control>,
    /// How long direct current is to be held until the motor stands, where it is injected; then a stop by ramp ends it. See
    /// [`Drive::set_injection_time`](crate::Drive::set_injection_time).
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "injection_ms",
            skip_serializing_if = "Option::is_none",
            serialize_with = "crate::serialize::milliseconds"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
    pub injects_for: Option<Duration>,
}

impl Stopped {
    /// A stop in the mode that was asked for.
    #[must_use]
    pub const fn by(mode: StopMode, status: Status) -> Self {
        Self { status, mode, instead: None, taken_from: None, injects_for: None }
    }

    /// The same, with how long direct current is to be held where that is the mode.
    #[must_use]
    pub fn held_by(self, shaft: &Shaft) -> Self {
        let injects = self.mode == StopMode::DcInjection;
        Self { injects_for: injects.then(|| shaft.injection_time()), ..self }
    }
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} stop", self.mode)?;
        if let Some(why) = self.instead {
            write!(f, " ({why})")?;
        }
        if let Some(other) = self.taken_from {
            write!(f, ", command taken from: {other}")?;
        }
        write!(f, ": {}", self.status)
    }
}
