//! The one piece by which every family keeps its lease and judges it: [`OwnRun`], from the [`Evidence`] that the family finds
//! in a drive's words.

use crate::{
    error::Refusal,
    lease::{Lack, Lease, Verdict},
};

/// What the drive's own words say of the run command that was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RunWord {
    /// It stands in the drive.
    Stands,
    /// No run command stands there.
    Gone,
    /// Another run command stands there: somebody else's, or one of this side from before.
    Another,
    /// These words do not tell.
    #[default]
    NotTold,
}

/// One thing that a run command needs to act, as the drive's words tell it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Told {
    /// It is there.
    Yes,
    /// It is not there, because of this.
    No(Refusal),
    /// These words do not tell.
    #[default]
    NotTold,
}

impl Told {
    /// Whether `lacks` keeps it away; nothing does: it is there.
    #[must_use]
    pub fn unless(lacks: Option<Refusal>) -> Self {
        lacks.map_or(Self::Yes, Self::No)
    }
}

/// What a drive's words say of the run command that this side has given, each part by itself. [`OwnRun::judge`] makes the
/// verdict of it, the same for every family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Evidence {
    /// Whether the run command stands.
    pub word: RunWord,
    /// Whether the bus is the active source of commands.
    pub command: Told,
    /// Whether the motor is driven, or may be: nothing cuts, brakes or holds it.
    pub output: Told,
    /// Whether the motor follows the reference of the bus, in the direction that was commanded.
    pub reference: Told,
}

/// The run command of this side, from before it is written until the drive's own words showed that it stands no more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OwnRun {
    lease: Option<Lease>,
    /// The one that stood when the present one was given.
    before: Option<Lease>,
    /// Whether the drive has said that it took it. While it has not, that it does not stand says nothing: it may be on its way.
    arrived: bool,
}

impl OwnRun {
    /// None was given.
    #[must_use]
    pub const fn new() -> Self {
        Self { lease: None, before: None, arrived: false }
    }

    /// The run command that stands, or may.
    #[must_use]
    pub const fn lease(&self) -> Option<Lease> {
        self.lease
    }

    /// Whether the drive has shown that it took it.
    #[must_use]
    pub const fn has_arrived(&self) -> bool {
        self.arrived
    }

    /// A run command is about to be written.
    pub const fn give(&mut self, lease: Lease) {
        if self.arrived {
            self.before = self.lease;
        }
        (self.lease, self.arrived) = (Some(lease), false);
    }

    /// The drive has confirmed the write.
    pub const fn was_written(&mut self) {
        (self.before, self.arrived) = (None, self.lease.is_some());
    }

    /// It is certain that the write did not arrive: it was never sent, or the drive has refused it.
    pub const fn was_not_written(&mut self) {
        (self.lease, self.arrived) = (self.before, self.before.is_some());
        self.before = None;
    }

    /// One of an earlier run of the program. The next evidence of its word ends it where it does not stand.
    pub const fn adopt(&mut self, lease: Lease) {
        (self.lease, self.before, self.arrived) = (Some(lease), None, true);
    }

    /// The drive was seen to hold another word of this side in its place: a stop, a withdrawal, a reset.
    pub const fn end(&mut self) {
        *self = Self::new();
    }

