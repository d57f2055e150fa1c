//! The same for programs.

use std::time::Duration;

use serde::Serialize;

use super::{judge::habits, observations::Figures, report::Diagnosis, verdict::Verdict};
use drived_words::{
    json::{self, microseconds, milliseconds},
    line_spec,
};

#[derive(Serialize)]
struct Object<'a> {
    healthy: bool,
    line: String,
    latency_timer_ms: Option<u64>,
    driver: Option<&'a str>,
    took_ms: u64,
    /// Why it ended before its time.
    cut_short: Option<&'a str>,
    verdicts: Vec<VerdictObject<'a>>,
    slaves: Vec<SlaveObject>,
    /// The drives that stand tripped, which is no fault of the line.
    tripped: Vec<String>,
    /// What nobody can know of the drives that are named.
    not_known: Vec<String>,
    listened_ms: u64,
    frames_of_others: usize,
    noise_bytes: usize,
    second_master: Vec<HabitObject>,
}

#[derive(Serialize)]
struct VerdictObject<'a> {
    #[serde(flatten)]
    verdict: &'a Verdict,
    drives: Vec<String>,
}

#[derive(Serialize)]
struct SlaveObject {
    drive: String,
    slave: u8,
    asked: usize,
    answered: usize,
    silent: usize,
    damaged: usize,
    late: usize,
    stray: u64,
    response_min_us: Option<u64>,
    response_p50_us: Option<u64>,
    response_p99_us: Option<u64>,
    response_max_us: Option<u64>,
}

#[derive(Serialize)]
struct HabitObject {
    slave: Option<u8>,
    what: String,
    times: usize,
    every_ms: Option<u64>,
}

/// One object with everything but the damaged frames, which are in the report.
pub(super) fn of(diagnosis: &Diagnosis<'_>) -> String {
    let seen = diagnosis.seen;
    let slave = |figures: Figures| {
        let time = |percent| figures.quantile(percent).map(|time: Duration| microseconds(time));
        SlaveObject {
            drive: seen.name(figures.slave),
            slave: figures.slave,
            asked: figures.asked,
            answered: figures.answered,
            silent: figures.silent,
            damaged: figures.damaged,
            late: figures.late,
            stray: figures.stray,
            response_min_us: time(0),
            response_p50_us: time(50),
            response_p99_us: time(99),
            response_max_us: time(100),
        }
    };
    let verdict = |verdict| VerdictObject { verdict, drives: named(diagnosis, verdict) };
    let habit = |habit: super::judge::Habit| HabitObject {
        slave: habit.slave,
        what: habit.what,
        times: habit.times,
        every_ms: habit.every.map(milliseconds),
    };
    json::line(&Object {
        healthy: diagnosis.verdicts.is_empty(),
        line: line_spec::describe(&seen.config),
        latency_timer_ms: seen.adapter.latency.map(milliseconds),
        driver: seen.adapter.driver.as_deref(),
        took_ms: milliseconds(seen.took),
        cut_short: seen.cut_short.as_deref(),
        verdicts: diagnosis.verdicts.iter().map(verdict).collect(),
        slaves: diagnosis.figures().into_iter().map(slave).collect(),
        tripped: diagnosis.tripped(),
        not_known: diagnosis.not_known(),
        listened_ms: milliseconds(seen.listened.time),
        frames_of_others: seen.listened.frames().count(),
        noise_bytes: seen.listened.noise().count(),
        second_master: habits(seen).into_iter().map(habit).collect(),
    })
}

fn named(diagnosis: &Diagnosis<'_>, verdict: &Verdict) -> Vec<String> {
    verdict.slaves.iter().map(|slave| diagnosis.seen.name(*slave)).collect()
}
