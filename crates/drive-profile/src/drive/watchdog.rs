//! Its communication watchdog as it is set at the drive: read where the profile names the register of its time, so that whoever polls it
//! asks often enough. It is never set.

use std::{collections::BTreeSet, time::Duration};

use drive_core::{Class, Error, Port, Result, Watchdog};

use super::{ProfileDrive, Words};
use crate::format::{Answer, FedBy, UnitName};

/// A shorter one no line feeds by asking.
const SHORTEST: Duration = Duration::from_millis(100);

impl<P: Port> ProfileDrive<P> {
    /// How it is set now, of one that asking feeds. What it does then is told in the profile's words alone.
    pub(super) async fn read_watchdog(&mut self) -> Result<Watchdog> {
        let unsupported = |reason| Err(Error::Unsupported { what: "watchdog", reason });
        let profile = self.profile.clone();
        let Some(watchdog) = profile.file().watchdog.given().map(crate::format::Spanned::get_ref) else {
            return unsupported("its profile knows none");
        };
        if watchdog.fed_by == Answer::Given(FedBy::CommandWrite) {
            return unsupported("a command word alone feeds it, and none is repeated");
        }
        let Some((name, cell)) = profile.watchdog_time().and_then(|name| Some((name, profile.cell(name)?)))
        else {
            return unsupported("its profile does not know in which register its time can be read");
        };
        let mut words = Words::default();
        for block in profile.blocks(&BTreeSet::from([name])) {
            let read = self.read_block(Class::Background, block).await?;
            words.keep(block, read);
        }
        self.see_watchdog_time(&profile, &words);
        let milliseconds = match cell.unit {
            UnitName::Second => cell.hundredths(&words, UnitName::Second).map(|of| of.saturating_mul(10)),
            UnitName::Millisecond => cell.hundredths(&words, UnitName::Millisecond).map(|of| of / 100),
            _ => None,
        };
        let Some(milliseconds) = milliseconds.and_then(|of| u64::try_from(of).ok()) else {
            return unsupported("its profile does not say what a count of its time is worth");
        };
        let timeout = match Duration::from_millis(milliseconds) {
            Duration::ZERO if watchdog.zero_is.given().is_some_and(|zero| zero == "off") => None,
            Duration::ZERO => return unsupported("its profile does not know what a time of 0 means"),
            time if time < SHORTEST => return unsupported("its time is shorter than any line asks"),
            time => Some(time),
        };
        Ok(Watchdog { timeout, reaction: None })
    }
}
