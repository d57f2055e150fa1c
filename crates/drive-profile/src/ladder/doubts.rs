//! Numbers that can be so, and mostly are a slip: told as a question, and held below a level until it is answered.

use super::{Ladder, Level};
use crate::{
    format::{Numbering, Register, Rung, Setpoint, Space, Spanned, UnitName},
    scale::hundredths,
};

/// The highest setpoint that is no slip of a scale: faster than any spindle that these drives turn, and more than any full scale allows.
const HIGHEST_HERTZ: i64 = 1_000;
const HIGHEST_PERCENT: i64 = 400;

/// What a highest setpoint is above, in hundredths: below it limits were written in the unit instead of in counts.
const LEAST_HIGHEST: i64 = 100;

/// How manuals print holding registers that they count from 40001.
const PRINTED: std::ops::RangeInclusive<u32> = 40_001..=49_999;

/// How far apart addresses are at the most that stand beside each other.
const NEAR: u32 = 0x100;

impl Ladder<'_> {
    /// How fast it would turn at the highest that its setpoint may be.
    pub(super) fn highest(&mut self, setpoint: &Spanned<Setpoint>) {
        let fact = setpoint.get_ref();
        let Some(register) = self.file.named(fact.register.get_ref()) else { return };
        let Some([numerator, denominator]) = register.scale.as_ref().map(|scale| *scale.get_ref()) else {
            return;
        };
        let most = match register.unit {
            UnitName::Hertz => HIGHEST_HERTZ,
            UnitName::Percent => HIGHEST_PERCENT,
            _ => return,
        };
        let high = hundredths(fact.limits.get_ref().high.into(), numerator, denominator);
        let (unit, limits) = (register.unit.symbol(), fact.limits.span().start);
        if high > most * 100 {
            self.keep(
                Level::Motion,
                limits,
                &format!("its setpoint would go up to {}.{:02} {unit}", high / 100, high % 100),
                "is the scale of its register right, and what is the highest that the manual allows?",
            );
        } else if high < LEAST_HIGHEST {
            self.keep(
                Level::Motion,
                limits,
                &format!("its setpoint would go no higher than {}.{:02} {unit}", high / 100, high % 100),
                "are the limits written in counts of its register, by its scale, and not in its unit?",
            );
        }
    }

    /// A count that is worth more than a hertz: a scale that is upside down.
    pub(super) fn coarse(&mut self, name: &str, register: &Register) {
        let Some(scale) = register.scale.as_ref().filter(|_| register.unit == UnitName::Hertz) else {
            return;
        };
        let [numerator, denominator] = *scale.get_ref();
        let one = hundredths(1, numerator, denominator);
        if one > 100 {
            self.keep(
                Level::Motion,
                scale.span().start,
                &format!("one count of {name} would be {}.{:02} Hz", one / 100, one % 100),
                "is its scale upside down? [1, 100] is 0.01 Hz for one count",
            );
        }
    }

    /// A word that two rungs write from different states: a drive that has come from the one to the other by it holds it already.
    pub(super) fn rungs(&mut self) {
        let file = self.file;
        let Some(rungs) = file.start.ladder.given().filter(|_| !self.is_tried(Level::Motion)) else { return };
        let writes = |rung: &Spanned<Rung>| {
            let rung = rung.get_ref();
            rung.word.zip(rung.register.as_ref().map(|name| name.get_ref().clone()))
        };
        for (at, rung) in rungs.iter().enumerate() {
            let Some(written) = writes(rung) else { continue };
            if rungs.iter().take(at).any(|before| writes(before).as_ref() == Some(&written)) {
                self.keep(
                    Level::Motion,
                    rung.span().start,
                    &format!(
                        "two rungs of its ladder write {:04X}h, and the second may lead nowhere",
                        written.0
                    ),
                    "which word leads out of each of the two states?",
                );
            }
        }
    }

    /// A number in hex without its 0x: far from all others, and beside them as one in hex.
    pub(super) fn hex(&mut self) {
        if self.is_tried(Level::Stop) {
            return;
        }
        let file = self.file;
        let space = |register: &Register| register.space.unwrap_or(file.link.get_ref().space);
        let number = |register: &Register| *register.address.get_ref();
        let all: Vec<_> = file.register.iter().map(|(name, of)| (name, of.get_ref())).collect();
        for &(name, register) in &all {
            let address = number(register);
            let Ok(in_hex) = u32::from_str_radix(&address.to_string(), 16) else { continue };
            let is_near = |to: u32| {
                let others = all.iter().filter(|(other, of)| *other != name && space(of) == space(register));
                others.into_iter().any(|(_, of)| number(of).abs_diff(to) <= NEAR)
            };
            if !is_near(address) && is_near(in_hex) {
                self.keep(
                    Level::Stop,
                    register.address.span().start,
                    &format!("{name} has the address {address}, far from all others, and {address}h would stand beside them"),
                    &format!("is it a number in hex? 0x{address} then"),
                );
            }
        }
    }

    /// Addresses that look as manuals print them from 40001, in a file that counts them otherwise.
    pub(super) fn numbering(&mut self) {
        let file = self.file;
        let link = file.link.get_ref();
        let space = |register: &Register| register.space.unwrap_or(link.space);
        let all =
            file.register.values().map(Spanned::get_ref).filter(|of| space(of) == Space::HoldingRegister);
        let mut numbers = all.map(|register| *register.address.get_ref()).peekable();
        let is_printed = numbers.peek().is_some() && numbers.all(|number| PRINTED.contains(&number));
        if is_printed && link.numbering != Numbering::From40001 && !self.is_tried(Level::Stop) {
            self.ask(
                Level::Stop,
                "numbering",
                "all its addresses are 40001 to 49999, as manuals print them that count from 40001, and this file counts otherwise",
                "does the manual count from 40001? numbering = \"from_40001\" then",
            );
        }
    }
}
