//! UNI-TELWAY slaves with habits of their own, and their line, in virtual time. Written from the card's manual
//! (VVDED397054 p. 11–13/35–37) and what public slaves of the protocol do, not from our simulator. Every word that is
//! read says which request it answers.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap, VecDeque},
    time::Duration,
};

use drive_bus::{
    LineConfig, Protocol,
    master::{Master, Outcome},
    protocol::{NetworkHeader, UniTelwaySettings},
};
use drive_core::{Class, PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::{MS, rig::Random, unitelway::serial};

const ACK: u8 = 0x06;
const NAK: u8 = 0x15;
const EOT: u8 = 0x04;

/// What a slave does with a reply whose acknowledgement it has not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unacknowledged {
    /// Says it again at the next poll, until another request comes.
    Repeats,
    /// Gives it up as soon as anything but a refusal comes.
    Forgets,
    /// Keeps it, and the replies to later requests behind it.
    Queues,
    /// Keeps it, and takes no request before it is gone.
    Refuses,
}

/// How a slave behaves. Every combination is lawful.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Habits {
    pub(crate) unacknowledged: Unacknowledged,
    /// Silence, and not EOT, where it has nothing to say yet.
    pub(crate) silent: bool,
    /// Before each of its words.
    pub(crate) delay: Duration,
    /// From a request to its reply.
    pub(crate) work: Duration,
    /// It refuses all requests for the second of these times in every first.
    pub(crate) busy: Option<(Duration, Duration)>,
    pub(crate) header: NetworkHeader,
    /// Whether it knows the request FAh.
    pub(crate) mirrors: bool,
}

impl Habits {
    /// What most slaves do.
    pub(crate) fn plain() -> Self {
        Self {
            unacknowledged: Unacknowledged::Repeats,
            silent: false,
            delay: 2 * MS,
            work: 4 * MS,
            busy: None,
            header: NetworkHeader::default(),
            mirrors: true,
        }
    }
}

/// What goes wrong, each once in so many; 0: never.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Faults {
    /// The acknowledgement of a reply is lost.
    pub(crate) lost_ack: u64,
    pub(crate) lost_reply: u64,
    pub(crate) damaged_reply: u64,
    /// None of these three happens twice running.
    pub(crate) once: bool,
    /// How many of these three may still happen; `None`: any number.
    pub(crate) left: Option<u32>,
    /// Anything, either way, is lost, or a bit of it changes.
    pub(crate) anything: u64,
}

type OnItsWay = (Instant, u64, bool, Vec<u8>);

struct Slave {
    habits: Habits,
    /// Replies, and when they are ready.
    outbox: VecDeque<(Instant, Vec<u8>)>,
    /// Its reply was the last thing on the line.
    awaits_word: bool,
}

/// A request that a slave has carried out.
struct Done {
    slave: u8,
    at: Instant,
    what: What,
}

#[derive(PartialEq, Eq, Debug)]
enum What {
    Read { first: u16, quantity: u16 },
    Write { address: u16, value: u16 },
}

struct Asked {
    slave: u8,
    request: Request<'static>,
    class: Class,
    at: Instant,
}

/// A call that ended.
pub(crate) struct Ended {
    pub(crate) call: u64,
    pub(crate) slave: u8,
    pub(crate) class: Class,
    pub(crate) took: Duration,
    pub(crate) outcome: Outcome,
}

pub(crate) struct Telway {
    pub(crate) master: Master<u64>,
    pub(crate) now: Instant,
    pub(crate) start: Instant,
    pub(crate) random: Random,
    pub(crate) faults: Faults,
    /// One of the three faults was the last thing that could happen.
    happened: bool,
    slaves: BTreeMap<u8, Slave>,
    /// What is on its way: when it has come, in which order, to the master or to the slaves.
    wire: BinaryHeap<Reverse<OnItsWay>>,
    order: u64,
    asked: BTreeMap<u64, Asked>,
    calls: u64,
    done: Vec<Done>,
    /// Data frames of the master: to whom, when, the UNI-TE request.
    pub(crate) requests: Vec<(u8, Instant, Vec<u8>)>,
    /// The slaves have the line until then.
    spoken_until: Instant,
    /// How often anything was lost or damaged.
    pub(crate) spoilt: usize,
}

pub(crate) fn config(settings: UniTelwaySettings) -> LineConfig {
    LineConfig { protocol: Protocol::UniTelway(settings), ..LineConfig::stream(serial()) }
}

