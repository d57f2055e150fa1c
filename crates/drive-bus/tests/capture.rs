//! A capture of a line, and its replay through the machines.

mod support;

use std::{
    io::Write,
    sync::{Arc, Mutex},
};

use drive_bus::{
    LineConfig,
    capture::{self, Captured, Direction},
    exchange::rtu,
    master::Master,
};
use drive_core::{PortError, Terms, serial::SerialSettings};
use support::{MS, calls, line};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

#[derive(Clone, Default)]
struct Sink(Arc<Mutex<Vec<u8>>>);

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Three reads: one answered, one damaged and repeated, one refused.
async fn record() -> Vec<u8> {
    let (line, mut peer) = line(|config| config);
    let sink = Sink::default();
    let writing = line.capture(sink.clone()).unwrap();
    let call = |address| calls(line.slave(3), Request::ReadHoldingRegisters(address, 1));
    let first = call(10);
    peer.request().await;
    peer.one_by_one(&rtu::frame(3, &[3, 2, 0, 10])).await;
    first.await.unwrap().unwrap().unwrap();
    let second = call(20);
    peer.answer(&[3, 2, 0, 20]).await;
    second.await.unwrap().unwrap().unwrap();
    let third = call(30);
    peer.request().await;
    peer.after(5 * MS, &[3, 3, 2, 0, 30, 0xBA, 0xD0]).await;
    peer.answer(&[0x83, 2]).await;
    third.await.unwrap().unwrap().unwrap_err();
    line.close().await;
    drop(line);
    writing.finished().await.unwrap();
    std::mem::take(&mut sink.0.lock().unwrap())
}

/// Feeds a capture to a new master: the requests are asked, what was received is received, each at its time.
fn replay(
    frames: &[Captured],
    feed: impl Fn(&mut Master<usize>, Instant, &[u8]),
) -> Vec<Result<Vec<u16>, String>> {
    let begin = Instant::now();
    let mut master = Master::new(
        Instant::now(),
        LineConfig { retries: 0, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) },
    );
    master.handle_up(begin);
    let mut now = begin;
    let mut outcomes = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        // A second between two frames: what was given up in the recording is given up again.
        if frame.direction == Direction::Sent {
            now += 1_000 * MS;
            master.handle_timeout(now);
            let pdu = frame.bytes.slice(1..frame.bytes.len() - 2);
            let request = Request::try_from(pdu).unwrap();
            master.submit(now, frame.bytes[0], request, Terms::default(), index).unwrap();
            assert_eq!(master.poll_transmit(now).as_ref(), Some(&frame.bytes), "the same bytes are sent");
            master.handle_sent(now);
        } else {
            now += 20 * MS;
            feed(&mut master, now, &frame.bytes);
            now += 100 * MS;
            master.handle_timeout(now);
        }
        while let Some((_, outcome)) = master.poll_outcome() {
            outcomes.push(match outcome {
                Ok(Ok(Response::ReadHoldingRegisters(words))) => Ok(words),
                Ok(other) => Err(format!("{other:?}")),
                Err(PortError::Damaged(why)) => Err(why.to_owned()),
                Err(error) => panic!("{error}"),
            });
        }
    }
    outcomes
}

#[tokio::test(start_paused = true)]
async fn a_capture_replayed_through_the_machines_gives_the_same_answers() {
    let frames = capture::read(&record().await).unwrap().frames;
    assert_eq!(frames.len(), 8, "{frames:02X?}");
    assert!(frames.windows(2).all(|pair| pair[0].at <= pair[1].at));
    let expected =
        [Ok(vec![10]), Ok(vec![20]), Err("CRC".to_owned()), Err("Err(IllegalDataAddress)".to_owned())];
    assert_eq!(replay(&frames, Master::handle_bytes), expected);
    let byte_by_byte = |master: &mut Master<usize>, now, bytes: &[u8]| {
        for byte in bytes {
            master.handle_bytes(now, &[*byte]);
        }
    };
    assert_eq!(replay(&frames, byte_by_byte), expected);
}

#[tokio::test(start_paused = true)]
async fn what_a_capture_has_heard_last_is_kept_for_whoever_asks_later_and_without_one_nothing_is() {
    let (line, mut peer) = line(|config| config);
    let begin = Instant::now();
    let ask = async |peer: &mut support::Peer| {
        let call = calls(line.slave(3), Request::ReadHoldingRegisters(10, 1));
        peer.answer(&[3, 2, 0, 10]).await;
        call.await.unwrap().unwrap().unwrap();
    };
    ask(&mut peer).await;
    assert_eq!(line.last_frames(begin), capture::LastFrames::default());
    let sink = Sink::default();
    let writing = line.capture(sink.clone()).unwrap();
    ask(&mut peer).await;
    ask(&mut peer).await;
    // Another one ends it, and takes what comes from then on.
    let second = line.capture(std::io::sink()).unwrap();
    writing.finished().await.unwrap();
    ask(&mut peer).await;
    line.close().await;
    second.finished().await.unwrap();
    let last = line.last_frames(begin);
    let numbers: Vec<u64> = last.frames.iter().map(|heard| heard.number).collect();
    assert_eq!((numbers, last.is_cut), ((0..6).collect(), false));
    let frames = capture::read(&sink.0.lock().unwrap()).unwrap().frames;
    let heard: Vec<Captured> = last.frames.iter().take(4).map(|heard| heard.frame.clone()).collect();
    assert_eq!(heard, frames);
    let later = last.frames[4].at;
    assert_eq!(line.last_frames(later).frames, last.frames[4..]);
    line.forget_frames(later);
    assert_eq!(line.last_frames(begin).frames, last.frames[4..]);
}

/// Skipped, with a word about it, where tshark is not installed.
#[tokio::test(start_paused = true)]
async fn wireshark_decodes_a_capture_as_modbus_rtu_without_any_setting() {
    let file = record().await;
    let path = std::env::temp_dir().join(format!("drive-bus-{}.pcapng", std::process::id()));
    std::fs::write(&path, &file).unwrap();
    let fields =
        ["-T", "fields", "-e", "mbrtu.unit_id", "-e", "modbus.func_code", "-e", "modbus.exception_code"];
    let output = std::process::Command::new("tshark").arg("-r").arg(&path).args(fields).output();
    std::fs::remove_file(&path).unwrap();
    let Ok(output) = output else {
        assert!(std::env::var_os("CI").is_none(), "tshark is not installed, and CI must have it");
        println!("skipped: tshark is not installed");
        return;
    };
    let decoded = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = decoded.lines().collect();
    assert_eq!(lines.len(), 8, "{decoded} {}", String::from_utf8_lossy(&output.stderr));
    assert!(lines.iter().all(|line| line.starts_with("3\t3")), "{decoded}");
    assert!(lines[7].ends_with("\t2"), "{decoded}");
}
