//! What is told of a command when the runtime of its fleet ends before it is known what became of it. `Refused` says that nothing moved
//! because of it, and `NotReady` that nobody was started: neither is told of what was sent, or may have been.

use std::time::Duration;

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, ErrorKind, Frequency, SerialSettings, StopMode};
use drive_fleet::{
    DriveHandle, DriveSettings, Fleet, GroupFailure, GroupStart, Outcome, Refused, Unconfirmed, Until,
};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312};
use tokio::{
    runtime::{Builder, Runtime},
    time::sleep,
};

/// A fleet on a runtime of its own, whose drives are ready.
struct Plant {
    runtime: Runtime,
    _site: SimLine,
    fleet: Fleet,
    machines: Vec<SimSlave>,
}

impl Plant {
    fn ready(drives: u8) -> Self {
        let runtime = Builder::new_current_thread().enable_all().start_paused(true).build().unwrap();
        let settings = SerialSettings::MODBUS_DEFAULT;
        let (site, fleet, machines) = runtime.block_on(async {
            let site = SimLine::new(Wiring::rtu(settings));
            let line = Line::over(site.in_memory(), LineConfig::stream(settings));
            let mut builder = Fleet::builder().line("north", line);
            let mut machines = Vec::new();
            for slave in 1..=drives {
                machines.push(site.add(slave, atv312::Atv312::under_bus_control()).unwrap());
                let drive = DriveSettings::controlled(format!("pump {slave}"));
                builder =
                    builder.drive("north", slave, drive, |port, slave| Box::new(Atv312::new(port, slave)));
            }
            let fleet = builder.start().unwrap();
            for drive in fleet.drives() {
                drive.ready(Duration::from_secs(10)).await.unwrap();
            }
            (site, fleet, machines)
        });
        Self { runtime, _site: site, fleet, machines }
    }

    fn pump(&self) -> DriveHandle {
        self.fleet.drive("pump 1").unwrap()
    }

    /// The runtime ends once the first motor is driven.
    fn ends_when_driven(self) -> Vec<SimSlave> {
        self.runtime.block_on(self.machines[0].wait_until(|seen| seen.running));
        self.machines
    }
}

/// It is there at once: whoever would tell it later has ended.
fn told<T>(outcome: impl Future<Output = T>) -> T {
    let runtime = Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(outcome)
}

fn abandoned(outcome: &Outcome) -> bool {
    matches!(outcome, Outcome::OutcomeUnknown(unknown) if unknown.abandoned)
}

#[test]
fn a_start_that_was_sent_when_its_runtime_ended_is_unknown_and_not_refused() {
    let plant = Plant::ready(1);
    let start = plant.pump().start_at(Direction::Forward, Frequency::from_hertz(20));
    let machines = plant.ends_when_driven();
    let outcome = told(start.finished());
    assert!(machines[0].observe().running);
    assert!(abandoned(&outcome), "{outcome}");
}

#[test]
fn an_order_that_was_not_begun_when_its_runtime_ended_is_refused() {
    let plant = Plant::ready(1);
    let start = plant.pump().start_at(Direction::Forward, Frequency::from_hertz(20));
    let stop = plant.pump().stop(StopMode::Ramp);
    let machines = plant.machines.clone();
    drop(plant);
    assert!(!machines[0].observe().running);
    assert_eq!(told(start.finished()), Outcome::Refused(Refused::ShutDown));
    assert_eq!(told(stop.finished()), Outcome::Refused(Refused::ShutDown));
}

#[test]
fn a_stop_that_was_sent_when_its_runtime_ended_is_unknown_and_not_refused() {
    let plant = Plant::ready(1);
    plant.runtime.block_on(async {
        assert!(plant.pump().run(Direction::Forward, Frequency::from_hertz(50)).await.is_confirmed());
    });
    let (stop, another) = (plant.pump().stop(StopMode::Ramp), plant.pump().stop(StopMode::Ramp));
    plant.runtime.block_on(async {
        assert!(stop.in_force().await.is_confirmed());
    });
    drop(plant);
    for stop in [stop, another] {
        let outcome = told(stop.finished());
        assert!(abandoned(&outcome), "{outcome}");
    }
}

#[test]
fn a_group_whose_first_motor_turned_when_its_runtime_ended_is_not_told_as_one_of_which_nobody_was_started() {
    let plant = Plant::ready(2);
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(20).into()),
        spacing: Duration::ZERO,
        until: Until::InForce,
    };
    let start = plant.fleet.all().start(start);
    let machines = plant.ends_when_driven();
    let outcome = told(start.finished());
    assert!(machines[0].observe().running);
    let Err(GroupFailure::Abandoned(outcomes)) = outcome else { panic!("{outcome:?}") };
    let [(first, of_first), (second, of_second)] = &outcomes[..] else { panic!("{outcomes:?}") };
    assert_eq!((&**first, &**second), ("pump 1", "pump 2"));
    assert!(abandoned(of_first), "{of_first}");
    // Its setpoint was given before the first start, and its run word was not.
    let setpoint = Frequency::from_hertz(20).into();
    assert!(
        matches!(of_second, Outcome::NotConfirmed(Unconfirmed::NotStarted { setpoint: given, .. }) if *given == setpoint),
        "{of_second}"
    );
}

#[test]
fn a_group_that_was_not_begun_when_its_runtime_ended_is_told_as_one_of_which_nobody_was_started() {
    let plant = Plant::ready(2);
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: None,
        spacing: Duration::ZERO,
        until: Until::InForce,
    };
    let start = plant.fleet.all().start(start);
    drop(plant);
    let outcome = told(start.finished());
    assert!(matches!(&outcome, Err(GroupFailure::NotReady(nobody)) if nobody.len() == 2), "{outcome:?}");
}

#[test]
fn a_setpoint_of_a_group_that_was_sent_when_its_runtime_ended_is_not_refused() {
    let plant = Plant::ready(1);
    let pump = plant.pump();
    let setpoint = plant.runtime.block_on(async {
        assert!(pump.run(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
        let setpoint = plant.fleet.all().set_setpoint(Frequency::from_hertz(30));
        plant.machines[0].wait_until(|seen| seen.setpoint == 3_000).await;
        setpoint
    });
    drop(plant);
    let outcomes = told(setpoint.finished());
    assert!(matches!(&outcomes[..], [(_, outcome)] if abandoned(outcome)), "{outcomes:?}");
}

#[test]
fn a_parameter_that_was_being_written_when_its_runtime_ended_is_not_told_as_refused() {
    let plant = Plant::ready(1);
    let pump = plant.pump();
    let row = drive_atv312::registers::ACC.row();
    let asker = std::thread::spawn(move || told(pump.write_parameter(row, 77)));
    plant.runtime.block_on(async {
        while plant.machines[0].peek(row.address) != Some(77) {
            sleep(Duration::from_millis(1)).await;
        }
    });
    drop(plant);
    let told = asker.join().unwrap();
    assert!(
        matches!(&told, Err(Refused::Drive(error)) if error.kind() == ErrorKind::OutcomeUnknown),
        "{told:?}"
    );
}
