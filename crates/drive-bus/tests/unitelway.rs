//! The exchange machine of UNI-TELWAY: frames byte for byte, and what becomes of everything else. `unitelway_line.rs`
//! has the line above it.

mod support;

use std::borrow::Cow;

use bytes::Bytes;
use drive_bus::{
    exchange::{
        Exchange, Failure, Step, Stray,
        unitelway::{UNITE, UniTelway, data_frame, poll},
    },
    protocol::{NetworkHeader, UniTelwaySettings},
};
use drive_core::Class;
use support::{
    MS,
    script::{PATIENCE, Script},
    unitelway::{ACK, EOT, NAK, READ, WRITE, WRITTEN, serial},
};
use tokio_modbus::{ExceptionCode, Request, Response};

fn script(settings: UniTelwaySettings) -> Script<UniTelway> {
    Script::new(UniTelway::new(serial(), settings, 20 * MS))
}

fn simplified(category: u8) -> UniTelwaySettings {
    UniTelwaySettings { header: NetworkHeader::Simplified, category, ..UniTelwaySettings::default() }
}

/// A machine that knows slave 1 to hold nothing.
fn settled() -> Script<UniTelway> {
    let mut script = script(UniTelwaySettings::default());
    assert_eq!(script.ask(1, &READ), poll(1));
    assert_eq!(script.hear(EOT), Step::More);
    send(&mut script);
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0x34, 0, 0])), sends(ACK));
    assert!(matches!(script.wait(), Step::Done(Ok(Ok(_)))));
    script
}

fn sends(bytes: &[u8]) -> Step {
    Step::Send(Bytes::copy_from_slice(bytes))
}

/// The silence before a transmission passes; what is sent.
fn send(script: &mut Script<UniTelway>) -> Bytes {
    match script.wait() {
        Step::Send(bytes) => bytes,
        step => panic!("{step:?}"),
    }
}

/// The slave acknowledges the request and is polled.
fn acknowledge(script: &mut Script<UniTelway>) {
    assert_eq!(script.hear(ACK), Step::More);
    assert_eq!(send(script), poll(1));
}

/// A reply of slave 1 with the standard header.
fn reply(unite: &[u8]) -> Bytes {
    data_frame(1, &[&[0x20, 0, 0xFE, 0, 0, 0], unite].concat())
}

