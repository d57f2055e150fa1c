//! The parameters of §2.1, which act from one power-up to the next (its note 3).

use std::time::Duration;

use drive_3g3ev::{FrequencyUnit, registers::address as at};
use drive_core::{Frequency, Percent};

use super::MAX_FREQUENCY;
use crate::{Bank, Rules};

/// What was set at power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SetUp {
    /// n02.
    pub(super) mode: u16,
    pub(super) detects_time_over: bool,
    unit: FrequencyUnit,
    baud: u64,
    wait: Duration,
}

impl SetUp {
    pub(super) fn of(bank: &Bank) -> Self {
        Self {
            mode: bank.value(at::N02),
            detects_time_over: bank.value(at::N40) == 0,
            unit: FrequencyUnit::of(bank.value(at::N39)).unwrap_or(FrequencyUnit::Decihertz),
            baud: 2_400 << bank.value(at::N63).min(3),
            wait: Duration::from_millis(u64::from(bank.value(at::N65))),
        }
    }

    /// 24 bits and 10 ms between the end of an answer, or of a request to all, and the next request (VS-606V7 manual
    /// p. 92; the drawing of §3.3 is missing).
    pub(super) fn pause(self) -> Duration {
        self.silence() + Duration::from_millis(10)
    }

    /// 24 bits.
    fn silence(self) -> Duration {
        Duration::from_nanos(24 * 1_000_000_000 / self.baud)
    }

    /// Functions and limits (§3.1.2). The answer begins 24 bits and n65 after the request (VS-606V7 manual p. 92).
    pub(super) fn rules(self) -> Rules {
        Rules {
            read_holding: 8,
            read_input: 0,
            write_single: false,
            write_multiple: 8,
            diagnostics: &[0x00],
            event_counter: false,
            broadcast: &[0x10],
            turnaround: self.silence() + self.wait,
        }
    }

    /// A word of 0002h, 0023h or 0024h as a frequency, in hundredths of a hertz.
    pub(super) fn frequency(self, word: u16) -> u32 {
        let hertz = self.unit.frequency(word).map(Frequency::centihertz);
        hertz.unwrap_or_else(|| {
            let share = self.unit.share(word).map_or(0, Percent::hundredths).unsigned_abs();
            share * MAX_FREQUENCY / 10_000
        })
    }

    /// A frequency in hundredths of a hertz as a word.
    pub(super) fn word(self, frequency: u32) -> u16 {
        let counts = match self.unit {
            FrequencyUnit::Decihertz => frequency / 10,
            FrequencyUnit::Centihertz => frequency,
            FrequencyUnit::ThirtyThousandths => frequency * 30_000 / MAX_FREQUENCY,
            FrequencyUnit::PerMille => frequency * 1_000 / MAX_FREQUENCY,
        };
        u16::try_from(counts).unwrap_or(u16::MAX)
    }
}

/// Whether this is the address of a parameter, 0100h and its number (§5.4).
pub(super) fn is_parameter(address: u16) -> bool {
    (at::N01..=at::N68).contains(&address)
}
