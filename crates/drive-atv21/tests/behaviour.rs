//! The driver against the simulated drive, over a real line, in virtual time.

use std::time::Duration;

use drive_atv21::{
    Alarms, Atv21, Authority, CommandWord, MaintenanceAlarms, ModelEntry, StallLevel, StatusWord,
    blocks::{BlockSetUp, Blocks, ReadSlot},
    registers as map,
};
use drive_bus::{Line, LineConfig, Slave};
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, Fault, Frequency, Percent, Reaction, Refusal, Result,
    SerialSettings, Setpoint, SetpointProblem, SlaveAddress, Speed, State, Status, StopMode, Watchdog,
};
use drive_sim::{Exception, Observation, Panel, SimLine, SimSlave, Wiring, models::atv21::Atv21 as Model};

const SECOND: Duration = Duration::from_secs(1);
const HALF_SPEED: Frequency = Frequency::from_hertz(25);

struct Rig {
    machine: SimSlave,
    line: Line,
}

impl Rig {
    fn new(model: Model) -> (Self, Atv21<Slave>) {
        let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let machine = simulated.add(1, model).unwrap();
        let line = Line::over(simulated.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
        // The time-out would trip a drive that a test leaves alone.
        machine.poke(0x0803, 0);
        let drive = Atv21::new(line.slave(1), SlaveAddress::try_from(1).unwrap());
        (Self { machine, line }, drive)
    }

    fn factory() -> (Self, Atv21<Slave>) {
        Self::new(Model::new())
    }

    /// With the standard blocks in effect.
    async fn with_blocks() -> (Self, Atv21<Slave>) {
        let (rig, mut drive) = Self::factory();
        let _ = drive.set_up_blocks(Blocks::STANDARD).await.unwrap();
        rig.power_cycle().await;
        drive.forget();
        (rig, drive)
    }

    async fn power_cycle(&self) {
        self.machine.power_cycle();
        tokio::time::sleep(2 * SECOND).await;
    }

    async fn at_speed(&self, drive: &mut Atv21<Slave>) {
        drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
        drive.start(Direction::Forward).await.unwrap();
        self.until(|seen| seen.output_frequency == 2_500).await;
    }

    /// Waits until the machine is seen to be so, and fails when it never is.
    async fn until(&self, is_so: impl Fn(&Observation) -> bool) {
        let seen = tokio::time::timeout(100 * SECOND, self.machine.wait_until(is_so)).await;
        seen.unwrap_or_else(|_| panic!("{:?}", self.machine.observe()));
    }

    fn count(&self) -> u64 {
        self.machine.all_requests()
    }
}

fn refusal<T: std::fmt::Debug>(result: Result<T>) -> Refusal {
    match result.unwrap_err() {
        Error::Refused { reason, .. } => reason,
        other => panic!("{other}"),
    }
}

fn state(status: &Status) -> (State, Option<Direction>) {
    (status.state, status.direction)
}

#[tokio::test(start_paused = true)]
async fn it_starts_reverses_and_stops_along_the_ramp() {
    let (rig, mut drive) = Rig::factory();
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Ready, Some(Control::Terminals)));
    rig.at_speed(&mut drive).await;
    let status = drive.status().await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Forward)));
    assert_eq!((status.output_frequency, status.control), (Some(HALF_SPEED), Some(Control::Bus)));
    drive.start(Direction::Reverse).await.unwrap();
    rig.until(|seen| seen.output_frequency == -2_500).await;
    let status = drive.status().await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Reverse)));
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().state, State::Stopping);
    rig.until(|seen| !seen.running).await;
    let status = drive.status().await.unwrap();
    assert!(status.is_standstill(), "{status}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_confirmed_by_its_order_where_run_shows_until_standstill() {
    let (rig, mut drive) = Rig::new(Model::new().running_until_standstill());
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().state, State::Stopping);
    drive.start(Direction::Reverse).await.unwrap();
    rig.until(|seen| seen.output_frequency < 0).await;
}

