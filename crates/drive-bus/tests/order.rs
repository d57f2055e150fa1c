//! What a line sends when: silences, classes, lifetimes, replacements, and slaves that are off-line.

mod support;

use std::time::Duration;

use drive_bus::{LineConfig, SlaveSettings, exchange::rtu};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use support::{MS, line, read, reads, write, writes};
use tokio::time::Instant;

fn without_retries(config: LineConfig) -> LineConfig {
    LineConfig { retries: 0, ..config }
}

#[tokio::test(start_paused = true)]
async fn the_silence_before_a_request_is_never_shorter_than_3_5_characters() {
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    let (line, mut peer) = line(|config| config);
    for n in 0..20 {
        let call = reads(line.slave(1 + n % 3), 0, 1);
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
    let first = reads(line.slave(1), 0, 1);
    peer.answer(&[3, 2, 0, 1]).await;
    assert!(first.await.unwrap().is_ok());
    let answered = Instant::now();
    let second = reads(line.slave(1), 0, 1);
    let third = reads(line.slave(2), 0, 1);
    assert_eq!(peer.answer(&[3, 2, 0, 2]).await[0], 2);
    assert_eq!(peer.answer(&[3, 2, 0, 3]).await[0], 1);
    assert!(answered.elapsed() >= 50 * MS);
    assert_eq!((second.await.unwrap(), third.await.unwrap()), (Ok(vec![3]), Ok(vec![2])));
}

#[tokio::test(start_paused = true)]
async fn a_stop_goes_before_everything_and_takes_waiting_commands_with_it() {
    let (line, mut peer) = line(|config| config);
    let busy = reads(line.slave(9), 0, 1);
    peer.request().await;
    let poll = reads(line.slave(2), 0, 1);
    let start = writes(line.slave(1).with_terms(Terms::of(Class::Command)), 8501, 15);
    tokio::time::sleep(MS).await;
    let stop = writes(line.slave(1).with_terms(Terms::of(Class::Stop)), 8501, 0);
    peer.after(5 * MS, &rtu::frame(9, &[3, 2, 0, 1])).await;
    assert!(busy.await.unwrap().is_ok());
    assert_eq!(peer.answer(&[6, 0x21, 0x35, 0, 0]).await[..2], [1, 6]);
    assert_eq!(stop.await.unwrap(), Ok(()));
    assert_eq!(start.await.unwrap(), Err(PortError::Superseded));
    assert_eq!(peer.answer(&[3, 2, 0, 1]).await[0], 2);
    assert!(poll.await.unwrap().is_ok());
}

#[tokio::test(start_paused = true)]
async fn an_order_of_several_writes_ends_with_a_stop_that_was_written_to_its_slave() {
    let (line, mut peer) = line(|config| config);
    let order = || Terms { begun: Some(Instant::now()), ..Terms::of(Class::Command) };
    let before = order();
    tokio::time::sleep(MS).await;
    let stop = writes(line.slave(1).with_terms(Terms::of(Class::Stop)), 8501, 0);
    peer.answer(&[6, 0x21, 0x35, 0, 0]).await;
    assert_eq!(stop.await.unwrap(), Ok(()));

    assert_eq!(write(&mut line.slave(1).with_terms(before), 8501, 15).await, Err(PortError::Superseded));
    assert_eq!(line.stats().slaves[&1].outcomes.superseded, 1);
    tokio::time::sleep(MS).await;
    let alone = Terms::of(Class::Command);
    for (slave, terms) in [(2, before), (1, order()), (1, alone)] {
        let goes_on = writes(line.slave(slave).with_terms(terms), 8501, 15);
        assert_eq!(peer.answer(&[6, 0x21, 0x35, 0, 15]).await[0], slave);
        assert_eq!(goes_on.await.unwrap(), Ok(()));
    }
    let read = reads(line.slave(1).with_terms(before), 8501, 1);
    peer.answer(&[3, 2, 0, 15]).await;
    assert_eq!(read.await.unwrap(), Ok(vec![15]));
}

#[tokio::test(start_paused = true)]
async fn every_order_ends_with_a_stop_that_was_written_to_all() {
    let (line, mut peer) = line(|config| config);
    let before = Terms { begun: Some(Instant::now()), ..Terms::of(Class::Command) };
    tokio::time::sleep(MS).await;
    let stop = writes(line.slave(0).with_terms(Terms::of(Class::Stop)), 8501, 0);
    peer.request().await;
    assert_eq!(stop.await.unwrap(), Ok(()));
    for slave in [1, 2] {
        let outcome = write(&mut line.slave(slave).with_terms(before), 8501, 15).await;
        assert_eq!(outcome, Err(PortError::Superseded));
    }
    peer.hears_nothing_for(1_000 * MS).await;
}

#[tokio::test(start_paused = true)]
async fn a_command_expires_in_the_queue_and_is_never_sent_late() {
    let (line, mut peer) = line(without_retries);
    let busy = reads(line.slave(9), 0, 1);
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
    let busy = reads(line.slave(9), 0, 1);
    peer.request().await;
    let terms = Terms::of(Class::Command).replacing(8502);
    let setpoints: Vec<_> = [100, 200, 300]
        .into_iter()
        .map(|value| writes(line.slave(1).with_terms(terms), 8502, value))
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
    let level = writes(line.slave(1), 8502, 1);
    peer.request().await;
    peer.answer(&[6, 0x21, 0x36, 0, 1]).await;
    assert_eq!(level.await.unwrap(), Ok(()));

    let edge = writes(line.slave(1).with_terms(Terms::of(Class::Command).edge()), 8501, 128);
    peer.request().await;
    assert_eq!(edge.await.unwrap(), Err(PortError::OutcomeUnknown("no answer")));
    peer.hears_nothing_for(2_000 * MS).await;
}

#[tokio::test(start_paused = true)]
async fn a_dead_slave_goes_off_line_fails_fast_and_comes_back_by_a_probe() {
    let (line, mut peer) = line(|config| config);
    let call = reads(line.slave(1), 7, 1);
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
    let call = reads(line.slave(1), 7, 1);
    peer.answer(&[3, 2, 0, 5]).await;
    assert_eq!(call.await.unwrap(), Ok(vec![5]));
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_sent_to_an_off_line_slave_and_a_probe_gives_way_to_it() {
    let (line, mut peer) = line(|config| config);
    let call = reads(line.slave(1), 7, 1);
    for _ in 0..3 {
        peer.request().await;
    }
    assert!(call.await.unwrap().is_err());
    assert_eq!(peer.request().await[1], 3, "the probe");
    tokio::time::sleep(10 * MS).await;
    let start = Instant::now();
    let stop = writes(line.slave(2).with_terms(Terms::of(Class::Stop)), 8501, 0);
    peer.answer(&[6, 0x21, 0x35, 0, 0]).await;
    assert_eq!(stop.await.unwrap(), Ok(()));
    assert!(start.elapsed() < 50 * MS, "{:?}", start.elapsed());
}

#[tokio::test(start_paused = true)]
async fn a_full_queue_says_so() {
    let (line, _peer) = line(|config| LineConfig { queue_limit: 2, ..config });
    let waiting: Vec<_> = (1..=4).map(|address| reads(line.slave(address), 0, 1)).collect();
    tokio::task::yield_now().await;
    tokio::task::yield_now().await;
    let refused = read(&mut line.slave(5), 0, 1).await;
    assert!(matches!(refused, Err(PortError::QueueFull(2))), "{refused:?}");
    drop(waiting);
}

#[tokio::test(start_paused = true)]
async fn closing_ends_what_waits_and_lets_the_exchange_finish() {
    let (line, mut peer) = line(|config| config);
    let under_way = reads(line.slave(1), 0, 1);
    peer.request().await;
    let waiting = reads(line.slave(2), 0, 1);
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

#[tokio::test(start_paused = true)]
async fn a_write_whose_repetition_is_refused_after_a_lost_answer_has_an_unknown_outcome() {
    let (line, mut peer) = line(|config| config);
    let call = writes(line.slave(1).with_terms(Terms::of(Class::Command)), 8501, 15);
    // Carried out, and its confirmation is lost.
    peer.request().await;
    peer.answer(&[0x86, 6]).await;
    let outcome = call.await.unwrap();
    assert!(matches!(outcome, Err(PortError::OutcomeUnknown(_))), "{outcome:?}");
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_waits_for_the_pause_of_every_slave() {
    let pause = SlaveSettings { turnaround: 50 * MS, ..SlaveSettings::default() };
    let (line, mut peer) = line(|config| config.slave(1, pause));
    let first = reads(line.slave(1), 0, 1);
    peer.answer(&[3, 2, 0, 1]).await;
    assert!(first.await.unwrap().is_ok());
    let answered = Instant::now();
    let stop = writes(line.broadcast().with_terms(Terms::of(Class::Stop)), 1, 0);
    assert_eq!(peer.request().await[0], 0);
    assert!(answered.elapsed() >= 50 * MS, "{:?}", answered.elapsed());
    assert_eq!(stop.await.unwrap(), Ok(()));
}
