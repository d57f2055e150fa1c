//! Lines and drives that come, change and go while a fleet runs: the others notice nothing, and who goes, goes by his policy.

use std::time::Duration;

use drive_bus::Line;
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_families::Family;
use drive_fleet::{
    DriveSettings, EventKind, ExitAction, FleetError, Left, Link, OnExit, Outcome, Periods, Received, Refused,
};
use support::{
    drives,
    plant::{PATIENCE, Plant, Site},
};
use tokio::time::{sleep, timeout};

const SECOND: Duration = Duration::from_secs(1);
const FAMILY: Family = Family::ATV312;

/// A line with drives "1" and "2", and a machine at address 3 that nobody watches yet.
fn plant() -> Plant {
    let members = (1..=2).map(|at| (FAMILY, at, DriveSettings::controlled(at.to_string()))).collect();
    let plant = Plant::open(vec![Site::new(SerialSettings::MODBUS_DEFAULT, members)]).expect("it works");
    plant.sites[0].simulated.add_boxed(3, drives::machine(FAMILY)).expect("the address is free");
    plant
}

async fn connected(plant: &Plant, name: &str) {
    let drive = plant.drive(name);
    let connected = drive.wait_until(|snapshot| snapshot.link == Link::Connected);
    timeout(PATIENCE, connected).await.unwrap_or_else(|_| panic!("{name} does not connect"));
}

async fn started(plant: &Plant, name: &str) {
    let drive = plant.drive(name);
    drive.ready(PATIENCE).await.expect("it gets ready");
    let outcome = drive.run(Direction::Forward, Frequency::from_hertz(30)).await;
    assert!(outcome.is_confirmed(), "{outcome}");
}

fn runs(plant: &Plant, address: u8) -> bool {
    plant.sites[0].simulated.slave(address).expect("it is there").observe().running
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_added_is_watched_and_the_others_keep_their_snapshots() {
    let plant = plant();
    started(&plant, "1").await;
    let before = plant.drive("1").snapshot();
    let planned = plant.fleet.plan("line 0").expect("it is a line");
    let added = plant.fleet.extend(|fleet| {
        fleet.drive("line 0", 3, DriveSettings::controlled("3"), |port, slave| {
            drives::drive(FAMILY, port, slave)
        })
    });
    assert_eq!(added, Ok(()));
    connected(&plant, "3").await;
    let after = plant.drive("1").snapshot();
    assert!(
        after.counters.polls >= before.counters.polls && after.started_here() && after.counters.lost == 0
    );
    let names: Vec<_> = plant.fleet.drives().iter().map(|drive| drive.name().to_string()).collect();
    assert_eq!(names, ["1", "2", "3"]);
    let replanned = plant.fleet.plan("line 0").expect("it is a line");
    assert!(replanned.utilisation_ppm > planned.utilisation_ppm);
    started(&plant, "3").await;
    assert!(plant.fleet.stop_all(StopMode::Ramp).await.is_confirmed());
    assert!(!runs(&plant, 1) && !runs(&plant, 3));
}

#[tokio::test(start_paused = true)]
async fn what_does_not_fit_is_refused_and_nothing_is_added() {
    let plant = plant();
    let add = |line: &'static str, address: u8, name: &str| {
        let settings = DriveSettings::watched(name);
        plant.fleet.extend(|fleet| {
            let free = DriveSettings::watched("free");
            let fleet = fleet.drive("line 0", 3, free, |port, slave| drives::drive(FAMILY, port, slave));
            fleet.drive(line, address, settings, |port, slave| drives::drive(FAMILY, port, slave))
        })
    };
    assert!(matches!(add("line 0", 4, "1"), Err(FleetError::NameTaken(_))));
    assert!(matches!(add("line 0", 2, "4"), Err(FleetError::AddressTaken { .. })));
    assert!(matches!(add("line 9", 4, "4"), Err(FleetError::NoSuchLine { .. })));
    let line = plant.lines[0].clone();
    let twice = plant.fleet.extend(|fleet| {
        let fleet = fleet.line("the same", line);
        fleet.drive("the same", 1, DriveSettings::watched("4"), |port, slave| {
            drives::drive(FAMILY, port, slave)
        })
    });
    let other = "line 0".to_owned();
    assert_eq!(twice, Err(FleetError::LineTaken { line: "the same".to_owned(), other }));
    assert_eq!((plant.fleet.drives().len(), plant.fleet.lines().len()), (2, 1));
    let unknown = plant.fleet.reconfigure(DriveSettings::watched("9"));
    assert_eq!(unknown, Err(FleetError::NoSuchDrive("9".to_owned())));
}

