#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod command;
mod drive;
mod faults;
mod intent;
mod lists;
mod parameters;
mod proof;
mod reading;
pub mod registers;
mod restoring;
mod setpoint;
pub mod words;

use drive_core::{
    Absent, Capabilities, Control, ExceptionMeaning, Identity, Port, Quantity, Registers, Row,
    SerialSettings, SlaveAddress, Speed, StatusBit, StopMode, serial::CharacterFormat,
};
use drive_drivecom::Proof;

use crate::proof::Look;
pub use crate::{faults::FAULTS, faults::WARNINGS, registers::ROWS};

/// What an Altivar 28 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    functions: &[0x03, 0x06, 0x10],
    read_words: 7,
    rows: ROWS,
    reads_across: true,
    restoring: restoring::RESTORING,
    write_words: 7,
    highest_address: 31,
    stations: 18,
    formats: &[CharacterFormat::F8N1],
    factory: match SerialSettings::new(19_200, CharacterFormat::F8N1) {
        Ok(settings) => settings,
        Err(_) => SerialSettings::MODBUS_DEFAULT,
    },
    stop_modes: &StopMode::ALL,
    speed_setpoint: true,
    fault_reset: "CMD bit 7, rising edge",
    // SLF.
    communication_fault: Some(5),
    // Its manual prints no bits of ETA: those of the Altivar 312, of which it shows the same chart.
    stop_key: Some(StatusBit { address: 458, mask: 1 << 14, source: "BBV51701 p. 21" }),
    identification: Some("nominal current INV (W555)"),
    broadcast_stops: &[StopMode::Fast, StopMode::Freewheel],
    fault_history: 4,
    status_exchanges: 2,
    status_words: 11,
    stop_exchanges: 5,
    measurement_exchanges: 6,
    quantities: &[
        Quantity::OutputFrequency,
        Quantity::Current,
        Quantity::Speed,
        Quantity::LineVoltage,
        Quantity::Torque,
        Quantity::DriveThermal,
        Quantity::MotorThermal,
        Quantity::RunningTime,
    ],
    ..Capabilities::least("atv28", "Schneider Altivar 28")
};

/// An Altivar 28 behind a port. See [`Drive`](drive_core::Drive) for what its methods promise.
#[derive(Debug)]
pub struct Atv28<P> {
    registers: Registers<P>,
    /// The run command of this side and the shaft.
    proof: Proof<Look>,
    /// The registers that this drive lacks.
    absent: Absent,
    /// The limits of a setpoint in rpm.
    speeds: Option<(Speed, Speed)>,
    /// Who commanded when it was last read.
    control: Option<Control>,
    /// What it has said of itself.
    said: Option<Identity>,
}

impl<P: Port> Atv28<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every register of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, meaning),
            proof: Proof::default(),
            absent: Absent::default(),
            speeds: None,
            said: None,
            control: None,
        }
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }
}

/// The exceptions of the manual's last section.
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    ExceptionMeaning::standard(code)
}
