//! What a status and the measurements are made of: the names of the profile resolved once, for they are looked at in each poll.

use drive_core::{Direction, State};

use super::{Words, cell::Cell, plan::Block};
use crate::{
    format::{Answer, Bits, Direction as Turns, Owner, Proves, Spanned},
    profile::Profile,
    read_back::ReadBack,
};

/// What is read of a drive, and where its values stand in that.
#[derive(Debug)]
pub(super) struct Sight {
    /// What a status reads.
    pub(super) fast: Vec<Block>,
    /// What the measurements read.
    pub(super) slow: Vec<Block>,
    /// What reads the code of the present fault, where no status does.
    pub(super) code: Option<Block>,
    /// What reads the command back, where no status does.
    pub(super) command: Vec<Block>,
    /// The states, the first that fits.
    pub(super) states: Vec<(State, Test)>,
    pub(super) standstill: Option<Test>,
    pub(super) at_setpoint: Option<Test>,
    pub(super) warning: Option<Test>,
    pub(super) commanded_by: Option<(Test, Proves)>,
    pub(super) reference_by: Option<(Test, Proves)>,
    pub(super) output: Option<Cell>,
    pub(super) setpoint: Option<Cell>,
    /// It is read in the register that takes it, and no sign of it is the direction of a start.
    pub(super) shows_own_setpoint: bool,
    pub(super) current: Option<Cell>,
    pub(super) speed: Option<Cell>,
    pub(super) output_voltage: Option<Cell>,
    pub(super) dc_bus_voltage: Option<Cell>,
    /// The code of the present fault.
    pub(super) fault: Option<Cell>,
    /// The command that reads back.
    pub(super) reads_back: Option<ReadBack>,
    pub(super) full_scale: Option<FullScale>,
    direction: Option<(Cell, Turns)>,
}

/// Who knows what 100 % is.
#[derive(Debug)]
pub(super) enum FullScale {
    Owner,
    Register(Cell),
}

/// Bits whose register is resolved.
#[derive(Debug)]
pub(super) struct Test {
    cell: Cell,
    bits: Bits,
}

impl Test {
    /// Whether they fit; `None`: they were not read.
    pub(super) fn fits(&self, words: &Words) -> Option<bool> {
        self.cell.word(words).map(|word| self.bits.fit(word))
    }
}

impl Sight {
    pub(super) fn of(profile: &Profile) -> Self {
        let file = profile.file();
        let (see, owner) = (&file.see, &file.ownership);
        let cell = |name: &Answer<Spanned<String>>| profile.cell(name.given()?.get_ref());
        let test =
            |bits: &Bits| Some(Test { cell: profile.cell(bits.register.get_ref())?, bits: bits.clone() });
        let told = |bits: &Answer<Spanned<Bits>>| test(bits.given()?.get_ref());
        let owned = |owner: &Answer<Spanned<Owner>>| {
            let owner = owner.given()?.get_ref();
            Some((test(&owner.bits)?, owner.proves))
        };
        let full_scale = file.setpoint.given().and_then(|setpoint| setpoint.get_ref().full_scale.as_ref());
        let states = file.state.is.iter().map(Spanned::get_ref);
        Self {
            fast: profile.fast(),
            slow: profile.slow(),
            code: profile.code(),
            command: profile.command(),
            states: states.filter_map(|is| Some((is.state.state(), test(is.bits.get_ref())?))).collect(),
            standstill: told(&file.state.standstill),
            at_setpoint: told(&see.at_setpoint),
            warning: told(&see.warning),
            commanded_by: owned(&owner.command),
            reference_by: owned(&owner.reference),
            output: cell(&see.output),
            setpoint: cell(&see.setpoint),
            shows_own_setpoint: !file.starts_by_setpoint()
                && see
                    .setpoint
                    .given()
                    .zip(file.setpoint.given())
                    .is_some_and(|(seen, given)| seen.get_ref() == given.get_ref().register.get_ref()),
            current: cell(&see.current),
            speed: cell(&see.speed),
            output_voltage: cell(&see.output_voltage),
            dc_bus_voltage: cell(&see.dc_bus_voltage),
            fault: cell(&file.faults.present),
            reads_back: ReadBack::of(file),
            full_scale: full_scale.and_then(|full| match full.get_ref().as_str() {
                "owner" => Some(FullScale::Owner),
                name => profile.cell(name).map(FullScale::Register),
            }),
            direction: see.direction.given().and_then(|direction| {
                let direction = direction.get_ref();
                Some((profile.cell(direction.register.get_ref())?, direction.clone()))
            }),
        }
    }

    /// The first state that fits. What cannot be seen may be a trip: nothing behind it is told.
    pub(super) fn state(&self, words: &Words) -> State {
        let fitting = self.states.iter().find(|(_, test)| test.fits(words) != Some(false));
        match fitting {
            Some((state, test)) if test.fits(words) == Some(true) => *state,
            _ => State::Unknown,
        }
    }

    /// Whether these bits stand in a word by which the state is told.
    pub(super) fn is_of_the_state(&self, test: &Test) -> bool {
        self.states.iter().any(|(_, state)| state.bits.register.get_ref() == test.bits.register.get_ref())
    }

    /// Which way it turns.
    pub(super) fn direction(&self, words: &Words) -> Option<Direction> {
        let (cell, turns) = self.direction.as_ref()?;
        let Some(mask) = &turns.mask else {
            return match cell.counts(words)?.signum() {
                1 => Some(Direction::Forward),
                -1 => Some(Direction::Reverse),
                _ => None,
            };
        };
        let word = Some(cell.word(words)? & mask.get_ref());
        if word == turns.forward {
            Some(Direction::Forward)
        } else if word == turns.reverse {
            Some(Direction::Reverse)
        } else {
            None
        }
    }

    /// The command that the drive is read to hold.
    pub(super) fn held(&self, words: &Words) -> Option<u16> {
        self.reads_back.as_ref()?.word(|space, address| words.at(space, address))
    }

    /// The code of the present fault.
    pub(super) fn fault_code(&self, words: &Words) -> Option<u16> {
        self.fault?.word(words).filter(|code| *code != 0)
    }

    /// Whether a state of its profile is that of a motor that runs.
    pub(super) fn shows_running(&self) -> bool {
        self.states.iter().any(|(state, _)| *state == State::Running)
    }
}
