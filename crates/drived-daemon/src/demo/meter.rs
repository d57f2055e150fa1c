//! The numbers of a line over the last seconds.

use std::{collections::VecDeque, time::Duration};

use drive_bus::stats::{SlaveStats, Stats};
use tokio::time::Instant;

use super::{
    plant::{Plant, PlantLine},
    unit::Unit,
};
use drived_words::output;

/// Over how many samples the numbers are taken.
const SAMPLES: usize = 5;

/// Between two samples.
const EVERY: Duration = Duration::from_millis(500);

struct Sample {
    at: Instant,
    busy: Duration,
    /// Status polls of its drives that were answered.
    polls: u64,
}

/// What [`Meter::cells`] are.
pub(super) const HEADS: [&str; 8] =
    ["line", "used", "polls/s", "silences", "shortest", "t3.5", "timeouts", "damaged"];

/// The line's numbers on one line of text, for what is no table.
pub(super) fn sentence(
    [line, used, polls, silences, shortest, t3_5, timeouts, damaged]: [String; 8],
) -> String {
    format!(
        "{line}: {used} used, {polls} polls/s, {timeouts} timeouts, {damaged} damaged,\n          \
         {silences} silences, the shortest {shortest} (t3.5 is {t3_5})"
    )
}

/// Watches one line.
pub(super) struct Meter {
    samples: VecDeque<Sample>,
    stats: Stats,
}

impl Meter {
    pub(super) fn new() -> Self {
        Self { samples: VecDeque::new(), stats: Stats::default() }
    }

    /// Takes a sample when it is time for one.
    pub(super) fn look(&mut self, plant: &Plant, line: &PlantLine, now: Instant) {
        if self.samples.back().is_some_and(|sample| now.duration_since(sample.at) < EVERY) {
            return;
        }
        self.stats = line.line.stats();
        let units = plant.units.get(line.units.clone()).unwrap_or_default();
        let polls = units.iter().map(Unit::answered).sum();
        if self.samples.len() == SAMPLES {
            self.samples.pop_front();
        }
        self.samples.push_back(Sample { at: now, busy: self.stats.busy, polls });
    }

    /// Share of the time in which the line was needed, and polls in it, over the last seconds.
    fn rates(&self) -> Option<Rates> {
        let (first, last) = (self.samples.front()?, self.samples.back()?);
        let elapsed = last.at.duration_since(first.at);
        let busy = last.busy.saturating_sub(first.busy);
        let utilisation = (busy.as_nanos() * 1_000_000).checked_div(elapsed.as_nanos())?;
        let polls = u128::from(last.polls.saturating_sub(first.polls)) * 10_000_000_000;
        Some(Rates {
            utilisation_ppm: u64::try_from(utilisation).unwrap_or(u64::MAX),
            decipolls_per_second: u64::try_from(polls / elapsed.as_nanos().max(1)).unwrap_or(u64::MAX),
        })
    }

    /// The line's numbers as texts, under [`HEADS`].
    pub(super) fn cells(&self, line: &PlantLine) -> [String; 8] {
        let outcomes =
            |of: fn(&SlaveStats) -> u64| self.stats.slaves.values().map(of).sum::<u64>().to_string();
        let rates = self.rates();
        [
            line.settings.to_string(),
            output::or_dash(
                rates.as_ref().map(|rates| output::percent(rates.utilisation_ppm.min(1_000_000))),
            ),
            output::or_dash(rates.as_ref().map(|rates| {
                format!("{}.{}", rates.decipolls_per_second / 10, rates.decipolls_per_second % 10)
            })),
            self.stats.silence.count().to_string(),
            output::milliseconds(self.stats.silence.min()),
            output::milliseconds(line.settings.t3_5()),
            outcomes(|slave| slave.outcomes.timeouts),
            outcomes(|slave| slave.outcomes.damaged),
        ]
    }
}

/// See [`Meter::rates`].
struct Rates {
    utilisation_ppm: u64,
    decipolls_per_second: u64,
}
