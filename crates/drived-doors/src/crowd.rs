//! How many may be connected at once. Whoever comes when there is no room takes the place of one that has not asked whole: of the
//! address that has most of them the one that has waited the longest. Nobody who says nothing, or says it slowly, keeps out a stop.
//! Where all ask, there are places that are for stops alone.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, btree_map::Entry},
    net::IpAddr,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::{
    sync::{Notify, OwnedSemaphorePermit, Semaphore},
    time::Instant,
};

/// How many may come through a door.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Connections at once.
    pub connections: usize,
    /// Connections of one address.
    pub per_address: usize,
    /// Connections besides, when all others ask.
    pub for_stops: usize,
    /// Who has said nothing for so long makes room. Who has never said anything makes room at once for an address that has fewer
    /// connections than his.
    pub silent_for: Duration,
    /// So many that have to make room may be heard for a moment longer at once.
    pub moments: usize,
    /// Event streams at once: what is left of the connections is for commands.
    pub streams: usize,
    /// Event streams of one address.
    pub streams_per_address: usize,
}

impl Limits {
    /// On the control socket, where nobody has an address.
    pub(super) const SOCKET: Self = Self {
        connections: 64,
        per_address: 64,
        for_stops: 16,
        silent_for: Duration::ZERO,
        moments: 512,
        streams: 32,
        streams_per_address: 32,
    };
    pub(super) const HTTP: Self = Self { per_address: 32, streams_per_address: 8, ..Self::SOCKET };

    /// At a gateway with so many clients: one that asks every second or so is not put out for others.
    pub const fn of_gateway(clients: usize) -> Self {
        let silent_for = Duration::from_secs(2);
        Self { connections: clients, per_address: clients, for_stops: 8, silent_for, ..Self::SOCKET }
    }
}

/// The connections of one door; a cheap handle.
#[derive(Debug, Clone)]
pub struct Crowd {
    members: Arc<Mutex<Members>>,
    moments: Arc<Semaphore>,
    limits: Limits,
}

#[derive(Debug, Default)]
struct Members {
    next: u64,
    all: BTreeMap<u64, Member>,
    /// How many each address has. Counted on, and not anew for each who comes: whoever comes again and again as fast as he can has to
    /// cost next to nothing.
    of: BTreeMap<Option<IpAddr>, usize>,
}

impl Members {
    /// How many connections an address has.
    fn of(&self, address: Option<IpAddr>) -> usize {
        self.of.get(&address).copied().unwrap_or_default()
    }

    fn insert(&mut self, member: Member) -> u64 {
        let id = self.next;
        self.next += 1;
        *self.of.entry(member.address).or_default() += 1;
        self.all.insert(id, member);
        id
    }

    fn remove(&mut self, id: u64) -> Option<Member> {
        let member = self.all.remove(&id)?;
        if let Entry::Occupied(mut count) = self.of.entry(member.address) {
            *count.get_mut() -= 1;
            if *count.get() == 0 {
                count.remove();
            }
        }
        Some(member)
    }
}

#[derive(Debug)]
struct Member {
    address: Option<IpAddr>,
    /// Since when it has not asked for anything, or not to the end of what it asks.
    waits_since: Instant,
    /// It has said something.
    heard: bool,
    is_for_stops: bool,
    streams: bool,
    shared: Arc<Shared>,
}

/// What a connection and its requests know of each other.
#[derive(Debug, Default)]
struct Shared {
    leave: Notify,
    /// The head of a request has come, and its answer has not gone.
    is_under_way: AtomicBool,
    /// How many heads have come.
    heads: AtomicU64,
    /// It has come whole.
    asks: AtomicBool,
}

impl Member {
    fn asks(&self) -> bool {
        self.shared.asks.load(Ordering::Relaxed)
    }
}

impl Crowd {
    pub fn new(limits: Limits) -> Self {
        Self { members: Arc::default(), moments: Arc::new(Semaphore::new(limits.moments)), limits }
    }

