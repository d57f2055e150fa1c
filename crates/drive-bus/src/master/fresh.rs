//! A port that was opened again: what the last one has left behind is nobody's answer.
//!
//! Serial servers and adapters keep bytes, and give them to whoever comes next: as soon as he comes, or with the first thing
//! that he asks. So a port is **listened to** first, then asked **one question whose answer is thrown away**, and listened to
//! once more. A stop waits for none of that: it is that question, and is not confirmed by what comes first. For as long as
//! anything late may come, what was answered last over the last port counts as owed.
//!
//! And a port is opened again **when all that should answer are mute**: a connection or an adapter can hang without an error.

use std::{collections::VecDeque, time::Duration};

use tokio::time::Instant;

use super::{Master, port::PortState};
use crate::{config::DOUBLE, shape::Shape, stats::NOTHING_HEARD};

/// How long a port that was opened again is listened to: a server that has kept something gives it in a round trip.
const LISTEN: Duration = Duration::from_millis(100);

/// Whoever babbles is not listened to for longer.
const LONGEST_LISTEN: Duration = Duration::from_secs(1);

/// How many answers are kept that may come again: more than servers were seen to keep.
const LAST: usize = 8;

/// How long all are mute before the port is opened again: longer than the three attempts that a call makes, and than most
/// gateways wait for a dead drive.
const MUTE: Duration = Duration::from_secs(4);

/// And at the most, when that was in vain.
const LONGEST_MUTE: Duration = Duration::from_secs(60);

/// What is kept of the ports.
#[derive(Debug, Default)]
pub(super) struct Fresh {
    opened: Option<Opened>,
    /// The answers that came last: whose, and of what shape.
    last: VecDeque<(u8, Shape)>,
    /// Whether the port can be opened again.
    pub(super) reopens: bool,
    /// When anything was heard last, or the port was opened.
    heard: Option<Instant>,
    /// When the first of what was asked since then was in vain.
    in_vain: Option<Instant>,
    /// How often in a row the port was opened again for that.
    reopened: u32,
    /// The port is known to be mute.
    pub(super) is_mute: bool,
    /// It was left for that, and not ended by its far end.
    pub(super) was_left: bool,
}

/// A port that was opened again.
#[derive(Debug, Clone, Copy)]
struct Opened {
    since: Instant,
    listen: Duration,
    /// The question whose answer is thrown away was asked.
    asked: bool,
}

/// What a port that was opened again wants first.
pub(super) enum First {
    /// Nothing.
    Nothing,
    /// To be listened to until then.
    Listen(Instant),
    /// That this slave is asked something.
    Ask(u8),
}

impl Fresh {
    pub(super) fn answered(&mut self, slave: u8, shape: Shape) {
        self.last.retain(|last| *last != (slave, shape));
        if self.last.len() >= LAST {
            self.last.pop_front();
        }
        self.last.push_back((slave, shape));
    }

    /// Something was heard.
    pub(super) fn heard(&mut self, now: Instant) {
        self.heard = Some(now);
        self.in_vain = None;
        self.reopened = 0;
    }

    /// When anything was heard last, or the port was opened.
    pub(super) const fn last_heard(&self) -> Option<Instant> {
        self.heard
    }

    /// A question to somebody who has answered before was in vain.
    pub(super) fn in_vain(&mut self, now: Instant) {
        self.in_vain.get_or_insert(now);
    }

    /// Something is sent: the first thing over a port is that question.
    pub(super) fn is_first(&mut self) -> bool {
        self.opened.as_mut().is_some_and(|opened| !std::mem::replace(&mut opened.asked, true))
    }
}

impl<C> Master<C> {
    /// Whether the port can be opened again when it is mute.
    pub fn set_reopens(&mut self, reopens: bool) {
        self.fresh.reopens = reopens;
    }

