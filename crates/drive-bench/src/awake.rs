//! Processors that do not go to sleep.
//!
//! A processor that has nothing to do sleeps, and needs some 30 to 100 µs to wake up, on a virtual machine more than on
//! a real one. Between two characters of a slow line every processor has nothing to do. What this costs is no property
//! of the line, so it is measured with and without.

use std::{
    env::current_exe,
    io,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use crate::Error;

/// One process for each processor, which uses what nobody else wants of it. They end with this.
#[derive(Debug)]
pub(crate) struct Awake {
    spinning: Vec<Child>,
}

impl Awake {
    /// Needs `chrt` of util-linux, for a program cannot give itself the idle class without `unsafe`. Without it the
    /// measurement is left out, and says so.
    pub(crate) fn begin() -> Option<Self> {
        Self::try_begin()
            .inspect_err(|error| eprintln!("drive-bench: processors cannot be kept awake: {error}"))
            .ok()
    }

    fn try_begin() -> Result<Self, Error> {
        let mut awake = Self { spinning: Vec::new() };
        for _ in 0..thread::available_parallelism()?.get() {
            let mut command = Command::new("chrt");
            command.args(["--idle", "0"]).arg(current_exe()?).arg("--keep-awake").stdin(Stdio::piped());
            awake.spinning.push(command.spawn()?);
        }
        Ok(awake)
    }
}

impl Drop for Awake {
    fn drop(&mut self) {
        for spinning in &mut self.spinning {
            // Its end.
            spinning.stdin = None;
            let _ = spinning.wait();
        }
    }
}

/// Spins until the standard input ends.
pub(crate) fn spin() {
    let over = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&over);
    thread::spawn(move || {
        // Nothing is ever written there, and an error is an end too.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        ended.store(true, Ordering::Relaxed);
    });
    while !over.load(Ordering::Relaxed) {
        std::hint::spin_loop();
    }
}
