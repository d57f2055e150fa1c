//! The trip that the bus orders, and the end of one: emergency stop and fault reset.

use drive_core::{
    Class, Command, Confirming, Error, ErrorKind, Exchange, Port, PortError, Result, State, Status, StopMode,
};

use crate::{Atv21, control::BY_SERIAL_LINK, registers as map, words::CommandWord};

impl<P: Port> Atv21<P> {
    /// Gives the drive's emergency stop (FA00 bit 12) once, then a word without it. The drive trips with fault E,
    /// also when it is not commanded by the bus; it needs a reset afterwards. Returns the status that shows it.
    ///
    /// # Errors
    /// [`Error::NotConfirmed`] when no trip and no emergency stop shows: the motor was ordered to stop along its ramp
    /// in any case.
    pub async fn emergency_stop(&mut self) -> Result<Status> {
        let clear = self.stop_word(StopMode::Ramp);
        let edge = (clear | CommandWord::EMERGENCY_STOP).bits();
        let sent = self.registers.at(Class::Stop).edge().write(map::COMMAND_WORD, edge).await;
        // Whatever became of the edge: a word without it clears it, and stops along the ramp.
        let cleared = self.write_stop(clear).await.and_then(|sent| sent);
        let mut confirming = Confirming::begin();
        loop {
            let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
            if is_tripped(&status) {
                self.clear_edge(&cleared, CommandWord::EMERGENCY_STOP, clear).await?;
                return Ok(status);
            }
            if !confirming.again().await {
                sent?;
                cleared.map_err(Error::after_write)?;
                return Err(self.not_confirmed(Command::Configure("emergency stop"), status, None));
            }
        }
    }

    pub(crate) async fn reset_trip(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if !is_tripped(&status) {
            return Ok(status);
        }
        self.check_own(Command::ResetFaults).await?;
        // The reset sets FA00 to 0, the priorities included: whoever gives a run command then starts the motor.
        let terminals = self.terminals().await?;
        if let Some(reason) = terminals.would_start() {
            return Err(self.refused(Command::ResetFaults, reason));
        }
        let clear = self.command_word(Class::Command).await? & CommandWord::KEPT;
        // It may act only while the bus commands (§8.4 does not say).
        let mut edge = clear | CommandWord::FAULT_RESET;
        if terminals.command_mode != Some(BY_SERIAL_LINK) {
            edge |= CommandWord::COMMAND_PRIORITY;
        }
        let edge = edge.bits();
        let sent = self.registers.at(Class::Command).edge().write(map::COMMAND_WORD, edge).await;
        match &sent {
            Err(error) if error.kind() != ErrorKind::OutcomeUnknown => return sent.map(|()| status),
            _ => {}
        }
        // A drive that starts up anew takes other blocks into effect, if they were changed, and its references are 0.
        self.forget_blocks();
        self.proof.disagree();
        self.references = None;
        // The edge is cleared whether or not the drive is already starting up again and hears nothing: then it clears
        // the word by itself.
        let cleared = self.write_command_word(clear).await;
        self.registers.owe_judgement();
        if cleared.is_ok() {
            self.watch.run.end();
        }
        let mut confirming = Confirming::begin();
        let mut last = None;
        loop {
            // The drive is mute while it starts up, so a read without an answer is one more reason to read again.
            if let Ok(status) = self.read_status(Class::Command).await {
                if !is_tripped(&status) {
                    self.clear_edge(&cleared, CommandWord::FAULT_RESET, clear).await?;
                    return Ok(status);
                }
                last = Some(status);
            }
            if !confirming.again().await {
                break;
            }
        }
        let Some(status) = last else {
            let problem =
                PortError::OutcomeUnknown("the drive is mute after the fault reset; read its status in 2 s");
            let exchange = Exchange { function: 0x06, register: Some(map::COMMAND_WORD.address()) };
            return Err(Error::Port { slave: self.registers.slave(), exchange, problem });
        };
        sent.and(cleared).map_err(Error::after_write)?;
        Err(self.not_confirmed(Command::ResetFaults, status, None))
    }

    /// Clears an edge that may still be set because the write that cleared it failed. A drive that has started up anew has
    /// cleared it by itself, and is not commanded again.
    async fn clear_edge(
        &mut self,
        cleared: &Result<()>,
        edge: CommandWord,
        clear: CommandWord,
    ) -> Result<()> {
        if cleared.is_ok() {
            return Ok(());
        }
        let present = self.command_word(Class::Command).await.map_err(Error::after_write)?;
        if !present.contains(edge) {
            return Ok(());
        }
        self.write_command_word(clear).await.map_err(Error::after_write)
    }
}

fn is_tripped(status: &Status) -> bool {
    status.is_fault() || status.state == State::QuickStop
}
