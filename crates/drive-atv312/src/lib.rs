#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod channels;
mod command;
mod diagnosis;
mod drive;
mod facts;
mod faults;
mod intent;
mod parameters;
mod proof;
mod ramp;
mod reading;
mod reference;
pub mod registers;
mod restoring;
mod setpoint;
mod settings;
pub mod words;

use drive_core::{
    Capabilities, Control, ExceptionMeaning, Port, Quantity, Registers, Row, SlaveAddress, StatusBit,
    StopMode,
    registers::{Register, access::WriteStopped},
    serial::CharacterFormat,
};
use drive_drivecom::Proof;

use crate::{facts::Facts, proof::Look, settings::Known};
pub use crate::{
    faults::{FAULTS, PastFault, WARNINGS},
    registers::ROWS,
};

/// What an Altivar 312 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    functions: &[0x03, 0x06, 0x10, 0x2B],
    read_words: 29,
    rows: ROWS,
    reads_across: true,
    scaled: restoring::SCALED,
    restoring: restoring::RESTORING,
    write_words: 27,
    speeds: &[4_800, 9_600, 19_200],
    formats: &[CharacterFormat::F8O1, CharacterFormat::F8E1, CharacterFormat::F8N1, CharacterFormat::F8N2],
    stop_modes: &StopMode::ALL,
    speed_setpoint: true,
    frequency_step: "0.1 Hz (with CMI bit 9: 600/32767 Hz)",
    fault_reset: "CMD bit 7, rising edge",
    watchdog: Some(parameters::WATCHDOG),
    // SLF.
    communication_fault: Some(5),
    stop_key: Some(StatusBit { address: 3201, mask: 1 << 14, source: "BBV51701 p. 21" }),
    identification: Some("function 43/14, and NCV, VCAL, INV, UdP, TSP"),
    release: true,
    persist: Some("CMI bit 1"),
    broadcast_stops: &[StopMode::Fast, StopMode::Freewheel],
    fault_history: 4,
    status_words: 6,
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
    ..Capabilities::least("atv312", "Schneider Altivar 312")
};

/// An Altivar 312 behind a port. See [`Drive`](drive_core::Drive) for what its methods promise, and the crate's page for what is special
/// about this family.
#[derive(Debug)]
pub struct Atv312<P> {
    registers: Registers<P>,
    /// The run command of this side and the shaft.
    proof: Proof<Look>,
    /// What was found of the reference behind the present words.
    facts: Facts,
    known: Known,
    /// The bits 11 to 15 of the control word as they were last known: one of them may say who commands.
    high_bits: u16,
    /// Who commanded when it was last read.
    control: Option<Control>,
    /// By what the bus brought the motor down in the last status: direct current, or a ramp.
    brought_down: Option<StopMode>,
    /// What the bus control set-up has changed, with what it was before, in the order of the changes.
    set_up_before: Vec<(Register<WriteStopped>, u16)>,
    /// Whether the automatic restart is accepted.
    accepts_restart: bool,
    /// In which counts the setpoint that stands was given, or was seen last.
    counted: Option<reading::Resolution>,
    /// The count of the reference was changed since the setpoint was given.
    recounted: bool,
    /// Whether a parameter was changed since the last save.
    unsaved: bool,
    saves: u32,
}

impl<P: Port> Atv312<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every register of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, exception_meaning),
            proof: Proof::default(),
            facts: Facts::default(),
            known: Known::default(),
            high_bits: 0,
            control: None,
            brought_down: None,
            set_up_before: Vec::new(),
            accepts_restart: false,
            counted: None,
            recounted: false,
            unsaved: false,
            saves: 0,
        }
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }
}

/// What an exception means (BBV52816 p. 15; for function 43, p. 14). Which code answers a parameter that is refused while
/// the motor runs is not printed.
#[must_use]
pub const fn exception_meaning(function: u8, code: u8) -> ExceptionMeaning {
    match (function, code) {
        // Only 1 and 2 are printed for it.
        (0x2B, 3..) => ExceptionMeaning::Unknown,
        _ => ExceptionMeaning::standard(code),
    }
}
