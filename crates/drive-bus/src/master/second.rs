//! A second connection to what is at the far end, for stops.
//!
//! A gateway that waits for a dead drive serves what else its connection has asked only afterwards. Most have several clients,
//! and serve them in turn: what comes over another connection waits for one question in vain at the most, and where the
//! drives are on several lines for none. So while something is owed a second connection is open, and a stop that waits, or is
//! on its way behind what is owed, goes over it **as well**: never instead, so that it is later for nothing.
//!
//! Two connections can overtake each other. So the answer over the second one counts only where no other write to that drive
//! may still be under way over the first; otherwise the stop behind it there is the one that counts. And nothing is written to
//! a drive over the first while its stop is under way over the second.
//!
//! Some far ends grant one connection only: a second one that is ended, that gives no answer, or with which the first goes
//! mute, is given up at once.

mod going;

use std::{sync::Arc, time::Duration};

use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Flight, Master, port::PortState};
use crate::{
    config::LineConfig,
    exchange::{Frame, Machine},
    schedule::Ticket,
    stats::SecondConnection,
};

/// How long a write of which nothing is known may still be carried out, though nothing was heard of it: longer than any
/// gateway was seen to keep a question.
const UNSETTLED: Duration = Duration::from_secs(60);

/// How long one that was ended, or gave no answer, is not opened again.
const GIVEN_UP: Duration = Duration::from_secs(600);

/// How long one that has served, and was lost, is not opened again.
const REOPENED: Duration = Duration::from_secs(1);

/// Why one is given up with which the first goes mute.
const SILENCED: &str = "with it the first gave no answer any more";

/// Who has answered so long ago is there.
const JUST: Duration = Duration::from_millis(100);

/// What the task is to do with the second connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SecondPort {
    /// Open it.
    Open,
    /// Close it, with a reset.
    Close,
}

/// The second connection of a line.
pub(super) struct Second {
    allowed: bool,
    state: State,
    /// It is to be closed.
    close: bool,
    machine: Option<Box<dyn Machine>>,
    flight: Option<Going>,
    /// Who answered over it last, and what.
    taken: Option<(u8, Frame)>,
    /// When it is asked next, where a silence is to be kept before.
    free_at: Option<Instant>,
    /// Who answered over the first last, and when.
    answered: Option<(u8, Instant)>,
    /// When it has answered last.
    pub(super) heard: Option<Instant>,
    /// Writes over the first connection that may still be carried out: whose, and when they were given up.
    unsettled: Vec<(u8, Instant)>,
    /// How many stops were answered over it.
    pub(super) stops: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// It is not open, and may be from then on.
    Closed(Option<Instant>),
    Opening,
    Open {
        since: Instant,
        /// Something was answered over it.
        serves: bool,
    },
    /// It is not granted, and may be tried again then, if ever.
    GivenUp(&'static str, Option<Instant>),
}

/// What is under way over it.
struct Going {
    /// The stop; `None`: the question whether it is served.
    stop: Option<Ticket>,
    slave: u8,
    request: Arc<Request<'static>>,
    started: Instant,
    answer_by: Option<Instant>,
}

impl Second {
    pub(super) fn new(config: &LineConfig) -> Self {
        Self {
            allowed: config.takes_second_connection(),
            state: State::Closed(None),
            close: false,
            machine: None,
            flight: None,
            taken: None,
            free_at: None,
            answered: None,
            heard: None,
            unsettled: Vec::new(),
            stops: 0,
        }
    }

    /// What is known of it, for whoever asks.
    pub(super) const fn told(&self) -> SecondConnection {
        match self.state {
            State::GivenUp(why, _) => SecondConnection::GivenUp(why),
            State::Open { serves: true, .. } => SecondConnection::Granted,
            _ if self.stops > 0 => SecondConnection::Granted,
            _ => SecondConnection::Unused,
        }
    }

    fn set(&mut self, state: State) {
        self.close = matches!(self.state, State::Open { .. } | State::Opening);
        self.state = state;
        self.machine = None;
        self.flight = None;
        self.taken = None;
    }

    fn give_up(&mut self, why: &'static str, until: Option<Instant>) {
        tracing::debug!(why, "second connection given up");
        self.set(State::GivenUp(why, until));
    }

    /// When it was opened, if it is open.
    const fn open_since(&self) -> Option<Instant> {
        match self.state {
            State::Open { since, .. } => Some(since),
            _ => None,
        }
    }

    /// Until when a write to this slave waits, because its stop is under way.
    pub(super) fn holds(&self, slave: u8) -> Option<Instant> {
        let over = self.flight.as_ref().filter(|over| over.stop.is_some())?;
        if slave == 0 || over.slave == slave { over.answer_by } else { None }
    }

