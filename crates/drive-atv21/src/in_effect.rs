//! Whether the blocks hold what F870, F871 and F875 to F879 say.
//!
//! A changed slot takes effect only after a reset of the drive (§6.3), anybody may have changed one, and no register
//! tells what is in effect. A block of another layout would be read as a wrong frequency or a wrong state. So the read
//! block is used only once each word of the fast set has stood in its place, and no other register that the block could
//! hold explains it. At rest nearly every word is 0 and explains nothing; that needs a turning motor.

use drive_core::{Class, Error, ExceptionMeaning, Measurements, Port, Result, registers::Register};

use crate::{
    Atv21, WriteBlock,
    blocks::{self, READ_BLOCK, ReadSlot, WriteSlot},
    status::FAST_SET,
};

/// What is known of the read block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadBlock {
    /// It has not shown what it holds. It is looked at after so many more measurements of a turning motor, and then after
    /// ever more, because a look takes many exchanges.
    Unshown { wait: u32, pause: u32 },
    /// It holds the fast set in these places; the others are not used.
    Shown([ReadSlot; 5]),
    /// It is not used.
    Unused,
}

impl Default for ReadBlock {
    fn default() -> Self {
        Self::Unshown { wait: 0, pause: 1 }
    }
}

impl ReadBlock {
    /// Whether to look at it after these measurements of a turning motor.
    const fn is_look_due(&mut self) -> bool {
        match self {
            Self::Unshown { wait: 0, pause } => {
                *self = Self::Unshown { wait: *pause, pause: pause.saturating_mul(2) };
                true
            }
            Self::Unshown { wait, .. } => {
                *wait -= 1;
                false
            }
            Self::Shown(_) | Self::Unused => false,
        }
    }
}

/// What a register has shown just before and just after the block was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    slot: ReadSlot,
    before: u16,
    after: u16,
}

impl Seen {
    /// Whether the register may have held this word in between.
    fn explains(self, word: u16) -> bool {
        let (low, high) = (self.before.min(self.after), self.before.max(self.after));
        let slack = match self.slot {
            ReadSlot::StatusWord | ReadSlot::Alarms | ReadSlot::LogicInputs | ReadSlot::LogicOutputs => {
                return word == low || word == high;
            }
            // A measured value is never quite still.
            _ => high / 16 + 4,
        };
        (low.saturating_sub(slack)..=high.saturating_add(slack)).contains(&word)
    }
}

/// The places of the fast set in a block of these words, if it shows all of them: each word explained by the register
/// that is configured and by no other. A place that holds nothing may read 0, so 0 shows nothing.
fn shown(configured: [ReadSlot; 5], block: &[u16], seen: &[Seen]) -> Option<[ReadSlot; 5]> {
    let mut places = [ReadSlot::None; 5];
    for ((place, slot), &word) in places.iter_mut().zip(configured).zip(block) {
        let mut explained = seen.iter().filter(|seen| seen.explains(word)).map(|seen| seen.slot);
        if is_fast(slot) && word != 0 && explained.next() == Some(slot) && explained.next().is_none() {
            *place = slot;
        }
    }
    holds_fast_set(&places).then_some(places)
}

/// Whether its register belongs to the fast set.
fn is_fast(slot: ReadSlot) -> bool {
    slot.register().is_some_and(|register| FAST_SET.map(Register::address).contains(&register.address()))
}

fn holds_fast_set(slots: &[ReadSlot; 5]) -> bool {
    FAST_SET.iter().all(|wanted| {
        let held = |slot: &ReadSlot| slot.register().is_some_and(|at| at.address() == wanted.address());
        slots.iter().any(held)
    })
}

/// Whether an exception says that the drive does not have such a block.
pub(crate) const fn is_refusal(meaning: ExceptionMeaning) -> bool {
    matches!(meaning, ExceptionMeaning::ValueRefused | ExceptionMeaning::NoSuchRegister)
}

impl<P: Port> Atv21<P> {
    /// Nothing that was known of the blocks counts any more: the drive may have started up anew.
    pub(crate) fn forget_blocks(&mut self) {
        self.read_block = ReadBlock::default();
        if let WriteBlock::Read(_) = self.write_block {
            self.write_block = WriteBlock::Promised;
        }
    }

    /// Looks at what the read block holds, where the motor turns and it is worth it. A look belongs to the slow set: on a
    /// full line its exchanges would hold up a status for longer than the status is fresh.
    pub(crate) async fn look_at_block(&mut self, measurements: &Measurements) {
        let turning = measurements.speed.is_some_and(|speed| speed.rpm() != 0);
        if !turning || !self.read_block.is_look_due() {
            return;
        }
        match self.compare_block().await {
            Ok(Some(read_block)) => self.read_block = read_block,
            Err(Error::Exception { meaning, .. }) if is_refusal(meaning) => {
                self.read_block = ReadBlock::Unused;
            }
            // The measurements were read whole all the same; what the line lacks, the next look will tell.
            Ok(None) | Err(_) => {}
        }
    }

