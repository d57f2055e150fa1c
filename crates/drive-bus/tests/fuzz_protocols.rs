//! Whatever comes in on a line in Modbus ASCII or UNI-TELWAY: no panic, no wait without end, no wrong answer, and the next
//! good frame is understood.

#![cfg(all(feature = "ascii", feature = "unitelway"))]

mod support;

use std::borrow::Cow;

use bytes::Bytes;
use drive_bus::{
    Echo,
    exchange::{
        Answer, Exchange, Failure, Step,
        ascii::{self, Ascii, AsciiSettings},
        unitelway::{UniTelway, data_frame},
    },
    protocol::UniTelwaySettings,
};
use drive_core::serial::SerialSettings;
use proptest::prelude::*;
use support::{MS, script::Script};
use tokio_modbus::{Request, Response};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadInputRegisters(0, 1);

/// The longest that anything may take here: the machines' own limits, several times over.
const FOR_EVER: u32 = 60_000;

fn requests() -> impl Strategy<Value = Request<'static>> {
    prop_oneof![
        Just(Request::ReadHoldingRegisters(250, 4)),
        Just(Request::WriteSingleRegister(400, 6)),
        Just(Request::WriteMultipleRegisters(400, Cow::Borrowed(&[6, 500]))),
        Just(Request::Custom(0x08, Cow::Borrowed(&[0, 0, 1, 2]))),
    ]
}

/// Noise, frames of the protocol, and their parts, more often than chance makes them.
fn chunks(
    frame: impl Fn(u8, &[u8]) -> Vec<u8> + Clone + 'static,
    special: &'static [u8],
) -> impl Strategy<Value = Vec<Vec<u8>>> {
    let noise = prop::collection::vec(any::<u8>(), 0..600);
    let near = prop::collection::vec(prop::sample::select(special), 0..40);
    let data = prop::collection::vec(any::<u8>(), 1..40);
    let whole = (1_u8..4, data.clone()).prop_map({
        let frame = frame.clone();
        move |(slave, data)| frame(slave, &data)
    });
    let cut = (1_u8..4, data, 0_usize..30).prop_map(move |(slave, data, len)| {
        let mut frame = frame(slave, &data);
        frame.truncate(len);
        frame
    });
    prop::collection::vec(prop_oneof![noise, near, whole, cut], 0..12)
}

fn ascii_chunks() -> impl Strategy<Value = Vec<Vec<u8>>> {
    chunks(|slave, pdu| ascii::frame(slave, pdu, b'\n').to_vec(), b":0123456789ABCDEFabc\r\n!")
}

fn unitelway_chunks() -> impl Strategy<Value = Vec<Vec<u8>>> {
    let frame = |slave, unite: &[u8]| data_frame(slave, &[&[0], unite].concat()).to_vec();
    chunks(frame, &[0x10, 0x10, 0x02, 0x05, 0x01, 0x00, 0x06, 0x15, 0x04, 0x34, 0x66, 0xFD, 0xFE])
}

/// An exchange in the middle of all that. True: it has ended.
fn feed<M: Exchange>(script: &mut Script<M>, request: &Request<'static>, chunks: &[Vec<u8>]) -> bool {
    script.ask(1, request);
    for chunk in chunks {
        match script.hear(chunk) {
            Step::Done(_) => return true,
            Step::Wait(until) => drop(script.resume(1, until)),
            Step::More | Step::Send(_) => {}
        }
        assert!(script.strays().len() <= 4 * chunk.len() + 16, "strays without bound");
        if script.machine.deadline().is_some_and(|deadline| deadline <= script.now)
            && let Step::Done(_) = script.wait_or_go_on(1)
        {
            return true;
        }
    }
    false
}

/// Time alone ends it.
fn end<M: Exchange>(script: &mut Script<M>) {
    let began = script.now;
    loop {
        if let Step::Done(_) = script.wait_or_go_on(1) {
            break;
        }
        assert!(script.now - began < FOR_EVER * MS, "the exchange never ends");
    }
    script.now += 1_000 * MS;
}

/// A whole exchange with a slave that is as it should be, until the answer has come.
fn exchange(script: &mut Script<UniTelway>) -> Step {
    let sent = script.ask(1, &READ);
    play(script, sent, &data_frame(1, &[0, 0x34, 7, 0]))
}

