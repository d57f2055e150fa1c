//! How often somebody has done what he should not: come with a wrong token, or asked for what he may not do.

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;

/// So often in [`WITHIN`]; then it is counted alone.
const ALLOWED: usize = 10;
const WITHIN: Duration = Duration::from_secs(60);
/// Those who are remembered; of more, those that failed longest ago are forgotten.
const REMEMBERED: usize = 1_024;

/// The failures of each in the last minute. The time is an argument.
#[derive(Debug)]
pub(super) struct Failures<K>(BTreeMap<K, Times>);

#[derive(Debug, Default)]
struct Times {
    /// The last [`ALLOWED`] of them.
    last: Vec<Instant>,
    /// Those that were not told.
    untold: u64,
}

impl<K> Default for Failures<K> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<K: Ord + Clone> Failures<K> {
    /// How long this one has to wait until he is listened to again, if he has to.
    pub(super) fn wait(&self, who: &K, now: Instant) -> Option<Duration> {
        let times = &self.0.get(who)?.last;
        let earliest = times.len().checked_sub(ALLOWED).and_then(|index| times.get(index))?;
        WITHIN.checked_sub(now.saturating_duration_since(*earliest)).filter(|wait| !wait.is_zero())
    }

    /// This one has failed. Gives how many of his were not told before, if this one is to be told.
    pub(super) fn count(&mut self, who: &K, now: Instant) -> Option<u64> {
        let waits = self.wait(who, now).is_some();
        self.0.retain(|_, times| {
            times.last.last().is_some_and(|last| now.saturating_duration_since(*last) < WITHIN)
        });
        if self.0.len() >= REMEMBERED
            && !self.0.contains_key(who)
            && let Some(oldest) =
                self.0.iter().min_by_key(|(_, times)| times.last.last().copied()).map(|(key, _)| key.clone())
        {
            self.0.remove(&oldest);
        }
        let times = self.0.entry(who.clone()).or_default();
        if waits {
            // Whoever goes on waits from his last told one on: a flood is told ten times a minute.
            times.untold = times.untold.saturating_add(1);
            return None;
        }
        if times.last.len() >= ALLOWED {
            times.last.remove(0);
        }
        times.last.push(now);
        Some(std::mem::take(&mut times.untold))
    }
}

#[cfg(test)]
mod tests {
    use std::net::IpAddr;

    use super::*;

    #[test]
    fn after_ten_failures_in_a_minute_an_address_waits_until_the_first_is_a_minute_old() {
        let (start, mut failures) = (Instant::now(), Failures::default());
        let [one, other] = [1, 2].map(|last| IpAddr::from([10, 0, 0, last]));
        for second in 0..10 {
            assert_eq!(failures.wait(&one, start + Duration::from_secs(second)), None);
            failures.count(&one, start + Duration::from_secs(second));
        }
        assert_eq!(failures.wait(&one, start + Duration::from_secs(9)), Some(Duration::from_secs(51)));
        assert_eq!(failures.wait(&one, start + Duration::from_secs(60)), None);
        assert_eq!(failures.wait(&other, start + Duration::from_secs(9)), None);
    }

    #[test]
    fn many_addresses_take_no_room_without_end() {
        let (start, mut failures) = (Instant::now(), Failures::default());
        for number in 0..5_000_u32 {
            failures.count(&IpAddr::from(number.to_be_bytes()), start + Duration::from_millis(number.into()));
        }
        assert_eq!(failures.0.len(), REMEMBERED);
    }

    #[test]
    fn of_a_flood_ten_a_minute_are_told_and_the_others_are_counted() {
        let (start, mut failures) = (Instant::now(), Failures::default());
        let told: Vec<u64> = (0..1_200)
            .filter_map(|tenth| failures.count(&"panel", start + Duration::from_millis(100) * tenth))
            .collect();
        assert_eq!(told, [vec![0; 10], vec![590], vec![0; 9]].concat());
    }
}
