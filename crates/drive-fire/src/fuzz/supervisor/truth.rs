//! What is true of the drive that a supervisor is fuzzed by, and what follows from it.

use std::time::Duration;

use drive_core::{
    Command, Control, Direction, Error, ExceptionMeaning, Exchange, Frequency, Lack, Lease, Motion,
    PortError, Refusal, Result, SlaveAddress, State, Status, Verdict,
};
use drive_fleet::Outcome;
use tokio::time::Instant;

use super::Ordered;
use crate::fuzz::Source;

/// The most that its owner allows; commands go up to 49 Hz.
pub(super) const LIMIT: Frequency = Frequency::from_hertz(42);
/// The oldest status that counts as fresh (drive-fleet's default), and a moment for what is under way.
const FRESH: Duration = Duration::from_millis(3_200);
/// It takes so long at the least to put another one in its place: longer than it may be silent without being lost.
const EXCHANGED: Duration = Duration::from_secs(6);
/// From a stop that was taken to standstill.
const RAMP: Duration = Duration::from_secs(2);

/// From when a start is given on nothing of it is written behind this: the second that it may wait, the two that it may take behind that,
/// and a write that was under way.
const LONGEST_START: Duration = Duration::from_millis(3_400);

/// Something that was ordered, and is not told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Given {
    pub(super) ordered: Ordered,
    pub(super) at: Instant,
    /// Who has ordered it.
    pub(super) by: &'static str,
    /// What a start brings along.
    pub(super) setpoint: Option<Frequency>,
    /// It was ordered of several: it has its turn when it has.
    pub(super) of_group: bool,
}

/// What its owner allows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    /// Who alone may command it; `None`: whoever does.
    pub(super) nobody_but: Option<&'static str>,
    /// The most that it may turn at.
    pub(super) limit: Frequency,
}

/// What is true, and what follows from it.
pub(super) struct Truth {
    pub(super) source: Source,
    pub(super) control: bool,
    /// Nothing is lost any more, and nothing happens.
    pub(super) calm: bool,
    /// The run command that stands in it, and since when.
    pub(super) run: Option<(Direction, Instant)>,
    comes_down_until: Option<Instant>,
    pub(super) tripped: bool,
    pub(super) taken: bool,
    pub(super) is_another: bool,
    /// No reading is answered until then.
    mute_until: Option<Instant>,
    pub(super) reference: Frequency,
    /// When another master has written it.
    foreign: Option<Instant>,
    pub(super) lease: Option<Lease>,
    /// The last status that it told, and the last that told a run command in force, and which way.
    told_status: Option<(Instant, bool)>,
    told_in_force: Option<(Instant, Direction)>,
    /// What it said first of what it is, and last.
    pub(super) identities: Option<(bool, bool)>,
    /// Since when a stop stands that was taken.
    pub(super) stopped_at: Option<Instant>,
    given_start: Option<Instant>,
    given_stop: Option<Instant>,
    given_setpoint: Option<Instant>,
    pub(super) pending: Vec<Given>,
    /// What its owner allows, since when, and whether it stood then: what turns goes on.
    pub(super) rule: Rule,
    ruled: Option<(Instant, bool)>,
    /// Since when it is being taken out, or all end.
    pub(super) leaving: Option<Instant>,
    /// From when to when each start was on its way that was confirmed.
    confirmed: Vec<(Instant, Instant)>,
    /// When each start was given, and told.
    starts: Vec<(Instant, Option<Instant>)>,
    /// When a run command was carried out.
    pub(super) carried: Vec<Instant>,
    pub(super) resets_ordered: u32,
    pub(super) resets: u32,
    pub(super) against: Option<String>,
    /// What happened, for whoever reads of a find.
    pub(super) story: Vec<String>,
}

/// What becomes of a write.
pub(super) enum Fate {
    Done,
    /// Its answer is lost, and it was carried out.
    LostAnswer,
    Fails(Error),
    /// It is answered, and the drive shows otherwise.
    Unshown,
}

pub(super) fn slave() -> SlaveAddress {
    SlaveAddress::try_from(1).expect("it is an address")
}

pub(super) fn port(problem: PortError, function: u8) -> Error {
    Error::Port { slave: slave(), exchange: Exchange { function, register: Some(8501) }, problem }
}

