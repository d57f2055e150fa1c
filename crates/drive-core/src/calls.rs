//! The one way in which families read and write: [`Registers`], typed, within the family's limits, every answer
//! checked, every error naming slave and register.

use std::{borrow::Cow, time::Duration};

use tokio::time::Instant;
use tokio_modbus::{Request, Response, Slave, prelude::ReadCode};

use crate::{
    access::{Readable, Writable},
    address::SlaveAddress,
    capabilities::Capabilities,
    confirm::{CONFIRMED_WITHIN, Confirming, later},
    error::{BUSY, Error, ErrorKind, ExceptionMeaning, Exchange, Result},
    identity::Identity,
    kept_readings::KeptReadings,
    port::{Class, Effect, Port, PortError, Terms},
    registers::{Place, Register, Row, Written},
    setpoint::Command,
    status::{RawWord, Status},
    stopped::{Followed, Follower},
};

/// How long a drive that answers that it is busy is asked again by a call without a lifetime, and how long one that has
/// accepted a write and takes long for it is read back.
const PATIENCE: Duration = Duration::from_secs(1);

/// How long what judges a written order waits for its turn on the line: it has to show within [`CONFIRMED_WITHIN`], and a reading that
/// was lost costs the line another wait.
const JUDGED_WITHIN: Duration = CONFIRMED_WITHIN.saturating_mul(2);

/// How long a call of each class may wait until it is sent. `None`: as long as its caller waits.
///
/// ```
/// use std::time::Duration;
/// use drive_core::{Class, Lifetimes};
///
/// let lifetimes = Lifetimes { status: Some(Duration::from_millis(500)), ..Lifetimes::default() };
/// assert_eq!(lifetimes.of(Class::Command), Some(Duration::from_secs(1)), "never carried out late");
/// assert_eq!(lifetimes.of(Class::Stop), None, "a stop does not expire");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lifetimes {
    /// Stops. They do not expire by default.
    pub stop: Option<Duration>,
    /// Starts, setpoints, resets: 1 s by default, so that none is carried out late.
    pub command: Option<Duration>,
    /// When nothing more of a command is sent, however quickly each call of it was: a drive that takes long to answer makes the next one
    /// late. Never by default.
    pub command_until: Option<Instant>,
    /// When a command of which nothing was written is not sent any more, for one whose further words belong to the first: an edge that has
    /// risen is to fall. Never by default.
    pub begun_until: Option<Instant>,
    /// Keep-alives.
    pub keep_alive: Option<Duration>,
    /// Status polls; a daemon sets its poll period.
    pub status: Option<Duration>,
    /// Parameters, histories, slow measurements.
    pub background: Option<Duration>,
    /// The class in which what polls and identifies is asked instead of its own: [`Class::Stop`] where a stop waits for what it tells,
    /// so that it goes to a slave that is off-line as the stop itself would.
    pub polls_as: Option<Class>,
}

impl Lifetimes {
    /// The lifetime of a class.
    #[must_use]
    pub const fn of(&self, class: Class) -> Option<Duration> {
        match class {
            Class::Stop => self.stop,
            Class::Command => self.command,
            Class::KeepAlive => self.keep_alive,
            Class::Status => self.status,
            Class::Background => self.background,
        }
    }
}

impl Default for Lifetimes {
    fn default() -> Self {
        Self {
            stop: None,
            command: Some(Duration::from_secs(1)),
            command_until: None,
            begun_until: None,
            keep_alive: None,
            status: None,
            background: None,
            polls_as: None,
        }
    }
}

/// The registers of one slave behind a port.
#[derive(Debug)]
pub struct Registers<P> {
    port: P,
    slave: SlaveAddress,
    capabilities: &'static Capabilities,
    meaning: fn(function: u8, code: u8) -> ExceptionMeaning,
    /// The other slave to which the port leads.
    elsewhere: Option<SlaveAddress>,
    /// When the oldest answer since [`begin_snapshot`](Self::begin_snapshot) ended on the line.
    oldest: Option<Instant>,
    /// When the order began that is carried out.
    begun: Option<Instant>,
    /// Until then what is read as a command judges an order that was written.
    judged_until: Option<Instant>,
    /// Something of the order was written, or may have been.
    written: bool,
    /// How long calls may wait.
    pub lifetimes: Lifetimes,
    /// What long jobs have read that were cut.
    pub kept: KeptReadings,
    /// Who follows a stop that does not show: see [`Drive::follow_stops`](crate::Drive::follow_stops).
    pub follower: Option<Follower>,
}

