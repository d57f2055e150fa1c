//! What could not be written, until it can be.

use serde_json::{Value, json};

use super::{Kind, Record};

/// Stops of a gap that are told one by one; more are counted.
const STOPS: usize = 64;

/// What is missing in the log.
#[derive(Debug, Default)]
pub(super) struct Gap {
    since: u64,
    records: u64,
    stops: Vec<Value>,
    stops_more: u64,
}

impl Gap {
    pub(super) const fn is_empty(&self) -> bool {
        self.records == 0
    }

    /// Keeps what is missing. Gives whether it is a stop that is kept by itself.
    pub(super) fn add(&mut self, record: &Record, time_unix_ms: u64) -> bool {
        if self.is_empty() {
            self.since = time_unix_ms;
        }
        self.records = self.records.saturating_add(1);
        if record.kind != Kind::Command || !is_stop(&record.what) {
            return false;
        }
        if self.stops.len() >= STOPS {
            self.stops_more = self.stops_more.saturating_add(1);
            return false;
        }
        let Record { caller, origin, what, id, .. } = record;
        self.stops.push(json!({
            "time_unix_ms": time_unix_ms, "caller": caller, "origin": origin, "what": what, "id": id,
        }));
        true
    }

    /// The record of what is missing now, if anything is, and how much it is.
    pub(super) fn record(&self, now_unix_ms: u64) -> Option<(Record, u64)> {
        if self.is_empty() {
            return None;
        }
        let records = self.records;
        let what = format!("{records} records could not be written, with {} stops", self.stops.len());
        let body = json!({
            "since_unix_ms": self.since,
            "until_unix_ms": now_unix_ms,
            "stops": self.stops,
            "stops_more": self.stops_more,
        });
        let record = Record { body: Some(body), ..Record::of_program(Kind::Gap, what) };
        Some((record, records))
    }

    /// So many of it stand in the log now.
    pub(super) fn forget(&mut self, records: u64) {
        self.records = self.records.saturating_sub(records);
        if self.is_empty() {
            *self = Self::default();
        }
    }
}

/// Whether a command is a stop, by the words in which each face puts it.
fn is_stop(what: &str) -> bool {
    what.split(|character: char| !character.is_ascii_alphabetic())
        .any(|word| word.eq_ignore_ascii_case("stop"))
}