    /// A place for a connection, if there is room or somebody to make room.
    pub fn enter(&self, address: Option<IpAddr>, now: Instant) -> Option<Place> {
        let mut members = self.lock();
        let has = members.of(address);
        let its_own = address.is_some() && has >= self.limits.per_address;
        let mut is_for_stops = false;
        if its_own || members.all.len() >= self.limits.connections {
            let may_go = members.all.iter().filter(|(_, member)| !its_own || member.address == address);
            let is_silent = |since| now.saturating_duration_since(since) >= self.limits.silent_for;
            let crowds = |member: &Member| !member.heard && members.of(member.address) > has + 1;
            let waiting = may_go
                .filter(|(_, member)| !member.asks() && (is_silent(member.waits_since) || crowds(member)));
            let first = waiting.max_by_key(|(id, member)| {
                let longest = Reverse((member.waits_since, **id));
                (!member.is_for_stops, members.of(member.address), longest)
            });
            match first.map(|(id, _)| *id) {
                Some(first) => {
                    let member = members.remove(first);
                    // A place of those that are for stops goes to the next one as what it is.
                    is_for_stops = member.as_ref().is_some_and(|member| member.is_for_stops);
                    if let Some(member) = member {
                        member.shared.leave.notify_one();
                    }
                }
                None => {
                    let taken = members.all.values().filter(|member| member.is_for_stops).count();
                    if taken >= self.limits.for_stops {
                        return None;
                    }
                    is_for_stops = true;
                }
            }
        }
        let shared = Arc::<Shared>::default();
        let member = Member {
            address,
            waits_since: now,
            heard: false,
            is_for_stops,
            streams: false,
            shared: Arc::clone(&shared),
        };
        let id = members.insert(member);
        drop(members);
        Some(Place { crowd: self.clone(), id, shared })
    }

    fn is_for_stops(&self, id: u64) -> bool {
        self.lock().all.get(&id).is_some_and(|member| member.is_for_stops)
    }

    fn lock(&self) -> MutexGuard<'_, Members> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The place of one connection; it is free again when dropped.
#[derive(Debug)]
pub struct Place {
    crowd: Crowd,
    id: u64,
    shared: Arc<Shared>,
}

impl Place {
    /// Waits until somebody else needs the place. Safe to drop.
    pub async fn wanted(&self) {
        self.shared.leave.notified().await;
    }

    /// For whoever has to make room: a moment in which what he has sent is still heard, as long as not too many have one.
    pub(super) fn moment(&self) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.crowd.moments).try_acquire_owned().ok()
    }

    /// Whether it is for stops alone.
    pub fn is_for_stops(&self) -> bool {
        self.crowd.is_for_stops(self.id)
    }

    /// Whether a request has come whole and is not answered.
    pub(super) fn asks(&self) -> bool {
        self.shared.asks.load(Ordering::Relaxed)
    }

    /// Whether a request has begun whose answer has not gone.
    pub(super) fn is_under_way(&self) -> bool {
        self.shared.is_under_way.load(Ordering::Relaxed)
    }

    /// How many requests have begun.
    pub(super) fn heads(&self) -> u64 {
        self.shared.heads.load(Ordering::Relaxed)
    }

    /// The head of a request has come; what this gives is dropped when its answer has gone.
    pub(super) fn ask(&self) -> Asking {
        self.shared.is_under_way.store(true, Ordering::Relaxed);
        self.shared.heads.fetch_add(1, Ordering::Relaxed);
        self.hear(Instant::now());
        Asking { crowd: self.crowd.clone(), id: self.id, shared: Arc::clone(&self.shared) }
    }

    /// Something has come from it.
    pub fn hear(&self, now: Instant) {
        if let Some(member) = self.crowd.lock().all.get_mut(&self.id) {
            member.waits_since = now;
            member.heard = true;
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.crowd.lock().remove(self.id);
    }
}

/// A request that is not answered whole yet.
#[derive(Debug)]
pub(super) struct Asking {
    crowd: Crowd,
    id: u64,
    shared: Arc<Shared>,
}

impl Asking {
    /// The request has come whole: its connection makes room for nobody until it is answered.
    pub(super) fn is_whole(&self) {
        self.shared.asks.store(true, Ordering::Relaxed);
    }

    /// Whether its place is for stops alone.
    pub(super) fn is_for_stops(&self) -> bool {
        self.crowd.is_for_stops(self.id)
    }

