//! What is found among the records: what was done to a drive, by whom, and what it said of it.

use drived_plant::plant::past::RecordView;

use super::{
    super::{
        body::{Body, Cause, OfOne, OfSeveral, body},
        journal::as_trip,
    },
    Facts, SEEN_AGAIN_MS,
};

/// What is told of one reading is recorded within this time.
const SAME_READING_MS: i64 = 150;

impl Facts {
    /// Whether a record is of this drive: what happened to it, or a command that was for it too.
    pub(in crate::story) fn is_of_drive(&self, found: &RecordView) -> bool {
        found.drive.as_deref() == Some(&*self.drive)
            || self.of_several(found).is_some()
            || self.is_refused(found)
    }

    /// Whether a record is of a command for this drive that a broker's face refused: that names its drive in its text.
    pub(in crate::story) fn is_refused(&self, found: &RecordView) -> bool {
        let rest = || found.text.strip_prefix(&*self.drive);
        found.what == "command_refused" && rest().is_some_and(|rest| rest.starts_with(": "))
    }

    /// Whether what it showed with something was found so behind a poll that was not answered, without which it is not told as found: one that
    /// is heard for the first time, or again, is told as that.
    pub(in crate::story) fn is_found_unanswered(&self, at: i64) -> bool {
        let of_reading = |found: &&RecordView| {
            found.drive.as_deref() == Some(&*self.drive) && (found.time_unix_ms - at).abs() <= SAME_READING_MS
        };
        let with_it = || self.records.iter().filter(of_reading);
        let is_found = |found: &RecordView| {
            found.what == "state_changed" && matches!(body(found).cause, Some(Cause::Found))
        };
        with_it().any(is_found) && !with_it().any(|found| found.what == "connected")
    }

    /// What became of a command for several at this drive.
    pub(in crate::story) fn of_several(&self, found: &RecordView) -> Option<OfOne> {
        if found.kind != "command" || found.drive.is_some() {
            return None;
        }
        let several: OfSeveral = serde_json::from_str(found.body.as_ref()?.get()).ok()?;
        several.drives.into_iter().find(|one| one.drive.as_deref() == Some(&*self.drive))
    }

    /// What the drive said of a trip, where that was read.
    pub(in crate::story) fn explained(&self, trip: &RecordView) -> Option<&RecordView> {
        let of_same = |found: &&RecordView| found.number > trip.number && found.drive == trip.drive;
        // What is explained behind the next trip is that one.
        let mut own = self.records.iter().filter(of_same).take_while(|found| found.what != "tripped");
        own.find(|found| found.what == "trip_explained").filter(|_| trip.what == "tripped")
    }

    /// Whose doing an event was. What followed an act of the program it once told as the doing of that, and such records are kept: a policy that
    /// can do nothing of the kind, or that acted long before, did not do it.
    pub(in crate::story) fn cause_of(&self, found: &RecordView) -> Option<Cause> {
        let Body { cause, from, .. } = body(found);
        if self.stop_key_with(found).is_some() {
            return Some(Cause::Drive);
        }
        let Some(Cause::Policy { policy }) = &cause else { return cause };
        let acted = || {
            self.records.iter().rev().any(|act| {
                act.what == "command"
                    && act.drive == found.drive
                    && (found.time_unix_ms - SEEN_AGAIN_MS..=found.time_unix_ms).contains(&act.time_unix_ms)
                    && matches!(body(act).cause, Some(Cause::Policy { policy: other }) if other == *policy)
            })
        };
        let ends_run = matches!(from.as_deref(), Some("running" | "stopping" | "quick_stop"));
        let can = match &*found.what {
            "fault_cleared" => policy == "on_fault",
            // Where the output was cut there was no run to be ended.
            "state_changed" if policy == "output_blocked" => false,
            "state_changed" => ends_run || acted(),
            _ => true,
        };
        let is_own = can && self.was_ending(found).is_none() && !self.found_nothing_to_do(found, policy);
        if is_own { cause } else { Some(Cause::Drive) }
    }

