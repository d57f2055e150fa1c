//! How well a poll went: per drive, and for the line.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{
    LineConfig,
    stats::{SlaveStats, Stats},
};

use drived_words::{
    drive_spec::DriveName,
    line_spec,
    output::{self, Table},
};

pub(super) struct Summary {
    pub(super) drives: Vec<(DriveName, SlaveStats)>,
    pub(super) elapsed: Duration,
    /// Full rounds: how often every drive that answers at all was read.
    pub(super) sweeps: u64,
    pub(super) utilisation_ppm: u32,
    /// Intact frames of somebody else, and bytes that made no frame.
    pub(super) strange: (u64, u64),
    /// The longest wait of a stop, as the line has gone so far.
    pub(super) stop_within: Duration,
    pub(super) silences: u64,
    pub(super) shortest_silence: Duration,
    /// The silence that the protocol needs before each request, and how it is called; `None` where it needs none.
    pub(super) needed: Option<(Duration, String)>,
}

impl Summary {
    pub(super) fn new(
        names: &[DriveName],
        answered: &BTreeMap<DriveName, u64>,
        stats: &Stats,
        config: &LineConfig,
    ) -> Self {
        let of = |name: &DriveName| stats.slaves.get(&name.slave.number()).cloned().unwrap_or_default();
        Self {
            drives: names.iter().map(|name| (*name, of(name))).collect(),
            elapsed: stats.elapsed,
            sweeps: answered.values().copied().min().unwrap_or_default(),
            utilisation_ppm: stats.utilisation_ppm(),
            strange: (stats.foreign, stats.noise_bytes),
            stop_within: stats.worst_case_stop,
            silences: stats.silence.count(),
            shortest_silence: stats.silence.min(),
            needed: line_spec::needed_silence(config),
        }
    }

    /// Full rounds in 1000 s.
    pub(super) fn sweeps_per_1000_s(&self) -> u64 {
        let sweeps = u128::from(self.sweeps) * 1_000_000_000;
        let per_1000_s = sweeps.checked_div(self.elapsed.as_micros()).unwrap_or_default();
        u64::try_from(per_1000_s).unwrap_or(u64::MAX)
    }

    /// What each drive answered.
    pub(super) fn table(&self) -> Table {
        let heads = ["drive", "good", "timeouts", "damaged", "wrong", "late", "exceptions", "p50", "p99"];
        let mut table = Table::new(heads).with_numbers_from(1);
        for (name, stats) in &self.drives {
            let response = |per_mille| {
                let answered = stats.response.count() > 0;
                output::or_dash(answered.then(|| output::milliseconds(stats.response.quantile(per_mille))))
            };
            table.row([
                name.to_string(),
                stats.outcomes.answered.to_string(),
                stats.outcomes.timeouts.to_string(),
                stats.outcomes.damaged.to_string(),
                stats.outcomes.mismatches.to_string(),
                stats.late.to_string(),
                stats.outcomes.exceptions.to_string(),
                response(500),
                response(990),
            ]);
        }
        table
    }

    /// How well the line was used, and its silences.
    pub(super) fn of_line(&self) -> String {
        let rate = self.sweeps_per_1000_s();
        let used = format!(
            "line: {}.{:03} sweeps/s, utilisation {}, a stop on the wire within {}",
            rate / 1_000,
            rate % 1_000,
            output::percent(self.utilisation_ppm.into()),
            output::milliseconds(self.stop_within),
        );
        let (frames, bytes) = self.strange;
        let used = match frames + bytes {
            0 => used,
            _ => format!("{used}; from others: {frames} frames, {bytes} bytes that make none"),
        };
        match &self.needed {
            Some((silence, name)) => format!(
                "{used}; {} silences kept, the shortest {} ({name} {})",
                self.silences,
                output::milliseconds(self.shortest_silence),
                output::milliseconds(*silence)
            ),
            None => used,
        }
    }
}
