//! The simulated plant: lines, simulated drives on them, and the fleet that supervises them.

use std::{ops::Range, sync::Arc, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{SerialSettings, SlaveAddress, serial::CharacterFormat};
use drive_families::{Family, SetUp, simulated};
use drive_fleet::{DriveSettings, ExitAction, Fleet, Periods, Times};
use drive_sim::{SimLine, Wiring};
use tokio::{sync::watch, task::AbortHandle};

use super::{STOPPING, story, unit::Unit};
use drived_config::config::Group;
use drived_http::api::demo::Stage;
use drived_words::{drive_spec::DriveName, failure::Failure};

/// Drives of each family.
const EACH: u8 = 2;

/// Simulated drives answer soon. A short limit makes the probes of a drive that restarts cheap, and so frequent.
const RESPONSE_TIMEOUT: Duration = Duration::from_millis(100);

/// As often as leaves the line room for measurements and commands.
const PERIODS: Periods = Periods {
    running: Duration::from_millis(500),
    rest: Duration::from_secs(1),
    slow: Duration::from_secs(5),
    max_age: Duration::from_secs(5),
};

/// The story gives a setpoint right behind a reset, after which an Altivar 21 is deaf for two seconds.
const LIFETIME: Duration = Duration::from_secs(3);

/// What was done to each drive at the end.
type Actions = Vec<(Arc<str>, ExitAction)>;

pub(super) struct Plant {
    pub(super) lines: Vec<PlantLine>,
    pub(super) units: Vec<Unit>,
    pub(super) fleet: Fleet,
    families: Vec<Family>,
    story: AbortHandle,
    ended: watch::Sender<Option<Actions>>,
}

pub(super) struct PlantLine {
    pub(super) settings: SerialSettings,
    pub(super) line: Line,
    simulated: SimLine,
    /// The units on it, by their place in the plant.
    pub(super) units: Range<usize>,
}

impl Plant {
    /// Builds the plant of drives of these families and sets it going.
    pub(super) fn start(families: Vec<Family>) -> Result<Self, Failure> {
        let mut lines = Vec::new();
        let mut members = Vec::new();
        let mut builder = Fleet::builder().whatever_the_plan();
        for (settings, names) in layout(&families) {
            let simulated = SimLine::new(Wiring::rtu(settings));
            let config = LineConfig {
                precise_timer: true,
                response_timeout: RESPONSE_TIMEOUT,
                ..LineConfig::stream(settings)
            };
            let first = members.len();
            for name in &names {
                let model = simulated::model(name.family, SetUp::ForTheBus);
                let model = model.map_err(|error| Failure::Input(error.to_string()))?;
                let machine = simulated.add_boxed(name.slave.number(), model);
                members.push((*name, machine.map_err(|error| Failure::Input(error.to_string()))?));
            }
            let line = Line::over(simulated.in_memory_precise(), config);
            builder = builder.line(settings.to_string(), line.clone());
            for name in names {
                let mut drive_settings =
                    DriveSettings { periods: PERIODS, ..DriveSettings::controlled(name.to_string()) };
                drive_settings.times = Times { lifetime: LIFETIME, ..drive_settings.times };
                builder = builder.drive(
                    &settings.to_string(),
                    name.slave.number(),
                    drive_settings,
                    |port, slave| name.family.open_with(port, slave, &simulated::options()),
                );
            }
            lines.push(PlantLine { settings, line, simulated, units: first..members.len() });
        }
        let fleet = builder.start().map_err(|error| Failure::Input(error.to_string()))?;
        let units: Vec<Unit> = members
            .into_iter()
            .zip(fleet.drives())
            .map(|((name, machine), handle)| Unit::new(name, machine, handle))
            .collect();
        let story = tokio::spawn(story::tell(units.clone(), fleet.clone())).abort_handle();
        Ok(Self { lines, units, fleet, families, story, ended: watch::Sender::new(None) })
    }

    /// What can be tripped and pulled by hand.
    pub(super) fn stage(&self) -> Stage {
        let machine = |unit: &Unit| {
            let code = unit.name.family.simulated_trip()?;
            Some((unit.name.to_string(), (unit.machine.clone(), code)))
        };
        let line = |line: &PlantLine| (line.settings.to_string(), line.simulated.clone());
        Stage {
            machines: self.units.iter().filter_map(machine).collect(),
            lines: self.lines.iter().map(line).collect(),
        }
    }

    /// The drives of each family, as groups.
    pub(super) fn groups(&self) -> Vec<Group> {
        let of = |family: Family| {
            let units = self.units.iter().filter(|unit| unit.name.family == family);
            Group { name: format!("all {family}"), drives: units.map(|unit| unit.name.to_string()).collect() }
        };
        self.families.iter().copied().map(of).collect()
    }

    /// Ends the story and stops every motor that it has started.
    pub(super) fn stop(&self) {
        self.story.abort();
        let (fleet, ended) = (self.fleet.clone(), self.ended.clone());
        tokio::spawn(async move { ended.send_replace(Some(fleet.shutdown(STOPPING).await)) });
    }

    /// What was done to each drive at the end, once it is.
    pub(super) fn actions(&self) -> Option<Actions> {
        self.ended.borrow().clone()
    }
}

/// The drives of each family on a line of 19200 8E1; a family that cannot be set to it has a line of its own.
fn layout(families: &[Family]) -> Vec<(SerialSettings, Vec<DriveName>)> {
    let mut lines = vec![(SerialSettings::MODBUS_DEFAULT, Vec::new())];
    let mut address = 0;
    for &family in families {
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
        let lines = layout(&Family::all());
        assert_eq!(lines[0].0, SerialSettings::MODBUS_DEFAULT);
        for family in Family::all() {
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
