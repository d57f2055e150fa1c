//! The drive against its simulated counterpart, over a real line in virtual time.

mod rig;

use std::time::Duration;

use drive_3g3ev::{ROWS, broadcast};
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, ExceptionMeaning, Fault, Frequency, Intent, Percent,
    Reaction, Refusal, Row, Setpoint, SetpointProblem, State, StopMode, Watchdog, registers::Storage,
};
use drive_sim::{SimSlave, models::drive_3g3ev::Drive3g3ev as Model};
use drive_testing::bench::{self, writes};
use rig::{Judged, RESET, Rig, one};
use tokio_modbus::{Request, client::Client};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));

/// What is wrong, how it comes about, the direction of the start, and the refusal.
type Refused = (&'static str, fn(&SimSlave), Direction, Refusal);

fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

async fn running() -> (Judged, SimSlave, Rig) {
    let (mut drive, machine, rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    // The drive trips when nothing is said for 2 s; the ramp takes 2.5 s.
    while machine.observe().output_frequency != 5_000 {
        drive.keep_alive().await.unwrap();
    }
    (drive, machine, rig)
}

/// Sets a parameter as on the keypad and switches the drive off and on.
fn set_up(machine: &SimSlave, parameters: &[(u16, u16)]) {
    for &(address, value) in parameters {
        assert!(machine.poke(address, value));
    }
    machine.power_cycle();
}

fn commands(machine: &SimSlave) -> Vec<u16> {
    bench::written(machine, 0x0001)
}

#[tokio::test(start_paused = true)]
async fn a_start_is_seen_in_the_drives_own_words_and_the_motor_reaches_its_setpoint() {
    let (mut drive, machine, rig) = one();
    assert_eq!(drive.status().await.unwrap().state, State::Ready);
    drive.set_setpoint(FIFTY).await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!((status.state, status.control), (State::Running, Some(Control::Bus)));
    assert_eq!(commands(&machine), [1]);
    while machine.observe().output_frequency != 5_000 {
        drive.status().await.unwrap();
    }
    let status = drive.status().await.unwrap();
    assert_eq!(
        status.to_string(),
        format!("running, forward, 50.00 Hz, {}, at reference, control: bus", status.current.unwrap())
    );
    assert_eq!(rig.sim.violations(), []);
}

#[tokio::test(start_paused = true)]
async fn a_running_motor_turns_to_the_other_direction_through_standstill() {
    let (mut drive, machine, _rig) = running().await;
    drive.start(Direction::Reverse).await.unwrap();
    while machine.observe().output_frequency != -5_000 {
        drive.keep_alive().await.unwrap();
    }
    let status = drive.status().await.unwrap();
    assert_eq!(
        (status.direction, status.output_frequency),
        (Some(Direction::Reverse), Some(Frequency::from_hertz(50)))
    );
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_seen_at_once_and_ends_at_standstill() {
    let (mut drive, machine, _rig) = running().await;
    let status = drive.stop(StopMode::Ramp).await.unwrap().status;
    assert_eq!(status.state, State::Stopping);
    assert!(machine.observe().running, "a stop takes its time");
    assert_eq!(drive.status().await.unwrap().state, State::Stopping);
    while machine.observe().running {
        drive.keep_alive().await.unwrap();
    }
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.is_standstill()), (State::Ready, true));
    assert_eq!(commands(&machine), [1, 0]);
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_sent_whatever_the_state_and_the_mode() {
    let (mut drive, machine, _rig) = one();
    machine.trip(0);
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().status.state, State::Fault);
    assert_eq!(commands(&machine), [0]);
    for mode in [StopMode::Fast, StopMode::Freewheel, StopMode::DcInjection] {
        let stopped = drive.stop(mode).await.unwrap();
        assert_eq!((stopped.mode, stopped.instead.is_some()), (StopMode::Ramp, true), "{mode}");
    }
    assert_eq!(commands(&machine), [0; 4]);
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_with_the_reason_and_nothing_is_written() {
    let cases: [Refused; 3] = [
        ("fault", |machine| machine.trip(0xA), Direction::Forward, Refusal::Fault(0xA)),
        ("n05", |machine| set_up(machine, &[(0x0105, 1)]), Direction::Reverse, Refusal::DirectionForbidden),
        (
            "OP4",
            |machine| set_up(machine, &[(0x012A, 9)]),
            Direction::Forward,
            Refusal::State(State::NotReady),
        ),
    ];
    for (name, prepare, direction, expected) in cases {
        let (mut drive, machine, _rig) = one();
        prepare(&machine);
        let error = drive.start(direction).await.unwrap_err();
        assert!(matches!(error, Error::Refused { reason, .. } if reason == expected), "{name}: {error}");
        assert_eq!(writes(&machine), 0, "{name}");
    }
}

/// "Reverse: n05", which somebody changes at the panel, as the refusal tells him to.
#[tokio::test(start_paused = true)]
async fn the_forbidden_direction_is_read_again_for_each_start() {
    let (mut drive, machine, _rig) = one();
    for _ in 0..2 {
        machine.poke(0x0105, 0);
        drive.start(Direction::Reverse).await.unwrap();
        drive.stop(StopMode::Ramp).await.unwrap();
        machine.poke(0x0105, 1);
        let error = drive.start(Direction::Reverse).await.unwrap_err();
        assert!(matches!(error, Error::Refused { reason: Refusal::DirectionForbidden, .. }), "{error}");
        drive.start(Direction::Forward).await.unwrap();
        drive.stop(StopMode::Ramp).await.unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn setpoints_count_as_n39_says() {
    for (n39, word) in [(0, 475), (1, 4_750)] {
        let (mut drive, machine, _rig) = one();
        set_up(&machine, &[(0x0127, n39)]);
        drive.set_setpoint(Frequency::from_decihertz(475).into()).await.unwrap();
        assert_eq!(machine.peek(2), Some(word));
        let measured = drive.measurements().await.unwrap();
        assert_eq!(measured.reference, Some(Frequency::from_decihertz(475).into()));
        let error = drive.set_setpoint(Frequency::from_centihertz(4_755).into()).await.unwrap_err();
        let resolution = SetpointProblem::Resolution("0.1 Hz");
        assert!(matches!(error, Error::Setpoint { problem, .. } if problem == resolution), "{error}");
        let error = drive.set_setpoint(Frequency::from_hertz(6_600).into()).await.unwrap_err();
        assert!(matches!(error, Error::Setpoint { problem: SetpointProblem::TooLarge, .. }), "{error}");
        assert_eq!(writes(&machine), 1);
    }
}

#[tokio::test(start_paused = true)]
async fn where_n39_counts_percent_hertz_are_refused_and_percents_are_taken() {
    for (n39, word) in [(2, 15_000), (3, 500)] {
        let (mut drive, machine, _rig) = one();
        set_up(&machine, &[(0x0127, n39)]);
        let error = drive.set_setpoint(FIFTY).await.unwrap_err();
        assert_eq!((error.kind(), writes(&machine)), (ErrorKind::Unsupported, 0));
        drive.set_setpoint("50%".parse().unwrap()).await.unwrap();
        assert_eq!(machine.peek(2), Some(word));
        let asked = drive.intent(2, word).await.unwrap();
        assert_eq!(asked, Some(Intent::Setpoint(Percent::from_percent(50).into())));
        let status = drive.start(Direction::Forward).await.unwrap();
        assert_eq!((status.state, status.output_frequency), (State::Running, None));
        assert_eq!(drive.measurements().await.unwrap().reference, Some(Percent::from_percent(50).into()));
        let error = drive.set_setpoint(Percent::from_percent(-1).into()).await.unwrap_err();
        assert!(matches!(error, Error::Setpoint { problem: SetpointProblem::TooLarge, .. }), "{error}");
    }
    let (mut drive, machine, _rig) = one();
    set_up(&machine, &[(0x0127, 3)]);
    let error = drive.set_setpoint(Percent::from_hundredths(4_555).into()).await.unwrap_err();
    assert!(error.to_string().contains("steps of 0.1 %"), "{error}");
    let (mut drive, _machine, _rig) = one();
    let error = drive.set_setpoint(Percent::from_percent(50).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_beyond_the_drives_own_limit_is_its_exception_21h() {
    let (mut drive, machine, _rig) = one();
    let error = drive.set_setpoint(Frequency::from_hertz(61).into()).await.unwrap_err();
    let refused = ExceptionMeaning::ValueRefused;
    assert!(matches!(error, Error::Exception { code: 0x21, meaning, .. } if meaning == refused), "{error}");
    assert_eq!(machine.peek(2), Some(0));
    let error = drive.set_setpoint(drive_core::Speed::from_rpm(1_500).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
}

#[tokio::test(start_paused = true)]
async fn after_n39_was_changed_nothing_is_guessed_until_the_drive_was_switched_off() {
    let (mut drive, machine, _rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.write_parameter(row("n39"), 1).await.unwrap();
    assert_eq!(drive.status().await.unwrap().output_frequency, None);
    let error = drive.set_setpoint(FIFTY).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    drive.persist().await.unwrap();
    machine.power_cycle();
    drive.forget();
    drive.set_setpoint(FIFTY).await.unwrap();
    assert_eq!(machine.peek(2), Some(5_000));
}

/// The supply was away for less than anybody looked, and n39 was changed at the panel before: with 1 a count is 0.01 Hz, with 0
/// it is 0.1 Hz, from the power-up on (§2.1, note 3).
#[tokio::test(start_paused = true)]
async fn a_unit_that_came_into_force_in_a_cut_that_nobody_saw_is_not_written_by_the_old_one() {
    let (mut drive, machine, _rig) = one();
    set_up(&machine, &[(0x0127, 1)]);
    drive.status().await.unwrap();
    set_up(&machine, &[(0x0127, 0)]);
    drive.status().await.unwrap();
    let error = drive.set_setpoint(Frequency::from_hertz(5).into()).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    assert_eq!((writes(&machine), machine.peek(2)), (0, Some(0)));
    // What the words count is not known either, until the drive was seen without supply.
    assert_eq!(drive.status().await.unwrap().output_frequency, None);
    drive.forget();
    drive.set_setpoint(Frequency::from_hertz(5).into()).await.unwrap();
    assert_eq!(machine.peek(2), Some(50));
}

/// The setpoint was written before the cut, and its repetition arrived behind it: 500 counts are 50 Hz there.
#[tokio::test(start_paused = true)]
async fn a_start_is_refused_where_the_unit_of_its_reference_has_changed() {
    let (mut drive, machine, _rig) = one();
    set_up(&machine, &[(0x0127, 1)]);
    drive.set_setpoint(Frequency::from_hertz(5).into()).await.unwrap();
    set_up(&machine, &[(0x0127, 0)]);
    machine.poke(2, 500);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    assert_eq!(commands(&machine), [0; 0]);
}

/// The line was lost and the drive never without supply: what its panel has set meanwhile acts at the next power-up only.
#[tokio::test(start_paused = true)]
async fn a_drive_that_still_holds_what_it_was_given_behind_a_lost_line_counts_as_before() {
    let (mut drive, machine, _rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    machine.poke(0x0127, 1);
    drive.forget();
    assert_eq!(drive.status().await.unwrap().output_frequency, None);
    for _ in 0..2 {
        let error = drive.set_setpoint(Frequency::from_hertz(5).into()).await.unwrap_err();
        assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
        drive.forget();
    }
    assert_eq!(machine.peek(2), Some(500));
    machine.power_cycle();
    drive.forget();
    drive.set_setpoint(Frequency::from_hertz(5).into()).await.unwrap();
    assert_eq!(machine.peek(2), Some(500), "of 0.01 Hz");
}

/// What a second master has set in 0001h does not outlive the supply, and a start does not set it again.
#[tokio::test(start_paused = true)]
async fn inputs_that_a_power_cut_has_ended_are_not_set_again_by_a_start() {
    let (mut drive, machine, _rig) = one();
    machine.written_by_another(1, 0x10).unwrap();
    drive.status().await.unwrap();
    machine.power_cycle();
    drive.status().await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(machine.peek(1), Some(1));
}

#[tokio::test(start_paused = true)]
async fn a_fault_is_reset_by_one_pulse_of_the_input_that_carries_it_and_nothing_starts() {
    let (mut drive, machine, _rig) = running().await;
    machine.trip(0xE);
    machine.trip(0);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.fault_code), (State::Fault, Some(0)));
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(Fault::mnemonic).collect::<Vec<_>>(), ["OC", "BUS"]);
    assert_eq!(faults.warnings.iter().map(|fault| fault.code).collect::<Vec<_>>(), [0x2CF]);
    let status = drive.reset_faults().await.unwrap();
    assert_eq!(status.state, State::Ready);
    assert_eq!(commands(&machine), [1, 0x20, 0]);
    assert!(!machine.observe().running);
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_reset_without_an_input_for_it_is_unsupported_and_says_why() {
    let (drive, machine, rig) = one();
    machine.trip(0);
    drop(drive);
    let mut unknowing = drive_3g3ev::Drive3g3ev::new(rig.line.slave(1), bench::address(1));
    let error = unknowing.reset_faults().await.unwrap_err();
    assert!(error.to_string().contains("was not given"), "{error}");
    machine.poke(0x0107, 2);
    let error = rig.drive(1).reset_faults().await.unwrap_err();
    assert!(error.to_string().contains("none of the inputs"), "{error}");
    assert_eq!(writes(&machine), 0);
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_a_fault_is_not_reset() {
    let (mut drive, machine, _rig) = running().await;
    let before = writes(&machine);
    assert_eq!(drive.reset_faults().await.unwrap().state, State::Running);
    assert_eq!(writes(&machine), before);
}

#[tokio::test(start_paused = true)]
async fn a_pulse_of_an_input_that_the_drive_does_not_obey_is_not_confirmed() {
    // The number that was given is not this drive's number for "fault reset".
    let rig = Rig::new([Model::new()]);
    rig.machines[0].poke(0x0108, RESET);
    rig.machines[0].trip(3);
    let error = rig.drive(1).reset_faults().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    assert_eq!(commands(&rig.machines[0]), [0x40, 0]);
}

#[tokio::test(start_paused = true)]
async fn time_over_is_read_and_never_written() {
    let (mut drive, machine, _rig) = one();
    let armed = Watchdog { timeout: Some(Duration::from_secs(2)), reaction: Some(Reaction::Trip) };
    let off = Watchdog { timeout: None, reaction: Some(Reaction::Ignore) };
    let two = Duration::from_secs(2);
    assert_eq!(drive.watchdog().await, Ok(armed));
    assert_eq!(drive.arm_watchdog(two, Reaction::Trip).await, Ok(armed));
    let error = drive.arm_watchdog(two, Reaction::Ignore).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    let error = drive.arm_watchdog(Duration::from_secs(3), Reaction::Trip).await.unwrap_err();
    assert!(matches!(error, Error::WatchdogTime { .. }), "{error}");
    let error = drive.arm_watchdog(two, Reaction::Freewheel).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    set_up(&machine, &[(0x0128, 1)]);
    assert_eq!(drive.arm_watchdog(two, Reaction::Ignore).await, Ok(off));
    assert!(drive.arm_watchdog(two, Reaction::Trip).await.is_err());
    assert_eq!(writes(&machine), 0);
}

#[tokio::test(start_paused = true)]
async fn a_silent_master_trips_the_drive_and_keep_alives_do_not_let_it() {
    let (mut drive, machine, _rig) = running().await;
    for _ in 0..5 {
        tokio::time::sleep(Duration::from_secs(1)).await;
        drive.keep_alive().await.unwrap();
    }
    assert_eq!(machine.observe().trip, None);
    machine.wait_until(|seen| seen.trip == Some(0xE)).await;
    assert!(!machine.observe().running);
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(Fault::mnemonic).collect::<Vec<_>>(), ["BUS"]);
    assert!(faults.warnings.iter().any(|warning| warning.code == 0x3D6));
    assert_eq!(drive.reset_faults().await.unwrap().state, State::Ready);
}

#[tokio::test(start_paused = true)]
async fn a_parameter_lives_in_ram_until_it_is_saved_once_for_each_change() {
    let (mut drive, machine, _rig) = one();
    let before = machine.observe().eeprom_writes;
    let saves = || machine.observe().eeprom_writes - before;
    let nothing = |error: &Error| matches!(error, Error::Refused { reason: Refusal::NothingToSave, .. });
    assert!(nothing(&drive.persist().await.unwrap_err()));
    let written = drive.write_parameter(row("n20"), 50).await.unwrap();
    assert_eq!((written.changed, written.storage, saves()), (true, Storage::RamUntilSaved, 0));
    assert!(!drive.write_parameter(row("n20"), 50).await.unwrap().changed);
    assert_eq!((drive.persist().await, saves()), (Ok(1), 1));
    assert!(nothing(&drive.persist().await.unwrap_err()));
    machine.power_cycle();
    assert_eq!(drive.read_parameter(row("n20")).await, Ok(50));
}

#[tokio::test(start_paused = true)]
async fn the_eeprom_is_not_written_beyond_its_life() {
    let (_, machine, rig) = one();
    let mut drive = rig.drive(1).with(|drive| drive.with_saves(99_999));
    drive.write_parameter(row("n20"), 50).await.unwrap();
    assert_eq!(drive.persist().await, Ok(100_000));
    drive.write_parameter(row("n20"), 51).await.unwrap();
    let before = machine.observe().eeprom_writes;
    let error = drive.persist().await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::EepromLife, .. }), "{error}");
    assert_eq!(machine.observe().eeprom_writes, before);
}

#[tokio::test(start_paused = true)]
async fn parameters_are_refused_by_access_range_running_and_their_own_methods() {
    let (mut drive, machine, _rig) = running().await;
    let before = writes(&machine);
    let forbidden = drive.write_parameter(row("0024h"), 1).await.unwrap_err();
    assert!(matches!(forbidden, Error::AccessForbidden { .. }), "{forbidden}");
    let forbidden = drive.read_parameter(row("0900h")).await.unwrap_err();
    assert!(matches!(forbidden, Error::AccessForbidden { .. }), "{forbidden}");
    let range = drive.write_parameter(row("n65"), 41).await.unwrap_err();
    assert!(matches!(range, Error::ValueNotAllowed { .. }), "{range}");
    for code in ["0001h", "0002h", "0900h"] {
        assert_eq!(drive.write_parameter(row(code), 0).await.unwrap_err().kind(), ErrorKind::Unsupported);
    }
    assert_eq!(writes(&machine), before);
    let running = drive.write_parameter(row("n05"), 1).await.unwrap_err();
    let not_now = ExceptionMeaning::NotNow;
    assert!(
        matches!(running, Error::Exception { code: 0x22, meaning, .. } if meaning == not_now),
        "{running}"
    );
    // An unnamed parameter by its number, and the two commands that are plain registers.
    let unnamed = drive_3g3ev::registers::parameter(21).unwrap();
    assert_eq!(drive.read_parameter(unnamed).await, Ok(0));
    assert!(drive.write_parameter(row("0003h"), 900).await.unwrap().changed);
    assert!(drive.write_parameter(row("0009h"), 3).await.unwrap().changed);
    let volatile = drive.persist().await.unwrap_err();
    assert!(matches!(volatile, Error::Refused { reason: Refusal::NothingToSave, .. }), "{volatile}");
}

#[tokio::test(start_paused = true)]
async fn what_the_family_cannot_do_is_unsupported() {
    let (mut drive, machine, _rig) = one();
    assert_eq!(drive.identify().await.unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(drive.release().await.unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(machine.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn broadcasts_start_trip_reset_and_stop_every_drive() {
    let rig = Rig::new([Model::new(), Model::new()]);
    let send = async |write: drive_core::BroadcastWrite| {
        let request = Request::WriteMultipleRegisters(write.register, vec![write.value].into());
        rig.line.broadcast().call(request).await.unwrap().unwrap();
    };
    send(broadcast::reference(Percent::from_percent(50)).unwrap()).await;
    send(broadcast::run(Direction::Reverse)).await;
    assert!(rig.machines.iter().all(|machine| machine.observe().setpoint == -3_000));
    send(rig.drive(1).broadcast_stop(StopMode::Ramp).unwrap()).await;
    for number in [1, 2] {
        assert_ne!(rig.drive(number).status().await.unwrap().state, State::Fault);
        assert_eq!(rig.machines[usize::from(number) - 1].observe().setpoint, 0);
    }
    for write in broadcast::external_fault() {
        send(write).await;
    }
    for number in [1, 2] {
        let faults = rig.drive(number).faults().await.unwrap();
        assert_eq!(faults.present.iter().map(Fault::mnemonic).collect::<Vec<_>>(), ["EFx"]);
    }
    for write in broadcast::fault_reset() {
        send(write).await;
    }
    for number in [1, 2] {
        assert_eq!(rig.drive(number).faults().await.unwrap().present, []);
    }
}
