//! The reference, 0002h.

use drive_core::{
    Class, Command as Order, Confirming, Error, ErrorKind, Port, RawWord, Refusal, Result, SETTLED_WITHIN,
    Setpoint, Status,
};
use tokio::time::Instant;

use crate::{
    Drive3g3ev,
    refusals::{LOCAL_REFERENCE, OTHER_REFERENCE},
    registers::{REFERENCE, REFERENCE_SEEN, STATE},
    status::{is_run, state_word},
    words::DriveState,
};

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        if let Setpoint::Speed(_) = setpoint {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm",
                reason: "the reference of a 3G3EV is a frequency or a share of one",
            });
        }
        let order = Order::Setpoint(setpoint);
        self.check_reference(order).await?;
        let word = self.reference_word(setpoint, order).await?;
        self.write_reference(word, order).await
    }

    /// The word of a setpoint, in what n39 counts.
    async fn reference_word(&mut self, setpoint: Setpoint, order: Order) -> Result<u16> {
        const IN_PERCENT: Error = Error::Unsupported {
            what: "a setpoint in hertz",
            reason: "n39 counts the reference in percent of a frequency that the manual names no register for: \
                     give it in percent, or write 0 to n39, save it, and switch the drive off and on",
        };
        const IN_HERTZ: Error = Error::Unsupported {
            what: "a setpoint in percent",
            reason: "n39 counts the reference in hertz; 2 or 3 counts it in percent",
        };
        let unit = self.reference_unit(order).await?;
        let word = match setpoint {
            Setpoint::Frequency(frequency) => unit.frequency_word(frequency).ok_or(IN_PERCENT)?,
            Setpoint::Share(share) => unit.share_word(share).ok_or(IN_HERTZ)?,
            Setpoint::Speed(_) => return Err(IN_HERTZ),
        };
        word.map_err(|problem| Error::Setpoint { slave: self.registers.slave(), setpoint, problem })
    }

    /// Refuses a reference where bit 9 of 002Ch says that the panel or the terminals give it. n02 tells less: it acts at the
    /// next power-up only.
    async fn check_reference(&mut self, order: Order) -> Result<()> {
        let state = DriveState::from_bits_retain(self.registers.at(Class::Command).read(STATE).await?);
        if state.contains(DriveState::LOCAL_REFERENCE) {
            return Err(self.refused(order, LOCAL_REFERENCE));
        }
        Ok(())
    }

    /// Writes 0002h, reads it back, and sees that it is in force: bit 9 of 002Ch names the bus, and 0023h is what was
    /// written. At rest that may be 0. The drive's own limits are in parameters that the manual does not name: it refuses
    /// by 21h, or keeps another value, and the reading back tells.
    async fn write_reference(&mut self, word: u16, order: Order) -> Result<()> {
        let mut calls = self.registers.at(Class::Command).replacing(REFERENCE.address());
        let before = self.proof.agreed();
        self.proof.disagree();
        calls.write(REFERENCE, word).await?;
        self.registers.owe_judgement();
        self.see_reference(word, before, order).await.map_err(Error::after_write)
    }

    async fn see_reference(&mut self, word: u16, before: Option<u16>, order: Order) -> Result<()> {
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        loop {
            let (kept, status, because) = match self.look_at_reference(word).await {
                Ok(seen) => seen,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            if kept && because.is_none() {
                self.proof.agree(word);
                return Ok(());
            }
            if !kept || Instant::now() >= settled || !confirming.again().await {
                let held = status.raw(REFERENCE.address());
                if !kept && held.is_some() && held != before {
                    self.proof.expect(word);
                }
                return Err(self.not_confirmed(order, status, because.filter(|_| kept)));
            }
        }
    }

    /// Whether 0002h holds the word, the status, and what is in force instead.
    async fn look_at_reference(&mut self, word: u16) -> Result<(bool, Status, Option<Refusal>)> {
        let value = self.registers.at(Class::Command).read(REFERENCE).await?;
        let mut status = self.read_status(Class::Command).await?;
        status.raw.push(RawWord { address: REFERENCE.address(), code: REFERENCE.row().code, value });
        let seen = status.raw(REFERENCE_SEEN.address()).unwrap_or(0);
        let own = (seen == 0 && !is_run(&status)) || self.is_same_reference(seen, word).await?;
        let because = if state_word(&status).contains(DriveState::LOCAL_REFERENCE) {
            Some(LOCAL_REFERENCE)
        } else {
            (!own).then_some(OTHER_REFERENCE)
        };
        Ok((value == word, status, because))
    }

    /// Whether two references are the same but for what the drive rounds; not judged where nobody knows what they count.
    pub(crate) async fn is_same_reference(&mut self, one: u16, other: u16) -> Result<bool> {
        self.unit(Class::Command).await?;
        Ok(self.is_same(one, other))
    }

    /// The same, by what is known of the unit.
    pub(crate) fn is_same(&self, one: u16, other: u16) -> bool {
        self.known_unit().is_none_or(|unit| one.abs_diff(other) <= unit.rounding())
    }
}
