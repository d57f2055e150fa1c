//! What a third party hears of a line that two others speak on: whole frames, whose they are, and everything else as what
//! it is.

#![cfg(all(feature = "tcp", feature = "ascii", feature = "unitelway"))]

mod support;

use std::time::Duration;

use drive_bus::{
    LineConfig, OpenError, Protocol,
    content::{Content, Signal},
    exchange::{ascii, rtu},
    listen::{Ear, Heard, Listener, Role},
};
use drive_core::serial::{CharacterFormat, SerialSettings};
use proptest::prelude::*;
use support::MS;
use tokio::io::AsyncWriteExt as _;

const READ: &[u8] = &[3, 0x0C, 0x81, 0, 2];
const WORDS: &[u8] = &[3, 4, 0x06, 0x27, 0, 1];
const WRITE: &[u8] = &[6, 0x21, 0x35, 0, 15];

fn config(protocol: &str) -> LineConfig {
    let serial = SerialSettings::new(19_200, CharacterFormat::F8O1).unwrap();
    LineConfig { protocol: protocol.parse().unwrap(), ..LineConfig::stream(serial) }
}

/// All that is heard of these pieces, of which each comes so long after the one before it.
fn heard(protocol: &str, pieces: &[(Duration, Vec<u8>)]) -> Vec<Heard> {
    let mut ear = Ear::new(&config(protocol), Duration::ZERO).unwrap();
    let (mut now, mut all) = (Duration::ZERO, Vec::new());
    for (pause, piece) in pieces {
        now += *pause;
        while let Some(deadline) = ear.deadline().filter(|deadline| *deadline <= now) {
            assert!(deadline >= all.last().map_or(Duration::ZERO, |heard: &Heard| heard.last));
            ear.handle_timeout();
            all.extend(ear.by_ref());
        }
        ear.hear(now, piece);
        all.extend(ear.by_ref());
    }
    ear.handle_timeout();
    all.extend(ear.by_ref());
    assert_eq!(ear.deadline(), None, "something is kept for ever");
    all
}

fn roles(all: &[Heard]) -> Vec<Role> {
    all.iter().map(|heard| heard.role).collect()
}

fn is_damaged(heard: &Heard) -> bool {
    heard.role == Role::Damaged
}

/// Reads, writes, a refusal, an identification, a vendor's function, a broadcast, and a request without an answer.
fn conversation() -> Vec<(Role, Vec<u8>)> {
    use Role::{Answer, Request};
    let identified = [&[0x2B, 0x0E, 1, 1, 0, 0, 1, 0, 3][..], b"ATV"].concat();
    let said: [(Role, u8, &[u8]); 18] = [
        (Request, 1, READ),
        (Answer, 1, WORDS),
        (Request, 2, WRITE),
        (Answer, 2, WRITE),
        (Request, 2, WRITE),
        (Answer, 2, WRITE),
        (Request, 1, &[16, 0x21, 0x35, 0, 2, 4, 0, 6, 1, 0xF4]),
        (Answer, 1, &[16, 0x21, 0x35, 0, 2]),
        (Request, 3, READ),
        (Answer, 3, &[0x83, 2]),
        (Request, 1, &[0x2B, 0x0E, 1, 0]),
        (Answer, 1, &identified),
        (Request, 0, WRITE),
        (Request, 9, READ),
        (Request, 1, &[8, 0, 0, 0xA5, 0x37]),
        (Answer, 1, &[8, 0, 0, 0xA5, 0x37]),
        (Request, 1, &[0x17, 0, 1, 0, 1, 0, 9, 0, 1, 2, 0, 7]),
        (Answer, 1, &[0x17, 2, 0, 9]),
    ];
    said.into_iter().map(|(role, slave, pdu)| (role, rtu::frame(slave, pdu).to_vec())).collect()
}

#[test]
fn a_conversation_without_any_silence_is_told_apart_whole_wherever_it_is_cut() {
    let said = conversation();
    let bytes: Vec<u8> = said.iter().flat_map(|(_, frame)| frame.clone()).collect();
    let told = |pieces: &[(Duration, Vec<u8>)]| {
        let all = heard("rtu", pieces);
        let told: Vec<(Role, Vec<u8>)> = all.iter().map(|heard| (heard.role, heard.bytes.to_vec())).collect();
        assert_eq!(told, said);
    };
    told(&[(1_000 * MS, bytes.clone())]);
    for cut in 1..bytes.len() {
        let (before, behind) = bytes.split_at(cut);
        told(&[(1_000 * MS, before.to_vec()), (15 * MS, behind.to_vec())]);
    }
    let one_by_one = bytes.iter().map(|byte| (MS, vec![*byte]));
    let pieces: Vec<_> = [(1_000 * MS, vec![])].into_iter().chain(one_by_one).collect();
    told(&pieces);
}

