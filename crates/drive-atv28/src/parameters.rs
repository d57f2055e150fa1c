//! Parameters.

use drive_core::{Class, Error, Port, Result, Row, Written, registers::refuse_commands};

use crate::{
    Atv28,
    registers::{CMD, CMDD, CMI, LFR, LFRD},
    setpoint::Limits,
};

impl<P: Port> Atv28<P> {
    pub(crate) async fn change_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        let commands = [CMD.address(), CMDD.address(), LFR.address(), LFRD.address()];
        refuse_commands(row, &commands)?;
        if row.address == CMI.address() {
            return Err(Error::Unsupported {
                what: "writing CMI as a parameter",
                reason: "its bits are not confirmed; on the Altivar 312 they recall factory settings and write the EEPROM",
            });
        }
        // HSP, LSP, nominal values: limits that were read once may change with it.
        self.limits = Limits::default();
        self.registers.at(Class::Background).change_row(row, word).await
    }
}
