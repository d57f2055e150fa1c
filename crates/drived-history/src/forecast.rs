//! How large the file becomes, and how much is written a day, at the most.

use std::time::Duration;

use drive_fleet::Periods;
use drived_face::Site;

use crate::write::Limits;

/// Numbers that move with every status of a drive, and with every reading of its slow set: with their words.
const FAST: u64 = 8;
const SLOW: u64 = 8;
/// Bytes of one of them on the disk, measured where all move each time: see the README.
const BYTES: u64 = 3;
/// Bytes of a minute, and of an hour, of one number.
const MINUTE_BYTES: u64 = 6;
const HOUR_BYTES: u64 = 30;
/// Bytes of what happens to a drive in a day: ten events with what the API tells of each.
const RECORD_BYTES: u64 = 10 * 1_200;
/// So often the minutes of a number are written in a day: with each hour those of the day before it once more, to the log and to the file.
const MINUTES_WRITTEN_TIMES: u64 = 24;
/// A value is written to the log of the file, to the file, and both again in its block; a page is more than what is in it.
const WRITTEN_TIMES: u64 = 5;

const DAY_S: u64 = 86_400;

/// What is to be expected of a configuration where everything moves all the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Forecast {
    /// Of the file, when it is as old as what it keeps.
    pub bytes: u64,
    /// Written to the disk in a day.
    pub bytes_a_day: u64,
}

impl Forecast {
    /// Of the drives of a configuration.
    #[must_use]
    pub fn of(site: &Site<'_>, limits: &Limits) -> Self {
        let drives = site.lines.iter().flat_map(|line| &line.drives);
        drives.map(|drive| Self::of_drive(drive.settings.periods, limits)).fold(
            Self::default(),
            |all, one| Self { bytes: all.bytes + one.bytes, bytes_a_day: all.bytes_a_day + one.bytes_a_day },
        )
    }

    fn of_drive(periods: Periods, limits: &Limits) -> Self {
        let a_day = |period: Duration, numbers: u64| {
            let times = DAY_S as f64 / period.as_secs_f64().max(0.02);
            (times * numbers as f64) as u64
        };
        let slow = if periods.slow.is_zero() { 0 } else { a_day(periods.slow, SLOW) };
        let values = a_day(periods.running, FAST) + slow;
        let days = |milliseconds: i64| u64::try_from(milliseconds).unwrap_or_default() as f64 / 86_400_000.0;
        let numbers = (FAST + SLOW) as f64;
        let bytes = (values * BYTES) as f64 * days(limits.polled_ms)
            + numbers * (1_440 * MINUTE_BYTES) as f64 * days(limits.minutes_ms)
            + (numbers * (24 * HOUR_BYTES) as f64 + RECORD_BYTES as f64) * days(limits.years_ms);
        let minutes = (FAST + SLOW) * 1_440 * MINUTE_BYTES * MINUTES_WRITTEN_TIMES;
        Self { bytes: bytes as u64, bytes_a_day: (values * BYTES + RECORD_BYTES) * WRITTEN_TIMES + minutes }
    }
}
