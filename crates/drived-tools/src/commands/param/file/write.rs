//! Writing a backup.

use std::{
    fmt::{self, Write as _},
    fs, io,
    path::Path,
};

use drive_core::registers::{Part, Space};

use super::{Backup, Entry};
use drived_config::kept::{Kept, Readers};
use drived_words::{failure::Failure, registers::factory};

/// How a backup begins. Only a file that begins so is overwritten by the next one.
pub(super) const FIRST_LINE: &str = "# The parameters of a drive, kept by drived param backup.";

const HINTS: &str = "# drived param diff compares it, drived param restore writes it back. Whoever changes a value takes its raw word out.";

impl fmt::Display for Backup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = &self.head;
        writeln!(f, "{FIRST_LINE}\n{HINTS}\n\n[drive]")?;
        let texts = [
            ("name", Some(&head.name)),
            ("line", Some(&head.line)),
            ("vendor", head.vendor.as_ref()),
            ("model", head.model.as_ref()),
            ("firmware", head.firmware.as_ref()),
            ("date", Some(&head.date)),
        ];
        writeln!(f, "family = {}\nslave = {}", quoted(&head.family.to_string()), head.slave)?;
        for (key, text) in texts {
            if let Some(text) = text {
                writeln!(f, "{key} = {}", quoted(text))?;
            }
        }
        let restoring = head.family.capabilities().restoring;
        let is_rating = |entry: &&Entry| restoring.part(entry.row) == Part::Rating;
        writeln!(f, "\n[rating]")?;
        self.entries.iter().filter(is_rating).try_for_each(|entry| self.line(f, entry))?;
        writeln!(f, "\n[parameters]")?;
        self.entries.iter().filter(|entry| !is_rating(entry)).try_for_each(|entry| self.line(f, entry))
    }
}

impl Backup {
    fn line(&self, f: &mut fmt::Formatter<'_>, Entry { row, held }: &Entry) -> fmt::Result {
        write!(f, "{} = {{ ", key(row.code))?;
        match held {
            Ok(word) => write!(f, "value = {}, raw = {word}", quoted(&self.text(row, *word)))?,
            Err(why) => write!(f, "error = {}", quoted(why))?,
        }
        let factory = factory(self.head.family.capabilities(), row);
        if !factory.is_empty() {
            write!(f, ", factory = {}", quoted(&factory))?;
        }
        if row.space != Space::HoldingRegister {
            write!(f, ", space = {}", quoted(&row.space.to_string().replace(' ', "_")))?;
        }
        writeln!(f, ", access = {}, address = {} }}", quoted(&row.access.to_string()), row.address)
    }

    /// Writes it to a file, whole or not at all. A file that is no backup is not overwritten.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let failed = |error: &io::Error| Failure::Input(format!("{}: {error}", path.display()));
        match fs::read(path) {
            Ok(old) if old.starts_with(FIRST_LINE.as_bytes()) => {}
            Ok(_) => {
                return Err(Failure::Input(format!(
                    "{} is there and is no backup of parameters: it is not overwritten",
                    path.display()
                )));
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(failed(&error)),
        }
        let written = Kept::at(path).replace(self.to_string().as_bytes(), Readers::Others);
        written.map_err(|error| failed(&error))
    }
}

/// A mnemonic as a key.
fn key(code: &str) -> String {
    let is_bare = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
    if code.bytes().all(is_bare) { code.to_owned() } else { quoted(code) }
}

/// A text between quotation marks, on one line whatever is in it.
fn quoted(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            // Writing into a String does not fail.
            _ if character.is_control() => drop(write!(quoted, "\\u{:04X}", u32::from(character))),
            _ => quoted.push(character),
        }
    }
    quoted.push('"');
    quoted
}
