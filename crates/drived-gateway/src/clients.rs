//! What is remembered of clients: by their addresses the last command word to each drive, and when they were last heard; by their
//! connections what is older than what.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use drive_fleet::Place;
use drived_config::rights::Heard;
use tokio::{sync::watch, time::Instant};

/// How many addresses are remembered. Who comes back after having been forgotten has to write a word without run again.
const KEPT: usize = 1_024;

/// A command word, as far as it matters for the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Run,
    WithoutRun,
}

/// What stands before a run command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Before {
    /// A word without run of the same client, written then.
    WithoutRun(Instant),
    /// Nothing, or a run command: it only goes on.
    NoWordWithoutRun,
    /// A word without run that came on another connection when this one was open already. A kernel sends again what it has no answer
    /// to, also when its program has closed the connection and gone on by another one: the run command may be from before that word.
    NewerConnection,
}

/// A connection of a client.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) peer: IpAddr,
    opened: Moment,
    closed: watch::Sender<bool>,
}

impl Connection {
    /// Its client has closed his side.
    pub(super) fn close(&self) {
        self.closed.send_replace(true);
    }

    /// Whether its client may still hear what is answered.
    pub(super) fn is_open(&self) -> bool {
        !*self.closed.borrow()
    }

    /// Until he has, or nobody serves him any more.
    pub(super) fn heard(&self) -> Heard {
        let closed = self.closed.subscribe();
        Heard::until(move || {
            let mut closed = closed.clone();
            async move { drop(closed.wait_for(|is_closed| *is_closed).await) }
        })
    }
}

/// One after the other, of all gateways of a program.
type Moment = u64;

/// In which order connections were opened and words without run written, at all gateways of a program. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Course(Arc<Mutex<Past>>);

#[derive(Debug, Default)]
struct Past {
    moments: Moment,
    /// The last word without run to each drive: when, and when its connection was opened, which no two were at once.
    without_run: HashMap<Place, (Moment, Moment)>,
}

impl Past {
    const fn next(&mut self) -> Moment {
        self.moments += 1;
        self.moments
    }
}

/// The clients of a gateway.
#[derive(Debug, Default)]
pub(super) struct Clients {
    addresses: Mutex<HashMap<IpAddr, Client>>,
    course: Course,
}

#[derive(Debug)]
struct Client {
    heard: Instant,
    words: HashMap<Place, (Word, Instant)>,
}

impl Clients {
    /// Those of one of the gateways that have a course together.
    pub(super) fn of(course: Course) -> Self {
        Self { course, ..Self::default() }
    }

    /// A client has opened a connection.
    pub(super) fn open(&self, peer: IpAddr) -> Connection {
        Connection { peer, opened: lock(&self.course.0).next(), closed: watch::Sender::new(false) }
    }

    /// A client has asked for something.
    pub(super) fn hear(&self, peer: IpAddr, now: Instant) {
        self.with(peer, now, |client| client.heard = now);
    }

    /// A client has written a word without run to a drive.
    pub(super) fn write_without_run(&self, by: &Connection, drive: &Place) {
        let mut past = lock(&self.course.0);
        let written = (past.next(), by.opened);
        past.without_run.insert(drive.clone(), written);
        drop(past);
        self.write(by.peer, drive, Word::WithoutRun);
    }

    /// A client has written a run command to a drive; gives what stands before it. What may be old is not his last word.
    pub(super) fn write_run(&self, by: &Connection, drive: &Place) -> Before {
        let last = lock(&self.course.0).without_run.get(drive).copied();
        let is_older = |(at, connection)| at > by.opened && connection != by.opened;
        if drive_fleet::mutant!("older-connection-starts", last.is_some_and(is_older), false) {
            return Before::NewerConnection;
        }
        match self.write(by.peer, drive, Word::Run) {
            Some((Word::WithoutRun, at)) => Before::WithoutRun(at),
            _ => Before::NoWordWithoutRun,
        }
    }

    /// Keeps a word; gives the one before it, and when that was.
    fn write(&self, peer: IpAddr, drive: &Place, word: Word) -> Option<(Word, Instant)> {
        let now = Instant::now();
        self.with(peer, now, |client| client.words.insert(drive.clone(), (word, now)))
    }

    fn with<T>(&self, peer: IpAddr, now: Instant, act: impl FnOnce(&mut Client) -> T) -> T {
        let mut clients = lock(&self.addresses);
        if clients.len() >= KEPT && !clients.contains_key(&peer) {
            let oldest = clients.iter().min_by_key(|(_, client)| client.heard).map(|(peer, _)| *peer);
            if let Some(oldest) = oldest {
                clients.remove(&oldest);
            }
        }
        let new = || Client { heard: now, words: HashMap::new() };
        act(clients.entry(peer).or_insert_with(new))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
