//! What the configuration file is made of: how a key is declared ([`table`]) and read ([`values`]), where it stands ([`place`]), and
//! its tables of lines, drives and groups. Each face has its own table; the file as a whole is `drived-file`.

mod described;
mod drive;
mod groups;
mod line;
pub mod look_alikes;
mod place;
mod state;
mod table;
pub mod values;

use drive_bus::LineConfig;
use drive_families::Options;
use drive_fleet::{Demand, DriveSettings, FleetBuilder, Left, LineBudget, Place};
use toml::Spanned;

pub use self::line::ROOM_PPM;
use self::line::demand;
pub use self::{
    drive::DriveEntry,
    groups::{Entries as GroupEntries, Group, groups},
    line::{LineEntries, LineEntry, Members, NO_DRIVE, line_part},
    place::{ConfigError, Source},
    state::{Environment, Said as SaidState, State},
    table::{Entry, Key, Said, Tells, settings, shown, within},
    values::{NotAmong, Parsed, words},
};
use drived_words::drive_spec::DriveName;

/// The keys of a drive.
pub fn drive_keys() -> &'static [Key] {
    drive::DriveEntry::KEYS
}

/// The places of the drives of these lines, by their names.
pub fn places(lines: &[LinePart]) -> impl Iterator<Item = (&str, Place)> {
    lines.iter().flat_map(|line| {
        line.drives.iter().map(move |drive| (drive.settings.name.as_str(), line.place(drive.name)))
    })
}

/// A line and its drives.
#[derive(Debug)]
pub struct LinePart {
    pub name: String,
    pub config: LineConfig,
    pub budget: LineBudget,
    pub drives: Vec<DrivePart>,
    /// Why the line cannot work, with the arithmetic.
    pub problem: Option<ConfigError>,
}

/// A drive of a line.
#[derive(Debug)]
pub struct DrivePart {
    pub name: DriveName,
    pub settings: DriveSettings,
    pub options: Options,
    /// Its number, where the file says it.
    pub slot: Option<u16>,
    /// Whether its family is a guess.
    pub is_guess: bool,
}

impl LinePart {
    /// Which machine a drive of it is, as the fleet knows it.
    pub fn place(&self, drive: DriveName) -> Place {
        Place::of(&self.name, &self.config.endpoint, drive.family.capabilities().key, drive.slave)
    }

    /// What its drives want of it.
    pub fn demands(&self) -> Vec<Demand> {
        let protocol = self.config.protocol;
        self.drives
            .iter()
            .map(|drive| demand(drive.name, &drive.settings, &drive.options, protocol))
            .collect()
    }
}

/// What a table of the file has, if there is one.
pub fn of<T>(said: &Option<Spanned<T>>) -> Option<&T> {
    said.as_ref().map(Spanned::get_ref)
}

/// Adds a drive of a line, of which a run before has left this.
pub fn add(builder: FleetBuilder, line: &LinePart, drive: &DrivePart, left: Left) -> FleetBuilder {
    let DrivePart { name, settings, options, .. } = drive;
    let settings = settings.clone().after(left);
    builder.drive(&line.name, name.slave.number(), settings, |port, slave| {
        name.family.open_with(port, slave, options)
    })
}
