//! Fingerprints: what only this drive reads so, whatever it does and however it is set.

use super::Check;
use crate::{
    format::{Access, Answer, Guard, Spanned},
    ladder::word,
};

/// What a fingerprint is instead.
const INSTEAD: &str = "a register that holds the type of the drive, which its manual prints as one number; else fingerprints = \"unknown\": a person tries it";

impl Check<'_> {
    pub(super) fn fingerprint(&mut self, spanned: &Spanned<Guard>) {
        let guard = spanned.get_ref();
        let name = guard.register.get_ref();
        let file = self.file;
        let Some(register) = file.named(name) else { return };
        let place = file.place(register);
        let is_it =
            |other: &Spanned<String>| file.named(other.get_ref()).and_then(|of| file.place(of)) == place;
        let guards = file.who.guards.given().into_iter().flatten();
        let why = if guards.into_iter().any(|of| is_it(&of.get_ref().register)) {
            format!("{name} is a guard as well: a setting tells no drive from another")
        } else if register.access != Access::Read {
            format!("{name} can be written: a setting tells no drive from another")
        } else if file.measured().into_iter().filter_map(Answer::given).any(is_it) {
            format!("{name} changes while the drive works: it tells no drive from another")
        } else if let Some(state) = self.denied_state(guard) {
            format!("{name} does not read so while it is {state}: it tells no drive from another")
        } else if guard.is.as_ref().is_some_and(|is| is.contains(&0)) {
            format!("{name}: 0 is what most registers of most drives read: it tells no drive from another")
        } else {
            return;
        };
        self.refuse(&spanned.span(), why, INSTEAD);
    }

    /// A state in which a fingerprint in the register of the states would not hold.
    fn denied_state(&self, guard: &Guard) -> Option<&'static str> {
        let is = guard.is.as_ref()?;
        let of_register = || {
            let states = self.file.state.is.iter().map(Spanned::get_ref);
            states.filter(|state| state.bits.get_ref().register.get_ref() == guard.register.get_ref())
        };
        // What one state looks at and another does not may be anything in that one.
        let told = of_register().fold(0, |told, state| told | state.bits.get_ref().mask.get_ref());
        let told = told & guard.mask.unwrap_or(u16::MAX);
        let denies = |state: &crate::format::StateIs| {
            let bits = state.bits.get_ref();
            let fits = |word: &u16| (word ^ bits.value) & told == 0;
            !bits.differs && (bits.mask.get_ref() & told != told || !is.iter().any(fits))
        };
        of_register().find(|state| denies(state)).map(|state| word(state.state))
    }
}
