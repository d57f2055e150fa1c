//! A fleet at its full size: eight lines of 31 drives for an hour, a stop of a line of mixed families with mute drives
//! among them, a reader that is too slow. In virtual time.

use std::time::Duration;

use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_families::Family;
use drive_fleet::{
    DriveSettings, GroupStart, Link, Periods, Received, Snapshot, Until, WatchdogCheck, WatchdogContract,
};
use support::plant::{Plant, Site, common_settings, contract};
use tokio::time::{Instant, sleep, timeout};

const SECOND: Duration = Duration::from_secs(1);
const LINES: usize = 8;
const DRIVES: u8 = 31;

/// What is planned: each drive every 3 s, its slow set every minute, 0.4 of the line.
fn planned(family: Family, name: String) -> DriveSettings {
    let periods = Periods { running: 3 * SECOND, rest: 3 * SECOND, slow: 60 * SECOND, max_age: 10 * SECOND };
    let watchdog = contract(family).map(|contract| match family.capabilities().watchdog {
        Some(watchdog) if watchdog.settable => {
            drive_fleet::WatchdogContract { timeout: 8 * SECOND, ..contract }
        }
        _ => contract,
    });
    DriveSettings { periods, watchdog, ..DriveSettings::controlled(name) }
}

/// Everybody forward at once.
fn start_at(hertz: u16) -> GroupStart {
    let setpoint = Some(Frequency::from_hertz(hertz).into());
    GroupStart { direction: Direction::Forward, setpoint, spacing: Duration::ZERO, until: Until::AtReference }
}

/// The memory of this process, where the system tells it.
fn resident_kilobytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[tokio::test(start_paused = true)]
async fn eight_lines_of_31_drives_miss_no_deadline_in_an_hour_and_their_memory_is_flat() {
    let sites = (0..LINES)
        .map(|line| {
            let member =
                |address| (Family::ATV312, address, planned(Family::ATV312, format!("{line}/{address}")));
            Site::new(SerialSettings::MODBUS_DEFAULT, (1..=DRIVES).map(member).collect())
        })
        .collect();
    let mut plant = Plant::open(sites).expect("it is planned to work");
    for drive in plant.fleet.drives() {
        drive.ready(120 * SECOND).await.expect("it gets ready");
    }
    plant.fleet.all().start(start_at(40)).await.expect("all start");
    let begin: Vec<_> = plant.fleet.drives().iter().map(|drive| drive.snapshot().counters).collect();
    sleep(600 * SECOND).await;
    let early = resident_kilobytes();
    sleep(3_000 * SECOND).await;
    let late = resident_kilobytes();

    for (drive, begin) in plant.fleet.drives().iter().zip(begin) {
        let now = drive.snapshot().counters;
        let (polls, missed) = (now.polls - begin.polls, now.missed - begin.missed);
        assert_eq!((missed, now.lost, now.trips), (0, 0, 0), "{}", drive.name());
        assert!((1_198..=1_201).contains(&polls), "{}: {polls} polls in 3600 s", drive.name());
    }
    for site in &plant.sites {
        assert_eq!(site.simulated.violations(), []);
    }
    if let (Some(early), Some(late)) = (early, late) {
        println!("memory after 10 minutes {early} KiB, after 60 minutes {late} KiB");
        assert!(late <= early + 2_048, "{early} KiB grew to {late} KiB");
    }
    assert!(!plant.events_so_far().await.is_empty());
}

/// A full line whose drives trip unless they hear a frame between two polls.
fn narrow(name: String) -> DriveSettings {
    let every = Duration::from_millis(4_450);
    let periods = Periods { running: every, rest: every, slow: Duration::ZERO, max_age: 3 * every };
    let timeout = Duration::from_millis(3_800);
    let watchdog = contract(Family::ATV312).map(|contract| WatchdogContract { timeout, ..contract });
    DriveSettings { periods, watchdog, ..DriveSettings::controlled(name) }
}

/// Until every watchdog is verified; nothing has tripped meanwhile.
async fn all_verified(plant: &Plant) {
    for drive in plant.fleet.drives() {
        let verified = |snapshot: &Snapshot| matches!(snapshot.watchdog, WatchdogCheck::Verified(_));
        let verified = timeout(60 * SECOND, drive.wait_until(verified)).await;
        assert!(verified.is_ok(), "{}: {:?}", drive.name(), drive.snapshot().watchdog);
    }
    for drive in plant.fleet.drives() {
        assert_eq!(plant.machine_of(drive.name()).observe().trip, None, "{}", drive.name());
    }
}

