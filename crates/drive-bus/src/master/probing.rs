//! Which of the slaves that do not answer is asked next, for how long, and how much of the line that may take.
//!
//! A slave that may not be there is asked a **short question**: twice as long as it has needed so far, or, when it has
//! never answered, as the slowest of the others has. Now and then a question is long, for a slave that is slower than
//! that. Questions in vain take from 2 to 10 % of the line, the more the more slaves are lost; on an idle line they are
//! free. Where one comes back its neighbours are asked next: power comes back by the cabinet.

use std::{sync::Arc, time::Duration};

use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{AGING, Master, Purpose, offline::Offline};

/// What short questions in vain may take of a line that is needed, in thousandths: when as few or as many are lost. With
/// the long ones it is 2 %, what the sweep of the living may be longer with 3 of 31 dead, and up to 10 %, with which 20 are
/// back within 5 s (`tests/coming_back.rs`).
const FEW: (usize, u32) = (3, 14);
const MANY: (usize, u32) = (20, 90);

/// What long questions may take, in thousandths: a part of these 2 %, enough for one of 500 ms in 100 s.
const LONG: u32 = 5;

/// With more lost than this, long questions are only so many times as long as short ones: the living feel a single one.
const FEW_ENOUGH: usize = 10;
const LONGER: u32 = 4;

/// For each answered probe's time on the line, so many times as long no other: a cabinet of twenty is back in two seconds.
const FOUND_REST: u32 = 4;

/// A line on which nobody has asked for anything for so long is idle: longer than the usual period of a status.
const IDLE: Duration = Duration::from_secs(1);

/// What is kept of the probes.
#[derive(Debug, Default)]
pub(super) struct Probing {
    /// No probe before this on a line that is needed.
    free_at: Option<Instant>,
    /// No long question before this on a line that is needed.
    long_at: Option<Instant>,
    /// Those that are asked before the others: their neighbours are back.
    first: Vec<u8>,
}

impl Probing {
    /// Begins the probe of a slave. True: the question is long.
    fn begin(&mut self, now: Instant, slave: u8, idle: bool, longest: Duration) -> bool {
        self.first.retain(|first| *first != slave);
        let long = self.long_at.is_none_or(|at| at <= now || idle);
        if long {
            self.long_at = Some(now + rest(longest, LONG));
        }
        long
    }

    /// A probe is over and has taken so much of the line.
    pub(super) fn ended(&mut self, now: Instant, took: Duration, answered: bool, long: bool, lost: usize) {
        let pause = if answered { took * FOUND_REST } else { rest(took, share(lost)) };
        if answered || !long {
            self.free_at = Some(now + pause);
        }
    }

    /// A slave is back: the next that are lost on both sides of it are asked first.
    fn is_back(&mut self, slave: u8, lost: &Offline) -> impl Iterator<Item = u8> + use<> {
        let neighbours = lost.neighbours(slave);
        for neighbour in neighbours.into_iter().flatten() {
            self.first.retain(|first| *first != neighbour);
            self.first.insert(0, neighbour);
        }
        neighbours.into_iter().flatten()
    }
}

/// What short questions may take of the line, in thousandths, when so many are lost.
fn share(lost: usize) -> u32 {
    let lost = lost.clamp(FEW.0, MANY.0) - FEW.0;
    FEW.1 + (MANY.1 - FEW.1) * lost as u32 / (MANY.0 - FEW.0) as u32
}

/// For how long no other follows what took so long, so that it takes so many thousandths.
fn rest(took: Duration, thousandths: u32) -> Duration {
    took * (1_000 - thousandths) / thousandths
}

