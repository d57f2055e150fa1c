//! One simulated drive at address 1 of a line, in virtual time.

use drive_bus::{Line, LineConfig, Slave, SlaveSettings};
use drive_core::{BroadcastWrite, Capabilities, Direction, Drive, Frequency, Result, SlaveAddress, Status};
use drive_sim::{Model, Panel, SimLine, SimSlave, Wiring};
use tokio_modbus::{Request, client::Client};

use crate::truth::Judged;

/// An address of a slave.
///
/// # Panics
/// When it is none.
#[must_use]
pub fn address(number: u8) -> SlaveAddress {
    SlaveAddress::try_from(number).expect("it is an address")
}

/// The drive that `open` makes, the machine that it talks to, and the line between, at the family's factory speed. What the drive
/// says of its motor is held against the machine.
///
/// # Panics
/// When the line itself is wrong.
pub fn on_a_line<D: Drive>(
    capabilities: &Capabilities,
    model: impl Model + 'static,
    open: impl FnOnce(Slave, SlaveAddress) -> D,
) -> (Judged<D>, SimSlave, Line) {
    let simulated = SimLine::new(Wiring::rtu(capabilities.factory));
    let machine = simulated.add(1, model).expect("the address is free");
    let pause = SlaveSettings { turnaround: capabilities.turnaround, ..SlaveSettings::default() };
    let config = LineConfig::stream(capabilities.factory).slave(1, pause);
    let line = Line::over(simulated.in_memory(), config);
    (Judged::new(open(line.slave(1), address(1)), machine.clone()), machine, line)
}

/// Starts a drive forward and waits until its machine runs at 50 Hz. A machine that trips for want of messages sooner
/// needs another way.
///
/// # Panics
/// When the drive does not start.
pub async fn run_at_fifty(drive: &mut Judged<impl Drive>, machine: &SimSlave) {
    drive.set_setpoint(Frequency::from_hertz(50).into()).await.expect("it takes 50 Hz");
    drive.start(Direction::Forward).await.expect("it starts");
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
}

/// Starts a drive forward, and has somebody at its panel take the start back as soon as the machine runs; how the start
/// ends.
///
/// # Errors
/// The start's.
pub async fn start_taken_back(
    drive: &mut Judged<impl Drive>,
    machine: &SimSlave,
    panel: Panel,
) -> Result<Status> {
    let taken_back = async {
        machine.wait_until(|seen| seen.running).await;
        machine.panel(panel);
    };
    let (started, ()) = tokio::join!(drive.start(Direction::Forward), taken_back);
    started
}

/// The words that were written to a register, in order.
#[must_use]
pub fn written(machine: &SimSlave, register: u16) -> Vec<u16> {
    let word = |pdu: &[u8], at: usize| Some(u16::from_be_bytes([*pdu.get(at)?, *pdu.get(at + 1)?]));
    let write = |pdu: &[u8]| match (pdu.first()?, word(pdu, 1)?) {
        (0x06, at) if at == register => word(pdu, 3),
        (0x10, first) => {
            let index = usize::from(register.checked_sub(first)?);
            (index < usize::from(word(pdu, 3)?)).then(|| word(pdu, 6 + 2 * index))?
        }
        _ => None,
    };
    machine.received().iter().filter_map(|request| write(&request.pdu)).collect()
}

/// How many requests wrote something.
#[must_use]
pub fn writes(machine: &SimSlave) -> u64 {
    machine.requests(0x06) + machine.requests(0x10)
}

/// Somebody else on the line writes a register.
///
/// # Panics
/// When the slave does not take it.
pub async fn write(line: &Line, register: u16, value: u16) {
    assert!(write_to(line, 1, register, value).await, "it takes the value");
}

/// Somebody else on the line writes a register of this slave; whether it took the value.
///
/// # Panics
/// When the slave does not answer.
pub async fn write_to(line: &Line, slave: u8, register: u16, value: u16) -> bool {
    let answer = line.slave(slave).call(Request::WriteSingleRegister(register, value)).await;
    answer.expect("it answers").is_ok()
}

/// A write to everybody.
///
/// # Panics
/// When it is not sent.
pub async fn broadcast(line: &Line, write: BroadcastWrite) {
    let BroadcastWrite { function, register, value } = write;
    let request = match function {
        0x06 => Request::WriteSingleRegister(register, value),
        0x10 => Request::WriteMultipleRegisters(register, vec![value].into()),
        other => panic!("nothing is broadcast by function {other:02X}h"),
    };
    line.broadcast().call(request).await.expect("it is sent").expect("nobody answers");
}
