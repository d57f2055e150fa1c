//! What the bits of a motor that runs are taken for and cannot tell: who commands it, that it is at its setpoint, which way it turns, and
//! that it can be started.

use super::Check;
use crate::{
    format::{Action, Answer, Bits, Owner, Spanned, StateName},
    written::Written,
};

impl Bits {
    /// Whether one word can fit both.
    pub(super) fn meet(&self, other: &Self) -> bool {
        let is_contrary = self.differs != other.differs
            && self.mask.get_ref() == other.mask.get_ref()
            && self.value == other.value;
        self.register.get_ref() == other.register.get_ref()
            && !is_contrary
            && (self.differs
                || other.differs
                || (self.value ^ other.value) & self.mask.get_ref() & other.mask.get_ref() == 0)
    }

    /// Whether whatever fits these fits others.
    fn imply(&self, other: &Self) -> bool {
        let mask = *other.mask.get_ref();
        !self.differs
            && !other.differs
            && self.register.get_ref() == other.register.get_ref()
            && mask & !self.mask.get_ref() == 0
            && self.value & mask == other.value
    }
}

impl<'a> Check<'a> {
    pub(super) fn running(&mut self) {
        let file = self.file;
        for (key, owner) in [("command", &file.ownership.command), ("reference", &file.ownership.reference)] {
            self.owned_by_running(key, owner);
        }
        if let Some(at) = file.see.at_setpoint.given()
            && self.running_bits().next().is_some()
            && self.running_bits().all(|runs| runs.imply(at.get_ref()))
        {
            self.refuse(
                &at.span(),
                "at_setpoint is told of every motor that runs: it does not tell one that accelerates",
                "the bit that says that the output has reached the setpoint; \"unknown\" where there is none",
            );
        }
        self.turned_by_running();
        for (name, start) in file.actions().filter(|(name, _)| name.starts_with("start.")) {
            self.awaits_running(name, start);
            self.resets(name, start);
        }
    }

    fn running_bits(&self) -> impl Iterator<Item = &'a Bits> + use<'a> {
        let all = self.file.state.is.iter().map(Spanned::get_ref);
        all.filter(|is| is.state == StateName::Running).map(|is| is.bits.get_ref())
    }

    /// A motor that stands would be somebody else's, and one that the panel runs the bus's.
    fn owned_by_running(&mut self, key: &str, owner: &Answer<Spanned<Owner>>) {
        let Some(owner) = owner.given() else { return };
        let bits = &owner.get_ref().bits;
        if self.running_bits().any(|runs| runs.imply(bits) && bits.imply(runs)) {
            self.refuse(
                &owner.span(),
                format!("the {key} is told to be the bus's by the bits that show that the motor runs, whoever runs it"),
                "the bit that tells who commands it; \"none\" where the drive has none, \"unknown\" where nobody knows",
            );
        }
    }

    /// Bits that are the same in every motor that runs tell no direction of it.
    fn turned_by_running(&mut self) {
        let file = self.file;
        let (Some(direction), Some(_)) = (file.see.direction.given(), file.start.reverse.given()) else {
            return;
        };
        let Some(mask) = direction.get_ref().mask.as_ref().map(|mask| *mask.get_ref()) else { return };
        let fixed = |runs: &Bits| {
            let is_told = runs.register.get_ref() == direction.get_ref().register.get_ref()
                && !runs.differs
                && mask & !runs.mask.get_ref() == 0;
            is_told.then_some(runs.value & mask)
        };
        let mut told = self.running_bits().map(fixed);
        if let Some(Some(first)) = told.next()
            && told.all(|other| other == Some(first))
        {
            self.refuse(
                &direction.span(),
                format!("which way it turns is told by bits that are {first:04X}h in every motor that runs, whichever way"),
                "the bit that tells forward from reverse; \"unknown\" where none is known",
            );
        }
    }

    /// Before the run command nothing runs: whoever waits for that waits until the start is given up.
    fn awaits_running(&mut self, name: &str, start: &Spanned<Action>) {
        let Some((_, before)) = start.get_ref().steps.split_last() else { return };
        let states = || self.file.state.is.iter().map(Spanned::get_ref);
        // A narrower state of a motor that stands may come before that of one that runs.
        let runs = |bits: &Bits| {
            let first = states().find_map(|is| match is.state {
                StateName::Running if bits.imply(is.bits.get_ref()) => Some(true),
                StateName::Ready | StateName::Disabled | StateName::NotReady
                    if bits.meet(is.bits.get_ref()) =>
                {
                    Some(false)
                }
                _ => None,
            });
            first == Some(true)
        };
        let waits = before.iter().find(|step| step.get_ref().awaits.as_ref().is_some_and(runs));
        if let Some(waits) = waits {
            self.refuse(
                &waits.span(),
                format!("{name} waits for a motor that runs before it writes the run command"),
                "the bits that show that the drive takes the run command, or no await",
            );
        }
    }

    /// The bit by which [reset] resets, in the word of a start: it would reset whatever trip there is, and run.
    fn resets(&mut self, name: &str, start: &Spanned<Action>) {
        let file = self.file;
        let rises = file.reset_bits();
        let holds = |written: &Written| {
            let its = |rise: &&Written| (rise.space, rise.address) == (written.space, written.address);
            let is_held =
                |bits: u16| written.value & bits == bits && bits & !file.needed_to_run(*written) != 0;
            rises.iter().find(its).filter(|rise| is_held(rise.value))
        };
        let writes = file.writes(start.get_ref());
        if let Some((written, rise)) = writes.iter().find_map(|written| Some((written, holds(written)?))) {
            self.refuse(
                &start.span(),
                format!("{name} writes {:04X}h, which holds the bit by which the reset resets ({:04X}h)", written.value, rise.value),
                "the word of the start without that bit; where the run command has it as well, it stands in the mask and value of [command]",
            );
        }
    }
}
