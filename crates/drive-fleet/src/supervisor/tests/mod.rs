//! The machine alone: a made-up drive answers what it is asked, time is a number.

mod adoption;
mod causes;
mod connection;
mod control;
mod eeprom;
mod matrix;
mod off_setpoint;
mod orders;
mod questions;
mod shown;
mod stops;
mod undone;
mod withdrawn;

use std::time::Duration;

use drive_core::{
    Command, Control, Direction, ExceptionMeaning, Exchange, Fault, Frequency, Identity, Lack, Lease,
    Measurements, Motion, PortError, Reaction, Recognised, Refusal, Result, SelfRestart, SlaveAddress, State,
    StopMode, Stopped, Verdict, Watchdog, Withdrawn, Written, registers::Storage,
};

use super::*;
use crate::{
    cause::Act,
    event::{ExitAction, Happened},
    limits::{Band, FrequencyLimits},
    outcome::{Order, Refused, Unconfirmed, Until},
    settings::{Commanders, OnControlTaken, OnExit, OnFault, OnLoss},
    snapshot::Snapshot,
    stop_order::StopOrder,
    testing::CAPABILITIES,
    watchdog::WatchdogContract,
};

const MS: Duration = Duration::from_millis(1);
const CONTRACT: WatchdogContract =
    WatchdogContract { timeout: Duration::from_secs(2), reaction: Reaction::Ramp };

const ANOTHER_WORD: Refusal = Refusal::Overridden { by: "another word", remedy: "see whose it is" };

/// A drive of paper: what it is, and whether it answers.
struct Paper {
    status: Status,
    identity: Identity,
    recognised: Recognised,
    watchdog: Watchdog,
    reference: Option<drive_core::Setpoint>,
    /// The error of every job while it lasts.
    failing: Option<PortError>,
    /// By which exception it answers whoever asks for its status, and what that means.
    refuses: Option<(u8, ExceptionMeaning)>,
    /// A command is carried out and its answer is lost, once.
    loses_answer: bool,
    /// The fault that it names when it is asked, of one whose status names none.
    names_fault: Option<u16>,
    /// What a run command does; `false`: nothing.
    obeys: bool,
    /// By which mode it stops whatever it is told, and why.
    stops_by: Option<(StopMode, &'static str)>,
    /// Whether it has a word that withdraws a run command.
    withdraws: bool,
    /// Its run word still stands when a withdrawal looks.
    word_stands: bool,
    self_restarts: Vec<SelfRestart>,
    /// It confirms the write of its watchdog and keeps what it had.
    keeps_watchdog: bool,
    /// It says so in its answer to the write.
    denies_watchdog: bool,
    /// It refuses the write of its watchdog: not now.
    refuses_watchdog: bool,
    /// A stop takes the command from whoever has it.
    takes_command: bool,
    /// A stop brings it onto a ramp on which it stays.
    ramps: bool,
    /// It refuses every stop: not now.
    refuses_stops: bool,
    /// No stop leaves for its line in time.
    expires_stops: bool,
    /// Its driver sends no stop, because.
    withholds_stops: Option<Refusal>,
    /// It takes every stop and goes on, and why, where its driver knows.
    denies_stops: Option<Option<Refusal>>,
    /// It refuses a start, because.
    withholds_starts: Option<Refusal>,
    /// A setpoint is not confirmed, for this reason.
    denies_setpoints: Option<Refusal>,
    /// The run command of this side that it holds.
    lease: Option<Lease>,
    /// The run command that stands in it, whoever has given it, once one of before was taken for ours.
    held: Option<Option<Lease>>,
    /// What its statuses say of that, whatever else they show.
    says: Option<Verdict>,
    /// The content of every register.
    register: u16,
    log: Vec<Job>,
    /// What an order reads before it writes is not answered.
    reads_in_vain: bool,
}

fn slave() -> SlaveAddress {
    SlaveAddress::try_from(1).unwrap()
}

fn port_error(problem: PortError) -> Error {
    Error::Port { slave: slave(), exchange: Exchange { function: 3, register: Some(3201) }, problem }
}

/// The same of the write of an order: nobody knows what became of it, where it was sent.
fn of_a_write(error: Error) -> Error {
    let exchange = Exchange { function: 6, register: Some(8501) };
    match error {
        Error::Port { slave, problem, .. } => Error::Port { slave, exchange, problem },
        error => error,
    }
}

/// A write that the drive refuses by exception 04.
fn not_now(register: u16) -> Error {
    let exchange = Exchange { function: 6, register: Some(register) };
    Error::Exception { slave: slave(), exchange, code: 4, meaning: ExceptionMeaning::NotNow }
}

impl Paper {
    fn new() -> Self {
        Self {
            status: Status {
                state: State::Ready,
                output_frequency: Some(Frequency::ZERO),
                control: Some(Control::Bus),
                at_reference: Some(false),
                motion: Motion::AtRest,
                ..Status::default()
            },
            identity: Identity { model: Some("one".to_owned()), ..Identity::default() },
            recognised: Recognised::CannotTell,
            watchdog: Watchdog { timeout: None, reaction: None },
            reference: None,
            failing: None,
            refuses: None,
            loses_answer: false,
            names_fault: None,
            obeys: true,
            stops_by: None,
            withdraws: true,
            word_stands: true,
            self_restarts: Vec::new(),
            keeps_watchdog: false,
            denies_watchdog: false,
            refuses_watchdog: false,
            takes_command: false,
            ramps: false,
            refuses_stops: false,
            expires_stops: false,
            withholds_stops: None,
            denies_stops: None,
            withholds_starts: None,
            denies_setpoints: None,
            lease: None,
            held: None,
            says: None,
            register: 0,
            log: Vec::new(),
            reads_in_vain: false,
        }
    }

