//! Where the numbers of an execution come from: a seed, or bytes that somebody else has chosen.

use std::{
    ops::{Bound, RangeBounds},
    sync::mpsc::{self, Receiver, Sender},
};

use fastrand::Rng;

/// The numbers of one execution, one behind the other.
#[derive(Debug, Clone)]
pub struct Source {
    seeded: Rng,
    /// What is left of the bytes, the first one last; `None`: the numbers are those of the seed.
    bytes: Option<Vec<u8>>,
    /// Who is told the bytes by which what a seed has drawn is drawn again.
    told: Option<Sender<Vec<u8>>>,
}

macro_rules! draws {
    ($($name:ident)*) => {$(
        /// A number of this range. Behind the last byte each is the least.
        pub fn $name(&mut self, range: impl RangeBounds<$name>) -> $name {
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
            let most = last.saturating_sub(first) as u64;
            if let Some(bytes) = &mut self.bytes {
                return first + drawn(bytes, most) as $name;
            }
            let number = self.seeded.$name(range);
            self.tell(most, (number - first) as u64);
            number
        }
    )*};
}

/// Of so many bytes is a number from nought to `most`: of as few as it needs, so that one byte that changes changes one number.
const fn len_of(most: u64) -> usize {
    8 - most.leading_zeros() as usize / 8
}

/// One from nought to `most`.
fn drawn(bytes: &mut Vec<u8>, most: u64) -> u64 {
    let drawn = (0..len_of(most)).fold(0, |drawn, _| drawn << 8 | u64::from(bytes.pop().unwrap_or_default()));
    most.checked_add(1).map_or(drawn, |count| drawn % count)
}

impl Source {
    /// The numbers of a seed.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self { seeded: Rng::with_seed(seed), bytes: None, told: None }
    }

    /// The same, and the bytes by which they come again, told as they are drawn.
    pub(super) fn recorded(seed: u64) -> (Self, Receiver<Vec<u8>>) {
        let (told, bytes) = mpsc::channel();
        (Self { told: Some(told), ..Self::seeded(seed) }, bytes)
    }

    /// The numbers that these bytes are.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self { bytes: Some(bytes.iter().rev().copied().collect()), ..Self::seeded(0) }
    }

    draws!(u8 u16 u32 u64 usize);

    /// Yes or no.
    pub fn bool(&mut self) -> bool {
        self.u8(..2) == 1
    }

    /// A frame, a file or a text, of at most so many bytes: made of numbers, or as somebody has chosen it. By a seed it is always made, and
    /// recorded as if it had been chosen, so that whoever changes the recorded bytes changes what is read and not how it is made.
    pub(super) fn bytes(&mut self, most: usize, make: impl FnOnce(&mut Self) -> Vec<u8>) -> Vec<u8> {
        if self.bytes.is_some() && self.bool() {
            let len = self.usize(..=most);
            let left = self.bytes.get_or_insert_default();
            let mut chosen = left.split_off(left.len().saturating_sub(len));
            chosen.reverse();
            return chosen;
        }
        let told = self.told.take();
        let mut made = make(self);
        made.truncate(most);
        self.told = told;
        self.tell(1, 1);
        self.tell(most as u64, made.len() as u64);
        if let Some(told) = &self.told {
            drop(told.send(made.clone()));
        }
        made
    }

    /// The bytes by which a number up to `most` is drawn as this one.
    fn tell(&self, most: u64, number: u64) {
        if let Some(told) = &self.told {
            drop(told.send(number.to_be_bytes()[8 - len_of(most)..].to_vec()));
        }
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

    #[test]
    fn a_frame_is_what_was_chosen_or_made_of_numbers_and_no_longer_than_it_may_be() {
        let chosen = |bytes: &[u8]| {
            let mut source = Source::of(bytes);
            let frame = source.bytes(3, |source| vec![source.u8(..); 5]);
            (frame, source.u8(..))
        };
        assert_eq!(chosen(&[1, 2, 0x83, 2, 9]), (vec![0x83, 2], 9));
        assert_eq!(chosen(&[1, 3, 0x83]), (vec![0x83], 0));
        assert_eq!(chosen(&[0, 7, 9]), (vec![7; 3], 9));
    }

    #[test]
    fn what_a_seed_has_drawn_is_drawn_again_by_the_bytes_that_were_recorded() {
        let draw = |source: &mut Source| {
            let numbers = (source.u8(5..15), source.u16(..), source.u32(..40_000), source.u64(9..=9));
            let frame =
                source.bytes(300, |source| (0..source.usize(..400)).map(|_| source.u8(9..)).collect());
            (numbers, frame, source.bool(), source.usize(..=256), source.u64(..))
        };
        for seed in 0..100 {
            let (mut source, told) = Source::recorded(seed);
            let drawn = draw(&mut source);
            assert_eq!(draw(&mut Source::seeded(seed)), drawn);
            let bytes: Vec<u8> = told.try_iter().flatten().collect();
            let mut again = Source::of(&bytes);
            assert_eq!((draw(&mut again), again.bytes), (drawn, Some(Vec::new())));
        }
    }
}
