//! The file of the audit log: appended to, synchronised, rotated. Several programs may append; each takes the lock and goes
//! on from what stands there.

use std::{
    fs,
    io::{self, Read as _, Seek as _, SeekFrom, Write as _},
    path::Path,
};

use super::{Line, Record, unix_ms};
use crate::{
    doors::tokens::sha256,
    kept::{Kept, is_at},
};

/// A file of this size is put aside.
const LARGEST: u64 = 8 * 1024 * 1024;
/// Files that are kept beside the one that is written.
pub(super) const KEPT: u32 = 20;
/// What stands where there is no line before.
pub(super) const FIRST: &str = "0000000000000000000000000000000000000000000000000000000000000000";

pub(super) struct File {
    kept: Kept,
    largest: u64,
}

impl File {
    /// The file at a path, made if there is none.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let kept = Kept::at(path);
        kept.open_to_append().map(|_| Self { kept, largest: LARGEST })
    }

    /// Appends a record and waits until the disk has it. What was written of a record that failed is taken back.
    pub(super) fn append(&mut self, record: &Record) -> io::Result<()> {
        let mut file = self.locked()?;
        if file.metadata()?.len() >= self.largest {
            self.rotate()?;
            file = self.locked()?;
        }
        let length = file.metadata()?.len();
        let last = last_line(&mut file)?;
        // A line that was torn by a crash stays, and stays in the chain.
        let mut line =
            if last.as_ref().is_some_and(|last| !last.is_whole) { "\n".to_owned() } else { String::new() };
        let before = match last {
            None => match aside(&self.kept, 1).open()? {
                Some(mut aside) => last_line(&mut aside)?,
                None => None,
            },
            last => last,
        };
        let previous = before.map_or_else(|| FIRST.to_owned(), |last| sha256(&last.bytes));
        line.push_str(&crate::json::line(&Line { time_unix_ms: unix_ms(), record, previous: &previous }));
        line.push('\n');
        let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
        if written.is_err() {
            // A record is there whole or not at all. Where even this fails, the next program finds a torn line.
            let _ = file.set_len(length);
        }
        written
    }

    /// The file that stands at the path when its lock has been taken.
    fn locked(&self) -> io::Result<fs::File> {
        loop {
            let file = self.kept.open_to_append()?;
            file.lock()?;
            if is_at(&file, &self.kept)? {
                return Ok(file);
            }
        }
    }

    fn rotate(&self) -> io::Result<()> {
        for number in (1..KEPT).rev() {
            aside(&self.kept, number).rename(&aside(&self.kept, number + 1))?;
        }
        self.kept.rename(&aside(&self.kept, 1)).map(drop)
    }
}

/// A file that was put aside; 1 is the newest.
pub(super) fn aside(log: &Kept, number: u32) -> Kept {
    log.beside(&format!(".{number}"))
}

/// The last line of a file.
struct Last {
    /// Without its line end.
    bytes: Vec<u8>,
    is_whole: bool,
}

/// Nothing where the file is empty.
fn last_line(file: &mut fs::File) -> io::Result<Option<Last>> {
    let length = file.metadata()?.len();
    let mut tail = Vec::new();
    let mut reach = 4_096;
    loop {
        let start = length.saturating_sub(reach);
        file.seek(SeekFrom::Start(start))?;
        tail.clear();
        io::Read::by_ref(file).take(length - start).read_to_end(&mut tail)?;
        let is_whole = tail.last() == Some(&b'\n');
        if is_whole {
            tail.pop();
        }
        if let Some(newline) = tail.iter().rposition(|byte| *byte == b'\n') {
            return Ok(Some(Last { bytes: tail.split_off(newline + 1), is_whole }));
        }
        if start == 0 {
            return Ok((length > 0).then_some(Last { bytes: tail, is_whole }));
        }
        reach *= 2;
    }
}

#[cfg(test)]
mod tests {
    use std::{fs::OpenOptions, path::PathBuf};

    use super::*;
    use crate::doors::{
        audit::{Kind, Verdict, verify},
        rights::{Caller, Rights},
        tests::Folder,
    };

