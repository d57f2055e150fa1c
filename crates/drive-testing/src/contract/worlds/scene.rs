//! A drive in a plant: the simulated machine with its world, the drive that commands it, and a twin of the machine that
//! lives in the same world and hears nothing from this side. What the twin does too, the plant has done.

use std::time::Duration;

use drive_bus::{Line, LineConfig, SlaveSettings};
use drive_core::{Capabilities, Direction, Drive, Frequency, StopMode, registers::Row};
use drive_sim::{ControlError, Observation, Panel, SimLine, SimSlave, Wiring};
use tokio::time::{Instant, sleep};

use super::Configuration;
use crate::{bench::address, truth::contradiction};

/// Where the drive is.
const ADDRESS: u8 = 1;
/// How often the drive is asked while time passes, so that no watchdog trips.
const POLL: Duration = Duration::from_millis(400);

/// A drive, its machine and its twin.
pub struct Scene {
    /// The drive as a user holds it.
    pub drive: Box<dyn Drive>,
    /// The machine as somebody beside it sees it.
    pub machine: SimSlave,
    /// The line that the drive is on.
    pub line: Line,
    simulated: SimLine,
    twin: Twin,
}

/// What is around a drive and its twin.
pub struct Around {
    both: [(SimLine, String); 2],
}

impl Around {
    /// As [`Scene::happens`].
    ///
    /// # Panics
    /// When the simulator does not know it.
    pub fn happens(&self, deed: &str) {
        for (line, machine) in &self.both {
            match line.control(&format!("{machine} {deed}")) {
                // Another master writes, and the drive refuses: that is what happens then.
                Ok(_) | Err(ControlError::Refused(_)) => {}
                Err(error) => panic!("{machine} {deed}: {error}"),
            }
        }
    }
}

/// The same machine on a line of its own.
struct Twin {
    machine: SimSlave,
    simulated: SimLine,
    drive: Box<dyn Drive>,
}

impl Scene {
    /// A machine and its twin, each set up as this configuration says, in a quiet world.
    ///
    /// # Panics
    /// When the scene itself is wrong, or the simulator does not know a setting.
    #[must_use]
    pub fn new(capabilities: &Capabilities, configuration: &Configuration) -> Self {
        let (simulated, machine, line, drive) = stage(capabilities, configuration);
        let (twin_line, twin_machine, _, twin_drive) = stage(capabilities, configuration);
        let twin = Twin { machine: twin_machine, simulated: twin_line, drive: twin_drive };
        let scene = Self { drive, machine, line, simulated, twin };
        configuration.settings.iter().for_each(|setting| scene.happens(setting));
        scene
    }

    /// Has something happen around the drive, and around its twin: a line of the simulator's text without the drive's
    /// name.
    ///
    /// # Panics
    /// When the simulator does not know it.
    pub fn happens(&self, deed: &str) {
        self.around().happens(deed);
    }

    /// What is around both, for who makes something happen while a command is under way.
    #[must_use]
    pub fn around(&self) -> Around {
        let both = [(&self.simulated, &self.machine), (&self.twin.simulated, &self.twin.machine)];
        Around { both: both.map(|(line, machine)| (line.clone(), machine.name())) }
    }

    /// Sets a setting at the drive and at its twin. False: it does not take the value.
    #[must_use]
    pub fn is_set_to(&self, row: &Row, value: u16) -> bool {
        self.machine.poke(row.address, value) && self.twin.machine.poke(row.address, value)
    }

    /// Somebody at the twin's panel resets its fault, as this side has reset the drive's.
    pub fn twin_is_reset(&self) {
        self.twin.machine.panel(Panel::Reset);
    }

    /// Starts the twin at another setpoint by a side of its own, and stops it.
    pub async fn run_twin(&mut self, hertz: u16) {
        let drive = &mut self.twin.drive;
        // Where the bus decides nothing there is nothing to leave behind.
        let _ = drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
        let _ = drive.start(Direction::Forward).await;
        let _ = drive.stop(StopMode::Ramp).await;
    }

    /// Gives the control of the twin back, by a side of its own. False: it is refused.
    pub async fn release_twin(&mut self) -> bool {
        self.twin.drive.release().await.is_ok()
    }

    /// Lets time pass with the drive asked all the while, as a plant does. Whether it was said at last that its run command is in
    /// force.
    ///
    /// # Errors
    /// What a status says that the machine contradicts.
    pub async fn live(&mut self, time: Duration) -> Result<bool, String> {
        let end = Instant::now() + time;
        let mut in_force = false;
        while Instant::now() < end {
            // Whether it says anything is nobody's concern here.
            if let Ok(status) = self.drive.status().await {
                contradiction(&status, &self.seen()).map_or(Ok(()), Err)?;
                in_force = status.verdict.is_some_and(|verdict| verdict.is_in_force());
            }
            let _ = self.twin.drive.status().await;
            sleep(POLL).await;
        }
        Ok(in_force)
    }

    /// What the machine does.
    #[must_use]
    pub fn seen(&self) -> Observation {
        self.machine.observe()
    }

    /// What the twin does in the same world without this side.
    #[must_use]
    pub fn twin(&self) -> Observation {
        self.twin.machine.observe()
    }

    /// How often something was written to the drive.
    #[must_use]
    pub fn writes(&self) -> u64 {
        [0x06, 0x10].into_iter().map(|function| self.machine.requests(function)).sum()
    }
}

fn stage(
    capabilities: &Capabilities,
    configuration: &Configuration,
) -> (SimLine, SimSlave, Line, Box<dyn Drive>) {
    let simulated = SimLine::new(Wiring::rtu(capabilities.factory));
    let machine = simulated.add_boxed(ADDRESS, (configuration.machine)()).expect("the address is free");
    let pause = SlaveSettings { turnaround: capabilities.turnaround, ..SlaveSettings::default() };
    let config = LineConfig::stream(capabilities.factory).slave(ADDRESS, pause);
    let line = Line::over(simulated.in_memory(), config);
    let drive = (configuration.open)(Box::new(line.slave(ADDRESS)), address(ADDRESS));
    (simulated, machine, line, drive)
}