    /// Whether its answer may be an event stream, or there are too many.
    pub(super) fn may_stream(&self) -> bool {
        let mut members = self.crowd.lock();
        let Some(address) = members.all.get(&self.id).map(|member| member.address) else { return false };
        let limits = self.crowd.limits;
        let streams = || members.all.values().filter(|member| member.streams);
        let of_it = streams().filter(|member| member.address == address).count();
        let too_many = streams().count() >= limits.streams || of_it >= limits.streams_per_address;
        if let Some(member) = members.all.get_mut(&self.id).filter(|_| !too_many) {
            member.streams = true;
        }
        !too_many
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        self.shared.asks.store(false, Ordering::Relaxed);
        self.shared.is_under_way.store(false, Ordering::Relaxed);
        if let Some(member) = self.crowd.lock().all.get_mut(&self.id) {
            member.waits_since = Instant::now();
            member.streams = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(number: u8) -> Option<IpAddr> {
        Some(IpAddr::from([10, 0, 0, number]))
    }

    fn asking(place: &Place) -> Asking {
        let asking = place.ask();
        asking.is_whole();
        asking
    }

    #[test]
    fn an_idle_connection_makes_room_and_one_that_asks_does_not() {
        let (crowd, start) = (Crowd::new(Limits::HTTP), Instant::now());
        let places: Vec<Place> = (0..32)
            .map(|number| crowd.enter(address(1), start + Duration::from_secs(number)).unwrap())
            .collect();
        let all: Vec<Asking> = places.iter().take(31).map(asking).collect();
        let newest = crowd.enter(address(1), start).unwrap();
        assert_eq!(crowd.lock().all.len(), 32);
        assert!(!crowd.lock().all.contains_key(&places[31].id), "the one that asked for nothing");
        let asks = asking(&newest);
        let for_stops = crowd.enter(address(1), start).unwrap();
        assert!(for_stops.ask().is_for_stops(), "everybody of this address asks");
        let other = crowd.enter(address(2), start).unwrap();
        assert!(!other.ask().is_for_stops(), "another address has room");
        drop((asks, all));
        assert!(!crowd.enter(address(1), start).unwrap().ask().is_for_stops());
    }

    #[test]
    fn who_asks_slowly_makes_room_for_others_before_them_and_the_places_for_stops_have_an_end() {
        let (crowd, start) = (Crowd::new(Limits::HTTP), Instant::now());
        let alone = crowd.enter(address(9), start).unwrap();
        let slow: Vec<(Place, Asking)> = (0..63)
            .map(|number| {
                let place = crowd.enter(address(1 + number / 32), start).unwrap();
                let asking = place.ask();
                (place, asking)
            })
            .collect();
        let newest = crowd.enter(address(8), start).unwrap();
        assert!(crowd.lock().all.contains_key(&alone.id), "it is the only one of its address");
        assert!(!crowd.lock().all.contains_key(&slow[0].0.id));
        slow.iter().for_each(|(_, asking)| asking.is_whole());
        let (alone, newest) = (asking(&alone), asking(&newest));
        let stops: Vec<(Place, Asking)> = (0..16)
            .map(|number| {
                let place = crowd.enter(address(100 + number), start).unwrap();
                let asking = asking(&place);
                assert!(asking.is_for_stops());
                (place, asking)
            })
            .collect();
        assert!(crowd.enter(address(7), start).is_none());
        drop((alone, newest, stops));
    }

    #[test]
    fn clients_of_a_gateway_that_ask_nothing_make_room_and_those_that_ask_do_not() {
        let (crowd, start) = (Crowd::new(Limits::of_gateway(16)), Instant::now());
        let second = Duration::from_secs(1);
        let idle: Vec<Place> = (0..16).map(|number| crowd.enter(address(number), start).unwrap()).collect();
        let is_for_stops = |number, now| crowd.enter(address(number), now).unwrap().is_for_stops();
        assert!(is_for_stops(100, start + second), "they have just come");
        idle.iter().take(15).for_each(|place| place.hear(start + 9 * second));
        let scada = crowd.enter(address(100), start + 10 * second).unwrap();
        assert!(!scada.is_for_stops());
        assert!(!crowd.lock().all.contains_key(&idle[15].id), "the one that has asked nothing");
        assert!(is_for_stops(101, start + 10 * second));
        drop(scada);
        assert!(!is_for_stops(101, start + 10 * second));
    }

    #[test]
    fn one_address_that_comes_again_and_again_and_says_nothing_keeps_no_other_out_of_a_gateway() {
        let (crowd, start) = (Crowd::new(Limits::of_gateway(16)), Instant::now());
        let mut held: Vec<Place> = (0..16).map(|_| crowd.enter(address(1), start).unwrap()).collect();
        let scada = crowd.enter(address(2), start).expect("sixteen of one address have said nothing");
        assert!(!scada.is_for_stops());
        assert_eq!(crowd.lock().all.len(), 16);
        // Nor does he get its place back before it has asked.
        assert!(crowd.enter(address(1), start).unwrap().is_for_stops());
        assert!(crowd.lock().all.contains_key(&scada.id));
        // Those that ask stay, whatever address they are of.
        held.iter().for_each(|place| place.hear(start));
        assert!(crowd.enter(address(3), start).unwrap().is_for_stops());
        held.clear();
    }

    #[test]
    fn one_address_does_not_take_all_streams_nor_streams_all_connections() {
        let (crowd, start) = (Crowd::new(Limits::HTTP), Instant::now());
        let mut kept = Vec::new();
        for number in 1..=5 {
            for stream in 0..10 {
                let place = crowd.enter(address(number), start).unwrap();
                let asking = asking(&place);
                assert_eq!(asking.may_stream(), stream < 8 && number < 5, "{number} {stream}");
                if stream < 8 {
                    kept.push((asking, place));
                }
            }
        }
    }
}
