//! The file of the audit log: appended to, synchronised, rotated. Several programs may append; each takes the lock and goes
//! on from what stands there.

use std::{
    fs,
    io::{self, BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _},
    path::Path,
};

use serde::{Deserialize, Serialize};

use super::{Line, Record, seal::Key, unix_ms};
use drived_config::kept::{Kept, is_at, sha256};

/// A file of this size is put aside.
const LARGEST: u64 = 8 * 1024 * 1024;
/// The same of the file of what was refused.
const LARGEST_REFUSED: u64 = 1024 * 1024;
/// Files that are kept beside the one that is written.
pub(super) const KEPT: u32 = 20;
/// What stands where there is no line before.
pub(super) const FIRST: &str = "0000000000000000000000000000000000000000000000000000000000000000";
/// What stands behind the name of the log in that of the file which says how it ends.
const HEAD: &str = ".head";
/// Its length: it is written in its place, in one step.
const HEAD_LENGTH: usize = 256;

pub(super) struct File {
    kept: Kept,
    largest: u64,
    /// How many are kept beside it.
    aside: u32,
    /// `None`: its lines have no seal, and nothing says how it ends.
    key: Option<Key>,
    last: Option<Head>,
    /// How often the disk was waited for.
    #[cfg(test)]
    pub(super) waits: u32,
}

/// How a log ends, and how it begins: by this it is known where one was cut.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Head {
    /// The number of the last line that was written.
    pub(super) number: u64,
    /// The SHA-256 of it.
    pub(super) last: String,
    /// The number of the first line that is kept.
    pub(super) first: u64,
}

impl Head {
    /// What a log says of itself, and by whose key; `None` where it says nothing.
    ///
    /// # Errors
    /// It cannot be read, or what it says is not sealed by its key.
    pub(super) fn of(log: &Kept, key: &Key) -> io::Result<Option<Self>> {
        let Some((text, _)) = log.beside(HEAD).read()? else { return Ok(None) };
        let text = text.trim_ascii();
        match serde_json::from_slice(text) {
            Ok(head) if key.has_sealed(text) => Ok(Some(head)),
            _ => Err(io::ErrorKind::InvalidData.into()),
        }
    }

    fn write(&self, log: &Kept, key: &Key) -> io::Result<()> {
        let mut text = key.sealed(&drived_words::json::line(self)).into_bytes();
        text.resize(HEAD_LENGTH - 1, b' ');
        text.push(b'\n');
        log.beside(HEAD).open_to_write()?.write_all(&text)
    }
}

