//! Machines with a defect, each of a kind that fuzzing is there for.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_bus::exchange::{Failure, Machine, Step, Stray};
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Defect {
    /// It panics where a refusal comes in a chunk of its own.
    Panics,
    /// Behind forty bytes its time is never over.
    NeverEnds,
    /// What is no answer is kept without bound.
    KeepsAll,
    /// Now and then it takes for an answer what is none.
    MakesUp,
    /// Behind a long chunk it hears nothing any more.
    GoesDeaf,
    /// It loses the last byte of a long chunk.
    LosesAByte,
}

impl Defect {
    pub(super) const ALL: [Self; 6] =
        [Self::Panics, Self::NeverEnds, Self::KeepsAll, Self::MakesUp, Self::GoesDeaf, Self::LosesAByte];
}

pub(super) struct Broken {
    machine: Box<dyn Machine>,
    defect: Defect,
    heard: usize,
    deaf: bool,
}

impl Broken {
    pub(super) fn new(machine: Box<dyn Machine>, defect: Defect) -> Self {
        Self { machine, defect, heard: 0, deaf: false }
    }
}

impl Machine for Broken {
    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        self.heard = 0;
        self.machine.start(slave, request, pdu)
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        self.machine.handle_sent(end, answer_by);
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.heard += bytes.len();
        match self.defect {
            Defect::Panics => assert!(!matches!(bytes, [_, 0x83, ..]), "planted"),
            Defect::MakesUp if bytes.iter().fold(0_u8, |sum, byte| sum ^ byte) == 0x2A => {
                return Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![0x0BAD]))));
            }
            Defect::GoesDeaf => self.deaf |= bytes.len() > 64,
            _ => {}
        }
        match self.defect {
            Defect::GoesDeaf if self.deaf => Step::More,
            Defect::LosesAByte if bytes.len() == 7 => self.machine.handle_bytes(now, &bytes[..6]),
            _ => self.machine.handle_bytes(now, bytes),
        }
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
        match self.machine.handle_timeout(now) {
            Step::Done(Err(Failure::Timeout)) if self.defect == Defect::NeverEnds && self.heard > 40 => {
                Step::More
            }
            step => step,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let never = self.defect == Defect::NeverEnds && self.heard > 40;
        self.machine.deadline().map(|at| if never { at + Duration::from_secs(3_600) } else { at })
    }

    fn abandon(&mut self) {
        self.machine.abandon();
    }

    fn reset(&mut self) {
        self.machine.reset();
    }

    fn resume(&mut self, slave: u8) -> Option<Bytes> {
        self.machine.resume(slave)
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        let strays = self.machine.take_strays();
        if self.defect == Defect::KeepsAll { strays.repeat(5_000) } else { strays }
    }

    fn confuses_late_answers(&self) -> bool {
        self.machine.confuses_late_answers()
    }
}
