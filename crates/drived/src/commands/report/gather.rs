//! Everything that a report is made of, read from a daemon: what could not be read stands there with the reason.

use drive_families::Family;
use futures_util::future::try_join_all;
use serde_json::Value;

use crate::{
    client::{Daemon, Target, Way, path_of},
    commands::param::{diff::Comparison, file::Backup, source::Source},
    failure::Failure,
};

/// Why nothing is asked of a drive that is away.
const SILENT: &str = "the drive did not answer";
/// Why the parameters were not asked for.
pub(super) const LEFT_OUT: &str = "left out, as was asked";

/// What was read.
#[derive(Debug)]
pub(super) struct Gathered {
    /// The state of the plant at the end of the reading.
    pub(super) state: Value,
    /// The lines on which the drives are, each with what was measured on it.
    pub(super) lines: Vec<Told>,
    pub(super) drives: Vec<DriveTold>,
    /// What happened lately.
    pub(super) events: Told,
}

/// An answer, or why there is none.
pub(super) type Told = Result<Value, String>;

/// What was read of one drive.
#[derive(Debug)]
pub(super) struct DriveTold {
    /// As the API has it.
    pub(super) view: Value,
    pub(super) family: Result<Family, String>,
    pub(super) settings: Told,
    pub(super) faults: Told,
    pub(super) parameters: Result<Compared, String>,
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
            let drives = wanted.iter().filter(|drive| drive["line"] == **line);
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
            let now = state["drives"].as_array().into_iter().flatten();
            if let Some(now) = now.into_iter().find(|now| now["name"] == drive.view["name"]) {
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
    drives: impl Iterator<Item = &Value>,
    with_parameters: bool,
) -> Result<Vec<DriveTold>, Failure> {
    let mut daemon = way.connect().await?;
    let mut told = Vec::new();
    for view in drives {
        let name = view["name"].as_str().unwrap_or_default();
        let settings = ask(&mut daemon, &["drives", name, "settings"]).await;
        let is_there = view["status"]["quality"] == "good";
        let (faults, parameters) = match (is_there, with_parameters) {
            (false, _) => (Err(SILENT.to_owned()), Err(SILENT.to_owned())),
            (true, false) => (ask(&mut daemon, &["drives", name, "faults"]).await, Err(LEFT_OUT.to_owned())),
            (true, true) => (
                ask(&mut daemon, &["drives", name, "faults"]).await,
                compared(way.connect().await?, view).await,
            ),
        };
        let family = view["family"].as_str().unwrap_or_default();
        let family = family.parse().map_err(|error| drive_families::UnknownFamily::to_string(&error));
        told.push(DriveTold { view: view.clone(), family, settings, faults, parameters });
    }
    Ok(told)
}

impl DriveTold {
    /// Reads the faults of a drive again that has tripped, or was reset, since they were read.
    async fn ask_again(&mut self, daemon: &mut Daemon) {
        let is_present =
            |faults: &Value| faults["present"].as_array().is_some_and(|present| !present.is_empty());
        let is_known =
            self.faults.as_ref().is_ok_and(|faults| is_present(faults) == self.view["fault"].is_object());
        if self.view["status"]["quality"] == "good" && !is_known {
            let name = self.view["name"].as_str().unwrap_or_default();
            self.faults = ask(daemon, &["drives", name, "faults"]).await;
        }
    }
}

/// The drives that these names mean, line by line.
fn wanted<'a>(state: &'a Value, names: &[String]) -> Result<Vec<&'a Value>, Failure> {
    let drives = || state["drives"].as_array().into_iter().flatten();
    if names.is_empty() {
        return Ok(drives().collect());
    }
    let mut targets = Vec::new();
    for name in names {
        match Target::find(state, name) {
            Ok(target) => targets.push(Ok(target)),
            Err(_) if drives().any(|drive| drive["line"] == **name) => targets.push(Err(name)),
            Err(failure) => return Err(failure),
        }
    }
    let is_wanted = |drive: &&Value| {
        targets.iter().any(|target| match target {
            Ok(target) => drive["name"].as_str().is_some_and(|name| target.has(state, name)),
            Err(line) => drive["line"] == ***line,
        })
    };
    Ok(drives().filter(is_wanted).collect())
}

/// The lines of drives, each once.
fn lines_of(drives: &[&Value]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for line in drives.iter().filter_map(|drive| drive["line"].as_str()) {
        if !lines.iter().any(|known| known == line) {
            lines.push(line.to_owned());
        }
    }
    lines
}

async fn ask(daemon: &mut Daemon, parts: &[&str]) -> Told {
    let answer = daemon.get(&path_of(parts)).await.and_then(crate::client::Answer::done);
    answer.map_err(|failure| failure.to_string())
}

/// Reads the parameters of a drive and compares them with its factory setting.
async fn compared(daemon: Daemon, view: &Value) -> Result<Compared, String> {
    let mut source = Source::OfDaemon { daemon: Box::new(daemon), view: view.clone() };
    let held = source.keep().await.map_err(|failure| failure.to_string())?;
    match held.nothing_read() {
        Some(why) => Err(why),
        None => {
            let factory = Comparison::of(&held, &Backup::of_factory(held.head.family), true);
            Ok(Compared { held, factory })
        }
    }
}
