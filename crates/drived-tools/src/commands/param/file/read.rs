//! Reading a backup. It may come from anywhere: whatever is wrong with it is one line with its place.

use std::{collections::BTreeMap, fs, io::Read as _, ops::Range, path::Path};

use drive_core::{
    Row,
    registers::{Place, Space},
};
use drive_families::{Family, UnknownFamily};
use serde::Deserialize;
use toml::Spanned;

use super::{Backup, Entry, Head, is_kept};
use drived_config::config::Source;
use drived_words::failure::Failure;

/// A family has a few hundred registers, and a line for each.
const LARGEST: u64 = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    drive: HeadText,
    #[serde(default)]
    rating: BTreeMap<String, Spanned<Line>>,
    parameters: BTreeMap<String, Spanned<Line>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HeadText {
    family: Spanned<String>,
    slave: u8,
    name: String,
    line: String,
    vendor: Option<String>,
    model: Option<String>,
    firmware: Option<String>,
    date: String,
}

/// What stands behind a mnemonic. Access and factory setting are there for whoever reads the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    value: Option<String>,
    raw: Option<u16>,
    error: Option<String>,
    address: Option<u16>,
    space: Option<Space>,
    #[serde(rename = "factory")]
    _factory: Option<String>,
    #[serde(rename = "access")]
    _access: Option<String>,
}

impl Backup {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let failed = |why: String| Failure::Input(format!("{}: {why}", path.display()));
        let mut bytes = Vec::new();
        let file = fs::File::open(path).map_err(|error| failed(error.to_string()))?;
        file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|error| failed(error.to_string()))?;
        if bytes.len() as u64 > LARGEST {
            return Err(failed("it is larger than any backup of parameters, 1 MiB".to_owned()));
        }
        // The first block of pcapng, or the number of a pcap in one of its two orders and two resolutions.
        let is_capture = [
            &[0x0A, 0x0D, 0x0D, 0x0A],
            &[0xA1, 0xB2, 0xC3, 0xD4],
            &[0xD4, 0xC3, 0xB2, 0xA1],
            &[0xA1, 0xB2, 0x3C, 0x4D],
            &[0x4D, 0x3C, 0xB2, 0xA1],
        ]
        .iter()
        .any(|first: &&[u8; 4]| bytes.starts_with(*first));
        let text = String::from_utf8(bytes).map_err(|_| match is_capture {
            true => failed(
                "it is a capture and no backup: drived explain reads it, drived param backup makes a backup"
                    .to_owned(),
            ),
            false => failed("it is no text in UTF-8: drived param backup makes a backup".to_owned()),
        })?;
        Self::parse(path, &text)
    }

    /// The same for its text.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Failure> {
        let place = Source { file: path, text };
        let wrong = |at: Range<usize>, why: String| Failure::Input(place.error(at, why).to_string());
        let read: Text = toml::from_str(text).map_err(|error| {
            let why = error.message().lines().next().unwrap_or_default().to_owned();
            match error.span() {
                Some(at) => wrong(at, why),
                None => Failure::Input(place.error_of_file(why).to_string()),
            }
        })?;
        let HeadText { family, slave, name, line, vendor, model, firmware, date } = read.drive;
        let known = family.get_ref().parse::<Family>();
        let family = known.map_err(|error| wrong(family.span(), UnknownFamily::to_string(&error)))?;
        let rows = family.capabilities().rows;

        let mut lines: BTreeMap<Place, &Spanned<Line>> = BTreeMap::new();
        for (code, line) in read.rating.iter().chain(&read.parameters) {
            let row = rows.iter().find(|row| row.code == code).filter(|row| is_kept(family, row));
            let Some(row) = row else {
                return Err(wrong(line.span(), format!("the family {family} keeps no parameter {code:?}")));
            };
            if line.get_ref().address.is_some_and(|address| address != row.address) {
                return Err(wrong(line.span(), format!("{code} has the address {}", row.address)));
            }
            if line.get_ref().space.unwrap_or(Space::HoldingRegister) != row.space {
                return Err(wrong(line.span(), format!("{code} is a {}", row.space)));
            }
            if lines.insert(row.place(), line).is_some() {
                return Err(wrong(line.span(), format!("{code} stands there twice")));
            }
        }
        let head = Head { name, family, line, slave, vendor, model, firmware, date };
        let mut backup = Self { head, entries: Vec::new() };
        // First what chooses the unit of others.
        let (mut scaled, mut held) = (Vec::new(), BTreeMap::new());
        for row in rows {
            let Some(line) = lines.get(&row.place()) else { continue };
            if family.capabilities().scaled_by(row.address).is_some() {
                scaled.push((row, line));
            } else {
                let word = line.get_ref().held(row).map_err(|why| wrong(line.span(), why))?;
                held.insert(row.place(), word);
            }
        }
        for (row, line) in scaled {
            let known = |address: u16| held.get(&address.into()).and_then(|word| word.as_ref().ok()).copied();
            let by = family.capabilities().scaled_by(row.address).filter(|by| known(by.address).is_none());
            if let (Some(by), None) = (by, &line.get_ref().error) {
                let why = format!("{} has its unit by {}, which the file does not have", row.code, by.code);
                return Err(wrong(line.span(), why));
            }
            let in_units = family.capabilities().in_units(row, known);
            let word = line.get_ref().held(&in_units).map_err(|why| wrong(line.span(), why))?;
            held.insert(row.place(), word);
        }
        let entry = |row: &'static Row| held.remove(&row.place()).map(|held| Entry { row, held });
        backup.entries = rows.iter().filter_map(entry).collect();
        Ok(backup)
    }
}

impl Line {
    /// What it says of its register, whose row is in the unit that counts here.
    fn held(&self, row: &Row) -> Result<Result<u16, String>, String> {
        let code = row.code;
        let word = match (&self.value, self.raw, &self.error) {
            (None, None, Some(why)) => return Ok(Err(why.clone())),
            (_, _, Some(_)) => return Err(format!("{code} has an error and a value: one of them is wrong")),
            (None, None, None) => return Err(format!("{code} has neither a value nor a raw word")),
            (None, Some(raw), None) => raw,
            (Some(value), Some(raw), None) if *value == super::brief(row, raw) => raw,
            (Some(value), raw, None) => {
                let word = row
                    .read(value)
                    .ok_or_else(|| format!("{code}: {value:?} is no value of it: {}", span(row)))?;
                if raw.is_some_and(|raw| raw != word) {
                    return Err(format!(
                        "{code}: the value {value:?} and the raw word do not agree: take one of them out"
                    ));
                }
                word
            }
        };
        Ok(Ok(word))
    }
}

fn span(row: &Row) -> String {
    match drived_words::registers::range(row) {
        range if range.is_empty() => "expected a number in its unit or a hexadecimal word".to_owned(),
        range => format!("expected {range}"),
    }
}
