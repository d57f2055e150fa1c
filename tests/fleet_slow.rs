//! Long readings on a line that never leaves them the time for all of their exchanges at once: they go on where they were cut.

use std::time::Duration;

use drive_bus::{Protocol, SlaveSettings};
use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{Order, Periods, Until};
use drive_sim::{Exception, Fault, SimSlave};
use drive_testing::rig::Rig;
use support::{
    drives,
    plant::{ADDRESS, Plant, Site, common_settings, controlled},
};
use tokio::time::{Instant, sleep, timeout};

const MS: Duration = Duration::from_millis(1);

/// So many turns are more than any family has exchanges in its slow set; one comes at the latest when a status is old.
const BOUND: Duration = Duration::from_secs(60);

#[tokio::test(start_paused = true)]
async fn measurements_that_are_cut_at_every_turn_are_whole_within_as_many_turns_as_they_have_exchanges() {
    // A third of the oldest age is less than the exchanges of an Altivar 21 take, alone or beside others.
    let alone =
        Periods { running: 150 * MS, rest: 200 * MS, slow: Duration::from_secs(1), max_age: 450 * MS };
    let beside = Periods { running: 300 * MS, rest: 400 * MS, max_age: 900 * MS, ..alone };
    for (periods, families) in
        [(alone, &[Family::ATV21][..]), (beside, &[Family::ATV21, Family::ATV312, Family::OMRON_3G3EV])]
    {
        let member = |(family, address): (&Family, u8)| {
            let mut settings = controlled(*family, &format!("{family} {address}"));
            (settings.periods, settings.watchdog) = (periods, None);
            (*family, address, settings)
        };
        let members: Vec<_> = families.iter().zip(1..).map(member).collect();
        let names: Vec<String> = members.iter().map(|(.., settings)| settings.name.clone()).collect();
        let site = Site::new(common_settings(), members);
        let began = Instant::now();
        let plant = Plant::open_whatever_the_plan(vec![site]).expect("it is built");
        for name in &names {
            let drive = plant.drive(name);
            let measured = drive.wait_until(|snapshot| snapshot.measurements.is_some());
            let snapshot = timeout(BOUND, measured).await.unwrap_or_else(|_| panic!("{name}: never whole"));
            let measured = snapshot.measurements.as_ref().expect("they are there");
            assert!(
                measured.at >= began,
                "{name}: as old as the first of its exchanges, which was asked for here"
            );
            assert!(!measured.value.raw.is_empty(), "{name}: {:?}", measured.value);
        }
    }
}

/// A gateway that does not pass function 43/14 on answers an exception, and takes its time for it.
#[tokio::test(start_paused = true)]
async fn an_identification_that_is_cut_behind_each_exchange_ends_within_as_many_turns_as_it_has_exchanges() {
    const JOB: u8 = 4;
    for (family, refuses) in Family::BUILT_IN.into_iter().flat_map(|family| [(family, false), (family, true)])
    {
        let open = |port, slave| drives::drive(family, port, slave);
        let mut rig = Rig::new(Protocol::Rtu, family.capabilities().factory, drives::machine(family), open);
        // The first question of each is function 43/14.
        let refuse = |machine: &SimSlave| {
            if refuses {
                machine.refuse_next(Exception::FAILURE);
            }
        };
        refuse(&rig.machine);
        let whole = rig.drive.identify().await;
        let exchanges = rig.machine.all_requests();
        rig.drive.forget();
        refuse(&rig.machine);
        let mut turns = 0;
        let told = loop {
            turns += 1;
            let before = rig.machine.all_requests();
            let second = async {
                while rig.machine.all_requests() < before + 2 {
                    sleep(MS).await;
                }
            };
            if let Some(kept) = rig.drive.kept_mut() {
                kept.begin(JOB);
            }
            tokio::select! {
                told = rig.drive.identify() => break told,
                () = second => assert!(turns <= exchanges, "{family}, refuses: {refuses}: {turns} turns"),
            }
        };
        assert_eq!(told.ok(), whole.ok(), "{family}, refuses: {refuses}");
    }
}

