//! What counts as done, on words as the manual gives them: in force, and never only written.

use drive_atv312::{Atv312, CAPABILITIES};
use drive_core::{
    Class, Control, Direction, Drive, Error, ErrorKind, Frequency, Lack, Lease, Refusal, Row, Setpoint,
    State, StopMode,
};
use drive_testing::words::{Asked, Words, lacks_within};

const CMD: u16 = 8501;
const LFR: u16 = 8502;
const THIRTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(30));

/// The settings of a drive for the bus (p. 11, 35–37, 40), `tFr`, `HSP`, and a setpoint of 30 Hz.
const FOR_THE_BUS: [(u16, u16); 12] = [
    (3006, 2),
    (3103, 600),
    (3104, 500),
    (8401, 2),
    (8411, 96),
    (8413, 164),
    (8421, 98),
    (8423, 10),
    (8424, 10),
    (11203, 173),
    (11204, 174),
    (LFR, 300),
];
/// "Switch on disabled", commanded by Modbus.
const STANDS: [(u16, u16); 2] = [(3201, 0x0240), (3206, 0x4002)];
/// Runs forward at 30 Hz by our command (p. 10, 21, 22).
const RUNS: [(u16, u16); 5] = [(3201, 0x0627), (3202, 300), (3203, 300), (3206, 0x4012), (CMD, 0x000F)];

fn drive(words: &[&[(u16, u16)]]) -> Atv312<Words> {
    Atv312::new(Words::new(&CAPABILITIES, &words.concat()), 1.try_into().unwrap())
}

/// The same, once its settings are known.
async fn watched(words: &[&[(u16, u16)]]) -> Atv312<Words> {
    let mut drive = drive(words);
    drive.status().await.unwrap();
    drive.self_restarts().await.unwrap();
    drive
}

fn row(code: &str) -> &'static Row {
    Row::find(drive_atv312::ROWS, code).unwrap()
}

fn commands(drive: Atv312<Words>) -> Vec<u16> {
    drive.into_port().written().into_iter().filter(|(at, _)| *at == CMD).map(|(_, word)| word).collect()
}

fn because(error: &Error) -> Option<Refusal> {
    match error {
        Error::Refused { reason, .. } => Some(*reason),
        Error::NotConfirmed { because, .. } => *because,
        _ => None,
    }
}

