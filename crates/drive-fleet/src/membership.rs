//! Who belongs to a fleet that runs: lines and drives come, change and go, and the others notice nothing.

use std::{
    collections::BTreeSet,
    sync::{Arc, PoisonError, atomic::Ordering},
    time::Duration,
};

use drive_bus::Line;
use tokio::sync::watch;

use crate::{
    builder::{FleetBuilder, FleetError, SettingProblem, check_settings},
    cause::Policy,
    event::ExitAction,
    fleet::{Fleet, end},
    handle::Entry,
    message::Urgent,
    plan::forecast,
    settings::DriveSettings,
    snapshot::Snapshot,
};

impl Fleet {
    /// Adds lines and drives, all of them or none. Drives may also be on lines that the fleet has.
    ///
    /// ```no_run
    /// # use drive_core::{Drive, SlaveAddress};
    /// # fn atv312(port: drive_bus::Slave, slave: SlaveAddress) -> Box<dyn Drive> { unimplemented!() }
    /// # fn example(fleet: drive_fleet::Fleet) -> Result<(), drive_fleet::FleetError> {
    /// use drive_fleet::DriveSettings;
    ///
    /// fleet.extend(|fleet| {
    ///     fleet.drive("north", 7, DriveSettings::watched("pump 7"), |port, slave| atv312(port, slave))
    /// })
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`FleetError`] with what does not fit; nothing was added then. [`FleetError::ShutDown`] after the end of the fleet.
    ///
    /// # Panics
    /// Outside a tokio runtime, in which the tasks of its drives are to live.
    ///
    /// # Deadlocks
    /// `add` may not change the members itself, by this or another method: whoever does waits until it has returned.
    pub fn extend(&self, add: impl FnOnce(FleetBuilder) -> FleetBuilder) -> Result<(), FleetError> {
        let _changing = self.inner.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let events = self.sender().ok_or(FleetError::ShutDown)?;
        let (lines, drives) = add(FleetBuilder::addition(&self.members())).enlist(&events)?;
        self.change(|members| {
            lines.into_iter().for_each(|line| members.add_line(line));
            drives.into_iter().for_each(|drive| members.add_drive(drive));
        });
        Ok(())
    }

    /// Gives a drive other settings. Its task, its snapshot, its orders and a stop under way go on; what depends on the
    /// settings is checked anew. A start of a motor at rest that they refuse is broken off, also where it is being carried out. Whether its line can keep the new periods is not judged here.
    ///
    /// # Errors
    /// [`FleetError::NoSuchDrive`]; [`FleetError::Setting`] for settings that contradict themselves or the family, and for a
    /// drive that would not be under control any more: that one is [removed](Self::remove), so that its policy acts, and
    /// added again.
    pub fn reconfigure(&self, settings: DriveSettings) -> Result<(), FleetError> {
        let _changing = self.inner.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = self.members().drive(&settings.name).cloned();
        let Some(entry) = entry else { return Err(FleetError::NoSuchDrive(settings.name)) };
        check_exchange(&entry, &settings)?;
        let settings = Arc::new(settings);
        *entry.settings.write().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&settings);
        // A task that is gone has nothing to change.
        let _ = entry.urgent.send(Urgent::Settings(settings));
        self.replan(&entry.line.name);
        Ok(())
    }

    /// Calls the drive `old` otherwise, as these settings have it, which hold from now on. It is the same drive: its task, its orders, a
    /// stop under way and its motor go on, and nothing is written to it. A handle of it by the old name commands it on; a watch by the
    /// old name ends, as if the drive had left.
    ///
    /// # Errors
    /// [`FleetError::NameTaken`], and as of [`reconfigure`](Self::reconfigure); nothing has changed then.
    pub fn rename(&self, old: &str, settings: DriveSettings) -> Result<(), FleetError> {
        let _changing = self.inner.changing.lock().unwrap_or_else(PoisonError::into_inner);
        if self.members().drive(&settings.name).is_some() {
            return Err(FleetError::NameTaken(settings.name));
        }
        let entry = self.members().drive(old).cloned();
        let Some(entry) = entry else { return Err(FleetError::NoSuchDrive(old.to_owned())) };
        check_exchange(&entry, &settings)?;
        let settings = Arc::new(settings);
        let name: Arc<str> = Arc::from(settings.name.as_str());
        let now = Snapshot { name: Arc::clone(&name), ..Snapshot::clone(&entry.snapshots.now()) };
        let (told, snapshots) = watch::channel(Arc::new(now));
        let renamed = Arc::new(Entry {
            name,
            place: entry.place.clone(),
            line: Arc::clone(&entry.line),
            slave: entry.slave,
            capabilities: entry.capabilities,
            watchdog: entry.watchdog,
            settings: Arc::clone(&entry.settings),
            broadcasts: Arc::clone(&entry.broadcasts),
            messages: entry.messages.clone(),
            urgent: entry.urgent.clone(),
            calls: Arc::clone(&entry.calls),
            snapshots: snapshots.into(),
            exit: entry.exit.clone(),
            removed: Arc::clone(&entry.removed),
        });
        *entry.settings.write().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&settings);
        self.change(|members| members.rename(old, renamed));
        // A task that is gone has nothing to change.
        let _ = entry.urgent.send(Urgent::Renamed(settings, told));
        self.replan(&entry.line.name);
        Ok(())
    }

    /// Takes drives out of the fleet: the policy of each acts as at a [`shutdown`](Self::shutdown), within `limit`, and what
    /// was done is listed. Handles of it refuse every command but a stop from then on; it is asked and stopped like any other until the
    /// policies of all of them are done, and refuses stops too once they have gone. Names that the fleet does not have are left out.
    /// The policies are on their way when this returns.
    ///
    /// # Cancellation
    /// When the future is dropped the policies go on, and the drives stay listed and are asked on.
    #[must_use = "a drive that was not stopped may run"]
    pub fn remove(
        &self,
        drives: &[&str],
        limit: Duration,
    ) -> impl Future<Output = Vec<(Arc<str>, ExitAction)>> + Send + use<> {
        let leaving = self.members().numbered(drives);
        leaving.values().for_each(|entry| entry.removed.store(true, Ordering::Relaxed));
        let (ended, fleet) = (end(leaving.values().cloned().collect(), Policy::Removal, limit), self.clone());
        async move {
            let actions = ended.await;
            // Not before: nobody waits for a policy with the lock in hand.
            let _changing = fleet.inner.changing.lock().unwrap_or_else(PoisonError::into_inner);
            fleet.change(|members| leaving.keys().for_each(|number| members.remove_drive(*number)));
            let lines: BTreeSet<&str> = leaving.values().map(|left| &*left.line.name).collect();
            lines.into_iter().for_each(|line| fleet.replan(line));
            actions
        }
    }

    /// Takes a line without drives out of the fleet, and gives it. `None` where the fleet has no such line, or drives on it.
    pub fn remove_line(&self, line: &str) -> Option<Line> {
        let _changing = self.inner.changing.lock().unwrap_or_else(PoisonError::into_inner);
        self.change(|members| members.remove_line(line)).map(|removed| removed.line.clone())
    }

    /// Plans a line anew whose drives have changed.
    fn replan(&self, line: &str) {
        let members = self.members();
        let Some(entry) = members.line(line) else { return };
        let demands: Vec<_> = members.on_line(line).map(|drive| drive.demand()).collect();
        entry.set_plan(forecast(entry.budget, &demands, 0).plan);
    }
}

/// Checks the settings that a drive is to have from now on.
fn check_exchange(entry: &Entry, settings: &DriveSettings) -> Result<(), FleetError> {
    // What is only read is stopped by nobody: a motor that was started here would be left to itself.
    let released = (entry.settings().control && !settings.control).then(|| SettingProblem {
        setting: "control",
        reason: "a drive under control is removed, by its policy, before it is only read".to_owned(),
    });
    let checked = check_settings(settings, entry.capabilities, entry.watchdog);
    match released.or_else(|| checked.err()) {
        Some(problem) => Err(FleetError::Setting { drive: settings.name.clone(), problem }),
        None => Ok(()),
    }
}
