//! The parameters of §2.1, which act from one power-up to the next (its note 3).

use std::time::Duration;

use drive_3g3ev::{
    FrequencyUnit,
    registers::{N02, N39, N40, N63, N65},
};
use drive_core::{Frequency, Percent};

use super::MAX_FREQUENCY;
use crate::{Bank, Rules};

/// What was set at power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SetUp {
    pub(super) run_by_bus: bool,
    pub(super) reference_by_bus: bool,
    pub(super) detects_time_over: bool,
    unit: FrequencyUnit,
    baud: u64,
    wait: Duration,
}

impl SetUp {
    pub(super) fn of(bank: &Bank) -> Self {
        let mode = bank.value(N02.address());
        Self {
            run_by_bus: matches!(mode, 2 | 5),
            reference_by_bus: matches!(mode, 4 | 5),
            detects_time_over: bank.value(N40.address()) == 0,
            unit: FrequencyUnit::of(bank.value(N39.address())).unwrap_or(FrequencyUnit::Decihertz),
            baud: 2_400 << bank.value(N63.address()).min(3),
            wait: Duration::from_millis(u64::from(bank.value(N65.address()))),
        }
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
            turnaround: Duration::from_nanos(24 * 1_000_000_000 / self.baud) + self.wait,
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
    (0x0101..=0x0144).contains(&address)
}
