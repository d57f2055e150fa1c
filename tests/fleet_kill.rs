//! A process that drives is killed: its drives trip by their own watchdogs, and the next process adopts what it finds
//! without a write. Over a pty, in real time.
#![cfg(unix)]

use std::{env, path::Path, process::Stdio, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, State};
use drive_families::Family;
use drive_fleet::{Fleet, GroupStart, Link, Until, WatchdogCheck};
use drive_sim::{SimLine, Wiring};
use drive_testing::witness::Witnesses;
use support::{drives, plant};
use tokio::process::Command;

/// Every family that has a watchdog which stops it, at its address.
const MEMBERS: [(Family, u8); 3] = [(Family::ATV312, 1), (Family::ATV21, 2), (Family::OMRON_3G3EV, 3)];

/// Tells the process that is to be killed where its drives are.
const LINK: &str = "FLEET_KILL_LINK";

const PATIENCE: Duration = Duration::from_secs(60);

async fn open(link: &Path) -> (Fleet, Line) {
    let config = LineConfig {
        response_timeout: Duration::from_millis(200),
        ..LineConfig::serial(link, SerialSettings::MODBUS_DEFAULT)
    };
    let line = Line::open(config).await.expect("the pty is there");
    let builder = Fleet::builder().line("pty", line.clone());
    let builder = MEMBERS.iter().fold(builder, |builder, (family, address)| {
        let settings = plant::controlled(*family, &family.to_string());
        builder.drive("pty", *address, settings, |port, slave| drives::drive(*family, port, slave))
    });
    (builder.start().expect("it can be fed"), line)
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "it is the process that the other test starts and kills"]
async fn a_process_that_drives_until_it_is_killed() {
    let Some(link) = env::var_os(LINK) else { return };
    let (fleet, _line) = open(Path::new(&link)).await;
    for drive in fleet.drives() {
        drive.ready(PATIENCE).await.expect("it gets ready");
    }
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(20).into()),
        spacing: Duration::ZERO,
        until: Until::AtReference,
    };
    fleet.all().start(start).await.expect("all start");
    std::future::pending::<()>().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn drives_of_a_killed_process_trip_by_their_watchdogs_and_the_next_one_adopts_them_without_a_write() {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let machines = MEMBERS.map(|(family, address)| {
        simulated.add_boxed(address, drives::machine(family)).expect("the address is free")
    });
    let link = env::temp_dir().join(format!("fleet-kill-{}", std::process::id()));
    let _serving = simulated.serve_pty(&link).expect("there is a pty");

    let mut process = Command::new(env::current_exe().expect("a test has a path"))
        .args(["--exact", "a_process_that_drives_until_it_is_killed", "--ignored"])
        .env(LINK, &link)
        .stdout(Stdio::null())
        .kill_on_drop(true)
        .spawn()
        .expect("it starts");
    for machine in &machines {
        machine.wait_until(|machine| machine.output_frequency == 2_000).await;
    }
    process.kill().await.expect("it can be killed");
    for machine in &machines {
        machine.wait_until(|machine| machine.trip.is_some() && !machine.running).await;
    }

    let writes: Vec<u64> = machines.iter().map(plant::Plant::writes).collect();
    let (fleet, line) = open(&link).await;
    let witnesses = Witnesses::of_fleet(&fleet, [("pty", &simulated)]);
    for (drive, (family, _)) in fleet.drives().iter().zip(MEMBERS) {
        let verified = drive.wait_until(|snapshot| matches!(snapshot.watchdog, WatchdogCheck::Verified(_)));
        let snapshot =
            tokio::time::timeout(PATIENCE, verified).await.expect("its watchdog is as it was left");
        assert_eq!(snapshot.link, Link::Connected);
        let status = snapshot.status.as_ref().expect("it is connected");
        assert_eq!(status.value.state, State::Fault, "{family}");
        let explained =
            drive.wait_until(|snapshot| snapshot.trips.back().is_some_and(|trip| trip.faults.is_some()));
        let snapshot = tokio::time::timeout(PATIENCE, explained).await.expect("it says why it tripped");
        let faults = snapshot.trips.back().and_then(|trip| trip.faults.clone()).expect("it was read");
        let present: Vec<u16> = faults.present.iter().map(|fault| fault.code).collect();
        assert_eq!(present, drives::communication_trips(family), "{family}");
    }
    let after: Vec<u64> = machines.iter().map(plant::Plant::writes).collect();
    assert_eq!(after, writes, "nothing is written until somebody commands");
    drop((witnesses, fleet));
    line.close().await;
}
