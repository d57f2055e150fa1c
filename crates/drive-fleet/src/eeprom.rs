//! What is written to a drive's EEPROM, which wears: one ledger of each drive, whoever writes.

use std::{
    fmt,
    time::{Duration, SystemTime},
};

use tokio::time::Instant;

use crate::watchdog::WatchdogContract;

/// How often an EEPROM may be written in a day until that is an alarm, and what the fleet itself writes is held back. The least that
/// is known of the families is 10 000 writes in a life, so that this is more than a year.
pub const EEPROM_WRITES_A_DAY: u32 = 24;

const DAY: Duration = Duration::from_secs(86_400);

/// What has written to an EEPROM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum EepromUse {
    /// The communication watchdog was set up.
    Watchdog,
    /// The communication watchdog was put back.
    Restore,
    /// A parameter.
    Parameter,
    /// A save of all parameters.
    Save,
}

drive_core::named! { EepromUse {
    Watchdog => "setting up the watchdog",
    Restore => "putting the watchdog back",
    Parameter => "a parameter",
    Save => "a save",
} }

/// What is known of the writes to a drive's EEPROM. Whoever keeps it beyond the life of the program, from
/// [`EepromWritten`](crate::EventKind::EepromWritten), gives it to the next as
/// [`eeprom_before`](crate::DriveSettings::eeprom_before).
///
/// ```
/// use drive_fleet::{EEPROM_WRITES_A_DAY, EepromLedger};
///
/// let mut ledger = EepromLedger::default();
/// for _ in 0..EEPROM_WRITES_A_DAY {
///     ledger.count();
/// }
/// assert!(ledger.is_worn());
/// assert_eq!(ledger.to_string(), "24 writes today, 24 in all");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct EepromLedger {
    /// Writes, or what may have been one, in all.
    pub writes: u64,
    /// When the day began in which the last was: with the first write behind the 24 h before. By the wall's clock, in
    /// milliseconds since 1970.
    pub day_unix_ms: u64,
    /// Writes in that day.
    pub today: u32,
    /// What was tried and reads back otherwise: it is not tried again.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub in_vain: Option<InVain>,
}

/// A watchdog that was set up in vain.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct InVain {
    /// Which drive it was, as it says; `None` where it does not.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub identity: Option<String>,
    /// What it was to be.
    pub contract: WatchdogContract,
}

impl EepromLedger {
    /// The EEPROM was written once more, now, or may have been: for who writes to it beside a fleet.
    pub fn count(&mut self) {
        let now = Instant::now();
        let mut ledger = Ledger::new(now, Some(self.clone()));
        ledger.write(now);
        *self = ledger.kept;
    }

    /// Whether it was written so often in the day of the last write that this is an alarm.
    #[must_use]
    pub const fn is_worn(&self) -> bool {
        self.today >= EEPROM_WRITES_A_DAY
    }
}

impl fmt::Display for EepromLedger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} writes today, {} in all", self.today, self.writes)
    }
}

/// The ledger by this side's clock.
#[derive(Debug)]
pub(crate) struct Ledger {
    pub(crate) kept: EepromLedger,
    day_began: Option<Instant>,
}

impl Ledger {
    pub(crate) fn new(now: Instant, before: Option<EepromLedger>) -> Self {
        let kept = before.unwrap_or_default();
        let began = SystemTime::UNIX_EPOCH + Duration::from_millis(kept.day_unix_ms);
        // A clock that was set back makes the day longer, never shorter.
        let ago = SystemTime::now().duration_since(began).unwrap_or_default();
        let day_began = (kept.today > 0 && ago < DAY).then(|| now.checked_sub(ago).unwrap_or(now));
        Self { kept, day_began }
    }

    /// Writes in the day that is now.
    pub(crate) fn today(&self, now: Instant) -> u32 {
        let is_today = self.day_began.is_some_and(|began| now.saturating_duration_since(began) < DAY);
        if is_today { self.kept.today } else { 0 }
    }

    /// Something was written, or may have been.
    pub(crate) fn write(&mut self, now: Instant) {
        if self.today(now) == 0 {
            let wall = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
            self.day_began = Some(now);
            self.kept.day_unix_ms = u64::try_from(wall.as_millis()).unwrap_or(u64::MAX);
            self.kept.today = 0;
        }
        self.kept.today = self.kept.today.saturating_add(1);
        self.kept.writes = self.kept.writes.saturating_add(1);
    }

    /// How often it was written today, where that is too often.
    pub(crate) fn is_worn(&self, now: Instant) -> Option<u32> {
        Some(self.today(now)).filter(|today| *today >= EEPROM_WRITES_A_DAY)
    }
}
