//! A stop is sent, at once and until the drive has taken it: each attempt, what it hears on its way, and how it ends.

use drive_core::{Error, ErrorKind, Followed, Result, StopMode, Stopped};
use tokio::time::Instant;

use super::{REPEAT, is_refused};
use crate::{
    cause::Cause,
    event::EventKind,
    supervisor::{Job, Supervisor, verdict::status_of},
};

impl Supervisor {
    pub(in crate::supervisor) fn stop_job(&self, now: Instant) -> Option<Job> {
        let stopping = self.stopping.as_ref()?;
        (stopping.next_try? <= now).then_some(Job::Stop(stopping.mode))
    }

    /// An attempt is on its way; whose.
    pub(in crate::supervisor) fn begin_attempt(&mut self) -> Option<Cause> {
        let stopping = self.stopping.as_mut()?;
        stopping.begun = stopping.begun.saturating_add(1);
        Some(stopping.asker.cause())
    }

    /// What the attempt has heard that is under way: the status does not show the stop yet, and the drive may have refused its word.
    pub(crate) fn handle_followed(&mut self, now: Instant, heard: Followed) {
        let Followed { status, denied } = heard;
        if !matches!(self.in_flight, Some(Job::Stop(_))) {
            return;
        }
        if let Some(stopping) = &mut self.stopping {
            // Whoever asks before the attempt ends is told so, and no more once the drive takes the words again.
            if denied.is_some() || matches!(stopping.error, Some(Error::Exception { .. })) {
                stopping.error = denied;
            }
        }
        self.accept_status(now, status);
    }

    pub(in crate::supervisor) fn handle_stopped(&mut self, now: Instant, result: Result<Stopped>) {
        let standstill = self.settings.times.standstill;
        let Some(stopping) = &mut self.stopping else { return };
        // What never left for the line was no attempt.
        let error = result.as_ref().err();
        let refused = error.is_some_and(is_refused);
        let sent = !refused && error.is_none_or(|error| error.kind() != ErrorKind::NotSent);
        stopping.attempts = stopping.attempts.saturating_add(u32::from(sent));
        stopping.begun = stopping.begun.saturating_sub(u32::from(!sent));
        let cause = stopping.asker.cause();
        let status = match result {
            Ok(Stopped { status, mode: used, instead: why, taken_from, injects_for }) => {
                let asked = stopping.mode;
                let told = std::mem::replace(&mut stopping.used, used);
                stopping.next_try = None;
                // The ramp that ends an injection is no other mode.
                if stopping.injects_since.is_none() || used != StopMode::Ramp {
                    stopping.shown = Some((used, why));
                }
                if used == StopMode::DcInjection {
                    stopping.injects_since.get_or_insert(now);
                    stopping.injects_for = injects_for;
                }
                stopping.error = None;
                stopping.pause = REPEAT.0;
                if !stopping.taken {
                    stopping.takes(now, standstill);
                }
                if let Some(other) = taken_from {
                    self.stop_took_command = true;
                    self.emit_by(EventKind::StopTookCommand(other), cause.clone());
                }
                if used != asked && used != told {
                    self.emit_by(EventKind::StopModeReplaced { asked, used, why }, cause);
                }
                Some(status)
            }
            Err(error) => {
                stopping.next_try = crate::mutant!("stop-not-repeated", Some(now + stopping.pause), None);
                stopping.pause = (stopping.pause * 2).min(REPEAT.1);
                stopping.taken = false;
                // No time makes it go out: whoever looks after the motor is told now.
                if refused {
                    stopping.alarm_at = stopping.alarm_at.map(|at| at.min(now));
                }
                let status = status_of(&error);
                stopping.error = Some(error);
                status
            }
        };
        if let Some(status) = status {
            self.accept_status(now, status);
        }
    }
}
