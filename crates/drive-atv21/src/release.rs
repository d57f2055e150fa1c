//! What is given back: command and reference to whom the settings name, and a run command of ours that is no longer in
//! force.

use drive_core::{
    Class, Command, Confirming, Error, Port, Refusal, Result, SETTLED_WITHIN, Status, Withdrawn,
};

use crate::{
    Atv21,
    control::{BY_SERIAL_LINK, commanded_by_other},
    refusals::OTHER_WORD,
    registers as map,
    words::CommandWord,
};

impl<P: Port> Atv21<P> {
    pub(crate) async fn give_control_back(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if status.state.is_moving() {
            return Err(self.refused(Command::Release, Refusal::MotorRunning));
        }
        self.check_own(Command::Release).await?;
        let terminals = self.terminals().await?;
        if terminals.command_mode == Some(BY_SERIAL_LINK) {
            let reason = Refusal::Settings("CMOD = 2 leaves the command with the bus: set CMOD to 0 or 1");
            return Err(self.refused(Command::Release, reason));
        }
        if let Some(reason) = terminals.would_start() {
            return Err(self.refused(Command::Release, reason));
        }
        let is_begun = self.put_references_back().await?;
        let later = |error: Error| if is_begun { error.after_write() } else { error };
        let held = self.command_word(Class::Command).await.map_err(later)?;
        let chosen = if self.selections.is_some() { CommandWord::empty() } else { CommandWord::SELECTIONS };
        self.write_command_word(held & chosen & CommandWord::KEPT).await.map_err(later)?;
        self.watch.run.end();
        let mut settling = Confirming::within(SETTLED_WITHIN);
        loop {
            let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
            if commanded_by_other(&status).is_some() {
                return Ok(status);
            }
            if !settling.again().await {
                return Err(self.not_confirmed(Command::Release, status, None));
            }
        }
    }

    /// Ends the run command in FA00, if this side gave it or it is not in force, also where the drive has tripped: what another master has written there is
    /// his.
    pub(crate) async fn withdraw_run(&mut self) -> Result<Withdrawn> {
        let status = self.read_status(Class::Command).await?;
        let held = self.command_word(Class::Command).await?;
        let lease = self.watch.run.lease();
        let stands = held.contains(CommandWord::RUN);
        let ours = self.watch.run.is_own(held.bits()) || commanded_by_other(&status).is_some();
        // One that was not seen to arrive may come late: what stands is written again, and read after it.
        let may_come = !stands && lease.is_some();
        if !(may_come || stands && ours) {
            self.watch.run.end();
            return Ok(Withdrawn::Nothing(Status { verdict: None, ..status }));
        }
        let word = held - CommandWord::RUN - CommandWord::EDGES;
        self.write_command_word(word).await?;
        let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
        let now = self.command_word(Class::Command).await.map_err(Error::after_write)?;
        if now.contains(CommandWord::RUN) {
            return Err(self.not_confirmed(Command::Withdraw, status, Some(OTHER_WORD)));
        }
        self.watch.run.end();
        Ok(Withdrawn::Ended(Status { verdict: None, ..status }))
    }

    /// Writes the references that stood in the drive before the first setpoint of this value: the terminals' next run
    /// command may run at them (FMOD = 4). Gives whether they were.
    async fn put_references_back(&mut self) -> Result<bool> {
        let Some([frequency, speed]) = self.references else { return Ok(false) };
        let mut both = [(map::FREQUENCY_REFERENCE, frequency), (map::SPEED_REFERENCE, speed)];
        // The one that counts may be the one that was written last.
        both.sort_by_key(|(_, word)| *word);
        let mut is_begun = false;
        for (register, word) in both {
            let written = self.registers.at(Class::Command).write(register, word).await;
            written.map_err(|error| if is_begun { error.after_write() } else { error })?;
            is_begun = true;
        }
        self.proof.disagree();
        self.references = None;
        Ok(is_begun)
    }
}
