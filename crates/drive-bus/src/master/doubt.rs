//! What may still come from one slave, and what its next request therefore waits for or differs in.

use std::{collections::VecDeque, time::Duration};

use tokio::time::Instant;

use crate::{config::DOUBLE, exchange::Frame, shape::Shape};

/// How long anything strange is remembered. Longer than a serial server or a gateway usually keeps an answer (its own
/// timeouts are seconds), and it costs only a word more in a read.
pub(super) const MEMORY: Duration = Duration::from_secs(60);

/// What comes later than this is no second answer to what was taken.
pub(super) const LONGEST_DOUBLE: Duration = Duration::from_secs(1);

/// How many answers are remembered by what they say: those of a second, where they are not asked for without a pause.
const LATELY: usize = 32;

/// How many shapes are remembered: the reads that a family has in rotation, in all their lengths, and some writes. There are
/// thirty thousand slaves on a thousand lines.
const MOST: usize = 16;

/// What is known of the answers of one slave: which are owed, which came unasked, and which came last.
#[derive(Debug, Default)]
pub(super) struct Doubt {
    known: Vec<Known>,
    strange_until: Option<Instant>,
    /// Something came that nothing explains: answers may come twice here.
    unexplained_until: Option<Instant>,
    /// The answer that was taken last, and when the same came before.
    taken: Option<Taken>,
    /// What was taken lately, and when, since something strange came: what may come once more.
    lately: VecDeque<(Frame, Instant)>,
    held_until: Option<Instant>,
}

/// An answer that was taken.
#[derive(Debug, Clone, Copy)]
struct Taken {
    frame: Frame,
    at: Instant,
    asked_at: Instant,
    same_before: Option<Instant>,
}

/// What an intact frame is that was no answer to what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Heard {
    /// It was owed.
    pub(super) was_owed: bool,
    /// The answer that was taken last, once more, so much later.
    pub(super) again_after: Option<Duration>,
    /// Another answer to the same question: what was taken then may have been that to an earlier one.
    pub(super) withdraws: Option<Instant>,
}

/// One shape that a coming answer should not have.
#[derive(Debug, Clone, Copy)]
struct Known {
    shape: Shape,
    /// A request whose answer can only have this shape waits until then.
    wait: Instant,
    /// One whose answer can have another shape rather takes another until then.
    avoid: Instant,
    /// Such an answer will come to somebody: it is owed to us, or another master asks for it. Any other shape is better.
    will_come: bool,
    /// Such a frame has come that was no answer of ours and cannot have been one once more: where another shape costs nothing it
    /// is better.
    stray: bool,
    /// Such an answer is owed and has not come.
    owed: bool,
    /// It is not kept until the next question: a later answer has come, or one was thrown away that may have been this one.
    asked_again: bool,
    /// A check over the write that it confirms, of which the confirmation of some writes repeats no value. `None`: it confirms none,
    /// or its slave has answered something behind its time, so that it hardly comes any more.
    wrote: Option<u16>,
    /// Something else was written since.
    overtaken: bool,
    /// An answer of its shape was taken since: which of the two that was nobody knows, and the other one may still come.
    may_have_come: bool,
    /// Its port was lost. What comes over the next one may be anything that the last one left behind, also an echo, so
    /// that no frame proves that this answer has come.
    over_a_lost_port: bool,
}

impl Doubt {
    /// An answer of this shape may still come until `until`, and hardly after it.
    pub(super) fn owe(
        &mut self,
        now: Instant,
        shape: Shape,
        wrote: Option<u16>,
        until: Instant,
        over_a_lost_port: bool,
    ) {
        self.strange_until = Some(now + MEMORY);
        let avoid = until.max(now + MEMORY);
        self.remember(
            now,
            Known {
                shape,
                wait: until,
                avoid,
                will_come: true,
                stray: false,
                owed: true,
                asked_again: false,
                wrote,
                overtaken: false,
                may_have_come: false,
                over_a_lost_port,
            },
        );
    }

