//! What it costs that each status proves whether a run command is in force, and what a stop of all takes: exchanges, the sweep of
//! a full line and the time until each drive has confirmed, by the line's own clock, beside what its plan says. In virtual time.

use std::time::Duration;

use drive_bus::LineConfig;
use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{
    Demand, DriveSettings, GroupStart, LineBudget, LinePlan, Link, Periods, Until, WatchdogContract, forecast,
};
use support::plant::{PATIENCE, Plant, Site, common_settings, contract};
use tokio::time::{Instant, sleep};

/// A full line; of a family whose drives trip after two seconds without a frame, as many as a line can feed.
fn drives(family: Family) -> u8 {
    let fixed = family.capabilities().watchdog.and_then(|watchdog| watchdog.fixed());
    if fixed.is_some_and(|time| time < EVERY) { 12 } else { 31 }
}

/// How often each is asked, so that nothing is missing.
const EVERY: Duration = Duration::from_millis(4_450);

/// The watchdog of an Altivar 312, which wants a frame of its own between two statuses.
const WATCHDOG: Duration = Duration::from_millis(5_600);

/// A drive that is asked for its status and nothing else.
fn settings(family: Family, name: &str) -> DriveSettings {
    // That of an Altivar 21 is looked at in turn from when it is armed, also at rest, and is left alone here.
    let is_settable = family.capabilities().watchdog.is_some_and(|watchdog| watchdog.settable);
    let is_settable = is_settable && family != Family::ATV21;
    let watchdog = contract(family)
        .filter(|_| is_settable)
        .map(|contract| WatchdogContract { timeout: WATCHDOG, ..contract });
    let periods = Periods { running: EVERY, rest: EVERY, slow: Duration::ZERO, max_age: 3 * EVERY };
    DriveSettings { periods, watchdog, ..DriveSettings::controlled(name) }
}

/// Lines of this family, each drive ready to be started.
async fn line_of(family: Family, drives: u8) -> Plant {
    let member = |address: u8| (family, address, settings(family, &address.to_string()));
    let site = Site::new(common_settings(), (1..=drives).map(member).collect());
    for address in 1..=drives {
        let machine = site.simulated.slave(address).expect("it is there");
        // As delivered an Altivar 21 trips after 3 s (F803), and nobody here asks 31 of them in that time.
        assert!(family != Family::ATV21 || machine.poke(0x0803, 30));
        machine.set_turnaround(Some(ANSWERS_AFTER));
        // Nor can 31 of the Omron be fed within the 2 s of n40, which acts at the next power-up.
        if family == Family::OMRON_3G3EV && drives > self::drives(family) {
            assert!(machine.poke(0x0128, 1));
            machine.power_cycle();
        }
    }
    let plant = Plant::open_whatever_the_plan(vec![site]).unwrap_or_else(|error| panic!("{error}"));
    for drive in plant.fleet.drives() {
        drive.ready(PATIENCE).await.unwrap_or_else(|refused| panic!("{}: {refused}", drive.name()));
    }
    plant
}

async fn start(plant: &Plant, until: Until) {
    let setpoint = Some(Frequency::from_hertz(20).into());
    let start = GroupStart { direction: Direction::Forward, setpoint, spacing: Duration::ZERO, until };
    plant.fleet.all().start(start).await.unwrap_or_else(|failure| panic!("{failure}"));
}

/// When every machine here answers.
const ANSWERS_AFTER: Duration = Duration::from_millis(6);

/// What the plan says of such a line when its drives answer as these do.
fn told(family: Family, drives: u8) -> LinePlan {
    let budget =
        LineBudget { response: ANSWERS_AFTER, ..LineBudget::of(&LineConfig::stream(common_settings())) };
    let demand = |address: u8| {
        let settings = settings(family, &address.to_string());
        Demand {
            drive: settings.name,
            capabilities: family.capabilities(),
            watchdog_capability: family.capabilities().watchdog,
            periods: settings.periods,
            watchdog: settings.watchdog,
        }
    };
    let demands: Vec<Demand> = (1..=drives).map(demand).collect();
    forecast(budget, &demands, 0).plan
}

