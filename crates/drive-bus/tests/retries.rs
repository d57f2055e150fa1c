//! What is sent again, what never is, and what is told of it.

#![cfg(feature = "tcp")]

mod support;

use std::{iter, time::Duration};

use drive_bus::LineConfig;
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use support::{MS, by_hand::ByHand};
use tokio_modbus::Request;

const READ: Request<'static> = Request::ReadHoldingRegisters(3201, 1);
const START: Request<'static> = Request::WriteSingleRegister(8501, 15);
const STOP: Request<'static> = Request::WriteSingleRegister(8501, 0);
const NO_ANSWER: PortError = PortError::OutcomeUnknown("no answer");

fn config() -> LineConfig {
    LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
}

fn command() -> Terms {
    Terms::of(Class::Command).within(Duration::from_secs(10))
}

/// What was written to slave 1 within a minute, answered by nobody, and how each call ended.
fn written(line: &mut ByHand) -> (Vec<u16>, Vec<(u32, Option<PortError>)>) {
    let (mut words, mut ended) = (Vec::new(), Vec::new());
    let until = line.now + Duration::from_secs(60);
    loop {
        let request = line.next_sent(until);
        let written = request.iter().filter(|request| request[1] == 6);
        words.extend(written.map(|request| u16::from_be_bytes([request[4], request[5]])));
        ended.extend(iter::from_fn(|| line.ended()).map(|(caller, outcome)| (caller, outcome.err())));
        if request.is_none() {
            return (words, ended);
        }
    }
}

#[test]
fn a_start_whose_answer_was_lost_is_not_sent_again_behind_a_stop_to_it_or_to_all() {
    for slave in [1, 0] {
        let mut line = ByHand::new(config());
        line.ask(1, 1, START, command());
        assert_eq!(line.sent()[5], 15);
        line.ask(2, slave, STOP, Terms::of(Class::Stop));
        let (words, ended) = written(&mut line);
        assert!(!words.is_empty() && words.iter().all(|word| *word == 0), "{words:?}");
        assert!(ended.contains(&(1, Some(NO_ANSWER))), "{ended:?}");
    }
    // Somebody else's stop is no reason.
    let mut line = ByHand::new(config());
    line.ask(1, 1, START, command());
    line.sent();
    line.ask(2, 2, STOP, Terms::of(Class::Stop));
    assert!(written(&mut line).0.contains(&15));
}

#[test]
fn a_write_that_expires_before_it_is_sent_again_is_not_told_as_never_sent() {
    let mut line = ByHand::new(config());
    // Its repetition waits until its late answer can no longer come.
    line.ask(1, 1, START, Terms::of(Class::Command).within(600 * MS));
    let (words, ended) = written(&mut line);
    assert_eq!((words, ended), (vec![15], vec![(1, Some(NO_ANSWER))]));
    assert_eq!(line.master.stats(line.now).slaves[&1].outcomes.expired, 1);
}

#[test]
fn an_old_setpoint_is_not_sent_again_after_a_newer_one_was_asked_for() {
    let setpoint = |word| Request::WriteSingleRegister(8502, word);
    let terms = command().replacing(1);
    let mut line = ByHand::new(config());
    line.ask(1, 1, setpoint(100), terms);
    line.sent();
    line.ask(2, 1, setpoint(200), terms);
    let (words, ended) = written(&mut line);
    assert!(!words.is_empty() && words.iter().all(|word| *word == 200), "{words:?}");
    assert_eq!(ended.first(), Some(&(1, Some(NO_ANSWER))));
    // One with another key, or without, is sent again.
    for other in [command().replacing(2), command()] {
        let mut line = ByHand::new(config());
        line.ask(1, 1, setpoint(100), terms);
        line.sent();
        line.ask(2, 1, setpoint(200), other);
        let (words, _) = written(&mut line);
        assert!(words.contains(&100) && words.contains(&200), "{words:?}");
    }
}

#[test]
fn a_stop_that_waits_is_sent_when_its_drive_goes_off_line_and_everything_else_is_not() {
    let mut line = ByHand::new(LineConfig { offline_after: 1, ..config() });
    line.ask(1, 1, READ, Terms::default());
    line.sent();
    line.ask(2, 1, STOP, Terms::of(Class::Stop));
    line.ask(3, 1, READ, Terms::of(Class::KeepAlive));
    let (words, ended) = written(&mut line);
    assert!(!words.is_empty(), "the stop was dropped: {ended:?}");
    assert!(
        ended.iter().any(|(caller, error)| *caller == 3 && matches!(error, Some(PortError::Offline { .. })))
    );
    assert!(!ended.iter().any(|(caller, error)| *caller == 2 && *error != Some(NO_ANSWER)), "{ended:?}");
}
