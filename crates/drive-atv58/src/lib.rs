#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod command;
mod diagnostics;
mod map;
pub mod registers;
mod status;
pub mod words;

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Class, Direction, Drive, Error, ExceptionMeaning, Fault, Faults, Frequency,
    Identity, Lifetimes, Measurements, Port, Registers, Result, Row, SerialSettings, Setpoint, SlaveAddress,
    Status, StopMode, Stopped, Watchdog, WatchdogCapability, Written,
    drivecom::{self, Drivecom},
    registers::refuse_commands,
    serial::CharacterFormat,
};
use tokio_modbus::prelude::ReadCode;

pub use crate::{diagnostics::Counters, map::Atv58Map, registers::ROWS};
use crate::{
    registers::{CMD, W401, W402, W463, W483},
    status::Words,
    words::FaultRegister,
};

/// The card's message watch on the bus, fixed as far as its manual says (VVDED397054 p. 24/48).
const MESSAGE_WATCH: Duration = Duration::from_secs(10);

/// What an Altivar 58 with the card VW3-A58303 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    key: "atv58",
    name: "Schneider Altivar 58 with card VW3-A58303",
    functions: &[0x03, 0x04, 0x06, 0x08, 0x0B, 0x10],
    read_words: 63,
    write_words: 60,
    highest_address: 31,
    speeds: &[4_800, 9_600, 19_200],
    formats: &[
        CharacterFormat::F8O1,
        CharacterFormat::F8E1,
        CharacterFormat::F8N1,
        CharacterFormat::F8N2,
        CharacterFormat::F7O1,
        CharacterFormat::F7E1,
        CharacterFormat::F7O2,
        CharacterFormat::F7E2,
    ],
    // The manual prints no factory setting; 8O1 is the one format that all protocols of the card have.
    factory: match SerialSettings::new(19_200, CharacterFormat::F8O1) {
        Ok(settings) => settings,
        Err(_) => SerialSettings::MODBUS_DEFAULT,
    },
    stop_modes: &[StopMode::Ramp, StopMode::Fast, StopMode::Freewheel],
    speed_setpoint: false,
    frequency_step: "one count of W401 (0.1 Hz unless set otherwise)",
    fault_reset: "CMD bit 7, rising edge",
    watchdog: Some(WatchdogCapability {
        min: MESSAGE_WATCH,
        max: MESSAGE_WATCH,
        step: Duration::from_secs(1),
        reactions: &[],
        settable: false,
    }),
    identification: Some("UNI-TE request 0Fh, on a UNI-TELWAY line"),
    release: false,
    persist: None,
    broadcast_stops: &[StopMode::Ramp, StopMode::Fast, StopMode::Freewheel],
    fault_history: 0,
    turnaround: Duration::ZERO,
    status_exchanges: 1,
    measurement_exchanges: 2,
};

/// An Altivar 58 behind a port. See [`Drive`] for what its methods promise, and [`Atv58Map`] for what they rest on.
#[derive(Debug)]
pub struct Atv58<P> {
    registers: Registers<P>,
    map: Atv58Map,
    /// Low and high speed, read when the first setpoint needs them.
    limits: Option<(Frequency, Frequency)>,
}

impl<P: Port> Atv58<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every word of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address, with the unconfirmed defaults of [`Atv58Map`]. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self::with_map(port, slave, Atv58Map::default())
    }

    /// The drive with this address, with the words that its owner has confirmed. Nothing is sent.
    #[must_use]
    pub fn with_map(port: P, slave: SlaveAddress, map: Atv58Map) -> Self {
        Self { registers: Registers::new(port, slave, &CAPABILITIES, meaning), map, limits: None }
    }

    /// Which words the driver uses where the manual is silent.
    #[must_use]
    pub const fn map(&self) -> &Atv58Map {
        &self.map
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }

    /// Reads the fault register W483, whether the drive has tripped or not.
    ///
    /// # Errors
    /// [`Error::Port`] and [`Error::Exception`].
    pub async fn fault_register(&mut self) -> Result<FaultRegister> {
        let words = self.produced(Class::Background, W483.address()).await?;
        Ok(FaultRegister(words.at(Some(W483.address())).unwrap_or_default()))
    }

    /// Reads a word that the drive alone writes.
    async fn produced(&mut self, class: Class, address: u16) -> Result<Words> {
        Words::read(&mut self.registers.at(class), self.map.input_words, &[address]).await
    }
}

