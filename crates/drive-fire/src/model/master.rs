//! Small cases of the master of a line, on a wire and behind a gateway.

use std::{collections::BTreeMap, ops::RangeInclusive, time::Duration};

use drive_bus::{
    Gateway, LineConfig, SlaveSettings,
    exchange::rtu,
    master::{Master, Outcome},
    schedule::Ticket,
};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::{Held, Model, clock::Clocked, names};

/// As it is explored.
pub(crate) const MODEL: Model = Model {
    name: "master",
    part: "model of the master",
    against_plants: "model of the master, against planted defects",
    settings: &["Wire", "Gateway"],
    steps: || names(&Step::ALL),
    lives: |setting, steps, _| {
        let steps: Vec<Step> = steps.iter().map(|step| Step::ALL[*step]).collect();
        lives(Setting::ALL[setting], &steps)
    },
    defects: Vec::new,
    lines: true,
};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const MS: Duration = Duration::from_millis(1);
/// What each slave needs after its answer.
const PAUSE: Duration = Duration::from_millis(6);
/// How long a slave takes to answer.
const RESPONSE: Duration = Duration::from_millis(5);
/// How long a command may wait.
const LIFETIME: Duration = Duration::from_millis(1_000);
/// Behind the last step so much time passes, in which everything ends.
const AFTER: Duration = Duration::from_secs(300);
/// And so much more for each call: a stop in vain has its share of the line.
const AFTER_EACH: Duration = Duration::from_secs(30);
/// The words of a read, and with as many more as its drive may be asked for along.
const LENGTHS: RangeInclusive<u8> = 2..=5;
/// So long a length is asked for last of all that is owed (drive-bus' README, *Doubt*).
const MEMORY: Duration = Duration::from_secs(60);

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// A stop for slave 1.
    Stop,
    /// A start for slave 1: a level.
    Command,
    /// A reset for slave 1: an edge.
    Edge,
    /// The next setpoint for slave 1, which takes the place of the one before.
    Setpoint,
    /// A read of slave 1, which may be lengthened.
    Read,
    /// A read of slave 2.
    Neighbour,
    /// Who asked last goes away.
    Drop,
    /// What is under way is answered.
    Answer,
    /// Its answer is lost: time passes until something else happens.
    Lose,
    /// Its answer comes damaged.
    Damage,
    /// It is refused by exception 04.
    Refuse,
    /// The last answer that was lost comes after all.
    ComesLate,
    /// A third of a second passes.
    Wait,
}

use Step as S;

impl Step {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Stop,
        Self::Command,
        Self::Edge,
        Self::Setpoint,
        Self::Read,
        Self::Neighbour,
        Self::Drop,
        Self::Answer,
        Self::Lose,
        Self::Damage,
        Self::Refuse,
        Self::ComesLate,
        Self::Wait,
    ];
}

/// Which line is explored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// A wire.
    Wire,
    /// A serial server in front of it, which does one thing at a time and waits a second for the dead.
    Gateway,
}

impl Setting {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Wire, Self::Gateway];

    fn config(self) -> LineConfig {
        let pause = SlaveSettings { turnaround: PAUSE, ..SlaveSettings::default() };
        let config = match self {
            Self::Wire => LineConfig {
                far_end_paces: Some(true),
                double_window: 50 * MS,
                offline_after: 2,
                retries: 1,
                ..LineConfig::stream(SERIAL)
            },
            Self::Gateway => LineConfig {
                gateway: Some(Gateway { at_once: Some(1), wait: Some(Duration::from_secs(1)) }),
                offline_after: 2,
                retries: 1,
                ..LineConfig::stream(SERIAL)
            },
        };
        config.slave(1, pause).slave(2, pause)
    }
}

/// A call and everything that became of it.
#[derive(Debug, Clone)]
struct Call {
    slave: u8,
    pdu: Vec<u8>,
    terms: Terms,
    ticket: Ticket,
    at: Instant,
    sent: Vec<Instant>,
    /// Something of it was answered rightly.
    answered: bool,
    outcome: Option<Outcome>,
    dropped: bool,
    /// Another one that asks the same was open with it: which of them was sent nobody can tell.
    has_twin: bool,
}

