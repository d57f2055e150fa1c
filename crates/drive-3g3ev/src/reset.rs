//! The fault reset of one drive: a pulse of the input that carries it.

use drive_core::{Class, Command as Order, Error, Port, Result, Status};

use crate::{
    Drive3g3ev,
    command::READS,
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
        let input = self.fault_reset_input().await?;
        // The pulse is a rising edge only where the bit was not left set, by a reset that was interrupted.
        if self.command.is_none_or(|held| held.contains(input)) {
            self.write_command(Class::Command, Command::empty()).await?;
        }
        self.command = None;
        // Sent once; whatever becomes of it, the bit is cleared again.
        let pulse = self.registers.at(Class::Command).edge().write(COMMAND, input.bits()).await;
        match pulse {
            Err(Error::Port { problem, exchange, slave }) if problem.nothing_sent() => {
                return Err(Error::Port { problem, exchange, slave });
            }
            Err(error @ Error::Exception { .. }) => return Err(error),
            _ => {}
        }
        self.see_reset(pulse).await.map_err(Error::after_write)
    }

    /// Clears the bit, and reads until no fault shows.
    async fn see_reset(&mut self, pulse: Result<()>) -> Result<Status> {
        self.write_command(Class::Command, Command::empty()).await?;
        let mut shown = Status::default();
        for _ in 0..READS {
            shown = self.read_status(Class::Command).await?;
            if !shown.is_fault() {
                // A pulse in doubt may have come after its clearing.
                if pulse.is_err() && self.read_command(Class::Command).await?.value != 0 {
                    self.write_command(Class::Command, Command::empty()).await?;
                }
                return Ok(shown);
            }
        }
        // The drive still shows its fault: where the pulse itself failed, that is the reason.
        pulse?;
        Err(self.not_confirmed(Order::ResetFaults, shown))
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
