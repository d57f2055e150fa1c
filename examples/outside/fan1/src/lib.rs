//! A made-up fan drive: a family of drives from outside, with its simulated twin.
//!
//! It is written by `.github/A-FAMILY-IN-A-DAY.md` and by the public documentation of the crates that it uses.
//!
//! ```
//! use drive_families::Family;
//!
//! // Once, where the program begins.
//! Family::new(&drive_fan1::FAN1).add()?;
//! assert_eq!("fan1".parse::<Family>().unwrap().capabilities().name, "Example FAN1");
//! # Ok::<(), drive_families::NameTaken>(())
//! ```

#![forbid(unsafe_code)]

mod command;
mod definition;
mod drive;
pub mod machine;
mod reading;
pub mod registers;
mod setpoint;

use drive_core::{
    Capabilities, ExceptionMeaning, FaultEntry, Frequency, Port, Registers, SlaveAddress, Watch,
    serial::CharacterFormat,
};

pub use crate::definition::FAN1;
use crate::registers::ROWS;

/// What a FAN1 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    read_words: 7,
    rows: ROWS,
    reads_across: true,
    formats: &[CharacterFormat::F8E1, CharacterFormat::F8N1],
    fault_reset: "a rising edge of bit 2 of CTL",
    ..Capabilities::least("fan1", "Example FAN1")
};

/// The codes of `FLT` (p. 4).
pub const FAULTS: &[FaultEntry] = &[
    FaultEntry::new(1, "OC", "overcurrent", "look for a short circuit and a blocked fan"),
    FaultEntry::new(2, "OH", "overheating of the drive", "check its ventilation and let it cool"),
    FaultEntry::new(3, "OL", "overload of the motor", "lower the load and let the motor cool"),
];

/// The highest frequency that the reference takes (p. 2).
pub const HIGHEST: Frequency = Frequency::from_hertz(60);

/// A FAN1 behind a port. See [`Drive`](drive_core::Drive) for what its methods promise.
#[derive(Debug)]
pub struct Fan1<P> {
    registers: Registers<P>,
    watch: Watch,
    /// The highest setpoint that its owner allows.
    highest: Frequency,
    /// The reference that a run command of this side rests on: as this side gave it, or found it at the start.
    agreed: Option<u16>,
}

impl<P: Port> Fan1<P> {
    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        let registers = Registers::new(port, slave, &CAPABILITIES, meaning);
        Self { registers, watch: Watch::default(), highest: HIGHEST, agreed: None }
    }

    /// This drive with a fan that its owner allows no more than this; at most [`HIGHEST`] counts.
    #[must_use]
    pub fn with_highest(self, highest: Frequency) -> Self {
        Self { highest: highest.min(HIGHEST), ..self }
    }
}

/// The exceptions of p. 6.
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    match code {
        1 => ExceptionMeaning::NoSuchFunction,
        2 => ExceptionMeaning::NoSuchRegister,
        3 => ExceptionMeaning::ValueRefused,
        _ => ExceptionMeaning::Unknown,
    }
}
