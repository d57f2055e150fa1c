//! Small cases of a line behind a gateway that serves one question after the other and is at each until it is answered or its own wait is
//! over: every sequence of so many steps of what is asked, who dies, and what becomes of the connection.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    time::Duration,
};

use drive_bus::{
    Gateway, LineConfig,
    master::{Master, Outcome},
    stats::{FarEndStats, WaitIs},
};
use drive_core::{Class, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::{Held, Model, clock::Clocked, names};

/// As it is explored.
pub(crate) const MODEL: Model = Model {
    name: "gateway",
    part: "model of a gateway",
    against_plants: "model of a gateway, against planted defects",
    settings: &["Tells", "Silent", "Unknown"],
    steps: || names(&Step::ALL),
    lives: |setting, steps, _| {
        let steps: Vec<Step> = steps.iter().map(|step| Step::ALL[*step]).collect();
        lives(Setting::ALL[setting], &steps)
    },
    defects: Vec::new,
    lines: true,
};

const MS: Duration = Duration::from_millis(1);
/// How long a drive takes to answer, on its own line and back.
const RESPONSE: Duration = Duration::from_millis(20);
/// How long the gateway waits for one that does not answer.
const WAIT: Duration = Duration::from_millis(1_000);
/// How long this side waits for an answer.
const TIMEOUT: Duration = Duration::from_millis(300);
/// Behind the last step so much time passes, in which everything ends.
const AFTER: Duration = Duration::from_secs(120);
/// And so much more for each call: a stop in vain has its share of the line.
const AFTER_EACH: Duration = Duration::from_secs(30);
/// So long after somebody has asked for a drive it may be asked by itself; a probe that was begun in time has a turn of the clock more.
const INTEREST: Duration = Duration::from_secs(61);
/// The longest share of the line that a stop waits for behind one in vain: four times as long as a gateway of which nothing is known
/// is taken to wait (drive-bus' README).
const SHARE: Duration = Duration::from_secs(12);
/// The registers of a stop, a command and a read.
const STOP: u16 = 100;
const COMMAND: u16 = 101;
const READ: u16 = 7;

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// A read of drive 1.
    Read,
    /// A read of drive 2.
    Neighbour,
    /// A read of drive 3, which is not there.
    Absent,
    /// A command to drive 1.
    Command,
    /// A stop for drive 1.
    Stop,
    /// A stop for drive 3, which is not there.
    StopInVain,
    /// Drive 1 goes, or comes back.
    Dies,
    /// The connection is lost and opened again; the gateway goes on with what it was asked.
    Lost,
    /// A third of a second passes.
    Wait,
    /// One and a half seconds pass.
    LongWait,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Read,
        Self::Neighbour,
        Self::Absent,
        Self::Command,
        Self::Stop,
        Self::StopInVain,
        Self::Dies,
        Self::Lost,
        Self::Wait,
        Self::LongWait,
    ];
}

/// Which gateway, and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// It says that nobody answered, and what it does is configured.
    Tells,
    /// It says nothing, and what it does is configured.
    Silent,
    /// It says that nobody answered, and nothing is known of it.
    Unknown,
}

impl Setting {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tells, Self::Silent, Self::Unknown];

    fn config(self) -> LineConfig {
        let gateway = match self {
            Self::Unknown => Gateway::default(),
            _ => Gateway { at_once: Some(1), wait: Some(WAIT) },
        };
        LineConfig {
            gateway: Some(gateway),
            response_timeout: TIMEOUT,
            timeout_floor: TIMEOUT,
            offline_after: 3,
            retries: 0,
            ..LineConfig::modbus_tcp("gateway")
        }
    }
}

/// Something that the gateway was asked.
#[derive(Debug, Clone)]
struct Question {
    transaction: [u8; 2],
    slave: u8,
    pdu: Vec<u8>,
    /// Over which connection.
    connection: u32,
}