impl<P: Port> Registers<P> {
    /// The registers of `slave`, which is the one that the port was made for where it was made for one: else every call ends
    /// with [`Error::OtherSlave`]. `meaning` says what an exception means on this family.
    #[must_use]
    pub fn new(
        mut port: P,
        slave: SlaveAddress,
        capabilities: &'static Capabilities,
        meaning: fn(function: u8, code: u8) -> ExceptionMeaning,
    ) -> Self {
        let elsewhere = port.made_for().filter(|made_for| *made_for != slave);
        // A port that was made for another slave keeps it, so that nothing goes to a drive that is not meant.
        if elsewhere.is_none() {
            port.set_slave(Slave(slave.number()));
            port.wants_pause(capabilities.turnaround);
        }
        let (lifetimes, kept) = (Lifetimes::default(), KeptReadings::default());
        Self {
            port,
            slave,
            capabilities,
            meaning,
            elsewhere,
            oldest: None,
            begun: None,
            judged_until: None,
            written: false,
            lifetimes,
            kept,
            follower: None,
        }
    }

    /// Tells whoever follows it a status behind a stop that does not show yet, and how the last write of that ended. Of the run command
    /// that is to end the status says nothing.
    pub fn tell_follower<T>(&self, status: &Status, written: &Result<T>) {
        if let Some(follower) = &self.follower {
            let status = Status { verdict: None, ..status.clone() };
            // An exception is what the drive says. Every other end is the line's.
            let denied = written.as_ref().err().filter(|error| matches!(error, Error::Exception { .. }));
            follower.send_replace(Some(Followed { status, denied: denied.cloned() }));
        }
    }

    /// The slave.
    #[must_use]
    pub const fn slave(&self) -> SlaveAddress {
        self.slave
    }

    /// What the family can do.
    #[must_use]
    pub const fn capabilities(&self) -> &'static Capabilities {
        self.capabilities
    }

    /// The calls that follow travel in this class, with its lifetime. Those of a stop end the order that had begun.
    pub const fn at(&mut self, class: Class) -> Calls<'_, P> {
        if matches!(class, Class::Stop) {
            self.begun = None;
        }
        let begun = if matches!(class, Class::Command) { self.begun } else { None };
        let asked_as = match (class, self.lifetimes.polls_as) {
            (Class::Status | Class::Background, Some(asked_as)) => asked_as,
            _ => class,
        };
        let terms = Terms { lifetime: self.lifetimes.of(class), begun, ..Terms::of(asked_as) };
        Calls { registers: self, terms }
    }

    /// An order begins: what is read for it dies with it, until it is written; and what it writes is not sent behind a stop of
    /// somebody else's that comes meanwhile, see [`Terms::begun`]. **Whatever writes in the class of commands begins an order**, or it
    /// is taken for a part of the one before.
    pub fn begin_order(&mut self) {
        (self.judged_until, self.written) = (None, false);
        self.begun = Some(Instant::now());
    }

    /// The order is written, or may be, and its judgement is owed: **what judges it does not die of the order's lifetime**. What is
    /// read in the class of commands waits for its turn, until the next order begins or the time is over in which this one has to
    /// show.
    pub fn owe_judgement(&mut self) {
        self.judged_until = Some(Instant::now() + JUDGED_WITHIN);
    }

    /// How long a reading of this class may wait that would wait for so long else.
    fn patience(&self, terms: Terms) -> Terms {
        let judges =
            terms.class == Class::Command && self.judged_until.is_some_and(|until| Instant::now() < until);
        if judges { Terms { lifetime: None, ..terms } } else { self.bounded(terms) }
    }

    /// A call that dies is sent in the time of its command, too.
    fn bounded(&self, terms: Terms) -> Terms {
        let begun_until = self.lifetimes.begun_until.filter(|_| !self.written);
        let until = [self.lifetimes.command_until, begun_until].into_iter().flatten().min();
        let until = until.filter(|_| terms.class == Class::Command);
        let left = until.map(|until| until.saturating_duration_since(Instant::now()));
        let lifetime = terms.lifetime.map(|lifetime| left.map_or(lifetime, |left| lifetime.min(left)));
        Terms { lifetime, ..terms }
    }

    /// What is read from here on makes one picture of the drive, which is as old as its oldest answer.
    pub const fn begin_snapshot(&mut self) {
        self.oldest = None;
    }

    /// When the oldest answer since [`begin_snapshot`](Self::begin_snapshot) ended on the line; `None` on a port that keeps
    /// no time, and before the first answer.
    #[must_use]
    pub const fn snapshot_time(&self) -> Option<Instant> {
        self.oldest
    }

    /// Whether the picture has taken so long that its parts may be of different moments.
    #[must_use]
    pub fn is_torn(&self) -> bool {
        self.oldest.is_some_and(|oldest| oldest.elapsed() > CONFIRMED_WITHIN / 2)
    }

    /// What was read is a part of the picture.
    fn see(&mut self, at: Instant) {
        self.oldest = Some(self.oldest.map_or(at, |oldest| oldest.min(at)));
    }

    /// The port.
    #[must_use]
    pub const fn port(&self) -> &P {
        &self.port
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.port
    }
}

