//! One slave of the line: a model, the counters of its serial port, and what a test does to it.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use bytes::Bytes;
use drive_core::registers::{Place, Space};
use tokio::time::Instant;

use crate::{
    habits::LinkHabits,
    model::{Cast, Damage, Dialect, Exception, Model, Observation, Played, Says},
    pdu::{self, DIAGNOSTICS, EVENT_COUNTER, EXCEPTION},
    record::Breach,
    speech::{Content, Speech},
    unite::{self, LinkCounters},
    world::{Intervened, Intervention},
};

/// Requests that a slave remembers, and as many interventions of others.
const REMEMBERED: usize = 256;
/// Line feed, the last character of an ASCII frame until function 08/03 changes it.
pub(crate) const LINE_FEED: u8 = b'\n';

/// A request that a slave took.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Received {
    /// When its last bit was on the wire.
    pub at: Instant,
    /// To it alone or to all.
    pub cast: Cast,
    /// The request from the function code on, without address and check. For UNI-TELWAY the UNI-TE request.
    pub pdu: Bytes,
}

/// The counters that function 08 reads (MODBUS over Serial Line V1.02 p. 35; VVDED397054 p. 19). What the line
/// counts for all its slaves is passed in and kept here as the value at the last reset.
#[derive(Debug, Clone, Copy, Default)]
struct Counters {
    line_base: LineCounters,
    exceptions: u16,
    addressed: u16,
    broadcasts: u16,
    /// Of function 0Bh: messages carried out, without exceptions and without the request for this counter itself.
    events: u16,
}

/// What every slave counts alike, because every slave hears every frame.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LineCounters {
    pub(crate) good: u64,
    pub(crate) bad: u64,
}

/// What a test has ordered for the answers of a slave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
enum Hold {
    #[default]
    No,
    Next,
    Held(Vec<u8>),
}

pub(crate) struct Slave {
    model: Box<dyn Model>,
    /// Where it was put on the line.
    address: u8,
    /// How it speaks and listens.
    dialect: Dialect,
    /// Until when the model's time has passed.
    advanced: Instant,
    counters: Counters,
    listen_only: bool,
    delimiter: u8,
    turnaround: Option<Duration>,
    /// The end of its last answer, or of a request to all.
    pause_from: Option<Instant>,
    deaf_for: Duration,
    habits: LinkHabits,
    busy_until: Option<Instant>,
    connected: bool,
    powered: bool,
    hold: Hold,
    refuses: Option<Exception>,
    requests: BTreeMap<u8, u64>,
    received: VecDeque<Received>,
    interventions: VecDeque<Intervened>,
}

impl Slave {
    pub(crate) fn new(
        mut model: Box<dyn Model>,
        address: u8,
        dialect: Dialect,
        now: Instant,
        line: LineCounters,
    ) -> Self {
        model.join(address, dialect.protocol);
        Self {
            model,
            address,
            dialect,
            advanced: now,
            counters: Counters { line_base: line, ..Counters::default() },
            listen_only: false,
            delimiter: LINE_FEED,
            turnaround: None,
            pause_from: None,
            deaf_for: Duration::ZERO,
            habits: LinkHabits::default(),
            busy_until: None,
            connected: true,
            powered: true,
            hold: Hold::No,
            refuses: None,
            requests: BTreeMap::new(),
            received: VecDeque::new(),
            interventions: VecDeque::new(),
        }
    }

    /// The model at this moment. Time never runs back: a frame is carried out at the moment of its last bit, which is
    /// a little ahead of whoever looks at the same time.
    pub(crate) fn at(&mut self, now: Instant) -> &mut dyn Model {
        let elapsed = now.saturating_duration_since(self.advanced);
        if !elapsed.is_zero() {
            self.model.advance(elapsed);
            self.advanced = now;
        }
        &mut *self.model
    }

    /// Takes a request that ended now, to this address or to all; what is said to it.
    pub(crate) fn asked(
        &mut self,
        now: Instant,
        address: u8,
        request: &[u8],
        cast: Cast,
        line: LineCounters,
    ) -> Option<Speech> {
        let (content, turnaround) = match self.play(now, request, cast) {
            Some(Played { after, says: Says::Message(message) }) => (Content::Message(message), after),
            Some(Played { after, says: Says::Characters(characters) }) => {
                (Content::Signal(characters), after)
            }
            Some(Played { says: Says::Nothing, .. }) => return None,
            None => {
                let answer = self.request(now, request, cast, line)?;
                (Content::Message(answer), self.turnaround())
            }
        };
        // Nobody answers a request to all.
        let speech = Speech { slave: address, content, heard: now, turnaround, is_to_another: false };
        (cast == Cast::Unicast).then_some(speech)
    }