/// A transmission that waits for its answer.
#[derive(Debug, Clone)]
struct UnderWay {
    slave: u8,
    pdu: Vec<u8>,
    end: Instant,
    number: u16,
    call: Option<u32>,
    /// An answer of this shape was owed when it was asked: which of the two has come nobody knows by then.
    behind_an_owed: bool,
}

impl UnderWay {
    /// Whose it is, and how many words it reads.
    fn read(&self) -> (u8, u8) {
        (self.slave, if self.pdu[0] == 3 { self.pdu[4] } else { 0 })
    }
}

struct World {
    master: Master<u32>,
    config: LineConfig,
    now: Instant,
    calls: BTreeMap<u32, Call>,
    under_way: Option<UnderWay>,
    /// Answers that were lost on the way.
    lost: Vec<UnderWay>,
    /// End of the last thing on the wire, and of each slave's last answer.
    quiet_from: Instant,
    answered_at: BTreeMap<u8, Instant>,
    /// The number of each request, in its answer.
    number: u16,
    /// A stop that has not been on the wire yet: since when.
    stop_waits: Option<Instant>,
    /// Something was on the wire when it was given.
    busy_at_stop: bool,
    setpoint: u16,
    /// The answer that came later than the late window, by its number.
    beyond_its_window: Option<u16>,
    /// A read was refused, so that it is not lengthened any more.
    refuses_longer: bool,
    /// Reads of which no right answer has come: whose, of how many words, and until when that is remembered.
    owed: BTreeMap<(u8, u8), Instant>,
    /// Answers of all lengths were owed when the read under way was sent, so that it has none of its own.
    has_no_own_length: bool,
}

impl World {
    fn new(setting: Setting) -> Self {
        let config = setting.config();
        let begun = Instant::now();
        let mut master = Master::new(begun, config.clone());
        master.handle_up(begun + MS);
        let now = begun + Duration::from_secs(1);
        Self {
            master,
            config,
            now,
            calls: BTreeMap::new(),
            under_way: None,
            lost: Vec::new(),
            quiet_from: begun,
            answered_at: BTreeMap::new(),
            number: 0,
            stop_waits: None,
            busy_at_stop: false,
            setpoint: 0,
            beyond_its_window: None,
            refuses_longer: false,
            owed: BTreeMap::new(),
            has_no_own_length: false,
        }
    }

    fn take(&mut self, step: Step) -> Held {
        super::trace(self.now, format_args!("{step:?}"));
        match step {
            S::Stop => {
                self.stop_waits.get_or_insert(self.now);
                self.busy_at_stop = self.master.is_busy();
                self.ask(1, Request::WriteSingleRegister(100, 0), Terms::of(Class::Stop))?;
            }
            S::Command => {
                self.ask(
                    1,
                    Request::WriteSingleRegister(100, self.own_value(15)),
                    Terms::of(Class::Command).within(LIFETIME),
                )?;
            }
            S::Edge => {
                self.ask(
                    1,
                    Request::WriteSingleRegister(101, self.own_value(128)),
                    Terms::of(Class::Command).within(LIFETIME).edge(),
                )?;
            }
            S::Setpoint => {
                self.setpoint += 1;
                let write = Request::WriteSingleRegister(102, self.setpoint);
                self.ask(1, write, Terms::of(Class::Command).within(LIFETIME).replacing(1))?;
            }
            S::Read => {
                self.ask(1, Request::ReadHoldingRegisters(7, 2), Terms::of(Class::Status).sparing(3))?;
            }
            S::Neighbour => {
                self.ask(2, Request::ReadHoldingRegisters(7, 2), Terms::of(Class::Status).sparing(3))?;
            }
            S::Drop => {
                let last = self.calls.values_mut().next_back().filter(|call| call.outcome.is_none());
                if let Some(call) = last {
                    call.dropped = true;
                    self.master.withdraw(call.ticket);
                }
            }
            S::Answer | S::Damage | S::Refuse => self.answered(step)?,
            S::Lose => {
                if let Some(lost) = self.under_way.take() {
                    self.lost.push(lost);
                }
                self.run_for(600 * MS)?;
            }
            S::ComesLate => {
                if let Some(late) = self.lost.pop() {
                    // It was carried out, so that this confirms it, and whatever has written the same.
                    for call in
                        self.calls.values_mut().filter(|call| call.pdu == late.pdu && !call.sent.is_empty())
                    {
                        call.answered = true;
                    }
                    let frame = rtu::frame(late.slave, &Self::answer_of(&late));
                    if self.now > late.end + self.config.late_window {
                        self.beyond_its_window = Some(late.number);
                    }
                    let at = self.now.max(self.quiet_from) + RESPONSE + SERIAL.characters(frame.len());
                    self.answered_at.insert(late.slave, at);
                    self.owed.remove(&late.read());
                    self.hears(at, &frame)?;
                }
            }
            S::Wait => self.run_for(330 * MS)?,
        }
        self.run_for(Duration::ZERO)
    }

