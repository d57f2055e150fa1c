//! What it takes until the stop of every drive is in the queue of its line, as each line logs it.

use std::{
    fmt::{Debug, Write as _},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use tracing::{
    Event, Id, Level, Metadata, Subscriber,
    field::{Field, Visit},
    span::{Attributes, Record},
};

use crate::usage::processor_time;

const IS_THERE: &str = "a stop is in the queue of its line";

/// Hears what the lines log on this thread.
#[derive(Clone, Default)]
pub(crate) struct Queued(Arc<Inner>);

#[derive(Default)]
struct Inner {
    /// How many stops are still to come.
    missing: AtomicUsize,
    /// The processor time of this program when the last was there.
    last: Mutex<Option<Duration>>,
}

impl Queued {
    /// So many are to come from now on.
    pub(crate) fn expect(&self, stops: usize) {
        self.0.missing.store(stops, Ordering::Relaxed);
    }

    /// The processor time of this program when the last was there, if it was.
    pub(crate) fn last(&self) -> Option<Duration> {
        *self.0.last.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct Said(bool);

impl Visit for Said {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            let mut text = String::new();
            let _ = write!(text, "{value:?}");
            self.0 = text == IS_THERE;
        }
    }
}

impl Subscriber for Queued {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::DEBUG && metadata.target().starts_with("drive_bus")
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        if self.0.missing.load(Ordering::Relaxed) == 0 {
            return;
        }
        let mut said = Said(false);
        event.record(&mut said);
        if said.0 && self.0.missing.fetch_sub(1, Ordering::Relaxed) == 1 {
            *self.0.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(processor_time());
        }
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}