impl File {
    /// The file at a path, made if there is none. One on a disk that is only read is written once that takes it again: as on a full one,
    /// motors may turn that have to be stopped.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let kept = Kept::at(path);
        writable_or_only_read(kept.open_to_append())?;
        let key = Key::of_or_new(&kept)?;
        // One that says nothing any more is found by who looks whether it is whole.
        let last = Head::of(&kept, &key).ok().flatten();
        Ok(Self { last, ..Self::of(kept, LARGEST, KEPT, Some(key)) })
    }

    const fn of(kept: Kept, largest: u64, aside: u32, key: Option<Key>) -> Self {
        Self {
            kept,
            largest,
            aside,
            key,
            last: None,
            #[cfg(test)]
            waits: 0,
        }
    }

    /// The file of what was refused.
    pub(super) fn open_refused(path: &Path) -> io::Result<Self> {
        let kept = Kept::at(path);
        writable_or_only_read(kept.open_to_append())?;
        Ok(Self::of(kept, LARGEST_REFUSED, 1, None))
    }

    /// The newest line, by its number and its SHA-256.
    pub(super) fn head(&self) -> String {
        self.last.as_ref().map_or_else(String::new, |head| format!("{}-{}", head.number, head.last))
    }

    /// Appends a record and waits until the disk has it.
    pub(super) fn append(&mut self, record: &Record) -> io::Result<()> {
        self.append_all([record])
    }

    /// Appends records in their order and waits once until the disk has them all. Of those that could not all be written none is there.
    pub(super) fn append_all<'a>(&mut self, records: impl IntoIterator<Item = &'a Record>) -> io::Result<()> {
        let mut file = self.locked()?;
        // Another program may have written since.
        let mut head = match &self.key {
            Some(key) => Head::of(&self.kept, key).ok().flatten(),
            None => None,
        };
        if file.metadata()?.len() >= self.largest {
            let first = self.rotate()?;
            if let (Some(head), Some(first)) = (&mut head, first) {
                head.first = first;
            }
            file = self.locked()?;
        }
        let length = file.metadata()?.len();
        let last = last_line(&mut file)?;
        // A line that was torn by a crash stays, and stays in the chain.
        let mut lines =
            if last.as_ref().is_some_and(|last| !last.is_whole) { "\n".to_owned() } else { String::new() };
        let mut aside = if last.is_none() { aside(&self.kept, 1).open()? } else { None };
        let before = match &mut aside {
            Some(aside) => last_line(aside)?,
            None => last,
        };
        let known = head.as_ref().map_or(0, |head| head.number);
        let (mut previous, before) = match &before {
            Some(last) => {
                let number = number_of(&last.bytes)
                    .map_or_else(|| last_number(aside.as_mut().unwrap_or(&mut file)), Ok)?;
                (sha256(&last.bytes), number.max(known))
            }
            // Whoever has emptied it has not made it new.
            None => (head.as_ref().map_or_else(|| FIRST.to_owned(), |head| head.last.clone()), known),
        };
        let mut number = before;
        for record in records {
            number += 1;
            let line = Line { number, time_unix_ms: unix_ms(), record, previous: &previous };
            let object = drived_words::json::line(&line);
            let object = self.key.as_ref().map_or_else(|| object.clone(), |key| key.sealed(&object));
            previous = sha256(object.as_bytes());
            lines.push_str(&object);
            lines.push('\n');
        }
        #[cfg(test)]
        {
            self.waits += 1;
        }
        let written = file.write_all(lines.as_bytes()).and_then(|()| file.sync_data());
        if written.is_err() {
            // They are there whole or not at all. Where even this fails, the next program finds a torn line.
            let _ = file.set_len(length);
            return written;
        }
        if let Some(key) = &self.key {
            let first = head.map_or(before + 1, |head| head.first);
            let head = Head { number, last: previous, first };
            // The last that could be written is still true.
            let _ = head.write(&self.kept, key);
            self.last = Some(head);
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

    /// Puts the file aside. Gives the number of the first line that is kept, where the oldest had to go.
    fn rotate(&self) -> io::Result<Option<u64>> {
        let goes = aside(&self.kept, self.aside).open()?.is_some();
        for number in (1..self.aside).rev() {
            aside(&self.kept, number).rename(&aside(&self.kept, number + 1))?;
        }
        self.kept.rename(&aside(&self.kept, 1))?;
        let oldest =
            (1..=self.aside).rev().find_map(|number| aside(&self.kept, number).open().ok().flatten());
        Ok(match oldest {
            Some(oldest) if goes => {
                let lines = BufReader::new(oldest).split(b'\n').map_while(Result::ok);
                lines.filter_map(|line| number_of(&line)).next()
            }
            _ => None,
        })
    }
}

fn writable_or_only_read(opened: io::Result<fs::File>) -> io::Result<()> {
    match opened {
        Err(error) if error.kind() == io::ErrorKind::ReadOnlyFilesystem => Ok(()),
        opened => opened.map(drop),
    }
}

/// A file that was put aside; 1 is the newest.
pub(super) fn aside(log: &Kept, number: u32) -> Kept {
    log.beside(&format!(".{number}"))
}

/// The number of a line, if it is whole and of a log with a key.
pub(super) fn number_of(line: &[u8]) -> Option<u64> {
    #[derive(Deserialize)]
    struct Numbered {
        number: Option<u64>,
    }
    serde_json::from_slice::<Numbered>(line).ok()?.number
}

/// The number of the last line of a file that has one.
fn last_number(file: &mut fs::File) -> io::Result<u64> {
    file.seek(SeekFrom::Start(0))?;
    let mut last = 0;
    for line in BufReader::new(file).split(b'\n') {
        last = number_of(&line?).unwrap_or(last);
    }
    Ok(last)
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

    use drived_config::testing::Folder;

    use super::*;
    use crate::audit::{Kind, Verdict, verify, verify::verify_since};
    use drived_config::rights::{Caller, Rights};

    fn record(what: &str) -> Record {
        let caller = Caller::new("panel", "http 10.0.0.7", Rights::ALL);
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
        let numbers: Vec<_> = lines.iter().map(|line| number_of(line.as_bytes())).collect();
        assert_eq!(numbers, [1, 2, 3].map(Some));
        assert!(!lines[0].contains('\u{1b}'), "{}", lines[0]);
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 3, torn: 0, .. }));
    }

    /// A card that was mounted anew after an error, to be read alone: motors may turn that have to be stopped.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_log_that_can_only_be_read_is_opened_and_goes_on_once_it_can_be_written() {
        let Some(disk) = drived_config::testing::Disk::of("audit") else { return };
        let path = disk.file("audit");
        File::open(&path).unwrap().append(&record("first")).unwrap();
        File::open_refused(&disk.file("audit.refused")).unwrap();
        disk.is_only_read(true);
        let mut file = File::open(&path).unwrap();
        let mut refused = File::open_refused(&disk.file("audit.refused")).unwrap();
        assert!(file.append(&record("second")).is_err() && refused.append(&record("second")).is_err());
        disk.is_only_read(false);
        file.append(&record("third")).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 2, torn: 0, .. }));
    }

    #[test]
    fn records_that_are_written_together_are_a_chain_as_if_each_were_alone() {
        let folder = Folder::new("together");
        let path = folder.file("audit");
        let mut file = File::open(&path).unwrap();
        file.append(&record("one")).unwrap();
        let together = ["two", "three", "four"].map(record);
        file.append_all(&together).unwrap();
        file.append(&record("five")).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 5, torn: 0, .. }));
        let numbers: Vec<_> = lines(&path).iter().map(|line| number_of(line.as_bytes())).collect();
        assert_eq!(numbers, [1, 2, 3, 4, 5].map(Some));
        assert_eq!(file.head().split('-').next(), Some("5"));
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
    fn what_was_emptied_cut_or_edited_at_its_end_is_found() {
        let folder = Folder::new("cut");
        let path = folder.file("audit");
        let mut file = File::open(&path).unwrap();
        for number in 0..10 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        let whole = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = whole.lines().collect();
        for (what, tampered) in [
            ("emptied", String::new()),
            ("cut at its end", lines[..9].join("\n") + "\n"),
            ("cut at its beginning", lines[1..].join("\n") + "\n"),
            ("edited in its last line", whole.replace("command 9", "command 8")),
        ] {
            fs::write(&path, tampered).unwrap();
            let verdict = verify(&path).unwrap();
            assert!(matches!(verdict, Verdict::Broken { .. }), "{what}: {verdict:?}");
        }
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

    #[test]
    fn what_was_rewritten_without_the_key_or_put_back_as_it_was_earlier_is_found() {
        let folder = Folder::new("rewritten");
        let path = folder.file("audit");
        let mut file = File::open(&path).unwrap();
        for number in 0..5 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        let earlier = ["", ".head"].map(|ending| fs::read(folder.file(&format!("audit{ending}"))).unwrap());
        for number in 5..10 {
            file.append(&record(&format!("command {number}"))).unwrap();
        }
        let head = file.head();
        assert!(matches!(verify_since(&path, Some(&head)).unwrap(), Verdict::Unbroken { .. }));
        // Somebody writes a chain of his own, with a key of his own.
        let forged = folder.file("forged");
        let mut other = File::open(&forged).unwrap();
        (0..10).for_each(|number| other.append(&record(&format!("forged {number}"))).unwrap());
        let whole = fs::read(&path).unwrap();
        fs::copy(&forged, &path).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Broken { .. }));
        for ending in [".head", ".key"] {
            let of = |log: &str| folder.file(&format!("{log}{ending}"));
            fs::copy(of("audit"), of("kept")).unwrap();
            fs::copy(of("forged"), of("audit")).unwrap();
        }
        // He has all that this program has: only what was told elsewhere says it.
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { .. }));
        assert!(matches!(verify_since(&path, Some(&head)).unwrap(), Verdict::Broken { .. }));
        for ending in [".head", ".key"] {
            let of = |log: &str| folder.file(&format!("{log}{ending}"));
            fs::copy(of("kept"), of("audit")).unwrap();
        }
        fs::write(&path, whole).unwrap();
        for (ending, content) in ["", ".head"].into_iter().zip(earlier) {
            fs::write(folder.file(&format!("audit{ending}")), content).unwrap();
        }
        assert!(matches!(verify_since(&path, Some(&head)).unwrap(), Verdict::Broken { .. }), "rolled back");
        for ending in [".head", ".key"] {
            fs::remove_file(folder.file(&format!("audit{ending}"))).unwrap();
            assert!(matches!(verify(&path).unwrap(), Verdict::Broken { .. }), "without its {ending}");
        }
    }

    #[test]
    fn the_log_of_a_version_without_a_key_goes_on_and_is_whole() {
        let folder = Folder::new("older");
        let path = folder.file("audit");
        let one = format!(r#"{{"time_unix_ms":1,"kind":"daemon","what":"one","previous":"{FIRST}"}}"#);
        let two = format!(r#"{{"time_unix_ms":2,"what":"two","previous":"{}"}}"#, sha256(one.as_bytes()));
        fs::write(&path, format!("{one}\n{two}\n")).unwrap();
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 2, .. }));
        let mut file = File::open(&path).unwrap();
        file.append(&record("three")).unwrap();
        let verdict = verify(&path).unwrap();
        assert!(matches!(verdict, Verdict::Unbroken { records: 3, .. }), "{verdict:?}");
        let whole = fs::read_to_string(&path).unwrap();
        for tampered in [whole.replace("two", "zwo"), whole + &two + "\n"] {
            fs::write(&path, tampered).unwrap();
            assert!(matches!(verify(&path).unwrap(), Verdict::Broken { .. }));
        }
    }
}
