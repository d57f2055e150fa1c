//! The one piece by which every family keeps its lease and judges it: [`OwnRun`], from the [`Evidence`] that the family finds
//! in a drive's words.

use crate::{
    lease::{Lack, Lease, Verdict},
    refusal::Refusal,
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

impl Evidence {
    /// Whether every part is there.
    #[must_use]
    pub fn is_proven(&self) -> bool {
        let parts = [self.command, self.output, self.reference];
        self.word == RunWord::Stands && parts.iter().all(|told| *told == Told::Yes)
    }
}

/// The run command of this side, from before it is written until the drive's own words showed that it stands no more.
///
/// ```
/// use drive_core::{Direction, Evidence, Lease, OwnRun, RunWord, Told, Verdict};
///
/// let mut run = OwnRun::new();
/// run.give(Lease::new(Direction::Forward, 0x000F)); // before the word is written
/// run.was_written();
/// // In force is what all of the drive's own words show, and not that the word was sent.
/// let shown = Evidence { word: RunWord::Stands, command: Told::Yes, output: Told::Yes, reference: Told::NotTold };
/// assert_eq!(run.judge(&shown), Some(Verdict::NotKnown));
/// assert_eq!(run.judge(&Evidence { reference: Told::Yes, ..shown }), Some(Verdict::InForce));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OwnRun {
    lease: Option<Lease>,
    /// The one that stood, or might, when the present one was given, and whether it had arrived.
    before: Option<(Lease, bool)>,
    /// Whether the drive has said that it took it. While it has not, that it does not stand says nothing: it may be on its way.
    arrived: bool,
    /// The command word that this side wrote last, whatever became of it.
    sent: Option<u16>,
    /// The command word as the drive was read to hold it since.
    held: Option<u16>,
    /// One was given since the shaft was looked at last.
    unseen: bool,
}

impl OwnRun {
    /// None was given.
    #[must_use]
    pub const fn new() -> Self {
        Self { lease: None, before: None, arrived: false, sent: None, held: None, unseen: false }
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

    /// A command word is about to be written, a run command or another: nobody knows what stands then until it is read.
    pub const fn sends(&mut self, word: u16) {
        (self.sent, self.held) = (Some(word), None);
    }

    /// The drive was read to hold this command word.
    pub const fn reads(&mut self, word: u16) {
        self.held = Some(word);
    }

    /// What was read proves nothing any more: the line was lost, or the drive may be another one.
    pub const fn unread(&mut self) {
        self.held = None;
    }

    /// The command word that the drive was read to hold since one was written.
    #[must_use]
    pub const fn held(&self) -> Option<u16> {
        self.held
    }

    /// What that says of the run command, in a drive of which these words are run commands.
    #[must_use]
    pub fn word(&self, is_run: impl Fn(u16) -> bool) -> RunWord {
        match (self.held, self.lease) {
            (Some(held), Some(lease)) if held == lease.word => RunWord::Stands,
            (Some(held), _) if is_run(held) => RunWord::Another,
            (Some(_), _) => RunWord::Gone,
            (None, _) => RunWord::NotTold,
        }
    }

    /// Whether this run command is one of this side: the one that was given last, or the one before it while that was not seen to arrive.
    #[must_use]
    pub fn is_own(&self, word: u16) -> bool {
        let before = self.before.map(|(before, _)| before);
        self.lease.into_iter().chain(before).any(|lease| lease.word == word)
    }

    /// A run command is about to be written.
    pub const fn give(&mut self, lease: Lease) {
        // One of which nobody knows whether it arrived may stand as well: its answer was lost.
        if let Some(before) = self.lease {
            self.before = Some((before, self.arrived));
        }
        (self.lease, self.arrived, self.unseen) = (Some(lease), false, true);
    }

    /// The shaft is looked at: whether a run command was given since that was done last, by which it may have turned.
    pub(crate) const fn is_looked_at(&mut self) -> bool {
        std::mem::replace(&mut self.unseen, false)
    }

    /// The drive has confirmed the write.
    pub const fn was_written(&mut self) {
        (self.before, self.arrived) = (None, self.lease.is_some());
    }

    /// It is certain that the write did not arrive: it was never sent, or the drive has refused it.
    pub const fn was_not_written(&mut self) {
        (self.lease, self.arrived) = match self.before {
            Some((before, arrived)) => (Some(before), arrived),
            None => (None, false),
        };
        self.before = None;
    }

    /// One of an earlier run of the program. The next evidence of its word ends it where it does not stand.
    pub const fn adopt(&mut self, lease: Lease) {
        (self.lease, self.before, self.arrived) = (Some(lease), None, true);
        (self.sent, self.held) = (None, None);
    }

    /// The drive was seen to hold another word of this side in its place: a stop, a withdrawal, a reset.
    pub const fn end(&mut self) {
        (self.lease, self.before, self.arrived) = (None, None, false);
    }

    /// What [`judge`](Self::judge) would say, for a status that a command has read: it ends nothing. While a word of this side
    /// is on its way, what stands says nothing.
    #[must_use]
    pub fn verdict(&self, evidence: &Evidence) -> Option<Verdict> {
        let word = if evidence.word == RunWord::Gone { RunWord::NotTold } else { evidence.word };
        let mut own = *self;
        own.judge(&Evidence { word, ..*evidence })
    }

    /// The verdict on the run command, if one stands. A word that took its place ends it; the verdict says so once, unless it is
    /// this side's own, of a stop that did not show at once.
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
        if evidence.word == RunWord::Gone && self.held.is_some() && self.held == self.sent {
            self.end();
            return None;
        }
        // A lost answer leaves open whether the word arrived; that it stands settles it.
        if evidence.word == RunWord::Stands {
            (self.arrived, self.before) = (true, None);
        }
        let gone = match evidence.word {
            RunWord::Stands | RunWord::NotTold => None,
            _ if !self.arrived => Some(UNSEEN),
            RunWord::Gone => Some(GONE),
            RunWord::Another => Some(ANOTHER),
        };
        if let Some(because) = gone {
            // What was never seen to arrive may still come: its lease is kept, so that it is withdrawn then.
            if self.arrived {
                self.end();
            }
            return Some(Verdict::lacks(Lack::Command, because));
        }
        // Another word of this side is on its way, or arrived: what cuts the output may be that.
        if self.held.is_none()
            && self.lease.is_some_and(|lease| self.sent.is_some_and(|sent| sent != lease.word))
        {
            return Some(Verdict::NotKnown);
        }
        let parts = [
            (Lack::Command, evidence.command),
            (Lack::Output, evidence.output),
            (Lack::Reference, evidence.reference),
        ];
        // What turns the motor another way, or as fast as before, is then this side's own word of before.
        let stood_before = !self.arrived && self.before.is_some();
        let lacking = parts.iter().find_map(|&(lack, told)| match told {
            Told::No(_) if stood_before && lack == Lack::Reference => {
                Some(Verdict::lacks(Lack::Command, UNSEEN))
            }
            Told::No(because) => Some(Verdict::lacks(lack, because)),
            Told::Yes | Told::NotTold => None,
        });
        Some(lacking.unwrap_or(if evidence.is_proven() { Verdict::InForce } else { Verdict::NotKnown }))
    }
}

