//! The master: everything that decides on a line, without a clock and without a port.
//!
//! Inputs are named `handle_…`, `submit`, `withdraw`; outputs `poll_…`. The task feeds it and acts.

mod finish;
mod station;

use std::{
    collections::{BTreeMap, VecDeque},
    mem,
    sync::Arc,
    time::Duration,
};

use bytes::Bytes;
use drive_core::{Class, PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::Request;

use crate::{
    answer,
    config::{LineConfig, SlaveSettings},
    exchange::{Answer, Exchange, Step, Stray, ascii::Ascii, mbap::Mbap, rtu::Rtu, unitelway::UniTelway},
    pdu,
    protocol::Protocol,
    schedule::{Choice, Entry, Readiness, Rules, Schedule, Ticket},
    stats::Stats,
};

use station::Station;

/// How a call ends.
pub type Outcome = Result<Answer, PortError>;

/// How long a request waits before it may take an aged turn.
const AGING: Duration = Duration::from_secs(1);

/// For each probe's time on the line, so many times as long no other probe: 4 %, and 5 % with what surrounds it.
const PROBE_REST: u32 = 24;

/// The machine of one line. `C` is whoever waits for an answer.
pub struct Master<C> {
    config: LineConfig,
    exchange: Box<dyn Exchange>,
    schedule: Schedule<Job<C>>,
    stations: BTreeMap<u8, Station>,
    flight: Option<Flight<C>>,
    to_send: Option<Bytes>,
    outcomes: VecDeque<(C, Outcome)>,
    link: Link,
    closing: bool,
    /// End of the last activity on the line: computed for what we sent, observed for what we received.
    quiet_from: Instant,
    last_slave: Option<u8>,
    /// No probe before this.
    probe_free_at: Option<Instant>,
    /// When the schedule wants to be asked again.
    choose_at: Option<Instant>,
    opened_at: Option<Instant>,
    stats: Stats,
}

/// What is asked, and by whom.
struct Job<C> {
    request: Arc<Request<'static>>,
    pdu: Bytes,
    is_write: bool,
    caller: C,
    attempts: u32,
    /// The adapter was asked for its echo on behalf of this request.
    settled: bool,
    /// What became of the last attempt.
    last: Option<PortError>,
}

/// The exchange that is under way.
struct Flight<C> {
    purpose: Purpose<C>,
    slave: u8,
    request: Arc<Request<'static>>,
    /// How many characters are being sent.
    sending: usize,
    started: Instant,
    sent: Option<Sent>,
}

#[derive(Clone, Copy)]
struct Sent {
    /// Computed end of transmission.
    end: Instant,
    timeout: Duration,
    /// When the answer is due.
    answer_by: Instant,
    /// Nobody answers; it is over at this time.
    unanswered_until: Option<Instant>,
}

enum Purpose<C> {
    /// Somebody's call; `None` once he has dropped it.
    Call(Option<Entry<Job<C>>>),
    /// Whether an off-line slave is back.
    Probe,
    /// Whether the adapter echoes.
    Settle,
}

enum Link {
    /// The port is open.
    Up,
    /// It was lost a moment ago, or is being opened for the first time: what waits goes on waiting.
    Opening,
    /// It cannot be opened: nothing is accepted.
    Down(String),
}

impl<C> Master<C> {
    /// A line whose port is not open yet.
    #[must_use]
    pub fn new(config: LineConfig) -> Self {
        let exchange: Box<dyn Exchange> = if config.is_mbap() {
            Box::new(Mbap::new())
        } else {
            let (serial, chunk_gap, echo) = (config.serial, config.chunk_gap, config.echo);
            match config.protocol {
                Protocol::Rtu => Box::new(Rtu::new(serial, chunk_gap, echo)),
                Protocol::Ascii(settings) => Box::new(Ascii::new(serial, settings, echo)),
                Protocol::UniTelway(settings) => Box::new(UniTelway::new(serial, settings, chunk_gap)),
            }
        };
        Self {
            exchange,
            schedule: Schedule::new(Rules { limit: config.queue_limit, aging: AGING }),
            stations: BTreeMap::new(),
            flight: None,
            to_send: None,
            outcomes: VecDeque::new(),
            link: Link::Opening,
            closing: false,
            quiet_from: Instant::now(),
            last_slave: None,
            probe_free_at: None,
            choose_at: None,
            opened_at: None,
            stats: Stats::default(),
            config,
        }
    }

    /// The configuration.
    #[must_use]
    pub const fn config(&self) -> &LineConfig {
        &self.config
    }

    /// Sets what is special about one slave.
    pub fn configure_slave(&mut self, slave: u8, settings: SlaveSettings) {
        self.config.slaves.insert(slave, settings);
        if let Some(station) = self.stations.get_mut(&slave) {
            station.configure(&self.config, settings);
        }
    }

    /// Takes a request.
    ///
    /// # Errors
    /// The request is refused at once: it has no form on this line, the slave is off-line, too many wait, the line is
    /// down or closed.
    pub fn submit(
        &mut self,
        now: Instant,
        slave: u8,
        request: Request<'static>,
        terms: Terms,
        caller: C,
    ) -> Result<Ticket, PortError> {
        let request = Arc::new(request);
        let pdu = self.admit(now, slave, &request, terms).inspect_err(|_| {
            if let Some(station) = self.stations.get_mut(&slave) {
                station.stats.outcomes.refused += 1;
            }
        })?;
        let is_write = self.exchange.is_write(&request);
        if terms.class == Class::Stop {
            self.clear_the_way(now, slave);
        }
        let job = Job { request, pdu, is_write, caller, attempts: 0, settled: false, last: None };
        let (ticket, replaced) = self
            .schedule
            .push(now, slave, terms, job)
            .map_err(|_| PortError::QueueFull(self.schedule.len()))?;
        if let Some(old) = replaced {
            self.drop_unsent(old, PortError::Superseded);
        }
        self.choose_at = None;
        Ok(ticket)
    }

    fn admit(
        &mut self,
        now: Instant,
        slave: u8,
        request: &Arc<Request<'static>>,
        terms: Terms,
    ) -> Result<Bytes, PortError> {
        if self.closing {
            return Err(PortError::Closed);
        }
        let pdu = pdu::encode(request).map_err(|error| PortError::NotCarried(error.to_string()))?;
        if slave == 0 && answer::confirmation(request).is_none() {
            return Err(PortError::NotCarried(
                "nobody answers a broadcast, so that it cannot read".to_owned(),
            ));
        }
        self.exchange.carries(slave, request, terms.class).map_err(PortError::NotCarried)?;
        if let Link::Down(reason) = &self.link {
            return Err(PortError::LineDown(reason.clone()));
        }
        let is_write = self.exchange.is_write(request);
        let station = self.station(slave);
        station.ask(now, request, is_write);
        if terms.class != Class::Stop
            && let Some(at) = station.probe_at()
        {
            return Err(PortError::Offline { retry_in: at.saturating_duration_since(now) });
        }
        Ok(pdu)
    }

    /// A stop arrives: commands that wait for the same slave would undo it, and no probe is worth its wait.
    fn clear_the_way(&mut self, now: Instant, slave: u8) {
        let overtaken = self.schedule.withdraw_all(|entry| {
            entry.terms.class == Class::Command && entry.work.is_write && (slave == 0 || entry.slave == slave)
        });
        for entry in overtaken {
            self.drop_unsent(entry, PortError::Superseded);
        }
        let Some(flight) = self.flight.take_if(|flight| matches!(flight.purpose, Purpose::Probe)) else {
            return;
        };
        self.exchange.abandon();
        self.to_send = None;
        let kind = self.exchange.kind_of_answer(flight.request.function_code().value());
        let until = flight.sent.map_or(now, |sent| sent.end) + self.config.late_window;
        let station = self.station(flight.slave);
        station.expect_late(kind, until);
        station.probe_again(until);
        self.quiet_from = self.quiet_from.max(now);
    }

    /// The caller of a request is gone.
    pub fn withdraw(&mut self, ticket: Ticket) {
        if let Some(entry) = self.schedule.withdraw(ticket) {
            self.station(entry.slave).stats.outcomes.withdrawn += 1;
            return;
        }
        if let Some(Flight { purpose: Purpose::Call(call), .. }) = &mut self.flight {
            call.take_if(|entry| entry.ticket == ticket);
        }
    }

    /// What is to be written now, if anything. [`handle_sent`](Self::handle_sent) **must** follow when it is.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Bytes> {
        if let Some(bytes) = self.to_send.take() {
            return Some(bytes);
        }
        self.choose_at = None;
        if self.flight.is_some() || !matches!(self.link, Link::Up) || self.closing {
            return None;
        }
        let free_at = self.free_at();
        let probe = self.next_probe().filter(|_| !self.schedule.has_stop());
        if now < free_at {
            self.choose_at = (!self.schedule.is_empty() || probe.is_some()).then_some(free_at);
            return None;
        }
        if let Some((slave, at)) = probe {
            if at <= now {
                self.station(slave).stats.probes += 1;
                return self.begin_read(now, slave, Purpose::Probe);
            }
            self.choose_at = Some(at);
        }
        match self.choose(now, free_at) {
            Choice::Send(entry) => self.begin(now, entry),
            Choice::Wait(at) => {
                self.choose_at = Some(self.choose_at.map_or(at, |probe| probe.min(at)));
                None
            }
            Choice::Idle => None,
        }
    }

    fn choose(&mut self, now: Instant, free_at: Instant) -> Choice<Job<C>> {
        let Self { schedule, stations, config, last_slave, exchange, .. } = self;
        schedule.choose(now, |entry| {
            let mut at = free_at;
            if last_slave.is_some_and(|last| last != entry.slave) {
                at += config.slave_change_gap;
            }
            let request = &entry.work.request;
            let mut takes = config.response_timeout;
            if let Some(station) = stations.get(&entry.slave) {
                at = at.max(station.ready_at.unwrap_or(at));
                if entry.terms.class != Class::Stop || !entry.work.is_write {
                    let kind = exchange.kind_of_answer(request.function_code().value());
                    at = at.max(station.late_until(kind).unwrap_or(at));
                }
                takes = station.timeout.typical();
            }
            let pdus = (entry.work.pdu.len(), answer::likely_len(request));
            takes += config.characters(config.request_len(pdus.0) + config.answer_len(pdus.1));
            Readiness { at, takes }
        })
    }

    /// When the silence before any request is over.
    fn free_at(&self) -> Instant {
        self.quiet_from + self.config.silence()
    }

    fn next_probe(&self) -> Option<(u8, Instant)> {
        let (slave, at) = self
            .stations
            .iter()
            .filter_map(|(slave, station)| Some((*slave, station.wanted_probe_at()?)))
            .min_by_key(|(_, at)| *at)?;
        Some((slave, self.probe_free_at.map_or(at, |free| free.max(at))))
    }

    fn begin(&mut self, now: Instant, mut entry: Entry<Job<C>>) -> Option<Bytes> {
        let slave = entry.slave;
        let ambiguous = slave != 0 && answer::equals_its_request(&entry.work.request);
        if ambiguous && self.exchange.echo_is_unknown() && !mem::replace(&mut entry.work.settled, true) {
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
        let arrived = entry.arrived;
        let (request, pdu) = (Arc::clone(&entry.work.request), entry.work.pdu.clone());
        Some(self.fly(now, slave, Purpose::Call(Some(entry)), arrived, request, &pdu))
    }

    fn begin_read(&mut self, now: Instant, slave: u8, purpose: Purpose<C>) -> Option<Bytes> {
        let request = self.station(slave).harmless_read();
        let pdu = pdu::encode(&request).ok()?;
        Some(self.fly(now, slave, purpose, now, request, &pdu))
    }

    fn fly(
        &mut self,
        now: Instant,
        slave: u8,
        purpose: Purpose<C>,
        since: Instant,
        request: Arc<Request<'static>>,
        pdu: &Bytes,
    ) -> Bytes {
        let allowed = self.free_at().max(since).max(self.station(slave).ready_at.unwrap_or(since));
        self.stats.lag.record(now.saturating_duration_since(allowed));
        self.stats.silence.record(now.saturating_duration_since(self.quiet_from));
        let bytes = self.exchange.start(slave, Arc::clone(&request), pdu);
        self.flight =
            Some(Flight { purpose, slave, request, sending: bytes.len(), started: now, sent: None });
        bytes
    }

    /// What [`poll_transmit`](Self::poll_transmit) gave has been handed to the port.
    pub fn handle_sent(&mut self, now: Instant) {
        let Some(flight) = &mut self.flight else { return };
        let end = now + self.config.characters(flight.sending);
        self.quiet_from = end;
        if let Some(sent) = flight.sent {
            self.exchange.handle_sent(end, sent.answer_by);
            return;
        }
        let unanswered = flight.slave == 0 || pdu::is_unanswered(&flight.request);
        let station = self.stations.entry(flight.slave).or_insert_with(|| {
            Station::new(&self.config, self.config.slaves.get(&flight.slave).copied().unwrap_or_default())
        });
        station.stats.sent += 1;
        let timeout = station.timeout.current();
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

    /// Bytes came in.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        self.quiet_from = self.quiet_from.max(now);
        let step = self.exchange.handle_bytes(now, bytes);
        self.act(now, step);
    }

    /// [`deadline`](Self::deadline) has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        for entry in self.schedule.expired(now) {
            self.drop_unsent(entry, PortError::Expired);
        }
        let unanswered =
            self.flight.as_ref().and_then(|flight| flight.sent).and_then(|sent| sent.unanswered_until);
        if unanswered.is_some_and(|until| now >= until) {
            self.finish_unanswered(now);
        } else if self.exchange.deadline().is_some_and(|deadline| now >= deadline) {
            let step = self.exchange.handle_timeout(now);
            self.act(now, step);
        }
    }

    /// Whether an exchange is under way.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        self.flight.is_some()
    }

    /// When [`handle_timeout`](Self::handle_timeout) and [`poll_transmit`](Self::poll_transmit) are to be called, unless
    /// something else happens before.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let unanswered =
            self.flight.as_ref().and_then(|flight| flight.sent).and_then(|sent| sent.unanswered_until);
        let exchange = if unanswered.is_some() { unanswered } else { self.exchange.deadline() };
        [exchange, self.choose_at, self.schedule.next_expiry()].into_iter().flatten().min()
    }

    fn act(&mut self, now: Instant, step: Step) {
        self.count_strays();
        let unanswered = self
            .flight
            .as_ref()
            .is_some_and(|flight| flight.sent.is_some_and(|sent| sent.unanswered_until.is_some()));
        match step {
            Step::More => {}
            Step::Send(bytes) => {
                if let Some(flight) = &mut self.flight {
                    flight.sending = bytes.len();
                    self.to_send = Some(bytes);
                }
            }
            Step::Done(_) if unanswered => {}
            Step::Done(result) => self.finish(now, result),
        }
    }

    fn count_strays(&mut self) {
        for stray in self.exchange.take_strays() {
            match stray {
                Stray::Echo => self.stats.echoes += 1,
                Stray::Noise(bytes) => self.stats.noise_bytes += bytes as u64,
                Stray::Frame { slave, function } => {
                    let kind = self.exchange.kind_of_answer(function & 0x7F);
                    let late = self.stations.get_mut(&slave).is_some_and(|station| station.came_late(kind));
                    self.stats.foreign += u64::from(!late);
                }
            }
        }
    }

    /// The next call that has ended.
    pub fn poll_outcome(&mut self) -> Option<(C, Outcome)> {
        self.outcomes.pop_front()
    }

    /// The port is open.
    pub fn handle_up(&mut self, now: Instant) {
        tracing::info!(endpoint = ?self.config.endpoint, "line up");
        self.link = Link::Up;
        self.exchange.reset();
        self.quiet_from = now;
        self.stats.opened += 1;
        self.opened_at.get_or_insert(now);
    }

    /// The port is lost. What waits goes on waiting.
    pub fn handle_lost(&mut self, now: Instant, reason: &str) {
        tracing::warn!(endpoint = ?self.config.endpoint, reason, "line lost");
        self.link = Link::Opening;
        self.stats.lost += 1;
        self.exchange.reset();
        self.fail_flight(now, reason);
    }

    /// The port cannot be opened. What waits without a lifetime ends; what has one expires.
    pub fn handle_down(&mut self, reason: &str) {
        if let Link::Opening = mem::replace(&mut self.link, Link::Down(reason.to_owned())) {
            tracing::warn!(endpoint = ?self.config.endpoint, reason, "line down");
        }
        for entry in self.schedule.withdraw_all(|entry| entry.terms.lifetime.is_none()) {
            self.drop_unsent(entry, PortError::LineDown(reason.to_owned()));
        }
    }

    /// The line is to be closed.
    pub fn handle_close(&mut self) {
        self.closing = true;
        for entry in self.schedule.withdraw_all(|_| true) {
            self.drop_unsent(entry, PortError::Closed);
        }
    }

    /// Whether the line is closed and nothing is under way any more.
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        self.closing && self.flight.is_none()
    }

    /// What was counted so far, at `now`.
    #[must_use]
    pub fn stats(&self, now: Instant) -> Stats {
        let mut stats = self.stats.clone();
        stats.elapsed = self.opened_at.map_or(Duration::ZERO, |opened| now.saturating_duration_since(opened));
        stats.queued = self.schedule.len();
        stats.echoing = self.exchange.echoes();
        stats.slaves = self
            .stations
            .iter()
            .filter(|(slave, _)| **slave != 0)
            .map(|(slave, station)| {
                let mut stats = station.stats.clone();
                stats.response_timeout = station.timeout.current();
                (*slave, stats)
            })
            .collect();
        stats
    }

    fn station(&mut self, slave: u8) -> &mut Station {
        let config = &self.config;
        self.stations
            .entry(slave)
            .or_insert_with(|| Station::new(config, config.slaves.get(&slave).copied().unwrap_or_default()))
    }
}
