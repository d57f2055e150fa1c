//! A drive and what surrounds it, as plain data, and what can change in it.

use std::collections::BTreeMap;

use super::drivecom::State;
use super::{Family, Silence, Who};

/// Everything that a manual says decides over the motor. [`World::factory`] and `Default` are a drive as delivered, switched
/// on, with nothing written and no input closed. Whoever reads the drive's status may correct what it shows, and then
/// clear [`unsure`](Self::unsure).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct World {
    /// Whose manual is asked.
    pub family: Family,
    /// Settings in force by address; one that is absent has its factory value.
    pub words: BTreeMap<u16, u16>,
    /// Settings written that are not in force before the next switching on.
    pub pending: BTreeMap<u16, u16>,
    /// The settings stored, where they differ from those in force; they come into force with the next switching on.
    pub stored: Option<BTreeMap<u16, u16>>,
    /// Levels of the logic inputs, by the bits of the drive's own input word: F, R, RES are 0, 1, 2 and VIA is 7 on an
    /// ATV21; LI1 to LI6 are 0 to 5 on the others.
    pub inputs: u16,
    /// Analog inputs by number, the dial as 16: hundredths of a percent of their span, with sign. Absent is 0.
    pub analog: BTreeMap<u8, i16>,
    /// The keys.
    pub panel: Panel,
    /// The command word that the bus wrote last since the drive was switched on.
    pub command: Option<u16>,
    /// The command word before that.
    pub command_before: Option<u16>,
    /// Whether it reached the drive as a broadcast.
    pub command_broadcast: bool,
    /// Other words of control that the bus wrote last, by address: references, second command words.
    pub written: BTreeMap<u16, u16>,
    /// The reference reached the drive as a broadcast.
    pub reference_broadcast: bool,
    /// The command word that another bus wrote last.
    pub other_command: u16,
    /// The state of the DRIVECOM chart, where there is one.
    pub state: State,
    /// The mains stand.
    pub mains: bool,
    /// Requests arrive within the drive's time-out.
    pub link: bool,
    /// The fault code, if the drive has tripped.
    pub tripped: Option<u16>,
    /// What made it trip is still there.
    pub cause: bool,
    /// The motor turns or is injected with current.
    pub turning: bool,
    /// The run command that an edge at the terminals or a key has left standing.
    pub latched: Option<Direction>,
    /// The run command of the bus that a stop input has used up.
    pub spent: Spent,
    /// The command came back to the bus without a write of it.
    pub regained: bool,
    /// Forced local mode as the drive's status shows it, if whoever fills this in has read it.
    pub forced_local: Option<bool>,
    /// Who commands, if it is known from elsewhere than the manual.
    pub told: Option<Who>,
    /// What happened that the manual does not follow.
    pub unsure: Option<&'static Silence>,
}

/// The keys of the drive or of its remote terminal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Panel {
    /// STOP is held.
    pub stop: bool,
    /// LOC/REM stands on local.
    pub local: bool,
    /// FWD/REV stands on reverse.
    pub reverse: bool,
    /// The reference of the panel, in hundredths of a hertz.
    pub reference: i32,
}

/// A direction of rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Forward.
    Forward,
    /// Reverse.
    Reverse,
}

/// What became of a run command of the bus under a stop input.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Spent {
    /// It stands.
    #[default]
    No,
    /// A new run command is needed.
    Yes,
    /// The same word was written once more.
    SameWordAgain,
}

/// A key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// RUN.
    Run,
    /// STOP.
    Stop,
    /// RESET.
    Reset,
    /// LOC/REM, held standing for local.
    Local,
    /// FWD/REV, held standing for reverse.
    Reverse,
}