#[tokio::test(start_paused = true)]
async fn a_full_line_that_begins_and_begins_again_under_running_motors_trips_none_by_its_own_watchdogs() {
    for turnaround in 1..=10 {
        let member = |address: u8| (Family::ATV312, address, narrow(address.to_string()));
        let site = Site::new(common_settings(), (1..=DRIVES).map(member).collect());
        for address in 1..=DRIVES {
            let machine = site.simulated.slave(address).expect("it is there");
            machine.set_turnaround(Some(Duration::from_millis(turnaround)));
        }
        let plant = Plant::open(vec![site]).expect("it is planned to work");
        all_verified(&plant).await;
        sleep(30 * SECOND).await;
        plant.fleet.all().start(start_at(20)).await.expect("all start");
        let plant = plant.restarted().await;
        all_verified(&plant).await;
        sleep(30 * SECOND).await;
        for drive in plant.fleet.drives() {
            let seen = plant.machine_of(drive.name()).observe();
            let name = drive.name();
            assert_eq!((seen.trip, seen.running), (None, true), "{name}, answers after {turnaround} ms");
        }
    }
}

/// 31 drives every 50 ms on a line that has 28 ms for one: seventeen times too much.
#[tokio::test(start_paused = true)]
async fn a_line_that_is_asked_for_far_more_than_it_carries_prefers_nobody_and_gets_every_drive_ready() {
    let every = Duration::from_millis(50);
    let member = |address: u8| {
        let periods = Periods { running: every, rest: every, slow: 60 * SECOND, max_age: 10 * SECOND };
        let settings = DriveSettings::controlled(address.to_string());
        let watchdog = contract(Family::ATV312);
        (Family::ATV312, address, DriveSettings { periods, watchdog, ..settings })
    };
    let site = Site::new(common_settings(), (1..=DRIVES).map(member).collect());
    let plant = Plant::open_whatever_the_plan(vec![site]).expect("it is opened all the same");
    let counters = || plant.fleet.drives().iter().map(|drive| drive.snapshot().counters).collect::<Vec<_>>();
    for drive in plant.fleet.drives() {
        drive.ready(600 * SECOND).await.unwrap_or_else(|refused| panic!("{}: {refused}", drive.name()));
    }
    let before = counters();
    sleep(120 * SECOND).await;
    let after = counters();
    let answered: Vec<_> =
        after.iter().zip(&before).map(|(after, before)| after.answered - before.answered).collect();
    let (least, most) = (answered.iter().min().unwrap(), answered.iter().max().unwrap());
    assert!(least * 4 >= most * 3, "{answered:?}");
    assert!(after.iter().all(|counters| (counters.lost, counters.trips) == (0, 0)), "{after:?}");
    let one = plant.drive("18");
    assert!(one.set_setpoint(Frequency::from_hertz(20)).await.is_confirmed());
    assert!(one.start(Direction::Forward).await.is_confirmed());
    let stopped = plant.fleet.stop_all(StopMode::Ramp).await;
    assert!(stopped.is_confirmed(), "{stopped}");
}

