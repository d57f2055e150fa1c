//! Whatever comes in: no panic, no buffer without bound, and the next good frame is understood.

#![cfg(feature = "tcp")]

use std::{sync::Arc, time::Duration};

use drive_bus::{
    Echo,
    exchange::{Machine, Step, mbap::Mbap, rtu, rtu::Rtu},
    pdu,
};
use drive_core::serial::SerialSettings;
use proptest::prelude::*;
use tokio::time::Instant;
use tokio_modbus::{Request, Response, prelude::ReadCode};

const MS: Duration = Duration::from_millis(1);

fn requests() -> impl Strategy<Value = Request<'static>> {
    prop_oneof![
        Just(Request::ReadHoldingRegisters(3201, 4)),
        Just(Request::ReadCoils(0, 19)),
        Just(Request::WriteSingleRegister(8501, 6)),
        Just(Request::WriteMultipleRegisters(1, vec![1, 2].into())),
        Just(Request::ReadDeviceIdentification(ReadCode::Basic, 0)),
        Just(Request::Custom(0x08, vec![0, 0, 1, 2].into())),
        Just(Request::Custom(0x5A, vec![1].into())),
    ]
}

/// Bytes that look like frames more often than chance makes them.
fn chunks() -> impl Strategy<Value = Vec<Vec<u8>>> {
    let noise = prop::collection::vec(any::<u8>(), 0..300);
    let framed = (1_u8..4, prop::collection::vec(any::<u8>(), 1..40))
        .prop_map(|(slave, pdu)| rtu::frame(slave, &pdu).to_vec());
    let near = (prop::sample::select(vec![1_u8, 3, 6, 16, 0x2B, 0x83, 0xAB]), any::<u8>(), any::<u8>())
        .prop_map(|(function, a, b)| vec![1, function, a, b]);
    prop::collection::vec(prop_oneof![noise, framed, near], 0..12)
}

fn feed(
    machine: &mut dyn Machine,
    request: Request<'static>,
    chunks: &[Vec<u8>],
    mut now: Instant,
) -> Instant {
    let pdu = pdu::encode(&request).unwrap();
    machine.start(1, Arc::new(request), &pdu);
    machine.handle_sent(now, now + 50 * MS);
    for chunk in chunks {
        now += 7 * MS;
        machine.handle_bytes(now, chunk);
        assert!(machine.take_strays().len() <= 4 * (chunk.len() + 300), "strays without bound");
        if machine.deadline().is_some_and(|deadline| deadline <= now) {
            machine.handle_timeout(now);
        }
    }
    // Time alone ends every exchange.
    for _ in 0..8 {
        now = machine.deadline().unwrap_or(now).max(now);
        machine.handle_timeout(now);
    }
    assert_eq!(machine.deadline(), None, "the exchange never ends");
    now + 1_000 * MS
}

fn answers(machine: &mut dyn Machine, now: Instant, answer: impl Fn(&[u8]) -> Vec<u8>) {
    let request = Request::ReadInputRegisters(0, 1);
    let pdu = pdu::encode(&request).unwrap();
    let sent = machine.start(1, Arc::new(request), &pdu);
    machine.handle_sent(now, now + 500 * MS);
    let step = machine.handle_bytes(now + 5 * MS, &answer(&sent));
    assert_eq!(step, Step::Done(Ok(Ok(Response::ReadInputRegisters(vec![7])))));
}

proptest! {
    #[test]
    fn the_rtu_machine_survives_anything_and_understands_the_next_answer(
        request in requests(),
        chunks in chunks(),
        echo in prop::sample::select(vec![Echo::Off, Echo::On, Echo::Auto]),
    ) {
        let mut machine = Rtu::new(SerialSettings::MODBUS_DEFAULT, 20 * MS, echo);
        let now = feed(&mut machine, request, &chunks, Instant::now());
        answers(&mut machine, now, |_| rtu::frame(1, &[4, 2, 0, 7]).to_vec());
    }

    #[test]
    fn the_modbus_tcp_machine_survives_anything_and_understands_the_next_answer(
        request in requests(),
        chunks in chunks(),
    ) {
        let mut machine = Mbap::new();
        let now = feed(&mut machine, request, &chunks, Instant::now());
        answers(&mut machine, now, |sent| [&sent[..2], &[0, 0, 0, 5, 1, 4, 2, 0, 7]].concat());
    }

    #[test]
    fn bytes_outside_an_exchange_are_strays_and_nothing_else(chunks in chunks()) {
        let mut machine = Rtu::new(SerialSettings::MODBUS_DEFAULT, 20 * MS, Echo::Off);
        let mut now = Instant::now();
        for chunk in &chunks {
            now += 30 * MS;
            if machine.deadline().is_some() {
                prop_assert_eq!(machine.handle_timeout(now), Step::More);
            }
            prop_assert_eq!(machine.handle_bytes(now, chunk), Step::More);
        }
        answers(&mut machine, now + 1_000 * MS, |_| rtu::frame(1, &[4, 2, 0, 7]).to_vec());
    }
}
