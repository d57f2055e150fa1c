//! The words of one line.

use drive_core::{
    Frequency, Percent,
    registers::{Place, Row, Unit},
};

use super::ControlError;
use crate::world::{Act, Panel, Surroundings};

/// What a line asks of one drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Deed {
    Act(Act),
    Panel(Panel),
    Power(bool),
    PowerCycle,
    Trip(u16),
    Load(u16),
    Cable(bool),
    Busy(bool),
    Get(Place),
    Set(Place, u16),
    Master(Place, u16),
    Show,
}

/// A line, word by word.
pub(super) struct Words<'a> {
    line: &'a str,
    rest: std::str::SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    pub(super) fn of(line: &'a str) -> Self {
        Self { line, rest: line.split_whitespace() }
    }

    /// The next word; empty when there is none.
    pub(super) fn next(&mut self) -> &'a str {
        self.rest.next().unwrap_or_default()
    }

    /// Nothing may follow.
    pub(super) fn end(&mut self) -> Result<(), ControlError> {
        if self.next().is_empty() { Ok(()) } else { Err(self.unknown()) }
    }

    pub(super) fn unknown(&self) -> ControlError {
        ControlError::Unknown(self.line.trim().to_owned())
    }

    /// Whether the next word is the first of the two that may stand there.
    pub(super) fn either(&mut self, yes: &str, no: &str) -> Result<bool, ControlError> {
        match self.next() {
            word if word == yes => Ok(true),
            word if word == no => Ok(false),
            _ => Err(self.unknown()),
        }
    }

    /// What is asked of a drive with these surroundings.
    pub(super) fn deed(&mut self, around: &Surroundings) -> Result<Deed, ControlError> {
        Ok(match self.next() {
            "terminal" => {
                let name = self.next();
                Deed::Act(around.terminal(name, self.either("on", "off")?)?)
            }
            "analog" => {
                let name = self.next();
                let level = self.quantity(Unit::scaled("%", 2).signed(), "a level such as 50% or -12.5%")?;
                Deed::Act(around.analog(name, Percent::from_hundredths(level))?)
            }
            "panel" => Deed::Panel(self.panel()?),
            "power" => match self.next() {
                "on" => Deed::Power(true),
                "off" => Deed::Power(false),
                "cycle" => Deed::PowerCycle,
                _ => return Err(self.unknown()),
            },
            "motor-supply" => Deed::Act(Act::MotorSupply(self.either("on", "off")?)),
            "trip" => Deed::Trip(self.trip(around)?),
            "load" => {
                let word = self.next();
                let percent = Unit::scaled("%", 0).read(word);
                Deed::Load(percent.ok_or_else(|| not(word, "a load such as 80%"))?)
            }
            "cable" => Deed::Cable(self.either("join", "cut")?),
            "busy" => Deed::Busy(self.either("on", "off")?),
            "get" => Deed::Get(self.register(around)?.0),
            "set" => {
                let (register, row) = self.register(around)?;
                Deed::Set(register, self.value(row)?)
            }
            "master" => {
                let (register, row) = self.register(around)?;
                Deed::Master(register, self.value(row)?)
            }
            "reading" => {
                let name = self.next();
                Deed::Act(around.reading(name, self.next())?)
            }
            "show" => Deed::Show,
            _ => return Err(self.unknown()),
        })
    }

    fn panel(&mut self) -> Result<Panel, ControlError> {
        Ok(match self.next() {
            "takes" => Panel::TakeControl,
            "releases" => Panel::ReleaseControl,
            "stop" => Panel::Stop,
            "run" => Panel::Run,
            "reset" => Panel::Reset,
            "reference" => {
                let hertz = self.quantity(Unit::scaled("Hz", 2), "a frequency such as 25Hz")?;
                Panel::Reference(Frequency::from_centihertz(hertz.unsigned_abs()))
            }
            _ => return Err(self.unknown()),
        })
    }

    /// A number in the smallest step of its unit.
    fn quantity(&mut self, unit: Unit, expected: &'static str) -> Result<i32, ControlError> {
        let word = self.next();
        unit.read(word).map(|read| unit.number(read)).ok_or_else(|| not(word, expected))
    }

    fn trip(&mut self, around: &Surroundings) -> Result<u16, ControlError> {
        let word = self.next();
        let entry = around.trips.iter().find(|entry| entry.mnemonic.eq_ignore_ascii_case(word));
        let code = entry.map_or_else(|| Unit::COUNT.read(word), |entry| Some(entry.code));
        code.ok_or_else(|| not(word, "a fault of this family, by its mnemonic or its number"))
    }

    /// A register, a coil or an input; by its address alone it is a holding register.
    fn register(&mut self, around: &Surroundings) -> Result<(Place, Option<&'static Row>), ControlError> {
        let word = match self.next() {
            "coil" => format!("coil {}", self.next()),
            first @ ("discrete" | "input" | "holding") => {
                format!("{first} {} {}", self.next(), self.next())
            }
            word => word.to_owned(),
        };
        let row = Row::find(around.rows, &word);
        let place = row.map(Row::place).or_else(|| Place::read(&word));
        let place = place.or_else(|| Unit::COUNT.read(&word).map(Place::from));
        Ok((place.ok_or_else(|| not(&word, "a register, by its mnemonic or its address"))?, row))
    }

    fn value(&mut self, row: Option<&Row>) -> Result<u16, ControlError> {
        let word = self.next();
        let value = row.and_then(|row| row.read(word)).or_else(|| Unit::COUNT.read(word));
        value.ok_or_else(|| not(word, "a value of this register"))
    }
}

fn not(word: &str, expected: &'static str) -> ControlError {
    ControlError::Value { word: word.to_owned(), expected }
}
