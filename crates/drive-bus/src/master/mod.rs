//! The master: everything that decides on a line, without a clock and without a port.
//!
//! Inputs are named `handle_…`, `submit`, `withdraw`; outputs `poll_…`. The task feeds it and acts.

mod aside;
mod finish;
mod link;
mod send;
mod station;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
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
    schedule::{Entry, Rules, Schedule, Ticket},
    stats::Stats,
    unite::LinkCounters,
};

use aside::Aside;
use link::Link;
use station::Station;

/// How a call ends.
pub type Outcome = Result<Answer, PortError>;

/// The last address a slave on a line can have; the rest is reserved (MODBUS over Serial Line V1.02 p. 7).
const LAST_SLAVE: u8 = 247;

/// How long a request waits before it may take an aged turn.
const AGING: Duration = Duration::from_secs(1);

/// For each probe's time on the line, so many times as long no other probe: 4 %, and 5 % with what surrounds it.
const PROBE_REST: u32 = 24;

/// The same for stops of slaves that are off-line, which are repeated for as long as they are: together they take a fifth.
/// If all went ahead of everything, three dead drives would take the whole line from the living.
const OFFLINE_STOP_REST: u32 = 4;

/// The machine of one line. `C` is whoever waits for an answer.
pub struct Master<C> {
    config: LineConfig,
    exchange: Box<dyn Exchange>,
    schedule: Schedule<Job<C>>,
    stations: BTreeMap<u8, Station>,
    /// Those that do not answer: they are probed.
    offline: BTreeSet<u8>,
    flight: Option<Flight<C>>,
    /// Exchanges whose slaves are not ready yet.
    aside: BTreeMap<u8, Aside<C>>,
    /// The last exchange that was sent was one of those: the next turn is another's.
    resumed: bool,
    to_send: Option<Bytes>,
    /// How many characters the port was given whose sending is not confirmed yet.
    sending: Option<usize>,
    outcomes: VecDeque<(C, Outcome)>,
    link: Link,
    closing: bool,
    /// End of the last activity on the line: computed for what we sent, observed for what we received.
    quiet_from: Instant,
    /// End of our own last exchange.
    exchange_end: Instant,
    last_slave: Option<u8>,
    /// No probe before this.
    probe_free_at: Option<Instant>,
    /// No stop of a slave that is off-line before this.
    offline_stop_at: Option<Instant>,
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
            offline: BTreeSet::new(),
            flight: None,
            aside: BTreeMap::new(),
            resumed: false,
            to_send: None,
            sending: None,
            outcomes: VecDeque::new(),
            link: Link::Opening,
            closing: false,
            quiet_from: Instant::now(),
            exchange_end: Instant::now(),
            last_slave: None,
            probe_free_at: None,
            offline_stop_at: None,
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
        for old in replaced {
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
        if slave > LAST_SLAVE && !self.config.is_mbap() {
            return Err(PortError::NotCarried(format!(
                "{slave} is no address of a slave on a line: 1 to {LAST_SLAVE}"
            )));
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
        // A repetition that waits for its share of the line is worth no probe.
        if self.station(slave).was_stopped_in_vain() && self.offline_stop_at.is_some_and(|at| at > now) {
            return;
        }
        let Some(flight) = self.flight.take_if(|flight| matches!(flight.purpose, Purpose::Probe)) else {
            return;
        };
        self.exchange.abandon();
        self.to_send = None;
        self.fear_late_answer(now, &flight);
        self.station(flight.slave).probe_again(now);
        self.quiet_from = self.quiet_from.max(now);
        self.exchange_end = self.quiet_from;
    }

    /// The caller of a request is gone.
    pub fn withdraw(&mut self, ticket: Ticket) {
        if let Some(entry) = self.schedule.withdraw(ticket) {
            self.station(entry.slave).stats.outcomes.withdrawn += 1;
            return;
        }
        let aside = self.aside.values_mut().map(|aside| &mut aside.flight);
        for flight in self.flight.iter_mut().chain(aside) {
            if let Purpose::Call(call) = &mut flight.purpose {
                call.take_if(|entry| entry.ticket == ticket);
            }
        }
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
                if self.flight.is_some() {
                    self.to_send = Some(bytes);
                }
            }
            Step::Wait(at) => self.put_aside(now, at),
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

    /// When the last exchange ended on the line: what [`poll_outcome`](Self::poll_outcome) gives now is as old as that.
    #[must_use]
    pub const fn exchange_end(&self) -> Instant {
        self.exchange_end
    }

    /// A slave has said what its link has counted.
    pub(crate) fn note_link_counters(&mut self, slave: u8, counters: LinkCounters) {
        self.station(slave).stats.link = Some(counters);
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
