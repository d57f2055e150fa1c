//! A pty with a name that stays.

use std::{
    fs, io,
    os::{fd::OwnedFd, unix::fs::symlink},
    path::{Path, PathBuf},
};

use drive_core::{SerialSettings, serial::Parity};
use rustix::{
    fs::{Mode, OFlags},
    termios::{ControlModes, InputModes, OptionalActions, tcgetattr, tcsetattr},
};
use tokio_serial::{SerialPort, SerialStream};

use crate::wire::{Errors, Master};

/// The slave side of a pty and the link to it.
pub(super) struct Pty {
    link: PathBuf,
    device: String,
}

/// The slave side, kept open: while it is, a master that closes the device does not end it, and reading our side does not
/// fail. It tells how the master has set it.
pub(super) struct Kept(OwnedFd);

impl Kept {
    /// Sets the port as the line is: a master that leaves it as it finds it is understood.
    fn preset(&self, line: SerialSettings) -> io::Result<()> {
        let mut set = tcgetattr(&self.0)?;
        set.set_speed(line.baud())?;
        set.control_modes.set(ControlModes::CSTOPB, line.format().stop_bits() == 2);
        Ok(tcsetattr(&self.0, OptionalActions::Now, &set)?)
    }

    /// How a master has set the port, on a line whose own settings are these; `None`: at no speed that a line has.
    ///
    /// A pty keeps 8 data bits and no parity whatever is set, but the flags that go with a parity stay as the master left
    /// them. Whoever leaves none of them means, as far as anybody can tell, the line's.
    pub(super) fn master(&self, line: SerialSettings) -> Option<Master> {
        let set = tcgetattr(&self.0).ok()?;
        let (input, control) = (set.input_modes, set.control_modes);
        let checks = input.contains(InputModes::INPCK);
        let parity = match line.format().parity() {
            _ if control.contains(ControlModes::PARODD) => 'O',
            _ if checks => 'E',
            _ if input.contains(InputModes::IGNPAR) => 'N',
            Parity::Odd => 'O',
            Parity::Even => 'E',
            Parity::None => 'N',
        };
        let stop_bits = if control.contains(ControlModes::CSTOPB) { 2 } else { 1 };
        let format = format!("{}{parity}{stop_bits}", line.format().data_bits());
        let settings = SerialSettings::new(set.output_speed(), format.parse().ok()?).ok()?;
        let errors = match (checks, input.contains(InputModes::IGNPAR)) {
            (false, _) => Errors::Pass,
            (true, false) => Errors::Zero,
            (true, true) => Errors::Drop,
        };
        Some(Master { settings, errors })
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

/// Opens a pty in raw mode, set as the line is, and links to it: our side, and what keeps it.
pub(super) fn open(link: PathBuf, line: SerialSettings) -> io::Result<(SerialStream, Kept, Pty)> {
    let (ours, other) = SerialStream::pair()?;
    let device = other.name().ok_or_else(|| io::Error::other("the pty has no name"))?;
    let kept = rustix::fs::open(&device, OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK, Mode::empty())?;
    let kept = Kept(kept);
    kept.preset(line)?;
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
    Ok((ours, kept, Pty { link, device }))
}
