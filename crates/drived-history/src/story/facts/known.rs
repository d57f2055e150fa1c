//! Of which times anything is known of a drive, and of which not.

use drived_plant::plant::past::RecordView;
use rusqlite::Connection;

use super::{super::body::body, Facts, SEEN_AGAIN_MS};
use crate::{column::Point, quantity::Quantity, read::pieces, store::StoreError};

/// So long before a stream that was begun anew something may be missing.
const TOLD_AGAIN_MS: i64 = 60_000;
/// A gap that is told: shorter ones are lost polls.
const GAP_MS: i64 = 5_000;
/// So long behind a moment everything of it is there: the slow set was read, a line's minute was counted.
const FRESH_MS: i64 = 60_000;

impl Facts {
    /// The time around a moment in which nothing is known of the drive.
    pub(in crate::story) fn gap_at(&self, at: i64) -> Option<(i64, i64)> {
        self.gaps.iter().copied().find(|(start, end)| (*start..=*end).contains(&at))
    }

    /// The last time in which nothing was known of the drive, of those that ended no longer than a moment before it was seen again.
    pub(in crate::story) fn gap_before(&self, at: i64) -> Option<(i64, i64)> {
        self.gaps.iter().rev().copied().find(|(start, end)| *start < at && at <= *end + SEEN_AGAIN_MS)
    }

    /// When its output or who commands it was read otherwise than before.
    pub(in crate::story) fn readings(&self) -> impl Iterator<Item = i64> {
        let outputs = self.outputs.iter().filter(|(_, count)| count.is_some()).map(|(at, _)| *at);
        outputs.chain(self.controls.iter().map(|(at, _)| *at))
    }

    /// Whether it was heard all the time between two moments.
    pub(in crate::story) fn is_heard(&self, from: i64, to: i64) -> bool {
        self.spans.iter().any(|(start, end)| *start <= from && to <= *end)
    }

    /// Whether this program had been standing still until shortly before a moment.
    pub(in crate::story) fn stood_still_until(&self, at: i64) -> bool {
        self.records
            .iter()
            .any(|found| found.what == "stood_still" && (found.time_unix_ms - at).abs() <= SEEN_AGAIN_MS)
    }

    /// Drives of its line that were heard all the time between two moments.
    pub(in crate::story) fn heard_between(&self, from: i64, to: i64) -> Vec<&str> {
        let is_heard = |spans: &[(i64, i64)]| spans.iter().any(|(start, end)| *start <= from && to <= *end);
        self.heard.iter().filter(|(_, spans)| is_heard(spans)).map(|(name, _)| &**name).collect()
    }

    /// How long nothing is kept behind a moment that is so near that what is read more rarely may not be there yet.
    pub(in crate::story) fn ends_soon_after(&self, at: i64) -> Option<i64> {
        let after = self.to - at;
        (0..FRESH_MS).contains(&after).then_some(after)
    }

    /// By what it was commanded at a moment, in the drive's own words.
    pub(in crate::story) fn control_at(&self, at: i64) -> Option<&str> {
        self.controls.iter().rev().find(|(since, _)| *since <= at).map(|(_, control)| &**control)
    }

    /// Why something may have been asked for or have happened between two moments that is not among the records; `None`: nothing is missing.
    pub(in crate::story) fn missing(&self, from: i64, to: i64) -> Option<String> {
        if self.is_cut {
            return Some("more is recorded than was looked at".to_owned());
        }
        let (mut ended, mut closed, mut last) = (None, None, None);
        for found in self.records.iter().filter(|found| found.kind == "history") {
            let (at, body) = (found.time_unix_ms, body(found));
            let (since, why) = match &*found.what {
                "ended" => {
                    ended = Some(at);
                    continue;
                }
                "history_closed" => {
                    closed = Some(at);
                    continue;
                }
                // What happened in the moment of a reload is told by the next one.
                "history_opened" if closed.is_none_or(|closed| at - closed < TOLD_AGAIN_MS) => {
                    closed = None;
                    continue;
                }
                "history_opened" => (closed.take().unwrap_or(at), "the history had been closed"),
                "began_after_kill" => {
                    (body.last_known_unix_ms.unwrap_or(i64::MIN), "this program had been killed")
                }
                "began" if closed.is_some() => {
                    (closed.take().unwrap_or(i64::MIN), "the history had been closed")
                }
                "began" => (ended.unwrap_or(i64::MIN), "this program had not run until then"),
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
        if closed.is_some_and(|closed| closed <= to) {
            return Some("the history had been closed".to_owned());
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
}

/// The times between two moments in which nothing was read of a drive, as far as they are told: neither a value nor what an event tells.
pub(super) fn gaps(
    spans: &[(i64, i64)],
    shown: impl Iterator<Item = i64>,
    from: i64,
    to: i64,
) -> Vec<(i64, i64)> {
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

/// When a drive was heard.
pub(super) fn heard(
    connection: &Connection,
    drive: &str,
    from: i64,
    to: i64,
) -> Result<Vec<(i64, i64)>, StoreError> {
    let pieces = pieces(connection, drive, Quantity::STATE, from, to)?.into_iter();
    Ok(pieces.flat_map(|piece| known_spans(&piece.closed())).collect())
}

/// The times in which something is known, of points that end with nothing.
pub(in crate::story) fn known_spans(points: &[Point]) -> Vec<(i64, i64)> {
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
pub(in crate::story) fn lasting(ms: i64) -> String {
    match ms {
        ..120_000 => format!("{:.1} s", ms as f64 / 1_000.0),
        _ => format!("{} min", (ms + 30_000) / 60_000),
    }
}
