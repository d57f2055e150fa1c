//! Who judges: a port that holds every answer against what the machine itself has said and heard, and statuses against the shaft.

use std::{
    io,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use async_trait::async_trait;
use drive_core::{Class, Effect, Lack, Motion, Port, PortError, SlaveAddress, Status, Terms, Verdict};
use drive_sim::{Received, SimSlave};
use drive_testing::truth::contradiction;
use tokio::time::Instant;
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

use super::{Untold, Way, tap::Tap, untold::Kind};

/// How much later than its lifetime a request may be heard whole: its characters on the wire, and a turn of the clock.
const ON_THE_WIRE: Duration = Duration::from_millis(250);

/// In this time a motor that stood can be run by others and let coast, and one that comes down can lose its supply and have it again,
/// seen by nobody: the words are those of one that stands.
const UNSEEN: Duration = Duration::from_millis(500);

/// A ramp of these drives passes less than the tolerance of a look in this time.
const WHILE_IT_RAMPS: Duration = Duration::from_millis(60);

/// What was found against a cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Notes(Arc<Mutex<Noted>>);

#[derive(Debug, Default)]
struct Noted {
    against: Vec<(Kind, String)>,
    /// When the drive told a status last, and what of its motor.
    looked: Option<(Instant, Motion)>,
    /// Since then it was looked at again: it was told at rest or coming down before, and was not looked at for a while.
    unseen_until: Option<Instant>,
    /// A rule was broken that holds whatever the drive is told.
    breaks_a_rule: bool,
    /// Nobody but this side commands the drive.
    alone: bool,
    /// Edges that were given, with when.
    edges: Vec<(Vec<u8>, Instant)>,
    /// Writes of levels, of whose repetitions nothing is said.
    levels: Vec<Vec<u8>>,
}

impl Notes {
    fn noted(&self) -> MutexGuard<'_, Noted> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was told of the machine, or what it does, contradicts it.
    pub(super) fn object(&self, why: String) {
        self.object_to(Kind::Machine, why);
    }

    fn object_to(&self, kind: Kind, why: String) {
        self.noted().against.push((kind, why));
    }

    /// What holds whatever the drive is told, and did not.
    pub(super) fn breach(&self, why: String) {
        let mut noted = self.noted();
        noted.breaks_a_rule = true;
        noted.against.push((Kind::Machine, why));
    }

    /// Whether a drive whose motor stood, or came down, was not looked at for so long, and has not stood since: [`Motion::AtRest`] says that
    /// what it did between two looks nobody saw. One that was driven before is to be told as coasting.
    fn lost_sight_of(&self, at: Option<Instant>) -> bool {
        self.noted().unseen_until.is_some_and(|until| at.is_none_or(|at| at >= until))
    }

    /// A status told this of a motor that turns or stands.
    pub(super) fn looked(&self, at: Instant, told: Motion, turns: bool) {
        let mut noted = self.noted();
        let before = noted.looked.replace((at, told));
        let gap = before.is_some_and(|(before, told)| {
            before + UNSEEN < at && matches!(told, Motion::AtRest | Motion::Braking | Motion::Held)
        });
        if !turns {
            noted.unseen_until = None;
        } else if gap {
            noted.unseen_until = Some(at);
        }
    }

    /// Whether nobody but this side commands the drive: nobody else gives it a reference then.
    pub(super) fn alone(&self, is_alone: bool) {
        self.noted().alone = is_alone;
    }

    /// A stop was confirmed: the motor was seen to come down, whatever its status was told of before.
    pub(super) fn comes_down(&self) {
        if let Some((_, told)) = self.noted().looked.as_mut() {
            *told = Motion::Braking;
        }
    }

    /// What was found, and why nobody can tell it where nobody can. What UNI-TELWAY carries is no PDU of Modbus, so that no answer is
    /// held against the machine's there.
    pub(super) fn verdict(
        &self,
        way: Way,
        mut untold: impl Iterator<Item = Untold>,
    ) -> (Vec<String>, Option<&'static str>) {
        let noted = self.noted();
        let (kinds, why): (Vec<Kind>, Vec<String>) = noted.against.iter().cloned().unzip();
        let explains = |untold: &Untold| way == Way::UniTelway || untold.explains(&kinds);
        let explained = if noted.breaks_a_rule { None } else { untold.find(explains) };
        (why, explained.map(|untold| untold.why))
    }

    /// Edges that the machine took more often than they were given.
    pub(super) fn doubled_edges(&self, machine: &SimSlave) -> Vec<String> {
        let noted = self.noted();
        let mut doubled = Vec::new();
        for (pdu, since) in &noted.edges {
            if noted.levels.contains(pdu) {
                continue;
            }
            let given = noted.edges.iter().filter(|(other, _)| other == pdu).count();
            let earliest = noted.edges.iter().filter(|(other, _)| other == pdu).map(|(_, at)| *at).min();
            let taken = machine
                .received_since(earliest.unwrap_or(*since))
                .iter()
                .filter(|got| got.pdu[..] == pdu[..])
                .count();
            if taken > given {
                doubled.push(format!("an edge was given {given} times and taken {taken} times: {pdu:02X?}"));
            }
        }
        doubled.dedup();
        doubled
    }
}

/// What a port is judged by.
#[derive(Clone)]
pub(super) struct Bench {
    pub(super) tap: Tap,
    pub(super) machine: SimSlave,
    pub(super) notes: Notes,
    pub(super) way: Way,
    /// The way delivers when it likes.
    pub(super) holds_back: bool,
}

/// The port.
pub(super) struct Judged {
    pub(super) line: drive_bus::Slave,
    pub(super) bench: Bench,
    pub(super) terms: Terms,
}

/// The PDU of a request, made by hand; `None`: of a kind that is not judged.
fn pdu(request: &Request<'_>) -> Option<Vec<u8>> {
    let two =
        |function: u8, a: u16, b: u16| [&[function], &a.to_be_bytes()[..], &b.to_be_bytes()[..]].concat();
    Some(match request {
        Request::ReadHoldingRegisters(at, count) => two(3, *at, *count),
        Request::ReadInputRegisters(at, count) => two(4, *at, *count),
        Request::WriteSingleRegister(at, word) => two(6, *at, *word),
        Request::WriteMultipleRegisters(at, words) => {
            let mut pdu = two(16, *at, words.len() as u16);
            pdu.push(words.len() as u8 * 2);
            pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
            pdu
        }
        _ => return None,
    })
}

impl Judged {
    fn object(&self, kind: Kind, why: &str, pdu: &[u8]) {
        self.bench.notes.object_to(kind, format!("{why} ({pdu:02X?})"));
    }

    /// How often the machine has taken this since then, and when last.
    fn taken(&self, pdu: &[u8], since: Instant) -> Vec<Instant> {
        // What is told at the very moment in which it was asked took no time.
        let received = self.bench.machine.received_since(since - Duration::from_micros(1));
        received.iter().filter(|got| got.pdu[..] == *pdu).map(|got| got.at).collect()
    }

    fn judge(&self, pdu: &[u8], asked: Instant, told: &tokio_modbus::Result<Response>) {
        let writes = matches!(pdu.first(), Some(6 | 16));
        match told {
            Ok(Ok(Response::ReadHoldingRegisters(words) | Response::ReadInputRegisters(words)))
                if !self.is_true(pdu, asked, words) =>
            {
                let why = format!("a value that the machine did not give: {words:04X?}");
                self.object(Kind::Value, &why, pdu);
            }
            Ok(Ok(_))
                if writes
                    && self.bench.way != Way::UniTelway
                    && self.taken(pdu, asked).is_empty()
                    && !self.is_held(pdu) =>
            {
                self.object(Kind::Confirmation, "confirmed, and never taken by the machine", pdu);
            }
            Err(error) if writes && self.bench.way != Way::UniTelway => {
                let said_unsent = matches!(error, tokio_modbus::Error::Transport(error) if error
                    .get_ref()
                    .and_then(|error| error.downcast_ref::<PortError>())
                    .is_some_and(|error| error.nothing_sent() && !matches!(error, PortError::Busy(_))));
                if said_unsent && !self.taken(pdu, asked).is_empty() {
                    self.bench.notes.breach(format!(
                        "told as never sent ({error}), and the machine has taken it ({pdu:02X?})"
                    ));
                }
            }
            _ => {}
        }
        let lifetime = self.terms.lifetime.filter(|_| writes && self.terms.class == Class::Command);
        if let Some(lifetime) = lifetime.filter(|_| !self.bench.holds_back) {
            let late = self.taken(pdu, asked).into_iter().find(|at| *at > asked + lifetime + ON_THE_WIRE);
            if let Some(at) = late {
                self.bench
                    .notes
                    .breach(format!("a command was sent {:?} after it was given ({pdu:02X?})", at - asked));
            }
        }
    }

    /// Whether this is a level that the machine took before, as the last of what was written there, and holds: that an equal write is
    /// confirmed by the answer to the one before it says what is so.
    fn is_held(&self, pdu: &[u8]) -> bool {
        let (Some(place), [.., high, low]) = (pdu.get(1..3), pdu) else { return false };
        let is_there =
            |got: &Received| matches!(got.pdu.first(), Some(6 | 16)) && got.pdu.get(1..3) == Some(place);
        let received = self.bench.machine.received();
        let last = received.iter().rev().find(|got| is_there(got));
        let address = u16::from_be_bytes([place[0], place[1]]);
        self.terms.effect == Effect::Level
            && last.is_some_and(|got| got.pdu[..] == *pdu)
            && self.bench.machine.peek(address) == Some(u16::from_be_bytes([*high, *low]))
    }

    /// Whether these words are what the machine has answered to this question since it was asked.
    fn is_true(&self, pdu: &[u8], asked: Instant, words: &[u16]) -> bool {
        if self.bench.way == Way::UniTelway {
            return true;
        }
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        let slave = self.bench.machine.address();
        let answers = self.bench.tap.answers_to(slave, pdu, asked);
        answers.iter().any(|answer| answer.answer.get(2..).is_some_and(|said| said.starts_with(&bytes)))
    }
}

#[async_trait]
impl Client for Judged {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let asked = Instant::now();
        let pdu = pdu(&request);
        if let Some(pdu) = pdu.as_ref().filter(|pdu| matches!(pdu.first(), Some(6 | 16))) {
            let mut noted = self.bench.notes.noted();
            match self.terms.effect {
                Effect::Edge => noted.edges.push((pdu.clone(), asked)),
                Effect::Level => noted.levels.push(pdu.clone()),
            }
        }
        let told = self.line.call(request).await;
        if let Some(pdu) = pdu {
            self.judge(&pdu, asked, &told);
        }
        told
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        self.line.disconnect().await
    }
}

