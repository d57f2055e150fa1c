//! The traps that others fell into, as far as they are the line's.

mod support;

use drive_bus::{LineConfig, exchange::rtu};
use drive_core::{Class, PortError, Terms};
use support::{MS, calls, line, reads, writes};
use tokio_modbus::Request;

const ETA: u16 = 3201;
const LFR: u16 = 8502;

#[tokio::test(start_paused = true)]
async fn a_setpoint_on_the_wire_is_not_replaced_but_followed() {
    let (line, mut peer) = line(|config| config);
    let terms = Terms::of(Class::Command).replacing(8502);
    let first = writes(line.slave(1).with_terms(terms), LFR, 100);
    peer.request().await;
    let second = writes(line.slave(1).with_terms(terms), LFR, 200);
    peer.after(5 * MS, &rtu::frame(1, &[6, 0x21, 0x36, 0, 100])).await;
    assert_eq!(first.await.unwrap(), Ok(()));
    peer.answer(&[6, 0x21, 0x36, 0, 200]).await;
    assert_eq!(second.await.unwrap(), Ok(()));
}

#[tokio::test(start_paused = true)]
async fn a_timeout_touches_one_request() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let polls: Vec<_> = (1..=5).map(|address| reads(line.slave(address), ETA, 1)).collect();
    peer.request().await;
    for value in 2..=5 {
        assert_eq!(peer.answer(&[3, 2, 0, value]).await[0], value);
    }
    let mut outcomes = Vec::new();
    for poll in polls {
        outcomes.push(poll.await.unwrap());
    }
    assert_eq!(
        outcomes,
        [Err(PortError::Timeout { after: 500 * MS }), Ok(vec![2]), Ok(vec![3]), Ok(vec![4]), Ok(vec![5])]
    );
}

#[tokio::test(start_paused = true)]
async fn an_answer_in_the_chunks_of_a_usb_adapter_is_good() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let call = reads(line.slave(1), ETA, 1);
    peer.request().await;
    let frame = rtu::frame(1, &[3, 2, 0, 7]);
    peer.after(5 * MS, &frame[..3]).await;
    tokio::time::sleep(16 * MS).await;
    peer.now(&frame[3..]).await;
    assert_eq!(call.await.unwrap(), Ok(vec![7]));
}

#[tokio::test(start_paused = true)]
async fn what_one_line_counts_is_no_other_lines() {
    let ((one, mut peer), (two, _other_peer)) = (line(|config| config), line(|config| config));
    let call = reads(one.slave(1), ETA, 1);
    peer.answer(&[3, 2, 0, 7]).await;
    call.await.unwrap().unwrap();
    assert_eq!(one.stats().slaves[&1].outcomes.answered, 1);
    assert!(two.stats().slaves.is_empty());
}

#[tokio::test(start_paused = true)]
async fn one_noisy_exception_blacklists_nothing() {
    let (line, mut peer) = line(|config| config);
    for answer in [&[0x83, 2][..], &[3, 2, 0, 7]] {
        let call = calls(line.slave(1), Request::ReadHoldingRegisters(ETA, 1));
        peer.answer(answer).await;
        assert_eq!(call.await.unwrap().unwrap().is_ok(), answer[0] == 3);
    }
}

#[tokio::test(start_paused = true)]
async fn a_learned_timeout_never_goes_below_the_floor_of_the_line() {
    let (line, mut peer) = line(|config| LineConfig { timeout_floor: 80 * MS, ..config });
    for _ in 0..20 {
        let call = reads(line.slave(1), ETA, 1);
        peer.answer(&[3, 2, 0, 7]).await;
        call.await.unwrap().unwrap();
    }
    assert_eq!(line.stats().slaves[&1].response_timeout, 80 * MS);
}

#[tokio::test(start_paused = true)]
async fn a_command_goes_ahead_of_thirty_waiting_polls() {
    let (line, mut peer) = line(|config| config);
    let polls: Vec<_> = (1..=30).map(|address| reads(line.slave(address), ETA, 1)).collect();
    peer.answer(&[3, 2, 0, 7]).await;
    let command = writes(line.slave(40).with_terms(Terms::of(Class::Command)), LFR, 100);
    tokio::task::yield_now().await;
    assert_eq!(peer.answer(&[6, 0x21, 0x36, 0, 100]).await[0], 40);
    assert_eq!(command.await.unwrap(), Ok(()));
    for poll in polls {
        poll.abort();
    }
}
