//! The reference, 0002h.

use drive_core::{
    Class, Command as Order, Error, Frequency, Percent, Port, RawWord, Result, Setpoint, Status,
};

use crate::{Drive3g3ev, registers::REFERENCE};

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let Setpoint::Frequency(frequency) = setpoint else {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm",
                reason: "the reference of a 3G3EV is a frequency or a share of one",
            });
        };
        let order = Order::Setpoint(setpoint);
        self.check_reference_source(order).await?;
        let word = self.frequency_word(frequency, order).await?;
        self.write_reference(word, order).await
    }

    /// Gives the drive a reference in percent, where n39 counts it so (2 or 3). 100 % is a frequency for which the
    /// manual names no register.
    ///
    /// # Errors
    /// As [`set_setpoint`](drive_core::Drive::set_setpoint); [`Error::Unsupported`] when n39 counts in hertz, and
    /// [`Error::ValueNotAllowed`] for a share that is negative, between two counts or beyond a word.
    pub async fn set_reference_share(&mut self, share: Percent) -> Result<()> {
        let order = Order::Configure("reference in percent");
        self.check_reference_source(order).await?;
        let unit = self.reference_unit(order).await?;
        if unit.share(0).is_none() {
            return Err(Error::Unsupported {
                what: "a reference in percent",
                reason: "n39 counts the reference in hertz; 2 or 3 counts it in percent",
            });
        }
        let word = unit.share_word(share).ok_or(Error::ValueNotAllowed {
            slave: self.registers.slave(),
            register: REFERENCE.address(),
            code: REFERENCE.row().code,
            value: share.hundredths(),
        })?;
        self.write_reference(word, order).await
    }

    async fn frequency_word(&mut self, frequency: Frequency, order: Order) -> Result<u16> {
        let unit = self.reference_unit(order).await?;
        let word = unit.frequency_word(frequency).ok_or(Error::Unsupported {
            what: "a setpoint in hertz",
            reason: "n39 counts the reference in percent of a frequency that the manual names no register for; \
                     0 or 1 counts it in hertz",
        })?;
        word.map_err(|problem| Error::Setpoint {
            slave: self.registers.slave(),
            setpoint: Setpoint::Frequency(frequency),
            problem,
        })
    }

    /// Writes 0002h and reads it back. The drive's own limits are in parameters that the manual does not name: it
    /// refuses by 21h, or keeps another value, and the reading back tells.
    async fn write_reference(&mut self, word: u16, order: Order) -> Result<()> {
        let mut calls = self.registers.at(Class::Command).replacing(REFERENCE.address());
        calls.write(REFERENCE, word).await?;
        let value = self.registers.at(Class::Command).read(REFERENCE).await.map_err(Error::after_write)?;
        if value == word {
            return Ok(());
        }
        let raw = vec![RawWord { address: REFERENCE.address(), code: REFERENCE.row().code, value }];
        Err(self.not_confirmed(order, Status { raw, ..Status::default() }))
    }
}
