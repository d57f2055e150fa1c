//! Frames in every dress, from formats that others write: the exchange is the example of the Modbus application protocol that many
//! print, function 03 of three registers from 006Bh at slave 17.

use std::time::Duration;

use bytes::Bytes;
use drive_bus::capture::{Captured, Direction, Dissector, Writer};
use etherparse::PacketBuilder;

use super::*;

const REQUEST: [u8; 8] = [0x11, 0x03, 0x00, 0x6B, 0x00, 0x03, 0x76, 0x87];
const ANSWER: [u8; 11] = [0x11, 0x03, 0x06, 0xAE, 0x41, 0x56, 0x52, 0x43, 0x40, 0x49, 0xAD];

fn said(bytes: &[u8]) -> Vec<(Direction, Vec<u8>)> {
    let taken = read(bytes, false).unwrap_or_else(|why| panic!("{}: {why}", String::from_utf8_lossy(bytes)));
    taken.frames.into_iter().map(|frame| (frame.direction, frame.bytes.to_vec())).collect()
}

fn both() -> Vec<(Direction, Vec<u8>)> {
    vec![(Direction::Sent, REQUEST.to_vec()), (Direction::Received, ANSWER.to_vec())]
}

#[test]
fn hexadecimal_is_read_in_any_dress_and_between_anything() {
    for text in [
        "11 03 00 6B 00 03 76 87\n11 03 06 AE 41 56 52 43 40 49 AD",
        "1103006b00037687 110306ae415652434049ad",
        "1103006b00037687110306ae415652434049ad",
        "0x11,0x03,0x00,0x6B,0x00,0x03,0x76,0x87\r\n0x11,0x03,0x06,0xAE,0x41,0x56,0x52,0x43,0x40,0x49,0xAD",
        "11h 03h 00h 6Bh 00h 03h 76h 87h\n11h 03h 06h AEh 41h 56h 52h 43h 40h 49h ADh",
        r"b'\x11\x03\x00\x6B\x00\x03\x76\x87'
          b'\x11\x03\x06\xAE\x41\x56\x52\x43\x40\x49\xAD'",
        "11-03-00-6b-00-03-76-87\n11:03:06:ae:41:56:52:43:40:49:ad",
        // libmodbus and mbpoll -v.
        "[11][03][00][6B][00][03][76][87]\nWaiting for a confirmation...\n<11><03><06><AE><41><56><52><43><40><49><AD>",
        // pymodbus.
        "2026-11-24 08:51:47,123 DEBUG transport:392 send: 0x11 0x3 0x0 0x6b 0x0 0x3 0x76 0x87\n\
         2026-11-24 08:51:47,163 DEBUG transport:310 recv: 0x11 0x3 0x6 0xae 0x41 0x56 0x52 0x43 0x40 0x49 0xad extra data: ",
        "08:51:47 11 03 00 6B 00 03 76 87\n08:51:47 11 03 06 AE 41 56 52 43 40 49 AD",
        // xxd, hexdump -C, Wireshark.
        "00000000: 1103 006b 0003 7687 1103 06ae 4156 5243  ...k..v.....AVRC\n00000010: 4049 ad                                  @I.",
        "00000000  11 03 00 6b 00 03 76 87  11 03 06 ae 41 56 52 43  |...k..v.....AVRC|\n00000010  40 49 ad                                          |@I.|\n00000013",
        "0000   11 03 00 6b 00 03 76 87 11 03 06 ae 41 56 52 43   ...k..v.....AVRC\n0010   40 49 ad                                          @I.",
    ] {
        assert_eq!(said(text.as_bytes()), both(), "{text}");
    }
    assert_eq!(said(&[&REQUEST[..], &ANSWER].concat()), both(), "bytes as they were");
}

#[test]
fn damaged_frames_are_told_as_such_and_what_is_no_frame_is_refused() {
    let taken = read(b"11 03 00 6B 00 03 76 88", false).unwrap();
    assert_eq!(taken.frames[0].direction, Direction::Unknown);
    assert!(taken.notes[0].contains("--no-check"), "{:?}", taken.notes);
    let bare = read(b"11 03 00 6B 00 03", true).unwrap();
    assert_eq!(bare.frames[0].bytes, REQUEST[..]);
    for nothing in [&b""[..], b"hello world", b"2026-11-24", b"\n\n"] {
        let why = read(nothing, false).unwrap_err();
        assert!(why.contains("nothing in it looks like a frame"), "{why}");
    }
}

#[test]
fn modbus_ascii_is_read_from_a_log() {
    // The same by the rules of ASCII: LRC of 11 03 00 6B 00 03 is 7Eh.
    let taken = read(b"tx :1103006B00037E\nrx :110306AE415652434049AD\n", false).unwrap();
    assert_eq!((taken.dissector, taken.frames.len()), (Dissector::Data, 1));
    assert_eq!(taken.frames[0].direction, Direction::Sent);
}

/// A classic capture as pcap-savefile(5) has it.
fn pcap(big_endian: bool, nano: bool, link: u32, packets: &[(u32, u32, Vec<u8>)]) -> Vec<u8> {
    let word = |word: u32| if big_endian { word.to_be_bytes() } else { word.to_le_bytes() };
    let half = |half: u16| if big_endian { half.to_be_bytes() } else { half.to_le_bytes() };
    let magic: u32 = if nano { 0xA1B2_3C4D } else { 0xA1B2_C3D4 };
    let mut file =
        [word(magic).as_slice(), &half(2), &half(4), &word(0), &word(0), &word(65_535), &word(link)].concat();
    for (seconds, fraction, data) in packets {
        let length = word(u32::try_from(data.len()).unwrap());
        file.extend([word(*seconds).as_slice(), &word(*fraction), &length, &length, data].concat());
    }
    file
}

