//! Slaves with speeds, formats and protocols of their own on one line, and two slaves at one address.

use std::time::Duration;

use drive_core::SerialSettings;
use drive_sim::{Breach, Dialect, Protocol, SimLine, SimSlave};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::support::{KEEP, OUT, Small, TURNAROUND, ask, frame, hear, read};

const PATIENCE: Duration = Duration::from_millis(500);

fn at(text: &str) -> SerialSettings {
    text.parse().unwrap()
}

fn add(line: &SimLine, address: u8, settings: &str, protocol: Protocol) -> SimSlave {
    let slave = line.add(address, Small::new()).unwrap();
    slave.set_dialect(Dialect { settings: at(settings), protocol });
    slave
}

#[tokio::test(start_paused = true)]
async fn each_slave_answers_at_its_own_speed_and_format_and_in_its_own_time() {
    let line = SimLine::default();
    let own = [(1, "1200 8E1"), (2, "9600 8N1"), (3, "19200 8O1"), (4, "38400 8E1")];
    let slaves = own.map(|(address, settings)| add(&line, address, settings, Protocol::Rtu));
    for (address, settings) in own {
        let mut port = line.in_memory_at(at(settings));
        let start = tokio::time::Instant::now();
        let answer = ask(&mut port, &read(address, KEEP.address(), 1), PATIENCE).await;
        assert_eq!(answer, Some(frame(&[address, 3, 2, 0, 7])), "{settings}");
        let exact = at(settings).characters(8) + TURNAROUND + at(settings).characters(7);
        let taken = start.elapsed();
        assert!((exact..exact + Duration::from_millis(1)).contains(&taken), "{settings}: {taken:?}");
        tokio::time::sleep(PATIENCE).await;
    }
    assert_eq!(slaves.map(|slave| slave.all_requests()), [1; 4]);
    assert_eq!(line.violations(), []);
}

#[tokio::test(start_paused = true)]
async fn a_master_at_another_speed_or_parity_is_noise_to_a_slave() {
    for (master, slave) in [
        ("9600 8E1", "19200 8E1"),
        ("19200 8E1", "9600 8E1"),
        ("19200 8N1", "19200 8E1"),
        ("19200 8E1", "19200 8N1"),
        ("19200 8O1", "19200 8E1"),
        ("1200 8E1", "115200 8E1"),
        ("115200 8E1", "1200 8E1"),
    ] {
        let line = SimLine::default();
        let drive = add(&line, 1, slave, Protocol::Rtu);
        let mut port = line.in_memory_at(at(master));
        assert_eq!(ask(&mut port, &read(1, OUT.address(), 1), PATIENCE).await, None, "{master} {slave}");
        assert_eq!(drive.all_requests(), 0);
    }
}

/// Bits 11 wide are heard by who has one stop bit less, and the other way round.
#[tokio::test(start_paused = true)]
async fn one_stop_bit_and_two_understand_each_other() {
    for (master, slave) in [("9600 8N1", "9600 8N2"), ("9600 8N2", "9600 8N1")] {
        let line = SimLine::default();
        add(&line, 1, slave, Protocol::Rtu);
        let mut port = line.in_memory_at(at(master));
        let answer = ask(&mut port, &read(1, KEEP.address(), 1), PATIENCE).await;
        assert_eq!(answer, Some(frame(&[1, 3, 2, 0, 7])));
    }
}

