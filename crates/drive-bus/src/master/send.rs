//! What is sent next, and what follows from its having been sent.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{AGING, Flight, Job, Master, Purpose, Sent, Station, link::Link, station::wants_settling};
use crate::{
    answer, pdu,
    schedule::{Choice, Entry, Readiness},
};

impl<C> Master<C> {
    /// What is to be written now, if anything. [`handle_sent`](Self::handle_sent) **must** follow when it is.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Bytes> {
        let bytes = match self.to_send.take() {
            Some(bytes) => bytes,
            None => self.next_exchange(now)?,
        };
        self.sending = Some(bytes.len());
        Some(bytes)
    }

    fn next_exchange(&mut self, now: Instant) -> Option<Bytes> {
        self.choose_at = None;
        if self.flight.is_some() || !matches!(self.link, Link::Up) {
            return None;
        }
        let aside = self.next_aside();
        if self.closing && aside.is_none() {
            return None;
        }
        let free_at = self.free_at();
        let waits_long = |entry: &Entry<Job<C>>| self.waits_long(now, entry);
        let stop_at =
            self.schedule.first_stop(|entry| !waits_long(entry)).map(|since| self.stop_free_at(since));
        let probe = self.next_probe().filter(|_| stop_at.is_none() && !self.closing);
        let soonest = stop_at.unwrap_or(free_at);
        if now < soonest {
            let waits = !self.schedule.is_empty() || probe.is_some() || aside.is_some();
            self.choose_at = waits.then_some(soonest);
            return None;
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
            Choice::Send(entry) => return self.begin(now, entry),
            Choice::Wait(at) => Some(at),
            Choice::Idle => None,
        };
        if let Some((_, slave)) = due {
            return self.resume(now, slave);
        }
        self.choose_at = [self.choose_at, at, aside.map(|(at, _)| at)].into_iter().flatten().min();
        None
    }

    fn choose(&mut self, now: Instant, free_at: Instant, stop_at: Option<Instant>) -> Choice<Job<C>> {
        let Self { schedule, stations, aside, config, last_slave, exchange, offline_stop_at, .. } = self;
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
            let mut takes = config.response_timeout;
            let mut long = None;
            if let Some(station) = stations.get(&entry.slave) {
                at = at.max(station.ready_at.unwrap_or(at));
                long = station.held_until(now, exchange.as_ref(), entry, *offline_stop_at);
                let aside = aside.get(&entry.slave).and_then(|aside| aside.holds(now, entry));
                long = long.max(aside);
                at = at.max(long.unwrap_or(at));
                takes = station.timeout.typical();
            }
            let pdus = (entry.work.pdu.len(), answer::likely_len(request));
            takes += config.characters(config.request_len(pdus.0) + config.answer_len(pdus.1));
            Readiness { at, takes, holds_line: stop && long.is_none() }
        })
    }

    /// Whether a Stop has to wait for longer than its slave's pause, so that the line is free for others meanwhile.
    fn waits_long(&self, now: Instant, entry: &Entry<Job<C>>) -> bool {
        let aside = self.aside.get(&entry.slave);
        aside.is_some_and(|aside| aside.holds(now, entry).is_some())
            || self.stations.get(&entry.slave).is_some_and(|station| {
                station.held_until(now, self.exchange.as_ref(), entry, self.offline_stop_at).is_some()
            })
    }

    /// When the silence before any request is over.
    fn free_at(&self) -> Instant {
        self.quiet_from + self.config.silence()
    }

    /// When a Stop that waits since `arrived` is sent at the latest, whatever is heard on the line: bytes that belong to
    /// no exchange of ours hold it up for one frame, not for as long as somebody babbles.
    fn stop_free_at(&self, arrived: Instant) -> Instant {
        let heard_out = arrived.max(self.exchange_end) + self.config.silence() + self.config.longest_stray();
        self.free_at().min(heard_out)
    }

    /// The next probe that is worth the line's time. What commands or feeds a watchdog goes first, for as long as
    /// anything may wait before it has aged: on a full line a drive that is back would never be noticed.
    fn next_probe(&self) -> Option<(u8, Instant)> {
        let (slave, at) = self.due_probe()?;
        let urgent = self.schedule.any(|entry| entry.terms.class >= Class::KeepAlive);
        Some((slave, if urgent { at + AGING } else { at }))
    }

    fn due_probe(&self) -> Option<(u8, Instant)> {
        let (slave, at) = self
            .offline
            .iter()
            .filter(|slave| !self.aside.contains_key(slave))
            .filter_map(|slave| Some((*slave, self.stations.get(slave)?.wanted_probe_at()?)))
            .min_by_key(|(_, at)| *at)?;
        Some((slave, self.probe_free_at.map_or(at, |free| free.max(at))))
    }

    fn begin(&mut self, now: Instant, mut entry: Entry<Job<C>>) -> Option<Bytes> {
        let slave = entry.slave;
        if wants_settling(self.exchange.as_ref(), &entry) && self.may_settle(now, slave) {
            entry.work.settled = true;
            self.schedule.put_back(entry);
            return self.begin_read(now, slave, Purpose::Settle);
        }
        if entry.work.attempts == 0 {
            let class = self.stats.class_mut(entry.terms.class);
            class.sent += 1;
            class.wait.record(now.saturating_duration_since(entry.arrived));
        } else {
            self.station(slave).stats.retries += 1;
        }
        self.note_start(now, slave, entry.arrived);
        self.forsake(now, slave);
        let request = Arc::clone(&entry.work.request);
        let first = entry.work.attempts == 0 && entry.work.is_write && entry.terms.class == Class::Stop;
        let bytes = if first {
            self.exchange.start_at_once(slave, Arc::clone(&request), &entry.work.pdu)
        } else {
            self.exchange.start(slave, Arc::clone(&request), &entry.work.pdu)
        };
        Some(self.fly(now, slave, Purpose::Call(Some(entry)), request, bytes))
    }

    /// Whether no late answer can be taken for that of the read that finds out about the echo. Only a Stop comes here
    /// while one can: it is sent as it is, and asks before its next attempt.
    fn may_settle(&self, now: Instant, slave: u8) -> bool {
        let late_until = self
            .stations
            .get(&slave)
            .and_then(|station| station.late_until(self.exchange.as_ref(), &station.harmless_read()));
        late_until.is_none_or(|until| until <= now)
    }

    fn begin_read(&mut self, now: Instant, slave: u8, purpose: Purpose<C>) -> Option<Bytes> {
        let request = self.station(slave).harmless_read();
        let pdu = pdu::encode(&request).ok()?;
        self.note_start(now, slave, now);
        let bytes = self.exchange.start(slave, Arc::clone(&request), &pdu);
        Some(self.fly(now, slave, purpose, request, bytes))
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
        bytes: Bytes,
    ) -> Bytes {
        self.resumed = false;
        self.flight = Some(Flight { purpose, slave, request, started: now, sent: None });
        bytes
    }

    /// When the last bit of what the port was given is off the line, if it is sent from `now` on.
    pub(super) fn end_of_sending(&self, now: Instant) -> Instant {
        now + self.config.characters(self.sending.unwrap_or_default())
    }

    /// What [`poll_transmit`](Self::poll_transmit) gave has been handed to the port.
    pub fn handle_sent(&mut self, now: Instant) {
        let end = self.end_of_sending(now);
        self.sending = None;
        self.quiet_from = end;
        let Some(flight) = &mut self.flight else {
            // Given up while it was written, for a Stop: that waits until this is off the line.
            self.exchange_end = end;
            return;
        };
        if let Some(sent) = flight.sent {
            self.exchange.handle_sent(end, sent.answer_by);
            return;
        }
        let unanswered = flight.slave == 0 || pdu::is_unanswered(&flight.request);
        let station = self.stations.entry(flight.slave).or_insert_with(|| {
            Station::new(&self.config, self.config.slaves.get(&flight.slave).copied().unwrap_or_default())
        });
        station.stats.sent += 1;
        // What waits while others are served may wait as long as it was configured.
        let timeout = if self.exchange.frees_the_line() {
            station.timeout.ceiling()
        } else {
            station.timeout.current()
        };
        let characters = self.config.characters(self.config.answer_len(answer::likely_len(&flight.request)));
        let answer_by = end + timeout + characters;
        flight.sent = Some(Sent {
            end,
            timeout,
            answer_by,
            unanswered_until: unanswered.then(|| end + self.config.broadcast_turnaround),
        });
        self.exchange.handle_sent(end, answer_by);
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
