//! Guards, fingerprints, and every other place that names a register.

use crate::format::Spanned;

use super::Check;
use crate::{
    format::{Access, Answer, Bits, Guard, Register, UnitName},
    read_back::ReadBack,
};

impl Check<'_> {
    pub(super) fn who(&mut self) {
        let file = self.file;
        for guards in [&file.who.fingerprints, &file.who.guards] {
            for guard in guards.given().into_iter().flatten() {
                self.guard(guard);
            }
        }
        for fingerprint in file.who.fingerprints.given().into_iter().flatten() {
            self.fingerprint(fingerprint);
        }
        let set_up = file.who.guards.given().into_iter().flatten().find(|guard| guard.get_ref().set_up);
        if let (Some(guard), None) = (set_up, file.setup.given()) {
            self.refuse(
                &guard.span(),
                "a guard is said to be made true by `setup`, and there is none",
                "a table [setup], or set_up = false",
            );
        }
        let see = &file.see;
        for seen in file.measured() {
            if let Some(name) = seen.given() {
                self.readable(name);
            }
        }
        for seen in [&see.output, &see.speed] {
            self.is_no_echo(seen);
        }
        for (what, seen, units) in [
            ("output", &see.output, &[UnitName::Hertz, UnitName::Percent][..]),
            ("current", &see.current, &[UnitName::Ampere]),
            ("speed", &see.speed, &[UnitName::Rpm]),
            ("output voltage", &see.output_voltage, &[UnitName::Volt]),
            ("dc bus voltage", &see.dc_bus_voltage, &[UnitName::Volt]),
        ] {
            self.is_in_its_unit(what, seen, units);
        }
        for bits in [&see.at_setpoint, &see.warning, &file.state.standstill] {
            if let Answer::Given(bits) = bits {
                self.bits(bits.get_ref());
            }
        }
        for owner in
            [&file.ownership.command, &file.ownership.reference].into_iter().filter_map(Answer::given)
        {
            self.bits(&owner.get_ref().bits);
        }
        if let Some(read) = file.ownership.reads_back.given() {
            self.reads_back(&read.get_ref().register);
            self.source(&read.get_ref().source);
        }
        if let Some(codes) = file.faults.codes.given() {
            self.source(&codes.get_ref().source);
        }
        self.direction();
        self.watchdog();
    }

    /// The register in which a command reads back is that of the run words. One that tells the state when it is read is none.
    fn reads_back(&mut self, name: &Spanned<String>) {
        self.readable(name);
        let file = self.file;
        let is_it = |other: &Spanned<String>| other.get_ref() == name.get_ref();
        let mut runs = file.command.given().into_iter().flat_map(|of| &of.get_ref().runs);
        let tells_the_state = file.state.is.iter().any(|is| is_it(&is.get_ref().bits.get_ref().register));
        if !runs.any(|run| is_it(&run.get_ref().register)) || tells_the_state {
            self.refuse(
                &name.span(),
                format!("reads_back names {}, which has no run word of [command], or tells the state", name.get_ref()),
                "the register of the run words, where it holds the command when it is read; else \"none\" or \"unknown\"",
            );
            return;
        }
        let Some(read_back) = ReadBack::of(file).filter(ReadBack::is_split) else { return };
        let all = file.register.iter().map(|(name, register)| (name, register.get_ref()));
        let cell =
            |of: &(&String, &Register)| file.place(of.1).is_some_and(|at| read_back.cells().contains(&at));
        let cells: Vec<_> = all.filter(cell).collect();
        if let Some((other, _)) = cells.iter().find(|(_, of)| of.access == Access::Write) {
            self.refuse(
                &name.span(),
                format!(
                    "a start runs by {other} and not by {}, and {other} can only be written",
                    name.get_ref()
                ),
                format!("access = \"read_write\" where {other} reads back; else reads_back = \"none\""),
            );
        }
        let most = read_back.most();
        let mut written = file.actions().flat_map(|(_, action)| file.writes(action.get_ref()));
        if written
            .any(|of| read_back.cells().contains(&(of.space, of.address)) && of.value >= most && most > 1)
        {
            self.refuse(
                &name.span(),
                format!("the command stands in {} registers, and by {most:04X}h and more in one of them no run command is told from another", cells.len()),
                "reads_back = \"unknown\"",
            );
        }
    }

    fn guard(&mut self, spanned: &Spanned<Guard>) {
        let guard = spanned.get_ref();
        self.readable(&guard.register);
        self.source(&guard.source);
        let owners = [&self.file.ownership.command, &self.file.ownership.reference];
        let mut owned = owners.into_iter().filter_map(Answer::given).map(|owner| &owner.get_ref().bits);
        let mask = guard.mask.unwrap_or(u16::MAX);
        if owned.any(|bits| {
            bits.register.get_ref() == guard.register.get_ref() && mask & bits.mask.get_ref() != 0
        }) {
            self.refuse(
                &spanned.span(),
                format!(
                    "{} tells who commands just now, and a guard says what the drive is: once another commands, its stop would be \
                     withheld",
                    guard.register.get_ref()
                ),
                "nothing here, [ownership] says it; a guard is a setting, such as the parameter that gives the command to the bus",
            );
        }
        let words = || [&guard.is, &guard.is_not].into_iter().flatten().flatten();
        if words().next().is_none() || guard.is.is_some() == guard.is_not.is_some() {
            self.refuse(
                &spanned.span(),
                "it is not said what this register has to hold",
                "is = [...] or is_not = [...], one of them",
            );
        }
        if let Some(word) = words().find(|word| **word & !mask != 0) {
            self.refuse(
                &spanned.span(),
                format!("{word:04X}h has bits that its mask {mask:04X}h has not: it never reads so"),
                format!("{:04X}h, or a mask with these bits", word & mask),
            );
        }
    }

    fn direction(&mut self) {
        let Some(spanned) = self.file.see.direction.given() else { return };
        let direction = spanned.get_ref();
        let is_signed = self.readable(&direction.register).is_none_or(|register| register.signed);
        self.source(&direction.source);
        let told = match (&direction.mask, direction.forward, direction.reverse) {
            (None, None, None) => is_signed,
            (Some(mask), Some(forward), Some(reverse)) => {
                let mask = *mask.get_ref();
                mask != 0 && forward != reverse && (forward | reverse) & !mask == 0
            }
            _ => false,
        };
        if !told {
            self.refuse(
                &spanned.span(),
                "it is not said how forward and reverse look",
                "mask, forward and reverse, two values of its bits; or a signed register and none of them",
            );
        }
    }

    fn watchdog(&mut self) {
        let Some(spanned) = self.file.watchdog.given() else { return };
        let watchdog = spanned.get_ref();
        self.source(&watchdog.source);
        for name in [&watchdog.time, &watchdog.action].into_iter().filter_map(Answer::given) {
            self.register(name);
        }
    }

    /// Bits that say something: of a register that can be read, and possible.
    pub(super) fn bits(&mut self, bits: &Bits) {
        self.readable(&bits.register);
        self.source(&bits.source);
        self.mask(bits);
    }

    /// A mask that has bits, and a value that has no others.
    pub(super) fn mask(&mut self, bits: &Bits) {
        let mask = *bits.mask.get_ref();
        if mask == 0 || bits.value & !mask != 0 {
            self.refuse(
                &bits.mask.span(),
                format!("mask {mask:04X}h and value {:04X}h never fit", bits.value),
                "a mask of the bits that count, and the value of these bits alone",
            );
        }
    }

    /// A register that can be read.
    pub(super) fn readable(&mut self, name: &Spanned<String>) -> Option<&crate::format::Register> {
        let register = self.register(name)?;
        if register.access == Access::Write {
            self.refuse(
                &name.span(),
                format!("{} can only be written", name.get_ref()),
                "a register that the drive lets be read, or \"none\"",
            );
        }
        Some(register)
    }
}
