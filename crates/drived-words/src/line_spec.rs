//! What `--line` says: `PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]]`, `rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]` or `tcp://HOST:PORT`,
//! and the settings that the drives on it share.

mod far_end;

use std::{fmt, str::FromStr, time::Duration};

use drive_bus::{
    Endpoint, LineConfig, Protocol, SlaveSettings,
    protocol::{ProtocolError, ProtocolMismatch},
};
use drive_core::{
    WatchdogCapability,
    serial::{BaudError, CharacterFormat, CharacterFormatError, SerialSettings},
};
use drive_families::Options;

use self::far_end::FarEndError;
pub use self::far_end::{FarEndSpec, MOST_CONNECTIONS, proposal};
use crate::drive_spec::DriveName;

/// What a line is, for the help of `--line`.
pub const HELP: &str = "The line: PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]], rtu+tcp://HOST:PORT[,BAUD[,FORMAT]] or tcp://HOST:PORT; \
     PROTOCOL is rtu, ascii or unitelway, such as unitelway,header=simplified,link-timeout=200ms; behind each may stand gateway=none, \
     or gateway=3x1s for a gateway that asks a dead drive three times for a second, connections=2 for a far end that grants a stop a second connection (1 where \
     it must not have one), and far-end-paces=no for an adapter or a program \
     that is faster than the line's speed";

/// The same for a port that is only listened to.
pub const TO_LISTEN_TO: &str = "A port to listen to: PATH[,BAUD[,FORMAT[,PROTOCOL]]] such as /dev/ttyUSB0,19200,8E1, or rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]";

/// A line as a person names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSpec {
    target: Target,
    serial: SerialSpec,
    far_end: FarEndSpec,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Target {
    Serial(String),
    RtuOverTcp(String),
    ModbusTcp(String),
}

/// Speed and format as far as they were said; the rest is the drives' factory setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SerialSpec {
    pub baud: Option<u32>,
    pub format: Option<CharacterFormat>,
    pub protocol: Protocol,
}

/// The communication watchdog of a drive on a line with this protocol, asked of the driver itself.
pub fn watchdog(name: DriveName, options: &Options, protocol: Protocol) -> Option<WatchdogCapability> {
    name.family.watchdog(matches!(protocol, Protocol::Ascii(_)), options)
}

impl LineSpec {
    /// What is spoken on it.
    pub const fn protocol(&self) -> Protocol {
        self.serial.protocol
    }

    /// The serial port whatever is said of its speed and format, and whether something is; `None` over TCP.
    pub fn port(&self) -> Option<(LineConfig, bool)> {
        let Target::Serial(path) = &self.target else { return None };
        let config = LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT);
        Some((self.far_end.on(config).ok()?, self.serial.baud.is_some()))
    }

    /// The configuration of this line for these drives, checked against what each family can be set to.
    pub fn config(&self, drives: &[DriveName]) -> Result<LineConfig, LineSpecError> {
        let config = match &self.target {
            Target::Serial(path) => {
                let config = LineConfig::serial(path, self.serial.settings(drives)?);
                LineConfig { protocol: self.serial.protocol, ..config }
            }
            Target::RtuOverTcp(address) => {
                LineConfig::rtu_over_tcp(address.as_str(), self.serial.settings(drives)?)
            }
            Target::ModbusTcp(address) => LineConfig::modbus_tcp(address.as_str()),
        };
        Ok(with_turnarounds(self.far_end.on(config)?, drives))
    }

    /// The same line, with what a file says of its far end.
    pub fn with_far_end(&self, said: FarEndSpec) -> Self {
        Self { far_end: said.or(self.far_end), ..self.clone() }
    }
}

/// The same line at another speed, and why it cannot be set so where it cannot; `None` for one without a speed.
pub fn at(
    config: &LineConfig,
    drives: &[DriveName],
    baud: u32,
) -> Option<(LineConfig, Option<LineSpecError>)> {
    if !config.protocol.is_paced() {
        return None;
    }
    let serial = SerialSettings::new(baud, config.serial.format()).ok()?;
    let config = LineConfig { serial, ..config.clone() };
    let forbidden = check(&config, drives).err();
    Some((config, forbidden))
}