    /// What a recording says to a request that it hears; `None`: this is none.
    fn play(&mut self, now: Instant, request: &[u8], cast: Cast) -> Option<Played> {
        let is_connected = self.is_connected(now);
        let played = self.model.play(request, cast)?;
        if !is_connected || !self.hears(now, request, cast) {
            return Some(Played { after: Duration::ZERO, says: Says::Nothing });
        }
        Some(played)
    }

    /// Takes a request; the PDU of the answer, if one is given.
    fn request(&mut self, now: Instant, request: &[u8], cast: Cast, line: LineCounters) -> Option<Vec<u8>> {
        let &function = request.first()?;
        if !self.hears(now, request, cast) {
            return None;
        }
        let allowed = cast == Cast::Unicast || self.model.rules().broadcast.contains(&function);
        let answer = match function {
            _ if !allowed => return None,
            DIAGNOSTICS if !self.model.rules().diagnostics.is_empty() => self.diagnose(request, line),
            _ if self.listen_only => return None,
            _ if cast == Cast::Unicast && self.is_busy(now) => Err(Exception::BUSY),
            EVENT_COUNTER if self.model.rules().event_counter => {
                let [high, low] = self.counters.events.to_be_bytes();
                Ok(Some(vec![EVENT_COUNTER, 0, 0, high, low]))
            }
            _ => pdu::answer(&mut *self.model, request, cast).map(Some),
        };
        let answer = match cast {
            Cast::Unicast => self.refuses.take().map_or(answer, Err),
            Cast::Broadcast => answer,
        };
        match &answer {
            Ok(_) if function != EVENT_COUNTER => self.counters.events = self.counters.events.wrapping_add(1),
            Ok(_) => {}
            Err(_) => self.counters.exceptions = self.counters.exceptions.wrapping_add(1),
        }
        if cast == Cast::Broadcast {
            return None;
        }
        let answer = answer.unwrap_or_else(|Exception(code)| Some(vec![function | EXCEPTION, code]))?;
        self.unless_held(answer)
    }

    /// Takes a UNI-TE request; the answer, if one is given, and after how long it is ready. A drive without UNI-TE hears
    /// nothing.
    pub(crate) fn unite(
        &mut self,
        now: Instant,
        request: &[u8],
        counters: &mut LinkCounters,
    ) -> Option<(Vec<u8>, Duration)> {
        self.model.unite()?;
        match self.play(now, request, Cast::Unicast) {
            Some(Played { after, says: Says::Message(reply) }) => return Some((reply, after)),
            Some(_) => return None,
            None => {}
        }
        if !self.hears(now, request, Cast::Unicast) {
            return None;
        }
        let answer = unite::answer(&mut *self.model, request, counters);
        let answer = if self.refuses.take().is_some() { unite::REFUSED.to_vec() } else { answer };
        Some((self.unless_held(answer)?, self.habits.works_for))
    }

    /// Notes that a frame for this slave came, unless it cannot hear it; the model is then at `now`.
    pub(crate) fn hears(&mut self, now: Instant, request: &[u8], cast: Cast) -> bool {
        if !self.is_connected(now) {
            return false;
        }
        self.model.frame_seen(cast);
        let counter = match cast {
            Cast::Unicast => &mut self.counters.addressed,
            Cast::Broadcast => &mut self.counters.broadcasts,
        };
        *counter = counter.wrapping_add(1);
        if let Some(&function) = request.first() {
            *self.requests.entry(function).or_default() += 1;
        }
        if self.received.len() == REMEMBERED {
            self.received.pop_front();
        }
        self.received.push_back(Received { at: now, cast, pdu: Bytes::copy_from_slice(request) });
        true
    }

    pub(crate) fn speaks_unite(&self) -> bool {
        self.model.unite().is_some()
    }

