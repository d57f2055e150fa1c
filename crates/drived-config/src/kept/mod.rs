//! What is kept in files: read and replaced whole, in the old or in the new form also when the power fails, and never through
//! a link.
//!
//! Whoever owns a folder can put a link into it, and a program with more rights that follows it reads and writes what it was not meant
//! to, as root's `drived token add` would in the folder of the service. So the folder is opened first ([`folder`]), and what is
//! in it by its name alone.

mod digest;
mod folder;
mod secure;

use std::{
    ffi::{CStr, OsStr, OsString},
    fs::File,
    io::{self, Read as _, Write as _},
    os::unix::ffi::OsStrExt as _,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use rustix::{
    fd::OwnedFd,
    fs::{
        AtFlags, FileType, FlockOperation, Gid, Mode, OFlags, Uid, fchown, flock, fstat, fsync, openat,
        readlinkat, renameat, statat, unlinkat,
    },
    io::Errno,
    process::geteuid,
};

pub use self::{
    digest::{digits, sha256},
    secure::{BALLAST, Stale, Unwritten, lay_ballast},
};

/// Who may read what is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Readers {
    /// Its owner alone.
    Owner,
    /// Whoever the user's own mask lets.
    Others,
}

/// How long somebody else may be at work in a folder.
const LOCKED_WITHIN: Duration = Duration::from_secs(5);
/// What is longer is nothing that was kept.
const LONGEST: u64 = 1 << 20;

/// A file that is kept: a folder, and a name in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kept {
    path: PathBuf,
    folder: PathBuf,
    name: OsString,
}

/// By what a file is known to be the same still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    changed: (i64, i64),
    length: u64,
    inode: u64,
    /// Whether nobody but its owner can read it.
    pub is_private: bool,
}

/// Nobody else who takes it changes anything in the folder until this is dropped.
#[derive(Debug)]
pub struct Lock {
    _folder: OwnedFd,
}

impl Kept {
    /// The file at a path.
    pub fn at(path: &Path) -> Self {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        // A path without a name is that of a folder, which is said when it is opened.
        let name = path.file_name().unwrap_or(OsStr::new(".")).to_owned();
        Self { path: path.to_owned(), folder, name }
    }

