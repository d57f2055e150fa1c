//! What a count of 0002h, 0023h and 0024h is: n39 (§2.1).

use drive_core::{Frequency, Percent, Setpoint, SetpointProblem};

/// What a count of a frequency is, by n39. With every one of them the drive keeps 0.1 Hz only (§2.1, note 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FrequencyUnit {
    /// n39 = 0: 0.1 Hz.
    Decihertz,
    /// n39 = 1: 0.01 Hz.
    Centihertz,
    /// n39 = 2: 30000 counts are 100 %.
    ThirtyThousandths,
    /// n39 = 3: 0.1 %.
    PerMille,
}

impl FrequencyUnit {
    /// The unit that a word of n39 stands for; `None` for a word that the manual does not list.
    #[must_use]
    pub const fn of(n39: u16) -> Option<Self> {
        match n39 {
            0 => Some(Self::Decihertz),
            1 => Some(Self::Centihertz),
            2 => Some(Self::ThirtyThousandths),
            3 => Some(Self::PerMille),
            _ => None,
        }
    }

    /// The frequency that a word stands for; `None` in percent, of a frequency that the manual names no register for.
    #[must_use]
    pub const fn frequency(self, word: u16) -> Option<Frequency> {
        match self {
            Self::Decihertz => Some(Frequency::from_decihertz(word)),
            Self::Centihertz => Some(Frequency::from_centihertz(word as u32)),
            Self::ThirtyThousandths | Self::PerMille => None,
        }
    }

    /// The word for a frequency. `None` in percent.
    pub(crate) fn frequency_word(self, frequency: Frequency) -> Option<Result<u16, SetpointProblem>> {
        let centihertz = frequency.centihertz();
        let counts = match self {
            Self::Decihertz => centihertz / 10,
            Self::Centihertz => centihertz,
            Self::ThirtyThousandths | Self::PerMille => return None,
        };
        if !centihertz.is_multiple_of(10) {
            return Some(Err(SetpointProblem::Resolution("0.1 Hz")));
        }
        Some(u16::try_from(counts).map_err(|_| SetpointProblem::TooLarge))
    }

    /// How many counts two words of the same reference may differ: 0.1 Hz, of 50 Hz and more where it counts percent.
    pub(crate) const fn rounding(self) -> u16 {
        match self {
            Self::Decihertz => 1,
            Self::Centihertz => 10,
            Self::ThirtyThousandths => 60,
            Self::PerMille => 2,
        }
    }

    /// The share that a word stands for, rounded towards zero to 0.01 %; `None` in hertz.
    #[must_use]
    pub fn share(self, word: u16) -> Option<Percent> {
        let word = i32::from(word);
        match self {
            Self::Decihertz | Self::Centihertz => None,
            Self::ThirtyThousandths => Some(Percent::from_hundredths(word / 3)),
            Self::PerMille => Some(Percent::from_hundredths(word * 10)),
        }
    }

    /// The word for a share: none below zero, between two counts, or beyond a word. `None` in hertz.
    pub(crate) fn share_word(self, share: Percent) -> Option<Result<u16, SetpointProblem>> {
        let hundredths = i64::from(share.hundredths());
        let counts = match self {
            Self::ThirtyThousandths => hundredths * 3,
            Self::PerMille if hundredths % 10 != 0 => return Some(Err(SetpointProblem::Resolution("0.1 %"))),
            Self::PerMille => hundredths / 10,
            Self::Decihertz | Self::Centihertz => return None,
        };
        Some(u16::try_from(counts).map_err(|_| SetpointProblem::TooLarge))
    }

    /// The setpoint that a word stands for; `None` between two hundredths of a percent.
    pub(crate) fn setpoint(self, word: u16) -> Option<Setpoint> {
        if let Some(frequency) = self.frequency(word) {
            return Some(frequency.into());
        }
        let share = self.share(word)?;
        (self.share_word(share) == Some(Ok(word))).then_some(share.into())
    }
}
