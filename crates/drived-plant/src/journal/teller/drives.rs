//! What is told of drives: they are heard and lost, trip, are commanded and left.

use std::{sync::Arc, time::Duration};

use drive_core::{Command, Error, PortError, Status};
use drive_fleet::{Cause, ExitAction, Outcome, Policy, Snapshot, Trip};
use tokio::time::Instant;
use tracing::Level;

use super::{Fate, Held, Teller, What, When};
use crate::journal::words::{Hertz, Span, cause, doing, fault, left};

/// How long the drive may take to explain a trip.
const EXPLAINED: Duration = Duration::from_secs(4);

impl Teller {
    pub(super) fn connected(&mut self, now: Instant, drive: &Arc<str>, status: &Status, snapshot: &Snapshot) {
        let state = self.state(drive);
        let was_tripped = std::mem::take(&mut state.tripped);
        let is_first = !std::mem::replace(&mut state.seen, true);
        let lost = state.lost.take();
        let after = lost.map(|(since, _)| now.saturating_duration_since(since)).unwrap_or_default();
        let turned = lost.and_then(|(_, turned)| turned);
        state.changed_at = Some(now);
        if status.is_fault() {
            state.tripped = true;
            let when = if is_first { When::First } else { When::Back(after) };
            let explained =
                snapshot.trips.back().filter(|_| was_tripped).and_then(|trip| trip.faults.clone());
            let what = What::Trip { when, is_new: !was_tripped, code: status.fault_code };
            let held = Held { until: now + EXPLAINED, drive: Arc::clone(drive), what };
            match explained.as_ref().and_then(|faults| faults.present.first()) {
                Some(present) => self.release(now, held, Some(fault(present))),
                None => self.held.push(held),
            }
            return;
        }
        let cleared = if was_tripped { ", no fault any more" } else { "" };
        match turned {
            _ if is_first => self.share(now, drive, Fate::Connected, Level::INFO, after, doing(status)),
            Some(turned) if status.is_standstill() => {
                let said = format!("at standstill: it turned at {} when it was lost", Hertz(turned));
                self.back(now, drive, Level::WARN, after, said);
            }
            _ => self.back(now, drive, Level::INFO, after, format!("{}{cleared}", doing(status))),
        }
    }

    pub(super) fn lost(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        silent_for: Duration,
        error: Option<&Error>,
        snapshot: &Snapshot,
    ) {
        let status = snapshot.status.as_ref().map(|status| &*status.value);
        let turned = status.filter(|status| !status.is_undriven()).and_then(|status| status.output_frequency);
        let line = self.line_of(drive);
        let with_line =
            line_down(error).is_some() || self.lines.get(line).is_some_and(|line| line.away.is_some());
        let state = self.state(drive);
        state.lost = Some((now.checked_sub(silent_for).unwrap_or(now), turned));
        (state.with_line, state.changed_at) = (with_line, Some(now));
        if with_line {
            return;
        }
        let why = cause(error, silent_for);
        let Some(status) = status else {
            self.share(now, drive, Fate::Silent, Level::WARN, silent_for, String::new());
            return;
        };
        let level = if status.is_undriven() { Level::WARN } else { Level::ERROR };
        if self.together.contains_key(&(line, Fate::Lost)) {
            self.share(now, drive, Fate::Lost, level, silent_for, left(status));
        } else {
            let during = if status.is_fault() { "while " } else { "" };
            self.say(now, drive, level, "lost", format!("lost {during}{}: {why}", left(status)));
            self.expect(now, drive, Fate::Lost);
        }
    }

    pub(super) fn tripped(&mut self, now: Instant, drive: &Arc<str>, trip: &Trip) {
        self.state(drive).tripped = true;
        if self.held.iter().any(|held| held.drive == *drive && matches!(held.what, What::Trip { .. })) {
            return;
        }
        let before = trip.before.as_ref().map(|before| &*before.value);
        let turned = before.filter(|before| !before.is_undriven()).and_then(|before| before.output_frequency);
        let code = trip.status.value.fault_code;
        self.hold(now + EXPLAINED, drive, What::Trip { when: When::Heard(turned), is_new: true, code });
    }

