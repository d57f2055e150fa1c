//! The one way in which families read and write: [`Registers`], typed, within the family's limits, every answer
//! checked, every error naming slave and register.

mod device;
mod lifetimes;
mod rows;
mod slave;
mod words;

use std::time::Duration;

use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use crate::{
    confirm::{Confirming, later},
    error::{BUSY, Error, ErrorKind, Exchange, Result},
    port::{Effect, Port, PortError, Terms},
};

pub use self::{lifetimes::Lifetimes, slave::Registers};

/// How long a drive that answers that it is busy is asked again by a call without a lifetime, and how long one that has
/// accepted a write and takes long for it is read back.
const PATIENCE: Duration = Duration::from_secs(1);

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

    pub(crate) fn has(&self, function: u8) -> bool {
        self.registers.capabilities.functions.contains(&function)
    }
}

#[cfg(test)]
mod tests;
