//! Facts about a drive: where they are from, what tells it, its setpoint, faults, watchdog and what is never written.

use serde::Deserialize;

use super::{Answer, Mark, Spanned};

/// Where facts are from.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Source {
    /// The document or the repository.
    pub document: String,
    /// Its edition, date or commit.
    pub edition: Answer<String>,
    /// The pages, sections or files.
    pub page: String,
    /// How sure it is.
    pub mark: Mark,
}

/// That a person has tried it on a drive.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Tried {
    /// Who.
    pub person: String,
    /// On which drive, with its rating.
    pub drive: String,
    /// With which firmware.
    pub firmware: String,
    /// On which day, such as `2026-11-24`.
    pub day: String,
    /// What was seen.
    pub seen: String,
    /// How far it came. Without this and the next two it is told, and lifts nothing.
    pub reached: Option<Reached>,
    /// What it was tried on.
    pub on: Option<TriedOn>,
    /// The digest of what was tried: what the file said of the drive then. Once it says something else, the trial proves nothing of it.
    pub of: Option<String>,
}

/// How far a trial came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Reached {
    /// All was read; a stop, where one was sent, found the motor at rest.
    Read,
    /// A stop over the bus stopped a turning motor.
    Stopped,
    /// A start over the bus turned the motor, and a stop stopped it.
    Started,
}

/// What was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum TriedOn {
    /// A drive with its motor.
    Drive,
    /// A program that behaves like one: it proves nothing of a drive.
    Simulator,
}

/// Bits of a register that say something.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Bits {
    /// The register.
    pub register: Spanned<String>,
    /// The bits.
    pub mask: Spanned<u16>,
    /// How they are then.
    pub value: u16,
    /// That they are then anything else than `value`.
    #[serde(default)]
    pub differs: bool,
    /// Where this is from.
    pub source: Spanned<String>,
}

impl Bits {
    /// Whether a word says it.
    #[must_use]
    pub fn fit(&self, word: u16) -> bool {
        (word & self.mask.get_ref() == self.value) != self.differs
    }
}

/// Bits that tell who commands.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Owner {
    /// The bits.
    pub bits: Bits,
    /// What they prove where they fit; where they do not, it is not the bus.
    pub proves: Proves,
}

/// What bits of ownership prove where they fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Proves {
    /// That it is the bus.
    Bus,
    /// That it may be the bus.
    Nothing,
}

/// What has to read so.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Guard {
    /// What it says, in words that finish "this holds because ...".
    pub what: String,
    /// The register.
    pub register: Spanned<String>,
    /// The bits that count; all where there is none.
    pub mask: Option<u16>,
    /// What it has to be, one of these.
    pub is: Option<Vec<u16>>,
    /// What it must not be, none of these.
    pub is_not: Option<Vec<u16>>,
    /// Whether the action `setup` makes it true.
    #[serde(default)]
    pub set_up: bool,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// Which way it turns.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Direction {
    /// The register.
    pub register: Spanned<String>,
    /// The bits that tell it; without them the sign does.
    pub mask: Option<Spanned<u16>>,
    /// How they are forward.
    pub forward: Option<u16>,
    /// How they are in reverse.
    pub reverse: Option<u16>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// The setpoint.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Setpoint {
    /// The register that takes it, whose unit is Hz, rpm or %.
    pub register: Spanned<String>,
    /// Where percent become hertz: the register that holds 100 %, or `owner`, who has to say it. Of a register in %.
    pub full_scale: Option<Spanned<String>>,
    /// What it may be.
    pub limits: Spanned<Limits>,
    /// Whether its sign gives the direction.
    pub sign_is_direction: bool,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// What a setpoint may be, in counts.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Limits {
    /// The lowest.
    pub low: i32,
    /// The highest that the register takes.
    pub high: i32,
    /// Who knows the highest that the drive allows: the register that holds it, or `owner`, who has to say it.
    pub high_in: Option<Spanned<String>>,
}

/// Its faults.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Faults {
    /// The register that holds the code of the present fault.
    pub present: Answer<Spanned<String>>,
    /// The code by which it says that its communication watchdog ran out.
    pub communication: Answer<u16>,
    /// Its codes.
    pub codes: Answer<Spanned<Codes>>,
}

/// Its codes, each with its mnemonic, meaning and remedy.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Codes {
    /// Code, mnemonic, meaning, remedy.
    pub list: Vec<(u16, String, String, String)>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// Its communication watchdog.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Watchdog {
    /// The register that holds its time.
    pub time: Answer<Spanned<String>>,
    /// What a time of 0 means: `off`, as it mostly does.
    pub zero_is: Answer<String>,
    /// Whether it acts as it leaves the factory.
    pub from_factory: Answer<bool>,
    /// The register that says what it does.
    pub action: Answer<Spanned<String>>,
    /// What each value of that does.
    pub actions: Answer<Vec<(u16, String)>>,
    /// What feeds it.
    pub fed_by: Answer<FedBy>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// What feeds a watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FedBy {
    /// Any request to this drive.
    AnyRequest,
    /// A write of the command or the setpoint.
    CommandWrite,
}

/// Addresses that are never written.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Forbidden {
    /// The first.
    pub from: Spanned<u32>,
    /// The last.
    pub to: u32,
    /// Why.
    pub why: String,
    /// Where this is from.
    pub source: Spanned<String>,
}
