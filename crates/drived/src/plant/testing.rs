//! A simulated plant in virtual time, for the tests of what stands on it.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::SerialSettings;
use drive_families::Family;
use drive_fleet::{DriveSettings, Fleet};
use drive_sim::{SimLine, SimSlave, Wiring};

use super::Plant;
use crate::{
    config::Group,
    simulated::{self, SetUp},
};

/// One line, named `north`, with Altivar 312: `pump 1`, `pump 2` … in the group `pumps`.
pub(crate) struct TestPlant {
    pub(crate) plant: Plant,
    pub(crate) line: SimLine,
    pub(crate) machines: Vec<SimSlave>,
}

impl TestPlant {
    /// Drives that may be commanded.
    pub(crate) async fn of(drives: u8) -> Self {
        Self::with(drives, DriveSettings::controlled).await
    }

    /// Drives with these settings, each once it can be started or has been tried for long enough.
    pub(crate) async fn with(drives: u8, settings: impl Fn(String) -> DriveSettings) -> Self {
        let family = Family::Atv312;
        let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let config = LineConfig {
            response_timeout: Duration::from_millis(100),
            ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
        };
        let mut machines = Vec::new();
        for slave in 1..=drives {
            machines.push(line.add_boxed(slave, simulated::model(family, SetUp::ForTheBus)).unwrap());
        }
        let port = Line::over(line.in_memory(), config);
        let mut builder = Fleet::builder().whatever_the_plan().line("north", port);
        let names: Vec<String> = (1..=drives).map(|slave| format!("pump {slave}")).collect();
        for (slave, name) in (1..).zip(&names) {
            builder = builder.drive("north", slave, settings(name.clone()), |port, slave| {
                family.open_with(port, slave, &simulated::options())
            });
        }
        let fleet = builder.start().unwrap();
        let plant = Plant::start(fleet, vec![Group { name: "pumps".to_owned(), drives: names }], false);
        for drive in plant.fleet().drives() {
            let _ = drive.ready(Duration::from_secs(10)).await;
        }
        Self { plant, line, machines }
    }
}

impl Plant {
    /// No group starts before what it gives is dropped.
    pub(crate) async fn hold_group_starts(&self) -> impl Drop {
        self.0.group_starts.lock().await
    }
}