    /// What is known of the block after a look; `None`: no more than before.
    async fn compare_block(&mut self) -> Result<Option<ReadBlock>> {
        let class = Class::Background;
        let configured = self.read_slots(class).await?;
        if !holds_fast_set(&configured) {
            return Ok(Some(ReadBlock::Unused));
        }
        let status = self.read_status(class).await?;
        let mut calls = self.registers.at(class);
        let block = calls.read_words(READ_BLOCK, blocks::read_count(&configured)).await?;
        let mut seen = Vec::with_capacity(ReadSlot::CHOICES.len());
        for slot in ReadSlot::CHOICES {
            let Some(register) = slot.register() else { continue };
            let after = calls.read(register).await?;
            let before = status.raw(register.address()).unwrap_or(after);
            seen.push(Seen { slot, before, after });
        }
        Ok(shown(configured, &block, &seen).map(ReadBlock::Shown))
    }

    /// What the write block holds; `None` where nobody says that it is in effect.
    pub(crate) async fn write_slots(&mut self) -> Result<Option<[WriteSlot; 2]>> {
        match self.write_block {
            WriteBlock::Unused => Ok(None),
            WriteBlock::Read(slots) => Ok(Some(slots)),
            WriteBlock::Promised => {
                let slots = self.configured_write_slots(Class::Command).await?;
                self.write_block = WriteBlock::Read(slots);
                Ok(Some(slots))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::Blocks;

    const STANDARD: [ReadSlot; 5] = Blocks::STANDARD.read;

    /// What the registers show: FD01, FD00, FE03, FE05, FC91, FE22, FD06, FD07, FE35, FE36, FE90.
    fn seen(words: [u16; 11]) -> Vec<Seen> {
        let seen = |(slot, word)| Seen { slot, before: word, after: word };
        ReadSlot::CHOICES.into_iter().zip(words).map(seen).collect()
    }

    fn running() -> Vec<Seen> {
        seen([0x6400, 5_000, 3_700, 10_000, 0, 0, 1, 0, 700, 12, 1_500])
    }

    #[test]
    fn a_turning_motor_shows_the_places_of_the_fast_set() {
        let mut places = STANDARD;
        places[3..].fill(ReadSlot::None);
        assert_eq!(shown(STANDARD, &[0x6400, 5_010, 3_650, 9_990, 0], &running()), Some(places));
        let swapped = [ReadSlot::None, STANDARD[2], STANDARD[1], ReadSlot::Unknown(12), STANDARD[0]];
        let expected = [ReadSlot::None, STANDARD[2], STANDARD[1], ReadSlot::None, STANDARD[0]];
        assert_eq!(shown(swapped, &[0, 3_700, 5_000, 7, 0x6400], &running()), Some(expected));
    }

    #[test]
    fn a_motor_at_rest_shows_nothing_and_the_look_is_repeated_ever_more_rarely() {
        let at_rest = seen([0x4000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(shown(STANDARD, &[0x4000, 0, 0, 0, 0], &at_rest), None);
        let mut block = ReadBlock::default();
        let looks: Vec<_> = (0..20).filter(|_| block.is_look_due()).collect();
        assert_eq!(looks, [0, 2, 5, 10, 19]);
        assert!(!ReadBlock::Shown(STANDARD).is_look_due());
        assert!(!ReadBlock::Unused.is_look_due());
    }

    #[test]
    fn another_layout_than_the_configured_one_shows_nothing_whatever_it_shows() {
        for block in [[0x6400, 3_700, 5_000, 10_000, 0], [5_000, 0x6400, 3_700, 10_000, 0], [0; 5]] {
            assert_eq!(shown(STANDARD, &block, &running()), None, "{block:?}");
        }
        // Another register stands in one place, and happens to hold the same word as the one that belongs there.
        for (place, configured) in STANDARD.into_iter().enumerate().take(3) {
            for held in ReadSlot::CHOICES.into_iter().filter(|held| *held != configured) {
                for word in [0, 1, 500, 5_000, 0x6400, u16::MAX] {
                    let mut seen = running();
                    for other in seen.iter_mut().filter(|seen| [held, configured].contains(&seen.slot)) {
                        (other.before, other.after) = (word, word);
                    }
                    let mut block = [0x6400, 5_000, 3_700, 10_000, 0];
                    block[place] = word;
                    assert_eq!(shown(STANDARD, &block, &seen), None, "{held:?} for {configured:?}: {word}");
                }
            }
        }
    }

    #[test]
    fn a_value_that_moves_while_it_is_read_still_explains_its_word() {
        let moving = Seen { slot: ReadSlot::OutputFrequency, before: 2_000, after: 2_600 };
        assert_eq!([1_990, 2_300, 2_700].map(|word| moving.explains(word)), [true; 3]);
        assert_eq!([1_500, 3_200, 0].map(|word| moving.explains(word)), [false; 3]);
    }

    #[test]
    fn a_block_without_the_whole_fast_set_is_not_worth_a_look() {
        use ReadSlot as R;
        assert!(holds_fast_set(&STANDARD));
        assert!(holds_fast_set(&[
            R::OutputSpeed,
            R::OutputFrequency,
            R::OutputCurrent,
            R::StatusWord,
            R::None
        ]));
        assert!(!holds_fast_set(&[R::StatusWord, R::OutputFrequency, R::Alarms, R::Unknown(3), R::None]));
    }
}
