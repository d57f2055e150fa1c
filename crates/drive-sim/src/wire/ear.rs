//! The ends of a wire: the slaves that listen alike, and the master's port.

use std::time::Duration;

use drive_core::{SerialSettings, serial::Parity};
use tokio::time::Instant;

use super::{Pacing, UNPACED_TIMEOUT, misheard::Character};
use crate::{
    framing::{self, Framing},
    model::Dialect,
};

/// The slaves of one dialect, as one receiver.
pub(super) struct Ear {
    pub(super) dialect: Dialect,
    pub(super) framing: Box<dyn Framing>,
    /// When the last character that it heard ended.
    pub(super) last: Option<Instant>,
    /// When the frame that is being received began, where silences count.
    pub(super) began: Option<Instant>,
    /// Characters of the frame that is being received, for the ideal time of its exchange.
    pub(super) characters: usize,
}

impl Ear {
    pub(super) fn new(dialect: Dialect) -> Self {
        Self { dialect, framing: framing::of(dialect.protocol), last: None, began: None, characters: 0 }
    }

    pub(super) const fn t3_5(&self, pacing: Pacing) -> Duration {
        match pacing {
            Pacing::None => Duration::ZERO,
            Pacing::Simulated | Pacing::Hardware => self.dialect.settings.t3_5(),
        }
    }

    /// The silence after which a frame that has begun is over.
    pub(super) fn frame_timeout(&self, pacing: Pacing) -> Duration {
        if pacing == Pacing::None { UNPACED_TIMEOUT } else { self.framing.frame_timeout(self.t3_5(pacing)) }
    }

    /// When a frame that is being received would be over by silence.
    pub(super) fn silence_due(&self, pacing: Pacing) -> Option<Instant> {
        let last = self.last.filter(|_| !self.framing.is_between_frames())?;
        Some(last + self.frame_timeout(pacing))
    }
}

/// How the master has set its port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Master {
    pub(crate) settings: SerialSettings,
    pub(crate) errors: Errors,
}

impl Master {
    /// A port of Linux as a serial port library sets it: parity is looked at where the format has one.
    pub(crate) fn of(settings: SerialSettings) -> Self {
        let checks = settings.format().parity() != Parity::None;
        Self { settings, errors: if checks { Errors::Zero } else { Errors::Pass } }
    }
}

/// What a program reads in place of a character of which parity or stop bit is wrong, as the terminal's flags say (termios(3)).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Errors {
    /// `INPCK` is off: the character itself.
    Pass,
    /// `INPCK` alone: a zero.
    Zero,
    /// `INPCK` and `IGNPAR`: nothing.
    #[cfg_attr(not(unix), expect(dead_code, reason = "a terminal alone is set so"))]
    Drop,
}

impl Errors {
    /// What of these characters is read.
    pub(super) fn read(self, characters: &[Character]) -> Vec<u8> {
        let read = |character: &Character| match self {
            _ if character.intact => Some(character.byte),
            Self::Pass => Some(character.byte),
            Self::Zero => Some(0),
            Self::Drop => None,
        };
        characters.iter().filter_map(read).collect()
    }
}
