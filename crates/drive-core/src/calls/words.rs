//! Words that are read and written, with every confirmation checked and an ambiguous write read back.

use std::borrow::Cow;

use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::{Calls, PATIENCE};
use crate::{
    access::{Readable, Writable},
    confirm::Confirming,
    error::{Error, ErrorKind, ExceptionMeaning, Exchange, Result},
    port::{Class, Effect, Port},
    registers::{Place, Register},
};

impl<P: Port> Calls<'_, P> {
    /// Reads one register.
    pub async fn read(&mut self, register: Register<impl Readable>) -> Result<u16> {
        self.read_word(register.address()).await
    }

    /// Reads one word at an address.
    pub async fn read_word(&mut self, address: u16) -> Result<u16> {
        let [word] = self.read_array(address).await?;
        Ok(word)
    }

    /// Reads `count` consecutive words in one request.
    ///
    /// # Errors
    /// Also [`Error::TooManyWords`] when the family's limit forbids the request; nothing is sent then.
    pub async fn read_words(&mut self, first: u16, count: u16) -> Result<Vec<u16>> {
        self.check_words(usize::from(count), self.registers.capabilities.read_words)?;
        let exchange = Self::reading(first);
        let is_kept = self.terms.class == Class::Background;
        if is_kept && let Some((words, at)) = self.registers.kept.of(Instant::now(), first, count) {
            self.registers.see(at);
            return Ok(words);
        }
        let terms = self.terms.sparing(self.registers.capabilities.spare_words(first, count));
        let terms = self.registers.patience(terms);
        let response =
            self.request_under(terms, Request::ReadHoldingRegisters(first, count), exchange).await?;
        let Response::ReadHoldingRegisters(words) = response else {
            return Err(self.answer(exchange, "the answer is of another function"));
        };
        // tokio-modbus's own clients check neither this nor what a confirmation names in a release build.
        if words.len() != usize::from(count) {
            return Err(self.answer(exchange, "the answer holds another number of words"));
        }
        if is_kept {
            let at = self.registers.port.asked_at().unwrap_or_else(Instant::now);
            self.registers.kept.keep(first, &words, at);
        }
        Ok(words)
    }

    /// Reads the `N` consecutive words from `first` on in one request.
    ///
    /// # Errors
    /// As [`read_words`](Self::read_words).
    pub async fn read_array<const N: usize>(&mut self, first: u16) -> Result<[u16; N]> {
        let count = u16::try_from(N).unwrap_or(u16::MAX);
        let words = self.read_words(first, count).await?;
        let exchange = Self::reading(first);
        words.try_into().map_err(|_| self.answer(exchange, "the answer holds another number of words"))
    }

    /// Writes one register, with function 06 where the family has it and function 16 where it has not. When it is
    /// not known whether the write arrived, a register that can be read is read back: the write succeeds if the
    /// value stands there. An edge is never read back, because its bit may clear itself.
    pub async fn write<A: Writable>(&mut self, register: Register<A>, value: u16) -> Result<()> {
        let result = self.write_word(register.address(), value).await;
        let Err(error) = result else { return Ok(()) };
        let seen = A::ACCESS.is_readable() && self.terms.effect == Effect::Level;
        // A reading that fails, or is not even sent any more, leaves the outcome unknown.
        if error.kind() == ErrorKind::OutcomeUnknown
            && seen
            && self.read_back(register.address().into(), value, &error).await == Ok(value)
        {
            return Ok(());
        }
        Err(error)
    }

    /// What a register holds after a write of which nobody knows what became: read once, or for a while where the drive
    /// has said that it takes long.
    pub(super) async fn read_back(&mut self, place: Place, value: u16, error: &Error) -> Result<u16> {
        let takes_long = matches!(error, Error::Exception { meaning: ExceptionMeaning::Accepted, .. });
        // The write has gone: whoever reads it back does not die of the order's lifetime.
        self.terms.lifetime = None;
        let mut confirming = Confirming::within(PATIENCE);
        loop {
            let held = self.read_place(place).await?;
            if held == value || !takes_long || !confirming.again().await {
                return Ok(held);
            }
        }
    }

    /// Writes one word at an address; the confirmation must echo it.
    pub async fn write_word(&mut self, address: u16, value: u16) -> Result<()> {
        if !self.has(0x06) {
            return self.write_words(address, &[value]).await;
        }
        let exchange = Self::writing(address, 0x06);
        match self.request(Request::WriteSingleRegister(address, value), exchange).await? {
            Response::WriteSingleRegister(at, echoed) if (at, echoed) == (address, value) => Ok(()),
            _ => Err(self.answer(exchange, "the confirmation does not echo the write")),
        }
    }

    /// Writes consecutive words in one request (function 16); the confirmation must name the same words.
    ///
    /// # Errors
    /// Also [`Error::TooManyWords`] when the family's limit forbids the request; nothing is sent then.
    pub async fn write_words(&mut self, first: u16, words: &[u16]) -> Result<()> {
        self.check_words(words.len(), self.registers.capabilities.write_words)?;
        let exchange = Self::writing(first, 0x10);
        match self.request(Request::WriteMultipleRegisters(first, Cow::Borrowed(words)), exchange).await? {
            Response::WriteMultipleRegisters(at, count)
                if at == first && usize::from(count) == words.len() =>
            {
                Ok(())
            }
            _ => Err(self.answer(exchange, "the confirmation does not name the written words")),
        }
    }

    const fn check_words(&self, words: usize, limit: u16) -> Result<()> {
        if words == 0 || words > limit as usize {
            return Err(Error::TooManyWords { slave: self.registers.slave, words, limit });
        }
        Ok(())
    }

    const fn reading(register: u16) -> Exchange {
        Exchange { function: 0x03, register: Some(register) }
    }

    const fn writing(register: u16, function: u8) -> Exchange {
        Exchange { function, register: Some(register) }
    }
}