#[cfg(test)]
mod tests {
    use crate::{setpoint::Direction, state::Control};

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

    /// A start the other way that the drive could not complete: what it runs by is still of this side, and is to be withdrawn.
    #[test]
    fn the_run_command_before_one_that_was_not_seen_to_arrive_is_still_this_sides() {
        let reverse = Lease::new(Direction::Reverse, 0x080F);
        let mut own = given();
        own.give(reverse);
        assert_eq!([RUN.word, reverse.word, 0x0006].map(|word| own.is_own(word)), [true, true, false]);
        own.judge(&Evidence { word: RunWord::Another, ..IN_FORCE });
        assert!(own.is_own(RUN.word), "it stands");
        own.judge(&IN_FORCE);
        assert_eq!(
            [RUN.word, reverse.word].map(|word| own.is_own(word)),
            [false, true],
            "its successor stands"
        );
        own.end();
        assert!(!own.is_own(reverse.word));
    }

    /// A drive whose command word cannot be read goes on by the one before, and nobody else turns it.
    #[test]
    fn what_a_run_command_of_before_turns_is_no_others_reference_while_its_successor_was_not_seen_to_arrive()
    {
        const AGAINST: Refusal =
            Refusal::Overridden { by: "whoever turns it the other way,", remedy: "see who" };
        let turned = Evidence { word: RunWord::NotTold, reference: Told::No(AGAINST), ..IN_FORCE };
        let mut own = given();
        own.give(Lease::new(Direction::Reverse, 0x080F));
        let lacks = |verdict| match verdict {
            Some(Verdict::NotInForce { lacks, .. }) => Some(lacks),
            _ => None,
        };
        assert_eq!(lacks(own.judge(&turned)), Some(Lack::Command));
        own.was_written();
        assert_eq!(lacks(own.judge(&turned)), Some(Lack::Reference));
    }

    #[test]
    fn what_stands_is_known_from_when_it_was_read_until_another_word_is_written() {
        let is_run = |word| word & 0x000F == 0x000F;
        let mut own = given();
        own.sends(RUN.word);
        assert_eq!(own.word(is_run), RunWord::NotTold, "a confirmed write is no reading");
        for (held, told) in [(0x000F, RunWord::Stands), (0x080F, RunWord::Another), (0x0006, RunWord::Gone)] {
            own.reads(held);
            assert_eq!((own.word(is_run), own.held()), (told, Some(held)));
        }
        own.unread();
        assert_eq!(own.word(is_run), RunWord::NotTold);
    }

    #[test]
    fn a_stop_of_this_side_that_shows_late_ends_it_and_is_nobody_elses_word() {
        let gone = Evidence { word: RunWord::Gone, ..IN_FORCE };
        let mut own = given();
        own.sends(0x0007);
        assert_eq!(own.verdict(&gone), Some(Verdict::NotKnown), "it is on its way");
        let output = Told::No(Refusal::NotInControl(Control::Local));
        let cut = Evidence { word: RunWord::NotTold, output, ..IN_FORCE };
        assert_eq!(own.judge(&cut), Some(Verdict::NotKnown), "what cuts the output may be this stop");
        own.reads(0x0007);
        assert_eq!((own.judge(&gone), own.lease()), (None, None));
        let mut own = given();
        own.sends(0x0007);
        own.reads(0x0006);
        assert!(own.judge(&gone).is_some(), "that one is somebody else's");
    }

    /// Found by the model of the lease in `drive-fire`: the motor may run by the first, and nobody would have had a lease of it.
    #[test]
    fn a_run_command_that_never_left_leaves_the_one_before_it_whose_answer_was_lost() {
        let mut own = OwnRun::new();
        own.give(RUN);
        own.give(Lease::new(Direction::Reverse, 0x080F));
        own.was_not_written();
        assert_eq!((own.lease(), own.has_arrived()), (Some(RUN), false));
        assert_eq!(own.judge(&IN_FORCE), Some(Verdict::InForce), "it has come");
        assert!(own.has_arrived());
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
