//! What is in force and not only written: the panel, the terminals and another master decide as well.

mod rig;

use drive_3g3ev::broadcast;
use drive_core::{
    Class, Direction, Drive, Error, ErrorKind, Frequency, Lack, Lease, Motion, Percent, Refusal, Result,
    Setpoint, State, StopMode, Verdict,
};
use drive_sim::{Panel, SimSlave, models::drive_3g3ev::Drive3g3ev as Model};
use drive_testing::{
    bench,
    words::{Asked, Words, lacks_within},
};
use rig::{Judged, RESET, Rig, one, ready, running, with};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));
/// Bits of 002Ch.
const LOCAL_REFERENCE: u16 = 1 << 9;
const LOCAL_RUN: u16 = 1 << 0xA;

/// What decides instead, as a refusal or as the reason of a command that is not confirmed.
fn instead<T: std::fmt::Debug>(result: Result<T>) -> &'static str {
    let reason = match result.unwrap_err() {
        Error::Refused { reason, .. } | Error::NotConfirmed { because: Some(reason), .. } => reason,
        other => panic!("{other}"),
    };
    let Refusal::Overridden { by, remedy } = reason else { panic!("{reason}") };
    assert!(!remedy.is_empty());
    by
}

/// A drive that runs at 50 Hz by the bus, with these words besides.
fn running_with(more: &[(u16, u16)]) -> Words {
    let mut words = running();
    words.words.extend([(0x0002, 500), (0x0023, 500)]);
    words.words.extend(more.iter().copied());
    words
}

/// n02 as it is since the last power-up.
fn powered_with_n02(n02: u16) -> (Judged, SimSlave, Rig) {
    let (drive, machine, rig) = one();
    machine.poke(0x0102, n02);
    machine.power_cycle();
    (drive, machine, rig)
}

#[tokio::test(start_paused = true)]
async fn a_start_and_a_setpoint_go_by_bits_9_and_a_of_002ch_and_not_by_n02() {
    // n02: 2 gives the reference to the panel, 4 the run command to the terminals, 0 and 3 both to the panel.
    for (n02, starts, sets) in [(0, false, false), (2, false, false), (4, false, true), (5, true, true)] {
        let (mut drive, machine, _rig) = powered_with_n02(n02);
        // A change acts at the next power-up only (§2.1 note 3).
        machine.poke(0x0102, if starts { 0 } else { 5 });
        let set = drive.set_setpoint(FIFTY).await;
        assert_eq!(set.is_ok(), sets, "n02 = {n02}: {set:?}");
        let started = drive.start(Direction::Forward).await;
        assert_eq!(started.is_ok(), starts, "n02 = {n02}: {started:?}");
        if !starts {
            assert!(instead(started).contains("002Ch"));
            assert_eq!((bench::written(&machine, 1), machine.observe().running), (vec![], false));
        }
    }
}

#[tokio::test(start_paused = true)]
async fn nothing_is_confirmed_under_the_panel() {
    for bit in [LOCAL_REFERENCE, LOCAL_RUN] {
        let mut drive = rig::drive(running_with(&[(0x2C, 0x0065 | bit)]));
        assert!(instead(drive.start(Direction::Forward).await).contains("the panel or the terminals"));
        assert_eq!(drive.into_port().written(), []);
    }
    let mut drive = rig::drive(running_with(&[(0x2C, 0x0065 | LOCAL_REFERENCE)]));
    assert!(instead(drive.set_setpoint(FIFTY).await).contains("bit 9"));
    let (mut drive, machine, _rig) = one();
    machine.panel(Panel::TakeControl);
    assert!(instead(drive.start(Direction::Forward).await).contains("bit A"));
    assert_eq!(bench::writes(&machine), 0);
}

