//! Somebody on the control socket who hears of each command as soon as it waits for its line.

use std::{
    collections::HashSet,
    io::{BufRead as _, BufReader, Error, ErrorKind, Result, Write as _},
    os::unix::net::UnixStream,
    path::Path,
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

use super::PATIENCE;

/// What was heard, with its time.
pub(super) struct Observer {
    heard: Receiver<(Instant, String)>,
    /// The commands that are known: each is told again when something becomes of it.
    known: HashSet<String>,
}

impl Observer {
    /// Follows the events of a daemon from now on.
    pub(super) fn start(socket: &Path) -> Result<Self> {
        let mut stream = UnixStream::connect(socket)?;
        stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")?;
        let (tell, heard) = channel();
        thread::spawn(move || {
            for line in BufReader::new(stream).lines() {
                let Ok(line) = line else { return };
                if line.starts_with("data:") && tell.send((Instant::now(), line)).is_err() {
                    return;
                }
            }
        });
        Ok(Self { heard, known: HashSet::new() })
    }

    /// How long after that it was heard of another command which came from there, whatever has become of it by then.
    pub(super) fn heard_of(&mut self, origin: &str, began: Instant) -> Result<Duration> {
        let origin = format!("\"origin\":\"{origin}");
        loop {
            let left = PATIENCE.saturating_sub(began.elapsed());
            let (at, data) = self.heard.recv_timeout(left).map_err(|_| Error::from(ErrorKind::TimedOut))?;
            let id = data.split_once("\"id\":\"").and_then(|(_, rest)| rest.split_once('"'));
            let is_new = id.is_some_and(|(id, _)| self.known.insert(id.to_owned()));
            if is_new && at >= began && data.contains(&origin) {
                return Ok(at - began);
            }
        }
    }
}
