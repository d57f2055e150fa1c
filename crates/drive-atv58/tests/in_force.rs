//! What counts as done, on words where the default map has them: in force, and never only written.

use std::time::Duration;

use drive_atv58::{ASCII_MESSAGE_WATCH, Atv58, Atv58Map, CAPABILITIES};
use drive_core::{
    Class, Control, Direction, Drive, Error, ErrorKind, Frequency, Refusal, Setpoint, StopMode,
};
use drive_testing::words::{Asked, Words};

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
