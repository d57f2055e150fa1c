//! What counts as done, on words where the default map has them: in force, and never only written.

use std::{io, time::Duration};

use async_trait::async_trait;
use drive_atv58::{ASCII_MESSAGE_WATCH, Atv58, Atv58Map, CAPABILITIES};
use drive_core::{
    Class, Control, Direction, Drive, Error, ErrorKind, Frequency, Lack, Lease, Motion, Port, Refusal,
    Setpoint, StopMode, Terms, Verdict,
};
use drive_testing::words::{Asked, Words, lacks_within};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

const CMD: u16 = 400;
const THIRTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(30));
const STANDS: [(u16, u16); 3] = [(401, 300), (250, 500), (458, 0x0240)];
const RUNS: [(u16, u16); 6] = [(401, 300), (250, 500), (CMD, 0x000F), (450, 300), (451, 300), (458, 0x0627)];

fn with_map(words: &[&[(u16, u16)]], map: Atv58Map) -> Atv58<Words> {
    Atv58::with_map(Words::new(&CAPABILITIES, &words.concat()), 1.try_into().unwrap(), map)
}

fn drive(words: &[&[(u16, u16)]]) -> Atv58<Words> {
    with_map(words, Atv58Map::default())
}

fn because(error: &Error) -> Option<Refusal> {
    match error {
        Error::Refused { reason, .. } => Some(*reason),
        Error::NotConfirmed { because, .. } => *because,
        _ => None,
    }
}

