//! A port on which something happens in front of one exchange.

use std::{
    io,
    sync::{Arc, Mutex, PoisonError},
};

use async_trait::async_trait;
use drive_core::{Drive, Port, PortError, StopMode, Terms};
use tokio_modbus::{ExceptionCode, Request, Response, Slave, client::Client, slave::SlaveContext};

/// What happens.
pub enum Event {
    /// From now on nothing is sent in time.
    Expiry,
    /// The drive refuses this one exchange: it is busy.
    Busy,
    /// From now on nothing comes to an end, so that whoever waits gives up.
    Silence,
    /// Somebody else stops the motor, and sees that it is confirmed.
    Stop(Box<dyn Drive>, StopMode),
    /// This request comes, which the way to the drive had kept back.
    Late(Request<'static>),
    /// The drive answers the write that this is, and carries it out when so many more exchanges have passed; then this comes.
    Slow(usize, Deed),
}

/// What somebody does beside the line.
pub type Deed = Box<dyn FnOnce() + Send>;

/// What is carried out late.
struct Kept {
    left: usize,
    write: Request<'static>,
    deed: Deed,
}

/// When, counted in exchanges from now on.
#[derive(Default)]
struct Plan {
    left: usize,
    event: Option<Event>,
    writes: usize,
    happened: Option<Happened>,
}

/// When it has happened.
#[derive(Debug, Clone, Copy)]
pub struct Happened {
    /// How many writes had passed.
    pub writes: usize,
    /// Whether it was in front of a write.
    pub before_a_write: bool,
}

/// A port in front of a line. Clones share what is to happen.
#[derive(Clone)]
pub struct Interrupted {
    line: drive_bus::Slave,
    plan: Arc<Mutex<Plan>>,
    kept: Arc<Mutex<Option<Kept>>>,
}

impl Interrupted {
    /// A port on which nothing happens yet.
    #[must_use]
    pub fn new(line: drive_bus::Slave) -> Self {
        Self { line, plan: Arc::default(), kept: Arc::default() }
    }

    /// Lets this happen when so many more exchanges have passed.
    pub fn after(&self, exchanges: usize, event: Event) {
        self.set(Plan { left: exchanges, event: Some(event), ..Plan::default() });
    }

    /// Lets everything pass again. Gives when it has happened, if it has.
    pub fn calm(&self) -> Option<Happened> {
        self.set(Plan::default()).happened
    }

    fn set(&self, plan: Plan) -> Plan {
        std::mem::replace(&mut *self.plan.lock().unwrap_or_else(PoisonError::into_inner), plan)
    }

    /// What is carried out in front of this exchange.
    fn kept_until_now(&self) -> Option<Kept> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.as_mut() {
            Some(Kept { left, .. }) if *left > 0 => {
                *left -= 1;
                None
            }
            _ => kept.take(),
        }
    }

    /// Whether something is still to be carried out.
    #[must_use]
    pub fn keeps(&self) -> bool {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// What happens in front of this exchange. What lasts happens in front of the next one, too.
    fn due(&self, request: &Request<'_>) -> Option<Event> {
        let mut plan = self.plan.lock().unwrap_or_else(PoisonError::into_inner);
        let is_write = matches!(request.function_code().value(), 0x06 | 0x10);
        if plan.left > 0 {
            plan.left -= 1;
            plan.writes += usize::from(is_write);
            return None;
        }
        if plan.happened.is_none() {
            plan.happened = Some(Happened { writes: plan.writes, before_a_write: is_write });
        }
        match plan.event {
            Some(Event::Expiry) => Some(Event::Expiry),
            Some(Event::Silence) => Some(Event::Silence),
            _ => plan.event.take(),
        }
    }
}

impl Port for Interrupted {
    fn set_terms(&mut self, terms: Terms) {
        self.line.set_terms(terms);
    }
}

impl SlaveContext for Interrupted {
    fn set_slave(&mut self, slave: Slave) {
        self.line.set_slave(slave);
    }
}

#[async_trait]
impl Client for Interrupted {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        if let Some(Kept { write, deed, .. }) = self.kept_until_now() {
            self.line.call(write).await.expect("it answers").expect("it takes it");
            deed();
        }
        match self.due(&request) {
            None => {}
            Some(Event::Slow(left, deed)) => {
                let (answer, write) = match &request {
                    Request::WriteSingleRegister(at, word) => {
                        (Response::WriteSingleRegister(*at, *word), Request::WriteSingleRegister(*at, *word))
                    }
                    Request::WriteMultipleRegisters(at, words) => (
                        Response::WriteMultipleRegisters(*at, u16::try_from(words.len()).expect("a few")),
                        Request::WriteMultipleRegisters(*at, words.to_vec().into()),
                    ),
                    other => panic!("no write: {other:?}"),
                };
                *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(Kept { left, write, deed });
                return Ok(Ok(answer));
            }
            Some(Event::Expiry) => {
                return Err(tokio_modbus::Error::Transport(PortError::Expired.into_io()));
            }
            Some(Event::Busy) => return Ok(Err(ExceptionCode::ServerDeviceFailure)),
            Some(Event::Silence) => std::future::pending().await,
            Some(Event::Stop(mut drive, mode)) => {
                drive.stop(mode).await.expect("it stops");
            }
            Some(Event::Late(late)) => {
                self.line.call(late).await.expect("it answers").expect("it takes it");
            }
        }
        self.line.call(request).await
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}