    /// The verdict on the run command, if one stands. A word that took its place ends it; the verdict says so once.
    pub fn judge(&mut self, evidence: &Evidence) -> Option<Verdict> {
        const GONE: Refusal = Refusal::Overridden {
            by: "another word, or a power cycle, that took the place of the run command,",
            remedy: "start it again if it is to run",
        };
        const ANOTHER: Refusal = Refusal::Overridden {
            by: "another run command, which took the place of the one that was given,",
            remedy: "see which master has given it, and stop the motor unless it is to run",
        };
        const UNSEEN: Refusal = Refusal::Overridden {
            by: "the word that stood before, for the run command was not seen to arrive and may come late,",
            remedy: "stop it, and start again",
        };
        self.lease?;
        self.arrived |= evidence.word == RunWord::Stands;
        let gone = match evidence.word {
            RunWord::Stands | RunWord::NotTold => None,
            _ if !self.arrived => Some(UNSEEN),
            RunWord::Gone => Some(GONE),
            RunWord::Another => Some(ANOTHER),
        };
        if let Some(because) = gone {
            if self.arrived {
                self.end();
            }
            return Some(Verdict::lacks(Lack::Command, because));
        }
        let parts = [
            (Lack::Command, evidence.command),
            (Lack::Output, evidence.output),
            (Lack::Reference, evidence.reference),
        ];
        let lacking = parts.iter().find_map(|&(lack, told)| match told {
            Told::No(because) => Some(Verdict::lacks(lack, because)),
            Told::Yes | Told::NotTold => None,
        });
        let proven = evidence.word == RunWord::Stands && parts.iter().all(|&(_, told)| told == Told::Yes);
        Some(lacking.unwrap_or(if proven { Verdict::InForce } else { Verdict::NotKnown }))
    }
}

#[cfg(test)]
mod tests {
    use crate::{setpoint::Direction, status::Control};

    use super::*;

    const RUN: Lease = Lease::new(Direction::Forward, 0x000F);
    const IN_FORCE: Evidence =
        Evidence { word: RunWord::Stands, command: Told::Yes, output: Told::Yes, reference: Told::Yes };

    fn given() -> OwnRun {
        let mut own = OwnRun::new();
        own.give(RUN);
        own.was_written();
        own
    }

    #[test]
    fn only_a_run_command_of_which_every_part_is_proven_is_in_force() {
        assert_eq!(OwnRun::new().judge(&IN_FORCE), None);
        assert_eq!(given().judge(&IN_FORCE), Some(Verdict::InForce));
        for evidence in [
            Evidence { word: RunWord::NotTold, ..IN_FORCE },
            Evidence { command: Told::NotTold, ..IN_FORCE },
            Evidence { output: Told::NotTold, ..IN_FORCE },
            Evidence { reference: Told::NotTold, ..IN_FORCE },
        ] {
            assert_eq!(given().judge(&evidence), Some(Verdict::NotKnown));
        }
        let taken = Refusal::NotInControl(Control::Panel);
        for (evidence, lack) in [
            (Evidence { command: Told::No(taken), ..IN_FORCE }, Lack::Command),
            (Evidence { output: Told::No(taken), ..IN_FORCE }, Lack::Output),
            (Evidence { reference: Told::No(taken), ..IN_FORCE }, Lack::Reference),
        ] {
            let mut own = given();
            assert_eq!(own.judge(&evidence), Some(Verdict::lacks(lack, taken)));
            assert_eq!(own.lease(), Some(RUN), "it stands all the same");
        }
    }

    #[test]
    fn a_word_in_its_place_ends_it_once_it_was_seen_to_arrive_and_not_before() {
        for word in [RunWord::Gone, RunWord::Another] {
            let evidence = Evidence { word, ..IN_FORCE };
            let mut own = given();
            assert!(matches!(own.judge(&evidence), Some(Verdict::NotInForce { lacks: Lack::Command, .. })));
            assert_eq!((own.lease(), own.judge(&evidence)), (None, None), "told once");

            let mut lost = OwnRun::new();
            lost.give(RUN);
            lost.judge(&evidence);
            assert_eq!(lost.lease(), Some(RUN), "its answer was lost: it may come late");
            lost.judge(&IN_FORCE);
            lost.judge(&evidence);
            assert_eq!(lost.lease(), None);
        }
    }

    #[test]
    fn a_run_command_that_never_left_leaves_the_one_before_it() {
        let mut own = given();
        own.give(Lease::new(Direction::Reverse, 0x080F));
        own.was_not_written();
        assert_eq!(own.lease(), Some(RUN));
        let mut first = OwnRun::new();
        first.give(RUN);
        first.was_not_written();
        assert_eq!(first.lease(), None);
    }
}
