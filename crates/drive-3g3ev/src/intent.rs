//! What another master's writes ask.

use drive_core::{Command as Order, Direction, Frequency, Intent, Port, Result, StopMode};

use crate::{
    Drive3g3ev,
    registers::address::{COMMAND, ENTER, OUTPUTS, REFERENCE},
    words::Command,
};

impl<P: Port> Drive3g3ev<P> {
    /// Manual §5.1. What a count of the reference is, n39 says (§2.1).
    pub(crate) async fn asked_by_another(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match register {
            COMMAND => Intent::understood(Command::from_bits_retain(word).intent()),
            REFERENCE => {
                let unit = self.reference_unit(Order::Setpoint(Frequency::ZERO.into())).await?;
                Intent::understood(unit.setpoint(word).map(Intent::Setpoint))
            }
            OUTPUTS | ENTER => Intent::kept(),
            _ => Ok(None),
        }
    }
}

impl Command {
    /// What it asks. Without RUN it is a stop, whatever else is set; a run command with one of the inputs, which n06 to n08
    /// may give any function, is not understood.
    #[must_use]
    pub fn intent(self) -> Option<Intent> {
        if !self.contains(Self::RUN) {
            return Some(Intent::Stop(StopMode::Ramp));
        }
        let reverse = Self::run(Direction::Reverse);
        let direction = if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward };
        reverse.contains(self).then_some(Intent::Start(direction))
    }
}
