//! How often an address has come with a wrong token.

use std::{collections::BTreeMap, net::IpAddr, time::Duration};

use tokio::time::Instant;

/// Wrong tokens that an address may bring in [`WITHIN`].
const ALLOWED: usize = 10;
const WITHIN: Duration = Duration::from_secs(60);
/// Addresses that are remembered; of more, those that failed longest ago are forgotten.
const ADDRESSES: usize = 1_024;

/// The failures of each address in the last minute. The time is an argument.
#[derive(Debug, Default)]
pub(super) struct Failures(BTreeMap<IpAddr, Vec<Instant>>);

impl Failures {
    /// How long this address has to wait until its tokens are looked at again, if it has to.
    pub(super) fn wait(&self, address: IpAddr, now: Instant) -> Option<Duration> {
        let times = self.0.get(&address)?;
        let earliest = times.len().checked_sub(ALLOWED).and_then(|index| times.get(index))?;
        WITHIN.checked_sub(now.saturating_duration_since(*earliest)).filter(|wait| !wait.is_zero())
    }

    /// This address has brought a wrong token.
    pub(super) fn count(&mut self, address: IpAddr, now: Instant) {
        self.0.retain(|_, times| {
            times.last().is_some_and(|last| now.saturating_duration_since(*last) < WITHIN)
        });
        if self.0.len() >= ADDRESSES
            && !self.0.contains_key(&address)
            && let Some(oldest) =
                self.0.iter().min_by_key(|(_, times)| times.last().copied()).map(|(key, _)| *key)
        {
            self.0.remove(&oldest);
        }
        let times = self.0.entry(address).or_default();
        if times.len() >= ALLOWED {
            times.remove(0);
        }
        times.push(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_ten_failures_in_a_minute_an_address_waits_until_the_first_is_a_minute_old() {
        let (start, mut failures) = (Instant::now(), Failures::default());
        let [one, other] = [1, 2].map(|last| IpAddr::from([10, 0, 0, last]));
        for second in 0..10 {
            assert_eq!(failures.wait(one, start + Duration::from_secs(second)), None);
            failures.count(one, start + Duration::from_secs(second));
        }
        assert_eq!(failures.wait(one, start + Duration::from_secs(9)), Some(Duration::from_secs(51)));
        assert_eq!(failures.wait(one, start + Duration::from_secs(60)), None);
        assert_eq!(failures.wait(other, start + Duration::from_secs(9)), None);
    }

    #[test]
    fn many_addresses_take_no_room_without_end() {
        let (start, mut failures) = (Instant::now(), Failures::default());
        for number in 0..5_000_u32 {
            failures.count(IpAddr::from(number.to_be_bytes()), start + Duration::from_millis(number.into()));
        }
        assert_eq!(failures.0.len(), ADDRESSES);
    }
}
