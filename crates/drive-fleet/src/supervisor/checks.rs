//! What is checked at each connect: which drive it is, its communication watchdog, and whether it starts again by itself.

use std::{borrow::Cow, sync::Arc, time::Duration};

use drive_core::{
    Error, ErrorKind, ExceptionMeaning, Ground, Identity, Recognised, Result, SelfRestart, Watchdog,
    WatchdogCapability,
};
use tokio::time::Instant;

use crate::{
    eeprom::InVain,
    event::EventKind,
    outcome::Refused,
    settings::DriveSettings,
    shown_identity::ShownIdentity,
    snapshot::{IdentityCheck, WatchdogCheck},
    supervisor::Job,
    watchdog::{WatchdogBefore, WatchdogContract},
};

/// Until a check that failed is tried again.
const AGAIN: Duration = Duration::from_secs(1);

/// How often a drive may refuse that its watchdog is set up, a second apart, until that is an alarm.
const REFUSALS: u8 = 10;

/// The part of a watchdog's time after which it is fed by a frame of its own, if no poll has fed it: a half. The
/// plan counts on the same part.
pub const FEED_PART: u32 = 2;

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

    pub(crate) const fn identity(&self) -> &IdentityCheck {
        &self.identity
    }

    pub(crate) const fn watchdog(&self) -> &WatchdogCheck {
        &self.watchdog
    }

    /// The time of a watchdog that was seen armed, or that the drive always has.
    pub(crate) fn armed_for(&self) -> Option<Duration> {
        self.contract.filter(|_| self.armed).map(|contract| contract.timeout).or(self.fixed)
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

    /// The drive received a frame at this time, and answered it.
    pub(crate) fn heard(&mut self, at: Instant) {
        if self.heard.is_none_or(|before| before < at) {
            self.heard = Some(at);
            self.feed_again = None;
        }
    }

    /// When the watchdog wants a frame of its own.
    pub(crate) fn feed_at(&self) -> Option<Instant> {
        let set = match self.watchdog {
            // Another run of the program, or a write whose outcome nobody has heard, may have set it up.
            WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => {
                self.shown.into_iter().chain(self.contract.map(|contract| contract.timeout)).min()
            }
            _ => self.shown,
        };
        let at = self.heard? + set.or(self.fixed)? / FEED_PART;
        Some(self.feed_again.map_or(at, |again| at.max(again)))
    }

    /// When a check is due.
    pub(crate) fn wake_at(&self) -> Option<Instant> {
        let identity = self.identity_at.filter(|_| self.identity == IdentityCheck::Unchecked);
        let watchdog = self.watchdog_at.filter(|_| self.wants_watchdog());
        [identity, watchdog, self.restarts_at].into_iter().flatten().min()
    }

    fn wants_watchdog(&self) -> bool {
        match self.watchdog {
            WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => true,
            // Whoever has none says so without an exchange; of a drive by file its register tells.
            WatchdogCheck::NoContract { found } => found.is_none(),
            WatchdogCheck::WaitsForStandstill(_) | WatchdogCheck::Verified(_) => false,
        }
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

    /// What the drive said it was, last.
    pub(crate) fn remembered(&self) -> Option<Identity> {
        self.remembered.as_deref().cloned()
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

    /// The question which drive it is, if it is due.
    pub(crate) fn identity_job(&self, now: Instant) -> Option<Job> {
        let due = self.identity == IdentityCheck::Unchecked && self.identity_at.is_some_and(|at| at <= now);
        due.then_some(Job::Identify)
    }

    /// The question how the watchdog is set, if it is due.
    pub(crate) fn watchdog_job(&self, now: Instant) -> Option<Job> {
        let due = self.wants_watchdog() && self.watchdog_at.is_some_and(|at| at <= now);
        due.then_some(Job::Watchdog)
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

    /// What the drive says of itself, where it does.
    pub(crate) fn says(&self) -> Option<String> {
        match &self.identity {
            IdentityCheck::Same(identity) => Some(identity.to_string()),
            _ => None,
        }
    }

    /// It is known which drive it is: what was tried on it in vain is not tried again.
    fn known(&mut self) {
        let tried = self.in_vain_before.as_ref();
        self.in_vain |=
            tried.is_some_and(|tried| Some(tried.contract) == self.contract && tried.identity == self.says());
    }

    /// The job that sets the watchdog up.
    pub(crate) fn arm(&self) -> Option<Job> {
        self.contract
            .filter(|_| !self.held_back)
            .map(|contract| Job::ArmWatchdog(contract.timeout, contract.reaction))
    }

    /// Why nothing is written to what answers, where it is not known to be the drive that is meant.
    pub(crate) fn stranger(&self) -> Option<Refused> {
        match &self.identity {
            IdentityCheck::Same(_) | IdentityCheck::CannotSay => None,
            IdentityCheck::Unchecked => Some(Refused::IdentityUnchecked),
            IdentityCheck::Changed { .. } => Some(Refused::IdentityChanged),
            IdentityCheck::OtherFamily { it_is, .. } => Some(Refused::OtherFamily(it_is.clone())),
        }
    }

    /// Whether what answers is known to be another drive than the one that is meant, or one of another family.
    pub(crate) const fn is_another(&self) -> bool {
        matches!(self.identity, IdentityCheck::Changed { .. } | IdentityCheck::OtherFamily { .. })
    }

    pub(crate) fn handle_identity(
        &mut self,
        now: Instant,
        result: Result<(Identity, Recognised)>,
    ) -> Option<EventKind> {
        let found = match result {
            Ok((identity, Recognised::NotMine { it_is })) => {
                // What was found was another drive's: nothing of it is put back here.
                (self.found, self.written, self.inherited) = (None, false, None);
                let found = Arc::new(identity);
                let it_is = Cow::Borrowed(it_is);
                self.identity =
                    IdentityCheck::OtherFamily { it_is: it_is.clone(), found: Arc::clone(&found) };
                return Some(EventKind::OtherFamily { it_is, found });
            }
            Ok((identity, _)) => Arc::new(identity),
            Err(error) if error.is_speechless() => {
                self.identity = IdentityCheck::CannotSay;
                self.known();
                return None;
            }
            Err(_) => {
                self.identity_at = Some(now + AGAIN);
                return None;
            }
        };
        match &self.remembered {
            Some(remembered) if *remembered != found => {
                let remembered = Arc::clone(remembered);
                (self.found, self.written, self.inherited) = (None, false, None);
                (self.in_vain, self.refusals) = (false, 0);
                self.identity =
                    IdentityCheck::Changed { remembered: Arc::clone(&remembered), found: Arc::clone(&found) };
                Some(EventKind::IdentityChanged { remembered, found })
            }
            _ => {
                self.remembered = Some(Arc::clone(&found));
                self.identity = IdentityCheck::Same(Arc::clone(&found));
                self.known();
                Some(EventKind::Identified(found))
            }
        }
    }

    /// Which settings start the drive again by themselves, once they have been read.
    pub(crate) const fn restarts(&self) -> Option<&Arc<[SelfRestart]>> {
        self.restarts.as_ref()
    }

    /// Whether the settings accept all of them.
    pub(crate) fn restarts_accepted(&self) -> bool {
        let accepts = |restart: &SelfRestart| self.accepted_restarts.iter().any(|code| code == restart.code);
        self.restarts.iter().flat_map(|by| by.iter()).all(accepts)
    }

    pub(crate) fn handle_restarts(
        &mut self,
        now: Instant,
        result: Result<Vec<SelfRestart>>,
    ) -> Option<EventKind> {
        self.restarts_at = matches!(result, Err(Error::Port { .. })).then_some(now + AGAIN);
        let by: Arc<[SelfRestart]> = result.ok()?.into();
        self.restarts = Some(Arc::clone(&by));
        let accepted = self.restarts_accepted();
        (!by.is_empty()).then_some(EventKind::RestartsItself { by, accepted })
    }

    /// Why the drive that somebody was shown is not accepted; `None`: it is the one that answers.
    pub(crate) fn refuses_to_accept(&self, shown: ShownIdentity) -> Option<Refused> {
        match &self.identity {
            IdentityCheck::Changed { found, .. } | IdentityCheck::Same(found) => {
                (!shown.is(found)).then(|| Refused::NotTheShown(Some(Arc::clone(found))))
            }
            IdentityCheck::CannotSay => Some(Refused::NotTheShown(None)),
            IdentityCheck::Unchecked | IdentityCheck::OtherFamily { .. } => self.stranger(),
        }
    }

    /// Takes what the drive says it is for right.
    pub(crate) fn accept_identity(&mut self) {
        if let IdentityCheck::Changed { found, .. } = &self.identity {
            let found = Arc::clone(found);
            self.remembered = Some(Arc::clone(&found));
            self.identity = IdentityCheck::Same(found);
        }
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
                self.armed = true;
                self.written |= written;
                self.watchdog = WatchdogCheck::Verified(watchdog);
                let before = self.to_keep(watchdog);
                Some(EventKind::WatchdogVerified { watchdog, written, before })
            }
            Ok(watchdog) if control && self.settable && !written && !self.in_vain => {
                self.watchdog = WatchdogCheck::WaitsForStandstill(watchdog);
                None
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

    pub(crate) fn handle_kept_alive(&mut self, now: Instant, answered: bool) {
        if let (false, Some(heard), Some(at)) = (answered, self.heard, self.feed_at()) {
            // Half of the half that is left.
            self.feed_again = Some(now + at.saturating_duration_since(heard) / FEED_PART);
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
