//! A master's process that is stopped and continued from outside, in real time over a pty: no value of one request is given
//! as that of another, neither in statuses, which ask the same again and again, nor in a dump of parameters, which asks for
//! what lies behind. Nothing here asserts a duration. `DRIVED_STANDING_STILL` is how many calls there are.
#![cfg(all(target_os = "linux", feature = "serial"))]

mod support;

use std::{
    collections::BTreeMap,
    env,
    io::Read,
    process::{Child, Command, Stdio},
    time::Duration,
};

use drive_bus::{Line, LineConfig, exchange::rtu};
use drive_core::{Terms, serial::SerialSettings};
use rustix::process::{Pid, Signal, kill_process};
use support::{MS, rig::Random};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    time::sleep,
};
use tokio_modbus::{Request, Response, client::Client};
use tokio_serial::{SerialPort, SerialStream};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const SLAVES: u16 = 3;

/// Here a slave holds the number of the request that it answers, and behind it its own address.
const STATUS: u16 = 0xE000;

/// What a slave holds at any other address: a word tells which call of a dump it answers.
fn word(slave: u8, address: u16) -> u16 {
    address ^ u16::from(slave) << 13
}

fn exchanges() -> u16 {
    env::var("DRIVED_STANDING_STILL").ok().and_then(|text| text.parse().ok()).unwrap_or(160)
}

/// The master: asks, checks, and prints what came of it.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "a process of its own that the test below starts"]
async fn the_masters_process() {
    let Ok(pty) = env::var("DRIVED_PTY") else { return };
    let line = Line::open(LineConfig::serial(pty, SERIAL)).await.unwrap();
    let (mut right, mut wrong, mut failed) = (0, 0, 0);
    for call in 0..exchanges() {
        let (slave, is_status) = ((call % SLAVES + 1) as u8, call % 32 < 16);
        let first = if is_status { STATUS } else { call * 4 };
        let mut port = line.slave(slave).with_terms(Terms::default().sparing((call / 4 % 2) as u8));
        let Ok(answer) = port.call(Request::ReadHoldingRegisters(first, 2)).await else {
            failed += 1;
            continue;
        };
        let sent = line.stats().slaves.get(&slave).map_or(0, |slave| slave.sent);
        let truth = if is_status {
            vec![sent as u16, slave.into()]
        } else {
            vec![word(slave, first), word(slave, first + 1)]
        };
        *(if answer == Ok(Response::ReadHoldingRegisters(truth)) { &mut right } else { &mut wrong }) += 1;
    }
    println!("right {right} wrong {wrong} failed {failed}");
}

/// The slaves at the other end, as slow as a line.
async fn slaves(mut port: SerialStream) {
    let mut received = Vec::new();
    let mut buffer = [0; 256];
    let mut asked = BTreeMap::<u8, u16>::new();
    loop {
        let Ok(len) = AsyncReadExt::read(&mut port, &mut buffer).await else { return };
        received.extend_from_slice(&buffer[..len]);
        while received.len() >= 8 {
            let request: Vec<u8> = received.drain(..8).collect();
            assert!(rtu::is_frame(&request), "{request:02X?}");
            let (slave, first) = (request[0], u16::from_be_bytes([request[2], request[3]]));
            let number = asked.entry(slave).or_default();
            *number += 1;
            let words = (0..u16::from(request[5])).map(|at| match (first, at) {
                (STATUS, 0) => *number,
                (STATUS, _) => slave.into(),
                _ => word(slave, first + at),
            });
            let words = words.flat_map(u16::to_be_bytes);
            let pdu: Vec<u8> = [3, request[5] * 2].into_iter().chain(words).collect();
            let answer = rtu::frame(slave, &pdu);
            sleep(5 * MS + SERIAL.characters(8 + answer.len())).await;
            if port.write_all(&answer).await.is_err() {
                return;
            }
        }
    }
}

/// Stops and continues the process until it ends.
async fn disturb(mut child: Child) -> String {
    let mut random = Random::new(7);
    let pid = Pid::from_child(&child);
    while child.try_wait().unwrap().is_none() {
        sleep(Duration::from_millis(20 + random.below(500))).await;
        let _ = kill_process(pid, Signal::STOP);
        sleep(Duration::from_millis(300 + random.below(2_700))).await;
        let _ = kill_process(pid, Signal::CONT);
    }
    let mut said = String::new();
    child.stdout.take().unwrap().read_to_string(&mut said).unwrap();
    said
}

#[tokio::test(flavor = "multi_thread")]
async fn a_process_that_is_stopped_and_continued_gives_no_wrong_value() {
    let (ours, theirs) = SerialStream::pair().unwrap();
    let serving = tokio::spawn(slaves(ours));
    let child = Command::new(env::current_exe().unwrap())
        .args(["--exact", "the_masters_process", "--ignored", "--nocapture"])
        .env("DRIVED_PTY", theirs.name().unwrap())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let said = disturb(child).await;
    serving.abort();
    let counted: Vec<u32> = said
        .lines()
        .find(|line| line.starts_with("right "))
        .unwrap_or_else(|| panic!("{said}"))
        .split(' ')
        .filter_map(|part| part.parse().ok())
        .collect();
    let &[right, wrong, failed] = &counted[..] else { panic!("{said}") };
    println!("{right} right, {failed} failed, {wrong} wrong");
    assert_eq!(wrong, 0, "{said}");
    assert!(right > 0 && right + failed == u32::from(exchanges()), "{said}");
}