    /// Whether it can be heard on the line at all.
    pub(crate) fn is_connected(&mut self, now: Instant) -> bool {
        let listens = self.at(now).listens();
        self.connected && self.powered && listens
    }

    /// The answer itself, or nothing while a test holds it.
    pub(crate) fn unless_held(&mut self, answer: Vec<u8>) -> Option<Vec<u8>> {
        if self.hold == Hold::Next {
            self.hold = Hold::Held(answer);
            return None;
        }
        Some(answer)
    }

    /// Function 08. `Ok(None)`: carried out, and no answer is due.
    fn diagnose(&mut self, request: &[u8], line: LineCounters) -> Result<Option<Vec<u8>>, Exception> {
        let [_, high, low, ref data @ ..] = *request else { return Err(Exception::ILLEGAL_VALUE) };
        let sub_code = u16::from_be_bytes([high, low]);
        if self.listen_only && sub_code != 0x01 {
            return Ok(None);
        }
        if !self.model.rules().diagnostics.contains(&sub_code) {
            return Err(Exception::ILLEGAL_FUNCTION);
        }
        let counter = match (sub_code, data) {
            (0x00, _) => return Ok(Some(request.to_vec())),
            (0x01, [0x00 | 0xFF, 0x00]) => {
                self.reset_counters(line);
                self.listen_only = false;
                return Ok(Some(request.to_vec()));
            }
            (0x03, &[delimiter, 0x00]) => {
                self.delimiter = delimiter;
                return Ok(Some(request.to_vec()));
            }
            (0x04, [0x00, 0x00]) => {
                self.listen_only = true;
                return Ok(None);
            }
            (0x0A, [0x00, 0x00]) => {
                self.reset_counters(line);
                return Ok(Some(request.to_vec()));
            }
            (0x0B, [0x00, 0x00]) => since(line.good, self.counters.line_base.good),
            (0x0C, [0x00, 0x00]) => since(line.bad, self.counters.line_base.bad),
            (0x0D, [0x00, 0x00]) => self.counters.exceptions,
            (0x0E, [0x00, 0x00]) => self.counters.addressed,
            (0x0F, [0x00, 0x00]) => self.counters.broadcasts,
            // Negative acknowledges, busy answers and lost characters: a simulated drive has none.
            (0x10..=0x12, [0x00, 0x00]) => 0,
            _ => return Err(Exception::ILLEGAL_VALUE),
        };
        let [first, second] = counter.to_be_bytes();
        Ok(Some(vec![DIAGNOSTICS, high, low, first, second]))
    }

    fn reset_counters(&mut self, line: LineCounters) {
        self.counters = Counters { line_base: line, ..Counters::default() };
    }

    pub(crate) const fn dialect(&self) -> Dialect {
        self.dialect
    }

    pub(crate) fn set_dialect(&mut self, dialect: Dialect, line: LineCounters) {
        self.dialect = dialect;
        self.model.join(self.address, dialect.protocol);
        self.reset_counters(line);
    }

    pub(crate) fn turnaround(&self) -> Duration {
        self.turnaround.unwrap_or(self.model.rules().turnaround)
    }

    pub(crate) const fn delimiter(&self) -> u8 {
        self.delimiter
    }

    pub(crate) fn observe(&mut self, now: Instant) -> Observation {
        self.at(now).observe()
    }

    pub(crate) fn power(&mut self, now: Instant, on: bool, line: LineCounters) {
        if on == self.powered {
            return;
        }
        self.powered = on;
        self.at(now).power(on);
        self.reset_counters(line);
        self.listen_only = false;
        self.delimiter = LINE_FEED;
        self.hold = Hold::No;
    }

    /// The address at which it takes requests: the one that it has given itself, or where it was put.
    pub(crate) fn address(&self) -> u8 {
        self.model.own_address().unwrap_or(self.address)
    }

    /// Something ended after which the slave needs its pause.
    pub(crate) const fn pause_from(&mut self, at: Instant) {
        self.pause_from = Some(at);
    }

    /// Whether it does not hear a frame that began at this moment, because it is still busy with its last answer.
    pub(crate) fn is_deaf(&self, began: Option<Instant>) -> bool {
        let deaf_until =
            self.pause_from.map(|from| from + self.deaf_for).filter(|_| !self.deaf_for.is_zero());
        began.zip(deaf_until).is_some_and(|(began, until)| began < until)
    }

