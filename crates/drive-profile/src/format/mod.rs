//! The format of a profile: what its file holds, as it is read and before it is checked.
//!
//! It is data alone: no expressions, no loops, no conditions but the drive's own states. A key that is not named here is refused, and
//! so is a question that is left out.

mod action;
mod answer;
mod facts;
mod register;
mod spanned;

use std::collections::BTreeMap;

use drive_core::State;
pub use drive_core::registers::Space;
use serde::Deserialize;

pub use action::{Action, Acts, Command, Deed, ModeName, Rung, Sign, Start, Step, Stops};
pub use answer::Answer;
pub use facts::{
    Bits, Codes, Direction, Faults, FedBy, Forbidden, Guard, Limits, Owner, Proves, Reached, Setpoint,
    Source, Tried, TriedOn, Watchdog,
};
pub use register::{Access, Byte, Order, Register, Storage, UnitName};
pub use spanned::Spanned;

/// The version of the format that this crate writes. It reads this one and no other: an older file is refused with what to change.
pub const VERSION: u32 = 1;

/// A JSON schema of a profile, for editors. What it lets pass is still to be checked: see [`read`](crate::read).
#[cfg(feature = "schemars")]
#[must_use]
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(File)
}

/// How sure a source is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Mark {
    /// Read in a public repository of a program that drives it.
    R,
    /// Read on a page of the maker's manual.
    P,
    /// Arithmetic from facts of these two kinds.
    D,
    /// Sources contradict each other.
    X,
    /// From memory.
    M,
    /// A weak source: a forum, a generated table.
    W,
}

impl Mark {
    /// Whether a motor may be moved by what it marks.
    #[must_use]
    pub const fn is_sound(self) -> bool {
        matches!(self, Self::R | Self::P | Self::D)
    }

    /// What it means, for people.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::R => "read in a public repository",
            Self::P => "read in the maker's manual",
            Self::D => "arithmetic from such facts",
            Self::X => "its sources contradict each other",
            Self::M => "from memory",
            Self::W => "a weak source",
        }
    }
}

/// The whole file.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct File {
    /// The version of the format.
    pub format: Spanned<u32>,
    /// The name by which configurations choose it.
    pub key: Spanned<String>,
    /// The maker.
    pub maker: Spanned<String>,
    /// The drive, with its maker.
    pub name: Spanned<String>,
    /// For which models and firmware it is meant.
    pub models: Spanned<String>,
    /// Where its facts are from, by the names that the facts use.
    pub sources: BTreeMap<String, Spanned<Source>>,
    /// On which drives a person has tried it.
    pub tried: Answer<Vec<Spanned<Tried>>>,
    /// What tells this drive from others, and what makes its registers mean what stands here.
    pub who: Who,
    /// The line.
    pub link: Spanned<Link>,
    /// The registers, by the manual's mnemonics.
    pub register: BTreeMap<String, Spanned<Register>>,
    /// Its states.
    pub state: States,
    /// Where what it measures stands.
    pub see: See,
    /// Who commands it.
    pub ownership: Ownership,
    /// Its command word or coils.
    pub command: Answer<Spanned<Command>>,
    /// Its stops.
    pub stop: Stops,
    /// Its starts.
    pub start: Start,
    /// How a fault is reset.
    pub reset: Answer<Spanned<Action>>,
    /// What makes its guards true, once, when a person asks for it.
    pub setup: Answer<Spanned<Action>>,
    /// Its setpoint.
    pub setpoint: Answer<Spanned<Setpoint>>,
    /// Its faults.
    pub faults: Faults,
    /// Its communication watchdog.
    pub watchdog: Answer<Spanned<Watchdog>>,
    /// What is never written.
    pub never_written: Answer<Vec<Spanned<Forbidden>>>,
    /// Its names in other languages, by their codes, such as `fr`.
    pub texts: Answer<BTreeMap<String, String>>,
}

/// What tells a drive from others.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Who {
    /// What only this drive reads so.
    pub fingerprints: Answer<Vec<Spanned<Guard>>>,
    /// What has to read so before anything but a stop is written.
    pub guards: Answer<Vec<Spanned<Guard>>>,
}