    /// A value that no other call writes, so that each is told from the others.
    fn own_value(&self, least: u16) -> u16 {
        least + 256 * self.calls.len() as u16
    }

    fn ask(&mut self, slave: u8, request: Request<'static>, terms: Terms) -> Held {
        let id = self.calls.len() as u32;
        let pdu = drive_bus::pdu::encode(&request).map_err(|_| "it is encoded")?.to_vec();
        let is_twin = |call: &Call| call.outcome.is_none() && call.slave == slave && call.pdu == pdu;
        if let Ok(ticket) = self.master.submit(self.now, slave, request, terms, id) {
            let mut has_twin = false;
            for twin in self.calls.values_mut().filter(|call| is_twin(call)) {
                (twin.has_twin, has_twin) = (true, true);
            }
            let call = Call {
                slave,
                pdu,
                terms,
                ticket,
                at: self.now,
                sent: Vec::new(),
                answered: false,
                outcome: None,
                dropped: false,
                has_twin,
            };
            self.calls.insert(id, call);
        } else if terms.class == Class::Stop {
            return Err("a stop is taken whatever is known of its slave");
        }
        self.run_for(Duration::ZERO)
    }

    /// The PDU by which a slave answers.
    fn answer_of(asked: &UnderWay) -> Vec<u8> {
        match *asked.pdu {
            [3, .., count] => {
                let words = (0..u16::from(count)).flat_map(|at| (asked.number * 16 + at).to_be_bytes());
                [3, count * 2].into_iter().chain(words).collect()
            }
            _ => asked.pdu.clone(),
        }
    }

    /// What is under way is answered, once something is.
    fn answered(&mut self, how: Step) -> Held {
        let until = self.now + 400 * MS;
        while self.under_way.is_none() {
            if !self.goes_on_before(until)? {
                return Ok(());
            }
        }
        let Some(asked) = self.under_way.take() else { return Ok(()) };
        if !self.master.is_busy() {
            // It was given up meanwhile: what comes now is late.
            self.lost.push(asked);
            return Ok(());
        }
        self.refuses_longer |= how == S::Refuse && asked.pdu[0] == 3;
        if how != S::Damage {
            self.is_answered(&asked);
        }
        let pdu = match how {
            S::Refuse => vec![asked.pdu[0] | 0x80, 4],
            _ => Self::answer_of(&asked),
        };
        let mut frame = rtu::frame(asked.slave, &pdu).to_vec();
        if how == S::Damage {
            let last = frame.len() - 3;
            frame[last] ^= 0x10;
        } else if let Some(call) = asked.call.and_then(|id| self.calls.get_mut(&id)) {
            call.answered |= how == S::Answer;
        }
        let at = asked.end.max(self.now) + RESPONSE + SERIAL.characters(frame.len());
        self.hears(at, &frame)?;
        self.answered_at.insert(asked.slave, at);
        Ok(())
    }

    /// A right answer has come: what was owed before it may still come, as far as the line can know.
    fn is_answered(&mut self, asked: &UnderWay) {
        match asked.behind_an_owed {
            true => self.owed.insert(asked.read(), self.now + MEMORY),
            false => self.owed.remove(&asked.read()),
        };
    }

