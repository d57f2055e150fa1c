//! The communication watchdog of a drive: set up at standstill as the contract says, verified by what reads back, and put back at the end.

use std::{sync::Arc, time::Duration};

use drive_core::{Error, ErrorKind, ExceptionMeaning, Ground, Result, Watchdog};
use tokio::time::Instant;

use super::{AGAIN, Checks};
use crate::{
    eeprom::InVain,
    event::EventKind,
    snapshot::{IdentityCheck, WatchdogCheck},
    supervisor::Job,
    watchdog::{WatchdogBefore, WatchdogContract},
};

/// How often a drive may refuse that its watchdog is set up, a second apart, until that is an alarm.
const REFUSALS: u8 = 10;

/// For how long one that reads as the contract says counts as so where a motor at rest is to turn: whoever stands at the drive may set it
/// otherwise, and no word of a motor that stands tells it.
const HOLDS: Duration = Duration::from_secs(10);

impl Checks {
    pub(crate) const fn watchdog(&self) -> &WatchdogCheck {
        &self.watchdog
    }

    /// The time of a watchdog that was seen armed, or that the drive always has.
    pub(crate) fn armed_for(&self) -> Option<Duration> {
        self.contract.filter(|_| self.armed).map(|contract| contract.timeout).or(self.fixed)
    }

    pub(super) fn wants_watchdog(&self) -> bool {
        match self.watchdog {
            WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => true,
            // Whoever has none says so without an exchange; of a drive by file its register tells.
            WatchdogCheck::NoContract { found } => found.is_none(),
            WatchdogCheck::WaitsForStandstill(_) | WatchdogCheck::Verified(_) => false,
        }
    }

    /// The question how the watchdog is set, if it is due.
    pub(crate) fn watchdog_job(&self, now: Instant) -> Option<Job> {
        let due = self.wants_watchdog() && self.watchdog_at.is_some_and(|at| at <= now);
        due.then_some(Job::Watchdog)
    }

    /// The question whether a watchdog that was verified still is as the contract says, where that was too long ago for a motor at rest that
    /// is to turn.
    pub(crate) fn watchdog_again(&self, now: Instant) -> Option<Job> {
        let holds = |at: Instant| now.saturating_duration_since(at) < HOLDS;
        let verified = matches!(self.watchdog, WatchdogCheck::Verified(_));
        (verified && !self.verified_at.is_some_and(holds)).then_some(Job::Watchdog)
    }

    /// The job that sets the watchdog up.
    pub(crate) fn arm(&self) -> Option<Job> {
        self.contract
            .filter(|_| !self.held_back)
            .map(|contract| Job::ArmWatchdog(contract.timeout, contract.reaction))
    }

    /// Whether nothing is to be written by the fleet itself.
    pub(crate) const fn hold_back(&mut self, held_back: bool) {
        self.held_back = held_back;
    }

    /// What was written, and reads back otherwise.
    pub(crate) fn in_vain(&self) -> Option<InVain> {
        let contract = self.contract.filter(|_| self.in_vain)?;
        Some(InVain { identity: self.says(), contract })
    }

    pub(crate) fn handle_watchdog(
        &mut self,
        now: Instant,
        written: bool,
        control: bool,
        result: Result<Watchdog>,
    ) -> Option<EventKind> {
        if let Ok(watchdog) = &result {
            self.shown = watchdog.timeout;
        }
        let Some(contract) = self.contract else {
            self.adopt_watchdog(now, result);
            return None;
        };
        if let (false, Ok(watchdog)) = (written, &result) {
            self.found.get_or_insert(*watchdog);
        }
        match result {
            Ok(watchdog) if self.keeps(watchdog, contract) => {
                self.verified_at = Some(now);
                if !written && self.watchdog == WatchdogCheck::Verified(watchdog) {
                    return None;
                }
                self.armed = true;
                self.written |= written;
                self.watchdog = WatchdogCheck::Verified(watchdog);
                let before = self.to_keep(watchdog);
                Some(EventKind::WatchdogVerified { watchdog, written, before })
            }
            Ok(watchdog) if control && self.settable && !written && !self.in_vain => {
                let before =
                    std::mem::replace(&mut self.watchdog, WatchdogCheck::WaitsForStandstill(watchdog));
                let changed = matches!(before, WatchdogCheck::Verified(_));
                changed.then_some(EventKind::ContractChanged(Ground::Watchdog))
            }
            Ok(watchdog) => {
                self.in_vain |= written;
                let reason = match (written || self.in_vain, self.settable) {
                    (true, _) => "it was written and reads back so",
                    (false, true) => "the drive is only read",
                    (false, false) => "the bus cannot set it, set it at the drive",
                };
                self.broken(now, format!("{}; {reason}", describe(watchdog, contract)))
            }
            // A read or a write that found no answer says nothing of the watchdog.
            Err(Error::Port { .. }) if !written && matches!(self.watchdog, WatchdogCheck::Verified(_)) => {
                None
            }
            Err(Error::Port { .. }) => {
                self.watchdog_at = Some(now + AGAIN);
                self.watchdog = WatchdogCheck::Unchecked;
                None
            }
            // While the motor turns the drive may refuse; it is tried again at standstill, and not for ever.
            Err(Error::Exception { meaning: ExceptionMeaning::NotNow, .. } | Error::Refused { .. })
                if written && self.refusals < REFUSALS =>
            {
                self.refusals += 1;
                self.watchdog_at = Some(now + AGAIN);
                None
            }
            Err(error) => {
                self.in_vain |= written && error.kind() == ErrorKind::NotConfirmed;
                self.broken(now, error.to_string())
            }
        }
    }

