//! Days of a plant in virtual time: many lines full of drives of every family, a fault every few seconds, commands all the time. Whatever
//! the fleet tells is held against the machines; each command ends, a stop within its time; what is only watched is never written, what
//! its owner's limits forbid is never taken, and what runs when the fleet ends is stopped by it; memory, queues and ages do not grow with
//! the days.

mod days;
mod plant;

use std::{
    collections::BTreeMap,
    fs,
    panic::{self, AssertUnwindSafe},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant as Clock},
};

use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{DriveHandle, Outcome};
use drive_sim::{Breach, Faults, SimLine, SimSlave};
use drive_testing::{contract::Open, witness::Witnesses};
use fastrand::Rng;
use tokio::time::{Instant, sleep};

use crate::{
    matrix::{self, Planted, drive_of},
    report::{Find, Plant, Told},
};
use days::Days;
pub use plant::Size;

/// Every command is told by then: the longest that a fleet waits for standstill, for a reference and for what it does not know.
const LONGEST: Duration = Duration::from_secs(240);
/// What a plant may need more at its end than after a tenth of its time.
const GROWTH: u64 = 48 * 1024;
/// What the owner of each third drive allows at the most; commands go up to 45 Hz.
const LIMIT: Frequency = Frequency::from_hertz(38);

/// What became of the commands.
#[derive(Debug, Default)]
struct Kept {
    outcomes: BTreeMap<&'static str, u64>,
    longest_stop: Duration,
    given: u64,
    told: u64,
    late: Vec<String>,
    passed: Vec<String>,
}

/// Lives through it.
///
/// # Panics
/// When the plant itself cannot be built.
pub fn run(seed: u64, size: Size, go_on: impl FnMut() -> bool) -> Told {
    run_with(seed, size, &drive_of, go_on)
}

/// How much a planted defect is given: a drive of each family on each line.
const SMALL: Size = Size { lines: 2, drives: 5, time: Duration::from_secs(3_600), calm: 1 };

/// Lives through a small one with each planted defect, or `only` this one.
pub fn find_plants(seed: u64, only: Option<&str>) -> Told {
    let begun = Clock::now();
    let mut told = Told::new("soak, against planted defects", "hours of a plant");
    for (name, planted) in planted().filter(|(name, _)| only.is_none_or(|only| only == name)) {
        let live = || run_with(seed, SMALL, &|family| planted.open(family), || true);
        let (lived, reached) = planted.while_chosen(live);
        told.count += lived.count;
        let first = |find: &Find| find.what.chars().take(200).collect::<String>().replace('\n', " ");
        let name = format!("{name}{}", if reached { "" } else { " (its line was never reached)" });
        let plant = Plant { name, found_by: lived.finds.first().map(first) };
        eprintln!("{plant:?}");
        told.plants.push(plant);
    }
    told.took = begun.elapsed();
    told
}

/// Those of families and, with the feature `plants`, of the line and of the fleet.
fn planted() -> impl Iterator<Item = (String, Planted)> {
    #[cfg(feature = "plants")]
    let fleet = crate::mutation::names_of("drive-fleet")
        .map(|name| (format!("fleet: {name}"), crate::matrix::at_a_line(name)));
    #[cfg(not(feature = "plants"))]
    let fleet = std::iter::empty();
    matrix::planted().chain(fleet)
}

fn run_with(seed: u64, size: Size, open: &dyn Fn(Family) -> Box<Open>, go_on: impl FnMut() -> bool) -> Told {
    let begun = Clock::now();
    let mut told = Told::new("soak", "hours of a plant");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    let runtime = runtime.expect("a runtime of one thread");
    let mut witnesses = Witnesses::default();
    let lived = runtime.block_on(live(seed, size, open, &mut witnesses, &mut told, go_on));
    told.count = lived.as_secs() / 3_600;
    // They tell what they have seen by a panic.
    let seen = panic::catch_unwind(AssertUnwindSafe(|| drop(witnesses)));
    if let Err(panic) = seen {
        let what = panic.downcast_ref::<String>().cloned().unwrap_or_default();
        let what: String = what.chars().take(3_000).collect();
        told.finds.push(Find { what, replay: size.replay(seed) });
    }
    told.took = begun.elapsed();
    told
}

