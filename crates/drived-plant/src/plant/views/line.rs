//! One line.

use drive_bus::{
    Line,
    evidence::{Certainty, Finding},
    stats::{Histogram, SlaveStats, Stats},
};
use drive_fleet::{DriveHandle, LinePlan, view::FindingFigures};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::plant::usage::Usage;
use drived_config::names::KnownAs;
use drived_words::json::{microseconds, milliseconds};

/// A line, and what was counted on it since it was opened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LineView {
    pub name: String,
    /// By what it is known that keeps over another name.
    #[serde(flatten)]
    pub known_as: KnownAs,
    /// As `--line` takes it.
    pub port: String,
    pub protocol: String,
    pub link: LineLink,
    /// Why its port is not there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The share of the last seconds in which it was needed.
    pub utilisation_percent: f64,
    /// The same since it was opened.
    pub utilisation_since_opening_percent: f64,
    /// The longest time from a stop to its first bit on the line, whatever happens.
    pub worst_case_stop_ms: u64,
    /// One status of every living drive, by the plan.
    pub cycle_ms: u64,
    /// Requests that were sent.
    pub exchanges: u64,
    pub errors: LineErrors,
    /// What is wrong with it by what it has heard lately; absent where nothing is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<FindingView>,
    pub slaves: Vec<SlaveView>,
}

/// What a line has found wrong with itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FindingView {
    /// What, by its name.
    pub defect: String,
    /// The address that it concerns; absent where it is the line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slave: Option<u8>,
    /// The drive that has this address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    #[serde(flatten)]
    pub figures: FindingFigures,
    /// From what it cannot be told, in words; absent where it is certain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cannot_be_told_from: Option<String>,
    pub text: String,
    /// What to do next, the likeliest first.
    pub next: Vec<String>,
}

impl FindingView {
    fn of(finding: &Finding, drives: &[DriveHandle]) -> Self {
        let named = |slave: u8| drives.iter().find(|drive| drive.slave().number() == slave);
        Self {
            defect: finding.defect.name().to_owned(),
            slave: finding.slave,
            drive: finding.slave.and_then(named).map(|drive| drive.name().to_string()),
            figures: finding.into(),
            cannot_be_told_from: match finding.certainty {
                Certainty::CannotBeToldFrom(what) => Some(what.to_string()),
                _ => None,
            },
            text: finding.to_string(),
            next: finding.next().iter().map(|next| (*next).to_owned()).collect(),
        }
    }
}

/// Whether the port is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineLink {
    Connected,
    /// It is not, and is tried again.
    Away,
}

/// What went wrong, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct LineErrors {
    pub no_answer: u64,
    /// Answers that failed their check.
    pub damaged: u64,
    /// Answers after their time.
    pub late: u64,
    /// Answers that did not fit their request.
    pub mismatched: u64,
    /// Refusals by the slave.
    pub exception: u64,
    /// Intact frames of somebody else; of the line only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foreign: Option<u64>,
    /// Requests that the adapter gave back, which is no error where it always does; of the line only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub echo: Option<u64>,
}

/// A slave that was asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SlaveView {
    pub slave: u8,
    /// The drive; absent where none of the configuration has this address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    pub exchanges: u64,
    /// From the end of a request to the first character of its answer; absent before the first answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub answer_ms: Option<AnswerTimes>,
    pub errors: LineErrors,
    /// Whether it has not answered for so long that it is only probed.
    pub off_line: bool,
    pub probes: u64,
    /// In how long it is asked next whether it is back; absent unless it is off-line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_probe_ms: Option<u64>,
    /// How long its answers are waited for now.
    pub timeout_ms: u64,
}

/// How long answers took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AnswerTimes {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

