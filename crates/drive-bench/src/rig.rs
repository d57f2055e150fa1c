//! The simulated line, on a thread of its own: it must not wait for the master that is measured.

use std::{env::temp_dir, path::PathBuf, process, sync::mpsc, thread, time::Duration};

use drive_bus::{Echo, LineConfig};
use drive_core::serial::SerialSettings;
use drive_sim::{SimLine, Wiring, models::atv312::Atv312};
use tokio::sync::oneshot;

use crate::Error;

/// The slave's time to answer in every measurement.
pub(crate) const TURNAROUND: Duration = Duration::from_millis(5);

/// The registers that are read: eight from here, which the ATV312 has without a hole, its status word ETAD first
/// (BBV51701 pp. 17, 18).
pub(crate) const FIRST: u16 = 8_603;
pub(crate) const QUANTITY: u16 = 8;

/// A served line; it ends with this.
pub(crate) struct Rig {
    pub(crate) line: SimLine,
    pub(crate) path: PathBuf,
    _stop: oneshot::Sender<()>,
}

impl Rig {
    /// Drives 1 to `drives` on a pty.
    pub(crate) fn start(drives: u8, unpaced: bool) -> Result<Self, Error> {
        let path = temp_dir().join(format!("drive-bench-{}-{drives}-{unpaced}", process::id()));
        let (started, when_started) = mpsc::channel();
        let (stop, stopped) = oneshot::channel();
        let link = path.clone();
        thread::spawn(move || {
            let serve = || -> Result<_, Error> {
                let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
                let guard = runtime.enter();
                let line = populated(drives, unpaced)?;
                let serving = line.serve_pty(link)?;
                drop(guard);
                Ok((runtime, line, serving))
            };
            match serve() {
                Ok((runtime, line, serving)) => {
                    let _ = started.send(Ok(line));
                    // The end comes when the rig is dropped.
                    let _ = runtime.block_on(stopped);
                    drop(serving);
                }
                Err(error) => {
                    let _ = started.send(Err(error));
                }
            }
        });
        let line = when_started.recv()??;
        Ok(Self { line, path, _stop: stop })
    }

    /// The configuration of our line to it.
    pub(crate) fn config(&self) -> LineConfig {
        // Nothing echoes here, and the first write must not be preceded by a read in the measurement of a Stop.
        LineConfig { echo: Echo::Off, ..LineConfig::serial(&self.path, SerialSettings::MODBUS_DEFAULT) }
    }

    /// The path in the form that tokio-serial wants.
    pub(crate) fn port(&self) -> String {
        self.path.to_string_lossy().into_owned()
    }
}

/// A line of ATV312 under bus control.
pub(crate) fn populated(drives: u8, unpaced: bool) -> Result<SimLine, Error> {
    let line = SimLine::new(Wiring { unpaced, ..Wiring::rtu(SerialSettings::MODBUS_DEFAULT) });
    for address in 1..=drives {
        let turnaround = if unpaced { Duration::ZERO } else { TURNAROUND };
        line.add(address, Atv312::under_bus_control())?.set_turnaround(Some(turnaround));
    }
    Ok(line)
}

/// A runtime for the master that is measured.
pub(crate) fn runtime() -> Result<tokio::runtime::Runtime, Error> {
    Ok(tokio::runtime::Builder::new_current_thread().enable_all().build()?)
}