/// The methods of [`Drive`](crate::Drive) that need nothing but the [`Registers`] of a family, in the field of this name:
/// `slave`, `capabilities`, `lifetimes_mut` and `kept_mut`.
///
/// ```ignore
/// #[async_trait]
/// impl<P: Port> Drive for Fan1<P> {
///     drive_core::told_by!(registers);
///     // and the methods that are the family's own
/// }
/// ```
#[macro_export]
macro_rules! told_by {
    ($registers:ident) => {
        fn slave(&self) -> $crate::SlaveAddress {
            self.$registers.slave()
        }

        fn capabilities(&self) -> &'static $crate::Capabilities {
            self.$registers.capabilities()
        }

        fn lifetimes_mut(&mut self) -> &mut $crate::Lifetimes {
            self.$registers.begin_order();
            &mut self.$registers.lifetimes
        }

        fn kept_mut(&mut self) -> Option<&mut $crate::KeptReadings> {
            Some(&mut self.$registers.kept)
        }

        fn follow_stops(&mut self, follower: $crate::Follower) {
            self.$registers.follower = Some(follower);
        }
    };
}

/// Calls to one slave under the same terms.
///
/// # Errors
/// Every method fails with [`Error::Port`] when no valid answer came and [`Error::Exception`] when the drive refused.
///
/// # Cancellation
/// Dropping a future of these leaves the line whole: what is on the wire finishes there and its answer is discarded.
/// Whether a dropped write was carried out is unknown; that of a stop is sent all the same where the port has a schedule.
#[derive(Debug)]
pub struct Calls<'a, P> {
    registers: &'a mut Registers<P>,
    terms: Terms,
}

