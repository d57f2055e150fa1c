//! The schedule of a line: which request is sent next. Pure: time is an argument.
//!
//! Classes by rank, and inside a class a round-robin of slaves with deadlines inside each round:
//! - A **higher class** goes first. A Stop is never overtaken, and while one [holds the line](Readiness::holds_line), even
//!   for its slave's pause, nothing else starts.
//! - **Inside a class** requests go in rounds. Each slave has one request in a round, so that the second of one waits until
//!   every other slave has had its first, whatever their deadlines are; one that has not asked for a while begins in the
//!   present round and has saved nothing up. Inside a round the earliest deadline goes first. What expires unsent has not had
//!   its turn, so that a line that is too slow for what is asked of it still asks every slave as often as every other.
//! - **Aging**: whatever has waited for [`Rules::aging`] may take every fourth turn, but never a Stop's. A keep-alive ages
//!   ten times as fast and goes first among what has aged: behind a stream of commands its drive would trip.
//! - **One slave's Commands** go ahead of what others wait for sixteen times; from then on Status and KeepAlive have every second
//!   turn, until it has had no Command for a second.
//! - **Background** gets every twentieth turn when it would otherwise get none.
//! - What is not yet sent may be **replaced** by a later request with the same key, **expires** at its lifetime, and may
//!   be **withdrawn**.
//! - A slave that needs a pause does not hold up the others, except that nothing longer than the pause starts in front
//!   of a Command.

mod share;
mod waiting;

use std::{cmp::Reverse, collections::BTreeMap, time::Duration};

use drive_core::{Class, Terms};
use tokio::time::Instant;

use share::Shares;
use waiting::Waiting;

/// At most every so-many-th turn goes to what has aged: a stream of commands keeps three quarters of the line.
const AGED_TURN: u32 = 4;

/// A keep-alive ages so many times as fast as anything else: after 0.1 s, where the watchdogs of these drives have
/// seconds as delivered.
const KEEP_ALIVE_AGING: u32 = 10;

/// At least every so-many-th turn goes to Background while some waits: 5 %.
const BACKGROUND_TURN: u32 = 20;

/// Names one queued request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(u64);

/// What the schedule may be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// How many requests may wait. Stops may take as many places again.
    pub limit: usize,
    /// How long a request waits before it counts as aged.
    pub aging: Duration,
}

/// One queued request.
#[derive(Debug)]
pub struct Entry<T> {
    /// Its name.
    pub ticket: Ticket,
    /// For whom.
    pub slave: u8,
    /// Its terms.
    pub terms: Terms,
    /// When it came.
    pub arrived: Instant,
    /// What is to be done.
    pub work: T,
    /// Its place inside its class: the round, then the deadline, then the order of arrival.
    rank: (u64, Instant, Ticket),
}

impl<T> Entry<T> {
    /// When it must not be sent any more.
    #[must_use]
    pub fn expires(&self) -> Option<Instant> {
        self.terms.lifetime.and_then(|lifetime| self.arrived.checked_add(lifetime))
    }
}

/// When an entry could be sent, as its slave's pauses want it, and how long its exchange will take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Readiness {
    /// Not before this.
    pub at: Instant,
    /// Expected length of the exchange.
    pub takes: Duration,
    /// Whether nothing else starts while it waits. Only a Stop holds a line.
    pub holds_line: bool,
}

/// What to do next.
#[derive(Debug)]
pub enum Chosen<T> {
    /// Send this.
    Send(Entry<T>),
    /// Choose again at this time, or when something arrives.
    Wait(Instant),
    /// Nothing waits.
    Idle,
}

/// What is best.
enum Best {
    Now(usize),
    At(Instant),
}

/// The queue of one line.
#[derive(Debug)]
pub struct Schedule<T> {
    rules: Rules,
    queued: Vec<Entry<T>>,
    next_ticket: u64,
    /// The round that each slave's last request got, by class.
    last_rounds: BTreeMap<(Class, u8), u64>,
    /// The round that each class is in.
    round: BTreeMap<Class, u64>,
    since_aged: u32,
    since_background: u32,
    shares: Shares,
    /// Of each queued entry that was asked for it, while choosing.
    readiness: Vec<Option<Readiness>>,
}

impl<T> Schedule<T> {
    /// An empty queue.
    #[must_use]
    pub const fn new(rules: Rules) -> Self {
        Self {
            rules,
            queued: Vec::new(),
            next_ticket: 0,
            last_rounds: BTreeMap::new(),
            round: BTreeMap::new(),
            since_aged: 0,
            since_background: 0,
            shares: Shares::new(),
            readiness: Vec::new(),
        }
    }

