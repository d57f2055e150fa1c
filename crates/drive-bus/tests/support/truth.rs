//! A line in virtual time whose slaves tell the truth: each word that they answer carries their address and the number of
//! the request that it answers, so that a value of another request is known for what it is. Nothing here comes from a
//! model of a drive. Everything follows from the seed.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap, VecDeque},
    time::Duration,
};

use drive_bus::{
    LineConfig, Protocol,
    exchange::rtu,
    master::{Master, Outcome},
};
use drive_core::{Class, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::rig::Random;

/// How many words are read.
pub(crate) const QUANTITY: u16 = 2;

/// What goes wrong, each once in so many; 0: never.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Faults {
    /// An answer comes once more, after 1 ms and at most so many.
    pub(crate) double: (u64, u64),
    /// An answer comes after its time, by at most so many ms.
    pub(crate) late: (u64, u64),
    /// An answer is lost.
    pub(crate) lost: u64,
    /// An answer comes damaged, and whole after at most so many ms.
    pub(crate) damaged: (u64, u64),
    /// The process stands still for 30 ms and at most so many.
    pub(crate) stall: (u64, u64),
    /// Another master asks the same slave for the same words.
    pub(crate) second_master: u64,
    /// The adapter gives back what is sent; one in three of these is damaged.
    pub(crate) echo: u64,
    /// A refusal instead of an answer.
    pub(crate) refused: u64,
    /// Over Modbus TCP: an answer to the next number comes before its request.
    pub(crate) guessed: u64,
}

/// What came of it.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) exchanges: u64,
    pub(crate) right: u64,
    pub(crate) wrong: u64,
    pub(crate) failed: u64,
    pub(crate) writes: u64,
    /// Writes that were confirmed and never reached the slave.
    pub(crate) unfounded: u64,
    /// How often anything went wrong on the way.
    pub(crate) faults: u64,
}

struct Call {
    slave: u8,
    value: Option<u16>,
}

pub(crate) struct TruthLine {
    master: Master<u64>,
    pub(crate) now: Instant,
    random: Random,
    faults: Faults,
    config: LineConfig,
    mbap: bool,
    paced: bool,
    /// What will come to the master: time, order, bytes.
    wire: BinaryHeap<Reverse<(Instant, u64, Vec<u8>)>>,
    order: u64,
    /// When our last request is off the line.
    sent_until: Instant,
    /// When another master asks a slave.
    stranger: Option<(Instant, u8)>,
    /// How many requests each slave has got.
    numbers: BTreeMap<u8, u64>,
    /// What each slave was told last.
    written: BTreeMap<u8, VecDeque<u16>>,
    /// When each slave's last answers were withheld.
    owed: BTreeMap<u8, Vec<Instant>>,
    calls: BTreeMap<u64, Call>,
    next_call: u64,
    /// The request on the wire: its slave and number.
    last: (u8, u64),
    pub(crate) counts: Counts,
}

/// The words that tell which request of which slave they answer.
fn truth(slave: u8, number: u64, count: u8) -> impl Iterator<Item = u16> {
    (0..u64::from(count)).map(move |at| (number + u64::from(slave) * 4_099 + at * 257) as u16)
}

