//! What troubles a drive now, read off its snapshot: by the table of [`ConcernKind`] and nowhere else.

use drive_core::{Control, Error, Fault, Motion};
use tokio::time::Instant;

use crate::{
    concern::{Concern, ConcernKind},
    outcome::{Refused, Tenths},
    snapshot::{Freshness, IdentityCheck, Link, OffSetpoint, Snapshot, Trip, WatchdogCheck},
};

impl Snapshot {
    /// The worst that troubles the drive at `now`; `None` where nothing does.
    #[must_use]
    pub fn concern(&self, now: Instant) -> Option<Concern> {
        self.concerns(now).into_iter().next()
    }

    /// All that troubles the drive at `now`, the worst first.
    #[must_use]
    pub fn concerns(&self, now: Instant) -> Vec<Concern> {
        ConcernKind::ALL.iter().filter_map(|kind| self.concern_of(*kind, now)).collect()
    }

    pub(crate) fn concern_of(&self, kind: ConcernKind, now: Instant) -> Option<Concern> {
        let status = self.status.as_ref();
        let was_moving = self.started_here() || status.is_some_and(|status| !status.value.is_undriven());
        let heard = status.map(|status| status.at);
        let error = || self.error.as_ref().map(ToString::to_string);
        let connected = status.filter(|_| self.link == Link::Connected);
        let shaft = |motion| connected.is_some_and(|status| status.value.motion == motion);
        let (since, detail) = match kind {
            ConcernKind::StopUnconfirmed => {
                let stop = self.stop.filter(|stop| stop.alarm)?;
                (Some(stop.since), Some(format!("{} stop, {}", stop.mode, stop.sent())))
            }
            ConcernKind::RunCommandStands => (None, Some(self.run_command_stands.as_ref()?.to_string())),
            ConcernKind::LostRunning => (heard, (self.link == Link::Lost && was_moving).then(error)?),
            ConcernKind::Tripped => {
                let shown = status.filter(|status| status.value.is_fault())?;
                let trip = self.present_trip();
                let unread = || shown.value.fault_code.map(|code| format!("fault {code}"));
                let told = |fault: &Fault| match fault.entry {
                    Some(_) => fault.to_string(),
                    None => format!("fault {}", fault.code),
                };
                let said =
                    trip.and_then(|trip| trip.faults.as_deref()).filter(|said| !said.present.is_empty());
                let told = match said {
                    Some(said) => Some(said.present.iter().map(told).collect::<Vec<_>>().join(", ")),
                    None => trip.and_then(Trip::fault).as_ref().map(told),
                };
                (trip.map(|trip| trip.at), told.or_else(unread))
            }
            ConcernKind::RunSuspended => {
                let because =
                    self.suspended.filter(|_| !status.is_some_and(|status| status.value.is_fault()))?;
                (None, Some(because.to_string()))
            }
            ConcernKind::IdentityChanged => match &self.identity {
                IdentityCheck::Changed { remembered, found } => {
                    (None, Some(format!("{found} instead of {remembered}")))
                }
                _ => return None,
            },
            ConcernKind::OtherFamily => match &self.identity {
                IdentityCheck::OtherFamily { it_is, .. } => (None, Some(it_is.to_string())),
                _ => return None,
            },
            ConcernKind::SetUpOtherwise => {
                // Of another drive that is told, and no setting.
                let is_another = matches!(self.identity, IdentityCheck::OtherFamily { .. });
                (None, Some(self.unmet.filter(|_| !is_another)?.to_string()))
            }
            ConcernKind::WatchdogBroken => match &self.watchdog {
                WatchdogCheck::Broken(why) => (None, Some(why.clone())),
                _ => return None,
            },
            ConcernKind::WatchdogNotInForce => {
                let waits = matches!(self.watchdog, WatchdogCheck::WaitsForStandstill(_));
                let turns = status.is_some_and(|status| !status.value.is_undriven());
                (None, (waits && turns && self.link == Link::Connected).then_some(None)?)
            }
            ConcernKind::Lost => {
                (heard, (self.link == Link::Lost && !was_moving && !self.refuses()).then(error)?)
            }
            ConcernKind::Refuses => (None, self.refuses().then(error)?),
            ConcernKind::Stale => {
                let is_old = self.link == Link::Connected && self.freshness(now) == Freshness::Stale;
                (heard.filter(|_| is_old).map(Some)?, error())
            }
            ConcernKind::RestartsItself => {
                let by =
                    self.self_restarts.as_ref().filter(|by| !by.is_empty() && !self.restarts_accepted)?;
                let codes: Vec<&str> = by.iter().map(|restart| restart.code).collect();
                (None, Some(codes.join(", ")))
            }
            ConcernKind::EepromWorn => {
                let times = self.eeprom_worn?;
                (None, Some(format!("{times} times today")))
            }
            ConcernKind::LimitExceeded => {
                let limits: Vec<String> = self.exceeded.iter().map(ToString::to_string).collect();
                (None, (!limits.is_empty()).then(|| Some(limits.join(", ")))?)
            }
            ConcernKind::OffSetpoint => {
                let OffSetpoint { setpoint, is_given, output } = self.off_setpoint?;
                let whose = if is_given { "setpoint" } else { "the drive's own reference" };
                (None, Some(format!("output {output}, {whose} {setpoint}")))
            }
            ConcernKind::Warning => {
                (None, status.filter(|status| status.value.warning == Some(true)).map(|_| None)?)
            }
            ConcernKind::ControlTaken => (None, Some(self.control_taken?.to_string())),
            ConcernKind::StopPending => {
                let stop = self.stop.filter(|stop| !stop.alarm)?;
                let lasts = Tenths(now.saturating_duration_since(stop.since));
                let how = if stop.taken { "the drive is stopping" } else { "it is repeated" };
                (Some(stop.since), Some(format!("{} stop for {lasts}, {how}", stop.mode)))
            }
            ConcernKind::SetpointUnknown => {
                let is_unknown = self.setpoint.is_none() && !self.tells_reference();
                (None, (is_unknown && self.started_here() && shaft(Motion::Driven)).then_some(None)?)
            }
            ConcernKind::RunByAnother => {
                let is_watched = self.start_refused == Some(Refused::ReadOnly);
                let by = status.and_then(|status| status.value.control);
                let is_elsewhere = by.is_some_and(|control| control != Control::Bus);
                let is_ours = self.started_here() || self.stop.is_some() || is_watched || is_elsewhere;
                (None, (!is_ours && shaft(Motion::Driven)).then_some(None)?)
            }
            ConcernKind::Coasting => (None, shaft(Motion::Coasting).then_some(None)?),
            ConcernKind::Held => (None, shaft(Motion::Held).then_some(None)?),
            ConcernKind::NeverSeen => (None, (self.link == Link::Connecting && !self.refuses()).then(error)?),
        };
        let noted = || self.since.iter().find(|(noted, _)| *noted == kind).map(|(_, since)| *since);
        Some(Concern { kind, since: since.or_else(noted), detail })
    }

