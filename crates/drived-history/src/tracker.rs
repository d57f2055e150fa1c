//! What is new of a drive: [`Tracker`], which turns its snapshots into what is kept. It has no clock of its own.
//!
//! A value is known from the status that shows it to the next one, if that comes before the first is stale; where it does not, nothing
//! is known behind the first.

use std::collections::BTreeMap;

use crate::quantity::Quantity;

/// A set that was read, as far as it says something new.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seen {
    /// When its exchange ended on the line, in milliseconds of the daemon's own clock.
    pub at: i64,
    /// Whether nothing is known between what was seen before and this.
    pub is_after_gap: bool,
    /// What has moved by more than its deadband; `None`: it is not shown any more. After a gap all of it.
    pub changed: Vec<(Quantity, Option<i64>)>,
}

/// Follows one set of one drive.
#[derive(Debug, Default)]
pub struct Tracker {
    last: Option<i64>,
    kept: BTreeMap<Quantity, i64>,
    is_broken: bool,
}

impl Tracker {
    /// A set was read at `at`, and is stale `max_age` later. `None`: it has been told before.
    pub fn see(&mut self, at: i64, max_age: i64, values: &[(Quantity, i64)]) -> Option<Seen> {
        if self.last.is_some_and(|last| at <= last) {
            return None;
        }
        let is_continued = self.last.is_some_and(|last| at - last <= max_age) && !self.is_broken;
        let is_after_gap = !is_continued;
        if is_after_gap {
            self.kept.clear();
        }
        let mut changed = Vec::new();
        for (quantity, count) in values {
            let is_kept = self
                .kept
                .get(quantity)
                .is_some_and(|kept| kept.abs_diff(*count) <= quantity.deadband().unsigned_abs());
            if !is_kept {
                self.kept.insert(*quantity, *count);
                changed.push((*quantity, Some(*count)));
            }
        }
        if self.kept.len() > values.len() {
            self.kept.retain(|quantity, _| {
                let is_shown = values.iter().any(|(shown, _)| shown == quantity);
                if !is_shown {
                    changed.push((*quantity, None));
                }
                is_shown
            });
        }
        (self.last, self.is_broken) = (Some(at), false);
        Some(Seen { at, is_after_gap, changed })
    }

    /// What was seen last is not followed by what comes: it was withdrawn, or could not be kept.
    pub fn break_off(&mut self) {
        self.is_broken = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;
    const AMPERES: Quantity = Quantity::CURRENT;

    #[test]
    fn a_value_is_kept_when_it_has_left_its_deadband_and_again_after_a_gap() {
        let mut tracker = Tracker::default();
        let seen = |at, is_after_gap, changed: &[(Quantity, Option<i64>)]| {
            Some(Seen { at, is_after_gap, changed: changed.to_vec() })
        };
        assert_eq!(tracker.see(0, 1_500, &[(HZ, 3_000)]), seen(0, true, &[(HZ, Some(3_000))]));
        assert_eq!(tracker.see(0, 1_500, &[(HZ, 9_999)]), None, "it is the same status");
        assert_eq!(tracker.see(1_000, 1_500, &[(HZ, 3_005)]), seen(1_000, false, &[]));
        // From what was kept, not from what was seen last: a slow drift is not lost.
        assert_eq!(tracker.see(2_000, 1_500, &[(HZ, 3_006)]), seen(2_000, false, &[(HZ, Some(3_006))]));
        assert_eq!(tracker.see(3_501, 1_500, &[(HZ, 3_006)]), seen(3_501, true, &[(HZ, Some(3_006))]));
        tracker.break_off();
        assert_eq!(tracker.see(4_000, 1_500, &[(HZ, 3_006)]), seen(4_000, true, &[(HZ, Some(3_006))]));
    }

    #[test]
    fn what_a_drive_shows_no_more_is_not_known_any_more() {
        let mut tracker = Tracker::default();
        let _ = tracker.see(0, 1_500, &[(HZ, 1), (AMPERES, 2)]);
        let seen = tracker.see(1_000, 1_500, &[(HZ, 1)]).unwrap();
        assert_eq!(seen.changed, [(AMPERES, None)]);
        let seen = tracker.see(2_000, 1_500, &[(HZ, 1), (AMPERES, 2)]).unwrap();
        assert_eq!(seen.changed, [(AMPERES, Some(2))]);
    }
}