impl SlaveContext for Judged {
    fn set_slave(&mut self, slave: Slave) {
        self.line.set_slave(slave);
    }
}

impl Port for Judged {
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
        self.line.set_terms(terms);
    }

    fn made_for(&self) -> Option<SlaveAddress> {
        self.line.made_for()
    }

    fn asked_at(&self) -> Option<Instant> {
        self.line.asked_at()
    }

    fn is_ascii(&self) -> bool {
        self.line.is_ascii()
    }
}

impl Bench {
    /// What the machine has against a status that was asked for at `asked`.
    pub(super) fn judge_status(&self, status: &Status, asked: Instant, fresh: bool) {
        if let Some(Verdict::NotInForce { lacks: Lack::Reference, because }) = status.verdict
            && self.notes.noted().alone
        {
            self.notes
                .object(format!("told to follow another's reference, and nobody else is there: {because}"));
        }
        if let Some(at) = status.at {
            self.notes.looked(at, status.motion, self.machine.observe().shaft_frequency != 0);
            let now = Instant::now();
            if at > now {
                self.notes.object(format!("a status from {:?} ahead", at - now));
            }
            if fresh && at < asked {
                self.notes.object(format!("a status told as asked for now is {:?} older", asked - at));
            }
            let touched = self.machine.interventions().last().is_some_and(|last| last.at >= at);
            let writes = |pdu: &[u8]| matches!(pdu.first(), Some(0x06 | 0x10 | 0x14 | 0x37 | 0xF2));
            if touched || self.machine.received_since(at).iter().any(|request| writes(&request.pdu)) {
                return;
            }
        }
        // Of a motor on its ramp a status that is told late says what was so: one that stood and was not touched stands.
        let is_late = status.at.is_some_and(|at| at + WHILE_IT_RAMPS < Instant::now());
        if is_late && status.motion != Motion::AtRest {
            return;
        }
        let seen = self.machine.observe();
        if seen.shaft_frequency != 0 && self.notes.lost_sight_of(status.at) && status.motion == Motion::AtRest
        {
            // What it did between two looks nobody saw: see `Motion::AtRest`.
            return;
        }
        if let Some(why) = contradiction(status, &seen) {
            self.notes.object(why);
        }
    }
}