impl<P: Port> Calls<'_, P> {
    /// The same calls as edges: a write is sent once and never repeated.
    #[must_use]
    pub const fn edge(mut self) -> Self {
        self.terms = self.terms.edge();
        self
    }

    /// The same calls under a replacement key, see [`Terms::replaces`].
    #[must_use]
    pub const fn replacing(mut self, key: u16) -> Self {
        self.terms = self.terms.replacing(key);
        self
    }

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
    async fn read_back(&mut self, place: Place, value: u16, error: &Error) -> Result<u16> {
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

    /// Reads the register of a row, if its access allows it.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`]; nothing is sent then.
    pub async fn read_row(&mut self, row: &Row) -> Result<u16> {
        if !row.access.is_readable() {
            return Err(self.access_forbidden(row));
        }
        self.read_place(row.place()).await
    }

    /// Writes the register of a row, if its access and range allow it.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`] and [`Error::ValueNotAllowed`]; nothing is sent then.
    pub async fn write_row(&mut self, row: &Row, word: u16) -> Result<()> {
        self.check_row(row, word)?;
        self.write_place(row.place(), word).await
    }

    /// Writes the register of a row as a parameter: reads it first, leaves an equal value alone, and reads back what it
    /// wrote.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`] and [`Error::ValueNotAllowed`] before anything is sent, and
    /// [`Error::NotConfirmed`] when it reads back otherwise; the status of that error holds the word and nothing else.
    pub async fn change_row(&mut self, row: &Row, word: u16) -> Result<Written> {
        self.check_row(row, word)?;
        // To write what stands there wears the EEPROM for nothing (rule 10).
        if row.access.is_readable() && self.read_row(row).await? == word {
            return Ok(Written { changed: false, storage: row.storage });
        }
        let outcome = self.write_place(row.place(), word).await;
        let written = Written { changed: true, storage: row.storage };
        if !row.access.is_readable() {
            return outcome.map(|()| written);
        }
        let value = match &outcome {
            Ok(()) => self.read_row(row).await,
            // Whether an ambiguous write arrived, the reading tells.
            Err(error) if error.kind() == ErrorKind::OutcomeUnknown => {
                self.read_back(row.place(), word, error).await
            }
            Err(error) => return Err(error.clone()),
        };
        let value = value.map_err(Error::after_write)?;
        if value == word {
            return Ok(written);
        }
        // It is not there, and the drive has said why.
        if let Err(error @ Error::Exception { .. }) = outcome {
            return Err(error);
        }
        let raw = vec![RawWord { address: row.address, code: row.code, value }];
        let status = Box::new(Status { raw, ..Status::default() });
        let command = Command::WriteParameter(row.address);
        Err(Error::NotConfirmed { slave: self.registers.slave, command, status, because: None })
    }

    /// Sends `data` round by function 08, sub-function 00, and checks that it comes back: the cheapest proof that the
    /// slave hears and speaks.
    pub async fn echo(&mut self, data: u16) -> Result<()> {
        let exchange = Exchange { function: 0x08, register: None };
        let [high, low] = data.to_be_bytes();
        let payload = [0, 0, high, low];
        match self.request(Request::Custom(0x08, Cow::Borrowed(&payload)), exchange).await? {
            Response::Custom(0x08, echoed) if echoed.as_ref() == payload => Ok(()),
            _ => Err(self.answer(exchange, "the echo differs")),
        }
    }

    /// Asks what the device is, by function 43/14 from object 00 on.
    pub async fn identification(&mut self, code: ReadCode) -> Result<Identity> {
        // Some gateways do not pass function 43 on and take their whole wait to say so: what was told once is kept.
        let exchange = Exchange { function: 0x2B, register: None };
        let is_kept = self.terms.class == Class::Background;
        if is_kept && let Some((told, at)) = self.registers.kept.named(Instant::now()) {
            self.registers.see(at);
            return told.map_err(|code| self.exception(exchange, code));
        }
        let told = self.ask_identification(code, exchange).await;
        let kept = match &told {
            Ok(identity) => Some(Ok(identity.clone())),
            Err(Error::Exception { code, .. }) => Some(Err(*code)),
            Err(_) => None,
        };
        if let Some(kept) = kept.filter(|_| is_kept) {
            let at = self.registers.port.asked_at().unwrap_or_else(Instant::now);
            self.registers.kept.keep_named(&kept, at);
        }
        told
    }

    async fn ask_identification(&mut self, code: ReadCode, exchange: Exchange) -> Result<Identity> {
        let response = self.request(Request::ReadDeviceIdentification(code, 0), exchange).await?;
        let Response::ReadDeviceIdentification(response) = response else {
            return Err(self.answer(exchange, "the answer is of another function"));
        };
        let object = |id| {
            let found = response.device_id_objects.iter().find(|object| object.id == id)?;
            Some(String::from_utf8_lossy(&found.value).trim_end_matches(['\0', ' ']).to_owned())
        };
        Ok(Identity { vendor: object(0), model: object(1), version: object(2), codes: Vec::new() })
    }

    /// Sends any request and returns the response as tokio-modbus decodes it. What the typed methods do not cover.
    ///
    /// A drive that answers that it is busy (exception 06, Modbus Application Protocol V1.1b3, section 7) has done nothing,
    /// and is asked again within the lifetime of the call, or a second where it has none; an edge is not.
    pub async fn request(&mut self, request: Request<'_>, exchange: Exchange) -> Result<Response> {
        // Bits and input registers judge an order as holding registers do.
        let reads = matches!(
            request,
            Request::ReadCoils(..) | Request::ReadDiscreteInputs(..) | Request::ReadInputRegisters(..)
        );
        let terms =
            if reads { self.registers.patience(self.terms) } else { self.registers.bounded(self.terms) };
        let outcome = self.request_under(terms, request, exchange).await;
        let is_sent = outcome.as_ref().err().is_none_or(|error| error.kind() != ErrorKind::NotSent);
        self.registers.written |= exchange.is_write() && is_sent;
        outcome
    }

    async fn request_under(
        &mut self,
        mut terms: Terms,
        request: Request<'_>,
        exchange: Exchange,
    ) -> Result<Response> {
        let patience = terms.lifetime.unwrap_or(PATIENCE);
        let until = later(Instant::now(), patience);
        let mut asking = Confirming::within(patience);
        loop {
            let outcome = self.once(terms, request.clone(), exchange).await;
            let busy = matches!(outcome, Err(Error::Exception { code: BUSY, .. }));
            if !busy || terms.effect == Effect::Edge || !asking.again().await {
                return outcome;
            }
            // The lifetime counts from the first try, or a busy drive would make a command late (rule 2).
            terms.lifetime = terms.lifetime.map(|_| until.saturating_duration_since(Instant::now()));
        }
    }

    async fn once(&mut self, terms: Terms, request: Request<'_>, exchange: Exchange) -> Result<Response> {
        if let Some(made_for) = self.registers.elsewhere {
            return Err(Error::OtherSlave { slave: self.registers.slave, made_for });
        }
        self.registers.port.set_terms(terms);
        let outcome = self.registers.port.call(request).await;
        if let (Ok(Ok(_)), Some(at)) = (&outcome, self.registers.port.asked_at()) {
            self.registers.see(at);
        }
        match outcome {
            Ok(Ok(response)) => Ok(response),
            Ok(Err(exception)) => Err(self.exception(exchange, exception.into())),
            Err(error) => Err(self.port_error(exchange, PortError::from_modbus(error))),
        }
    }

    /// An answer that breaks what the manual says.
    #[must_use]
    pub const fn answer(&self, exchange: Exchange, reason: &'static str) -> Error {
        Error::Answer { slave: self.registers.slave, exchange, reason }
    }

    fn exception(&self, exchange: Exchange, code: u8) -> Error {
        let meaning = (self.registers.meaning)(exchange.function, code).or_of_a_gateway(code);
        Error::Exception { slave: self.registers.slave, exchange, code, meaning }
    }

    const fn port_error(&self, exchange: Exchange, problem: PortError) -> Error {
        Error::Port { slave: self.registers.slave, exchange, problem }
    }

    fn check_row(&self, row: &Row, word: u16) -> Result<()> {
        if !row.access.is_writable() {
            return Err(self.access_forbidden(row));
        }
        let value = row.unit.number(word);
        if !row.range.allows(value) {
            let slave = self.registers.slave;
            return Err(Error::ValueNotAllowed { slave, register: row.address, code: row.code, value });
        }
        Ok(())
    }

    const fn access_forbidden(&self, row: &Row) -> Error {
        let slave = self.registers.slave;
        Error::AccessForbidden { slave, register: row.address, code: row.code, access: row.access }
    }

    const fn check_words(&self, words: usize, limit: u16) -> Result<()> {
        if words == 0 || words > limit as usize {
            return Err(Error::TooManyWords { slave: self.registers.slave, words, limit });
        }
        Ok(())
    }

    pub(crate) fn has(&self, function: u8) -> bool {
        self.registers.capabilities.functions.contains(&function)
    }

    const fn reading(register: u16) -> Exchange {
        Exchange { function: 0x03, register: Some(register) }
    }

    const fn writing(register: u16, function: u8) -> Exchange {
        Exchange { function, register: Some(register) }
    }
}

