//! The port of a family that breaks its contract below its own logic.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use async_trait::async_trait;
use drive_core::{Class, Port, SlaveAddress, Terms};
use tokio::time::Instant;
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

use super::Mutant;

/// What the drive above tells the port of the method that is under way.
#[derive(Debug, Clone, Default)]
pub(super) struct Tap {
    resets: Arc<AtomicBool>,
    starts: Arc<AtomicBool>,
    stops: Arc<AtomicBool>,
}

impl Tap {
    pub(super) fn resets(&self, on: bool) {
        self.resets.store(on, Ordering::Relaxed);
    }

    pub(super) fn stops(&self, on: bool) {
        self.stops.store(on, Ordering::Relaxed);
    }

    pub(super) fn starts(&self, on: bool) {
        self.starts.store(on, Ordering::Relaxed);
    }
}

pub(super) struct Faulty<P> {
    mutant: Mutant,
    port: P,
    tap: Tap,
    control: Option<u16>,
    terms: Terms,
    /// Words that were written to the control register since the method began.
    written: usize,
}

impl<P: Port> Faulty<P> {
    pub(super) fn before(mutant: Mutant, port: P, control: Option<u16>) -> (Self, Tap) {
        let tap = Tap::default();
        (Self { mutant, port, tap: tap.clone(), control, terms: Terms::default(), written: 0 }, tap)
    }

    fn word(&self, request: &Request<'_>) -> Option<u16> {
        match request {
            Request::WriteSingleRegister(at, word) if Some(*at) == self.control => Some(*word),
            Request::WriteMultipleRegisters(at, words) if Some(*at) == self.control => words.first().copied(),
            _ => None,
        }
    }
}

#[async_trait]
impl<P: Port> Client for Faulty<P> {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let word = self.word(&request);
        let (resets, stops) =
            (self.tap.resets.load(Ordering::Relaxed), self.tap.stops.load(Ordering::Relaxed));
        if (resets || stops) && word.is_some() {
            self.written += 1;
            // What clears the edge, or repeats the stop, is never sent.
            let loses = match self.mutant {
                Mutant::ResetAsALevel => resets,
                Mutant::StopOnce => stops,
                _ => false,
            };
            if loses && self.written > 1 {
                return Ok(Ok(match request {
                    Request::WriteSingleRegister(at, word) => Response::WriteSingleRegister(at, word),
                    Request::WriteMultipleRegisters(at, words) => {
                        Response::WriteMultipleRegisters(at, words.len() as u16)
                    }
                    _ => return self.port.call(request).await,
                }));
            }
        } else if !(resets || stops) {
            self.written = 0;
        }
        let starts = self.tap.starts.load(Ordering::Relaxed);
        if self.mutant == Mutant::RunTwice && starts && word.is_some() {
            let again = request.clone();
            self.port.call(again).await?.ok();
        }
        self.port.call(request).await
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        self.port.disconnect().await
    }
}

impl<P: Port> SlaveContext for Faulty<P> {
    fn set_slave(&mut self, slave: Slave) {
        self.port.set_slave(slave);
    }
}

impl<P: Port> Port for Faulty<P> {
    fn set_terms(&mut self, mut terms: Terms) {
        if self.mutant == Mutant::StopInTheBackground && terms.class == Class::Stop {
            terms.class = Class::Background;
        }
        if self.mutant == Mutant::CommandsLiveForEver {
            terms.lifetime = None;
        }
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
