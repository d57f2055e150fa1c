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

use std::time::Duration;

use tokio::time::Instant;

use crate::{
    gateway::Gateway,
    shape::Shape,
    stats::{FarEndStats, SecondConnection, WaitIs},
};

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
}

/// A question in vain.
#[derive(Debug, Clone, Copy)]
struct Owed {
    slave: u8,
    number: Option<u16>,
    shape: Shape,
    asked: Instant,
    until: Instant,
    /// It was asked over a connection that is gone, and so may be the question.
    over_a_lost_port: bool,
}

/// A question that was given up, or is under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) slave: u8,
    pub(super) number: Option<u16>,
    pub(super) shape: Shape,
    pub(super) at: Instant,
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
        let in_turn = crate::mutant!("far-end-serves-side-by-side", self.serves < 2, false);
        let begins = self.owed.iter().map(|owed| owed.until).max().filter(|_| in_turn);
        let wait = crate::mutant!("far-end-gives-up-early", self.wait() * 5 / 4, self.wait() / 4);
        let limit = wait * (1 << self.unproven.min(DOUBLINGS));
        // It came to it when it was done with what it was at, which may be later than it was asked.
        let begins = begins.or(self.free_from.filter(|_| in_turn));
        let until = begins.unwrap_or(asked.at).max(asked.at) + limit;
        let Asked { slave, number, shape, at } = asked;
        if self.owed.len() >= MOST {
            self.owed.remove(0);
        }
        self.owed.push(Owed { slave, number, shape, asked: at, until, over_a_lost_port: false });
        self.in_vain = self.in_vain.saturating_add(1);
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
        let is_it = number.is_some() && only.number == number && !only.over_a_lost_port;
        let alone = self.free_from.is_none_or(|free| free <= only.asked);
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
        let at = self.owed.iter().position(is_it)?;
        let mut given_up = Vec::new();
        if self.serves < 2 {
            // One after another: what was asked before is over too.
            let before: Vec<_> = self.owed.drain(..at).collect();
            if let Some(first) = before.first() {
                self.saw(now, first.asked, before.len());
                given_up.extend(before.iter().map(|owed| owed.slave));
            }
        }
        let owed = self.owed.remove(if self.serves < 2 { 0 } else { at });
        if nobody {
            self.saw(now, owed.asked, 1);
            given_up.push(owed.slave);
        }
        self.unproven = 0;
        self.free_from = Some(now);
        Some(given_up)
    }

    /// The gateway says of what was asked at `asked` that nobody answered.
    pub(super) fn nobody_answered(&mut self, now: Instant, asked: Instant) {
        self.unproven = 0;
        if self.owed.is_empty() {
            self.saw(now, asked, 1);
        }
        self.free_from = Some(now);
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
        over.filter(|owed| waits && !owed.over_a_lost_port).map(|owed| owed.slave).collect()
    }

    /// The connection is lost, with this question under way: a gateway that has a line may still be at it.
    pub(super) fn lost(&mut self, under_way: Option<Asked>) {
        let goes_on = crate::mutant!("far-end-forgets-at-a-loss", self.exactly && self.serves < 2, false);
        if let Some(asked) = under_way.filter(|_| goes_on) {
            self.owe(asked);
        }
        if crate::mutant!("far-end-free-after-a-loss", false, true) {
            self.owed.clear();
        }
        for owed in &mut self.owed {
            owed.number = None;
            owed.over_a_lost_port = true;
        }
    }

    fn done_with_all(&mut self, now: Instant) -> Vec<u8> {
        // What is served side by side shows nothing of how long each is waited for.
        if let Some(first) = self.owed.first().filter(|_| self.serves < 2).map(|owed| owed.asked) {
            self.saw(now, first, self.owed.len());
        }
        let slaves = self.owed.drain(..).map(|owed| owed.slave).collect();
        self.free_from = Some(now);
        slaves
    }

    /// So many questions, the first of them asked at `asked`, were over at `now`, for want of an answer.
    fn saw(&mut self, now: Instant, asked: Instant, questions: usize) {
        let began = crate::mutant!(
            "far-end-waits-since-it-was-asked",
            self.free_from.map_or(asked, |free| free.max(asked)),
            asked
        );
        let shares = crate::mutant!("far-end-waits-for-one", u32::try_from(questions).unwrap_or(1).max(1), 1);
        let waited = now.saturating_duration_since(began) / shares;
        if waited > Duration::ZERO {
            self.seen = Some(waited);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);
    const MS: Duration = Duration::from_millis(1);

    fn asked(slave: u8, number: u16, at: Instant) -> Asked {
        Asked { slave, number: Some(number), shape: Shape::ANY, at }
    }

    #[test]
    fn nothing_is_owed_where_nothing_is_in_between() {
        let mut far = FarEnd::new(None);
        far.owe(asked(1, 1, Instant::now()));
        assert_eq!((far.owes(), far.gate(true), far.stop_waits()), (0, None, Duration::ZERO));
    }

    #[test]
    fn one_living_drive_is_read_to_see_and_nothing_is_written_meanwhile() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        assert_eq!(far.gate(true), None);
        assert!(far.gate(false).is_some());
        far.owe(asked(2, 2, now));
        assert!(far.gate(true).is_some(), "two are enough");
    }

    #[test]
    fn what_is_answered_at_once_beside_a_question_in_vain_shows_that_it_does_more_at_once() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        assert!(far.answered(now + 20 * MS, 1, true).is_empty());
        assert_eq!((far.gate(false), far.held_up(now)), (None, Duration::ZERO));
        assert!(!far.holds_others_up());
        far.owe(asked(3, 2, now));
        assert!(far.gate(false).is_some(), "of three at once nothing is known");
        assert_eq!(far.gate(true), None);
    }

    #[test]
    fn an_answer_at_once_when_the_far_end_may_be_done_says_nothing_of_how_much_it_does_at_once() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        // A stop, sent when the gateway had given up without a word.
        assert!(far.answered(now + 3_200 * MS, 1, true).is_empty());
        assert!(far.holds_others_up());
        assert_eq!(far.stop_waits(), 2 * Gateway::ASSUMED_WAIT);
    }

    #[test]
    fn an_answer_behind_two_questions_in_vain_does_not_show_that_two_are_served_at_once() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        far.owe(asked(2, 2, now));
        assert_eq!(far.answered(now + 6 * SECOND, 2, false), [1, 2]);
        assert!(far.holds_others_up());
        assert_eq!((far.wait(), far.stop_waits()), (3 * SECOND, 3 * SECOND));
    }

    #[test]
    fn an_answer_behind_a_question_in_vain_shows_how_long_that_took_and_that_it_does_one_thing_at_a_time() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        assert_eq!(far.stop_waits(), 2 * Gateway::ASSUMED_WAIT);
        far.owe(asked(1, 1, now));
        assert_eq!(far.answered(now + 2 * SECOND, 1, false), [1]);
        assert_eq!((far.wait(), far.stop_waits(), far.owes()), (2 * SECOND, 2 * SECOND, 0));
        far.owe(asked(1, 3, now + 3 * SECOND));
        assert_eq!(far.gate(true), Some(now + 5_500 * MS));
        assert!(far.expired(now + 5_400 * MS).is_empty());
        assert_eq!(far.expired(now + 5_500 * MS), [1]);
    }

    #[test]
    fn a_late_answer_of_known_number_ends_what_was_asked_before_it() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway { at_once: Some(1), ..Gateway::default() }));
        far.owe(asked(1, 1, now));
        far.owe(asked(2, 2, now + SECOND));
        assert_eq!(far.heard(now + 9 * SECOND, 2, Some(7), Shape::ANY, false), None);
        assert_eq!(far.heard(now + 9 * SECOND, 2, Some(2), Shape::ANY, false), Some(vec![1]));
        assert_eq!((far.owes(), far.wait()), (0, 9 * SECOND));
    }

    #[test]
    fn a_late_answer_tells_its_own_time_only_where_nothing_held_it_up() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        assert_eq!(far.took(now + 250 * MS, Some(1)), Some(250 * MS));
        assert_eq!(far.took(now + 250 * MS, Some(2)), None, "another question's");
        assert_eq!(far.took(now + 250 * MS, None), None, "whose, nobody knows");
        far.owe(asked(2, 2, now + 100 * MS));
        assert_eq!(far.took(now + 250 * MS, Some(1)), None);
        far.heard(now + 250 * MS, 1, Some(1), Shape::ANY, false);
        assert_eq!(far.took(now + 500 * MS, Some(2)), None, "it has waited behind the first");
    }

    #[test]
    fn a_gateway_that_says_nobody_teaches_its_wait() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway::default()));
        far.owe(asked(1, 1, now));
        assert_eq!(far.heard(now + 4 * SECOND, 1, Some(1), Shape::ANY, true), Some(vec![1]));
        assert_eq!(far.wait(), 4 * SECOND);
    }

    #[test]
    fn what_waited_in_the_gateway_is_owed_from_when_the_gateway_came_to_it() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway { at_once: Some(1), wait: Some(SECOND) }));
        far.owe(asked(3, 1, now));
        // A stop is sent behind it; the gateway says after a second that nobody answered, and only then comes to the stop.
        assert_eq!(far.heard(now + SECOND, 3, Some(1), Shape::ANY, true), Some(vec![3]));
        far.owe(asked(4, 2, now + 300 * MS));
        assert_eq!(far.gate(false), Some(now + 2_250 * MS));
    }

    #[test]
    fn a_lost_connection_ends_nothing_that_a_gateway_is_at() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway { at_once: Some(1), wait: Some(SECOND) }));
        far.owe(asked(3, 1, now));
        far.lost(Some(asked(1, 2, now + 300 * MS)));
        assert_eq!(far.owes(), 2);
        assert_eq!(far.gate(true), Some(now + 1_250 * MS));
    }

    #[test]
    fn a_gateway_waits_from_when_it_came_to_a_question() {
        let now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway { at_once: Some(1), wait: Some(SECOND) }));
        far.owe(asked(3, 1, now));
        far.owe(asked(4, 2, now + 300 * MS));
        assert_eq!(far.heard(now + SECOND, 3, Some(1), Shape::ANY, true), Some(vec![3]));
        assert_eq!(far.heard(now + 2 * SECOND, 4, Some(2), Shape::ANY, true), Some(vec![4]));
        assert_eq!(far.wait(), SECOND);
    }

    #[test]
    fn while_nothing_proves_that_it_is_done_it_is_asked_less_and_less() {
        let mut now = Instant::now();
        let mut far = FarEnd::new(Some(Gateway { wait: Some(SECOND), ..Gateway::default() }));
        let mut limits = Vec::new();
        for number in 0..4 {
            far.owe(asked(1, number, now));
            let until = far.gate(false).expect("it is owed");
            limits.push(until - now);
            now = until;
            assert_eq!(far.expired(now), [1]);
        }
        assert_eq!(limits, [1_250 * MS, 2_500 * MS, 5_000 * MS, 5_000 * MS]);
    }
}
