//! Somebody on the control socket who hears what becomes of each stop.

use std::{
    collections::HashSet,
    io::{BufRead as _, BufReader, Error, ErrorKind, Result, Write as _},
    os::unix::net::UnixStream,
    path::Path,
    sync::mpsc::{Receiver, channel},
    thread,
    time::Instant,
};

use super::PATIENCE;

/// In what is told of a stop.
const STOPS: &str = "\"action\":\"stop\"";
const BEGUN_ANEW: &str = "begun anew";

/// What was heard.
pub(super) struct Observer {
    heard: Receiver<String>,
    /// The stops of which nothing is known yet.
    pending: HashSet<String>,
    /// Those that are known: each is told again when something becomes of it.
    known: HashSet<String>,
}

impl Observer {
    /// Follows the events of a daemon from now on.
    pub(super) fn start(socket: &Path) -> Result<Self> {
        let connect = |socket: &Path| {
            let mut stream = UnixStream::connect(socket)?;
            stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")?;
            Result::Ok(stream)
        };
        let (mut stream, socket) = (connect(socket)?, socket.to_owned());
        let (tell, heard) = channel();
        thread::spawn(move || {
            loop {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    let of_a_stop = line.starts_with("data:") && line.contains(STOPS);
                    if of_a_stop && tell.send(line).is_err() {
                        return;
                    }
                }
                // Whoever came so late that a stream has gone on begins anew, as long as there is a daemon.
                stream = match connect(&socket) {
                    Ok(stream) if tell.send(BEGUN_ANEW.to_owned()).is_ok() => stream,
                    _ => return,
                };
            }
        });
        Ok(Self { heard, pending: HashSet::new(), known: HashSet::new() })
    }

    /// Waits until something has become of one more stop and of all others: what a line has in its queue then is of the next.
    pub(super) fn has_settled_another(&mut self) -> Result<()> {
        let (until, mut is_another) = (Instant::now() + PATIENCE, false);
        while !(is_another && self.pending.is_empty()) {
            let left = until.saturating_duration_since(Instant::now());
            let data = self.heard.recv_timeout(left).map_err(|_| Error::from(ErrorKind::TimedOut))?;
            is_another |= self.hear(&data);
        }
        Ok(())
    }

    /// Hears of what has become of those that are not settled by now.
    pub(super) fn catch_up(&mut self) {
        while let Ok(data) = self.heard.try_recv() {
            self.hear(&data);
        }
    }

    /// Whether it tells of a stop that was not known.
    fn hear(&mut self, data: &str) -> bool {
        if data == BEGUN_ANEW {
            // What has become of them was told meanwhile.
            self.pending.clear();
            return true;
        }
        let id = data.split_once("\"id\":\"").and_then(|(_, rest)| rest.split_once('"'));
        let Some((id, rest)) = id.filter(|_| data.contains("\"command\":\"")) else { return false };
        match rest.contains("\"outcome\":\"pending\"") {
            true => self.pending.insert(id.to_owned()),
            false => self.pending.remove(id),
        };
        self.known.insert(id.to_owned())
    }
}