    /// How many wait.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.queued.len()
    }

    /// Whether nothing waits.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.queued.is_empty()
    }

    /// Whether anything waits that `which` names.
    #[must_use]
    pub fn any(&self, which: impl FnMut(&Entry<T>) -> bool) -> bool {
        self.queued.iter().any(which)
    }

    /// Since when a Stop waits, if one does for which `since` tells it.
    #[must_use]
    pub fn first_stop(&self, since: impl Fn(&Entry<T>) -> Option<Instant>) -> Option<Instant> {
        self.queued.iter().filter(|entry| entry.terms.class == Class::Stop).filter_map(since).min()
    }

    /// What has waited longest of what `which` names.
    pub fn find(&mut self, which: impl Fn(&Entry<T>) -> bool) -> Option<&mut Entry<T>> {
        self.queued.iter_mut().filter(|entry| which(entry)).min_by_key(|entry| entry.arrived)
    }

    /// Queues a request. Gives its ticket and what it replaces: everything that waits for the same slave with the same
    /// key, except that nothing less urgent takes the place of a Stop or of any higher class.
    ///
    /// # Errors
    /// The work back, when too many wait already.
    pub fn push(
        &mut self,
        now: Instant,
        slave: u8,
        terms: Terms,
        work: T,
    ) -> Result<(Ticket, Vec<Entry<T>>), T> {
        let replaced = if terms.replaces.is_some() {
            self.withdraw_all(|entry| {
                entry.slave == slave
                    && entry.terms.replaces == terms.replaces
                    && entry.terms.class <= terms.class
            })
        } else {
            Vec::new()
        };
        let limit =
            if terms.class == Class::Stop { self.rules.limit.saturating_mul(2) } else { self.rules.limit };
        if replaced.is_empty() && self.queued.len() >= limit {
            return Err(work);
        }
        let ticket = Ticket(self.next_ticket);
        self.next_ticket += 1;
        // The successor takes the place in the queue, or a stream of setpoints would never be sent.
        let rank = match replaced.iter().find(|old| old.terms.class == terms.class) {
            Some(old) => old.rank,
            None => self.rank(now, slave, terms, ticket),
        };
        self.queued.push(Entry { ticket, slave, terms, arrived: now, work, rank });
        Ok((ticket, replaced))
    }

    fn rank(&mut self, now: Instant, slave: u8, terms: Terms, ticket: Ticket) -> (u64, Instant, Ticket) {
        let current = self.round.get(&terms.class).copied().unwrap_or_default();
        let round = match self.last_rounds.get(&(terms.class, slave)) {
            Some(last) => current.max(last + 1),
            None => current,
        };
        self.last_rounds.insert((terms.class, slave), round);
        let deadline = terms.lifetime.unwrap_or(match terms.class {
            Class::Stop => Duration::ZERO,
            Class::Command | Class::KeepAlive | Class::Status => Duration::from_secs(1),
            Class::Background => Duration::from_secs(10),
        });
        (round, now.checked_add(deadline).unwrap_or(now), ticket)
    }

    /// Puts back what [`choose`](Self::choose) gave and was not sent after all, at its old place.
    pub fn put_back(&mut self, entry: Entry<T>) {
        self.queued.push(entry);
    }

    /// Queues once more what was sent in vain: behind the first attempts of the other slaves in its class, so that one
    /// that is dead delays nobody's stop by being asked twice.
    pub fn queue_again(&mut self, mut entry: Entry<T>) {
        entry.rank = self.rank(entry.arrived, entry.slave, entry.terms, entry.ticket);
        self.queued.push(entry);
    }

    /// Takes one request out.
    pub fn withdraw(&mut self, ticket: Ticket) -> Option<Entry<T>> {
        let index = self.queued.iter().position(|entry| entry.ticket == ticket)?;
        Some(self.queued.swap_remove(index))
    }

    /// Takes out everything that `which` names.
    pub fn withdraw_all(&mut self, mut which: impl FnMut(&Entry<T>) -> bool) -> Vec<Entry<T>> {
        self.queued.extract_if(.., |entry| which(entry)).collect()
    }

    /// Takes out what has outlived its lifetime. It has not had its turn: the next of that slave has it.
    pub fn expired(&mut self, now: Instant) -> Vec<Entry<T>> {
        let expired = self.withdraw_all(|entry| entry.expires().is_some_and(|expires| expires <= now));
        for entry in &expired {
            let key = (entry.terms.class, entry.slave);
            if self.last_rounds.get(&key) == Some(&entry.rank.0) {
                match entry.rank.0.checked_sub(1) {
                    Some(before) => self.last_rounds.insert(key, before),
                    None => self.last_rounds.remove(&key),
                };
            }
        }
        expired
    }

    /// When the next request expires.
    #[must_use]
    pub fn next_expiry(&self) -> Option<Instant> {
        self.queued.iter().filter_map(Entry::expires).min()
    }

    /// Chooses what is sent next at `now`; `readiness` says when each entry could be. It is asked at most once of each, and only of
    /// those whose turn it would be.
    pub fn choose(&mut self, now: Instant, readiness: impl FnMut(&Entry<T>) -> Readiness) -> Chosen<T> {
        let mut waiting = Waiting::new(&self.queued, std::mem::take(&mut self.readiness), readiness);
        let best = self.best(now, &mut waiting);
        self.readiness = waiting.end();
        match best {
            Some(Best::Now(index)) => {
                self.count_turn(now, index);
                let entry = self.queued.swap_remove(index);
                let round = self.round.entry(entry.terms.class).or_default();
                *round = (*round).max(entry.rank.0);
                Chosen::Send(entry)
            }
            Some(Best::At(at)) => Chosen::Wait(at),
            None => Chosen::Idle,
        }
    }

    fn best(
        &self,
        now: Instant,
        waiting: &mut Waiting<'_, T, impl FnMut(&Entry<T>) -> Readiness>,
    ) -> Option<Best> {
        // One caller who asks for one thing after another: nothing to choose from.
        if let [_] = self.queued.as_slice() {
            let at = waiting.of(0)?.at;
            return Some(if at <= now { Best::Now(0) } else { Best::At(at) });
        }
        let of = |class: Class| move |entry: &Entry<T>| (entry.terms.class == class).then_some(entry.rank);
        if let Some(stop) = crate::mutant!("stop-waits-its-turn", waiting.first(now, of(Class::Stop)), None) {
            return Some(Best::Now(stop));
        }
        let held = waiting.soonest(|entry| entry.terms.class == Class::Stop, |stop| stop.holds_line);
        if let Some(at) = held {
            return Some(Best::At(at));
        }
        // In front of what has aged, which has its turn behind it: the other way round the twentieth turn would be the twenty-first.
        if self.since_background + 1 >= BACKGROUND_TURN
            && let Some(background) = waiting.first(now, of(Class::Background))
        {
            return Some(Best::Now(background));
        }
        if self.since_aged + 1 >= AGED_TURN
            && let Some(aged) = waiting.first(now, |entry| {
                let order = (entry.terms.class != Class::KeepAlive, entry.arrived, entry.ticket);
                self.has_aged(now, entry).then_some(order)
            })
        {
            return Some(Best::Now(aged));
        }
        let best = waiting.first(now, |entry| {
            let class = crate::mutant!(
                "stop-waits-its-turn",
                entry.terms.class,
                entry.terms.class.min(Class::Command)
            );
            Some((Reverse(class), entry.rank))
        });
        let Some(index) = best else {
            return waiting.soonest(|_| true, |_| true).map(Best::At);
        };
        let first = self.queued.get(index)?;
        if first.terms.class == Class::Command
            && self.shares.gives_way(now, first.slave)
            && let Some(other) = waiting.first(now, |entry| {
                asks_for_another(first.slave, entry).then_some((Reverse(entry.terms.class), entry.rank))
            })
        {
            return Some(Best::Now(other));
        }
        // What would still be on the line when a Command's pause is over does not start in front of it.
        let over_at = now + waiting.of(index)?.takes;
        if first.terms.class < Class::Command
            && let Some(at) = waiting.soonest(|entry| entry.terms.class == Class::Command, |_| true)
            && at < over_at
        {
            return Some(Best::At(at));
        }
        Some(Best::Now(index))
    }

    fn has_aged(&self, now: Instant, entry: &Entry<T>) -> bool {
        let aging = match entry.terms.class {
            Class::KeepAlive => self.rules.aging / KEEP_ALIVE_AGING,
            _ => self.rules.aging,
        };
        now.saturating_duration_since(entry.arrived) >= aging
    }

    fn count_turn(&mut self, now: Instant, chosen: usize) {
        let Some(entry) = self.queued.get(chosen) else { return };
        let class = entry.terms.class;
        let count =
            |others: bool, mine: bool, since: u32| if mine || !others { 0 } else { since.saturating_add(1) };
        let aged = self.has_aged(now, entry) && class < Class::Stop;
        let aged_waits = self.queued.iter().enumerate().any(|(index, entry)| {
            index != chosen && entry.terms.class < Class::Stop && self.has_aged(now, entry)
        });
        let background_waits = self
            .queued
            .iter()
            .enumerate()
            .any(|(index, entry)| index != chosen && entry.terms.class == Class::Background);
        self.since_aged = count(aged_waits, aged, self.since_aged);
        self.since_background = count(background_waits, class == Class::Background, self.since_background);
        let slave = entry.slave;
        // Asked of a Command alone: nothing else takes of its slave's share.
        let others_wait =
            class == Class::Command && self.queued.iter().any(|entry| asks_for_another(slave, entry));
        self.shares.count(now, class, slave, others_wait);
    }
}

/// Whether it asks what keeps another slave known and its watchdog fed.
fn asks_for_another<T>(slave: u8, entry: &Entry<T>) -> bool {
    entry.slave != slave && matches!(entry.terms.class, Class::Status | Class::KeepAlive)
}

#[cfg(test)]
mod tests;
