//! What the file holds of a drive around a moment.

mod fall;
mod found;
mod known;
mod words;

use std::collections::BTreeSet;

use drived_plant::plant::past::{LineMinuteView, RecordView};
use rusqlite::Connection;

use self::known::{gaps, heard};
pub(super) use self::{
    fall::Fall,
    found::{begins, is_silent},
    known::{known_spans, lasting},
};
use super::body::body;
use crate::{
    curve::Piece,
    quantity::Quantity,
    read::{Filter, Found, bounds, line_minutes, pieces, records},
    store::StoreError,
};

/// So long before a moment it is looked,
const BEFORE_MS: i64 = 10 * 60_000;
/// and so long after.
pub const AFTER_MS: i64 = 10 * 60_000;
/// So many records at the most: a plant that tells more in twenty minutes is told of in part, and it is said.
const RECORDS: usize = 20_000;

/// What is known around a moment.
pub(super) struct Facts {
    pub(super) drive: String,
    pub(super) line: Option<String>,
    pub(super) from: i64,
    pub(super) to: i64,
    /// Of the whole plant, in the daemon's order.
    pub(super) records: Vec<RecordView>,
    pub(super) is_cut: bool,
    /// How much of the time something is known of the drive, from 0 to 1.
    pub(super) known: f64,
    /// When it was heard, by its values.
    spans: Vec<(i64, i64)>,
    /// Times in which nothing is known, longer than a few polls.
    pub(super) gaps: Vec<(i64, i64)>,
    /// What its inputs showed, from each of these moments on,
    pub(super) inputs: Vec<(i64, i64)>,
    /// and when anything is known of them.
    pub(super) inputs_known: Vec<(i64, i64)>,
    /// Its output, from each of these moments on.
    outputs: Vec<(i64, Option<i64>)>,
    /// By what it was commanded, from each of these moments on.
    pub(super) controls: Vec<(i64, String)>,
    /// When other drives of its line were heard.
    pub(super) heard: Vec<(String, Vec<(i64, i64)>)>,
    /// What its line counted, minute by minute.
    pub(super) minutes: Vec<LineMinuteView>,
    /// That the clock was set forward over the moment, so that there was no such time.
    pub(super) skipped: Option<RecordView>,
    /// That the clock was set shortly before the moment, or with it, as it stood then.
    pub(super) stepped: Option<RecordView>,
}

/// What a drive shows when it is seen again is told of it within this time.
pub(super) const SEEN_AGAIN_MS: i64 = 3_000;
/// Events that tell what was read of a drive at their moment. Behind a kill they are there, and the values of the last minute are not.
const SHOWN: [&str; 11] = [
    "connected",
    "identified",
    "state_changed",
    "tripped",
    "fault_changed",
    "fault_cleared",
    "control_taken",
    "control_returned",
    "output_blocked",
    "reference_taken",
    "command_overridden",
];
/// A clock that was set forward by more than this skipped no time that somebody would ask for.
const SKIPPED_MS: i64 = 24 * 60 * 60_000;
/// So shortly before or behind a moment a clock that was set is told with it.
const STEPPED_MS: i64 = 5_000;
/// So many other drives of a line are looked at, whether they were heard.
const NEIGHBOURS: usize = 64;
/// What became of a command is told with when it was, where that was later than this: it is recorded with when it was asked for.
const LATER_MS: i64 = 1_500;

