//! What is at the far end of a line's port, as the text of a line and the keys of a file say it.

use drive_bus::{Endpoint, Gateway, GatewayError, LineConfig, Stats, stats::WaitIs};

/// The settings of it, as they stand anywhere behind the port.
const GATEWAY: &str = "gateway=";
const CONNECTIONS: &str = "connections=";
const PACES: &str = "far-end-paces=";

/// More connections than two are of no use to a line.
pub const MOST_CONNECTIONS: u8 = 2;

/// What was said of the far end; the rest follows from the kind of port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FarEndSpec {
    /// The gateway between the port and the drives.
    pub gateway: Option<Gateway>,
    /// How many connections it grants us at once.
    pub connections: Option<u8>,
    /// Whether it takes the time that characters take on a line.
    pub paces: Option<bool>,
}

/// What cannot be said of a far end.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FarEndError {
    #[error("gateway={0}")]
    Gateway(#[from] GatewayError),
    #[error("connections={0:?}: expected 1, or 2 where a stop may take a second connection")]
    Connections(String),
    #[error("a serial port has no connections: expected no {CONNECTIONS}")]
    NoConnections,
    #[error("far-end-paces={0:?}: expected yes or no")]
    Paces(String),
    #[error("{0} is said twice")]
    Twice(&'static str),
    #[error("Modbus TCP has no speed that its far end could keep: expected no {PACES}")]
    NoSpeed,
}

impl FarEndSpec {
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
    pub fn or(self, other: Self) -> Self {
        Self {
            gateway: self.gateway.or(other.gateway),
            connections: self.connections.or(other.connections),
            paces: self.paces.or(other.paces),
        }
    }

    /// The line with this far end.
    pub fn on(self, config: LineConfig) -> Result<LineConfig, FarEndError> {
        if self.paces.is_some() && !config.protocol.is_paced() {
            return Err(FarEndError::NoSpeed);
        }
        if self.connections.is_some() && !matches!(config.endpoint, Endpoint::Tcp(_)) {
            return Err(FarEndError::NoConnections);
        }
        let Self { gateway, connections, paces } = self;
        Ok(LineConfig { gateway, connections, far_end_paces: paces, ..config })
    }

    /// What a configuration says of it.
    pub(super) fn of(config: &LineConfig) -> Self {
        Self { gateway: config.gateway, connections: config.connections, paces: config.far_end_paces }
    }

    /// As it stands behind the port.
    pub(super) fn written(self) -> String {
        let gateway = self.gateway.map(|gateway| format!(",{GATEWAY}{gateway}"));
        let connections = self.connections.map(|connections| format!(",{CONNECTIONS}{connections}"));
        let paces = self.paces.map(|paces| format!(",{PACES}{}", if paces { "yes" } else { "no" }));
        [gateway, connections, paces].into_iter().flatten().collect()
    }
}

/// What the far end was seen to be like where the line is not set so, with the setting that says it.
pub fn proposal(config: &LineConfig, stats: &Stats) -> Option<String> {
    if config.far_end_paces != Some(false) && stats.is_faster_than_configured() {
        return Some(format!(
            "every answer came sooner than {} can carry it, and none was taken: an adapter without a UART or a program is faster than \
             a line, say {PACES}no; or the speed is set too low",
            config.serial
        ));
    }
    let seen = stats.far_end.filter(|seen| seen.wait_is == WaitIs::Seen && config.gateway.is_none())?;
    let wait = std::time::Duration::from_millis(
        u64::try_from(seen.wait.as_millis().div_ceil(100)).unwrap_or(u64::MAX) * 100,
    );
    let gateway = Gateway { at_once: Some(seen.at_once), wait: Some(wait) };
    Some(format!(
        "a gateway was seen to wait {wait:?} for a drive that does not answer, and to serve {} at once: say {GATEWAY}{gateway}",
        if seen.at_once == 1 { "one request".to_owned() } else { format!("{} requests", seen.at_once) }
    ))
}
