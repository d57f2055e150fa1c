//! The words of the fast set, and what they say.

use drive_core::{Current, Frequency, RawWord, Status, drivecom::StatusWords, registers::Register};

use crate::{
    registers::{CMD, ETA, ETI, ETI2, FRH, LCR, LFT, RFR, THD, THR, ULN, W452},
    words::ControlWord,
};

/// The first block: W450 to W456, the seven words that the manual's own sample reads.
pub(crate) const FIRST_BLOCK: (u16, usize) = (FRH.address(), 7);
/// The second block: W457 to W460.
pub(crate) const SECOND_BLOCK: (u16, usize) = (LFT.address(), 4);

/// The mnemonics of the two blocks in their order.
const CODES: [&str; FIRST_BLOCK.1 + SECOND_BLOCK.1] = [
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

/// W450 to W460 as they were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FastWords {
    words: [u16; CODES.len()],
}

impl FastWords {
    /// From the two blocks.
    pub(crate) fn of(first: [u16; FIRST_BLOCK.1], second: [u16; SECOND_BLOCK.1]) -> Self {
        let mut words = [0; CODES.len()];
        for (word, read) in words.iter_mut().zip(first.into_iter().chain(second)) {
            *word = read;
        }
        Self { words }
    }

    /// From the raw words of a status that [`status`](Self::status) made.
    pub(crate) fn of_raw(raw: &[RawWord]) -> Self {
        let mut words = [0; CODES.len()];
        for (word, read) in words.iter_mut().zip(raw) {
            *word = read.value;
        }
        Self { words }
    }

    pub(crate) fn word<A: drive_core::registers::access::Kind>(&self, register: Register<A>) -> u16 {
        let index = register.address().checked_sub(FIRST_BLOCK.0).map(usize::from);
        index.and_then(|index| self.words.get(index)).copied().unwrap_or(0)
    }

    /// `ETA` and `ETI`.
    pub(crate) fn state_words(&self) -> StatusWords {
        StatusWords::new(self.word(ETA), self.word(ETI))
    }

    /// The status. `command` is the control word that this drive was last seen to hold, if any: see
    /// [`StatusWords::state`].
    pub(crate) fn status(&self, command: Option<ControlWord>) -> Status {
        let state = self.state_words();
        Status {
            output_frequency: Some(self.output()),
            reference: Some(self.reference()),
            current: Some(Current::from_deciamperes(u32::from(self.word(LCR)))),
            fault_code: state.is_tripped().then(|| self.word(LFT)),
            raw: self.raw(),
            ..state.status(command)
        }
    }

    /// The output frequency.
    pub(crate) fn output(&self) -> Frequency {
        Frequency::from_decihertz(self.word(RFR).cast_signed().unsigned_abs())
    }

    /// The reference before the ramp.
    pub(crate) fn reference(&self) -> Frequency {
        Frequency::from_decihertz(self.word(FRH))
    }

    pub(crate) fn raw(&self) -> Vec<RawWord> {
        Self::first_block(&self.words)
    }

    /// The raw form of words that begin at W450.
    pub(crate) fn first_block(words: &[u16]) -> Vec<RawWord> {
        let words = (FIRST_BLOCK.0..).zip(CODES).zip(words);
        words.map(|((address, code), &value)| RawWord { address, code, value }).collect()
    }
}

/// The raw form of the control word, for statuses that were confirmed by it.
pub(crate) const fn raw_command(value: u16) -> RawWord {
    RawWord { address: CMD.address(), code: CMD.row().code, value }
}