impl Telway {
    pub(crate) fn new(seed: u64, config: LineConfig, habits: impl IntoIterator<Item = Habits>) -> Self {
        let start = Instant::now();
        let mut master = Master::new(start, config);
        master.handle_up(start);
        let slave = |habits| Slave { habits, outbox: VecDeque::new(), awaits_word: false };
        Self {
            master,
            now: start,
            start,
            random: Random::new(seed),
            faults: Faults::default(),
            happened: false,
            slaves: (1..).zip(habits.into_iter().map(slave)).collect(),
            wire: BinaryHeap::new(),
            order: 0,
            asked: BTreeMap::new(),
            calls: 0,
            done: Vec::new(),
            requests: Vec::new(),
            spoken_until: start,
            spoilt: 0,
        }
    }

    /// Leaves a reply to an earlier master in a slave.
    pub(crate) fn leave_reply(&mut self, slave: u8, unite: &[u8]) {
        let slave = self.slaves.get_mut(&slave).unwrap();
        slave.outbox.push_back((self.now, message(slave.habits.header, unite)));
    }

    pub(crate) fn call(
        &mut self,
        slave: u8,
        request: Request<'static>,
        terms: Terms,
    ) -> Result<u64, PortError> {
        let call = self.calls;
        self.calls += 1;
        self.master.submit(self.now, slave, request.clone(), terms, call)?;
        self.asked.insert(call, Asked { slave, request, class: terms.class, at: self.now });
        Ok(call)
    }

    /// A read of words that say which request they answer.
    pub(crate) fn read(&mut self, slave: u8, quantity: u16, class: Class) -> Result<u64, PortError> {
        self.call(slave, Request::ReadHoldingRegisters(450, quantity), Terms::of(class))
    }

    /// A write of a value that no other write has.
    pub(crate) fn write(&mut self, slave: u8, class: Class) -> Result<u64, PortError> {
        let value = self.calls as u16;
        self.call(slave, Request::WriteSingleRegister(400, value), Terms::of(class))
    }

    /// The number of calls that have not ended.
    pub(crate) fn waiting(&self, slave: u8) -> usize {
        self.asked.values().filter(|asked| asked.slave == slave).count()
    }

    pub(crate) fn carried_out(&self) -> usize {
        self.done.len()
    }

    /// Lets everything happen for this long, or until a call ends.
    pub(crate) fn run_for(&mut self, time: Duration) -> Option<Ended> {
        let until = self.now + time;
        let mut standing_still = 0;
        loop {
            if let Some(ended) = self.step() {
                return Some(ended);
            }
            let next = [self.master.deadline(), self.wire.peek().map(|Reverse((at, ..))| *at)];
            let Some(next) = next.into_iter().flatten().min().filter(|next| *next <= until) else { break };
            standing_still = if next > self.now { 0 } else { standing_still + 1 };
            assert!(standing_still < 1_000, "livelock at {:?}", self.now - self.start);
            self.now = self.now.max(next);
        }
        self.now = until;
        None
    }

    /// Lets everything happen until this call ends.
    pub(crate) fn outcome(&mut self, call: u64) -> Ended {
        loop {
            let ended = self.run_for(Duration::from_secs(600)).expect("every call ends");
            if ended.call == call {
                return ended;
            }
        }
    }

    fn step(&mut self) -> Option<Ended> {
        while self.wire.peek().is_some_and(|Reverse((at, ..))| *at <= self.now) {
            let Reverse((at, _, to_master, bytes)) = self.wire.pop()?;
            if to_master {
                self.master.handle_bytes(self.now, &bytes);
            } else {
                self.heard(at, &bytes);
            }
        }
        self.master.handle_timeout(self.now);
        if let Some(ended) = self.collect() {
            return Some(ended);
        }
        if let Some(bytes) = self.master.poll_transmit(self.now) {
            self.transmitted(bytes.to_vec());
            self.master.handle_sent(self.now);
        }
        self.collect()
    }

    fn collect(&mut self) -> Option<Ended> {
        let (call, outcome) = self.master.poll_outcome()?;
        let asked = self.asked.remove(&call).expect("every call ends once");
        self.check(&asked, &outcome);
        let Asked { slave, class, at, .. } = asked;
        Some(Ended { call, slave, class, took: self.now - at, outcome })
    }

