//! What happened in words: those of its record, but for what the history itself knows better.

use drived_plant::plant::past::RecordView;

use super::Facts;

/// What is told of one reading is recorded within this time.
const SAME_READING_MS: i64 = 100;

/// What is told of a run command that does not decide any more, where its drive shows no more than that.
const ANOTHER: &str = "another run command, which took the place of the one that was given";

/// By what a drive is commanded, and was before.
struct Commanded<'a> {
    by: &'a str,
    before: &'a str,
    /// Whether that had commanded it before the other did.
    is_again: bool,
}

impl Facts {
    /// A record in words. A drive whose terminals command it has no other run command of a bus, and control that falls back was taken by nobody.
    pub(in crate::story) fn told(&self, found: &RecordView) -> String {
        let (text, at) = (&*found.text, found.time_unix_ms);
        if found.drive.as_deref() != Some(&*self.drive) {
            return text.to_owned();
        }
        if let Some(commanded) = self.falls_back(found) {
            let Commanded { by, before, .. } = commanded;
            return format!("commanded by {by} again, as before, and by {before} no longer");
        }
        if let (Some(_), Some((_, rest))) = (self.begun_before_kill(found), text.split_once("is not ours: "))
        {
            return format!("run not taken over that this program had begun before it was killed: {rest}");
        }
        let by_hand = self.control_at(at + 1).filter(|control| *control != "bus");
        if let (Some((head, _)), Some(control)) = (text.split_once(ANOTHER), by_hand) {
            return format!(
                "{head}a bus does not command the drive any more, which says that it is commanded by {control}"
            );
        }
        match text.split_once(" went between two readings that lie ").zip(self.fall_before(at)) {
            Some(((head, rest), _)) => {
                let reference = rest.split_once(", and ").map_or("", |(_, reference)| reference);
                format!("{head} was gone when that was read, and {reference}")
            }
            None => text.to_owned(),
        }
    }

    /// Where control fell back to with what was read at a moment: what is told of that reading was not done by who has it then.
    pub(in crate::story) fn fell_back_with(&self, at: i64) -> Option<&RecordView> {
        self.records
            .iter()
            .find(|found| (found.time_unix_ms - at).abs() <= SAME_READING_MS && self.is_fallen_back(found))
    }

    /// Whether control that is told as taken is where it was before somebody else had it.
    pub(in crate::story) fn is_fallen_back(&self, found: &RecordView) -> bool {
        self.falls_back(found).is_some()
    }

    fn falls_back(&self, found: &RecordView) -> Option<Commanded<'_>> {
        let is_told = found.what == "control_taken" && found.drive.as_deref() == Some(&*self.drive);
        self.commanded(found.time_unix_ms).filter(|commanded| is_told && commanded.is_again)
    }

    fn commanded(&self, at: i64) -> Option<Commanded<'_>> {
        let mut known = self.controls.iter().rev().skip_while(|(since, _)| *since > at + 1);
        let (_, by) = known.next()?;
        let mut others = known.skip_while(|(_, control)| control == by);
        let (_, before) = others.next()?;
        Some(Commanded { by, before, is_again: others.any(|(_, control)| control == by) })
    }
}