#[tokio::test(start_paused = true)]
async fn the_watchdog_that_counts_is_that_of_the_instance() {
    // p. 24/48: 10 s on the bus, 1 s in the ASCII protocol.
    let time = |drive: &Atv58<Words>| drive.watchdog_capability().unwrap().max;
    assert_eq!(time(&drive(&[])), Duration::from_secs(10));
    let map = Atv58Map { message_watch: ASCII_MESSAGE_WATCH, ..Atv58Map::default() };
    let mut drive = with_map(&[], map);
    assert_eq!(time(&drive), Duration::from_secs(1));
    assert_eq!(drive.watchdog().await.unwrap().timeout, Some(Duration::from_secs(1)));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_the_map_does_not_have_is_replaced_and_always_written() {
    let no_ramp = Atv58Map { ramp_stop: None, ..Atv58Map::default() };
    for (map, asked, word, used) in [
        (Atv58Map::default(), StopMode::Ramp, 7, StopMode::Ramp),
        (Atv58Map::default(), StopMode::DcInjection, 7, StopMode::Ramp),
        (no_ramp, StopMode::Ramp, 2, StopMode::Fast),
        (no_ramp, StopMode::DcInjection, 2, StopMode::Fast),
    ] {
        let mut drive = with_map(&[&STANDS], map);
        let stopped = drive.stop(asked).await.unwrap();
        assert_eq!((stopped.mode, stopped.instead.is_some()), (used, asked != used), "{asked}");
        let asked = drive.into_port().asked;
        assert_eq!(asked[0], Asked::Write(Class::Stop, CMD, vec![word]));
        assert!(asked[1..].iter().all(|asked| matches!(asked, Asked::Read(Class::Command, ..))));
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_and_a_setpoint_are_confirmed_only_by_the_reference_of_the_bus() {
    let mut drive = drive(&[&RUNS]);
    drive.start(Direction::Forward).await.unwrap();
    drive.set_setpoint(THIRTY).await.unwrap();
    let mut drive = self::drive(&[&RUNS, &[(450, 500)]]);
    for error in
        [drive.start(Direction::Forward).await.unwrap_err(), drive.set_setpoint(THIRTY).await.unwrap_err()]
    {
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert!(matches!(because(&error), Some(Refusal::Overridden { .. })), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_does_not_turn_is_not_called_started() {
    let mut drive = drive(&[&RUNS, &[(451, 0)]]);
    assert_eq!(drive.start(Direction::Forward).await.unwrap_err().kind(), ErrorKind::NotConfirmed);
}

#[tokio::test(start_paused = true)]
async fn a_stop_in_forced_local_mode_is_told_at_once() {
    let mut drive = drive(&[&RUNS, &[(458, 0x0427)]]);
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
    assert_eq!(drive.into_port().written(), [(CMD, 7)]);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_in_forced_local_mode_is_not_confirmed() {
    let mut drive = drive(&[&STANDS, &[(458, 0x0040)]]);
    let error = drive.set_setpoint(Frequency::from_hertz(30).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    assert_eq!(because(&error), Some(Refusal::NotInControl(Control::Local)));
}

/// The driver of a drive whose motor runs by our command, with these words besides.
fn leased(more: &[(u16, u16)], map: Atv58Map) -> Atv58<Words> {
    let mut drive = with_map(&[&RUNS, more], map);
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    drive
}

#[tokio::test(start_paused = true)]
async fn each_status_names_what_keeps_our_run_command_from_acting() {
    for (more, lack, by) in [
        // -30 Hz, which another master has written.
        (&[(401, 0xFED4)][..], Lack::Reference, "sign of the reference W401"),
        (&[(450, 500)], Lack::Reference, "not that of W401"),
        // "Operation enabled" without an output beside a reference.
        (&[(451, 0)], Lack::Output, "a stop at the drive"),
        // The chart: "quick stop active", "switched on".
        (&[(458, 0x0607)], Lack::Output, "quick stop"),
        (&[(458, 0x0623)], Lack::Output, "disabled operation"),
        (&[(458, 0x0608)], Lack::Output, ""),
    ] {
        let told = lacks_within(&mut leased(more, Atv58Map::default()), 10).await;
        let (lacks, because) = told.unwrap_or_else(|| panic!("{more:?}: told in force"));
        assert!(lacks == lack && because.contains(by), "{more:?}: {because}");
    }
    // The high speed, W250, bounds what follows W401: 60 Hz is followed at 50.
    for more in [&[][..], &[(401, 600), (450, 500), (451, 500)]] {
        let mut drive = leased(more, Atv58Map::default());
        assert_eq!(lacks_within(&mut drive, 10).await, None, "{more:?}");
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce), "{more:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_limit_across_the_setpoint_is_no_other_reference_whether_it_bounds_frh_or_the_output_alone() {
    for limit in [[(250, 200), (450, 200), (451, 200)], [(251, 400), (450, 400), (451, 400)]] {
        for bounded in [450, 0] {
            let more: Vec<_> = limit.iter().copied().filter(|(at, _)| *at != 450 || *at == bounded).collect();
            let mut drive = leased(&more, Atv58Map::default());
            assert_eq!(lacks_within(&mut drive, 20).await, None, "{more:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_passes_zero_is_not_told_to_be_stopped_at_the_drive_by_one_look() {
    let mut drive = leased(&[(451, 0)], Atv58Map::default());
    assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::NotKnown));
    assert_eq!(lacks_within(&mut drive, 1).await.map(|(lack, _)| lack), Some(Lack::Output));
}

#[tokio::test(start_paused = true)]
async fn where_no_word_tells_who_commands_nothing_is_told_in_force() {
    let mut drive = leased(&[], Atv58Map { remote: 0, ..Atv58Map::default() });
    for _ in 0..10 {
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::NotKnown));
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_nobody_saw_brake_the_motor_is_not_told_as_rest() {
    // Running, then without an output as soon as the run command is gone: that the normal stop is a ramp no manual says.
    let mut drive = leased(&[(451, 0)], Atv58Map::default());
    assert_eq!(drive.status().await.unwrap().motion, Motion::Driven);
    let _ = drive.stop(StopMode::Ramp).await;
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
}

/// Words that change by what the drive is asked.
#[derive(Debug)]
struct Changing(Words, fn(&mut Words, &Request<'_>));

impl Port for Changing {
    fn set_terms(&mut self, terms: Terms) {
        self.0.set_terms(terms);
    }
}

impl SlaveContext for Changing {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Changing {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        (self.1)(&mut self.0, &request);
        self.0.call(request).await
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Bit 15 of ETA, and the sign of rFr: the motor turns in reverse.
const REVERSE: [(u16, u16); 2] = [(458, 0x8627), (451, 0xFED4)];

#[tokio::test(start_paused = true)]
async fn a_motor_that_stood_and_is_turned_the_other_way_is_not_called_started() {
    fn turns(words: &mut Words, request: &Request<'_>) {
        if matches!(request, Request::WriteSingleRegister(CMD, 0x000F)) {
            words.words.extend(REVERSE);
        }
    }
    let words = Words::new(&CAPABILITIES, &[&RUNS[..], &[(CMD, 7), (458, 0x0623), (451, 0)]].concat());
    let mut drive = Atv58::new(Changing(words, turns), 1.try_into().unwrap());
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_the_other_way_at_a_speed_that_does_not_fall_is_not_told_in_force() {
    let mut drive = leased(&REVERSE, Atv58Map::default());
    let mut told = Vec::new();
    for _ in 0..10 {
        told.push(drive.status().await.unwrap().verdict.unwrap());
        tokio::time::advance(Duration::from_millis(500)).await;
    }
    assert!(!told.contains(&Verdict::InForce), "{told:?}");
    let Some(Verdict::NotInForce { lacks: Lack::Reference, because }) = told.last() else {
        panic!("{told:?}")
    };
    assert!(because.to_string().contains("turns the motor the other way"), "{because}");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_round_is_not_told_to_be_turned_by_somebody_else() {
    fn comes_down(words: &mut Words, request: &Request<'_>) {
        if matches!(request, Request::ReadHoldingRegisters(first, _) if *first > 401) {
            let output = words.words.get(&451).copied().unwrap_or(0).cast_signed();
            words.words.insert(451, (output + 1).min(0).cast_unsigned());
        }
    }
    let words = Words::new(&CAPABILITIES, &[&RUNS[..], &REVERSE].concat());
    let mut drive = Atv58::new(Changing(words, comes_down), 1.try_into().unwrap());
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    // A tenth of a hertz in two seconds: the slowest ramp, 999.9 s from 50 Hz.
    for _ in 0..295 {
        tokio::time::advance(Duration::from_secs(2)).await;
        let verdict = drive.status().await.unwrap().verdict;
        assert!(!matches!(verdict, Some(Verdict::NotInForce { .. })), "{verdict:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_this_side_is_told_as_nobody_elses_while_the_motor_comes_down() {
    // Behind 0007h operation is disabled, "switched on", and the motor is coming down (the chart's transition 5).
    fn stops(words: &mut Words, request: &Request<'_>) {
        if matches!(request, Request::WriteSingleRegister(CMD, 0x0007)) {
            words.words.insert(458, 0x0223);
        }
    }
    let mut drive = Atv58::new(Changing(Words::new(&CAPABILITIES, &RUNS), stops), 1.try_into().unwrap());
    drive.start(Direction::Forward).await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    for _ in 0..5 {
        let verdict = drive.status().await.unwrap().verdict;
        assert!(!matches!(verdict, Some(Verdict::NotInForce { .. })), "{verdict:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_withdrawn_where_the_motor_has_no_output_whoever_keeps_it_from_acting() {
    // The fast stop of an input leaves "operation enabled"; forced local mode is bit 9 of ETA at 0.
    for (eta, output, is_withdrawn) in [(0x0627, 0, true), (0x0427, 0, true), (0x0427, 300, false)] {
        let mut drive = leased(&[(458, eta), (450, 0), (451, output)], Atv58Map::default());
        drive.status().await.unwrap();
        assert_eq!(drive.withdraw().await.is_ok(), is_withdrawn, "{eta:#06x} {output}");
        let written: &[(u16, u16)] = if is_withdrawn { &[(CMD, 0)] } else { &[] };
        assert_eq!(drive.into_port().written(), written);
    }
}

/// An analog input is another word at each reading, and each of them another question.
#[tokio::test(start_paused = true)]
async fn a_reference_from_elsewhere_that_never_stands_still_is_told_as_another_one() {
    let mut port = Words::new(&CAPABILITIES, &[&RUNS[..], &[(450, 400)]].concat());
    port.wanders = Some(450);
    let mut drive = Atv58::with_map(port, 1.try_into().unwrap(), Atv58Map::default());
    drive.adopt(Lease::new(Direction::Forward, 0x000F));
    let told = lacks_within(&mut drive, 20).await;
    assert_eq!(told.map(|(lack, _)| lack), Some(Lack::Reference));
}

/// The reference before the ramp is above the high speed, up to which the drive turns its motor.
#[tokio::test(start_paused = true)]
async fn a_start_at_a_reference_that_stands_above_the_high_speed_is_told_at_that() {
    let mut drive = drive(&[&STANDS, &RUNS, &[(401, 600), (450, 600), (451, 500), (251, 50)]]);
    let started = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(started.reference, Some(Frequency::from_hertz(50)));
}
