//! What was written to each drive's EEPROM, kept beyond the life of the program: what was tried in vain is not tried again by the
//! next, and a day is a day.

use drive_fleet::{EepromLedger, EventKind};

use drived_config::records::Records;

/// Notes what has happened. Gives whether the file is another now.
pub(super) fn note(records: &mut Records<EepromLedger>, drive: &str, kind: &EventKind) -> bool {
    match kind {
        EventKind::EepromWritten { ledger, .. } => records.set(drive, Some(ledger.clone())),
        _ => false,
    }
}
