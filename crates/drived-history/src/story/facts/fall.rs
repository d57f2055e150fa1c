//! An output that falls before something is told of its drive: what brought it to a standstill had begun by then.

use drived_plant::plant::past::RecordView;

use super::{
    super::body::{Cause, body},
    Facts,
};
use crate::quantity::Quantity;

/// An output that moved this long ago does not move any more.
const MOVES_MS: i64 = 1_000;
/// What is told of a reading has its own reading of the clock.
const SAME_READING_MS: i64 = 100;
/// One that was seen to fall only at the last reading fell with it.
const BEFORE_MS: i64 = 400;
/// So much of a hundred an output falls by, at the least, that is told as falling;
const FALLS: i64 = 10;
/// and so much one that had begun to.
const BEGINS: i64 = 2;
/// A policy acts upon something within this time.
const UPON_MS: i64 = 60_000;

/// That an output was falling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::story) struct Fall {
    /// When it was read lower for the first time,
    pub(in crate::story) since: i64,
    /// and what it had been,
    from: i64,
    /// and was then.
    to: i64,
    /// Whether it was read lower once only: how it came there nobody has seen.
    is_step: bool,
}

impl Fall {
    pub(in crate::story) fn from(self) -> String {
        Quantity::OUTPUT_FREQUENCY.text(self.from)
    }

    /// What it was read as, where it was read lower once only.
    pub(in crate::story) fn step(self) -> Option<String> {
        self.is_step.then(|| Quantity::OUTPUT_FREQUENCY.text(self.to))
    }
}

impl Facts {
    /// Its output at a moment,
    pub(in crate::story) fn output_at(&self, at: i64) -> Option<i64> {
        self.output_since(at)?.1
    }

    /// and since when it had been that.
    pub(in crate::story) fn output_since(&self, at: i64) -> Option<(i64, Option<i64>)> {
        self.outputs.iter().rev().find(|(since, _)| *since <= at).copied()
    }

    /// That the output was falling at a moment, or fell with it, by more than this share of a hundred.
    fn fall(&self, at: i64, share: i64) -> Option<Fall> {
        let known = self.outputs.iter().rev().skip_while(|(since, _)| *since > at + SAME_READING_MS);
        let known: Vec<(i64, i64)> =
            known.map_while(|(since, count)| Some((*since, count.map(i64::abs)?))).collect();
        let (seen, last) = known.first().copied().filter(|(seen, _)| at - seen <= MOVES_MS)?;
        let falls: Vec<_> = known.windows(2).take_while(|pair| pair[0].1 < pair[1].1).collect();
        let (since, to, from) =
            falls.last().map_or((seen, last, last), |pair| (pair[0].0, pair[0].1, pair[1].1));
        let is_step = falls.len() == 1;
        (last * 100 < from * (100 - share)).then_some(Fall { since, from, to, is_step })
    }

    /// Likewise that it had been falling for longer than from one reading to the next.
    pub(in crate::story) fn fall_before(&self, at: i64) -> Option<Fall> {
        self.fall(at, FALLS).filter(|fall| at - fall.since >= BEFORE_MS)
    }

    /// What this program withdrew its run command upon, where that is told as the end of a run and the output was falling before: which of
    /// the two it was nobody knows.
    pub(in crate::story) fn was_ending(&self, ended: &RecordView) -> Option<&RecordView> {
        let Some(Cause::Policy { policy }) = body(ended).cause else { return None };
        let upon: &[&str] = match &*policy {
            "reference_taken" => &["reference_taken"],
            "control_taken" => &["control_taken", "command_overridden"],
            _ => return None,
        };
        let at = ended.time_unix_ms;
        let mut own = self
            .records
            .iter()
            .filter(|found| found.drive == ended.drive && (at - UPON_MS..=at).contains(&found.time_unix_ms));
        let upon = own.rfind(|found| upon.contains(&&*found.what))?;
        (ended.what == "state_changed" && self.fall(upon.time_unix_ms, BEGINS).is_some()).then_some(upon)
    }
}