fn unite(code_and_body: &'static [u8]) -> Request<'static> {
    Request::Custom(UNITE, Cow::Borrowed(code_and_body))
}

/// Requests and replies as the link's rules make them, the 10h doubled, both checks as they are on the line.
struct Vector {
    settings: UniTelwaySettings,
    slave: u8,
    request: Request<'static>,
    sent: &'static [u8],
    reply: &'static [u8],
    answer: Response,
}

fn vectors() -> Vec<Vector> {
    let standard = UniTelwaySettings::default();
    let with = |reply: &'static [u8]| Response::Custom(UNITE, Bytes::from_static(reply));
    vec![
        // Mirror of 10h 04h, category 1, simplified header.
        Vector {
            settings: simplified(1),
            slave: 1,
            request: unite(&[0xFA, 0x10, 0x04]),
            sent: &[0x10, 0x02, 0x01, 0x05, 0x00, 0xFA, 0x01, 0x10, 0x10, 0x04, 0x37],
            reply: &[0x10, 0x02, 0x01, 0x04, 0x00, 0xFB, 0x10, 0x10, 0x04, 0x36],
            answer: with(&[0xFB, 0x10, 0x04]),
        },
        // Mirror of 05h.
        Vector {
            settings: simplified(0),
            slave: 1,
            request: unite(&[0xFA, 0x05]),
            sent: &[0x10, 0x02, 0x01, 0x04, 0x00, 0xFA, 0x00, 0x05, 0x16],
            reply: &[0x10, 0x02, 0x01, 0x03, 0x00, 0xFB, 0x05, 0x16],
            answer: with(&[0xFB, 0x05]),
        },
        // Mirror of 00h with the network header.
        Vector {
            settings: standard,
            slave: 1,
            request: unite(&[0xFA, 0x00]),
            sent: &[0x10, 0x02, 0x01, 0x09, 0x20, 0, 0xFE, 0, 0, 0, 0xFA, 0x07, 0x00, 0x3B],
            reply: &[0x10, 0x02, 0x01, 0x08, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xFB, 0x00, 0x34],
            answer: with(&[0xFB, 0x00]),
        },
        // Request 00h of category 7 to slave 2.
        Vector {
            settings: standard,
            slave: 2,
            request: unite(&[0x00, 0x00, 0x00]),
            sent: &[0x10, 0x02, 0x02, 0x0A, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x00, 0x07, 0x00, 0x00, 0x43],
            reply: &[0x10, 0x02, 0x02, 0x09, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x30, 0x00, 0x00, 0x6B],
            answer: with(&[0x30, 0x00, 0x00]),
        },
        // Error counters.
        Vector {
            settings: standard,
            slave: 1,
            request: unite(&[0xA2]),
            sent: &[0x10, 0x02, 0x01, 0x08, 0x20, 0, 0xFE, 0, 0, 0, 0xA2, 0x07, 0xE2],
            reply: &[
                0x10, 0x02, 0x01, 0x0F, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xD2, 0, 0, 0, 0, 0, 0, 0, 0,
                0x12,
            ],
            answer: with(&[0xD2, 0, 0, 0, 0, 0, 0, 0, 0]),
        },
        // The manual's reading of W250 to W253 (VVDED397054 p. 12/36), with the words of a drive.
        Vector {
            settings: simplified(7),
            slave: 1,
            request: Request::ReadHoldingRegisters(250, 4),
            sent: &[0x10, 0x02, 0x01, 0x09, 0x00, 0x36, 0x07, 0x68, 0x07, 0xFA, 0x00, 0x04, 0x00, 0xC6],
            reply: &[
                0x10, 0x02, 0x01, 0x0B, 0x00, 0x66, 0x07, 0xF4, 0x01, 0x00, 0x00, 0x10, 0x10, 0x00, 0x1E,
                0x00, 0xBE,
            ],
            answer: Response::ReadHoldingRegisters(vec![500, 0, 16, 30]),
        },
    ]
}

#[test]
fn the_test_vectors_go_both_ways_whole_byte_by_byte_and_twice_in_a_row() {
    for Vector { settings, slave, request, sent, reply, answer } in vectors() {
        let mut script = script(settings);
        for round in 0..3 {
            let opening = script.ask(slave, &request);
            if round == 0 {
                assert_eq!(opening, poll(slave), "nothing is known of the slave yet");
                script.hear(EOT);
                assert_eq!(send(&mut script), sent);
            } else {
                assert_eq!(opening, sent);
            }
            assert_eq!(script.hear(ACK), Step::More);
            assert_eq!(send(&mut script), poll(slave));
            let step = match round {
                0 => script.hear(reply),
                1 => script.hear_one_by_one(reply),
                _ => script.hear(&[reply, reply].concat()),
            };
            assert_eq!(step, sends(ACK), "{request:?}");
            assert_eq!(script.wait(), Step::Done(Ok(Ok(answer.clone()))));
        }
    }
}

#[test]
fn a_damaged_vector_is_refused_and_polled_for_again_and_never_taken_for_another_answer() {
    for Vector { settings, slave, request, reply, answer, .. } in vectors() {
        for at in 0..reply.len() {
            for bit in 0..8 {
                let mut damaged = reply.to_vec();
                damaged[at] ^= 1 << bit;
                let mut script = script(settings);
                script.ask(slave, &request);
                script.hear(EOT);
                send(&mut script);
                script.hear(ACK);
                send(&mut script);
                let mut step = script.hear(&damaged);
                if step == Step::More {
                    step = script.wait_for_step();
                }
                if step == sends(NAK) {
                    assert_eq!(send(&mut script), poll(slave));
                    assert_eq!(script.hear(reply), sends(ACK), "after {damaged:02X?}");
                    assert_eq!(script.wait(), Step::Done(Ok(Ok(answer.clone()))));
                } else {
                    // No beginning of a frame was left, or the beginning of another slave's.
                    assert_eq!(step, Step::Done(Err(Failure::Timeout)), "{damaged:02X?}");
                }
            }
        }
    }
}

#[test]
fn a_slave_that_has_nothing_to_say_yet_is_polled_again_until_its_time_is_over() {
    let mut script = settled();
    script.ask(1, &WRITE);
    let asked = script.now;
    acknowledge(&mut script);
    for _ in 0..3 {
        assert_eq!(script.hear(EOT), Step::More);
        assert_eq!(send(&mut script), poll(1));
    }
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(WRITTEN))));

    script.ask(1, &WRITE);
    acknowledge(&mut script);
    let step = loop {
        match script.hear(EOT) {
            Step::More => assert_eq!(send(&mut script), poll(1)),
            step => break step,
        }
    };
    assert_eq!(step, Step::Done(Err(Failure::Timeout)));
    assert!(script.now - asked >= PATIENCE);
}

