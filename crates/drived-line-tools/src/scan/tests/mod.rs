//! Scans of simulated lines, in virtual time.

mod one;
mod two;

use std::time::Duration;

use drive_bus::{Line, LineConfig, Protocol};
use drive_core::{SerialSettings, SlaveAddress};
use drive_families::{Family, SetUp, simulated};
use drive_sim::{ALWAYS, Dialect, Fault, SimLine, SimSlave, Wiring};
use tokio::time::Instant;

use crate::sim;
use drived_words::failure::Failure;

use super::{
    answer::{Answer, Likeness},
    plan::{Others, Plan, Trial},
    sweep::{Find, Sweep, Told},
};

const WAIT: Duration = Duration::from_millis(100);
/// What changes something in a slave: functions of Modbus, and requests of UNI-TE (writing a word, words, the specific request,
/// clearing counters).
const WRITES: [u8; 6] = [0x05, 0x06, 0x0F, 0x10, 0x16, 0x17];
const UNITE_WRITES: [u8; 4] = [0x14, 0x37, 0xF2, 0xA4];

fn serial(text: &str) -> SerialSettings {
    text.parse().unwrap()
}

fn addresses(numbers: impl IntoIterator<Item = u8>) -> Vec<SlaveAddress> {
    numbers.into_iter().map(|number| number.try_into().unwrap()).collect()
}

fn at_one(settings: &str, numbers: impl IntoIterator<Item = u8>) -> Plan {
    Plan::new(vec![Trial::named(serial(settings), Protocol::Rtu)], &addresses(numbers), WAIT)
}

async fn scanned(simulated: &SimLine, plan: &Plan) -> Vec<Find> {
    scanned_over(
        async |config: LineConfig| Ok(Line::over(simulated.in_memory_at(config.serial), config)),
        plan,
    )
    .await
}

async fn scanned_over(open: impl AsyncFn(LineConfig) -> Result<Line, Failure>, plan: &Plan) -> Vec<Find> {
    found_by(&mut Sweep::new(plan, LineConfig::stream(SerialSettings::MODBUS_DEFAULT), WAIT, open)).await
}

async fn found_by(sweep: &mut Sweep<'_, impl AsyncFn(LineConfig) -> Result<Line, Failure>>) -> Vec<Find> {
    let mut finds = Vec::new();
    let told = |told| {
        finds.extend(match told {
            Told::Found(find) => Some(find),
            Told::At { .. } => None,
        });
        Ok(())
    };
    sweep.run(|_, _| true, told).await.unwrap();
    sweep.close().await;
    finds
}

fn assert_only_read(machines: &[SimSlave]) {
    assert_none(machines, &WRITES);
}

fn assert_none(machines: &[SimSlave], functions: &[u8]) {
    for machine in machines {
        for &write in functions {
            assert_eq!(machine.requests(write), 0, "{}: function {write}", machine.name());
        }
    }
}

