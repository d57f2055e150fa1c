//! A line as a text: `PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]]`, `rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]` or
//! `tcp://HOST:PORT`, and behind each what is said of its far end.

use std::{fmt, str::FromStr};

use drive_core::serial::{BaudError, CharacterFormat, CharacterFormatError, SerialSettings};

use super::{
    Endpoint, LineConfig,
    far_end::{FarEndError, FarEndSettings},
};
use crate::protocol::{Protocol, ProtocolError, ProtocolMismatch};

/// A line as a person names it; what is not said of speed and format follows from the drives on it.
///
/// ```
/// use drive_bus::config::LineText;
/// use drive_core::SerialSettings;
///
/// let said: LineText = "/dev/ttyUSB0".parse()?;
/// assert_eq!(said.serial.baud, None);
/// let config = said.at(SerialSettings::MODBUS_DEFAULT)?;
/// assert_eq!(config.to_string(), "/dev/ttyUSB0,19200,8E1");
/// # Ok::<(), drive_bus::config::LineTextError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct LineText {
    /// Where it goes.
    pub endpoint: Endpoint,
    /// Speed, format and protocol.
    pub serial: SerialText,
    /// What is at its far end.
    pub far_end: FarEndSettings,
}

/// Speed and format as far as they were said, and the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SerialText {
    /// In bit/s.
    pub baud: Option<u32>,
    /// Data bits, parity, stop bits.
    pub format: Option<CharacterFormat>,
    /// What is spoken.
    pub protocol: Protocol,
}

impl LineText {
    /// The line at this speed and format, whatever was said of them.
    ///
    /// # Errors
    /// A far end that this port does not have.
    pub fn at(&self, serial: SerialSettings) -> Result<LineConfig, LineTextError> {
        let to = LineConfig::to(self.endpoint.clone(), serial);
        Ok(self.far_end.on(LineConfig { protocol: self.serial.protocol, ..to })?)
    }

    /// The same line, with what is said elsewhere of its far end.
    #[must_use]
    pub fn with_far_end(&self, said: FarEndSettings) -> Self {
        Self { far_end: said.or(self.far_end), ..self.clone() }
    }
}

/// A line whose speed and format are said, such as `/dev/ttyUSB0,19200,8E1` or `tcp://gateway.local:502`; the other settings
/// are those of its constructor.
///
/// ```
/// use drive_bus::{LineConfig, Protocol};
///
/// let line: LineConfig = "COM3,9600,7E1,ascii".parse()?;
/// assert!(matches!(line.protocol, Protocol::Ascii(_)));
/// let gateway: LineConfig = "tcp://plant:502,gateway=3x1s,connections=2".parse()?;
/// assert_eq!(gateway.to_string(), "tcp://plant:502,gateway=3s,connections=2");
/// assert!("/dev/ttyUSB0".parse::<LineConfig>().is_err(), "at which speed?");
/// # Ok::<(), drive_bus::config::LineTextError>(())
/// ```
impl FromStr for LineConfig {
    type Err = LineTextError;

    fn from_str(text: &str) -> Result<Self, LineTextError> {
        let said: LineText = text.parse()?;
        let serial = match (said.serial.baud, said.serial.format) {
            _ if !said.serial.protocol.is_paced() => SerialSettings::MODBUS_DEFAULT,
            (Some(baud), Some(format)) => SerialSettings::new(baud, format)?,
            _ => return Err(LineTextError::Unsaid),
        };
        said.serial.protocol.check(serial)?;
        said.at(serial)
    }
}

/// As it is read: what differs from the constructors of this type beyond port, speed, format, protocol and far end is not
/// written. A stream of the caller's has speed and format only.
impl fmt::Display for LineConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (baud, format) = (self.serial.baud(), self.serial.format());
        match (&self.endpoint, self.protocol) {
            #[cfg(feature = "serial")]
            (Endpoint::Serial(path), protocol) => {
                write!(f, "{},{baud},{format}", path.display())?;
                if protocol != Protocol::Rtu {
                    write!(f, ",{protocol}")?;
                }
            }
            #[cfg(feature = "tcp")]
            (Endpoint::Tcp(address), Protocol::Tcp) => write!(f, "tcp://{address}")?,
            #[cfg(feature = "tcp")]
            (Endpoint::Tcp(address), _) => write!(f, "rtu+tcp://{address},{baud},{format}")?,
            (Endpoint::Stream, _) => write!(f, "{baud},{format}")?,
        }
        FarEndSettings::of(self).fmt(f)
    }
}

