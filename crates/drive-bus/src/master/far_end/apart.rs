//! Which drives of a far end wait for each other, as far as was seen: those on one line behind it do, those with lines of their own do not.

use std::collections::{BTreeMap, BTreeSet};

/// Where so many were silent, and none of those that were answered meanwhile waited for any of them, each counts as having a line of its
/// own: on four lines that several share somebody has waited by then.
const MANY: usize = 4;

/// What was seen of the drives.
#[derive(Debug, Default)]
pub(super) struct Apart {
    /// Whether two are apart, the lower first.
    seen: BTreeMap<(u8, u8), bool>,
    /// How many of these wait for each other.
    waiting: usize,
    /// Beside whom others were answered at once.
    silent: BTreeSet<u8>,
    /// It is set that several are served at once, and nothing has shown otherwise.
    is_set: bool,
}

impl Apart {
    /// Of a far end that is set to serve so many at once.
    pub(super) fn new(at_once: Option<usize>) -> Self {
        Self { is_set: at_once.is_some_and(|at_once| at_once > 1), ..Self::default() }
    }

    /// While one was waited for in vain another was answered: at once, or only behind that.
    pub(super) fn saw(&mut self, silent: u8, answered: u8, are_apart: bool) {
        if silent == answered {
            return;
        }
        if are_apart {
            self.silent.insert(silent);
        }
        let before = self.seen.insert(pair(silent, answered), are_apart);
        self.waiting -= usize::from(before == Some(false));
        self.waiting += usize::from(!are_apart);
    }

    /// One was answered late, behind whom nobody knows.
    pub(super) fn somebody_waited(&mut self) {
        self.silent.clear();
        self.is_set = false;
    }

    /// Whether neither waits for the other, as far as is known. A drive waits for itself.
    pub(super) fn is(&self, one: u8, other: u8) -> bool {
        let all_are = self.waiting == 0 && (self.is_set || self.silent.len() >= MANY);
        one != other && self.seen.get(&pair(one, other)).copied().unwrap_or(all_are)
    }

    /// Whether neither was seen to wait for the other.
    pub(super) fn was_seen(&self, one: u8, other: u8) -> bool {
        self.seen.get(&pair(one, other)) == Some(&true)
    }

    /// Whether one is known to wait for the other.
    pub(super) fn waits(&self, one: u8, other: u8) -> bool {
        self.seen.get(&pair(one, other)) == Some(&false)
    }

    /// How many of those of which something is known wait for each other, as a part of them all.
    pub(super) fn waiting(&self) -> f64 {
        self.waiting as f64 / self.seen.len().max(1) as f64
    }
}

fn pair(one: u8, other: u8) -> (u8, u8) {
    (one.min(other), one.max(other))
}
