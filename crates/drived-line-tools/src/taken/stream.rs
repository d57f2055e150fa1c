//! Bytes of a line without their times: cut into frames by length and check alone.

use std::time::Duration;

use drive_bus::{
    LineConfig,
    capture::{Captured, Dissector},
    listen::{Ear, Role},
};
use drive_core::SerialSettings;

use super::Taken;

/// When the first piece comes: so long after nothing that it begins a conversation.
const BEGIN: Duration = Duration::from_secs(60);

/// Between two pieces: too short for whoever answers to have given up.
const BETWEEN: Duration = Duration::from_millis(1);

/// Frames of bytes that stand behind one another.
pub(super) fn read(bytes: &[u8]) -> Taken {
    let mut heard = Heard::of(&[bytes.to_vec()], false);
    if heard.good == 0 {
        // Anything may be in a file: without one frame whose check fits it is none of a line.
        heard.frames.clear();
        return taken(heard, Vec::new());
    }
    taken(heard, vec!["the times were not taken down: silences cannot be judged".to_owned()])
}

/// What is heard, without any times.
pub(super) fn taken(heard: Heard, notes: Vec<String>) -> Taken {
    Taken { dissector: Dissector::Rtu, late: None, has_times: false, frames: heard.frames, notes }
}

/// What a listener makes of pieces of Modbus RTU.
#[derive(Debug, Default)]
pub(super) struct Heard {
    pub(super) frames: Vec<Captured>,
    /// Bytes that belong to frames whose check fits.
    pub(super) good: usize,
}

impl Heard {
    /// The frames of these pieces. Where each stands for itself, none goes on in the next one.
    pub(super) fn of(pieces: &[Vec<u8>], each_alone: bool) -> Self {
        let mut all = Self::default();
        let Some(mut ear) = Ear::new(&LineConfig::stream(SerialSettings::MODBUS_DEFAULT), Duration::ZERO)
        else {
            return all;
        };
        let mut now = BEGIN;
        for piece in pieces {
            for part in piece.chunks(PIECE) {
                ear.hear(now, part);
                all.take(&mut ear);
            }
            if each_alone {
                ear.handle_timeout();
                all.take(&mut ear);
            }
            now += BETWEEN;
        }
        ear.handle_timeout();
        all.take(&mut ear);
        all
    }

    fn take(&mut self, ear: &mut Ear) {
        for heard in ear {
            if heard.role != Role::Damaged {
                self.good += heard.bytes.len();
            }
            self.frames.push(Captured { at: Duration::ZERO, ..heard.captured() });
        }
    }
}

/// Who sent which of these whole frames, by their forms and the order in which they came.
#[cfg(feature = "captures")]
pub(super) fn directions(frames: &mut [Captured]) {
    let Some(mut ear) = Ear::new(&LineConfig::stream(SerialSettings::MODBUS_DEFAULT), Duration::ZERO) else {
        return;
    };
    for frame in frames {
        ear.hear(frame.at.max(BEGIN), &frame.bytes);
        let first = ear.next();
        ear.handle_timeout();
        if let (Some(heard), None) = (first.or_else(|| ear.next()), ear.next()) {
            frame.direction = heard.captured().direction;
        }
    }
}

/// So many bytes are heard at once.
const PIECE: usize = 256;
