//! Rows of a register table that are read and written, within their access and range; as parameters they are written once and read back.

use super::Calls;
use crate::{
    error::{Error, ErrorKind, Result},
    port::Port,
    registers::{Row, Written},
    setpoint::Command,
    status::{RawWord, Status},
};

impl<P: Port> Calls<'_, P> {
    /// Reads the register of a row, if its access allows it.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`]; nothing is sent then.
    pub async fn read_row(&mut self, row: &Row) -> Result<u16> {
        if !row.access.is_readable() {
            return Err(self.access_forbidden(row));
        }
        self.read_place(row.place()).await
    }

    /// Writes the register of a row, if its access and range allow it.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`] and [`Error::ValueNotAllowed`]; nothing is sent then.
    pub async fn write_row(&mut self, row: &Row, word: u16) -> Result<()> {
        self.check_row(row, word)?;
        self.write_place(row.place(), word).await
    }

    /// Writes the register of a row as a parameter: reads it first, leaves an equal value alone, and reads back what it
    /// wrote.
    ///
    /// # Errors
    /// Also [`Error::AccessForbidden`] and [`Error::ValueNotAllowed`] before anything is sent, and
    /// [`Error::NotConfirmed`] when it reads back otherwise; the status of that error holds the word and nothing else.
    pub async fn change_row(&mut self, row: &Row, word: u16) -> Result<Written> {
        self.check_row(row, word)?;
        // To write what stands there wears the EEPROM for nothing (rule 10).
        if row.access.is_readable() && self.read_row(row).await? == word {
            return Ok(Written { changed: false, storage: row.storage });
        }
        let outcome = self.write_place(row.place(), word).await;
        let written = Written { changed: true, storage: row.storage };
        if !row.access.is_readable() {
            return outcome.map(|()| written);
        }
        let value = match &outcome {
            Ok(()) => self.read_row(row).await,
            // Whether an ambiguous write arrived, the reading tells.
            Err(error) if error.kind() == ErrorKind::OutcomeUnknown => {
                self.read_back(row.place(), word, error).await
            }
            Err(error) => return Err(error.clone()),
        };
        let value = value.map_err(Error::after_write)?;
        if value == word {
            return Ok(written);
        }
        // It is not there, and the drive has said why.
        if let Err(error @ Error::Exception { .. }) = outcome {
            return Err(error);
        }
        let raw = vec![RawWord { address: row.address, code: row.code, value }];
        let status = Box::new(Status { raw, ..Status::default() });
        let command = Command::WriteParameter(row.address);
        Err(Error::NotConfirmed { slave: self.registers.slave, command, status, because: None })
    }

    fn check_row(&self, row: &Row, word: u16) -> Result<()> {
        if !row.access.is_writable() {
            return Err(self.access_forbidden(row));
        }
        let value = row.unit.number(word);
        if !row.range.allows(value) {
            let slave = self.registers.slave;
            return Err(Error::ValueNotAllowed { slave, register: row.address, code: row.code, value });
        }
        Ok(())
    }

    const fn access_forbidden(&self, row: &Row) -> Error {
        let slave = self.registers.slave;
        Error::AccessForbidden { slave, register: row.address, code: row.code, access: row.access }
    }
}