/// `tcp://HOST:PORT`, or else the path of a serial port. What is spoken there, and how fast, says a [`LineConfig`].
///
/// ```
/// use drive_bus::Endpoint;
///
/// assert_eq!("tcp://10.0.0.5:502".parse(), Ok(Endpoint::Tcp("10.0.0.5:502".to_owned())));
/// let port: Endpoint = "/dev/ttyUSB0".parse()?;
/// assert_eq!(port, Endpoint::Serial("/dev/ttyUSB0".into()));
/// assert!("http://10.0.0.5".parse::<Endpoint>().is_err());
/// # Ok::<(), drive_bus::config::LineTextError>(())
/// ```
impl FromStr for Endpoint {
    type Err = LineTextError;

    fn from_str(text: &str) -> Result<Self, LineTextError> {
        if let Some(address) = text.strip_prefix("tcp://") {
            return connection(address);
        }
        // A stream is brought by a program: no text opens one.
        let is_path = !text.is_empty() && !text.contains("://") && text != Self::Stream.to_string();
        if is_path { serial_port(text) } else { Err(LineTextError::Form) }
    }
}

impl FromStr for LineText {
    type Err = LineTextError;

    fn from_str(text: &str) -> Result<Self, LineTextError> {
        let (text, far_end) = FarEndSettings::take(text)?;
        if let Some(address) = text.strip_prefix("tcp://") {
            let (address, settings) = split_settings(address);
            if settings.is_some() {
                return Err(LineTextError::TcpSettings);
            }
            return modbus_tcp(address, far_end);
        }
        let (endpoint, settings) = if let Some(rest) = text.strip_prefix("rtu+tcp://") {
            let (address, settings) = split_settings(rest);
            (connection(address)?, settings)
        } else {
            let (path, settings) = split_settings(&text);
            if path.is_empty() || path.contains("://") {
                return Err(LineTextError::Form);
            }
            (serial_port(path)?, settings)
        };
        let serial: SerialText = settings.map(str::parse).transpose()?.unwrap_or_default();
        if endpoint.is_connection() && serial.protocol != Protocol::Rtu {
            return Err(LineTextError::TcpProtocol);
        }
        Ok(Self { endpoint, serial, far_end })
    }
}

/// It is written `BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]`.
impl FromStr for SerialText {
    type Err = LineTextError;

    fn from_str(text: &str) -> Result<Self, LineTextError> {
        let (baud, rest) = split_settings(text);
        let characters: Option<CharacterText> = rest.map(str::parse).transpose()?;
        let CharacterText { format, protocol } = characters.unwrap_or_default();
        Ok(Self { baud: Some(baud_of(baud)?), format, protocol })
    }
}

/// In a configuration a line is its text.
///
/// ```
/// # #[cfg(feature = "serde")] {
/// use drive_bus::{LineConfig, config::LineText};
///
/// let said: LineText = serde_json::from_str(r#""/dev/ttyUSB0""#)?;
/// assert_eq!(said.serial.baud, None, "it follows from the drives");
/// let line: LineConfig = serde_json::from_str(r#""/dev/ttyUSB0,19200,8E1""#)?;
/// assert_eq!(line.serial.baud(), 19_200);
/// assert!(serde_json::from_str::<LineConfig>(r#""/dev/ttyUSB0""#).is_err(), "at which speed?");
/// # }
/// # Ok::<(), serde_json::Error>(())
/// ```
#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for LineText {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        drive_core::serialize::as_text::deserialize(deserializer)
    }
}

/// The same with speed and format said.
#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for LineConfig {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        drive_core::serialize::as_text::deserialize(deserializer)
    }
}

