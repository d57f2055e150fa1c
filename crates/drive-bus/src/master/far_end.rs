//! What stands between a connection and the drives: what it still owes, how much it does at once, how long it waits for a
//! drive that does not answer.
//!
//! A gateway goes on with a question after its master has given up, and many serve one question at a time: whatever is asked
//! meanwhile waits there, a stop as well. So a **question in vain stays owed** until its late answer comes, or exception
//! 0Bh, or the gateway can no longer be at it. While something is owed:
//! - a far end of which it is **not known** whether it does more than one thing at once is asked one thing more: a read, of a
//!   drive that answers. Its answer comes at once, then it does; or behind what was owed, which shows how long that took;
//! - one that **does no more** is asked nothing, until what is owed is over;
//! - a stop is sent, whatever is owed.

mod turn;

use std::{iter, time::Duration};

use tokio::time::Instant;

use crate::{
    gateway::Gateway,
    shape::Shape,
    stats::{FarEndStats, SecondConnection, WaitIs},
};

pub(super) use turn::{Asked, Place};
use turn::{Owed, Turn, waited};

/// Of so many questions in vain one asks again whether a far end that does one thing at a time still does.
const ASK_AGAIN: u32 = 8;

/// What is owed at the most: one question of each of the drives of a long line.
const MOST: usize = 32;

/// A gateway is still at what it was asked so short a time ago, unless it waits for less than twice that.
const SOON: Duration = Duration::from_secs(1);

/// How often what is waited for may double while nothing proves that the far end is done.
const DOUBLINGS: u32 = 2;

/// The far end of one line.
#[derive(Debug)]
pub(super) struct FarEnd {
    /// `None`: there is nothing that could owe.
    gateway: Option<Gateway>,
    owed: Vec<Owed>,
    /// So many things at once, at least.
    serves: usize,
    /// And no more.
    exactly: bool,
    /// How long it was seen to wait.
    seen: Option<Duration>,
    /// When it was last done with something that was owed.
    free_from: Option<Instant>,
    /// How often in a row nothing has proved that it was done.
    unproven: u32,
    in_vain: u32,
    /// Until when it may be at what a lost connection has asked, where nobody knows whether it goes on with that: what is asked
    /// meanwhile shows nothing of its own time.
    left_until: Option<Instant>,
}

impl FarEnd {
    pub(super) fn new(gateway: Option<Gateway>) -> Self {
        let at_once = gateway.and_then(|gateway| gateway.at_once);
        Self {
            gateway,
            owed: Vec::new(),
            serves: at_once.unwrap_or(1).max(1),
            exactly: at_once.is_some(),
            seen: None,
            free_from: None,
            unproven: 0,
            in_vain: 0,
            left_until: None,
        }
    }

    /// Whether there may be something in between.
    pub(super) const fn is_there(&self) -> bool {
        self.gateway.is_some()
    }

    /// Whether it does one thing at a time, as far as is known: then a question in vain costs everybody its whole wait.
    pub(super) const fn holds_others_up(&self) -> bool {
        self.gateway.is_some() && self.serves < 2
    }

    /// How long it waits for a drive that does not answer: seen, set, or assumed.
    pub(super) fn wait(&self) -> Duration {
        let Some(gateway) = self.gateway else { return Duration::ZERO };
        self.seen.or(gateway.wait).unwrap_or(Gateway::ASSUMED_WAIT)
    }

    /// What it adds to the wait of a stop: one question in vain, and one more where it is not yet known whether it does
    /// more than one thing at once.
    pub(super) fn stop_waits(&self) -> Duration {
        let Some(gateway) = self.gateway else { return Duration::ZERO };
        let questions = if self.exactly || self.serves > 1 { 1 } else { 2 };
        self.wait().max(gateway.wait.unwrap_or_default()) * questions
    }

    /// How many questions it owes.
    pub(super) fn owes(&self) -> usize {
        self.owed.len()
    }

    pub(super) fn stats(&self, second: SecondConnection, stops_over_second: u64) -> Option<FarEndStats> {
        let gateway = self.gateway?;
        let wait_is = match (self.seen, gateway.wait) {
            (Some(_), _) => WaitIs::Seen,
            (None, Some(_)) => WaitIs::Set,
            (None, None) => WaitIs::Assumed,
        };
        Some(FarEndStats {
            owed: self.owed.len(),
            at_once: self.serves,
            no_more: self.exactly,
            wait: self.wait(),
            wait_is,
            in_vain: u64::from(self.in_vain),
            second,
            stops_over_second,
        })
    }

