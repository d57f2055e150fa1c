//! Modbus ASCII as the card of the Altivar 58 speaks it.

use std::time::Duration;

use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_sim::{ALWAYS, Fault, Protocol, SimLine, SimSlave, Wiring};
use tokio::{
    io::{AsyncWriteExt, DuplexStream},
    time::Instant,
};

use crate::support::{ACC, KEEP, Small, ask, hear};

const PATIENCE: Duration = Duration::from_millis(2_500);

fn line() -> (SimLine, SimSlave, DuplexStream) {
    let settings = SerialSettings::new(9_600, CharacterFormat::F7E1).unwrap();
    let line = SimLine::new(Wiring { protocol: Protocol::Ascii, ..Wiring::rtu(settings) });
    let slave = line.add(2, Small::new()).unwrap();
    let port = line.in_memory();
    (line, slave, port)
}

/// A frame of hexadecimal digits with its LRC.
fn ascii(digits: &str, delimiter: u8) -> Vec<u8> {
    let bytes = (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap());
    let lrc = bytes.fold(0, u8::wrapping_add).wrapping_neg();
    let mut frame = format!(":{digits}{lrc:02X}\r").into_bytes();
    frame.push(delimiter);
    frame
}

#[tokio::test(start_paused = true)]
async fn the_manuals_frame_is_answered_by_its_echo() {
    // VVDED397054 p. 23 (47 in English): value 10 into word W252 of slave 2.
    let (line, slave, mut port) = line();
    let frame = b":020600FC000AF2\r\n";
    let start = Instant::now();
    assert_eq!(ask(&mut port, frame, PATIENCE).await.unwrap(), frame);
    assert_eq!(slave.peek(ACC.address()), Some(10));
    // 17 characters there and back of 10 bits, and 5 ms.
    let exact = line.wiring().settings.characters(34) + Duration::from_millis(5);
    assert!((exact..exact + Duration::from_millis(1)).contains(&start.elapsed()));
    assert_eq!(
        ask(&mut port, frame, PATIENCE).await.unwrap(),
        frame,
        "at once again: no silence is asked for"
    );
    assert_eq!(line.violations(), []);
}

#[tokio::test(start_paused = true)]
async fn a_frame_may_pause_for_a_second_between_characters_and_no_longer() {
    let (line, slave, mut port) = line();
    let frame = b":020600FC000AF2\r\n";
    for byte in frame {
        tokio::time::sleep(Duration::from_millis(900)).await;
        port.write_all(&[*byte]).await.unwrap();
    }
    assert_eq!(hear(&mut port, PATIENCE).await.unwrap(), frame);
    port.write_all(&frame[..9]).await.unwrap();
    tokio::time::sleep(Duration::from_millis(1_100)).await;
    assert_eq!(ask(&mut port, &frame[9..], PATIENCE).await, None);
    assert_eq!((slave.all_requests(), line.stats().bad_frames), (1, 1));
}

#[tokio::test(start_paused = true)]
async fn damage_is_met_with_silence_and_a_colon_begins_anew() {
    let (line, slave, mut port) = line();
    for bad in [
        &b":020600FC000AF3\r\n"[..],
        b":020600fc000aF2\r\n",
        b":020600FC000AF\r\n",
        b":020600FC0G0AF2\r\n",
        b":\r\n",
        b":02FE\r\n",
        b"020600FC000AF2\r\n",
    ] {
        assert_eq!(ask(&mut port, bad, PATIENCE).await, None, "{bad:?}");
    }
    assert_eq!(line.stats().bad_frames, 6, "without a colon there is no frame");
    let cut_short = b":0206:020600FC000AF2\r\n";
    assert!(ask(&mut port, cut_short, PATIENCE).await.is_some());
    assert_eq!(slave.all_requests(), 1);
    port.write_all(&[b':'; 600]).await.unwrap();
    port.write_all(&[b'0'; 600]).await.unwrap();
    assert!(ask(&mut port, b"\r\n:020600FC000AF2\r\n", PATIENCE).await.is_some());
}

#[tokio::test(start_paused = true)]
async fn function_08_03_changes_the_last_character_for_the_frames_that_follow() {
    let (_line, slave, mut port) = line();
    let change = ascii("020800032A00", b'\n');
    assert_eq!(ask(&mut port, &change, PATIENCE).await.unwrap(), change);
    let read = "020300040001";
    assert_eq!(
        ask(&mut port, &ascii(read, b'\n'), PATIENCE).await,
        None,
        "the slave waits for its character"
    );
    assert_eq!(ask(&mut port, &ascii(read, b'*'), PATIENCE).await, Some(ascii("0203020007", b'*')));
    slave.power_cycle();
    assert_eq!(ask(&mut port, &ascii(read, b'\n'), PATIENCE).await, Some(ascii("0203020007", b'\n')));
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_is_taken_by_who_sees_its_end() {
    let (line, slave, mut port) = line();
    let other = line.add(3, Small::new()).unwrap();
    ask(&mut port, &ascii("020800032A00", b'\n'), PATIENCE).await.unwrap();
    assert_eq!(ask(&mut port, &ascii("00060004000C", b'\n'), PATIENCE).await, None);
    assert_eq!((slave.peek(KEEP.address()), other.peek(KEEP.address())), (Some(7), Some(12)));
}

#[tokio::test(start_paused = true)]
async fn faults_leave_characters_of_seven_bits() {
    let (line, _, mut port) = line();
    line.set_fault(Fault::Flipped, ALWAYS);
    for _ in 0..200 {
        let heard = ask(&mut port, b":020600FC000AF2\r\n", PATIENCE).await.unwrap();
        assert!(heard.is_ascii(), "{heard:?}");
    }
}