impl<C> Master<C> {
    /// The next probe that is worth the line's time. What commands or feeds a watchdog goes first, for as long as
    /// anything may wait before it has aged: on a full line a drive that is back would never be noticed.
    pub(super) fn next_probe(&self, now: Instant) -> Option<(u8, Instant)> {
        let (slave, at) = self.due_probe(now)?;
        let at = self.far_end.gate(false).map_or(at, |gate| gate.max(at));
        // One that was heard late has its pause as well.
        let at =
            self.stations.get(&slave).and_then(|station| station.ready_at).map_or(at, |ready| ready.max(at));
        let urgent = self.schedule.any(|entry| entry.terms.class >= Class::KeepAlive);
        Some((slave, if urgent { at + AGING } else { at }))
    }

    fn due_probe(&self, now: Instant) -> Option<(u8, Instant)> {
        let rested =
            self.soonest(now, false).map(|(slave, at)| (slave, self.probing.free_at.unwrap_or(at).max(at)));
        // Behind a gateway that serves one question at a time no question in vain is free, as long as anybody lives.
        if !self.schedule.is_empty() || self.far_end.holds_others_up() && self.somebody_answers() {
            return rested;
        }
        // Nobody has asked for anything for a while: what probes take is taken from nobody.
        let idle_from = self.called_at.map(|called| called + IDLE);
        let idle = self.soonest(now, true).map(|(slave, at)| (slave, idle_from.unwrap_or(at).max(at)));
        rested.into_iter().chain(idle).min_by_key(|(_, at)| *at)
    }

    fn somebody_answers(&self) -> bool {
        self.stations
            .iter()
            .any(|(slave, station)| station.timeout.is_learned() && !self.offline.contains(*slave))
    }

    /// Whom to probe and when, if the line were his.
    fn soonest(&self, now: Instant, idle: bool) -> Option<(u8, Instant)> {
        let wanted = |slave: u8| {
            let free = !self.aside.contains_key(&slave);
            let at = self.wanted_probe_at(now, slave, idle).filter(|_| free)?;
            Some((slave, at))
        };
        let first = self.probing.first.iter().filter_map(|slave| wanted(*slave)).find(|(_, at)| *at <= now);
        first.or_else(|| self.offline.slaves().filter_map(wanted).min_by_key(|(_, at)| *at))
    }

    /// When a slave that is off-line is asked next.
    pub(super) fn probe_at(&self, slave: u8) -> Option<Instant> {
        let at = self.offline.probe_at(slave)?;
        self.stations.get(&slave)?.doubt.over().max(Some(at))
    }

    /// The same, as long as somebody cares: one that waits for its share of the line is nobody's any more when all have lost interest.
    /// On an `idle` line no probe waits longer than the first.
    fn wanted_probe_at(&self, now: Instant, slave: u8, idle: bool) -> Option<Instant> {
        let at = if idle {
            self.offline.idle_probe_at(slave, self.config.probe_backoff.0)?
        } else {
            self.offline.probe_at(slave)?
        };
        let station = self.stations.get(&slave)?;
        station.doubt.over().max(Some(at)).filter(|at| station.is_wanted(now.max(*at)))
    }

    /// How long it takes until the slave that is off-line and due at `at` is probed, as far as is known.
    pub(super) fn probe_in(&self, now: Instant, at: Instant) -> Duration {
        let under_way = self.flight.as_ref().and_then(|flight| flight.sent).map(|sent| sent.answer_by);
        let soonest = [Some(at), self.probing.free_at, under_way].into_iter().flatten().max();
        soonest.map_or(Duration::ZERO, |at| at.saturating_duration_since(now))
    }

    /// A slave that was off-line answers.
    pub(super) fn welcome(&mut self, now: Instant, slave: u8) {
        for neighbour in self.probing.is_back(slave, &self.offline) {
            self.offline.hope(now, neighbour);
        }
        tracing::debug!(slave, "slave answers again");
    }