/// How many exchanges a status takes, and how long one of every drive takes of the line.
async fn measured(plant: &Plant, runs: bool) -> (f64, Duration) {
    sleep(EVERY * 30).await;
    let drives = plant.fleet.drives();
    let count = || {
        let polls: u64 = drives.iter().map(|drive| drive.snapshot().counters.polls).sum();
        let requests: u64 = drives.iter().map(|drive| plant.machine_of(drive.name()).all_requests()).sum();
        (polls, requests)
    };
    let _ = plant.sites[0].simulated.take_stats();
    let before = count();
    sleep(EVERY * 150).await;
    let after = count();
    let busy = plant.sites[0].simulated.take_stats().ideal;
    for drive in &drives {
        let snapshot = drive.snapshot();
        assert_eq!((snapshot.link, snapshot.started_here()), (Link::Connected, runs), "{}", drive.name());
        assert_eq!(plant.machine_of(drive.name()).observe().running, runs, "{}", drive.name());
    }
    let (polls, requests) = ((after.0 - before.0) as f64, (after.1 - before.1) as f64);
    (requests / polls, busy.mul_f64(drives.len() as f64 / polls))
}

#[tokio::test(start_paused = true)]
async fn what_proves_a_run_command_takes_no_more_of_a_full_line_than_its_share_and_the_plan_counts_it() {
    for family in Family::BUILT_IN {
        let number = drives(family);
        let plant = line_of(family, number).await;
        let (ordinary, without) = measured(&plant, false).await;
        start(&plant, Until::InForce).await;
        let (proved, with) = measured(&plant, true).await;
        let share = with.as_secs_f64() / without.as_secs_f64() - 1.0;
        let told = told(family, number);
        println!(
            "{family}: {ordinary:.3} exchanges a status, {proved:.3} with a run command of ours; a sweep of {number} {} ms, \
             {} ms: {:+.1} %; the plan says {} ms, {:+.1} %",
            without.as_millis(),
            with.as_millis(),
            100.0 * share,
            told.sweep.as_millis(),
            100.0 * (told.sweep.as_secs_f64() / with.as_secs_f64() - 1.0),
        );
        let allowed = if family == Family::ATV21 { 0.10 } else { 0.05 };
        assert!(share <= allowed, "{family}: {share}");
        // Each of its parts is in whole nanoseconds.
        let most = told.sweep + Duration::from_micros(1);
        assert!(without <= most && with <= most, "{family}: {with:?}, the plan says {:?}", told.sweep);
        assert!(told.sweep <= with.mul_f64(1.03), "{family}: {with:?}, the plan says {:?}", told.sweep);
        let used = with.as_secs_f64() / EVERY.as_secs_f64();
        let planned = told.utilisation_ppm as f64 / 1e6;
        assert!(
            used <= planned + 5e-5 && planned <= 1.03 * used,
            "{family}: {used}, the plan says {planned}"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_is_on_the_wire_and_confirmed_within_what_the_plan_says_and_written_to_each_once() {
    for family in Family::BUILT_IN {
        for number in [1, 31] {
            let plant = line_of(family, number).await;
            start(&plant, Until::AtReference).await;
            let (wire, told) = (plant.lines[0].worst_case_stop(), told(family, number).stop_all(0));
            let called = Instant::now();
            let report = plant.fleet.stop_all(StopMode::Ramp).in_force().await;
            let took = called.elapsed();
            assert!(report.is_confirmed(), "{family}: {report}");
            println!("{number} {family}: all have confirmed a stop after {took:?}, the plan says {told:?}");
            assert!(took <= told, "{number} {family}: {took:?}, the plan says {told:?}");
            for drive in plant.fleet.drives() {
                let received = plant.machine_of(drive.name()).received_since(called);
                let writes: Vec<_> =
                    received.iter().filter(|request| matches!(request.pdu[0], 0x06 | 0x10)).collect();
                let first = writes.first().expect("a stop is written").at - called;
                let others = told * u32::from(number - 1) / u32::from(number);
                assert!(first <= wire + others, "{family} {}: {first:?}", drive.name());
                let alone = writes.iter().filter(|write| write.cast == drive_sim::Cast::Unicast).count();
                assert_eq!(alone, 1, "{number} {family}: {}", drive.name());
            }
        }
    }
}
