//! Whether the blocks hold what F870, F871 and F875 to F879 say.
//!
//! A changed slot takes effect only after a reset of the drive (§6.3), anybody may have changed one, and no register
//! tells what is in effect. A block of another layout would be read as a wrong frequency or a wrong state. So a place of
//! the read block is believed only once it has shown a word that, of all registers that it could hold, only the
//! configured one explains. At rest nearly every word is 0 and explains nothing; that needs a turning motor.

use drive_core::{Class, Error, ExceptionMeaning, Port, Result, Status};

use crate::{
    Atv21, WriteBlock,
    blocks::{self, READ_BLOCK, ReadSlot, WriteSlot},
    reading::{FAST_SET, SLOW_SET},
    registers as map,
};

/// What is believed of the read block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Belief {
    places: [ReadSlot; 5],
    /// How many statuses with a turning motor until the block is looked at again; `None`: it is not.
    next_look: Option<u32>,
    pause: u32,
}

impl Default for Belief {
    fn default() -> Self {
        Self { places: [ReadSlot::None; 5], next_look: Some(0), pause: 1 }
    }
}

impl Belief {
    /// The block is not used.
    pub(crate) const NEVER: Self = Self { places: [ReadSlot::None; 5], next_look: None, pause: 1 };

    /// The places that may be used; the others are [`ReadSlot::None`].
    pub(crate) const fn places(&self) -> [ReadSlot; 5] {
        self.places
    }

    /// Whether to look at the block now. A look that has not shown enough is repeated ever more rarely, because it
    /// takes many exchanges.
    const fn is_look_due(&mut self) -> bool {
        match self.next_look {
            Some(0) => {
                self.next_look = Some(self.pause);
                self.pause = self.pause.saturating_mul(2);
                true
            }
            Some(statuses) => {
                self.next_look = Some(statuses - 1);
                false
            }
            None => false,
        }
    }

    /// Takes in what a look at the block has shown.
    fn learn(&mut self, configured: &[ReadSlot; 5], block: &[u16], seen: &[Seen]) {
        let places = self.places.iter_mut().zip(configured);
        for ((place, &slot), &word) in places.zip(block) {
            match judge(slot, word, seen) {
                Verdict::Shown if *place == ReadSlot::None => *place = slot,
                // Another layout, or a motor that moved too fast to tell: nothing that this look shows counts.
                Verdict::Refuted => {
                    self.places = [ReadSlot::None; 5];
                    return;
                }
                Verdict::Shown | Verdict::Open => {}
            }
        }
        let wanted = worth_reading(configured);
        if blocks::coverage(&self.places, &wanted) == blocks::coverage(configured, &wanted) {
            self.next_look = None;
        }
    }
}

/// The registers for whose sake a block of these slots is read: the fast set, else the slow set, if it holds more than
/// one of them.
fn worth_reading(slots: &[ReadSlot; 5]) -> Vec<u16> {
    let sets = [&FAST_SET[..], &SLOW_SET[..]];
    let mut addresses = sets.into_iter().map(|set| set.iter().map(|at| at.address()).collect::<Vec<_>>());
    addresses.find(|addresses| blocks::coverage(slots, addresses) > 1).unwrap_or_default()
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

/// What a word says of the place that it stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// The place holds what is configured: nothing else explains the word.
    Shown,
    /// The place holds something else: what is configured does not explain the word.
    Refuted,
    /// It may be this or that.
    Open,
}

fn judge(slot: ReadSlot, word: u16, seen: &[Seen]) -> Verdict {
    let Some(configured) = seen.iter().find(|seen| seen.slot == slot) else { return Verdict::Open };
    if !configured.explains(word) {
        return Verdict::Refuted;
    }
    // A place that holds nothing may read 0.
    let alone = seen.iter().all(|other| other.slot == slot || !other.explains(word));
    if alone && word != 0 { Verdict::Shown } else { Verdict::Open }
}

/// Whether an exception says that the drive does not have such a block.
pub(crate) const fn is_refusal(meaning: ExceptionMeaning) -> bool {
    matches!(meaning, ExceptionMeaning::ValueRefused | ExceptionMeaning::NoSuchRegister)
}

impl<P: Port> Atv21<P> {
    /// Nothing that was known of the blocks counts any more: the drive may have started up anew.
    pub(crate) fn forget_blocks(&mut self) {
        self.read_block = Belief::default();
        if let WriteBlock::Read(_) = self.write_block {
            self.write_block = WriteBlock::Promised;
        }
    }

    /// Looks, where this status makes it worth it, at what the read block holds.
    pub(crate) async fn look_at_block(&mut self, status: &Status) {
        let turning = status.raw(map::OUTPUT_FREQUENCY.address()).is_some_and(|word| word != 0);
        if !turning || !self.read_block.is_look_due() {
            return;
        }
        match self.compare_block(status).await {
            Err(Error::Exception { meaning, .. }) if is_refusal(meaning) => self.read_block = Belief::NEVER,
            // The status was read whole all the same; what the line lacks, the next one will tell.
            Ok(()) | Err(_) => {}
        }
    }

