//! What happens again and again: told a few times, then counted.

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;
use tracing::Level;

use super::Entry;

/// How often the same is told within [`WINDOW`].
const TOLD: u32 = 3;
/// After which time it is said how often it happened again.
const WINDOW: Duration = Duration::from_secs(60);

/// Counts what is told, by what it is about.
#[derive(Debug, Default)]
pub(super) struct Repeats(BTreeMap<String, Repeat>);

#[derive(Debug)]
struct Repeat {
    since: Instant,
    told: u32,
    counted: u32,
    last: Entry,
}

impl Repeats {
    /// Whether it is to be told; otherwise it is counted.
    pub(super) fn admit(&mut self, now: Instant, key: String, level: Level, text: &str) -> bool {
        let last = Entry { level, text: text.to_owned() };
        let repeat =
            self.0.entry(key).or_insert(Repeat { since: now, told: 0, counted: 0, last: last.clone() });
        if repeat.told < TOLD {
            repeat.told += 1;
            return true;
        }
        repeat.counted += 1;
        repeat.last = last;
        false
    }

    /// What has been counted for long enough.
    pub(super) fn due(&mut self, now: Instant) -> Vec<Entry> {
        self.take(|since| now.saturating_duration_since(since) >= WINDOW, now)
    }

    /// Whatever has been counted.
    pub(super) fn rest(&mut self, now: Instant) -> Vec<Entry> {
        self.take(|_| true, now)
    }

    fn take(&mut self, is_over: impl Fn(Instant) -> bool, now: Instant) -> Vec<Entry> {
        let mut told = Vec::new();
        self.0.retain(|_, repeat| {
            if !is_over(repeat.since) {
                return true;
            }
            if repeat.counted == 0 {
                return false;
            }
            let Entry { level, text } = &repeat.last;
            let times = if repeat.counted == 1 { "time" } else { "times" };
            let over = now.saturating_duration_since(repeat.since).as_secs();
            let over = if over >= WINDOW.as_secs() { "minute".to_owned() } else { format!("{over} s") };
            let text = format!("{text} (again {} {times} in the last {over})", repeat.counted);
            told.push(Entry { level: *level, text });
            (repeat.since, repeat.counted) = (now, 0);
            true
        });
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn what_is_told_again_and_again_is_counted_and_said_each_minute() {
        let (mut repeats, start) = (Repeats::default(), Instant::now());
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut say =
            |seconds, text: &str| repeats.admit(at(seconds), "pump 3".to_owned(), Level::WARN, text);
        let told: Vec<bool> = (0..60).map(|second| say(second, &format!("refused at {second}"))).collect();
        assert_eq!(told.iter().filter(|told| **told).count(), 3);
        assert_eq!(repeats.due(at(59)), []);
        let text = "refused at 59 (again 57 times in the last minute)".to_owned();
        assert_eq!(repeats.due(at(60)), [Entry { level: Level::WARN, text }]);
        // A quiet minute, and it is forgotten.
        assert_eq!(repeats.due(at(120)), []);
        assert!(repeats.admit(at(121), "pump 3".to_owned(), Level::WARN, "refused"));
    }
}
