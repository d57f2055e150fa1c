//! What the configuration file is made of: how a key is declared ([`table`]) and read ([`values`]), where it stands ([`place`]), and
//! its tables of lines, drives and groups. Each face has its own table; the file as a whole is [`crate::config_file`].

mod described;
mod drive;
mod groups;
mod line;
mod place;
mod state;
mod table;
mod values;

use std::collections::BTreeMap;

use drive_bus::LineConfig;
use drive_families::Options;
use drive_fleet::{Demand, DriveSettings, LineBudget};
use toml::Spanned;

#[cfg(test)]
pub(crate) use self::line::ROOM_PPM;
use self::line::demand;
pub(crate) use self::{
    drive::DriveEntry,
    groups::{Entries as GroupEntries, Group, groups},
    line::{LineEntries, LineEntry, Members, line_part},
    place::{ConfigError, Source},
    state::{Environment, Said as SaidState, State},
    table::{Entry, Key, Said, Tells, settings, shown, within},
    values::{NotAmong, Parsed, words},
};
use crate::drive_spec::DriveName;

/// The keys of a drive.
pub(crate) fn drive_keys() -> &'static [Key] {
    drive::DriveEntry::KEYS
}

/// A line and its drives.
#[derive(Debug)]
pub(crate) struct LinePart {
    pub(crate) name: String,
    pub(crate) config: LineConfig,
    pub(crate) budget: LineBudget,
    pub(crate) drives: Vec<DrivePart>,
    /// Why the line cannot work, with the arithmetic.
    pub(crate) problem: Option<ConfigError>,
}

/// A drive of a line.
#[derive(Debug)]
pub(crate) struct DrivePart {
    pub(crate) name: DriveName,
    pub(crate) settings: DriveSettings,
    pub(crate) options: SaidOptions,
}

/// The options of a drive, and the texts by which the file says them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SaidOptions {
    pub(crate) values: Options,
    pub(crate) texts: BTreeMap<&'static str, String>,
}

impl LinePart {
    /// What its drives want of it.
    pub(crate) fn demands(&self) -> Vec<Demand> {
        let protocol = self.config.protocol;
        self.drives
            .iter()
            .map(|drive| demand(drive.name, &drive.settings, &drive.options, protocol))
            .collect()
    }
}

/// What a table of the file has, if there is one.
pub(crate) fn of<T>(said: &Option<Spanned<T>>) -> Option<&T> {
    said.as_ref().map(Spanned::get_ref)
}
