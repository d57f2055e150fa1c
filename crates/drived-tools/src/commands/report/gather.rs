//! Everything that a report is made of, read from a daemon: what could not be read stands there with the reason.

use std::time::{SystemTime, UNIX_EPOCH};

use axum::http::StatusCode;
use drive_core::Faults;
use drive_families::Family;
use futures_util::future::try_join_all;
use serde::de::DeserializeOwned;

use crate::commands::param::{diff::Comparison, file::Backup, source::Source};
use drived_client::{Daemon, Way, path_of, wanted};
use drived_plant::plant::{
    past::DayView,
    recent::RecentView,
    views::{DriveView, LineDetailView, SettingsView, StateView},
};
use drived_words::failure::Failure;

/// Why nothing is asked of a drive that is away.
const SILENT: &str = "the drive did not answer";
/// Why the parameters were not asked for.
pub(super) const LEFT_OUT: &str = "left out, as was asked";

/// So far back it is told what a drive did.
const DAYS_MS: u64 = 30 * 86_400_000;

/// What was read.
#[derive(Debug)]
pub(super) struct Gathered {
    /// The state of the plant at the end of the reading.
    pub(super) state: StateView,
    /// The lines on which the drives are, each with what was measured on it.
    pub(super) lines: Vec<Told<LineDetailView>>,
    pub(super) drives: Vec<DriveTold>,
    /// What happened lately.
    pub(super) events: Told<Vec<RecentView>>,
}

/// An answer, or why there is none.
pub(super) type Told<T> = Result<T, String>;

/// What was read of one drive.
#[derive(Debug)]
pub(super) struct DriveTold {
    /// As the API has it.
    pub(super) view: DriveView,
    pub(super) family: Result<Family, String>,
    pub(super) settings: Told<SettingsView>,
    pub(super) faults: Told<Faults>,
    pub(super) parameters: Result<Compared, String>,
    /// What it did lately, day by day; `None` where no history is kept.
    pub(super) past: Option<Told<Vec<DayView>>>,
}

/// The parameters of a drive beside the factory setting.
#[derive(Debug)]
pub(super) struct Compared {
    pub(super) held: Backup,
    pub(super) factory: Comparison,
}

impl Gathered {
    /// Reads everything of these drives: lines, drives and groups by their names; of all where none is named.
    pub(super) async fn read(way: &Way, names: &[String], with_parameters: bool) -> Result<Self, Failure> {
        let mut daemon = way.connect().await?;
        let before = daemon.state().await?;
        let wanted = wanted(&before, names)?;
        let lines = lines_of(&wanted);
        // The lines do not wait for one another.
        let read = lines.iter().map(|line| {
            let drives = wanted.iter().filter(|drive| drive.line == *line);
            read_drives(way, drives.copied(), with_parameters)
        });
        let read = try_join_all(read).await?;
        // What changes fast is read at the end, so that it is young when the report is written.
        let state = daemon.state().await?;
        let mut told = Vec::new();
        for line in &lines {
            told.push(ask(&mut daemon, &["lines", line]).await);
        }
        let events = ask(&mut daemon, &["events", "recent"]).await;
        let mut drives: Vec<DriveTold> = read.into_iter().flatten().collect();
        for drive in &mut drives {
            if let Some(now) = state.drives.iter().find(|now| now.name() == drive.name()) {
                drive.view = now.clone();
            }
            drive.ask_again(&mut daemon).await;
        }
        Ok(Self { state, lines: told, drives, events })
    }
}

/// Reads the drives of one line, one after the other.
async fn read_drives(
    way: &Way,
    drives: impl Iterator<Item = &DriveView>,
    with_parameters: bool,
) -> Result<Vec<DriveTold>, Failure> {
    let mut daemon = way.connect().await?;
    let mut told = Vec::new();
    for view in drives {
        let name = view.name();
        let family = view.family.parse().map_err(|error| drive_families::UnknownFamily::to_string(&error));
        let settings = ask(&mut daemon, &["drives", name, "settings"]).await;
        let is_there = view.snapshot.status.is_good();
        let (faults, parameters) = match (is_there, with_parameters) {
            (false, _) => (Err(SILENT.to_owned()), Err(SILENT.to_owned())),
            (true, false) => (ask(&mut daemon, &["drives", name, "faults"]).await, Err(LEFT_OUT.to_owned())),
            (true, true) => (
                ask(&mut daemon, &["drives", name, "faults"]).await,
                compared(way.connect().await?, view).await,
            ),
        };
        let past = past(&mut daemon, name).await;
        told.push(DriveTold { view: view.clone(), family, settings, faults, parameters, past });
    }
    Ok(told)
}

impl DriveTold {
    /// Reads the faults of a drive again that has tripped, or was reset, since they were read.
    async fn ask_again(&mut self, daemon: &mut Daemon) {
        let is_tripped = self.view.snapshot.fault.is_some();
        let is_known = self.faults.as_ref().is_ok_and(|faults| faults.tripped == is_tripped);
        if self.is_there() && !is_known {
            let name = self.view.name();
            self.faults = ask(daemon, &["drives", name, "faults"]).await;
        }
    }
}

/// The lines of drives, each once.
fn lines_of(drives: &[&DriveView]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for drive in drives {
        if !lines.contains(&drive.line) {
            lines.push(drive.line.clone());
        }
    }
    lines
}

async fn ask<T: DeserializeOwned>(daemon: &mut Daemon, parts: &[&str]) -> Told<T> {
    daemon.read(parts).await.map_err(|failure| failure.to_string())
}

/// What the history has kept of a drive, day by day; `None`: the daemon keeps no history.
async fn past(daemon: &mut Daemon, drive: &str) -> Option<Told<Vec<DayView>>> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let to = u64::try_from(now.as_millis()).unwrap_or(u64::MAX);
    let name = path_of(&[drive]);
    let name = name.rsplit('/').next().unwrap_or_default();
    let path = format!(
        "{}?drive={name}&from_unix_ms={}&to_unix_ms={to}",
        path_of(&["history", "days"]),
        to.saturating_sub(DAYS_MS)
    );
    match daemon.get(&path).await {
        Ok(answer) if answer.status == StatusCode::NOT_FOUND => None,
        Ok(answer) => Some(answer.done().map_err(|failure| failure.to_string())),
        Err(failure) => Some(Err(failure.to_string())),
    }
}

/// Reads the parameters of a drive and compares them with its factory setting.
async fn compared(daemon: Daemon, view: &DriveView) -> Result<Compared, String> {
    let mut source = Source::OfDaemon { daemon: Box::new(daemon), view: Box::new(view.clone()) };
    let held = source.keep().await.map_err(|failure| failure.to_string())?;
    match held.nothing_read() {
        Some(why) => Err(why),
        None => {
            let factory = Comparison::of(&held, &Backup::of_factory(&held), true);
            Ok(Compared { held, factory })
        }
    }
}
