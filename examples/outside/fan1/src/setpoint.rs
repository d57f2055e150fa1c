//! The reference.

use drive_core::{
    Class, Command as Order, Confirming, Error, ErrorKind, Frequency, Port, Result, Setpoint, SetpointProblem,
};

use crate::{
    Fan1,
    reading::{PANEL, remote, word},
    registers::{REFERENCE, address as at},
};

impl<P: Port> Fan1<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let reference = self.reference_word(setpoint)?;
        let order = Order::Setpoint(setpoint);
        let status = self.read_status(Class::Command).await?;
        if !remote(word(&status)) {
            return Err(self.refused(order, PANEL));
        }
        self.agreed = None;
        let mut calls = self.registers.at(Class::Command).replacing(REFERENCE.address());
        calls.write(REFERENCE, reference).await?;
        self.registers.owe_judgement();
        self.see_reference(reference, order).await.map_err(Error::after_write)
    }

    /// It is in force where it stands in `REF` and bit 4 of `STA` names the bus.
    async fn see_reference(&mut self, reference: u16, order: Order) -> Result<()> {
        let mut confirming = Confirming::begin();
        loop {
            let status = match self.read_status(Class::Command).await {
                Ok(status) => status,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            let held = status.raw(at::REFERENCE) == Some(reference);
            let panel = (!remote(word(&status))).then_some(PANEL);
            if held && panel.is_none() {
                self.agreed = Some(reference);
                return Ok(());
            }
            if !confirming.again().await {
                return Err(self.not_confirmed(order, status, panel));
            }
        }
    }

    /// In steps of 0.1 Hz, up to what the drive takes and its owner allows.
    fn reference_word(&self, setpoint: Setpoint) -> Result<u16> {
        let frequency = match setpoint {
            Setpoint::Frequency(frequency) => frequency,
            Setpoint::Share(_) => return Err(Error::no_share()),
            Setpoint::Speed(_) => {
                return Err(Error::Unsupported {
                    what: "a setpoint in rpm",
                    reason: "the drive takes a frequency",
                });
            }
        };
        let problem = if frequency > self.highest {
            SetpointProblem::OutsideFrequencyLimits { low: Frequency::ZERO, high: self.highest }
        } else if let Some(word) = frequency.exact_decihertz() {
            return Ok(word);
        } else {
            SetpointProblem::Resolution("0.1 Hz")
        };
        Err(Error::Setpoint { slave: self.registers.slave(), setpoint, problem })
    }
}
