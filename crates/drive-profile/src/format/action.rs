//! What is written, in its order.

use serde::Deserialize;

use super::{Answer, Bits, Spanned, StateName};

/// Which words run the motor, and what they do while they stand.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Command {
    /// Every form of a word that runs the motor, jogging included.
    pub runs: Vec<Spanned<Bits>>,
    /// Whether a run command that stands starts the motor when what kept it from acting goes away.
    pub acts: Acts,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// What a run command that stands does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Acts {
    /// It acts for as long as it stands.
    Level,
    /// It acts when it is written, or rises.
    Edge,
    /// Nobody knows: counted as a level.
    Unknown,
}

/// What is done, step by step.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Action {
    /// The steps.
    pub steps: Vec<Spanned<Step>>,
    /// Of a stop: the states in which it is done.
    pub seen: Option<Spanned<Vec<StateName>>>,
    /// Of a reset: whether the drive clears the bit by itself.
    pub clears_itself: Option<bool>,
    /// Where this is from.
    pub source: Spanned<String>,
}

/// One step: a write, a pause, or a reading that is waited for.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Step {
    /// The register or coil that is written, or the first of several.
    pub write: Option<Spanned<String>>,
    /// The words.
    pub words: Option<Vec<u16>>,
    /// The coils.
    pub coils: Option<Vec<bool>>,
    /// Of a drive whose setpoint is its run command: the setpoint that was given goes out, with this sign. In the last step of a start.
    pub setpoint: Option<Spanned<Sign>>,
    /// The function, where it is not the one for so many. 23 reads the first register of the states along.
    pub function: Option<Spanned<u8>>,
    /// How long nothing is done, in ms.
    pub pause_ms: Option<Spanned<u16>>,
    /// What is waited for.
    #[serde(rename = "await")]
    pub awaits: Option<Bits>,
    /// For how long at the most, in ms.
    pub within_ms: Option<Spanned<u16>>,
}

/// With which sign a setpoint goes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Sign {
    /// As it was given.
    Positive,
    /// With the other sign.
    Negative,
}

/// Its stops, each by the mode that it is.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Stops {
    /// Along the ramp.
    pub ramp: Answer<Spanned<Action>>,
    /// Along the short ramp.
    pub fast: Answer<Spanned<Action>>,
    /// By cutting the output.
    pub freewheel: Answer<Spanned<Action>>,
    /// By direct current.
    pub dc_injection: Answer<Spanned<Action>>,
    /// Which of them is a stop also where the guards were not read: another may be a run command there.
    pub unread: Spanned<ModeName>,
}

/// The closed list of stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ModeName {
    /// Along the ramp.
    Ramp,
    /// Along the short ramp.
    Fast,
    /// By cutting the output.
    Freewheel,
    /// By direct current.
    DcInjection,
}

impl Stops {
    /// The stop of a mode.
    #[must_use]
    pub const fn of(&self, mode: ModeName) -> &Answer<Spanned<Action>> {
        match mode {
            ModeName::Ramp => &self.ramp,
            ModeName::Fast => &self.fast,
            ModeName::Freewheel => &self.freewheel,
            ModeName::DcInjection => &self.dc_injection,
        }
    }
}

/// Its starts.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Start {
    /// What is written from each state before the run command, the first that fits; `none`: nothing.
    pub ladder: Answer<Vec<Spanned<Rung>>>,
    /// Forward.
    pub forward: Answer<Spanned<Action>>,
    /// In reverse.
    pub reverse: Answer<Spanned<Action>>,
}

/// A rung of the ladder: in this state this word is written, or the drive is waited for, or the run command is due.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Rung {
    /// The state.
    pub bits: Bits,
    /// What is done there.
    #[serde(rename = "do")]
    pub deed: Deed,
    /// The register that is written.
    pub register: Option<Spanned<String>>,
    /// What is written.
    pub word: Option<u16>,
}

/// What is done on a rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Deed {
    /// The word is written.
    Write,
    /// The drive is waited for.
    Wait,
    /// The run command is due.
    Run,
}
