//! Whatever comes in on a line in Modbus ASCII: no panic, no wait without end, no wrong answer, and the next
//! good frame is understood.

#![cfg(feature = "ascii")]

mod support;

use std::borrow::Cow;

use drive_bus::{
    Echo,
    exchange::{
        Machine, Step,
        ascii::{self, Ascii, AsciiSettings},
    },
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
fn chunks(frame: fn(u8, &[u8]) -> Vec<u8>, special: &'static [u8]) -> impl Strategy<Value = Vec<Vec<u8>>> {
    let noise = prop::collection::vec(any::<u8>(), 0..600);
    let near = prop::collection::vec(prop::sample::select(special), 0..40);
    let data = prop::collection::vec(any::<u8>(), 1..40);
    let whole = (1_u8..4, data.clone()).prop_map(move |(slave, data)| frame(slave, &data));
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

/// An exchange in the middle of all that. True: it has ended.
fn feed(script: &mut Script<Ascii>, request: &Request<'static>, chunks: &[Vec<u8>]) -> bool {
    script.ask(1, request);
    for chunk in chunks {
        match script.hear(chunk) {
            Step::Done(_) => return true,
            Step::More | Step::Send(_) | Step::Wait(_) => {}
        }
        assert!(script.strays().len() <= 4 * chunk.len() + 16, "strays without bound");
        if script.machine.deadline().is_some_and(|deadline| deadline <= script.now)
            && let Step::Done(_) = script.wait_for_step()
        {
            return true;
        }
    }
    false
}

/// Time alone ends it.
fn end(script: &mut Script<Ascii>) {
    let began = script.now;
    loop {
        if let Step::Done(_) = script.wait_for_step() {
            break;
        }
        assert!(script.now - began < FOR_EVER * MS, "the exchange never ends");
    }
    script.now += 1_000 * MS;
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
    fn bytes_outside_an_exchange_are_strays_and_nothing_else(chunks in ascii_chunks()) {
        let mut script = Script::new(Ascii::new(SERIAL, AsciiSettings::default(), Echo::Off));
        for chunk in &chunks {
            prop_assert_eq!(script.hear(chunk), Step::More);
        }
    }
}
