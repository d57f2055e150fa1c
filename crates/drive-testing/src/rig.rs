//! A drive, the simulated machine that it talks to, and the line between, in virtual time.

use std::time::Duration;

use drive_bus::{Line, LineConfig, Protocol, SlaveSettings};
use drive_core::{Drive, Frequency, SerialSettings, SlaveAddress, Status};
use drive_sim::{Model, Observation, SimLine, SimSlave, Wiring};
use tokio::time::{Instant, sleep, timeout_at};

use crate::truth::contradiction;

/// Where the drive is.
pub const ADDRESS: u8 = 5;

/// How long anything may take here, in virtual time; a ramp takes seconds.
const PATIENCE: Duration = Duration::from_secs(120);

/// A drive, the line between, and the simulated machine.
pub struct Rig {
    /// The drive as a user holds it.
    pub drive: Box<dyn Drive>,
    /// The machine as somebody beside it sees it.
    pub machine: SimSlave,
    /// The simulated line.
    pub simulated: SimLine,
    /// The line that the drive is on.
    pub line: Line,
}

impl Rig {
    /// A machine on a line that speaks this protocol with these characters, and the drive that `open` makes for it. The line
    /// keeps the pause that the family needs after each answer.
    ///
    /// # Panics
    /// Only when the rig itself is wrong, or the protocol does not have these characters.
    #[must_use]
    pub fn new(
        protocol: Protocol,
        settings: SerialSettings,
        machine: Box<dyn Model>,
        open: impl FnOnce(drive_bus::Slave, SlaveAddress) -> Box<dyn Drive>,
    ) -> Self {
        protocol.check(settings).expect("the protocol has these characters");
        let spoken = match protocol {
            Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
            Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
            _ => drive_sim::Protocol::Rtu,
        };
        let simulated = SimLine::new(Wiring { protocol: spoken, ..Wiring::rtu(settings) });
        let machine = simulated.add_boxed(ADDRESS, machine).expect("the address is free");
        let line = Line::over(simulated.in_memory(), LineConfig { protocol, ..LineConfig::stream(settings) });
        let slave = SlaveAddress::try_from(ADDRESS).expect("it is one");
        let drive = open(line.slave(ADDRESS), slave);
        let turnaround = drive.capabilities().turnaround;
        line.configure_slave(ADDRESS, SlaveSettings { turnaround, ..SlaveSettings::default() });
        Self { drive, machine, simulated, line }
    }

    /// Polls the drive until its own status is so. A drive that is not polled would trip by its watchdog. Each status is held against
    /// the machine.
    ///
    /// # Panics
    /// When that does not come in two minutes of virtual time, and when a status says what the machine contradicts.
    pub async fn until(&mut self, what: &str, is_so: impl Fn(&Status) -> bool) -> Status {
        self.until_both(what, |status, _| is_so(status)).await
    }

    /// Polls the drive until the machine itself is seen to be so.
    ///
    /// # Panics
    /// As [`until`](Self::until).
    pub async fn until_machine(&mut self, what: &str, is_so: impl Fn(&Observation) -> bool) -> Status {
        self.until_both(what, |_, machine| is_so(machine)).await
    }

    /// Polls the drive for a while.
    ///
    /// # Panics
    /// When it does not answer at the end of it.
    pub async fn poll_for(&mut self, time: Duration) {
        let end = Instant::now() + time;
        self.until("time passes", |_| Instant::now() >= end).await;
    }

    async fn until_both(&mut self, what: &str, is_so: impl Fn(&Status, &Observation) -> bool) -> Status {
        let end = Instant::now() + PATIENCE;
        let mut last = None;
        loop {
            match timeout_at(end, self.drive.status()).await {
                Ok(Ok(status)) => {
                    let machine = self.machine.observe();
                    assert_eq!(contradiction(&status, &machine), None, "the words against the shaft");
                    if is_so(&status, &machine) {
                        return status;
                    }
                    last = Some(Ok(status));
                }
                Ok(failed) => last = Some(failed),
                Err(_) => panic!("{what}: not seen; the last was {last:?}"),
            }
            sleep(Duration::from_millis(50)).await;
        }
    }

    /// Polls until the output has this frequency and the drive says that it is its reference.
    pub async fn until_at(&mut self, frequency: Frequency) -> Status {
        self.until("the reference is reached", |status| match status.output_frequency {
            Some(output) => output == frequency && status.at_reference != Some(false),
            None => status.reference == Some(frequency) && status.at_reference == Some(true),
        })
        .await
    }

    /// Polls until the drive shows standstill, or that it has cut the output of a motor that may coast.
    pub async fn until_standstill(&mut self) -> Status {
        self.until("standstill", Status::is_undriven).await
    }
}
