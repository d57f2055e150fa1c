//! Which drives of a line answered badly within a minute, as a fact: [`Errors`]. It has no clock of its own.

use std::collections::BTreeMap;

use drive_bus::stats::{SlaveStats, Stats};
use serde::Serialize;

use crate::record::{Kind, Moment, Record};

/// So many in a minute are told: fewer a line has that is well.
const TOLD_FROM: u64 = 5;

/// What became of the questions to one drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(crate) struct OfOne {
    sent: u64,
    damaged: u64,
    missing: u64,
    /// Answered by an exception, such as that it is busy.
    exceptions: u64,
}

impl OfOne {
    fn of(stats: &SlaveStats) -> Self {
        let outcomes = &stats.outcomes;
        Self {
            sent: stats.sent,
            damaged: outcomes.damaged + outcomes.mismatches,
            missing: outcomes.timeouts,
            exceptions: outcomes.exceptions + outcomes.busy,
        }
    }

    const fn since(self, before: Self) -> Self {
        Self {
            sent: self.sent.saturating_sub(before.sent),
            damaged: self.damaged.saturating_sub(before.damaged),
            missing: self.missing.saturating_sub(before.missing),
            exceptions: self.exceptions.saturating_sub(before.exceptions),
        }
    }

    const fn bad(self) -> u64 {
        self.damaged + self.missing + self.exceptions
    }

    fn in_words(self, name: &str) -> String {
        let Self { sent, damaged, missing, exceptions } = self;
        let parts = [(damaged, "damaged"), (missing, "missing"), (exceptions, "by an exception")];
        let told =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
        format!("{name}: of {sent} answers {}", told.collect::<Vec<_>>().join(", "))
    }
}

/// Follows the drives of one line.
#[derive(Debug, Default)]
pub(crate) struct Errors(BTreeMap<u8, OfOne>);

/// What a minute of a line had of them, by slave, the worst first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Minute(Vec<(u8, OfOne)>);

impl Errors {
    /// Looks at what was counted until now, a minute behind the last look; gives what is to be told. What the first look finds belongs to its
    /// minute: the line counts from its beginning.
    pub(crate) fn look(&mut self, stats: &Stats) -> Option<Minute> {
        let mut bad = Vec::new();
        for (slave, stats) in &stats.slaves {
            let now = OfOne::of(stats);
            let before =
                self.0.insert(*slave, now).filter(|before| before.sent <= now.sent).unwrap_or_default();
            let of_minute = now.since(before);
            if of_minute.bad() > 0 {
                bad.push((*slave, of_minute));
            }
        }
        let all: u64 = bad.iter().map(|(_, one)| one.bad()).sum();
        bad.sort_by_key(|(slave, one)| (u64::MAX - one.bad(), *slave));
        (all >= TOLD_FROM).then_some(Minute(bad))
    }
}

impl Minute {
    /// As a record of the line.
    pub(crate) fn told(&self, line: &str, now: Moment, named: impl Fn(u8) -> String) -> Record {
        let parts: Vec<String> = self.0.iter().map(|(slave, one)| one.in_words(&named(*slave))).collect();
        let slaves: BTreeMap<String, OfOne> =
            self.0.iter().map(|(slave, one)| (named(*slave), *one)).collect();
        Record {
            kind: Kind::Event,
            line: Some(line.to_owned()),
            body: serde_json::to_string(&serde_json::json!({ "drives": slaves })).ok(),
            ..Record::of_history(now, "line_errors", format!("in the last minute {}", parts.join("; ")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(slaves: &[(u8, u64, u64, u64, u64)]) -> Stats {
        let mut stats = Stats::default();
        for (slave, sent, damaged, missing, exceptions) in slaves {
            let mut one = SlaveStats::default();
            one.sent = *sent;
            one.outcomes.damaged = *damaged;
            one.outcomes.timeouts = *missing;
            one.outcomes.exceptions = *exceptions;
            stats.slaves.insert(*slave, one);
        }
        stats
    }

    #[test]
    fn the_answers_of_a_minute_that_were_bad_are_told_by_drive_the_worst_first() {
        let now = Moment { steady_ms: 60_000, wall_ms: 60_000 };
        let mut errors = Errors::default();
        let mut told = |slaves: &[(u8, u64, u64, u64, u64)]| {
            let minute = errors.look(&counted(slaves))?;
            Some(minute.told("north", now, |slave| format!("pump {slave}")).text)
        };
        assert_eq!(told(&[(1, 300, 1, 0, 0), (2, 300, 0, 0, 0)]), None, "a line that is well");
        // As the night with the bad cable was logged: 63 of 922 answers damaged, most of pump 1.
        let text = "in the last minute pump 1: of 307 answers 40 damaged; pump 2: of 300 answers 23 damaged, 1 missing";
        assert_eq!(told(&[(1, 607, 41, 0, 0), (2, 600, 23, 1, 0)]).as_deref(), Some(text));
        let text = "in the last minute pump 2: of 16 answers 16 by an exception";
        assert_eq!(told(&[(1, 900, 41, 0, 0), (2, 616, 23, 1, 16)]).as_deref(), Some(text));
        assert_eq!(told(&[(1, 10, 0, 0, 0), (2, 10, 0, 0, 0)]), None, "a line that was opened anew");
    }
}
