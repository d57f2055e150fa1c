//! What is at the far end of a line's port, as the text of a line and the keys of a file say it.

use std::fmt;

use super::LineConfig;
use crate::gateway::{Gateway, GatewayError};

/// The settings of it, as they stand anywhere behind the port.
const GATEWAY: &str = "gateway=";
const CONNECTIONS: &str = "connections=";
const PACES: &str = "far-end-paces=";

/// More connections than two are of no use to a line.
pub const MOST_CONNECTIONS: u8 = 2;

/// What was said of the far end; the rest follows from the kind of port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FarEndSettings {
    /// The gateway between the port and the drives.
    pub gateway: Option<Gateway>,
    /// How many connections it grants us at once.
    pub connections: Option<u8>,
    /// Whether it takes the time that characters take on a line.
    pub paces: Option<bool>,
}

/// What cannot be said of a far end.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FarEndError {
    /// No gateway.
    #[error("gateway={0}")]
    Gateway(#[from] GatewayError),
    /// No number of connections.
    #[error("connections={0:?}: expected 1, or 2 where a stop may take a second connection")]
    Connections(String),
    /// Connections of a serial port.
    #[error("a serial port has no connections: expected no {CONNECTIONS}")]
    NoConnections,
    /// Neither yes nor no.
    #[error("far-end-paces={0:?}: expected yes or no")]
    Paces(String),
    /// The setting.
    #[error("{0} is said twice")]
    Twice(&'static str),
    /// A pace on Modbus TCP.
    #[error("Modbus TCP has no speed that its far end could keep: expected no {PACES}")]
    NoSpeed,
}

impl FarEndSettings {
    /// Takes its settings out of the text of a line, and gives the rest.
    pub(super) fn take(text: &str) -> Result<(String, Self), FarEndError> {
        let mut said = Self::default();
        let mut rest = Vec::new();
        for part in text.split(',') {
            if let Some(gateway) = part.strip_prefix(GATEWAY) {
                if said.gateway.replace(gateway.parse()?).is_some() {
                    return Err(FarEndError::Twice("gateway"));
                }
            } else if let Some(connections) = part.strip_prefix(CONNECTIONS) {
                let number =
                    connections.parse().ok().filter(|number| (1..=MOST_CONNECTIONS).contains(number));
                let number = number.ok_or_else(|| FarEndError::Connections(connections.to_owned()))?;
                if said.connections.replace(number).is_some() {
                    return Err(FarEndError::Twice("connections"));
                }
            } else if let Some(paces) = part.strip_prefix(PACES) {
                let paces = match paces {
                    "yes" => true,
                    "no" => false,
                    other => return Err(FarEndError::Paces(other.to_owned())),
                };
                if said.paces.replace(paces).is_some() {
                    return Err(FarEndError::Twice("far-end-paces"));
                }
            } else {
                rest.push(part);
            }
        }
        Ok((rest.join(","), said))
    }

    /// What is said here, and of what is not said the other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            gateway: self.gateway.or(other.gateway),
            connections: self.connections.or(other.connections),
            paces: self.paces.or(other.paces),
        }
    }

    /// The line with this far end.
    ///
    /// # Errors
    /// Where the line's port has no such thing.
    pub fn on(self, config: LineConfig) -> Result<LineConfig, FarEndError> {
        if self.paces.is_some() && !config.protocol.is_paced() {
            return Err(FarEndError::NoSpeed);
        }
        if self.connections.is_some() && !config.endpoint.is_connection() {
            return Err(FarEndError::NoConnections);
        }
        let Self { gateway, connections, paces } = self;
        Ok(LineConfig { gateway, connections, far_end_paces: paces, ..config })
    }

    /// What a configuration says of it.
    pub(super) fn of(config: &LineConfig) -> Self {
        Self { gateway: config.gateway, connections: config.connections, paces: config.far_end_paces }
    }
}

/// As it stands behind the port: each setting that was said behind a comma.
impl fmt::Display for FarEndSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(gateway) = self.gateway {
            write!(f, ",{GATEWAY}{gateway}")?;
        }
        if let Some(connections) = self.connections {
            write!(f, ",{CONNECTIONS}{connections}")?;
        }
        match self.paces {
            Some(paces) => write!(f, ",{PACES}{}", if paces { "yes" } else { "no" }),
            None => Ok(()),
        }
    }
}