    pub(super) fn explained(&mut self, now: Instant, drive: &Arc<str>, trip: &Trip) {
        let Some(present) = trip.faults.as_ref().and_then(|faults| faults.present.first()) else { return };
        let mut text = fault(present);
        if let Some(silence) = trip.watchdog_after {
            let by = if trip.by_watchdog { "by its communication watchdog " } else { "" };
            text = format!("{text}, {by}after {} without a message", Span(silence));
        }
        let is_it = |held: &Held| held.drive == *drive && matches!(held.what, What::Trip { .. });
        match self.held.iter().position(is_it) {
            Some(index) => {
                let held = self.held.remove(index);
                self.release(now, held, Some(text));
            }
            None => self.say(now, drive, Level::INFO, "explained", format!("the trip was {text}")),
        }
    }

    pub(super) fn fault_changed(&mut self, now: Instant, drive: &Arc<str>, trip: &Trip) {
        let Some(present) = trip.faults.as_ref().and_then(|faults| faults.present.first()) else { return };
        self.say(now, drive, Level::WARN, "fault", format!("another fault stands now: {}", fault(present)));
    }

    pub(super) fn commanded(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        command: &Command,
        commander: &str,
        cause: &Cause,
        outcome: &Outcome,
    ) {
        // How it was found is told before what became of a command to it.
        for fate in [Fate::Connected, Fate::Back] {
            self.tell_waiting(drive, fate);
        }
        let at_exit = matches!(cause, Cause::Policy { policy: Policy::Exit | Policy::Removal });
        let mine = |what: &What| match (what, command) {
            (What::FaultCleared, Command::ResetFaults) => outcome.is_confirmed(),
            (What::StopUnconfirmed { .. }, Command::Stop(_)) => !outcome.is_confirmed(),
            _ => false,
        };
        let index = self.held.iter().position(|held| held.drive == *drive && mine(&held.what));
        let held = index.map(|index| self.held.remove(index));
        if let (Some(Held { what: What::StopUnconfirmed { .. }, .. }), true) = (&held, !at_exit) {
            let text = format!("STOP NOT CONFIRMED, the motor may turn: {command} by {commander}: {outcome}");
            self.say(now, drive, Level::ERROR, "stop", text);
            return;
        }
        // What was done at the exit is told as that, and a run command that stands although it is to be withdrawn.
        if at_exit || *command == Command::Withdraw && outcome.is_confirmed() {
            self.held.extend(held);
            return;
        }
        if *command == Command::ResetFaults && outcome.is_confirmed() {
            self.state(drive).reset_at = Some(now);
        }
        let level = if outcome.is_confirmed() { Level::INFO } else { Level::WARN };
        let key = match command {
            Command::Setpoint(_) => format!("setpoint {commander} {}", outcome.kind()),
            command => format!("{command} {commander} {}", outcome.kind()),
        };
        self.say(now, drive, level, &key, format!("{command} by {commander}: {outcome}"));
    }

    pub(super) fn exited(&mut self, now: Instant, drive: &Arc<str>, action: &ExitAction) {
        if !action.is_alarm() {
            let said = match action {
                ExitAction::Stopped(_) => "stopped",
                ExitAction::Released(_) => "released",
                _ => "left as before",
            };
            self.share(now, drive, Fate::AtExit, Level::INFO, Duration::ZERO, said.to_owned());
        } else {
            self.say(now, drive, Level::ERROR, "exit", format!("at the exit: {action}"));
        }
    }
}

/// What the line said, when it is its port that is gone.
fn line_down(error: Option<&Error>) -> Option<&str> {
    match error {
        Some(Error::Port { problem: PortError::LineDown(why), .. }) => Some(why),
        _ => None,
    }
}
