//! The configuration file: lines, drives, periods, policies.
//!
//! Read in two steps: the keys one by one, as their tables declare them ([`drived_config::config`]), then seen together, against the families and against the
//! arithmetic of the lines. Whatever is wrong is told with its file, line and field.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod added;
mod checks;
mod file;
pub mod ledger;

use std::{collections::BTreeMap, path::Path, time::Duration};

use serde::Deserialize as _;
use toml::{
    Spanned,
    de::{DeTable, Deserializer},
};

use self::{added::Added, file::File};
pub use self::{checks::is_one_wire, file::without};
use drived_config::config::{
    ConfigError, DriveEntry, Entry as _, Environment, Group, Key, LineEntries, LineEntry, LinePart, Members,
    NO_DRIVE, Source, State, groups, line_part, look_alikes, of,
};
use drived_config::profiles::{Folder, ProfilesError};
use drived_doors::{
    certificate_doubt,
    config::{DoorsConfig, Http},
};
use drived_face::{Configured, Site, Written};
use drived_words::failure::Failure;

/// The configuration of whoever names none.
const USUAL: &str = "drives.toml";

/// The tables of the file whose keys are declared, each with its head: those of the daemon itself, and those of the faces that the
/// program knows.
pub fn tables() -> Vec<(String, Vec<&'static Key>)> {
    let faces = drived_face::all();
    let own = [("`[lines.NAME]`", LineEntry::KEYS), ("`[[drives]]`", DriveEntry::KEYS)];
    let top = File::KEYS.iter().chain(faces.iter().map(|face| face.row()));
    let mut tables = vec![("Top level".to_owned(), top.collect())];
    tables.extend(own.map(|(head, keys)| (head.to_owned(), keys.iter().collect())));
    let declared = faces.iter().filter(|face| !face.keys().is_empty());
    tables.extend(declared.map(|face| (format!("`{}`", face.row().name), face.keys().iter().collect())));
    tables
}

