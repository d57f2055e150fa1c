//! Two ways to look at the drive: a simulated 3G3EV behind a real line whose frames are kept, and one that is nothing but
//! words.

#![allow(dead_code, reason = "each test file uses its part")]

use std::sync::{Arc, Mutex};

use drive_3g3ev::{CAPABILITIES, Drive3g3ev};
use drive_bus::{Line, LineConfig, Slave, config::SlaveSettings};
use drive_sim::{SimLine, SimSlave, Wiring, models::drive_3g3ev::Drive3g3ev as Model};
use drive_testing::{bench, words::Words};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

/// A drive, each of whose words is held against its machine.
pub(crate) type Judged = drive_testing::truth::Judged<Drive3g3ev<Slave>>;

/// A number for "fault reset" in n06 to n08. The manual prints none, so the tests take one that nobody else would.
pub(crate) const RESET: u16 = 77;

/// Frames as they crossed the wire, whole, in both directions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frames(Arc<Mutex<Vec<Vec<u8>>>>);

impl Frames {
    fn add(&self, bytes: &[u8]) {
        self.0.lock().unwrap().push(bytes.to_vec());
    }

    /// What has crossed since this was last called.
    pub(crate) fn take(&self) -> Vec<Vec<u8>> {
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

    pub(crate) fn drive(&self, number: u8) -> Judged {
        let drive = Drive3g3ev::new(self.line.slave(number), bench::address(number));
        let machine = self.machines[usize::from(number) - 1].clone();
        Judged::new(drive.with_fault_reset_function(RESET), machine)
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
pub(crate) fn one() -> (Judged, SimSlave, Rig) {
    let rig = Rig::new([Model::new().with_fault_reset_function(RESET)]);
    let machine = rig.machines[0].clone();
    machine.poke(0x0107, RESET);
    (rig.drive(1), machine, rig)
}

/// A drive that stands ready, commanded by the bus, from the factory.
pub(crate) fn ready() -> Words {
    with(&[(0x20, 0x04), (0x2C, 0x0142), (0x0102, 5)])
}

/// A drive that runs.
pub(crate) fn running() -> Words {
    with(&[(0x20, 0x05), (0x2C, 0x0065), (0x24, 500), (0x0102, 5), (0x0001, 1)])
}

/// A drive that holds these words.
pub(crate) fn with(words: &[(u16, u16)]) -> Words {
    Words::new(&CAPABILITIES, words)
}

/// The driver of a drive that is nothing but words.
pub(crate) fn drive(words: Words) -> Drive3g3ev<Words> {
    Drive3g3ev::new(words, bench::address(1))
}
