//! A port between a drive and its line that writes down what goes through it, and that can make the drive behind it
//! disobedient: what is claimed of a command is held against what was really sent and what really happened.

use std::{
    io,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use async_trait::async_trait;
use drive_core::{Class, Effect, Port, PortError, SlaveAddress, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

/// A request that went through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// The terms under which it travelled.
    pub terms: Terms,
    /// Its function code.
    pub function: u8,
    /// Its first register, coil or input, where it has one.
    pub register: Option<u16>,
    /// The words that it writes, of a coil 1 for on and 0 for off; empty for what only reads.
    pub words: Vec<u16>,
}

impl Heard {
    fn of(terms: Terms, request: &Request<'_>) -> Self {
        let (register, words) = match request {
            Request::WriteSingleRegister(register, word) => (Some(*register), vec![*word]),
            Request::WriteMultipleRegisters(register, words) => (Some(*register), words.to_vec()),
            Request::ReadHoldingRegisters(register, _) | Request::ReadInputRegisters(register, _) => {
                (Some(*register), Vec::new())
            }
            Request::WriteSingleCoil(coil, on) => (Some(*coil), vec![u16::from(*on)]),
            Request::WriteMultipleCoils(coil, coils) => {
                (Some(*coil), coils.iter().map(|on| u16::from(*on)).collect())
            }
            Request::ReadCoils(coil, _) | Request::ReadDiscreteInputs(coil, _) => (Some(*coil), Vec::new()),
            _ => (None, Vec::new()),
        };
        Self { terms, function: request.function_code().value(), register, words }
    }

    /// Whether it writes.
    #[must_use]
    pub const fn writes(&self) -> bool {
        !self.words.is_empty()
    }

    /// The word that it writes to a register, if it does.
    #[must_use]
    pub fn written_to(&self, register: u16) -> Option<u16> {
        let index = register.checked_sub(self.register?)?;
        self.words.get(usize::from(index)).copied()
    }

    /// Its class.
    #[must_use]
    pub const fn class(&self) -> Class {
        self.terms.class
    }

    /// Whether it is sent once and never again by itself.
    #[must_use]
    pub fn is_edge(&self) -> bool {
        self.terms.effect == Effect::Edge
    }
}

/// How the drive behind the port behaves from now on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Habit {
    /// It does what it is told.
    #[default]
    Obeys,
    /// It acknowledges every write and keeps the words that it had.
    KeepsItsWords,
    /// Of the calls from now on the one of this number arrives, and its answer is lost.
    LosesAnswer(usize),
    /// Of the calls from now on the one of this number does not arrive.
    LosesRequest(usize),
    /// From the call of this number on all arrive, and no answer comes.
    LosesAnswersFrom(usize),
    /// From the call of this number on none arrives.
    LosesRequestsFrom(usize),
}

#[derive(Debug, Default)]
struct Ledger {
    heard: Vec<Heard>,
    habit: Habit,
    /// Calls since the habit was given.
    calls: usize,
}

/// What somebody beside the port sees of it, and how he makes the drive behind it misbehave.
#[derive(Debug, Clone, Default)]
pub struct Witness {
    ledger: Arc<Mutex<Ledger>>,
}

impl Witness {
    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The drive behaves like this from now on, and what was heard before is forgotten.
    pub fn from_now_on(&self, habit: Habit) {
        *self.ledger() = Ledger { habit, ..Ledger::default() };
    }

    /// What has gone through since then, in order.
    #[must_use]
    pub fn heard(&self) -> Vec<Heard> {
        self.ledger().heard.clone()
    }

    /// The words that were written to a register since then, in order.
    #[must_use]
    pub fn written_to(&self, register: u16) -> Vec<u16> {
        self.ledger().heard.iter().filter_map(|heard| heard.written_to(register)).collect()
    }
}

/// The port.
#[derive(Debug)]
pub struct Recorder<P> {
    port: P,
    witness: Witness,
    terms: Terms,
}

impl<P: Port> Recorder<P> {
    /// A port before another, and its witness.
    #[must_use]
    pub fn before(port: P) -> (Self, Witness) {
        let witness = Witness::default();
        (Self { port, witness: witness.clone(), terms: Terms::default() }, witness)
    }

    fn hears(&self, request: &Request<'_>) -> (Habit, bool) {
        let mut ledger = self.witness.ledger();
        ledger.heard.push(Heard::of(self.terms, request));
        let number = ledger.calls;
        ledger.calls += 1;
        let hit = match ledger.habit {
            Habit::LosesAnswer(at) | Habit::LosesRequest(at) => number == at,
            Habit::LosesAnswersFrom(first) | Habit::LosesRequestsFrom(first) => number >= first,
            Habit::Obeys | Habit::KeepsItsWords => false,
        };
        (ledger.habit, hit)
    }
}

/// That no answer came to a request.
fn unanswered(writes: bool) -> tokio_modbus::Error {
    let problem = if writes {
        PortError::OutcomeUnknown("the answer was lost")
    } else {
        PortError::Damaged("the answer was lost")
    };
    tokio_modbus::Error::Transport(problem.into_io())
}

#[async_trait]
impl<P: Port> Client for Recorder<P> {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let (habit, hit) = self.hears(&request);
        let acknowledged = match &request {
            Request::WriteSingleRegister(register, word) => {
                Some(Response::WriteSingleRegister(*register, *word))
            }
            Request::WriteMultipleRegisters(register, words) => {
                Some(Response::WriteMultipleRegisters(*register, words.len() as u16))
            }
            Request::WriteSingleCoil(coil, on) => Some(Response::WriteSingleCoil(*coil, *on)),
            Request::WriteMultipleCoils(coil, coils) => {
                Some(Response::WriteMultipleCoils(*coil, coils.len() as u16))
            }
            _ => None,
        };
        match habit {
            Habit::LosesRequest(_) | Habit::LosesRequestsFrom(_) if hit => {
                Err(unanswered(acknowledged.is_some()))
            }
            Habit::LosesAnswer(_) | Habit::LosesAnswersFrom(_) if hit => {
                self.port.call(request).await?.ok();
                Err(unanswered(acknowledged.is_some()))
            }
            Habit::KeepsItsWords => match acknowledged {
                Some(acknowledged) => Ok(Ok(acknowledged)),
                None => self.port.call(request).await,
            },
            _ => self.port.call(request).await,
        }
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        self.port.disconnect().await
    }
}

impl<P: Port> SlaveContext for Recorder<P> {
    fn set_slave(&mut self, slave: Slave) {
        self.port.set_slave(slave);
    }
}

impl<P: Port> Port for Recorder<P> {
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
        self.port.set_terms(terms);
    }

    fn wants_pause(&mut self, pause: Duration) {
        self.port.wants_pause(pause);
    }

    fn made_for(&self) -> Option<SlaveAddress> {
        self.port.made_for()
    }

    fn asked_at(&self) -> Option<Instant> {
        self.port.asked_at()
    }

    fn is_ascii(&self) -> bool {
        self.port.is_ascii()
    }
}
