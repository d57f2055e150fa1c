//! What `--line` says: `PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]]`, `rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]` or `tcp://HOST:PORT`,
//! and the settings that the drives on it share.

mod meant;
mod proposal;

use std::{fmt, str::FromStr, time::Duration};

use drive_bus::{
    Endpoint, LineConfig, Protocol, SlaveSettings,
    config::{FarEndError, FarEndSettings, LineText, LineTextError, SerialText},
    protocol::ProtocolMismatch,
};
use drive_core::{
    WatchdogCapability,
    serial::{BaudError, SerialSettings},
};
use drive_families::Options;

use self::meant::meant;
pub use self::proposal::proposal;
use crate::drive_spec::DriveName;

/// What a line is, for the help of `--line`.
pub const HELP: &str = "The line: PATH[,BAUD[,FORMAT[,PROTOCOL[,SETTING=VALUE]...]]], rtu+tcp://HOST:PORT[,BAUD[,FORMAT]] or tcp://HOST:PORT; \
     PROTOCOL is rtu, ascii or unitelway, such as unitelway,header=simplified,link-timeout=200ms; behind each may stand gateway=none, \
     or gateway=3x1s for a gateway that asks a dead drive three times for a second, connections=2 for a far end that grants a stop a second connection (1 where \
     it must not have one), and far-end-paces=no for an adapter or a program \
     that is faster than the line's speed";

/// The same for a port that is only listened to.
pub const TO_LISTEN_TO: &str = "A port to listen to: PATH[,BAUD[,FORMAT[,PROTOCOL]]] such as /dev/ttyUSB0,19200,8E1, or rtu+tcp://HOST:PORT[,BAUD[,FORMAT]]";

/// A line as a person names it; speed and format are the drives' factory setting where they are not said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSpec(LineText);

/// The communication watchdog of a drive on a line with this protocol, asked of the driver itself.
pub fn watchdog(name: DriveName, options: &Options, protocol: Protocol) -> Option<WatchdogCapability> {
    name.family.watchdog(matches!(protocol, Protocol::Ascii(_)), options)
}

impl LineSpec {
    /// What is spoken on it.
    pub const fn protocol(&self) -> Protocol {
        self.0.serial.protocol
    }

    /// The serial port whatever is said of its speed and format, and whether something is; `None` over TCP.
    pub fn port(&self) -> Option<(LineConfig, bool)> {
        let Endpoint::Serial(path) = &self.0.endpoint else { return None };
        let config = LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT);
        Some((self.0.far_end.on(config).ok()?, self.0.serial.baud.is_some()))
    }

    /// The configuration of this line for these drives, checked against what each family can be set to.
    pub fn config(&self, drives: &[DriveName]) -> Result<LineConfig, LineSpecError> {
        let serial = match self.0.serial.protocol.is_paced() {
            true => settings(self.0.serial, drives)?,
            false => SerialSettings::MODBUS_DEFAULT,
        };
        Ok(with_turnarounds(self.0.at(serial)?, drives))
    }

    /// The same line, with what a file says of its far end.
    pub fn with_far_end(&self, said: FarEndSettings) -> Self {
        Self(self.0.with_far_end(said))
    }
}

impl FromStr for LineSpec {
    type Err = LineSpecError;

    fn from_str(text: &str) -> Result<Self, LineSpecError> {
        let text = meant(text);
        text.parse().map(Self).map_err(|error| match meant::format(&text) {
            Some(format) => LineSpecError::Meant(error, format),
            None => LineSpecError::Text(error),
        })
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

/// Speed and format for these drives: what was said, else what all of them have from the factory, if every drive can be
/// set to it.
pub fn settings(said: SerialText, drives: &[DriveName]) -> Result<SerialSettings, LineSpecError> {
    let factory = |name: &DriveName| name.family.capabilities().factory;
    let baud = match said.baud {
        Some(baud) => baud,
        None => agreed(drives, |name| factory(name).baud())?,
    };
    let format = match said.format {
        Some(format) => format,
        None => agreed(drives, |name| factory(name).format())?,
    };
    let settings = SerialSettings::new(baud, format)?;
    check_serial(settings, said.protocol, drives)?;
    Ok(settings)
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
    #[error(transparent)]
    Text(#[from] LineTextError),
    #[error("{0}: did you mean {1}?")]
    Meant(LineTextError, String),
    #[error(transparent)]
    FarEnd(#[from] FarEndError),
    #[error(transparent)]
    Baud(#[from] BaudError),
    #[error(transparent)]
    ProtocolMismatch(#[from] ProtocolMismatch),
    #[error("say which speed and format the line has, such as 19200,8E1")]
    NoDrive,
    #[error("{0}: say which speed and format the line has, such as 19200,8E1")]
    FactorySettings(String),
    #[error("{0}: {1}")]
    Drive(DriveName, String),
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
            assert_eq!(config(line, &["atv58@1"]).unwrap().to_string(), line);
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
