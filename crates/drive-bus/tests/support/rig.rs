//! The master and a line of simulated slaves in virtual time: no runtime, no port, no clock. Everything follows from the
//! seed.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
    time::Duration,
};

use drive_bus::{
    Echo, LineConfig,
    exchange::rtu,
    master::{Master, Outcome},
    schedule::Ticket,
};
use drive_core::{Class, PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::MS;

/// A small generator: the same numbers from the same seed, on every machine (xorshift64*).
#[derive(Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) % limit
    }

    pub(crate) fn one_in(&mut self, many: u64) -> bool {
        many > 0 && self.below(many) == 0
    }
}

/// What goes wrong, each once in so many answers; 0: never.
#[derive(Clone, Copy, Default)]
pub(crate) struct Faults {
    pub(crate) lost: u64,
    pub(crate) flipped: u64,
    pub(crate) truncated: u64,
    pub(crate) noise: u64,
    pub(crate) late: u64,
    pub(crate) foreign: u64,
}

pub(crate) struct Rig {
    pub(crate) master: Master<u64>,
    pub(crate) start: Instant,
    pub(crate) now: Instant,
    pub(crate) random: Random,
    pub(crate) faults: Faults,
    pub(crate) dead: BTreeSet<u8>,
    /// The adapter gives back what is sent; one in so many echoes is damaged.
    pub(crate) echo: Option<u64>,
    config: LineConfig,
    /// What will come to the master: time, order, bytes.
    wire: BinaryHeap<Reverse<(Instant, u64, Vec<u8>)>>,
    order: u64,
    asked: BTreeMap<u64, Asked>,
    next_call: u64,
    /// End of the last thing on the wire.
    quiet_from: Instant,
    pub(crate) written: BTreeMap<(u8, u16), u16>,
    pub(crate) counts: Counts,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) sent: u64,
    pub(crate) answered: u64,
    pub(crate) failed: u64,
    pub(crate) shortest_silence: Option<Duration>,
    pub(crate) longest_stop_wait: Duration,
}

struct Asked {
    slave: u8,
    request: Request<'static>,
    class: Class,
    at: Instant,
    ticket: Ticket,
    sent: bool,
    echo_was_read: bool,
}

fn is_write(request: &Request<'_>) -> bool {
    matches!(request, Request::WriteSingleRegister(..))
}

/// The word that a slave has in a register that nobody wrote.
pub(crate) fn word(slave: u8, address: u16) -> u16 {
    (u16::from(slave) << 8 | u16::from(slave)) ^ address.wrapping_mul(0x9E37)
}

impl Rig {
    pub(crate) fn new(seed: u64, config: LineConfig) -> Self {
        let start = Instant::now();
        let mut master = Master::new(start, config.clone());
        master.handle_up(start);
        Self {
            master,
            start,
            now: start,
            random: Random::new(seed),
            faults: Faults::default(),
            dead: BTreeSet::new(),
            echo: None,
            config,
            wire: BinaryHeap::new(),
            order: 0,
            asked: BTreeMap::new(),
            next_call: 0,
            quiet_from: start,
            written: BTreeMap::new(),
            counts: Counts::default(),
        }
    }

    pub(crate) fn read(
        &mut self,
        slave: u8,
        address: u16,
        quantity: u16,
        terms: Terms,
    ) -> Result<u64, PortError> {
        self.call(slave, Request::ReadHoldingRegisters(address, quantity), terms)
    }

    pub(crate) fn write(
        &mut self,
        slave: u8,
        address: u16,
        value: u16,
        terms: Terms,
    ) -> Result<u64, PortError> {
        self.call(slave, Request::WriteSingleRegister(address, value), terms)
    }

    fn call(&mut self, slave: u8, request: Request<'static>, terms: Terms) -> Result<u64, PortError> {
        let call = self.next_call;
        self.next_call += 1;
        let ticket = self.master.submit(self.now, slave, request.clone(), terms, call)?;
        let asked = Asked {
            slave,
            request,
            class: terms.class,
            at: self.now,
            ticket,
            sent: false,
            echo_was_read: false,
        };
        self.asked.insert(call, asked);
        Ok(call)
    }

