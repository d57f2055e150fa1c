//! What is sent next, and what follows from its having been sent.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::{Class, PortError};
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{
    Asked, Flight, Master, Purpose, Sending, Sent,
    fresh::First,
    port::PortState,
    probing,
    waits::{Waits, shape_of, wants_echo_read},
};
use crate::{
    answer,
    evidence::Over,
    exchange::Frame,
    pdu,
    schedule::{Chosen, Entry, Readiness},
    shape,
};

/// A line without any silence for so long has somebody else on it that sends for ever: the longest frame at 9600 bit/s takes
/// 0.3 s. At lower speeds it is as long as two of them.
const NEVER_QUIET: Duration = Duration::from_secs(1);

impl<C> Master<C> {
    /// What is to be written now, if anything. [`handle_sent`](Self::handle_sent) **must** follow when it is.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Bytes> {
        let going_on = self.to_send.take();
        let goes_on = going_on.is_some();
        let bytes = match going_on {
            Some(bytes) => bytes,
            None => self.next_exchange(now)?,
        };
        self.record.sent(&bytes);
        self.evidence.sent(now, Over::First, goes_on, &bytes);
        self.sending = Some(Sending { since: now, characters: bytes.len() });
        Some(bytes)
    }

    fn next_exchange(&mut self, now: Instant) -> Option<Bytes> {
        self.choose_at = None;
        if self.flight.is_some() || !matches!(self.port, PortState::Open) {
            return None;
        }
        let aside = self.next_aside();
        if self.closing && aside.is_none() && self.schedule.is_empty() {
            return None;
        }
        let free_at = self.free_at();
        let Self { exchange, stations, aside: waiting, offline, far_end, second, .. } = &*self;
        let waits = Waits { exchange: exchange.as_ref(), stations, aside: waiting, offline, far_end, second };
        let stop_since = self.schedule.first_stop(|entry| waits.since(now, entry));
        let stop_at = stop_since.map(|since| self.stop_free_at(since));
        let probe = self.next_probe(now).filter(|_| stop_at.is_none() && !self.closing);
        let soonest = stop_at.unwrap_or(free_at);
        if now < soonest {
            self.give_up_on_silence(now);
            let waits = !self.schedule.is_empty() || probe.is_some() || aside.is_some();
            self.choose_at = waits.then_some(soonest);
            return None;
        }
        if stop_at.is_none() && !self.closing {
            match crate::mutant!("first-answer-believed", self.first(now), First::Nothing) {
                First::Nothing => {}
                First::Listen(until) => {
                    let waits = !self.schedule.is_empty() || probe.is_some() || aside.is_some();
                    self.choose_at = waits.then_some(until);
                    return None;
                }
                First::Ask(slave) => return self.begin_read(now, slave, Purpose::ThrowAway),
            }
        }
        let due = aside.filter(|(at, _)| stop_at.is_none() && *at <= now);
        if let Some((_, slave)) = due.filter(|_| !self.resumed || self.closing) {
            return self.resume(now, slave);
        }
        if let Some((slave, at)) = probe {
            if at <= now {
                self.station(slave).stats.probes += 1;
                return self.begin_read(now, slave, Purpose::Probe);
            }
            self.choose_at = Some(at);
        }
        let at = match self.choose(now, free_at, stop_at) {
            Chosen::Send(entry) => return self.begin(now, entry),
            Chosen::Wait(at) => Some(at),
            Chosen::Idle => None,
        };
        if let Some((_, slave)) = due {
            return self.resume(now, slave);
        }
        self.choose_at = [self.choose_at, at, aside.map(|(at, _)| at)].into_iter().flatten().min();
        None
    }

    fn choose(&mut self, now: Instant, free_at: Instant, stop_at: Option<Instant>) -> Chosen<Asked<C>> {
        let Self {
            schedule, stations, aside, config, last_slave, exchange, offline, far_end, second, ..
        } = self;
        let waits = Waits { exchange: exchange.as_ref(), stations, aside, offline, far_end, second };
        schedule.choose(now, |entry| {
            let stop = entry.terms.class == Class::Stop;
            let mut at = stop_at.filter(|_| stop).unwrap_or(free_at);
            if last_slave.is_some_and(|last| last != entry.slave) {
                at += config.slave_change_gap;
            }
            if entry.slave == 0 {
                // Every slave listens, so that each has its pause.
                at = stations.values().filter_map(|station| station.ready_at).fold(at, Instant::max);
            }
            let request = &entry.work.request;
            let station = stations.get(&entry.slave);
            at = station.and_then(|station| station.ready_at).map_or(at, |ready_at| at.max(ready_at));
            let mut takes = station.map_or(config.response_timeout, |station| station.timeout.typical());
            let waits = waits.until(now, entry);
            at = waits.map_or(at, |until| at.max(until));
            let pdus = (entry.work.pdu.len(), answer::likely_len(request));
            takes += config.characters(config.request_len(pdus.0) + config.answer_len(pdus.1));
            Readiness { at, takes, holds_line: stop && waits.is_none() }
        })
    }

    /// When the silence before any request is over.
    fn free_at(&self) -> Instant {
        self.quiet_from + crate::mutant!("silence-unkept", self.config.silence(), std::time::Duration::ZERO)
    }

    /// When a Stop that waits for nothing but the line, since then, is sent at the latest, whatever is heard there: bytes that belong
    /// to no exchange of ours hold it up for one frame, not for as long as somebody babbles.
    fn stop_free_at(&self, since: Instant) -> Instant {
        let heard_out = since.max(self.exchange_end) + self.config.silence() + self.config.longest_stray();
        self.free_at().min(heard_out)
    }

    /// There has been no silence for so long that there will be none: what waits for it ends, but for a Stop.
    fn give_up_on_silence(&mut self, now: Instant) {
        let longest = NEVER_QUIET.max(self.config.longest_stray() * 2);
        let goes_on = self.heard.filter(|(_, until)| now < *until + self.config.silence());
        let heard_for = goes_on.map_or(Duration::ZERO, |(since, until)| until - since);
        if heard_for < longest {
            return;
        }
        for entry in self.schedule.withdraw_all(|entry| entry.terms.class != Class::Stop) {
            self.stats.never_quiet += 1;
            self.drop_unsent(entry, PortError::NeverQuiet { heard_for });
        }
    }

    fn begin(&mut self, now: Instant, mut entry: Entry<Asked<C>>) -> Option<Bytes> {
        let slave = entry.slave;
        if wants_echo_read(self.exchange.as_ref(), &entry) && self.may_read_echo(now, slave) {
            entry.work.echo_was_read = true;
            self.schedule.put_back(entry);
            return self.begin_read(now, slave, Purpose::EchoRead);
        }
        self.called_at = Some(now);
        if entry.work.attempts == 0 && entry.work.last.is_none() && entry.work.doubted.is_none() {
            let class = self.stats.class_mut(entry.terms.class);
            class.sent += 1;
            let waited = now.saturating_duration_since(entry.arrived);
            class.wait.record(waited);
            class.waits.record(waited);
        } else {
            self.station(slave).stats.retries += 1;
        }
        self.note_start(now, slave, entry.arrived);
        self.forsake(now, slave);
        let (more, _) = self.station(slave).place(now, &entry);
        let longer = shape::lengthened(&entry.work.request, more).filter(|_| more > 0);
        let (request, pdu) = match longer.map(|request| (pdu::encode(&request), request)) {
            Some((Ok(pdu), request)) => (Arc::new(request), pdu),
            _ => (Arc::clone(&entry.work.request), entry.work.pdu.clone()),
        };
        Some(self.fly(now, slave, Purpose::Call(Some(entry)), request, &pdu, more))
    }

    /// Whether no late answer can be taken for that of the read that finds out about the echo. Only a Stop comes here
    /// while one can: it is sent as it is, and asks before its next attempt.
    fn may_read_echo(&self, now: Instant, slave: u8) -> bool {
        let Some(station) = self.stations.get(&slave) else { return true };
        let read = shape_of(self.exchange.as_ref(), &station.harmless_read());
        station.doubt.wait(now, read).is_none()
    }

    fn begin_read(&mut self, now: Instant, slave: u8, purpose: Purpose<C>) -> Option<Bytes> {
        let request = self.station(slave).harmless_read();
        let request = if let Purpose::Probe | Purpose::ThrowAway = purpose {
            probing::shortest(request)
        } else {
            request
        };
        let pdu = pdu::encode(&request).ok()?;
        self.note_start(now, slave, now);
        Some(self.fly(now, slave, purpose, request, &pdu, 0))
    }

    /// A request that could have been sent from `since` on is sent at `now`.
    fn note_start(&mut self, now: Instant, slave: u8, since: Instant) {
        let allowed = self.free_at().max(since).max(self.station(slave).ready_at.unwrap_or(since));
        self.stats.lag.record(now.saturating_duration_since(allowed));
        self.stats.silence.record(now.saturating_duration_since(self.quiet_from));
    }

    fn fly(
        &mut self,
        now: Instant,
        slave: u8,
        purpose: Purpose<C>,
        request: Arc<Request<'static>>,
        pdu: &Bytes,
        more: u8,
    ) -> Bytes {
        self.resumed = false;
        let shape = self.exchange.shape(pdu);
        let at_once = matches!(&purpose, Purpose::Call(Some(entry))
            if entry.work.attempts == 0 && entry.work.is_write && entry.terms.class == Class::Stop);
        let bytes = if at_once {
            self.exchange.start_at_once(slave, Arc::clone(&request), pdu)
        } else {
            self.exchange.start(slave, Arc::clone(&request), pdu)
        };
        let is_write = self.exchange.is_write(&request);
        let first = crate::mutant!("first-answer-believed", self.fresh.is_first(), false);
        let asks = Frame::of(pdu).check;
        let wrote = Some(asks).filter(|_| is_write && self.exchange.confirms_late());
        let doubt = &mut self.station(slave).doubt;
        let suspect = first || doubt.owes(now, shape, wrote);
        if is_write {
            doubt.written(shape, asks);
        }
        let answer = answer::likely_len(&request);
        self.longest = (self.longest.0.max(pdu.len()), self.longest.1.max(answer));
        let (patience, question) = self.patience(now, slave, &purpose);
        let is_stop = matches!(&purpose, Purpose::Call(Some(entry)) if entry.terms.class == Class::Stop);
        self.flight = Some(Flight {
            is_stop,
            purpose,
            slave,
            request,
            shape,
            asks,
            wrote,
            more,
            suspect,
            stalled: false,
            patience,
            question,
            started: now,
            asked_at: now,
            number: self.exchange.number(),
            behind: self.far_end.owes(),
            sent: None,
        });
        bytes
    }

    /// When the last bit of what the port was given is off the line, if it is sent from `now` on.
    pub(super) fn end_of_sending(&self, now: Instant) -> Instant {
        now + self.config.characters(self.sending.map_or(0, |sending| sending.characters))
    }

    /// What [`poll_transmit`](Self::poll_transmit) gave has been handed to the port.
    pub fn handle_sent(&mut self, now: Instant) {
        let end = self.end_of_sending(now);
        let taken_in = now - self.sending.take().map_or(now, |sending| sending.since);
        self.quiet_from = end;
        let Some(flight) = &mut self.flight else {
            // Given up while it was written, for a Stop: that waits until this is off the line.
            self.exchange_end = end;
            return;
        };
        if let Some(sent) = flight.sent {
            self.exchange.handle_sent(end - taken_in, sent.answer_by);
            return;
        }
        // While the host was away anything may have come, before the request was sent.
        let away = taken_in > self.config.chunk_gap;
        flight.suspect |= away && self.exchange.confuses_late_answers();
        let unanswered = flight.slave == 0 || pdu::is_unanswered(&flight.request);
        if let Some(station) = self.stations.get_mut(&flight.slave) {
            station.stats.sent += 1;
        }
        let timeout = flight.patience;
        let characters = self.config.characters(self.config.answer_len(answer::likely_len(&flight.request)));
        let usually_by = end + timeout + characters;
        let answer_by = usually_by + self.far_end.held_up(end);
        flight.sent = Some(Sent {
            end,
            timeout,
            answer_by,
            usually_by,
            place: self.far_end.place(end),
            unanswered_until: unanswered.then(|| end + self.config.broadcast_pause),
        });
        self.exchange.handle_sent(end - taken_in, answer_by);
        self.last_slave = (flight.slave != 0).then_some(flight.slave);
    }

    /// When the last character of the awaited answer usually comes, and by how much that varies. `None`: nothing is
    /// awaited, or the slave has not answered yet.
    #[must_use]
    pub fn answer_due(&self) -> Option<(Instant, Duration)> {
        let flight = self.flight.as_ref()?;
        let sent = flight.sent.filter(|sent| sent.unanswered_until.is_none())?;
        let (response, spread) = self.stations.get(&flight.slave)?.timeout.learned()?;
        let characters = self.config.characters(self.config.answer_len(answer::likely_len(&flight.request)));
        Some((sent.end + response + characters, spread))
    }
}
