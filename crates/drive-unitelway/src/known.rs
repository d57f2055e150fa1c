//! What is known of each slave's link.

use std::time::Duration;

/// After how many silences a slave counts as one that has no word for "nothing to say", and how often it is listened to
/// for one all the same. Two may have been lost; and one poll in vain in 32 exchanges costs 3 ms of each.
const SILENCES: u32 = 3;
const LISTENED_TO: u32 = 32;

/// So near together two times are one.
const NEAR: Duration = Duration::from_millis(5);

/// What takes longer is polled from then on as ever: a reply that was lost looks like one that is not ready, and would come later
/// and later.
const LONGEST: Duration = Duration::from_millis(100);

/// After so many replies it is tried anew whether they come sooner.
const TRIED_AGAIN: u32 = 128;

/// One slave, as its polls have shown it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known {
    /// The time that its replies take, of one that is silent until they are ready.
    pace: Option<Pace>,
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
        self.pace = None;
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

/// How long a reply takes, from the end of its request. A poll before that costs the whole time in which an answer could begin,
/// because nothing comes; so the first is sent when the reply is likely there.
#[derive(Debug, Clone, Copy)]
struct Pace {
    /// A poll then was met with silence.
    silent_at: Duration,
    /// One then brought the reply; `None`: none has yet.
    ready_at: Option<Duration>,
    /// Replies since it was tried whether they come sooner.
    replies: u32,
}

impl Known {
    /// When the first poll for a reply is worth it, from the end of its request.
    pub(crate) fn poll_after(self) -> Duration {
        let Some(Pace { silent_at, ready_at: Some(ready_at), .. }) = self.pace else { return Duration::ZERO };
        let at =
            if ready_at.saturating_sub(silent_at) > NEAR { (silent_at + ready_at) / 2 } else { ready_at };
        if at > LONGEST { Duration::ZERO } else { at }
    }

    /// A poll for a reply so long after the request was met with silence.
    pub(crate) fn note_silent_poll(&mut self, after: Duration) {
        let pace = self.pace.get_or_insert(Pace { silent_at: after, ready_at: None, replies: 0 });
        pace.silent_at = pace.silent_at.max(after);
        pace.ready_at.take_if(|ready_at| *ready_at <= after);
    }

    /// An exchange has failed: whatever was known of its pace may be wrong.
    pub(crate) const fn note_failure(&mut self) {
        self.pace = None;
    }

    /// A poll for a reply so long after the request has brought it.
    pub(crate) fn note_reply(&mut self, after: Duration) {
        let Some(pace) = &mut self.pace else { return };
        pace.ready_at = Some(pace.ready_at.map_or(after, |ready_at| ready_at.min(after)));
        pace.silent_at = pace.silent_at.min(after);
        pace.replies += 1;
        if pace.replies >= TRIED_AGAIN {
            pace.replies = 0;
            pace.silent_at = pace.silent_at * 3 / 4;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_poll_comes_to_be_sent_when_the_reply_is_there_and_follows_a_slave_that_grows_slow() {
        const MS: Duration = Duration::from_millis(1);
        let mut known = Known::default();
        let silent = |known: &mut Known, work: Duration, replies: u32| {
            let mut in_vain = 0;
            for _ in 0..replies {
                let mut at = known.poll_after();
                while at < work {
                    known.note_silent_poll(at);
                    in_vain += 1;
                    at += 110 * MS;
                }
                known.note_reply(at);
            }
            (in_vain, known.poll_after())
        };
        let (in_vain, after) = silent(&mut known, 30 * MS, 100);
        assert!(in_vain <= 25, "{in_vain}");
        assert!(after >= 15 * MS && after <= 36 * MS, "{after:?}");
        let (in_vain, after) = silent(&mut known, 80 * MS, 100);
        assert!(in_vain <= 40, "{in_vain}");
        assert!(after >= 60 * MS && after <= 100 * MS, "{after:?}");
        let (_, after) = silent(&mut known, 900 * MS, 100);
        assert_eq!(after, Duration::ZERO);
        known.note_nothing_said(false);
        assert_eq!(known.poll_after(), Duration::ZERO, "it says when it has nothing to say");
    }
}
