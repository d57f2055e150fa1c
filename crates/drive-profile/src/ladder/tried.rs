//! What a person has tried, and what of it still proves something.

use super::{Ladder, Level};
use crate::{
    format::{Reached, Spanned, Tried, TriedOn},
    source::line,
};

impl Ladder<'_> {
    /// Whether a person has tried, on a drive, what the file says now, as far as a level rests on it.
    pub(super) fn is_tried(&self, level: Level) -> bool {
        let least = match level {
            Level::Watch => Reached::Read,
            Level::Stop => Reached::Stopped,
            Level::Motion => Reached::Started,
        };
        let mut all = self.file.tried.given().into_iter().flatten().map(Spanned::get_ref);
        all.any(|tried| self.proves_less(tried).is_none() && tried.reached.is_some_and(|of| of >= least))
    }

    /// Why a trial proves nothing of what the file says.
    fn proves_less(&self, tried: &Tried) -> Option<&'static str> {
        match (&tried.of, tried.on, tried.reached) {
            (Some(_), Some(TriedOn::Simulator), _) => {
                Some("was on a simulator, and proves nothing of a drive")
            }
            (Some(of), Some(_), Some(_)) if of == self.substance => None,
            (Some(_), Some(_), Some(_)) => {
                Some("holds no more: the file says something else now than what was tried")
            }
            _ => Some("does not say what was tried, on what and how far it came, and proves nothing"),
        }
    }

    /// What is said of each trial that does not prove all.
    pub(super) fn trials(&mut self) {
        for spanned in self.file.tried.given().into_iter().flatten() {
            let tried = spanned.get_ref();
            let why = self.proves_less(tried).or(match tried.reached {
                Some(Reached::Read) => {
                    Some("ended before a stop had stopped a turning motor, and proves no stop and no start")
                }
                Some(Reached::Stopped) => Some("ended before the start, and proves the stop alone"),
                Some(Reached::Started) | None => None,
            });
            if let Some(why) = why {
                let at = line(self.text, &spanned.span());
                self.say(
                    &format!("the trial of {} on {}, line {at}, {why}", tried.person, tried.day),
                    "try it on the drive to the end: drived profile try",
                );
            }
        }
    }
}
