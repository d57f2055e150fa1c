//! What a job writes to the EEPROM, why, and that it did: counted in the ledger and told.

use tokio::time::Instant;

use super::{Job, Question, Supervisor};
use crate::{
    cause::{Cause, Policy},
    eeprom::EepromUse,
    event::EventKind,
};

impl Supervisor {
    /// What a job writes to the EEPROM, and why: known while who asks for it stands, for a stop ends what it drops.
    pub(super) fn wears(&self, job: Job) -> Option<(EepromUse, Cause)> {
        let watchdog = |by, policy| self.watchdog_wears.then(|| (by, Cause::policy(policy)));
        match job {
            Job::ArmWatchdog(..) => watchdog(EepromUse::Watchdog, Policy::Watchdog),
            Job::RestoreWatchdog(_) => watchdog(EepromUse::Restore, self.exits_by),
            Job::Persist => self.active.as_ref().map(|active| (EepromUse::Save, active.cause())),
            Job::Ask(Question::Write(row, _)) if row.storage.may_wear() => {
                self.questions.front().map(|asked| (EepromUse::Parameter, Cause::Command(asked.by.clone())))
            }
            _ => None,
        }
    }

    /// Its EEPROM was written, or may have been.
    pub(super) fn note_eeprom(&mut self, now: Instant, worn: Option<(EepromUse, Cause)>) {
        let Some((by, cause)) = worn else { return };
        if by == EepromUse::Watchdog {
            self.ledger.kept.in_vain = self.checks.in_vain();
        }
        self.ledger.write(now);
        let ledger = self.ledger.kept.clone();
        self.emit_by(EventKind::EepromWritten { by, ledger }, cause);
    }
}
