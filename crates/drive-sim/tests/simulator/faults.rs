//! Each kind of fault does what it says, and the same again from the same seed.

use std::time::Duration;

use crate::support::{KEEP, Small, ask, frame, hear, read, write};
use drive_core::SerialSettings;
use drive_sim::{ALWAYS, Breach, Fault, Faults, SimLine};
use tokio::{io::DuplexStream, time::Instant};

const PATIENCE: Duration = Duration::from_millis(500);

/// A line of two drives on which one kind of fault always strikes.
fn line_with(fault: Fault) -> (SimLine, DuplexStream) {
    let line = SimLine::default();
    for address in [1, 2] {
        line.add(address, Small::new()).unwrap();
    }
    line.set_faults(Faults::seeded(1).with(fault, ALWAYS));
    let port = line.in_memory();
    (line, port)
}

/// What slave 1 answers to this when nothing is wrong.
fn right() -> (Vec<u8>, Vec<u8>) {
    (read(1, KEEP.address(), 1), frame(&[1, 0x03, 2, 0, 7]))
}

fn bits_that_differ(one: &[u8], other: &[u8]) -> u32 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).map(|(one, other)| (one ^ other).count_ones()).sum()
}

#[tokio::test(start_paused = true)]
async fn a_flipped_answer_differs_in_one_bit() {
    let (line, mut port) = line_with(Fault::Flipped);
    let (request, answer) = right();
    let heard = ask(&mut port, &request, PATIENCE).await.unwrap();
    assert_eq!(bits_that_differ(&heard, &answer), 1);
    assert_eq!(line.injected(Fault::Flipped), 1);
}

#[tokio::test(start_paused = true)]
async fn a_flipped_or_lost_request_is_not_carried_out() {
    for (fault, bad) in [(Fault::RequestFlipped, 1), (Fault::RequestLost, 0)] {
        let (line, mut port) = line_with(fault);
        assert_eq!(ask(&mut port, &write(1, KEEP.address(), 9), PATIENCE).await, None);
        let slave = line.slave(1).unwrap();
        assert_eq!((slave.all_requests(), slave.peek(KEEP.address())), (0, Some(7)));
        assert_eq!(line.stats().bad_frames, bad);
        line.set_fault(fault, 0);
        assert!(ask(&mut port, &write(1, KEEP.address(), 9), PATIENCE).await.is_some());
    }
}

#[tokio::test(start_paused = true)]
async fn a_request_whose_answer_is_lost_has_been_carried_out() {
    let (line, mut port) = line_with(Fault::Lost);
    assert_eq!(ask(&mut port, &write(1, KEEP.address(), 9), PATIENCE).await, None);
    assert_eq!(line.slave(1).unwrap().peek(KEEP.address()), Some(9));
}

#[tokio::test(start_paused = true)]
async fn a_truncated_answer_is_the_beginning_of_the_right_one() {
    let (_line, mut port) = line_with(Fault::Truncated);
    let (request, answer) = right();
    let heard = ask(&mut port, &request, PATIENCE).await.unwrap_or_default();
    assert!(heard.len() < answer.len() && answer.starts_with(&heard), "{heard:?}");
}

#[tokio::test(start_paused = true)]
async fn noise_comes_directly_before_the_right_answer() {
    let (_line, mut port) = line_with(Fault::Noise);
    let (request, answer) = right();
    let heard = ask(&mut port, &request, PATIENCE).await.unwrap();
    assert!(heard.ends_with(&answer) && (1..=4).contains(&(heard.len() - answer.len())), "{heard:?}");
}

#[tokio::test(start_paused = true)]
async fn an_echo_brings_back_what_was_sent_before_the_answer() {
    let (line, mut port) = line_with(Fault::Echo);
    let (request, answer) = right();
    let start = Instant::now();
    assert_eq!(ask(&mut port, &request, PATIENCE).await.unwrap(), request);
    assert!(start.elapsed() >= SerialSettings::MODBUS_DEFAULT.characters(8));
    assert_eq!(hear(&mut port, PATIENCE).await.unwrap(), answer);
    assert_eq!(line.violations(), []);
    assert_eq!(line.stats().characters_out, 7, "the echo is no answer");
}

