//! The fault reset of one drive: a pulse of the input that carries it.

use drive_core::{Class, Command as Order, Confirming, Error, ErrorKind, Port, Result, Status};

use crate::{
    Drive3g3ev,
    command::commanded_by_other,
    refusals::OTHER_COMMAND,
    registers::{COMMAND, N06},
    words::Command,
};

/// The inputs in the order of their parameters n06 to n08.
const INPUTS: [Command; 3] = [Command::INPUT_1, Command::INPUT_2, Command::INPUT_3];

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn pulse_fault_reset(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if !status.is_fault() {
            return Ok(status);
        }
        // A run command at the panel or the terminals may start the motor as soon as the fault is gone, and nothing tells
        // whether there is one: the manual lists no bits of 002Bh.
        if let Some(OTHER_COMMAND) = commanded_by_other(&status) {
            return Err(self.refused(Order::ResetFaults, OTHER_COMMAND));
        }
        let input = self.fault_reset_input().await?;
        let held = Command::from_bits_retain(self.read_command(Class::Command).await?.value);
        let clear = (held & Command::INPUTS) - input;
        // The pulse is a rising edge only where the bit was not left set, by a reset that was interrupted.
        if held.contains(input) {
            self.write_command(clear).await?;
        }
        self.command = None;
        self.watch.run.sends(clear.bits());
        // Sent once; whatever becomes of it, the bit is cleared again.
        let pulse = self.registers.at(Class::Command).edge().write(COMMAND, (clear | input).bits()).await;
        if let Err(error) = &pulse
            && matches!(error.kind(), ErrorKind::NotSent | ErrorKind::Exception)
        {
            return Err(error.clone());
        }
        self.see_reset(pulse, clear).await.map_err(Error::after_write)
    }

    /// Clears the bit, and reads until no fault shows.
    async fn see_reset(&mut self, pulse: Result<()>, clear: Command) -> Result<Status> {
        self.write_command(clear).await?;
        self.registers.owe_judgement();
        let mut confirming = Confirming::begin();
        loop {
            let shown = self.read_status(Class::Command).await?;
            if !shown.is_fault() {
                // A pulse in doubt may have come after its clearing.
                if pulse.is_err() && self.read_command(Class::Command).await?.value != clear.bits() {
                    self.write_command(clear).await?;
                }
                if self.watch.run.lease().is_some() {
                    self.read_command(Class::Command).await?;
                    self.watch.run.end();
                }
                return Ok(Status { verdict: None, ..shown });
            }
            if !confirming.again().await {
                // The drive still shows its fault: where the pulse itself failed, that is the reason.
                pulse?;
                return Err(self.not_confirmed(Order::ResetFaults, shown, None));
            }
        }
    }

    /// The bit of 0001h whose input is set to fault reset now.
    async fn fault_reset_input(&mut self) -> Result<Command> {
        let what = "fault reset";
        let Some(number) = self.fault_reset else {
            let reason = "the number for it in n06 to n08 is not in the manual and was not given; the broadcast reset \
                          reaches all drives of the line";
            return Err(Error::Unsupported { what, reason });
        };
        let functions = self.registers.at(Class::Command).read_words(N06.address(), 3).await?;
        let carries = INPUTS.into_iter().zip(functions).find(|&(_, function)| function == number);
        carries.map(|(input, _)| input).ok_or(Error::Unsupported {
            what,
            reason: "none of the inputs of n06 to n08 holds the number that was given for it",
        })
    }
}