#[tokio::test(start_paused = true)]
async fn rtu_ascii_and_unitelway_live_on_one_line_each_with_its_master() {
    let line = SimLine::default();
    let slaves =
        [("9600 8N1", Protocol::Rtu), ("9600 7E1", Protocol::Ascii), ("9600 8O1", Protocol::UniTelway)];
    let [rtu, ascii, telway] = [1, 2, 3].map(|address| {
        add(&line, address, slaves[usize::from(address) - 1].0, slaves[usize::from(address) - 1].1)
    });
    let mut port = line.in_memory_at(at("9600 8N1"));
    assert_eq!(ask(&mut port, &read(1, KEEP.address(), 1), PATIENCE).await, Some(frame(&[1, 3, 2, 0, 7])));
    let mut port = line.in_memory_at(at("9600 7E1"));
    // Slave 2, function 03, register 4, one word: 02 + 03 + 00 + 04 + 00 + 01 = 0Ah, whose two's complement is F6h.
    let answer = ask(&mut port, b":020300040001F6\r\n", PATIENCE).await.unwrap();
    assert_eq!(String::from_utf8(answer).unwrap(), ":0203020007F2\r\n");
    let mut port = line.in_memory_at(at("9600 8O1"));
    // A poll of slave 3: nothing to say.
    assert_eq!(ask(&mut port, &[0x10, 0x05, 3], PATIENCE).await, Some(vec![0x04]));
    assert_eq!([rtu, ascii].map(|slave| slave.all_requests()), [1, 1]);
    assert_eq!(telway.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn what_is_counted_of_bad_frames_is_counted_by_those_who_heard_them() {
    let line = SimLine::default();
    add(&line, 1, "19200 8E1", Protocol::Rtu);
    add(&line, 2, "9600 8E1", Protocol::Rtu);
    let mut port = line.in_memory();
    for _ in 0..3 {
        ask(&mut port, &read(1, KEEP.address(), 1), PATIENCE).await.unwrap();
        tokio::time::sleep(PATIENCE).await;
    }
    // Function 08/0C, bus communication errors, and 08/0B, messages.
    let counted = async |settings: &str, slave: u8, counter: u8| {
        let mut port = line.in_memory_at(at(settings));
        let answer = ask(&mut port, &frame(&[slave, 8, 0, counter, 0, 0]), PATIENCE).await.unwrap();
        u16::from_be_bytes([answer[4], answer[5]])
    };
    assert_eq!(counted("19200 8E1", 1, 0x0C).await, 0);
    assert!(counted("9600 8E1", 2, 0x0C).await >= 3);
    assert_eq!(counted("9600 8E1", 2, 0x0B).await, 2);
}

mod at_one_address {
    use super::*;

    async fn heard(port: &mut (impl AsyncReadExt + Unpin)) -> Vec<u8> {
        let mut heard = Vec::new();
        while let Some(piece) = hear(port, PATIENCE).await {
            heard.extend(piece);
        }
        heard
    }

    fn two() -> (SimLine, SimSlave, SimSlave) {
        let line = SimLine::default();
        let one = line.add(1, Small::new()).unwrap();
        let other = line.add_beside(1, Box::new(Small::new())).unwrap();
        (line, one, other)
    }

    #[tokio::test(start_paused = true)]
    async fn equal_answers_at_the_same_moment_are_heard_as_one() {
        let (line, one, other) = two();
        let mut port = line.in_memory();
        port.write_all(&read(1, KEEP.address(), 1)).await.unwrap();
        assert_eq!(heard(&mut port).await, frame(&[1, 3, 2, 0, 7]));
        assert_eq!((one.requests(3), other.requests(3)), (1, 1));
        assert_eq!(line.stats().slave_collisions, 1);
    }

    #[tokio::test(start_paused = true)]
    async fn what_differs_is_damaged_and_the_rest_is_not() {
        let (line, one, _) = two();
        assert!(one.poke(KEEP.address(), 0x1207));
        let mut port = line.in_memory();
        port.write_all(&read(1, KEEP.address(), 1)).await.unwrap();
        let answer = heard(&mut port).await;
        assert_eq!(answer.len(), 7);
        assert_eq!((&answer[..3], answer[4]), (&[1, 3, 2][..], 7));
        assert_ne!(answer, frame(&[1, 3, 2, 0x12, 7]));
        assert_ne!(answer, frame(&[1, 3, 2, 0, 7]));
    }

    #[tokio::test(start_paused = true)]
    async fn answers_after_each_other_are_both_heard() {
        let (line, _, other) = two();
        other.set_turnaround(Some(TURNAROUND * 10));
        let mut port = line.in_memory();
        port.write_all(&read(1, KEEP.address(), 1)).await.unwrap();
        assert_eq!(heard(&mut port).await, [frame(&[1, 3, 2, 0, 7]), frame(&[1, 3, 2, 0, 7])].concat());
        assert_eq!(line.stats().slave_collisions, 0);
    }

    #[tokio::test(start_paused = true)]
    async fn answers_that_overlap_are_both_damaged() {
        let (line, _, other) = two();
        other.set_turnaround(Some(TURNAROUND + Duration::from_millis(1)));
        let mut port = line.in_memory();
        port.write_all(&read(1, KEEP.address(), 1)).await.unwrap();
        let answer = heard(&mut port).await;
        assert_ne!(answer[..7], frame(&[1, 3, 2, 0, 7]));
        assert_eq!(line.stats().slave_collisions, 1);
        assert!(
            line.violations().iter().all(|violation| !matches!(violation.breach, Breach::Collision { .. }))
        );
    }
}
