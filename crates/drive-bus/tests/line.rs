//! What a line does with a slave that misbehaves, a caller that leaves, and an adapter that echoes.

mod support;

use std::time::Duration;

use drive_bus::{Echo, LineConfig, Slave, SlaveSettings, exchange::rtu};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use support::{MS, characters, line};
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request, Response, client::Client, client::Context, prelude::*};

/// FC03, `quantity` registers from `address`.
async fn read(slave: &mut Slave, address: u16, quantity: u16) -> Result<Vec<u16>, PortError> {
    match slave.call(Request::ReadHoldingRegisters(address, quantity)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => Ok(words),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

async fn write(slave: &mut Slave, address: u16, word: u16) -> Result<(), PortError> {
    match slave.call(Request::WriteSingleRegister(address, word)).await {
        Ok(Ok(Response::WriteSingleRegister(got, value))) if (got, value) == (address, word) => Ok(()),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

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

#[tokio::test(start_paused = true)]
async fn an_exception_is_the_inner_error_and_is_not_repeated() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { slave.call(Request::ReadHoldingRegisters(9, 1)).await });
    peer.answer(&[0x83, 2]).await;
    assert_eq!(call.await.unwrap().unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(line.stats().slaves[&3].outcomes.exceptions, 1);
}

#[tokio::test(start_paused = true)]
async fn a_late_answer_is_never_taken_for_the_next() {
    let (line, mut peer) = line(without_retries);
    let (mut slave, mut same) = (line.slave(3), line.slave(3));
    let first = tokio::spawn(async move { read(&mut slave, 10, 1).await });
    peer.request().await;
    assert_eq!(first.await.unwrap(), Err(PortError::Timeout { after: 500 * MS }));

    // The same slave, the same shape: it is left alone until the late answer has come or cannot come any more.
    let second = tokio::spawn(async move { read(&mut same, 20, 1).await });
    peer.hears_nothing_for(100 * MS).await;
    peer.now(&rtu::frame(3, &[3, 2, 0xAA, 0xAA])).await;
    assert_eq!(peer.answer(&[3, 2, 0, 20]).await, rtu::frame(3, &[3, 0, 20, 0, 1]));
    assert_eq!(second.await.unwrap(), Ok(vec![20]));
    assert_eq!(line.stats().slaves[&3].late, 1);
}

#[tokio::test(start_paused = true)]
async fn while_one_slave_is_in_quarantine_the_others_are_served_and_its_late_answer_does_no_harm() {
    let (line, mut peer) = line(without_retries);
    let (mut slow, mut slow_again, mut other) = (line.slave(3), line.slave(3), line.slave(4));
    let first = tokio::spawn(async move { read(&mut slow, 10, 1).await });
    peer.request().await;
    assert!(first.await.unwrap().is_err());
    let second = tokio::spawn(async move { read(&mut slow_again, 20, 1).await });
    let third = tokio::spawn(async move { read(&mut other, 30, 1).await });
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
    let (result, mut slave) = call.await.unwrap();
    assert_eq!(result, Err(PortError::Damaged("CRC")));
    assert!(start.elapsed() < 150 * MS, "given up long before the timeout, after {:?}", start.elapsed());

    let next = tokio::spawn(async move { read(&mut slave, 0, 1).await });
    peer.answer(&[3, 2, 0, 9]).await;
    assert_eq!(next.await.unwrap(), Ok(vec![9]));
}

#[tokio::test(start_paused = true)]
async fn a_damaged_read_is_repeated() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { read(&mut slave, 0, 1).await });
    peer.request().await;
    peer.after(5 * MS, &[3, 3, 2, 0, 9, 0xFF, 0xFF]).await;
    peer.answer(&[3, 2, 0, 9]).await;
    assert_eq!(call.await.unwrap(), Ok(vec![9]));
    assert_eq!(line.stats().slaves[&3].retries, 1);
}

#[tokio::test(start_paused = true)]
async fn a_foreign_answer_is_ignored_and_the_timer_runs_on() {
    let (line, mut peer) = line(without_retries);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { read(&mut slave, 0, 1).await });
    peer.request().await;
    peer.after(5 * MS, &rtu::frame(9, &[3, 2, 0, 1])).await;
    peer.after(60 * MS, &rtu::frame(3, &[3, 2, 0, 2])).await;
    assert_eq!(call.await.unwrap(), Ok(vec![2]));
    assert_eq!(line.stats().foreign, 1);
}