impl Truth {
    pub(super) fn new(source: Source, control: bool) -> Self {
        Self {
            source,
            control,
            calm: false,
            run: None,
            comes_down_until: None,
            tripped: false,
            taken: false,
            is_another: false,
            mute_until: None,
            reference: Frequency::from_hertz(30),
            foreign: None,
            lease: None,
            told_status: None,
            told_in_force: None,
            identities: None,
            stopped_at: None,
            given_start: None,
            given_stop: None,
            given_setpoint: None,
            pending: Vec::new(),
            rule: Rule { nobody_but: None, limit: LIMIT },
            ruled: None,
            leaving: None,
            confirmed: Vec::new(),
            starts: Vec::new(),
            carried: Vec::new(),
            resets_ordered: 0,
            resets: 0,
            against: None,
            story: Vec::new(),
        }
    }

    pub(super) fn object(&mut self, what: &str) {
        self.against.get_or_insert_with(|| what.to_owned());
    }

    pub(super) fn note(&mut self, what: impl Into<String>) {
        self.story.push(what.into());
    }

    pub(super) const fn runs(&self) -> bool {
        self.run.is_some()
    }

    /// What happens to it.
    pub(super) fn happens(&mut self, what: u8) {
        self.note(format!("event {what}"));
        match what {
            8 => {
                self.tripped = true;
                self.ends_run();
            }
            9 => self.taken = !self.taken,
            // Somebody else's stop.
            10 => self.ends_run(),
            // Another one comes in its place, and stands.
            11 => {
                self.is_another = !self.is_another;
                self.ends_run();
                (self.comes_down_until, self.tripped) = (None, false);
                // Nobody is that quick.
                self.mute_until = Some(Instant::now() + EXCHANGED);
            }
            12 => {
                let time = Duration::from_millis(self.source.u16(..).into()) / 4;
                self.mute_until = Some(Instant::now() + time);
            }
            // Another master writes its reference.
            14 => {
                self.reference = Frequency::from_hertz(self.source.u16(10..50));
                self.foreign = Some(Instant::now());
            }
            _ => {}
        }
    }

    pub(super) fn becomes_calm(&mut self) {
        self.note("calm");
        // Who is mute says so to its end: another one is put in its place in no shorter time than it takes to miss the first.
        (self.calm, self.taken) = (true, false);
    }

    pub(super) fn ends_run(&mut self) {
        if self.run.take().is_some() {
            self.comes_down_until = Some(Instant::now() + RAMP);
        }
    }

    fn turns(&self) -> bool {
        self.run.is_some() && !self.taken || self.comes_down_until.is_some_and(|until| Instant::now() < until)
    }

    /// Its own words.
    pub(super) fn status(&mut self) -> Status {
        let now = Instant::now();
        if self.run.is_none() {
            self.lease = None;
        }
        let acts = self.run.filter(|_| !self.taken);
        let verdict = match (self.lease, acts) {
            (None, _) => None,
            (Some(lease), Some((direction, _))) if lease.direction == direction => Some(Verdict::InForce),
            _ => Some(Verdict::lacks(Lack::Command, Refusal::NotInControl(Control::Terminals))),
        };
        if let Some((direction, _)) = acts.filter(|_| verdict == Some(Verdict::InForce)) {
            self.told_in_force = Some((now, direction));
        }
        self.told_status = Some((now, self.tripped));
        let (state, motion) = match (self.tripped, acts.is_some(), self.turns()) {
            (true, _, true) => (State::Fault, Motion::Coasting),
            (true, ..) => (State::Fault, Motion::AtRest),
            (_, true, _) => (State::Running, Motion::Driven),
            (_, _, true) => (State::Stopping, Motion::Braking),
            _ => (State::Ready, Motion::AtRest),
        };
        Status {
            state,
            motion,
            verdict,
            direction: acts.map(|(direction, _)| direction),
            output_frequency: Some(if acts.is_some() { self.reference } else { Frequency::ZERO }),
            reference: Some(self.reference),
            at_reference: Some(acts.is_some()),
            control: Some(if self.taken { Control::Terminals } else { Control::Bus }),
            at: Some(now),
            ..Status::default()
        }
    }

