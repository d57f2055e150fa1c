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

mod checks;
mod file;
pub mod ledger;

use std::{path::Path, time::Duration};

use self::file::File;
use drived_broker::broker::config::{MqttConfig, SparkplugConfig};
use drived_config::config::{
    ConfigError, DriveEntry, Entry as _, Environment, Group, Key, LineEntries, LineEntry, LinePart, Members,
    Source, State, groups, line_part, look_alikes, of,
};
use drived_doors::config::DoorsConfig;
use drived_gateway::config::{GatewayConfig, GatewayEntry, gateways};
use drived_words::failure::Failure;

/// The tables of the file whose keys are declared, each with its head.
pub fn tables() -> [(&'static str, &'static [Key]); 4] {
    [
        ("Top level", File::KEYS),
        ("`[lines.NAME]`", LineEntry::KEYS),
        ("`[[drives]]`", DriveEntry::KEYS),
        ("`[[gateways]]`", GatewayEntry::KEYS),
    ]
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
    pub gateways: Vec<GatewayConfig>,
    /// The broker to which everything is told; `None`: nothing is.
    pub mqtt: Option<MqttConfig>,
    /// The edge node that the daemon is on the same brokers.
    pub sparkplug: Option<SparkplugConfig>,
}

impl Config {
    /// Reads a file.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        match checks::read_file(file) {
            Ok(text) => Self::read(file, &text),
            Err(why) => Err(Source { file, text: "" }.error_of_file(format_args!("cannot be read: {why}"))),
        }
    }

    /// Reads a file whose lines can work.
    pub fn load_workable(file: &Path) -> Result<Self, Failure> {
        Self::load(file).and_then(Self::workable).map_err(|error| Failure::Input(error.to_string()))
    }

    /// Reads the text of a file.
    fn read(file: &Path, text: &str) -> Result<Self, ConfigError> {
        let source = Source { file, text };
        let raw: File = toml::from_str(text).map_err(|error| match error.span() {
            Some(span) => source.error(span, error.message()),
            None => source.error_of_file(error.message()),
        })?;
        let mut said = file::Draft::default();
        raw.set(source, &mut said)?;
        let file::Draft { snapshots, shutdown, kept } = said;
        let state = State::of(source, &kept, &Environment::of_process());
        let none = LineEntries::new();
        let members = Members::of(
            source,
            of(&raw.lines).unwrap_or(&none),
            of(&raw.drives).map_or(&[], Vec::as_slice),
            of(&raw.defaults),
        )?;
        let mut lines = Vec::new();
        for (name, entry) in raw.lines() {
            lines.push(line_part(source, name.get_ref(), name.span(), entry, &members)?);
        }
        checks::ports(source, &raw, &lines)?;
        let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
        let names = drives.map(|drive| drive.settings.name.as_str());
        let groups = groups(source, of(&raw.groups), names)?;
        let broker = of(&raw.mqtt);
        let mqtt = broker.map(|entry| MqttConfig::read(source, entry));
        let sparkplug = broker.and_then(|entry| entry.sparkplug.as_ref()).map(|entry| {
            let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
            let drives = drives.map(|drive| drive.settings.name.as_str());
            let lines = lines.iter().map(|line| line.name.as_str());
            SparkplugConfig::read(source, entry, drives, lines, &state)
        });
        let doors = DoorsConfig::read(source, of(&raw.http), of(&raw.socket), state)?;
        let gateways = gateways(source, of(&raw.gateways).map_or(&[], Vec::as_slice), &lines)?;
        Ok(Self {
            doors,
            gateways,
            snapshots,
            shutdown,
            lines,
            groups,
            mqtt: mqtt.transpose()?,
            sparkplug: sparkplug.transpose()?,
        })
    }

    /// Names that somebody may take for others.
    pub fn doubts(&self) -> Vec<String> {
        self.names()
            .into_iter()
            .flat_map(|(kind, names)| look_alikes::doubts(kind, names.into_iter()))
            .collect()
    }

    /// What is doubtful in another configuration that comes after this one, and would not be without its new names.
    pub fn new_doubt(&self, new: &Self) -> Option<String> {
        let lived_with = self.names().into_iter().zip(new.names()).flat_map(|((_, mine), (kind, names))| {
            look_alikes::doubts(kind, names.into_iter().filter(|name| mine.contains(name)))
        });
        let lived_with: Vec<String> = lived_with.collect();
        new.doubts().into_iter().find(|doubt| !lived_with.contains(doubt))
    }

    /// The names of each kind: those of drives and groups stand beside each other.
    fn names(&self) -> [(&'static str, Vec<&str>); 3] {
        let drives =
            self.lines.iter().flat_map(|line| &line.drives).map(|drive| drive.settings.name.as_str());
        [
            ("line", self.lines.iter().map(|line| line.name.as_str()).collect()),
            ("drive or group", drives.chain(self.groups.iter().map(|group| group.name.as_str())).collect()),
            ("gateway", self.gateways.iter().map(|gateway| gateway.name.as_str()).collect()),
        ]
    }

    /// The same, if every line can work.
    fn workable(mut self) -> Result<Self, ConfigError> {
        match self.lines.iter_mut().find_map(|line| line.problem.take()) {
            Some(problem) => Err(problem),
            None => Ok(self),
        }
    }
}

#[cfg(test)]
mod tests;
