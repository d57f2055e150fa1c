//! The file of a report: whether it can be written is found out before anything is read, and nothing is written over unless that is
//! asked for.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use drived_words::failure::Failure;

/// A file that is written when the report is there. What is not finished is taken away again.
#[derive(Debug)]
pub(super) struct Sheet {
    to: PathBuf,
    /// Where it is written until it is whole.
    new: PathBuf,
    file: File,
    overwrite: bool,
}

impl Sheet {
    /// Makes sure that it can be written.
    pub(super) fn begin(to: &Path, overwrite: bool) -> Result<Self, Failure> {
        let refused = |why: String| Failure::Input(format!("{}: {why}; nothing was read", to.display()));
        let Some(name) = to.file_name().filter(|_| !to.is_dir()) else {
            return Err(refused("it is a folder: name a file in it, such as report.html".to_owned()));
        };
        if !overwrite && fs::symlink_metadata(to).is_ok() {
            return Err(refused(THERE.to_owned()));
        }
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(".new");
        let new = to.with_file_name(hidden);
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(&new);
        let file = file.map_err(|error| refused(format!("it cannot be written: {error}")))?;
        Ok(Self { to: to.to_owned(), new, file, overwrite })
    }

    /// Writes it, whole or not at all.
    pub(super) fn write(mut self, text: &str) -> Result<(), Failure> {
        let failed = |to: &Path, error: &io::Error| match error.kind() {
            io::ErrorKind::AlreadyExists => Failure::Input(format!("{}: {THERE}", to.display())),
            _ => Failure::Input(format!("{}: {error}", to.display())),
        };
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_all());
        written.and_then(|()| self.settle()).map_err(|error| failed(&self.to, &error))
    }

    /// Gives it its name. A link is made only where nothing has that name; a disk that knows none is asked before.
    fn settle(&self) -> io::Result<()> {
        if self.overwrite {
            return fs::rename(&self.new, &self.to);
        }
        match fs::hard_link(&self.new, &self.to) {
            Err(error)
                if error.kind() != io::ErrorKind::AlreadyExists
                    && fs::symlink_metadata(&self.to).is_err() =>
            {
                fs::rename(&self.new, &self.to)
            }
            settled => settled,
        }
    }
}

impl Drop for Sheet {
    fn drop(&mut self) {
        // It may have its name already.
        let _ = fs::remove_file(&self.new);
    }
}

const THERE: &str = "it is there already and is not written over: give it another name, or say --overwrite";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_written_over_nothing_unless_that_is_asked_for_and_leaves_nothing_behind() {
        let folder = std::env::temp_dir().join(format!("drived-sheet-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let to = folder.join("report.html");
        let left = || {
            let names = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name());
            names.collect::<Vec<_>>()
        };
        drop(Sheet::begin(&to, false).unwrap());
        assert!(left().is_empty(), "given up: {:?}", left());
        Sheet::begin(&to, false).unwrap().write("one").unwrap();
        assert_eq!((fs::read_to_string(&to).unwrap().as_str(), left().len()), ("one", 1));
        let why = Sheet::begin(&to, false).unwrap_err().to_string();
        assert!(why.contains("--overwrite") && why.contains("nothing was read"), "{why}");
        Sheet::begin(&to, true).unwrap().write("two").unwrap();
        assert_eq!((fs::read_to_string(&to).unwrap().as_str(), left().len()), ("two", 1));
        // Somebody else writes it meanwhile.
        let other = folder.join("other.html");
        let sheet = Sheet::begin(&other, false).unwrap();
        fs::write(&other, "his").unwrap();
        assert!(sheet.write("mine").is_err());
        assert_eq!(fs::read_to_string(&other).unwrap(), "his");
        for impossible in [folder.clone(), folder.join("missing/report.html")] {
            assert!(Sheet::begin(&impossible, true).is_err(), "{}", impossible.display());
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