    /// A question was given up.
    pub(super) fn owe(&mut self, asked: Asked) {
        if crate::mutant!("far-end-owes-nothing", self.gateway.is_none(), true) || asked.slave == 0 {
            return;
        }
        // What it was done with since then is not before it any more.
        let was_done = self.free_from.is_some_and(|free| free > asked.at);
        let Place { turn, begins } = if was_done { self.place(asked.at) } else { asked.place };
        let in_turn = self.serves_in_turn();
        let before = self.owed.iter().map(|owed| owed.until).max().filter(|_| in_turn);
        let wait = crate::mutant!("far-end-gives-up-early", self.wait() * 5 / 4, self.wait() / 4);
        // What stood before it was waited for as long as it might take, and its end was proved by nothing: it is not doubled once more.
        let is_behind_what_is_over = before.is_none() && begins.is_some();
        let limit = if is_behind_what_is_over { wait } else { wait * (1 << self.unproven.min(DOUBLINGS)) };
        // It came to it when it was done with what it was at, which may be later than it was asked.
        let begins = before.max(begins).or(self.free_from.filter(|_| in_turn));
        let until = begins.unwrap_or(asked.at).max(asked.at) + limit;
        let Asked { slave, number, shape, at, place: _ } = asked;
        if self.owed.len() >= MOST {
            self.owed.remove(0);
        }
        self.owed.push(Owed { slave, number, shape, asked: at, until, turn, over_a_lost_port: false });
        self.in_vain = self.in_vain.saturating_add(1);
    }

    /// Whether one question waits behind the other, as far as is known.
    fn serves_in_turn(&self) -> bool {
        crate::mutant!("far-end-serves-side-by-side", self.serves < 2, false)
    }

    /// Behind what that stands which is asked at `at`.
    pub(super) fn place(&self, at: Instant) -> Place {
        let in_turn = self.serves_in_turn();
        let turn = match self.owed.last().filter(|_| in_turn) {
            Some(before) => before.turn.map(|turn| Turn { place: turn.place.saturating_add(1), ..turn }),
            None if self.left_until.is_some_and(|until| at < until) => None,
            None => {
                let free = self.free_from.filter(|_| in_turn).map_or(at, |free| free.max(at));
                let free_from = crate::mutant!("far-end-waits-since-it-was-asked", free, at);
                Some(Turn { free_from, place: 1 })
            }
        };
        Place { turn, begins: self.owed.iter().map(|owed| owed.until).max().filter(|_| in_turn) }
    }

    /// Until when a request waits. `reads`: it is a read of a drive that answers, or of any where none does.
    pub(super) fn gate(&self, reads: bool) -> Option<Instant> {
        let owed = self.owed.len();
        if owed == 0 || owed < self.serves {
            return None;
        }
        let asks_whether = crate::mutant!(
            "far-end-asked-one-more",
            !self.exactly || self.in_vain.is_multiple_of(ASK_AGAIN) && self.gateway_may_change(),
            true
        );
        if asks_whether && reads && owed == self.serves {
            return None;
        }
        self.owed.iter().map(|owed| owed.until).min()
    }

    fn gateway_may_change(&self) -> bool {
        self.gateway.is_some_and(|gateway| gateway.at_once.is_none())
    }

    /// How much longer than usual the answer to what is sent at `now` may take, because it waits behind what is owed.
    pub(super) fn held_up(&self, now: Instant) -> Duration {
        let last = self.owed.iter().map(|owed| owed.until).max().filter(|_| self.owed.len() >= self.serves);
        last.map_or(Duration::ZERO, |last| last.saturating_duration_since(now))
    }

    /// What was sent behind `behind` questions in vain was answered: at once, or only when its usual time was over. Gives
    /// the slaves that the far end has waited for in vain to the end.
    pub(super) fn answered(&mut self, now: Instant, behind: usize, at_once: bool) -> Vec<u8> {
        self.unproven = 0;
        if behind == 0 || self.gateway.is_none() {
            return Vec::new();
        }
        if at_once {
            // Later it may be done with what was asked, though nobody was told; with what a lost connection has asked, at once.
            let soon = SOON.min(self.wait() / 2);
            let is_recent = |owed: &Owed| now.saturating_duration_since(owed.asked) < soon;
            let is_busy = crate::mutant!(
                "far-end-done-is-busy",
                self.owed.iter().all(|owed| is_recent(owed) && !owed.over_a_lost_port),
                true
            );
            if is_busy && self.owed.len() >= behind && behind >= self.serves && self.gateway_may_change() {
                self.serves = behind + 1;
                self.exactly = false;
            }
            return Vec::new();
        }
        if self.gateway_may_change() {
            // Behind two it may have waited for one after the other.
            self.serves = self.serves.min(behind);
            self.exactly = true;
        }
        self.done_with_all(now)
    }

    /// How long the late answer of this number has taken, where nothing else can have held it up: it was asked when nothing was
    /// owed, and nothing is owed besides.
    pub(super) fn took(&self, now: Instant, number: Option<u16>) -> Option<Duration> {
        let [only] = self.owed.as_slice() else { return None };
        let is_it = number.is_some() && only.number == number;
        let alone = only.turn == Some(Turn { free_from: only.asked, place: 1 });
        (is_it && alone).then(|| now.saturating_duration_since(only.asked))
    }