    pub(crate) const fn set_deaf_for(&mut self, pause: Duration) {
        self.deaf_for = pause;
    }

    /// How a frame that began at this moment broke the slave's pause, if it did.
    pub(crate) fn pause_broken(&self, began: Instant) -> Option<Breach> {
        let (kept, required) = (began.saturating_duration_since(self.pause_from?), self.model.pause());
        (kept < required).then(|| Breach::Pause { slave: self.address(), kept, required })
    }

    pub(crate) fn frame_damaged(&mut self, damage: Damage) {
        if self.connected && self.powered {
            self.model.frame_damaged(damage);
        }
    }

    /// Another master writes one word or coil, by the function that the family has for it.
    pub(crate) fn written_by_another(
        &mut self,
        now: Instant,
        place: Place,
        value: u16,
    ) -> Result<(), Exception> {
        let [[a, b], [c, d]] = [place.address, value].map(u16::to_be_bytes);
        let request = match place.space {
            Space::HoldingRegister if self.model.rules().write_single => {
                vec![pdu::WRITE_SINGLE, a, b, c, d]
            }
            Space::HoldingRegister => vec![pdu::WRITE_MULTIPLE, a, b, 0, 1, 2, c, d],
            Space::Coil => vec![pdu::WRITE_COIL, a, b, if value == 0 { 0 } else { 0xFF }, 0],
            Space::DiscreteInput | Space::InputRegister => return Err(Exception::ILLEGAL_FUNCTION),
        };
        if self.hears(now, &request, Cast::Unicast) {
            pdu::answer(&mut *self.model, &request, Cast::Unicast)?;
        }
        Ok(())
    }

    pub(crate) const fn habits(&self) -> LinkHabits {
        self.habits
    }

    pub(crate) const fn set_habits(&mut self, habits: LinkHabits) {
        self.habits = habits;
    }

    pub(crate) fn is_busy(&self, now: Instant) -> bool {
        self.busy_until.is_some_and(|until| now < until)
    }

    pub(crate) const fn busy_until(&mut self, until: Instant) {
        self.busy_until = Some(until);
    }

    pub(crate) const fn set_turnaround(&mut self, turnaround: Option<Duration>) {
        self.turnaround = turnaround;
    }

    pub(crate) const fn connect(&mut self, connected: bool) {
        self.connected = connected;
    }

    pub(crate) const fn refuse_next(&mut self, exception: Exception) {
        self.refuses = Some(exception);
    }

    pub(crate) fn hold_next(&mut self) {
        self.hold = Hold::Next;
    }

    /// Ends the hold; the answer that was held.
    pub(crate) fn release(&mut self) -> Option<Vec<u8>> {
        match std::mem::take(&mut self.hold) {
            Hold::Held(answer) => Some(answer),
            Hold::No | Hold::Next => None,
        }
    }

    pub(crate) const fn is_holding(&self) -> bool {
        matches!(self.hold, Hold::Held(_))
    }

    pub(crate) fn requests(&self, function: u8) -> u64 {
        self.requests.get(&function).copied().unwrap_or(0)
    }

    pub(crate) fn all_requests(&self) -> u64 {
        self.requests.values().sum()
    }

    pub(crate) fn received(&self) -> Vec<Received> {
        self.received.iter().cloned().collect()
    }

    pub(crate) fn received_since(&self, since: Instant) -> Vec<Received> {
        let newer = self.received.iter().rev().take_while(|request| request.at > since);
        let mut newer: Vec<Received> = newer.cloned().collect();
        newer.reverse();
        newer
    }

    /// Somebody else than the line's master has done something to it.
    pub(crate) fn note(&mut self, at: Instant, what: Intervention) {
        let number = self.interventions.back().map_or(0, |last| last.number + 1);
        if self.interventions.len() == REMEMBERED {
            self.interventions.pop_front();
        }
        self.interventions.push_back(Intervened { number, at, what });
    }

    pub(crate) fn interventions(&self) -> Vec<Intervened> {
        self.interventions.iter().copied().collect()
    }
}

/// What a counter of the line grew by, as the 16-bit counter of a slave shows it.
fn since(now: u64, base: u64) -> u16 {
    u16::try_from(now.saturating_sub(base) & 0xFFFF).unwrap_or(u16::MAX)
}