fn overridden_by(error: &Error, what: &str) -> bool {
    matches!(because(error), Some(Refusal::Overridden { by, .. }) if by.contains(what))
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_the_settings_lack_is_replaced_and_always_written() {
    for (settings, asked, word, used) in [
        // Stt, p. 40: fast, freewheel, injection, unknown.
        (&[(11201, 0)][..], StopMode::Ramp, 0x100F, StopMode::Ramp),
        (&[(11201, 1)], StopMode::Ramp, 0x100F, StopMode::Fast),
        (&[(11201, 2)], StopMode::Ramp, 0x100F, StopMode::Freewheel),
        (&[(11201, 3)], StopMode::Ramp, 0x400F, StopMode::Fast),
        (&[(11201, 9)], StopMode::Ramp, 0x400F, StopMode::Fast),
        // A function on bit 12 (p. 42), and no fast stop on a bit.
        (&[(11401, 172)], StopMode::Ramp, 0x400F, StopMode::Fast),
        (&[(11401, 172), (11204, 0)], StopMode::Ramp, 0x0002, StopMode::Fast),
        (&[(11204, 0)], StopMode::Fast, 0x0002, StopMode::Fast),
        // No injection on a bit: what Stt says, and never what the others lack.
        (&[(11203, 0)], StopMode::DcInjection, 0x100F, StopMode::Ramp),
        (&[(11203, 0), (11201, 3)], StopMode::DcInjection, 0x100F, StopMode::DcInjection),
        (&[(11203, 0), (11401, 172)], StopMode::DcInjection, 0x400F, StopMode::Fast),
        (&[], StopMode::DcInjection, 0x200F, StopMode::DcInjection),
        (&[(11201, 3)], StopMode::Freewheel, 0x0000, StopMode::Freewheel),
        // An access level that the manual does not list.
        (&[(3006, 7)], StopMode::Ramp, 0x0002, StopMode::Fast),
    ] {
        let mut drive = watched(&[&FOR_THE_BUS, &STANDS, settings]).await;
        let stopped = drive.stop(asked).await.unwrap();
        assert_eq!(stopped.mode, used, "{settings:?}, {asked}");
        assert_eq!(stopped.instead.is_some(), asked != used, "{settings:?}, {asked}");
        assert_eq!(commands(drive), [word], "{settings:?}, {asked}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_was_never_read_is_stopped_before_anything_is_read() {
    for (mode, word) in [
        (StopMode::Ramp, 0x0002),
        (StopMode::Fast, 0x0002),
        (StopMode::DcInjection, 0x0002),
        (StopMode::Freewheel, 0x0000),
    ] {
        let mut drive = drive(&[&FOR_THE_BUS, &STANDS]);
        drive.stop(mode).await.unwrap();
        let asked = drive.into_port().asked;
        assert_eq!(asked[0], Asked::Write(Class::Stop, CMD, vec![word]), "{mode}");
        let stops = asked
            .iter()
            .filter(|asked| matches!(asked, Asked::Write(Class::Stop, ..) | Asked::Read(Class::Stop, ..)));
        assert_eq!(stops.count(), 1, "{mode}: the readings are commands");
    }
}

#[tokio::test(start_paused = true)]
async fn where_bit_13_selects_the_command_channel_it_stays_with_the_bus() {
    // CCS = C113, Cd1 = tEr, Cd2 = Mdb (p. 37): the bus commands while bit 13 is 1.
    let switched = [(8421, 189), (8423, 1), (8424, 10), (11203, 0), (CMD, 0x200F)];
    for (mode, word) in [(StopMode::Ramp, 0x300F), (StopMode::Fast, 0x600F), (StopMode::Freewheel, 0x2000)] {
        let mut drive = watched(&[&FOR_THE_BUS, &STANDS, &switched]).await;
        drive.stop(mode).await.unwrap();
        assert_eq!(commands(drive), [word], "{mode}");
    }
    // Never read: at once a word that stops, then the one that takes the channel back, as soon as that is known and when all is.
    let terminals = [(3206, 0x0002)];
    let mut drive = drive(&[&FOR_THE_BUS, &STANDS, &switched, &terminals]);
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(commands(drive), [0x0002, 0x2002, 0x2002]);
    // Read before a reconnect: bit 13 as it was known.
    let mut drive = watched(&[&FOR_THE_BUS, &RUNS, &switched]).await;
    drive.forget();
    let _ = drive.stop(StopMode::Freewheel).await;
    assert_eq!(commands(drive)[0], 0x2000);
}

#[tokio::test(start_paused = true)]
async fn a_stop_to_a_motor_that_no_word_of_the_bus_reaches_is_told_at_once() {
    // Forced local, turning: ETA bit 9 is 0.
    let local = [(3201, 0x0427), (3202, 300), (3206, 0x0012)];
    let mut drive = watched(&[&FOR_THE_BUS, &local]).await;
    let begun = tokio::time::Instant::now();
    for _ in 0..2 {
        let error = drive.stop(StopMode::Ramp).await.unwrap_err();
        assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
    }
    assert_eq!(begun.elapsed(), std::time::Duration::ZERO);
    // A quick stop would be one as soon as he lets go of the motor, and none was asked for.
    assert_eq!(commands(drive), [0x100F; 2], "and written all the same");
}

/// ETI bit 0: nothing can be written while it saves (BBV51701 p. 22).
#[tokio::test(start_paused = true)]
async fn a_stop_to_a_drive_that_saves_is_told_as_such_and_goes_on_as_the_stop_that_was_asked_for() {
    let saves = [(3201, 0x0627), (3202, 300), (3203, 300), (3206, 0x4013), (CMD, 0x000F)];
    let mut drive = watched(&[&FOR_THE_BUS, &saves]).await;
    for _ in 0..2 {
        let error = drive.stop(StopMode::Ramp).await.unwrap_err();
        assert!(because(&error).is_some_and(|because| because.to_string().contains("EEPROM")), "{error}");
    }
    assert!(commands(drive).iter().all(|word| *word == 0x100F));
}

#[tokio::test(start_paused = true)]
async fn a_motor_under_direct_current_has_not_come_to_a_stop() {
    // p. 20: stopped is ETI.4 = ETI.5 = 0.
    let braked = [(3201, 0x0627), (3206, 0x4022), (CMD, 0x200F)];
    let status = drive(&[&FOR_THE_BUS, &braked]).status().await.unwrap();
    assert_eq!(status.state, State::Stopping);
    assert!(!status.is_standstill());
}

#[tokio::test(start_paused = true)]
async fn a_run_command_of_before_shows_at_once_also_where_nothing_turns() {
    // After tLS (p. 28), or at a setpoint of zero.
    let waits = [(3201, 0x0627), (3206, 0x4002), (CMD, 0x000F)];
    let status = drive(&[&FOR_THE_BUS, &waits]).status().await.unwrap();
    assert_eq!(status.state, State::Running);
    let stopped = [(3201, 0x0627), (3206, 0x4002), (CMD, 0x100F)];
    assert_eq!(drive(&[&FOR_THE_BUS, &stopped]).status().await.unwrap().state, State::Ready);
}

#[tokio::test(start_paused = true)]
async fn the_first_status_behind_a_stop_of_another_program_says_stopping() {
    let comes_down = [(3201, 0x0227), (3202, 200), (3206, 0x4412), (CMD, 0x100F)];
    let status = drive(&[&FOR_THE_BUS, &comes_down]).status().await.unwrap();
    assert_eq!(status.state, State::Stopping);
    assert_eq!(status.motion, drive_core::Motion::Braking, "{status:?}");
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(20)));
}

#[tokio::test(start_paused = true)]
async fn a_status_at_rest_is_one_exchange_and_of_a_motor_that_runs_two_until_its_settings_are_known() {
    let is_status = |asked: &Asked| *asked == Asked::Read(Class::Status, 3201, 6);
    let mut drive = drive(&[&FOR_THE_BUS, &STANDS]);
    for _ in 0..3 {
        drive.status().await.unwrap();
    }
    let asked = drive.into_port().asked;
    assert!(asked.len() == 3 && asked.iter().all(is_status), "{asked:?}");

    let mut drive = self::drive(&[&FOR_THE_BUS, &RUNS]);
    for _ in 0..30 {
        drive.status().await.unwrap();
    }
    let asked = drive.into_port().asked;
    assert_eq!(
        asked[1],
        Asked::Read(Class::Status, CMD, 4),
        "the resolution, and whether a run command is in force"
    );
    assert_eq!(asked.len(), 30 + 1 + 17, "each block once");
    assert!(asked.windows(2).all(|pair| pair.iter().any(is_status)), "never two behind one status");
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_of_a_motor_that_somebody_else_has_is_not_confirmed() {
    // LAC = L1; ETA and ETI (p. 16, 20): a motor that the terminals run, and one at rest in forced local mode.
    for (settings, eta, eti) in
        [(&[(3006, 0)][..], 0x0627, 0x0012), (&[(3006, 0)], 0x0427, 0x0002), (&[], 0x0427, 0x4002)]
    {
        let mut drive = drive(&[&FOR_THE_BUS, settings, &[(3201, eta), (3206, eti)]]);
        let error = drive.set_setpoint(THIRTY).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
        assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_release_leaves_no_setpoint_to_the_terminals_that_command_already() {
    // Cd1 = tEr, Fr1 = Mdb, and the terminals command (p. 20, 36, 37).
    let mut drive = drive(&[&FOR_THE_BUS, &[(8423, 1), (3201, 0x0240), (3206, 0x0002)]]);
    drive.release().await.unwrap();
    assert_eq!(drive.into_port().written(), [(LFR, 0)]);
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_direct_current_brakes_in_a_quick_stop_is_not_let_coast_by_a_start() {
    // "Quick stop active" (ETA xx0x111), and bit 4 of ETI: the motor is under current, at an output frequency of 0.
    let mut drive = drive(&[&FOR_THE_BUS, &STANDS, &[(3201, 0x0607), (3206, 0x4012)]]);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(because(&error), Some(Refusal::State(State::QuickStop)), "{error}");
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_while_a_logic_input_asks_for_a_stop() {
    // p. 40 and 41: FSt and nSt stop while their input is 0, dCI while it is 1.
    for (function, stops, runs) in [(11204, 0, 1 << 3), (11202, 0, 1 << 3), (11203, 1 << 3, 0)] {
        for (inputs, refused) in [(stops, true), (runs, false)] {
            // LI4.
            let mut drive = drive(&[&FOR_THE_BUS, &RUNS, &[(function, 132), (5240, inputs)]]);
            let outcome = drive.start(Direction::Forward).await;
            let is_refused = outcome.as_ref().is_err_and(|error| overridden_by(error, "nSt, FSt or dCI"));
            assert_eq!(is_refused, refused, "{function}, inputs {inputs:06b}: {outcome:?}");
            assert_eq!(commands(drive).is_empty(), refused);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_is_confirmed_only_by_the_reference_of_the_bus() {
    let mut drive = drive(&[&FOR_THE_BUS, &RUNS]);
    drive.start(Direction::Forward).await.unwrap();
    // FrH (p. 21) is another one, and nothing says whose.
    let mut drive = self::drive(&[&FOR_THE_BUS, &RUNS, &[(3203, 500)]]);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    assert!(overridden_by(&error, "FrH"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_start_at_which_something_else_would_decide_the_speed_is_refused_with_its_name() {
    for (settings, by) in [
        (&[(11901, 1)][..], "PIF"),
        // LFL = LFF, and bit 12 of LRS1: the 4-20 mA are lost (p. 22, 54).
        (&[(7003, 4), (3250, 1 << 12)], "LFL"),
        (&[(8411, 97), (8414, 1)], "Fr2"),
        (&[(8413, 1)], "Fr1"),
        // rFC by LI5, which has selected Fr2 = AI1: LRS3 bit 0.
        (&[(8411, 133), (8414, 1), (3252, 1)], "Fr2"),
        // PS2 on LI3, PS4 on bit 15 of CMD, JOG on LI4, and these are on.
        (&[(11401, 131), (5240, 0b100)], "preset"),
        (&[(11402, 175), (CMD, 0x8000)], "preset"),
        (&[(11110, 132), (5240, 0b1000)], "jog"),
        // AI2 at 4 V is summed to Fr1; so is AI1 at -1 V, and Modbus itself.
        (&[(11801, 2), (5243, 4_000)], "SA2"),
        (&[(11802, 1), (5242, 0xFC18)], "SA3"),
        (&[(11801, 164)], "SA2"),
    ] {
        let mut drive = drive(&[&FOR_THE_BUS, &STANDS, settings]);
        let error = drive.start(Direction::Forward).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Refused, "{error}");
        assert!(overridden_by(&error, by), "{error}");
        let error = drive.set_setpoint(THIRTY).await.unwrap_err();
        assert!(overridden_by(&error, by), "{error}");
        assert!(commands(drive).is_empty(), "{by}");
    }
    // Assigned and silent: nothing decides instead.
    let silent = [(11401, 131), (11801, 2), (5243, 3), (8411, 133), (7003, 5)];
    let mut drive = drive(&[&FOR_THE_BUS, &RUNS, &silent]);
    drive.start(Direction::Forward).await.unwrap();
    drive.set_setpoint(THIRTY).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_to_a_running_motor_is_confirmed_by_frh() {
    let mut drive = drive(&[&FOR_THE_BUS, &RUNS]);
    drive.set_setpoint(THIRTY).await.unwrap();
    let error = drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "these words do not follow");
    assert!(overridden_by(&error, "FrH"), "{error}");
    // LFL = rLS and the 4-20 mA are lost (p. 22, 54): the motor keeps its speed, and FrH may be the reference of the bus all the same.
    let mut drive = self::drive(&[&FOR_THE_BUS, &RUNS, &[(7003, 5), (3250, 1 << 12)]]);
    let error = drive.set_setpoint(THIRTY).await.unwrap_err();
    assert!(error.kind() == ErrorKind::NotConfirmed && overridden_by(&error, "LFL"), "{error}");
}

/// LAF on LI5 (p. 50).
#[tokio::test(start_paused = true)]
async fn a_start_towards_a_limit_switch_that_keeps_the_motor_from_turning_names_it() {
    let enabled = [(3201, 0x0627), (3203, 300), (3206, 0x4002)];
    for (switch, is_named) in [(0, false), (133, true)] {
        let mut drive = drive(&[&FOR_THE_BUS, &enabled, &[(11601, switch)]]);
        let error = drive.start(Direction::Forward).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
        assert_eq!(overridden_by(&error, "limit switch"), is_named, "{error}");
    }
}

/// AdC (p. 41) holds the motor; nothing has it run.
#[tokio::test(start_paused = true)]
async fn what_is_refused_while_direct_current_flows_does_not_say_that_the_motor_runs() {
    let mut drive = drive(&[&FOR_THE_BUS, &[(3201, 0x0627), (3206, 0x4022), (CMD, 0x100F)]]);
    let error = drive.release().await.unwrap_err();
    assert!(
        matches!(because(&error), Some(Refusal::Settings(why)) if why.contains("direct current")),
        "{error}"
    );
}

#[tokio::test(start_paused = true)]
async fn a_start_the_other_way_says_in_which_direction_the_motor_still_turns() {
    // Forward, slowing down, reverse requested (ETI bit 15).
    let turning_round = [(3201, 0x0227), (3202, 100), (3203, 300), (3206, 0xC412), (CMD, 0x000F)];
    let mut drive = drive(&[&FOR_THE_BUS, &turning_round]);
    let status = drive.start(Direction::Reverse).await.unwrap();
    assert_eq!(status.direction, Some(Direction::Forward));
    // A motor that does not think of it.
    let mut drive = self::drive(&[&FOR_THE_BUS, &RUNS]);
    assert_eq!(drive.start(Direction::Reverse).await.unwrap_err().kind(), ErrorKind::NotConfirmed);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_starts_again_by_itself_is_started_only_where_that_is_accepted_by_name() {
    let mut drive = drive(&[&FOR_THE_BUS, &RUNS, &[(7122, 1)]]);
    assert_eq!(drive.self_restarts().await.unwrap()[0].code, "Atr");
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(
        matches!(because(&error), Some(Refusal::RestartsItself(restart)) if restart.code == "Atr"),
        "{error}"
    );
    drive.accept_self_restart(&["other"]);
    assert!(drive.start(Direction::Forward).await.is_err());
    drive.accept_self_restart(&["Atr"]);
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_withdrawn_by_the_stop_of_bit_12_alone() {
    // Somebody has forced local mode and runs the motor.
    let local = [(3201, 0x0427), (3202, 300), (3206, 0x0012), (CMD, 0x000F)];
    let mut drive = drive(&[&FOR_THE_BUS, &local]);
    drive.withdraw().await.unwrap();
    assert_eq!(commands(drive), [0x100F]);
    // A function on bit 12, and access level L1, where any command would take the motor from him.
    for settings in [&[(11401, 172)][..], &[(3006, 0), (3201, 0x0627)]] {
        let mut drive = self::drive(&[&FOR_THE_BUS, &local, settings]);
        assert_eq!(drive.withdraw().await.unwrap_err().kind(), ErrorKind::Unsupported);
        assert!(commands(drive).is_empty());
    }
}

#[tokio::test(start_paused = true)]
async fn release_puts_back_what_was_set_up_and_leaves_no_setpoint_behind() {
    // As it leaves the factory (p. 15), but Fr1 by AI3.
    let factory = [(8401, 1), (8413, 3), (8423, 1), (8424, 10), (8411, 96), (8421, 98)];
    let functions = [(11401, 131), (11402, 132), (11801, 2), (11102, 1), (LFR, 300)];
    let mut drive = drive(&[&STANDS, &factory, &functions]);
    drive.set_up_bus_control().await.unwrap();
    // These words name the bus for ever; what counts is what was written.
    let error = drive.release().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    let words = drive.into_port().words;
    for (register, before) in
        [(8413, 3), (8423, 1), (8401, 1), (11401, 131), (11402, 132), (11801, 2), (11203, 0), (LFR, 0)]
    {
        assert_eq!(words.get(&register).copied().unwrap_or(0), before, "{register}");
    }
}

#[tokio::test(start_paused = true)]
async fn set_up_leaves_neither_ai2_nor_li3_and_li4_beside_the_setpoint() {
    let mut drive = drive(&[&STANDS, &[(11401, 131), (11402, 132), (11801, 2), (11403, 133)]]);
    drive.set_up_bus_control().await.unwrap();
    let words = drive.into_port().words;
    assert_eq!([11401, 11402, 11801].map(|register| words[&register]), [0; 3]);
    assert_eq!(words[&11403], 133, "what its owner has assigned is for him to change");
}

#[tokio::test(start_paused = true)]
async fn nothing_is_released_or_reset_while_a_level_at_the_terminals_would_start_the_motor() {
    // tCC = 2C and tCt = LEL (p. 33), LI1 closed; then rrS on LI2.
    for inputs in [&[(5240, 0b01)][..], &[(5240, 0b10), (11105, 130)]] {
        let mut drive = drive(&[&FOR_THE_BUS, &STANDS, inputs]);
        assert!(overridden_by(&drive.release().await.unwrap_err(), "terminals"));
        assert_eq!(drive.into_port().written(), []);
        let mut drive = self::drive(&[&FOR_THE_BUS, &[(3201, 0x0208), (3206, 0x0006), (8423, 1)], inputs]);
        assert!(overridden_by(&drive.reset_faults().await.unwrap_err(), "terminals"));
        assert_eq!(drive.into_port().written(), []);
    }
}

#[tokio::test(start_paused = true)]
async fn the_injection_at_standstill_is_set_only_where_no_current_can_flow() {
    // p. 41: it injects "even if a run command has not been sent".
    let enabled = [(3201, 0x0627), (3206, 0x4002)];
    let mut drive = drive(&[&FOR_THE_BUS, &enabled]);
    let error = drive.write_parameter(row("AdC"), 2).await.unwrap_err();
    assert!(matches!(because(&error), Some(Refusal::Settings(why)) if why.contains("AdC")), "{error}");
    assert_eq!(drive.into_port().written(), []);
    let mut drive = self::drive(&[&FOR_THE_BUS, &STANDS]);
    assert!(drive.write_parameter(row("AdC"), 2).await.unwrap().changed);
}

#[tokio::test(start_paused = true)]
async fn the_reset_of_the_operating_time_is_done_when_it_has_fallen_back() {
    // p. 55: "automatically falls back to nO as soon as the reset to zero is performed".
    let mut words = Words::new(&CAPABILITIES, &[FOR_THE_BUS.as_slice(), &STANDS].concat());
    words.deaf = true;
    let mut drive = Atv312::new(words, 1.try_into().unwrap());
    assert!(drive.write_parameter(row("rPr"), 2).await.unwrap().changed);
}

/// The driver of a drive whose motor runs by our command and whose settings are known, with these words besides.
async fn leased(more: &[(u16, u16)]) -> Atv312<Words> {
    let mut drive = watched(&[&FOR_THE_BUS, &RUNS, more]).await;
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    drive
}

#[tokio::test(start_paused = true)]
async fn each_status_names_what_keeps_our_run_command_from_acting() {
    let elsewhere = (3203, 500);
    for (more, lack, by) in [
        (&[elsewhere][..], Lack::Reference, "FrH"),
        // A reference of zero from elsewhere, at which the motor does not turn.
        (&[(3203, 0), (3202, 0), (3206, 0x4002)], Lack::Reference, "FrH"),
        // p. 21: bit 11 of ETA, "reference exceeded (< LSP or > HSP)": no other reference decides.
        (&[(3203, 200), (3201, 0x0A27)], Lack::Reference, "below LSP or above HSP"),
        // p. 42: AI2 at 4 V is summed to Fr1. p. 35: LI5 switches to Fr2 = AI1, LRS3 bit 0. p. 43: PS2 on LI3.
        (&[elsewhere, (11801, 2), (5243, 4_000)], Lack::Reference, "SA2"),
        (&[elsewhere, (8411, 133), (8414, 1), (3252, 1)], Lack::Reference, "Fr2"),
        (&[elsewhere, (11401, 131), (5240, 0b100)], Lack::Reference, "preset"),
        (&[(11901, 1)], Lack::Reference, "PIF"),
        // p. 40: nSt on LI4 stops while it is open; the drive has no output any more.
        (&[(11202, 132), (5240, 0), (3201, 0x0627), (3202, 0), (3206, 0x4002)], Lack::Output, "nSt"),
    ] {
        let told = lacks_within(&mut leased(more).await, 20).await;
        let (lacks, because) = told.unwrap_or_else(|| panic!("{more:?}: told in force"));
        assert!(lacks == lack && because.contains(by), "{more:?}: {because}");
    }
    assert_eq!(lacks_within(&mut leased(&[]).await, 20).await, None);
}

#[tokio::test(start_paused = true)]
async fn a_limit_across_the_setpoint_is_no_other_reference_whether_it_bounds_frh_or_the_output_alone() {
    for limit in [[(3104, 200), (3203, 200), (3202, 200)], [(3105, 400), (3203, 400), (3202, 400)]] {
        for bounded in [3203, 0] {
            let more: Vec<_> =
                limit.iter().copied().filter(|(at, _)| *at != 3203 || *at == bounded).collect();
            let mut drive = leased(&more).await;
            assert_eq!(lacks_within(&mut drive, 20).await, None, "{more:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn whatever_setting_was_learnt_is_read_again_in_its_turn() {
    let mut drive = leased(&[]).await;
    for _ in 0..1_500 {
        drive.status().await.unwrap();
    }
    let asked = drive.into_port().asked;
    // Behind what was read to learn them: LAC, Fr1, rFC, Stt, nSt, PS2, JOG, SA2, PIF, Atr.
    for setting in [3006, 8413, 8411, 11201, 11202, 11401, 11110, 11801, 11901, 7122] {
        assert!(asked[100..].iter().any(|asked| asked.reads(setting)), "{setting} was read once");
    }
}

/// What somebody at the keypad may have set otherwise while the motor stood: all that is read but AdC, which decides nothing of a start.
#[tokio::test(start_paused = true)]
async fn each_start_reads_anew_all_that_decides_what_it_does() {
    // LAC, CCS, rFC, Fr1, Stt, rPS, LC2, EtF, CHP, Pr2, PS2, SA2, PIF, JOG, Atr, LFL; below L3 those that count there.
    let at_l3 = [
        3006, 8421, 8411, 8413, 11201, 9010, 9202, 7131, 8011, 11909, 11401, 11801, 11901, 11110, 7122, 7003,
    ];
    let below = [3006, 11201, 11401, 11801, 11901, 11110, 7122, 7003];
    for (settings, read, blocks) in [(&[][..], &at_l3[..], 16), (&[(3006, 0)], &below[..], 8)] {
        let mut drive = watched(&[&FOR_THE_BUS, &RUNS, settings]).await;
        for _ in 0..2 {
            drive.start(Direction::Forward).await.unwrap();
        }
        let asked = drive.into_port().asked;
        for &setting in read {
            let times = asked.iter().filter(|asked| asked.reads(setting)).count();
            assert_eq!(times, 3, "{setting}: once before, and for each start");
        }
        assert_eq!(read.len(), blocks);
    }
}

/// An analog input is another word at each reading, and each of them another question.
#[tokio::test(start_paused = true)]
async fn a_reference_from_elsewhere_that_never_stands_still_is_told_as_another_one() {
    let mut port = Words::new(&CAPABILITIES, &[&FOR_THE_BUS[..], &RUNS[..], &[(3203, 400)]].concat());
    port.wanders = Some(3203);
    let mut drive = Atv312::new(port, 1.try_into().unwrap());
    drive.status().await.unwrap();
    drive.self_restarts().await.unwrap();
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    let told = lacks_within(&mut drive, 20).await;
    assert_eq!(told.map(|(lack, _)| lack), Some(Lack::Reference));
}

/// "During saving (ETI.0 = 1), parameters cannot be written" (BBV51701 p. 20, 22): also what is written while the motor runs.
#[tokio::test(start_paused = true)]
async fn nothing_is_set_and_nothing_starts_while_the_drive_saves_its_parameters() {
    let saving = [(3206, 0x4003)];
    for (code, word) in [("ACC", 50), ("tdC", 10), ("SPAT", 3), ("SA2", 0)] {
        let mut drive = drive(&[&FOR_THE_BUS, &STANDS, &saving]);
        let refused = drive.write_parameter(row(code), word).await.unwrap_err();
        let reason = because(&refused).map(|reason| reason.to_string()).unwrap_or_default();
        assert!(reason.contains("ETI bit 0"), "{code}: {refused}");
        assert!(drive.into_port().written().is_empty(), "{code}");
    }
    let mut drive = drive(&[&FOR_THE_BUS, &STANDS, &saving]);
    let refused = drive.start(drive_core::Direction::Forward).await.unwrap_err();
    let reason = because(&refused).map(|reason| reason.to_string()).unwrap_or_default();
    assert!(reason.contains("ETI bit 0"), "{refused}");
    assert!(commands(drive).is_empty());
}

/// LRS1 bit 8 and ETI bit 7: "motor thermal overload alarm" (BBV51701 p. 22).
#[tokio::test(start_paused = true)]
async fn a_motor_thermal_alarm_is_told_once_from_whichever_word_shows_it() {
    for (eti, lrs1) in [(0x4002, 1 << 8), (0x4082, 0), (0x4082, 1 << 8)] {
        let mut drive = drive(&[&FOR_THE_BUS, &[(3201, 0x02C0), (3206, eti), (3250, lrs1)]]);
        let warnings = drive.faults().await.unwrap().warnings;
        let told: Vec<_> = warnings.iter().map(|alarm| alarm.entry.unwrap().meaning).collect();
        assert_eq!(told, ["motor thermal overload alarm"], "ETI {eti:04X}h, LRS1 {lrs1:04X}h");
    }
}

/// The reference before the ramp is above the high speed, up to which the drive turns its motor.
#[tokio::test(start_paused = true)]
async fn a_start_at_a_reference_that_stands_above_the_high_speed_is_told_at_that() {
    let mut drive =
        watched(&[&FOR_THE_BUS, &STANDS, &RUNS, &[(LFR, 600), (3202, 500), (3203, 600), (3105, 50)]]).await;
    let started = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(started.reference, Some(Frequency::from_hertz(50)));
}

/// FrH is a word that monitors: it shows another reference only some readings after the drive follows that, as FRHD says at once. 1500 rpm are
/// SMAL, of 50 Hz, HSP.
#[tokio::test(start_paused = true)]
async fn a_start_is_confirmed_at_its_setpoint_and_not_at_the_reference_that_frh_still_shows() {
    const SPEEDS: [(u16, u16); 3] = [(8602, 900), (8605, 900), (8609, 1_500)];
    for before in [0, 400] {
        let mut words =
            Words::new(&CAPABILITIES, &[&FOR_THE_BUS[..], &RUNS, &SPEEDS, &[(3203, before)]].concat());
        words.lags = Some((3203, 300, 4));
        let mut drive = Atv312::new(words, 1.try_into().unwrap());
        let started = drive.start(Direction::Forward).await.unwrap();
        assert_eq!(started.reference, Some(Frequency::from_hertz(30)), "{before}");
    }
    // One that was asked for in rpm, LFr being of before, is seen in force at once.
    let begun = tokio::time::Instant::now();
    let mut drive = drive(&[&FOR_THE_BUS[..], &RUNS, &SPEEDS, &[(LFR, 100)]]);
    drive.start(Direction::Forward).await.unwrap();
    assert!(begun.elapsed() < std::time::Duration::from_millis(100), "{:?}", begun.elapsed());
    // Whatever FrH is for good, the drive follows the bus.
    let mut drive = self::drive(&[&FOR_THE_BUS[..], &RUNS, &SPEEDS, &[(3203, 200)]]);
    let started = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(started.reference, Some(Frequency::from_hertz(20)));
}
