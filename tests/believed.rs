//! What a fleet believes of drives by a file is watched for as long as it matters: with the tasks, the line and the twins between.

use std::{sync::Arc, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings};
use drive_families::{Family, SetUp};
use drive_fleet::{ConcernKind, DriveHandle, DriveSettings, Fleet, Outcome};
use drive_profile::{Owner, ProfileDrive, definition, shipped};
use drive_sim::{SimLine, SimSlave, Wiring};
use tokio::time::{Instant, sleep};

/// A001 of a WJ200 (B7 p. 342): who gives the frequency, 3 the bus, 1 the analog input.
const A001: u16 = 0x1200;

/// A fleet of one drive by a file, whose 100 % and highest frequency are 50 Hz on its twin.
fn plant(key: &str, owner: Owner) -> (Fleet, DriveHandle, SimSlave) {
    let profile = Arc::new(shipped::find(key).expect("it is shipped").clone());
    let twin = Family::new(definition(&profile)).machine(SetUp::ForTheBus).expect("it has a twin");
    let settings = SerialSettings::MODBUS_DEFAULT;
    let simulated = SimLine::new(Wiring::rtu(settings));
    let machine = simulated.add_boxed(3, twin).expect("3 is free");
    let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
    let open = move |port, slave| -> Box<dyn drive_core::Drive> {
        Box::new(ProfileDrive::new(port, slave, profile.clone(), owner))
    };
    let fleet = Fleet::builder().line("north", line);
    let fleet = fleet.drive("north", 3, DriveSettings::controlled("pump"), open).start().expect("a fleet");
    let pump = fleet.drive("pump").expect("it is there");
    (fleet, pump, machine)
}

async fn run_at(pump: &DriveHandle, hertz: u16) -> Outcome {
    pump.ready(Duration::from_secs(10)).await.expect("it is ready");
    pump.run(Direction::Forward, Frequency::from_hertz(hertz)).await
}

/// What of this kind is told within half a minute, if anything.
async fn told(pump: &DriveHandle, kind: ConcernKind) -> Option<String> {
    let until = Instant::now() + Duration::from_secs(30);
    loop {
        let concerns = pump.snapshot().concerns(Instant::now());
        if let Some(concern) = concerns.into_iter().find(|concern| concern.kind == kind) {
            return Some(concern.to_string());
        }
        if Instant::now() >= until {
            return None;
        }
        sleep(Duration::from_millis(200)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_setting_that_is_changed_at_the_keypad_of_a_motor_that_runs_is_told_until_it_is_set_back() {
    let owner = Owner::default().with_highest(Frequency::from_hertz(50));
    let (_fleet, pump, machine) = plant("wj200", owner);
    let run = run_at(&pump, 25).await;
    assert!(run.is_confirmed(), "{run}");
    assert_eq!(told(&pump, ConcernKind::SetUpOtherwise).await, None, "all is as it has to be");
    assert!(machine.poke(A001, 1), "at the keypad");
    let said = told(&pump, ConcernKind::SetUpOtherwise).await.expect("it is told");
    assert!(said.contains("set A001 to 3 at the drive"), "{said}");
    assert!(machine.observe().running && pump.snapshot().started_here(), "nothing is stopped by that");
    assert!(machine.poke(A001, 3), "at the keypad");
    sleep(Duration::from_secs(30)).await;
    assert_eq!(told(&pump, ConcernKind::SetUpOtherwise).await, None, "it is set back");
}

#[tokio::test(start_paused = true)]
async fn a_g120_whose_full_scale_is_another_than_its_owner_says_is_told_at_another_frequency_than_was_asked()
{
    for (full_scale, is_told) in [(50, false), (40, true)] {
        let owner = Owner::default().with_full_scale(Frequency::from_hertz(full_scale));
        let (_fleet, pump, machine) = plant("g120", owner);
        // At the reference or not: the start is in force either way.
        let run = run_at(&pump, 20).await;
        let said = told(&pump, ConcernKind::OffSetpoint).await;
        assert_eq!(said.is_some(), is_told, "{full_scale} Hz: {run}, {said:?}");
        assert_eq!(machine.observe().output_frequency, if is_told { 2_500 } else { 2_000 });
        assert!(said.iter().all(|said| said.contains("output 25.00 Hz, setpoint 20.00 Hz")), "{said:?}");
    }
}