    fn transmitted(&mut self, mut bytes: Vec<u8>) {
        // A stop does not hear out the answer to a probe.
        let stops = self.asked.values().any(|asked| asked.class == Class::Stop);
        assert!(stops || self.now >= self.spoken_until, "{bytes:02X?} over a slave's words");
        let end = self.now + serial().characters(bytes.len());
        if let [0x10, 0x02, address, ..] = bytes[..] {
            let unite = undoubled(&bytes).map(|data| split(&data).1.to_vec()).unwrap();
            self.requests.push((address, self.now, unite));
        }
        let answers_reply = bytes == [ACK] && self.slaves.values().any(|slave| slave.awaits_word);
        let over_words = self.now < self.spoken_until;
        let lost = answers_reply && self.happens(self.faults.lost_ack);
        if lost || over_words || self.spoils(&mut bytes) {
            bytes.clear();
        }
        self.put(end, false, bytes);
    }

    fn happens(&mut self, one_in: u64) -> bool {
        let Faults { once, left, .. } = self.faults;
        let happens = self.random.one_in(one_in) && !(once && self.happened) && left != Some(0);
        if one_in > 0 {
            self.happened = happens;
        }
        if happens {
            self.spoilt += 1;
            self.faults.left = left.map(|left| left - 1);
        }
        happens
    }

    /// Damages it; true: it is lost.
    fn spoils(&mut self, bytes: &mut [u8]) -> bool {
        if !self.random.one_in(self.faults.anything) || bytes.is_empty() {
            return false;
        }
        self.spoilt += 1;
        let bit = self.random.below(bytes.len() as u64 * 8) as usize;
        bytes[bit / 8] ^= 1 << (bit % 8);
        self.random.one_in(2)
    }

    fn put(&mut self, at: Instant, to_master: bool, bytes: Vec<u8>) {
        self.order += 1;
        self.wire.push(Reverse((at, self.order, to_master, bytes)));
    }

    fn says(&mut self, address: u8, at: Instant, mut bytes: Vec<u8>) {
        let slave = &self.slaves[&address];
        let end = at + slave.habits.delay + serial().characters(bytes.len());
        let is_reply = bytes.len() > 1;
        let damaged = is_reply && self.happens(self.faults.damaged_reply);
        if damaged {
            // Not its beginning, which would make nothing of it: that is a lost one.
            let at = 4 + self.random.below(bytes.len() as u64 - 4) as usize;
            bytes[at] ^= 1 << self.random.below(8);
        }
        let lost = is_reply && self.happens(self.faults.lost_reply);
        // Two bits that change can undo each other in the check, which is a sum.
        if !(lost || !damaged && self.spoils(&mut bytes)) {
            self.put(end, true, bytes);
        }
        self.spoken_until = end;
    }

    /// The slaves hear something of the master's.
    fn heard(&mut self, at: Instant, bytes: &[u8]) {
        if let [signal] = bytes {
            for slave in self.slaves.values_mut().filter(|slave| slave.awaits_word) {
                if [ACK, NAK].contains(signal) {
                    slave.awaits_word = false;
                }
                if *signal == ACK {
                    slave.outbox.pop_front();
                }
            }
            return;
        }
        for slave in self.slaves.values_mut().filter(|slave| slave.awaits_word) {
            slave.awaits_word = false;
            if slave.habits.unacknowledged == Unacknowledged::Forgets {
                slave.outbox.pop_front();
            }
        }
        match *bytes {
            [0x10, 0x05, address] => self.polled(at, address),
            [0x10, 0x02, address, ..] if self.slaves.contains_key(&address) => match undoubled(bytes) {
                Some(data) => self.asked_for(at, address, &data),
                None => self.says(address, at, vec![NAK]),
            },
            _ => {}
        }
    }

    fn polled(&mut self, at: Instant, address: u8) {
        let Some(slave) = self.slaves.get_mut(&address) else { return };
        match slave.outbox.front().filter(|(ready, _)| *ready <= at) {
            Some((_, reply)) => {
                let frame = framed(address, reply);
                slave.awaits_word = true;
                self.says(address, at, frame);
            }
            None if slave.habits.silent => {}
            None => self.says(address, at, vec![EOT]),
        }
    }

    fn asked_for(&mut self, at: Instant, address: u8, data: &[u8]) {
        let slave = &self.slaves[&address];
        let Habits { unacknowledged, busy, work, .. } = slave.habits;
        let since = at - self.start;
        let is_busy = busy.is_some_and(|(every, long)| since.as_nanos() % every.as_nanos() < long.as_nanos());
        if is_busy || (unacknowledged == Unacknowledged::Refuses && !slave.outbox.is_empty()) {
            return self.says(address, at, vec![NAK]);
        }
        let (header, unite) = split(data);
        let reply = [header, &self.carry_out(at, address, unite)].concat();
        let slave = self.slaves.get_mut(&address).unwrap();
        if unacknowledged != Unacknowledged::Queues {
            slave.outbox.clear();
        }
        // They are made one after the other.
        let from = slave.outbox.back().map_or(at, |(ready, _)| at.max(*ready));
        slave.outbox.push_back((from + work, reply));
        self.says(address, at, vec![ACK]);
    }