#[tokio::test(start_paused = true)]
async fn freewheel_and_dc_injection_hold_until_the_next_command() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::Freewheel).await.unwrap().state, State::Disabled);
    assert!(!rig.machine.observe().running);
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::DcInjection).await.unwrap().state, State::Stopping);
    rig.until(|seen| seen.shaft_frequency == 0).await;
    assert!(rig.machine.observe().running, "the injection goes on at rest");
    drive.stop(StopMode::Ramp).await.unwrap();
    assert!(drive.status().await.unwrap().is_standstill());
}

#[tokio::test(start_paused = true)]
async fn a_fast_stop_is_unsupported_and_sends_nothing() {
    let (rig, mut drive) = Rig::factory();
    assert_eq!(drive.stop(StopMode::Fast).await.unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(rig.count(), 0);
}

#[tokio::test(start_paused = true)]
async fn an_emergency_stop_trips_once_and_leaves_no_edge() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert!(drive.emergency_stop().await.unwrap().is_fault());
    assert_eq!((rig.machine.observe().trip, rig.machine.peek(0xFA00)), (Some(17), Some(0xC000)));
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::Fault(17));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_mute_after_a_reset_is_reported_as_unknown_and_found_reset_later() {
    let (rig, mut drive) = Rig::factory();
    rig.machine.trip(10);
    assert_eq!(drive.status().await.unwrap().state, State::Fault);
    let error = drive.reset_faults().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    tokio::time::sleep(15 * SECOND).await;
    assert_eq!(drive.status().await.unwrap().state, State::Ready);
    assert_eq!(rig.machine.observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_answers_at_once_is_seen_reset_and_does_not_start() {
    let (rig, mut drive) = Rig::new(Model::new().restarting_in(Duration::ZERO));
    rig.at_speed(&mut drive).await;
    rig.machine.trip(14);
    assert_eq!(drive.reset_faults().await.unwrap().state, State::Ready);
    assert!(!rig.machine.observe().running);
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC000));
    let resets =
        rig.machine.received().iter().filter(|request| request.pdu[..] == [6, 0xFA, 0, 0xE0, 0]).count();
    assert_eq!(resets, 1);
    // Nothing to reset: nothing is written.
    let writes = rig.machine.requests(6);
    drive.reset_faults().await.unwrap();
    assert_eq!(rig.machine.requests(6), writes);
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_while_somebody_else_has_the_drive() {
    let (rig, mut drive) = Rig::factory();
    rig.machine.panel(Panel::TakeControl);
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Panel));
    rig.machine.panel(Panel::ReleaseControl);
    // The terminals run the motor.
    rig.machine.poke(0xFD06, 1);
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Terminals));
    rig.machine.poke(0xFD06, 0);
    rig.until(|seen| !seen.running).await;
    // Without the priorities a drive that listens to its terminals is not ours.
    let mut drive = drive.with_authority(Authority::Settings);
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Terminals));
    assert_eq!(rig.machine.requests(6), 0);
    rig.machine.poke(0x0003, 2);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0x0400));
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_in_undervoltage() {
    let (rig, mut drive) = Rig::factory();
    rig.machine.poke(0xFC91, Alarms::UNDERVOLTAGE_RELAY.bits());
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::State(State::NotReady));
}

#[tokio::test(start_paused = true)]
async fn release_gives_the_command_back_to_the_terminals_at_rest() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert_eq!(refusal(drive.release().await), Refusal::MotorRunning);
    drive.stop(StopMode::Ramp).await.unwrap();
    rig.until(|seen| !seen.running).await;
    assert_eq!(drive.release().await.unwrap().control, Some(Control::Terminals));
    assert_eq!(rig.machine.peek(0xFA00), Some(0));
    rig.machine.poke(0x0003, 2);
    assert!(matches!(refusal(drive.release().await), Refusal::Settings(_)));
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_outside_the_limits_is_refused_before_it_is_sent() {
    let (rig, mut drive) = Rig::factory();
    let error = drive.set_setpoint(Frequency::from_centihertz(5_001).into()).await.unwrap_err();
    let Error::Setpoint { problem, .. } = error else { panic!("{error}") };
    let high = Frequency::from_hertz(50);
    assert_eq!(problem, SetpointProblem::OutsideFrequencyLimits { low: Frequency::ZERO, high });
    assert!(drive.set_setpoint(Speed::from_rpm(24_001).into()).await.is_err());
    assert_eq!(rig.machine.requests(6), 0);
    // Another UL is found after forget, not before.
    rig.machine.poke(0x0012, 6_000);
    assert!(drive.set_setpoint(Frequency::from_hertz(60).into()).await.is_err());
    drive.forget();
    drive.set_setpoint(Frequency::from_hertz(60).into()).await.unwrap();
    drive.set_setpoint(Speed::from_rpm(1_500).into()).await.unwrap();
    assert_eq!((rig.machine.peek(0xFA01), rig.machine.peek(0xFA13)), (Some(6_000), Some(1_500)));
}

