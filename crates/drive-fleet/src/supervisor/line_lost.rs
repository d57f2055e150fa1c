//! The line has lost its port. However short that was, another drive may answer now: the adapters have come back under each
//! other's name, the serial servers under each other's address.

use drive_core::{Error, Refusal, StopMode};
use tokio::time::Instant;

use super::{
    Asker, Job, Supervisor,
    orders::{Active, Phase},
};
use crate::{
    cause::Policy,
    outcome::{Refused, Unconfirmed},
    snapshot::Link,
};

impl Supervisor {
    /// Its line has lost its port. Until the drive was asked anew which it is nothing is sent to it but stops. Gives whether the
    /// job in flight has to be dropped for it.
    pub(crate) fn handle_line_lost(&mut self, now: Instant) -> bool {
        self.look_anew(now);
        self.end_writes();
        self.end_order_by_line(now);
        self.end_restoring("its line was lost meanwhile");
        // What would be sent of it yet was meant for the drive that answered before, and what it has read is that one's. A stop is
        // given all the same, as that of a drive which is lost.
        self.in_flight.is_some_and(|job| !matches!(job, Job::Stop(_)))
    }

    /// Another drive may answer than before: what is known of it is read anew, and it is asked which it is.
    fn look_anew(&mut self, now: Instant) {
        self.changed = true;
        self.unseen = true;
        self.given = None;
        self.doubt_stop();
        self.checks.connected(now);
        if self.link == Link::Connected {
            self.pace.hurry(now);
        }
    }

    /// An order was not carried out, and its family may have found that another drive answers than before: nobody has missed it.
    pub(super) fn note_exchange(&mut self, now: Instant, error: &Error) {
        if matches!(error, Error::Refused { reason: Refusal::Exchanged, .. }) {
            self.look_anew(now);
            self.end_writes();
        }
    }

    /// Whether the drive that answers was not looked at yet since its line was lost.
    pub(super) fn is_unseen(&self) -> bool {
        self.unseen && self.link == Link::Connected
    }

    /// An order of which nothing was sent waits until it is known which drive answers. One of which something was is over, and
    /// a start of which nobody knows whether it was carried out is taken back.
    fn end_order_by_line(&mut self, now: Instant) {
        let Some(active) = &self.active else { return };
        let is_start = matches!(
            active.phase,
            Phase::Sending(Job::Start(_)) | Phase::Verifying { job: Job::Start(_), .. }
        );
        if matches!(active, Active { phase: Phase::Prepare, setpoint_given: None, .. }) {
            return;
        }
        let outcome = match active.phase {
            // Of an edge nobody knows whether it was sent.
            Phase::Sending(Job::Persist) => self.unknown(now, self.last_error.clone()),
            _ => active.ended_by(Refused::NotConnected, Unconfirmed::Lost),
        };
        self.end_order(outcome);
        if is_start {
            self.stop_by_policy(now, Asker::Policy(Policy::StartNotConfirmed), StopMode::Ramp);
        }
    }
}