    fn run(&mut self) {
        let reference = self.reference;
        self.status.state = State::Running;
        self.status.motion = Motion::Driven;
        self.status.at_reference = Some(true);
        self.status.output_frequency = match reference {
            Some(drive_core::Setpoint::Frequency(frequency)) => Some(frequency),
            _ => Some(Frequency::from_hertz(10)),
        };
    }

    fn stand(&mut self) {
        self.status.state = State::Ready;
        self.status.motion = Motion::AtRest;
        self.status.at_reference = Some(false);
        self.status.output_frequency = Some(Frequency::ZERO);
    }

    fn come_down(&mut self) {
        self.status.state = State::Stopping;
        self.status.motion = Motion::Braking;
        self.status.at_reference = Some(false);
    }

    fn trip(&mut self, code: u16) {
        self.stand();
        self.status.state = State::Fault;
        self.status.fault_code = Some(code);
    }

    fn result<T>(&mut self, value: T) -> Result<T> {
        if std::mem::take(&mut self.loses_answer) {
            return Err(port_error(PortError::OutcomeUnknown("no answer")));
        }
        match &self.failing {
            Some(problem) => Err(port_error(problem.clone())),
            None => Ok(value),
        }
    }

    /// As a family judges it: by who commands, whether it has tripped, and whether it runs.
    fn verdict(&mut self) -> Option<Verdict> {
        if let Some(held) = self.held.take()
            && held != self.lease
        {
            self.lease = None;
            return Some(Verdict::lacks(Lack::Command, ANOTHER_WORD));
        }
        self.lease.map(|_| self.says.unwrap_or_else(|| self.shown()))
    }

    fn shown(&self) -> Verdict {
        match (self.status.control, self.status.state) {
            (_, State::Fault) => Verdict::lacks(Lack::Output, Refusal::Tripped),
            (Some(other), _) if other != Control::Bus => {
                Verdict::lacks(Lack::Command, Refusal::NotInControl(other))
            }
            (_, State::Running) => Verdict::InForce,
            (_, state) => Verdict::lacks(Lack::Output, Refusal::State(state)),
        }
    }

    fn status(&mut self) -> Result<Status> {
        if let Some((code, meaning)) = self.refuses {
            let exchange = Exchange { function: 3, register: Some(3201) };
            return Err(Error::Exception { slave: slave(), exchange, code, meaning });
        }
        let status = Status { verdict: self.verdict(), ..self.status.clone() };
        self.result(status)
    }