    /// An intact frame came that was no answer to what was asked, or another master's request for one.
    pub(super) fn heard(&mut self, now: Instant, frame: Frame, is_request: bool) -> Heard {
        let shape = frame.shape;
        self.strange_until = Some(now + MEMORY);
        let is_it = |known: &Known| {
            known.owed && !is_request && (known.shape == shape || shape.is_refusal_of(known.shape))
        };
        let was_owed = self.known.iter().any(is_it);
        let may_be_anothers = self.known.iter().any(|known| is_it(known) && known.asked_again);
        if let Some(index) = self.known.iter().position(|known| is_it(known) && !known.over_a_lost_port) {
            // What was waited for has come: one thing less to be afraid of.
            self.known.remove(index);
        }
        if shape != Shape::ANY {
            let heard = Known::come(shape, now + DOUBLE, now + MEMORY);
            let stray = !was_owed && self.is_no_double(now, frame);
            self.remember(now, Known { will_come: is_request, stray, ..heard });
        }
        let taken = self.taken.filter(|taken| {
            !is_request
                && taken.frame.shape == shape
                && now.saturating_duration_since(taken.at) <= LONGEST_DOUBLE
        });
        if was_owed {
            // Which of the two was owed nobody knows.
            let taken = taken.filter(|taken| may_be_anothers && taken.frame.check != frame.check);
            return Heard { was_owed, withdraws: taken.map(|taken| taken.asked_at), ..Heard::default() };
        }
        self.unexplained_until = Some(now + MEMORY);
        let Some(taken) = taken else { return Heard::default() };
        let same = taken.frame.check == frame.check;
        Heard {
            was_owed,
            again_after: if same {
                Some(now - taken.at)
            } else {
                taken.same_before.map(|before| taken.at - before)
            },
            withdraws: (!same).then_some(taken.asked_at),
        }
    }

    /// Whether this is none of the answers that were taken lately, as far as they are all known.
    fn is_no_double(&self, now: Instant, frame: Frame) -> bool {
        let is_it = |(taken, at): &(Frame, Instant)| *taken == frame && *at + LONGEST_DOUBLE >= now;
        let knows_all = match self.lately.front() {
            Some((_, oldest)) => self.lately.len() < LATELY || *oldest + LONGEST_DOUBLE < now,
            None => false,
        };
        knows_all && !self.lately.iter().any(is_it)
    }

    /// This answer was taken.
    pub(super) fn took(&mut self, now: Instant, frame: Frame, asked_at: Instant) {
        if self.is_strange(now) {
            if self.lately.len() >= LATELY {
                self.lately.pop_front();
            }
            self.lately.push_back((frame, now));
        } else if !self.lately.is_empty() {
            self.lately = VecDeque::new();
        }
        let same = self.taken.filter(|taken| taken.frame == frame && now - taken.at <= LONGEST_DOUBLE);
        self.taken = Some(Taken { frame, at: now, asked_at, same_before: same.map(|same| same.at) });
    }

    /// An answer of this shape was taken. It may come twice within `double`, and on this line answers were seen to come again
    /// after `again`. A protocol without shapes has its own proofs.
    pub(super) fn answered(&mut self, now: Instant, shape: Shape, double: Duration, again: Option<Duration>) {
        if shape == Shape::ANY {
            return;
        }
        self.known
            .retain(|known| known.avoid > now && (known.shape != shape || known.will_come || known.stray));
        for known in self.known.iter_mut().filter(|known| known.wait <= now) {
            known.wrote = None;
            // Once: a shape that is asked for all the time would be avoided for ever.
            if known.owed && known.shape == shape && !known.may_have_come {
                (known.may_have_come, known.avoid) = (true, now + MEMORY);
            }
        }
        let strange = self.is_strange(now);
        // An answer that is late is late once, and then no reason any more to wait.
        let owes = self.known.iter().any(|known| known.owed);
        let unexplained = self.unexplained_until.is_some_and(|until| until > now);
        let wait = now + again.or((unexplained || owes).then_some(DOUBLE)).unwrap_or_default();
        self.remember(now, Known::come(shape, wait, now + if strange { MEMORY } else { double }));
    }

    /// Anything may have come meanwhile: nothing is asked until `until`.
    pub(super) fn hold(&mut self, now: Instant, until: Instant) {
        self.strange_until = Some(now + MEMORY);
        self.unexplained_until = Some(now + MEMORY);
        self.held_until = Some(until);
    }

    /// Until when a request waits whose answer can only have this shape.
    pub(super) fn wait(&self, now: Instant, shape: Shape) -> Option<Instant> {
        let same = self.known.iter().filter(|known| known.shape == shape).map(|known| known.wait);
        same.chain(self.held_until).max().filter(|until| *until > now)
    }

