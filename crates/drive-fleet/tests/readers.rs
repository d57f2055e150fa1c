//! A reader that holds what it was given of a drive, for as long as it likes, holds up nobody. On real threads and in real time: it is
//! threads that such a reader would hold up.

use std::{
    sync::mpsc::{Receiver, Sender, channel},
    thread,
    time::{Duration, Instant},
};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, Fleet, Received};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312};
use tokio::runtime::{Builder, Runtime};

/// For that long it is waited for what has to come: much longer than it takes.
const PATIENCE: Duration = Duration::from_secs(20);

fn runtime() -> Runtime {
    Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap()
}

/// Two motors that run, on a line in a runtime of its own.
fn running(plant: &Runtime, ours: &Runtime) -> (Fleet, [SimSlave; 2]) {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let site = SimLine::new(Wiring::rtu(settings));
    let machines = [1, 2].map(|slave| site.add(slave, atv312::Atv312::under_bus_control()).unwrap());
    // `SLL` 0: no watchdog of theirs stops them meanwhile.
    assert!(machines.iter().all(|machine| machine.poke(7010, 0)));
    let stream = {
        let _plant = plant.enter();
        site.in_memory()
    };
    let fleet = ours.block_on(async {
        let mut builder = Fleet::builder().line("north", Line::over(stream, LineConfig::stream(settings)));
        for slave in 1..=2 {
            let drive = DriveSettings::controlled(format!("pump {slave}"));
            builder = builder.drive("north", slave, drive, |port, slave| Box::new(Atv312::new(port, slave)));
        }
        let fleet = builder.start().unwrap();
        for drive in fleet.drives() {
            drive.ready(PATIENCE).await.unwrap();
            let started = drive.start_at(Direction::Forward, Frequency::from_hertz(20)).await;
            assert!(started.is_confirmed(), "{started}");
        }
        fleet
    });
    (fleet, machines)
}

/// No runtime of these tests runs on their own threads.
#[expect(clippy::disallowed_methods, reason = "it blocks a thread without a runtime, as such a reader does")]
fn wait(time: Duration) {
    thread::sleep(time);
}

/// Both motors come to their stop while a reader of the first holds what `hold` holds. It says when it does, and holds until it is let go.
fn motors_are_stopped_while(hold: impl FnOnce(DriveHandle, Sender<()>, Receiver<()>) + Send + 'static) {
    let (plant, ours) = (runtime(), runtime());
    let (fleet, machines) = running(&plant, &ours);
    let pump = fleet.drive("pump 1").unwrap();
    let ((says, hears), (let_go, until_let_go)) = (channel(), channel());
    let reader = thread::spawn(move || hold(pump, says, until_let_go));
    hears.recv_timeout(PATIENCE).unwrap();
    // By then something new was to be told of the drive.
    wait(Duration::from_secs(1));
    // Not from here: this thread is to say that it does not come back.
    thread::spawn(move || drop(fleet.stop_all(StopMode::Ramp)));
    let over = Instant::now() + PATIENCE;
    while machines.iter().any(|machine| machine.observe().running) {
        assert!(Instant::now() < over, "a reader holds the stops up");
        wait(Duration::from_millis(10));
    }
    assert!(!reader.is_finished(), "it was not held any more");
    let_go.send(()).unwrap();
    reader.join().unwrap();
}

#[test]
fn as_many_readers_as_were_asked_for_get_what_happens_from_the_start_of_the_fleet() {
    let ours = runtime();
    ours.block_on(async {
        let settings = SerialSettings::MODBUS_DEFAULT;
        let site = SimLine::new(Wiring::rtu(settings));
        site.add(1, atv312::Atv312::under_bus_control()).unwrap();
        let line = Line::over(site.in_memory(), LineConfig::stream(settings));
        let pump = DriveSettings::controlled("pump");
        let fleet = Fleet::builder()
            .line("north", line)
            .drive("north", 1, pump, |port, slave| Box::new(Atv312::new(port, slave)))
            .readers_from_the_start(3)
            .start()
            .unwrap();
        fleet.drive("pump").unwrap().ready(PATIENCE).await.unwrap();
        let mut readers = [fleet.events(), fleet.events(), fleet.events()];
        for reader in &mut readers {
            let first = tokio::time::timeout(PATIENCE, reader.recv()).await.unwrap();
            let Received::Event(first) = first else { panic!("{first:?}") };
            assert_eq!(first.kind.name(), "connected");
        }
    });
}

#[test]
fn a_reader_that_keeps_what_it_was_given_holds_up_no_stop() {
    motors_are_stopped_while(|pump, says, until_let_go| {
        let watch = pump.watch();
        let snapshot = watch.now();
        says.send(()).unwrap();
        let _ = until_let_go.recv();
        drop(snapshot);
    });
}

#[test]
fn a_reader_that_takes_its_time_to_judge_a_snapshot_holds_up_no_stop() {
    motors_are_stopped_while(|pump, says, until_let_go| {
        let judging = pump.wait_until(|_| {
            says.send(()).unwrap();
            let _ = until_let_go.recv();
            true
        });
        Builder::new_current_thread().build().unwrap().block_on(judging);
    });
}