    /// A write over the first connection was given up, and may still be carried out.
    pub(super) fn unsettled(&mut self, now: Instant, slave: u8) {
        if !self.allowed {
            return;
        }
        self.unsettled.retain(|(other, _)| *other != slave);
        self.unsettled.push((slave, now));
    }

    /// A slave has answered over the first connection what it was asked at `asked`: what was asked there before is over.
    pub(super) fn settled(&mut self, now: Instant, slave: u8, asked: Instant) {
        if !self.allowed {
            return;
        }
        self.answered = Some((slave, now));
        self.unsettled.retain(|(other, at)| *at > asked || *other != slave && *other != 0);
    }

    fn is_settled(&self, now: Instant, slave: u8) -> bool {
        !self.unsettled.iter().any(|(other, at)| (*other == slave || *other == 0) && now < *at + UNSETTLED)
    }

    /// Whom to ask whether it is served: who has just answered over the first, so that the question takes no time.
    fn asks(&self, now: Instant) -> Option<u8> {
        self.answered.filter(|(slave, at)| *slave != 0 && now < *at + JUST).map(|(slave, _)| slave)
    }

    /// When something is to be done.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let exchange = self.machine.as_ref().and_then(|machine| machine.deadline());
        exchange.or(self.free_at.filter(|_| matches!(self.state, State::Open { .. })))
    }
}

impl<C> Master<C> {
    /// What is to be done with the second connection.
    pub fn poll_second(&mut self, now: Instant) -> Option<SecondPort> {
        if std::mem::take(&mut self.second.close) {
            return Some(SecondPort::Close);
        }
        let may_open = match self.second.state {
            State::Closed(from) | State::GivenUp(_, from @ Some(_)) => from.is_none_or(|from| from <= now),
            _ => false,
        };
        let is_wanted = self.second.allowed && self.far_end.owes() > 0 && !self.closing;
        if !(may_open && is_wanted && matches!(self.port, PortState::Open)) {
            return None;
        }
        self.second.state = State::Opening;
        Some(SecondPort::Open)
    }

    /// The second connection is open.
    pub fn handle_second_up(&mut self, now: Instant) {
        if self.second.state != State::Opening {
            self.second.close = true;
            return;
        }
        self.second.state = State::Open { since: now, serves: false };
        self.second.machine = Some(self.config.machine());
        self.second.free_at = None;
    }

    /// The second connection was ended, or was not made.
    pub fn handle_second_lost(&mut self, now: Instant) {
        match self.second.state {
            State::Open { serves: true, .. } => self.second.set(State::Closed(Some(now + REOPENED))),
            State::Open { .. } | State::Opening => {
                self.second.give_up("the far end has ended it", Some(now + GIVEN_UP));
            }
            State::Closed(_) | State::GivenUp(..) => {}
        }
        self.second.close = false;
    }

    /// The first connection is lost: the next two are others. One that was left because it was mute leaves the second one to
    /// the stops.
    pub(super) fn end_second(&mut self, now: Instant) {
        if std::mem::take(&mut self.fresh.was_left) {
            return;
        }
        if let Some(since) = self.second.open_since()
            && !self.was_heard_since(since)
        {
            self.second.give_up("the far end has ended the first for it", None);
        } else if !matches!(self.second.state, State::GivenUp(..)) {
            self.second.set(State::Closed(Some(now + REOPENED)));
        }
    }

    /// Somebody who answers did not, over the first connection and behind nothing. True: the second one has made it mute.
    pub(super) fn blame_second(&mut self, flight: &Flight<C>) -> bool {
        let is_mute = self.second.open_since().is_some_and(|since| {
            !self.was_heard_since(since) && flight.behind == 0 && flight.started >= since
        });
        if is_mute {
            self.second.give_up(SILENCED, None);
        }
        is_mute
    }

    /// The first is mute and is opened again: where nothing came over it since the second one is open, that may be why. A gateway
    /// that is busy with two dead drives looks the same, so that it is tried again.
    pub(super) fn mute_beside_second(&mut self, now: Instant) {
        if self
            .second
            .open_since()
            .is_some_and(|since| !self.was_heard_since(since) || self.second.heard > self.fresh.last_heard())
        {
            self.second.give_up(SILENCED, Some(now + GIVEN_UP));
        }
    }

    /// What was under way over the first connection was given up: as a write it may still be carried out. A stop does no harm.
    pub(super) fn unsettle(&mut self, now: Instant, flight: &Flight<C>) {
        if flight.sent.is_some() && !flight.is_stop && self.exchange.is_write(&flight.request) {
            self.second.unsettled(now, flight.slave);
        }
    }

    fn was_heard_since(&self, since: Instant) -> bool {
        self.heard.is_some_and(|(_, until)| until > since)
    }
}
