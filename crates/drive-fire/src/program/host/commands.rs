//! Whoever commands a drive: it is started, given setpoints, and stopped, again and again, each behind the other.

use std::{
    io,
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use fastrand::Rng;
use serde_json::Value;

use super::{
    Hour, Started,
    judge::{self, Stopped},
    site::Drive,
};

/// How a stop is asked for: a ramp mostly, for whose drive stands soonest is commanded the most.
const STOPS: [&str; 12] = [
    "{}",
    "{}",
    "{}",
    "{}",
    "{}",
    "{\"mode\":\"ramp\"}",
    "{\"mode\":\"ramp\"}",
    "{\"mode\":\"fast\"}",
    "{\"mode\":\"fast\"}",
    "{\"mode\":\"fast\"}",
    "{\"mode\":\"dc_injection\"}",
    "{\"mode\":\"freewheel\"}",
];

/// Until the end, at which its motor is stopped.
pub(super) fn give(hour: &Hour, drive: &Drive, started: &Started, mut rng: Rng) {
    while hour.goes_on() {
        started.times.fetch_add(1, Ordering::SeqCst);
        started.may_run.store(true, Ordering::SeqCst);
        started.is_starting.store(true, Ordering::SeqCst);
        let (outcome, reason) = start(hour, drive, rng.u16(12..45));
        // One of which nobody has told the end is under way until its stop is.
        let is_open = matches!(outcome.as_deref(), None | Some("pending" | "unknown"));
        started.is_starting.store(is_open, Ordering::SeqCst);
        if reason.as_deref() == Some("fault") {
            tell(hour, "reset", &hour.site.ask("POST", &drive.path("reset?wait=10s"), Some("{}")));
        }
        for _ in 0..rng.u8(..4) {
            hour.wait(Duration::from_millis(rng.u64(300..2_500)));
            let body = format!("{{\"setpoint\":{{\"frequency_hz\":{}}}}}", rng.u16(8..48));
            tell(hour, "setpoint", &hour.site.ask("POST", &drive.path("setpoint?wait=5s"), Some(&body)));
        }
        hour.wait(Duration::from_millis(rng.u64(..2_000)));
        let held = stop(hour, drive, STOPS[rng.usize(..STOPS.len())]);
        if held.is_ok() {
            started.is_starting.store(false, Ordering::SeqCst);
            started.may_run.store(false, Ordering::SeqCst);
        }
        hour.judge(drive.name, held);
        hour.wait(Duration::from_millis(rng.u64(200..1_500)));
    }
}

/// What became of it and why, in a word each.
pub(super) fn start(hour: &Hour, drive: &Drive, hertz: u16) -> (Option<String>, Option<String>) {
    let body = format!("{{\"setpoint\":{{\"frequency_hz\":{hertz}}}}}");
    let answer = hour.site.ask("POST", &drive.path("start?wait=10s"), Some(&body));
    tell(hour, "start", &answer);
    let told = answer.map(|(_, told)| told).unwrap_or_default();
    let word = |name: &str| told[name].as_str().map(str::to_owned);
    (word("outcome"), word("reason"))
}

/// What became of a command is counted; whoever is told nothing tries again, as of everything but a stop.
fn tell(hour: &Hour, what: &str, answer: &io::Result<(u16, Value)>) {
    hour.count(match answer {
        Ok((status, answer)) => {
            format!("{what}: {}", answer["outcome"].as_str().unwrap_or(&status.to_string()))
        }
        Err(error) => format!("{what}: no answer, {:?}", error.kind()),
    });
}

/// It is answered, and followed until it is confirmed; the motor stands then.
fn stop(hour: &Hour, drive: &Drive, body: &str) -> Result<(), String> {
    let begun = Instant::now();
    let answer = hour.site.ask("POST", &drive.path("stop?wait=30s"), Some(body));
    tell(hour, "stop", &answer);
    let (mut status, mut told) = answer.map_err(|error| format!("a stop is not answered: {error}"))?;
    loop {
        let took = begun.elapsed();
        judge::in_time(took).map_err(|why| format!("{why}: {told}"))?;
        let id = match judge::stop(status, &told)? {
            Stopped::Open(id) => id,
            Stopped::Confirmed { may_coast } => {
                let mut kept = hour.kept();
                kept.longest_stop = kept.longest_stop.max(took);
                drop(kept);
                // One that is not there turns nothing.
                let look = hour.site.lines[drive.line].look(drive.machine);
                return look.map_or(Ok(()), |look| {
                    judge::stands(&look.seen, may_coast).map_err(|why| format!("{why}, behind {told}"))
                });
            }
        };
        hour.wait(Duration::from_millis(100));
        // Whoever cannot be told now asks again: it goes on meanwhile.
        match hour.site.ask("GET", &format!("/api/v1/commands/{id}?wait=30s"), None) {
            Ok((200, more)) => (status, told) = (200, more),
            _ => hour.count("looks at a stop that were not answered"),
        }
    }
}