/// A configuration whose fields are right. Whether its lines can work is another question: see [`Self::workable`].
#[derive(Debug)]
pub struct Config {
    /// How often a snapshot of every drive is printed; zero: never.
    pub snapshots: Duration,
    /// How long the exit may take.
    pub shutdown: Duration,
    /// Who may come in, and by which door.
    pub doors: DoorsConfig,
    pub lines: Vec<LinePart>,
    pub groups: Vec<Group>,
    /// What is left out of the folder of profiles, and why. No drive here needs it.
    pub left_out: Vec<ProfilesError>,
    /// Where drives are added at the page; `None`: there is no folder for it.
    pub added: Option<Added>,
    /// The faces that have a table, and those that are there without one, by its name, in the order in which the program knows them.
    pub faces: Vec<(&'static str, Box<dyn Configured>)>,
}

impl Config {
    /// Reads a file. The usual one need not be there where drives are added at the page.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        match checks::read_file(file) {
            Ok(text) => Self::read(file, &text),
            Err(why) => {
                let config = Self::load_or_empty(file)?;
                match config.lines.is_empty() {
                    true => {
                        Err(Source { file, text: "" }.error_of_file(format_args!("cannot be read: {why}")))
                    }
                    false => Ok(config),
                }
            }
        }
    }

    /// Reads a file that may have no drive yet. The usual one need not be there; whoever names another means it.
    pub fn load_or_empty(file: &Path) -> Result<Self, ConfigError> {
        match checks::read_file(file) {
            Ok(text) => Self::parse(file, &text, None),
            Err(_) if is_missing(file) => Self::parse(file, "", None),
            Err(why) => Err(Source { file, text: "" }.error_of_file(format_args!("cannot be read: {why}"))),
        }
    }

    /// The same, whose lines can work: what a daemon begins with, which has drives or a page at which they are added. `http` is said
    /// beside the file.
    pub fn load_to_begin(file: &Path, http: Option<Http>) -> Result<Self, Failure> {
        let read = Self::load_or_empty(file).and_then(Self::workable);
        let config = read.map_err(|error| Failure::Input(error.to_string()))?;
        let has_page = http.map_or(config.doors.http.is_some(), |http| http != Http::Off);
        match config.lines.is_empty() && !(has_page && config.added.is_some()) {
            true => {
                let none = if has_page { "no folder in which they are kept" } else { "no page" };
                let problem = format_args!("{NO_DRIVE}, and there is {none}, to add some there");
                Err(Failure::Input(Source { file, text: "" }.error_of_file(problem).to_string()))
            }
            false => Ok(config),
        }
    }

    /// The same, with other drives added at the page than those that stand there.
    pub fn load_with(file: &Path, added: &str) -> Result<Self, Failure> {
        let text = match checks::read_file(file) {
            Ok(text) => text,
            Err(_) if is_missing(file) => String::new(),
            Err(why) => return Err(Failure::Input(format!("{}: cannot be read: {why}", file.display()))),
        };
        let read = Self::parse(file, &text, Some(added)).and_then(Self::workable);
        read.map_err(|error| Failure::Input(error.to_string()))
    }

    /// Reads a file whose lines can work.
    pub fn load_workable(file: &Path) -> Result<Self, Failure> {
        Self::load(file).and_then(Self::workable).map_err(|error| Failure::Input(error.to_string()))
    }

    /// Reads the text of a file with drives.
    fn read(file: &Path, text: &str) -> Result<Self, ConfigError> {
        let config = Self::parse(file, text, None)?;
        if config.lines.is_empty() {
            return Err(Source { file, text }.error_of_file(NO_DRIVE));
        }
        Ok(config)
    }

    /// `instead` is read in the place of the file of what is added at the page.
    fn parse(file: &Path, text: &str, instead: Option<&str>) -> Result<Self, ConfigError> {
        let source = Source { file, text };
        let wrong = |error| checks::refused(source, &error);
        let mut tables = DeTable::parse(text).map_err(wrong)?;
        // What is a face's is read by it, when the rest is known; what is left is the daemon's own, and has to be known.
        let mut written = Vec::new();
        for face in drived_face::all() {
            let of_face = tables.get_mut().remove(face.table());
            written.push((face, of_face.map(|value| Written::new(source, value))));
        }
        file::not_built_in(source, tables.get_ref())?;
        // The names of drives are read by it.
        let profiles = profiles_of(source, &tables)?;
        let raw = File::deserialize(Deserializer::from(tables)).map_err(wrong)?;
        let mut said = file::Draft::default();
        raw.set(source, &mut said)?;
        let file::Draft { snapshots, shutdown, kept } = said;
        let state = State::of(source, &kept, &Environment::of_process());
        let added = checks::added(&state, raw.has_plant(), instead)?;
        let lines = match added.as_ref().and_then(|added| Some((added, added.text.as_deref()?))) {
            Some((Added { file, is_aside: false, .. }, text)) => {
                let source = Source { file, text };
                plant_of(source, &checks::only_plant(source)?, &profiles)?
            }
            _ => plant_of(source, &raw, &profiles)?,
        };
        let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
        let names = drives.map(|drive| drive.settings.name.as_str());
        let groups = groups(source, of(&raw.groups), names)?;
        let site = Site::new(&lines, &groups, &state);
        let mut faces = Vec::new();
        for (face, written) in written {
            let configured = match written {
                Some(written) => Some(face.configure(written, &site)?),
                None => face.unsaid(&site),
            };
            faces.extend(configured.map(|configured| (face.table(), configured)));
        }
        let doors = DoorsConfig::read(source, of(&raw.http), of(&raw.socket), state)?;
        Ok(Self {
            doors,
            faces,
            snapshots,
            shutdown,
            lines,
            groups,
            left_out: profiles.left_out().to_vec(),
            added,
        })
    }

    /// What the file says of the face with this table; `None`: nothing.
    pub fn face(&self, table: &str) -> Option<&dyn Configured> {
        self.faces.iter().find(|(name, _)| *name == table).map(|(_, face)| &**face)
    }

    /// What is left out of the folder of profiles, and names that somebody may take for others.
    pub fn doubts(&self) -> Vec<String> {
        let left_out = self.left_out.iter().map(|why| format!("a profile is left out: {why}"));
        let tls = self.doors.http.as_ref().and_then(|http| http.tls.as_ref());
        left_out.chain(self.doubtful_names()).chain(tls.and_then(certificate_doubt)).collect()
    }

    /// Names that somebody may take for others.
    fn doubtful_names(&self) -> Vec<String> {
        self.names()
            .into_iter()
            .flat_map(|(kind, names)| look_alikes::doubts(kind, names.into_iter()))
            .collect()
    }

    /// What is doubtful in another configuration that comes after this one, and would not be without its new names.
    pub fn new_doubt(&self, new: &Self) -> Option<String> {
        let known = self.names();
        let of_kind = |kind| known.get(kind).map_or(&[][..], Vec::as_slice);
        let lived_with = new.names().into_iter().flat_map(|(kind, names)| {
            look_alikes::doubts(kind, names.into_iter().filter(|name| of_kind(kind).contains(name)))
        });
        let lived_with: Vec<String> = lived_with.collect();
        new.doubtful_names().into_iter().find(|doubt| !lived_with.contains(doubt))
    }

    /// The names of each kind: those of drives and groups stand beside each other.
    fn names(&self) -> BTreeMap<&'static str, Vec<&str>> {
        let drives =
            self.lines.iter().flat_map(|line| &line.drives).map(|drive| drive.settings.name.as_str());
        let groups = self.groups.iter().map(|group| group.name.as_str());
        let own = [
            ("line", self.lines.iter().map(|line| line.name.as_str()).collect()),
            ("drive or group", drives.chain(groups).collect()),
        ];
        own.into_iter().chain(self.faces.iter().filter_map(|(_, face)| face.names())).collect()
    }

    /// The same, if every line can work.
    fn workable(mut self) -> Result<Self, ConfigError> {
        match self.lines.iter_mut().find_map(|line| line.problem.take()) {
            Some(problem) => Err(problem),
            None => Ok(self),
        }
    }
}

