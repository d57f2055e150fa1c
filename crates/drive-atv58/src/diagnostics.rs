//! Function 08 with all its sub-codes, function 0B and function 04: what the card has beyond reading and writing
//! output words (VVDED397054 p. 18/42, 19/43, 21/45).

use std::borrow::Cow;

use drive_core::{Calls, Class, Error, Exchange, Port, PortError, Result};
use tokio_modbus::{Request, Response};

use crate::{Atv58, CAPABILITIES};

/// Function 08.
const DIAGNOSTICS: Exchange = Exchange { function: 0x08, register: None };
/// Function 0B.
const EVENT_COUNTER: Exchange = Exchange { function: 0x0B, register: None };

/// The sub-codes of function 08, beside 00, the echo, which is [`Calls::echo`].
const RESTART_COMMUNICATION: u16 = 0x01;
const CHANGE_DELIMITER: u16 = 0x03;
const ENTER_LISTEN_ONLY: u16 = 0x04;
const CLEAR_COUNTERS: u16 = 0x0A;
/// The sub-code of the first counter; the others follow.
const FIRST_COUNTER: u16 = 0x0B;

/// The counters of the card, each of 16 bits, since power-up or [`Atv58::clear_counters`].
///
/// They are read one by one, so each is as old as its own exchange, and the reading itself counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Counters {
    /// 0Bh: messages seen on the line without an error of the check.
    pub messages: u16,
    /// 0Ch: messages received with an error of the check.
    pub check_errors: u16,
    /// 0Dh: exception responses sent.
    pub exceptions: u16,
    /// 0Eh: messages to this slave, without broadcasts.
    pub addressed: u16,
    /// 0Fh: broadcasts received.
    pub broadcasts: u16,
    /// 10h: NAQ responses; the manual says always 0.
    pub naq: u16,
    /// 11h: responses "not ready"; the manual says always 0.
    pub not_ready: u16,
    /// 12h: characters not processed, because they were wrong.
    pub characters: u16,
}

impl<P: Port> Atv58<P> {
    /// Function 08/00: sends `data` round and checks that it comes back.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], and [`Error::Answer`] when the echo differs.
    pub async fn echo(&mut self, data: u16) -> Result<()> {
        self.registers.at(Class::Background).echo(data).await
    }

    /// Function 08/01: restarts the card's communication. It is the only request that a card in listen-only mode
    /// answers, and it ends that mode.
    ///
    /// It travels as urgently as a stop, also to a slave that the line has taken for lost: until it has arrived, no
    /// stop reaches the drive.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], and [`Error::Answer`] when the confirmation differs.
    pub async fn restart_communication(&mut self) -> Result<()> {
        self.confirmed(Class::Stop, RESTART_COMMUNICATION, 0).await
    }

    /// Function 08/03: changes the character that ends a message in Modbus ASCII, line feed (0Ah) until then. The
    /// line must use the new one from now on; in RTU it has no effect.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], and [`Error::Answer`] when the confirmation differs.
    pub async fn change_ascii_delimiter(&mut self, delimiter: u8) -> Result<()> {
        self.confirmed(Class::Background, CHANGE_DELIMITER, u16::from_be_bytes([delimiter, 0])).await
    }

    /// Function 08/04: enters listen-only mode. The card then carries out and answers nothing, **not even a stop**,
    /// until [`restart_communication`](Self::restart_communication). It does not answer this request either, so `Ok`
    /// says that it was sent and not refused, and nothing more; a dead line looks the same. A line that knows the
    /// request returns after its turnaround, another one after its timeout; a plain connection without a timeout waits
    /// for ever.
    ///
    /// # Errors
    /// [`Error::Port`] when it was not sent, [`Error::Exception`] when it is refused, and [`Error::Answer`] when
    /// something else comes back.
    pub async fn enter_listen_only(&mut self) -> Result<()> {
        match self.confirmed(Class::Background, ENTER_LISTEN_ONLY, 0).await {
            Err(Error::Port {
                problem: PortError::Timeout { .. } | PortError::OutcomeUnknown(_), ..
            }) => Ok(()),
            result => result,
        }
    }