#[test]
fn what_an_earlier_exchange_left_in_a_slave_is_taken_before_its_next_request() {
    let mut script = settled();
    script.ask(1, &WRITE);
    acknowledge(&mut script);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));

    assert_eq!(script.ask(1, &READ), poll(1));
    script.strays();
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.strays(), [Stray::Frame { slave: 1, function: 0xFE }]);
    assert_eq!(send(&mut script), poll(1));
    assert_eq!(script.hear(EOT), Step::More);
    assert_eq!(send(&mut script), reply(&[0x04, 0x07, 0x90, 0x01]));
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0x34, 0x06, 0x00])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![6])))));
}

#[test]
fn a_slave_that_says_nothing_to_the_first_poll_is_asked_all_the_same() {
    let mut script = script(UniTelwaySettings::default());
    assert_eq!(script.ask(1, &WRITE), poll(1));
    assert_eq!(send(&mut script), reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(WRITTEN))));
}

#[test]
fn a_slave_that_used_to_say_something_is_not_asked_when_it_says_nothing_until_the_second_time() {
    let mut script = settled();
    script.ask(1, &WRITE);
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)));
    assert_eq!(script.ask(1, &READ), poll(1));
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)), "what it holds may come late");
    assert_eq!(script.ask(1, &WRITE), poll(1));
    assert_eq!(send(&mut script), reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
}

#[test]
fn a_refused_request_is_sent_again_and_then_given_up_as_not_carried_out() {
    let mut script = settled();
    let request = script.ask(1, &WRITE);
    assert_eq!(script.hear(NAK), Step::More);
    assert_eq!(send(&mut script), request);
    assert!(matches!(script.hear(NAK), Step::Done(Err(Failure::Refused(_)))));
    assert_eq!(script.ask(1, &WRITE), request, "it holds nothing of it");
}

#[test]
fn a_refusal_among_noise_is_none_because_the_request_may_have_been_taken() {
    let mut script = settled();
    script.ask(1, &WRITE);
    assert_eq!(script.hear(&[0xAA, 0x15]), Step::More);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
}

#[test]
fn a_request_that_is_not_acknowledged_is_not_sent_again() {
    let mut script = settled();
    script.ask(1, &WRITE);
    let asked = script.now;
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)));
    assert!(script.now - asked < 110 * MS, "the link's own timeout, not that of the reply");
}

#[test]
fn a_reply_that_stays_damaged_is_given_up_and_one_that_breaks_off_is_damaged() {
    let mut script = settled();
    script.ask(1, &READ);
    acknowledge(&mut script);
    let good = reply(&[0x34, 1, 2]);
    assert_eq!(script.hear(&good[..7]), Step::More);
    assert_eq!(script.wait(), sends(NAK));
    assert_eq!(send(&mut script), poll(1));
    let mut damaged = good.to_vec();
    damaged[9] ^= 1;
    assert_eq!(script.hear(&damaged), Step::Done(Err(Failure::Damaged("BCC"))));
}

