//! What is remembered of clients by their addresses: the last command word to each drive, what they have started, and when
//! they were last heard. Time is an argument.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

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
    words: HashMap<Arc<str>, Word>,
    started: Vec<Arc<str>>,
}

impl Clients {
    /// A client has asked for something.
    pub(super) fn hear(&self, peer: IpAddr, now: Instant) {
        self.with(peer, now, |client| client.heard = now);
    }

    /// A client has written a command word to a drive; gives the one before it.
    pub(super) fn write(&self, peer: IpAddr, drive: &Arc<str>, word: Word) -> Option<Word> {
        self.with(peer, Instant::now(), |client| client.words.insert(Arc::clone(drive), word))
    }

    /// A client starts a drive.
    pub(super) fn start(&self, peer: IpAddr, drive: &Arc<str>, now: Instant) {
        self.with(peer, now, |client| {
            if !client.started.contains(drive) {
                client.started.push(Arc::clone(drive));
            }
        });
    }

    /// What was started by clients that have been silent for so long; each is told once.
    pub(super) fn silent(&self, now: Instant, limit: Duration) -> Vec<(IpAddr, Arc<str>)> {
        let mut clients = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let silent =
            clients.iter_mut().filter(|(_, client)| now.saturating_duration_since(client.heard) >= limit);
        silent
            .flat_map(|(peer, client)| {
                let started = std::mem::take(&mut client.started);
                started.into_iter().map(|drive| (*peer, drive))
            })
            .collect()
    }

    fn with<T>(&self, peer: IpAddr, now: Instant, act: impl FnOnce(&mut Client) -> T) -> T {
        let mut clients = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if clients.len() >= KEPT && !clients.contains_key(&peer) {
            // One that has started something is kept: its silence is still to be noticed.
            let idle = clients.iter().filter(|(_, client)| client.started.is_empty());
            let oldest = idle.min_by_key(|(_, client)| client.heard).map(|(peer, _)| *peer);
            if let Some(oldest) = oldest {
                clients.remove(&oldest);
            }
        }
        let new = || Client { heard: now, words: HashMap::new(), started: Vec::new() };
        act(clients.entry(peer).or_insert_with(new))
    }
}
