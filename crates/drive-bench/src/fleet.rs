//! A whole plant over many lines full of drives, each with its registers, in virtual time: what a drive costs in memory and in
//! processor, how old what is known of it becomes, and what a stop of all of them takes. The wires take the time that wires take, and what
//! this machine has to do for them takes none: that is told as processor time beside it.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, StopMode, serial::SerialSettings};
use drive_families::{Family, SetUp};
use drive_fleet::{DriveSettings, Fleet, Freshness, GroupStart, Periods, Until};
use drive_sim::{SimLine, SimSlave, Wiring};
use drived_config::rights::{Caller, Rights};
use drived_plant::plant::{
    Plant,
    commands::{Action, LIFETIME, OutcomeWord, Request, Target},
};
use tokio::time::{Instant, sleep};

use crate::{
    Error,
    queued::Queued,
    report::{Goal, Report, Unit, millis, quantile},
    rig::{DRIVES, virtual_runtime},
    usage::{memory_kib, processor_time},
};

const SECTION: &str = "fleet";

/// Periods that a full line keeps, as a configuration of 31 drives has them that leaves room for others.
const PERIODS: Periods = Periods {
    running: Duration::from_secs(3),
    rest: Duration::from_secs(3),
    slow: Duration::from_secs(60),
    max_age: Duration::from_secs(10),
};
/// Until every drive has been asked who it is, and is polled in its turn.
const SETTLE: Duration = Duration::from_secs(30);
/// What a stop may take until it waits for its line, as at every door.
const GIVEN_MS: f64 = 50.0;
const LOOK: Duration = Duration::from_millis(100);
/// Nothing that is waited for takes longer.
const PATIENCE: Duration = Duration::from_secs(120);

/// Measures a tenth of so many lines and all of them: what grows faster than they do is seen by the two.
pub(crate) fn measure(report: &mut Report, time: Duration, most: u16) -> Result<(), Error> {
    let before = memory_kib()?;
    for lines in [most / 10, most].into_iter().filter(|lines| *lines > 0) {
        virtual_runtime()?.block_on(one(report, time, lines, before))?;
    }
    Ok(())
}

async fn one(report: &mut Report, time: Duration, lines: u16, before: u64) -> Result<(), Error> {
    let name = |what: &str| format!("{lines} lines x {DRIVES} drives: {what}");
    let number = f64::from(lines) * f64::from(DRIVES);
    let sites = (0..lines).map(|_| simulated()).collect::<Result<Vec<_>, _>>()?;
    let machines_hold = memory_kib()?.saturating_sub(before);

    let begun = processor_time();
    let fleet = fleet(&sites)?;
    let plant = Plant::start(fleet.clone(), Vec::new(), false);
    let built = processor_time().saturating_sub(begun);
    report.note(SECTION, name("processor time until all are there"), Unit::Millis, millis(built));
    sleep(SETTLE).await;

    let (began, used) = (Instant::now(), processor_time());
    let (mut ages, mut old) = (Vec::new(), 0_u64);
    let drives = fleet.drives();
    while began.elapsed() < time {
        sleep(LOOK).await;
        let now = Instant::now();
        for snapshot in drives.iter().map(drive_fleet::DriveHandle::snapshot) {
            ages.extend(snapshot.status.as_ref().map(|status| status.age(now)));
            old += u64::from(snapshot.freshness(now) != Freshness::Fresh);
        }
    }
    let used = processor_time().saturating_sub(used);
    let processors = used.as_secs_f64() / began.elapsed().as_secs_f64();
    report.note(SECTION, name("processors that it would take, the drives included"), Unit::Times, processors);
    let looks = ages.len();
    for (quantile_name, per_mille) in [("p50", 500), ("p99", 990), ("the oldest", 1_000)] {
        let age = quantile(&mut ages, per_mille).as_secs_f64() / PERIODS.rest.as_secs_f64();
        let what = format!("age of a status by its period, of {looks}: {quantile_name}");
        report.note(SECTION, name(&what), Unit::Times, age);
    }
    report.row(
        SECTION,
        name("statuses that are missing or too old"),
        Unit::Count,
        old as f64,
        Goal::AtMost(0.0),
    );
    let held = memory_kib()?.saturating_sub(before + machines_hold) as f64;
    // What was looked at is this measurement's own.
    let own = (looks * size_of::<Duration>()) as f64 / 1_024.0;
    let what = format!("memory of a drive in a plant after {} s", (SETTLE + time).as_secs());
    report.note(SECTION, name(&what), Unit::KiB, (held - own) / number);
    drop(ages);

    run_all(&fleet).await?;
    stop_all(report, &name, &plant, &sites).await?;
    drop(plant);
    change_all(report, &name, &fleet).await
}