/// The exceptions of p. 22/46.
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    ExceptionMeaning::standard(code)
}

#[async_trait]
impl<P: Port> Drive for Atv58<P> {
    fn slave(&self) -> SlaveAddress {
        self.registers.slave()
    }

    fn capabilities(&self) -> &'static Capabilities {
        &CAPABILITIES
    }

    fn rows(&self) -> &'static [Row] {
        ROWS
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        &mut self.registers.lifetimes
    }

    fn forget(&mut self) {
        self.limits = None;
    }

    /// One exchange with the default map, and a second one for W483 when the drive has tripped. Of several fault bits
    /// [`Status::fault_code`] is the lowest; [`faults`](Drive::faults) has all.
    async fn status(&mut self) -> Result<Status> {
        self.read_status(Class::Status).await
    }

    /// Two exchanges with the default map: the mapped words, and W463 to W466, whose content is not known.
    async fn measurements(&mut self) -> Result<Measurements> {
        let map = self.map;
        let mapped = [map.reference, map.line_voltage, map.motor_thermal, map.drive_thermal];
        let addresses: Vec<u16> = mapped.into_iter().flatten().collect();
        let mut calls = self.registers.at(Class::Background);
        let mut words = Words::read(&mut calls, map.input_words, &addresses).await?;
        words.append(&mut calls, map.input_words, W463.address(), 4).await?;
        Ok(words.measurements(&map))
    }

    /// The bits of W483 while the drive is tripped, each as its number: their meanings are not public. The family has
    /// no history and names no alarm.
    async fn faults(&mut self) -> Result<Faults> {
        let words = self.produced(Class::Background, self.map.status).await?;
        if !words.is_tripped(&self.map) {
            return Ok(Faults::default());
        }
        let register = self.fault_register().await?;
        let present = register.bits().map(|code| Fault { code, entry: None }).collect();
        Ok(Faults { present, ..Faults::default() })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.start_motor(direction).await
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await.map(|status| Stopped::by(mode, status))
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        drivecom::reset_fault(self).await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.produced(Class::KeepAlive, self.map.status).await.map(drop)
    }

    /// What the card says of itself on a UNI-TELWAY line: its rating and the version of its software (request 0Fh,
    /// p. 11/35). A line asks for it as it asks for a device identification.
    ///
    /// # Errors
    /// [`Error::Unsupported`] over Modbus, for which the manual names nothing of the kind and the card answers exception
    /// 01 (p. 22/46).
    async fn identify(&mut self) -> Result<Identity> {
        match self.registers.at(Class::Background).identification(ReadCode::Basic).await {
            Err(Error::Exception { code: 0x01, .. }) => Err(Error::Unsupported {
                what: "identification",
                reason: "the card says what it is over UNI-TELWAY only",
            }),
            result => result,
        }
    }

    /// What the card's manual prints, without an exchange: the time can neither be read nor set, and what the drive does
    /// when it runs out is not said.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        Ok(Watchdog { timeout: Some(self.map.message_watch), reaction: None })
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &[CMD.address(), W401.address()])?;
        if row.address == W402.address() {
            return Err(Error::Unsupported {
                what: "writing W402 as a parameter",
                reason: "it is suspected to be CMI, whose bits recall factory settings and write the EEPROM",
            });
        }
        // The limits that were read once may change with it.
        self.limits = None;
        self.registers.at(Class::Background).change_row(row, word).await
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        self.stop_word(mode).map(|value| BroadcastWrite { function: 0x06, register: CMD.address(), value })
    }
}
