//! What a line was planned to be, and what it has been since it was opened.

use std::time::Duration;

use drive_bus::{
    Line,
    stats::{Histogram, SlaveStats, Stats},
};
use drive_core::Class;
use drive_fleet::{DriveHandle, DriveSettings, LinePlan, WatchdogCheck};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use drived_words::{json::milliseconds, line_spec};

/// What the plan says of a line whose drives all live and run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedLineView {
    /// One status of every drive.
    pub cycle_ms: f64,
    /// The share of the line that polls and watchdogs take; more than 100 where they want more than it has.
    pub utilisation_percent: f64,
    /// From a stop to all drives until each has confirmed it; the motors then still need their ramps.
    pub all_stopped_ms: f64,
    /// The longest time from a stop to its first bit on the line, whatever happens.
    pub stop_ms: f64,
}

/// What was measured on a line since it was opened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeasuredLineView {
    /// For how long.
    pub elapsed_ms: u64,
    /// One status of every drive that is not off-line, each exchange as long as that drive's are on average, with the shortest
    /// silence that was kept; absent before the first answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycle_ms: Option<f64>,
    /// The share of the time in which the line was needed.
    pub utilisation_percent: f64,
    /// The longest time from a stop to its first bit, while the line goes on as it has.
    pub stop_ms: f64,
    /// From the call of a stop to its first bit; absent while none was sent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_wait_ms: Option<TimesView>,
    /// The same of commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command_wait_ms: Option<TimesView>,
    /// The same of statuses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status_wait_ms: Option<TimesView>,
    /// How much later than allowed requests were written while one was waiting: what this computer costs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_ms: Option<TimesView>,
    /// The silence kept before requests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub silence_ms: Option<TimesView>,
    /// The silence that the protocol needs; absent where it needs none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed_silence_ms: Option<f64>,
    /// Requests that were sent again.
    pub retries: u64,
    /// Bytes that made no frame.
    pub noise_bytes: u64,
    /// How often the port was lost.
    pub lost: u64,
    pub answers: Vec<AnswersView>,
}

/// Durations, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimesView {
    pub count: u64,
    pub min: f64,
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

/// How a slave answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AnswersView {
    pub slave: u8,
    /// Requests that were answered, with an exception too.
    pub answered: u64,
    /// How often it went off-line.
    pub went_offline: u64,
    /// From the end of a request to the first character of its answer, counted in steps of about a tenth; the steps follow one
    /// another, from the shortest to the longest that was measured.
    pub times: Vec<StepView>,
}

/// One step of a histogram.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepView {
    /// Where it ends, and the next one begins.
    pub up_to_ms: f64,
    pub count: u32,
}

/// What a drive was told when the fleet was started, and what the plan makes of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SettingsView {
    pub settings: DriveSettings,
    /// How old its status becomes at the most while it runs; absent where the line has more to do than it can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub running_age_ms: Option<f64>,
    /// The same at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_age_ms: Option<f64>,
    /// How old its measurements become at the most; absent where none are read, or there is no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measurements_age_ms: Option<f64>,
    /// Whether its communication watchdog runs; absent while that is not known, or where its family has none that can be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watchdog_armed: Option<bool>,
    /// How that is fed; absent where none is known that runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed: Option<FeedView>,
}

/// How a communication watchdog is fed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FeedView {
    /// Its time.
    pub time_ms: f64,
    /// From the last frame that the drive heard to the next, at the latest, one answer of another drive failing meanwhile.
    pub heard_within_ms: f64,
    /// Whether that is in time.
    pub in_time: bool,
}

impl PlannedLineView {
    pub fn of(line: &Line, plan: LinePlan) -> Self {
        Self {
            cycle_ms: exact(plan.sweep),
            utilisation_percent: (plan.utilisation_ppm / 100) as f64 / 100.0,
            all_stopped_ms: exact(plan.stop_all(0)),
            stop_ms: exact(line.worst_case_stop()),
        }
    }
}

