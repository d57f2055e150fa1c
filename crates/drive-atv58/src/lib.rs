#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod command;
mod diagnostics;
mod drive;
mod intent;
mod proof;
mod reading;
pub mod registers;
mod setpoint;
mod settings;
pub mod words;

use std::time::Duration;

use drive_core::{
    Absent, Capabilities, Class, Direction, ExceptionMeaning, NEGATIVE_REPLY, Port, Quantity, Registers,
    Result, Row, SerialSettings, SlaveAddress, StopMode, WatchdogCapability, serial::CharacterFormat,
};
use drive_drivecom::Proof;

pub use crate::{diagnostics::Counters, registers::ROWS, settings::Atv58Map};
use crate::{proof::Look, reading::Words, registers::W483, words::FaultRegister};

/// The card's message watch over RTU and UNI-TELWAY, fixed as far as its manual says (VVDED397054 p. 24/48).
pub const MESSAGE_WATCH: Duration = Duration::from_secs(10);
/// The card's message watch over ASCII (p. 24/48): for [`Atv58Map::message_watch`] on such a line.
pub const ASCII_MESSAGE_WATCH: Duration = Duration::from_secs(1);

/// The watch as a capability: it can be neither set nor switched off.
const fn watchdog(time: Duration) -> WatchdogCapability {
    WatchdogCapability {
        min: time,
        max: time,
        step: Duration::from_secs(1),
        reactions: &[],
        settable: false,
        wears: false,
    }
}

/// What an Altivar 58 with the card VW3-A58303 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    rows: ROWS,
    // VVDED397054 p. 2 and 26.
    protocols: &["rtu", "ascii", "unitelway"],
    functions: &[0x03, 0x04, 0x06, 0x08, 0x0B, 0x10],
    read_words: 63,
    write_words: 60,
    highest_address: 31,
    // "Do not connect more than 28 stations on a bus" (p. 8).
    stations: 28,
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
    frequency_step: "one count of W401 (0.1 Hz unless set otherwise)",
    fault_reset: "CMD bit 7, rising edge",
    watchdog: Some(watchdog(MESSAGE_WATCH)),
    identification: Some("UNI-TE request 0Fh, on a UNI-TELWAY line"),
    broadcast_stops: &[StopMode::Ramp, StopMode::Fast, StopMode::Freewheel],
    status_words: 9,
    measurement_exchanges: 2,
    quantities: &[
        Quantity::OutputFrequency,
        Quantity::Current,
        Quantity::LineVoltage,
        Quantity::DriveThermal,
        Quantity::MotorThermal,
    ],
    ..Capabilities::least("atv58", "Schneider Altivar 58 with card VW3-A58303")
};

/// An Altivar 58 behind a port. See [`Drive`](drive_core::Drive) for what its methods promise, and [`Atv58Map`] for what they rest on.
#[derive(Debug)]
pub struct Atv58<P> {
    registers: Registers<P>,
    /// The run command of this side and the shaft.
    proof: Proof<Look>,
    /// How many statuses behind each other show no output although operation is enabled.
    idle: u8,
    /// Which way the motor turned at the last status, and when the run command that was given last was written.
    turning: Option<Direction>,
    turned: Option<Direction>,
    /// The registers that this drive lacks.
    absent: Absent,
    map: Atv58Map,
    /// Whether the ramp stop was the last word that was written.
    stops_by_ramp: bool,
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
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, meaning),
            proof: Proof::default(),
            idle: 0,
            turning: None,
            turned: None,
            absent: Absent::default(),
            map,
            stops_by_ramp: false,
        }
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

    /// How long the card waits for a message, which its owner's setting cannot lengthen in Modbus ASCII.
    fn message_watch(&self) -> Duration {
        match self.registers.port().is_ascii() {
            true => self.map.message_watch.min(ASCII_MESSAGE_WATCH),
            false => self.map.message_watch,
        }
    }

    /// Reads the fault register W483, whether the drive has tripped or not.
    ///
    /// # Errors
    /// [`Error::Port`](drive_core::Error::Port) and [`Error::Exception`](drive_core::Error::Exception).
    pub async fn fault_register(&mut self) -> Result<FaultRegister> {
        let words = self.produced(Class::Background, &[], W483.address()).await?;
        Ok(FaultRegister(words.at(Some(W483.address())).unwrap_or_default()))
    }

    /// Reads words that the drive alone writes: those that it has, and one without which nothing is told.
    async fn produced(&mut self, class: Class, addresses: &[u16], needed: u16) -> Result<Words> {
        let input = self.map.input_words;
        let mut calls = self.registers.at(class);
        let mut words = Words::read(&mut self.absent, &mut calls, input, addresses).await?;
        if words.at(Some(needed)).is_none() {
            words.append(&mut calls, input, needed, 1).await?;
        }
        Ok(words)
    }
}

/// The exceptions of p. 22/46, and UNI-TE's negative reply (p. 13/37).
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    match code {
        NEGATIVE_REPLY => ExceptionMeaning::Refused,
        code => ExceptionMeaning::standard(code),
    }
}
