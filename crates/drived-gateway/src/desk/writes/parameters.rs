//! Parameters that are written.

use drive_core::{Row, tokio_modbus::ExceptionCode};
use drive_fleet::DriveHandle;
use tokio::time::{Instant, timeout_at};

use super::{Refusal, Who, pending};
use crate::{desk::Desk, pdu::Ask};
use drived_doors::audit::{Kind, Record};
use drived_plant::plant::commands::{Expects, Rejected};

impl Desk {
    /// Parameters: each is a row of the family that may be written, all are judged before the first is, and each is read back.
    pub(super) async fn parameters(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        deadline: Instant,
    ) -> Result<(), Refusal> {
        if !self.config.raw_writes {
            return Err(Refusal::rule("it is no command, and raw_writes is not set"));
        }
        let rows = drive.capabilities().rows;
        let mut writes: Vec<(&'static Row, u16)> = Vec::new();
        for (register, word) in ask.writes() {
            let row = rows.iter().find(|row| row.place() == register.into() && row.access.is_writable());
            let Some(row) = row else {
                let why = format!("register {register} is no parameter of the family's list");
                return Err(Refusal::new(ExceptionCode::IllegalDataAddress, why));
            };
            if row.storage.may_wear() && !self.config.eeprom_writes {
                let why = format!("{} may be written to the EEPROM, and eeprom_writes is not set", row.code);
                return Err(Refusal::rule(why));
            }
            writes.push((row, word));
        }
        let drive = drive.commanded_by(&*self.config.name);
        let judged = timeout_at(deadline, self.plant.forbids(&drive, &writes)).await;
        if let Some(why) = judged.map_err(|_| pending(&drive))? {
            return Err(Refusal::rule(why));
        }
        for (row, word) in writes {
            let what = format!("{}: {} = {word}", drive.name(), row.code);
            let record = self.audit.record(Record::new(Kind::Command, who.caller, what));
            record.done().await.map_err(|error| Refusal::rule(error.to_string()))?;
            self.is_still(&drive)?;
            who.hears()?;
            let written = timeout_at(deadline, drive.write_parameter(row, word)).await;
            let written = written.map_err(|_| pending(&drive))?;
            let written = written.map_err(|refused| Refusal::rule(format!("{}: {refused}", row.code)))?;
            self.plant.tell_written(who.caller, &drive, row, word, written.changed);
        }
        Ok(())
    }

    /// Whether a drive is the one that its unit meant, for what the plant does not judge.
    pub(super) fn is_still(&self, drive: &DriveHandle) -> Result<(), Refusal> {
        let judged = self.plant.is_as_shown(&Expects::of(drive), &[drive.name().to_string()]);
        judged.map_err(|otherwise| Refusal::rule(Rejected::Otherwise(otherwise).to_string()))
    }
}