#[tokio::test(start_paused = true)]
async fn a_preset_speed_that_overrides_the_setpoint_is_noticed() {
    let (rig, mut drive) = Rig::factory();
    drive.select(CommandWord::PRESET_SPEED_2 | CommandWord::RUN);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC402), "only selections are kept");
    assert!(matches!(refusal(drive.set_setpoint(HALF_SPEED.into()).await), Refusal::Settings(_)));
    // A start without a preset of our own overwrites that of FA00.
    drive.select(CommandWord::RAMP_2);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC440));
    // One that does not come from FA00 stays: no start then.
    drive.select(CommandWord::empty());
    rig.machine.poke(0xFE46, 255);
    assert!(matches!(refusal(drive.start(Direction::Forward).await), Refusal::Settings(_)));
}

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
    assert_eq!(rig.count() - before, u64::from(Atv21::<Slave>::CAPABILITIES.status_exchanges));
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
    assert_eq!(rig.count() - before, u64::from(Atv21::<Slave>::CAPABILITIES.measurement_exchanges));
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
async fn a_block_that_the_drive_refuses_is_replaced_by_single_reads() {
    let (rig, mut drive) = Rig::with_blocks().await;
    drive.status().await.unwrap();
    rig.machine.refuse_next(Exception::ILLEGAL_VALUE);
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Terminals));
}

#[tokio::test(start_paused = true)]
async fn start_at_writes_command_and_reference_in_one_exchange_where_the_block_allows_it() {
    let (rig, mut drive) = Rig::with_blocks().await;
    let set_up = rig.machine.requests(6);
    let status = drive.start_at(Direction::Reverse, HALF_SPEED).await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Reverse)));
    assert_eq!((rig.machine.requests(0x10), rig.machine.requests(6) - set_up), (1, 0));
    rig.until(|seen| seen.output_frequency == -2_500).await;

    let (rig, mut drive) = Rig::factory();
    drive.start_at(Direction::Forward, HALF_SPEED).await.unwrap();
    assert_eq!((rig.machine.requests(0x10), rig.machine.requests(6)), (0, 2));
    rig.until(|seen| seen.output_frequency == 2_500).await;
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
async fn a_lost_confirmation_of_a_stop_is_read_back() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    rig.machine.hold_next_answer();
    let (status, ()) = tokio::join!(drive.stop(StopMode::Ramp), async {
        rig.machine.wait_until_held().await;
        assert_eq!(rig.machine.peek(0xFA00), Some(0xC000));
        tokio::time::sleep(SECOND).await;
        rig.machine.release();
    });
    assert!(matches!(status.unwrap().state, State::Stopping | State::Ready));
    rig.line.close().await;
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
async fn it_says_which_model_it_is() {
    let (rig, mut drive) = Rig::factory();
    assert_eq!(drive.identify().await.unwrap().model.as_deref(), Some("ATV21H075M3X"));
    assert_eq!(drive.model().await.unwrap(), ModelEntry::lookup(4, 0));
    rig.machine.poke(0xFB05, 3);
    assert_eq!(drive.model().await.unwrap(), None);
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_stop_reaches_the_drive() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    let write = drive.broadcast_stop(StopMode::Freewheel).unwrap();
    let mut all: tokio_modbus::client::Context = rig.line.broadcast().into();
    tokio_modbus::prelude::Writer::write_single_register(&mut all, write.register, write.value)
        .await
        .unwrap()
        .unwrap();
    assert!(!rig.machine.observe().running);
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
