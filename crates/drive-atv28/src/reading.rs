//! The words of the fast set, and what they say.

use drive_core::{
    Absent, Calls, Class, Current, Direction, Frequency, Identity, Port, RawWord, Result, Status,
    registers::Register,
};
use drive_drivecom::StatusWords;

use crate::{
    Atv28,
    registers::{CMD, ETA, ETI, ETI2, FRH, INV, LCR, LFT, RFR, THD, THR, ULN, W452},
    words::ControlWord,
};

/// The first block: W450 to W456, the seven words that the manual's own sample reads.
pub(crate) const FIRST_BLOCK: (u16, u16) = (FRH.address(), 7);
/// The second block: W457 to W460.
pub(crate) const SECOND_BLOCK: (u16, u16) = (LFT.address(), 4);

/// The mnemonics of the two blocks in their order.
const CODES: [&str; (FIRST_BLOCK.1 + SECOND_BLOCK.1) as usize] = [
    FRH.row().code,
    RFR.row().code,
    W452.row().code,
    LCR.row().code,
    ULN.row().code,
    THR.row().code,
    THD.row().code,
    LFT.row().code,
    ETA.row().code,
    ETI.row().code,
    ETI2.row().code,
];

/// What no status is without: these are read, also where the drive was found not to have one.
const NEEDED: [u16; 3] = [FRH.address(), ETA.address(), ETI.address()];

/// W450 to W460 as they were read; `None`: not in this drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct FastWords {
    words: [Option<u16>; CODES.len()],
}

impl FastWords {
    /// From the two blocks.
    pub(crate) fn of(words: impl IntoIterator<Item = Option<u16>>) -> Self {
        let mut fast = Self::default();
        fast.words.iter_mut().zip(words).for_each(|(word, read)| *word = read);
        fast
    }

    /// From the raw words of a status that [`status`](Self::status) made.
    pub(crate) fn of_raw(raw: &[RawWord]) -> Self {
        let word = |address| raw.iter().find(|word| word.address == address).map(|word| word.value);
        Self::of((FIRST_BLOCK.0..).take(CODES.len()).map(word))
    }

    pub(crate) fn word<A: drive_core::registers::access::Kind>(&self, register: Register<A>) -> Option<u16> {
        let index = register.address().checked_sub(FIRST_BLOCK.0).map(usize::from);
        index.and_then(|index| self.words.get(index)).copied().flatten()
    }

    /// `ETA` and `ETI`.
    pub(crate) fn state_words(&self) -> StatusWords {
        StatusWords::new(self.word(ETA).unwrap_or(0), self.word(ETI).unwrap_or(0))
    }

    /// The status. `command` is the control word that this drive was last seen to hold, if any: see
    /// [`StatusWords::state`].
    pub(crate) fn status(&self, command: Option<ControlWord>) -> Status {
        let state = self.state_words();
        let own = state.status(command);
        Status {
            output_frequency: self.output(),
            // The word of the direction is of another exchange than the frequency, and may tell of the rest behind it.
            direction: if self.is_reversed() { Some(Direction::Reverse) } else { own.direction },
            reference: Some(self.reference()),
            current: self.word(LCR).map(|word| Current::from_deciamperes(u32::from(word))),
            fault_code: self.word(LFT).filter(|&code| state.is_tripped() && code != 0),
            raw: self.raw(),
            ..own
        }
    }

    /// The output frequency.
    pub(crate) fn output(&self) -> Option<Frequency> {
        self.word(RFR).map(|word| Frequency::from_decihertz(word.cast_signed().unsigned_abs()))
    }

    /// Whether the output frequency turns the motor in reverse, by its sign (twin W3202, p. 21). One without a sign tells nothing.
    fn is_reversed(&self) -> bool {
        self.word(RFR).is_some_and(|word| word.cast_signed() < 0)
    }

    /// The reference before the ramp.
    pub(crate) fn reference(&self) -> Frequency {
        Frequency::from_decihertz(self.word(FRH).unwrap_or(0))
    }

    /// The words that the drive has.
    pub(crate) fn raw(&self) -> Vec<RawWord> {
        let words = (FIRST_BLOCK.0..).zip(CODES).zip(self.words);
        words.filter_map(|((address, code), value)| Some(RawWord { address, code, value: value? })).collect()
    }
}

/// A block of the fast set. Without a word that no status is without it is refused as the drive refuses it.
pub(crate) async fn read_block<P: Port>(
    absent: &mut Absent,
    calls: &mut Calls<'_, P>,
    (first, count): (u16, u16),
) -> Result<Vec<Option<u16>>> {
    let words = absent.read(calls, first, count).await?;
    if let Some(needed) =
        NEEDED.into_iter().find(|&word| (first..first + count).contains(&word) && absent.has(word))
    {
        calls.read_word(needed).await?;
    }
    Ok(words)
}

impl<P: Port> Atv28<P> {
    /// All that the drive says of itself: its nominal current.
    pub(crate) async fn read_identity(&mut self, class: Class) -> Result<Identity> {
        let inv = self.absent.word(&mut self.registers.at(class), INV.address()).await?;
        let inv = inv.map(|value| RawWord { address: INV.address(), code: INV.row().code, value });
        Ok(Identity { codes: inv.into_iter().collect(), ..Identity::default() })
    }
}

/// The raw form of the control word, for statuses that were confirmed by it.
pub(crate) const fn raw_command(value: u16) -> RawWord {
    RawWord { address: CMD.address(), code: CMD.row().code, value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ETA (p. 21): ready to switch on, and operation enabled in reverse.
    const AT_REST: u16 = 0x0021;
    const IN_REVERSE: u16 = 0x8027;

    #[test]
    fn a_frequency_is_told_with_the_direction_that_it_has_itself() {
        let status = |rfr: i16, eta: u16| {
            let mut words = [0; CODES.len()];
            (words[1], words[8]) = (rfr.cast_unsigned(), eta);
            let status = FastWords::of(words.map(Some)).status(None);
            (status.output_frequency, status.direction)
        };
        let told = |hertz, direction| (Some(Frequency::from_hertz(hertz)), Some(direction));
        // It came to rest between the two exchanges.
        assert_eq!(status(-20, AT_REST), told(2, Direction::Reverse));
        assert_eq!(status(-20, IN_REVERSE), told(2, Direction::Reverse));
        assert_eq!(status(20, IN_REVERSE), told(2, Direction::Reverse));
        assert_eq!(status(0, IN_REVERSE), told(0, Direction::Reverse));
    }
}
