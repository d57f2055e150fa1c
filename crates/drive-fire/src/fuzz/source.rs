//! Where the numbers of an execution come from: a seed, or bytes that somebody else has chosen.

use std::ops::{Bound, RangeBounds};

use fastrand::Rng;

/// The numbers of one execution, one behind the other.
#[derive(Debug, Clone)]
pub struct Source {
    seeded: Rng,
    /// What is left of the bytes, the first one last; `None`: the numbers are those of the seed.
    bytes: Option<Vec<u8>>,
}

macro_rules! draws {
    ($($name:ident)*) => {$(
        /// A number of this range. Behind the last byte each is the least.
        pub fn $name(&mut self, range: impl RangeBounds<$name>) -> $name {
            let Some(bytes) = &mut self.bytes else { return self.seeded.$name(range) };
            let first = match range.start_bound() {
                Bound::Included(first) => *first,
                Bound::Excluded(before) => before.saturating_add(1),
                Bound::Unbounded => $name::MIN,
            };
            let last = match range.end_bound() {
                Bound::Included(last) => *last,
                Bound::Excluded(behind) => behind.saturating_sub(1),
                Bound::Unbounded => $name::MAX,
            };
            first + drawn(bytes, last.saturating_sub(first) as u64) as $name
        }
    )*};
}

/// One from nought to `most`, of as few bytes as it needs, so that one byte that changes changes one number.
fn drawn(bytes: &mut Vec<u8>, most: u64) -> u64 {
    let len = 8 - most.leading_zeros() as usize / 8;
    let drawn = (0..len).fold(0, |drawn, _| drawn << 8 | u64::from(bytes.pop().unwrap_or_default()));
    most.checked_add(1).map_or(drawn, |count| drawn % count)
}

impl Source {
    /// The numbers of a seed.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self { seeded: Rng::with_seed(seed), bytes: None }
    }

    /// The numbers that these bytes are.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self { seeded: Rng::with_seed(0), bytes: Some(bytes.iter().rev().copied().collect()) }
    }

    draws!(u8 u16 u32 u64 usize);

    /// Yes or no.
    pub fn bool(&mut self) -> bool {
        self.u8(..2) == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_byte_is_a_number_of_its_range_and_behind_the_last_one_each_is_the_least() {
        let mut source = Source::of(&[7, 1, 2, 3, 200]);
        assert_eq!((source.u8(5..15), source.u16(..), source.bool()), (5 + 7, 0x0102, true));
        assert_eq!((source.usize(3..=5), source.u64(9..), source.bool()), (3 + 200 % 3, 9, false));
    }
}