    /// An intact frame came that was no answer to what was asked. `nobody`: the gateway says that nobody answered. `None`:
    /// it was not owed. Gives otherwise the slaves that the far end has waited for in vain to the end.
    pub(super) fn heard(
        &mut self,
        now: Instant,
        slave: u8,
        number: Option<u16>,
        shape: Shape,
        nobody: bool,
    ) -> Option<Vec<u8>> {
        let is_it = |owed: &Owed| match (owed.number, number) {
            (Some(owed), Some(number)) => {
                crate::mutant!("far-end-any-late-answer", owed == number, true)
            }
            _ => owed.slave == slave && (owed.shape == shape || shape.is_refusal_of(owed.shape)),
        };
        // What a lost connection has asked has no number any more, and may look like it.
        let numbered = self.owed.iter().position(|owed| number.is_some() && owed.number == number);
        let at = numbered.or_else(|| self.owed.iter().position(is_it))?;
        // One after another: what was asked before is over too.
        let before: Vec<_> = self.owed.drain(if self.serves < 2 { ..at } else { ..0 }).collect();
        let owed = self.owed.remove(at - before.len());
        let mut given_up: Vec<_> = before.iter().filter_map(Owed::given_up).collect();
        let mut over = before;
        if nobody {
            given_up.extend(owed.given_up());
            over.push(owed);
        }
        self.saw(now, &over);
        self.unproven = 0;
        self.is_free(now);
        Some(given_up)
    }

    /// The gateway says of what is under way that nobody answered.
    pub(super) fn nobody_answered(&mut self, now: Instant, asked: Option<Asked>) {
        self.unproven = 0;
        // What it is done with since then had another place.
        let turn = asked.filter(|asked| self.free_from.is_none_or(|free| free <= asked.at));
        let waited = turn.and_then(|asked| {
            let before = self.owed.iter().rev().map(|owed| owed.asked);
            waited(now, asked.place.turn?, iter::once(asked.at).chain(before))
        });
        self.seen = waited.or(self.seen);
        self.is_free(now);
    }

    /// It is done with something, and comes to what it owes besides. What a lost connection has asked it may have forgotten.
    fn is_free(&mut self, now: Instant) {
        self.free_from = Some(now);
        let mut is_known = self.serves < 2;
        for (place, owed) in (1..).zip(&mut self.owed) {
            is_known &= !owed.over_a_lost_port;
            let free_from = crate::mutant!("far-end-waits-since-it-was-asked", now, owed.asked);
            owed.turn =
                if self.serves < 2 { is_known.then_some(Turn { free_from, place }) } else { owed.turn };
        }
    }

    /// What can no longer come, as far as is known: the slaves that were asked, where it is known how long is waited for
    /// them.
    pub(super) fn expired(&mut self, now: Instant) -> Vec<u8> {
        let none_is_over = self.owed.iter().all(|owed| owed.until > now);
        if crate::mutant!("far-end-owes-for-ever", none_is_over, true) {
            return Vec::new();
        }
        self.unproven = self.unproven.saturating_add(1);
        let waits = self.seen.is_some() || self.gateway.is_some_and(|gateway| gateway.wait.is_some());
        let over = self.owed.extract_if(.., |owed| owed.until <= now);
        over.filter_map(|owed| owed.given_up().filter(|_| waits)).collect()
    }

    /// The connection is lost, with this question under way: a gateway that has a line may still be at it.
    pub(super) fn lost(&mut self, under_way: Option<Asked>) {
        let goes_on = crate::mutant!("far-end-forgets-at-a-loss", self.exactly && self.serves < 2, false);
        if let Some(asked) = under_way.filter(|_| goes_on) {
            self.owe(asked);
        } else if let Some(asked) = under_way {
            self.left_until = Some(asked.at + self.wait() * 5 / 4);
        }
        if crate::mutant!("far-end-free-after-a-loss", false, true) {
            self.owed.clear();
        }
        for owed in &mut self.owed {
            owed.number = None;
            owed.over_a_lost_port = true;
            // It may have been answered in time, and nobody was told.
            owed.turn = None;
        }
    }

    fn done_with_all(&mut self, now: Instant) -> Vec<u8> {
        let over = std::mem::take(&mut self.owed);
        // What is served side by side shows nothing of how long each is waited for.
        if self.serves < 2 {
            self.saw(now, &over);
        }
        self.is_free(now);
        over.iter().filter_map(Owed::given_up).collect()
    }

    /// The last of these was over at `now`, for want of an answer, and so were those before it.
    fn saw(&mut self, now: Instant, over: &[Owed]) {
        let turn = over.last().and_then(|last| last.turn);
        let asked = over.iter().rev().map(|owed| owed.asked);
        self.seen = turn.and_then(|turn| waited(now, turn, asked)).or(self.seen);
    }
}

#[cfg(test)]
mod tests;