#[tokio::test(start_paused = true)]
async fn a_late_answer_comes_whole_and_late() {
    let (line, mut port) = line_with(Fault::Late);
    line.set_lateness(Duration::from_millis(300));
    let (request, answer) = right();
    assert_eq!(ask(&mut port, &request, Duration::from_millis(200)).await, None);
    assert_eq!(hear(&mut port, PATIENCE).await.unwrap(), answer);
}

#[tokio::test(start_paused = true)]
async fn a_collision_with_a_late_answer_says_that_the_master_could_not_know() {
    let (line, mut port) = line_with(Fault::Late);
    line.set_lateness(Duration::from_millis(100));
    let (request, _) = right();
    // Sent at 0, the answer is on the wire from 109.6 ms to 113.6 ms.
    assert_eq!(ask(&mut port, &request, Duration::from_millis(110)).await, None);
    ask(&mut port, &read(2, 1, 1), PATIENCE).await.unwrap();
    let breaches: Vec<_> = line.violations().iter().map(|violation| violation.breach).collect();
    assert!(breaches.contains(&Breach::Collision { slave: 1, late: true }), "{breaches:?}");
}

#[tokio::test(start_paused = true)]
async fn a_duplicated_answer_comes_twice_with_a_silence_between() {
    let (_line, mut port) = line_with(Fault::Duplicated);
    let (request, answer) = right();
    assert_eq!(ask(&mut port, &request, PATIENCE).await.unwrap(), answer);
    let first = Instant::now();
    assert_eq!(hear(&mut port, PATIENCE).await.unwrap(), answer);
    let settings = SerialSettings::MODBUS_DEFAULT;
    let apart = settings.characters(answer.len()) + settings.t3_5();
    assert!(first.elapsed().abs_diff(apart) <= Duration::from_millis(1), "{:?}", first.elapsed());
}

#[tokio::test(start_paused = true)]
async fn another_slaves_answer_comes_before_the_right_one() {
    let (_line, mut port) = line_with(Fault::Foreign);
    let (request, answer) = right();
    let foreign = frame(&[&[2], &answer[1..answer.len() - 2]].concat());
    assert_eq!(ask(&mut port, &request, PATIENCE).await.unwrap(), foreign);
    assert_eq!(hear(&mut port, PATIENCE).await.unwrap(), answer);
}

#[tokio::test(start_paused = true)]
async fn a_wrong_confirmation_has_a_right_check_and_one_wrong_bit() {
    let (line, mut port) = line_with(Fault::WrongEcho);
    let request = write(1, KEEP.address(), 9);
    let heard = ask(&mut port, &request, PATIENCE).await.unwrap();
    assert_eq!(heard, frame(&heard[..6]));
    assert_eq!(bits_that_differ(&heard[..6], &request[..6]), 1);
    tokio::time::sleep(Duration::from_millis(10)).await;
    let answer = ask(&mut port, &read(1, KEEP.address(), 1), PATIENCE).await;
    assert_eq!(answer, Some(frame(&[1, 0x03, 2, 0, 9])), "a read is no confirmation");
    assert_eq!(line.injected(Fault::WrongEcho), 1);
}

#[tokio::test(start_paused = true)]
async fn the_same_seed_and_traffic_give_the_same_line_and_another_seed_does_not() {
    async fn heard_with(seed: u64) -> Vec<Option<Vec<u8>>> {
        let line = SimLine::default();
        line.add(1, Small::new()).unwrap();
        let mut faults = Faults::seeded(seed);
        for fault in Fault::ALL {
            faults.set(fault, 50_000);
        }
        line.set_faults(faults);
        let mut port = line.in_memory();
        let mut heard = Vec::new();
        for value in 0..100 {
            heard.push(ask(&mut port, &write(1, KEEP.address(), value), PATIENCE).await);
        }
        heard
    }
    let first = heard_with(3).await;
    assert_eq!(first, heard_with(3).await);
    assert_ne!(first, heard_with(4).await);
}
