//! Whatever a master sends, the slaves neither stop nor fill their memory: the next good frame is answered.

use std::time::Duration;

use drive_core::SerialSettings;
use drive_sim::{Delivery, Fault, Faults, Protocol, SimLine, Wiring, models::atv58::Atv58};
use fastrand::Rng;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

use crate::support::{ask, read};

const PATIENCE: Duration = Duration::from_secs(2);
/// The longest silence that any of the protocols waits for inside a frame.
const PAUSE: Duration = Duration::from_millis(1_500);

/// A request of each protocol for W252 of slave 1, and how its answer ends.
fn good(protocol: Protocol) -> Vec<u8> {
    match protocol {
        Protocol::Rtu => read(1, 252, 1),
        Protocol::Ascii => b":010300FC0001FF\r\n".to_vec(),
        Protocol::UniTelway => vec![0x10, 0x05, 0x01],
    }
}

/// Bytes that look like frames now and then.
fn rubbish(random: &mut Rng, protocol: Protocol) -> Vec<u8> {
    let mut bytes = match random.u8(0..4) {
        0 => good(protocol),
        1 => vec![0x10, 0x02, 0x01, random.u8(..)],
        2 => b":01".to_vec(),
        _ => Vec::new(),
    };
    let alphabet = [0x10, 0x02, 0x05, 0x06, b':', b'\r', b'\n', b'0', b'F', 0x01, 0x03];
    for _ in 0..random.usize(0..600) {
        bytes.push(if random.bool() { random.u8(..) } else { random.choice(alphabet).unwrap_or(0) });
    }
    for _ in 0..random.usize(0..3) {
        let at = random.usize(0..bytes.len().max(1));
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << random.u8(0..8);
        }
    }
    bytes
}

async fn drain(port: &mut DuplexStream) {
    let mut buffer = [0; 4_096];
    while tokio::time::timeout(PAUSE, port.read(&mut buffer)).await.is_ok() {}
}

#[tokio::test(start_paused = true)]
async fn rubbish_in_any_protocol_is_left_at_the_next_good_frame() {
    for protocol in [Protocol::Rtu, Protocol::Ascii, Protocol::UniTelway] {
        for unpaced in [false, true] {
            let wiring = Wiring { protocol, unpaced, ..Wiring::rtu(SerialSettings::MODBUS_DEFAULT) };
            let line = SimLine::new(wiring);
            line.add(1, Atv58::new()).unwrap();
            let mut port = line.in_memory();
            let mut random = Rng::with_seed(58);
            for round in 0..150 {
                port.write_all(&rubbish(&mut random, protocol)).await.unwrap();
                drain(&mut port).await;
                let answer = ask(&mut port, &good(protocol), PATIENCE).await;
                assert!(answer.is_some(), "{protocol:?}, round {round}");
                drain(&mut port).await;
                // Listen-only mode or another last character may have been understood; neither outlives the supply.
                line.slave(1).unwrap().power_cycle();
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn every_fault_at_once_leaves_a_line_that_works_without_them() {
    for protocol in [Protocol::Rtu, Protocol::Ascii, Protocol::UniTelway] {
        for delivery in [Delivery::Whole, Delivery::Pieces(1), Delivery::Pieces(3)] {
            let wiring = Wiring { protocol, delivery, ..Wiring::rtu(SerialSettings::MODBUS_DEFAULT) };
            let line = SimLine::new(wiring);
            line.add(1, Atv58::new()).unwrap();
            line.add(2, Atv58::new()).unwrap();
            let mut faults = Faults::seeded(5);
            for fault in Fault::ALL {
                faults.set(fault, 200_000);
            }
            line.set_faults(faults);
            let mut port = line.in_memory();
            for _ in 0..200 {
                ask(&mut port, &good(protocol), Duration::from_millis(50)).await;
            }
            line.set_faults(Faults::default());
            drain(&mut port).await;
            assert!(ask(&mut port, &good(protocol), PATIENCE).await.is_some(), "{protocol:?}");
        }
    }
}