async fn live(
    seed: u64,
    size: Size,
    open: &dyn Fn(Family) -> Box<Open>,
    witnesses: &mut Witnesses,
    told: &mut Told,
    mut go_on: impl FnMut() -> bool,
) -> Duration {
    let mut rng = Rng::with_seed(seed);
    let (builder, sites) = plant::build(size, &mut rng, open);
    let fleet = builder.start().expect("whatever the plan");
    *witnesses = Witnesses::of_fleet(&fleet, sites.iter().map(|(name, line)| (&**name, line)));
    let kept = Arc::new(Mutex::new(Kept::default()));
    let (begun, mut early, mut days) = (Instant::now(), None, Days::begin());
    let config = plant::config();
    while begun.elapsed() < size.time && go_on() {
        for (name, simulated) in &sites {
            let drives = fleet.drives_on(name);
            let drive = &drives[rng.usize(..drives.len())];
            match rng.u8(..10) {
                0 => happens(&mut rng, simulated, drive),
                _ => command(&mut rng, drive, size, &kept),
            }
        }
        sleep(size.every()).await;
        days.look(&fleet, &config, memory);
        if early.is_none() && begun.elapsed() * 10 > size.time {
            early = memory();
        }
    }
    let lived = begun.elapsed();
    days.ends(&fleet, &config, memory());
    // All is well again, and everything stops.
    for (_, simulated) in &sites {
        simulated.set_faults(Faults::default());
    }
    let stops: Vec<_> = fleet.drives().iter().map(|drive| drive.stop(StopMode::Ramp)).collect();
    let mut ends = BTreeMap::<&str, u64>::new();
    for stop in stops {
        *ends.entry(word(&stop.finished().await)).or_default() += 1;
    }
    sleep(LONGEST).await;
    let end = memory();
    // The first of each line runs when the fleet ends.
    let machines: Vec<SimSlave> = sites.iter().filter_map(|(_, simulated)| simulated.slave(1)).collect();
    let first = |drive: &&DriveHandle| drive.slave().number() == 1;
    let starts: Vec<_> =
        fleet.drives().iter().filter(first).map(|drive| drive.run(Direction::Forward, LIMIT)).collect();
    for start in starts {
        *ends.entry(word(&start.finished().await)).or_default() += 1;
    }
    drop(fleet.shutdown(Duration::from_secs(60)).await);
    sleep(LONGEST).await;
    let kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    for (what, count) in &kept.outcomes {
        told.count_as(*what, *count);
    }
    told.details.push(format!("at the end each is stopped, and one of each line started: {ends:?}"));
    told.details.push(format!("longest stop until it was told: {:.1} s", kept.longest_stop.as_secs_f64()));
    told.details.append(&mut days.lines);
    let mut find = |what: String| told.finds.push(Find { what, replay: size.replay(seed) });
    if kept.told != kept.given {
        find(format!("{} of {} commands were told", kept.told, kept.given));
    }
    days.against.iter().for_each(|what| find(what.clone()));
    kept.late.iter().chain(&kept.passed).take(4).for_each(|what| find(what.clone()));
    for machine in machines.iter().filter(|machine| machine.observe().output_frequency != 0) {
        find(format!("{} runs behind the end of the fleet that has started it", machine.name()));
    }
    for (name, simulated) in &sites {
        let watched = simulated.slave(size.drives + 1);
        let writes = watched
            .map_or(0, |machine| [0x06, 0x10].iter().map(|function| machine.requests(*function)).sum());
        if writes > 0 {
            find(format!("{writes} writes to the drive of {name} that is only watched"));
        }
        // An answer that comes late on purpose meets whoever speaks then.
        let is_ours = |breach: &Breach| !matches!(breach, Breach::Collision { late: true, .. });
        if let Some(first) = simulated.violations().iter().map(|one| one.breach).find(is_ours) {
            find(format!("a rule of {name} was broken: {first:?}"));
        }
    }
    if let (Some(early), Some(end)) = (early, end) {
        if end > early + GROWTH {
            find(format!("{early} KiB after a tenth of the time, {end} KiB at its end"));
        }
        told.details.push(format!("{early} KiB after a tenth of the time, {end} KiB at its end"));
    }
    lived
}

fn happens(rng: &mut Rng, simulated: &SimLine, drive: &DriveHandle) {
    let Some(machine) = simulated.slave(drive.slave().number()) else { return };
    let deed = ["panel stop", "motor-supply off", "motor-supply on", "power cycle"][rng.usize(..4)];
    // What a model does not take does not happen to it.
    let _ = simulated.control(&format!("{} {deed}", machine.name()));
}

fn command(rng: &mut Rng, drive: &DriveHandle, size: Size, kept: &Arc<Mutex<Kept>>) {
    let frequency = Frequency::from_hertz(rng.u16(15..45));
    let given = Instant::now();
    let is_stop = matches!(rng.u8(..8), 0 | 1);
    let (kept, name) = (Arc::clone(kept), drive.name().to_string());
    kept.lock().unwrap_or_else(PoisonError::into_inner).given += 1;
    let drive = drive.clone();
    let order = rng.u8(..8);
    let runs_for = size.runs_for(rng);
    let is_too_fast = drive.settings().limits.high.is_some_and(|high| frequency > high);
    drop(tokio::spawn(async move {
        let outcome = match order {
            _ if is_stop => drive.stop(StopMode::Ramp).finished().await,
            0..=3 => drive.start_at(Direction::Forward, frequency).finished().await,
            4 => drive.reset_faults().finished().await,
            _ => drive.set_setpoint(frequency).finished().await,
        };
        let took = given.elapsed();
        {
            let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.told += 1;
            *kept.outcomes.entry(word(&outcome)).or_default() += 1;
            if is_stop {
                kept.longest_stop = kept.longest_stop.max(took);
            }
            if is_too_fast && !is_stop && order != 4 && outcome.is_confirmed() {
                kept.passed.push(format!("{name}: {frequency} was taken, and {LIMIT} is the most"));
            }
            if took > LONGEST {
                kept.late.push(format!("{name}: told after {took:?}: {outcome}"));
            }
        }
        if let Some(runs_for) = runs_for.filter(|_| outcome.is_confirmed() && !is_stop && order != 4) {
            sleep(runs_for).await;
            drop(drive.stop(StopMode::Ramp));
        }
    }));
}

const fn word(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Confirmed | Outcome::Started(_) | Outcome::Stopped(_) => "confirmed",
        Outcome::Refused(_) => "refused",
        Outcome::NotConfirmed(_) => "not confirmed",
        Outcome::OutcomeUnknown(_) => "outcome unknown",
        Outcome::Expired => "expired",
        _ => "another outcome",
    }
}

/// What this process holds in memory, in KiB; `None`: this system does not say.
fn memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}
