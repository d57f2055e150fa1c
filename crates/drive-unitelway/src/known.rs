//! What is known of each slave's link.

/// After how many silences a slave counts as one that has no word for "nothing to say", and how often it is listened to
/// for one all the same. Two may have been lost; and one poll in vain in 32 exchanges costs 3 ms of each.
const SILENCES: u32 = 3;
const LISTENED_TO: u32 = 32;

/// One slave, as its polls have shown it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known {
    /// It has said that it has nothing to say, since it was asked last.
    empty: bool,
    /// Exchanges in a row that ended without that word.
    silences: u32,
}

impl Known {
    pub(crate) const fn is_empty(self) -> bool {
        self.empty
    }

    /// It is asked something: a reply will come.
    pub(crate) const fn note_request(&mut self) {
        self.empty = false;
    }

    /// It has said that it has nothing to say. `emptied`: to a poll for nothing, so that it holds nothing either.
    pub(crate) const fn note_nothing_said(&mut self, emptied: bool) {
        self.silences = 0;
        self.empty = emptied;
    }

    /// An exchange has ended without that word.
    pub(crate) const fn note_silence(&mut self) {
        self.silences = self.silences.saturating_add(1);
    }

    /// Whether that word can be expected of it.
    pub(crate) const fn may_say_nothing(self) -> bool {
        self.silences < SILENCES || self.silences.is_multiple_of(LISTENED_TO)
    }
}
