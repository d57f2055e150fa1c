//! How many may be connected at once. Whoever comes when there is no room takes the place of the one that has asked for
//! nothing the longest, so that idle connections never keep out a stop.

use std::{
    collections::BTreeMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::{sync::Notify, time::Instant};

/// Connections at once.
const CONNECTIONS: usize = 64;
/// Connections of one address.
const PER_ADDRESS: usize = 32;
/// Event streams at once: what is left of the connections is for commands.
const STREAMS: usize = 32;
/// Event streams of one address.
const STREAMS_PER_ADDRESS: usize = 8;

/// The connections of one door; a cheap handle. On the socket nobody has an address, and all count as one.
#[derive(Debug, Clone)]
pub(super) struct Crowd {
    members: Arc<Mutex<Members>>,
    has_addresses: bool,
}

#[derive(Debug, Default)]
struct Members {
    next: u64,
    all: BTreeMap<u64, Member>,
}

#[derive(Debug)]
struct Member {
    address: Option<IpAddr>,
    /// Since when it has asked for nothing.
    idle_since: Option<Instant>,
    streams: bool,
    leave: Arc<Notify>,
}

impl Crowd {
    pub(super) fn new(has_addresses: bool) -> Self {
        Self { members: Arc::default(), has_addresses }
    }

    /// A place for a connection, if there is room or somebody idle to make room.
    pub(super) fn enter(&self, address: Option<IpAddr>, now: Instant) -> Option<Place> {
        let mut members = self.lock();
        let of_it = members.all.values().filter(|member| member.address == address).count();
        let its_own = self.has_addresses && of_it >= PER_ADDRESS;
        if its_own || members.all.len() >= CONNECTIONS {
            let may_go = members.all.iter().filter(|(_, member)| !its_own || member.address == address);
            let idle = may_go.filter_map(|(id, member)| Some((member.idle_since?, *id)));
            let (_, longest) = idle.min()?;
            if let Some(member) = members.all.remove(&longest) {
                member.leave.notify_one();
            }
        }
        let (id, leave) = (members.next, Arc::<Notify>::default());
        members.next += 1;
        let member = Member { address, idle_since: Some(now), streams: false, leave: Arc::clone(&leave) };
        members.all.insert(id, member);
        drop(members);
        Some(Place { crowd: self.clone(), id, leave })
    }

    fn lock(&self) -> MutexGuard<'_, Members> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The place of one connection; it is free again when dropped.
#[derive(Debug)]
pub(super) struct Place {
    crowd: Crowd,
    id: u64,
    leave: Arc<Notify>,
}

impl Place {
    /// Waits until somebody else needs the place. Safe to drop.
    pub(super) async fn wanted(&self) {
        self.leave.notified().await;
    }

    /// The connection asks for something, until this is dropped.
    pub(super) fn ask(&self) -> Asking {
        self.set_idle(None);
        Asking { crowd: self.crowd.clone(), id: self.id }
    }

    fn set_idle(&self, since: Option<Instant>) {
        if let Some(member) = self.crowd.lock().all.get_mut(&self.id) {
            member.idle_since = since;
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.crowd.lock().all.remove(&self.id);
    }
}

/// A request that is not answered whole yet.
#[derive(Debug)]
pub(super) struct Asking {
    crowd: Crowd,
    id: u64,
}

impl Asking {
    /// Whether its answer may be an event stream, or there are too many.
    pub(super) fn may_stream(&self) -> bool {
        let mut members = self.crowd.lock();
        let Some(address) = members.all.get(&self.id).map(|member| member.address) else { return false };
        let streams = || members.all.values().filter(|member| member.streams);
        let of_it = streams().filter(|member| member.address == address).count();
        let too_many =
            streams().count() >= STREAMS || (self.crowd.has_addresses && of_it >= STREAMS_PER_ADDRESS);
        if let Some(member) = members.all.get_mut(&self.id).filter(|_| !too_many) {
            member.streams = true;
        }
        !too_many
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        if let Some(member) = self.crowd.lock().all.get_mut(&self.id) {
            member.idle_since = Some(Instant::now());
            member.streams = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn address(number: u8) -> Option<IpAddr> {
        Some(IpAddr::from([10, 0, 0, number]))
    }

    #[test]
    fn an_idle_connection_makes_room_and_one_that_asks_does_not() {
        let (crowd, start) = (Crowd::new(true), Instant::now());
        let places: Vec<Place> = (0..32)
            .map(|number| crowd.enter(address(1), start + Duration::from_secs(number)).unwrap())
            .collect();
        let asking: Vec<Asking> = places.iter().take(31).map(Place::ask).collect();
        let newest = crowd.enter(address(1), start).unwrap();
        assert_eq!(crowd.lock().all.len(), 32);
        assert!(!crowd.lock().all.contains_key(&places[31].id), "the one that asked for nothing");
        let asks = newest.ask();
        assert!(crowd.enter(address(1), start).is_none(), "everybody of this address asks");
        assert!(crowd.enter(address(2), start).is_some(), "another address has room");
        drop((asks, asking));
        assert!(crowd.enter(address(1), start).is_some());
    }

    #[test]
    fn one_address_does_not_take_all_streams_nor_streams_all_connections() {
        let (crowd, start) = (Crowd::new(true), Instant::now());
        let mut kept = Vec::new();
        for number in 1..=5 {
            for stream in 0..10 {
                let place = crowd.enter(address(number), start).unwrap();
                let asking = place.ask();
                assert_eq!(asking.may_stream(), stream < 8 && number < 5, "{number} {stream}");
                if stream < 8 {
                    kept.push((asking, place));
                }
            }
        }
    }
}
