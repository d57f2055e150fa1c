//! The last exchanges of a line, as its far end has seen them.

mod support;

use std::time::Duration;

use drive_bus::{
    Line, LineConfig,
    exchange::rtu,
    record::{Ending, Exchange},
};
use support::{MS, line, read, write};
use tokio_modbus::{ExceptionCode, Request, client::Client as _};

fn endings(line: &Line) -> Vec<Ending> {
    line.exchanges().iter().map(|exchange| exchange.ending).collect()
}

#[tokio::test(start_paused = true)]
async fn the_last_exchanges_have_the_bytes_that_the_far_end_saw_and_how_each_ended() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    line.keep_exchanges(100);
    let mut slave = line.slave(3);
    let calls = async {
        assert_eq!(read(&mut slave, 10, 1).await, Ok(vec![10]));
        let refused = slave.call(Request::ReadHoldingRegisters(20, 1)).await.unwrap();
        assert_eq!(refused, Err(ExceptionCode::IllegalDataAddress));
        read(&mut slave, 30, 1).await.unwrap_err();
        write(&mut slave, 40, 7).await.unwrap_err();
    };
    let answers = async {
        let mut requests = vec![peer.answer(&[3, 2, 0, 10]).await, peer.answer(&[0x83, 2]).await];
        requests.push(peer.request().await);
        peer.after(5 * MS, &[3, 3, 2, 0, 30, 0xBA, 0xD0]).await;
        requests.push(peer.request().await);
        requests
    };
    let ((), requests) = tokio::join!(calls, answers);
    let kept = line.exchanges();
    assert_eq!(endings(&line), [Ending::Answered, Ending::Exception, Ending::Damaged, Ending::NoAnswer]);
    let seen: Vec<Vec<u8>> = kept.iter().map(|exchange| exchange.request.to_vec()).collect();
    assert_eq!(seen, requests);
    let heard: Vec<&[u8]> = kept.iter().map(|exchange| &*exchange.answer).collect();
    let (first, second) = (rtu::frame(3, &[3, 2, 0, 10]), rtu::frame(3, &[0x83, 2]));
    assert_eq!(heard, [&*first, &*second, &[3, 3, 2, 0, 30, 0xBA, 0xD0], &[]]);
    assert!(kept.iter().all(|exchange| exchange.slave == 3));
    assert!(kept.iter().is_sorted_by_key(|exchange| exchange.began));
    // Eight characters of the request, 5 ms, seven of the answer, at 11 bits and 19200 bit/s.
    let shortest = Duration::from_secs(15 * 11) / 19_200 + 5 * MS;
    assert!(kept[0].took >= shortest, "{:?}", kept[0].took);
}

#[tokio::test(start_paused = true)]
async fn a_line_keeps_no_exchanges_unless_it_is_asked_to_and_then_no_more_than_that() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(3);
    for kept in [0, 2] {
        line.keep_exchanges(kept);
        for word in 0..3 {
            let answer = [3, 2, 0, word as u8];
            let (got, _) = tokio::join!(read(&mut slave, word, 1), peer.answer(&answer));
            got.unwrap();
        }
        let addresses: Vec<u8> = line.exchanges().iter().map(|Exchange { request, .. }| request[3]).collect();
        assert_eq!(addresses, [1, 2][2 - kept..]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_slave_that_is_off_line_has_a_time_of_its_next_probe_and_one_that_answers_has_none() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, offline_after: 1, ..config });
    let mut slave = line.slave(3);
    let (got, _) = tokio::join!(read(&mut slave, 0, 1), peer.answer(&[3, 2, 0, 1]));
    got.unwrap();
    assert_eq!(line.stats().slaves[&3].next_probe, None);
    let (got, _) = tokio::join!(read(&mut slave, 0, 1), peer.request());
    got.unwrap_err();
    let stats = line.stats();
    let longest = line.config().probe_backoff.0 + line.config().late_window;
    assert!(stats.slaves[&3].offline);
    assert!(
        stats.slaves[&3].next_probe.is_some_and(|next| next <= longest),
        "{:?}",
        stats.slaves[&3].next_probe
    );
}

#[tokio::test(start_paused = true)]
async fn a_line_whose_port_is_away_says_why_until_it_is_open() {
    let (line, peer) = line(|config| config);
    assert_eq!(line.stats().away, None);
    drop(peer);
    let error = read(&mut line.slave(3), 0, 1).await.unwrap_err();
    let away = line.stats().away.expect("it says why");
    assert!(error.to_string().contains(&away), "{error}: {away}");
}