    /// The port is open again.
    pub(super) fn open_again(&mut self, now: Instant) {
        self.fresh.heard = Some(now);
        self.fresh.in_vain = None;
        let lost: Vec<u8> = self.offline.slaves().collect();
        for slave in lost {
            self.offline.hope(now, slave);
        }
        if !self.exchange.confuses_late_answers() {
            return;
        }
        self.fresh.opened = Some(Opened { since: now, listen: LISTEN, asked: false });
        let until = now + self.config.late_window;
        for (slave, shape) in std::mem::take(&mut self.fresh.last) {
            self.station(slave).doubt.owe(now, shape, None, until, true);
        }
    }

    /// What goes before everything but a stop.
    pub(super) fn first(&mut self, now: Instant) -> First {
        let Some(opened) = self.fresh.opened else { return First::Nothing };
        let heard = self.heard.filter(|(_, until)| *until >= opened.since);
        let quiet = heard.map_or(opened.since, |(_, until)| until + DOUBLE);
        let until = (opened.since + opened.listen).max(quiet).min(opened.since + LONGEST_LISTEN);
        if now < until {
            return First::Listen(until);
        }
        let asks = self.stations.iter().filter(|(slave, station)| {
            **slave != 0 && station.timeout.is_learned() && station.doubt.over().is_some()
        });
        let whom = asks.map(|(slave, _)| *slave).min_by_key(|slave| self.offline.contains(*slave));
        match whom.filter(|_| !opened.asked && self.far_end.gate(false).is_none()) {
            Some(slave) => First::Ask(slave),
            None => {
                self.fresh.opened = None;
                First::Nothing
            }
        }
    }

    /// The question whose answer is thrown away is over.
    pub(super) fn thrown_away(&mut self, now: Instant) {
        self.fresh.opened = Some(Opened { since: now, listen: DOUBLE, asked: true });
    }

    /// Why the port is to be closed and opened again, if it is.
    pub fn poll_mute(&mut self, now: Instant) -> Option<String> {
        let mute = now.saturating_duration_since(self.fresh.heard?);
        if !std::mem::take(&mut self.fresh.is_mute) && self.mute_at().is_none_or(|at| at > now) {
            return None;
        }
        self.fresh.was_left = true;
        self.mute_beside_second(now);
        self.fresh.heard = Some(now);
        self.fresh.in_vain = None;
        self.fresh.reopened = self.fresh.reopened.saturating_add(1);
        Some(format!("{NOTHING_HEARD} for {:.1} s, whoever was asked", mute.as_secs_f64()))
    }

    /// When the port counts as mute, unless something is heard.
    pub(super) fn mute_at(&self) -> Option<Instant> {
        let fresh = &self.fresh;
        if !fresh.reopens || !matches!(self.port, PortState::Open) || self.config.offline_after == 0 {
            return None;
        }
        fresh.in_vain?;
        let heard = fresh.heard?;
        let asked = |station: &super::Station| station.timeout.is_learned() && station.was_asked_since(heard);
        let answers = |slave: &u8| self.stations.get(slave).is_some_and(|station| station.is_answering());
        let all_failed = self
            .stations
            .iter()
            .filter(|(slave, station)| **slave != 0 && asked(station))
            .all(|(slave, _)| !answers(slave) || self.offline.contains(*slave));
        // Or its far end is there, and answers over another connection.
        let is_elsewhere = self.second.heard.is_some_and(|at| at > heard);
        (all_failed || is_elsewhere).then(|| heard + self.mute_for())
    }

    /// How long all are mute before the port is opened again.
    fn mute_for(&self) -> Duration {
        let slowest = self.stations.values().map(|station| station.timeout.ceiling()).max();
        let calls = slowest.unwrap_or_default() * (self.config.retries + 1);
        let gateway = self.far_end.wait() * 5 / 4 + self.config.response_timeout / 2;
        let mute = MUTE.max(calls).max(gateway);
        (mute * (1 << self.fresh.reopened.min(8))).min(LONGEST_MUTE.max(mute))
    }
}
