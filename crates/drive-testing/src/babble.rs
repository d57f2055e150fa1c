//! A drive that answers any word to anything.

use std::{
    io,
    sync::{Arc, Mutex, PoisonError},
};

use async_trait::async_trait;
use drive_core::{Capabilities, Port};
use tokio_modbus::{ExceptionCode, Request, Response, Slave, client::Client, slave::SlaveContext};

/// Answers every read with the next words of a generator, and confirms every write. It panics when it is asked what the
/// family does not have: a function, or more words than one request may carry. Clones share what was written.
#[derive(Debug, Clone)]
pub struct Babble {
    state: u32,
    plausible: &'static [u16],
    capabilities: &'static Capabilities,
    written: Arc<Mutex<Vec<(u16, u16)>>>,
}

impl Babble {
    /// A drive of a family that says what follows from `seed`. Of sixteen words as many as there are `plausible` ones
    /// are from among these, so that it is not only refused: words that mean something somewhere.
    #[must_use]
    pub fn new(capabilities: &'static Capabilities, plausible: &'static [u16], seed: u32) -> Self {
        Self { state: seed, plausible, capabilities, written: Arc::default() }
    }

    /// The words that were written to a register, in order.
    #[must_use]
    pub fn written(&self, register: u16) -> Vec<u16> {
        let written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        written.iter().filter(|(at, _)| *at == register).map(|(_, word)| *word).collect()
    }

    fn keep(&self, words: impl IntoIterator<Item = (u16, u16)>) {
        self.written.lock().unwrap_or_else(PoisonError::into_inner).extend(words);
    }

    fn word(&mut self) -> u16 {
        self.state = self.state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let plausible = self.plausible.get((self.state >> 24) as usize % 16).copied();
        plausible.unwrap_or((self.state >> 8) as u16)
    }
}

impl Port for Babble {}

impl SlaveContext for Babble {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Babble {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let function = request.function_code().value();
        // Whoever is asked what it is may say that it has no such function.
        if function == 0x2B && !self.capabilities.functions.contains(&function) {
            return Ok(Err(ExceptionCode::IllegalFunction));
        }
        assert!(
            self.capabilities.functions.contains(&function),
            "the family has no function {function:02X}h"
        );
        Ok(match request {
            Request::ReadHoldingRegisters(_, count) => {
                assert!(count <= self.capabilities.read_words, "{count} words in one read");
                Ok(Response::ReadHoldingRegisters((0..count).map(|_| self.word()).collect()))
            }
            Request::WriteSingleRegister(register, word) => {
                self.keep([(register, word)]);
                Ok(Response::WriteSingleRegister(register, word))
            }
            Request::WriteMultipleRegisters(first, words) => {
                assert!(words.len() <= usize::from(self.capabilities.write_words), "{} words", words.len());
                self.keep((first..).zip(words.iter().copied()));
                Ok(Response::WriteMultipleRegisters(first, words.len() as u16))
            }
            Request::Custom(0x08, data) => Ok(Response::Custom(0x08, data.into_owned().into())),
            _ => Err(ExceptionCode::IllegalFunction),
        })
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}