    /// Whether a reading is answered.
    pub(super) fn reads(&mut self) -> Result<()> {
        let is_mute = self.mute_until.is_some_and(|until| Instant::now() < until);
        if is_mute || !self.calm && self.source.u8(..12) == 1 {
            return Err(port(PortError::Timeout { after: Duration::from_millis(300) }, 3));
        }
        Ok(())
    }

    pub(super) fn writes(&mut self) -> Fate {
        if self.mute_until.is_some_and(|until| Instant::now() < until) {
            return Fate::Fails(port(PortError::OutcomeUnknown("no answer"), 6));
        }
        if self.calm {
            return Fate::Done;
        }
        match self.source.u8(..16) {
            1 | 2 => Fate::LostAnswer,
            3 => Fate::Fails(port(PortError::OutcomeUnknown("no answer"), 6)),
            4 => Fate::Fails(port(PortError::Expired, 6)),
            5 => Fate::Fails(Error::Exception {
                slave: slave(),
                exchange: Exchange { function: 6, register: Some(8501) },
                code: 4,
                meaning: ExceptionMeaning::NotNow,
            }),
            6 => Fate::Unshown,
            _ => Fate::Done,
        }
    }

    pub(super) fn not_confirmed(&mut self, command: Command) -> Error {
        Error::NotConfirmed { slave: slave(), command, status: Box::new(self.status()), because: None }
    }

    /// Its owner says otherwise.
    pub(super) fn ruled(&mut self, rule: Rule) {
        self.note(format!("{rule:?}"));
        self.ruled = Some((Instant::now(), !self.runs() && !self.turns()));
        self.rule = rule;
    }

    pub(super) fn given(&mut self, given: Given) {
        let Given { ordered, at, .. } = given;
        self.note(format!("{ordered:?} by {}{}", given.by, if given.of_group { " of several" } else { "" }));
        self.pending.push(given);
        match ordered {
            Ordered::Start(_) => {
                self.given_start = Some(at);
                self.starts.push((at, None));
            }
            Ordered::Stop => self.given_stop = Some(at),
            _ => {}
        }
        if !matches!(ordered, Ordered::Stop | Ordered::Other) {
            self.given_setpoint = Some(at);
        }
    }

    /// A run command is written.
    pub(super) fn is_started(&mut self) {
        let now = Instant::now();
        if !self.control {
            self.object("what is only watched is started");
        }
        if !self.pending.iter().any(|given| matches!(given.ordered, Ordered::Start(_))) {
            self.object("it is started, and nobody waits for that");
        }
        if self.given_stop.is_some_and(|stop| stop < now && self.given_start.is_none_or(|start| start < stop))
        {
            self.object("it is started behind a stop that was given after the start");
        }
        match self.told_status {
            None => self.object("it is started, and has told nothing"),
            Some((_, true)) => self.object("it is started, and has told that it has tripped"),
            Some((at, _)) if now - at > FRESH => self.object("it is started by a status that is too old"),
            _ => {}
        }
        if self.identities.is_some_and(|(first, last)| first != last) {
            self.object("it is started, and has told that it is another drive");
        }
    }

    /// A run command is on the wire: of those who wait for a start this way one has to be there whose it can be.
    pub(super) fn run_is_written(&mut self, direction: Direction) {
        let now = Instant::now();
        let is_leaving = self.leaving.is_some_and(|since| since < now);
        // What was on the wire as its owner changed his mind was before that.
        let holds = self.ruled.is_some_and(|(since, stood)| since < now && stood);
        let Rule { nobody_but, limit } = self.rule;
        let newest = self.confirmed.iter().map(|(given, _)| *given).max();
        let asked_since = |at: Instant| self.given_setpoint.max(self.foreign).is_some_and(|since| since > at);
        // That is seen behind the run command.
        let is_foreign = self.foreign.is_some_and(|at| at + LONGEST_START > now);
        let wrong = |given: &Given| {
            if self.given_stop.is_some_and(|stop| given.at < stop && stop < now) {
                Some("behind a stop that was given since")
            } else if holds && nobody_but.is_some_and(|one| one != given.by) {
                Some("for somebody who may not command it any more")
            } else if !given.of_group && now > given.at + LONGEST_START {
                Some("late")
            } else if newest.is_some_and(|newest| newest > given.at) {
                Some("behind one that was given since, and confirmed")
            } else if given.setpoint.is_some_and(|asked| asked != self.reference) && !asked_since(given.at) {
                Some("at another setpoint than it was asked for")
            } else {
                None
            }
        };
        let starts = self.pending.iter().filter(|given| given.ordered == Ordered::Start(direction));
        let wrong: Vec<_> = starts.map(wrong).collect();
        let object = match wrong.first() {
            _ if is_leaving => Some("behind the end of its fleet, or its own"),
            _ if holds && !is_foreign && self.reference > limit => {
                Some("at a setpoint that its owner forbids by now")
            }
            None => Some("and nobody waits for that this way"),
            Some(first) if wrong.iter().all(Option::is_some) => *first,
            Some(_) => None,
        };
        if let Some(object) = object {
            self.against.get_or_insert(format!("it is started {object}"));
        }
    }

