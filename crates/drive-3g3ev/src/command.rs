//! Start, stop and withdrawal: what is written to 0001h, and how it is seen to be in force.

use drive_core::{
    Class, Command as Order, Confirming, Control, Direction, Error, ErrorKind, Lease, Port, RawWord, Refusal,
    Result, SETTLED_WITHIN, State, Status, StopMode, Stopped, Withdrawn,
};
use tokio::time::Instant;

use crate::{
    Drive3g3ev,
    proof::withheld,
    refusals::{LOCAL_REFERENCE, OTHER_COMMAND, OTHER_REFERENCE, OTHER_WORD, OUTPUT_OFF},
    registers::address,
    status::{is_run, state_word},
    words::{Command, DriveState},
};

impl<P: Port> Drive3g3ev<P> {
    /// Refuses a start that would not come into force, before anything is written. Else: whether it turns a motor round that runs.
    pub(crate) async fn check_start(&mut self, direction: Direction) -> Result<bool> {
        let order = Order::Start(direction);
        self.look_at_unit().await?;
        let status = self.read_status(Class::Command).await?;
        if status.is_fault() {
            let reason = status.fault_code.map_or(Refusal::Tripped, Refusal::Fault);
            return Err(self.refused(order, reason));
        }
        self.check_direction(order, direction).await?;
        if let Some(reason) = commanded_by_other(&status) {
            return Err(self.refused(order, reason));
        }
        if status.state == State::NotReady {
            let cut = withheld(&status).filter(|_| is_run(&status));
            return Err(self.refused(order, cut.unwrap_or(Refusal::State(State::NotReady))));
        }
        // The reference that it finds was given in the old unit, or is told in it.
        self.check_unit(order)?;
        Ok(is_run(&status) && status.direction != Some(direction))
    }

    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let turns_round = self.check_start(direction).await?;
        // The inputs of n06 to n08 stand in the same word, and are left as they are: as they are now, where one was on, for they do not
        // outlive the supply.
        if self.command.is_none_or(|held| held.intersects(Command::INPUTS)) {
            self.read_command(Class::Command).await?;
        }
        let word = Command::run(direction) | self.inputs();
        // The lease is there before the word is on its way: a call that is dropped here leaves somebody who withdraws
        // it.
        self.watch.run.give(Lease::new(direction, word.bits()));
        let sent = self.write_command(word).await;
        self.registers.owe_judgement();
        match sent {
            Ok(()) => self.watch.run.was_written(),
            // What was refused may be a repetition of what was carried out.
            Err(error) if error.kind() == ErrorKind::Exception => {
                if self.read_command(Class::Command).await.map_err(Error::after_write)?.value != word.bits() {
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
        self.see_start(direction, word, turns_round).await.map_err(Error::after_write)
    }

    /// Reads until the run command is in force: 0001h holds it, bits 9 and A of 002Ch name the bus, the drive runs in that
    /// direction with its output on, and 0023h is the reference of 0002h. A motor that turned the other way slows down
    /// first: it is on its way, whether the status tells the direction in which it still turns or the one that is ordered, which the
    /// manual leaves open.
    async fn see_start(&mut self, direction: Direction, word: Command, turns_round: bool) -> Result<Status> {
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let mut first = None;
        loop {
            let (status, because) = match self.look_at_start(word).await {
                Ok(seen) => seen,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            let output = status.raw(address::OUTPUT_FREQUENCY);
            let directed = status.direction == Some(direction) || output < first;
            let obeys = turns_round || !self.is_brought_down(&status);
            if because.is_none() && is_run(&status) && directed && obeys {
                let verdict = self.verdict(&status);
                return Ok(Status { verdict, ..status });
            }
            first = first.or(output);
            let over = because.is_some() && (status.is_fault() || Instant::now() >= settled);
            if over || !confirming.again().await {
                let because = because.or_else(|| withheld(&status));
                let verdict = self.verdict(&status);
                let status = Status { verdict, ..status };
                return Err(self.not_confirmed(Order::Start(direction), status, because));
            }
        }
    }

    /// What the drive shows of the run command `word`: its status, and what decides instead. 0001h is read after all else,
    /// so that no stop of somebody else's is hidden.
    async fn look_at_start(&mut self, word: Command) -> Result<(Status, Option<Refusal>)> {
        let mut status = self.read_status(Class::Command).await?;
        let mut because = commanded_by_other(&status);
        if because.is_none() && is_run(&status) {
            because = self.not_in_force(&status).await?;
        }
        status.raw.push(self.read_command(Class::Command).await?);
        if status.is_fault() {
            because = Some(Refusal::Tripped);
        } else if self.command != Some(word) {
            because = Some(OTHER_WORD);
        }
        Ok((status, because))
    }

    /// The status, and after all that it shows 0001h.
    async fn status_and_command(&mut self) -> Result<Status> {
        let mut status = self.read_status(Class::Command).await?;
        // A status of a drive that is coming down has read it already, last of all.
        if status.raw(address::COMMAND).is_none() {
            status.raw.push(self.read_command(Class::Command).await?);
        }
        Ok(status)
    }

    /// What keeps the reference of the bus from reaching the motor of a drive that runs.
    async fn not_in_force(&mut self, status: &Status) -> Result<Option<Refusal>> {
        let reference = self.registers.at(Class::Command).read_word(address::REFERENCE).await?;
        let seen = status.raw(address::REFERENCE_SEEN).unwrap_or(0);
        self.proof.agree(reference);
        if !self.is_same_reference(seen, reference).await? {
            return Ok(Some(OTHER_REFERENCE));
        }
        let off = state_word(status).contains(DriveState::OUTPUT_OFF) && reference != 0;
        Ok(off.then_some(OUTPUT_OFF))
    }

    pub(crate) async fn stop_motor(&mut self, asked: StopMode) -> Result<Stopped> {
        let mode = StopMode::Ramp;
        let instead =
            (asked != mode).then_some("the bus has one stop: the drive stops in the way that it is set to");
        // What became of it, the reading tells.
        self.write_stop().await?.ok();
        self.registers.owe_judgement();
        let (mut confirming, mut settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let (mut first, mut seen) = (None, false);
        let (status, because, sent) = loop {
            let mut status = match self.status_and_command().await {
                Ok(status) => status,
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error.after_write()),
            };
            let revoked = self.command.is_none_or(|held| held.contains(Command::RUN));
            if !revoked {
                self.watch.run.end();
            }
            let runs = is_run(&status) && !status.is_fault();
            let local = status.control != Some(Control::Bus);
            let output = status.raw(address::OUTPUT_FREQUENCY);
            let comes_down = output == Some(0) || output < first;
            let (mut because, mut sent) = (None, Ok(()));
            if revoked {
                // The confirmation of function 10h tells no value: it may be that of a start that was late, and the start
                // itself may come later still.
                because = Some(OTHER_WORD);
                sent = self.write_stop().await.map_err(Error::after_write)?;
                settled = Instant::now() + SETTLED_WITHIN;
            } else if runs && local {
                because = Some(OTHER_COMMAND);
            } else if !runs || comes_down {
                // RUN may stand until the motor does: it is on its way when the order stands and the output goes down.
                if status.state == State::Running {
                    status.state = State::Stopping;
                }
                status.verdict = None;
                return Ok(Stopped { instead, ..Stopped::by(mode, status) });
            }
            self.registers.tell_follower(&status, &sent);
            if !seen {
                // It takes two readings to see an output go down, and on a full line the first may take all of the time.
                (first, confirming, seen) = (output, Confirming::begin(), true);
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
        let held = Command::from_bits_retain(self.read_command(Class::Command).await?.value);
        let lease = self.watch.run.lease();
        let stands = held.contains(Command::RUN);
        let ours = self.watch.run.is_own(held.bits()) || commanded_by_other(&status) == Some(OTHER_COMMAND);
        // One that was not seen to arrive may come late: what stands is written again, and read after it.
        let may_come = !stands && lease.is_some();
        if !(may_come || stands && ours) {
            self.watch.run.end();
            return Ok(Withdrawn::Nothing(Status { verdict: None, ..status }));
        }
        self.write_command(held - Command::RUN).await?;
        let status = self.status_and_command().await.map_err(Error::after_write)?;
        if self.command.is_none_or(|held| held.contains(Command::RUN)) {
            return Err(self.not_confirmed(Order::Withdraw, status, Some(OTHER_WORD)));
        }
        self.watch.run.end();
        Ok(Withdrawn::Ended(Status { verdict: None, ..status }))
    }

    /// Writes 0001h and remembers the word; while the outcome is not known, none is.
    pub(crate) async fn write_command(&mut self, command: Command) -> Result<()> {
        self.command = None;
        self.watch.run.sends(command.bits());
        self.registers.at(Class::Command).write(crate::registers::COMMAND, command.bits()).await?;
        self.command = Some(command);
        Ok(())
    }

    /// Writes a run command of 0, with the inputs as the drive held them last. That the drive refuses it, or that nobody
    /// knows whether it arrived, is given back: what the drive shows tells more.
    async fn write_stop(&mut self) -> Result<Result<()>> {
        let word = self.inputs();
        let sent = self.registers.at(Class::Stop).write_word(address::COMMAND, word.bits()).await;
        if let Err(error) = &sent
            && error.kind() == ErrorKind::NotSent
        {
            return sent.map(Ok);
        }
        self.command = Some(word);
        self.watch.run.sends(word.bits());
        Ok(sent)
    }

    /// The inputs of n06 to n08 as 0001h holds them, which are not the motion's.
    pub(crate) fn inputs(&self) -> Command {
        self.command.unwrap_or(Command::empty()) & Command::INPUTS
    }

    /// Reads 0001h back.
    pub(crate) async fn read_command(&mut self, class: Class) -> Result<RawWord> {
        let row = crate::registers::COMMAND.row();
        let value = self.registers.at(class).read_word(row.address).await?;
        self.holds(value);
        Ok(RawWord { address: row.address, code: row.code, value })
    }

    /// 0001h was read.
    pub(crate) const fn holds(&mut self, word: u16) {
        self.command = Some(Command::from_bits_retain(word));
        self.watch.run.reads(word);
    }

    pub(crate) fn not_confirmed(&self, command: Order, status: Status, because: Option<Refusal>) -> Error {
        Error::NotConfirmed { slave: self.registers.slave(), command, status: Box::new(status), because }
    }
}

/// Who decides instead of the bus, by bits A and 9 of 002Ch.
pub(crate) fn commanded_by_other(status: &Status) -> Option<Refusal> {
    let state = state_word(status);
    if state.contains(DriveState::LOCAL_RUN) {
        return Some(OTHER_COMMAND);
    }
    state.contains(DriveState::LOCAL_REFERENCE).then_some(LOCAL_REFERENCE)
}
