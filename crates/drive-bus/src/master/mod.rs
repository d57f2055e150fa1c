//! The master: everything that decides on a line, without a clock and without a port.
//!
//! Inputs are named `handle_…`, `submit`, `withdraw`; outputs `poll_…`. The task feeds it and acts.

mod aside;
mod bound;
mod doubt;
mod far_end;
mod finish;
mod fresh;
mod offline;
mod port;
mod probing;
mod row;
mod second;
mod send;
mod station;
mod waits;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use bytes::Bytes;
use drive_core::{Class, PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::Request;

use crate::{
    answer,
    config::{self, LineConfig, SlaveSettings},
    evidence::{Evidence, Fact, Finding, Known, Over, What},
    exchange::{Answer, Failure, Frame, Machine, Step, Stray},
    pdu,
    record::{Ending, Exchange, Record},
    schedule::{Entry, Rules, Schedule, Ticket},
    shape::Shape,
    stats::Stats,
};

use aside::Aside;
use doubt::Heard;
use far_end::FarEnd;
use fresh::Fresh;
use offline::Offline;
use port::PortState;
use probing::{Probing, Question};
use second::Second;
pub use second::SecondPort;
use station::Station;

/// How a call ends.
pub type Outcome = Result<Answer, PortError>;

/// How long a request waits before it may take an aged turn: the lifetime of a command, and longer than the sweep of a line of
/// 31 drives.
const AGING: Duration = Duration::from_secs(1);

/// How much later than it was seen to come again an answer may come again: as much as the time of a host varies.
const AGAIN: Duration = Duration::from_millis(5);

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

/// What is asked, and by whom.
struct Asked<C> {
    request: Arc<Request<'static>>,
    pdu: Bytes,
    shape: Shape,
    is_write: bool,
    caller: C,
    attempts: u32,
    /// The adapter was asked for its echo on behalf of this request.
    echo_was_read: bool,
    /// The slave refuses to read more along.
    asked_longer: bool,
    /// It went over the second connection too.
    went_second: bool,
    /// What came when it was asked last, which may have been the answer to another read, and how often that was so.
    doubted: Option<(Frame, u32)>,
    /// What became of the last attempt.
    last: Option<PortError>,
}

/// The exchange that is under way.
struct Flight<C> {
    purpose: Purpose<C>,
    slave: u8,
    request: Arc<Request<'static>>,
    shape: Shape,
    /// A check over what it asks.
    asks: u16,
    /// The same, where it writes.
    wrote: Option<u16>,
    /// Somebody's stop, whether he still waits for it or not.
    is_stop: bool,
    /// By how many words the read was lengthened.
    more: u8,
    /// An answer of this shape may be that to an earlier request.
    suspect: bool,
    /// The host was away when its time was over.
    stalled: bool,
    /// How long its answer may take to begin.
    patience: Duration,
    question: Question,
    started: Instant,
    /// The same of its first part, where it was put aside.
    asked_at: Instant,
    /// Its transaction number, where the protocol has one.
    number: Option<u16>,
    /// How many questions in vain the far end owed when it was sent.
    behind: usize,
    sent: Option<Sent>,
}

impl<C> Flight<C> {
    /// What came when it was asked just before, and was told nobody.
    fn doubted(&self) -> Option<Frame> {
        let Purpose::Call(Some(entry)) = &self.purpose else { return None };
        entry.work.doubted.map(|(frame, _)| frame)
    }

    /// What the far end was asked, if it was and somebody is to answer.
    fn asked(&self) -> Option<far_end::Asked> {
        let sent = self.sent.filter(|sent| sent.unanswered_until.is_none())?;
        let &Self { slave, number, shape, .. } = self;
        Some(far_end::Asked { slave, number, shape, at: sent.end, place: sent.place })
    }
}

/// What the port was given.
#[derive(Clone, Copy)]
struct Sending {
    since: Instant,
    characters: usize,
}

#[derive(Clone, Copy)]
struct Sent {
    /// Computed end of transmission.
    end: Instant,
    timeout: Duration,
    /// When the answer is due.
    answer_by: Instant,
    /// When it would be due if the far end owed nothing.
    usually_by: Instant,
    /// Behind what it waits in the far end.
    place: far_end::Place,
    /// Nobody answers; it is over at this time.
    unanswered_until: Option<Instant>,
}

enum Purpose<C> {
    /// Somebody's call; `None` once he has dropped it.
    Call(Option<Entry<Asked<C>>>),
    /// Whether an off-line slave is back.
    Probe,
    /// Whether the adapter echoes.
    EchoRead,
    /// What may still lie in a port that was opened again.
    ThrowAway,
}

impl<C> Master<C> {
    /// A line whose port is not open yet at `now`.
    #[must_use]
    pub fn new(now: Instant, config: LineConfig) -> Self {
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
        let shape = self.exchange.shape(&pdu);
        let asked = Asked {
            request,
            pdu,
            shape,
            is_write,
            caller,
            attempts: 0,
            echo_was_read: false,
            asked_longer: false,
            went_second: false,
            doubted: None,
            last: None,
        };
        let (ticket, replaced) = self
            .schedule
            .push(now, slave, terms, asked)
            .map_err(|_| PortError::QueueFull(self.schedule.len()))?;
        for old in replaced {
            self.drop_unsent(old, PortError::Superseded);
        }
        self.choose_at = None;
        if terms.class == Class::Stop && is_write {
            // By this line whoever measures sees when a stop is there.
            tracing::debug!(slave, "a stop is in the queue of its line");
        }
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
        let last = self.config.protocol.last_address();
        if slave > last {
            return Err(PortError::NotCarried(format!(
                "{slave} is no address of a slave on a line: 1 to {last}"
            )));
        }
        self.exchange.carries(slave, request, terms.class).map_err(PortError::NotCarried)?;
        if let PortState::Down(reason) = &self.port {
            return Err(PortError::LineDown(reason.clone()));
        }
        let is_write = self.exchange.is_write(request);
        self.station(slave).ask(now, request, is_write);
        if terms.class != Class::Stop
            && let Some(at) = self.probe_at(slave)
        {
            return Err(PortError::Offline { retry_in: self.probe_in(now, at) });
        }
        Ok(pdu)
    }

    /// A stop arrives: commands that wait for the same slave would undo it, and no probe is worth its wait.
    fn clear_the_way(&mut self, now: Instant, slave: u8) {
        let overtaken = self.schedule.withdraw_all(|entry| {
            let is_command =
                crate::mutant!("stop-spares-commands", entry.terms.class == Class::Command, false);
            is_command && entry.work.is_write && (slave == 0 || entry.slave == slave)
        });
        for entry in overtaken {
            self.drop_unsent(entry, PortError::Superseded);
        }
        // A repetition that waits for its share of the line is worth no probe.
        if self.offline.stop_at(slave).is_some_and(|at| at > now) {
            return;
        }
        let Some(flight) = self.flight.take_if(|flight| matches!(flight.purpose, Purpose::Probe)) else {
            return;
        };
        self.break_off(now, &flight);
        self.offline.probe_again(now, flight.slave);
    }

    /// The exchange that was under way is given up for a stop.
    fn break_off(&mut self, now: Instant, flight: &Flight<C>) {
        self.exchange.abandon();
        self.count_strays(now);
        self.to_send = None;
        self.record.ended(now, flight.slave, flight.started, Ending::GivenUp);
        self.fear_late_answer(now, flight);
        self.owe(flight);
        // Whatever came behind the request, damaged or cut off here, was its slave's.
        let sent = flight.sent.map(|sent| sent.end);
        let heard = self.heard.map(|(_, until)| until);
        if let Some(until) = heard.filter(|until| sent.is_some_and(|sent| *until > sent)) {
            self.station(flight.slave).spoke(until);
        }
        if !matches!(flight.purpose, Purpose::Probe) {
            self.fresh.in_vain(now);
        }
        self.quiet_from = self.quiet_from.max(now);
        self.exchange_end = self.quiet_from;
    }

    /// What only goes on because the far end owes something is given up for a stop that was not sent yet: behind what is
    /// owed that is the next.
    fn let_stops_through(&mut self, now: Instant) {
        if self.gives_way_at().is_none_or(|at| at > now) {
            return;
        }
        let Some(flight) = self.flight.take() else { return };
        self.break_off(now, &flight);
        match flight.purpose {
            Purpose::Call(Some(entry)) => {
                let waited = flight.sent.map_or(Duration::ZERO, |sent| sent.timeout);
                self.fail(now, entry, Failure::Timeout, waited);
            }
            Purpose::Call(None) => {}
            Purpose::ThrowAway => self.thrown_away(now),
            Purpose::Probe | Purpose::EchoRead => self.offline.probe_again(now, flight.slave),
        }
    }

    /// When the exchange that is under way gives way to a stop that waits, if it does before its time.
    fn gives_way_at(&self) -> Option<Instant> {
        let sent = self.flight.as_ref().filter(|flight| flight.behind > 0)?.sent?;
        let first = |entry: &Entry<Asked<C>>| {
            (entry.work.is_write && entry.work.attempts == 0).then_some(entry.arrived)
        };
        self.schedule.first_stop(first).map(|_| sent.usually_by)
    }

    /// The caller of a request is gone: what is unsent never is, but the write of a stop is sent, and sent again, all the same.
    pub fn withdraw(&mut self, ticket: Ticket) {
        let is_stop = |entry: &Entry<Asked<C>>| {
            let is_stop = entry.terms.class == Class::Stop && entry.work.is_write;
            crate::mutant!("stop-dropped-with-its-caller", is_stop, false)
        };
        if self.schedule.any(|entry| entry.ticket == ticket && is_stop(entry)) {
            return;
        }
        if let Some(entry) = self.schedule.withdraw(ticket) {
            self.station(entry.slave).stats.outcomes.withdrawn += 1;
            return;
        }
        let aside = self.aside.values_mut().map(|aside| &mut aside.flight);
        for flight in self.flight.iter_mut().chain(aside) {
            if let Purpose::Call(call) = &mut flight.purpose {
                call.take_if(|entry| entry.ticket == ticket && !is_stop(entry));
            }
        }
    }

    /// Bytes came in.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let goes_on = self.heard.filter(|(_, until)| now < *until + self.config.silence());
        self.heard = Some((goes_on.map_or(now, |(since, _)| since), now));
        self.fresh.heard(now);
        self.quiet_from = self.quiet_from.max(now);
        if self.flight.is_some() {
            self.record.heard(bytes);
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
        let unanswered =
            self.flight.as_ref().and_then(|flight| flight.sent).and_then(|sent| sent.unanswered_until);
        if unanswered.is_some_and(|until| now >= until) {
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
        let unanswered =
            self.flight.as_ref().and_then(|flight| flight.sent).and_then(|sent| sent.unanswered_until);
        let exchange = if unanswered.is_some() { unanswered } else { self.exchange.deadline() };
        let second = self.second.deadline();
        [exchange, second, self.choose_at, self.gives_way_at(), self.mute_at(), self.schedule.next_expiry()]
            .into_iter()
            .flatten()
            .min()
    }

    fn act(&mut self, now: Instant, step: Step) {
        self.count_strays(now);
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

    fn count_strays(&mut self, now: Instant) {
        for stray in self.exchange.take_strays() {
            match stray {
                Stray::Echo => self.stats.echoes += 1,
                Stray::Noise(bytes) => self.stats.noise_bytes += bytes as u64,
                Stray::Early { slave, frame } => {
                    let station = self.station(slave);
                    station.stats.early += 1;
                    let heard = station.heard(now, frame, false);
                    self.evidence.stray(now, Over::First, slave, What::Early);
                    self.note_heard(now, slave, heard);
                }
                Stray::Frame { slave, function, frame, is_request, number, nobody } => {
                    if number == Some(0) && self.exchange.number() != Some(0) {
                        self.evidence.stray(now, Over::First, slave, What::NumberZero);
                    }
                    let took = self.far_end.took(now, number).filter(|_| !nobody);
                    let given_up = self.far_end.heard(now, slave, number, frame.shape, nobody);
                    let was_owed = given_up.is_some();
                    // Its number says which question it answers, so that what it has taken is what such a question takes. A
                    // gateway is waited for so long all the same: the time that a stop waits behind it has it in it.
                    let wait = self.far_end.wait();
                    if let (Some(took), Some(station)) = (took, self.stations.get_mut(&slave)) {
                        station.timeout.allow((took * 5 / 4).min(wait));
                        station.timeout.answered(took);
                    }
                    if was_owed && !nobody && number.is_some() && self.stations.contains_key(&slave) {
                        self.note_alive(now, slave);
                    }
                    self.nobody_answered(now, given_up.unwrap_or_default());
                    self.count_frame(now, (slave, function, frame, is_request), was_owed);
                }
            }
        }
    }

    fn count_frame(
        &mut self,
        now: Instant,
        (slave, function, frame, is_request): (u8, u8, Frame, bool),
        was_owed: bool,
    ) {
        if let Some(flight) = self.flight.as_mut().filter(|flight| flight.slave == slave) {
            // Two masters have asked for the same; whose answer comes first nobody knows.
            flight.suspect |= is_request && frame.shape == flight.shape;
        }
        let asked = self.flight.as_ref().filter(|flight| flight.slave == slave);
        let asked = asked.map(|flight| flight.request.function_code().value());
        let confuses = self.exchange.confuses_late_answers();
        let with_next = asked.is_some();
        let Some(station) = self.stations.get_mut(&slave) else {
            self.stats.foreign += 1;
            let what = if is_request { What::OthersRequest } else { What::OthersAnswer };
            self.evidence.stray(now, Over::First, slave, what);
            return;
        };
        let heard = if confuses { station.heard(now, frame, is_request) } else { Heard::default() };
        let late = heard.was_owed;
        self.evidence.stray(
            now,
            Over::First,
            slave,
            match &heard {
                _ if is_request => What::OthersRequest,
                _ if was_owed || late => What::Late { with_next },
                heard if heard.withdraws.is_some() => What::Contradicted,
                heard if heard.again_after.is_some() => What::Doubled,
                _ => What::OthersAnswer,
            },
        );
        if was_owed && !late {
            station.stats.late += 1;
            return;
        }
        if late {
            station.heard_late(now);
            self.offline.hope(now, slave);
        }
        match asked {
            _ if late => station.stats.late += 1,
            Some(asked) if function & 0x7F != asked => station.stats.wrong_function += 1,
            Some(_) => station.stats.wrong_count += 1,
            None => self.stats.foreign += 1,
        }
        self.note_heard(now, slave, heard);
    }

    /// What a frame says of those before it.
    fn note_heard(&mut self, now: Instant, slave: u8, heard: Heard) {
        if let Some(after) = heard.again_after {
            let known = self.again.filter(|(_, until)| *until > now).map(|(again, _)| again);
            self.again =
                Some((known.unwrap_or(config::DOUBLE).max(after * 5 / 4 + AGAIN), now + doubt::MEMORY));
        }
        if let Some(asked_at) = heard.withdraws {
            let station = self.station(slave);
            station.stats.retracted += 1;
            station.retracted = Some(asked_at);
            self.retractions += 1;
        }
    }

    /// When the last value of a slave was asked for that another answer has withdrawn.
    pub(crate) fn retracted(&self, slave: u8) -> Option<Instant> {
        self.stations.get(&slave)?.retracted
    }

    /// How many values were withdrawn so far, of all slaves.
    pub(crate) const fn retractions(&self) -> u64 {
        self.retractions
    }

    /// When the last question began that a slave has answered.
    pub(crate) fn answered_at(&self, slave: u8) -> Option<Instant> {
        self.stations.get(&slave)?.answered_at
    }

    /// The next call that has ended.
    pub fn poll_outcome(&mut self) -> Option<(C, Outcome)> {
        self.outcomes.pop_front()
    }

    /// When the last exchange began: what [`poll_outcome`](Self::poll_outcome) gives now is not older than that, and nobody
    /// knows by how much it is younger.
    #[must_use]
    pub const fn asked_at(&self) -> Instant {
        self.asked_at
    }

    /// A slave has said what its link has counted.
    #[cfg(feature = "unitelway")]
    pub(crate) fn note_link_counters(&mut self, slave: u8, counters: drive_unitelway::LinkCounters) {
        self.station(slave).stats.link = Some(counters);
    }

    /// What was counted so far, at `now`.
    #[must_use]
    pub fn stats(&self, now: Instant) -> Stats {
        let mut stats = self.stats.clone();
        stats.elapsed = self.opened_at.map_or(Duration::ZERO, |opened| now.saturating_duration_since(opened));
        stats.queued = self.schedule.len();
        stats.echoing = self.exchange.echoes();
        stats.worst_case_stop = self.learned_worst_case_stop();
        stats.far_end = self.far_end.stats(self.second.told(), self.second.stops);
        stats.away = self.port.away().map(str::to_owned);
        stats.slaves = self
            .stations
            .iter()
            .filter(|(slave, _)| **slave != 0)
            .map(|(slave, station)| {
                let mut stats = station.stats.clone();
                stats.response_timeout = station.timeout.current();
                stats.offline = self.offline.contains(*slave);
                stats.next_probe = self.probe_at(*slave).map(|at| self.probe_in(now, at));
                (*slave, stats)
            })
            .collect();
        stats
    }

    /// What was heard last that is no plain answer, the oldest first.
    #[must_use]
    pub fn evidence(&self) -> Vec<Fact> {
        self.evidence.facts()
    }

    /// What is wrong with the line at `now`, by its evidence.
    #[must_use]
    pub fn findings(&self, now: Instant) -> Vec<Finding> {
        self.evidence.findings(Known { now, is_unitelway: self.config.protocol.name() == "unitelway" })
    }

    /// Keeps the last exchanges from now on.
    pub fn keep_exchanges(&mut self, count: usize) {
        self.record.keep(count);
    }

    /// The exchanges that are kept, the oldest first.
    #[must_use]
    pub fn exchanges(&self) -> Vec<Exchange> {
        self.record.exchanges()
    }

    fn station(&mut self, slave: u8) -> &mut Station {
        let config = &self.config;
        self.stations.entry(slave).or_insert_with(|| {
            Box::new(Station::new(config, config.slaves.get(&slave).copied().unwrap_or_default()))
        })
    }
}
