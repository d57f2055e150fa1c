//! Worlds: everything around a drive that may decide over its motor, before a command, in the midst of it, in the midst of a run
//! and afterwards; and who judges what is said of the motor then.
//!
//! A family tells its control configurations and what may happen around its drives by [`Surrounded`], and
//! [`Contract::live_in_worlds`](crate::Contract::live_in_worlds) lives through each of them with each [`Operation`]. Three judges look on:
//!
//! - each status is held against the shaft ([`truth`](crate::truth));
//! - a **twin** of the machine lives in the same world and hears nothing of this side: what it does too, the plant has done. A motor
//!   that turns while no lease stands, and whose twin does not, turns without a reason;
//! - a [`Judge`] who follows the manual, where the family has one: [`ByManual`] for the families of the
//!   [`referee`](crate::referee).
//!
//! And what a command says of itself is held against the machine: what is confirmed is in force, a stop is written and stops, nothing
//! but a start moves a motor.

mod by_manual;
mod cell;
mod matrix;
mod random;
mod scene;

use drive_core::registers::{Range, Row};
use drive_sim::{Model, SimSlave, Surroundings};

pub use self::{
    by_manual::ByManual,
    cell::{Comes, Operation},
    matrix::{Share, Tally},
    scene::Scene,
};
use crate::contract::Open;

/// A way in which a manual lets a drive be commanded.
pub struct Configuration {
    /// What it is, in a few words.
    pub name: String,
    /// Makes its drive, with what its owner says of it.
    pub open: Box<Open>,
    /// Makes the machine before the settings.
    pub machine: Box<dyn Fn() -> Box<dyn Model>>,
    /// What is set at the drive, as lines of the simulator's text without the drive's name.
    pub settings: Vec<String>,
}

/// Something that happens around a drive, and how it is taken back.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Event {
    /// What happens, as lines of the simulator's text without the drive's name.
    pub comes: Vec<String>,
    /// What takes it back, in the same order; empty: it stays.
    pub goes: Vec<String>,
}

impl Event {
    /// What stays.
    #[must_use]
    pub fn lasting(deed: &str) -> Self {
        Self { comes: vec![deed.to_owned()], goes: Vec::new() }
    }

    fn of(pairs: &[(String, String)]) -> Self {
        let (comes, goes) = pairs.iter().cloned().unzip();
        Self { comes, goes }
    }

    /// Whether another master of the line has a hand in it.
    #[must_use]
    pub fn is_of_a_master(&self) -> bool {
        self.comes.iter().any(|deed| deed.starts_with("master"))
    }

    /// Whether the drive hears nothing while it lasts.
    fn silences(&self) -> bool {
        self.comes.iter().any(|deed| deed.starts_with("power "))
    }
}

/// What a setting may be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Values {
    /// One of these words.
    Listed(Vec<u16>),
    /// A number from the first to the second.
    Between(i32, i32),
}

impl Values {
    /// What the range of a register allows, where it is a list or two numbers.
    #[must_use]
    pub fn of(range: &Range) -> Option<Self> {
        let choices = range.choices();
        match *range {
            _ if !choices.is_empty() => {
                Some(Self::Listed(choices.iter().map(|choice| choice.value).collect()))
            }
            Range::Within(low, high) | Range::Described(low, high, _) => Some(Self::Between(low, high)),
            _ => None,
        }
    }
}

/// What a family tells of the ways in which its drives are commanded, and of what may happen around them. Only the configurations are
/// needed.
pub trait Surrounded {
    /// Every way in which the manual lets such a drive be commanded.
    fn configurations(&self) -> Vec<Configuration>;

    /// What may happen around a machine that has this around it: all of [`events`] unless the family says otherwise.
    fn events(&self, around: &Surroundings) -> Vec<Event> {
        events(around)
    }

    /// What another master of the line may do.
    fn other_masters(&self) -> Vec<Event> {
        Vec::new()
    }

    /// The manual beside a machine as it is set up now, at rest, before anything is written to it. `None`: nobody has transcribed it,
    /// and twin and shaft are all that judge.
    fn judge(&self, machine: &SimSlave) -> Option<Box<dyn Judge>> {
        let _ = machine;
        None
    }

    /// The mnemonic of a parameter that moves no control, and a value for it.
    fn parameter(&self) -> Option<(&'static str, u16)> {
        None
    }

    /// What a random drive may have in a setting; `None`: it is left as the machine has it.
    fn values_of(&self, row: &Row) -> Option<Values> {
        let _ = row;
        None
    }
}

/// Who follows what is written to a machine and what happens around it, and says then what a manual makes of its motor.
pub trait Judge {
    /// Time has passed: what was written to the machine since and what was [done](SimSlave::interventions) to it is taken in.
    fn follow(&mut self);

    /// What the manual has against the motor as it is seen, and against what is said of our run command: `held`, a run command of
    /// this side stands; `in_force`, it is said to act.
    fn objects(&mut self, held: bool, in_force: bool) -> Option<String>;

    /// Whether the manual decides anything here.
    fn decides(&self) -> bool;
}

/// Every state of the world in which something else than the bus may decide: each input closed and opened, alone and with every
/// analog input at 60 %, each analog input alone, the panel in its ways, the supplies.
#[must_use]
pub fn events(around: &Surroundings) -> Vec<Event> {
    let pair = |comes: String, goes: &str| (comes, goes.to_owned());
    let terminal = |name: &&str, to: &str, back: &str| {
        pair(format!("terminal {name} {to}"), &format!("terminal {name} {back}"))
    };
    let closed: Vec<_> = around.terminals.iter().map(|name| terminal(name, "on", "off")).collect();
    let opened: Vec<_> = around.terminals.iter().map(|name| terminal(name, "off", "on")).collect();
    let analog: Vec<_> = (around.analog_inputs.iter())
        .map(|name| pair(format!("analog {name} 60%"), &format!("analog {name} 0%")))
        .collect();
    let panel = [pair("panel takes".to_owned(), "panel releases")];
    let panel_runs = [
        panel[0].clone(),
        pair("panel reference 35Hz".to_owned(), "panel reference 0Hz"),
        pair("panel run".to_owned(), "panel stop"),
    ];
    let alone = |one: &(String, String)| Event::of(std::slice::from_ref(one));
    let mut all = vec![Event::default()];
    all.extend(closed.iter().map(alone));
    all.extend(opened.iter().map(alone));
    all.extend(closed.iter().map(|one| Event::of(&[analog.as_slice(), std::slice::from_ref(one)].concat())));
    all.extend(analog.iter().map(alone));
    all.extend([&panel[..], &panel_runs[..]].map(Event::of));
    for (comes, goes) in
        [("panel stop", "panel releases"), ("motor-supply off", "motor-supply on"), ("power off", "power on")]
    {
        all.push(alone(&pair(comes.to_owned(), goes)));
    }
    all
}