#[cfg(test)]
mod tests {
    use std::{collections::VecDeque, io};

    use async_trait::async_trait;
    use tokio_modbus::{ExceptionCode, client::Client, slave::SlaveContext};

    use super::*;

    const CAPABILITIES: Capabilities = Capabilities {
        functions: &[3, 6, 16],
        read_words: 16,
        write_words: 16,
        highest_address: 31,
        speeds: &[19_200],
        fault_reset: "a bit",
        ..Capabilities::least("test", "Test drive")
    };

    /// A slave that answers by a script and then by holding the last word that it was given.
    #[derive(Debug, Default)]
    struct Script {
        answers: VecDeque<ExceptionCode>,
        held: u16,
        /// It takes a write whose answer is exception 05 only after so many readings.
        takes_after: usize,
        asked: Option<u16>,
        writes: usize,
    }

    #[async_trait]
    impl Client for Script {
        async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
            match request {
                Request::WriteSingleRegister(at, value) => {
                    self.writes += 1;
                    let exception = self.answers.pop_front();
                    match exception {
                        Some(ExceptionCode::Acknowledge) => self.asked = Some(value),
                        Some(_) => {}
                        None => self.held = value,
                    }
                    Ok(exception.map_or(Ok(Response::WriteSingleRegister(at, value)), Err))
                }
                _ => {
                    match self.takes_after.checked_sub(1) {
                        Some(left) => self.takes_after = left,
                        None => self.held = self.asked.take().unwrap_or(self.held),
                    }
                    Ok(Ok(Response::ReadHoldingRegisters(vec![self.held])))
                }
            }
        }