    fn answer(&mut self, job: Job) -> Reply {
        self.log.push(job);
        if self.reads_in_vain && matches!(job, Job::Start(_) | Job::SetSetpoint(..) | Job::ResetFaults) {
            let error = port_error(PortError::Timeout { after: 100 * MS });
            return match job {
                Job::SetSetpoint(..) => Reply::Setpoint(Err(error)),
                _ => Reply::Ordered(Err(error)),
            };
        }
        let reached = self.failing.is_none();
        match job {
            Job::Stop(_) if self.expires_stops => Reply::Stopped(Err(port_error(PortError::Expired))),
            Job::Stop(mode) if self.withholds_stops.is_some() => {
                let (slave, command) = (slave(), Command::Stop(mode));
                let reason = self.withholds_stops.expect("it was looked at");
                Reply::Stopped(Err(Error::Refused { slave, command, reason }))
            }
            Job::Stop(_) if self.refuses_stops => Reply::Stopped(Err(not_now(8501))),
            Job::Stop(mode) if self.denies_stops.is_some() => {
                let because = self.denies_stops.flatten();
                let (slave, command) = (slave(), Command::Stop(mode));
                let status = Box::new(self.status.clone());
                Reply::Stopped(Err(Error::NotConfirmed { slave, command, status, because }))
            }
            Job::Stop(asked) => {
                if reached && self.obeys {
                    if self.ramps {
                        self.come_down();
                    } else {
                        self.stand();
                    }
                    self.lease = None;
                }
                let other = self.status.control.filter(|of| *of != Control::Bus && self.takes_command);
                if other.is_some() {
                    self.status.control = Some(Control::Bus);
                }
                let (mode, instead) = match self.stops_by {
                    Some((mode, why)) if mode != asked => (mode, Some(why)),
                    _ => (asked, None),
                };
                let stopped = self.status().map(|status| Stopped {
                    instead,
                    taken_from: other,
                    ..Stopped::by(mode, status)
                });
                Reply::stopped(slave(), asked, stopped)
            }
            Job::Withdraw if !self.withdraws => {
                let (what, reason) = ("withdrawal of the run command", "a test");
                Reply::Withdrawn(Err(Error::Unsupported { what, reason }))
            }
            Job::Withdraw => {
                let stood = self.word_stands;
                if reached {
                    (self.lease, self.word_stands) = (None, true);
                }
                let told = if stood { Withdrawn::Ended } else { Withdrawn::Nothing };
                Reply::Withdrawn(self.status().map(told))
            }
            Job::SelfRestarts => {
                let restarts = self.self_restarts.clone();
                Reply::SelfRestarts(self.result(restarts))
            }
            Job::Start(direction) => {
                let tripped = self.status.is_fault().then_some(Refusal::Tripped);
                if let Some(reason) = self.withholds_starts.or(tripped) {
                    let command = Command::Start(direction);
                    return Reply::Ordered(Err(Error::Refused { slave: slave(), command, reason }));
                }
                if reached && self.obeys {
                    self.run();
                    self.status.direction = Some(direction);
                    self.lease = Some(Lease::new(direction, 0x000F));
                }
                Reply::started(slave(), direction, None, self.status().map_err(of_a_write))
            }
            Job::SetSetpoint(setpoint, _) => {
                if reached && self.obeys {
                    self.reference = Some(setpoint);
                    if self.status.state == State::Running {
                        self.run();
                    }
                }
                if let because @ Some(_) = self.denies_setpoints {
                    let (slave, command) = (slave(), Command::Setpoint(setpoint));
                    let status = Box::new(self.status.clone());
                    return Reply::Setpoint(Err(Error::NotConfirmed { slave, command, status, because }));
                }
                Reply::Setpoint(self.result(()).map_err(of_a_write))
            }
            Job::ResetFaults => {
                if reached && self.obeys {
                    self.stand();
                    self.status.fault_code = None;
                }
                Reply::Ordered(self.status().map_err(of_a_write))
            }
            Job::Release => {
                self.status.control = Some(Control::Terminals);
                Reply::Ordered(self.status().map_err(of_a_write))
            }
            Job::Persist => Reply::Saved(self.result(1).map_err(of_a_write)),
            Job::ArmWatchdog(..) if self.refuses_watchdog => Reply::Watchdog(Err(not_now(6005))),
            Job::ArmWatchdog(..) if self.denies_watchdog => {
                let (slave, command) = (slave(), Command::Configure("watchdog"));
                let status = Box::new(self.status.clone());
                Reply::Watchdog(Err(Error::NotConfirmed { slave, command, status, because: None }))
            }
            Job::ArmWatchdog(timeout, reaction) => {
                if reached && !self.keeps_watchdog {
                    self.watchdog = Watchdog { timeout: Some(timeout), reaction: Some(reaction) };
                }
                let watchdog = self.watchdog;
                Reply::Watchdog(self.result(watchdog))
            }
            Job::RestoreWatchdog(found) => {
                if reached {
                    self.watchdog = found;
                }
                let watchdog = self.watchdog;
                Reply::Watchdog(self.result(watchdog))
            }
            Job::KeepAlive => Reply::KeptAlive(self.result(())),
            Job::Status { .. } => Reply::Status(self.status()),
            Job::Identify => {
                let identity = (self.identity.clone(), self.recognised);
                Reply::Identity(self.result(identity))
            }
            Job::Watchdog => {
                let watchdog = self.watchdog;
                Reply::Watchdog(self.result(watchdog))
            }
            Job::Ask(Question::Write(_, word)) => {
                let changed = self.register != word;
                self.register = word;
                let written = Written { changed, storage: Storage::Volatile };
                Reply::Told(self.result(Told::Written(written)))
            }
            Job::Ask(Question::Read(_)) => {
                let word = self.register;
                Reply::Told(self.result(Told::Word(word)))
            }
            Job::Ask(Question::Faults) => {
                Reply::Told(self.result(Told::Faults(drive_core::Faults::default())))
            }
            Job::Faults => {
                let code = self.names_fault.or(self.status.fault_code).filter(|_| self.status.is_fault());
                let present = code.map(|code| Fault { code, entry: None }).into_iter().collect();
                Reply::Faults(self.result(drive_core::Faults { present, ..drive_core::Faults::default() }))
            }
            Job::Measurements => {
                let measurements = Measurements { reference: self.reference, ..Measurements::default() };
                Reply::Measurements(self.result(measurements))
            }
        }
    }