    /// That the STOP key of its drive had stopped the motor, as the reading says itself with which another state was told.
    fn stop_key_with(&self, found: &RecordView) -> Option<&RecordView> {
        let is_of_reading = |key: &&RecordView| {
            key.what == "stop_key"
                && key.drive == found.drive
                && (key.time_unix_ms - found.time_unix_ms).abs() <= SAME_READING_MS
        };
        self.records.iter().find(is_of_reading).filter(|_| found.what == "state_changed")
    }

    /// Whether what this program did by a policy at about that time found nothing to be done.
    pub(in crate::story) fn found_nothing_to_do(&self, found: &RecordView, policy: &str) -> bool {
        let mut acts = self.records.iter().filter(|act| {
            act.what == "command"
                && act.drive == found.drive
                && (act.time_unix_ms - found.time_unix_ms).abs() <= SEEN_AGAIN_MS
                && matches!(body(act).cause, Some(Cause::Policy { policy: other }) if other == policy)
        });
        acts.any(|act| act.text.contains(": nothing to be done"))
    }

    /// The begin of a run that somebody here had asked for, which went on when the program was killed, where it is told of that run that it was
    /// not taken over.
    pub(in crate::story) fn begun_before_kill(&self, found: &RecordView) -> Option<&RecordView> {
        let mut before = self.records.iter().rev().filter(|other| other.number < found.number);
        before.by_ref().find(|other| other.kind == "history" && other.what == "began_after_kill")?;
        let last = before.find(|other| other.what == "state_changed" && other.drive == found.drive)?;
        let Body { to, cause, .. } = body(last);
        let is_begun = to.as_deref() == Some("running") && matches!(cause, Some(Cause::Command { .. }));
        (is_begun && found.what == "run_not_adopted").then_some(last)
    }

    /// The trip by which the output of a drive was off when its stop was confirmed: the stop did not bring it to a standstill.
    pub(in crate::story) fn trip_behind(&self, confirmed: &RecordView) -> Option<&RecordView> {
        let own = self.records.iter().rev().filter(|found| {
            found.kind == "event" && found.drive == confirmed.drive && found.number < confirmed.number
        });
        let ends_fault = |found: &RecordView| match &*found.what {
            "fault_cleared" => true,
            "state_changed" => body(found).to.as_deref() != Some("fault"),
            "connected" => body(found).status.unwrap_or_default().state.as_deref() != Some("fault"),
            _ => false,
        };
        let mut own = own.take_while(|found| !ends_fault(found));
        own.find(|found| found.what == "tripped").filter(|_| confirmed.what == "stop_confirmed")
    }

    /// The drive's own record of its faults, where it was read behind a trip.
    pub(in crate::story) fn own_record(&self, trip: &RecordView) -> Option<&RecordView> {
        let later = self.records.iter().filter(|found| found.number > trip.number && self.is_of_drive(found));
        later.take_while(|found| found.what != "tripped").find(|found| found.what == "fault_record")
    }

    /// An event in words, a trip with what the drive said of it.
    pub(in crate::story) fn in_words(&self, found: &RecordView) -> String {
        let explained = self.explained(found).map(as_trip);
        explained.unwrap_or_else(|| self.told(found))
    }

    /// Events of this name at other drives, not farther from a moment than this. One that answers, if not as it should, is lost and not silent.
    pub(in crate::story) fn elsewhere(&self, what: &str, at: i64, within: i64) -> Vec<&RecordView> {
        let is_one = |found: &&RecordView| {
            found.kind == "event"
                && found.what == what
                && is_silent(found)
                && found.drive.as_deref().is_some_and(|drive| drive != self.drive)
                && (found.time_unix_ms - at).abs() <= within
        };
        self.records.iter().filter(is_one).collect()
    }
}

/// Whether nothing was heard of a drive that is told as lost: one that answers by exceptions, or damaged, is not cut off.
pub(in crate::story) fn is_silent(found: &RecordView) -> bool {
    const ANSWERED: [&str; 4] =
        [": exception ", "was damaged", "does not fit the request", "expired before it was sent"];
    found.what != "lost" || !ANSWERED.iter().any(|words| found.text.contains(words))
}

/// When something began: a loss with the silence, and not when patience was over.
pub(in crate::story) fn begins(found: &RecordView) -> i64 {
    let silent = if found.what == "lost" { body(found).silent_for_ms.unwrap_or_default() } else { 0 };
    found.time_unix_ms - i64::try_from(silent).unwrap_or_default()
}