#[tokio::test(start_paused = true)]
async fn a_reference_that_0023h_does_not_show_is_not_confirmed() {
    // An input of n06 to n08 chooses another speed.
    let mut drive = rig::drive(running_with(&[(0x0023, 150)]));
    assert!(instead(drive.set_setpoint(FIFTY).await).contains("0023h"));
    assert!(instead(drive.start(Direction::Forward).await).contains("0023h"));
    // At rest the manual leaves open whether it shows the reference or 0.
    for seen in [0, 500] {
        let mut words = ready();
        words.words.insert(0x0023, seen);
        rig::drive(words).set_setpoint(FIFTY).await.unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_whose_output_stays_off_is_not_confirmed() {
    let mut drive = rig::drive(running_with(&[(0x2C, 0x0165), (0x24, 0)]));
    assert!(instead(drive.start(Direction::Forward).await).contains("output off"));
    // At a reference of 0 there is nothing to put out.
    let mut drive = rig::drive(running_with(&[(0x2C, 0x0165), (0x24, 0), (0x02, 0), (0x23, 0)]));
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn the_inputs_of_0001h_are_kept_by_every_start_and_stop() {
    let mut drive = rig::drive(running_with(&[(0x0001, 0x0051), (0x24, 0)]));
    drive.start(Direction::Forward).await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    drive.withdraw().await.unwrap();
    assert_eq!(drive.into_port().written(), [(1, 0x51), (1, 0x50)]);
    // A new value reads them with its first status, so that its stop needs no reading before it.
    let mut drive = rig::drive(running_with(&[(0x0001, 0x0031), (0x24, 0)]));
    drive.status().await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    let asked = drive.into_port().asked;
    let stop = asked.iter().position(|asked| matches!(asked, Asked::Write(..))).unwrap();
    assert_eq!(asked[stop], Asked::Write(Class::Stop, 1, vec![0x30]));
    assert_eq!(stop, 4, "n39, the status, 0001h");
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_not_confirmed_while_the_output_stays() {
    let error = rig::drive(running_with(&[])).stop(StopMode::Ramp).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    let begun = tokio::time::Instant::now();
    let mut drive = rig::drive(running_with(&[(0x2C, 0x0065 | LOCAL_RUN)]));
    assert!(instead(drive.stop(StopMode::Ramp).await).contains("bit A"));
    assert!(begun.elapsed().as_millis() < 1_000, "told at once");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_is_turned_round_is_on_its_way_and_told_in_its_old_direction() {
    let (mut drive, machine, _rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    while machine.observe().output_frequency != 5_000 {
        drive.keep_alive().await.unwrap();
    }
    let status = drive.start(Direction::Reverse).await.unwrap();
    assert!(status.output_frequency < Some(Frequency::from_hertz(50)), "{status}");
    while machine.observe().output_frequency != -5_000 {
        drive.keep_alive().await.unwrap();
    }
}

/// The manual does not say which of the two bit 1 of 0020h is.
#[tokio::test(start_paused = true)]
async fn a_motor_that_is_turned_round_slowly_is_started_also_where_its_drive_tells_the_ordered_direction() {
    for told in [Model::new(), Model::new().telling_ordered_direction()] {
        let rig = Rig::new([told.with_fault_reset_function(RESET)]);
        let machine = rig.machines[0].clone();
        // n20: 20 s from nought to the highest frequency.
        machine.poke(0x0114, 200);
        let mut drive = rig.drive(1);
        drive.set_setpoint(FIFTY).await.unwrap();
        drive.start(Direction::Forward).await.unwrap();
        while machine.observe().output_frequency != 5_000 {
            drive.status().await.unwrap();
        }
        let status = drive.start(Direction::Reverse).await.unwrap();
        assert_eq!(status.state, State::Running, "{status}");
        while machine.observe().output_frequency != -5_000 {
            let status = drive.status().await.unwrap();
            assert!(!matches!(status.verdict, Some(Verdict::NotInForce { .. })), "{status}");
        }
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_goes_on_turning_the_other_way_is_not_called_started() {
    // 0001h takes "reverse run", and the drive goes on forward at its speed.
    let mut drive = rig::drive(running_with(&[]));
    let error = drive.start(Direction::Reverse).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    assert_eq!(drive.into_port().written(), [(1, 3)], "RUN and REVERSE");
    drive = rig::drive(running_with(&[]));
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_withdrawal_ends_our_run_command_and_nobody_elses() {
    let (mut drive, machine, _rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Reverse).await.unwrap();
    machine.panel(Panel::TakeControl);
    drive.withdraw().await.unwrap();
    assert_eq!(machine.peek(1), Some(2));
    machine.panel(Panel::ReleaseControl);
    drive.keep_alive().await.unwrap();
    assert!(!machine.observe().running || drive.status().await.unwrap().state != State::Running);
    // Another master runs it by the bus.
    let mut drive = rig::drive(running_with(&[(0x0001, 0x0003)]));
    drive.withdraw().await.unwrap();
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn a_fault_is_not_reset_where_the_panel_or_the_terminals_command() {
    let words = with(&[(0x20, 0x08), (0x21, 1), (0x0108, RESET), (0x2C, LOCAL_RUN)]);
    let mut drive = rig::drive(words).with_fault_reset_function(RESET);
    assert!(instead(drive.reset_faults().await).contains("bit A"));
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn a_reset_keeps_the_other_inputs() {
    let words = with(&[(0x20, 0x08), (0x21, 1), (0x0108, RESET), (0x0001, 0x0013)]);
    let mut drive = rig::drive(words).with_fault_reset_function(RESET);
    drive.reset_faults().await.unwrap_err();
    assert_eq!(drive.into_port().written(), [(1, 0x50), (1, 0x10)]);
}

#[test]
fn no_broadcast_reference_is_above_100_percent() {
    assert_eq!(broadcast::reference(Percent::from_percent(100)).unwrap().value, 30_000);
    for percent in [101, 218, -1] {
        assert_eq!(broadcast::reference(Percent::from_percent(percent)), None);
    }
}

#[tokio::test(start_paused = true)]
async fn a_status_is_as_old_as_its_first_answer() {
    let (mut drive, _machine, _rig) = one();
    drive.status().await.unwrap();
    let begun = tokio::time::Instant::now();
    let status = drive.status().await.unwrap();
    let ended = tokio::time::Instant::now();
    assert!(status.at.is_some_and(|at| begun < at && at < ended));
    assert!(drive.measurements().await.unwrap().at.is_some_and(|at| ended < at));
}

#[tokio::test(start_paused = true)]
async fn each_status_names_what_keeps_our_run_command_from_acting() {
    let told = async |more: &[(u16, u16)]| {
        let mut drive = rig::drive(running_with(more));
        drive.adopt(Lease::new(Direction::Forward, 1));
        lacks_within(&mut drive, 10).await
    };
    for (more, lack, by) in [
        (&[(0x2C, 0x0065 | LOCAL_REFERENCE)][..], Lack::Reference, "bit 9 of 002Ch"),
        (&[(0x2C, 0x0065 | LOCAL_RUN)], Lack::Command, "bit A of 002Ch"),
        // RUN is off in 0020h and 002Ch, and the output is not: 0 of bit 8.
        (&[(0x20, 0x04), (0x2C, 0x0064)], Lack::Output, "a stop at the drive"),
        (&[(0x2C, 0x0065 | 1 << 7)], Lack::Output, "bit 7 of 002Ch"),
        (&[(0x2C, 0x0065 | 1 << 8)], Lack::Output, "bit 8 of 002Ch"),
        (&[(0x0023, 150)], Lack::Reference, "0023h"),
    ] {
        let (lacks, because) = told(more).await.unwrap_or_else(|| panic!("{by}: told in force"));
        assert!(lacks == lack && because.contains(by), "{because}");
    }
    assert_eq!(told(&[]).await, None);
    // At a reference of 0 there is nothing to put out, and nobody has cut it.
    let at_zero = [(0x02, 0), (0x23, 0), (0x24, 0), (0x2C, 0x0165)];
    assert_eq!(told(&at_zero).await, None);
    let mut drive = rig::drive(running_with(&at_zero));
    drive.adopt(Lease::new(Direction::Forward, 1));
    // 0001h and 0002h are read behind the first.
    for verdict in [Verdict::NotKnown, Verdict::InForce] {
        let status = drive.status().await.unwrap();
        assert_eq!((status.motion, status.verdict), (Motion::Driven, Some(verdict)));
    }
}
