//! The fast set: W3201 to W3206 in one request, and what they say. W3207 can be read along where the line needs an
//! answer of another length.
//!
//! W3208 is in no list of the manual: what a read across it answers is not printed, and the fast set needs nothing behind
//! it.

use drive_core::{
    Current, Frequency, RawWord, Refusal, Status,
    registers::{Register, access::Kind},
};
use drive_drivecom::StatusWords;

use crate::{
    registers::{CMD, ETA, ETI, FRH, LCR, OTR, RFR},
    words::{ControlWord, ExtendedControl, ExtendedStatus},
};

/// The first word of the block.
pub(crate) const FIRST: u16 = ETA.address();

/// The mnemonics of the block in its order.
const CODES: [&str; 6] =
    [ETA.row().code, RFR.row().code, FRH.row().code, LCR.row().code, OTR.row().code, ETI.row().code];

/// What a count of `rFr`, `LFr`, `LFRD` and `RFRD` is, by bit 9 of `CMI` (p. 16, 19 and 21).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Resolution {
    /// 0.1 Hz and 1 rpm.
    Normal,
    /// 32767 for 600 Hz.
    High,
}

impl Resolution {
    /// By bit 9 of `CMI`.
    pub(crate) const fn of(cmi: ExtendedControl) -> Self {
        if cmi.contains(ExtendedControl::HIGH_RESOLUTION) { Self::High } else { Self::Normal }
    }

    /// The magnitude of a signed frequency word.
    pub(crate) const fn frequency(self, word: u16) -> Frequency {
        let counts = word.cast_signed().unsigned_abs();
        match self {
            Self::Normal => Frequency::from_decihertz(counts),
            Self::High => Frequency::from_centihertz((counts as u32 * 60_000 + 16_383) / 32_767),
        }
    }

    /// The word for a frequency, if there is one that reads back as this very frequency.
    pub(crate) fn word(self, frequency: Frequency) -> Option<u16> {
        let word = self.nearest(frequency)?;
        (self.frequency(word) == frequency).then_some(word)
    }

    /// The word that stands nearest for what `word` was at the resolution of `before`, with its sign.
    pub(crate) fn recounted(self, word: u16, before: Self) -> u16 {
        let counts = self.nearest(before.frequency(word)).unwrap_or(i16::MAX.unsigned_abs());
        if word.cast_signed() < 0 { counts.wrapping_neg() } else { counts }
    }

    /// The count that is nearest to a frequency, of those that a signed word has.
    fn nearest(self, frequency: Frequency) -> Option<u16> {
        let centihertz = u64::from(frequency.centihertz());
        let counts = match self {
            Self::Normal => (centihertz + 5) / 10,
            Self::High => (centihertz * 32_767 + 30_000) / 60_000,
        };
        u16::try_from(counts).ok().filter(|&counts| counts <= i16::MAX.unsigned_abs())
    }

    /// The step of a frequency setpoint, for errors.
    pub(crate) const fn step(self) -> &'static str {
        match self {
            Self::Normal => "0.1 Hz",
            Self::High => "600/32767 Hz (CMI bit 9 is set)",
        }
    }
}

/// W3201 to W3206 as they were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FastWords {
    words: [u16; CODES.len()],
}

impl FastWords {
    /// From the block.
    pub(crate) const fn of(words: [u16; CODES.len()]) -> Self {
        Self { words }
    }

    /// From a status that was made of them.
    pub(crate) fn in_status(status: &Status) -> Self {
        let mut words = [0; CODES.len()];
        for (word, address) in words.iter_mut().zip(FIRST..) {
            *word = status.raw(address).unwrap_or(0);
        }
        Self { words }
    }

    pub(crate) fn word<A: Kind>(&self, register: Register<A>) -> u16 {
        let index = register.address().checked_sub(FIRST).map(usize::from);
        index.and_then(|index| self.words.get(index)).copied().unwrap_or(0)
    }