#[tokio::test(start_paused = true)]
async fn a_running_drive_that_is_removed_ends_by_its_policy_and_the_others_go_on() {
    let mut plant = plant();
    started(&plant, "1").await;
    started(&plant, "2").await;
    let (removed, group) = (plant.drive("1"), plant.fleet.all());
    let actions = plant.fleet.remove(&["1", "nobody"], 60 * SECOND).await;
    let [(name, ExitAction::Stopped(outcome))] = &*actions else { panic!("{actions:?}") };
    assert!(&**name == "1" && outcome.is_confirmed(), "{outcome}");
    assert!(!runs(&plant, 1) && runs(&plant, 2));
    assert!(plant.fleet.drive("1").is_none());
    assert_eq!(removed.start(Direction::Forward).await, Outcome::Refused(Refused::Removed));
    plant.events_so_far().await;
    let report = group.stop(StopMode::Ramp).await;
    assert_eq!((report.confirmed, report.unconfirmed.len()), (vec!["2".into()], 1));
    plant.event("the others' events", |kind| matches!(kind, EventKind::StopConfirmed { .. })).await;
}

/// A silent drive may take all the time there is, and its neighbour turns meanwhile.
#[tokio::test(start_paused = true)]
async fn who_ends_beside_a_silent_drive_is_asked_and_stopped_until_both_are_done() {
    for is_shutdown in [false, true] {
        let left = DriveSettings { on_exit: OnExit::Leave, ..DriveSettings::controlled("2") };
        let members = vec![(FAMILY, 1, DriveSettings::controlled("1")), (FAMILY, 2, left)];
        let plant = Plant::open(vec![Site::new(SerialSettings::MODBUS_DEFAULT, members)]).expect("it works");
        started(&plant, "1").await;
        started(&plant, "2").await;
        let silent = plant.sites[0].simulated.slave(1).expect("it is there");
        silent.mute();
        let ended = match is_shutdown {
            true => tokio::spawn(plant.fleet.shutdown(60 * SECOND)),
            false => tokio::spawn(plant.fleet.remove(&["1", "2"], 60 * SECOND)),
        };
        sleep(20 * SECOND).await;
        let neighbour = plant.drive("2");
        assert!(runs(&plant, 2) && neighbour.snapshot().link == Link::Connected, "nobody has stopped it");
        let outcome = neighbour.stop(StopMode::Ramp).await;
        assert!(outcome.is_confirmed() && !runs(&plant, 2), "{outcome}");
        let why = if is_shutdown { Refused::ShutDown } else { Refused::Removed };
        assert_eq!(neighbour.start(Direction::Forward).await, Outcome::Refused(why));
        silent.unmute();
        let actions = ended.await.expect("it ends");
        let [(_, ExitAction::Stopped(outcome)), (_, ExitAction::Left)] = &*actions else {
            panic!("{actions:?}")
        };
        assert!(outcome.is_confirmed() && !runs(&plant, 1), "{outcome}");
    }
}

