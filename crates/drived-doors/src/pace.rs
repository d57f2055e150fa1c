//! How fast an address is refused. Whoever asks again and again for what he does not get would else keep the processor, from which stops
//! live too; so the answers that refuse him come slower and slower. What is done for anybody waits for none of this, least of all a stop.

use std::{collections::BTreeMap, net::IpAddr, time::Duration};

use tokio::time::Instant;

/// What a refusal costs an address, and how much of it may be owed before the next is held back.
const EACH: Duration = Duration::from_millis(50);
const OWED: Duration = Duration::from_secs(1);
/// No refusal is held back for longer.
const LONGEST: Duration = Duration::from_secs(1);
/// Addresses that are remembered; of more, whoever comes is held back at once.
const REMEMBERED: usize = 1_024;

/// Until when each address owes the time of its refusals. The time is an argument.
#[derive(Debug, Default)]
pub(super) struct Pace(BTreeMap<IpAddr, Instant>);

impl Pace {
    /// This one is refused: for how long the answer is held back.
    pub(super) fn hold(&mut self, address: IpAddr, now: Instant) -> Duration {
        if self.0.len() >= REMEMBERED && !self.0.contains_key(&address) {
            self.0.retain(|_, until| *until > now);
            if self.0.len() >= REMEMBERED {
                return LONGEST;
            }
        }
        let until = self.0.entry(address).or_insert(now);
        let owes = until.saturating_duration_since(now).saturating_add(EACH).min(OWED + LONGEST);
        *until = now + owes;
        owes.saturating_sub(OWED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn twenty_refusals_come_at_once_and_then_each_later_until_the_address_has_been_quiet() {
        let (start, mut pace) = (Instant::now(), Pace::default());
        let [one, other] = [1, 2].map(|last| IpAddr::from([10, 0, 0, last]));
        assert!((0..20).all(|_| pace.hold(one, start).is_zero()));
        assert_eq!([(); 3].map(|()| pace.hold(one, start)), [50 * MS, 100 * MS, 150 * MS]);
        assert!((0..100).any(|_| pace.hold(one, start) == 1_000 * MS));
        assert_eq!(pace.hold(one, start), 1_000 * MS, "and no later");
        assert_eq!(pace.hold(other, start), Duration::ZERO);
        assert_eq!(pace.hold(one, start + 1_500 * MS), Duration::ZERO);
        // Whoever asks once in a while is never held back.
        assert!((0..1_000).all(|number| pace.hold(other, start + number * 100 * MS).is_zero()));
    }

    #[test]
    fn many_addresses_take_no_room_without_end() {
        let (start, mut pace) = (Instant::now(), Pace::default());
        let holds: Vec<Duration> =
            (0..5_000_u32).map(|number| pace.hold(IpAddr::from(number.to_be_bytes()), start)).collect();
        assert_eq!(pace.0.len(), REMEMBERED);
        assert_eq!(holds.iter().filter(|hold| hold.is_zero()).count(), REMEMBERED);
        assert_eq!(pace.hold(IpAddr::from([9; 4]), start + 2_000 * MS), Duration::ZERO, "they are forgotten");
    }
}
