//! Two ptys and a cable between them, so that two programs can each open a serial port by its path.

use std::{
    fs::{File, OpenOptions},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
};

use tokio::{io::copy_bidirectional, task::JoinHandle};
use tokio_serial::{SerialPort, SerialStream};

/// A cable with a serial port at each end. Dropping it pulls it out.
#[derive(Debug)]
pub struct Cable {
    near: PathBuf,
    far: PathBuf,
    /// Kept open, so that a port that nobody has opened yet does not hang up.
    _ends: [File; 2],
    carrier: JoinHandle<()>,
}

impl Cable {
    /// A new cable.
    ///
    /// # Panics
    /// When the system gives no pty.
    #[must_use]
    pub fn new() -> Self {
        let (mut near, near_end) = pair();
        let (mut far, far_end) = pair();
        let (near_path, far_path) = (path(&near_end), path(&far_end));
        let ends = [keep_open(&near_path), keep_open(&far_path)];
        let carrier = tokio::spawn(async move {
            // It ends with the test.
            let _ = copy_bidirectional(&mut near, &mut far).await;
        });
        Self { near: near_path, far: far_path, _ends: ends, carrier }
    }

    /// The port at this end.
    #[must_use]
    pub fn near(&self) -> &Path {
        &self.near
    }

    /// The port at the other end.
    #[must_use]
    pub fn far(&self) -> &Path {
        &self.far
    }
}

impl Default for Cable {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        self.carrier.abort();
    }
}

fn pair() -> (SerialStream, SerialStream) {
    SerialStream::pair().expect("the system gives a pty")
}

fn path(end: &SerialStream) -> PathBuf {
    PathBuf::from(end.name().expect("a pty has a name"))
}

/// Opens a port without the lock that a serial library puts on it, and without making it this program's terminal.
fn keep_open(path: &Path) -> File {
    let flags = rustix::fs::OFlags::NOCTTY.bits().cast_signed();
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).expect("a pty can be opened")
}