impl LineView {
    pub fn of(
        (name, known_as): (&str, KnownAs),
        line: &Line,
        plan: LinePlan,
        drives: &[DriveHandle],
        usage: &Usage,
    ) -> Self {
        let (config, stats) = (line.config(), line.stats());
        let slaves: Vec<SlaveView> =
            stats.slaves.iter().map(|(&slave, of)| SlaveView::of(slave, of, drives)).collect();
        Self {
            name: name.to_owned(),
            known_as,
            port: config.to_string(),
            protocol: config.protocol.to_string(),
            link: if stats.opened > stats.lost { LineLink::Connected } else { LineLink::Away },
            error: stats.away.clone(),
            utilisation_percent: usage.percent(name, &stats),
            utilisation_since_opening_percent: f64::from(stats.utilisation_ppm() / 100) / 100.0,
            worst_case_stop_ms: milliseconds(line.worst_case_stop()),
            cycle_ms: milliseconds(plan.sweep),
            exchanges: slaves.iter().map(|slave| slave.exchanges).sum(),
            errors: LineErrors::of_line(&stats),
            findings: line.findings().iter().map(|finding| FindingView::of(finding, drives)).collect(),
            slaves,
        }
    }
}

impl LineErrors {
    /// The kinds of errors of one exchange: the key of each, what it is called, and how many there were.
    pub const fn of_exchanges(&self) -> [(&'static str, &'static str, u64); 5] {
        [
            ("no_answer", "no answer", self.no_answer),
            ("damaged", "damaged", self.damaged),
            ("late", "late", self.late),
            ("mismatched", "not fitting", self.mismatched),
            ("exception", "exception", self.exception),
        ]
    }

    /// The kinds that there were, in words.
    pub fn in_words(&self) -> String {
        let of_line = [("foreign", self.foreign), ("own echo", self.echo)]
            .map(|(word, count)| (word, count.unwrap_or(0)));
        let all = self.of_exchanges().map(|(_, word, count)| (word, count)).into_iter().chain(of_line);
        let some: Vec<String> =
            all.filter(|(_, count)| *count > 0).map(|(word, count)| format!("{count} {word}")).collect();
        if some.is_empty() { "none".to_owned() } else { some.join(", ") }
    }

    fn of_line(stats: &Stats) -> Self {
        let sum = stats.slaves.values().map(Self::of_slave).fold(Self::default(), |sum, of| Self {
            no_answer: sum.no_answer + of.no_answer,
            damaged: sum.damaged + of.damaged,
            late: sum.late + of.late,
            mismatched: sum.mismatched + of.mismatched,
            exception: sum.exception + of.exception,
            ..sum
        });
        Self { foreign: Some(stats.foreign), echo: Some(stats.echoes), ..sum }
    }

    fn of_slave(stats: &SlaveStats) -> Self {
        let outcomes = &stats.outcomes;
        Self {
            no_answer: outcomes.timeouts,
            damaged: outcomes.damaged,
            late: stats.late,
            mismatched: outcomes.mismatches,
            exception: outcomes.exceptions,
            ..Self::default()
        }
    }
}

impl SlaveView {
    fn of(slave: u8, stats: &SlaveStats, drives: &[DriveHandle]) -> Self {
        let drive = drives.iter().find(|drive| drive.slave().number() == slave);
        Self {
            slave,
            drive: drive.map(|drive| drive.name().to_string()),
            exchanges: stats.sent,
            answer_ms: AnswerTimes::of(&stats.response),
            errors: LineErrors::of_slave(stats),
            off_line: stats.offline,
            probes: stats.probes,
            next_probe_ms: stats.next_probe.map(milliseconds),
            timeout_ms: milliseconds(stats.response_timeout),
        }
    }
}

impl AnswerTimes {
    fn of(response: &Histogram) -> Option<Self> {
        let milliseconds = |time| (microseconds(time) / 10) as f64 / 100.0;
        (response.count() > 0).then(|| Self {
            p50: milliseconds(response.quantile(500)),
            p99: milliseconds(response.quantile(990)),
            max: milliseconds(response.max()),
        })
    }
}
