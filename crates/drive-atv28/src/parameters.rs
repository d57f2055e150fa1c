//! Parameters.

use drive_core::{Class, Command, Error, Port, Refusal, Result, Row, Written, registers::refuse_commands};

use crate::{
    Atv28,
    registers::{CMD, CMDD, CMI, LCC, LFR, LFRD, TCC},
    words::ControlWord,
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
        if [TCC.address(), LCC.address()].contains(&row.address)
            && let Some(reason) = self.refuses_move().await?
        {
            let command = Command::WriteParameter(row.address);
            return Err(Error::Refused { slave: self.registers.slave(), command, reason });
        }
        // HSP, LSP, nominal values: limits that were read once may change with it.
        self.proof.doubt_limits();
        self.speeds = None;
        self.registers.at(Class::Background).change_row(row, word).await
    }

    /// Why nothing is written now that changes who commands, or what the inputs do: somebody's run command might act by it.
    async fn refuses_move(&mut self) -> Result<Option<Refusal>> {
        const STANDS: Refusal = Refusal::Settings(
            "CMD holds a run command, which may act when control moves: stop the motor first",
        );
        let (held, _) = self.read_held(Class::Background).await?;
        if ControlWord::from_bits_retain(held).is_run() {
            return Ok(Some(STANDS));
        }
        self.closed_input().await
    }
}