    pub(crate) fn withdraw(&mut self, call: u64) {
        self.collect(&mut Vec::new());
        let Some(asked) = self.asked.get(&call) else { return };
        let is_kept = asked.class == Class::Stop && is_write(&asked.request);
        self.master.withdraw(asked.ticket);
        // The write of a stop is sent although nobody waits for it, and ends as if somebody did.
        if !is_kept {
            self.asked.remove(&call);
        }
    }

    pub(crate) fn waiting(&self) -> impl Iterator<Item = u64> + '_ {
        self.asked.keys().copied()
    }

    /// Lets everything happen until `until`, and gives the calls that ended.
    pub(crate) fn run_until(&mut self, until: Instant) -> Vec<(u64, Outcome)> {
        let mut ended = Vec::new();
        let mut standing_still = 0;
        loop {
            self.step(&mut ended);
            let next = [self.master.deadline(), self.wire.peek().map(|Reverse((at, ..))| *at)];
            let Some(next) = next.into_iter().flatten().min().filter(|next| *next <= until) else { break };
            standing_still = if next > self.now { 0 } else { standing_still + 1 };
            assert!(standing_still < 1_000, "livelock at {:?}", self.now - self.start);
            self.now = self.now.max(next);
        }
        self.now = self.now.max(until);
        ended
    }

    fn step(&mut self, ended: &mut Vec<(u64, Outcome)>) {
        while self.wire.peek().is_some_and(|Reverse((at, ..))| *at <= self.now) {
            let Some(Reverse((_, _, bytes))) = self.wire.pop() else { break };
            self.master.handle_bytes(self.now, &bytes);
        }
        self.master.handle_timeout(self.now);
        self.collect(ended);
        if let Some(frame) = self.master.poll_transmit(self.now) {
            self.transmitted(&frame);
            self.master.handle_sent(self.now);
        }
        self.collect(ended);
    }

    fn collect(&mut self, ended: &mut Vec<(u64, Outcome)>) {
        while let Some((call, outcome)) = self.master.poll_outcome() {
            self.check(call, &outcome);
            ended.push((call, outcome));
        }
    }

    fn transmitted(&mut self, frame: &[u8]) {
        assert!(rtu::is_frame(frame));
        self.counts.sent += 1;
        let (slave, pdu) = (frame[0], &frame[1..frame.len() - 2]);
        let silence = self.now.saturating_duration_since(self.quiet_from);
        if self.counts.sent > 1 {
            let shortest = self.counts.shortest_silence.get_or_insert(silence);
            *shortest = silence.min(*shortest);
        }
        self.stop_is_not_overtaken(slave, pdu);
        let end = self.now + self.config.serial.characters(frame.len());
        self.quiet_from = end;
        if let Some(damaged) = self.echo {
            let mut echo = frame.to_vec();
            if self.random.one_in(damaged) {
                self.flip(&mut echo);
            }
            if self.random.one_in(damaged) {
                self.truncate(&mut echo);
            }
            self.deliver(end, echo);
        }
        if slave != 0 && !self.dead.contains(&slave) {
            self.answer(slave, pdu, end);
        }
    }

    /// While the write of a Stop waits, only a Stop may be sent, or what finds out about the echo on its behalf, once. A
    /// read of that class may wait for a late answer, and what is for a dead slave for its share of the line.
    fn stop_is_not_overtaken(&mut self, slave: u8, pdu: &[u8]) {
        let sent =
            |asked: &Asked| asked.slave == slave && drive_bus::pdu::encode(&asked.request).unwrap() == pdu;
        let stops = || self.asked.values().filter(|asked| asked.class == Class::Stop);
        if stops().any(|stop| is_write(&stop.request) && !stop.sent) && !stops().any(sent) {
            let slaves = self.master.stats(self.now).slaves;
            let dead = |stop: &Asked| slaves.get(&stop.slave).is_some_and(|slave| slave.offline);
            let overtaken = stops().any(|stop| is_write(&stop.request) && !stop.sent && !dead(stop));
            assert!(!overtaken || self.reads_echo(slave, pdu), "{pdu:02X?} to {slave} overtakes a stop");
        }
        for asked in self.asked.values_mut().filter(|asked| asked.class == Class::Stop) {
            if !asked.sent && sent(asked) {
                asked.sent = true;
                let wait = self.now - asked.at;
                self.counts.longest_stop_wait = self.counts.longest_stop_wait.max(wait);
                break;
            }
        }
    }

    /// Whether this read finds out about the echo for a Stop that waits.
    fn reads_echo(&mut self, slave: u8, pdu: &[u8]) -> bool {
        let unread = |asked: &&mut Asked| {
            is_write(&asked.request)
                && asked.class == Class::Stop
                && asked.slave == slave
                && !asked.echo_was_read
        };
        self.config.echo == Echo::Auto
            && pdu[0] == 3
            && self.asked.values_mut().find(unread).map(|asked| asked.echo_was_read = true).is_some()
    }

    fn answer(&mut self, slave: u8, pdu: &[u8], end: Instant) {
        let answer = match *pdu {
            [3, high, low, _, quantity] => {
                let address = u16::from_be_bytes([high, low]);
                let words = (0..u16::from(quantity)).flat_map(|n| {
                    let at = address + n;
                    self.written.get(&(slave, at)).copied().unwrap_or_else(|| word(slave, at)).to_be_bytes()
                });
                [3, quantity * 2].into_iter().chain(words).collect::<Vec<u8>>()
            }
            [6, a1, a0, v1, v0] => {
                self.written.insert((slave, u16::from_be_bytes([a1, a0])), u16::from_be_bytes([v1, v0]));
                pdu.to_vec()
            }
            _ => vec![pdu[0] | 0x80, 1],
        };
        let mut bytes = rtu::frame(slave, &answer).to_vec();
        let mut turnaround = Duration::from_micros(3_000 + self.random.below(4_000));
        let Faults { lost, flipped, truncated, noise, late, foreign } = self.faults;
        if self.random.one_in(lost) {
            return;
        }
        if self.random.one_in(flipped) {
            self.flip(&mut bytes);
        }
        if self.random.one_in(truncated) {
            self.truncate(&mut bytes);
        }
        if self.random.one_in(noise) {
            bytes.insert(0, self.random.below(256) as u8);
        }
        if self.random.one_in(late) {
            turnaround += self.config.response_timeout + Duration::from_micros(self.random.below(200_000));
        }
        if self.random.one_in(foreign) {
            let stranger = rtu::frame(200, &[3, 2, 0xDE, 0xAD]).to_vec();
            let length = self.config.serial.characters(stranger.len());
            self.deliver(end + turnaround + length, stranger);
            turnaround += length + 4 * MS;
        }
        let length = self.config.serial.characters(bytes.len());
        self.deliver(end + turnaround + length, bytes);
    }

    /// One to three bits change.
    fn flip(&mut self, bytes: &mut [u8]) {
        for _ in 0..=self.random.below(3) {
            let bit = self.random.below(bytes.len() as u64 * 8);
            bytes[bit as usize / 8] ^= 1 << (bit % 8);
        }
    }

    fn truncate(&mut self, bytes: &mut Vec<u8>) {
        bytes.truncate(1 + self.random.below(bytes.len() as u64 - 1) as usize);
    }

    fn deliver(&mut self, at: Instant, bytes: Vec<u8>) {
        self.order += 1;
        if self.faults.late == 0 {
            self.quiet_from = self.quiet_from.max(at);
        }
        self.wire.push(Reverse((at, self.order, bytes)));
    }

    /// Every call ends once, and every answer is the right one.
    fn check(&mut self, call: u64, outcome: &Outcome) {
        let Some(asked) = self.asked.remove(&call) else {
            panic!("call {call} ended twice or was never asked")
        };
        match outcome {
            Ok(Ok(Response::ReadHoldingRegisters(words))) => {
                self.counts.answered += 1;
                let Request::ReadHoldingRegisters(address, _) = asked.request else {
                    panic!("{:?}", asked.request)
                };
                for (n, got) in words.iter().enumerate() {
                    let at = address + n as u16;
                    let expected = self.written.get(&(asked.slave, at)).copied();
                    assert_eq!(
                        *got,
                        expected.unwrap_or_else(|| word(asked.slave, at)),
                        "{:?}",
                        asked.request
                    );
                }
            }
            Ok(Ok(Response::WriteSingleRegister(at, value))) => {
                self.counts.answered += 1;
                assert_eq!(asked.request, Request::WriteSingleRegister(*at, *value));
                if asked.slave != 0 {
                    assert_eq!(self.written.get(&(asked.slave, *at)), Some(value), "confirmed but not done");
                }
            }
            Ok(other) => panic!("{other:?} to {:?}", asked.request),
            Err(_) => self.counts.failed += 1,
        }
    }
}