#[test]
fn a_classic_capture_of_a_serial_line_is_read_in_both_orders_and_resolutions() {
    for (big_endian, nano) in [(false, false), (false, true), (true, false), (true, true)] {
        let fraction = if nano { 40_000_000 } else { 40_000 };
        let packets = [(1_700_000_000, 0, REQUEST.to_vec()), (1_700_000_000, fraction, ANSWER.to_vec())];
        // 147 is the first link type that a user may use for himself.
        let file = pcap(big_endian, nano, 147, &packets);
        assert_eq!(said(&file), both());
        let taken = read(&file, false).unwrap();
        let after = taken.frames[1].at - taken.frames[0].at;
        assert_eq!((after, taken.has_times), (Duration::from_millis(40), true));
        // Cut off anywhere: what stands before is told, and nothing else happens.
        for cut in 24..file.len() {
            match read(&file[..cut], false) {
                Ok(taken) => {
                    assert!(taken.notes.iter().any(|note| note.contains("cut off")) || cut == 48, "{cut}");
                }
                Err(why) => assert!(!why.is_empty()),
            }
        }
        let half = read(&file[..file.len() - 4], false).unwrap();
        assert_eq!((half.frames.len(), half.notes.len()), (1, 1));
    }
}

/// Modbus TCP between a client and a gateway, as another program's library puts it into packets.
fn tcp(from: ([u8; 4], u16), to: ([u8; 4], u16), sequence: u32, payload: &[u8]) -> Vec<u8> {
    let builder =
        PacketBuilder::ethernet2([2; 6], [4; 6]).ipv4(from.0, to.0, 64).tcp(from.1, to.1, sequence, 1_024);
    let mut packet = Vec::new();
    builder.write(&mut packet, payload).unwrap();
    packet
}

#[test]
fn a_capture_of_a_gateway_is_read_also_where_segments_cut_frames_or_come_twice() {
    let (client, gateway) = (([10, 0, 0, 7], 51_000), ([10, 0, 0, 9], 502));
    let request = [0, 1, 0, 0, 0, 6, 0x11, 3, 0, 0x6B, 0, 3];
    let answer = [0, 1, 0, 0, 0, 9, 0x11, 3, 6, 0xAE, 0x41, 0x56, 0x52, 0x43, 0x40];
    let packets = [
        (1, 0, tcp(client, gateway, 100, &request)),
        (1, 5, tcp(client, gateway, 100, &request)),
        (1, 10, tcp(gateway, client, 900, &answer[..7])),
        (1, 20, tcp(gateway, client, 907, &answer[7..])),
        (1, 30, vec![0xFF; 40]),
    ];
    let file = pcap(false, false, 1, &packets);
    let taken = read(&file, false).unwrap();
    assert_eq!(taken.dissector, Dissector::Tcp);
    let frames: Vec<_> = taken.frames.iter().map(|frame| (frame.direction, frame.bytes.to_vec())).collect();
    assert_eq!(frames, [(Direction::Sent, request.to_vec()), (Direction::Received, answer.to_vec())]);
    assert!(
        taken.notes.iter().any(|note| note.contains("1 packets in it are no Modbus")),
        "{:?}",
        taken.notes
    );
    // A serial server: RTU behind TCP.
    let server = ([10, 0, 0, 9], 4_001);
    let packets = [(1, 0, tcp(client, server, 1, &REQUEST)), (1, 9, tcp(server, client, 1, &ANSWER))];
    assert_eq!(said(&pcap(false, false, 1, &packets)), both());
}

#[test]
fn our_own_captures_are_read_as_far_as_they_are_whole() {
    let mut file = Vec::new();
    let mut writer = Writer::of_listener(&mut file, Dissector::Rtu, Duration::from_millis(5)).unwrap();
    for (at, direction, bytes) in [(0, Direction::Sent, &REQUEST[..]), (40, Direction::Received, &ANSWER)] {
        let at = Duration::from_millis(1_700_000_000_000 + at);
        writer.write(&Captured { at, direction, bytes: Bytes::copy_from_slice(bytes) }).unwrap();
    }
    let whole = read(&file, false).unwrap();
    assert_eq!((whole.frames.len(), whole.late, whole.notes.len()), (2, Some(Duration::from_millis(5)), 0));
    let cut = read(&file[..file.len() - 10], false).unwrap();
    assert_eq!(cut.frames.len(), 1);
    assert!(cut.notes[0].contains("cut off"), "{:?}", cut.notes);
    for at in 0..file.len() {
        for value in [0, 0x7F, 0xFF] {
            let mut broken = file.clone();
            broken[at] = value;
            // Whatever it is, it is an answer.
            let _ = read(&broken, false);
        }
    }
}

proptest::proptest! {
    #[test]
    fn nothing_that_anybody_hands_over_upsets_it(bytes: Vec<u8>, text in "\\PC*", magic in 0..5_usize) {
        let _ = read(&bytes, false);
        let _ = read(text.as_bytes(), true);
        let begins = [&PCAPNG[..], &PCAP[0], &PCAP[1], &PCAP[2], &PCAP[3]][magic];
        let _ = read(&[begins, &bytes].concat(), false);
    }
}
