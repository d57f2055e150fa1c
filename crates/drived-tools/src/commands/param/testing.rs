//! One simulated drive in virtual time, as the subcommands meet it on a line.

use drive_bus::{Line, LineConfig, SlaveSettings};
use drive_core::SlaveAddress;
use drive_families::{Family, SetUp, simulated};
use drive_sim::{SimLine, SimSlave, Wiring};

use super::source::Source;
use crate::one_drive::OneDrive;
use drived_words::drive_spec::DriveName;

/// A drive of a family on its own line.
pub(super) struct Bench {
    pub source: Source,
    pub machine: SimSlave,
}

impl Bench {
    pub(super) fn of(family: Family, set_up: SetUp) -> Self {
        Self::taken_for(family, family, set_up)
    }

    /// The same, which a person takes for one of another family.
    pub(super) fn taken_for(taken_for: Family, family: Family, set_up: SetUp) -> Self {
        let settings = family.capabilities().factory;
        let simulated = SimLine::new(Wiring::rtu(settings));
        let machine = simulated.add_boxed(1, simulated::model(family, set_up).unwrap()).unwrap();
        let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
        let line = Line::over(simulated.in_memory(), config.clone());
        let turnaround = family.capabilities().turnaround;
        line.configure_slave(1, SlaveSettings { turnaround, ..SlaveSettings::default() });
        let name = DriveName { family: taken_for, slave: SlaveAddress::try_from(1).unwrap() };
        let one = OneDrive::over(name, line, config, &simulated::options());
        Self { source: Source::OnLine(Box::new(one)), machine }
    }
}
