//! When a stop is in the queue of its line, as the daemon itself logs it (`DRIVED_LOG=drive_bus=debug`), by the time in its log.

use std::{
    collections::HashSet,
    io::{BufRead as _, BufReader, Error, ErrorKind, Read, Result},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use super::PATIENCE;

/// What is logged when a stop is there, before the address of whom it is for.
const IS_THERE: &str = "a stop is in the queue of its line slave=";
const DAY_MS: f64 = 86_400_000.0;

/// The stops that were logged.
pub(super) struct Queue {
    logged: Receiver<Stop>,
}

/// A stop in the queue of the line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    /// Of the day in UTC, the whole milliseconds.
    ms: f64,
    /// 0: everybody's.
    slave: u8,
}

/// Who is stopped.
#[derive(Debug, Clone, Copy)]
pub(super) enum Whom<'a> {
    /// Each of these, by one for all or by his own.
    All(&'a [u8]),
    One(u8),
}

/// A moment by the clock of the machine, in milliseconds since 1970.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Act(pub(super) f64);

impl Act {
    pub(super) fn now() -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self(since.as_secs_f64() * 1_000.0)
    }
}

impl Queue {
    /// Reads the log of a daemon for as long as it writes one.
    pub(super) fn of(log: impl Read + Send + 'static) -> Self {
        let (tell, logged) = channel();
        thread::spawn(move || {
            for line in BufReader::new(log).lines() {
                let Ok(line) = line else { return };
                // Who is not there any more reads nothing; the pipe is emptied all the same.
                let _ = read(&line).map(|stop| tell.send(stop));
            }
        });
        Self { logged }
    }

    /// Forgets the stops that are there.
    pub(super) fn forget(&self) {
        while self.logged.try_recv().is_ok() {}
    }

    /// How long after an act the stop of everybody who is meant was in the queue. The log tells whole milliseconds: it was there at the
    /// end of the last of them.
    pub(super) fn had(&self, whom: Whom<'_>, act: Act) -> Result<Duration> {
        let (until, mut had) = (Instant::now() + PATIENCE, HashSet::new());
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let stop = self.logged.recv_timeout(left).map_err(|_| Error::from(ErrorKind::TimedOut))?;
            had.insert(stop.slave);
            let has_all = had.contains(&0)
                || match whom {
                    Whom::All(slaves) => slaves.iter().all(|slave| had.contains(slave)),
                    Whom::One(slave) => had.contains(&slave),
                };
            if has_all {
                let waited = (stop.ms + 1.0 - act.0).rem_euclid(DAY_MS);
                return Ok(Duration::from_secs_f64(waited / 1_000.0));
            }
        }
    }
}

/// The stop of a line such as `2026-11-21 14:03:21.350+01:00 DEBUG a stop is in the queue of its line slave=0`.
fn read(line: &str) -> Option<Stop> {
    let (head, slave) = line.split_once(IS_THERE)?;
    let time = head.split(' ').nth(1)?;
    let number = |of: std::ops::Range<usize>| time.get(of)?.parse::<f64>().ok();
    let local = (number(0..2)? * 60.0 + number(3..5)?) * 60_000.0 + number(6..12)? * 1_000.0;
    let ahead = (number(13..15)? * 60.0 + number(16..18)?) * 60_000.0;
    let ahead = if time.get(12..13)? == "-" { -ahead } else { ahead };
    Some(Stop { ms: (local - ahead).rem_euclid(DAY_MS).round(), slave: slave.trim().parse().ok()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_line_is_that_of_the_day_in_utc() {
        let line = |time| format!("2026-11-21 {time} DEBUG a stop is in the queue of its line slave=7");
        let read = |time| read(&line(time)).unwrap();
        assert_eq!(read("14:03:21.350+01:00"), Stop { ms: 47_001_350.0, slave: 7 });
        assert_eq!(read("00:30:00.000+01:00").ms, 84_600_000.0);
        assert_eq!(read("23:30:00.001-01:00").ms, 1_800_001.0);
        assert_eq!(super::read("2026-11-21 14:03:21.350+01:00 INFO  the page is at http://[::1]/"), None);
    }

    #[test]
    fn a_stop_of_all_is_there_with_that_of_everybody_or_of_each() {
        let log = "x 00:00:00.010+00:00 DEBUG a stop is in the queue of its line slave=1\n\
                   x 00:00:00.012+00:00 DEBUG a stop is in the queue of its line slave=2\n\
                   x 00:00:00.020+00:00 DEBUG a stop is in the queue of its line slave=0\n";
        let queue = Queue::of(log.as_bytes());
        assert_eq!(queue.had(Whom::All(&[1, 2]), Act(10.5)).unwrap(), Duration::from_secs_f64(0.0025));
        assert_eq!(queue.had(Whom::All(&[1, 2]), Act(10.0)).unwrap(), Duration::from_millis(11));
    }
}
