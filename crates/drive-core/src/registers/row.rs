//! One register: everything that is known of it, and from where.

use std::fmt;

use super::{
    space::{Place, Space},
    unit::Unit,
};
use crate::access::Access;

/// Where a written value lives, and so what a power cycle and a write cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Storage {
    /// Lost at power-off: commands, references, monitored values.
    Volatile,
    /// Taken at once in RAM and lost at power-off, unless the drive is told to save its parameters to EEPROM.
    RamUntilSaved,
    /// Each write goes to EEPROM, whose life is counted in writes.
    Eeprom,
    /// The manual does not say; treat each write as one to EEPROM.
    Unknown,
}

impl Storage {
    /// Whether each write wears an EEPROM, or is to be taken for that.
    #[must_use]
    pub const fn may_wear(self) -> bool {
        matches!(self, Self::Eeprom | Self::Unknown)
    }
}

impl fmt::Display for Storage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Volatile => "RAM",
            Self::RamUntilSaved => "RAM until saved",
            Self::Eeprom => "EEPROM",
            Self::Unknown => "unknown",
        })
    }
}

/// What became of a written parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Written {
    /// Whether the drive held another value before; an equal value is not written again.
    pub changed: bool,
    /// Where the value lives now.
    pub storage: Storage,
}

/// One value of a list-type register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Choice {
    /// The word.
    pub value: u16,
    /// The manual's mnemonic, as the keypad shows it.
    pub code: &'static str,
    /// What it means.
    pub meaning: &'static str,
}

impl Choice {
    /// A value of a list.
    #[must_use]
    pub const fn new(value: u16, code: &'static str, meaning: &'static str) -> Self {
        Self { value, code, meaning }
    }
}

/// Which words a register takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Range {
    /// The manual gives no range (bit words, monitored values).
    Any,
    /// From and to, in counts.
    Within(i32, i32),
    /// Only the values of a list.
    OneOf(&'static [Choice]),
    /// The values of a list, or a number from and to.
    OneOfOr(&'static [Choice], i32, i32),
    /// From and to in counts as far as they are fixed, and the rest of the rule in words ("LSP to tFr"): the drive
    /// itself judges.
    Described(i32, i32, &'static str),
    /// Any of these bits: the others are reserved, or can only be read.
    Bits(u16),
}

impl Range {
    /// Whether `number` can be taken at all. For [`Range::Described`] the drive has the last word.
    #[must_use]
    pub fn allows(self, number: i32) -> bool {
        let listed = |choices: &[Choice]| choices.iter().any(|choice| i32::from(choice.value) == number);
        match self {
            Self::Any => true,
            Self::Within(min, max) | Self::Described(min, max, _) => (min..=max).contains(&number),
            Self::OneOf(choices) => listed(choices),
            Self::OneOfOr(choices, min, max) => listed(choices) || (min..=max).contains(&number),
            Self::Bits(bits) => number & !i32::from(bits) == 0,
        }
    }

    /// The listed values, if there are any.
    #[must_use]
    pub const fn choices(self) -> &'static [Choice] {
        match self {
            Self::OneOf(choices) | Self::OneOfOr(choices, _, _) => choices,
            Self::Any | Self::Within(..) | Self::Described(..) | Self::Bits(_) => &[],
        }
    }
}

/// The factory setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Factory {
    /// There is none (monitored values), or the manual prints none.
    None,
    /// The word.
    Value(u16),
    /// A rule in words ("by the drive's rating").
    Described(&'static str),
    /// By the word of another register, and the rule in words.
    Chosen(u16, &'static [(u16, u16)], &'static str),
    /// So many percent of what another register holds in the same unit, and the rule in words ("0.7 In").
    Percent(u16, u16, &'static str),
}

/// Why a factory setting is no number for a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum NoFactory {
    /// The manual prints none.
    NotPrinted,
    /// It prints this rule in words.
    Rule(&'static str),
    /// It depends on this register, of which nothing is known.
    Unknown(u16),
    /// It depends on this register, and the manual prints none for what that holds.
    NoneFor(u16, u16),
}

impl Factory {
    /// The words that a drive may have as factory setting which holds this: two where the manual's share is no whole count, for to
    /// which of them the drive rounds is printed nowhere.
    ///
    /// # Errors
    /// Why there is none.
    pub fn words(self, held: impl Fn(u16) -> Option<u16>) -> Result<[u16; 2], NoFactory> {
        let of = |register: u16| held(register).ok_or(NoFactory::Unknown(register));
        match self {
            Self::None => Err(NoFactory::NotPrinted),
            Self::Value(word) => Ok([word; 2]),
            Self::Described(rule) => Err(NoFactory::Rule(rule)),
            Self::Chosen(by, words, _) => {
                let known = of(by)?;
                let (_, word) =
                    words.iter().find(|(of, _)| *of == known).ok_or(NoFactory::NoneFor(by, known))?;
                Ok([*word; 2])
            }
            Self::Percent(by, percent, _) => {
                let known = of(by)?;
                let hundredfold = u32::from(known) * u32::from(percent);
                let (below, above) = (hundredfold / 100, hundredfold.div_ceil(100));
                match (u16::try_from(below), u16::try_from(above)) {
                    (Ok(below), Ok(above)) if known > 0 => Ok([below, above]),
                    _ => Err(NoFactory::NoneFor(by, known)),
                }
            }
        }
    }
}

/// How sure a fact is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Confidence {
    /// Printed in the drive's communication manual.
    Manual,
    /// Not there, but confirmed by another public document or by a program used in production.
    Elsewhere,
}

/// One register: everything that is known of it, and from where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Row {
    /// The space in which it stands: a holding register of all five families, any in a drive from a file.
    pub space: Space,
    /// The address on the wire.
    pub address: u16,
    /// The manual's mnemonic.
    pub code: &'static str,
    /// What it is, in plain English.
    pub name: &'static str,
    /// Who may write it.
    pub access: Access,
    /// Where a written value lives.
    pub storage: Storage,
    /// What a count means.
    pub unit: Unit,
    /// Which values it takes.
    pub range: Range,
    /// The factory setting.
    pub factory: Factory,
    /// How sure the row is.
    pub confidence: Confidence,
    /// Document and page or section.
    pub source: &'static str,
}