/// Goes on with an exchange whose slave mirrors what it is asked to, and else says `reply`, until it ends.
fn play(script: &mut Script<UniTelway>, mut sent: Bytes, reply: &[u8]) -> Step {
    let mut holds = None;
    for _ in 0..1_000 {
        let heard = match *sent {
            [0x10, 0x02, 1, len, .., 0xFA, _, a, b, c, d, _] => {
                let header = &sent[4..usize::from(len) - 2];
                holds = Some(data_frame(1, &[header, &[0xFB, a, b, c, d]].concat()).to_vec());
                vec![0x06]
            }
            [0x10, 0x02, ..] => {
                holds = Some(reply.to_vec());
                vec![0x06]
            }
            [0x10, 0x05, 1] => holds.clone().unwrap_or_else(|| vec![0x04]),
            [0x06] => {
                holds = None;
                vec![]
            }
            _ => vec![],
        };
        let step = if heard.is_empty() { Step::More } else { script.hear(&heard) };
        match if step == Step::More { script.wait_or_go_on(1) } else { step } {
            Step::Send(bytes) => sent = bytes,
            Step::Wait(until) => sent = script.resume(1, until),
            step => return step,
        }
    }
    Step::More
}

proptest! {
    #[test]
    fn the_ascii_machine_survives_anything_and_understands_the_next_answer(
        request in requests(),
        chunks in ascii_chunks(),
        echo in prop::sample::select(vec![Echo::Off, Echo::On, Echo::Auto]),
    ) {
        let mut script = Script::new(Ascii::new(SERIAL, AsciiSettings::default(), echo));
        if !feed(&mut script, &request, &chunks) {
            end(&mut script);
        }
        script.ask(1, &READ);
        let step = script.hear(&ascii::frame(1, &[4, 2, 0, 7], b'\n'));
        prop_assert_eq!(step, Step::Done(Ok(Ok(Response::ReadInputRegisters(vec![7])))));
    }

    #[test]
    fn the_uni_telway_machine_survives_anything_and_understands_the_next_reply(
        request in requests(),
        chunks in unitelway_chunks(),
    ) {
        let mut script = Script::new(UniTelway::new(SERIAL, UniTelwaySettings::default(), 20 * MS));
        if !feed(&mut script, &request, &chunks) {
            end(&mut script);
        }
        let step = exchange(&mut script);
        prop_assert_eq!(step, Step::Done(Ok(Ok(Response::ReadInputRegisters(vec![7])))));
    }

    #[test]
    fn bytes_outside_an_exchange_are_strays_and_nothing_else(
        in_ascii in ascii_chunks(),
        on_uni_telway in unitelway_chunks(),
    ) {
        let mut ascii = Script::new(Ascii::new(SERIAL, AsciiSettings::default(), Echo::Off));
        for chunk in &in_ascii {
            prop_assert_eq!(ascii.hear(chunk), Step::More);
        }
        let mut unitelway =
            Script::new(UniTelway::new(SERIAL, UniTelwaySettings::default(), 20 * MS));
        for chunk in &on_uni_telway {
            prop_assert_eq!(unitelway.hear(chunk), Step::More);
        }
        let step = exchange(&mut unitelway);
        prop_assert_eq!(step, Step::Done(Ok(Ok(Response::ReadInputRegisters(vec![7])))));
    }

    #[test]
    fn a_damaged_reply_is_never_another_answer(
        words in prop::collection::vec(any::<u16>(), 4),
        at in any::<prop::sample::Index>(),
        flipped in 0_u8..8,
    ) {
        let mut unite = vec![0, 0x66, 7];
        unite.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let mut reply = data_frame(1, &unite).to_vec();
        let at = at.index(reply.len());
        reply[at] ^= 1 << flipped;
        let outcome = outcome_of(&reply);
        prop_assert!(outcome.is_err(), "{:02X?}: {:?}", reply, outcome);
    }
}

/// What becomes of reading four words from a slave that sends `reply` when it is polled for it, and nothing after that.
fn outcome_of(reply: &[u8]) -> Result<Answer, Failure> {
    let request = Request::ReadHoldingRegisters(250, 4);
    let mut script = Script::new(UniTelway::new(SERIAL, UniTelwaySettings::default(), 20 * MS));
    let sent = script.ask(1, &request);
    match play(&mut script, sent, reply) {
        Step::Done(outcome) => outcome,
        step => panic!("{step:?}"),
    }
}

#[test]
fn a_reply_that_a_flipped_bit_makes_shorter_is_no_answer_though_its_check_fits() {
    // The length was 0Bh. After three bytes stands 83h, the first byte of the words, and it is their sum.
    let reply = [0x10, 0x02, 0x01, 0x03, 0x00, 0x66, 0x07, 0x83, 0x07, 0, 0, 0, 0, 0, 0, 0x15];
    assert_eq!(outcome_of(&reply), Err(Failure::Mismatch("0 bytes instead of 4 words".to_owned())));
}
