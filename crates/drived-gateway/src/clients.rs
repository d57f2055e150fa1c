//! What is remembered of clients by their addresses: the last command word to each drive, and when they were last heard. Time is an
//! argument.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Mutex, PoisonError},
};

use drive_fleet::Place;
use tokio::time::Instant;

/// How many addresses are remembered. Who comes back after having been forgotten has to write a word without run again.
const KEPT: usize = 1_024;

/// A command word, as far as it matters for the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    Run,
    WithoutRun,
}

/// The clients of a gateway.
#[derive(Debug, Default)]
pub(super) struct Clients(Mutex<HashMap<IpAddr, Client>>);

#[derive(Debug)]
struct Client {
    heard: Instant,
    words: HashMap<Place, (Word, Instant)>,
}

impl Clients {
    /// A client has asked for something.
    pub(super) fn hear(&self, peer: IpAddr, now: Instant) {
        self.with(peer, now, |client| client.heard = now);
    }

    /// A client has written a command word to a drive; gives the one before it, and when that was.
    pub(super) fn write(&self, peer: IpAddr, drive: &Place, word: Word) -> Option<(Word, Instant)> {
        let now = Instant::now();
        self.with(peer, now, |client| client.words.insert(drive.clone(), (word, now)))
    }

    fn with<T>(&self, peer: IpAddr, now: Instant, act: impl FnOnce(&mut Client) -> T) -> T {
        let mut clients = self.0.lock().unwrap_or_else(PoisonError::into_inner);
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