impl MeasuredLineView {
    pub fn of(line: &Line, drives: &[DriveHandle]) -> Self {
        let stats = line.stats();
        let wait = |class| TimesView::of(&stats.class(class).wait);
        Self {
            elapsed_ms: milliseconds(stats.elapsed),
            cycle_ms: cycle(&stats, drives).map(exact),
            utilisation_percent: f64::from(stats.utilisation_ppm() / 100) / 100.0,
            stop_ms: exact(stats.worst_case_stop),
            stop_wait_ms: wait(Class::Stop),
            command_wait_ms: wait(Class::Command),
            status_wait_ms: wait(Class::Status),
            lag_ms: TimesView::of(&stats.lag),
            silence_ms: TimesView::of(&stats.silence),
            needed_silence_ms: line_spec::needed_silence(&line.config()).map(|(silence, _)| exact(silence)),
            retries: stats.slaves.values().map(|slave| slave.retries).sum(),
            noise_bytes: stats.noise_bytes,
            lost: stats.lost,
            answers: stats.slaves.iter().map(|(&slave, of)| AnswersView::of(slave, of)).collect(),
        }
    }
}

/// One status of every drive that is not off-line, as their exchanges have been on average.
fn cycle(stats: &Stats, drives: &[DriveHandle]) -> Option<Duration> {
    // The others were longer because the line had nothing to do.
    let silence = stats.silence.min();
    let one = |drive: &DriveHandle| {
        let slave = stats.slaves.get(&drive.slave().number()).filter(|slave| !slave.offline)?;
        let count = u32::try_from(slave.exchanges.up_to().last()?).ok()?;
        let mean = slave.exchanges.sum().checked_div(count)?;
        Some((mean + silence) * u32::from(drive.capabilities().status_exchanges))
    };
    let living: Vec<Duration> = drives.iter().filter_map(one).collect();
    (!living.is_empty()).then(|| living.iter().sum())
}

impl TimesView {
    fn of(times: &Histogram) -> Option<Self> {
        (times.count() > 0).then(|| Self {
            count: times.count(),
            min: exact(times.min()),
            p50: exact(times.quantile(500)),
            p99: exact(times.quantile(990)),
            max: exact(times.max()),
        })
    }
}

impl AnswersView {
    fn of(slave: u8, stats: &SlaveStats) -> Self {
        let step = |(end, count)| StepView { up_to_ms: exact(end), count };
        Self {
            slave,
            answered: stats.outcomes.answered + stats.outcomes.exceptions,
            went_offline: stats.went_offline,
            times: stats.response.buckets().map(step).collect(),
        }
    }
}

impl SettingsView {
    /// Those of a drive whose line has this plan.
    pub fn of(drive: &DriveHandle, plan: LinePlan) -> Self {
        let settings = DriveSettings::clone(&drive.settings());
        let periods = settings.periods;
        let limited = |age: Duration| (!plan.is_overloaded()).then(|| exact(age));
        Self {
            running_age_ms: limited(plan.status_age(periods.running)),
            rest_age_ms: limited(plan.status_age(periods.rest)),
            measurements_age_ms: (!periods.slow.is_zero())
                .then(|| plan.measurements_age(periods.slow))
                .and_then(limited),
            watchdog_armed: match (drive.watchdog_timeout(), &drive.snapshot().watchdog) {
                (Some(_), _) => Some(true),
                (None, WatchdogCheck::NoContract { found: Some(_) }) => Some(false),
                (None, _) => None,
            },
            feed: drive.watchdog_timeout().map(|timeout| FeedView::of(plan, timeout)),
            settings,
        }
    }
}

impl FeedView {
    fn of(plan: LinePlan, timeout: Duration) -> Self {
        let feed = plan.feed(timeout);
        Self {
            time_ms: exact(timeout),
            heard_within_ms: exact(feed.heard_within()),
            in_time: feed.is_in_time(),
        }
    }
}

/// Milliseconds with two decimals.
fn exact(time: Duration) -> f64 {
    (time.as_secs_f64() * 100_000.0).round() / 100.0
}
