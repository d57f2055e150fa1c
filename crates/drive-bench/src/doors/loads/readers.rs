//! A thousand who read at once: those who poll and keep their connection, those who come anew each time, pages, and event streams.

use std::{
    net::SocketAddr,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    time::{Instant, sleep, timeout},
};

use super::{Got, SECOND, Tally, all, connect, http::Answers};
use crate::doors::{PATIENCE, attacks::Target};

const READERS: u16 = 1_000;

const SERVED: &str = "polls served";
const STREAMS: &str = "event streams opened";

pub(super) fn read(to: &Target, over: &AtomicBool) -> Vec<Got> {
    let http = to.http;
    all(0..READERS, over, SERVED, |number, over| reader(number, http, over))
}

/// One in four each: a poll on a connection that is kept, a poll on a new one, a page, a stream.
async fn reader(number: u16, http: SocketAddr, over: Arc<AtomicBool>) -> Tally {
    let mut tally = Tally::default();
    let mut kept = None;
    // Not all in the same moment.
    sleep(Duration::from_millis(u64::from(number))).await;
    while !over.load(Ordering::Relaxed) {
        let begun = Instant::now();
        match number % 4 {
            0 => poll(number, http, "/api/v1/drives", &mut kept, &mut tally).await,
            1 => poll(number, http, "/api/v1/drives/pump%201", &mut None, &mut tally).await,
            2 => poll(number, http, "/api/v1/state", &mut None, &mut tally).await,
            _ => stream(number, http, &over, &mut tally).await,
        }
        sleep(SECOND.saturating_sub(begun.elapsed())).await;
    }
    tally
}

/// One poll, over a connection that is kept or a new one.
async fn poll(number: u16, http: SocketAddr, path: &str, kept: &mut Option<TcpStream>, tally: &mut Tally) {
    let mut open = match kept.take() {
        Some(open) => open,
        None => match connect(number, http).await {
            Ok(open) => open,
            Err(_) => return tally.count("polls that could not connect"),
        },
    };
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
    let asked = async {
        open.write_all(request.as_bytes()).await.ok()?;
        let (mut answers, mut buffer) = (Answers::default(), vec![0; 16_384]);
        loop {
            let read = open.read(&mut buffer).await.ok().filter(|read| *read > 0)?;
            answers.hear(buffer.get(..read)?);
            if let Some(answer) = answers.next() {
                return Some(answer);
            }
        }
    };
    match timeout(PATIENCE, asked).await {
        Err(_) => tally.count("polls without an answer within 5 s"),
        Ok(None) => tally.count("polls whose connection was closed"),
        Ok(Some(answer)) if answer.status == 200 => {
            tally.count(SERVED);
            *kept = Some(open);
        }
        Ok(Some(answer)) => tally.count(format!("polls refused: {}", answer.name())),
    }
}

/// An event stream, until it ends.
async fn stream(number: u16, http: SocketAddr, over: &AtomicBool, tally: &mut Tally) {
    let Ok(mut open) = connect(number, http).await else {
        return tally.count("streams that could not connect");
    };
    if open.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").await.is_err() {
        return;
    }
    let (mut answers, mut buffer, mut is_open) = (Answers::default(), vec![0; 16_384], false);
    while !over.load(Ordering::Relaxed) {
        let read = match timeout(SECOND, open.read(&mut buffer)).await {
            Err(_) => continue,
            Ok(Ok(read)) if read > 0 => read,
            Ok(_) => {
                tally.count(if is_open {
                    "event streams ended"
                } else {
                    "streams whose connection was closed"
                });
                return;
            }
        };
        if is_open {
            continue;
        }
        answers.hear(buffer.get(..read).unwrap_or_default());
        match answers.next() {
            None => {}
            Some(answer) if answer.status == 200 => {
                is_open = true;
                tally.count(STREAMS);
            }
            Some(answer) => return tally.count(format!("streams refused: {}", answer.name())),
        }
    }
}