/// Whether it is the usual one, and not there.
fn is_missing(file: &Path) -> bool {
    file == Path::new(USUAL) && !file.exists()
}

/// The lines and drives that a file says.
fn plant_of(source: Source<'_>, raw: &File, profiles: &Folder) -> Result<Vec<LinePart>, ConfigError> {
    let none = LineEntries::new();
    let members = Members::of(
        source,
        of(&raw.lines).unwrap_or(&none),
        of(&raw.drives).map_or(&[], Vec::as_slice),
        of(&raw.defaults),
    )?;
    checks::profiles(source, raw, profiles)?;
    let mut lines = Vec::new();
    for (name, entry) in raw.lines() {
        lines.push(line_part(source, name.get_ref(), name.span(), entry, &members)?);
    }
    checks::ports(source, raw, &lines)?;
    Ok(lines)
}

/// The drives from files that the configuration may name.
fn profiles_of(source: Source<'_>, tables: &Spanned<DeTable<'_>>) -> Result<Folder, ConfigError> {
    let Some((key, value)) = tables.get_ref().get_key_value("profiles") else { return Ok(Folder::default()) };
    // What is no text is refused with the other keys.
    let Some(folder) = value.get_ref().as_str() else { return Ok(Folder::default()) };
    let folder = source.file.parent().unwrap_or(Path::new("")).join(folder);
    Folder::read(&folder).map_err(|error| source.error(key.span(), error))
}

#[cfg(test)]
mod tests;
