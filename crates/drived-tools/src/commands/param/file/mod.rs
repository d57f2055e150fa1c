//! What a drive held, as a text file that a version control understands: one line per register, in the order of the map.

mod read;
mod write;

use drive_core::{
    Row,
    registers::{NoFactory, Part, Place},
};
use drive_families::Family;

use drived_words::registers::brief;

/// What the registers of a drive held at a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Backup {
    pub head: Head,
    /// Its settings and its ratings, in the order of the family's map.
    pub entries: Vec<Entry>,
}

/// Whose parameters they are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Head {
    /// The name that its owner gave the drive.
    pub name: String,
    pub family: Family,
    pub line: String,
    pub slave: u8,
    pub vendor: Option<String>,
    pub model: Option<String>,
    pub firmware: Option<String>,
    /// When it was read, by the clock of whoever read it.
    pub date: String,
}

/// One register.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    pub row: &'static Row,
    /// Its word, or why it could not be read.
    pub held: Result<u16, String>,
}

/// Whether a backup has a line for a register.
pub fn is_kept(family: Family, row: &Row) -> bool {
    family.capabilities().restoring.part(row) != Part::Passing
}

impl Backup {
    /// The word of a register, if it was read.
    pub fn word(&self, place: impl Into<Place>) -> Option<u16> {
        let place = place.into();
        let entry = self.entries.iter().find(|entry| entry.row.place() == place)?;
        entry.held.as_ref().ok().copied()
    }

    /// Why it holds nothing at all, if it does not.
    pub fn nothing_read(&self) -> Option<String> {
        let why = self.entries.iter().find_map(|entry| entry.held.as_ref().err());
        let why = why.map_or("its family has no parameters", String::as_str);
        let is_empty = self.entries.iter().all(|entry| entry.held.is_err());
        is_empty.then(|| format!("nothing could be read: {why}"))
    }

    /// How many registers could not be read.
    pub fn unread(&self) -> usize {
        self.entries.iter().filter(|entry| entry.held.is_err()).count()
    }

    /// A row in the unit that it had in this drive.
    pub fn row(&self, row: &Row) -> Row {
        self.head.family.capabilities().in_units(row, |address| self.word(address))
    }

    /// A word of this drive as a person reads it.
    pub fn text(&self, row: &Row, word: u16) -> String {
        brief(&self.row(row), word)
    }

    /// What the manual prints as factory setting for a drive that holds this: what depends on another register, as `bFr` or the
    /// rating, by what that drive has there.
    pub fn of_factory(side: &Self) -> Self {
        let family = side.head.family;
        let capabilities = family.capabilities();
        let is_setting = |row: &&Row| is_kept(family, row) && row.access.is_writable();
        let entries = capabilities.rows.iter().filter(is_setting).map(|row| {
            let words = row.factory.words(|address| side.word(address));
            // Of two to which a share may be rounded it is the one that the drive has.
            let word = |[low, high]: [u16; 2]| match side.word(row.place()) {
                Some(held) if held == low || held == high => held,
                _ => high,
            };
            Entry { row, held: words.map(word).map_err(|why| no_factory(side, why)) }
        });
        let head = Head {
            name: "factory".to_owned(),
            family,
            line: String::new(),
            slave: 0,
            vendor: None,
            model: None,
            firmware: None,
            date: String::new(),
        };
        Self { head, entries: entries.collect() }
    }
}

/// Why there is no factory setting to compare with, in words.
fn no_factory(side: &Backup, why: NoFactory) -> String {
    let row =
        |address: u16| side.head.family.capabilities().rows.iter().find(|row| row.place() == address.into());
    let code = |address: u16| row(address).map_or("another register", |row| row.code);
    match why {
        NoFactory::NotPrinted => "the manual prints no factory setting".to_owned(),
        NoFactory::Rule(rule) => format!("the manual has a rule: {rule}"),
        NoFactory::Unknown(by) => format!("it depends on {}, which is not known", code(by)),
        NoFactory::NoneFor(by, held) => {
            let held = row(by).map_or_else(|| held.to_string(), |row| side.text(row, held));
            format!("the manual prints no factory setting with {} {held}", code(by))
        }
        _ => "it has no number as factory setting".to_owned(),
    }
}

#[cfg(test)]
mod tests;