#[tokio::test(start_paused = true)]
async fn every_family_is_known_again_and_nothing_is_written_to_it() {
    let mut most = 0;
    for set_up in [SetUp::Factory, SetUp::ForTheBus] {
        let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
        let mut machines = Vec::new();
        for (family, number) in Family::BUILT_IN.into_iter().zip(1..) {
            machines.push(simulated.add_boxed(number, simulated::model(family, set_up).unwrap()).unwrap());
        }
        let finds = scanned(&simulated, &at_one("19200 8N1", 1..=7)).await;
        assert_eq!(finds.len(), 5);
        for (find, family) in finds.iter().zip(Family::BUILT_IN) {
            let Answer::Slave(alike) = &find.answer else { panic!("{find:?}") };
            let [Likeness { family: seen, certain, .. }] = alike[..] else { panic!("{alike:?}") };
            assert_eq!(seen, family);
            assert_eq!(certain, [Family::ATV312, Family::ATV21].contains(&family), "{alike:?}");
            most = most.max(find.found.exchanges);
        }
        assert_only_read(&machines);
        assert_eq!(simulated.violations(), []);
    }
    assert_eq!(most, super::plan::LOOKS);
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_cannot_be_understood_is_told_from_silence() {
    let simulated = SimLine::default();
    simulated.add_boxed(7, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    simulated.set_fault(Fault::Flipped, ALWAYS);
    let finds = scanned(&simulated, &at_one("19200 8E1", 6..=7)).await;
    assert!(
        matches!(&finds[..], [Find { answer: Answer::Damaged(_) | Answer::Two { .. }, .. }]),
        "{finds:?}"
    );
}

#[tokio::test(start_paused = true)]
async fn a_stray_byte_before_each_answer_is_no_second_drive() {
    let simulated = SimLine::default();
    simulated.add_boxed(7, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    simulated.set_fault(Fault::Noise, ALWAYS);
    let finds = scanned(&simulated, &at_one("19200 8E1", 6..=7)).await;
    let [Find { answer: Answer::Slave(alike), .. }] = &finds[..] else { panic!("{finds:?}") };
    assert!(
        matches!(&alike[..], [Likeness { family, certain: true, .. }] if *family == Family::ATV312),
        "{alike:?}"
    );
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_slower_than_the_scan_waits_is_found_and_nobody_else() {
    let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
    let slow = simulated.add_boxed(5, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    slow.set_turnaround(Some(Duration::from_millis(180)));
    let finds = scanned(&simulated, &at_one("19200 8N1", 4..=8)).await;
    let [Find { step, answer: Answer::Slave(_), .. }] = &finds[..] else { panic!("{finds:?}") };
    assert_eq!(step.slave.number(), 5);
}

#[tokio::test(start_paused = true)]
async fn one_read_of_a_watchdog_that_fails_is_no_watchdog_of_a_tenth_of_a_second() {
    for seed in 0..20 {
        let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
        simulated.set_faults(drive_sim::Faults::seeded(seed).with(Fault::Lost, ALWAYS / 20));
        simulated.add_boxed(5, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
        let finds = scanned(&simulated, &at_one("19200 8N1", [5])).await;
        for find in finds {
            assert!(
                find.found.interval.is_none_or(|every| every >= Duration::from_millis(500)),
                "{seed}: {find:?}"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_does_not_come_now_and_then_makes_no_unknown_slave_of_a_drive_that_was_found() {
    for seed in 0..20 {
        let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
        simulated.set_faults(drive_sim::Faults::seeded(seed).with(Fault::Lost, ALWAYS / 30));
        simulated.add_boxed(5, simulated::model(Family::ATV28, SetUp::ForTheBus).unwrap()).unwrap();
        for find in scanned(&simulated, &at_one("19200 8N1", [5])).await {
            let Answer::Slave(alike) = &find.answer else { panic!("{seed}: {find:?}") };
            let families: Vec<_> = alike.iter().map(|alike| alike.family).collect();
            assert_eq!(families, [Family::ATV28], "{seed}: {find:?}");
        }
    }
}

/// Five families at speeds, formats and protocols of their own, on one line.
fn mixed(simulated: &SimLine) -> Vec<(SimSlave, Family, Dialect)> {
    let rtu = |text| Dialect { settings: serial(text), protocol: drive_sim::Protocol::Rtu };
    let of = |text, protocol| Dialect { settings: serial(text), protocol };
    let drives = [
        (1, Family::ATV312, rtu("19200 8E1")),
        (2, Family::ATV312, rtu("4800 8O1")),
        (200, Family::ATV312, rtu("9600 8N2")),
        (1, Family::ATV28, rtu("9600 8N1")),
        (28, Family::ATV28, rtu("19200 8N1")),
        (3, Family::OMRON_3G3EV, rtu("9600 8E1")),
        (4, Family::OMRON_3G3EV, rtu("2400 8O1")),
        (247, Family::ATV21, rtu("19200 8O1")),
        (5, Family::ATV58, rtu("4800 8N1")),
        (6, Family::ATV58, of("9600 7E1", drive_sim::Protocol::Ascii)),
        (7, Family::ATV58, of("19200 7O2", drive_sim::Protocol::Ascii)),
        (8, Family::ATV58, of("19200 8O1", drive_sim::Protocol::UniTelway)),
        (9, Family::ATV58, of("4800 8O1", drive_sim::Protocol::UniTelway)),
    ];
    let add = |(address, family, dialect)| {
        let machine =
            simulated.add_beside(address, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
        machine.set_dialect(dialect);
        (machine, family, dialect)
    };
    drives.into_iter().map(add).collect()
}

#[tokio::test(start_paused = true)]
async fn all_addresses_at_all_settings_find_every_drive_in_the_time_that_was_told_and_write_nothing() {
    let simulated = SimLine::default();
    let machines = mixed(&simulated);
    let plan = Plan::new(Others::default().trials(None), &addresses(1..=247), WAIT);
    let began = Instant::now();
    let finds = scanned(&simulated, &plan).await;
    let taken = began.elapsed();
    for (machine, family, dialect) in &machines {
        let found = finds.iter().find(|find| {
            let trial = &plan.trials[find.step.trial];
            let [is, should] = [trial.serial, dialect.settings]
                .map(|serial| (serial.baud(), serial.format().data_bits(), serial.format().parity()));
            is == should
                && sim::by(trial.protocol) == dialect.protocol
                && find.step.slave.number() == machine.address()
        });
        let Some(Find { answer: Answer::Slave(alike), .. }) = found else {
            panic!("{family} {dialect:?}: {found:?}")
        };
        assert!(alike.iter().any(|likeness| likeness.family == *family), "{family} {dialect:?}: {alike:?}");
        if dialect.protocol == drive_sim::Protocol::UniTelway {
            assert!(alike[0].certain && alike[0].says().unwrap().contains("ATV"), "{alike:?}");
        }
        assert_eq!(machine.observe().trip, None, "{family} {dialect:?}");
    }
    assert_eq!(finds.len(), machines.len(), "{finds:?}");
    let (unite, modbus): (Vec<_>, Vec<_>) =
        machines.into_iter().partition(|(.., dialect)| dialect.protocol == drive_sim::Protocol::UniTelway);
    let of = |machines: Vec<(SimSlave, _, _)>| {
        machines.into_iter().map(|(machine, ..)| machine).collect::<Vec<_>>()
    };
    assert_only_read(&of(modbus));
    assert_none(&of(unite), &UNITE_WRITES);
    let silent = plan.time();
    let told = plan.time_with(&finds.iter().map(|find| find.found).collect::<Vec<_>>());
    println!(
        "{} settings, {} questions: {:.1} s if nobody answers, {:.1} s with those who do, {:.1} s taken",
        plan.trials.len(),
        plan.steps.len(),
        silent.as_secs_f64(),
        told.as_secs_f64(),
        taken.as_secs_f64()
    );
    assert!(taken.abs_diff(told) < told / 10, "{taken:?} {told:?}");
}

#[tokio::test(start_paused = true)]
async fn silence_takes_the_time_that_was_told_at_every_setting() {
    let simulated = SimLine::default();
    for trial in Others::default().trials(None) {
        let plan = Plan::new(vec![trial], &addresses(1..=20), WAIT);
        let began = Instant::now();
        assert_eq!(scanned(&simulated, &plan).await, []);
        let (taken, told) = (began.elapsed(), plan.time());
        assert!(taken.abs_diff(told) < told / 20, "{trial:?}: {taken:?} {told:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_whose_watchdog_is_armed_does_not_trip_while_the_scan_goes_on() {
    let simulated = SimLine::default();
    // n40 is 0 from the factory: after 2 s without a message it trips (§2.1).
    let drive =
        simulated.add_boxed(1, simulated::model(Family::OMRON_3G3EV, SetUp::Factory).unwrap()).unwrap();
    drive.set_dialect(Dialect { settings: serial("9600 8E1"), ..Dialect::default() });
    // ttO of a second and SLL, which trips.
    let other = simulated.add_boxed(2, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    let rows = Family::ATV312.capabilities().rows;
    let tto = rows.iter().find(|row| row.code == "ttO").unwrap();
    assert!(other.poke(tto.address, 10));
    let plan = Plan::new(Others::default().trials(None), &addresses(1..=31), WAIT);
    assert!(plan.time() > Duration::from_secs(60));
    let finds = scanned(&simulated, &plan).await;
    assert_eq!(finds.len(), 2);
    assert_eq!([&drive, &other].map(|machine| machine.observe().trip), [None, None]);
    // The watchdogs are armed indeed.
    tokio::time::sleep(Duration::from_secs(5)).await;
    assert!([&drive, &other].into_iter().all(|machine| machine.observe().trip.is_some()));
    assert_only_read(&[drive, other]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_trips_while_the_scan_goes_on_is_told_as_tripped_and_not_as_one_that_may() {
    let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
    let [during, before, never] = [3, 4, 5].map(|address| {
        simulated.add_boxed(address, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap()
    });
    // SLF, by any cause.
    let code = Family::ATV312.simulated_trip().unwrap();
    before.trip(code);
    let late = during.clone();
    tokio::spawn(async move {
        tokio::time::sleep(Duration::from_secs(4)).await;
        late.trip(code);
    });
    let plan = at_one("19200 8N1", 1..=60);
    let open = async |config: LineConfig| Ok(Line::over(simulated.in_memory_at(config.serial), config));
    let mut sweep = Sweep::new(&plan, LineConfig::stream(serial("19200 8N1")), WAIT, open);
    let mut finds = super::found::Finds::on(LineConfig::stream(serial("19200 8N1")), true);
    let told = |told| match told {
        Told::Found(find) => finds.note(&plan, find),
        Told::At { .. } => Ok(()),
    };
    sweep.run(|_, _| true, told).await.unwrap();
    let tripped = sweep.tripped().await.unwrap();
    let told = finds.trips(&tripped);
    let [first, second, third] = &told[..] else { panic!("{told:?}") };
    assert!(first.starts_with("3 tripped while this scan went on"), "{first}");
    assert!(second.starts_with("4 had tripped when it was found"), "{second}");
    assert!(third.starts_with("5 may trip now"), "{third}");
    assert_only_read(&[during, before, never]);
}

/// BBV51701 p. 17: `ttO` is set from 0.1 s on.
#[tokio::test(start_paused = true)]
async fn a_short_watchdog_is_fed_between_the_questions_to_another_slave_and_during_a_silence() {
    for tto in [5, 3] {
        let simulated = SimLine::default();
        let drive =
            simulated.add_boxed(3, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
        let rows = Family::ATV312.capabilities().rows;
        let address = rows.iter().find(|row| row.code == "ttO").unwrap().address;
        assert!(drive.poke(address, tto));
        // It is asked more than any other, and does not tell its name.
        simulated.add_boxed(8, simulated::model(Family::ATV21, SetUp::Factory).unwrap()).unwrap();
        let finds = scanned(&simulated, &at_one("19200 8E1", 1..=20)).await;
        assert_eq!(finds.len(), 2);
        assert_eq!(drive.observe().trip, None, "{} ms", tto * 100);
        tokio::time::sleep(Duration::from_secs(2)).await;
        assert!(drive.observe().trip.is_some(), "it was armed");
    }
}

/// Whoever answered and does not any more is asked in vain as often as he is fed: the others' half of their watchdog is theirs all the
/// same.
#[tokio::test(start_paused = true)]
async fn a_drive_that_falls_silent_while_it_is_fed_delays_nobody_elses_feeding() {
    for tto in [5, 10] {
        for after in (1_000..4_000).step_by(500).map(Duration::from_millis) {
            let simulated = SimLine::default();
            let rows = Family::ATV312.capabilities().rows;
            let address = rows.iter().find(|row| row.code == "ttO").unwrap().address;
            let [watched, silent] = [3, 4].map(|slave| {
                let model = simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap();
                simulated.add_boxed(slave, model).unwrap()
            });
            assert!(watched.poke(address, tto) && silent.poke(address, tto));
            simulated.add_boxed(8, simulated::model(Family::ATV21, SetUp::Factory).unwrap()).unwrap();
            let mute = silent.clone();
            tokio::spawn(async move {
                tokio::time::sleep(after).await;
                mute.mute();
            });
            let finds = scanned(&simulated, &at_one("19200 8E1", 1..=40)).await;
            assert!(finds.iter().any(|find| find.step.slave.number() == 3), "{finds:?}");
            assert_eq!(watched.observe().trip, None, "{} ms, mute after {after:?}", tto * 100);
        }
    }
}