impl TruthLine {
    pub(crate) fn new(seed: u64, config: LineConfig, faults: Faults) -> Self {
        let now = Instant::now();
        let mut master = Master::new(now, config.clone());
        master.handle_up(now);
        let mbap = config.protocol == Protocol::Tcp;
        let paced = config.far_end_paces == Some(true);
        Self {
            master,
            now,
            random: Random::new(seed),
            faults,
            config,
            mbap,
            paced,
            wire: BinaryHeap::new(),
            order: 0,
            sent_until: now,
            stranger: None,
            numbers: BTreeMap::new(),
            written: BTreeMap::new(),
            owed: BTreeMap::new(),
            calls: BTreeMap::new(),
            next_call: 0,
            last: (0, 0),
            counts: Counts::default(),
        }
    }

    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.random.below(limit)
    }

    /// Asks a slave for its words, or writes one of them.
    pub(crate) fn ask(&mut self, slave: u8, writes: bool, terms: Terms) {
        let call = self.next_call;
        self.next_call += 1;
        // Each write has a value of its own.
        let value = writes.then_some(call as u16);
        let request = match value {
            Some(value) => Request::WriteSingleRegister(7, value),
            None => Request::ReadHoldingRegisters(7, QUANTITY),
        };
        if self.master.submit(self.now, slave, request, terms, call).is_ok() {
            self.calls.insert(call, Call { slave, value });
        }
    }

    pub(crate) fn waiting(&self) -> usize {
        self.calls.len()
    }

    /// Lets everything happen for so long.
    pub(crate) fn run_for(&mut self, time: Duration) {
        let until = self.now + time;
        loop {
            self.step();
            let heard = self.wire.peek().map(|Reverse((at, ..))| *at);
            let next = [self.master.deadline(), heard, self.stranger.map(|(at, _)| at)];
            let Some(next) = next.into_iter().flatten().min().filter(|next| *next <= until) else { break };
            self.now = self.now.max(next);
            // Nobody notices that time goes on.
            if self.master.is_busy() && self.strikes(self.faults.stall.0) {
                self.stand_still();
            }
        }
        self.now = self.now.max(until);
    }

    fn stand_still(&mut self) {
        let time = 30 + self.random.below(self.faults.stall.1);
        self.now += Duration::from_millis(time);
    }

    fn step(&mut self) {
        self.second_master();
        // What lies in the port is read first, in one piece.
        let mut bytes = Vec::new();
        while self.wire.peek().is_some_and(|Reverse((at, ..))| *at <= self.now) {
            let Some(Reverse((_, _, more))) = self.wire.pop() else { break };
            bytes.extend(more);
        }
        if !bytes.is_empty() {
            self.master.handle_bytes(self.now, &bytes);
            self.collect();
        }
        self.master.handle_timeout(self.now);
        self.collect();
        if let Some(frame) = self.master.poll_transmit(self.now) {
            if self.strikes(self.faults.stall.0.saturating_mul(20)) {
                self.stand_still();
            }
            self.transmitted(&frame);
            self.master.handle_sent(self.now);
        }
    }

    fn transmitted(&mut self, frame: &[u8]) {
        self.counts.exchanges += 1;
        let (head, slave, pdu) = if self.mbap {
            (frame[..4].to_vec(), frame[6], frame[7..].to_vec())
        } else {
            (Vec::new(), frame[0], frame[1..frame.len() - 2].to_vec())
        };
        let number = self.numbers.entry(slave).or_default();
        *number += 1;
        self.last = (slave, *number);
        let end = self.now + self.characters(frame.len());
        self.sent_until = end;
        if !self.mbap && self.strikes(self.faults.echo) {
            let mut echo = frame.to_vec();
            if self.random.one_in(3) {
                self.flip(&mut echo);
            }
            self.deliver(end, echo);
        }
        let Some(answer) = self.answer(slave, &pdu) else { return };
        let answer =
            if self.mbap { mbap(&head, slave, &answer) } else { rtu::frame(slave, &answer).to_vec() };
        let guesses = self.strikes(self.faults.guessed);
        let guess = guesses.then(|| {
            let next = u16::from_be_bytes([head[0], head[1]]).wrapping_add(1).to_be_bytes();
            mbap(&[next[0], next[1], 0, 0], slave, &[3, 4, 0xBA, 0xD0, 0xBA, 0xD0])
        });
        self.deliver_answer(end, slave, answer, guess);
        if self.strikes(self.faults.second_master) {
            self.stranger = Some((end + Duration::from_micros(self.random.below(100_000)), slave));
        }
    }

    /// What a slave answers to a request that it has heard.
    fn answer(&mut self, slave: u8, pdu: &[u8]) -> Option<Vec<u8>> {
        let number = self.numbers.get(&slave).copied().unwrap_or_default();
        if self.strikes(self.faults.refused) {
            return Some(vec![pdu[0] | 0x80, 4]);
        }
        match *pdu {
            [3, _, _, _, count] => {
                let words = truth(slave, number, count).flat_map(u16::to_be_bytes);
                Some([3, count * 2].into_iter().chain(words).collect())
            }
            [6, _, _, high, low] => {
                let written = self.written.entry(slave).or_default();
                written.push_back(u16::from_be_bytes([high, low]));
                if written.len() > 64 {
                    written.pop_front();
                }
                Some(pdu.to_vec())
            }
            _ => None,
        }
    }

    /// Whether an answer of this slave may be owed: at most three in a minute, so that one length is never owed.
    fn may_owe(&mut self, slave: u8) -> bool {
        let owed = self.owed.entry(slave).or_default();
        owed.retain(|at| *at + Duration::from_secs(62) > self.now);
        owed.len() < 3 && {
            owed.push(self.now);
            self.counts.faults += 1;
            true
        }
    }

    /// Whether one of the faults that happen once in so many happens now.
    fn strikes(&mut self, one_in: u64) -> bool {
        let strikes = self.random.one_in(one_in);
        self.counts.faults += u64::from(strikes);
        strikes
    }

    fn deliver_answer(&mut self, end: Instant, slave: u8, answer: Vec<u8>, guess: Option<Vec<u8>>) {
        if self.random.one_in(self.faults.lost) && self.may_owe(slave) {
            return;
        }
        let mut pause = Duration::from_micros(if self.paced { 3_000 } else { 50 } + self.random.below(4_000));
        let late = self.random.one_in(self.faults.late.0) && self.may_owe(slave);
        if late {
            let late = Duration::from_millis(self.random.below(self.faults.late.1));
            pause += self.config.response_timeout + late;
        }
        let at = end + pause + self.characters(answer.len());
        if self.random.one_in(self.faults.damaged.0) && self.may_owe(slave) {
            let mut damaged = answer.clone();
            self.flip(&mut damaged);
            let whole = at + Duration::from_millis(1 + self.random.below(self.faults.damaged.1));
            self.deliver(at, damaged);
            self.deliver(whole, answer);
            return;
        }
        if self.strikes(self.faults.double.0) {
            let again = at + Duration::from_micros(1_000 + self.random.below(self.faults.double.1 * 1_000));
            self.deliver(again, answer.clone());
        }
        // A guess comes right behind, before the request that it would answer.
        let guess = guess.filter(|_| !late).unwrap_or_default();
        self.deliver(at, [answer, guess].concat());
    }

    /// Another master's request, once the line is free of ours, and the answer to it.
    fn second_master(&mut self) {
        let Some((at, slave)) = self.stranger.filter(|(at, _)| *at <= self.now) else { return };
        let request = rtu::frame(slave, &[3, 0, 7, 0, QUANTITY as u8]).to_vec();
        if self.now - self.characters(request.len()) < self.sent_until {
            self.stranger = Some((at + Duration::from_millis(10), slave));
            return;
        }
        self.stranger = None;
        let number = self.numbers.entry(slave).or_default();
        *number += 1;
        let words = truth(slave, *number, QUANTITY as u8).flat_map(u16::to_be_bytes);
        let pdu: Vec<u8> = [3, QUANTITY as u8 * 2].into_iter().chain(words).collect();
        let answer = rtu::frame(slave, &pdu).to_vec();
        let answered = self.now + Duration::from_millis(5) + self.characters(answer.len());
        self.deliver(self.now, request);
        self.deliver(answered, answer);
    }

    fn flip(&mut self, bytes: &mut [u8]) {
        for _ in 0..=self.random.below(3) {
            let bit = self.random.below(bytes.len() as u64 * 8);
            bytes[bit as usize / 8] ^= 1 << (bit % 8);
        }
    }

    fn characters(&self, count: usize) -> Duration {
        if self.paced { self.config.serial.characters(count) } else { Duration::ZERO }
    }

    fn deliver(&mut self, at: Instant, bytes: Vec<u8>) {
        self.order += 1;
        self.wire.push(Reverse((at, self.order, bytes)));
    }

    fn collect(&mut self) {
        while let Some((call, outcome)) = self.master.poll_outcome() {
            self.check(call, &outcome);
        }
    }

    fn check(&mut self, call: u64, outcome: &Outcome) {
        let Some(call) = self.calls.remove(&call) else {
            panic!("call {call} ended twice or was never asked")
        };
        match outcome {
            Ok(Ok(Response::ReadHoldingRegisters(words))) => {
                let (slave, number) = self.last;
                let right = slave == call.slave
                    && words.len() == usize::from(QUANTITY)
                    && truth(slave, number, QUANTITY as u8).eq(words.iter().copied());
                *(if right { &mut self.counts.right } else { &mut self.counts.wrong }) += 1;
            }
            Ok(Ok(Response::WriteSingleRegister(_, value))) => {
                let done = self.written.get(&call.slave).is_some_and(|written| written.contains(value));
                let founded = done && call.value == Some(*value);
                *(if founded { &mut self.counts.writes } else { &mut self.counts.unfounded }) += 1;
            }
            _ => self.counts.failed += 1,
        }
    }
}

/// A frame of Modbus TCP with the transaction and protocol numbers of `head`.
fn mbap(head: &[u8], slave: u8, pdu: &[u8]) -> Vec<u8> {
    [head, &(pdu.len() as u16 + 1).to_be_bytes(), &[slave], pdu].concat()
}

/// Asks `slaves` slaves until so many exchanges are over, with pauses of at most `pause`; `spare` words may be read along.
pub(crate) fn run(line: &mut TruthLine, slaves: u8, spare: u8, pause: Duration, exchanges: u64) {
    while line.counts.exchanges < exchanges {
        while line.waiting() < usize::from(slaves) {
            let slave = (line.below(u64::from(slaves)) + 1) as u8;
            let writes = line.below(8) == 0;
            let class = if writes { Class::Command } else { Class::Status };
            line.ask(slave, writes, Terms::of(class).sparing(spare));
            if line.below(4) == 0 {
                break;
            }
        }
        let pause = line.below(pause.as_micros() as u64);
        line.run_for(Duration::from_micros(pause));
    }
}