impl Row {
    /// The listed value that `word` stands for, if the register has a list and the word is on it.
    #[must_use]
    pub fn choice(&self, word: u16) -> Option<&'static Choice> {
        self.range.choices().iter().find(|choice| choice.value == word)
    }

    /// The word as a person reads it, with the meaning of a listed value.
    #[must_use]
    pub fn show(&self, word: u16) -> String {
        match self.choice(word) {
            Some(choice) if choice.meaning.is_empty() => format!("{word} {}", choice.code),
            Some(choice) => format!("{word} {} ({})", choice.code, choice.meaning),
            None => self.unit.show(word),
        }
    }

    /// The word that a person's text means for this register: a number in its unit, a hexadecimal word, or the
    /// mnemonic of a listed value. `None` when it is none of them.
    #[must_use]
    pub fn read(&self, text: &str) -> Option<u16> {
        let text = text.trim();
        let listed = self.range.choices().iter().find(|choice| choice.code == text);
        listed.map(|choice| choice.value).or_else(|| self.unit.read(text))
    }

    /// Where it stands: its address and the space of that.
    #[must_use]
    pub const fn place(&self) -> Place {
        Place { space: self.space, address: self.address }
    }

    /// The row whose mnemonic or decimal or hexadecimal address is `text`: `ACC`, `9001`, `W9001`, `2329h` or `0x2329`; an address alone
    /// is that of a holding register, `coil 14`, `discrete input 14` and `input register 14` are the others. A mnemonic in other letters
    /// is found where no second one differs from it by these alone.
    #[must_use]
    pub fn find(rows: &'static [Self], text: &str) -> Option<&'static Self> {
        let by_code = rows.iter().find(|row| row.code == text);
        by_code.or_else(|| {
            let at = |place: Place| rows.iter().find(|row| row.place() == place);
            if let Some(place) = Place::read(text) {
                return at(place);
            }
            let hexadecimal = text.strip_prefix("0x").or_else(|| text.strip_suffix(['h', 'H']));
            let address = match hexadecimal {
                Some(digits) => u16::from_str_radix(digits, 16),
                None => text.strip_prefix('W').unwrap_or(text).parse(),
            };
            match address {
                Ok(address) => at(address.into()),
                Err(_) => {
                    let mut alike = rows.iter().filter(|row| row.code.eq_ignore_ascii_case(text));
                    alike.next().filter(|_| alike.next().is_none())
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factory_setting_that_another_register_chooses_is_known_where_that_is() {
        let hertz = Factory::Chosen(3_015, &[(0, 500), (1, 600)], "50.0 Hz, with bFr = 60: 60.0 Hz");
        assert_eq!([0, 1].map(|word| hertz.words(|_| Some(word))), [Ok([500; 2]), Ok([600; 2])]);
        assert_eq!(hertz.words(|_| None), Err(NoFactory::Unknown(3_015)));
        assert_eq!(hertz.words(|_| Some(7)), Err(NoFactory::NoneFor(3_015, 7)));
        // 1.5 times 4.1 A are 6.15 A.
        let share = Factory::Percent(3_017, 150, "1.5 In");
        assert_eq!(share.words(|_| Some(41)), Ok([61, 62]));
        assert_eq!(share.words(|_| Some(40)), Ok([60, 60]));
        assert_eq!(share.words(|_| Some(0)), Err(NoFactory::NoneFor(3_017, 0)));
    }
}
