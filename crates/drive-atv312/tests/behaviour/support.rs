//! A drive on a simulated line.

use drive_atv312::{Atv312, CAPABILITIES, ROWS};
use drive_bus::{Line, Slave};
use drive_core::{Error, Frequency, Refusal, Row, Setpoint};
use drive_sim::{SimSlave, models};
use drive_testing::{bench, truth::Judged};

pub(crate) const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));

/// A drive that is set up for the bus.
pub(crate) fn rig() -> (Judged<Atv312<Slave>>, SimSlave, Line) {
    bench::on_a_line(&CAPABILITIES, models::atv312::Atv312::under_bus_control(), Atv312::new)
}

/// A drive as it leaves the factory.
pub(crate) fn factory() -> (Judged<Atv312<Slave>>, SimSlave, Line) {
    bench::on_a_line(&CAPABILITIES, models::atv312::Atv312::new(), Atv312::new)
}

/// A drive that runs at 50 Hz.
pub(crate) async fn running() -> (Judged<Atv312<Slave>>, SimSlave, Line) {
    let (mut drive, machine, line) = rig();
    bench::run_at_fifty(&mut drive, &machine).await;
    (drive, machine, line)
}

pub(crate) fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

pub(crate) fn commands(machine: &SimSlave) -> Vec<u16> {
    bench::written(machine, row("CMD").address)
}

pub(crate) fn refusal(error: &Error) -> Option<Refusal> {
    match error {
        Error::Refused { reason, .. } => Some(*reason),
        _ => None,
    }
}