    /// The file whose name goes on so.
    pub fn beside(&self, ending: &str) -> Self {
        let more = |start: &OsStr| {
            let mut name = start.to_owned();
            name.push(ending);
            name
        };
        Self { path: more(self.path.as_os_str()).into(), name: more(&self.name), ..self.clone() }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What stands in it; `None` where there is none.
    ///
    /// # Errors
    /// It cannot be read, is no file or far too long, or is a link: then the error says what to name instead.
    pub fn read(&self) -> io::Result<Option<(Vec<u8>, Stamp)>> {
        self.read_up_to(LONGEST)
    }

    fn read_up_to(&self, longest: u64) -> io::Result<Option<(Vec<u8>, Stamp)>> {
        let Some(file) = self.open()? else { return Ok(None) };
        let stamp = stamp(&file)?;
        let mut content = Vec::new();
        let mut file = file.take(longest + 1);
        file.read_to_end(&mut content)?;
        match file.limit() {
            0 => Err(io::Error::other(format!("it is longer than {} KiB", longest >> 10))),
            _ => Ok(Some((content, stamp))),
        }
    }

    /// By what it is known to be the same still; `None` where there is none.
    pub fn stamp(&self) -> io::Result<Option<Stamp>> {
        self.open()?.map(|file| stamp(&file)).transpose()
    }

    /// Opens it to read; `None` where there is none.
    pub fn open(&self) -> io::Result<Option<File>> {
        let folder = match folder::open(&self.folder) {
            Ok(folder) => folder,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        match self.open_in(&folder, OFlags::RDONLY) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Opens it to read and to append; where there is none it is made, for its owner alone.
    pub fn open_to_append(&self) -> io::Result<File> {
        self.open_or_make(OFlags::RDWR.union(OFlags::APPEND))
    }

    /// Opens it to read and to write in its place; where there is none it is made, for its owner alone.
    pub fn open_to_write(&self) -> io::Result<File> {
        self.open_or_make(OFlags::RDWR)
    }

    fn open_or_make(&self, how: OFlags) -> io::Result<File> {
        let folder = folder::open_or_make(&self.folder)?;
        match self.open_in(&folder, how | OFlags::CREATE | OFlags::EXCL) {
            Ok(file) => give_to_owner_of(&folder, &file).map(|()| file),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => self.open_in(&folder, how),
            Err(error) => Err(error),
        }
    }

    /// Replaces it in one step, and makes its folder where there is none.
    pub fn replace(&self, content: &[u8], readers: Readers) -> io::Result<()> {
        let folder = folder::open_or_make(&self.folder)?;
        let mut new = OsString::from(".");
        new.push(&self.name);
        new.push(".new");
        // What a crash, or somebody else, has left there.
        match unlinkat(&folder, &new, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => {}
            Err(error) => return Err(error.into()),
        }
        let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let mode = match readers {
            Readers::Owner => Mode::from_raw_mode(0o600),
            Readers::Others => Mode::from_raw_mode(0o666),
        };
        let mut file = File::from(openat(&folder, &new, flags, mode)?);
        let mut write = || {
            give_to_owner_of(&folder, &file)?;
            file.write_all(content)?;
            file.sync_all()?;
            Ok(renameat(&folder, &new, &folder, &self.name)?)
        };
        if let Err(error) = write() {
            // Half of it would keep room that others need.
            let _ = unlinkat(&folder, &new, AtFlags::empty());
            return Err(error);
        }
        // A disk that cannot write a folder has written the file.
        let _ = folder::itself(&folder).map(fsync);
        Ok(())
    }

    /// Gives it another name in its folder; whether it was there.
    pub fn rename(&self, to: &Self) -> io::Result<bool> {
        let folder = folder::open(&self.folder)?;
        match renameat(&folder, &self.name, &folder, &to.name) {
            Ok(()) => Ok(true),
            Err(Errno::NOENT) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Keeps everybody else who locks out of the folder, which is made where there is none.
    ///
    /// # Errors
    /// Somebody else is at work there and does not end.
    pub fn lock(&self) -> io::Result<Lock> {
        let folder = folder::itself(&folder::open_or_make(&self.folder)?)?;
        let until = Instant::now() + LOCKED_WITHIN;
        loop {
            match flock(&folder, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => return Ok(Lock { _folder: folder }),
                Err(Errno::WOULDBLOCK | Errno::INTR) if Instant::now() < until => {
                    thread::park_timeout(Duration::from_millis(20));
                }
                Err(Errno::WOULDBLOCK) => {
                    return Err(io::Error::other("another program is at work in its folder: try again"));
                }
                Err(error) => return Err(error.into()),
            }
        }
    }

    fn open_in(&self, folder: &OwnedFd, flags: OFlags) -> io::Result<File> {
        // A pipe would hold up whoever opens it.
        let careful = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let file = match openat(folder, &self.name, flags | careful, Mode::from_raw_mode(0o600)) {
            Ok(file) => file,
            Err(error @ (Errno::LOOP | Errno::EXIST)) => {
                return Err(self.link(folder).unwrap_or(error.into()));
            }
            Err(error) => return Err(error.into()),
        };
        let (known, around) = (fstat(&file)?, fstat(folder)?);
        if FileType::from_raw_mode(known.st_mode) != FileType::RegularFile {
            return Err(io::Error::other("it is no file"));
        }
        // A hard link is none that can be seen: what root opens in another's folder has to be that one's own.
        if geteuid().is_root() && around.st_uid != 0 && known.st_uid != around.st_uid {
            let why = format!("user {} has put it there, who does not own it", around.st_uid);
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, why));
        }
        Ok(File::from(file))
    }

    /// What is told of a link.
    fn link(&self, folder: &OwnedFd) -> Option<io::Error> {
        let target = readlinkat(folder, &self.name, Vec::new()).ok()?;
        let target = self.folder.join(text(&target));
        let why = format!("it is a link, which is not followed: name {} itself", target.display());
        Some(io::Error::other(why))
    }
}

/// A name as the system has it.
fn text(name: &CStr) -> OsString {
    OsStr::from_bytes(name.to_bytes()).to_owned()
}

/// What root makes belongs to whoever has its folder, so that the daemon's own user can use what was made for him.
fn give_to_owner_of(folder: &OwnedFd, file: &File) -> io::Result<()> {
    if geteuid().is_root() {
        let known = fstat(folder)?;
        let (user, group) = (Uid::from_raw(known.st_uid), Gid::from_raw(known.st_gid));
        fchown(file, Some(user), Some(group))?;
    }
    Ok(())
}

fn stamp(file: &File) -> io::Result<Stamp> {
    use std::os::unix::fs::MetadataExt as _;
    let known = file.metadata()?;
    Ok(Stamp {
        changed: (known.mtime(), known.mtime_nsec()),
        length: known.len(),
        inode: known.ino(),
        is_private: known.mode() & 0o077 == 0,
    })
}

/// Whether an open file stands in the place of another still.
pub fn is_at(file: &File, kept: &Kept) -> io::Result<bool> {
    let open = fstat(file)?;
    let there = statat(folder::open(&kept.folder)?, &kept.name, AtFlags::SYMLINK_NOFOLLOW);
    Ok(there.is_ok_and(|there| (there.st_dev, there.st_ino) == (open.st_dev, open.st_ino)))
}

#[cfg(test)]
mod tests;