    /// Jobs that write.
    fn writes(&self) -> Vec<Job> {
        self.log.iter().copied().filter(|job| !job.is_poll()).collect()
    }
}

/// The machine, the drive and the time.
struct Rig {
    machine: Supervisor,
    drive: Paper,
    /// The run command that stands in the drive from before, whoever has given it.
    stands: Option<Lease>,
    now: Instant,
    outputs: Vec<Output>,
    next_call: u64,
    /// Nothing is granted beside statuses, orders and frames for the watchdog.
    others_have_the_turn: bool,
    /// Another drive of its line starts.
    others_start: bool,
}

impl Rig {
    fn new(settings: DriveSettings) -> Self {
        Self::over(settings, false)
    }

    /// Over a drive whose watchdog stands in its EEPROM, or not.
    fn over(settings: DriveSettings, wears: bool) -> Self {
        let now = Instant::now();
        let watchdog = CAPABILITIES.watchdog.map(|watchdog| WatchdogCapability { wears, ..watchdog });
        let machine = Supervisor::new(now, settings, watchdog, CAPABILITIES.communication_fault);
        Self {
            machine,
            drive: Paper::new(),
            stands: None,
            now,
            outputs: Vec::new(),
            next_call: 0,
            others_have_the_turn: false,
            others_start: false,
        }
    }

    fn controlled() -> Self {
        Self::new(settings())
    }

    /// A drive that has been connected, identified and whose watchdog is verified.
    fn ready() -> Self {
        let mut rig = Self::controlled();
        rig.pass(1_500 * MS);
        rig.outputs.clear();
        rig.drive.log.clear();
        rig
    }

    /// One that was started by an order, and has confirmed it.
    fn running_at(hertz: u16) -> Self {
        let mut rig = Self::ready();
        let id = rig.order(run_at(hertz));
        rig.pass(500 * MS);
        assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
        rig
    }

    fn snapshot(&self) -> Snapshot {
        self.machine.snapshot(self.now)
    }