#[derive(Debug)]
struct Call {
    pdu: Vec<u8>,
    slave: u8,
    at: Instant,
    is_stop: bool,
    /// No other stop was open from when it was given until it was sent.
    is_alone: bool,
    /// None to its drive was in vain before: where it is alone too, the printed bound counts.
    is_first: bool,
    sent: bool,
    outcome: Option<Outcome>,
}

struct World {
    setting: Setting,
    master: Master<u32>,
    config: LineConfig,
    now: Instant,
    calls: BTreeMap<u32, Call>,
    connection: u32,
    /// What waits in the gateway, and what it is at, until when, and whether the drive has heard it.
    queue: VecDeque<Question>,
    at: Option<(Question, Instant, bool)>,
    dead: BTreeSet<u8>,
    /// When each drive was asked for last, whether that was taken or refused.
    wanted: BTreeMap<u8, Instant>,
    /// What drive 1 has counted: each answer tells another number.
    number: u16,
}

impl World {
    fn new(setting: Setting) -> Self {
        let config = setting.config();
        let begun = Instant::now();
        let mut master = Master::new(begun, config.clone());
        master.handle_up(begun);
        Self {
            setting,
            master,
            config,
            now: begun + Duration::from_secs(1),
            calls: BTreeMap::new(),
            connection: 0,
            queue: VecDeque::new(),
            at: None,
            dead: BTreeSet::from([3]),
            wanted: BTreeMap::new(),
            number: 0,
        }
    }

    fn take(&mut self, step: Step) -> Held {
        super::trace(self.now, format_args!("{step:?}"));
        let value = 1 + self.calls.len() as u16;
        match step {
            Step::Read => self.ask(1, Request::ReadHoldingRegisters(READ, 2), Terms::of(Class::Status))?,
            Step::Neighbour => {
                self.ask(2, Request::ReadHoldingRegisters(READ, 2), Terms::of(Class::Status))?;
            }
            Step::Absent => self.ask(3, Request::ReadHoldingRegisters(READ, 2), Terms::of(Class::Status))?,
            Step::Command => {
                let terms = Terms::of(Class::Command).within(1_000 * MS);
                self.ask(1, Request::WriteSingleRegister(COMMAND, value), terms)?;
            }
            Step::Stop => self.ask(1, Request::WriteSingleRegister(STOP, value), Terms::of(Class::Stop))?,
            Step::StopInVain => {
                self.ask(3, Request::WriteSingleRegister(STOP, value), Terms::of(Class::Stop))?;
            }
            Step::Dies => {
                if !self.dead.remove(&1) {
                    self.dead.insert(1);
                }
            }
            Step::Lost => {
                self.port_is_left();
                self.master.handle_lost(self.now, "the connection was lost");
                self.collect()?;
                self.run_for(10 * MS)?;
                self.master.handle_up(self.now);
            }
            Step::Wait => self.run_for(330 * MS)?,
            Step::LongWait => self.run_for(1_500 * MS)?,
        }
        self.run_for(Duration::ZERO)
    }

    fn ask(&mut self, slave: u8, request: Request<'static>, terms: Terms) -> Held {
        let id = self.calls.len() as u32;
        let pdu = drive_bus::pdu::encode(&request).map_err(|_| "it is encoded")?.to_vec();
        let is_stop = terms.class == Class::Stop;
        let open = |call: &&mut Call| call.is_stop && call.outcome.is_none();
        self.wanted.insert(slave, self.now);
        match self.master.submit(self.now, slave, request, terms, id) {
            Ok(_) => {
                let in_vain =
                    |call: &Call| call.is_stop && call.slave == slave && !matches!(call.outcome, Some(Ok(_)));
                let is_first = !self.calls.values().any(in_vain);
                let mut is_alone = true;
                for other in self.calls.values_mut().filter(|call| is_stop && open(call)) {
                    (other.is_alone, is_alone) = (false, false);
                }
                let at = self.now;
                let call = Call { pdu, slave, at, is_stop, is_alone, is_first, sent: false, outcome: None };
                self.calls.insert(id, call);
            }
            Err(_) if is_stop => return Err("a stop is taken whatever is known of its slave"),
            Err(_) => {}
        }
        self.run_for(Duration::ZERO)
    }

