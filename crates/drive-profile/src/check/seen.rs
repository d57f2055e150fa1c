//! What is seen: measured by another register than the one that is written, and a stop by states that are its own.

use super::Check;
use crate::format::{Action, Answer, Spanned, StateName, UnitName};

impl Check<'_> {
    /// A drive in a quick stop is braked on, by another stop than the one that would be told.
    pub(super) fn is_no_quick_stop(&mut self, name: &str, stop: &Action) {
        let Some(seen) = stop.seen.as_ref().filter(|_| name != "stop.fast") else { return };
        if seen.get_ref().contains(&StateName::QuickStop) {
            self.refuse(
                &seen.span(),
                format!("{name} is said to be done in a quick stop, which is another one and brakes on"),
                "quick_stop in the `seen` of stop.fast alone; here the states in which no run command acts, a trip among them",
            );
        }
    }

    /// A value is told in the unit of its quantity, and never in another: a register of another unit would show nothing, or something else.
    pub(super) fn is_in_its_unit(&mut self, what: &str, seen: &Answer<Spanned<String>>, units: &[UnitName]) {
        let Some(name) = seen.given() else { return };
        let Some(register) = self.file.named(name.get_ref()) else { return };
        if !units.contains(&register.unit) {
            let its = units.iter().map(|unit| unit.symbol()).collect::<Vec<_>>().join(" or ");
            self.refuse(
                &name.span(),
                format!("{} does not tell the {what} that is seen in it: it is not in {its}", name.get_ref()),
                "the register of that quantity, with its unit; else \"unknown\"",
            );
        }
    }

    /// An output that reads what was written bears out every start by its own echo.
    pub(super) fn is_no_echo(&mut self, seen: &Answer<Spanned<String>>) {
        let file = self.file;
        let Some(name) = seen.given() else { return };
        let setpoint = file.setpoint.given().and_then(|of| file.named(of.get_ref().register.get_ref()));
        let written = setpoint.and_then(|of| file.place(of)).into_iter().chain(file.commanded());
        let place = file.named(name.get_ref()).and_then(|of| file.place(of));
        if written.into_iter().any(|of| Some(of) == place) {
            self.refuse(
                &name.span(),
                format!("{} is what was written, and shows nothing of the motor", name.get_ref()),
                "the register of the output as the drive measures it, or \"unknown\"",
            );
        }
    }
}