#[tokio::test(start_paused = true)]
async fn noise_before_an_answer_is_no_part_of_it() {
    let (line, mut peer) = line(without_retries);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { read(&mut slave, 0, 1).await });
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
        let mut slave = line.slave(3);
        let call = tokio::spawn(async move { write(&mut slave, 0x2135, 3).await });
        peer.answer(wrong).await;
        let error = call.await.unwrap().unwrap_err();
        assert_eq!(error, PortError::OutcomeUnknown("the confirmation does not fit"));
    }
}

#[tokio::test(start_paused = true)]
async fn a_short_answer_to_a_read_is_refused() {
    let (line, mut peer) = line(without_retries);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { read(&mut slave, 0, 2).await });
    peer.answer(&[3, 2, 0, 1]).await;
    assert!(matches!(call.await.unwrap(), Err(PortError::Mismatch(_))));
}

#[tokio::test(start_paused = true)]
async fn a_call_dropped_while_it_is_on_the_wire_does_no_harm() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { read(&mut slave, 10, 1).await });
    peer.request().await;
    call.abort();
    let mut slave = line.slave(3);
    let next = tokio::spawn(async move { read(&mut slave, 20, 1).await });
    peer.after(5 * MS, &rtu::frame(3, &[3, 2, 0, 10])).await;
    peer.answer(&[3, 2, 0, 20]).await;
    assert_eq!(next.await.unwrap(), Ok(vec![20]));
}

