//! What goes over the second connection, and what comes.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{
    super::{Asked, Master, Purpose, probing},
    GIVEN_UP, Going, REOPENED, State,
};
use crate::{
    answer,
    evidence::{Ended, Over, What},
    exchange::{Answer, Step, Stray},
    pdu,
    schedule::{Entry, Ticket},
};

impl<C> Master<C> {
    /// What is to be written to the second connection now. [`handle_second_sent`](Self::handle_second_sent) **must** follow.
    pub fn poll_second_transmit(&mut self, now: Instant) -> Option<Bytes> {
        let State::Open { serves, .. } = self.second.state else { return None };
        if self.second.flight.is_some() || self.second.free_at.is_some_and(|at| now < at) {
            return None;
        }
        self.second.free_at = None;
        let (stop, slave, request) = match self.stop_for_second(now) {
            Some((ticket, slave, request)) => (Some(ticket), slave, request),
            None if serves => return None,
            None => {
                let slave = self.second.asks(now).filter(|_| self.far_end.owes() == 0)?;
                (None, slave, probing::shortest(self.station(slave).harmless_read()))
            }
        };
        let pdu = pdu::encode(&request).ok()?;
        let machine = self.second.machine.as_mut()?;
        let bytes = machine.start(slave, Arc::clone(&request), &pdu);
        self.evidence.sent(now, Over::Second, false, &bytes);
        self.second.flight = Some(Going { stop, slave, request, started: now, answer_by: None });
        Some(bytes)
    }

    /// The next stop that was not sent over it yet, and is not over without it at once.
    fn stop_for_second(&mut self, now: Instant) -> Option<(Ticket, u8, Arc<Request<'static>>)> {
        let Self { second, flight, schedule, far_end, offline, exchange, .. } = self;
        let confuses = exchange.confuses_late_answers();
        // A read shows what is so now: where a write may still follow it shows nothing, and without a number a late answer
        // could be taken for it.
        let goes = |entry: &Entry<Asked<C>>| {
            entry.terms.class == Class::Stop
                && !entry.work.went_second
                && entry.slave != 0
                && !offline.contains(entry.slave)
                && (entry.work.is_write || !confuses && second.is_settled(now, entry.slave))
        };
        let under_way =
            flight.as_mut().filter(|flight| flight.behind > 0).and_then(|flight| match &mut flight.purpose {
                Purpose::Call(Some(entry)) => Some(entry),
                _ => None,
            });
        let entry = match under_way.filter(|entry| goes(entry)) {
            Some(entry) => entry,
            None if far_end.owes() > 0 => schedule.find(goes)?,
            None => return None,
        };
        entry.work.went_second = true;
        Some((entry.ticket, entry.slave, Arc::clone(&entry.work.request)))
    }

    /// What [`poll_second_transmit`](Self::poll_second_transmit) gave has been handed over.
    pub fn handle_second_sent(&mut self, now: Instant) {
        let Some((slave, request)) =
            self.second.flight.as_ref().map(|over| (over.slave, Arc::clone(&over.request)))
        else {
            return;
        };
        let lens = (pdu::encode(&request).map_or(0, |pdu| pdu.len()), answer::likely_len(&request));
        let end = now + self.config.characters(self.config.request_len(lens.0));
        let timeout = self.station(slave).timeout.current();
        let held = if self.far_end.owes() > 0 { self.far_end.wait() * 5 / 4 } else { Duration::ZERO };
        let answer_by = end + self.config.characters(self.config.answer_len(lens.1)) + timeout + held;
        if let Some(over) = &mut self.second.flight {
            over.answer_by = Some(answer_by);
        }
        if let Some(machine) = &mut self.second.machine {
            machine.handle_sent(end, answer_by);
        }
    }

