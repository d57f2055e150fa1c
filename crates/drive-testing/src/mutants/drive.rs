//! The drive of a family that breaks its contract.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Control, Direction, Drive, Error, ErrorKind, Faults, Follower, Frequency,
    Ground, Identity, Intent, KeptReadings, Lack, Lease, Lifetimes, Measurements, Motion, PortError,
    Reaction, Recognised, Refusal, Result, Row, SelfRestart, Setpoint, SlaveAddress, Status, StopMode,
    Stopped, Verdict, Watchdog, WatchdogCapability, Withdrawn, Written, registers::Place,
};

use super::{Mutant, port::Tap};

pub(super) struct Faulty {
    mutant: Mutant,
    drive: Box<dyn Drive>,
    tap: Tap,
    /// The lease is hidden from now on.
    ended: bool,
}

impl Faulty {
    pub(super) fn new(mutant: Mutant, drive: Box<dyn Drive>, tap: Tap) -> Self {
        Self { mutant, drive, tap, ended: false }
    }

    fn is(&self, mutant: Mutant) -> bool {
        self.mutant == mutant
    }

    /// What this family makes of a status.
    fn told(&self, mut status: Status) -> Status {
        if status.verdict.is_some() {
            match self.mutant {
                Mutant::AlwaysInForce => status.verdict = Some(Verdict::InForce),
                Mutant::NeverKnown => status.verdict = Some(Verdict::NotKnown),
                _ => {}
            }
        }
        if self.is(Mutant::AlwaysInForce) && self.drive.lease().is_some() {
            status.verdict = Some(Verdict::InForce);
        }
        let other_reference =
            matches!(status.verdict, Some(Verdict::NotInForce { lacks: Lack::Reference, .. }));
        if self.is(Mutant::AnyReferenceIsOurs) && other_reference {
            status.verdict = Some(Verdict::InForce);
        }
        if self.is(Mutant::NoOutputIsStandstill) && status.output_frequency == Some(Frequency::ZERO) {
            status.motion = Motion::AtRest;
        }
        if self.ended {
            status.verdict = None;
        }
        if self.is(Mutant::ControlAlwaysTheBus) && status.control.is_some() {
            status.control = Some(Control::Bus);
        }
        status
    }

    /// What this family makes of an error.
    fn blamed(&self, error: Error) -> Error {
        match error {
            Error::Port { slave, exchange, problem: PortError::OutcomeUnknown(_) }
                if self.is(Mutant::NothingWrittenSaidOfAll) && !exchange.is_write() =>
            {
                Error::Port { slave, exchange, problem: PortError::Timeout { after: Duration::ZERO } }
            }
            error => error,
        }
    }

    /// The status that an error carries, or a fresh one: a family that confirms by anything.
    async fn anything(&mut self, error: Error) -> Result<Status> {
        match error {
            Error::NotConfirmed { status, .. } => Ok(*status),
            _ => self.drive.status().await,
        }
    }
}

#[async_trait]
impl Drive for Faulty {
    fn slave(&self) -> SlaveAddress {
        self.drive.slave()
    }

