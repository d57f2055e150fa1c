//! Blocks, watchdog, outputs, parameters.

use std::time::Duration;

use drive_atv21::{
    ROWS, StallLevel,
    blocks::{BlockSetUp, Blocks, ReadSlot},
    registers as map,
};
use drive_core::{Direction, Drive, Error, ErrorKind, Reaction, Refusal, Row, State, Watchdog};

use crate::support::{HALF_SPEED, Rig, SECOND, refusal};

fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

#[tokio::test(start_paused = true)]
async fn setting_up_the_blocks_writes_only_what_differs_and_is_used_after_the_reset() {
    let (rig, mut drive) = Rig::factory();
    let before = rig.machine.observe().eeprom_writes;
    assert_eq!(
        drive.set_up_blocks(Blocks::STANDARD).await.unwrap(),
        BlockSetUp { writes: 7, needs_reset: true }
    );
    assert_eq!(rig.machine.observe().eeprom_writes - before, 7);
    assert_eq!(drive.eeprom_writes(), 7);
    // Not in effect yet: the block would show zeros.
    assert_eq!(drive.status().await.unwrap().state, State::Ready);
    rig.power_cycle().await;
    drive.forget();
    assert_eq!(drive.blocks().await.unwrap(), Blocks::STANDARD);
    assert_eq!(
        drive.set_up_blocks(Blocks::STANDARD).await.unwrap(),
        BlockSetUp { writes: 0, needs_reset: false }
    );
    let unknown = Blocks { read: [ReadSlot::Unknown(12); 5], ..Blocks::STANDARD };
    assert!(matches!(drive.set_up_blocks(unknown).await, Err(Error::ValueNotAllowed { value: 12, .. })));
}

#[tokio::test(start_paused = true)]
async fn the_watchdog_is_armed_read_back_and_trips_err5() {
    let (rig, mut drive) = Rig::factory();
    assert_eq!(
        drive.watchdog().await.unwrap(),
        Watchdog { timeout: None, reaction: Some(Reaction::Unknown(4)) }
    );
    let armed = drive.arm_watchdog(2 * SECOND, Reaction::Ramp).await.unwrap();
    assert_eq!(armed, Watchdog { timeout: Some(2 * SECOND), reaction: Some(Reaction::Ramp) });
    let writes = rig.machine.requests(6);
    drive.arm_watchdog(2 * SECOND, Reaction::Ramp).await.unwrap();
    assert_eq!(rig.machine.requests(6), writes, "an equal value is not written to EEPROM");
    let error = drive.arm_watchdog(Duration::from_millis(1_500), Reaction::Ramp).await.unwrap_err();
    assert!(matches!(error, Error::WatchdogTime { .. }), "{error}");
    let error = drive.arm_watchdog(2 * SECOND, Reaction::Fast).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);

    drive.start_at(Direction::Forward, HALF_SPEED).await.unwrap();
    for _ in 0..5 {
        tokio::time::sleep(SECOND).await;
        drive.keep_alive().await.unwrap();
    }
    assert_eq!(rig.machine.observe().trip, None);
    rig.until(|seen| seen.trip == Some(24)).await;
    assert_eq!(drive.status().await.unwrap().state, State::FaultReaction, "it comes down along the ramp");
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present[0].mnemonic(), "Err5");
    assert_eq!(drive.arm_watchdog(SECOND, Reaction::Ignore).await.unwrap().timeout, None);
}

#[tokio::test(start_paused = true)]
async fn outputs_energy_and_stall_level_are_written_and_seen() {
    let (rig, mut drive) = Rig::factory();
    drive.set_relay(true).await.unwrap();
    drive.set_analog_output(1_023).await.unwrap();
    assert!(matches!(drive.set_analog_output(1_024).await, Err(Error::ValueNotAllowed { .. })));
    assert_eq!((rig.machine.peek(0xFA50), rig.machine.peek(0xFA51)), (Some(1), Some(1_023)));
    assert_eq!(drive.measurements().await.unwrap().outputs, Some(1));
    assert_eq!(drive.eeprom_writes(), 0);

    assert!(matches!(refusal(drive.set_stall_level(StallLevel::Oc2).await), Refusal::Settings(_)));
    rig.at_speed(&mut drive).await;
    drive.set_stall_level(StallLevel::Oc2).await.unwrap();
    tokio::time::sleep(36_000 * SECOND).await;
    assert!(drive.measurements().await.unwrap().output_energy > Some(700));
    drive.reset_energy().await.unwrap();
    assert_eq!(drive.measurements().await.unwrap().output_energy, Some(0));
    assert_eq!(rig.machine.peek(0xFA20), Some(0x1000), "the edge is cleared, the stall level stays");
    drive.set_stall_level(StallLevel::Oc1).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn parameters_are_checked_written_once_and_read_back() {
    let (rig, mut drive) = Rig::factory();
    let acceleration = map::ACCELERATION.row();
    assert!(drive.write_parameter(acceleration, 30).await.unwrap().changed);
    assert!(!drive.write_parameter(acceleration, 30).await.unwrap().changed);
    assert_eq!((drive.read_parameter(acceleration).await.unwrap(), drive.eeprom_writes()), (30, 1));
    let before = rig.count();
    assert!(matches!(drive.write_parameter(acceleration, 32_001).await, Err(Error::ValueNotAllowed { .. })));
    let read_only = drive.write_parameter(map::STATUS_WORD.row(), 0).await;
    assert!(matches!(read_only, Err(Error::AccessForbidden { .. })));
    assert_eq!(rig.count(), before);
    assert_eq!(drive.persist().await.unwrap_err().kind(), ErrorKind::Unsupported);
}

#[tokio::test(start_paused = true)]
async fn no_command_and_no_reference_is_written_as_a_parameter() {
    let (rig, mut drive) = Rig::factory();
    for (code, word) in [("FA00", 0xC400), ("FA00", 0x2000), ("FA20", 2), ("FA01", 2_500), ("FA13", 1_500)] {
        let error = drive.write_parameter(row(code), word).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{code}: {error}");
    }
    assert_eq!((rig.count(), rig.machine.observe().running), (0, false));
    // The outputs move no motor.
    assert!(drive.write_parameter(row("FA50"), 1).await.unwrap().changed);
}