#[tokio::test(start_paused = true)]
async fn a_reader_that_is_slow_is_told_how_many_events_it_missed() {
    let member = |address| (Family::ATV312, address, DriveSettings::controlled(format!("drive {address}")));
    let site = Site::new(SerialSettings::MODBUS_DEFAULT, (1..=3).map(member).collect());
    let plant = Plant::open(vec![site]).expect("it can be");
    let mut slow = plant.fleet.events();
    let mut fast = plant.fleet.events();
    let drive = plant.drive("drive 1");
    drive.ready(60 * SECOND).await.expect("it gets ready");
    let mut seen = 0_u64;
    for round in 0..6_000_u16 {
        assert!(
            drive
                .set_setpoint(Frequency::from_centihertz(1_000 + u32::from(round % 100) * 10))
                .await
                .is_confirmed()
        );
        while let Ok(Received::Event(_)) = tokio::time::timeout(Duration::ZERO, fast.recv()).await {
            seen += 1;
        }
    }
    let Received::Missed(missed) = slow.recv().await else { panic!("it was slow") };
    let mut left = 0_u64;
    while let Ok(Received::Event(_)) = tokio::time::timeout(Duration::ZERO, slow.recv()).await {
        left += 1;
    }
    assert_eq!(missed + left, seen, "none is lost without a word");
    assert!(missed > 0);
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_31_running_drives_of_mixed_families_stops_the_living_in_the_bound_and_names_the_mute() {
    let families = [Family::ATV312, Family::ATV28, Family::ATV58, Family::ATV21, Family::OMRON_3G3EV];
    let member = |address: u8| {
        let family = families[usize::from(address) % families.len()];
        let periods =
            Periods { running: 4 * SECOND, rest: 4 * SECOND, slow: Duration::ZERO, max_age: 10 * SECOND };
        let settings = planned(family, format!("{family} {address}"));
        (family, address, DriveSettings { periods, watchdog: None, ..settings })
    };
    // Fixed watchdogs (Altivar 58: 1 s) are fed by frames of their own; at 19200 bit/s a dozen of them is what the
    // plan allows.
    let members: Vec<_> = (1..=DRIVES).map(member).collect();
    let plant =
        Plant::open(vec![Site::new(common_settings(), members)]).unwrap_or_else(|error| panic!("{error}"));
    for drive in plant.fleet.drives() {
        drive.ready(120 * SECOND).await.expect("it gets ready");
    }
    plant.fleet.all().start(start_at(30)).await.unwrap_or_else(|failure| panic!("{failure}"));
    for drive in plant.fleet.drives() {
        assert_eq!(plant.machine_of(drive.name()).observe().output_frequency, 3_000, "{}", drive.name());
        assert_eq!(
            drive.snapshot().counters.lost,
            0,
            "{}: the starts leave the polls their time",
            drive.name()
        );
    }
    let mute = ["3", "14", "25"].map(|address| {
        let drives = plant.fleet.drives();
        let drive = drives.iter().find(|drive| drive.slave().to_string() == address).expect("it is there");
        plant.machine_of(drive.name()).mute();
        drive.name().to_string()
    });

    let bound = plant.fleet.plan("line 0").expect("it is a line").stop_all(3);
    let called = Instant::now();
    let fleet = plant.fleet.clone();
    let stop = tokio::spawn(async move { fleet.stop_all(StopMode::Ramp).await });
    let mut slowest = Duration::ZERO;
    for drive in plant.fleet.drives().iter().filter(|drive| !mute.contains(&drive.name().to_string())) {
        // The run command is gone from the machine when it steers for standstill.
        plant.machine_of(drive.name()).wait_until(|machine| machine.setpoint == 0 || !machine.running).await;
        slowest = slowest.max(called.elapsed());
    }
    println!("the last of 28 living drives took the stop after {slowest:?}, the bound is {bound:?}");
    assert!(slowest <= bound, "{slowest:?} of {bound:?}");
    let report = stop.await.expect("it ends");
    assert_eq!(report.confirmed.len(), usize::from(DRIVES) - mute.len(), "{report}");
    let mut unconfirmed: Vec<_> = report.unconfirmed.iter().map(|(name, _)| name.to_string()).collect();
    unconfirmed.sort();
    let mut mute = mute.to_vec();
    mute.sort();
    assert_eq!(unconfirmed, mute, "{report}");
    assert_eq!(report.broadcasts, [], "the families do not share a broadcast");

    // The stops of the mute go on until they are heard, and the living are seen and fed meanwhile.
    let drives = plant.fleet.drives();
    for _ in 0..60 {
        sleep(SECOND).await;
        for drive in drives.iter().filter(|drive| !mute.contains(&drive.name().to_string())) {
            let snapshot = drive.snapshot();
            assert_eq!(snapshot.link, Link::Connected, "{}", drive.name());
            assert!(snapshot.trips.is_empty(), "{}: {:?}", drive.name(), snapshot.trips);
        }
    }
    for name in &mute {
        plant.machine_of(name).unmute();
        plant.drive(name).wait_until(|snapshot| snapshot.stop.is_none()).await;
        assert!(!plant.machine_of(name).observe().running, "{name}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_line_of_one_family_is_stopped_by_one_broadcast_and_each_drive_then_confirms() {
    let member = |address| (Family::ATV28, address, DriveSettings::controlled(format!("drive {address}")));
    let plant =
        Plant::open(vec![Site::new(common_settings(), (1..=8).map(member).collect())]).expect("it can be");
    for drive in plant.fleet.drives() {
        drive.ready(60 * SECOND).await.expect("it gets ready");
        assert!(drive.run(Direction::Forward, Frequency::from_hertz(30)).await.is_confirmed());
    }
    let called = Instant::now();
    let fleet = plant.fleet.clone();
    let stop = tokio::spawn(async move { fleet.stop_all(StopMode::Freewheel).await });
    for drive in plant.fleet.drives() {
        plant.machine_of(drive.name()).wait_until(|machine| !machine.running).await;
    }
    assert!(
        called.elapsed() <= plant.lines[0].worst_case_stop() + 10 * Duration::from_millis(1),
        "{:?}",
        called.elapsed()
    );
    let report = stop.await.expect("it ends");
    assert_eq!((report.confirmed.len(), report.broadcasts.len()), (8, 1), "{report}");
}
