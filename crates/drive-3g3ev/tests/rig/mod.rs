//! Two ways to look at the drive: a simulated 3G3EV behind a real line whose frames are kept, and a bank of words that
//! says how it was asked.

#![allow(dead_code, reason = "each test file uses its part")]

use std::{
    collections::{BTreeMap, VecDeque},
    io,
    sync::{Arc, Mutex},
};

use async_trait::async_trait;
use drive_3g3ev::{CAPABILITIES, Drive3g3ev};
use drive_bus::{Line, LineConfig, Slave, config::SlaveSettings};
use drive_core::{Class, Port, PortError, SlaveAddress, Terms};
use drive_sim::{SimLine, SimSlave, Wiring, models::drive_3g3ev::Drive3g3ev as Model};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_modbus::{ExceptionCode, Request, Response, client::Client, slave::SlaveContext};

/// A number for "fault reset" in n06 to n08. The manual prints none, so the tests take one that nobody else would.
pub(crate) const RESET: u16 = 77;

pub(crate) fn address(number: u8) -> SlaveAddress {
    SlaveAddress::try_from(number).unwrap()
}

/// Frames as they crossed the wire, whole, in both directions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frames(Arc<Mutex<Vec<String>>>);

impl Frames {
    fn add(&self, bytes: &[u8]) {
        self.0.lock().unwrap().push(bytes.iter().map(|byte| format!("{byte:02X}")).collect());
    }

    /// What has crossed since this was last called, in hexadecimal.
    pub(crate) fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

/// Simulated drives at the first addresses of a line at the family's factory speed.
pub(crate) struct Rig {
    pub(crate) line: Line,
    pub(crate) sim: SimLine,
    pub(crate) machines: Vec<SimSlave>,
    pub(crate) frames: Frames,
}

impl Rig {
    pub(crate) fn new(models: impl IntoIterator<Item = Model>) -> Self {
        let sim = SimLine::new(Wiring::rtu(CAPABILITIES.factory));
        let mut config = LineConfig::stream(CAPABILITIES.factory);
        let mut machines = Vec::new();
        for (number, model) in (1..).zip(models) {
            machines.push(sim.add(number, model).unwrap());
            let settings = SlaveSettings { turnaround: CAPABILITIES.turnaround, ..SlaveSettings::default() };
            config = config.slave(number, settings);
        }
        let frames = Frames::default();
        let (ours, theirs) = tokio::io::duplex(4_096);
        drop(tokio::spawn(relay(theirs, sim.in_memory(), frames.clone())));
        Self { line: Line::over(ours, config), sim, machines, frames }
    }

    pub(crate) fn drive(&self, number: u8) -> Drive3g3ev<Slave> {
        Drive3g3ev::new(self.line.slave(number), address(number)).with_fault_reset_function(RESET)
    }
}

/// Passes frames on and keeps them.
async fn relay(mut master: DuplexStream, mut slaves: DuplexStream, frames: Frames) {
    let (mut request, mut answer) = ([0; 512], [0; 512]);
    loop {
        let (len, to_slaves) = tokio::select! {
            len = master.read(&mut request) => (len.unwrap(), true),
            len = slaves.read(&mut answer) => (len.unwrap(), false),
        };
        if len == 0 {
            return;
        }
        let (bytes, peer) =
            if to_slaves { (&request[..len], &mut slaves) } else { (&answer[..len], &mut master) };
        frames.add(bytes);
        peer.write_all(bytes).await.unwrap();
    }
}

/// One drive at address 1, and the machine beside it.
pub(crate) fn one() -> (Drive3g3ev<Slave>, SimSlave, Rig) {
    let rig = Rig::new([Model::new().with_fault_reset_function(RESET)]);
    let machine = rig.machines[0].clone();
    machine.poke(0x0107, RESET);
    (rig.drive(1), machine, rig)
}

/// A request that a [`Words`] port was asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Asked {
    Read(Class, u16, u16),
    Write(Class, u16, Vec<u16>),
    LoopBack(Class),
}

/// A drive that is nothing but words: what is written stands there, what is not there is 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Words {
    pub(crate) words: BTreeMap<u16, u16>,
    pub(crate) asked: Vec<Asked>,
    /// What becomes of the next writes: the failure that their caller sees, and whether they arrive all the same.
    pub(crate) writes: VecDeque<Option<(PortError, bool)>>,
    /// Confirms writes and does nothing.
    pub(crate) deaf: bool,
    /// Registers that answer this exception.
    pub(crate) refused: BTreeMap<u16, u8>,
    terms: Terms,
}

impl Words {
    /// A drive that stands ready, commanded by the bus, from the factory.
    pub(crate) fn ready() -> Self {
        Self::with(&[(0x20, 0x04), (0x2C, 0x0142), (0x0102, 5)])
    }

    /// A drive that runs.
    pub(crate) fn running() -> Self {
        Self::with(&[(0x20, 0x05), (0x2C, 0x0065), (0x24, 500), (0x0102, 5), (0x0001, 1)])
    }

    pub(crate) fn with(words: &[(u16, u16)]) -> Self {
        Self { words: words.iter().copied().collect(), ..Self::default() }
    }

    pub(crate) fn drive(self) -> Drive3g3ev<Self> {
        Drive3g3ev::new(self, address(1))
    }

    /// What was written, in order.
    pub(crate) fn written(&self) -> Vec<(u16, u16)> {
        let one = |asked: &Asked| match asked {
            Asked::Write(_, at, values) => values.first().map(|&value| (*at, value)),
            Asked::Read(..) | Asked::LoopBack(_) => None,
        };
        self.asked.iter().filter_map(one).collect()
    }

    fn read(&self, first: u16, count: u16) -> Result<Response, ExceptionCode> {
        let registers = first..first + count;
        if let Some(code) = registers.clone().find_map(|register| self.refused.get(&register)) {
            return Err(ExceptionCode::new(*code));
        }
        let values = registers.map(|register| self.words.get(&register).copied().unwrap_or(0));
        Ok(Response::ReadHoldingRegisters(values.collect()))
    }

    fn write(&mut self, first: u16, values: &[u16]) -> tokio_modbus::Result<Response> {
        let fate = self.writes.pop_front().flatten();
        if !self.deaf && fate.as_ref().is_none_or(|(_, arrives)| *arrives) {
            self.words.extend((first..).zip(values.iter().copied()));
        }
        match fate {
            Some((problem, _)) => Err(tokio_modbus::Error::Transport(problem.into_io())),
            None => Ok(Ok(Response::WriteMultipleRegisters(first, values.len() as u16))),
        }
    }
}

impl Port for Words {
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
    }
}

impl SlaveContext for Words {
    fn set_slave(&mut self, _: tokio_modbus::Slave) {}
}

#[async_trait]
impl Client for Words {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let class = self.terms.class;
        match request {
            Request::ReadHoldingRegisters(first, count) => {
                assert!(count <= 8);
                self.asked.push(Asked::Read(class, first, count));
                Ok(self.read(first, count))
            }
            Request::WriteMultipleRegisters(first, values) => {
                assert!(values.len() <= 8);
                self.asked.push(Asked::Write(class, first, values.to_vec()));
                self.write(first, &values)
            }
            Request::Custom(0x08, data) => {
                self.asked.push(Asked::LoopBack(class));
                Ok(Ok(Response::Custom(0x08, data.into_owned().into())))
            }
            other => panic!("a 3G3EV has no function {:02X}h", other.function_code().value()),
        }
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}