/// What a line is, for a person.
pub fn describe(config: &LineConfig) -> String {
    match &config.endpoint {
        Endpoint::Serial(path) => format!("{}, {} {}", path.display(), config.serial, config.protocol),
        Endpoint::Tcp(address) if config.protocol.is_paced() => {
            format!("rtu+tcp://{address}, {}", config.serial)
        }
        Endpoint::Tcp(address) => format!("tcp://{address}"),
        _ => config.serial.to_string(),
    }
}

/// Where a line goes, without its settings.
pub fn port(config: &LineConfig) -> String {
    match &config.endpoint {
        Endpoint::Serial(path) => path.display().to_string(),
        Endpoint::Tcp(address) => address.clone(),
        _ => String::new(),
    }
}

/// A line as `--line` takes it.
pub fn written(config: &LineConfig) -> String {
    let (baud, format) = (config.serial.baud(), config.serial.format());
    let port = match (&config.endpoint, config.protocol) {
        (Endpoint::Serial(path), Protocol::Rtu) => format!("{},{baud},{format}", path.display()),
        (Endpoint::Serial(path), protocol) => format!("{},{baud},{format},{protocol}", path.display()),
        (Endpoint::Tcp(address), Protocol::Tcp) => format!("tcp://{address}"),
        (Endpoint::Tcp(address), _) => format!("rtu+tcp://{address},{baud},{format}"),
        _ => format!("{baud},{format}"),
    };
    port + &FarEndSpec::of(config).written()
}

/// The silence that the line's protocol needs before each request, and how it is called; `None` where it needs none.
pub fn needed_silence(config: &LineConfig) -> Option<(Duration, String)> {
    let silence = config.silence();
    let name = match config.protocol {
        _ if silence.is_zero() => return None,
        Protocol::Ascii(_) => "a character in ASCII is".to_owned(),
        Protocol::UniTelway(settings) => format!("UNI-TELWAY's {} bits are", settings.silence_bits),
        _ => "t3.5 is".to_owned(),
    };
    Some((silence, name))
}

/// The configuration with the pause that each drive needs after its answers.
pub fn with_turnarounds(config: LineConfig, drives: &[DriveName]) -> LineConfig {
    drives.iter().fold(config, |config, name| {
        let turnaround = name.family.capabilities().turnaround;
        config.slave(name.slave.number(), SlaveSettings { turnaround, ..SlaveSettings::default() })
    })
}

impl SerialSpec {
    /// Speed and format for these drives: what was said, else what all of them have from the factory, if every drive
    /// can be set to it.
    pub fn settings(self, drives: &[DriveName]) -> Result<SerialSettings, LineSpecError> {
        let factory = |name: &DriveName| name.family.capabilities().factory;
        let baud = match self.baud {
            Some(baud) => baud,
            None => agreed(drives, |name| factory(name).baud())?,
        };
        let format = match self.format {
            Some(format) => format,
            None => agreed(drives, |name| factory(name).format())?,
        };
        let settings = SerialSettings::new(baud, format)?;
        check_serial(settings, self.protocol, drives)?;
        Ok(settings)
    }
}

/// Whether every drive can live on a line; Modbus TCP has nothing that could not be.
pub fn check(config: &LineConfig, drives: &[DriveName]) -> Result<(), LineSpecError> {
    if !config.protocol.is_paced() {
        return Ok(());
    }
    check_serial(config.serial, config.protocol, drives)
}

/// Whether every drive can be set to this.
fn check_serial(
    settings: SerialSettings,
    protocol: Protocol,
    drives: &[DriveName],
) -> Result<(), LineSpecError> {
    for name in drives {
        let spoken = name.family.capabilities().protocols;
        if !spoken.contains(&protocol.name()) {
            let problem = format!("it speaks {} and not {}", spoken.join(", "), protocol.name());
            return Err(LineSpecError::Drive(*name, problem));
        }
        let checked = name.family.capabilities().check_line(name.slave, settings);
        checked.map_err(|mismatch| LineSpecError::Drive(*name, mismatch.to_string()))?;
    }
    protocol.check(settings)?;
    Ok(())
}

