//! What has to be written also where the disk is full: a file of the same folder is given up for it, piece by piece, which holds nothing
//! but the room. And what could not be written is known as old by whoever reads it.

use std::{fmt, io, path::Path};

use rustix::{
    fs::{OFlags, fstatvfs},
    io::Errno,
};

use super::{Kept, LONGEST, Readers, folder};

/// The file of the state folder.
pub const BALLAST: &str = "ballast";
/// How much room it holds.
const HELD: usize = 256 << 10;
/// So much of it is given up at once: others who write take what is free.
const PIECE: u64 = 32 << 10;
/// It is made anew where there is so much room.
const ROOM: u64 = 2 * HELD as u64;
/// What is longer is nothing that was kept: ten thousand drives with a record each have a third of it.
const LONGEST_SECURED: u64 = LONGEST << 4;

/// What becomes of what is there where it cannot be replaced, and is old therefore.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stale {
    /// It is taken out: nothing is better than what is not so any more.
    Emptied,
    /// It stays: what is old is better than nothing.
    Left,
}

/// It cannot be written.
#[derive(Debug)]
pub struct Unwritten {
    why: io::Error,
    /// What has become of what is there; the error is why it could not be taken out.
    stale: Result<Stale, io::Error>,
}

impl fmt::Display for Unwritten {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { why, stale } = self;
        match stale {
            Ok(Stale::Emptied) => {
                write!(f, "{why}; what stood there is old and was taken out: in the next run of this program")
            }
            Ok(Stale::Left) => write!(f, "{why}; what stands there is old: in the next run of this program"),
            Err(stays) => write!(
                f,
                "{why}; what stands there is old and cannot be taken out ({stays}), THE NEXT RUN OF THIS PROGRAM TAKES IT FOR TRUE, unless the \
                 file is removed before it; then"
            ),
        }
    }
}

impl From<Unwritten> for io::Error {
    fn from(unwritten: Unwritten) -> Self {
        unwritten.why
    }
}

impl Kept {
    /// [Replaces](Self::replace) it, for its owner alone, and gives the ballast of its folder up for it where the disk is full.
    ///
    /// # Errors
    /// It cannot be written: then what is there is old, and `stale` says what becomes of it.
    pub fn secure<E: Into<io::Error>>(
        &self,
        content: Result<Vec<u8>, E>,
        stale: Stale,
    ) -> Result<(), Unwritten> {
        let ballast = Self::at(&self.folder.join(BALLAST));
        let replaced = |content: &[u8]| {
            loop {
                match self.replace(content, Readers::Owner) {
                    Err(error) if is_full(&error) && ballast.give_up_a_piece() => {}
                    // It holds room itself, and is old in any case.
                    Err(error) if is_full(&error) && stale == Stale::Emptied => {
                        return self.overwrite(content).map_err(|_| error);
                    }
                    written => return written,
                }
            }
        };
        let written = content.map_err(Into::into).and_then(|content| replaced(&content));
        match written {
            Ok(()) => {
                ballast.make_anew();
                Ok(())
            }
            Err(why) => {
                let stale = match stale {
                    Stale::Left => Ok(Stale::Left),
                    Stale::Emptied => self.overwrite(b"").map(|()| Stale::Emptied),
                };
                Err(Unwritten { why, stale })
            }
        }
    }

    /// What was [secured](Self::secure) in it; `None` where there is none.
    ///
    /// # Errors
    /// It cannot be read, or what is there was old and is taken out.
    pub fn read_secured(&self) -> io::Result<Option<Vec<u8>>> {
        let Some((content, _)) = self.read_up_to(LONGEST_SECURED)? else { return Ok(None) };
        match content.is_empty() {
            true => Err(io::Error::other(
                "an earlier run of this program could not write it, and took out what was old",
            )),
            false => Ok(Some(content)),
        }
    }

    /// Has another file have what stands in it.
    ///
    /// # Errors
    /// It is not there or cannot be read, or the other one cannot be written.
    pub fn copy_to(&self, other: &Self) -> io::Result<()> {
        match self.read_up_to(LONGEST_SECURED)? {
            Some((content, _)) => other.replace(&content, Readers::Owner),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    /// Writes it in its place, where there is one: whoever is cut off leaves nothing, or half of it, which is told from the whole.
    fn overwrite(&self, content: &[u8]) -> io::Result<()> {
        use io::Write as _;
        let Some(mut file) = self.open_there()? else { return Ok(()) };
        file.set_len(0)?;
        file.write_all(content)?;
        file.sync_all()
    }

    /// Whether there is less of it now.
    fn give_up_a_piece(&self) -> bool {
        let less = || {
            let Some(file) = self.open_there()? else { return Ok(false) };
            let length = file.metadata()?.len();
            file.set_len(length.saturating_sub(PIECE))?;
            file.sync_all()?;
            Ok::<_, io::Error>(length > 0)
        };
        less().unwrap_or(false)
    }

    /// Makes the ballast anew where it was given up and there is room. Where there is none the next time will do.
    fn make_anew(&self) {
        let is_less = matches!(self.stamp(), Ok(Some(stamp)) if stamp.length < HELD as u64);
        if is_less && self.room().is_ok_and(|room| room >= ROOM) {
            let _ = self.replace(&incompressible(), Readers::Owner);
        }
    }

    fn room(&self) -> io::Result<u64> {
        let known = fstatvfs(folder::itself(&folder::open(&self.folder)?)?)?;
        Ok(known.f_bavail.saturating_mul(known.f_frsize))
    }

    fn open_there(&self) -> io::Result<Option<std::fs::File>> {
        match self.open_in(&folder::open(&self.folder)?, OFlags::RDWR) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// Makes the ballast of a folder where there is none, or less of it than there should be.
///
/// # Errors
/// It cannot be written.
pub fn lay_ballast(folder: &Path) -> io::Result<()> {
    let ballast = Kept::at(&folder.join(BALLAST));
    match ballast.stamp()? {
        Some(stamp) if stamp.length >= HELD as u64 => Ok(()),
        _ => ballast.replace(&incompressible(), Readers::Owner),
    }
}

fn is_full(error: &io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::NOSPC | Errno::DQUOT))
}

/// What a file system does not make smaller: a generator of Marsaglia's (xorshift64).
fn incompressible() -> Vec<u8> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()
    };
    std::iter::repeat_with(next).take(HELD / 8).flatten().collect()
}
