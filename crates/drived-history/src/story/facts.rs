//! What the file holds of a drive around a moment.

use std::collections::BTreeSet;

use drived_plant::plant::past::RecordView;
use rusqlite::Connection;

use super::body::{Body, Cause, OfOne, OfSeveral, body};
use crate::{
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
    /// Times in which nothing is known, longer than a few polls.
    pub(super) gaps: Vec<(i64, i64)>,
    /// What its inputs showed, from each of these moments on,
    pub(super) inputs: Vec<(i64, i64)>,
    /// and when anything is known of them.
    pub(super) inputs_known: Vec<(i64, i64)>,
    /// By what it was commanded, from each of these moments on.
    pub(super) controls: Vec<(i64, String)>,
    /// When other drives of its line were heard.
    pub(super) heard: Vec<(String, Vec<(i64, i64)>)>,
    /// How many frames of somebody else its line heard, minute by minute: when the minute ended, and how many.
    pub(super) foreigners: Vec<(i64, i64)>,
    /// That the clock was set forward over the moment, so that there was no such time.
    pub(super) skipped: Option<RecordView>,
}

/// So long before a stream that was begun anew something may be missing.
const TOLD_AGAIN_MS: i64 = 60_000;
/// A gap that is told: shorter ones are lost polls.
const GAP_MS: i64 = 5_000;
/// What a drive shows when it is seen again is told of it within this time.
const SEEN_AGAIN_MS: i64 = 3_000;
/// Events that tell what was read of a drive at their moment. Behind a kill they are there, and the values of the last minute are not.
const SHOWN: [&str; 10] = [
    "connected",
    "identified",
    "state_changed",
    "tripped",
    "fault_cleared",
    "control_taken",
    "control_returned",
    "output_blocked",
    "reference_taken",
    "command_overridden",
];
/// A clock that was set forward by more than this skipped no time that somebody would ask for.
const SKIPPED_MS: i64 = 24 * 60 * 60_000;
/// So many other drives of a line are looked at, whether they were heard.
const NEIGHBOURS: usize = 64;

