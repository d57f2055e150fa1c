//! Somebody on the control socket who hears of each command as soon as it waits for its line.

use std::{
    io::{BufRead as _, BufReader, Error, ErrorKind, Result, Write as _},
    os::unix::net::UnixStream,
    path::Path,
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

use super::PATIENCE;

/// What was heard, with its time.
pub(super) struct Observer(Receiver<(Instant, String)>);

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
        Ok(Self(heard))
    }

    /// How long after that it was heard of a command which came from there and whose outcome was open.
    pub(super) fn heard_of(&self, origin: &str, began: Instant) -> Result<Duration> {
        let origin = format!("\"origin\":\"{origin}");
        loop {
            let left = PATIENCE.saturating_sub(began.elapsed());
            let (at, data) = self.0.recv_timeout(left).map_err(|_| Error::from(ErrorKind::TimedOut))?;
            if at >= began && data.contains(&origin) && data.contains("\"outcome\":\"pending\"") {
                return Ok(at - began);
            }
        }
    }
}