    /// Function 08/0A: sets all counters to 0.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], and [`Error::Answer`] when the confirmation differs.
    pub async fn clear_counters(&mut self) -> Result<()> {
        self.confirmed(Class::Background, CLEAR_COUNTERS, 0).await
    }

    /// Function 08/0B to 08/12: reads the counters, in eight exchanges.
    ///
    /// # Errors
    /// [`Error::Port`] and [`Error::Exception`].
    pub async fn counters(&mut self) -> Result<Counters> {
        let mut calls = self.registers.at(Class::Background);
        let mut values = [0; 8];
        for (value, code) in values.iter_mut().zip(FIRST_COUNTER..) {
            *value = diagnose(&mut calls, code, 0).await?;
        }
        let [messages, check_errors, exceptions, addressed, broadcasts, naq, not_ready, characters] = values;
        Ok(Counters { messages, check_errors, exceptions, addressed, broadcasts, naq, not_ready, characters })
    }

    /// Function 0B: reads the event counter, which counts each correct message to this slave, except those that were
    /// answered by an exception.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], and [`Error::Answer`] when the status word before the counter is not the
    /// 0 of the manual.
    pub async fn event_counter(&mut self) -> Result<u16> {
        let mut calls = self.registers.at(Class::Background);
        match calls.request(Request::Custom(0x0B, Cow::Borrowed(&[])), EVENT_COUNTER).await? {
            Response::Custom(0x0B, data) => match data.as_ref() {
                &[0, 0, high, low] => Ok(u16::from_be_bytes([high, low])),
                _ => Err(calls.answer(EVENT_COUNTER, "the status before the counter is not 0000")),
            },
            _ => Err(calls.answer(EVENT_COUNTER, "the answer is of another function")),
        }
    }

    /// Function 04: reads `count` input words, which are those that a master can only read. The manual does not say
    /// which words these are; its sample reads W463 to W466 with function 03.
    ///
    /// # Errors
    /// [`Error::Port`], [`Error::Exception`], [`Error::Answer`], and [`Error::TooManyWords`] before anything is sent.
    pub async fn read_input_words(&mut self, first: u16, count: u16) -> Result<Vec<u16>> {
        let limit = CAPABILITIES.read_words;
        if count == 0 || count > limit {
            let slave = self.registers.slave();
            return Err(Error::TooManyWords { slave, words: usize::from(count), limit });
        }
        read_input_words(&mut self.registers.at(Class::Background), first, count).await
    }

    /// A sub-code whose answer repeats the request.
    async fn confirmed(&mut self, class: Class, code: u16, data: u16) -> Result<()> {
        let mut calls = self.registers.at(class).edge();
        if diagnose(&mut calls, code, data).await? == data {
            Ok(())
        } else {
            Err(calls.answer(DIAGNOSTICS, "the confirmation does not repeat the request"))
        }
    }
}

/// Function 04, within the limit of words.
pub(crate) async fn read_input_words<P: Port>(
    calls: &mut Calls<'_, P>,
    first: u16,
    count: u16,
) -> Result<Vec<u16>> {
    let exchange = Exchange { function: 0x04, register: Some(first) };
    match calls.request(Request::ReadInputRegisters(first, count), exchange).await? {
        Response::ReadInputRegisters(words) if words.len() == usize::from(count) => Ok(words),
        Response::ReadInputRegisters(_) => {
            Err(calls.answer(exchange, "the answer holds another number of words"))
        }
        _ => Err(calls.answer(exchange, "the answer is of another function")),
    }
}

/// Sends a sub-code of function 08 and returns the answer's data.
async fn diagnose<P: Port>(calls: &mut Calls<'_, P>, code: u16, data: u16) -> Result<u16> {
    let [code_high, code_low] = code.to_be_bytes();
    let [high, low] = data.to_be_bytes();
    let payload = [code_high, code_low, high, low];
    match calls.request(Request::Custom(0x08, Cow::Borrowed(&payload)), DIAGNOSTICS).await? {
        Response::Custom(0x08, answer) => match answer.as_ref() {
            &[a, b, high, low] if [a, b] == [code_high, code_low] => Ok(u16::from_be_bytes([high, low])),
            _ => Err(calls.answer(DIAGNOSTICS, "the answer is of another sub-code")),
        },
        _ => Err(calls.answer(DIAGNOSTICS, "the answer is of another function")),
    }
}
