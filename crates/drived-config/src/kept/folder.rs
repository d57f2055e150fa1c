//! The way to a folder, on which nobody but root and this user may have laid a link.

use std::{
    ffi::{CString, OsString},
    io,
    path::{Component, Path},
};

#[cfg(target_os = "linux")]
use rustix::fs::fstat;
#[cfg(not(target_os = "linux"))]
use rustix::fs::{AtFlags, statat};
use rustix::{
    fd::OwnedFd,
    fs::{CWD, FileType, Mode, OFlags, Stat, mkdirat, openat, readlinkat},
    io::Errno,
    process::geteuid,
};

/// As a folder on the way is opened. Who may pass through it need not be allowed to list it.
const PASSED: OFlags = {
    let folder = OFlags::DIRECTORY.union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);
    #[cfg(target_os = "linux")]
    let folder = folder.union(OFlags::PATH);
    folder
};

/// A way with more links than this leads in a circle.
const MOST_LINKS: u32 = 40;

/// Opens a folder, step by step. A link on the way is followed where root or this user has laid it, such as `/var/lib/drived`
/// of a service with a dynamic user: nobody else leads a program to where he wants it.
///
/// # Errors
/// There is none, it may not be opened, or the way has another's link on it.
pub(super) fn open(path: &Path) -> io::Result<OwnedFd> {
    walk(path, false)
}

/// The folder itself, which can be locked and synchronised.
pub(super) fn itself(folder: &OwnedFd) -> io::Result<OwnedFd> {
    Ok(openat(folder, ".", OFlags::DIRECTORY.union(OFlags::CLOEXEC), Mode::empty())?)
}

/// The same; what there is not yet of the way is made, for this user alone.
pub(super) fn open_or_make(path: &Path) -> io::Result<OwnedFd> {
    walk(path, true)
}

fn walk(path: &Path, makes: bool) -> io::Result<OwnedFd> {
    let mut rest = steps(path);
    let mut at = openat(CWD, ".", PASSED, Mode::empty())?;
    let mut links = 0;
    while let Some(step) = rest.pop() {
        match openat(&at, &step, PASSED, Mode::empty()) {
            Ok(next) => at = next,
            Err(Errno::NOENT) if makes => {
                match mkdirat(&at, &step, Mode::RWXU) {
                    Ok(()) | Err(Errno::EXIST) => {}
                    Err(error) => return Err(error.into()),
                }
                rest.push(step);
            }
            Err(Errno::NOTDIR | Errno::LOOP) => {
                let (known, target) = look(&at, &step)?;
                if FileType::from_raw_mode(known.st_mode) != FileType::Symlink {
                    return Err(io::ErrorKind::NotADirectory.into());
                }
                if known.st_uid != 0 && known.st_uid != geteuid().as_raw() {
                    let why = format!("{} is a link of user {}", step.display(), known.st_uid);
                    return Err(io::Error::new(io::ErrorKind::PermissionDenied, why));
                }
                links += 1;
                if links > MOST_LINKS {
                    return Err(Errno::LOOP.into());
                }
                rest.extend(steps(Path::new(&super::text(&target))));
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(at)
}

/// What stands there instead of a folder, and where it leads if it is a link. It is opened first: whoever owns the folder puts no link of
/// his own in the place of another's between one question and the next.
#[cfg(target_os = "linux")]
fn look(at: &OwnedFd, step: &OsString) -> io::Result<(Stat, CString)> {
    let it = openat(at, step, OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC, Mode::empty())?;
    Ok((fstat(&it)?, readlinkat(&it, c"", Vec::new()).unwrap_or_default()))
}

#[cfg(not(target_os = "linux"))]
fn look(at: &OwnedFd, step: &OsString) -> io::Result<(Stat, CString)> {
    let known = statat(at, step, AtFlags::SYMLINK_NOFOLLOW)?;
    Ok((known, readlinkat(at, step, Vec::new()).unwrap_or_default()))
}

/// The steps of a way, the last first.
fn steps(path: &Path) -> Vec<OsString> {
    let steps = path.components().filter(|step| *step != Component::CurDir);
    steps.rev().map(|step| step.as_os_str().to_owned()).collect()
}
