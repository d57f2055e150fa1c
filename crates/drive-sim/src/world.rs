//! What is around a drive: its terminals, its analog inputs, its panel and its supplies, and the places where its
//! manual can be read in two ways.

use drive_core::{
    FaultEntry, Frequency, Percent,
    registers::{Place, Row},
};
use tokio::time::Instant;

/// What there is around the drives of a family, by name.
///
/// A world is quiet until somebody acts: every logic input is open, every analog input is at 0 %, nobody is at the
/// panel, both supplies are on, and each switch stands on its first reading. Inputs that are closed in a drive as
/// delivered are said so by the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Surroundings {
    /// The family as a person names it, such as `atv312`.
    pub family: &'static str,
    /// Its logic inputs, as its manual names them.
    pub terminals: &'static [&'static str],
    /// Its analog inputs, as its manual names them.
    pub analog_inputs: &'static [&'static str],
    /// What its manual leaves open.
    pub switches: &'static [Switch],
    /// The codes that [`trip`](crate::Model::trip) takes, with their mnemonics.
    pub trips: &'static [FaultEntry],
    /// Its registers, with their mnemonics.
    pub rows: &'static [Row],
}

impl Surroundings {
    /// Nothing: a drive that stands alone.
    pub const NONE: Self =
        Self { family: "drive", terminals: &[], analog_inputs: &[], switches: &[], trips: &[], rows: &[] };
}

/// A decision that a manual leaves open, as a switch of the simulated drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switch {
    /// Its name.
    pub name: &'static str,
    /// The names of the readings; a drive begins with the first.
    pub readings: &'static [&'static str],
    /// What is open, and where the manual leaves it so.
    pub question: &'static str,
}

impl Switch {
    /// Puts the switch of this name on a reading: `true` for the second of the two that it has.
    pub(crate) fn choose<'a>(
        choices: impl IntoIterator<Item = (&'a Self, &'a mut bool)>,
        name: &str,
        reading: &str,
    ) {
        for (switch, second) in choices.into_iter().filter(|(switch, _)| switch.name == name) {
            *second = switch.readings.get(1) == Some(&reading);
        }
    }
}

/// What happens to a drive from outside, beyond what every drive has a method for. The names are those of its
/// [`Surroundings`], whatever the case in which they were given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// A logic input is closed (`true`) or opened.
    Terminal(&'static str, bool),
    /// An analog input takes a level: a share of its full scale, negative on an input for ±10 V.
    Analog(&'static str, Percent),
    /// The supply of the power stage comes or goes, while the control is supplied all the time.
    MotorSupply(bool),
    /// From now on the drive follows this reading (the second name) of what its manual leaves open (the first).
    Reading(&'static str, &'static str),
}

/// What somebody does at the drive's panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Panel {
    /// Takes control away from the bus (forced local, LOC/REM key).
    TakeControl,
    /// Gives control back to the bus.
    ReleaseControl,
    /// Presses the STOP key.
    Stop,
    /// Presses the RUN key.
    Run,
    /// Resets a fault.
    Reset,
    /// Sets the panel's own reference.
    Reference(Frequency),
}

/// What somebody else than the line's master has done to a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intervention {
    /// At its terminals, at the supply of its power stage, or in how its manual is read.
    World(Act),
    /// At its panel.
    Panel(Panel),
    /// The supply of its control came (`true`) or went.
    Power(bool),
    /// It was tripped.
    Trip(u16),
    /// A register, a coil or an input was given a value without the line.
    Set(Place, u16),
    /// Another master of the line wrote a word to a register, or a coil.
    Master(Place, u16),
}

/// An [`Intervention`], and when it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Intervened {
    /// How many came before it.
    pub number: u64,
    /// When.
    pub at: Instant,
    /// What was done.
    pub what: Intervention,
}

/// A name that the drive's [`Surroundings`] do not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{family} has no {what} {name:?}: {}", listed(known))]
pub struct UnknownName {
    /// The drive's family.
    pub family: &'static str,
    /// What was named: a terminal, an analog input, a switch, a reading.
    pub what: &'static str,
    /// The name.
    pub name: String,
    /// The names that there are.
    pub known: Vec<&'static str>,
}

fn listed(known: &[&str]) -> String {
    if known.is_empty() { "it has none".to_owned() } else { format!("it has {}", known.join(", ")) }
}

impl Surroundings {
    /// The act that closes or opens a logic input.
    ///
    /// # Errors
    /// [`UnknownName`] when there is no such input.
    pub fn terminal(&self, name: &str, closed: bool) -> Result<Act, UnknownName> {
        Ok(Act::Terminal(self.named("terminal", name, self.terminals.iter().copied())?, closed))
    }

    /// The act that puts an analog input on a level.
    ///
    /// # Errors
    /// [`UnknownName`] when there is no such input.
    pub fn analog(&self, name: &str, level: Percent) -> Result<Act, UnknownName> {
        Ok(Act::Analog(self.named("analog input", name, self.analog_inputs.iter().copied())?, level))
    }

    /// The act that puts a switch on a reading.
    ///
    /// # Errors
    /// [`UnknownName`] when there is no such switch, or it has no such reading.
    pub fn reading(&self, name: &str, reading: &str) -> Result<Act, UnknownName> {
        let name = self.named("switch", name, self.switches.iter().map(|switch| switch.name))?;
        let of_switch = self.switches.iter().filter(|switch| switch.name == name);
        let readings = of_switch.flat_map(|switch| switch.readings.iter().copied());
        Ok(Act::Reading(name, self.named("reading", reading, readings)?))
    }

    fn named(
        &self,
        what: &'static str,
        name: &str,
        known: impl Iterator<Item = &'static str> + Clone,
    ) -> Result<&'static str, UnknownName> {
        known.clone().find(|known| known.eq_ignore_ascii_case(name)).ok_or_else(|| UnknownName {
            family: self.family,
            what,
            name: name.to_owned(),
            known: known.collect(),
        })
    }
}