    fn capabilities(&self) -> &'static Capabilities {
        self.drive.capabilities()
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        self.drive.lifetimes_mut()
    }

    fn kept_mut(&mut self) -> Option<&mut KeptReadings> {
        self.drive.kept_mut()
    }

    fn forget(&mut self) {
        if self.is(Mutant::ForgetForgetsNothing) {
            return;
        }
        self.ended |= self.is(Mutant::ForgetEndsTheLease);
        self.drive.forget();
    }

    fn lease(&self) -> Option<Lease> {
        self.drive.lease().filter(|_| !self.ended)
    }

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        self.drive.run_word_for(direction)
    }

    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        let may = self.drive.may_start(direction, setpoint).await;
        if self.is(Mutant::AnyStartMay) { Ok(()) } else { may }
    }

    fn adopt(&mut self, lease: Lease) {
        self.drive.adopt(lease);
    }

    fn take_changed(&mut self) -> Option<Ground> {
        self.drive.take_changed()
    }

    fn set_coast_time(&mut self, time: Option<Duration>) {
        self.drive.set_coast_time(time);
    }

    fn set_injection_time(&mut self, time: Option<Duration>) {
        self.drive.set_injection_time(time);
    }

    fn recognise(&self, identity: &Identity) -> Recognised {
        self.drive.recognise(identity)
    }

    fn unmet(&self) -> Option<Refusal> {
        self.drive.unmet()
    }

    async fn status(&mut self) -> Result<Status> {
        let status = self.drive.status().await?;
        Ok(self.told(status))
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.drive.measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.drive.faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.ended = false;
        self.tap.starts(true);
        let started = self.drive.start(direction).await;
        self.tap.starts(false);
        let is_unknown =
            |error: &Error| matches!(error.kind(), ErrorKind::OutcomeUnknown | ErrorKind::NoAnswer);
        self.ended |= self.is(Mutant::LeaseWantsAnAnswer) && started.as_ref().is_err_and(is_unknown);
        match started {
            Err(error) if self.is(Mutant::StartConfirmedByAnything) => self.anything(error).await,
            started => started.map(|status| self.told(status)).map_err(|error| self.blamed(error)),
        }
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        if self.is(Mutant::StopReadsFirst) {
            let _ = self.drive.status().await;
        }
        self.ended |= self.is(Mutant::StopSentEndsTheLease);
        self.tap.stops(true);
        let stopped = self.drive.stop(mode).await;
        self.tap.stops(false);
        match stopped {
            Err(error) if self.is(Mutant::StopConfirmedByAnything) => {
                self.anything(error).await.map(|status| Stopped::by(mode, status))
            }
            stopped => {
                stopped.map(|stopped| Stopped { status: self.told(stopped.status.clone()), ..stopped })
            }
        }
    }

    async fn withdraw(&mut self) -> Result<Withdrawn> {
        if self.is(Mutant::WithdrawalStopsWhoever) {
            return self.drive.stop(StopMode::Ramp).await.map(|stopped| Withdrawn::Ended(stopped.status));
        }
        match self.drive.withdraw().await {
            Err(error) if self.is(Mutant::WithdrawalConfirmedByAnything) => {
                self.anything(error).await.map(Withdrawn::Ended)
            }
            withdrawn => withdrawn,
        }
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        match self.drive.set_setpoint(setpoint).await {
            Err(_) if self.is(Mutant::SetpointNotCompared) => Ok(()),
            given => given.map_err(|error| self.blamed(error)),
        }
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        // A word that resets lets a motor coast in most families: it is what a stop by freewheel writes.
        if self.is(Mutant::ResetWithoutATrip) && !self.drive.status().await?.is_fault() {
            return self.drive.stop(StopMode::Freewheel).await.map(|stopped| stopped.status);
        }
        self.tap.resets(true);
        let reset = self.drive.reset_faults().await;
        self.tap.resets(false);
        match reset {
            Err(error) if self.is(Mutant::ResetConfirmedByAnything) => self.anything(error).await,
            reset => reset,
        }
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.drive.identify().await
    }

    async fn release(&mut self) -> Result<Status> {
        self.drive.release().await
    }

    async fn self_restarts(&mut self) -> Result<Vec<SelfRestart>> {
        self.drive.self_restarts().await
    }

    fn accept_self_restart(&mut self, codes: &[&str]) {
        self.drive.accept_self_restart(codes);
    }

    fn watchdog_capability(&self) -> Option<WatchdogCapability> {
        self.drive.watchdog_capability()
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.drive.keep_alive().await
    }

    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.drive.watchdog().await
    }

    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.drive.arm_watchdog(timeout, reaction).await
    }

    async fn restore_watchdog(&mut self, found: Watchdog) -> Result<Watchdog> {
        self.drive.restore_watchdog(found).await
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.drive.intent(register, word).await
    }

    fn follow_stops(&mut self, follower: Follower) {
        self.drive.follow_stops(follower);
    }

    fn stopped_by(&self, written: &[(Place, u16)]) -> Option<StopMode> {
        self.drive.stopped_by(written)
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.drive.read_parameter(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.drive.write_parameter(row, word).await
    }

    async fn persist(&mut self) -> Result<u32> {
        self.drive.persist().await
    }

    fn assume_changed(&mut self) {
        self.drive.assume_changed();
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        self.drive.broadcast_stop(mode)
    }
}
