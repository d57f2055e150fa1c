//! A line with one drive at address 1, and the machine beside it.

use drive_atv312::{Atv312, ROWS};
use drive_bus::{Line, LineConfig, Slave};
use drive_core::{BroadcastWrite, Direction, Drive, Frequency, Row, SerialSettings, Setpoint, SlaveAddress};
use drive_sim::{SimLine, SimSlave, Wiring, models};
use tokio_modbus::{client::Context, prelude::Writer};

/// A drive that is set up for the bus.
pub(crate) fn rig() -> (Atv312<Slave>, SimSlave, Line) {
    with(models::atv312::Atv312::under_bus_control())
}

/// A drive as it leaves the factory.
pub(crate) fn factory() -> (Atv312<Slave>, SimSlave, Line) {
    with(models::atv312::Atv312::new())
}

/// A drive that runs at 50 Hz.
pub(crate) async fn running() -> (Atv312<Slave>, SimSlave, Line) {
    let (mut drive, machine, line) = rig();
    drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(50))).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    (drive, machine, line)
}

fn with(model: models::atv312::Atv312) -> (Atv312<Slave>, SimSlave, Line) {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let sim = SimLine::new(Wiring::rtu(settings));
    let machine = sim.add(1, model).unwrap();
    let line = Line::over(sim.in_memory(), LineConfig::stream(settings));
    let drive = Atv312::new(line.slave(1), SlaveAddress::try_from(1).unwrap());
    (drive, machine, line)
}

pub(crate) fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

/// The words that were written to CMD.
pub(crate) fn commands(machine: &SimSlave) -> Vec<u16> {
    let received = machine.received();
    let writes = received.iter().filter(|request| request.pdu.starts_with(&[0x06, 0x21, 0x35]));
    writes.map(|request| u16::from_be_bytes([request.pdu[3], request.pdu[4]])).collect()
}

/// How many writes it got.
pub(crate) fn writes(machine: &SimSlave) -> u64 {
    machine.requests(0x06) + machine.requests(0x10)
}

/// Somebody else on the line writes a register.
pub(crate) async fn write(line: &Line, address: u16, value: u16) {
    let mut context: Context = line.slave(1).into();
    context.write_single_register(address, value).await.unwrap().unwrap();
}

/// A write to everybody.
pub(crate) async fn broadcast(line: &Line, write: BroadcastWrite) {
    assert_eq!(write.function, 0x06);
    let mut context: Context = line.broadcast().into();
    context.write_single_register(write.register, write.value).await.unwrap().unwrap();
}