    /// It goes on with what waits.
    fn next_question(&mut self) -> Held {
        if self.at.is_some() {
            return Ok(());
        }
        let Some(question) = self.queue.pop_front() else { return Ok(()) };
        let lives = !self.dead.contains(&question.slave);
        let takes = if lives { RESPONSE } else { WAIT };
        let first = self.calls.values().find(|call| call.pdu == question.pdu && call.slave == question.slave);
        // Repetitions of a stop that was in vain, and what a lost connection has held up, are bounded by no arithmetic here.
        if self.connection == 0
            && let Some(call) = first.filter(|call| call.is_stop && call.outcome.is_none())
            && question.slave == 1
            && self.now - call.at > self.config.worst_case_stop(8, 32)
            && self.calls.values().filter(|call| call.is_stop).count() == 1
        {
            return Err("a stop is on the drives' line within the printed bound");
        }
        self.at = Some((question, self.now + takes, lives));
        Ok(())
    }

    fn far_end(&self) -> Option<FarEndStats> {
        self.master.stats(self.now).far_end
    }

    fn knows_no_more_than_there_is(&self) -> Held {
        let Some(far_end) = self.far_end() else { return Err("there is a gateway") };
        if far_end.at_once > 1 {
            return Err("one that does one thing at a time is not taken for one that does more");
        }
        // When it was done with what it says nothing of nobody knows, so that two may be taken for one: never later than that. Of what a
        // lost connection has left there nothing is known at all.
        if self.connection == 0 && far_end.wait_is == WaitIs::Seen && far_end.wait > 2 * WAIT + 100 * MS {
            return Err("it is not taken to wait for more than twice as long as it does");
        }
        if far_end.owed > 32 {
            return Err("what is owed has a bound");
        }
        Ok(())
    }

    /// How soon a drive that is asked for is asked again: a question in vain costs a line behind such a gateway its whole wait, and takes
    /// 14 thousandths of it (`probing.rs`). One may be under way, and the other drive that is not there is asked for no more.
    fn returned_within(&self) -> Duration {
        let wait = self.far_end().map_or(Duration::ZERO, |far_end| far_end.wait);
        wait * 1_000 / 14 + Duration::from_secs(60)
    }

    /// Everything has ended, and a drive that lives is answered for.
    fn ends(&mut self) -> Held {
        self.dead.remove(&1);
        self.run_for(AFTER + AFTER_EACH * self.calls.len() as u32)?;
        self.master.handle_timeout(self.now);
        if self.calls.values().any(|call| call.outcome.is_none()) {
            return Err("every call ends");
        }
        if self.calls.values().any(|call| call.is_stop && !call.sent) {
            return Err("a stop is sent");
        }
        if self.far_end().is_none_or(|far_end| far_end.owed > 0) {
            return Err("what is owed is over at its time");
        }
        let (begun, within) = (self.now, self.returned_within());
        while self.now < begun + within {
            let id = self.calls.len() as u32;
            self.ask(1, Request::ReadHoldingRegisters(READ, 2), Terms::of(Class::Status))?;
            self.run_for(Duration::from_secs(15))?;
            if self.calls.get(&id).is_some_and(|call| matches!(call.outcome, Some(Ok(Ok(_))))) {
                return Ok(());
            }
        }
        super::trace(self.now, format_args!("{:#?}", self.master.stats(self.now)));
        Err("a drive that answers again is asked again")
    }
}

impl Clocked for World {
    fn master(&mut self) -> &mut Master<u32> {
        &mut self.master
    }

    fn now(&mut self) -> &mut Instant {
        &mut self.now
    }

    fn port_is_left(&mut self) {
        self.connection += 1;
    }

    /// When the gateway is done with what it is at.
    fn next(&self) -> Option<Instant> {
        self.at.as_ref().map(|(_, done, _)| *done)
    }