impl Facts {
    pub(super) fn gather(connection: &Connection, drive: &str, at: i64) -> Result<Self, StoreError> {
        let (first, last) = bounds(connection)?;
        let (first, last) = (first.unwrap_or(i64::MAX / 2), last.unwrap_or(i64::MIN / 2));
        let (from, to) = ((at - BEFORE_MS).max(first), (at + AFTER_MS).min(last));
        let filter = Filter { from_ms: from, to_ms: to, limit: RECORDS, ..Filter::default() };
        let Found { records, is_cut } = records(connection, &filter)?;
        let steps = Filter { what: Some("clock_stepped"), ..Filter::default() };
        let steps = Filter { from_ms: at, to_ms: at.saturating_add(SKIPPED_MS), limit: RECORDS, ..steps };
        let mut steps = self::records(connection, &steps)?.records.into_iter();
        let skipped = steps.find(|step| {
            let (from, to) = (body(step).from_unix_ms, body(step).to_unix_ms);
            from.zip(to).is_some_and(|(from, to)| (from..to).contains(&at))
        });
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
        let foreigners = line_minutes(connection, from, to, RECORDS)?
            .into_iter()
            .filter(|minute| Some(&minute.line) == line.as_ref() && minute.foreign > 0)
            .map(|minute| (minute.time_unix_ms, minute.foreign))
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
            gaps,
            inputs,
            inputs_known,
            controls,
            heard: Vec::new(),
            foreigners,
            skipped,
        };
        let neighbours: Vec<String> =
            facts.neighbours().into_iter().take(NEIGHBOURS).map(str::to_owned).collect();
        for name in neighbours {
            let spans = heard(connection, &name, from, to)?;
            facts.heard.push((name, spans));
        }
        Ok(facts)
    }

    /// The time around a moment in which nothing is known of the drive.
    pub(super) fn gap_at(&self, at: i64) -> Option<(i64, i64)> {
        self.gaps.iter().copied().find(|(start, end)| (*start..=*end).contains(&at))
    }

    /// The last time in which nothing was known of the drive, of those that ended no longer than a moment before it was seen again.
    pub(super) fn gap_before(&self, at: i64) -> Option<(i64, i64)> {
        self.gaps.iter().rev().copied().find(|(start, end)| *start < at && at <= *end + SEEN_AGAIN_MS)
    }

    /// Drives of its line that were heard all the time between two moments.
    pub(super) fn heard_between(&self, from: i64, to: i64) -> Vec<&str> {
        let is_heard = |spans: &[(i64, i64)]| spans.iter().any(|(start, end)| *start <= from && to <= *end);
        self.heard.iter().filter(|(_, spans)| is_heard(spans)).map(|(name, _)| &**name).collect()
    }

    /// By what it was commanded at a moment, in the drive's own words.
    pub(super) fn control_at(&self, at: i64) -> Option<&str> {
        self.controls.iter().rev().find(|(since, _)| *since <= at).map(|(_, control)| &**control)
    }

    /// Why something may have been asked for or have happened between two moments that is not among the records; `None`: nothing is missing.
    pub(super) fn missing(&self, from: i64, to: i64) -> Option<String> {
        if self.is_cut {
            return Some("more is recorded than was looked at".to_owned());
        }
        let (mut ended, mut last) = (None, None);
        for found in self.records.iter().filter(|found| found.kind == "history") {
            let (at, body) = (found.time_unix_ms, body(found));
            let (since, why) = match &*found.what {
                "ended" => {
                    ended = Some(at);
                    continue;
                }
                "began_after_kill" => {
                    (body.last_known_unix_ms.unwrap_or(i64::MIN), "this program had been killed")
                }
                "began" => (ended.unwrap_or(i64::MIN), "this program did not run"),
                "hole" if body.records != Some(0) => {
                    (body.since_unix_ms.unwrap_or(i64::MIN), "records could not be kept")
                }
                "damaged" => (i64::MIN, "what was kept before was damaged"),
                "stood_still" => (body.since_unix_ms.unwrap_or(at), "this program stood still"),
                "stream_anew" => (at - TOLD_AGAIN_MS, "what was told may have been missed"),
                _ => continue,
            };
            if since <= to && at >= from {
                last = Some(why);
            }
        }
        match ended {
            Some(ended) if ended <= to && !self.began_after(ended) => {
                Some("this program had ended".to_owned())
            }
            _ => last.map(str::to_owned),
        }
    }

    fn began_after(&self, ended: i64) -> bool {
        let is_beginning = |found: &&RecordView| matches!(&*found.what, "began" | "began_after_kill");
        self.records.iter().filter(is_beginning).any(|found| found.time_unix_ms >= ended)
    }

    /// Whether a record is of this drive: what happened to it, or a command that was for it too.
    pub(super) fn is_of_drive(&self, found: &RecordView) -> bool {
        found.drive.as_deref() == Some(&*self.drive) || self.of_several(found).is_some()
    }

    /// What became of a command for several at this drive.
    pub(super) fn of_several(&self, found: &RecordView) -> Option<OfOne> {
        if found.kind != "command" || found.drive.is_some() {
            return None;
        }
        let several: OfSeveral = serde_json::from_str(found.body.as_ref()?.get()).ok()?;
        several.drives.into_iter().find(|one| one.drive.as_deref() == Some(&*self.drive))
    }

    /// What the drive said of a trip, where that was read.
    pub(super) fn explained(&self, trip: &RecordView) -> Option<&RecordView> {
        let of_same = |found: &&RecordView| found.number > trip.number && found.drive == trip.drive;
        // What is explained behind the next trip is that one.
        let mut own = self.records.iter().filter(of_same).take_while(|found| found.what != "tripped");
        own.find(|found| found.what == "trip_explained").filter(|_| trip.what == "tripped")
    }

    /// Whose doing an event was. What followed an act of the program it once told as the doing of that, and such records are kept: a policy that
    /// can do nothing of the kind, or that acted long before, did not do it.
    pub(super) fn cause_of(&self, found: &RecordView) -> Option<Cause> {
        let Body { cause, from, .. } = body(found);
        let Some(Cause::Policy { policy }) = &cause else { return cause };
        let acted = || {
            self.records.iter().rev().any(|act| {
                act.what == "command"
                    && act.drive == found.drive
                    && (found.time_unix_ms - SEEN_AGAIN_MS..=found.time_unix_ms).contains(&act.time_unix_ms)
                    && matches!(body(act).cause, Some(Cause::Policy { policy: other }) if other == *policy)
            })
        };
        let ends_run = matches!(from.as_deref(), Some("running" | "stopping" | "quick_stop"));
        let can = match &*found.what {
            "fault_cleared" => policy == "on_fault",
            // Where the output was cut there was no run to be ended.
            "state_changed" if policy == "output_blocked" => false,
            "state_changed" => ends_run || acted(),
            _ => true,
        };
        if can { cause } else { Some(Cause::Drive) }
    }

    /// The drive's own record of its faults, where it was read behind a trip.
    pub(super) fn own_record(&self, trip: &RecordView) -> Option<&RecordView> {
        let later = self.records.iter().filter(|found| found.number > trip.number && self.is_of_drive(found));
        later.take_while(|found| found.what != "tripped").find(|found| found.what == "fault_record")
    }

    /// An event in words, a trip with what the drive said of it.
    pub(super) fn in_words(&self, found: &RecordView) -> String {
        let explained =
            self.explained(found).map(|explained| explained.text.replacen("trip explained", "tripped", 1));
        explained.unwrap_or_else(|| found.text.clone())
    }

    /// The other drives of its line.
    pub(super) fn neighbours(&self) -> BTreeSet<&str> {
        let is_near = |found: &&RecordView| self.line.is_some() && found.line == self.line;
        let names = self.records.iter().filter(is_near).filter_map(|found| found.drive.as_deref());
        names.filter(|name| *name != self.drive).collect()
    }

    /// Events of this name at other drives, not farther from a moment than this.
    pub(super) fn elsewhere(&self, what: &str, at: i64, within: i64) -> Vec<&RecordView> {
        let is_one = |found: &&RecordView| {
            found.kind == "event"
                && found.what == what
                && found.drive.as_deref().is_some_and(|drive| drive != self.drive)
                && (found.time_unix_ms - at).abs() <= within
        };
        self.records.iter().filter(is_one).collect()
    }
}

