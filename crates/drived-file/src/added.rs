//! The drives that are added at the page: a file of the state folder with lines and drives alone, which the daemon may write and a
//! person can read and change. It holds as long as the configuration has no line and no drive of its own.

use std::{
    fmt::Write as _,
    ops::Range,
    path::{Path, PathBuf},
};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use drived_config::kept::{Kept, Readers};
use drived_words::{drive_spec::DriveName, line_spec::LineSpec};

/// The file of the state folder.
pub const FILE: &str = "added.toml";

/// Where drives are added, and whether those that stand there hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Added {
    pub file: PathBuf,
    /// The configuration has lines or drives of its own: it alone holds.
    pub is_aside: bool,
    /// What stands in it; `None`: there is none.
    pub text: Option<String>,
}

impl Added {
    /// What is said where its drives do not hold although they are there; `None`: they do, or there are none.
    pub fn aside(&self, configuration: &Path) -> Option<String> {
        let Self { file, is_aside, text } = self;
        (*is_aside && text.is_some()).then(|| {
            format!(
                "the drives of {} do not hold: {} has drives of its own, and then it alone does",
                file.display(),
                configuration.display()
            )
        })
    }

    /// Replaces the file in one step.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, text: &str) -> std::io::Result<()> {
        Kept::at(&self.file).replace(text.as_bytes(), Readers::Others)
    }
}

impl Added {
    /// Makes the file what it was; `None`: there was none.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn put_back(&self, text: Option<&str>) -> std::io::Result<()> {
        match text {
            Some(text) => self.write(text),
            None => std::fs::remove_file(&self.file),
        }
    }
}

/// A drive that is added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewDrive {
    pub drive: DriveName,
    pub name: String,
    /// Whether it has said itself what it is.
    pub is_certain: bool,
}

/// The text with a line, unless it has this one already, and these drives on it, which are only read.
///
/// # Errors
/// It has a line of this name that goes elsewhere, or there with other settings: the drives would be others than those found.
pub fn with_drives(
    text: Option<&str>,
    (line, port): (&str, &str),
    drives: &[NewDrive],
) -> Result<String, String> {
    let mut text = text.map_or_else(|| HEAD.to_owned(), str::to_owned);
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    match port_of(&text, line) {
        None => {
            let _ = write!(text, "\n[lines.{}]\nport = {}\n", quoted(line), quoted(port));
        }
        Some(there) if is_same(&there, port) => {}
        Some(there) => {
            return Err(format!(
                "line {line:?} is there already and goes to {there}: these drives answer at {port}; give their line another name"
            ));
        }
    }
    let line = quoted(line);
    for NewDrive { drive, name, is_certain } in drives {
        let (known, guessed) = match is_certain {
            true => ("By its own words.", ""),
            false => {
                ("A GUESS: see its nameplate, and take the mark away where it is right.", "guessed = true\n")
            }
        };
        let _ = write!(
            text,
            "\n# {known}\n[[drives]]\nline = {line}\ndrive = {}\n{guessed}name = {}\n# true: commands may be given to it, and its policies act.\n\
             control = false\n",
            quoted(&drive.to_string()),
            quoted(name)
        );
    }
    Ok(text)
}

/// Whether two ports are one, with the same settings, however they are written.
fn is_same(one: &str, other: &str) -> bool {
    one.parse::<LineSpec>().is_ok_and(|one| other.parse() == Ok(one))
}

/// Where a line of the text goes; empty: it does not say so by itself.
fn port_of(text: &str, line: &str) -> Option<String> {
    let tables = DeTable::parse(text).ok()?;
    let table = tables.get_ref().get("lines")?.get_ref().as_table()?.get(line)?.get_ref().as_table();
    Some(table.and_then(|table| text_of(table.get("port")?)).unwrap_or_default().to_owned())
}

