//! The built daemon over ptys in real time, commanded over HTTP all the time, while its host misbehaves: the daemon and the simulated lines
//! are stopped and continued, processors are eaten, ptys go and come back, descriptors and the disk run out. Each stop is answered and is
//! true against the shaft, nothing runs that nobody has started, what is told as fresh is not against the machine, and at the end all stands.
//!
//! Real time draws what happens between two instructions: a seed draws the faults again, and not always what they found.

mod commands;
mod faults;
mod judge;
mod plants;
mod simulator;
mod site;
mod witness;

use std::{
    collections::BTreeMap,
    io,
    path::Path,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use fastrand::Rng;

use super::{GROWTH, judge as of_program, process};
use crate::report::{Find, Told};
pub(super) use plants::find as find_plants;
use site::{DRIVES, LINES, Site};

/// What all who take part share.
struct Hour {
    site: Site,
    /// For each drive how often it was started, and whether it may run by that.
    started: [Started; DRIVES.len()],
    ends: AtomicBool,
    kept: Mutex<Kept>,
}

/// Who may run, as whoever commands the drive knows it.
#[derive(Default)]
struct Started {
    times: AtomicU64,
    may_run: AtomicBool,
    /// A start of it is under way: it may run before the daemon tells that by whose command.
    is_starting: AtomicBool,
}

/// What came of it so far.
#[derive(Default)]
struct Kept {
    tally: BTreeMap<String, u64>,
    /// The first of each kind.
    finds: BTreeMap<String, String>,
    longest_stop: Duration,
}

impl Hour {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn count(&self, what: impl Into<String>) {
        *self.kept().tally.entry(what.into()).or_default() += 1;
    }

    fn judge(&self, who: &str, held: Result<(), String>) {
        if let Err(why) = held {
            let kind: String = why.chars().take(24).collect();
            self.kept().finds.entry(kind).or_insert_with(|| {
                let log = self.site.log();
                let last: Vec<_> =
                    log.lines().rev().take(LOG).map(|line| format!("\n      {line}")).collect();
                let find = format!("{who}: {why}{}", last.into_iter().rev().collect::<String>());
                eprintln!("found: {find}");
                find
            });
        }
    }

    fn goes_on(&self) -> bool {
        !self.ends.load(Ordering::Relaxed)
    }

    /// So long, or until it ends.
    #[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
    fn wait(&self, time: Duration) {
        let begun = Instant::now();
        while self.goes_on() && begun.elapsed() < time {
            thread::sleep(Duration::from_millis(50).min(time));
        }
    }
}

/// So many lines of the log stand behind what is found.
const LOG: usize = 12;
/// Until the daemon holds what it holds for long.
const WARM: Duration = Duration::from_secs(20);

/// For so long, or with a wrong line in the daemon until it is found.
///
/// # Errors
/// The program cannot be run as it is to be: what is found is no error.
pub(super) fn run(
    program: &Path,
    mutant: Option<&str>,
    seed: u64,
    mut go_on: impl FnMut() -> bool,
) -> io::Result<Told> {
    let begun = Instant::now();
    let hour = Hour {
        site: Site::start(program, mutant)?,
        started: Default::default(),
        ends: AtomicBool::new(false),
        kept: Mutex::default(),
    };
    let mut before = None;
    thread::scope(|scope| {
        let (hour, rng) = (&hour, |number| Rng::with_seed(seed.wrapping_mul(1_000).wrapping_add(number)));
        for (number, started) in (0..).zip(&hour.started) {
            scope.spawn(move || commands::give(hour, &DRIVES[number as usize], started, rng(number)));
        }
        for line in 0..LINES.len() {
            scope.spawn(move || witness::attend(hour, line));
        }
        scope.spawn(move || faults::of_the_daemon(hour, rng(100)));
        scope.spawn(move || faults::of_the_lines(hour, rng(101)));
        while go_on() && (mutant.is_none() || hour.kept().finds.is_empty()) {
            hour.wait(Duration::from_millis(500));
            if before.is_none() && begun.elapsed() > WARM {
                before = process::memory(hour.site.pid());
            }
            if let Some(code) = hour.site.has_ended() {
                hour.judge("the daemon", Err(format!("it has ended by itself with {code:?}")));
                break;
            }
        }
        hour.ends.store(true, Ordering::Relaxed);
    });
    let after = process::memory(hour.site.pid());
    if hour.site.has_ended().is_none() {
        end(&hour);
    }
    hour.judge("the daemon", of_program::log(&hour.site.log()));
    let mut told = Told::new("the program with its host's faults", "commands");
    if let (Some(before), Some(after)) = (before, after) {
        hour.judge("the daemon", of_program::memory(before, after, GROWTH));
        told.details.push(format!("the daemon: {before} KiB after {WARM:?}, {after} KiB before its end"));
    }
    let kept = hour.kept();
    told.details.push(format!("longest stop until it was told: {:.1} s", kept.longest_stop.as_secs_f64()));
    told.tally.clone_from(&kept.tally);
    told.count = kept.tally.iter().filter(|(what, _)| what.contains(": ")).map(|(_, count)| count).sum();
    let minutes = begun.elapsed().as_secs().div_ceil(60);
    let replay = format!("drive-fire program --ptys --seed {seed} --minutes {minutes}");
    told.finds.extend(kept.finds.values().map(|what| Find { what: what.clone(), replay: replay.clone() }));
    told.took = begun.elapsed();
    drop(kept);
    Ok(told)
}

/// Motors run by the daemon, and it is asked to end.
fn end(hour: &Hour) {
    if let Err(error) = hour.site.until_all_are_connected() {
        hour.judge("the daemon", Err(error.to_string()));
    }
    for drive in &DRIVES {
        commands::start(hour, drive, 20);
    }
    let turns = |machine: &str, line: usize| {
        hour.site.lines[line].look(machine).is_some_and(|look| look.seen.output_frequency != 0)
    };
    let running = DRIVES.iter().filter(|drive| turns(drive.machine, drive.line)).count();
    let code = hour.site.end();
    let seen =
        |drive: &site::Drive| Some((drive.name, hour.site.lines[drive.line].look(drive.machine)?.seen));
    let machines: Vec<_> = DRIVES.iter().filter_map(seen).collect();
    hour.judge("the daemon", judge::end(code, &machines));
    *hour.kept().tally.entry("motors ran when it was asked to end".to_owned()).or_default() += running as u64;
}
