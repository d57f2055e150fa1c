//! Status, measurements, faults, identity.

use drive_atv21::{Alarms, CAPABILITIES, MaintenanceAlarms, ModelEntry, ROWS, StatusWord};
use drive_core::{
    Control, Direction, Drive, Fault, Frequency, Percent, Row, Setpoint, Speed, State, StopMode, Verdict,
};
use drive_sim::{Exception, Panel};
use drive_testing::bench;

use crate::support::{HALF_SPEED, Rig, SECOND};

#[tokio::test(start_paused = true)]
async fn a_status_takes_two_exchanges_when_the_block_is_set_up_and_four_when_not() {
    let (rig, mut drive) = Rig::factory();
    drive.status().await.unwrap();
    let before = rig.count();
    drive.status().await.unwrap();
    assert_eq!(rig.count() - before, u64::from(CAPABILITIES.status_exchanges));

    let (rig, mut drive) = Rig::with_blocks_shown().await;
    rig.at_rest(&mut drive).await;
    // What FD01 shows anew may come from another FA00, which is read once.
    drive.status().await.unwrap();
    let before = rig.count();
    let status = drive.status().await.unwrap();
    assert_eq!(rig.count() - before, 2);
    assert_eq!((status.state, status.control, status.raw.len()), (State::Ready, Some(Control::Bus), 4));
    rig.machine.panel(Panel::TakeControl);
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Panel));
}

#[tokio::test(start_paused = true)]
async fn what_proves_a_run_command_costs_a_tenth_of_the_statuses_and_one_exchange_of_each_at_most() {
    let both = [(Rig::factory(), 4, 40), (Rig::with_blocks_shown().await, 2, 24)];
    for (mut rigged, of_a_status, turns) in both {
        let (rig, drive) = (&rigged.0, &mut rigged.1);
        rig.at_speed(drive).await;
        drive.status().await.unwrap();
        let begun = rig.count();
        for _ in 0..120 {
            let before = rig.count();
            assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
            assert!(rig.count() - before <= of_a_status + 1);
        }
        let exchanges = rig.count() - begun;
        // A turn may have been paid for before.
        let whole = 120 * of_a_status + turns;
        assert!((whole..=whole + 1).contains(&exchanges), "{exchanges} of 120 statuses");
    }
}

#[tokio::test(start_paused = true)]
async fn a_status_of_a_turning_motor_takes_what_the_capabilities_say_and_one_for_the_stop_at_most() {
    for (rig, mut drive) in [Rig::factory(), Rig::with_blocks().await] {
        rig.at_speed(&mut drive).await;
        for _ in 0..5 {
            let before = rig.count();
            drive.status().await.unwrap();
            assert!(rig.count() - before <= u64::from(CAPABILITIES.status_exchanges) + 1);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_takes_eleven_exchanges_with_the_block_and_a_stop_four() {
    let (rig, mut drive) = Rig::with_blocks_shown().await;
    rig.at_rest(&mut drive).await;
    let before = rig.count();
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.count() - before, 11, "43/14 among them");
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(rig.count() - before, 15);
}

#[tokio::test(start_paused = true)]
async fn measurements_take_what_the_capabilities_say() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    let before = rig.count();
    drive.measurements().await.unwrap();
    assert_eq!(rig.count() - before, u64::from(CAPABILITIES.measurement_exchanges) + 5, "and F875 to F879");
    let before = rig.count();
    let values = drive.measurements().await.unwrap();
    assert_eq!(rig.count() - before, u64::from(CAPABILITIES.measurement_exchanges));
    assert_eq!(values.reference, Some(Setpoint::Frequency(HALF_SPEED)));
    assert_eq!(values.speed, Some(Speed::from_rpm(750)));
    assert_eq!(values.output_voltage_share, Some(Percent::from_percent(50)));
    assert_eq!((values.inputs, values.outputs), (Some(0), Some(0)));
    assert_eq!(values.line_voltage, None);
}

#[tokio::test(start_paused = true)]
async fn a_block_that_the_drive_refuses_is_replaced_by_single_reads() {
    let (rig, mut drive) = Rig::with_blocks_shown().await;
    rig.machine.refuse_next(Exception::ILLEGAL_VALUE);
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Bus));
}

