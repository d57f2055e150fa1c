//! What nobody at this end of a way can tell from what is right, and what may come of it. Nothing is excused that the specification, a
//! manual or physics does not explain: a status against the shaft is a find wherever no answer was taken that the machine did not give.

/// What is found against a cell contradicts this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The value of a read, which the machine did not give.
    Value,
    /// A write that was told as done, and that the machine never took.
    Confirmation,
    /// The machine: what was told of it, or what it does.
    Machine,
}

/// What may be taken for right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Taken {
    /// A value of a read, and what follows from it.
    Value,
    /// A confirmation of a write, and what follows from it.
    Confirmation,
    /// Either.
    Answer,
    /// Nothing that was made up on the way: somebody says himself what is not so.
    OwnWords,
    /// A value of a read, which was made up on the way, or the drive's answer to somebody else.
    AnswerToAnother,
    /// Anything.
    Anything,
}

/// Something that cannot be told from what is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Untold {
    /// Why not.
    pub why: &'static str,
    taken: Taken,
}

impl Untold {
    /// A value of a read.
    pub(super) const fn value(why: &'static str) -> Self {
        Self { why, taken: Taken::Value }
    }

    /// A confirmation of a write.
    pub(super) const fn confirmation(why: &'static str) -> Self {
        Self { why, taken: Taken::Confirmation }
    }

    /// An answer to anything.
    pub(super) const fn answer(why: &'static str) -> Self {
        Self { why, taken: Taken::Answer }
    }

    /// What the drive, or a gateway in its place, says itself.
    pub(super) const fn own_words(why: &'static str) -> Self {
        Self { why, taken: Taken::OwnWords }
    }

    /// A value that the drive gave to somebody else, and what follows from it.
    pub(super) const fn answer_to_another(why: &'static str) -> Self {
        Self { why, taken: Taken::AnswerToAnother }
    }

    /// Whatever is said.
    pub(super) const fn anything(why: &'static str) -> Self {
        Self { why, taken: Taken::Anything }
    }

    /// Whether it explains what was found, on a way where answers are held against the machine's.
    pub(super) fn explains(&self, found: &[Kind]) -> bool {
        let (value, confirmation) = (found.contains(&Kind::Value), found.contains(&Kind::Confirmation));
        match self.taken {
            Taken::Value => value && !confirmation,
            Taken::Confirmation => confirmation && !value,
            Taken::Answer => value || confirmation,
            Taken::OwnWords => !value && !confirmation,
            Taken::AnswerToAnother => !confirmation,
            Taken::Anything => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_status_against_the_shaft_is_excused_by_an_answer_that_nobody_took() {
        let late = Untold::value("late");
        assert!(late.explains(&[Kind::Value, Kind::Machine]));
        assert!(!late.explains(&[Kind::Machine]));
        assert!(!late.explains(&[Kind::Value, Kind::Confirmation]));
        let liar = Untold::own_words("a liar");
        assert!(liar.explains(&[Kind::Machine]));
        assert!(!liar.explains(&[Kind::Machine, Kind::Value]));
        assert!(!Untold::confirmation("an echo").explains(&[Kind::Value]));
    }
}
