//! `drived check`: what a configuration means.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use drive_fleet::DriveSettings;
use serde_json::{Map, Value, json};

use drived_config::config::{DrivePart, LinePart, drive_keys};
use drived_face::Meaning;
use drived_file::{Config, added::Added};
use drived_words::{
    drive_spec::{self, DriveName},
    failure::Failure,
    line_spec,
    output::{self, JsonArgs, Table},
};

/// Validate a configuration without opening a port, and show what it means for each drive
///
/// What its lines will be like is the answer of `drived plan --config FILE`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    #[command(flatten)]
    json: JsonArgs,
}

/// How long the end may take behind the exit of the drives.
const CLOSING: Duration = Duration::from_secs(10);
/// `TimeoutStopSec` of the packaged unit.
const PACKAGED: Duration = Duration::from_secs(90);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    // A file that is there is what a daemon begins with: it may have no drive yet, where they can be added at the page.
    let config = match args.config.exists() {
        true => Config::load_to_begin(&args.config, None)?,
        false => Config::load_workable(&args.config)?,
    };
    for (_, face) in &config.faces {
        // What it needs is read as the daemon would.
        face.check()?;
    }
    args.json.say(|| object(&args.config, &config), || tell(&args.config, &config))
}

/// What it means, for a program: labels and texts are those that a person reads.
fn object(file: &Path, config: &Config) -> Value {
    let texts = |texts: Vec<(&str, String)>| {
        texts.into_iter().map(|(label, text)| (label.to_owned(), text.into())).collect::<Map<String, Value>>()
    };
    let drive = |drive: &DrivePart| {
        json!({
            "drive": drive.name.to_string(),
            "name": drive.settings.name,
            "control": drive.settings.control,
            "meaning": texts(meaning(drive)),
        })
    };
    let line = |line: &LinePart| {
        let drives: Vec<Value> = line.drives.iter().map(drive).collect();
        json!({ "name": line.name, "port": line.config.to_string(), "drives": drives })
    };
    let mut object = json!({
        "config": file,
        "lines": config.lines.iter().map(line).collect::<Vec<_>>(),
        "doubts": config.doubts(),
        "state": config.doors.state.folder,
        "timeout_stop_s": (config.shutdown + CLOSING).as_secs(),
    });
    if let Some(added) = config.added.as_ref().filter(|added| added.text.is_some()) {
        object["added"] = json!({ "file": added.file, "holds": !added.is_aside });
    }
    for (key, meaning) in config.faces.iter().flat_map(|(_, face)| face.object()) {
        object[key] = meaning;
    }
    object
}

fn tell(file: &Path, config: &Config) -> Result<(), Failure> {
    for LinePart { name, config, drives, .. } in &config.lines {
        let controlled = drives.iter().filter(|drive| drive.settings.control).count();
        output::say(format_args!(
            "line {name}: {}, {controlled} under control, on {}",
            output::counted(drives.len(), "drive", "drives"),
            line_spec::describe(config)
        ))?;
        for (names, first) in alike(drives) {
            output::say(format_args!("  {}", drive_spec::listed(&names)))?;
            let mut table = Table::texts();
            for (label, text) in meaning(first) {
                table.row([format!("    {label}"), text]);
            }
            output::say_table(table)?;
        }
    }
    for Meaning { head, rows } in config.faces.iter().flat_map(|(_, face)| face.meaning()) {
        output::say(head)?;
        let mut table = Table::texts();
        for (label, text) in rows {
            table.row([format!("    {label}"), text]);
        }
        output::say_table(table)?;
    }
    if let Some(folder) = &config.doors.state.folder {
        let audit = if config.doors.state.audit.is_some() { "" } else { "; no audit log is kept" };
        output::say(format_args!("kept in {}{audit}", folder.display()))?;
    }
    for text in config.added.iter().filter_map(|added| added_text(file, config, added)) {
        output::say(text)?;
    }
    for doubt in config.doubts() {
        output::say(format_args!("DOUBTFUL: {doubt}"))?;
    }
    let needed = config.shutdown + CLOSING;
    output::say(format_args!(
        "as a service it needs TimeoutStopSec={}s: shutdown is {:?}, and the lines are closed after it{}",
        needed.as_secs(),
        config.shutdown,
        match needed > PACKAGED {
            true =>
                "; THE PACKAGED UNIT HAS LESS: systemctl edit drived, or motors are left to their watchdogs",
            false => "",
        }
    ))?;
    if config.lines.is_empty() {
        return output::say(format_args!(
            "{} has no drive: drived begins with it, and nothing is watched",
            file.display()
        ));
    }
    output::say(format_args!(
        "{} is a configuration that can work; drived plan --config {0} calculates its lines",
        file.display()
    ))
}

/// Which of the two files with drives holds.
fn added_text(file: &Path, config: &Config, added: &Added) -> Option<String> {
    let (name, theirs) = (file.display(), added.file.display());
    match (added.aside(file), &added.text) {
        (Some(aside), _) => Some(format!("NOT READ: {aside}")),
        (None, _) if config.lines.is_empty() => {
            Some(format!("no drive yet: those that are added at the page are written to {theirs}"))
        }
        (None, Some(_)) if !added.is_aside => {
            Some(format!("the drives are those of {theirs}, added at the page: {name} has none of its own"))
        }
        _ => None,
    }
}

/// Drives with the same settings, and the first of them.
fn alike(drives: &[DrivePart]) -> Vec<(Vec<(DriveName, String)>, &DrivePart)> {
    let mut all: Vec<(Vec<(DriveName, String)>, &DrivePart)> = Vec::new();
    for drive in drives {
        let member = (drive.name, drive.settings.name.clone());
        match all.iter_mut().find(|(_, first)| is_alike(first, drive)) {
            Some((names, _)) => names.push(member),
            None => all.push((vec![member], drive)),
        }
    }
    all
}

/// Whether two drives differ in their names and addresses only.
fn is_alike(one: &DrivePart, other: &DrivePart) -> bool {
    let renamed = DriveSettings { name: one.settings.name.clone(), ..other.settings.clone() };
    one.name.family == other.name.family && one.options == other.options && one.settings == renamed
}

/// What the settings and options of a drive mean, each with its label.
fn meaning(drive: &DrivePart) -> Vec<(&'static str, String)> {
    let told =
        drive_keys().iter().filter(|key| drive.settings.control || !key.acts).flat_map(|key| key.tells);
    told.filter_map(|tells| Some((tells.label, (tells.text)(drive)?))).collect()
}
