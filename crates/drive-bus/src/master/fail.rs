//! How an attempt that failed goes on: once more, or as an error.

use std::time::Duration;

use drive_core::{Class, Effect, PortError};
use tokio::time::Instant;

use super::{Asked, Master, Purpose};
use crate::{exchange::Failure, record::Ending, schedule::Entry};

impl<C> Master<C> {
    /// An attempt has failed: once more, or the end.
    pub(super) fn fail(
        &mut self,
        now: Instant,
        mut entry: Entry<Asked<C>>,
        failure: Failure,
        waited: Duration,
    ) {
        let write = entry.work.is_write;
        let error = match failure {
            Failure::Refused(why) => match entry.work.last.take() {
                // An earlier attempt may have been carried out.
                Some(unknown @ PortError::OutcomeUnknown(_)) => unknown,
                _ => PortError::Busy(why),
            },
            Failure::Doubted(why) if write => PortError::OutcomeUnknown(why),
            Failure::Doubted(why) => PortError::Mismatch(why.to_owned()),
            Failure::Timeout | Failure::Nobody if write => {
                crate::mutant!(
                    "lost-write-told-as-expired",
                    PortError::OutcomeUnknown("no answer"),
                    PortError::Expired
                )
            }
            Failure::Damaged(_) if write => PortError::OutcomeUnknown("the answer was damaged"),
            Failure::Mismatch(_) if write => PortError::OutcomeUnknown("the confirmation does not fit"),
            Failure::Timeout | Failure::Nobody => PortError::Timeout { after: waited },
            Failure::Damaged(why) => PortError::Damaged(why),
            Failure::Mismatch(why) => PortError::Mismatch(why),
        };
        let again = self.may_retry(now, &entry);
        self.end_attempt(entry, error, again);
    }

    fn may_retry(&self, now: Instant, entry: &Entry<Asked<C>>) -> bool {
        let offline = self.offline.contains(entry.slave);
        let edge =
            crate::mutant!("edge-repeated", entry.work.is_write && entry.terms.effect == Effect::Edge, false);
        // A command sent again behind a stop would undo it.
        let stopped = entry.work.is_write
            && entry.terms.class != Class::Stop
            && self.is_stopped_since(entry.slave, Some(entry.arrived));
        // A later request with the same key says that this value is not wanted any more.
        let replaced = entry.terms.replaces.is_some()
            && self
                .schedule
                .any(|other| other.slave == entry.slave && other.terms.replaces == entry.terms.replaces);
        // The gateway has not given it up yet, and asks as often as it does. One that answers as a rule is late, and soon heard.
        let was_heard = self.stations.get(&entry.slave).is_some_and(|station| station.timeout.is_learned());
        let is_asked_still =
            !entry.work.is_write && !was_heard && self.far_end.gate(true).is_some_and(|gate| gate > now);
        entry.work.attempts < self.config.retries
            && entry.expires().is_none_or(|expires| now < expires)
            && !(offline
                || edge
                || crate::mutant!("command-repeated-behind-stop", stopped, false)
                || crate::mutant!("old-setpoint-repeated", replaced, false)
                || is_asked_still
                || self.closing && entry.terms.class != Class::Stop)
    }

    /// The port is lost with exchanges under way. A read waits for the next port, and so does a stop; any other write has an
    /// unknown outcome and is never sent again.
    pub(super) fn fail_flight(&mut self, now: Instant, reason: &str) {
        self.to_send = None;
        if let Some(flight) = &self.flight {
            self.record.ended(now, flight.slave, flight.started, Ending::LineLost);
        }
        self.evidence.forsake(None);
        let aside = std::mem::take(&mut self.aside).into_values().map(|aside| aside.flight);
        let flights: Vec<_> = self.flight.take().into_iter().chain(aside).collect();
        for flight in flights {
            self.unsettle(now, &flight);
            self.fear_late_answer(now, &flight);
            self.fail_call(now, flight.purpose, reason);
        }
    }

    fn fail_call(&mut self, now: Instant, purpose: Purpose<C>, reason: &str) {
        let Purpose::Call(Some(entry)) = purpose else { return };
        let (error, may_again) = if entry.work.is_write {
            // A stop is sent again, as soon as there is a port.
            (PortError::OutcomeUnknown("the line was lost"), entry.terms.class == Class::Stop)
        } else {
            (PortError::LineDown(reason.to_owned()), true)
        };
        let again = may_again && self.may_retry(now, &entry);
        self.end_attempt(entry, error, again);
    }

    /// It is queued `again`, or its caller is told.
    fn end_attempt(&mut self, mut entry: Entry<Asked<C>>, error: PortError, again: bool) {
        if again {
            entry.work.attempts += 1;
            entry.work.last = Some(error);
            self.schedule.queue_again(entry);
        } else {
            self.outcomes.push_back((entry.work.caller, Err(error)));
        }
    }

    /// A request leaves the queue. What was sent before, and waited to be sent again, ends as that attempt did.
    pub(super) fn drop_unsent(&mut self, entry: Entry<Asked<C>>, error: PortError) {
        self.station(entry.slave).stats.outcomes.never_sent(&error);
        let error = crate::mutant!("sent-told-as-unsent", entry.work.last.unwrap_or(error), error);
        self.outcomes.push_back((entry.work.caller, Err(error)));
    }
}