/// What it speaks, and in what measure.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Link {
    /// `modbus_rtu`: the one framing that is spoken here.
    pub protocol: Spanned<String>,
    /// How this file counts addresses.
    pub numbering: Numbering,
    /// The space of a register that names none.
    pub space: Space,
    /// The speeds, in bit/s.
    pub speeds: Answer<Vec<u32>>,
    /// The character formats, such as `8E1`.
    pub formats: Answer<Vec<Spanned<String>>>,
    /// Its factory setting, such as `19200 8E1`.
    pub factory: Answer<Spanned<String>>,
    /// The highest address it can have.
    pub highest_address: Answer<Spanned<u8>>,
    /// The functions of Modbus that it answers.
    pub functions: Vec<Spanned<u8>>,
    /// Words that one read may ask for; `unknown` counts as one.
    pub read_words: Answer<u16>,
    /// Whether one read may take any of the registers here that stand in a row.
    pub reads_across: Answer<bool>,
    /// Words that one write may carry; `unknown` counts as one.
    pub write_words: Answer<u16>,
    /// Coils or inputs that one read may ask for.
    pub read_coils: Answer<u16>,
    /// Coils that one write may carry.
    pub write_coils: Answer<u16>,
    /// The pause after its answer, in ms.
    pub pause_ms: Answer<u16>,
    /// How long it does not answer after a reset, in ms.
    pub after_reset_ms: Answer<u16>,
    /// The exceptions by which it says that it has done nothing, beside those of Modbus.
    pub exceptions: Option<Spanned<Exceptions>>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// Exceptions, each with what it says of a write.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Exceptions {
    /// Code, and what it says.
    pub list: Vec<(u8, Denial)>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// Why a write was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Denial {
    /// There is no such register, or it is only read.
    NoSuchRegister,
    /// The value is outside of what it takes.
    ValueRefused,
    /// Not now: the motor runs, or writing is locked.
    NotNow,
}

/// How a file counts addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Numbering {
    /// As on the wire, from 0.
    Wire,
    /// From 1: the wire's is one less.
    FromOne,
    /// 40001 is the first holding register.
    #[serde(rename = "from_40001")]
    From40001,
}

impl Numbering {
    /// The address on the wire.
    #[must_use]
    pub fn wire(self, number: u32) -> Option<u16> {
        let first = match self {
            Self::Wire => 0,
            Self::FromOne => 1,
            Self::From40001 => 40_001,
        };
        number.checked_sub(first)?.try_into().ok()
    }
}

/// Its states, the first that fits.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct States {
    /// What each looks like.
    pub is: Vec<Spanned<StateIs>>,
    /// What shows that the motor stands, beside an output that came down to zero.
    pub standstill: Answer<Spanned<Bits>>,
}

/// What a state looks like.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct StateIs {
    /// The state.
    pub state: StateName,
    /// The bits.
    pub bits: Spanned<Bits>,
}

/// The closed list of states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum StateName {
    /// It cannot start now.
    NotReady,
    /// It needs its start ladder first.
    Disabled,
    /// It stands and takes a start.
    Ready,
    /// A run command is in force.
    Running,
    /// It comes to a stop.
    Stopping,
    /// It holds its quick stop.
    QuickStop,
    /// It reacts to a fault.
    FaultReaction,
    /// It has tripped.
    Fault,
}

impl StateName {
    /// The same in the terms of all drives.
    #[must_use]
    pub const fn state(self) -> State {
        match self {
            Self::NotReady => State::NotReady,
            Self::Disabled => State::Disabled,
            Self::Ready => State::Ready,
            Self::Running => State::Running,
            Self::Stopping => State::Stopping,
            Self::QuickStop => State::QuickStop,
            Self::FaultReaction => State::FaultReaction,
            Self::Fault => State::Fault,
        }
    }
}

/// Where what it measures stands: names of registers.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct See {
    /// The output frequency.
    pub output: Answer<Spanned<String>>,
    /// The setpoint as the drive holds it.
    pub setpoint: Answer<Spanned<String>>,
    /// The motor current.
    pub current: Answer<Spanned<String>>,
    /// Which way it turns.
    pub direction: Answer<Spanned<Direction>>,
    /// That the output has reached the setpoint.
    pub at_setpoint: Answer<Spanned<Bits>>,
    /// That an alarm is present.
    pub warning: Answer<Spanned<Bits>>,
    /// The motor speed.
    pub speed: Answer<Spanned<String>>,
    /// The output voltage.
    pub output_voltage: Answer<Spanned<String>>,
    /// The voltage of the DC bus.
    pub dc_bus_voltage: Answer<Spanned<String>>,
}

/// Who commands it.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Ownership {
    /// What shows that the bus commands it.
    pub command: Answer<Spanned<Owner>>,
    /// What shows that the bus gives its reference.
    pub reference: Answer<Spanned<Owner>>,
    /// Whether the command register reads back the command that was written.
    pub reads_back: Answer<Spanned<ReadsBack>>,
}

/// The register in which a command reads back.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ReadsBack {
    /// The register.
    pub register: Spanned<String>,
    /// Where this is from.
    pub source: Spanned<String>,
}
