//! The UNI-TE requests of a slave on a UNI-TELWAY line that are no reading or writing of registers (VVDED397054
//! p. 11–13/35–37).

use std::{borrow::Cow, time::Duration};

use bytes::Bytes;
use drive_core::{Class, Port, PortError, Terms};
use tokio_modbus::{ExceptionCode, Request, Response, client::Client};

pub use drive_unitelway::{Identification, LinkCounters, SpecificCommand, SpecificReport, code, unite_of};

use crate::{exchange::unitelway::UNITE, protocol::Protocol, slave::Slave};

/// How long a command may wait until it is sent, where its caller has not said so: as in every family.
const COMMAND_LIFETIME: Duration = Duration::from_secs(1);

impl Slave {
    /// Its UNI-TE requests beyond reading and writing, on a line that speaks UNI-TELWAY, under the same terms.
    #[must_use]
    pub fn unite(&self) -> UniTe {
        UniTe::new(self.clone())
    }
}

/// UNI-TE requests to one slave, under its [`Terms`]. From [`Slave::unite`].
///
/// # Cancellation
/// As for every call of a [`Slave`].
///
/// # Errors
/// Every request fails with [`UniTeError::Port`] when no valid reply came, or with [`PortError::NotCarried`] in it when
/// the line does not speak UNI-TELWAY, and with [`UniTeError::Refused`] when the slave gave its negative reply.
#[derive(Debug, Clone)]
pub struct UniTe {
    slave: Slave,
}

/// Why a UNI-TE request brought nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UniTeError {
    /// The negative reply FDh, which has no reason, as exception 03; or 0Ah when the network could not deliver it.
    #[error("the slave refuses the request ({0})")]
    Refused(ExceptionCode),
    /// No valid reply.
    #[error(transparent)]
    Port(#[from] PortError),
}

impl UniTe {
    pub(crate) const fn new(slave: Slave) -> Self {
        Self { slave }
    }

    /// Request 0Fh: who the slave is.
    pub async fn identify(&mut self) -> Result<Identification, UniTeError> {
        let reply = self.ask(code::IDENTIFICATION, &[]).await?;
        Identification::from_reply(&reply).ok_or_else(|| misfit("an identification that is not whole"))
    }

    /// Request 30h: the protocol's version, as the slave codes it; what the bytes mean is not printed.
    pub async fn protocol_version(&mut self) -> Result<Bytes, UniTeError> {
        Ok(self.ask(code::PROTOCOL_VERSION, &[]).await?.slice(1..))
    }

    /// Request FAh: sends data round and checks that they come back. 100 bytes are always short enough.
    pub async fn mirror(&mut self, data: &[u8]) -> Result<(), UniTeError> {
        let reply = self.ask(code::MIRROR, data).await?;
        if reply.get(1..) == Some(data) { Ok(()) } else { Err(misfit("not the data that were sent")) }
    }

    /// Request A2h: the counters of the slave's link. They stand in the line's statistics from then on.
    pub async fn link_counters(&mut self) -> Result<LinkCounters, UniTeError> {
        let reply = self.ask(code::READ_COUNTERS, &[]).await?;
        let counters = LinkCounters::from_reply(&reply).ok_or_else(|| misfit("not four words"))?;
        self.note_link_counters(counters);
        Ok(counters)
    }

    /// Request A4h: sets the counters to 0.
    pub async fn clear_link_counters(&mut self) -> Result<(), UniTeError> {
        self.ask(code::CLEAR_COUNTERS, &[]).await?;
        self.note_link_counters(LinkCounters::default());
        Ok(())
    }

    /// Request F2h: writes control word, reference and ramps, and reads reference, status, faults and current back, in
    /// one exchange.
    ///
    /// **It commands the drive**, every time: it is no way to poll. It travels as a command even where the slave's terms
    /// are a poll's, and as a stop where they are a stop's. Where the control word has a bit that acts as an edge
    /// (fault reset), the terms **must** say [`edge`](Terms::edge), so that nothing is sent twice.
    ///
    /// # Errors
    /// Also [`PortError::OutcomeUnknown`] when it was sent and no reply came: read the status before anything else.
    pub async fn command(&mut self, command: SpecificCommand) -> Result<SpecificReport, UniTeError> {
        let mut commands = self.clone();
        let terms = self.slave.terms;
        if terms.class < Class::Command {
            let lifetime = terms.lifetime.map_or(COMMAND_LIFETIME, |own| own.min(COMMAND_LIFETIME));
            commands.slave.set_terms(Terms { class: Class::Command, lifetime: Some(lifetime), ..terms });
        }
        let reply = commands.ask(code::SPECIFIC, &command.body()).await?;
        SpecificReport::from_reply(&reply).ok_or_else(|| misfit("another specific reply"))
    }

    fn note_link_counters(&self, counters: LinkCounters) {
        self.slave.handle.shared.master().note_link_counters(self.slave.address(), counters);
    }

    async fn ask(&mut self, code: u8, body: &[u8]) -> Result<Bytes, UniTeError> {
        let protocol = self.slave.handle.shared.master().config().protocol;
        if !matches!(protocol, Protocol::UniTelway(_)) {
            return Err(PortError::NotCarried("the line does not speak UNI-TELWAY".to_owned()).into());
        }
        let request = Request::Custom(UNITE, Cow::Owned([&[code], body].concat()));
        let response = self.slave.call(request).await;
        match response.map_err(PortError::from_modbus)?.map_err(UniTeError::Refused)? {
            Response::Custom(UNITE, reply) => Ok(reply),
            _ => Err(misfit("another function")),
        }
    }
}

fn misfit(why: &str) -> UniTeError {
    UniTeError::Port(PortError::Mismatch(why.to_owned()))
}
