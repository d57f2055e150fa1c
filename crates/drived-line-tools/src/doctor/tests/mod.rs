//! Each defect is built into a simulated line as the real thing behaves, and the doctor has to find it and nothing else.

mod defects;
mod healthy;
mod heard;

use std::time::Duration;

use drive_bus::{Line, LineConfig, listen::Listener};
use drive_core::{
    SlaveAddress,
    serial::{CharacterFormat, SerialSettings},
};
use drive_families::{Family, SetUp, simulated};
use drive_sim::{SimLine, SimSlave, Wiring};

use super::{
    judge::judge,
    observations::{Adapter, Observations},
    observe::{self, Task, Ways},
    verdict::{Defect, Verdict},
};
use drived_words::{drive_spec::DriveName, failure::Failure, line_spec};

/// A simulated line in memory.
struct InMemory(SimLine);

impl Ways for InMemory {
    async fn open(&self, config: LineConfig) -> Result<Line, Failure> {
        Ok(Line::over(self.0.in_memory_at(config.serial), config))
    }

    async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure> {
        Listener::over(self.0.in_memory_at(config.serial), config)
            .map_err(|error| Failure::Input(error.to_string()))
    }

    fn adapter(&self) -> Adapter {
        Adapter::default()
    }
}

/// A line with drives, and what they are called.
struct Bench {
    line: SimLine,
    names: Vec<DriveName>,
    machines: Vec<SimSlave>,
    serial: SerialSettings,
}

impl Bench {
    /// Drives of these families at 1, 2, 3 and so on, at 19200 bit/s in a format that all of them have.
    fn of(families: &[Family]) -> Self {
        let serial = SerialSettings::new(19_200, CharacterFormat::F8N1).unwrap();
        Self::at(serial, families)
    }

    fn at(serial: SerialSettings, families: &[Family]) -> Self {
        let line = SimLine::new(Wiring::rtu(serial));
        let mut bench = Self { line, names: Vec::new(), machines: Vec::new(), serial };
        for (family, number) in families.iter().zip(1..) {
            let machine =
                bench.line.add_boxed(number, simulated::model(*family, SetUp::Factory).unwrap()).unwrap();
            bench.machines.push(machine);
            bench.names.push(DriveName { family: *family, slave: SlaveAddress::try_from(number).unwrap() });
        }
        bench
    }

    fn machine(&self, slave: u8) -> &SimSlave {
        &self.machines[usize::from(slave) - 1]
    }

    fn task(&self, config: LineConfig, time: Duration) -> Task {
        let config = line_spec::with_turnarounds(config, &self.names);
        Task {
            config,
            expected: self.names.clone(),
            addresses: self.names.iter().map(|name| name.slave).collect(),
            wait: Duration::from_millis(100),
            time,
        }
    }

    /// What the doctor notices of the line in memory.
    async fn seen(&self, time: Duration) -> Observations {
        let task = self.task(LineConfig::stream(self.serial), time);
        let seen = observe::observe(&task, &InMemory(self.line.clone()), |_| {}, std::future::pending())
            .await
            .unwrap();
        self.nothing_was_written();
        seen
    }

    /// What it notices of the line on a pty of this name.
    #[cfg(unix)]
    async fn seen_on_pty(&self, name: &str, time: Duration) -> Observations {
        let link = std::env::temp_dir().join(format!("drived-doctor-{}-{name}", std::process::id()));
        let serving = self.line.serve_pty(&link).unwrap();
        let task = self.task(LineConfig::serial(&link, self.serial), time);
        let port = super::Port(task.config.endpoint.clone());
        let seen = observe::observe(&task, &port, |_| {}, std::future::pending()).await.unwrap();
        drop(serving);
        self.nothing_was_written();
        seen
    }

    /// No slave has taken a request that writes.
    fn nothing_was_written(&self) {
        for machine in &self.machines {
            for write in [0x05, 0x06, 0x0F, 0x10, 0x16, 0x17] {
                assert_eq!(machine.requests(write), 0, "function {write:02X}h");
            }
        }
    }
}

fn defects(verdicts: &[Verdict]) -> Vec<(Defect, Vec<u8>)> {
    verdicts.iter().map(|verdict| (verdict.defect, verdict.slaves.clone())).collect()
}

/// Verdicts as a failed test shows them.
fn told(seen: &Observations) -> String {
    let diagnosis = super::report::Diagnosis { date: String::new(), verdicts: judge(seen), seen };
    diagnosis.to_string()
}
