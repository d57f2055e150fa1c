//! A configuration that is read again while the daemon runs: only what is different changes.

mod changes;

use std::{
    path::PathBuf,
    sync::{Arc, PoisonError},
    time::Duration,
};

use drive_bus::Line;
use drive_fleet::{Fleet, FleetBuilder};
use tokio::{sync::Mutex, time::Instant};

use self::changes::{Change, changes};
use super::notify::Notify;
use crate::{
    config::{Config, DrivePart, LinePart},
    failure::Failure,
    json::unix,
    metrics::{Id, Samples, Source},
    one_drive,
};

/// Reads the configuration again. Cheap to clone; one reload at a time.
#[derive(Clone)]
pub(crate) struct Reloader(Arc<Inner>);

struct Inner {
    fleet: Fleet,
    notify: Notify,
    file: PathBuf,
    /// What holds now.
    config: Mutex<Config>,
    /// Whether what was read last holds, and when what holds was read.
    last: std::sync::Mutex<(bool, u64)>,
}

impl Reloader {
    pub(super) fn new(fleet: Fleet, notify: Notify, file: PathBuf, config: Config) -> Self {
        let last = std::sync::Mutex::new((true, unix(Instant::now())));
        Self(Arc::new(Inner { fleet, notify, file, config: Mutex::new(config), last }))
    }

    /// Reads the file and does what has changed in it, or with `dry_run` only says what that would be: one sentence each. The
    /// whole file is read and checked first.
    ///
    /// A drive whose settings alone have changed keeps its task, its snapshot and its motor. One that is removed, or whose
    /// line, address, family or options have changed, ends by its policy, as at the exit.
    ///
    /// # Errors
    /// [`Failure::Input`] with what is wrong in the file; the old configuration holds then. [`Failure::Drive`] when a motor
    /// whose drive was removed may turn.
    pub(crate) async fn reload(&self, dry_run: bool) -> Result<Vec<String>, Failure> {
        let reloaded = self.read_again(dry_run).await;
        if !dry_run {
            let mut last = self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
            *last = match &reloaded {
                Ok(_) | Err(Failure::Drive(_)) => (true, unix(Instant::now())),
                Err(_) => (false, last.1),
            };
        }
        reloaded
    }

    async fn read_again(&self, dry_run: bool) -> Result<Vec<String>, Failure> {
        let mut config = self.0.config.lock().await;
        let file = self.0.file.clone();
        // A name of a server may have to be looked up.
        let read = tokio::task::spawn_blocking(move || Config::load_workable(&file)).await;
        let new = read.unwrap_or_else(|_| Err(Failure::Input("the file could not be read".to_owned())))?;
        let changes = changes(&config, &new);
        if dry_run {
            return Ok(changes.iter().map(|change| change.would_be(&self.0.fleet)).collect());
        }
        self.0.notify.reloading();
        let done = self.carry_out(&changes, &new, config.shutdown).await;
        self.0.notify.reloaded();
        let alarms = done?;
        *config = new;
        match alarms.is_empty() {
            true => Ok(changes.iter().map(ToString::to_string).collect()),
            false => Err(Failure::Drive(format!("THE MOTOR MAY TURN: {}", alarms.join("; ")))),
        }
    }

    /// Gives who was removed and may turn.
    async fn carry_out(
        &self,
        changes: &[Change],
        new: &Config,
        limit: Duration,
    ) -> Result<Vec<String>, Failure> {
        let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
        let fleet = &self.0.fleet;
        // What can fail comes first.
        let mut lines = Vec::new();
        for part in new.lines.iter().filter(|part| changes.iter().any(|change| change.opens(&part.name))) {
            lines.push((part, Line::start(part.config.clone()).map_err(|error| input(&error))?));
        }
        let leaving: Vec<&str> = changes.iter().filter_map(Change::removed_drive).collect();
        let actions = fleet.remove(&leaving, limit).await;
        for name in changes.iter().filter_map(Change::closed_line) {
            if let Some(line) = fleet.remove_line(name) {
                one_drive::close(&line).await;
            }
        }
        let added = fleet.extend(|mut builder| {
            for (part, line) in &lines {
                builder = builder.line_with(&*part.name, line.clone(), |_| part.budget);
            }
            for part in &new.lines {
                let is_added = |drive: &&DrivePart| {
                    changes.iter().any(|change| change.added_drive() == Some(&*drive.settings.name))
                };
                builder = part
                    .drives
                    .iter()
                    .filter(is_added)
                    .fold(builder, |builder, drive| add(builder, part, drive));
            }
            // The file was planned as a whole.
            builder.whatever_the_plan()
        });
        added.map_err(|error| input(&error))?;
        for settings in changes.iter().filter_map(Change::settings) {
            fleet.reconfigure(settings.clone()).map_err(|error| input(&error))?;
        }
        let alarms = actions.iter().filter(|(_, action)| action.is_alarm());
        Ok(alarms.map(|(name, action)| format!("{name}: {action}")).collect())
    }
}

impl Source for Reloader {
    fn collect(&self, samples: &mut Samples) {
        let (is_successful, at) = *self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
        samples.add(Id::ReloadSuccessful, &[], f64::from(u8::from(is_successful)));
        samples.add(Id::ReloadTime, &[], at as f64 / 1_000.0);
    }
}

/// Adds a drive of a line.
pub(super) fn add(builder: FleetBuilder, line: &LinePart, drive: &DrivePart) -> FleetBuilder {
    let DrivePart { name, settings, options } = drive;
    builder.drive(&line.name, name.slave.number(), settings.clone(), |port, slave| {
        name.family.open_with(port, slave, &options.values)
    })
}