/// An answer that comes when its question was given up, every twenty seconds: what it makes doubtful delays others, and neither the
/// slow readings of a drive of many exchanges nor the commands expire for it.
#[tokio::test(start_paused = true)]
async fn one_late_answer_every_20_seconds_keeps_no_measurement_and_no_start_from_anybody() {
    let families = [Family::ATV312, Family::ATV312, Family::ATV312, Family::ATV21];
    let member =
        |(family, address): (Family, u8)| (family, address, controlled(family, &address.to_string()));
    let site = Site::new(common_settings(), families.into_iter().zip(1..).map(member).collect());
    let plant = Plant::open(vec![site]).expect("it is planned to work");
    for drive in plant.fleet.drives() {
        drive.ready(BOUND).await.unwrap_or_else(|refused| panic!("{}: {refused}", drive.name()));
    }
    let [.., altivar_21] = ["1", "2", "3", "4"].map(|name| plant.drive(name));
    for name in ["1", "2", "3"] {
        let outcome = plant.drive(name).run(Direction::Forward, Frequency::from_hertz(30)).await;
        assert!(outcome.is_confirmed(), "{name}: {outcome}");
    }
    let simulated = &plant.sites[0].simulated;
    simulated.set_lateness(300 * MS);
    let requests =
        || ["1", "2", "3", "4"].iter().map(|name| plant.machine_of(name).all_requests()).sum::<u64>();
    let slaves = || plant.lines[0].stats().slaves;
    let in_vain = || slaves().values().map(|slave| slave.outcomes.timeouts).sum::<u64>();
    for round in 0..30 {
        let before = in_vain();
        while in_vain() == before {
            // One question, of whomever it is.
            let asked = requests();
            simulated.set_fault(Fault::Late, 1_000_000);
            while requests() == asked {
                sleep(MS).await;
            }
            sleep(10 * MS).await;
            simulated.set_fault(Fault::Late, 0);
            sleep(200 * MS).await;
        }
        // All reads of an Altivar 21 look alike, so that it is asked nothing until the answer is no more to be feared.
        sleep(2_000 * MS).await;
        if round % 3 == 0 {
            let outcome = altivar_21.run(Direction::Forward, Frequency::from_hertz(20)).await;
            assert!(outcome.is_confirmed(), "round {round}: {outcome}");
            assert!(altivar_21.stop(StopMode::Ramp).await.is_confirmed(), "round {round}");
        }
        sleep(20_000 * MS).await;
        for drive in plant.fleet.drives() {
            let snapshot = drive.snapshot();
            let measured = snapshot.measurements.as_ref().expect("they were read at the start");
            let age = measured.at.elapsed();
            assert!(age <= BOUND, "round {round}, {}: measured {age:?} ago", drive.name());
            assert_eq!(snapshot.counters.lost, 0, "round {round}, {}", drive.name());
        }
    }
    let late: u64 = slaves().values().map(|slave| slave.late).sum();
    assert!(late >= 20, "{late} late answers were heard");
}

/// README, promise 2: nothing of a command is sent behind the time that it says itself, however quickly each of its exchanges goes out. A
/// drive that takes 60 ms for an answer is asked for longer than half a second before its motor turns.
#[tokio::test(start_paused = true)]
async fn no_run_word_goes_to_a_slow_drive_behind_the_time_that_its_start_has_said() {
    for family in Family::BUILT_IN {
        let plant = Plant::single(family, |settings| settings.watchdog = None);
        let (drive, machine) = (plant.motor(), plant.machine());
        drive.ready(BOUND).await.unwrap_or_else(|refused| panic!("{family}: {refused}"));
        machine.set_turnaround(Some(60 * MS));
        sleep(5_000 * MS).await;
        let order = Order::Start {
            direction: Direction::Forward,
            setpoint: Some(Frequency::from_hertz(20).into()),
            until: Until::InForce,
        };
        let begun = Instant::now();
        let in_time = begun + 500 * MS;
        let outcome = drive.order_until(order, in_time).await;
        sleep(3_000 * MS).await;
        let late: Vec<_> = machine
            .received()
            .into_iter()
            .filter(|request| request.at > in_time && matches!(request.pdu.first(), Some(6 | 16)))
            .map(|request| (request.at - begun, request.pdu))
            .collect();
        assert!(late.is_empty(), "{family}: {outcome}, {late:02X?}");
        assert!(outcome.is_confirmed() == machine.observe().running, "{family}: {outcome}");
        // Whoever says no time has it started: what is begun in its second has two more.
        let outcome = drive.run(Direction::Forward, Frequency::from_hertz(20)).await;
        assert!(outcome.is_confirmed(), "{family}: {outcome}");
    }
}

/// README, promise 2: "A command that could not be sent within its lifetime (1 s by default) is never sent at all." Only a start that has begun
/// goes on.
#[tokio::test(start_paused = true)]
async fn a_setpoint_and_a_reset_of_a_slow_drive_are_written_in_their_second_or_never() {
    for (family, answers_after) in
        Family::BUILT_IN.into_iter().flat_map(|family| [60, 180, 300, 450].map(|after| (family, after)))
    {
        for resets in [false, true] {
            let seldom = 30_000 * MS;
            let periods =
                Periods { running: seldom, rest: seldom, slow: Duration::ZERO, max_age: 4 * seldom };
            let plant = Plant::single(family, |settings| {
                (settings.watchdog, settings.periods) = (None, periods);
            });
            let (drive, machine) = (plant.motor(), plant.machine());
            let turnaround = family.capabilities().turnaround;
            let patient = SlaveSettings { response_timeout: Some(2_000 * MS), turnaround };
            plant.lines[0].configure_slave(ADDRESS, patient);
            drive.ready(BOUND).await.unwrap_or_else(|refused| panic!("{family}: {refused}"));
            if resets {
                machine.trip(drives::a_trip(family));
                let tripped = drive.wait_until(|snapshot| snapshot.present_trip().is_some());
                assert!(timeout(BOUND, tripped).await.is_ok(), "{family}");
            }
            machine.set_turnaround(Some(answers_after * MS));
            sleep(5_000 * MS).await;
            let begun = Instant::now();
            let order = if resets {
                Order::ResetFaults
            } else {
                Order::Setpoint { setpoint: Frequency::from_hertz(20).into(), until: Until::InForce }
            };
            let outcome = drive.order(order).await;
            sleep(5_000 * MS).await;
            let writes = |request: &drive_sim::Received| matches!(request.pdu.first(), Some(6 | 16));
            let written =
                machine.received().into_iter().filter(|request| request.at > begun && writes(request));
            let first = written.map(|request| request.at - begun).min();
            // The last bit is on the wire a frame behind the first.
            assert!(
                first.is_none_or(|at| at <= 1_020 * MS),
                "{family}, answers after {answers_after} ms, reset: {resets}: {first:?}, {outcome}"
            );
        }
    }
}
