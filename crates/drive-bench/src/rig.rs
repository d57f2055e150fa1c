//! The measuring side of the [`simulator`](crate::simulator): starts it, orders, listens.

use std::{
    env::current_exe,
    io::{BufRead, BufReader, Write},
    path::PathBuf,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::Duration,
};

use drive_bus::{Echo, LineConfig};
use drive_core::serial::SerialSettings;
use tokio::runtime::Runtime;

use crate::{
    Error,
    simulator::{Counted, Order, Plant, Report},
};

/// The registers that are read: eight from here, which the ATV312 has without a hole, its status word ETAD first
/// (BBV51701 pp. 17, 18).
pub(crate) const FIRST: u16 = 8_603;
pub(crate) const QUANTITY: u16 = 8;

/// As many drives as a line has without a repeater.
pub(crate) const DRIVES: u8 = 31;

/// Simulated lines on ptys, in a process that ends with this.
pub(crate) struct Rig {
    process: Child,
    orders: Option<ChildStdin>,
    reports: BufReader<ChildStdout>,
    ports: Vec<PathBuf>,
    unpaced: bool,
}

impl Rig {
    pub(crate) fn start(plant: Plant) -> Result<Self, Error> {
        let mut process = Command::new(current_exe()?)
            .arg("--simulate")
            .arg(serde_json::to_string(&plant)?)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let orders = process.stdin.take();
        let reports = BufReader::new(process.stdout.take().ok_or("the simulator has no output")?);
        let mut rig = Self { process, orders, reports, ports: Vec::new(), unpaced: plant.unpaced };
        rig.ports = rig.report()?.ports;
        Ok(rig)
    }

    /// One paced line with all its drives.
    pub(crate) fn one_line() -> Result<Self, Error> {
        Self::start(Plant { lines: 1, drives: DRIVES, unpaced: false })
    }

    /// The only line's port.
    pub(crate) fn port(&self) -> Result<&PathBuf, Error> {
        self.ports.first().ok_or_else(|| "the simulator has no line".into())
    }

    /// The ports of all lines.
    pub(crate) fn ports(&self) -> &[PathBuf] {
        &self.ports
    }

    /// The configurations of our lines to it.
    pub(crate) fn configs(&self) -> impl Iterator<Item = LineConfig> {
        self.ports.iter().map(|port| LineConfig {
            // Nothing echoes here, and the first write of a Stop must not be preceded by a read.
            echo: Echo::Off,
            // All its drives live: a busy machine keeps their simulator waiting, and that is all a silence tells here.
            offline_after: 0,
            unpaced: self.unpaced,
            ..LineConfig::serial(port, SerialSettings::MODBUS_DEFAULT)
        })
    }

    /// The configuration of our line to its only line.
    pub(crate) fn config(&self) -> Result<LineConfig, Error> {
        self.configs().next().ok_or_else(|| "the simulator has no line".into())
    }

    /// Orders something of the simulator.
    pub(crate) fn order(&mut self, order: &Order) -> Result<Report, Error> {
        let orders = self.orders.as_mut().ok_or("the simulator has no input")?;
        let line = serde_json::to_string(order)?;
        orders.write_all(format!("{line}\n").as_bytes())?;
        self.report()
    }

    /// The numbers of the only line since they were last taken.
    pub(crate) fn take(&mut self) -> Result<Counted, Error> {
        Ok(self.order(&Order::Take)?.counted.first().copied().ok_or("the simulator has no line")?)
    }

    fn report(&mut self) -> Result<Report, Error> {
        let mut line = String::new();
        if self.reports.read_line(&mut line)? == 0 {
            return Err("the simulator has ended".into());
        }
        Ok(serde_json::from_str(&line)?)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // The end of its input is its end; it removes its links itself.
        self.orders = None;
        let _ = self.process.wait();
    }
}

/// A runtime for a master that is measured: one thread, as in a program that has little else to do.
pub(crate) fn runtime() -> Result<Runtime, Error> {
    Ok(tokio::runtime::Builder::new_current_thread().enable_all().build()?)
}

/// A runtime whose clock passes only while nobody has anything to do.
pub(crate) fn virtual_runtime() -> Result<Runtime, Error> {
    Ok(tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build()?)
}

/// The time of one exchange of a read on the wire: request, turnaround, answer.
pub(crate) fn exchange(turnaround: Duration) -> Duration {
    let serial = SerialSettings::MODBUS_DEFAULT;
    serial.characters(8) + turnaround + serial.characters(5 + 2 * usize::from(QUANTITY))
}
