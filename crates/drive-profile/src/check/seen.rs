//! What is measured: by another register than the one that is written.

use super::Check;
use crate::format::{Answer, Spanned};

impl Check<'_> {
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