/// The value that all drives have from the factory.
fn agreed<T: PartialEq + fmt::Display>(
    drives: &[DriveName],
    of: impl Fn(&DriveName) -> T,
) -> Result<T, LineSpecError> {
    let (first, rest) = drives.split_first().ok_or(LineSpecError::NoDrive)?;
    match rest.iter().find(|name| of(name) != of(first)) {
        Some(other) => Err(LineSpecError::FactorySettings(format!(
            "{first} has {} from the factory and {other} has {}",
            of(first),
            of(other)
        ))),
        None => Ok(of(first)),
    }
}

/// A text that is no line, or a line that the drives cannot share.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LineSpecError {
    #[error(
        "expected PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]], rtu+tcp://HOST:PORT[,BAUD[,FORMAT]] or tcp://HOST:PORT"
    )]
    Form,
    #[error("{0:?} is not HOST:PORT, such as gateway.local:502 or [::1]:502")]
    Address(String),
    #[error("{0:?} is not a speed: expected such as 9600, 19200 or 38400")]
    Speed(String),
    #[error(transparent)]
    Baud(#[from] BaudError),
    #[error(transparent)]
    Format(#[from] CharacterFormatError),
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    #[error(transparent)]
    ProtocolMismatch(#[from] ProtocolMismatch),
    #[error("over TCP the serial server speaks Modbus RTU: expected rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]")]
    TcpProtocol,
    #[error("Modbus TCP has no speed and no format: expected tcp://HOST:PORT")]
    TcpSettings,
    #[error(transparent)]
    FarEnd(#[from] FarEndError),
    #[error("say which speed and format the line has, such as 19200,8E1")]
    NoDrive,
    #[error("{0}: say which speed and format the line has, such as 19200,8E1")]
    FactorySettings(String),
    #[error("{0}: {1}")]
    Drive(DriveName, String),
}

impl FromStr for LineSpec {
    type Err = LineSpecError;

    fn from_str(text: &str) -> Result<Self, LineSpecError> {
        let (text, far_end) = FarEndSpec::take(text)?;
        if let Some(address) = text.strip_prefix("tcp://") {
            let (address, settings) = split_settings(address);
            if settings.is_some() {
                return Err(LineSpecError::TcpSettings);
            }
            let target = Target::ModbusTcp(host_and_port(address)?);
            return Ok(Self { target, serial: SerialSpec::default(), far_end });
        }
        let (target, settings) = if let Some(rest) = text.strip_prefix("rtu+tcp://") {
            let (address, settings) = split_settings(rest);
            (Target::RtuOverTcp(host_and_port(address)?), settings)
        } else {
            let (path, settings) = split_settings(&text);
            if path.is_empty() || path.contains("://") {
                return Err(LineSpecError::Form);
            }
            (Target::Serial(path.to_owned()), settings)
        };
        let serial: SerialSpec = settings.map(str::parse).transpose()?.unwrap_or_default();
        if matches!(target, Target::RtuOverTcp(_)) && serial.protocol != Protocol::Rtu {
            return Err(LineSpecError::TcpProtocol);
        }
        Ok(Self { target, serial, far_end })
    }
}

/// It is written `BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]`.
impl FromStr for SerialSpec {
    type Err = LineSpecError;

    fn from_str(text: &str) -> Result<Self, LineSpecError> {
        let (baud, rest) = split_settings(text);
        let characters: Option<CharacterSpec> = rest.map(str::parse).transpose()?;
        let CharacterSpec { format, protocol } = characters.unwrap_or_default();
        Ok(Self { baud: Some(speed(baud)?), format, protocol })
    }
}

/// Format and protocol, as `FORMAT[,PROTOCOL[,SETTING=VALUE]...]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CharacterSpec {
    pub format: Option<CharacterFormat>,
    pub protocol: Protocol,
}

impl FromStr for CharacterSpec {
    type Err = LineSpecError;

    fn from_str(text: &str) -> Result<Self, LineSpecError> {
        let (format, protocol) = split_settings(text);
        let protocol = protocol.map(str::parse).transpose()?.unwrap_or_default();
        Ok(Self { format: Some(format.parse()?), protocol })
    }
}

/// A speed that a serial line can have.
pub fn speed(text: &str) -> Result<u32, LineSpecError> {
    let baud = text.parse().map_err(|_| LineSpecError::Speed(text.to_owned()))?;
    SerialSettings::new(baud, CharacterFormat::F8E1)?;
    Ok(baud)
}

fn split_settings(text: &str) -> (&str, Option<&str>) {
    match text.split_once(',') {
        Some((target, settings)) => (target, Some(settings)),
        None => (text, None),
    }
}

fn host_and_port(text: &str) -> Result<String, LineSpecError> {
    let well_formed =
        text.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    if well_formed { Ok(text.to_owned()) } else { Err(LineSpecError::Address(text.to_owned())) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive_spec::{self, DriveSpec};

    fn drives(texts: &[&str]) -> Vec<DriveName> {
        let specs: Vec<DriveSpec> = texts.iter().map(|text| text.parse().unwrap()).collect();
        drive_spec::on_one_line(&specs).unwrap()
    }

    fn config(line: &str, texts: &[&str]) -> Result<LineConfig, LineSpecError> {
        line.parse::<LineSpec>()?.config(&drives(texts))
    }

    #[test]
    fn a_path_alone_has_the_factory_setting_of_its_drives() {
        let config = config("/dev/ttyUSB0", &["atv312@1"]).unwrap();
        assert_eq!(config.endpoint, Endpoint::Serial("/dev/ttyUSB0".into()));
        assert_eq!(config.serial.to_string(), "19200 8E1");
    }

    #[test]
    fn speed_and_format_stand_behind_the_path() {
        assert_eq!(config("COM3,9600", &["atv312@1"]).unwrap().serial.to_string(), "9600 8E1");
        assert_eq!(config("COM3,9600,8N1", &["atv312@1"]).unwrap().serial.to_string(), "9600 8N1");
        let far = config("rtu+tcp://plant:4001,9600,8N1", &["atv312@1"]).unwrap();
        assert_eq!(far.endpoint, Endpoint::Tcp("plant:4001".into()));
        assert_eq!(far.protocol, Protocol::Rtu);
        assert_eq!(far.serial.to_string(), "9600 8N1");
        let gateway = config("tcp://plant:502", &["atv312@1"]).unwrap();
        assert_eq!(gateway.endpoint, Endpoint::Tcp("plant:502".into()));
        assert_eq!(gateway.protocol, Protocol::Tcp);
    }

    #[test]
    fn a_line_is_written_as_it_was_read() {
        for line in [
            "COM3,9600,8N1",
            "COM3,9600,7E1,ascii",
            "COM3,19200,8O1,unitelway",
            "COM3,19200,8O1,unitelway,header=simplified,link-timeout=200ms",
            "rtu+tcp://plant:4001,9600,8N1",
            "tcp://plant:502",
            "tcp://plant:502,gateway=none",
            "tcp://plant:502,gateway=3s/4",
            "rtu+tcp://plant:4001,19200,8E1,gateway=3s,connections=2",
            "rtu+tcp://plant:4001,9600,8N1,gateway=unknown,far-end-paces=yes",
            "COM3,9600,8N1,far-end-paces=no",
            "COM3,19200,8O1,unitelway,header=simplified,link-timeout=200ms,far-end-paces=no",
        ] {
            assert_eq!(written(&config(line, &["atv58@1"]).unwrap()), line);
        }
    }

    #[test]
    fn what_is_said_of_the_far_end_stands_anywhere_behind_the_port() {
        let line = config("/dev/ttyUSB0,far-end-paces=no", &["atv312@1"]).unwrap();
        assert_eq!((line.far_end_paces, line.serial.to_string().as_str()), (Some(false), "19200 8E1"));
        let none = config("tcp://plant:502,gateway=none", &["atv312@1"]).unwrap();
        assert_eq!(none.far_end(), None);
        let error = config("COM3,9600,8N1,connections=2", &["atv312@1"]).unwrap_err().to_string();
        assert!(error.contains("a serial port has no connections"), "{error}");
        let error = config("tcp://plant:502,far-end-paces=no", &["atv312@1"]).unwrap_err().to_string();
        assert!(error.contains("Modbus TCP has no speed"), "{error}");
    }

    #[test]
    fn the_protocol_stands_behind_the_format_for_the_drives_that_speak_it() {
        let spoken = |line| config(line, &["atv58@1"]).map(|config| config.protocol.to_string());
        assert_eq!(spoken("COM3,9600,8E1").unwrap(), "rtu");
        assert_eq!(spoken("COM3,9600,7E1,ascii").unwrap(), "ascii");
        assert_eq!(spoken("COM3,19200,8O1,unitelway").unwrap(), "unitelway");
        let error = config("COM3,9600,8E1,ascii", &["atv312@1"]).unwrap_err().to_string();
        assert_eq!(error, "atv312@1: it speaks rtu and not ascii");
        assert!(spoken("COM3,9600,7E1").unwrap_err().to_string().contains("8 data bits"));
        assert!(spoken("COM3,9600,8E1,unitelway").unwrap_err().to_string().contains("8O1"));
        assert!("rtu+tcp://plant:4001,9600,7E1,ascii".parse::<LineSpec>().is_err());
    }

    #[test]
    fn the_silence_that_a_line_needs_is_called_by_its_protocol() {
        let needed = |line| needed_silence(&config(line, &["atv58@1"]).unwrap());
        let is = |nanos, name: &str| Some((Duration::from_nanos(nanos), name.to_owned()));
        // 3.5 characters of 11 bits; one of 10; 10 bits.
        assert_eq!(needed("COM3,19200,8E1"), is(2_005_209, "t3.5 is"));
        assert_eq!(needed("COM3,9600,7E1,ascii"), is(1_041_667, "a character in ASCII is"));
        assert_eq!(needed("COM3,9600,8O1,unitelway"), is(1_041_667, "UNI-TELWAY's 10 bits are"));
        assert_eq!(needed("tcp://plant:502"), None);
    }

    #[test]
    fn what_is_no_line_is_refused_with_the_reason() {
        for (line, reason) in [
            ("", "expected PATH"),
            (",9600", "expected PATH"),
            ("udp://plant:502", "expected PATH"),
            ("/dev/ttyUSB0,", "is not a speed"),
            ("/dev/ttyUSB0,fast", "is not a speed"),
            ("/dev/ttyUSB0,0", "0 bit/s is not a serial speed"),
            ("/dev/ttyUSB0,19200,8X1", "is not a character format"),
            ("COM3,19200,8O1,unitelway,header=short", "expected simplified, standard"),
            ("COM3,19200,8O1,unitelway,timeout=1s", "expected NAME=VALUE with one of header, category"),
            ("tcp://plant", "is not HOST:PORT"),
            ("tcp://:502", "is not HOST:PORT"),
            ("tcp://plant:99999", "is not HOST:PORT"),
            ("tcp://plant:502,9600", "Modbus TCP has no speed"),
            ("tcp://plant:502,gateway=often", "\"often\": expected none, unknown, or how long"),
            ("tcp://plant:502,gateway=none,gateway=1s", "gateway is said twice"),
            ("tcp://plant:502,connections=3", "expected 1, or 2"),
            ("tcp://plant:502,connections=1,connections=1", "connections is said twice"),
            ("COM3,9600,8N1,far-end-paces=maybe", "expected yes or no"),
        ] {
            let error = line.parse::<LineSpec>().unwrap_err().to_string();
            assert!(error.contains(reason), "{line}: {error}");
        }
    }

    #[test]
    fn a_line_that_a_drive_cannot_have_is_refused_with_its_name() {
        let error = config("/dev/ttyUSB0,12345,8E1", &["atv312@1"]).unwrap_err().to_string();
        assert!(error.starts_with("atv312@1: 12345 bit/s"), "{error}");
        let error = config("/dev/ttyUSB0,19200,8E1", &["atv312@1", "atv28@2"]).unwrap_err().to_string();
        assert!(error.starts_with("atv28@2: format 8E1"), "{error}");
    }

    #[test]
    fn drives_with_two_factory_settings_need_to_be_told_which_the_line_has() {
        let error = config("/dev/ttyUSB0", &["atv312@1", "atv28@2"]).unwrap_err().to_string();
        assert!(error.contains("say which speed and format"), "{error}");
        assert!(config("/dev/ttyUSB0,19200,8N1", &["atv312@1", "atv28@2"]).is_ok());
    }
}
