//! A register as a file names it.

use drive_core::registers::Space;
use serde::Deserialize;

use super::{Answer, Spanned};

/// One register, coil or input.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Register {
    /// What it is, in plain English.
    pub what: String,
    /// Its address, counted as the file says.
    pub address: Spanned<u32>,
    /// In which space, where it is not the one that the file names.
    pub space: Option<Space>,
    /// Who may write it.
    pub access: Access,
    /// Where a written value lives: of whatever can be written.
    pub storage: Option<Spanned<Storage>>,
    /// What a count is.
    #[serde(default)]
    pub unit: UnitName,
    /// So many of the unit, as a fraction, are one count.
    pub scale: Option<Spanned<[i64; 2]>>,
    /// Whether it is a signed number.
    #[serde(default)]
    pub signed: bool,
    /// How many words it takes: 1 or 2.
    pub words: Option<Spanned<u8>>,
    /// Which of two words is first.
    pub order: Option<Order>,
    /// The byte of the word that counts, where it is one.
    pub byte: Option<Byte>,
    /// The register whose number says how many decimals this one has.
    pub decimals_in: Option<Spanned<String>>,
    /// Whether it is a setting that a person may want to write.
    #[serde(default)]
    pub parameter: bool,
    /// The lowest and highest count.
    pub range: Option<Spanned<[i32; 2]>>,
    /// Its factory setting.
    pub factory: Option<Answer<u16>>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// Who may write a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Access {
    /// Nobody.
    Read,
    /// Anybody, at any time.
    ReadWrite,
    /// Anybody, while the motor stands.
    WriteStopped,
    /// Anybody, and nobody reads it.
    Write,
}

/// Where a written value lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Storage {
    /// Lost when the drive is switched off.
    Ram,
    /// Lost then unless the drive is told to save its parameters.
    RamUntilSaved,
    /// Each write wears an EEPROM.
    Eeprom,
    /// Nobody knows: counted as one that wears.
    Unknown,
}

/// Which of two words is first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// The high word.
    HighFirst,
    /// The low word.
    LowFirst,
}

/// A byte of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Byte {
    /// Bits 8 to 15.
    High,
    /// Bits 0 to 7.
    Low,
}

/// The closed list of units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum UnitName {
    /// Bits that mean something each.
    #[default]
    #[serde(rename = "bits")]
    Bits,
    /// The number of something in a list.
    #[serde(rename = "code")]
    Code,
    /// A plain number.
    #[serde(rename = "count")]
    Count,
    /// Hertz.
    #[serde(rename = "Hz")]
    Hertz,
    /// Turns in a minute.
    #[serde(rename = "rpm")]
    Rpm,
    /// Percent of the drive's own full scale.
    #[serde(rename = "%")]
    Percent,
    /// Ampere.
    #[serde(rename = "A")]
    Ampere,
    /// Volt.
    #[serde(rename = "V")]
    Volt,
    /// Kilowatt.
    #[serde(rename = "kW")]
    Kilowatt,
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Millisecond,
}

impl UnitName {
    /// The unit's symbol.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Bits | Self::Code | Self::Count => "",
            Self::Hertz => "Hz",
            Self::Rpm => "rpm",
            Self::Percent => "%",
            Self::Ampere => "A",
            Self::Volt => "V",
            Self::Kilowatt => "kW",
            Self::Second => "s",
            Self::Millisecond => "ms",
        }
    }
}
