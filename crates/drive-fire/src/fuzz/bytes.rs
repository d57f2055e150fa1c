//! Bytes that look like what a line carries more often than chance makes them.

use drive_bus::exchange::{ascii, rtu};

use super::source::Source;

/// PDUs that manuals and the specification print: requests, answers, refusals (MODBUS Application Protocol V1.1b3, section 6;
/// BBV51701; VVDED397054 p. 24; guide d'exploitation Altivar 21).
pub(super) const PDUS: &[&[u8]] = &[
    &[3, 0x0C, 0x81, 0, 4],
    &[3, 2, 2, 0x40],
    &[3, 6, 2, 0x2B, 0, 0, 0, 0x64],
    &[4, 2, 0, 0x0A],
    &[6, 0x21, 0x35, 0, 6],
    &[6, 0xFA, 0, 0xC4, 0],
    &[0x10, 0, 1, 0, 2, 4, 0, 0x0A, 1, 2],
    &[0x10, 0, 1, 0, 2],
    &[0x83, 2],
    &[0x86, 4],
    &[8, 0, 0, 0xA5, 0x37],
    &[0x0B, 0xFF, 0xFF, 1, 8],
    &[0x2B, 0x0E, 1, 0],
    &[
        0x2B, 0x0E, 1, 1, 0, 0, 1, 0, 12, b'T', b'e', b'l', b'e', b'm', b'e', b'c', b'a', b'n', b'i', b'q',
        b'u', b'e',
    ],
    &[0xAB, 0x0E, 2],
    &[1, 3, 0xCD, 0x6B, 5],
];

/// The longest file or text.
pub(super) const LONGEST: usize = 0xFFFF;

/// A PDU, as printed or changed.
pub(super) fn pdu(rng: &mut Source) -> Vec<u8> {
    let mut pdu = rng.bytes(253, |rng| {
        let mut pdu = PDUS[rng.usize(..PDUS.len())].to_vec();
        if rng.bool() {
            change(rng, &mut pdu);
        }
        if pdu.is_empty() {
            pdu.push(rng.u8(..));
        }
        pdu
    });
    if pdu.is_empty() {
        pdu.push(0);
    }
    pdu
}

/// One of these texts, changed.
pub(super) fn text(rng: &mut Source, texts: &[&str]) -> Vec<u8> {
    rng.bytes(LONGEST, |rng| {
        let mut text = texts[rng.usize(..texts.len())].as_bytes().to_vec();
        change(rng, &mut text);
        text
    })
}

/// One to four changes, each of a kind that finds something somewhere.
pub(crate) fn change(rng: &mut Source, bytes: &mut Vec<u8>) {
    for _ in 0..rng.usize(1..5) {
        let at = rng.usize(..=bytes.len());
        match rng.u8(..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.u8(..8),
            1 if at < bytes.len() => {
                bytes[at] = [0, 1, 0x7F, 0x80, 0xFF, 0x3A, 0x0D, 0x0A, 0x10][rng.usize(..9)];
            }
            2 => bytes.insert(at, rng.u8(..)),
            3 if at < bytes.len() => {
                bytes.remove(at);
            }
            4 => bytes.truncate(at),
            5 => {
                let end = bytes.len().min(at + 300);
                let again = bytes[at..end].to_vec();
                bytes.extend(again);
            }
            _ => bytes.extend((0..rng.usize(..9)).map(|_| rng.u8(..))),
        }
    }
}

/// Pieces of a stream of one protocol: whole frames, changed frames, their parts, noise.
pub(super) fn pieces(rng: &mut Source, frame: impl Fn(&mut Source, u8, &[u8]) -> Vec<u8>) -> Vec<Vec<u8>> {
    (0..rng.usize(..10))
        .map(|_| {
            let (slave, pdu) = (rng.u8(1..4), pdu(rng));
            let mut bytes = frame(rng, slave, &pdu);
            match rng.u8(..6) {
                0 => change(rng, &mut bytes),
                1 => bytes = (0..rng.usize(..300)).map(|_| rng.u8(..)).collect(),
                2 => bytes.truncate(rng.usize(..=bytes.len())),
                _ => {}
            }
            bytes
        })
        .collect()
}

pub(super) fn rtu_frame(_: &mut Source, slave: u8, pdu: &[u8]) -> Vec<u8> {
    rtu::frame(slave, pdu).to_vec()
}

pub(super) fn ascii_frame(_: &mut Source, slave: u8, pdu: &[u8]) -> Vec<u8> {
    ascii::frame(slave, pdu, b'\n').to_vec()
}

/// What stands on a UNI-TELWAY line: a poll, a byte that says yes, no or nothing, a data frame with the network header.
pub(super) fn telway_frame(rng: &mut Source, slave: u8, pdu: &[u8]) -> Vec<u8> {
    match rng.u8(..5) {
        0 => vec![[0x06, 0x15, 0x04][rng.usize(..3)]],
        1 => drive_unitelway_poll(slave),
        _ => {
            let mut data = vec![0];
            data.extend(pdu);
            telway_data(slave, &data)
        }
    }
}

fn drive_unitelway_poll(slave: u8) -> Vec<u8> {
    vec![0x10, 0x05, slave]
}

/// DLE STX address length data BCC, each 10h of length and data twice (the sum of all but the doubled ones).
fn telway_data(slave: u8, data: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x10, 0x02, slave];
    let mut sum = [0x10_u8, 0x02, slave].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    for byte in [data.len() as u8].iter().chain(data) {
        frame.push(*byte);
        sum = sum.wrapping_add(*byte);
        if *byte == 0x10 {
            frame.push(*byte);
        }
    }
    frame.push(sum);
    frame
}