    /// Bytes whose last is on the wire at `at`.
    fn hears(&mut self, at: Instant, bytes: &[u8]) -> Held {
        self.now = self.now.max(at);
        super::trace(self.now, format_args!("<- {bytes:02X?}"));
        self.quiet_from = self.now;
        self.master.handle_bytes(self.now, bytes);
        self.collect()?;
        self.run_for(Duration::ZERO)
    }

    fn bound(&self) -> Duration {
        self.config.worst_case_stop(8, 32)
    }

    /// Whose transmission it is, and whether he may have it.
    fn call_of(&mut self, slave: u8, pdu: &[u8], is_stop: bool) -> Result<Option<u32>, &'static str> {
        let now = self.now;
        let last_stop =
            self.calls.values().filter(|call| call.terms.class == Class::Stop).map(|call| call.at).max();
        let newest = self
            .calls
            .iter()
            .filter(|(_, call)| {
                call.pdu.get(..3) == Some(&[6, 0, 102])
                    && !call.dropped
                    && (call.outcome.is_none() || !call.sent.is_empty())
            })
            .map(|(id, _)| *id)
            .max();
        let reads = pdu[0] == 3;
        let is_it =
            |call: &Call| call.slave == slave && if reads { call.pdu[0] == 3 } else { call.pdu == pdu };
        // Equal calls are told apart by nothing: whichever may still be sent.
        let found = self
            .calls
            .iter_mut()
            .filter(|(_, call)| call.outcome.is_none() && is_it(call))
            .min_by_key(|(_, call)| (call.dropped, call.sent.len()));
        let Some((&id, call)) = found else {
            let told = self.calls.values().any(|call| is_it(call) && call.outcome.is_some());
            // A probe reads by itself, and a stop that nobody waits for goes on.
            return if told && !reads && !is_stop {
                Err("what has ended is not sent again")
            } else {
                Ok(None)
            };
        };
        if call.terms.class == Class::Command {
            if call.dropped && call.sent.is_empty() {
                return Err("what its caller has dropped is not sent");
            }
            if now >= call.at + LIFETIME {
                return Err("a command is not sent behind its lifetime");
            }
            if last_stop.is_some_and(|stop| call.at < stop && stop < now) {
                return Err("no command goes behind a stop that was given after it");
            }
            if call.terms.effect == drive_core::Effect::Edge && !call.sent.is_empty() {
                return Err("an edge is sent once");
            }
            if call.terms.replaces.is_some() && newest.is_some_and(|newest| newest > id) {
                return Err("an old setpoint is not sent behind a newer one");
            }
        }
        call.sent.push(now);
        Ok(Some(id))
    }

    /// Everything has ended.
    fn ends(&mut self) -> Held {
        if let Some(lost) = self.under_way.take() {
            self.lost.push(lost);
        }
        let until = self.now + AFTER + AFTER_EACH * self.calls.len() as u32;
        while self.now < until {
            if !self.goes_on_before(until)? {
                break;
            }
            // Nobody answers any more.
            self.under_way = None;
        }
        if self.calls.values().any(|call| call.outcome.is_none() && !call.dropped) {
            return Err("every call ends");
        }
        let is_stop = |call: &&Call| call.terms.class == Class::Stop;
        if self.stop_waits.is_some()
            || self.calls.values().filter(is_stop).any(|call| call.sent.is_empty() && call.outcome.is_none())
        {
            return Err("a stop is sent, whatever becomes of its caller");
        }
        Ok(())
    }
}

impl Clocked for World {
    fn master(&mut self) -> &mut Master<u32> {
        &mut self.master
    }

    fn now(&mut self) -> &mut Instant {
        &mut self.now
    }

    /// Nothing that was under way there comes any more.
    fn port_is_left(&mut self) {
        super::trace(self.now, format_args!("the port is left"));
        self.lost.extend(self.under_way.take());
    }

