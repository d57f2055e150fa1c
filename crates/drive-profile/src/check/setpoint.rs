//! The setpoint: of a unit that can be turned into counts and back, within limits, in RAM.

use super::Check;
use crate::format::{Access, Spanned, UnitName};

impl Check<'_> {
    pub(super) fn setpoint(&mut self) {
        let file = self.file;
        let Some(spanned) = file.setpoint.given() else { return };
        let setpoint = spanned.get_ref();
        self.source(&setpoint.source);
        let limits = setpoint.limits.get_ref();
        if limits.low < 0 || limits.low >= limits.high {
            self.refuse(
                &setpoint.limits.span(),
                "a setpoint without limits: the lowest is not below the highest, or below 0",
                "limits = { low = 0, high = ... } in counts; which way it turns is the start's",
            );
        }
        if let Some(name) = &limits.high_in
            && name.get_ref() != "owner"
        {
            self.readable(name);
        }
        let Some(register) = self.register(&setpoint.register) else { return };
        let highest = if register.signed { i32::from(i16::MAX) } else { i32::from(u16::MAX) };
        if limits.high > highest {
            self.refuse(
                &setpoint.limits.span(),
                format!("{} cannot hold {}", setpoint.register.get_ref(), limits.high),
                format!("high = at most {highest}"),
            );
        }
        let is_speed = matches!(register.unit, UnitName::Hertz | UnitName::Rpm | UnitName::Percent);
        if !is_speed || register.scale.is_none() || register.words.is_some() || register.byte.is_some() {
            self.refuse(
                &setpoint.register.span(),
                format!(
                    "{} is no setpoint: that is one whole word in Hz, rpm or %, with its scale",
                    setpoint.register.get_ref()
                ),
                "unit = \"Hz\", \"rpm\" or \"%\" and scale = [1, 100] for 0.01 under its register, without `words` and `byte`",
            );
        }
        let wanted = [
            (&limits.high_in, "high_in", register.unit),
            (&setpoint.full_scale, "full_scale", UnitName::Hertz),
        ];
        for (name, key, unit) in wanted {
            self.counts_in(name.as_ref(), key, unit);
        }
        if let Some(full) = &setpoint.full_scale {
            if register.unit != UnitName::Percent {
                self.refuse(
                    &full.span(),
                    "only what counts in percent has a full scale",
                    "nothing, or unit = \"%\"",
                );
            }
            if full.get_ref() != "owner" {
                self.readable(full);
            }
        } else if register.unit == UnitName::Percent {
            self.refuse(
                &setpoint.register.span(),
                "of how much it counts percent is left in silence",
                "full_scale = the register that holds 100 %, or \"owner\"",
            );
        }
        if setpoint.sign_is_direction && !register.signed {
            self.refuse(
                &spanned.span(),
                "a sign that the register has not",
                "signed = true, or sign_is_direction = false",
            );
        }
        if register.access == Access::Read {
            self.refuse(
                &setpoint.register.span(),
                "a setpoint that nobody can write",
                "access = \"read_write\"",
            );
        }
        if register.parameter {
            self.refuse(
                &setpoint.register.span(),
                "the setpoint is among the parameters",
                "parameter = false: a setpoint is no parameter",
            );
        }
        if let Some(why) = self.forbidden(register) {
            self.refuse(
                &setpoint.register.span(),
                format!("the setpoint is never written: {why}"),
                "another register",
            );
        }
        self.is_volatile("the setpoint", &setpoint.register, register);
    }

    /// A register with which a setpoint is compared, or by which it is scaled, counts in a unit that can be.
    fn counts_in(&mut self, name: Option<&Spanned<String>>, key: &str, unit: UnitName) {
        let Some(name) = name.filter(|name| name.get_ref() != "owner") else { return };
        let Some(register) = self.file.named(name.get_ref()) else { return };
        if register.unit != unit || register.scale.is_none() {
            let counts = match register.unit.symbol() {
                "" => "no unit",
                symbol => symbol,
            };
            let setpoint = if key == "high_in" { "the setpoint" } else { "100 % of the setpoint" };
            self.refuse(
                &name.span(),
                format!("{} counts in {counts}, and {setpoint} in {}", name.get_ref(), unit.symbol()),
                format!("{key} = a register in {} with its scale, or \"owner\"", unit.symbol()),
            );
        }
    }
}
