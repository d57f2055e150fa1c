//! What counts as done, on words as the manuals give them: in force, and never only written.

use drive_atv28::{Atv28, CAPABILITIES};
use drive_core::{
    Class, Control, Direction, Drive, Error, ErrorKind, Frequency, Lack, Lease, Refusal, Setpoint, State,
    StopMode, Verdict,
};
use drive_testing::words::{Asked, Words, lacks_within};

const CMD: u16 = 400;
const THIRTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(30));
/// `LFr`, `HSP`, `ETA`, `ETI`: at rest in "operation enabled", commanded by Modbus.
const STANDS: [(u16, u16); 4] = [(401, 300), (250, 500), (458, 0x0627), (459, 0x4002)];
/// Runs forward at 30 Hz by our command.
const RUNS: [(u16, u16); 6] = [(401, 300), (250, 500), (CMD, 0x000F), (450, 300), (451, 300), (459, 0x4012)];

fn drive(words: &[&[(u16, u16)]]) -> Atv28<Words> {
    Atv28::new(Words::new(&CAPABILITIES, &words.concat()), 1.try_into().unwrap())
}

fn because(error: &Error) -> Option<Refusal> {
    match error {
        Error::Refused { reason, .. } => Some(*reason),
        Error::NotConfirmed { because, .. } => *because,
        _ => None,
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_the_remote_terminal_commands_is_not_taken_from_it() {
    let mut drive = drive(&[&STANDS, &[(459, 0x2002)]]);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Panel)));
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn a_start_and_a_setpoint_are_confirmed_only_by_the_reference_of_the_bus() {
    let mut drive = drive(&[&STANDS, &RUNS]);
    drive.start(Direction::Forward).await.unwrap();
    drive.set_setpoint(THIRTY).await.unwrap();
    let mut drive = self::drive(&[&STANDS, &RUNS, &[(450, 500)]]);
    for error in
        [drive.start(Direction::Forward).await.unwrap_err(), drive.set_setpoint(THIRTY).await.unwrap_err()]
    {
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert!(matches!(because(&error), Some(Refusal::Overridden { .. })), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_direct_current_brakes_in_a_quick_stop_is_not_let_coast_by_a_start() {
    // "Quick stop active" (ETA xx0x111), and bit 4 of ETI: the motor is under current, at an output frequency of 0.
    let mut drive = drive(&[&STANDS, &[(458, 0x0607), (459, 0x4012)]]);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(because(&error), Some(Refusal::State(State::QuickStop)), "{error}");
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_of_a_motor_that_the_terminals_run_is_not_confirmed() {
    // Operation enabled and the motor running, bits 13 and 14 of ETI 0: the terminals (BBV51701 p. 20).
    let mut drive = drive(&[&STANDS, &RUNS, &[(450, 500), (451, 500), (459, 0x0012)]]);
    let error = drive.set_setpoint(THIRTY).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_does_not_turn_is_not_called_started() {
    let mut drive = drive(&[&STANDS, &RUNS, &[(459, 0x5002), (451, 0)]]);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(
        matches!(because(&error), Some(Refusal::Overridden { by, .. }) if by.contains("stop")),
        "{error}"
    );
}

#[tokio::test(start_paused = true)]
async fn the_first_status_tells_a_run_command_of_before_and_a_stop_under_way() {
    for (words, state) in [
        (&[(CMD, 0x000F)][..], State::Running),
        (&[(CMD, 0x100F)], State::Ready),
        (&[(CMD, 0x100F), (451, 200), (459, 0x4412)], State::Stopping),
        (&[(CMD, 0x200F), (459, 0x4022)], State::Stopping),
    ] {
        assert_eq!(drive(&[&STANDS, words]).status().await.unwrap().state, state, "{words:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn only_the_write_of_a_stop_travels_as_a_stop_and_forced_local_mode_is_told_at_once() {
    let local = [(458, 0x0427), (451, 300), (459, 0x0012)];
    let mut drive = drive(&[&STANDS, &local]);
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
    let asked = drive.into_port().asked;
    assert_eq!(asked[0], Asked::Write(Class::Stop, CMD, vec![0x100F]));
    assert!(asked[1..].iter().all(|asked| matches!(asked, Asked::Read(Class::Command, ..))), "{asked:?}");
    assert_eq!(asked.len(), 3);
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_withdrawn_in_forced_local_mode_and_not_where_it_would_take_the_motor() {
    let runs = [(451, 300), (459, 0x0012), (CMD, 0x000F)];
    let mut drive = drive(&[&STANDS, &runs, &[(458, 0x0427)]]);
    drive.withdraw().await.unwrap();
    assert_eq!(drive.into_port().written(), [(CMD, 0x100F)]);
    let mut drive = self::drive(&[&STANDS, &runs]);
    assert_eq!(drive.withdraw().await.unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn no_fault_is_reset_while_the_terminals_ask_for_a_run() {
    // Command by the terminals, and by the bus with each of LI1 to LI6 closed (IOLR, bits 0 to 5), whichever gives a run command.
    for (eti, inputs) in
        [(0x0006, 0), (0x0006, 1)].into_iter().chain((0..6).map(|input| (0x4006, 1 << input)))
    {
        let mut drive = drive(&[&STANDS, &[(458, 0x0608), (459, eti), (478, inputs)]]);
        let error = drive.reset_faults().await.unwrap_err();
        assert!(matches!(because(&error), Some(Refusal::Overridden { .. })), "{eti:#06x} {inputs}: {error}");
        assert_eq!(drive.into_port().written(), []);
    }
}

#[tokio::test(start_paused = true)]
async fn each_status_names_what_keeps_our_run_command_from_acting() {
    for (more, lack, by) in [
        // LFt 5 is OCF (p. 57, W457).
        (&[(458, 0x0608), (457, 5), (459, 0x4002), (451, 0)][..], Lack::Output, "5"),
        (&[(450, 500)], Lack::Reference, "FrH is not the reference of the bus"),
        // A reference of zero from elsewhere: the fast stop of an input, by bit 12 of ETI and without it, or an analog input.
        (&[(450, 0), (451, 0), (459, 0x4002)], Lack::Reference, "FrH is not the reference of the bus"),
        (&[(450, 0), (451, 0), (459, 0x5002)], Lack::Reference, "FrH is not the reference of the bus"),
        // Another master has taken the run command back; its word is read at once.
        (&[(CMD, 0x0007), (459, 0x4002), (451, 0)], Lack::Command, ""),
    ] {
        let mut drive = drive(&[&STANDS, &RUNS, more]);
        drive.adopt(Lease::new(Direction::Forward, 0x000F));
        let told = lacks_within(&mut drive, 10).await;
        let (lacks, because) = told.unwrap_or_else(|| panic!("{more:?}: told in force"));
        assert!(lacks == lack && because.contains(by), "{more:?}: {because}");
    }
    let mut drive = drive(&[&STANDS, &RUNS]);
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    assert_eq!(lacks_within(&mut drive, 10).await, None);
}

#[tokio::test(start_paused = true)]
async fn a_limit_across_the_setpoint_is_no_other_reference_whether_it_bounds_frh_or_the_output_alone() {
    for limit in [[(250, 200), (450, 200), (451, 200)], [(251, 400), (450, 400), (451, 400)]] {
        for bounded in [450, 0] {
            let more: Vec<_> = limit.iter().copied().filter(|(at, _)| *at != 450 || *at == bounded).collect();
            let mut drive = drive(&[&STANDS, &RUNS, &more]);
            drive.adopt(Lease::new(Direction::Forward, 0x000F));
            assert_eq!(lacks_within(&mut drive, 20).await, None, "{more:?}");
        }
    }
}

/// An analog input is another word at each reading, and each of them another question.
#[tokio::test(start_paused = true)]
async fn a_reference_from_elsewhere_that_never_stands_still_is_told_as_another_one() {
    let mut port = Words::new(&CAPABILITIES, &[&STANDS[..], &RUNS[..], &[(450, 400)]].concat());
    port.wanders = Some(450);
    let mut drive = Atv28::new(port, 1.try_into().unwrap());
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    let told = lacks_within(&mut drive, 20).await;
    assert_eq!(told.map(|(lack, _)| lack), Some(Lack::Reference));
}

/// Reverse (ETA bit 15) behind a forward run command, in current limit (ETI bit 11): neither at its reference nor on a ramp.
#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_the_other_way_and_says_nothing_of_a_ramp_is_not_told_in_force() {
    let mut drive = drive(&[&STANDS, &RUNS, &[(458, 0x8227), (459, 0x4812)]]);
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    let mut told = Vec::new();
    for _ in 0..6 {
        told.push(drive.status().await.unwrap().verdict);
        tokio::time::sleep(std::time::Duration::from_secs(1)).await;
    }
    assert!(!told.contains(&Some(Verdict::InForce)), "{told:?}");
    assert!(matches!(told[5], Some(Verdict::NotInForce { lacks: Lack::Reference, .. })), "{told:?}");
}

/// The reference before the ramp is above the high speed, up to which the drive turns its motor.
#[tokio::test(start_paused = true)]
async fn a_start_at_a_reference_that_stands_above_the_high_speed_is_told_at_that() {
    let mut drive = drive(&[&STANDS, &RUNS, &[(401, 600), (450, 600), (451, 500), (251, 50)]]);
    let started = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(started.reference, Some(Frequency::from_hertz(50)));
}

/// FrH is a word that monitors: it shows another reference only some readings after the drive follows that, as FRHD says at once. 1500 rpm are
/// SMAL, of 50 Hz, HSP.
#[tokio::test(start_paused = true)]
async fn a_start_is_confirmed_at_its_setpoint_and_not_at_the_reference_that_frh_still_shows() {
    const SPEEDS: [(u16, u16); 3] = [(603, 900), (604, 900), (608, 1_500)];
    for before in [0, 400] {
        let mut words = Words::new(&CAPABILITIES, &[&STANDS[..], &RUNS, &SPEEDS, &[(450, before)]].concat());
        words.lags = Some((450, 300, 4));
        let mut drive = Atv28::new(words, 1.try_into().unwrap());
        let started = drive.start(Direction::Forward).await.unwrap();
        assert_eq!(started.reference, Some(Frequency::from_hertz(30)), "{before}");
    }
    // One that was asked for in rpm, LFr being of before, is seen in force at once.
    let begun = tokio::time::Instant::now();
    let mut drive = drive(&[&STANDS[..], &RUNS, &SPEEDS, &[(401, 100)]]);
    drive.start(Direction::Forward).await.unwrap();
    assert!(begun.elapsed() < std::time::Duration::from_millis(100), "{:?}", begun.elapsed());
    // Whatever FrH is for good, the drive follows the bus.
    let mut drive = self::drive(&[&STANDS[..], &RUNS, &SPEEDS, &[(450, 200)]]);
    let started = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(started.reference, Some(Frequency::from_hertz(20)));
}
