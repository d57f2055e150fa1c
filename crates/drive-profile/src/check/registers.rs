//! Registers: addresses, spaces, scales, and what may not be written.

use crate::format::Spanned;

use super::Check;
use crate::drive::is_double;
use crate::format::{Access, Register, Storage, UnitName};

impl Check<'_> {
    pub(super) fn registers(&mut self) {
        let file = self.file;
        let functions: Vec<u8> =
            file.link.get_ref().functions.iter().map(|function| *function.get_ref()).collect();
        let link_source = file.link.get_ref().source.clone();
        self.source(&link_source);
        for (name, spanned) in &file.register {
            let register = spanned.get_ref();
            self.source(&register.source);
            let Some((space, first)) = file.place(register) else {
                self.refuse(
                    &register.address.span(),
                    format!("{} is no address as this file counts them", register.address.get_ref()),
                    "the manual's number, and `numbering` as the manual counts",
                );
                continue;
            };
            if name.is_empty() || name.len() > 32 || name.chars().any(char::is_control) {
                self.refuse(&spanned.span(), "this is no mnemonic", "the manual's, of at most 32 characters");
            }
            let words = register.words.as_ref().map_or(1, |words| *words.get_ref());
            if !matches!(words, 1 | 2) || first.checked_add(u16::from(words) - 1).is_none() {
                self.refuse(&spanned.span(), format!("{name} has {words} words"), "words = 1 or 2");
            }
            if (words == 2) != register.order.is_some() {
                self.refuse(
                    &spanned.span(),
                    format!("of {name} it is not said which of two words is first, or there is only one"),
                    "words = 2 and order = \"high_first\" or \"low_first\", or neither",
                );
            }
            if space.is_bit() && (words != 1 || register.byte.is_some() || register.scale.is_some()) {
                self.refuse(
                    &spanned.span(),
                    format!("{name} is one bit"),
                    "a coil or input without words, byte and scale",
                );
            }
            let readable = register.access != Access::Write;
            if readable && !functions.contains(&space.read_by()) {
                self.refuse(
                    &spanned.span(),
                    format!("{name} is read by function {}, which the drive has not", space.read_by()),
                    "the function in `functions`, or access = \"write\"",
                );
            }
            self.scale(name, spanned);
            self.writable(name, spanned);
            if let Some(of) = &register.decimals_in {
                self.register(of);
            }
        }
        self.addresses_differ();
    }

    /// A scale that cannot be turned round gives no word for a value.
    fn scale(&mut self, name: &str, spanned: &Spanned<Register>) {
        let register = spanned.get_ref();
        let Some(scale) = &register.scale else { return };
        let [numerator, denominator] = *scale.get_ref();
        let fits = |part: i64| (1..=1_000_000_000).contains(&part);
        if !fits(numerator) || !fits(denominator) {
            self.refuse(
                &scale.span(),
                format!("the scale of {name} cannot be turned round"),
                "scale = [how many units, are how many counts], both above 0, such as [1, 100] for 0.01",
            );
        }
        if matches!(register.unit, UnitName::Bits | UnitName::Code) {
            self.refuse(&scale.span(), format!("{name} has a scale and no unit"), "unit = \"Hz\" or another");
        }
    }

    fn writable(&mut self, name: &str, spanned: &Spanned<Register>) {
        let register = spanned.get_ref();
        let Some((space, _)) = self.file.place(register) else { return };
        if register.access == Access::Read {
            if register.parameter {
                self.refuse(
                    &spanned.span(),
                    format!("{name} is a parameter that nobody can write"),
                    "parameter = false",
                );
            }
            return;
        }
        let functions = &self.file.link.get_ref().functions;
        let can = |by: [u8; 2]| functions.iter().any(|function| by.contains(function.get_ref()));
        if !space.written_by().is_some_and(can) {
            self.refuse(
                &spanned.span(),
                format!("no function of the drive writes {name}"),
                "access = \"read\", or the function in `functions`",
            );
        }
        if register.storage.is_none() {
            self.refuse(
                &spanned.span(),
                format!("where a value lives that is written to {name} is left in silence"),
                "storage = \"ram\", \"ram_until_saved\", \"eeprom\" or \"unknown\"",
            );
        }
        if let Some(why) = self.forbidden(register) {
            self.refuse(
                &spanned.span(),
                format!("{name} can be written and is never written: {why}"),
                "access = \"read\", or take it out of never_written",
            );
        }
        if register.words.is_some() && register.parameter {
            self.refuse(&spanned.span(), format!("{name} is a parameter of two words"), "parameter = false");
        }
    }

    /// Why a register is never written, where it is not: also by its second word.
    pub(super) fn forbidden(&self, register: &Register) -> Option<String> {
        self.forbidden_block(
            register,
            usize::from(register.words.as_ref().map_or(1, |words| *words.get_ref())),
        )
    }

    /// Why so many registers from this one on are never written, where one of them is not.
    pub(super) fn forbidden_block(&self, register: &Register, count: usize) -> Option<String> {
        let first = *register.address.get_ref();
        let last = first.saturating_add(u32::try_from(count.saturating_sub(1)).unwrap_or(u32::MAX));
        let all = self.file.never_written.given()?;
        let found = all.iter().find(|of| *of.get_ref().from.get_ref() <= last && first <= of.get_ref().to);
        found.map(|of| of.get_ref().why.clone())
    }

    /// One address has one name, and so one meaning; but a word may be told as its two bytes.
    fn addresses_differ(&mut self) {
        let file = self.file;
        let mut seen = std::collections::BTreeMap::new();
        for (name, spanned) in &file.register {
            let register = spanned.get_ref();
            let Some(place) = file.place(register) else { continue };
            let part = register.byte.map(|byte| byte as u8);
            if let Some(other) = seen.insert((place, part), name) {
                self.refuse(
                    &spanned.span(),
                    format!("{name} and {other} have one address"),
                    "one of them alone, and its name wherever the other stood; or the address that the manual prints for it",
                );
            }
        }
        for (name, spanned) in &file.register {
            let Some((space, first)) = file.place(spanned.get_ref()).filter(|_| is_double(spanned.get_ref()))
            else {
                continue;
            };
            let second = first.checked_add(1).map(|second| (space, second));
            let other = file.register.iter().find(|(_, other)| file.place(other.get_ref()) == second);
            if let Some((other, _)) = other {
                self.refuse(
                    &spanned.span(),
                    format!("{name} has two words, and {other} is one of them"),
                    "words = 1, or the address that the manual prints for each",
                );
            }
        }
        for of in file.never_written.given().into_iter().flatten() {
            self.source(&of.get_ref().source);
            if of.get_ref().to < *of.get_ref().from.get_ref() {
                self.refuse(
                    &of.get_ref().from.span(),
                    "the range runs backwards",
                    "from = the lower, to = the higher",
                );
            }
        }
    }

    /// That a write to a register is kept in RAM alone: what goes to an EEPROM is no command and no setpoint.
    pub(super) fn is_volatile(&mut self, what: &str, name: &Spanned<String>, register: &Register) {
        if let Some(storage) = &register.storage
            && *storage.get_ref() == Storage::Eeprom
        {
            self.refuse(
                &storage.span(),
                format!("{what} writes {}, which wears an EEPROM", name.get_ref()),
                "the register that is kept in RAM, which most drives have beside it",
            );
        }
    }
}
