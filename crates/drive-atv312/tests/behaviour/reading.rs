//! Status, faults, identity: what the drive says.

use drive_atv312::words::FaultState;
use drive_core::{Control, Drive, ErrorKind, State, StopMode};
use drive_sim::Exception;
use drive_testing::bench::writes;

use crate::support::{commands, rig, running};

#[tokio::test(start_paused = true)]
async fn a_fault_is_read_with_its_meaning_reset_once_and_nothing_restarts() {
    let (mut drive, machine, _line) = running().await;
    machine.trip(17);
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(drive_core::Fault::mnemonic).collect::<Vec<_>>(), ["OLF"]);
    assert!(faults.present[0].remedy().is_some());
    assert_eq!(faults.reset_allowed, Some(true));
    assert_eq!(drive.error_code().await.unwrap(), 0x1000);
    let before = commands(&machine).len();
    let status = drive.reset_faults().await.unwrap();
    assert_eq!(status.state, State::Disabled);
    assert_eq!(commands(&machine)[before..], [0x0080, 0x0000]);
    assert!(!machine.observe().running);
    let faults = drive.faults().await.unwrap();
    assert!(faults.present.is_empty(), "LFt stays, but it is not present");
    assert_eq!(faults.reset_allowed, None);
    machine.trip(9);
    let past = drive.past_faults().await.unwrap();
    assert_eq!(past[0].fault.map(|fault| fault.code), Some(17));
    assert!(past[0].state.contains(FaultState::MOTOR_RUNNING));
    assert_eq!(past[0].state.control(), Control::Bus);
    assert_eq!(past[1].fault, None);
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_a_fault_is_not_reset() {
    let (mut drive, machine, _line) = running().await;
    let before = writes(&machine);
    drive.reset_faults().await.unwrap();
    assert_eq!(writes(&machine), before);
    assert!(machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn it_says_what_it_is() {
    let (mut drive, machine, _line) = rig();
    let identity = drive.identify().await.unwrap();
    assert_eq!(identity.vendor.as_deref(), Some("TELEMECANIQUE"));
    assert_eq!(identity.model.as_deref(), Some("ATV312HU15N4"));
    let codes: Vec<_> = identity.codes.iter().map(|word| (word.code, word.value)).collect();
    let expected = [("ARE", 0), ("NCV", 6), ("VCAL", 3), ("INV", 41), ("UdP", 0x1204), ("TSP", 128)];
    assert_eq!(codes, expected);
    // A drive that refuses function 43 is told by its words.
    machine.refuse_next(Exception::ILLEGAL_FUNCTION);
    let identity = drive.identify().await.unwrap();
    assert_eq!((identity.vendor, identity.codes.len()), (None, 6));
}

#[tokio::test(start_paused = true)]
async fn status_is_one_exchange_and_measurements_are_as_many_as_the_capabilities_say() {
    let (mut drive, machine, _line) = running().await;
    // What tells the ramp comes along with the first ones behind a start.
    for _ in 0..4 {
        drive.status().await.unwrap();
    }
    let count = machine.all_requests();
    drive.status().await.unwrap();
    assert_eq!(machine.all_requests() - count, u64::from(drive.capabilities().status_exchanges));
    let count = machine.all_requests();
    let measured = drive.measurements().await.unwrap();
    assert_eq!(machine.all_requests() - count, u64::from(drive.capabilities().measurement_exchanges));
    assert_eq!(measured.line_voltage.unwrap().to_string(), "400.0 V");
    assert_eq!(measured.outputs, Some(0x0100));
    assert_eq!(machine.requests(0x10), 0, "nothing is written by looking");
}

#[tokio::test(start_paused = true)]
async fn a_mute_drive_is_no_answer_and_never_a_stop() {
    let (mut drive, machine, _line) = running().await;
    machine.mute();
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert!(
        matches!(error.kind(), ErrorKind::NoAnswer | ErrorKind::OutcomeUnknown | ErrorKind::NotSent),
        "{error}"
    );
    assert!(machine.observe().running);
}
