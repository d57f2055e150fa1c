//! How old a value is: never younger than it is told, however long the process stood still.

mod support;

use std::{thread, time::Duration};

use drive_bus::{Line, LineConfig, exchange::rtu};
use drive_core::{Port, SerialSettings, Terms};
use support::{MS, read};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    time::Instant,
};

/// In real time: the process stands still, from the moment at which an answer lies in its port or at which it is asked for it.
#[tokio::test]
async fn in_a_hundred_stalls_no_value_is_told_to_be_younger_than_it_is() {
    let (ours, mut theirs) = tokio::io::duplex(512);
    let second = Duration::from_secs(1);
    let config = LineConfig {
        response_timeout: 20 * second,
        timeout_floor: 20 * second,
        chunk_gap: 20 * second,
        ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
    };
    let line = Line::over(ours, config);
    let (said, mut truth) = tokio::sync::mpsc::unbounded_channel();
    tokio::spawn(async move {
        let mut request = [0; 8];
        for stall in 0_u32.. {
            if theirs.read_exact(&mut request).await.is_err() {
                return;
            }
            let words = [0; 8].get(..usize::from(request[5]) * 2).unwrap_or_default().to_vec();
            let answer = rtu::frame(request[0], &[&[3, request[5] * 2], &words[..]].concat());
            said.send(Instant::now()).unwrap();
            theirs.write_all(&answer).await.unwrap();
            // Nobody reads it meanwhile.
            #[expect(clippy::disallowed_methods, reason = "it is to block the runtime")]
            thread::sleep((1 + stall % 20) * MS);
        }
    });
    for _ in 0..100 {
        let mut slave = line.slave(1).with_terms(Terms::default().sparing(2));
        read(&mut slave, 7, 1).await.unwrap();
        let shown = slave.asked_at().expect("it was answered");
        let true_at = truth.recv().await.unwrap();
        assert!(shown <= true_at, "{:?} younger than it is", shown - true_at);
    }
}

/// In virtual time: the process stands still for 0.2 to 20 s, before the far end makes its answer or when it lies in the port.
#[tokio::test(start_paused = true)]
async fn in_a_hundred_stalls_of_up_to_twenty_seconds_no_value_is_told_to_be_younger_than_it_is() {
    let (ours, mut theirs) = tokio::io::duplex(512);
    let line = Line::over(ours, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let (made, truth) = std::sync::mpsc::channel();
    tokio::spawn(async move {
        let mut request = [0; 8];
        for stall in 0_u16.. {
            if theirs.read_exact(&mut request).await.is_err() {
                return;
            }
            let stands_still = 200 * MS * u32::from(1 + stall % 100);
            if stall % 2 == 0 {
                tokio::time::advance(stands_still).await;
            }
            // Each answer says which it is.
            let words = usize::from(request[5]);
            let said = [&stall.to_be_bytes()[..], &[0; 16]].concat();
            let answer = rtu::frame(request[0], &[&[3, request[5] * 2], &said[..words * 2]].concat());
            made.send(Instant::now()).unwrap();
            theirs.write_all(&answer).await.unwrap();
            if stall % 2 == 1 {
                tokio::time::advance(stands_still).await;
            }
        }
    });
    let (mut times, mut told) = (Vec::new(), 0);
    for _ in 0..400 {
        let mut slave = line.slave(1).with_terms(Terms::default().sparing(2));
        let answered = read(&mut slave, 7, 1).await;
        times.extend(truth.try_iter());
        if let Ok(words) = answered {
            let shown = slave.asked_at().expect("it was answered");
            let true_at = times[usize::from(words[0])];
            assert!(shown <= true_at, "{:?} younger than it is, answer {}", shown - true_at, words[0]);
            told += 1;
        }
    }
    println!("{told} values told over {} stalls", times.len());
    assert!(times.len() >= 100, "{}", times.len());
    assert!(told >= 50, "{told}");
}
