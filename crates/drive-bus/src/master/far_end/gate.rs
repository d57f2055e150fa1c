//! What may be asked while something is owed.

use std::time::Duration;

use tokio::time::Instant;

use super::{FarEnd, turn::Owed};

/// Of so many questions in vain one asks again whether a far end that does one thing at a time still does.
const ASK_AGAIN: u32 = 8;

/// A gateway is still at what it was asked so short a time ago, unless it waits for less than twice that.
const SOON: Duration = Duration::from_secs(1);

impl FarEnd {
    /// Until when a request to this slave waits. `reads`: it is a read of a drive that answers, or of any where none does.
    pub(in crate::master) fn gate(&self, slave: u8, reads: bool) -> Option<Instant> {
        let asks_again = self.in_vain.is_multiple_of(ASK_AGAIN) && self.gateway_may_change();
        if self.is_full() {
            let asks_whether =
                crate::mutant!("far-end-asked-one-more", asks_again && self.owed.len() == self.serves, true);
            return if asks_whether && reads { None } else { self.owed.iter().map(|owed| owed.until).min() };
        }
        let before: Vec<&Owed> = self.before(slave).collect();
        let until = before.iter().map(|owed| owed.until).min()?;
        if let [own] = before[..]
            && own.slave == slave
            && own.passed
        {
            // Others have been asked meanwhile, and by what was seen of them are not held up by two of its questions.
            return Some(until.min(own.asked + self.soon()));
        }
        // Of all these one at the most is on this slave's own line then, so that nobody waits for more than two there.
        let may = |owed: &&Owed| {
            (reads || owed.passed)
                && owed.slave != slave
                && (asks_again && reads || !self.apart.waits(owed.slave, slave))
        };
        (!(before.iter().all(may) && self.are_apart(&before))).then_some(until)
    }

    /// Whether of these no two can be in front of somebody, as far as is known.
    fn are_apart(&self, owed: &[&Owed]) -> bool {
        let [first, rest @ ..] = owed else { return true };
        let is_apart =
            |other: &&Owed| (first.passed || other.passed) && self.apart.is(first.slave, other.slave);
        rest.iter().all(is_apart) && self.are_apart(rest)
    }

    /// For how long it is still at what it was asked in vain.
    fn soon(&self) -> Duration {
        SOON.min(self.wait() / 2)
    }

    /// Whether it is at as many things as it does at once.
    pub(super) const fn is_full(&self) -> bool {
        self.exactly && !self.owed.is_empty() && self.owed.len() >= self.serves
    }

    /// What is owed that may hold up what is asked of this slave.
    fn before(&self, slave: u8) -> impl Iterator<Item = &Owed> {
        let is_new = self.owed.len() >= self.serves;
        let holds_up = move |owed: &&Owed| is_new && !owed.passed || !self.apart.is(owed.slave, slave);
        self.owed.iter().filter(move |owed| self.is_full() || holds_up(owed))
    }

    pub(super) fn gateway_may_change(&self) -> bool {
        self.gateway.is_some_and(|gateway| gateway.at_once.is_none())
    }

    /// How much longer than usual the answer to what is sent to this slave at `now` may take, because it waits behind what is owed.
    pub(in crate::master) fn held_up(&self, now: Instant, slave: u8) -> Duration {
        let others = self.before(slave).filter(|owed| owed.slave != slave || !owed.passed);
        let last = others.map(|owed| owed.until).max();
        last.map_or(Duration::ZERO, |last| last.saturating_duration_since(now))
    }

    /// This slave was answered at once beside what is owed.
    pub(super) fn passed_by(&mut self, now: Instant, slave: u8) {
        // Later it may be done with what was asked, though nobody was told; with what a lost connection has asked, at once.
        let soon = self.soon();
        let mut busy = 0;
        for owed in &mut self.owed {
            owed.passed = true;
            let is_recent = now.saturating_duration_since(owed.asked) < soon && !owed.over_a_lost_port;
            if crate::mutant!("far-end-done-is-busy", is_recent, true) {
                busy += 1;
                self.apart.saw(owed.slave, slave, true);
            }
        }
        if busy >= self.serves && self.gateway_may_change() {
            self.serves = busy + 1;
            self.exactly = false;
        }
    }
}
