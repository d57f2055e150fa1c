//! Start, stop, withdrawal and fault reset: what is written to `CTL`, and how it is seen to be in force.

use drive_core::{
    Class, Command as Order, Confirming, Direction, Error, ErrorKind, Lease, Port, Refusal, Result,
    SETTLED_WITHIN, State, Status, StopMode, Stopped, Withdrawn,
};
use tokio::time::Instant;

use crate::{
    Fan1,
    reading::{PANEL, remote, withheld, word},
    registers::{CONTROL, ControlWord, StatusWord, address as at},
};

const OTHER_WORD: Refusal = Refusal::Overridden {
    by: "another word in CTL than was written",
    remedy: "see who else writes to this drive",
};

impl<P: Port> Fan1<P> {
    /// What speaks against a start, judged once: for who asks before, and for the start itself.
    pub(crate) async fn may_be_started(&mut self, direction: Direction) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        let reason = status.bars_motion().or((!remote(word(&status))).then_some(PANEL));
        reason.map_or(Ok(status), |reason| Err(self.refused(Order::Start(direction), reason)))
    }

    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let status = self.may_be_started(direction).await?;
        // One that stands and does not act would act only after it was 0 once (p. 2).
        if held(&status).contains(ControlWord::RUN) && !runs(&status) {
            self.write_control(ControlWord::empty()).await?;
        }
        let run = ControlWord::run(direction);
        self.watch.run.give(Lease::new(direction, run.bits()));
        let sent = self.write_control(run).await;
        self.registers.owe_judgement();
        match sent {
            Ok(()) => self.watch.run.was_written(),
            // What was refused may be a repetition of what was carried out.
            Err(error @ Error::Exception { .. }) => {
                let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
                if held(&status) != run {
                    self.watch.run.was_not_written();
                    return Err(error);
                }
            }
            Err(error) if error.kind() == ErrorKind::NotSent => {
                self.watch.run.was_not_written();
                return Err(error);
            }
            Err(error) => return Err(error),
        }
        self.see_start(direction, run).await.map_err(Error::after_write)
    }

    /// Reads until the run command is in force. A motor that turned the other way slows down first: it is on its way.
    async fn see_start(&mut self, direction: Direction, run: ControlWord) -> Result<Status> {
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let mut first = None;
        loop {
            let status = match self.read_status(Class::Command).await {
                Ok(status) => status,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            let panel = (!remote(word(&status))).then_some(PANEL);
            let other = (held(&status) != run).then_some(OTHER_WORD);
            let because = panel.or(other).or_else(|| withheld(&status));
            let output = status.raw(at::OUTPUT);
            if because.is_none() && (status.direction == Some(direction) || output < first) {
                self.agreed = status.raw(at::REFERENCE);
                let verdict = self.watch.run.verdict(&self.evidence(&status));
                return Ok(Status { verdict, ..status });
            }
            first = first.or(output);
            let over = because.is_some() && (status.is_fault() || Instant::now() >= settled);
            if over || !confirming.again().await {
                return Err(self.not_confirmed(Order::Start(direction), status, because));
            }
        }
    }

    /// The one stop of the drive is along its ramp. It is written before anything is read, and again where a run command
    /// has come after it.
    pub(crate) async fn stop_motor(&mut self, asked: StopMode) -> Result<Stopped> {
        let instead = (asked != StopMode::Ramp).then_some("the drive has one stop, along its ramp");
        // What became of it, the reading tells.
        self.write_stop().await?.ok();
        self.registers.owe_judgement();
        let (mut confirming, mut settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let (status, because, sent) = loop {
            let status = match self.read_status(Class::Command).await {
                Ok(status) => status,
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error.after_write()),
            };
            let revoked = held(&status).contains(ControlWord::RUN);
            let (mut because, mut sent) = (None, Ok(()));
            if revoked {
                because = Some(OTHER_WORD);
                sent = self.write_stop().await.map_err(Error::after_write)?;
                settled = Instant::now() + SETTLED_WITHIN;
            } else {
                self.watch.run.end();
                if !runs(&status) {
                    return Ok(Stopped {
                        instead,
                        ..Stopped::by(StopMode::Ramp, Status { verdict: None, ..status })
                    });
                }
                because = because.or((!remote(word(&status))).then_some(PANEL));
            }
            let over = because.is_some() && !revoked && Instant::now() >= settled;
            if over || !confirming.again().await {
                break (status, because, sent);
            }
        };
        sent?;
        Err(self.not_confirmed(Order::Stop(asked), status, because))
    }

    pub(crate) async fn withdraw_run(&mut self) -> Result<Withdrawn> {
        let status = self.read_status(Class::Command).await?;
        let lease = self.watch.run.lease();
        let stands = held(&status).contains(ControlWord::RUN);
        let ours = lease.is_some_and(|lease| lease.word == held(&status).bits()) || !remote(word(&status));
        // One that was not seen to arrive may come late: 0 is written again, and read after it.
        let may_come = !stands && lease.is_some();
        if !(may_come || stands && ours) {
            self.watch.run.end();
            return Ok(Withdrawn::Nothing(Status { verdict: None, ..status }));
        }
        self.write_control(ControlWord::empty()).await?;
        let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
        if held(&status).contains(ControlWord::RUN) {
            return Err(self.not_confirmed(Order::Withdraw, status, Some(OTHER_WORD)));
        }
        self.watch.run.end();
        Ok(Withdrawn::Ended(Status { verdict: None, ..status }))
    }

    /// The edge carries no run command, and is cleared whatever became of it.
    pub(crate) async fn pulse_reset(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if !status.is_fault() {
            return Ok(status);
        }
        // A run key of the panel may act as soon as the fault is gone, and nothing tells whether it does.
        if !remote(word(&status)) {
            return Err(self.refused(Order::ResetFaults, PANEL));
        }
        // The edge rises only where the bit was not left set, by a reset that was interrupted.
        if held(&status).contains(ControlWord::RESET) {
            self.write_control(ControlWord::empty()).await?;
        }
        self.watch.run.sends(ControlWord::empty().bits());
        let edge = self.registers.at(Class::Command).edge().write(CONTROL, ControlWord::RESET.bits()).await;
        match edge {
            Err(error @ Error::Exception { .. }) => return Err(error),
            Err(error) if error.kind() == ErrorKind::NotSent => return Err(error),
            _ => {}
        }
        self.see_reset(edge).await.map_err(Error::after_write)
    }

    async fn see_reset(&mut self, edge: Result<()>) -> Result<Status> {
        self.write_control(ControlWord::empty()).await?;
        self.registers.owe_judgement();
        let mut confirming = Confirming::begin();
        loop {
            let status = self.read_status(Class::Command).await?;
            if !status.is_fault() {
                // An edge in doubt may have come after its clearing.
                if edge.is_err() && held(&status) != ControlWord::empty() {
                    self.write_control(ControlWord::empty()).await?;
                }
                self.watch.run.end();
                return Ok(Status { verdict: None, ..status });
            }
            if !confirming.again().await {
                // Where the edge itself failed, that is the reason.
                edge?;
                return Err(self.not_confirmed(Order::ResetFaults, status, None));
            }
        }
    }

    async fn write_control(&mut self, control: ControlWord) -> Result<()> {
        self.watch.run.sends(control.bits());
        self.registers.at(Class::Command).write(CONTROL, control.bits()).await
    }

    /// That the drive refuses it, or that nobody knows whether it arrived, is given back: what the drive shows tells more.
    async fn write_stop(&mut self) -> Result<Result<()>> {
        self.watch.run.sends(0);
        match self.registers.at(Class::Stop).write_word(at::CONTROL, 0).await {
            Err(error) if error.kind() == ErrorKind::NotSent => Err(error),
            sent => Ok(sent),
        }
    }

    pub(crate) const fn refused(&self, command: Order, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    pub(crate) fn not_confirmed(&self, command: Order, status: Status, because: Option<Refusal>) -> Error {
        Error::NotConfirmed { slave: self.registers.slave(), command, status: Box::new(status), because }
    }
}

/// `CTL` as this status read it.
fn held(status: &Status) -> ControlWord {
    ControlWord::from_bits_retain(status.raw(at::CONTROL).unwrap_or(0))
}

fn runs(status: &Status) -> bool {
    status.state == State::Running || word(status).contains(StatusWord::RUNNING)
}