    /// How long the answer to what is asked next may take to begin, and what kind of question that makes it.
    pub(super) fn patience(&mut self, now: Instant, slave: u8, purpose: &Purpose<C>) -> (Duration, Question) {
        if self.exchange.frees_the_line() {
            // What waits while others are served may wait as long as it was configured.
            return (self.station(slave).timeout.ceiling(), Question::Usual);
        }
        let idle = self.schedule.is_empty();
        let shown = self.stations.values().filter_map(|station| station.timeout.short()).max();
        let others_wait = self.schedule.any(|entry| entry.slave != slave);
        let floor = self.config.timeout_floor;
        let hopeless = self.config.offline_after == 0;
        let retries = self.config.retries;
        let many = self.offline.len() > FEW_ENOUGH && !idle;
        let station = self.station(slave);
        let usual = station.timeout.current();
        let known = station.wants_long();
        match purpose {
            Purpose::Probe => {
                let ceiling = station.timeout.ceiling();
                let short = station.timeout.short().or(shown).unwrap_or(ceiling).min(ceiling);
                let longest = if many && !known { ceiling.min(short * LONGER) } else { ceiling };
                let long = self.probing.begin(now, slave, idle, longest) || known;
                if long { (longest, Question::Long) } else { (short, Question::Short) }
            }
            Purpose::Call(Some(entry))
                if !(known || hopeless || entry.work.is_write || station.timeout.is_learned()) =>
            {
                match shown {
                    Some(short) => (short.min(usual), Question::Short),
                    // Those who wait behind it may be there, and show how fast answers come here.
                    None if others_wait && entry.work.attempts == 0 && retries > 0 => {
                        (floor.min(usual), Question::Usual)
                    }
                    None => (usual, Question::Usual),
                }
            }
            _ => (usual, Question::Usual),
        }
    }
}

/// The same read of one word: what is lost when nobody answers is shorter.
pub(super) fn shortest(request: Arc<Request<'static>>) -> Arc<Request<'static>> {
    match *request {
        Request::ReadHoldingRegisters(first, 2..) => Arc::new(Request::ReadHoldingRegisters(first, 1)),
        Request::ReadInputRegisters(first, 2..) => Arc::new(Request::ReadInputRegisters(first, 1)),
        _ => request,
    }
}

/// How long a question is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    /// For as long as this slave may take.
    Usual,
    /// To somebody who may not be there.
    Short,
    /// To somebody who does not answer short ones.
    Long,
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn the_share_grows_from_two_to_ten_per_cent_with_the_long_questions() {
        let shares: Vec<u32> = (0..=40).map(|lost| share(lost) + LONG).collect();
        assert!(shares.is_sorted());
        assert_eq!((shares[0], shares[3], shares[20], shares[40]), (19, 19, 95, 95));
        assert_eq!(rest(95 * MS, 95), 905 * MS);
    }

    #[test]
    fn the_neighbours_of_what_is_back_are_asked_first_the_upper_before_the_lower() {
        let mut probing = Probing::default();
        let now = Instant::now();
        let mut lost = Offline::default();
        for slave in [3, 4, 9, 12] {
            lost.insert(now, slave, MS);
        }
        assert_eq!(probing.is_back(5, &lost).collect::<Vec<_>>(), [4, 9]);
        assert_eq!(probing.first, [9, 4]);
        assert_eq!(probing.is_back(13, &lost).collect::<Vec<_>>(), [12]);
        assert_eq!(probing.first, [12, 9, 4]);
        probing.begin(now, 9, false, MS);
        assert_eq!(probing.first, [12, 4]);
    }

    #[test]
    fn a_long_question_is_rare_on_a_line_that_is_needed_and_free_on_an_idle_one() {
        let mut probing = Probing::default();
        let now = Instant::now();
        assert!(probing.begin(now, 1, false, 500 * MS));
        assert!(!probing.begin(now + 50_000 * MS, 2, false, 500 * MS));
        assert!(probing.begin(now + 50_000 * MS, 3, true, 500 * MS));
        assert!(probing.begin(now + 200_000 * MS, 4, false, 500 * MS));
    }
}
