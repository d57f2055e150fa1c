//! A pty with a name that stays.

use std::{
    fs, io,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
};

use tokio_serial::{SerialPort, SerialStream};

/// The slave side of a pty and the link to it.
pub(super) struct Pty {
    link: PathBuf,
    device: String,
}

/// The slave side, kept open: while it is, a master that closes the device does not end it, and reading our side does not
/// fail. It tells the speed that the master has set.
pub(super) struct Kept(SerialStream);

impl Kept {
    /// Whether a master that has set this speed is understood.
    pub(super) fn is_set_to(&self, baud: u32) -> bool {
        self.0.baud_rate().is_ok_and(|set| set == baud)
    }
}

impl Pty {
    pub(super) fn device(&self) -> &str {
        &self.device
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // Only our own link: somebody may have put another simulator in its place.
        if fs::read_link(&self.link).is_ok_and(|target| target == Path::new(&self.device)) {
            let _ = fs::remove_file(&self.link);
        }
    }
}

/// Whether a link led to a pty that is gone: a simulator that was killed made it. One that leads to something may be anybody's,
/// also a simulator's that serves.
fn is_left_behind(link: &Path) -> bool {
    fs::read_link(link).is_ok_and(|target| target.starts_with("/dev") && !target.exists())
}

/// Opens a pty in raw mode and links to it: our side, and what keeps it.
pub(super) fn open(link: PathBuf) -> io::Result<(SerialStream, Kept, Pty)> {
    let (ours, kept) = SerialStream::pair()?;
    let device = kept.name().ok_or_else(|| io::Error::other("the pty has no name"))?;
    match fs::symlink_metadata(&link) {
        Ok(found) if found.is_symlink() && is_left_behind(&link) => fs::remove_file(&link)?,
        Ok(_) => {
            let text =
                format!("{} is there already and is no link that a simulator left behind", link.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
        Err(_) => {}
    }
    symlink(&device, &link)
        .map_err(|error| io::Error::new(error.kind(), format!("cannot link {}: {error}", link.display())))?;
    Ok((ours, Kept(kept), Pty { link, device }))
}
