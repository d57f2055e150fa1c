//! The number of the connections, which outlives the program.

use std::path::Path;

use drive_sparkplug::BdSeq;

use drived_config::kept::{Kept as File, Readers};

/// The number that is kept in a file.
#[derive(Debug)]
pub(super) struct Kept {
    file: File,
    /// Of the last connection that may have been made.
    last: Option<BdSeq>,
    is_failing: bool,
}

impl Kept {
    /// Reads the file; one that is not there yet is made with the first connection.
    ///
    /// # Errors
    /// It is none of this, or cannot be written.
    pub(super) fn open(file: &Path) -> Result<Self, String> {
        let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
        let number = |text: &[u8]| str::from_utf8(text).ok()?.parse().ok();
        let kept = File::at(file);
        let last = kept
            .read()
            .map_err(|error| failed(&error))?
            .map(|(text, _)| number(&text).ok_or_else(|| failed(&"expected a number from 0 to 255")));
        let last = last.transpose()?;
        if let Some(last) = last {
            write(&kept, last).map_err(|error| failed(&error))?;
        }
        Ok(Self { file: kept, last, is_failing: false })
    }

    /// The number of the next connection, which stands in the file when this returns. A disk that is full ends no connection.
    pub(super) fn next(&mut self) -> BdSeq {
        let next = self.last.map_or(BdSeq::default(), BdSeq::next);
        self.last = Some(next);
        let written = write(&self.file, next);
        if let Err(error) = &written
            && !self.is_failing
        {
            tracing::error!("Sparkplug: {}: {error}: bdSeq is not kept", self.file.path().display());
        }
        self.is_failing = written.is_err();
        next
    }
}

fn write(file: &File, number: BdSeq) -> std::io::Result<()> {
    file.replace(format!("{number}\n").as_bytes(), Readers::Owner)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_number_goes_on_over_restarts_and_begins_with_0() {
        let folder = std::env::temp_dir().join(format!("drived-bd-seq-{}", std::process::id()));
        let file = folder.join("sparkplug").join("bd-seq");
        let mut kept = Kept::open(&file).unwrap();
        assert_eq!([kept.next(), kept.next()].map(BdSeq::number), [0, 1]);
        // The program was killed.
        let mut kept = Kept::open(&file).unwrap();
        assert_eq!(kept.next().number(), 2);
        fs::write(&file, "255\n").unwrap();
        assert_eq!(Kept::open(&file).unwrap().next().number(), 0);
        fs::write(&file, "none").unwrap();
        assert!(Kept::open(&file).unwrap_err().ends_with("expected a number from 0 to 255"));
        fs::remove_dir_all(folder).unwrap();
    }
}