    /// Whether it answers and refuses, so that nothing is known of it: a drive of another family does so, and one that is busy. It is
    /// not silent.
    #[must_use]
    pub fn refuses(&self) -> bool {
        self.link != Link::Connected && matches!(self.error, Some(Error::Exception { .. }))
    }

    /// Whether something would be seen at `now` if it troubled the drive: only then it troubles nobody any more where it is not seen. A
    /// drive that does not answer shows nothing, and one that has just been found has not shown all of it yet.
    pub(crate) fn would_show(&self, kind: ConcernKind, now: Instant) -> bool {
        let Some(status) = self.fresh_status(now) else {
            // That it answers is seen even where it is not heard often enough.
            let is_connected = self.link == Link::Connected;
            return match kind {
                ConcernKind::LostRunning => is_connected,
                ConcernKind::Lost | ConcernKind::NeverSeen => is_connected || self.refuses(),
                ConcernKind::Refuses => is_connected || self.error.is_some(),
                _ => false,
            };
        };
        let is_here = status.control.is_none_or(|control| control == Control::Bus);
        match kind {
            // A program that was started anew knows of no stop, and one more stop begins its time anew.
            ConcernKind::StopUnconfirmed => status.is_undriven(),
            ConcernKind::RunCommandStands | ConcernKind::ControlTaken => is_here,
            ConcernKind::IdentityChanged | ConcernKind::OtherFamily => {
                self.identity != IdentityCheck::Unchecked
            }
            ConcernKind::WatchdogBroken | ConcernKind::WatchdogNotInForce => {
                self.watchdog != WatchdogCheck::Unchecked
            }
            ConcernKind::RestartsItself => self.self_restarts.is_some(),
            ConcernKind::LimitExceeded => match self.measurements_freshness(now) {
                Freshness::Fresh => true,
                Freshness::Stale => false,
                // They are never asked for where they have no period.
                Freshness::Never => self.measurements_max_age <= self.max_age,
            },
            ConcernKind::OffSetpoint => {
                self.setpoint.is_some() || self.tells_reference() || status.is_undriven()
            }
            ConcernKind::Warning => status.warning.is_some(),
            _ => true,
        }
    }
}