/// Format and protocol, as `FORMAT[,PROTOCOL[,SETTING=VALUE]...]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CharacterText {
    /// Data bits, parity, stop bits.
    pub format: Option<CharacterFormat>,
    /// What is spoken.
    pub protocol: Protocol,
}

impl FromStr for CharacterText {
    type Err = LineTextError;

    fn from_str(text: &str) -> Result<Self, LineTextError> {
        let (format, protocol) = split_settings(text);
        let protocol = protocol.map(str::parse).transpose()?.unwrap_or_default();
        Ok(Self { format: Some(format.parse()?), protocol })
    }
}

/// A text that is no line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LineTextError {
    /// None of the three forms.
    #[error(
        "expected PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]], rtu+tcp://HOST:PORT[,BAUD[,FORMAT]] or tcp://HOST:PORT"
    )]
    Form,
    /// No host with its port.
    #[error("{0:?} is not HOST:PORT, such as gateway.local:502 or [::1]:502")]
    Address(String),
    /// No number.
    #[error("{0:?} is not a speed: expected such as 9600, 19200 or 38400")]
    Speed(String),
    /// A speed that no line has.
    #[error(transparent)]
    Baud(#[from] BaudError),
    /// No character format.
    #[error(transparent)]
    Format(#[from] CharacterFormatError),
    /// No protocol.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// A protocol that cannot have this format.
    #[error(transparent)]
    ProtocolMismatch(#[from] ProtocolMismatch),
    /// Another protocol behind a serial server.
    #[error("over TCP the serial server speaks Modbus RTU: expected rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]")]
    TcpProtocol,
    /// A speed on Modbus TCP.
    #[error("Modbus TCP has no speed and no format: expected tcp://HOST:PORT")]
    TcpSettings,
    /// What cannot be said of the far end.
    #[error(transparent)]
    FarEndSettings(#[from] FarEndError),
    /// Speed and format of a serial line are missing.
    #[error("say which speed and format the line has, such as 19200,8E1")]
    Unsaid,
    /// A port whose feature is not compiled in.
    #[error("this program was built without {0} (the feature of drive-bus)")]
    NotBuilt(&'static str),
}

/// A speed that a serial line can have.
///
/// # Errors
/// What is no number, or no such speed.
pub fn baud_of(text: &str) -> Result<u32, LineTextError> {
    let baud = text.parse().map_err(|_| LineTextError::Speed(text.to_owned()))?;
    SerialSettings::new(baud, CharacterFormat::F8E1)?;
    Ok(baud)
}

fn split_settings(text: &str) -> (&str, Option<&str>) {
    match text.split_once(',') {
        Some((target, settings)) => (target, Some(settings)),
        None => (text, None),
    }
}

#[cfg(feature = "tcp")]
fn modbus_tcp(address: &str, far_end: FarEndSettings) -> Result<LineText, LineTextError> {
    let serial = SerialText { protocol: Protocol::Tcp, ..SerialText::default() };
    Ok(LineText { endpoint: connection(address)?, serial, far_end })
}

#[cfg(not(feature = "tcp"))]
const fn modbus_tcp(_: &str, _: FarEndSettings) -> Result<LineText, LineTextError> {
    Err(LineTextError::NotBuilt("tcp"))
}

#[cfg(feature = "tcp")]
fn connection(text: &str) -> Result<Endpoint, LineTextError> {
    let well_formed =
        text.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    if well_formed {
        Ok(Endpoint::Tcp(text.to_owned()))
    } else {
        Err(LineTextError::Address(text.to_owned()))
    }
}

#[cfg(not(feature = "tcp"))]
const fn connection(_: &str) -> Result<Endpoint, LineTextError> {
    Err(LineTextError::NotBuilt("tcp"))
}

#[cfg(feature = "serial")]
fn serial_port(path: &str) -> Result<Endpoint, LineTextError> {
    Ok(Endpoint::Serial(path.into()))
}

#[cfg(not(feature = "serial"))]
const fn serial_port(_: &str) -> Result<Endpoint, LineTextError> {
    Err(LineTextError::NotBuilt("serial"))
}