    fn happens(&mut self) -> Held {
        let Some((question, _, answers)) = self.at.take() else { return Ok(()) };
        let Question { transaction: [a, b], slave, pdu, connection } = question;
        super::trace(
            self.now,
            format_args!("<- {slave}: {pdu:02X?}, answered: {answers}, of connection {connection}"),
        );
        let answer = match (answers, self.setting) {
            (false, Setting::Silent) => None,
            (false, _) => Some(vec![pdu[0] | 0x80, 0x0B]),
            (true, _) if pdu[0] == 3 => {
                self.number += 1;
                let words = [self.number, u16::from(slave)].into_iter().chain(std::iter::repeat(0));
                let count = pdu.last().copied().unwrap_or_default();
                let data = words.take(count.into()).flat_map(u16::to_be_bytes);
                Some([3, 2 * count].into_iter().chain(data).collect())
            }
            (true, _) => Some(pdu),
        };
        if let Some(answer) = answer.filter(|_| connection == self.connection) {
            let [high, low] = (answer.len() as u16 + 1).to_be_bytes();
            let frame = [&[a, b, 0, 0, high, low, slave], &answer[..]].concat();
            self.master.handle_bytes(self.now, &frame);
            self.collect()?;
        }
        self.next_question()
    }

    fn transmitted(&mut self, frame: &[u8]) -> Held {
        let [a, b, 0, 0, _, _, slave, pdu @ ..] = frame else { return Err("it is a frame of Modbus TCP") };
        super::trace(self.now, format_args!("-> {slave}: {pdu:02X?}, {} before it", self.queue.len()));
        let is_stop = matches!(pdu, [6, 0, at, ..] if u16::from(*at) == STOP);
        let is_known = self.setting != Setting::Unknown;
        if is_known && !is_stop && self.at.is_some() {
            return Err(
                "a gateway that does one thing at a time is given nothing but a stop while it is at a question",
            );
        }
        let is_open = self.calls.values().any(|call| call.slave == *slave && call.outcome.is_none());
        let is_wanted = self.wanted.get(slave).is_some_and(|at| self.now <= *at + INTEREST);
        if !is_open && !is_wanted {
            return Err("who is lost and whom nobody asks for is not asked");
        }
        // One that is given behind another has that one under way before it.
        let stops = self.calls.values().filter(|call| call.is_stop).count();
        let call = self.calls.values_mut().find(|call| !call.sent && call.slave == *slave && call.pdu == pdu);
        if let Some(call) = call {
            call.sent = true;
            let waited = self.now - call.at;
            let most = self.config.worst_case_stop(8, 32);
            if call.is_stop && stops == 1 && waited > TIMEOUT + 20 * MS {
                return Err("a stop waits for the exchange under way and for nothing else");
            }
            // Repetitions to one that is off-line have their share of the line.
            let is_bounded = call.is_first && (stops == 1 || call.slave == 1);
            if call.is_stop && call.is_alone && is_bounded && waited > most {
                return Err("a stop waits no longer than the printed bound");
            }
            if call.is_stop && call.is_alone && waited > most + SHARE {
                return Err("a stop waits no longer than its share, however many were in vain before it");
            }
        }
        let connection = self.connection;
        self.queue.push_back(Question {
            transaction: [*a, *b],
            slave: *slave,
            pdu: pdu.to_vec(),
            connection,
        });
        self.next_question()
    }

    fn collect(&mut self) -> Held {
        while let Some((id, outcome)) = self.master.poll_outcome() {
            let Some(call) = self.calls.get_mut(&id) else {
                return Err("an outcome of a call that nobody made");
            };
            if call.outcome.is_some() {
                return Err("a call ends once");
            }
            if let Ok(Ok(Response::ReadHoldingRegisters(words))) = &outcome {
                // The newest answer is the only one that can be that to a question of now.
                if words[..] != [self.number, u16::from(call.slave)] {
                    return Err("a value is the answer to its own question");
                }
            }
            call.outcome = Some(outcome);
        }
        self.knows_no_more_than_there_is()
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