        async fn disconnect(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl SlaveContext for Script {
        fn set_slave(&mut self, _: Slave) {}
    }

    impl Port for Script {}

    crate::registers! {
        /// One register.
        pub(crate) const ROWS;

        CMD: ReadWrite(8501, "CMD", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "test");
    }

    fn registers(answers: impl IntoIterator<Item = ExceptionCode>, takes_after: usize) -> Registers<Script> {
        let port = Script { answers: answers.into_iter().collect(), takes_after, ..Script::default() };
        let slave = SlaveAddress::try_from(1).unwrap();
        Registers::new(port, slave, &CAPABILITIES, |_, code| ExceptionMeaning::standard(code))
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_is_busy_is_asked_again_for_the_lifetime_of_the_call_and_not_longer() {
        let mut registers = registers([ExceptionCode::ServerDeviceBusy; 3], 0);
        assert_eq!(registers.at(Class::Command).write(CMD, 15).await, Ok(()));
        assert_eq!((registers.port.held, registers.port.writes), (15, 4));

        for (class, edge, least, most) in [(Class::Command, false, 5, 30), (Class::Command, true, 1, 1)] {
            let mut busy = self::registers([ExceptionCode::ServerDeviceBusy; 1_000], 0);
            let begun = Instant::now();
            let mut calls = busy.at(class);
            calls = if edge { calls.edge() } else { calls };
            let error = calls.write(CMD, 15).await.unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
            assert!(begun.elapsed() <= Duration::from_secs(1), "{:?}", begun.elapsed());
            assert!((least..=most).contains(&busy.port.writes), "{}", busy.port.writes);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_call_may_wait_for_longer_than_any_clock_goes() {
        let mut registers = registers([ExceptionCode::ServerDeviceBusy; 3], 0);
        registers.lifetimes.stop = Some(Duration::MAX);
        registers.lifetimes.command = Some(Duration::MAX);
        for (class, word) in [(Class::Stop, 2), (Class::Command, 15)] {
            assert_eq!(registers.at(class).write(CMD, word).await, Ok(()), "{class}");
            assert_eq!(registers.port.held, word);
        }
    }

    /// What an order is read for and its first word die with it; what belongs to that word goes out whatever it takes.
    #[tokio::test(start_paused = true)]
    async fn a_command_that_has_not_begun_in_time_is_not_written_and_one_that_has_is_finished() {
        for (begins, is_sent) in [(false, false), (true, true)] {
            let mut registers = registers([], 0);
            registers.begin_order();
            registers.lifetimes.begun_until = Some(Instant::now() + Duration::from_millis(100));
            if begins {
                assert_eq!(registers.at(Class::Command).write(CMD, 0x80).await, Ok(()));
            }
            tokio::time::sleep(Duration::from_millis(200)).await;
            let terms = registers
                .bounded(Terms { lifetime: Some(Duration::from_secs(1)), ..Terms::of(Class::Command) });
            assert_eq!(terms.lifetime != Some(Duration::ZERO), is_sent, "{terms:?}");
            registers.begin_order();
            registers.lifetimes.begun_until = None;
            let terms = registers
                .bounded(Terms { lifetime: Some(Duration::from_secs(1)), ..Terms::of(Class::Command) });
            assert_eq!(terms.lifetime, Some(Duration::from_secs(1)));
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_write_that_was_accepted_and_takes_long_is_known_once_it_is_read_back() {
        let mut registers = registers([ExceptionCode::Acknowledge], 3);
        assert_eq!(registers.at(Class::Command).write(CMD, 15).await, Ok(()));
        assert_eq!(registers.port.writes, 1);

        let mut never = self::registers([ExceptionCode::Acknowledge], usize::MAX);
        let error = never.at(Class::Command).write(CMD, 15).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");

        let mut parameter = self::registers([ExceptionCode::Acknowledge], 3);
        let written = parameter.at(Class::Background).change_row(CMD.row(), 15).await;
        assert_eq!(written.map(|written| written.changed), Ok(true));
    }
}