#[tokio::test(start_paused = true)]
async fn a_call_dropped_before_it_is_sent_never_is() {
    let (line, mut peer) = line(|config| config);
    let (mut slave, mut other) = (line.slave(3), line.slave(4));
    let first = tokio::spawn(async move { read(&mut slave, 10, 1).await });
    peer.request().await;
    let dropped = tokio::spawn(async move { write(&mut other, 20, 1).await });
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
        let mut slave = line.slave(3);
        let call = tokio::spawn(async move { write(&mut slave, 20, 7).await });
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
    let mut slave = line.slave(3);
    let call = tokio::spawn(async move { write(&mut slave, 20, 7).await });
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
    let mut slave = line.slave(1);
    let next = tokio::spawn(async move { read(&mut slave, 0, 1).await });
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
            let (mut slave, sent) = (line.slave(2), request.clone());
            let call = tokio::spawn(async move { slave.call(sent).await });
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

#[tokio::test(start_paused = true)]
async fn the_silence_before_a_request_is_never_shorter_than_3_5_characters() {
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    let (line, mut peer) = line(|config| config);
    for n in 0..20 {
        let mut slave = line.slave(1 + n % 3);
        let call = tokio::spawn(async move { read(&mut slave, 0, 1).await });
        let silent_from = Instant::now();
        peer.answer(&[3, 2, 0, 1]).await;
        assert_eq!(call.await.unwrap(), Ok(vec![1]));
        if n > 0 {
            let stats = line.stats();
            assert!(stats.silence.quantile(1) >= t3_5, "{:?} since {silent_from:?}", stats.silence);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_slaves_own_pause_is_spent_serving_another() {
    let pause = SlaveSettings { turnaround: 50 * MS, ..SlaveSettings::default() };
    let (line, mut peer) = line(|config| config.slave(1, pause));
    let (mut one, mut one_again, mut two) = (line.slave(1), line.slave(1), line.slave(2));
    let first = tokio::spawn(async move { read(&mut one, 0, 1).await });
    peer.answer(&[3, 2, 0, 1]).await;
    assert!(first.await.unwrap().is_ok());
    let answered = Instant::now();
    let second = tokio::spawn(async move { read(&mut one_again, 0, 1).await });
    let third = tokio::spawn(async move { read(&mut two, 0, 1).await });
    assert_eq!(peer.answer(&[3, 2, 0, 2]).await[0], 2);
    assert_eq!(peer.answer(&[3, 2, 0, 3]).await[0], 1);
    assert!(answered.elapsed() >= 50 * MS);
    assert_eq!((second.await.unwrap(), third.await.unwrap()), (Ok(vec![3]), Ok(vec![2])));
}

#[tokio::test(start_paused = true)]
async fn a_stop_goes_before_everything_and_takes_waiting_commands_with_it() {
    let (line, mut peer) = line(|config| config);
    let busy = tokio::spawn({
        let mut slave = line.slave(9);
        async move { read(&mut slave, 0, 1).await }
    });
    peer.request().await;
    let poll = tokio::spawn({
        let mut slave = line.slave(2);
        async move { read(&mut slave, 0, 1).await }
    });
    let start = tokio::spawn({
        let mut slave = line.slave(1).with_terms(Terms::of(Class::Command));
        async move { write(&mut slave, 8501, 15).await }
    });
    tokio::time::sleep(MS).await;
    let stop = tokio::spawn({
        let mut slave = line.slave(1).with_terms(Terms::of(Class::Stop));
        async move { write(&mut slave, 8501, 0).await }
    });
    peer.after(5 * MS, &rtu::frame(9, &[3, 2, 0, 1])).await;
    assert!(busy.await.unwrap().is_ok());
    assert_eq!(peer.answer(&[6, 0x21, 0x35, 0, 0]).await[..2], [1, 6]);
    assert_eq!(stop.await.unwrap(), Ok(()));
    assert_eq!(start.await.unwrap(), Err(PortError::Superseded));
    assert_eq!(peer.answer(&[3, 2, 0, 1]).await[0], 2);
    assert!(poll.await.unwrap().is_ok());
}

#[tokio::test(start_paused = true)]
async fn a_command_expires_in_the_queue_and_is_never_sent_late() {
    let (line, mut peer) = line(without_retries);
    let busy = tokio::spawn({
        let mut slave = line.slave(9);
        async move { read(&mut slave, 0, 1).await }
    });
    peer.request().await;
    let terms = Terms::of(Class::Command).within(200 * MS);
    let start = Instant::now();
    let mut slave = line.slave(1).with_terms(terms);
    assert_eq!(write(&mut slave, 8501, 15).await, Err(PortError::Expired));
    assert_eq!(start.elapsed(), 200 * MS);
    assert!(busy.await.unwrap().is_err());
    peer.hears_nothing_for(2_000 * MS).await;
}

#[tokio::test(start_paused = true)]
async fn the_latest_setpoint_wins_while_none_is_sent() {
    let (line, mut peer) = line(|config| config);
    let busy = tokio::spawn({
        let mut slave = line.slave(9);
        async move { read(&mut slave, 0, 1).await }
    });
    peer.request().await;
    let terms = Terms::of(Class::Command).replacing(8502);
    let setpoints: Vec<_> = [100, 200, 300]
        .into_iter()
        .map(|value| {
            let mut slave = line.slave(1).with_terms(terms);
            tokio::spawn(async move { write(&mut slave, 8502, value).await })
        })
        .collect();
    tokio::time::sleep(MS).await;
    peer.after(5 * MS, &rtu::frame(9, &[3, 2, 0, 1])).await;
    busy.await.unwrap().unwrap();
    peer.answer(&[6, 0x21, 0x36, 1, 44]).await;
    let mut outcomes = Vec::new();
    for setpoint in setpoints {
        outcomes.push(setpoint.await.unwrap());
    }
    assert_eq!(outcomes, [Err(PortError::Superseded), Err(PortError::Superseded), Ok(())]);
}

#[tokio::test(start_paused = true)]
async fn a_level_is_written_again_an_edge_never() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(1);
    let level = tokio::spawn(async move { write(&mut slave, 8502, 1).await });
    peer.request().await;
    peer.answer(&[6, 0x21, 0x36, 0, 1]).await;
    assert_eq!(level.await.unwrap(), Ok(()));

    let mut slave = line.slave(1).with_terms(Terms::of(Class::Command).edge());
    let edge = tokio::spawn(async move { write(&mut slave, 8501, 128).await });
    peer.request().await;
    assert_eq!(edge.await.unwrap(), Err(PortError::OutcomeUnknown("no answer")));
    peer.hears_nothing_for(2_000 * MS).await;
}

#[tokio::test(start_paused = true)]
async fn a_dead_slave_goes_off_line_fails_fast_and_comes_back_by_a_probe() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(1);
    let call = tokio::spawn(async move { read(&mut slave, 7, 1).await });
    for _ in 0..3 {
        peer.request().await;
    }
    assert_eq!(call.await.unwrap(), Err(PortError::Timeout { after: 500 * MS }));
    let start = Instant::now();
    let error = read(&mut line.slave(1), 7, 1).await.unwrap_err();
    assert!(matches!(error, PortError::Offline { retry_in } if retry_in <= 500 * MS), "{error:?}");
    assert_eq!(start.elapsed(), Duration::ZERO);
    // The line asks again by itself, with the read that was asked last.
    assert_eq!(peer.answer(&[3, 2, 0, 1]).await, rtu::frame(1, &[3, 0, 7, 0, 1]));
    tokio::time::sleep(MS).await;
    assert!(!line.stats().slaves[&1].offline);
    let mut slave = line.slave(1);
    let call = tokio::spawn(async move { read(&mut slave, 7, 1).await });
    peer.answer(&[3, 2, 0, 5]).await;
    assert_eq!(call.await.unwrap(), Ok(vec![5]));
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_sent_to_an_off_line_slave_and_a_probe_gives_way_to_it() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(1);
    let call = tokio::spawn(async move { read(&mut slave, 7, 1).await });
    for _ in 0..3 {
        peer.request().await;
    }
    assert!(call.await.unwrap().is_err());
    assert_eq!(peer.request().await[1], 3, "the probe");
    tokio::time::sleep(10 * MS).await;
    let start = Instant::now();
    let mut slave = line.slave(2).with_terms(Terms::of(Class::Stop));
    let stop = tokio::spawn(async move { write(&mut slave, 8501, 0).await });
    peer.answer(&[6, 0x21, 0x35, 0, 0]).await;
    assert_eq!(stop.await.unwrap(), Ok(()));
    assert!(start.elapsed() < 50 * MS, "{:?}", start.elapsed());
}

#[tokio::test(start_paused = true)]
async fn a_full_queue_says_so() {
    let (line, _peer) = line(|config| LineConfig { queue_limit: 2, ..config });
    let waiting: Vec<_> = (1..=4)
        .map(|address| {
            let mut slave = line.slave(address);
            tokio::spawn(async move { read(&mut slave, 0, 1).await })
        })
        .collect();
    tokio::task::yield_now().await;
    tokio::task::yield_now().await;
    let refused = read(&mut line.slave(5), 0, 1).await;
    assert!(matches!(refused, Err(PortError::QueueFull(2))), "{refused:?}");
    drop(waiting);
}

#[tokio::test(start_paused = true)]
async fn closing_ends_what_waits_and_lets_the_exchange_finish() {
    let (line, mut peer) = line(|config| config);
    let (mut one, mut two) = (line.slave(1), line.slave(2));
    let under_way = tokio::spawn(async move { read(&mut one, 0, 1).await });
    peer.request().await;
    let waiting = tokio::spawn(async move { read(&mut two, 0, 1).await });
    tokio::task::yield_now().await;
    let closing = tokio::spawn({
        let line = line.clone();
        async move { line.close().await }
    });
    assert_eq!(waiting.await.unwrap(), Err(PortError::Closed));
    peer.after(5 * MS, &rtu::frame(1, &[3, 2, 0, 1])).await;
    assert_eq!(under_way.await.unwrap(), Ok(vec![1]));
    closing.await.unwrap();
    assert_eq!(read(&mut line.slave(1), 0, 1).await, Err(PortError::Closed));
}