#[tokio::test(start_paused = true)]
async fn other_settings_leave_the_motor_its_task_and_its_snapshot() {
    let plant = plant();
    started(&plant, "1").await;
    let before = plant.drive("1").snapshot().counters.polls;
    let writes = Plant::writes(&plant.sites[0].simulated.slave(1).expect("it is there"));
    let periods = Periods { running: SECOND, rest: 2 * SECOND, max_age: 5 * SECOND, ..Periods::default() };
    let settings = DriveSettings { periods, ..DriveSettings::controlled("1") };
    assert_eq!(plant.fleet.reconfigure(settings.clone()), Ok(()));
    assert_eq!(*plant.drive("1").settings(), settings);
    sleep(20 * SECOND).await;
    let after = plant.drive("1").snapshot();
    assert!(after.started_here() && after.max_age == 5 * SECOND && after.counters.lost == 0);
    let polls = after.counters.polls - before;
    assert!((18..=23).contains(&polls), "{polls} statuses in 20 s, one each second");
    assert_eq!(Plant::writes(&plant.sites[0].simulated.slave(1).expect("it is there")), writes);
    assert!(runs(&plant, 1));
    let released = plant.fleet.reconfigure(DriveSettings::watched("1"));
    assert!(matches!(released, Err(FleetError::Setting { .. })), "its policy has to act first: {released:?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_under_way_outlives_other_settings() {
    let plant = plant();
    started(&plant, "1").await;
    let machine = plant.sites[0].simulated.slave(1).expect("it is there");
    machine.mute();
    let drive = plant.drive("1");
    tokio::spawn(async move { drive.stop(StopMode::Ramp).await });
    sleep(5 * SECOND).await;
    let alarms = drive_fleet::Alarms {
        current: Some(drive_core::Current::from_deciamperes(10)),
        ..Default::default()
    };
    let settings = DriveSettings { alarms, ..DriveSettings::controlled("1") };
    assert_eq!(plant.fleet.reconfigure(settings), Ok(()));
    machine.unmute();
    timeout(PATIENCE, machine.wait_until(|machine| !machine.running)).await.expect("it is stopped");
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_called_otherwise_is_the_same_and_its_motor_notices_nothing() {
    let mut plant = plant();
    started(&plant, "1").await;
    started(&plant, "2").await;
    plant.events_so_far().await;
    let (old, before) = (plant.drive("1"), plant.drive("1").snapshot());
    let machine = plant.sites[0].simulated.slave(1).expect("it is there");
    let writes = Plant::writes(&machine);
    let settings = |name: &str| DriveSettings::controlled(name);
    assert_eq!(plant.fleet.rename("1", settings("2")), Err(FleetError::NameTaken("2".to_owned())));
    assert_eq!(plant.fleet.rename("9", settings("8")), Err(FleetError::NoSuchDrive("9".to_owned())));
    let released = plant.fleet.rename("1", DriveSettings::watched("mixer"));
    assert!(matches!(released, Err(FleetError::Setting { .. })), "its policy has to act first: {released:?}");
    assert_eq!(plant.fleet.rename("1", settings("mixer")), Ok(()));
    // At once, and by no other name.
    let names: Vec<_> = plant.fleet.drives().iter().map(|drive| drive.name().to_string()).collect();
    assert_eq!(names, ["mixer", "2"], "it keeps its place");
    assert!(plant.fleet.drive("1").is_none() && &*plant.drive("mixer").snapshot().name == "mixer");
    let renamed = |kind: &EventKind| matches!(kind, EventKind::Renamed(old) if &**old == "1");
    plant.event("the new name", renamed).await;
    sleep(20 * SECOND).await;
    let after = plant.drive("mixer").snapshot();
    assert!(after.lease == before.lease && after.lease.is_some() && after.setpoint == before.setpoint);
    assert!(after.counters.lost == 0 && after.counters.polls > before.counters.polls);
    assert!(runs(&plant, 1) && Plant::writes(&machine) == writes, "nothing is written to it");
    // Who watches it by the old name sees the end of that; a stop by it is a stop.
    let mut watch = old.watch();
    watch.look();
    assert!(watch.changed().await.is_err());
    assert!(old.stop(StopMode::Ramp).await.is_confirmed() && !runs(&plant, 1) && runs(&plant, 2));
    // It leaves by its policy, as every drive does.
    started(&plant, "mixer").await;
    let actions = plant.fleet.remove(&["mixer"], 60 * SECOND).await;
    assert!(matches!(&*actions, [(name, ExitAction::Stopped(_))] if &**name == "mixer"), "{actions:?}");
    assert!(!runs(&plant, 1));
}

#[tokio::test(start_paused = true)]
async fn a_stop_under_way_outlives_another_name() {
    let mut plant = plant();
    started(&plant, "1").await;
    let machine = plant.sites[0].simulated.slave(1).expect("it is there");
    machine.mute();
    let drive = plant.drive("1");
    tokio::spawn(async move { drive.stop(StopMode::Ramp).await });
    sleep(5 * SECOND).await;
    assert_eq!(plant.fleet.rename("1", DriveSettings::controlled("mixer")), Ok(()));
    assert!(plant.drive("mixer").snapshot().stop.is_some());
    machine.unmute();
    timeout(PATIENCE, machine.wait_until(|machine| !machine.running)).await.expect("it is stopped");
    plant.event("its confirmation", |kind| matches!(kind, EventKind::StopConfirmed { .. })).await;
}

#[tokio::test(start_paused = true)]
async fn a_line_is_exchanged_under_a_reader_of_events_who_notices_nothing_of_it() {
    let mut plant = plant();
    connected(&plant, "2").await;
    assert!(plant.fleet.remove_line("line 0").is_none(), "it has drives");
    let _ = plant.fleet.remove(&["1", "2"], 60 * SECOND).await;
    let line = plant.fleet.remove_line("line 0").expect("it has none left");
    line.close().await;
    let site = &plant.sites[0];
    let line = Line::over(site.simulated.in_memory(), site.config());
    let added = plant.fleet.extend(|fleet| {
        let fleet = fleet.line("line 0", line.clone());
        fleet.drive("line 0", 1, DriveSettings::controlled("1"), |port, slave| {
            drives::drive(FAMILY, port, slave)
        })
    });
    assert_eq!(added, Ok(()));
    let ends = plant.events_so_far().await;
    assert!(ends.iter().any(|kind| matches!(kind, EventKind::Removed(_))));
    plant.event("the new connection", |kind| matches!(kind, EventKind::Connected(_))).await;
    let _ = plant.fleet.shutdown(60 * SECOND).await;
    while !matches!(plant.events.recv().await, Received::End) {}
    let late = plant.fleet.extend(|fleet| fleet);
    assert_eq!(late, Err(FleetError::ShutDown));
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_is_left_turning_is_ours_again_where_what_was_left_of_it_is_taken_along() {
    for takes_along in [true, false] {
        let settings = DriveSettings { on_exit: OnExit::Leave, ..DriveSettings::controlled("1") };
        let site = Site::new(SerialSettings::MODBUS_DEFAULT, vec![(FAMILY, 1, settings)]);
        let mut plant = Plant::open(vec![site]).expect("it works");
        started(&plant, "1").await;
        let handle = plant.drive("1");
        assert_eq!(handle.left(), Left::default(), "it has not left");
        let actions = plant.fleet.remove(&["1"], 60 * SECOND).await;
        assert_eq!(actions, [("1".into(), ExitAction::Left)]);
        let line = plant.fleet.remove_line("line 0").expect("it has no drives");
        let left = handle.left();
        assert!(left.run.is_some() && left.identity.is_some(), "{left:?}");
        plant.events_so_far().await;
        let settings = DriveSettings::controlled("under another name");
        let settings = if takes_along { settings.after(left) } else { settings };
        let added = plant.fleet.extend(|fleet| {
            let fleet = fleet.line("another line", line.clone());
            fleet.drive("another line", 1, settings, |port, slave| drives::drive(FAMILY, port, slave))
        });
        assert_eq!(added, Ok(()));
        let drive = plant.drive("under another name");
        drive.ready(PATIENCE).await.expect("it gets ready");
        sleep(5 * SECOND).await;
        assert_eq!(drive.snapshot().started_here(), takes_along);
        let told = plant.events_so_far().await;
        assert_eq!(told.iter().any(|kind| matches!(kind, EventKind::RunAdopted(_))), takes_along, "{told:?}");
        let _ = plant.fleet.shutdown(60 * SECOND).await;
        assert_eq!(runs(&plant, 1), !takes_along, "at the exit a run of ours is stopped, and no other");
    }
}
