//! What a line does with a slave that misbehaves, a caller that leaves, and an adapter that echoes.

mod support;

use std::time::Duration;

use drive_bus::{Echo, Gateway, LineConfig, SlaveSettings, exchange::rtu};
use drive_core::{Class, PortError, Terms};
use support::{MS, calls, characters, line, read, reads, write, writes};
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request, client::Client, client::Context, prelude::*};

fn without_retries(config: LineConfig) -> LineConfig {
    LineConfig { retries: 0, ..config }
}

#[tokio::test(start_paused = true)]
async fn an_answer_reaches_its_caller_through_a_tokio_modbus_context() {
    let (line, mut peer) = line(|config| config);
    let mut context: Context = line.slave(3).into();
    let call = tokio::spawn(async move { context.read_holding_registers(3201, 2).await });
    assert_eq!(peer.answer(&[3, 4, 0x12, 0x34, 0x56, 0x78]).await, rtu::frame(3, &[3, 0x0C, 0x81, 0, 2]));
    assert_eq!(call.await.unwrap().unwrap(), Ok(vec![0x1234, 0x5678]));
}

/// As somebody writes who wants to wait for ever.
#[tokio::test(start_paused = true)]
async fn a_line_whose_times_are_as_long_as_can_be_and_whose_queue_has_no_room_serves_and_stops() {
    const EVER: Duration = Duration::MAX;
    let changes: [fn(LineConfig) -> LineConfig; 9] = [
        |config| LineConfig { response_timeout: EVER, ..config },
        |config| LineConfig { timeout_floor: EVER, ..config },
        |config| LineConfig { late_window: EVER, ..config },
        |config| LineConfig { broadcast_pause: EVER, slave_change_gap: EVER, ..config },
        |config| LineConfig { chunk_gap: EVER, double_window: EVER, ..config },
        |config| LineConfig { probe_backoff: (EVER, EVER), ..config },
        |config| LineConfig { gateway: Some(Gateway { at_once: None, wait: Some(EVER) }), ..config },
        |config| config.slave(3, SlaveSettings { turnaround: EVER, response_timeout: Some(EVER) }),
        |config| LineConfig { queue_limit: 0, ..config },
    ];
    for (change, number) in changes.into_iter().zip(0..) {
        let (line, mut peer) = line(change);
        assert!(line.worst_case_stop() > Duration::ZERO, "{number}");
        let stop = writes(line.slave(3).with_terms(Terms::of(Class::Stop)), 8501, 0);
        peer.answer(&[6, 0x21, 0x35, 0, 0]).await;
        assert_eq!(stop.await.unwrap(), Ok(()), "{number}");
        let read = reads(line.slave(3), 3201, 1);
        peer.answer(&[3, 2, 0, 7]).await;
        assert_eq!(read.await.unwrap(), Ok(vec![7]), "{number}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_exception_is_the_inner_error_and_is_not_repeated() {
    let (line, mut peer) = line(|config| config);
    let call = calls(line.slave(3), Request::ReadHoldingRegisters(9, 1));
    peer.answer(&[0x83, 2]).await;
    assert_eq!(call.await.unwrap().unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(line.stats().slaves[&3].outcomes.exceptions, 1);
}

#[tokio::test(start_paused = true)]
async fn who_has_been_refused_often_enough_is_refused_further_without_a_question() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(3).until_refused(2);
    let call = tokio::spawn(async move {
        let mut answers = Vec::new();
        for register in 9..13 {
            answers.push(slave.call(Request::ReadHoldingRegisters(register, 1)).await.unwrap().unwrap_err());
        }
        answers
    });
    peer.answer(&[0x83, 1]).await;
    peer.answer(&[0x83, 2]).await;
    let refusals = call.await.unwrap();
    assert_eq!(refusals[..2], [ExceptionCode::IllegalFunction, ExceptionCode::IllegalDataAddress]);
    assert_eq!(refusals[2..], [ExceptionCode::IllegalDataAddress; 2]);
    assert_eq!(line.stats().slaves[&3].sent, 2);
}

#[tokio::test(start_paused = true)]
async fn a_late_answer_is_never_taken_for_the_next() {
    let (line, mut peer) = line(without_retries);
    let first = reads(line.slave(3), 10, 1);
    peer.request().await;
    assert_eq!(first.await.unwrap(), Err(PortError::Timeout { after: 500 * MS }));

    // The same slave, the same shape: it is left alone until the late answer has come or cannot come any more.
    let second = reads(line.slave(3), 20, 1);
    peer.hears_nothing_for(100 * MS).await;
    peer.now(&rtu::frame(3, &[3, 2, 0xAA, 0xAA])).await;
    assert_eq!(peer.answer(&[3, 2, 0, 20]).await, rtu::frame(3, &[3, 0, 20, 0, 1]));
    assert_eq!(second.await.unwrap(), Ok(vec![20]));
    assert_eq!(line.stats().slaves[&3].late, 1);
}

#[tokio::test(start_paused = true)]
async fn while_one_slave_is_in_quarantine_the_others_are_served_and_its_late_answer_does_no_harm() {
    let (line, mut peer) = line(without_retries);
    let first = reads(line.slave(3), 10, 1);
    peer.request().await;
    assert!(first.await.unwrap().is_err());
    let second = reads(line.slave(3), 20, 1);
    let third = reads(line.slave(4), 30, 1);
    assert_eq!(peer.request().await[0], 4);
    // The late answer comes in the middle of the other slave's exchange.
    peer.after(3 * MS, &rtu::frame(3, &[3, 2, 0xAA, 0xAA])).await;
    peer.after(20 * MS, &rtu::frame(4, &[3, 2, 0, 30])).await;
    assert_eq!(third.await.unwrap(), Ok(vec![30]));
    peer.answer(&[3, 2, 0, 20]).await;
    assert_eq!(second.await.unwrap(), Ok(vec![20]));
}

#[tokio::test(start_paused = true)]
async fn a_crc_error_in_a_long_frame_recovers_at_once() {
    let (line, mut peer) = line(without_retries);
    let mut slave = line.slave(3);
    let start = Instant::now();
    let call = tokio::spawn(async move { (read(&mut slave, 0, 60).await, slave) });
    peer.request().await;
    let mut pdu = vec![3, 120];
    pdu.extend([7; 120]);
    let mut damaged = rtu::frame(3, &pdu).to_vec();
    damaged[50] ^= 0x10;
    peer.after(5 * MS, &damaged).await;
    let (result, slave) = call.await.unwrap();
    assert_eq!(result, Err(PortError::Damaged("CRC")));
    assert!(start.elapsed() < 150 * MS, "given up long before the timeout, after {:?}", start.elapsed());

    let next = reads(slave, 0, 1);
    peer.answer(&[3, 2, 0, 9]).await;
    assert_eq!(next.await.unwrap(), Ok(vec![9]));
}

#[tokio::test(start_paused = true)]
async fn a_damaged_read_is_repeated() {
    let (line, mut peer) = line(|config| config);
    let call = reads(line.slave(3), 0, 1);
    peer.request().await;
    peer.after(5 * MS, &[3, 3, 2, 0, 9, 0xFF, 0xFF]).await;
    peer.answer(&[3, 2, 0, 9]).await;
    assert_eq!(call.await.unwrap(), Ok(vec![9]));
    assert_eq!(line.stats().slaves[&3].retries, 1);
}

#[tokio::test(start_paused = true)]
async fn a_foreign_answer_is_ignored_and_the_timer_runs_on() {
    let (line, mut peer) = line(without_retries);
    let call = reads(line.slave(3), 0, 1);
    peer.request().await;
    peer.after(5 * MS, &rtu::frame(9, &[3, 2, 0, 1])).await;
    peer.after(60 * MS, &rtu::frame(3, &[3, 2, 0, 2])).await;
    assert_eq!(call.await.unwrap(), Ok(vec![2]));
    assert_eq!(line.stats().foreign, 1);
}

#[tokio::test(start_paused = true)]
async fn noise_before_an_answer_is_no_part_of_it() {
    let (line, mut peer) = line(without_retries);
    let call = reads(line.slave(3), 0, 1);
    peer.request().await;
    let mut bytes = vec![0xFF, 0x00, 0x03];
    bytes.extend(rtu::frame(3, &[3, 2, 0, 2]));
    peer.after(5 * MS, &bytes).await;
    assert_eq!(call.await.unwrap(), Ok(vec![2]));
    assert_eq!(line.stats().noise_bytes, 3);
}

#[tokio::test(start_paused = true)]
async fn a_wrong_confirmation_is_refused() {
    let (line, mut peer) = line(without_retries);
    for wrong in [&[6, 0x21, 0x35, 0, 4][..], &[6, 0x21, 0x36, 0, 3]] {
        let call = writes(line.slave(3), 0x2135, 3);
        peer.answer(wrong).await;
        let error = call.await.unwrap().unwrap_err();
        assert_eq!(error, PortError::OutcomeUnknown("the confirmation does not fit"));
    }
}

#[tokio::test(start_paused = true)]
async fn a_short_answer_to_a_read_is_refused() {
    let (line, mut peer) = line(without_retries);
    let call = reads(line.slave(3), 0, 2);
    peer.answer(&[3, 2, 0, 1]).await;
    assert!(matches!(call.await.unwrap(), Err(PortError::Mismatch(_))));
}

#[tokio::test(start_paused = true)]
async fn a_call_dropped_while_it_is_on_the_wire_does_no_harm() {
    let (line, mut peer) = line(|config| config);
    let call = reads(line.slave(3), 10, 1);
    peer.request().await;
    call.abort();
    let next = reads(line.slave(3), 20, 1);
    peer.after(5 * MS, &rtu::frame(3, &[3, 2, 0, 10])).await;
    peer.answer(&[3, 2, 0, 20]).await;
    assert_eq!(next.await.unwrap(), Ok(vec![20]));
}

#[tokio::test(start_paused = true)]
async fn a_call_dropped_before_it_is_sent_never_is() {
    let (line, mut peer) = line(|config| config);
    let first = reads(line.slave(3), 10, 1);
    peer.request().await;
    let dropped = writes(line.slave(4), 20, 1);
    tokio::task::yield_now().await;
    dropped.abort();
    peer.after(5 * MS, &rtu::frame(3, &[3, 2, 0, 10])).await;
    assert_eq!(first.await.unwrap(), Ok(vec![10]));
    peer.hears_nothing_for(1_000 * MS).await;
    assert_eq!(line.stats().slaves[&4].outcomes.withdrawn, 1);
}

#[tokio::test(start_paused = true)]
async fn an_echoing_adapter_is_recognised_and_its_live_slave_served() {
    for echo in [Echo::Auto, Echo::On] {
        let (line, mut peer) = line(|config| LineConfig { echo, retries: 0, ..config });
        let mut slave = line.slave(3);
        let call = tokio::spawn(async move {
            let words = read(&mut slave, 10, 1).await;
            (words, write(&mut slave, 20, 7).await)
        });
        for answer in [&[3, 2, 0, 10][..], &[6, 0, 20, 0, 7]] {
            let request = peer.request().await;
            peer.now(&request).await;
            peer.after(5 * MS, &rtu::frame(3, answer)).await;
        }
        assert_eq!(call.await.unwrap(), (Ok(vec![10]), Ok(())));
        let stats = line.stats();
        assert!(stats.echoing);
        assert_eq!((stats.echoes, stats.foreign, stats.noise_bytes), (2, 0, 0));
    }
}

#[tokio::test(start_paused = true)]
async fn the_echo_of_a_write_to_a_dead_slave_is_never_its_confirmation() {
    for echo in [Echo::Auto, Echo::On] {
        // The very first request of the line is a write, and nobody but the adapter answers.
        let (line, mut peer) = line(|config| LineConfig { echo, retries: 0, ..config });
        let call = writes(line.slave(3), 20, 7);
        let echoing = tokio::spawn(async move {
            loop {
                let request = peer.request().await;
                peer.now(&request).await;
            }
        });
        assert_eq!(call.await.unwrap(), Err(PortError::OutcomeUnknown("no answer")), "{echo:?}");
        echoing.abort();
    }
}

#[tokio::test(start_paused = true)]
async fn where_nothing_echoes_a_first_write_is_confirmed_after_one_read() {
    let (line, mut peer) = line(|config| LineConfig { echo: Echo::Auto, ..config });
    let call = writes(line.slave(3), 20, 7);
    assert_eq!(peer.answer(&[0x83, 2]).await[1], 3);
    assert_eq!(peer.answer(&[6, 0, 20, 0, 7]).await[1], 6);
    assert_eq!(call.await.unwrap(), Ok(()));
    assert!(!line.stats().echoing);
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_returns_after_its_turnaround_and_nothing_is_sent_before() {
    let (line, mut peer) = line(|config| config);
    let mut all: Context = line.broadcast().into();
    let start = Instant::now();
    let call = tokio::spawn(async move {
        all.write_single_register(8501, 0).await.unwrap().unwrap();
        all.write_multiple_registers(1, &[1, 2]).await.unwrap().unwrap();
        start.elapsed()
    });
    assert_eq!(peer.request().await, rtu::frame(0, &[6, 0x21, 0x35, 0, 0]));
    let next = reads(line.slave(1), 0, 1);
    peer.hears_nothing_for(100 * MS).await;
    peer.answer(&[3, 2, 0, 1]).await;
    assert_eq!(next.await.unwrap(), Ok(vec![1]));
    peer.request().await;
    let took = call.await.unwrap();
    assert!(took >= 2 * (100 * MS + characters(8)), "{took:?}");
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_cannot_read() {
    let (line, _peer) = line(|config| config);
    let error = read(&mut line.broadcast(), 0, 1).await.unwrap_err();
    assert!(matches!(error, PortError::NotCarried(_)));
}

#[tokio::test(start_paused = true)]
async fn every_function_is_answered_whole_byte_by_byte_twice_and_after_damage() {
    let mut identification = vec![0x2B, 0x0E, 1, 1, 0, 0, 1, 0, 13];
    identification.extend(b"Telemecanique");
    let exchanges: [(Request<'static>, Vec<u8>); 9] = [
        (Request::ReadHoldingRegisters(3201, 2), vec![3, 4, 2, 0x37, 0, 1]),
        (Request::ReadInputRegisters(3201, 1), vec![4, 2, 2, 0x37]),
        (Request::WriteSingleRegister(8501, 15), vec![6, 0x21, 0x35, 0, 15]),
        (Request::Custom(8, vec![0, 0, 0xA5, 0x37].into()), vec![8, 0, 0, 0xA5, 0x37]),
        (Request::Custom(8, vec![0, 0x0B, 0, 0].into()), vec![8, 0, 0x0B, 0x12, 0x34]),
        (Request::Custom(0x0B, vec![].into()), vec![0x0B, 0, 0, 1, 8]),
        (Request::WriteMultipleRegisters(8501, vec![1, 2].into()), vec![0x10, 0x21, 0x35, 0, 2]),
        (Request::ReadDeviceIdentification(ReadCode::Basic, 0), identification),
        (Request::Custom(0x5A, vec![1, 2, 3].into()), vec![0x5A, 9, 8, 7, 6, 5]),
    ];
    let (line, mut peer) = line(|config| config);
    for (request, answer) in exchanges {
        for way in ["whole", "byte by byte", "twice", "after damage"] {
            let call = calls(line.slave(2), request.clone());
            let got = peer.request().await;
            let frame = rtu::frame(2, &answer);
            match way {
                "whole" => peer.after(5 * MS, &frame).await,
                "byte by byte" => peer.one_by_one(&frame).await,
                "twice" => {
                    peer.after(5 * MS, &frame).await;
                    peer.now(&frame).await;
                }
                _ => {
                    let mut damaged = frame.to_vec();
                    let last = damaged.len() - 1;
                    damaged[last] ^= 1;
                    peer.after(5 * MS, &damaged).await;
                    assert_eq!(peer.request().await, got, "the request is repeated");
                    peer.after(5 * MS, &frame).await;
                }
            }
            let response = call.await.unwrap().unwrap().unwrap();
            assert_eq!(response.function_code().value(), answer[0], "{request:?} {way}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_refused_identification_is_an_exception_in_both_forms() {
    let (line, mut peer) = line(|config| config);
    for form in [&[0xAB, 2][..], &[0xAB, 0x0E, 2]] {
        let mut slave = line.slave(2);
        let call = tokio::spawn(async move {
            slave.call(Request::ReadDeviceIdentification(ReadCode::Specific, 9)).await.unwrap()
        });
        peer.answer(form).await;
        assert_eq!(call.await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    }
}