/// What a reload does to each drive, done to all of them: other settings, another name, and out.
async fn change_all(report: &mut Report, name: &impl Fn(&str) -> String, fleet: &Fleet) -> Result<(), Error> {
    let mut note = |what: &str, since: Duration| {
        let used = millis(processor_time().saturating_sub(since));
        report.note(SECTION, name(&format!("processor time until all {what}")), Unit::Millis, used);
    };
    let all: Vec<_> = fleet.drives().iter().map(drive_fleet::DriveHandle::settings).collect();
    let used = processor_time();
    for settings in &all {
        fleet.reconfigure(DriveSettings::clone(settings))?;
    }
    note("have other settings", used);
    let renamed = |settings: &DriveSettings| format!("another {}", settings.name);
    let used = processor_time();
    for settings in &all {
        let new = DriveSettings { name: renamed(settings), ..DriveSettings::clone(settings) };
        fleet.rename(&settings.name, new)?;
    }
    note("have another name", used);
    let names: Vec<String> = all.iter().map(|settings| renamed(settings)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let used = processor_time();
    let removed = fleet.remove(&names, Duration::ZERO);
    note("are on their way out", used);
    let removed = removed.await.len();
    note("are out", used);
    match fleet.drives().len() {
        0 if removed == all.len() => Ok(()),
        left => Err(format!("{removed} of {} were taken out, and {left} are left", all.len()).into()),
    }
}

/// A line full of drives, set up for the bus.
fn simulated() -> Result<SimLine, Error> {
    let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    for slave in 1..=DRIVES {
        let machine = Family::ATV312.machine(SetUp::ForTheBus).ok_or("nobody simulates it")?;
        line.add_boxed(slave, machine)?;
    }
    Ok(line)
}

fn fleet(sites: &[SimLine]) -> Result<Fleet, Error> {
    let mut builder = Fleet::builder();
    for (number, site) in sites.iter().enumerate() {
        let line = format!("line {number}");
        let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
        builder = builder.line(line.clone(), Line::over(site.in_memory(), config));
        for slave in 1..=DRIVES {
            let settings =
                DriveSettings { periods: PERIODS, ..DriveSettings::controlled(format!("{number}/{slave}")) };
            builder = builder.drive(&line, slave, settings, |port, slave| Family::ATV312.open(port, slave));
        }
    }
    Ok(builder.start()?)
}

/// Starts every drive, line by line at once.
async fn run_all(fleet: &Fleet) -> Result<(), Error> {
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(30).into()),
        spacing: Duration::ZERO,
        until: Until::InForce,
    };
    let groups: Vec<_> =
        fleet.lines().iter().map(|(line, _)| fleet.group_of(fleet.drives_on(line)).start(start)).collect();
    for group in groups {
        group.await.map_err(|failure| failure.to_string())?;
    }
    Ok(())
}

async fn stop_all(
    report: &mut Report,
    name: &impl Fn(&str) -> String,
    plant: &Plant,
    sites: &[SimLine],
) -> Result<(), Error> {
    let queued = Queued::default();
    let _heard = tracing::subscriber::set_default(queued.clone());
    let bound = plant.fleet().plan("line 0").ok_or("the line has no plan")?.stop_all(0);
    let caller = Caller::new("bench", "bench", Rights::ALL);
    let mut run: Vec<SimSlave> = sites.iter().flat_map(SimLine::slaves).collect();
    queued.expect(run.len());
    let (arrived, used) = (Instant::now(), processor_time());
    let action = Action::Stop(StopMode::Ramp.into());
    let request =
        Request { id: None, target: Target::All, action, lifetime: LIFETIME, arrived, expects: None };
    let mut told = plant.begin(&caller, request)?;
    let given = processor_time().saturating_sub(used);
    let what = name("a stop of all: processor time until it is given to each");
    report.row(SECTION, what, Unit::Millis, millis(given), Goal::AtMost(GIVEN_MS));

    while !run.is_empty() {
        if arrived.elapsed() > PATIENCE {
            return Err(format!("{} drives run behind a stop of all", run.len()).into());
        }
        sleep(Duration::from_millis(10)).await;
        // The run command is gone from a machine when it steers for standstill.
        run.retain(|machine| {
            let seen = machine.observe();
            seen.running && seen.setpoint != 0
        });
    }
    let taken = arrived.elapsed();
    let last = queued.last().ok_or("not every stop was in the queue of its line")?;
    let what = name("… until that of each is in the queue of its line");
    report.row(SECTION, what, Unit::Millis, millis(last.saturating_sub(used)), Goal::AtMost(GIVEN_MS));
    report.row(
        SECTION,
        name("… until the last drive has it, by the bound that its line tells"),
        Unit::Times,
        taken.as_secs_f64() / bound.as_secs_f64(),
        Goal::AtMost(1.0),
    );
    report.note(SECTION, name("… until the last drive has it"), Unit::Millis, millis(taken));
    let view = told.wait_for(|view| view.outcome != OutcomeWord::Pending);
    let outcome = tokio::time::timeout(PATIENCE, view)
        .await
        .map_err(|_| "nothing has become of a stop of all")??
        .outcome;
    let (took, used) = (arrived.elapsed(), processor_time().saturating_sub(used));
    if outcome != OutcomeWord::Confirmed {
        return Err(format!("a stop of all ended as {outcome:?}").into());
    }
    report.note(SECTION, name("… until all is confirmed"), Unit::Millis, millis(took));
    let processors = used.as_secs_f64() / took.as_secs_f64();
    report.note(SECTION, name("… processors that it would take meanwhile"), Unit::Times, processors);
    Ok(())
}
