//! What is checked at each connect: which drive it is, its communication watchdog, and whether it starts again by itself.

mod feeding;
mod identity;
mod restarts;
mod watchdog;

use std::{sync::Arc, time::Duration};

use drive_core::{Ground, Identity, SelfRestart, Watchdog, WatchdogCapability};
use tokio::time::Instant;

use super::Job;
use crate::{
    eeprom::InVain,
    settings::DriveSettings,
    snapshot::{IdentityCheck, WatchdogCheck},
    watchdog::{WatchdogBefore, WatchdogContract},
};

pub use self::feeding::FEED_PART;

/// Until a check that failed is tried again.
const AGAIN: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub(crate) struct Checks {
    identity: IdentityCheck,
    remembered: Option<Arc<Identity>>,
    identity_at: Option<Instant>,
    /// It was asked because it refuses to tell its status.
    refused: bool,
    contract: Option<WatchdogContract>,
    /// Whether the bus can set it.
    settable: bool,
    /// The time of a watchdog that the drive has whether anybody wants it or not.
    fixed: Option<Duration>,
    watchdog: WatchdogCheck,
    watchdog_at: Option<Instant>,
    /// When it was read as the contract says last.
    verified_at: Option<Instant>,
    /// The watchdog was verified at some time since the program started, so it acts while the drive is lost.
    armed: bool,
    /// As it was read first, before anything was written to it.
    found: Option<Watchdog>,
    /// The time that it had when it was read last.
    shown: Option<Duration>,
    /// It was written here.
    written: bool,
    /// The contract was written, once, and the drive has kept something else: it is not written again, for that may wear its EEPROM.
    in_vain: bool,
    /// What an earlier run has written in vain.
    in_vain_before: Option<InVain>,
    /// Its EEPROM has been written too often: nothing is written to it by the fleet itself.
    held_back: bool,
    /// How often the drive has refused the write at standstill.
    refusals: u8,
    /// What an earlier run found, and did not live to put back.
    inherited: Option<WatchdogBefore>,
    /// That it is not as it should be while the motor turns has been told.
    told: bool,
    heard: Option<Instant>,
    feed_again: Option<Instant>,
    restarts: Option<Arc<[SelfRestart]>>,
    restarts_at: Option<Instant>,
    accepted_restarts: Vec<String>,
}

impl Checks {
    pub(crate) fn new(settings: &DriveSettings, capability: Option<WatchdogCapability>) -> Self {
        let watchdog = match settings.watchdog {
            Some(_) => WatchdogCheck::Unchecked,
            None => WatchdogCheck::NoContract { found: None },
        };
        Self {
            identity: IdentityCheck::Unchecked,
            remembered: settings.identity.clone().map(Arc::new),
            identity_at: None,
            refused: false,
            contract: settings.watchdog,
            settable: capability.is_some_and(|watchdog| watchdog.settable),
            fixed: capability.and_then(|watchdog| watchdog.fixed()),
            watchdog,
            watchdog_at: None,
            verified_at: None,
            armed: false,
            found: None,
            shown: None,
            written: false,
            in_vain: false,
            in_vain_before: settings.eeprom_before.as_ref().and_then(|ledger| ledger.in_vain.clone()),
            held_back: false,
            refusals: 0,
            inherited: settings.watchdog_before.clone(),
            told: false,
            heard: None,
            feed_again: None,
            restarts: None,
            restarts_at: None,
            accepted_restarts: settings.accept_self_restart.clone(),
        }
    }

    /// Other settings hold from now on: what depends on them is checked anew.
    pub(crate) fn reconfigure(&mut self, now: Instant, settings: &DriveSettings) {
        if settings.watchdog != self.contract {
            self.contract = settings.watchdog;
            self.armed = false;
            (self.in_vain, self.refusals) = (false, 0);
            self.watchdog_at = Some(now);
            self.watchdog = match self.contract {
                Some(_) => WatchdogCheck::Unchecked,
                None => WatchdogCheck::NoContract { found: None },
            };
        }
        if settings.accept_self_restart != self.accepted_restarts {
            self.accepted_restarts.clone_from(&settings.accept_self_restart);
            self.restarts_at = Some(now);
        }
    }

    /// A connection begins: everything is checked anew.
    pub(crate) fn connected(&mut self, now: Instant) {
        self.identity = IdentityCheck::Unchecked;
        self.identity_at = Some(now);
        self.refused = false;
        self.watchdog_at = Some(now);
        self.restarts = None;
        self.restarts_at = Some(now);
        self.watchdog = match self.contract {
            Some(_) => WatchdogCheck::Unchecked,
            None => WatchdogCheck::NoContract { found: None },
        };
    }

    /// It answers, and has nothing of what a status is made of: it is asked which drive it is, once until it is seen again.
    pub(crate) fn refused(&mut self, now: Instant) {
        if self.refused {
            return;
        }
        self.refused = true;
        self.identity = IdentityCheck::Unchecked;
        self.identity_at = Some(now);
    }

    /// What this rests on has changed without this side: it is read anew.
    pub(crate) fn changed(&mut self, now: Instant, ground: Ground) {
        match ground {
            Ground::Watchdog => {
                self.watchdog_at = Some(now);
                self.watchdog = match self.contract {
                    Some(_) => WatchdogCheck::Unchecked,
                    None => WatchdogCheck::NoContract { found: None },
                };
            }
            Ground::Inputs => self.restarts_at = Some(now),
            _ => {}
        }
    }

    /// When a check is due.
    pub(crate) fn wake_at(&self) -> Option<Instant> {
        let identity = self.identity_at.filter(|_| self.identity == IdentityCheck::Unchecked);
        let watchdog = self.watchdog_at.filter(|_| self.wants_watchdog());
        [identity, watchdog, self.restarts_at].into_iter().flatten().min()
    }

    /// The check that is due. The watchdog is written at standstill, and only to the drive that the settings are for.
    pub(crate) fn job(&self, now: Instant, control: bool, stands: bool) -> Option<Job> {
        let restarts = || self.restarts_at.filter(|at| *at <= now).map(|_| Job::SelfRestarts);
        let arms = || {
            let waits = matches!(self.watchdog, WatchdogCheck::WaitsForStandstill(_));
            let known = matches!(self.identity, IdentityCheck::Same(_) | IdentityCheck::CannotSay);
            let due = self.watchdog_at.is_none_or(|at| at <= now);
            self.arm().filter(|_| waits && known && due && control && stands)
        };
        // Of a motor that turns it is wanted first whether its drive would stop it by itself.
        let first = self.watchdog_job(now).filter(|_| !stands && self.contract.is_some());
        let identity = first.or_else(|| self.identity_job(now));
        identity.or_else(|| self.watchdog_job(now)).or_else(arms).or_else(restarts)
    }
}