    /// What to do now, where the row of those of its line that start was looked at.
    fn next(&mut self) -> Step {
        match self.machine.next(self.now) {
            Step::Wait(_) if self.machine.start_turn() == Turn::Wanted => {
                if self.others_start {
                    self.machine.handle_row();
                } else {
                    self.machine.grant_start_turn();
                }
                self.machine.next(self.now)
            }
            step => step,
        }
    }

    /// Lets the machine work for a time; each job takes 20 ms.
    fn pass(&mut self, time: Duration) {
        let until = self.now + time;
        let mut turns = 0;
        while self.now < until {
            turns += 1;
            assert!(turns < 10_000, "the machine spins at {:?}", self.machine);
            if let Some(lease) = self.machine.take_adoption() {
                (self.drive.held, self.drive.lease) = (Some(self.stands), Some(lease));
                self.machine.handle_lease(self.drive.lease);
            }
            match self.next() {
                Step::Do { job, until, .. } => {
                    assert!(until.is_none_or(|until| until > self.now), "{job:?} would never be done");
                    self.now += 20 * MS;
                    let reply = self.drive.answer(job);
                    if reply.error().is_none() {
                        self.machine.handle_heard(self.now);
                    }
                    self.machine.handle_lease(self.drive.lease);
                    self.machine.handle_reply(self.now, reply);
                }
                Step::Wait(_) if self.machine.turn() == Turn::Wanted && !self.others_have_the_turn => {
                    self.machine.grant_turn();
                }
                Step::Wait(at) => self.now = at.clamp(self.now + Duration::from_micros(1), until),
                Step::Finished => self.now = until,
            }
            self.collect();
        }
    }

    fn collect(&mut self) {
        while let Some(output) = self.machine.poll_output() {
            self.outputs.push(output);
        }
    }

    fn asker(&mut self) -> Asker {
        self.next_call += 1;
        Asker::Caller { id: CallId(self.next_call), act: Arc::new(Act::of("tester")) }
    }

    fn order(&mut self, order: Order) -> CallId {
        let asker = self.asker();
        self.machine.handle_order(self.now, asker, order, None, None);
        CallId(self.next_call)
    }

    fn stop(&mut self, order: impl Into<StopOrder>) -> CallId {
        let asker = self.asker();
        if self.machine.handle_stop(self.now, asker, order.into(), None) {
            self.machine.handle_dropped(self.now);
        }
        CallId(self.next_call)
    }

    fn outcome(&self, id: CallId) -> Option<&Outcome> {
        self.outputs.iter().find_map(|output| match output {
            Output::Answer(answered, outcome) if *answered == id => Some(outcome),
            _ => None,
        })
    }

    fn happened(&self) -> impl Iterator<Item = &Happened> {
        self.outputs.iter().filter_map(|output| match output {
            Output::Event(happened) => Some(happened),
            Output::InForce(..) | Output::Answer(..) | Output::Told(..) | Output::Untold(_) => None,
        })
    }

    fn events(&self) -> Vec<&'static str> {
        self.happened().map(|happened| happened.kind.name()).collect()
    }

    /// Why the last event of this name happened.
    fn cause_of(&self, name: &str) -> Option<Cause> {
        let last = self.happened().filter(|happened| happened.kind.name() == name).last();
        last.map(|happened| happened.cause.clone())
    }

    /// How often this was told.
    fn times_told(&self, kind: &EventKind) -> usize {
        self.happened().filter(|happened| happened.kind == *kind).count()
    }
}

fn settings() -> DriveSettings {
    DriveSettings { watchdog: Some(CONTRACT), ..DriveSettings::controlled("pump") }
}

const START: Order = Order::Start { direction: Direction::Forward, setpoint: None, until: Until::InForce };

fn run_at(hertz: u16) -> Order {
    let setpoint = Some(Frequency::from_hertz(hertz).into());
    Order::Start { direction: Direction::Forward, setpoint, until: Until::AtReference }
}

/// Who has seen a drive of this model accepts it.
fn accept_of(model: &str) -> Order {
    Order::AcceptIdentity((&Identity { model: Some(model.to_owned()), ..Identity::default() }).into())
}

fn setpoint(hertz: u16) -> Order {
    Order::Setpoint { setpoint: Frequency::from_hertz(hertz).into(), until: Until::InForce }
}
