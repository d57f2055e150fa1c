//! A run command that an earlier run of the program has given, and a stop: the run command is ours again only where the record of it, the drive's identity
//! and the drive's own words agree. Without all three somebody else has started the motor.

use drive_core::{Lease, Verdict};
use tokio::time::Instant;

use super::{Asker, Supervisor};
use crate::{
    cause::{Cause, Policy},
    event::EventKind,
    settings::{DriveSettings, RunRecord},
    snapshot::IdentityCheck,
    stop_order::StopOrder,
};

/// How far it is known whether a run of before is ours.
#[derive(Debug)]
pub(super) enum Adoption {
    /// There is none, or it is decided.
    Decided,
    /// There is a record, and the drive has not said which it is.
    Kept(RunRecord),
    /// It is the drive of the record; its family is to be told.
    Due(Lease),
    /// The next words of the drive decide.
    Asked,
}

impl Adoption {
    pub(super) fn of(settings: &DriveSettings) -> Self {
        settings.run_before.clone().map_or(Self::Decided, Self::Kept)
    }
}

impl Supervisor {
    /// It has been asked which drive it is.
    pub(super) fn adopt_run(&mut self, now: Instant) {
        let Adoption::Kept(record) = &self.adoption else { return };
        let why = match self.checks.identity() {
            IdentityCheck::Unchecked => return,
            // A stop that nobody has seen confirmed waits until it may be given again.
            _ if !self.settings.control && record.stop.is_some() => return,
            _ if !self.settings.control => "the drive is only read",
            _ if crate::mutant!(
                "run-of-another-drive-adopted",
                self.is_drive_of(record) && !self.checks.is_another(),
                true
            ) =>
            {
                let stop = record.stop_order();
                self.adoption = record.lease.map_or(Adoption::Decided, Adoption::Due);
                self.pace.hurry(now);
                self.stop_goes_on(now, stop);
                return;
            }
            // The motor is the one at this place, whatever drive has come to it.
            _ => {
                let stop = record.stop_order();
                let why = match stop {
                    Some(_) => {
                        "it was given to another drive than answers here, to which the stop of before is given"
                    }
                    None => "it was given to another drive than answers here",
                };
                self.not_adopted(why.to_owned());
                self.stop_goes_on(now, stop);
                return;
            }
        };
        self.not_adopted(why.to_owned());
    }

    /// Whoever turns it, it is not to go on: who has given its stop has not seen it confirmed.
    fn stop_goes_on(&mut self, now: Instant, stop: Option<StopOrder>) {
        if let Some(stop) = crate::mutant!("stop-of-before-forgotten", stop, None) {
            self.stop_by_policy(now, Asker::Policy(Policy::StopOfBefore), stop);
        }
    }

    /// Whether a stop of before waits for the drive to say which it is.
    pub(super) const fn owes_stop_of_before(&self) -> bool {
        self.settings.control && matches!(&self.adoption, Adoption::Kept(record) if record.stop.is_some())
    }

    /// Whether this is the drive of a record. A stop that was asked of one that had never said which it is goes to whoever answers.
    fn is_drive_of(&self, record: &RunRecord) -> bool {
        let is_of_nobody = record.lease.is_none() && record.identity.is_none();
        is_of_nobody || self.says_what_it_is() == record.identity
    }

    /// What the drive says of itself, where it does.
    pub(crate) fn says_what_it_is(&self) -> Option<String> {
        self.checks.says()
    }

    /// The record of an earlier run of which it is not known yet whether it is ours.
    pub(super) fn unadopted(&self) -> Option<RunRecord> {
        match &self.adoption {
            Adoption::Kept(record) => {
                let stop = self.stop_under_way().or_else(|| record.stop_order());
                Some(record.clone().stopped_by(stop))
            }
            Adoption::Due(lease) => {
                RunRecord::of(|| self.says_what_it_is(), Some(*lease), self.stop_under_way())
            }
            Adoption::Decided | Adoption::Asked => None,
        }
    }

    /// The run command that the family is to take for ours, once.
    pub(crate) fn take_adoption(&mut self) -> Option<Lease> {
        match std::mem::replace(&mut self.adoption, Adoption::Decided) {
            Adoption::Due(lease) => {
                self.adoption = Adoption::Asked;
                Some(lease)
            }
            other => {
                self.adoption = other;
                None
            }
        }
    }

    /// Whether a record of an earlier run still waits for the drive's words.
    pub(crate) const fn is_adopting(&self) -> bool {
        !matches!(self.adoption, Adoption::Decided)
    }

    /// What the drive's words say of it. Gives whether the verdict is on a run command that is not ours.
    pub(super) fn judge_adoption(&mut self, verdict: Option<Verdict>) -> bool {
        if !matches!(self.adoption, Adoption::Asked) {
            return false;
        }
        match crate::mutant!(
            "run-adopted-unseen",
            (self.lease, verdict),
            (self.lease, Some(Verdict::InForce))
        ) {
            (Some(_), None | Some(Verdict::NotKnown)) => false,
            (Some(lease), Some(_)) => {
                self.adoption = Adoption::Decided;
                self.emit_shown(EventKind::RunAdopted(lease), Cause::Found);
                false
            }
            (None, verdict) => {
                let because = verdict.and_then(|verdict| verdict.because());
                let gone = || "it does not stand in the drive any more".to_owned();
                self.not_adopted(because.map_or_else(gone, |because| because.to_string()));
                true
            }
        }
    }

    fn not_adopted(&mut self, why: String) {
        self.adoption = Adoption::Decided;
        self.emit_by(EventKind::RunNotAdopted(why), Cause::Found);
    }
}
