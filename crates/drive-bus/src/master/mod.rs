//! The master: everything that decides on a line, without a clock and without a port.
//!
//! Inputs are named `handle_…`, `submit`, `withdraw`; outputs `poll_…`. The task feeds it and acts.

mod admit;
mod aside;
mod believe;
mod bound;
mod doubt;
mod fail;
mod far_end;
mod finish;
mod flight;
mod fresh;
mod give_way;
mod learn;
mod offline;
mod port;
mod probing;
mod row;
mod second;
mod send;
mod station;
mod strays;
mod told;
mod waits;

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use bytes::Bytes;
use drive_core::PortError;
use tokio::time::Instant;

use crate::{
    config::{LineConfig, SlaveSettings},
    evidence::{Evidence, Over},
    exchange::{Answer, Machine, Step},
    record::Record,
    schedule::{Rules, Schedule},
    stats::Stats,
};

use aside::Aside;
use far_end::FarEnd;
use flight::{Asked, Flight, Purpose, Sending, Sent};
use fresh::Fresh;
use offline::Offline;
use port::PortState;
use probing::Probing;
use second::Second;
pub use second::SecondPort;
use station::Station;

/// How a call ends.
pub type Outcome = Result<Answer, PortError>;

/// How long a request waits before it may take an aged turn: the lifetime of a command, and longer than the sweep of a line of
/// 31 drives.
const AGING: Duration = Duration::from_secs(1);

/// The machine of one line. `C` is whoever waits for an answer.
pub struct Master<C> {
    config: LineConfig,
    exchange: Box<dyn Machine>,
    schedule: Schedule<Asked<C>>,
    /// Boxed, because a node of the map has room for eleven.
    stations: BTreeMap<u8, Box<Station>>,
    /// Those that do not answer: they are probed.
    offline: Offline,
    /// After how long answers were seen to come again, and until when that is remembered.
    again: Option<(Duration, Instant)>,
    /// What the last port may have left behind, and whether this one is mute.
    fresh: Fresh,
    /// What the gateway still owes, if there is one.
    far_end: FarEnd,
    /// The connection that stops take besides.
    second: Second,
    flight: Option<Flight<C>>,
    /// Exchanges whose slaves are not ready yet.
    aside: BTreeMap<u8, Aside<C>>,
    /// The last exchange that was sent was one of those: the next turn is another's.
    resumed: bool,
    to_send: Option<Bytes>,
    /// What the port was given and has not confirmed yet.
    sending: Option<Sending>,
    outcomes: VecDeque<(C, Outcome)>,
    port: PortState,
    far_end_paces: bool,
    closing: bool,
    /// End of the last activity on the line: computed for what we sent, observed for what we received.
    quiet_from: Instant,
    /// What was heard last without a silence in it: from when, and until when.
    heard: Option<(Instant, Instant)>,
    /// End of our own last exchange.
    exchange_end: Instant,
    /// When the last exchange that ended was asked.
    asked_at: Instant,
    last_slave: Option<u8>,
    /// When somebody's call was sent last.
    called_at: Option<Instant>,
    probing: Probing,
    /// The lengths of the longest PDUs asked and likely answered so far.
    longest: (usize, usize),
    /// When the schedule wants to be asked again.
    choose_at: Option<Instant>,
    opened_at: Option<Instant>,
    stats: Stats,
    record: Record,
    evidence: Evidence,
    /// How many values were withdrawn.
    retractions: u64,
}

impl<C> Master<C> {
    /// A line whose port is not open yet at `now`.
    #[must_use]
    pub fn new(now: Instant, config: LineConfig) -> Self {
        let config = config.bounded();
        let mut master = Self {
            exchange: config.machine(),
            schedule: Schedule::new(Rules { limit: config.queue_limit, aging: AGING }),
            stations: BTreeMap::new(),
            offline: Offline::default(),
            again: None,
            fresh: Fresh::default(),
            far_end: FarEnd::new(config.far_end()),
            second: Second::new(&config),
            flight: None,
            aside: BTreeMap::new(),
            resumed: false,
            to_send: None,
            sending: None,
            outcomes: VecDeque::new(),
            port: PortState::Opening(None),
            far_end_paces: true,
            closing: false,
            quiet_from: now,
            heard: None,
            called_at: None,
            exchange_end: now,
            asked_at: now,
            last_slave: None,
            probing: Probing::default(),
            longest: (0, 0),
            choose_at: None,
            opened_at: None,
            stats: Stats::default(),
            record: Record::default(),
            evidence: Evidence::default(),
            retractions: 0,
            config,
        };
        master.set_far_end_paces(master.config.endpoint.is_serial());
        master
    }