#[test]
fn a_write_and_the_answer_that_equals_it_are_told_by_their_order() {
    let write = rtu::frame(2, WRITE).to_vec();
    let twice = [write.clone(), write.clone()].concat();
    // Behind a silence in which any answer would have come.
    assert_eq!(roles(&heard("rtu", &[(600 * MS, twice.clone())])), [Role::Request, Role::Answer]);
    // In the middle of a conversation it may be either, until a frame of one form has been heard.
    let read = rtu::frame(1, READ).to_vec();
    let all = heard("rtu", &[(10 * MS, [&twice[..], &read, &twice].concat())]);
    let expected = [Role::Either, Role::Either, Role::Request, Role::Request, Role::Answer];
    assert_eq!(roles(&all), expected);
    // One that nobody answers is written again.
    let all = heard("rtu", &[(600 * MS, write.clone()), (600 * MS, write)]);
    assert_eq!(roles(&all), [Role::Request, Role::Request]);
}

#[test]
fn a_frame_has_the_times_of_its_first_and_of_its_last_byte() {
    let read = rtu::frame(1, READ).to_vec();
    let (head, tail) = read.split_at(3);
    let all = heard("rtu", &[(600 * MS, head.to_vec()), (4 * MS, tail.to_vec())]);
    assert_eq!(all.iter().map(|heard| (heard.first, heard.last)).collect::<Vec<_>>(), [(600 * MS, 604 * MS)]);
}

#[test]
fn frames_are_found_behind_noise_and_behind_frames_that_were_cut_off() {
    let (read, words) = (rtu::frame(1, READ).to_vec(), rtu::frame(1, WORDS).to_vec());
    let good = [read.clone(), words.clone()].concat();
    let damaged: [&[u8]; 8] = [
        &[0xFF],
        &[0, 0, 0],
        &[1, 3],
        &read[..7],
        &words[..words.len() - 1],
        &[1, 0x10, 0, 0, 0, 0x7B, 0xF6, 1, 2],
        &[7, 0x41, 1, 2, 3],
        &[1, 3, 4, 6, 0x27, 0, 0, 0xAA, 0xAA],
    ];
    for noise in damaged {
        let bytes = [noise, &good].concat();
        for pieces in [
            vec![(600 * MS, bytes.clone())],
            vec![(600 * MS, noise.to_vec()), (3 * MS, good.clone())],
            vec![(600 * MS, noise.to_vec()), (30 * MS, good.clone())],
        ] {
            let all = heard("rtu", &pieces);
            let (bad, rest): (Vec<_>, Vec<_>) = all.iter().partition(|heard| is_damaged(heard));
            let lost: Vec<u8> = bad.iter().flat_map(|heard| heard.bytes.to_vec()).collect();
            assert_eq!(lost, noise);
            assert_eq!(
                rest.iter().map(|heard| heard.role).collect::<Vec<_>>(),
                [Role::Request, Role::Answer]
            );
        }
    }
}

#[test]
fn a_frame_of_a_function_that_nobody_knows_ends_with_the_silence_or_with_the_next_frame() {
    let (vendors, read) = (rtu::frame(1, &[0x41, 1, 2, 3, 4, 5, 6]).to_vec(), rtu::frame(1, READ).to_vec());
    let bytes = [vendors.clone(), read.clone()].concat();
    for pieces in [vec![(600 * MS, bytes)], vec![(600 * MS, vendors.clone()), (3 * MS, read)]] {
        let all = heard("rtu", &pieces);
        assert_eq!(all[0].bytes, vendors);
        assert_eq!(roles(&all), [Role::Request, Role::Request]);
    }
}

#[test]
fn modbus_ascii_is_heard_and_what_stands_between_its_frames() {
    let (write, read) = (ascii::frame(2, WRITE, b'\n'), ascii::frame(1, READ, b'\n'));
    let bytes = [b"??", &write[..], &write, b":0103", &read, &read[..9]].concat();
    let all = heard("ascii", &[(600 * MS, bytes.clone())]);
    let expected = [Role::Damaged, Role::Either, Role::Either, Role::Damaged, Role::Request, Role::Damaged];
    assert_eq!(roles(&all), expected);
    let again: Vec<u8> = all.iter().flat_map(|heard| heard.bytes.to_vec()).collect();
    assert_eq!(again, bytes);
    assert_eq!(all[4].content, Ok(Content::Pdu { slave: 1, pdu: READ.to_vec().into() }));
}

#[test]
fn unitelway_is_heard_poll_by_poll() {
    use drive_unitelway::{data_frame, poll};
    let (request, reply) = (data_frame(1, &[0, 0x04, 7, 0xFA, 0]), data_frame(1, &[0, 0x34, 0x10, 2]));
    let said: [(Role, Option<u8>, &[u8]); 8] = [
        (Role::Request, Some(2), &poll(2)),
        (Role::Answer, Some(2), &[0x04]),
        (Role::Request, Some(1), &request),
        (Role::Answer, Some(1), &[0x06]),
        (Role::Request, Some(1), &poll(1)),
        (Role::Answer, Some(1), &reply),
        (Role::Request, Some(1), &[0x06]),
        (Role::Request, Some(3), &poll(3)),
    ];
    let bytes: Vec<u8> = said.iter().flat_map(|(.., bytes)| bytes.to_vec()).collect();
    for cut in 0..bytes.len() {
        let (before, behind) = bytes.split_at(cut);
        let all = heard("unitelway", &[(600 * MS, before.to_vec()), (9 * MS, behind.to_vec())]);
        let told: Vec<_> = all.iter().map(|heard| (heard.role, heard.slave, &*heard.bytes)).collect();
        assert_eq!(told, said);
        assert_eq!(all[1].content, Ok(Content::Signal(Signal::NothingToSay)));
    }
}

