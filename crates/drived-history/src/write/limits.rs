//! How long and how much is kept.

/// What is kept, for how long, and in how many bytes: whichever comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Values as they were read, in milliseconds.
    pub polled_ms: i64,
    /// Minutes.
    pub minutes_ms: i64,
    /// Hours, events, alarms and commands.
    pub years_ms: i64,
    /// The file.
    pub bytes: i64,
}

const HOUR_MS: i64 = 3_600_000;
const DAY_MS: i64 = 24 * HOUR_MS;

impl Default for Limits {
    fn default() -> Self {
        Self::of(48, 90, 10, 2_048)
    }
}

impl Limits {
    #[must_use]
    pub const fn of(polled_hours: u32, minute_days: u32, years: u32, megabytes: u32) -> Self {
        Self {
            polled_ms: polled_hours as i64 * HOUR_MS,
            minutes_ms: minute_days as i64 * DAY_MS,
            years_ms: years as i64 * 366 * DAY_MS,
            bytes: (megabytes as i64) << 20,
        }
    }
}