    fn transmitted(&mut self, frame: &[u8]) -> Held {
        let (slave, pdu) = (frame[0], frame[1..frame.len() - 2].to_vec());
        super::trace(self.now, format_args!("-> {slave}: {pdu:02X?}"));
        if self.now < self.quiet_from + SERIAL.t3_5() {
            return Err("3.5 characters of silence stand before each request");
        }
        if self.answered_at.get(&slave).is_some_and(|at| self.now < *at + PAUSE) {
            return Err("each slave has its pause");
        }
        let end = self.now + SERIAL.characters(frame.len());
        self.quiet_from = end;
        let is_stop = pdu[..] == [6, 0, 100, 0, 0];
        // One that was sent in vain to a slave that is off-line has its share of the line, and no more.
        let in_vain =
            self.calls.values().any(|call| call.terms.class == Class::Stop && !call.sent.is_empty());
        if let Some(since) = self.stop_waits {
            if !is_stop && since < self.now && !self.busy_at_stop && !in_vain {
                return Err("a stop is the next thing on the wire");
            }
            if !is_stop && matches!(pdu[..], [6, 0, 100 | 101, ..]) {
                return Err("no command goes before a stop that waits");
            }
        }
        if is_stop {
            if !in_vain && self.stop_waits.is_some_and(|since| self.now - since > self.bound()) {
                return Err("a stop waits no longer than the printed bound");
            }
            self.stop_waits = None;
        } else {
            self.busy_at_stop = false;
        }
        let number = self.number;
        self.number += 1;
        let call = self.call_of(slave, &pdu, is_stop)?;
        let is_owed = |words: u8| self.owed.get(&(slave, words)).is_some_and(|until| self.now < *until);
        let mut under_way = UnderWay { slave, pdu, end, number, call, behind_an_owed: false };
        under_way.behind_an_owed = is_owed(under_way.read().1);
        self.has_no_own_length = LENGTHS.clone().all(is_owed);
        self.owed.insert(under_way.read(), end + MEMORY);
        self.under_way = Some(under_way);
        Ok(())
    }

    fn collect(&mut self) -> Held {
        while let Some((id, outcome)) = self.master.poll_outcome() {
            // What is under way has ended with its call.
            let Some(call) = self.calls.get_mut(&id) else {
                return Err("an outcome of a call that nobody made");
            };
            if call.outcome.is_some() {
                return Err("a call ends once");
            }
            let writes = call.pdu[0] == 6;
            let asked = call.sent.last().copied();
            if outcome.is_ok() && !call.has_twin && asked.is_some_and(|asked| self.master.asked_at() > asked)
            {
                return Err("a value is no younger than its question");
            }
            match &outcome {
                Ok(Ok(Response::ReadHoldingRegisters(words))) => {
                    let number = words[0] / 16;
                    // To a read that cannot differ from what is owed, what comes later than the late window cannot be told from its
                    // own answer (drive-bus' README): its drive refuses to have it lengthened, or all its lengths are owed.
                    let cannot_be_told = (self.refuses_longer || self.has_no_own_length)
                        && self.beyond_its_window == Some(number);
                    if usize::from(number) + 1 != usize::from(self.number) && !cannot_be_told {
                        return Err("a value is the answer to its own question");
                    }
                    if !call.answered && !call.has_twin && !cannot_be_told {
                        return Err("what was not answered is not told as answered");
                    }
                }
                Ok(Ok(_)) if !call.answered && !call.has_twin => {
                    return Err("what was not answered is not told as confirmed");
                }
                Ok(Err(_)) if writes && call.sent.len() > 1 && !call.has_twin => {
                    return Err("a write that was refused when it was repeated has an unknown outcome");
                }
                Err(error) if writes && error.nothing_sent() && !call.sent.is_empty() => {
                    return Err("what was told as never sent was not on the wire");
                }
                Err(PortError::OutcomeUnknown(_)) if call.sent.is_empty() && !call.has_twin => {
                    return Err("what was never sent has no unknown outcome");
                }
                _ => {}
            }
            call.outcome = Some(outcome);
        }
        Ok(())
    }
}

/// Lives through one sequence, to the end of everything.
///
/// # Errors
/// The invariant that it breaks.
pub fn lives(setting: Setting, steps: &[Step]) -> Held {
    let mut world = World::new(setting);
    for step in steps {
        world.take(*step)?;
    }
    world.ends()
}
