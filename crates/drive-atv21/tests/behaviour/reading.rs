//! Status, measurements, faults, identity.

use drive_atv21::{
    Alarms, CAPABILITIES, MaintenanceAlarms, ModelEntry, StatusWord,
    blocks::{Blocks, ReadSlot},
};
use drive_core::{Control, Direction, Drive, Fault, Percent, Setpoint, Speed, State, StopMode};
use drive_sim::{Exception, Panel};

use crate::support::{HALF_SPEED, Rig, SECOND};

#[tokio::test(start_paused = true)]
async fn a_status_takes_one_exchange_when_the_block_is_set_up_and_four_when_not() {
    let (rig, mut drive) = Rig::factory();
    drive.status().await.unwrap();
    let before = rig.count();
    drive.status().await.unwrap();
    assert_eq!(rig.count() - before, 4);

    let (rig, mut drive) = Rig::with_blocks().await;
    drive.status().await.unwrap();
    let before = rig.count();
    let status = drive.status().await.unwrap();
    assert_eq!(rig.count() - before, u64::from(CAPABILITIES.status_exchanges));
    assert_eq!((status.state, status.control, status.raw.len()), (State::Ready, None, 5));
    rig.machine.panel(Panel::TakeControl);
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Local));
}

#[tokio::test(start_paused = true)]
async fn a_start_takes_five_exchanges_with_the_block_and_a_stop_two() {
    let (rig, mut drive) = Rig::with_blocks().await;
    drive.status().await.unwrap();
    let before = rig.count();
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.count() - before, 5);
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(rig.count() - before, 7);
}

#[tokio::test(start_paused = true)]
async fn measurements_take_what_the_capabilities_say_and_fewer_with_the_right_block() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    let before = rig.count();
    let values = drive.measurements().await.unwrap();
    assert_eq!(rig.count() - before, u64::from(CAPABILITIES.measurement_exchanges));
    assert_eq!(values.reference, Some(Setpoint::Frequency(HALF_SPEED)));
    assert_eq!(values.speed, Some(Speed::from_rpm(750)));
    assert_eq!(values.output_voltage_share, Some(Percent::from_percent(50)));
    assert_eq!((values.inputs, values.outputs), (Some(0), Some(0)));
    assert_eq!(values.line_voltage, None);
    let slots = [
        ReadSlot::OutputVoltage,
        ReadSlot::OutputSpeed,
        ReadSlot::LogicInputs,
        ReadSlot::LogicOutputs,
        ReadSlot::None,
    ];
    let _ = drive.set_up_blocks(Blocks { read: slots, ..Blocks::default() }).await.unwrap();
    rig.power_cycle().await;
    drive.forget();
    drive.status().await.unwrap();
    let before = rig.count();
    drive.measurements().await.unwrap();
    assert_eq!(rig.count() - before, 12);
}

#[tokio::test(start_paused = true)]
async fn a_block_that_the_drive_refuses_is_replaced_by_single_reads() {
    let (rig, mut drive) = Rig::with_blocks().await;
    drive.status().await.unwrap();
    rig.machine.refuse_next(Exception::ILLEGAL_VALUE);
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Terminals));
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_with_its_history_and_what_was_before_it() {
    let (rig, mut drive) = Rig::factory();
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    rig.machine.trip(999);
    drive.reset_faults().await.unwrap_err();
    tokio::time::sleep(15 * SECOND).await;
    rig.at_speed(&mut drive).await;
    rig.machine.trip(11);
    rig.machine.poke(0xFC91, (Alarms::OVERVOLTAGE | Alarms::from_bits_retain(1 << 6)).bits());
    rig.machine.poke(0xFE79, 0x0005);
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(Fault::mnemonic).collect::<Vec<_>>(), ["OP2"]);
    assert_eq!(faults.history.iter().map(|fault| fault.code).collect::<Vec<_>>(), [11, 999]);
    assert_eq!(faults.warnings.iter().map(|alarm| alarm.code).collect::<Vec<_>>(), [4, 6]);
    let trip = drive.last_trip().await.unwrap();
    assert_eq!((trip.fault.unwrap().code, trip.output_frequency), (11, HALF_SPEED));
    assert!(trip.status.contains(StatusWord::RUN | StatusWord::STANDBY));
    let reference = trip.frozen.iter().find(|word| word.address == 0xFE02).map(|word| word.value);
    assert_eq!(reference, Some(2_500));
    let worn = MaintenanceAlarms::FAN | MaintenanceAlarms::MAIN_CAPACITOR;
    assert_eq!(drive.maintenance().await.unwrap(), worn);
}

#[tokio::test(start_paused = true)]
async fn it_says_which_model_it_is() {
    let (rig, mut drive) = Rig::factory();
    assert_eq!(drive.identify().await.unwrap().model.as_deref(), Some("ATV21H075M3X"));
    assert_eq!(drive.model().await.unwrap(), ModelEntry::lookup(4, 0));
    rig.machine.poke(0xFB05, 3);
    assert_eq!(drive.model().await.unwrap(), None);
}

#[tokio::test(start_paused = true)]
async fn reading_writes_nothing() {
    let (rig, mut drive) = Rig::factory();
    drive.status().await.unwrap();
    drive.measurements().await.unwrap();
    drive.faults().await.unwrap();
    drive.last_trip().await.unwrap();
    drive.identify().await.unwrap();
    drive.watchdog().await.unwrap();
    drive.keep_alive().await.unwrap();
    assert_eq!((rig.machine.requests(6), rig.machine.requests(0x10)), (0, 0));
}

#[tokio::test(start_paused = true)]
async fn no_status_word_and_no_garbage_makes_it_panic() {
    let (rig, mut drive) = Rig::factory();
    for word in (0..=u16::MAX).step_by(251).chain([u16::MAX]) {
        for address in [0xFD01, 0xFD00, 0xFE03, 0xFE45, 0xFC90] {
            rig.machine.poke(address, word);
        }
        rig.machine.poke(0xFC91, word);
        let status = drive.status().await.unwrap();
        assert_eq!(status.raw(0xFD01), Some(word));
        assert_eq!(status.is_fault(), word & 2 != 0);
        assert_eq!(drive.faults().await.unwrap().warnings.len(), word.count_ones() as usize);
    }
}