impl Facts {
    pub(super) fn gather(connection: &Connection, drive: &str, at: i64) -> Result<Self, StoreError> {
        let (first, last) = bounds(connection)?;
        let (first, last) = (first.unwrap_or(i64::MAX / 2), last.unwrap_or(i64::MIN / 2));
        // Where a clock was set, the last may lie before the first: nothing is known of such a time.
        let from = (at - BEFORE_MS).max(first);
        let to = (at + AFTER_MS).min(last).max(from);
        let filter = Filter { from_ms: from, to_ms: to, limit: RECORDS, ..Filter::default() };
        let Found { mut records, is_cut } = records(connection, &filter)?;
        records.iter_mut().filter(|found| found.kind == "command").for_each(tell_when);
        let skipped = step(connection, at, |from, to| (from..to).contains(&at))?;
        let stepped = step(connection, at, |from, _| (from - at).abs() <= STEPPED_MS)?;
        let of_drive = |found: &&RecordView| found.drive.as_deref() == Some(drive);
        let line = records.iter().filter(of_drive).find_map(|found| found.line.clone());
        let spans = heard(connection, drive, from, to)?;
        let known: i64 = spans.iter().map(|(start, end)| end - start).sum();
        let shown = records.iter().filter(of_drive).filter(|found| SHOWN.contains(&&*found.what));
        let gaps = gaps(&spans, shown.map(|found| found.time_unix_ms), from, to);
        let known = known as f64 / (to - from).max(1) as f64;
        let read = pieces(connection, drive, Quantity::INPUTS, from, to)?;
        let points = read.iter().flat_map(|piece| &piece.points);
        let inputs = points.filter_map(|point| Some((point.at, point.count?))).collect();
        let inputs_known = read.into_iter().flat_map(|piece| known_spans(&piece.closed())).collect();
        let outputs = pieces(connection, drive, Quantity::OUTPUT_FREQUENCY, from, to)?
            .into_iter()
            .flat_map(Piece::closed)
            .map(|point| (point.at, point.count))
            .collect();
        let minutes = line_minutes(connection, from, to, RECORDS)?
            .into_iter()
            .filter(|minute| Some(&minute.line) == line.as_ref())
            .collect();
        let controls = pieces(connection, drive, Quantity::CONTROL, from, to)?
            .into_iter()
            .flat_map(|piece| piece.points)
            .filter_map(|point| Some((point.at, Quantity::CONTROL.text(point.count?))))
            .collect();
        let drive = drive.to_owned();
        let mut facts = Self {
            drive,
            line,
            from,
            to,
            records,
            is_cut,
            known,
            spans,
            gaps,
            inputs,
            inputs_known,
            outputs,
            controls,
            heard: Vec::new(),
            minutes,
            skipped,
            stepped,
        };
        let neighbours: Vec<String> =
            facts.neighbours().into_iter().take(NEIGHBOURS).map(str::to_owned).collect();
        for name in neighbours {
            let spans = heard(connection, &name, from, to)?;
            facts.heard.push((name, spans));
        }
        Ok(facts)
    }

    /// The other drives of its line.
    pub(super) fn neighbours(&self) -> BTreeSet<&str> {
        let is_near = |found: &&RecordView| self.line.is_some() && found.line == self.line;
        let names = self.records.iter().filter(is_near).filter_map(|found| found.drive.as_deref());
        names.filter(|name| *name != self.drive).collect()
    }
}

/// The step of the clock within a day of a moment that is the one that is meant, by from where to where it was set.
fn step(
    connection: &Connection,
    at: i64,
    is_one: impl Fn(i64, i64) -> bool,
) -> Result<Option<RecordView>, StoreError> {
    let steps = Filter {
        what: Some("clock_stepped"),
        from_ms: at.saturating_sub(SKIPPED_MS),
        to_ms: at.saturating_add(SKIPPED_MS),
        limit: RECORDS,
        ..Filter::default()
    };
    let mut steps = records(connection, &steps)?.records.into_iter();
    Ok(steps.find(|step| {
        let step = body(step);
        step.from_unix_ms.zip(step.to_unix_ms).is_some_and(|(from, to)| is_one(from, to))
    }))
}

/// A command that was confirmed long after it was asked for was not confirmed then.
fn tell_when(found: &mut RecordView) {
    let took = body(found).took_ms.filter(|took| *took >= LATER_MS);
    if let Some((took, (asked, told))) = took.zip(found.text.split_once(": confirmed")) {
        found.text = format!("{asked}: confirmed {} later{told}", lasting(took));
    }
}
