//! A call whose caller has gone: what is unsent never is, but a stop always is.

mod support;

use drive_bus::exchange::rtu;
use drive_core::{Class, Terms};
use support::{MS, line, read, reads, write, writes};
use tokio::{
    task::yield_now,
    time::{Instant, timeout_at},
};

/// The ways in which a call of this class is made and dropped while another slave's exchange is under way; gives the requests that
/// come within a second after that.
async fn dropped(class: Class, is_write: bool) -> Vec<Vec<u8>> {
    let (line, mut peer) = line(|config| config);
    let mut other = line.slave(4).with_terms(Terms::of(class));
    let first = reads(line.slave(3), 10, 1);
    peer.request().await;
    let call = tokio::spawn(async move {
        let _ =
            if is_write { write(&mut other, 20, 1).await } else { read(&mut other, 20, 1).await.map(drop) };
    });
    yield_now().await;
    call.abort();
    assert!(call.await.unwrap_err().is_cancelled());
    peer.after(5 * MS, &rtu::frame(3, &[3, 2, 0, 10])).await;
    assert_eq!(first.await.unwrap(), Ok(vec![10]));
    let mut requests = Vec::new();
    let until = Instant::now() + 5_000 * MS;
    while let Ok(request) = timeout_at(until, peer.request()).await {
        // One that does not answer is probed.
        if request != rtu::frame(4, &[3, 0, 0, 0, 1]) {
            requests.push(request);
        }
    }
    requests
}

#[tokio::test(start_paused = true)]
async fn a_stop_whose_caller_has_gone_is_sent_and_repeated_until_it_is_answered_or_in_vain() {
    // Three attempts, none of them answered.
    assert_eq!(dropped(Class::Stop, true).await, vec![rtu::frame(4, &[6, 0, 20, 0, 1]); 3]);
}

/// The end of a request of a service: call, drive and line go together, while others wait at the line.
#[tokio::test(start_paused = true)]
async fn a_stop_whose_caller_and_whose_line_have_gone_is_sent_and_nothing_else() {
    let (line, mut peer) = line(|config| config);
    let mut other = line.slave(4).with_terms(Terms::of(Class::Stop));
    let first = reads(line.slave(3), 10, 1);
    peer.request().await;
    let waiting = reads(line.slave(5), 30, 1);
    let call = tokio::spawn(async move { write(&mut other, 20, 1).await });
    yield_now().await;
    for call in [&first, &waiting] {
        call.abort();
    }
    call.abort();
    drop(line);
    peer.after(5 * MS, &rtu::frame(3, &[3, 2, 0, 10])).await;
    let stop = rtu::frame(4, &[6, 0, 20, 0, 1]);
    assert_eq!(peer.request().await, stop);
    peer.after(5 * MS, &stop).await;
    let until = Instant::now() + 5_000 * MS;
    assert_eq!(timeout_at(until, peer.closed()).await, Ok(true), "the port is closed behind it");
}

#[tokio::test(start_paused = true)]
async fn whatever_else_was_dropped_before_it_was_sent_never_is() {
    for class in [Class::Command, Class::KeepAlive, Class::Status, Class::Background] {
        assert_eq!(dropped(class, true).await, Vec::<Vec<u8>>::new(), "{class:?}");
    }
    // Nobody is served by the answer to a question that nobody asks any more.
    assert_eq!(dropped(Class::Stop, false).await, Vec::<Vec<u8>>::new());
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_dropped_while_it_is_on_the_wire_is_asked_again() {
    let (line, mut peer) = line(|config| config);
    let call = writes(line.slave(4).with_terms(Terms::of(Class::Stop)), 20, 1);
    let stop = peer.request().await;
    call.abort();
    assert!(call.await.unwrap_err().is_cancelled());
    let again = tokio::time::timeout(3_000 * MS, peer.request()).await;
    assert_eq!(again.expect("it is asked again"), stop);
    peer.answer(&stop[1..6]).await;
    peer.hears_nothing_for(3_000 * MS).await;
}
