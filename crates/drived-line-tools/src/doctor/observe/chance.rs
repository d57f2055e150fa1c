//! Pauses of a length left to chance.

use std::time::Duration;

/// Numbers that follow no pattern that an adapter or a drive could have.
pub(super) struct Chance(u64);

impl Default for Chance {
    fn default() -> Self {
        Self(0x2545_F491_4F6C_DD1D)
    }
}

impl Chance {
    pub(super) fn up_to(&mut self, longest: Duration) -> Duration {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let micros = u64::try_from(longest.as_micros()).unwrap_or(u64::MAX).max(1);
        Duration::from_micros(self.0 % micros)
    }
}