/// What can happen to a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The bus writes a word to this drive.
    Write {
        /// Its address on the wire.
        address: u16,
        /// The word.
        value: u16,
    },
    /// The bus writes a word to all drives.
    Broadcast {
        /// Its address on the wire.
        address: u16,
        /// The word.
        value: u16,
    },
    /// Another bus writes the command word.
    OtherCommand(u16),
    /// A logic input opens or closes.
    Input {
        /// Its bit in [`World::inputs`].
        bit: u8,
        /// Closed is 1.
        closed: bool,
    },
    /// An analog input moves.
    Analog {
        /// Its number.
        number: u8,
        /// Hundredths of a percent of its span.
        value: i16,
    },
    /// A key is pressed or released.
    Key {
        /// Which.
        key: Key,
        /// Pressed, or standing on local, or on reverse.
        held: bool,
    },
    /// The mains go or come back.
    Mains(bool),
    /// The drive's time-out has run out, or requests come again.
    Link(bool),
    /// The drive trips.
    Trip(u16),
    /// What made it trip is gone.
    CauseGone,
    /// Time passes, and nothing else.
    Wait,
}

impl Default for World {
    fn default() -> Self {
        Self::factory(Family::Atv21)
    }
}

impl World {
    /// A drive as delivered, switched on.
    pub fn factory(family: Family) -> Self {
        Self::switched_on(family, BTreeMap::new())
    }

    /// A drive with these settings, just switched on.
    pub fn switched_on(family: Family, words: BTreeMap<u16, u16>) -> Self {
        let off = Self {
            family,
            words,
            pending: BTreeMap::new(),
            stored: None,
            inputs: 0,
            analog: BTreeMap::new(),
            panel: Panel::default(),
            command: None,
            command_before: None,
            command_broadcast: false,
            written: BTreeMap::new(),
            reference_broadcast: false,
            other_command: 0,
            state: State::Unknown,
            mains: false,
            link: true,
            tripped: None,
            cause: false,
            turning: false,
            latched: None,
            spent: Spent::No,
            regained: false,
            forced_local: None,
            told: None,
            unsure: None,
        };
        family.manual().step(&off, &Change::Mains(true))
    }

    /// This world after a sequence of changes.
    #[must_use]
    pub fn after(&self, changes: &[Change]) -> Self {
        changes.iter().fold(self.clone(), |world, change| super::next(&world, change))
    }

    pub(super) fn word(&self, address: u16, factory: u16) -> u16 {
        self.words.get(&address).copied().unwrap_or(factory)
    }

    pub(super) fn input(&self, bit: u8) -> bool {
        self.inputs >> bit & 1 == 1
    }

    pub(super) fn commanded(&self, bit: u8) -> bool {
        self.command.unwrap_or(0) >> bit & 1 == 1
    }

    /// What every family does alike with a change; says whether anything is left to do.
    pub(super) fn note(&mut self, change: &Change) {
        match *change {
            Change::OtherCommand(word) => self.other_command = word,
            Change::Input { bit, closed: true } => self.inputs |= 1 << bit,
            Change::Input { bit, closed: false } => self.inputs &= !(1 << bit),
            Change::Analog { number, value } => {
                self.analog.insert(number, value);
            }
            Change::Key { key: Key::Stop, held } => self.panel.stop = held,
            Change::Key { key: Key::Local, held } => self.panel.local = held,
            Change::Key { key: Key::Reverse, held } => self.panel.reverse = held,
            Change::Mains(on) => self.mains = on,
            Change::Link(stands) => self.link = stands,
            Change::Trip(code) => {
                self.tripped = Some(code);
                self.cause = true;
            }
            Change::CauseGone => self.cause = false,
            Change::Write { .. } | Change::Broadcast { .. } | Change::Key { .. } | Change::Wait => {}
        }
    }

    pub(super) fn take_command(&mut self, word: u16, broadcast: bool) {
        self.command_before = self.command.replace(word);
        self.command_broadcast = broadcast;
        self.regained = false;
    }

    /// What the bus wrote is forgotten.
    pub(super) fn forget_bus(&mut self) {
        self.command = None;
        self.command_before = None;
        self.command_broadcast = false;
        self.reference_broadcast = false;
        self.written.clear();
        self.spent = Spent::No;
        self.regained = false;
    }
}
