//! A drive on a tokio-modbus connection of its own.

use std::{fmt, io, time::Duration};

use async_trait::async_trait;
use tokio::time::{Instant, sleep_until, timeout};
use tokio_modbus::{
    ExceptionCode, Request, Response, Slave,
    client::{Client, Context},
    slave::SlaveContext,
};

use crate::port::{Class, Port, PortError, Terms};

/// How long an answer that nobody waits for any more may still come, at the least: one and a half times the response timeout
/// that most masters have, as the late window of a line (drive-bus).
const LATE: Duration = Duration::from_millis(750);

/// How long a connection may take, at the least.
const CONNECTED: Duration = Duration::from_secs(1);

/// One drive on a tokio-modbus [`Context`] that nothing else uses.
///
/// A bare [`Context`] lacks what a [`Drive`](crate::Drive) promises, and is no [`Port`]: it waits for ever for an answer that
/// does not come, and the answer to a call that was dropped is taken for that of the next one. Here every exchange ends in its
/// time. Behind one that was dropped, failed or gave no answer, the connection is closed; the next call waits until nothing
/// can come any more and makes a new one. The write of a stop waits for nothing, and its confirmation counts only where it can
/// be no other's.
///
/// It keeps no silence between two frames beyond what the drive's own time makes of it, and it schedules nothing: several
/// drives on one line, or a program beside others, take a line with a schedule (`drive-bus`).
///
/// ```no_run
/// use std::time::Duration;
/// use drive_core::{Reconnecting, tokio_modbus::client::tcp};
///
/// let gateway = "192.168.1.10:502".parse().expect("an address");
/// let port = Reconnecting::new(Duration::from_millis(500), move || tcp::connect(gateway));
/// // let mut drive = Atv312::new(port, 1.try_into()?);
/// ```
pub struct Reconnecting<F> {
    connect: F,
    response_timeout: Duration,
    context: Option<Context>,
    slave: Slave,
    terms: Terms,
    /// The answer to a request that is under way, or that nobody waits for any more, may come until then.
    owed_until: Option<Instant>,
    asked_at: Option<Instant>,
}

impl<F, C> Reconnecting<F>
where
    F: FnMut() -> C + Send,
    C: Future<Output = io::Result<Context>> + Send,
{
    /// A drive behind what `connect` makes, at the first call and whenever the connection was given up. `response_timeout` is
    /// how long an exchange may take, from its first bit to the last of the answer.
    #[must_use]
    pub const fn new(response_timeout: Duration, connect: F) -> Self {
        Self {
            connect,
            response_timeout,
            context: None,
            slave: Slave(0),
            terms: Terms::of(Class::Status),
            owed_until: None,
            asked_at: None,
        }
    }

    async fn exchange(&mut self, request: Request<'_>) -> Result<Result<Response, ExceptionCode>, PortError> {
        let asked = Instant::now();
        let is_write = is_write(&request);
        let mut doubtful = false;
        if let Some(until) = self.owed_until {
            // With the connection goes whatever may still come over it.
            self.context = None;
            doubtful = is_write && self.terms.class == Class::Stop && until > asked;
            if !doubtful {
                sleep_until(until).await;
            }
        }
        let context = match &mut self.context {
            Some(context) => context,
            none => none.insert(connected(&mut self.connect, self.response_timeout).await?),
        };
        // The wait and the connection may have taken longer than a command may wait (rule 2).
        if self.terms.lifetime.is_some_and(|lifetime| asked.elapsed() > lifetime) {
            return Err(PortError::Expired);
        }
        context.set_slave(self.slave);
        let sent = Instant::now();
        // Before the call, and taken back by its answer: a call that is dropped in between leaves it owed.
        self.owed_until = Some(sent + LATE.max(self.response_timeout * 3 / 2));
        let problem = match timeout(self.response_timeout, context.call(request)).await {
            Ok(Ok(_)) if doubtful => PortError::Mismatch("an earlier answer may have come".to_owned()),
            Ok(Ok(answer)) => {
                self.owed_until = None;
                self.asked_at = Some(sent);
                return Ok(answer);
            }
            Ok(Err(error)) => PortError::from_modbus(error),
            Err(_) => PortError::Timeout { after: self.response_timeout },
        };
        Err(if is_write { PortError::OutcomeUnknown("no answer that is surely its own") } else { problem })
    }
}

async fn connected<C>(
    mut connect: impl FnMut() -> C,
    response_timeout: Duration,
) -> Result<Context, PortError>
where
    C: Future<Output = io::Result<Context>>,
{
    match timeout(CONNECTED.max(response_timeout), connect()).await {
        Ok(made) => made.map_err(|error| PortError::LineDown(error.to_string())),
        Err(_) => Err(PortError::LineDown("no connection in its time".to_owned())),
    }
}

/// Whether it may change something in the slave. What is not known may.
fn is_write(request: &Request<'_>) -> bool {
    !matches!(
        request,
        Request::ReadCoils(..)
            | Request::ReadDiscreteInputs(..)
            | Request::ReadHoldingRegisters(..)
            | Request::ReadInputRegisters(..)
            | Request::ReadDeviceIdentification(..)
            | Request::ReportServerId
    )
}

#[async_trait]
impl<F, C> Client for Reconnecting<F>
where
    F: FnMut() -> C + Send,
    C: Future<Output = io::Result<Context>> + Send,
{
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        self.exchange(request).await.map_err(|error| tokio_modbus::Error::Transport(error.into_io()))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        match self.context.take() {
            Some(mut context) => context.disconnect().await,
            None => Ok(()),
        }
    }
}

impl<F> SlaveContext for Reconnecting<F> {
    fn set_slave(&mut self, slave: Slave) {
        self.slave = slave;
    }
}

impl<F, C> Port for Reconnecting<F>
where
    F: FnMut() -> C + Send,
    C: Future<Output = io::Result<Context>> + Send,
{
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
    }

    fn asked_at(&self) -> Option<Instant> {
        self.asked_at
    }
}

impl<F> fmt::Debug for Reconnecting<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reconnecting")
            .field("slave", &self.slave)
            .field("response_timeout", &self.response_timeout)
            .finish_non_exhaustive()
    }
}