    /// Nobody has heard what became of the setting up: it is read at once.
    pub(crate) fn arming_dropped(&mut self, now: Instant) {
        self.watchdog_at = Some(now);
        self.watchdog = WatchdogCheck::Unchecked;
    }

    /// Without a contract the watchdog is left as it is, and fed as it is.
    fn adopt_watchdog(&mut self, now: Instant, result: Result<Watchdog>) {
        self.watchdog_at = match result {
            Ok(watchdog) => {
                self.watchdog = WatchdogCheck::NoContract { found: Some(watchdog) };
                None
            }
            Err(Error::Port { .. }) => Some(now + AGAIN),
            Err(_) => None,
        };
    }

    /// Whether a watchdog is as the contract says. What the bus cannot set has the drive's own reaction.
    fn keeps(&self, watchdog: Watchdog, contract: WatchdogContract) -> bool {
        watchdog.timeout == Some(contract.timeout)
            && (!self.settable || watchdog.reaction.is_none_or(|reaction| reaction == contract.reaction))
    }

    fn broken(&mut self, now: Instant, why: String) -> Option<EventKind> {
        self.watchdog_at = Some(now + 10 * AGAIN);
        let known = matches!(&self.watchdog, WatchdogCheck::Broken(before) if *before == why);
        self.watchdog = WatchdogCheck::Broken(why.clone());
        (!known).then_some(EventKind::WatchdogBroken(why))
    }

    /// Why a motor that turns does so without the watchdog that it should have, if that has not been told yet.
    pub(crate) fn not_in_force(&mut self, turns: bool) -> Option<String> {
        let (WatchdogCheck::WaitsForStandstill(watchdog), Some(contract)) = (&self.watchdog, self.contract)
        else {
            self.told = false;
            return None;
        };
        let is_told = std::mem::replace(&mut self.told, turns);
        (turns && !is_told)
            .then(|| format!("{}; it is set up at the next standstill", describe(*watchdog, contract)))
    }

    /// The watchdog as it was found, if something else was written to it and it is still the drive to which that was written.
    pub(crate) fn to_restore(&self) -> Option<Watchdog> {
        let known = matches!(self.identity, IdentityCheck::Same(_) | IdentityCheck::CannotSay);
        let verified = matches!(
            self.watchdog,
            WatchdogCheck::Verified(_) | WatchdogCheck::NoContract { found: Some(_) }
        );
        self.before().filter(|_| known && verified)
    }

    /// The watchdog as it was before this program, or one that was killed, wrote to it.
    fn before(&self) -> Option<Watchdog> {
        let inherited = self.inherited.as_ref().filter(|before| {
            self.found == Some(before.set)
                && matches!(&self.identity, IdentityCheck::Same(identity) if identity.to_string() == before.identity)
        });
        match inherited {
            Some(before) => Some(before.found),
            None => self.found.filter(|_| self.written),
        }
    }

    /// The watchdog is as it was found again.
    pub(crate) fn put_back(&mut self) {
        (self.written, self.inherited) = (false, None);
    }

    /// What whoever goes on with the drive is to put back, where nobody has.
    pub(crate) fn left(&self) -> Option<WatchdogBefore> {
        match &self.watchdog {
            WatchdogCheck::Verified(set) => self.to_keep(*set).map(|before| WatchdogBefore::clone(&before)),
            _ => self.inherited.clone(),
        }
    }

    /// The same for who keeps it beyond the life of this program, of a drive that says which it is.
    fn to_keep(&self, set: Watchdog) -> Option<Arc<WatchdogBefore>> {
        let IdentityCheck::Same(identity) = &self.identity else { return None };
        let found = self.before()?;
        Some(Arc::new(WatchdogBefore { identity: identity.to_string(), set, found }))
    }

    /// The time of the watchdog that the drive has now, as far as it is known.
    pub(crate) fn set_to(&self) -> Option<Duration> {
        match &self.watchdog {
            WatchdogCheck::Verified(watchdog) | WatchdogCheck::WaitsForStandstill(watchdog) => {
                watchdog.timeout
            }
            WatchdogCheck::NoContract { found: Some(watchdog) } => watchdog.timeout,
            WatchdogCheck::NoContract { found: None }
            | WatchdogCheck::Unchecked
            | WatchdogCheck::Broken(_) => self.armed_for(),
        }
    }
}

fn describe(watchdog: Watchdog, contract: WatchdogContract) -> String {
    let is = watchdog.timeout.map_or_else(|| "off".to_owned(), |timeout| format!("{timeout:?}"));
    let then = watchdog.reaction.map_or_else(String::new, |reaction| format!(", then {reaction}"));
    format!(
        "the watchdog is {is}{then}; the contract says {:?}, then {}",
        contract.timeout, contract.reaction
    )
}