/// The text with another word for whether a drive takes commands; everything else stays as it stands. `None`: no entry of the file is
/// of this drive alone.
pub fn with_control(text: &str, name: &str, control: bool) -> Option<String> {
    let tables = DeTable::parse(text).ok()?;
    let drives = tables.get_ref().get("drives")?.get_ref().as_array()?;
    let entry = drives.iter().find_map(|drive| {
        let table = drive.get_ref().as_table()?;
        (text_of(table.get("name")?) == Some(name)).then_some(table)
    })?;
    let (at, new): (Range<usize>, String) = match entry.get("control") {
        Some(said) => (said.span(), control.to_string()),
        None => {
            let end = entry.get("name")?.span().end;
            (end..end, format!("\ncontrol = {control}"))
        }
    };
    let mut text = text.to_owned();
    text.replace_range(at, &new);
    Some(text)
}

fn text_of<'a>(value: &'a Spanned<DeValue<'_>>) -> Option<&'a str> {
    value.get_ref().as_str()
}

/// What stands above all.
const HEAD: &str = "# Drives that were added at the page of drived. A person may change this file: drived reload reads it again.\n\
    # It holds as long as the configuration that drived was started with has no [lines] and no [[drives]] of its own.\n";

/// A text as a value or a key of TOML.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(address: u8, name: &str) -> NewDrive {
        let spec: drived_words::drive_spec::DriveSpec = format!("atv312@{address}").parse().unwrap();
        NewDrive { drive: spec.single().unwrap(), name: name.to_owned(), is_certain: address == 1 }
    }

    #[test]
    fn what_is_added_is_only_read_and_stands_below_what_was_there() {
        let line = ("hall \"2\"", "/dev/ttyUSB0,19200,8E1");
        let first = with_drives(None, line, &[drive(1, "pump")]).unwrap();
        assert!(
            first.starts_with("# Drives that were added at the page") && first.contains("By its own words.")
        );
        let both = with_drives(Some(&first), line, &[drive(2, "Lüfter = 2")]).unwrap();
        assert!(both.starts_with(&first) && both.contains("A GUESS"), "{both}");
        let read: toml::Table = both.parse().unwrap();
        assert_eq!(read["lines"].as_table().unwrap().len(), 1);
        assert_eq!(read["lines"]["hall \"2\""]["port"].as_str(), Some("/dev/ttyUSB0,19200,8E1"));
        let drives = read["drives"].as_array().unwrap();
        assert_eq!(drives[1]["name"].as_str(), Some("Lüfter = 2"));
        assert_eq!(drives[1]["drive"].as_str(), Some("atv312@2"));
        assert!(drives.iter().all(|drive| drive["control"].as_bool() == Some(false)));
        let guessed = drives.iter().map(|drive| drive.get("guessed").and_then(toml::Value::as_bool));
        assert_eq!(guessed.collect::<Vec<_>>(), [None, Some(true)], "one has said itself what it is");
    }

    #[test]
    fn a_drive_is_never_added_to_another_line_than_that_on_which_it_was_found() {
        let (a, b) = ("/dev/ttyUSB0,19200,8E1", "/dev/ttyUSB1,19200,8E1");
        let first = with_drives(None, ("main", a), &[drive(1, "pump")]).unwrap();
        for elsewhere in [b, "/dev/ttyUSB0,9600,8E1"] {
            let why = with_drives(Some(&first), ("main", elsewhere), &[drive(2, "fan")]).unwrap_err();
            assert!(why.contains(a) && why.contains("another name"), "{why}");
        }
        let two = with_drives(Some(&first), ("hall", b), &[drive(2, "fan")]).unwrap();
        assert!(with_drives(Some(&two), ("main", a), &[drive(3, "mixer")]).is_ok());
    }

    #[test]
    fn control_of_one_drive_changes_one_word_and_nothing_of_what_a_person_has_written() {
        let text = "# mine\n[lines.a]\nport = \"/dev/ttyUSB0\"\n[[drives]]\nname = \"one\"  # the first\nline = \"a\"\n\
            drive = \"atv312@1\"\ncontrol = false # for now\n[[drives]]\nline=\"a\"\ndrive=\"atv312@2\"\nname=\"two\"\n";
        let taken = with_control(text, "one", true).unwrap();
        assert_eq!(taken, text.replace("control = false # for now", "control = true # for now"));
        assert_eq!(with_control(&taken, "one", false).as_deref(), Some(text));
        let other = with_control(text, "two", true).unwrap();
        assert_eq!(other, text.replace("name=\"two\"\n", "name=\"two\"\ncontrol = true\n"));
        assert_eq!(with_control(text, "three", true), None);
    }
}
