//! States: none that covers another, none that hides a trip, and none that nobody can leave.

use super::Check;
use crate::format::{Access, Answer, Deed, Register, Space, Spanned, StateIs, StateName};
use crate::ladder::word;

/// Whether every word that fits the second fits the first.
fn covers(first: &StateIs, second: &StateIs) -> bool {
    let alike = first.bits.get_ref().differs == second.bits.get_ref().differs;
    let plain = !first.bits.get_ref().differs || first.bits.get_ref().value == second.bits.get_ref().value;
    alike
        && plain
        && meets(first, second)
        && first.bits.get_ref().mask.get_ref() & !second.bits.get_ref().mask.get_ref() == 0
}

fn meets(one: &StateIs, other: &StateIs) -> bool {
    one.bits.get_ref().meet(other.bits.get_ref())
}

/// Whether a state of a motor that stands takes words of one that runs without a look at the bits that show it. A state that looks at all
/// of them and more is a narrower one.
fn hides_running(before: &StateIs, state: &StateIs) -> bool {
    let (stands, runs) = (before.bits.get_ref(), state.bits.get_ref());
    state.state == StateName::Running
        && matches!(before.state, StateName::Ready | StateName::Disabled)
        && !runs.differs
        && meets(before, state)
        && runs.mask.get_ref() & !stands.mask.get_ref() != 0
}

pub(super) const fn is_fault(state: StateName) -> bool {
    matches!(state, StateName::Fault | StateName::FaultReaction)
}

impl Check<'_> {
    pub(super) fn states(&mut self) {
        let file = self.file;
        let all = &file.state.is;
        for (index, spanned) in all.iter().enumerate() {
            let state = spanned.get_ref();
            self.bits(state.bits.get_ref());
            for earlier in all.iter().take(index) {
                let before = earlier.get_ref();
                if covers(before, state) {
                    self.refuse(
                        &spanned.span(),
                        format!(
                            "this state is never seen: \"{}\" before it takes all of its words",
                            word(before.state)
                        ),
                        "masks that tell them apart, the narrower one first",
                    );
                } else if is_fault(state.state) && !is_fault(before.state) && meets(before, state) {
                    self.refuse(
                        &spanned.span(),
                        format!("a trip may be told as \"{}\", which stands before it", word(before.state)),
                        "the fault first",
                    );
                    // Once is enough, whatever else stands before it.
                    break;
                } else if hides_running(before, state) {
                    self.refuse(
                        &spanned.span(),
                        format!("a motor that runs may be told as \"{}\", which stands before it", word(before.state)),
                        "\"running\" first; or in the mask of the other the bits of \"running\", as they are then",
                    );
                    break;
                }
            }
        }
        self.ladder();
    }

    /// What a rung writes is a command, and so what an action may write: one word, in RAM, that is not kept from being written.
    fn rung(&mut self, name: &Spanned<String>, register: &Register) {
        let is_holding = self.file.place(register).is_some_and(|(space, _)| space == Space::HoldingRegister);
        if !is_holding || register.words.is_some() || register.access == Access::Read {
            self.refuse(
                &name.span(),
                format!("the ladder writes {}, which is no word that can be written", name.get_ref()),
                "a holding register of one word with access = \"read_write\"",
            );
        }
        if register.parameter {
            self.refuse(
                &name.span(),
                format!("the ladder writes {}, which is a parameter", name.get_ref()),
                "parameter = false: a command is no parameter",
            );
        }
        if let Some(why) = self.forbidden(register) {
            self.refuse(
                &name.span(),
                format!("the ladder writes {}, which is never written: {why}", name.get_ref()),
                "another register, or take it out of never_written",
            );
        }
        self.is_whole("the ladder", name, register);
        self.is_volatile("the ladder", name, register);
    }

    /// Each state that needs its ladder has a rung, or a start that leads out of it by itself.
    fn leads_out(&mut self) {
        let start = &self.file.start;
        let disabled = || {
            let states = self.file.state.is.iter();
            states.filter(|is| is.get_ref().state == StateName::Disabled)
        };
        let starts = [&start.forward, &start.reverse].into_iter().filter_map(Answer::given);
        // Whatever stands before the run command leads there.
        let bare = starts.into_iter().find(|start| start.get_ref().steps.len() == 1);
        match &start.ladder {
            Answer::None => {
                let (Some(bare), Some(_)) = (bare, disabled().next()) else { return };
                let at = self.line_of("ladder").unwrap_or_else(|| bare.span());
                self.refuse(
                    &at,
                    "a state that nobody can leave: [state] has one that is \"disabled\", which needs its ladder first, and there is none",
                    "ladder = [...] with a rung for each state that is no \"ready\", or state = \"not_ready\" where no word leads out of it",
                );
            }
            Answer::Given(rungs) => {
                let fits = |state: &StateIs, rung: &Spanned<crate::format::Rung>| {
                    let (state, rung) = (state.bits.get_ref(), &rung.get_ref().bits);
                    let mask = state.mask.get_ref() & rung.mask.get_ref();
                    state.register.get_ref() == rung.register.get_ref()
                        && (state.differs || rung.differs || (state.value ^ rung.value) & mask == 0)
                };
                let none = |state: &&Spanned<StateIs>| !rungs.iter().any(|rung| fits(state.get_ref(), rung));
                let lost: Vec<_> = disabled().filter(none).map(Spanned::span).collect();
                for span in lost {
                    self.refuse(
                        &span,
                        "a state that nobody can leave: no rung is for it",
                        "a rung of the ladder with these bits, and do = \"write\" with what leads out of it, or do = \"wait\"",
                    );
                }
            }
            Answer::Unknown => {}
        }
    }

    /// From each rung something leads on, and one leads to the run command.
    fn ladder(&mut self) {
        self.leads_out();
        let Some(rungs) = self.file.start.ladder.given() else { return };
        for spanned in rungs {
            let rung = spanned.get_ref();
            self.bits(&rung.bits);
            let writes = rung.register.is_some() && rung.word.is_some();
            let none = rung.register.is_none() && rung.word.is_none();
            if !(if rung.deed == Deed::Write { writes } else { none }) {
                self.refuse(
                    &spanned.span(),
                    "a state that nobody can leave: it is not said what is written there",
                    "do = \"write\" with register and word, or do = \"wait\" or \"run\" without them",
                );
            }
            if let (Some(register), Some(word)) = (&rung.register, rung.word) {
                let found = self.register(register);
                if let Some(found) = found {
                    self.rung(register, found);
                }
                let place = found.and_then(|register| self.file.place(register));
                if let Some((space, address)) = place
                    && self.file.runs(crate::written::Written { space, address, value: word })
                {
                    self.refuse(
                        &spanned.span(),
                        format!("{word:04X}h on the ladder runs the motor before it is asked to"),
                        "the words that lead to the run command, and not the run command",
                    );
                }
            }
        }
        let leads = |deed| rungs.iter().any(|rung| rung.get_ref().deed == deed);
        if let (Some(first), false) = (rungs.first(), leads(Deed::Run)) {
            self.refuse(
                &first.span(),
                "a state that nobody can leave: no rung leads to the run command",
                "a rung with do = \"run\" for the state in which it is due",
            );
        }
    }
}