#[tokio::test(start_paused = true)]
async fn two_masters_and_their_slaves_are_heard_by_a_third_party_that_says_nothing() {
    let (line_of_first, mut peer_of_first) = support::line(|config| config);
    let (line_of_second, mut peer_of_second) = support::line(|config| config);
    let (mut wire, ear) = tokio::io::duplex(4_096);
    let listened = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
    let mut listener = Listener::over(ear, &listened).unwrap();
    let mut expected = Vec::new();
    for turn in 0..10_u8 {
        let (line, peer, slave) = match turn % 2 {
            0 => (&line_of_first, &mut peer_of_first, 3),
            _ => (&line_of_second, &mut peer_of_second, 4),
        };
        let answer = [3, 2, 0, turn];
        let mut asked = line.slave(slave);
        let call = tokio::spawn(async move { support::read(&mut asked, turn.into(), 1).await });
        let request = peer.answer(&answer).await;
        call.await.unwrap().unwrap();
        let answer = rtu::frame(slave, &answer);
        wire.write_all(&[&request[..], &answer].concat()).await.unwrap();
        expected.extend([(Role::Request, slave, request), (Role::Answer, slave, answer.to_vec())]);
    }
    for (role, slave, bytes) in expected {
        let heard = listener.next().await.unwrap().unwrap();
        assert_eq!((heard.role, heard.slave, heard.bytes.to_vec()), (role, Some(slave), bytes));
    }
    // Nothing has come back from the listener: its end closes, and there was not a byte.
    drop(listener);
    let mut written = Vec::new();
    tokio::io::AsyncReadExt::read_to_end(&mut wire, &mut written).await.unwrap();
    assert!(written.is_empty(), "{written:02X?}");
}

#[tokio::test(start_paused = true)]
async fn listening_ends_with_the_stream_and_what_had_begun_is_told() {
    let (mut wire, ear) = tokio::io::duplex(64);
    let mut listener = Listener::over(ear, &LineConfig::stream(SerialSettings::MODBUS_DEFAULT)).unwrap();
    wire.write_all(&[1, 3, 0x0C]).await.unwrap();
    drop(wire);
    assert!(is_damaged(&listener.next().await.unwrap().unwrap()));
    assert_eq!(listener.next().await.unwrap(), None);
    let gateway = LineConfig::modbus_tcp("127.0.0.1:502");
    assert!(matches!(Listener::open(&gateway).await, Err(OpenError::Protocol(_))));
    assert_eq!(gateway.protocol, Protocol::Tcp);
}

fn pieces() -> impl Strategy<Value = Vec<(Duration, Vec<u8>)>> {
    let noise = prop::collection::vec(any::<u8>(), 0..300);
    let likely = prop::collection::vec(
        prop::sample::select(&[1, 3, 6, 16, 2, 5, 0x2B, 0x0E, b':', b'0', 13][..]),
        0..40,
    );
    let frame = (0_u8..4, prop::collection::vec(any::<u8>(), 1..40))
        .prop_map(|(slave, pdu)| rtu::frame(slave, &pdu).to_vec());
    let piece = prop_oneof![
        noise,
        likely,
        frame,
        Just(rtu::frame(1, READ).to_vec()),
        Just(ascii::frame(1, READ, b'\n').to_vec())
    ];
    prop::collection::vec(((0_u64..40).prop_map(Duration::from_millis), piece), 0..12)
}

proptest! {
    #[test]
    fn every_byte_is_told_once_in_its_order_whatever_comes(
        pieces in pieces(),
        protocol in prop::sample::select(&["rtu", "ascii", "unitelway"][..]),
    ) {
        let all = heard(protocol, &pieces);
        let bytes: Vec<u8> = pieces.iter().flat_map(|(_, piece)| piece.clone()).collect();
        let told: Vec<u8> = all.iter().flat_map(|heard| heard.bytes.to_vec()).collect();
        prop_assert_eq!(told, bytes);
        for pair in all.windows(2) {
            prop_assert!(pair[0].last <= pair[1].first);
        }
        for heard in &all {
            prop_assert!(heard.first <= heard.last && heard.bytes.len() <= 1_024);
            prop_assert_eq!(heard.role == Role::Damaged, heard.content.is_err());
        }
    }

    #[test]
    fn a_conversation_is_understood_again_behind_whatever_came_before_it(noise in prop::collection::vec(any::<u8>(), 0..600)) {
        let said = conversation();
        let bytes: Vec<u8> = said.iter().flat_map(|(_, frame)| frame.clone()).collect();
        let all = heard("rtu", &[(600 * MS, noise), (600 * MS, bytes)]);
        let told: Vec<_> = all.iter().map(|heard| (heard.role, heard.bytes.to_vec())).collect();
        prop_assert!(told.ends_with(&said));
    }
}
