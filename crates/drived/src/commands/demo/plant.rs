//! The simulated plant: lines, drives on them, and one task for each drive.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{SerialSettings, SlaveAddress, serial::CharacterFormat};
use drive_families::Family;
use drive_sim::{SimLine, Wiring};
use tokio::{
    sync::{mpsc, watch},
    task::{AbortHandle, JoinSet},
};

use super::{
    story,
    unit::{Event, Unit},
};
use crate::{
    drive_spec::DriveName,
    failure::Failure,
    line_spec, one_drive,
    simulated::{self, SetUp},
};

/// Drives of each family.
const EACH: u8 = 2;

/// Simulated drives answer soon. A short limit makes the probes of a drive that restarts cheap, and so frequent.
const RESPONSE_TIMEOUT: Duration = Duration::from_millis(100);

pub(super) struct Plant {
    pub(super) lines: Vec<PlantLine>,
    pub(super) units: Vec<Unit>,
    story: AbortHandle,
    ending: watch::Sender<bool>,
    /// The drives' tasks and the story; they end with the plant.
    _tasks: JoinSet<()>,
}

pub(super) struct PlantLine {
    pub(super) settings: SerialSettings,
    pub(super) line: Line,
    /// The units on it, by their place in the plant.
    pub(super) units: std::ops::Range<usize>,
}

impl Plant {
    /// Builds the plant and sets it going.
    pub(super) fn start(events: &mpsc::Sender<Event>) -> Result<Self, Failure> {
        let mut tasks = JoinSet::new();
        let ending = watch::Sender::new(false);
        let mut lines = Vec::new();
        let mut units: Vec<Unit> = Vec::new();
        for (settings, names) in layout() {
            let simulated = SimLine::new(Wiring::rtu(settings));
            let config = LineConfig {
                precise_timer: true,
                response_timeout: RESPONSE_TIMEOUT,
                ..LineConfig::stream(settings)
            };
            let mut machines = Vec::new();
            for name in &names {
                let machine =
                    simulated.add_boxed(name.slave.number(), simulated::model(name.family, SetUp::ForTheBus));
                machines.push(machine.map_err(|error| Failure::Input(error.to_string()))?);
            }
            let line = Line::over(simulated.in_memory_precise(), line_spec::with_turnarounds(config, &names));
            let first = units.len();
            for (name, machine) in names.into_iter().zip(machines) {
                let drive = one_drive::open_drive(&line, name, &simulated::options())?;
                units.push(Unit::start(name, machine, drive, events.clone(), ending.subscribe(), &mut tasks));
            }
            lines.push(PlantLine { settings, line, units: first..units.len() });
        }
        let story = tasks.spawn(story::tell(units.clone()));
        Ok(Self { lines, units, story, ending, _tasks: tasks })
    }

    /// Ends the story and stops every motor, whatever its drive was told before.
    pub(super) fn stop(&self) {
        self.story.abort();
        self.ending.send_replace(true);
    }
}

/// The drives of every family on a line of 19200 8E1; a family that cannot be set to it has a line of its own.
fn layout() -> Vec<(SerialSettings, Vec<DriveName>)> {
    let mut lines = vec![(SerialSettings::MODBUS_DEFAULT, Vec::new())];
    let mut address = 0;
    for family in Family::ALL {
        for _ in 0..EACH {
            address += 1;
            let Ok(slave) = SlaveAddress::try_from(address) else { continue };
            let name = DriveName { family, slave };
            let Some(settings) = settings_of(name) else { continue };
            match lines.iter_mut().find(|(line, _)| *line == settings) {
                Some((_, names)) => names.push(name),
                None => lines.push((settings, vec![name])),
            }
        }
    }
    lines
}

/// 19200 8E1 where the family has it, else the next best that it has.
fn settings_of(name: DriveName) -> Option<SerialSettings> {
    let capabilities = name.family.capabilities();
    let with = |format| SerialSettings::new(19_200, format).ok();
    let choices = [with(CharacterFormat::F8E1), with(CharacterFormat::F8N1), Some(capabilities.factory)];
    choices.into_iter().flatten().find(|&settings| capabilities.check_line(name.slave, settings).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_has_its_drives_on_a_line_that_they_can_have() {
        let lines = layout();
        assert_eq!(lines[0].0, SerialSettings::MODBUS_DEFAULT);
        for family in Family::ALL {
            let of_family = |(_, names): &(_, Vec<DriveName>)| names.iter().any(|name| name.family == family);
            assert!(lines.iter().any(of_family), "{family}");
        }
        for (settings, names) in lines {
            for name in names {
                assert_eq!(name.family.capabilities().check_line(name.slave, settings), Ok(()));
            }
        }
    }
}
