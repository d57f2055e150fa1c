//! A thousand who read at once: those who poll and keep their connection, those who come anew each time, pages, and event streams.

use std::{
    io::{self, ErrorKind},
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

use super::{
    Got, SECOND, Tally, all,
    client::{Client, connect},
    http::{Answer, Answers},
};
use crate::doors::attacks::Target;

const READERS: u16 = 1_000;

const SERVED: &str = "polls served";
const STREAMS: &str = "event streams opened";

pub(super) fn read(to: &Target, over: &AtomicBool) -> Vec<Got> {
    let http = to.http;
    all(0..READERS, over, SERVED, |number, over| reader(number, http, over))
}

/// One in four each: a poll on a connection that is kept, a poll on a new one, a page, a stream.
async fn reader(number: u16, http: SocketAddr, over: Arc<AtomicBool>) -> Tally {
    let (mut tally, mut client) = (Tally::default(), Client::new(number, http));
    // Not all in the same moment.
    sleep(Duration::from_millis(u64::from(number))).await;
    while !over.load(Ordering::Relaxed) {
        let begun = Instant::now();
        let path = match number % 4 {
            0 => "/api/v1/drives",
            1 => "/api/v1/drives/pump%201",
            2 => "/api/v1/state",
            _ => {
                stream(number, http, &over, &mut tally).await;
                sleep(SECOND.saturating_sub(begun.elapsed())).await;
                continue;
            }
        };
        match client.ask("polls", &mut tally, async |open| poll(open, path).await).await {
            Some(answer) if answer.status == 200 => tally.count(SERVED),
            Some(answer) => {
                tally.count(format!("polls refused: {}", answer.name()));
                client.leave();
            }
            None => {}
        }
        if !number.is_multiple_of(4) {
            client.leave();
        }
        sleep(SECOND.saturating_sub(begun.elapsed())).await;
    }
    tally
}

async fn poll(open: &mut TcpStream, path: &str) -> io::Result<Answer> {
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
    open.write_all(request.as_bytes()).await?;
    let (mut answers, mut buffer) = (Answers::default(), vec![0; 16_384]);
    loop {
        let read = open.read(&mut buffer).await?;
        if read == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        answers.hear(buffer.get(..read).unwrap_or_default());
        if let Some(answer) = answers.next() {
            return Ok(answer);
        }
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