    /// The requests of p. 11–12/35–36.
    fn carry_out(&mut self, at: Instant, slave: u8, unite: &[u8]) -> Vec<u8> {
        let word = |low, high| u16::from_le_bytes([low, high]);
        let what = match *unite {
            [0xFA, _, ref data @ ..] if self.slaves[&slave].habits.mirrors => {
                return [&[0xFB], data].concat();
            }
            [0x04, _, a, b] => What::Read { first: word(a, b), quantity: 1 },
            [0x36, _, 0x68, 0x07, a, b, c, d] => What::Read { first: word(a, b), quantity: word(c, d) },
            [0x14, _, a, b, c, d] => What::Write { address: word(a, b), value: word(c, d) },
            _ => return vec![0xFD, 0x01],
        };
        let number = self.done.len() as u16;
        let reply = match what {
            What::Write { .. } => vec![0xFE],
            What::Read { quantity, .. } => {
                let words = (0..quantity).flat_map(|n| number.wrapping_add(n).to_le_bytes());
                let head = if quantity == 1 { vec![0x34] } else { vec![0x66, 0x07] };
                head.into_iter().chain(words).collect()
            }
        };
        self.done.push(Done { slave, at, what });
        reply
    }

    /// What was told as done was done, by this slave, since the call.
    fn check(&self, asked: &Asked, outcome: &Outcome) {
        let Asked { slave, request, at, .. } = asked;
        let since = |done: &&Done| done.slave == *slave && done.at >= *at;
        match outcome {
            Ok(Ok(Response::ReadHoldingRegisters(words))) => {
                let Request::ReadHoldingRegisters(first, quantity) = *request else { panic!("{request:?}") };
                let number = usize::from(words[0]);
                let wraps = (0..).map(|wrap| number + wrap * 0x1_0000).take_while(|n| *n < self.done.len());
                let what = What::Read { first, quantity };
                assert!(
                    wraps.map(|n| &self.done[n]).any(|done| since(&done) && done.what == what),
                    "{request:?} of slave {slave}, asked at {:?}, got the words of another request: {words:?}, {:?}",
                    *at - self.start,
                    self.done.get(number).map(|done| (done.slave, done.at - self.start, &done.what)),
                );
            }
            Ok(Ok(Response::WriteSingleRegister(address, value))) => {
                let what = What::Write { address: *address, value: *value };
                let done = self.done.iter().rev().take_while(|done| done.at >= *at);
                let mut done = done.filter(|done| done.slave == *slave);
                assert!(done.any(|done| done.what == what), "confirmed and not done: {request:?}");
            }
            Ok(other) => panic!("{other:?} to {request:?}"),
            Err(_) => {}
        }
    }
}

fn message(header: NetworkHeader, unite: &[u8]) -> Vec<u8> {
    match header {
        NetworkHeader::Simplified => [&[0][..], unite].concat(),
        NetworkHeader::Standard { .. } => [&[0x20, 0, 0xFE, 0, 0, 0][..], unite].concat(),
    }
}

/// Network header and UNI-TE part of a message.
fn split(data: &[u8]) -> (&[u8], &[u8]) {
    data.split_at(if data[0] == 0x20 { 6 } else { 1 })
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

fn framed(address: u8, data: &[u8]) -> Vec<u8> {
    let doubled = [data.len() as u8].into_iter().chain(data.iter().copied());
    let doubled = doubled.flat_map(|byte| std::iter::repeat_n(byte, if byte == 0x10 { 2 } else { 1 }));
    let mut frame: Vec<u8> = [0x10, 0x02, address].into_iter().chain(doubled).collect();
    frame.push(sum(&frame));
    frame
}

/// The data of a frame whose form and BCC are right.
fn undoubled(frame: &[u8]) -> Option<Vec<u8>> {
    let (check, body) = frame.split_last()?;
    let mut rest = body.get(3..)?.iter();
    let mut data = Vec::new();
    while let Some(byte) = rest.next() {
        if *byte == 0x10 && rest.next() != Some(&0x10) {
            return None;
        }
        data.push(*byte);
    }
    let (length, data) = data.split_first()?;
    (*check == sum(body) && usize::from(*length) == data.len()).then(|| data.to_vec())
}
