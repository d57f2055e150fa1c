//! Whether the chain of an audit log is whole.

use std::{
    io::{self, BufRead as _, BufReader},
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::file::{KEPT, aside};
use crate::{doors::tokens::sha256, kept::Kept};

/// What the chain of a log says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Each line stands behind the line that it was written behind.
    Unbroken {
        records: u64,
        /// Lines that are no whole record, as a crash leaves them; they stand in the chain.
        torn: u64,
        /// The SHA-256 of the last line: by it a log that was cut at its end is known, if it was noted elsewhere.
        last: String,
    },
    /// This line does not stand behind the one that it was written behind.
    Broken { file: PathBuf, line: u64 },
}

/// The part of a record that makes the chain.
#[derive(Deserialize)]
struct Link {
    previous: String,
}

/// Reads a log, and before it the files of it that were put aside, the oldest first. Where the oldest were removed, the
/// chain begins with what is left.
///
/// # Errors
///
/// A file cannot be read.
pub(crate) fn verify(path: &Path) -> io::Result<Verdict> {
    let log = Kept::at(path);
    let aside = (1..=KEPT).rev().map(|number| aside(&log, number)).filter(|file| file.path().exists());
    let mut last: Option<String> = None;
    let (mut records, mut torn) = (0, 0);
    // A torn line cannot say what stands before it; the line behind it says what it is.
    let mut unsure = None;
    for file in aside.chain([log.clone()]) {
        let Some(open) = file.open()? else { return Err(io::ErrorKind::NotFound.into()) };
        for (index, line) in BufReader::new(open).split(b'\n').enumerate() {
            let line = line?;
            let number = u64::try_from(index).unwrap_or(u64::MAX).saturating_add(1);
            match serde_json::from_slice::<Link>(&line) {
                Ok(link) => {
                    if last.as_ref().is_some_and(|last| *last != link.previous) {
                        return Ok(Verdict::Broken { file: file.path().to_owned(), line: number });
                    }
                    records += 1;
                    unsure = None;
                }
                Err(_) if unsure.is_none() && last.is_some() => {
                    torn += 1;
                    unsure = Some(number);
                }
                Err(_) => return Ok(Verdict::Broken { file: file.path().to_owned(), line: number }),
            }
            last = Some(sha256(&line));
        }
    }
    Ok(Verdict::Unbroken { records, torn, last: last.unwrap_or_default() })
}
