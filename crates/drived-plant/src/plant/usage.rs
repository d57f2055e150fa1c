//! How much of each line was needed lately.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use drive_bus::stats::Stats;

/// How many looks back "lately" begins.
const LOOKS: usize = 5;

/// The last looks at each line.
#[derive(Default)]
pub struct Usage(Mutex<BTreeMap<Arc<str>, VecDeque<Look>>>);

/// How long a line was open, and needed, until then.
type Look = (Duration, Duration);

impl Usage {
    /// Looks at all lines, once a second.
    pub(super) fn look<'a>(&self, lines: impl IntoIterator<Item = (&'a Arc<str>, Stats)>) {
        let mut looks = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut before = std::mem::take(&mut *looks);
        for (line, stats) in lines {
            let mut seen = before.remove(line).unwrap_or_default();
            // A line that was opened anew counts from the beginning.
            if seen.back().is_some_and(|(elapsed, _)| *elapsed > stats.elapsed) {
                seen.clear();
            }
            if seen.len() >= LOOKS {
                seen.pop_front();
            }
            seen.push_back((stats.elapsed, stats.busy));
            looks.insert(Arc::clone(line), seen);
        }
    }

    /// The share of the time since some looks ago in which a line was needed, in per cent; before the first look that since it
    /// was opened.
    pub(super) fn percent(&self, line: &str, stats: &Stats) -> f64 {
        let looks = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (elapsed, busy) = looks.get(line).and_then(VecDeque::front).copied().unwrap_or_default();
        let time = stats.elapsed.saturating_sub(elapsed).as_secs_f64();
        let used = stats.busy.saturating_sub(busy).as_secs_f64();
        // An exchange counts when it has ended, and may have begun before.
        if time > 0.0 { (used / time * 10_000.0).round().min(10_000.0) / 100.0 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stats(elapsed: u64, busy: u64) -> Stats {
        let mut stats = Stats::default();
        (stats.elapsed, stats.busy) = (Duration::from_millis(elapsed), Duration::from_millis(busy));
        stats
    }

    #[test]
    fn what_a_line_did_hours_ago_is_no_part_of_its_present_utilisation() {
        let (usage, line) = (Usage::default(), Arc::from("north"));
        assert_eq!(
            usage.percent("north", &stats(1_000, 250)),
            25.0,
            "since it was opened, before the first look"
        );
        for second in 3_600..3_610 {
            usage.look([(&line, stats(second * 1_000, 3_000_000))]);
        }
        assert_eq!(usage.percent("north", &stats(3_610_000, 3_000_000)), 0.0);
        assert_eq!(usage.percent("north", &stats(3_610_000, 3_002_500)), 50.0);
        usage.look([(&line, stats(1_000, 500))]);
        assert_eq!(usage.percent("north", &stats(2_000, 500)), 0.0, "it was opened anew");
        usage.look([]);
        assert_eq!(usage.percent("north", &stats(2_000, 500)), 25.0, "a line that is gone is forgotten");
    }
}