    /// `ETA` and `ETI`.
    pub(crate) fn state_words(&self) -> StatusWords {
        StatusWords::new(self.word(ETA), self.word(ETI))
    }

    /// The output frequency.
    pub(crate) fn output(&self, resolution: Resolution) -> Frequency {
        resolution.frequency(self.word(RFR))
    }

    /// Why a setting cannot be changed now.
    pub(crate) fn refuses_settings(&self) -> Option<Refusal> {
        const HELD: Refusal = Refusal::Settings(
            "direct current is injected into the motor (ETI bit 5): let it end, or disable operation first by a freewheel stop",
        );
        let words = self.state_words();
        // Under current no word says whether the shaft still turns: but it is not run.
        match words.is_driving() {
            true if words.eti.contains(ExtendedStatus::DC_INJECTION) => Some(HELD),
            true => Some(Refusal::MotorRunning),
            false => self.refuses_while_saving(),
        }
    }

    /// Why no parameter is written now (p. 20, 22), and nothing is started.
    pub(crate) fn refuses_while_saving(&self) -> Option<Refusal> {
        self.state_words().eti.contains(ExtendedStatus::EEPROM_BUSY).then_some(Refusal::Settings(
            "the drive is saving its parameters to EEPROM (ETI bit 0): try again in a moment",
        ))
    }

    /// The status. `command` is the control word that the drive was last seen to hold, if any: see
    /// [`StatusWords::state`].
    pub(crate) fn status(&self, resolution: Option<Resolution>, command: Option<ControlWord>) -> Status {
        let output = self.word(RFR);
        // Zero is zero at any resolution.
        let resolution = resolution.or_else(|| (output == 0).then_some(Resolution::Normal));
        Status {
            output_frequency: resolution.map(|resolution| resolution.frequency(output)),
            current: Some(Current::from_deciamperes(u32::from(self.word(LCR)))),
            reference: Some(self.reference()),
            raw: self.raw(),
            ..self.state_words().status(command)
        }
    }

    /// The reference before the ramp, which no bit gives another unit.
    pub(crate) fn reference(&self) -> Frequency {
        Frequency::from_decihertz(self.word(FRH))
    }

    fn raw(&self) -> Vec<RawWord> {
        let words = (FIRST..).zip(CODES).zip(self.words);
        words.map(|((address, code), value)| RawWord { address, code, value }).collect()
    }
}

/// The raw form of the control word, for statuses that were confirmed by it.
pub(crate) const fn raw_command(value: u16) -> RawWord {
    RawWord { address: CMD.address(), code: CMD.row().code, value }
}

#[cfg(test)]
mod tests {
    use drive_core::State;
    use drive_drivecom::ChartState;

    use super::*;

    #[test]
    fn every_word_of_the_block_is_kept() {
        for eta in 0..=u16::MAX {
            let status = FastWords::of([eta, 0, 0, 0, 0, 0xFFFF]).status(None, None);
            assert_eq!(status.state == State::Unknown, ChartState::of(eta).is_none(), "{eta:04X}h");
            assert_eq!(status.raw(3201), Some(eta));
        }
    }

    #[test]
    fn at_high_resolution_a_frequency_is_taken_only_if_it_reads_back_as_itself() {
        let high = Resolution::High;
        assert_eq!(high.word(Frequency::from_hertz(600)), Some(32_767));
        assert_eq!(high.word(Frequency::ZERO), Some(0));
        assert_eq!(high.word(Frequency::from_hertz(601)), None);
        for centihertz in 0..=60_000 {
            let frequency = Frequency::from_centihertz(centihertz);
            if let Some(word) = high.word(frequency) {
                assert_eq!(high.frequency(word), frequency);
            }
        }
        for word in 0..=0x7FFF {
            assert_eq!(high.word(high.frequency(word)), Some(word), "every word is reachable");
        }
    }
}