#[test]
fn a_reply_to_another_request_is_taken_from_the_slave_and_is_no_answer() {
    let mut script = settled();
    script.ask(1, &READ);
    acknowledge(&mut script);
    for unfit in [&[0xFE][..], &[0x34, 1], &[0x66, 7, 1, 2], &[]] {
        assert_eq!(script.hear(&reply(unfit)), sends(ACK), "{unfit:02X?}");
        assert_eq!(send(&mut script), poll(1));
    }
    assert_eq!(script.hear(&data_frame(1, &[0x55, 0x34, 1, 2])), sends(ACK), "an unknown header");
    assert_eq!(send(&mut script), poll(1));
    // Another slave's frame is not ours to acknowledge.
    assert_eq!(script.hear(&data_frame(2, &[0, 0x34, 1, 2])), Step::More);
    assert!(matches!(script.wait_for_step(), Step::Done(Err(Failure::Mismatch(_)))));
}

#[test]
fn a_negative_reply_is_an_exception_and_so_is_what_the_network_cannot_deliver() {
    let mut script = settled();
    for (answer, exception) in [
        (reply(&[0xFD]), ExceptionCode::IllegalDataValue),
        (data_frame(1, &[0x22, 0, 0xFE, 0, 0, 0]), ExceptionCode::GatewayPathUnavailable),
    ] {
        script.ask(1, &WRITE);
        acknowledge(&mut script);
        assert_eq!(script.hear(&answer), sends(ACK));
        assert_eq!(script.wait(), Step::Done(Ok(Err(exception))));
    }
}

#[test]
fn an_adapter_that_echoes_is_recognised_in_every_step() {
    let mut script = script(UniTelwaySettings::default());
    let first = script.ask(1, &READ);
    assert_eq!(script.hear(&first), Step::More);
    assert!(script.machine.echoes());
    script.hear(EOT);
    let request = reply(&[0x04, 0x07, 0x90, 0x01]);
    assert_eq!(send(&mut script), request);
    for _ in 0..2 {
        assert_eq!(script.hear(&request), Step::More);
        assert_eq!(script.hear(ACK), Step::More);
        assert_eq!(send(&mut script), poll(1));
        assert_eq!(script.hear(&[&poll(1)[..], &reply(&[0x34, 6, 0])].concat()), sends(ACK));
        // The next request waits for the echo of this acknowledgement, or it would be acknowledged by it.
        let answer = Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![6]))));
        assert_eq!(script.hear(ACK), answer);
        assert_eq!(script.ask(1, &READ), request);
    }
    assert_eq!(script.strays().iter().filter(|stray| **stray == Stray::Echo).count(), 7);
}

#[test]
fn what_the_protocol_has_no_form_for_is_refused_before_anything_is_sent() {
    let machine = UniTelway::new(serial(), UniTelwaySettings::default(), 20 * MS);
    let carries = |slave, request: &Request<'_>| machine.carries(slave, request, Class::Command);
    assert!(carries(0, &WRITE).is_err(), "a broadcast");
    assert!(carries(1, &Request::ReadHoldingRegisters(0, 64)).is_err());
    assert!(carries(1, &Request::Custom(0x08, Cow::Borrowed(&[0, 4, 0, 0]))).is_err());
    assert!(carries(1, &Request::Custom(UNITE, Cow::Owned(vec![0xFA; 252]))).is_err(), "too long");
    assert_eq!(carries(1, &Request::Custom(UNITE, Cow::Owned(vec![0xFA; 240]))), Ok(()));
    let specific = unite(&[0xF2, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0]);
    assert!(machine.is_write(&specific));
    for class in Class::ALL {
        let carried = machine.carries(1, &specific, class).is_ok();
        assert_eq!(carried, class >= Class::Command, "{class}");
    }
}