    /// Bytes came in over the second connection.
    pub fn handle_second_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let Some(machine) = &mut self.second.machine else { return };
        self.evidence.heard(now, Over::Second, self.second.flight.is_some(), bytes);
        if let Step::Done(Ok(answer)) = machine.handle_bytes(now, bytes) {
            self.second_answered(now, answer);
        }
        self.second_strays(now);
    }

    /// What came over it and was no part of its exchange.
    fn second_strays(&mut self, now: Instant) {
        let Some(machine) = &mut self.second.machine else { return };
        for stray in machine.take_strays() {
            let (slave, what) = match stray {
                Stray::Early { slave, .. } => (slave, What::Early),
                Stray::Frame { slave, is_request: true, .. } => (slave, What::OthersRequest),
                Stray::Frame { slave, number: Some(0), .. } if machine.number() != Some(0) => {
                    (slave, What::NumberZero)
                }
                // A number is given once.
                Stray::Frame { slave, number: Some(number), .. }
                    if self.second.flight.is_none() && machine.number() == Some(number) =>
                {
                    (slave, What::Doubled)
                }
                Stray::Frame { slave, frame, .. } => {
                    let again =
                        self.second.taken.filter(|(of, taken)| *of == slave && taken.shape == frame.shape);
                    let what = match again {
                        Some((_, taken)) if taken == frame => What::Doubled,
                        Some(_) => What::Contradicted,
                        None => What::OthersAnswer,
                    };
                    (slave, what)
                }
                Stray::Noise(_) | Stray::Echo => continue,
            };
            self.evidence.stray(now, Over::Second, slave, what);
        }
    }

    /// The time of what is under way over it may be over.
    pub(in crate::master) fn second_timeout(&mut self, now: Instant) {
        let Some(machine) = &mut self.second.machine else { return };
        let Step::Done(result) = machine.handle_timeout(now) else { return };
        if result.is_err()
            && let Some(going) = self.second.flight.take()
        {
            let _ = self.note_end(now, (Over::Second, going.slave), &going.request, Ended::InVain);
        }
        match (result, self.second.state) {
            (Ok(answer), _) => self.second_answered(now, answer),
            (Err(_), State::Open { serves: true, .. }) => {
                self.second.set(State::Closed(Some(now + REOPENED)));
            }
            (Err(_), _) => self.second.give_up("it gives no answer", Some(now + GIVEN_UP)),
        }
    }

    fn second_answered(&mut self, now: Instant, answer: Answer) {
        let Some(over) = self.second.flight.take() else { return };
        let _ = self.note_end(now, (Over::Second, over.slave), &over.request, Ended::with(&answer));
        let taken = self.second.machine.as_ref().and_then(|machine| machine.taken());
        self.second.taken = taken.map(|frame| (over.slave, frame));
        if let State::Open { serves, .. } = &mut self.second.state {
            *serves = true;
        }
        self.second.heard = Some(now);
        self.second.free_at = Some(now + self.config.silence()).filter(|at| *at > now);
        let Some(ticket) = over.stop else { return };
        self.second.stops += 1;
        // What a gateway or a drive refuses is told by the stop over the first connection.
        let Ok(response) = answer else { return };
        if self.writes_to(over.slave) || !self.second.is_settled(now, over.slave) {
            return;
        }
        let under_way = self.flight.as_mut().and_then(|flight| match &mut flight.purpose {
            Purpose::Call(call) => call.take_if(|entry| entry.ticket == ticket),
            _ => None,
        });
        let Some(entry) = under_way.or_else(|| self.schedule.withdraw(ticket)) else { return };
        self.note_alive(now, over.slave);
        let station = self.station(over.slave);
        station.answered_at = Some(over.started);
        station.stats.outcomes.answered += 1;
        // Whoever is told of several at once is told of the oldest.
        self.asked_at = if self.outcomes.is_empty() { over.started } else { self.asked_at.min(over.started) };
        self.outcomes.push_back((entry.work.caller, Ok(Ok(response))));
    }

    /// Whether a write to this slave is under way over the first connection that is no stop.
    fn writes_to(&self, slave: u8) -> bool {
        self.flight.as_ref().is_some_and(|flight| {
            (flight.slave == slave || flight.slave == 0)
                && !flight.is_stop
                && self.exchange.is_write(&flight.request)
        })
    }
}