    /// The configuration.
    #[must_use]
    pub const fn config(&self) -> &LineConfig {
        &self.config
    }

    /// Sets what is special about one slave.
    pub fn configure_slave(&mut self, slave: u8, settings: SlaveSettings) {
        let settings = settings.bounded();
        self.config.slaves.insert(slave, settings);
        if let Some(station) = self.stations.get_mut(&slave) {
            station.configure(&self.config, settings);
        }
    }

    /// Bytes came in.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let goes_on = self.heard.filter(|(_, until)| now < *until + self.config.silence());
        self.heard = Some((goes_on.map_or(now, |(since, _)| since), now));
        self.fresh.heard(now);
        self.quiet_from = self.quiet_from.max(now);
        if self.flight.is_some() {
            self.record.heard(now, bytes);
        }
        self.evidence.heard(now, Over::First, self.flight.is_some(), bytes);
        let step = self.exchange.handle_bytes(now, bytes);
        self.act(now, step);
    }

    /// Whether [`deadline`](Self::deadline) has passed. What lies in the port **must** be handed over before
    /// [`handle_timeout`](Self::handle_timeout) is called then.
    #[must_use]
    pub fn is_over(&self, now: Instant) -> bool {
        self.deadline().is_some_and(|deadline| now >= deadline)
    }

    /// Whether [`poll_transmit`](Self::poll_transmit) may begin an exchange. What lies in the port **must** be handed over
    /// before.
    #[must_use]
    pub fn may_send(&self) -> bool {
        self.flight.is_none() && !self.schedule.is_empty()
    }

    /// Whether the far end of the port takes the time that characters take on a line, see
    /// [`LineConfig::far_end_paces`]. Told before [`handle_up`](Self::handle_up); the configuration comes first.
    pub fn set_far_end_paces(&mut self, paces: bool) {
        self.far_end_paces = self.config.is_paced() && self.config.far_end_paces.unwrap_or(paces);
        self.exchange.set_far_end_paces(self.far_end_paces);
    }

    /// [`deadline`](Self::deadline) has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        for entry in crate::mutant!("command-sent-late", self.schedule.expired(now), Vec::new()) {
            self.drop_unsent(entry, PortError::Expired);
        }
        let given_up = self.far_end.expired(now);
        self.nobody_answered(now, given_up);
        self.let_stops_through(now);
        self.second_timeout(now);
        if self.unanswered_until().is_some_and(|until| now >= until) {
            self.finish_unanswered(now);
        } else if let Some(deadline) = self.exchange.deadline().filter(|deadline| now >= *deadline) {
            let away = now - deadline > self.config.chunk_gap;
            if let Some(flight) = &mut self.flight {
                flight.stalled |= away;
            }
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
        let exchange = self.unanswered_until().or_else(|| self.exchange.deadline());
        let second = self.second.deadline();
        [exchange, second, self.choose_at, self.gives_way_at(), self.mute_at(), self.schedule.next_expiry()]
            .into_iter()
            .flatten()
            .min()
    }

    /// When the time is over of what is under way and nobody answers.
    fn unanswered_until(&self) -> Option<Instant> {
        self.flight.as_ref()?.sent?.unanswered_until
    }

    fn act(&mut self, now: Instant, step: Step) {
        self.count_strays(now);
        match step {
            Step::More => {}
            Step::Send(bytes) => {
                if self.flight.is_some() {
                    self.to_send = Some(bytes);
                }
            }
            Step::Wait(at) => self.put_aside(now, at),
            Step::Done(_) if self.unanswered_until().is_some() => {}
            Step::Done(result) => self.finish(now, result),
        }
    }

    /// The next call that has ended.
    pub fn poll_outcome(&mut self) -> Option<(C, Outcome)> {
        self.outcomes.pop_front()
    }

    fn station(&mut self, slave: u8) -> &mut Station {
        let config = &self.config;
        self.stations.entry(slave).or_insert_with(|| {
            Box::new(Station::new(config, config.slaves.get(&slave).copied().unwrap_or_default()))
        })
    }
}