    /// Nobody waits any more for what was ordered then.
    pub(super) fn is_dropped(&mut self, ordered: Ordered, given: Instant) {
        self.note(format!("{ordered:?} is dropped"));
        self.pending.retain(|pending| (pending.ordered, pending.at) != (ordered, given));
    }

    pub(super) fn told(&mut self, ordered: Ordered, given: Instant, outcome: &Outcome) {
        let now = Instant::now();
        self.note(format!("{ordered:?} is told: {}", outcome.word()));
        let is_it = |pending: &Given| (pending.ordered, pending.at) == (ordered, given);
        if let Some(at) = self.pending.iter().position(is_it) {
            let asked = self.pending.remove(at).setpoint.filter(|_| self.given_setpoint == Some(given));
            if asked.is_some_and(|asked| asked != self.reference) && outcome.is_confirmed() && self.runs() {
                self.object("a start is confirmed at another reference than it was given");
            }
        }
        if let Ordered::Start(_) = ordered {
            self.start_is_told(given, now, outcome);
        }
        let is_confirmed = outcome.is_confirmed();
        if is_confirmed && !self.control {
            self.object("a command to what is only watched is confirmed");
        }
        match ordered {
            Ordered::Start(direction) if is_confirmed => {
                self.confirmed.push((given, now));
                if self.told_in_force.is_none_or(|(at, told)| at < given || told != direction) {
                    self.object("a start is confirmed that the drive has not shown");
                }
            }
            Ordered::Stop if is_confirmed => {
                // Who was asked to start meanwhile may run again.
                let is_last = self.given_start.is_none_or(|start| start <= given);
                // A motor that has tripped, and coasts, is stopped.
                if is_last && (self.runs() || self.turns() && !self.tripped) {
                    self.object("a stop is confirmed while the motor turns");
                }
                if self.stopped_at.is_none() {
                    self.object("a stop is confirmed that the drive has never taken");
                }
            }
            Ordered::Setpoint(frequency) if is_confirmed => {
                let is_last = self.given_setpoint == Some(given);
                if is_last && self.reference != frequency {
                    self.object("a setpoint is confirmed that the drive does not hold");
                }
            }
            _ => {}
        }
    }

    /// What is told of a start against what was done of it, where no other was on its way meanwhile.
    fn start_is_told(&mut self, given: Instant, now: Instant, outcome: &Outcome) {
        let is_it = |start: &&mut (Instant, Option<Instant>)| start.0 == given && start.1.is_none();
        if let Some(start) = self.starts.iter_mut().find(is_it) {
            start.1 = Some(now);
        }
        let meanwhile = |start: &&(Instant, Option<Instant>)| start.1.is_none_or(|told| told >= given);
        let is_alone = self.starts.iter().filter(meanwhile).count() == 1;
        let was_carried = self.carried.iter().any(|at| *at >= given);
        if matches!(outcome, Outcome::Refused(_) | Outcome::Expired) && was_carried && is_alone {
            self.object("a start that was carried out is told as not sent");
        }
    }

    /// All is well for minutes.
    pub(super) fn judge_the_end(&mut self) {
        if !self.pending.is_empty() {
            self.object("a command is never told");
        }
        if self.resets > self.resets_ordered {
            self.object("a fault is reset more often than anybody asked");
        }
        if let Some((_, since)) = self.run
            && !self.confirmed.iter().any(|(given, told)| *given <= since && since <= *told)
        {
            self.object("it runs by a start that was never confirmed");
        }
        self.note("the end");
    }
}
