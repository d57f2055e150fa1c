//! Adapters that echo, and echoes that are damaged.

#![cfg(feature = "ascii")]

mod support;

use std::borrow::Cow;

use drive_bus::{
    Echo, LineConfig,
    exchange::{
        Failure, Machine, Step, Stray,
        ascii::{Ascii, AsciiSettings},
        rtu::Rtu,
    },
};
use drive_core::{Class, Terms, serial::SerialSettings};
use support::{
    MS,
    by_hand::ByHand,
    script::{PATIENCE, Script},
};
use tokio_modbus::{Request, Response};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadHoldingRegisters(0, 1);
const WRITE: Request<'static> = Request::WriteSingleRegister(8501, 0);

fn rtu(echo: Echo) -> Script<Rtu> {
    Script::new(Rtu::new(SERIAL, 20 * MS, echo))
}

fn ascii(echo: Echo) -> Script<Ascii> {
    Script::new(Ascii::new(SERIAL, AsciiSettings::default(), echo))
}

/// The request as the adapter gives it back, with one character changed behind the function code.
fn damaged(request: &[u8]) -> Vec<u8> {
    let mut echo = request.to_vec();
    let place = echo.len() / 2;
    echo[place] = if echo[place] == b'0' { b'1' } else { b'0' };
    echo
}

/// A read whose echo is damaged and whose answer comes after a pause, then a write that nobody answers.
fn story<M: Machine>(mut script: Script<M>, answer: &[u8], echoes: Echo) {
    let request = script.ask(1, &READ);
    assert_eq!(script.hear(&damaged(&request)), Step::More);
    if script.machine.deadline().is_some_and(|deadline| deadline < script.now + PATIENCE / 2) {
        assert_eq!(script.wait(), Step::More, "the answer may still come");
    }
    assert_eq!(script.hear(answer), Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![0x1111])))));
    assert_eq!(script.machine.echo_is_unknown(), echoes == Echo::Auto, "the answer did not come first");

    let request = script.ask(1, &WRITE);
    assert_eq!(script.hear(&request), Step::More);
    let end = script.wait_for_step();
    assert!(matches!(end, Step::Done(Err(Failure::Timeout | Failure::Mismatch(_)))), "{end:?}");
}

#[test]
fn behind_a_damaged_echo_the_answer_is_waited_for_and_no_echo_becomes_a_confirmation() {
    let words = [3, 2, 0x11, 0x11];
    for echo in [Echo::On, Echo::Auto] {
        story(rtu(echo), &drive_bus::exchange::rtu::frame(1, &words), echo);
        story(ascii(echo), &drive_bus::exchange::ascii::frame(1, &words, b'\n'), echo);
    }
}

#[test]
fn an_echo_that_is_damaged_and_never_answered_fails_when_the_time_is_over() {
    for echo in [Echo::On, Echo::Auto] {
        let mut script = rtu(echo);
        let request = script.ask(1, &READ);
        let asked = script.now;
        script.hear(&damaged(&request));
        let end = script.wait_for_step();
        assert!(matches!(end, Step::Done(Err(Failure::Mismatch(_)))), "{end:?}");
        assert_eq!(script.now, asked + PATIENCE);
    }
}

#[test]
fn where_nothing_echoes_a_damaged_answer_fails_at_once() {
    let mut script = rtu(Echo::Off);
    script.ask(1, &READ);
    script.hear(&damaged(&drive_bus::exchange::rtu::frame(1, &[3, 2, 0x11, 0x11])));
    assert_eq!(script.wait(), Step::Done(Err(Failure::Damaged("CRC"))));
}

#[test]
fn a_value_behind_a_damaged_echo_is_the_one_that_was_asked_for() {
    let mut line = ByHand::new(LineConfig { echo: Echo::On, ..LineConfig::stream(SERIAL) });
    line.ask(1, 1, Request::ReadHoldingRegisters(0, 1), Terms::default());
    line.ask(2, 1, Request::ReadHoldingRegisters(7, 1), Terms::default());
    let first = line.sent();
    line.hears(SERIAL.characters(8), &damaged(&first));
    // The drive has heard the request, and takes longer than any pause inside a frame.
    line.answers(&[1], &[3, 2, 0x11, 0x11]);
    let words = |word| Ok(Ok(Response::ReadHoldingRegisters(vec![word])));
    assert_eq!(line.ended(), Some((1, words(0x1111))));
    let second = line.sent();
    line.hears(SERIAL.characters(8), &second);
    line.answers(&[1], &[3, 2, 0x77, 0x77]);
    assert_eq!(line.ended(), Some((2, words(0x7777))));
}

#[test]
fn the_read_that_asks_for_the_echo_is_never_a_request_whose_answer_equals_it() {
    let mut line = ByHand::new(LineConfig { echo: Echo::Auto, ..LineConfig::stream(SERIAL) });
    let loop_back = || Request::Custom(8, Cow::Borrowed(&[0, 0, 0xA5, 0x37]));
    line.ask(1, 1, READ, Terms::default());
    let request = line.sent();
    line.answers(&request, &[3, 2, 0, 1]);
    line.ask(2, 1, loop_back(), Terms::default());
    let request = line.sent();
    line.answers(&request, &request[1..6]);
    assert!(line.ended().is_some() && line.ended().is_some());
    // Another adapter may be there after this.
    line.master.handle_lost(line.now, "unplugged");
    line.master.handle_up(line.now);
    // What the last one left behind would be taken for the answer before.
    line.now += 1_000 * MS;
    line.ask(3, 1, WRITE, Terms::of(Class::Stop));
    let request = line.sent();
    assert_eq!(request[1], 3);
    line.answers(&request, &[3, 2, 0, 1]);
    let request = line.sent();
    assert_eq!(request[1], 6);
    line.answers(&request, &request[1..6]);
    assert_eq!(line.ended(), Some((3, Ok(Ok(Response::WriteSingleRegister(8501, 0))))));
}

#[test]
fn the_read_that_asks_for_the_echo_waits_for_late_answers_and_a_stop_does_not_wait_for_it() {
    let config = LineConfig { echo: Echo::Auto, retries: 0, ..LineConfig::stream(SERIAL) };
    let unanswered = || {
        let mut line = ByHand::new(config.clone());
        line.ask(1, 1, READ, Terms::default());
        let request = line.sent();
        let end = line.now + SERIAL.characters(request.len());
        // All that is heard is a damaged echo, so that neither the echo is known nor the answer come.
        line.hears(SERIAL.characters(8), &damaged(&request));
        assert_eq!(line.next_sent(line.now + 2 * PATIENCE), None);
        assert!(matches!(line.ended(), Some((1, Err(_)))));
        (line, end + config.late_window)
    };
    let (mut line, late_until) = unanswered();
    line.ask(2, 1, WRITE, Terms::of(Class::Command));
    assert_eq!(line.sent()[1], 3);
    assert!(line.now >= late_until);

    let (mut line, late_until) = unanswered();
    line.ask(2, 1, WRITE, Terms::of(Class::Stop));
    assert_eq!(line.sent()[1], 6);
    assert!(line.now < late_until);
}

#[test]
fn the_echo_of_a_request_that_was_given_up_while_it_was_sent_is_no_late_answer() {
    fn given_up<M: Machine>(mut script: Script<M>) {
        let request = script.ask(1, &READ);
        script.machine.abandon();
        assert_eq!(script.hear(&request), Step::More);
        script.ask(2, &READ);
        assert_eq!(script.strays(), [Stray::Echo]);
    }
    given_up(rtu(Echo::On));
    given_up(ascii(Echo::On));
}