#[tokio::test(start_paused = true)]
async fn a_block_that_is_configured_and_not_in_effect_is_never_read_as_a_status() {
    let (rig, mut drive) = Rig::with_blocks_shown().await;
    // Another program swaps FD01 and FD00; the drive is not reset.
    for (slot, choice) in [(0x0875, 2), (0x0876, 1)] {
        bench::write(&rig.line, slot, choice).await;
    }
    let before = rig.count();
    let status = drive.status().await.unwrap();
    assert_eq!(status.output_frequency, Some(HALF_SPEED), "as it was in effect");
    assert!(rig.count() - before <= 3, "by the block");
    // A daemon that starts, or that was reconnected, knows nothing of it.
    drive.forget();
    for _ in 0..5 {
        drive.measurements().await.unwrap();
        let status = drive.status().await.unwrap();
        assert_eq!((status.state, status.output_frequency), (State::Running, Some(HALF_SPEED)));
    }
    rig.at_rest(&mut drive).await;
    assert_eq!(drive.status().await.unwrap().state, State::Ready);
}

#[tokio::test(start_paused = true)]
async fn a_layout_that_shows_the_same_at_rest_is_not_believed_there() {
    let (rig, _) = Rig::with_blocks().await;
    // FE03 and FD00 have changed places; at rest both are 0.
    for (slot, choice) in [(0x0876, 3), (0x0877, 2)] {
        bench::write(&rig.line, slot, choice).await;
    }
    let mut drive = rig.another();
    for _ in 0..5 {
        assert_eq!(drive.status().await.unwrap().state, State::Ready);
    }
    rig.at_speed(&mut drive).await;
    for _ in 0..5 {
        drive.measurements().await.unwrap();
        assert_eq!(drive.status().await.unwrap().output_frequency, Some(HALF_SPEED));
    }
}

#[tokio::test(start_paused = true)]
async fn a_reset_that_takes_a_changed_block_into_effect_changes_no_value() {
    let (rig, mut drive) = Rig::with_blocks_shown().await;
    for (code, choice) in [("F875", 2), ("F876", 1)] {
        drive.write_parameter(Row::find(ROWS, code).unwrap(), choice).await.unwrap();
    }
    let status = drive.status().await.unwrap();
    assert_eq!((status.output_frequency, status.control), (Some(HALF_SPEED), Some(Control::Bus)));
    rig.machine.trip(1);
    assert_eq!(drive.status().await.unwrap().state, State::Fault);
    drive.reset_faults().await.unwrap();
    tokio::time::sleep(15 * SECOND).await;
    rig.at_speed(&mut drive).await;
    for exchanges in [4, 2] {
        let before = rig.count();
        let status = drive.status().await.unwrap();
        assert_eq!((status.state, status.output_frequency), (State::Running, Some(HALF_SPEED)));
        let took = rig.count() - before;
        assert!(
            (exchanges..=exchanges + 1).contains(&took),
            "word by word, then the block that is in effect now"
        );
        drive.measurements().await.unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_somebody_else_resets_ends_the_use_of_the_block_as_well() {
    let (rig, mut drive) = Rig::with_blocks_shown().await;
    for (slot, choice) in [(0x0875, 2), (0x0876, 1)] {
        bench::write(&rig.line, slot, choice).await;
    }
    rig.machine.trip(1);
    assert!(drive.status().await.unwrap().is_fault());
    bench::write(&rig.line, 0xFA00, 0xE000).await;
    tokio::time::sleep(5 * SECOND).await;
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.output_frequency), (State::Ready, Some(Frequency::ZERO)));
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_with_its_history_and_what_was_before_it() {
    let (rig, mut drive) = Rig::factory();
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    rig.machine.trip(999);
    drive.reset_faults().await.unwrap();
    tokio::time::sleep(15 * SECOND).await;
    rig.at_speed(&mut drive).await;
    rig.machine.trip(11);
    rig.machine.poke(0xFC91, (Alarms::OVERVOLTAGE | Alarms::from_bits_retain(1 << 6)).bits());
    rig.machine.poke(0xFE79, 0x0005);
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(Fault::mnemonic).collect::<Vec<_>>(), ["OP2"]);
    assert_eq!(faults.history.iter().map(|fault| fault.code).collect::<Vec<_>>(), [11, 999]);
    assert_eq!(faults.warnings.iter().map(|alarm| alarm.code).collect::<Vec<_>>(), [4, 6, 16, 18]);
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

/// FE79: bit 0 fan, 1 circuit board, 2 capacitors, 3 set up by the user (§8.7 p. 36).
#[tokio::test(start_paused = true)]
async fn what_is_due_for_maintenance_stands_among_the_alarms() {
    let (rig, mut drive) = Rig::factory();
    for (bit, part) in [(0, "fan"), (1, "circuit board"), (2, "capacitors"), (3, "user")] {
        rig.machine.poke(0xFE79, 1 << bit);
        let warnings = drive.faults().await.unwrap().warnings;
        let [alarm] = *warnings else { panic!("{warnings:?}") };
        assert!(alarm.entry.is_some_and(|entry| entry.meaning.contains(part)), "{alarm:?}");
    }
    rig.machine.poke(0xFE79, 0);
    assert_eq!(drive.faults().await.unwrap().warnings, []);
}
