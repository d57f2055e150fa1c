//! Tests of the halves together, on files.

mod asked;
mod captures;
mod clock;
mod faults;
mod untold;
mod week;

use std::sync::Arc;

use crate::{
    quantity::{Quantity, Set},
    record::{Kind, Moment, Record},
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Shown},
    },
};

/// 2026-11-21 00:00 UTC.
const BEGIN_MS: i64 = 1_795_219_200_000;

fn moment(steady_ms: i64) -> Moment {
    Moment { steady_ms, wall_ms: BEGIN_MS + steady_ms }
}

fn event(at: Moment, drive: &str, what: &str) -> Record {
    Record {
        kind: Kind::Event,
        drive: Some(drive.to_owned()),
        ..Record::of_history(at, what, format!("{what} at {}", at.steady_ms))
    }
}

/// A drive that is read into an archive.
struct Pump {
    name: Arc<str>,
    tracker: Tracker,
}

impl Pump {
    fn of(name: &str) -> Self {
        Self { name: name.into(), tracker: Tracker::default() }
    }

    fn read(&mut self, archive: &mut Archive, at: Moment, values: &[(Quantity, i64)]) {
        let Some(seen) = self.tracker.see(at.steady_ms, 3_000, values) else { return };
        let shown = Shown { drive: Arc::clone(&self.name), set: Set::Status, seen };
        archive.take(Batch { shown: vec![shown], ..Batch::default() }, at);
    }
}
