//! The share of a line that the commands of one slave have: a stream of them, such as two controllers that give setpoints to one drive
//! as fast as it takes them, must not keep everybody else from being asked, or their watchdogs trip.

use std::{collections::BTreeMap, time::Duration};

use drive_core::Class;
use tokio::time::Instant;

/// So many turns of one slave's Commands go ahead of what others wait for: more than any command of a drive takes, with all that is read
/// before and behind it.
const AHEAD: u32 = 16;

/// A slave that has had no Command for so long has its share anew.
const ANEW: Duration = Duration::from_secs(1);

/// What the Commands of each slave have had while others waited.
#[derive(Debug, Default)]
pub(super) struct Shares {
    taken: BTreeMap<u8, Taken>,
    /// The last turn was a Command's.
    last: bool,
}

#[derive(Debug)]
struct Taken {
    turns: u32,
    at: Instant,
}

impl Shares {
    pub(super) const fn new() -> Self {
        Self { taken: BTreeMap::new(), last: false }
    }

    /// Whether the next Command of a slave leaves one turn to the others.
    pub(super) fn gives_way(&self, now: Instant, slave: u8) -> bool {
        let taken = self.taken.get(&slave).filter(|taken| taken.at + ANEW > now);
        self.last && taken.is_some_and(|taken| taken.turns >= AHEAD)
    }

    /// A class has a turn for a slave, while others wait or not.
    pub(super) fn count(&mut self, now: Instant, class: Class, slave: u8, others_wait: bool) {
        self.last = class == Class::Command;
        if !self.last {
            return;
        }
        let taken = self.taken.entry(slave).or_insert(Taken { turns: 0, at: now });
        if taken.at + ANEW <= now {
            taken.turns = 0;
        }
        *taken = Taken { turns: taken.turns.saturating_add(others_wait.into()), at: now };
    }
}
