//! A line that stays awake for its answers, over a pty in real time. Nothing here looks at how long anything took.

#![cfg(feature = "serial")]

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use drive_bus::{Echo, Line, LineConfig, exchange::rtu};
use drive_core::{
    Class, Terms,
    serial::{CharacterFormat, SerialSettings},
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_modbus::{Request, Response, client::Client};
use tokio_serial::SerialStream;

const READ: usize = 8;

/// A slave that answers each read with the number of the request, mostly after the same time, now and then in two pieces,
/// now and then much later; and every write.
async fn slave(mut port: SerialStream) {
    let mut request = [0; READ];
    let mut asked = 0_u16;
    while port.read_exact(&mut request).await.is_ok() {
        let pause = if asked % 16 == 15 { 20 } else { 2 };
        tokio::time::sleep(Duration::from_millis(pause)).await;
        asked += 1;
        let pdu = if request[1] == 3 {
            let [high, low] = asked.to_be_bytes();
            vec![3, 2, high, low]
        } else {
            request[1..6].to_vec()
        };
        let answer = rtu::frame(request[0], &pdu);
        let (first, rest) = answer.split_at(if asked % 5 == 4 { 3 } else { answer.len() });
        port.write_all(first).await.unwrap();
        if !rest.is_empty() {
            tokio::time::sleep(Duration::from_millis(1)).await;
            port.write_all(rest).await.unwrap();
        }
    }
}

/// Reads and stops on a line that stays awake or does not, while another task wants to run all the time.
async fn every_answer_is_right(stay_awake: bool) {
    let (ours, theirs) = SerialStream::pair().unwrap();
    let far_end = tokio::spawn(slave(theirs));
    let settings = SerialSettings::new(115_200, CharacterFormat::F8N1).unwrap();
    let config =
        LineConfig { precise_timer: true, stay_awake, echo: Echo::Off, ..LineConfig::stream(settings) };
    let line = Line::over(ours, config);
    let (over, turns) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
    let other = tokio::spawn({
        let (over, turns) = (Arc::clone(&over), Arc::clone(&turns));
        async move {
            while !over.load(Ordering::Relaxed) {
                turns.fetch_add(1, Ordering::Relaxed);
                tokio::task::yield_now().await;
            }
        }
    });
    let mut stop = line.slave(1).with_terms(Terms::of(Class::Stop));
    for number in 1..=48 {
        let answer = line.slave(1).call(Request::ReadHoldingRegisters(0, 1)).await.unwrap().unwrap();
        // On a machine that stood still meanwhile the line has asked more than once: the answer is that to the last.
        let sent = line.stats().slaves.get(&1).unwrap().sent;
        assert_eq!(answer, Response::ReadHoldingRegisters(vec![sent as u16]));
        if number % 8 == 0 {
            // After a pause of the machine its confirmation may be doubted: it is sent until one is not, as a family does.
            while !matches!(stop.call(Request::WriteSingleRegister(1, 0)).await, Ok(Ok(_))) {}
        }
    }
    assert!(turns.load(Ordering::Relaxed) > 48, "nobody else came to his turn");
    over.store(true, Ordering::Relaxed);
    other.await.unwrap();
    line.close().await;
    far_end.abort();
}

#[tokio::test]
async fn a_line_that_stays_awake_takes_every_answer_and_gives_way_to_other_tasks() {
    every_answer_is_right(true).await;
}

#[tokio::test]
async fn a_line_that_does_not_stay_awake_takes_the_same_answers() {
    every_answer_is_right(false).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn on_two_threads_it_is_the_same() {
    every_answer_is_right(true).await;
}