/// The times between two moments in which nothing was read of a drive, as far as they are told: neither a value nor what an event tells.
fn gaps(spans: &[(i64, i64)], shown: impl Iterator<Item = i64>, from: i64, to: i64) -> Vec<(i64, i64)> {
    let mut known: Vec<(i64, i64)> = spans.iter().copied().chain(shown.map(|at| (at, at))).collect();
    known.push((to, to));
    known.sort_unstable();
    let (mut gaps, mut until) = (Vec::new(), from);
    for (start, end) in known {
        if start - until > GAP_MS {
            gaps.push((until, start));
        }
        until = until.max(end);
    }
    gaps
}

/// When something began: a loss with the silence, and not when patience was over.
pub(super) fn begins(found: &RecordView) -> i64 {
    let silent = if found.what == "lost" { body(found).silent_for_ms.unwrap_or_default() } else { 0 };
    found.time_unix_ms - i64::try_from(silent).unwrap_or_default()
}

/// When a drive was heard.
fn heard(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Vec<(i64, i64)>, StoreError> {
    let pieces = pieces(connection, drive, Quantity::STATE, from, to)?.into_iter();
    Ok(pieces.flat_map(|piece| known_spans(&piece.closed())).collect())
}

/// The times in which something is known, of points that end with nothing.
fn known_spans(points: &[crate::column::Point]) -> Vec<(i64, i64)> {
    let mut spans = Vec::new();
    let mut since = None;
    for point in points {
        match (point.count, since) {
            (Some(_), None) => since = Some(point.at),
            (None, Some(start)) => {
                spans.push((start, point.at - 1));
                since = None;
            }
            _ => {}
        }
    }
    spans
}

/// A time as a person says it.
pub(super) fn lasting(ms: i64) -> String {
    match ms {
        ..120_000 => format!("{:.1} s", ms as f64 / 1_000.0),
        _ => format!("{} min", (ms + 30_000) / 60_000),
    }
}
