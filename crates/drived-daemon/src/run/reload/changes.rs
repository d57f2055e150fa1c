//! What is different between two configurations: a pure comparison.

use std::{collections::BTreeMap, fmt};

use drive_bus::LineConfig;
use drive_fleet::{DriveSettings, Fleet};

use drived_config::config::{DrivePart, LinePart};
use drived_doors::config::HttpConfig;
use drived_file::Config;

/// What a reload does, in the order in which it is told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Change {
    LineAdded(String),
    LineRemoved(String),
    /// Its port or its times are others: it is closed and opened anew.
    LineChanged(String),
    DriveAdded(String),
    DriveRemoved(String),
    /// Its line, address, family or options are others, or it comes under control no more: it ends by its policy and begins
    /// anew.
    DriveExchanged(String, &'static str),
    /// Its settings are others.
    DriveChanged(Box<DriveSettings>),
    /// It is called otherwise, which is the old name: by these settings. It is the same drive at the same place.
    DriveRenamed(String, Box<DriveSettings>),
    /// The file of its profile says something else: the drive goes on by what it was opened with.
    ProfileLater(String),
    Groups,
    /// It has a table that it did not have.
    FaceOpened(&'static str),
    FaceClosed(&'static str),
    /// Its table says something else: it is closed and opened anew.
    FaceChanged(&'static str),
    /// Whoever connects from now on is served by another certificate.
    Certificate,
    /// It holds from the next start on.
    Later(&'static str),
}

impl Change {
    /// Whether it opens this line.
    pub(super) fn opens(&self, line: &str) -> bool {
        matches!(self, Self::LineAdded(name) | Self::LineChanged(name) if name == line)
    }

    pub(super) fn closed_line(&self) -> Option<&str> {
        match self {
            Self::LineRemoved(name) | Self::LineChanged(name) => Some(name),
            _ => None,
        }
    }

    pub(super) fn removed_drive(&self) -> Option<&str> {
        match self {
            Self::DriveRemoved(name) | Self::DriveExchanged(name, _) => Some(name),
            _ => None,
        }
    }

    pub(super) fn added_drive(&self) -> Option<&str> {
        match self {
            Self::DriveAdded(name) | Self::DriveExchanged(name, _) => Some(name),
            _ => None,
        }
    }

    pub(super) fn settings(&self) -> Option<&DriveSettings> {
        match self {
            Self::DriveChanged(settings) => Some(settings),
            _ => None,
        }
    }

    /// The old name, and the settings with the new one.
    pub(super) fn renamed(&self) -> Option<(&str, &DriveSettings)> {
        match self {
            Self::DriveRenamed(old, settings) => Some((old, settings)),
            _ => None,
        }
    }

    pub(super) fn opened_face(&self) -> Option<&str> {
        match self {
            Self::FaceOpened(table) | Self::FaceChanged(table) => Some(table),
            _ => None,
        }
    }

    pub(super) fn closed_face(&self) -> Option<&str> {
        match self {
            Self::FaceClosed(table) | Self::FaceChanged(table) => Some(table),
            _ => None,
        }
    }

    /// Whether it comes to hold by a reload.
    pub(super) const fn is_now(&self) -> bool {
        !matches!(self, Self::Later(_) | Self::ProfileLater(_))
    }

    /// What has become of it where nothing could be added: lines and drives that had to go are gone.
    pub(super) fn half(&self) -> Option<String> {
        Some(match self {
            Self::LineAdded(name) => format!("line {name} NOT added"),
            Self::LineChanged(name) => format!("line {name} closed and NOT opened anew"),
            Self::DriveAdded(name) => format!("{name} NOT added"),
            Self::DriveExchanged(name, _) => {
                format!("{name} ended by its policy of the exit and NOT begun anew")
            }
            Self::DriveChanged(settings) => format!("{} goes on with its OLD settings", settings.name),
            Self::DriveRenamed(old, settings) => {
                format!("{old} is NOT called {}, and goes on as it was", settings.name)
            }
            Self::LineRemoved(_)
            | Self::DriveRemoved(_)
            | Self::Groups
            | Self::FaceOpened(_)
            | Self::FaceClosed(_)
            | Self::FaceChanged(_)
            | Self::Certificate => self.to_string(),
            Self::ProfileLater(_) | Self::Later(_) => return None,
        })
    }

    /// What it would be, with what the drive does now where it ends by its policy.
    pub(super) fn would_be(&self, fleet: &Fleet) -> String {
        let drive = self.removed_drive().and_then(|name| fleet.drive(name));
        let status = drive.and_then(|drive| drive.snapshot().status.clone());
        match status {
            Some(status) if !status.value.is_undriven() => format!("{self}: it shows {}", status.value),
            _ => self.to_string(),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LineAdded(name) => write!(f, "line {name} added"),
            Self::LineRemoved(name) => write!(f, "line {name} removed"),
            Self::LineChanged(name) => write!(f, "line {name} closed and opened anew"),
            Self::DriveAdded(name) => write!(f, "{name} added"),
            Self::DriveRemoved(name) => write!(f, "{name} removed, by its policy of the exit"),
            Self::DriveExchanged(name, why) => {
                write!(f, "{name} ended by its policy of the exit and begun anew, because {why}")
            }
            Self::DriveChanged(settings) => write!(f, "{} has other settings and goes on", settings.name),
            Self::DriveRenamed(old, settings) => {
                write!(f, "{old} is called {} now, and goes on", settings.name)
            }
            Self::ProfileLater(name) => write!(f, "the profile of {name}: from the next start on"),
            Self::Groups => write!(f, "groups changed"),
            Self::FaceOpened(table) => write!(f, "{table} opened"),
            Self::FaceClosed(table) => write!(f, "{table} closed"),
            Self::FaceChanged(table) => write!(f, "{table} closed and opened anew"),
            Self::Certificate => write!(f, "the certificate of [http] renewed"),
            Self::Later(what) => write!(f, "{what}: from the next start on"),
        }
    }
}

/// What is different.
pub(super) fn changes(old: &Config, new: &Config) -> Vec<Change> {
    let mut changes = Vec::new();
    let line = |config: &'_ Config, name: &str| config.lines.iter().position(|line| line.name == name);
    for part in &old.lines {
        match line(new, &part.name).and_then(|at| new.lines.get(at)) {
            None => changes.push(Change::LineRemoved(part.name.clone())),
            Some(other) if is_other(&part.config, &other.config) => {
                changes.push(Change::LineChanged(part.name.clone()));
            }
            Some(_) => {}
        }
    }
    let added = new.lines.iter().filter(|part| line(old, &part.name).is_none());
    changes.extend(added.map(|part| Change::LineAdded(part.name.clone())));
    let (before, after) = (drives(old), drives(new));
    let renamed = renamed(&before, &after, &changes);
    for (name, (line, drive)) in &before {
        let Some((other_line, other)) = after.get(name) else {
            let Some(other) = renamed.get(name) else {
                changes.push(Change::DriveRemoved((*name).to_owned()));
                continue;
            };
            changes.push(Change::DriveRenamed((*name).to_owned(), Box::new(other.settings.clone())));
            if drive.name.family.revision() != other.name.family.revision() {
                changes.push(Change::ProfileLater(other.settings.name.clone()));
            }
            continue;
        };
        let exchanged = match () {
            () if line.name != other_line.name => Some("it is on another line"),
            () if changes.iter().any(|change| change.closed_line() == Some(&line.name)) => {
                Some("its line has changed")
            }
            () if drive.name != other.name => Some("its family or address has changed"),
            () if drive.options != other.options => Some("its options have changed"),
            () if drive.settings.control && !other.settings.control => Some("it is only read from now on"),
            () => None,
        };
        match exchanged {
            Some(why) => changes.push(Change::DriveExchanged((*name).to_owned(), why)),
            None if drive.settings != other.settings => {
                changes.push(Change::DriveChanged(Box::new(other.settings.clone())));
            }
            None => {}
        }
        let revisions = [drive, other].map(|drive| drive.name.family.revision());
        if exchanged.is_none() && revisions[0] != revisions[1] {
            changes.push(Change::ProfileLater((*name).to_owned()));
        }
    }
    let is_renamed = |name: &str| renamed.values().any(|other| other.settings.name == name);
    let added = after.keys().filter(|name| !before.contains_key(*name) && !is_renamed(name));
    changes.extend(added.map(|name| Change::DriveAdded((*name).to_owned())));
    let budgets = |config: &Config| -> BTreeMap<String, _> {
        config.lines.iter().map(|line| (line.name.clone(), line.budget)).collect()
    };
    let (planned, kept) = (budgets(new), budgets(old));
    changes.extend((old.groups != new.groups).then_some(Change::Groups));
    for (table, face) in &old.faces {
        match new.face(table) {
            None => changes.push(Change::FaceClosed(table)),
            Some(other) if !face.is_same(other) => changes.push(Change::FaceChanged(table)),
            Some(_) => {}
        }
    }
    let opened = new.faces.iter().filter(|(table, _)| old.face(table).is_none());
    changes.extend(opened.map(|(table, _)| Change::FaceOpened(table)));
    for (is_other, what) in [
        (old.snapshots != new.snapshots, "snapshots"),
        (old.shutdown != new.shutdown, "shutdown"),
        (is_other_server(old.doors.http.as_ref(), new.doors.http.as_ref()), "[http]"),
        (old.doors.socket != new.doors.socket, "[socket]"),
        (old.doors.state.watchdogs != new.doors.state.watchdogs, "another file of watchdogs"),
        (old.doors.state.tokens != new.doors.state.tokens, "another file of tokens"),
        (old.doors.state.audit != new.doors.state.audit, "another audit log"),
        (
            kept.iter().any(|(name, budget)| planned.get(name).is_some_and(|other| other != budget)),
            "response and segments of lines",
        ),
    ] {
        changes.extend(is_other.then_some(Change::Later(what)));
    }
    changes
}

/// Who is called otherwise, by the old names: the same family at the same address of a line that stays, of which nothing has changed for
/// which a drive ends and begins anew. Both names mean no other drive, before and after.
fn renamed<'a>(
    before: &BTreeMap<&'a str, (&LinePart, &DrivePart)>,
    after: &BTreeMap<&str, (&LinePart, &'a DrivePart)>,
    changes: &[Change],
) -> BTreeMap<&'a str, &'a DrivePart> {
    let gone = before.iter().filter(|(name, _)| !after.contains_key(*name));
    let stays =
        gone.filter(|(_, (line, _))| !changes.iter().any(|change| change.closed_line() == Some(&line.name)));
    let now = |(name, (line, drive)): (&&'a str, &(&LinePart, &DrivePart))| {
        let new = after.iter().filter(|(name, _)| !before.contains_key(*name));
        let mut same = new.filter(|(_, (other_line, other))| {
            line.name == other_line.name
                && drive.name == other.name
                && drive.options == other.options
                && (other.settings.control || !drive.settings.control)
        });
        same.next().map(|(_, (_, other))| (*name, *other))
    };
    stays.filter_map(now).collect()
}

/// Whether the page is to be served otherwise than by another certificate, which is taken now.
fn is_other_server(old: Option<&HttpConfig>, new: Option<&HttpConfig>) -> bool {
    match (old, new) {
        (Some(old), Some(new)) if old.tls.is_some() && new.tls.is_some() => {
            *old != HttpConfig { tls: old.tls.clone(), ..new.clone() }
        }
        _ => old != new,
    }
}

/// Whether a line has to be opened anew. The pauses of its drives come and go with them.
fn is_other(old: &LineConfig, new: &LineConfig) -> bool {
    let bare = |config: &LineConfig| LineConfig { slaves: BTreeMap::new(), ..config.clone() };
    bare(old) != bare(new)
}

fn drives(config: &Config) -> BTreeMap<&str, (&LinePart, &DrivePart)> {
    let on = |line| move |drive| (line, drive);
    let all = config.lines.iter().flat_map(|line| line.drives.iter().map(on(line)));
    all.map(|(line, drive): (&LinePart, &DrivePart)| (drive.settings.name.as_str(), (line, drive))).collect()
}