    async fn compare_block(&mut self, status: &Status) -> Result<()> {
        let class = Class::Status;
        let configured = self.read_slots(class).await?;
        if worth_reading(&configured).is_empty() {
            self.read_block = Belief::NEVER;
            return Ok(());
        }
        let mut calls = self.registers.at(class);
        let block = calls.read_words(READ_BLOCK, blocks::read_count(&configured)).await?;
        let mut seen = Vec::with_capacity(ReadSlot::CHOICES.len());
        for slot in ReadSlot::CHOICES {
            let Some(register) = slot.register() else { continue };
            let after = calls.read(register).await?;
            let before = status.raw(register.address()).unwrap_or(after);
            seen.push(Seen { slot, before, after });
        }
        self.read_block.learn(&configured, &block, &seen);
        Ok(())
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

    fn at_rest() -> Vec<Seen> {
        seen([0x4000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    }

    #[test]
    fn a_turning_motor_shows_each_place_of_the_fast_set_and_the_look_is_not_repeated() {
        let mut belief = Belief::default();
        assert!(belief.is_look_due());
        belief.learn(&STANDARD, &[0x6400, 5_010, 3_650, 9_990, 0], &running());
        let mut shown = STANDARD;
        shown[4] = ReadSlot::None;
        assert_eq!(belief.places(), shown, "an alarm word of 0 shows nothing");
        assert!((0..1_000).all(|_| !belief.is_look_due()));
    }

    #[test]
    fn at_rest_only_the_status_word_is_shown_and_the_look_is_repeated_ever_more_rarely() {
        let mut belief = Belief::default();
        let mut looks = Vec::new();
        for status in 0..20 {
            if belief.is_look_due() {
                belief.learn(&STANDARD, &[0x4000, 0, 0, 0, 0], &at_rest());
                looks.push(status);
            }
        }
        assert_eq!(blocks::coverage(&belief.places(), &[0xFD01, 0xFD00, 0xFE03, 0xFE05, 0xFC91]), 1);
        assert_eq!(looks, [0, 2, 5, 10, 19]);
    }

    #[test]
    fn one_word_that_the_configured_register_does_not_explain_discredits_the_whole_block() {
        for block in [[0x6400, 3_700, 5_000, 10_000, 0], [5_000, 0x6400, 3_700, 10_000, 0], [0; 5]] {
            let mut belief = Belief::default();
            for _ in 0..20 {
                belief.learn(&STANDARD, &block, &running());
                assert_eq!(belief, Belief::default(), "{block:?}");
            }
        }
    }

    #[test]
    fn no_other_layout_is_ever_believed_whatever_it_shows() {
        // Two registers of every pair agree, apart from a wrong place: neither may be believed.
        for (place, configured) in STANDARD.into_iter().enumerate() {
            for held in ReadSlot::CHOICES.into_iter().filter(|held| *held != configured) {
                for word in [0, 1, 500, 5_000, 0x6400, u16::MAX] {
                    let mut seen = running();
                    for other in seen.iter_mut().filter(|seen| [held, configured].contains(&seen.slot)) {
                        (other.before, other.after) = (word, word);
                    }
                    let mut belief = Belief::default();
                    let mut block = [0x6400, 5_000, 3_700, 10_000, 0];
                    block[place] = word;
                    belief.learn(&STANDARD, &block, &seen);
                    assert_eq!(belief.places()[place], ReadSlot::None, "{held:?} for {configured:?}: {word}");
                }
            }
        }
    }

    #[test]
    fn a_value_that_moves_while_it_is_read_still_explains_its_word() {
        let mut seen = running();
        seen[1] = Seen { slot: ReadSlot::OutputFrequency, before: 2_000, after: 2_600 };
        let word = |word| judge(ReadSlot::OutputFrequency, word, &seen);
        assert_eq!([word(1_990), word(2_300), word(2_700)], [Verdict::Shown; 3]);
        assert_eq!([word(1_500), word(3_200), word(0)], [Verdict::Refuted; 3]);
    }

    #[test]
    fn a_slot_that_the_manual_does_not_list_is_left_alone() {
        assert_eq!(judge(ReadSlot::Unknown(12), 5_000, &running()), Verdict::Open);
        assert_eq!(judge(ReadSlot::None, 0, &running()), Verdict::Open);
    }

    #[test]
    fn a_block_is_worth_reading_for_more_than_one_word_of_a_set() {
        use ReadSlot as R;
        let fast = [R::OutputSpeed, R::OutputVoltage, R::OutputCurrent, R::StatusWord, R::None];
        assert_eq!(worth_reading(&fast), [0xFD01, 0xFD00, 0xFE03]);
        let slow = [R::OutputSpeed, R::OutputVoltage, R::OutputCurrent, R::None, R::None];
        assert!(worth_reading(&slow).contains(&0xFE90));
        assert!(worth_reading(&[R::StatusWord, R::Alarms, R::None, R::Unknown(12), R::None]).is_empty());
    }
}