    /// Which of these shapes tells its answer best from what may come, and until when a request for it waits.
    pub(super) fn best(
        &self,
        now: Instant,
        shapes: impl Iterator<Item = Shape>,
    ) -> Option<(usize, Option<Instant>)> {
        let rate = |shape: Shape| {
            let same =
                self.known.iter().enumerate().filter(|(_, known)| known.shape == shape && known.avoid > now);
            let will_come =
                same.clone().filter(|(_, known)| known.will_come).map(|(_, known)| known.avoid).max();
            let stray = same.clone().filter(|(_, known)| known.stray).map(|(_, known)| known.avoid).max();
            let came = same.map(|(order, known)| (known.avoid, order)).max();
            (will_come, self.wait(now, shape), stray, came)
        };
        let mut best = None;
        for (index, rating) in shapes.map(rate).enumerate() {
            // Of which nothing is known is the best there can be, and nearly always the first.
            if rating == (None, None, None, None) {
                return Some((index, None));
            }
            if best.is_none_or(|(_, least)| rating < least) {
                best = Some((index, rating));
            }
        }
        best.map(|(index, (_, wait, ..))| (index, wait))
    }

    /// Whether the confirmation of a write with this shape may be that of an earlier one and prove nothing: something else was
    /// written between the two, or nobody knows what came meanwhile. `wrote` is a check over the write. That of function 10h names
    /// no value: the confirmation of another one that is owed is none of this one, however late it comes.
    pub(super) fn owes(&self, now: Instant, shape: Shape, wrote: Option<u16>) -> bool {
        let held = self.held_until.is_some_and(|until| until > now);
        let another =
            |known: &Known| wrote.is_some() && known.wrote.is_some_and(|other| Some(other) != wrote);
        let owed = self.known.iter().filter(|known| known.owed && known.shape == shape);
        { owed }.any(|known| known.wait > now && (known.overtaken || held) || another(known))
    }

    /// Something is written, whose confirmation has this shape, with the check over it.
    pub(super) fn written(&mut self, shape: Shape, wrote: u16) {
        for known in &mut self.known {
            known.overtaken |= known.shape != shape || known.wrote.is_some_and(|other| other != wrote);
        }
    }

    /// Whether the answer to a read that has this shape may be one that is owed, however late, and none was thrown away for that yet.
    pub(super) fn may_be_late(&self, now: Instant, shape: Shape) -> bool {
        let mut owed = self.known.iter().filter(|known| known.owed && known.avoid > now);
        owed.any(|known| known.shape == shape && !known.asked_again)
    }

    /// An answer of this shape was thrown away, because it may have been one that is owed: the right one may come until `until`.
    pub(super) fn threw_away(&mut self, now: Instant, shape: Shape, until: Instant) {
        self.owe(now, shape, None, until, false);
        self.is_in_step();
        self.taken = None;
    }

    /// No answer needs to be thrown away for what is owed: a later one has come, so that none is kept until the next question.
    pub(super) fn is_in_step(&mut self) {
        for known in &mut self.known {
            known.asked_again = true;
        }
    }

    /// Whether the refusal of what has this shape may be that of an earlier request.
    pub(super) fn owes_refusal(&self, now: Instant, shape: Shape) -> bool {
        self.owed(now).any(|known| known.shape.shares_refusals_with(shape))
    }

    /// Until when anything may come.
    pub(super) fn over(&self) -> Option<Instant> {
        let owed = self.known.iter().filter(|known| known.owed).map(|known| known.wait);
        owed.chain(self.held_until).max()
    }

    fn owed(&self, now: Instant) -> impl Iterator<Item = &Known> {
        self.known.iter().filter(move |known| known.owed && known.wait > now)
    }

    fn is_strange(&self, now: Instant) -> bool {
        self.strange_until.is_some_and(|until| until > now)
    }

    fn remember(&mut self, now: Instant, known: Known) {
        if self.known.len() >= MOST {
            // What is waited for stays: the answer that was taken last may come again at any moment. Of the rest what will come
            // outlasts what has come, for every value that is written has a shape of its own, and once of each shape is enough.
            let outlasts = |index: usize, known: &Known| {
                let later = self.known.iter().skip(index + 1);
                (known.will_come || known.stray)
                    && !{ later }.any(|later| later.shape == known.shape && later.will_come)
            };
            let all = self.known.iter().enumerate();
            let least = all.min_by_key(|(index, known)| (known.wait > now, outlasts(*index, known)));
            if let Some((least, _)) = least {
                self.known.remove(least);
            }
        }
        // Nearly always it is one.
        self.known.reserve_exact(1);
        self.known.push(known);
    }
}

impl Known {
    const fn come(shape: Shape, wait: Instant, avoid: Instant) -> Self {
        Self {
            shape,
            wait,
            avoid,
            will_come: false,
            stray: false,
            owed: false,
            asked_again: false,
            wrote: None,
            overtaken: false,
            may_have_come: false,
            over_a_lost_port: false,
        }
    }
}
