//! Whether an audit log is whole.

use std::{
    io::{self, BufRead as _, BufReader},
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::{
    file::{FIRST, Head, KEPT, aside},
    seal::Key,
};
use drived_config::kept::{Kept, sha256};

/// What a log says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Each line stands behind the line that it was written behind, from the first that is kept to the last that was written.
    Unbroken {
        records: u64,
        /// Lines that are no whole record, as a crash leaves them; they stand in the chain.
        torn: u64,
        /// The SHA-256 of the last line.
        last: String,
        /// The number of it and its SHA-256: by these a log that was put back as it was earlier is known, if they were noted
        /// elsewhere.
        head: Option<String>,
    },
    /// Something is wrong at this line, or with what stands before it.
    Broken { file: PathBuf, line: u64, why: &'static str },
}

/// The part of a record that makes the chain.
#[derive(Deserialize)]
struct Link {
    number: Option<u64>,
    previous: String,
    seal: Option<String>,
}

/// A log as it is read through.
#[derive(Default)]
struct Read {
    records: u64,
    torn: u64,
    /// The SHA-256 of the last line.
    last: Option<String>,
    /// A torn line cannot say what stands before it; the line behind it says what it is.
    is_unsure: bool,
    /// The numbers of the first and of the last line with a seal.
    numbers: Option<(u64, u64)>,
    /// Lines that are looked for by their hashes, and were found.
    found: Vec<String>,
}

impl Read {
    /// Takes the next line, or says what is wrong with it.
    fn take(&mut self, line: &[u8], key: Option<&Key>, looked_for: &[&str]) -> Result<(), &'static str> {
        const CHAIN: &str = "this line or the one before was changed, added or taken out";
        let hash = sha256(line);
        match serde_json::from_slice::<Link>(line) {
            Ok(link) => {
                if self.last.as_ref().is_some_and(|last| *last != link.previous) {
                    return Err(CHAIN);
                }
                match (link.number.zip(link.seal), self.numbers) {
                    (None, None) => {}
                    (None, Some(_)) => return Err("it has no seal, and lines before it have"),
                    (Some((number, _)), numbers) => {
                        if !key.is_some_and(|key| key.has_sealed(line)) {
                            return Err(
                                "its seal is not that of the key: it was changed, or the key is another",
                            );
                        }
                        if numbers.is_some_and(|(_, last)| number != last + 1) {
                            return Err("its number does not follow the one before");
                        }
                        self.numbers = Some((numbers.map_or(number, |(first, _)| first), number));
                    }
                }
                self.records += 1;
                self.is_unsure = false;
            }
            Err(_) if !self.is_unsure && self.last.is_some() => {
                self.torn += 1;
                self.is_unsure = true;
            }
            Err(_) => return Err(CHAIN),
        }
        if looked_for.contains(&hash.as_str()) {
            self.found.push(hash.clone());
        }
        self.last = Some(hash);
        Ok(())
    }
}

/// Reads a log, and before it the files of it that were put aside, the oldest first.
///
/// # Errors
///
/// A file cannot be read.
pub fn verify(path: &Path) -> io::Result<Verdict> {
    verify_since(path, None)
}

/// The same, and whether the line is in it that was the newest when somebody noted it, by its SHA-256, or by its number, a `-` and
/// that.
///
/// # Errors
///
/// A file cannot be read, or what was noted is older than what is kept.
pub fn verify_since(path: &Path, since: Option<&str>) -> io::Result<Verdict> {
    let log = Kept::at(path);
    let key = Key::of(&log)?;
    let head = key.as_ref().map(|key| Head::of(&log, key)).transpose();
    let noted = since.map(|since| {
        since.rsplit_once('-').map_or((None, since), |(number, hash)| (number.parse().ok(), hash))
    });
    let of_head = head.as_ref().ok().and_then(Option::as_ref).and_then(Option::as_ref);
    let looked_for: Vec<&str> =
        noted.map(|(_, hash)| hash).into_iter().chain(of_head.map(|head| head.last.as_str())).collect();
    let mut read = Read::default();
    let mut at = 0;
    for file in (1..=KEPT).rev().map(|number| aside(&log, number)).chain([log.clone()]) {
        let Some(open) = file.open()? else {
            if file == log {
                return Err(io::ErrorKind::NotFound.into());
            }
            continue;
        };
        at = 0;
        for line in BufReader::new(open).split(b'\n') {
            at += 1;
            if let Err(why) = read.take(&line?, key.as_ref(), &looked_for) {
                return Ok(Verdict::Broken { file: file.path().to_owned(), line: at, why });
            }
        }
    }
    let broken = |why| Ok(Verdict::Broken { file: path.to_owned(), line: at, why });
    let is_there = |hash: &str| read.found.iter().any(|found| found == hash);
    match (head, read.numbers) {
        (Err(error), _) if error.kind() != io::ErrorKind::InvalidData => return Err(error),
        (Err(_), _) => return broken("what says how it ends was changed"),
        (Ok(None | Some(None)), Some(_)) => return broken("what says how it ends is gone"),
        (Ok(Some(Some(head))), numbers) => {
            if !is_there(&head.last) {
                return broken("it was cut: its last line is not there");
            }
            if numbers.is_none_or(|(first, _)| first != head.first) {
                return broken("it was cut: its first line is not there");
            }
        }
        (Ok(None | Some(None)), None) => {}
    }
    if let Some((number, hash)) = noted
        && !is_there(hash)
    {
        let first = read.numbers.map_or(0, |(first, _)| first);
        if number.is_some_and(|number: u64| number < first) {
            let why = format!(
                "record {} is older than what is kept, which begins with {first}",
                number.unwrap_or(0)
            );
            return Err(io::Error::other(why));
        }
        return broken(
            "the line that was noted is not in it: it was rewritten or put back as it was earlier",
        );
    }
    let last = read.last.unwrap_or_else(|| FIRST.to_owned());
    let head = read.numbers.map(|(_, number)| format!("{number}-{last}"));
    Ok(Verdict::Unbroken { records: read.records, torn: read.torn, last, head })
}