    fn record(what: &str) -> Record {
        let caller =
            Caller { name: "panel".to_owned(), origin: "http 10.0.0.7".to_owned(), rights: Rights::ALL };
        Record::new(Kind::Command, &caller, what)
    }

    fn aside(path: &Path, number: u32) -> PathBuf {
        super::aside(&Kept::at(path), number).path().to_owned()
    }

    fn lines(path: &Path) -> Vec<String> {
        fs::read_to_string(path).unwrap().lines().map(str::to_owned).collect()
    }

    #[test]
    fn each_line_has_the_hash_of_the_one_before_whoever_writes_it() {
        let folder = Folder::new("chain");
        let path = folder.file("audit");
        let mut one = File::open(&path).unwrap();
        let mut other = File::open(&path).unwrap();
        one.append(&record("first\nline \u{1b}[2J")).unwrap();
        other.append(&record("second")).unwrap();
        one.append(&record("third")).unwrap();
        let lines = lines(&path);
        let previous =
            |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["previous"].clone();
        assert_eq!(previous(&lines[0]), FIRST);
        // By somebody else's program: printf %s LINE | sha256sum.
        assert_eq!(previous(&lines[1]), sha256(lines[0].as_bytes()));
        assert_eq!(previous(&lines[2]), sha256(lines[1].as_bytes()));
        assert!(!lines[0].contains('\u{1b}'), "{}", lines[0]);
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 3, torn: 0, .. }));
    }

    #[test]
    fn the_chain_goes_on_over_the_rotation() {
        let folder = Folder::new("rotation");
        let path = folder.file("audit");
        let mut file = File { largest: 1_000, ..File::open(&path).unwrap() };
        for number in 0..40 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        assert!(aside(&path, 2).exists() && lines(&path).len() < 10);
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 40, .. }));
        for number in 0..400 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        assert!(aside(&path, KEPT).exists() && !aside(&path, KEPT + 1).exists());
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { .. }), "the oldest were removed");
        fs::remove_file(aside(&path, 3)).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Broken { .. }), "one in between was removed");
    }

    #[test]
    fn a_line_that_was_changed_added_or_taken_out_is_found() {
        let folder = Folder::new("tampered");
        let path = folder.file("audit");
        let mut file = File::open(&path).unwrap();
        for number in 0..10 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        let whole = fs::read_to_string(&path).unwrap();
        let without: Vec<&str> =
            whole.lines().enumerate().filter(|(line, _)| *line != 4).map(|(_, line)| line).collect();
        for tampered in [
            whole.replace("command 4", "command 5"),
            without.join("\n") + "\n",
            whole.replacen('\n', "\n{}\n", 1),
        ] {
            fs::write(&path, tampered).unwrap();
            let verdict = verify(&path).unwrap();
            assert!(matches!(verdict, Verdict::Broken { .. }), "{verdict:?}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn no_link_in_its_folder_is_followed() {
        let folder = Folder::new("audit-links");
        let (path, elsewhere) = (folder.file("audit"), folder.file("elsewhere"));
        std::os::unix::fs::symlink(&elsewhere, &path).unwrap();
        assert!(File::open(&path).is_err());
        assert!(!elsewhere.exists(), "nothing was made behind the link");
    }

    #[test]
    fn a_line_that_a_crash_has_torn_stays_in_the_chain() {
        let folder = Folder::new("torn");
        let path = folder.file("audit");
        File::open(&path).unwrap().append(&record("first")).unwrap();
        OpenOptions::new().append(true).open(&path).unwrap().write_all(b"{\"time_unix_ms\":17").unwrap();
        File::open(&path).unwrap().append(&record("second")).unwrap();
        let verdict = verify(&path).unwrap();
        assert!(matches!(verdict, Verdict::Unbroken { records: 2, torn: 1, .. }), "{verdict:?}");
        fs::write(&path, fs::read_to_string(&path).unwrap().replace(":17\n", ":18\n")).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Broken { .. }));
    }
}
