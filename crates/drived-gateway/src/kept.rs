//! What drives have answered lately, for clients that may get it again: pure. A block is kept as it came, and never put
//! together from two.

use std::{
    collections::{HashMap, VecDeque},
    sync::{Mutex, PoisonError},
    time::Duration,
};

use drive_fleet::Place;
use tokio::time::Instant;

use super::pdu::Ask;

/// Blocks that are kept of each drive.
const BLOCKS: usize = 8;

/// The last blocks by drive.
#[derive(Debug, Default)]
pub(super) struct Kept(Mutex<HashMap<Place, VecDeque<Block>>>);

#[derive(Debug)]
struct Block {
    function: u8,
    address: u16,
    words: Vec<u16>,
    at: Instant,
}

impl Block {
    fn part(&self, function: u8, address: u16, count: u16) -> Option<Vec<u16>> {
        let from = usize::from(address.checked_sub(self.address)?);
        let part = self.words.get(from..from + usize::from(count))?;
        (self.function == function).then(|| part.to_vec())
    }
}

impl Kept {
    /// Keeps what was read.
    pub(super) fn keep(&self, drive: &Place, ask: &Ask, words: &[u16], at: Instant, max_age: Duration) {
        let Ask::Read { function, address, .. } = *ask else { return };
        if max_age.is_zero() {
            return;
        }
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let blocks = kept.entry(drive.clone()).or_default();
        blocks.retain(|block| (block.function, block.address) != (function, address));
        blocks.push_front(Block { function, address, words: words.to_vec(), at });
        blocks.truncate(BLOCKS);
    }

    /// What is asked for, if one block has it all and is young enough at `now`.
    pub(super) fn of(&self, drive: &Place, ask: &Ask, now: Instant, max_age: Duration) -> Option<Vec<u16>> {
        let Ask::Read { function, address, count } = *ask else { return None };
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let young = |block: &&Block| now.saturating_duration_since(block.at) < max_age;
        kept.get(drive)?.iter().filter(young).find_map(|block| block.part(function, address, count))
    }

    /// A drive was written to: what it held before is nobody's any more.
    pub(super) fn forget(&self, drive: &Place) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(drive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AGE: Duration = Duration::from_millis(500);

    fn ask(address: u16, count: u16) -> Ask {
        Ask::Read { function: 3, address, count }
    }

    #[test]
    fn a_part_of_one_block_is_told_until_it_is_too_old_and_two_blocks_are_never_joined() {
        let (kept, drive, start) = (Kept::default(), Place::from("pump"), Instant::now());
        kept.keep(&drive, &ask(10, 4), &[1, 2, 3, 4], start, AGE);
        kept.keep(&drive, &ask(14, 2), &[5, 6], start, AGE);
        assert_eq!(kept.of(&drive, &ask(11, 2), start, AGE), Some(vec![2, 3]));
        assert_eq!(kept.of(&drive, &ask(13, 2), start, AGE), None, "of two moments");
        assert_eq!(kept.of(&drive, &Ask::Read { function: 4, address: 11, count: 2 }, start, AGE), None);
        assert_eq!(kept.of(&"fan".into(), &ask(11, 2), start, AGE), None);
        assert_eq!(kept.of(&drive, &ask(11, 2), start + AGE, AGE), None);
        kept.forget(&drive);
        assert_eq!(kept.of(&drive, &ask(11, 2), start, AGE), None);
    }

    #[test]
    fn where_nothing_is_to_be_kept_nothing_is() {
        let (kept, drive, now) = (Kept::default(), Place::from("pump"), Instant::now());
        kept.keep(&drive, &ask(10, 1), &[1], now, Duration::ZERO);
        assert!(kept.0.lock().unwrap().is_empty());
        assert_eq!(kept.of(&drive, &ask(10, 1), now, Duration::ZERO), None);
    }
}
