//! The drive that a supervisor is fuzzed by. Its driver never lies.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use async_trait::async_trait;
use drive_core::{
    Capabilities, Command, Control, Direction, Drive, Error, Faults, Identity, Lease, Lifetimes,
    Measurements, PortError, Refusal, Result, Row, Setpoint, SlaveAddress, Status, StopMode, Stopped,
    Verdict, Withdrawn, Written,
};
use drive_families::Family;
use tokio::time::{Instant, sleep};

use super::{
    locked,
    truth::{Fate, LIMIT, Truth, port, slave},
};

/// The word by which it is started.
const RUN: u16 = 15;

/// The drive.
pub(super) struct Puppet {
    truth: Arc<Mutex<Truth>>,
    slave: SlaveAddress,
    lifetimes: Lifetimes,
}

impl Puppet {
    pub(super) fn new(truth: Arc<Mutex<Truth>>, slave: SlaveAddress) -> Self {
        Self { truth, slave, lifetimes: Lifetimes::default() }
    }

    /// Each exchange has its time.
    async fn passes(&self) {
        let time = {
            let mut truth = locked(&self.truth);
            if truth.calm { 20 } else { [20, 20, 20, 300][truth.source.usize(..4)] }
        };
        sleep(Duration::from_millis(time)).await;
    }

    /// A write: what it does where it is carried out.
    async fn write(&self, command: Command, does: impl FnOnce(&mut Truth) + Send) -> Result<()> {
        self.passes().await;
        let mut truth = locked(&self.truth);
        let truth = &mut *truth;
        let fate = truth.writes();
        if !truth.control {
            truth.object("what is only watched is written");
        }
        match fate {
            Fate::Fails(error) => Err(error),
            Fate::Unshown => {
                // It was not carried out, or others took the drive as it was.
                if truth.source.bool() {
                    truth.taken = true;
                    does(truth);
                }
                Err(truth.not_confirmed(command))
            }
            Fate::LostAnswer => {
                does(truth);
                Err(port(PortError::OutcomeUnknown("no answer"), 6))
            }
            Fate::Done => {
                does(truth);
                Ok(())
            }
        }
    }
}

#[async_trait]
impl Drive for Puppet {
    fn slave(&self) -> SlaveAddress {
        self.slave
    }

    fn capabilities(&self) -> &'static Capabilities {
        Family::BUILT_IN[0].capabilities()
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        &mut self.lifetimes
    }

    fn forget(&mut self) {}

    fn lease(&self) -> Option<Lease> {
        locked(&self.truth).lease
    }

    fn adopt(&mut self, lease: Lease) {
        let mut truth = locked(&self.truth);
        truth.lease = Some(lease).filter(|_| truth.runs());
    }

    async fn status(&mut self) -> Result<Status> {
        self.passes().await;
        let mut truth = locked(&self.truth);
        truth.reads()?;
        Ok(truth.status())
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.passes().await;
        locked(&self.truth).reads().map(|()| Measurements::default())
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.passes().await;
        locked(&self.truth).reads().map(|()| Faults::default())
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        {
            let mut truth = locked(&self.truth);
            truth.is_started();
            if truth.tripped || truth.taken {
                let reason =
                    if truth.tripped { Refusal::Tripped } else { Refusal::NotInControl(Control::Terminals) };
                return Err(Error::Refused { slave: slave(), command: Command::Start(direction), reason });
            }
            // It stands from when it may be on its way.
            truth.lease = Some(Lease::new(direction, RUN));
        }
        let command = Command::Start(direction);
        let written = self.write(command, |truth| {
            truth.note("started");
            truth.run_is_written(direction);
            truth.carried.push(Instant::now());
            truth.run = Some((direction, Instant::now())).filter(|_| !truth.tripped);
            truth.stopped_at = None;
        });
        written.await?;
        let mut truth = locked(&self.truth);
        let status = truth.status();
        if status.verdict == Some(Verdict::InForce) { Ok(status) } else { Err(truth.not_confirmed(command)) }
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        let stopped = self.write(Command::Stop(mode), |truth| {
            truth.note("stopped");
            truth.ends_run();
            truth.stopped_at = Some(Instant::now());
        });
        stopped.await?;
        Ok(Stopped::by(mode, locked(&self.truth).status()))
    }

    async fn withdraw(&mut self) -> Result<Withdrawn> {
        let stood = locked(&self.truth).runs();
        if !stood {
            return self.status().await.map(Withdrawn::Nothing);
        }
        self.write(Command::Withdraw, Truth::ends_run).await?;
        Ok(Withdrawn::Ended(locked(&self.truth).status()))
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let Setpoint::Frequency(frequency) = setpoint else { return Err(Error::no_share()) };
        if frequency > LIMIT {
            locked(&self.truth).object("a setpoint is written that its owner forbids");
        }
        self.write(Command::Setpoint(setpoint), |truth| truth.reference = frequency).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        let reset = self.write(Command::ResetFaults, |truth| {
            truth.resets += 1;
            truth.tripped = false;
        });
        reset.await?;
        Ok(locked(&self.truth).status())
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.passes().await;
        let mut truth = locked(&self.truth);
        truth.reads()?;
        let is_another = truth.is_another;
        let first = truth.identities.map_or(is_another, |(first, _)| first);
        truth.identities = Some((first, is_another));
        let model = if is_another { "another" } else { "one" };
        Ok(Identity { model: Some(model.to_owned()), ..Identity::default() })
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.passes().await;
        locked(&self.truth).reads()
    }

    async fn read_parameter(&mut self, _: &'static Row) -> Result<u16> {
        self.passes().await;
        locked(&self.truth).reads().map(|()| 0)
    }

    async fn write_parameter(&mut self, row: &'static Row, _: u16) -> Result<Written> {
        let Row { address, code, access, .. } = *row;
        Err(Error::AccessForbidden { slave: slave(), register: address, code, access })
    }
}
