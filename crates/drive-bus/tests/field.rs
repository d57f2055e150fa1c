//! The traps that others fell into, as far as they are the line's.

mod support;

use drive_bus::{LineConfig, Slave, exchange::rtu};
use drive_core::{Class, PortError, Terms};
use support::{MS, line};
use tokio_modbus::{Request, Response, client::Client};

async fn write(slave: &mut Slave, word: u16) -> Result<(), PortError> {
    match slave.call(Request::WriteSingleRegister(8502, word)).await {
        Ok(Ok(Response::WriteSingleRegister(8502, got))) if got == word => Ok(()),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

async fn read(slave: &mut Slave) -> Result<u16, PortError> {
    match slave.call(Request::ReadHoldingRegisters(3201, 1)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => Ok(words[0]),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_on_the_wire_is_not_replaced_but_followed() {
    let (line, mut peer) = line(|config| config);
    let terms = Terms::of(Class::Command).replacing(8502);
    let (mut one, mut two) = (line.slave(1).with_terms(terms), line.slave(1).with_terms(terms));
    let first = tokio::spawn(async move { write(&mut one, 100).await });
    peer.request().await;
    let second = tokio::spawn(async move { write(&mut two, 200).await });
    peer.after(5 * MS, &rtu::frame(1, &[6, 0x21, 0x36, 0, 100])).await;
    assert_eq!(first.await.unwrap(), Ok(()));
    peer.answer(&[6, 0x21, 0x36, 0, 200]).await;
    assert_eq!(second.await.unwrap(), Ok(()));
}

#[tokio::test(start_paused = true)]
async fn a_timeout_touches_one_request() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let reads: Vec<_> = (1..=5)
        .map(|address| {
            let mut slave = line.slave(address);
            tokio::spawn(async move { read(&mut slave).await })
        })
        .collect();
    peer.request().await;
    for value in 2..=5 {
        assert_eq!(peer.answer(&[3, 2, 0, value]).await[0], value);
    }
    let mut outcomes = Vec::new();
    for read in reads {
        outcomes.push(read.await.unwrap());
    }
    assert_eq!(outcomes, [Err(PortError::Timeout { after: 500 * MS }), Ok(2), Ok(3), Ok(4), Ok(5)]);
}

#[tokio::test(start_paused = true)]
async fn an_answer_in_the_chunks_of_a_usb_adapter_is_good() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let mut slave = line.slave(1);
    let call = tokio::spawn(async move { read(&mut slave).await });
    peer.request().await;
    let frame = rtu::frame(1, &[3, 2, 0, 7]);
    peer.after(5 * MS, &frame[..3]).await;
    tokio::time::sleep(16 * MS).await;
    peer.now(&frame[3..]).await;
    assert_eq!(call.await.unwrap(), Ok(7));
}

#[tokio::test(start_paused = true)]
async fn what_one_line_counts_is_no_other_lines() {
    let ((one, mut peer), (two, _other_peer)) = (line(|config| config), line(|config| config));
    let mut slave = one.slave(1);
    let call = tokio::spawn(async move { read(&mut slave).await });
    peer.answer(&[3, 2, 0, 7]).await;
    call.await.unwrap().unwrap();
    assert_eq!(one.stats().slaves[&1].outcomes.answered, 1);
    assert!(two.stats().slaves.is_empty());
}

#[tokio::test(start_paused = true)]
async fn one_noisy_exception_blacklists_nothing() {
    let (line, mut peer) = line(|config| config);
    for answer in [&[0x83, 2][..], &[3, 2, 0, 7]] {
        let mut slave = line.slave(1);
        let call = tokio::spawn(async move { slave.call(Request::ReadHoldingRegisters(3201, 1)).await });
        peer.answer(answer).await;
        assert_eq!(call.await.unwrap().unwrap().is_ok(), answer[0] == 3);
    }
}

#[tokio::test(start_paused = true)]
async fn a_learned_timeout_never_goes_below_the_floor_of_the_line() {
    let (line, mut peer) = line(|config| LineConfig { timeout_floor: 80 * MS, ..config });
    for _ in 0..20 {
        let mut slave = line.slave(1);
        let call = tokio::spawn(async move { read(&mut slave).await });
        peer.answer(&[3, 2, 0, 7]).await;
        call.await.unwrap().unwrap();
    }
    assert_eq!(line.stats().slaves[&1].response_timeout, 80 * MS);
}

#[tokio::test(start_paused = true)]
async fn a_command_goes_ahead_of_thirty_waiting_polls() {
    let (line, mut peer) = line(|config| config);
    let polls: Vec<_> = (1..=30)
        .map(|address| {
            let mut slave = line.slave(address);
            tokio::spawn(async move { read(&mut slave).await })
        })
        .collect();
    peer.answer(&[3, 2, 0, 7]).await;
    let mut slave = line.slave(40).with_terms(Terms::of(Class::Command));
    let command = tokio::spawn(async move { write(&mut slave, 100).await });
    tokio::task::yield_now().await;
    assert_eq!(peer.answer(&[6, 0x21, 0x36, 0, 100]).await[0], 40);
    assert_eq!(command.await.unwrap(), Ok(()));
    for poll in polls {
        poll.abort();
    }
}
