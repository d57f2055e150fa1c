//! What was written to each drive's EEPROM, kept beyond the life of the program: what was tried in vain is not tried again by the
//! next, and a day is a day.

use drive_fleet::{EepromLedger, Event, EventKind};

use drived_config::records::Records;

/// Notes what has happened. Gives whether the file is another now.
pub(super) fn note(records: &Records<EepromLedger>, event: &Event) -> bool {
    match &event.kind {
        EventKind::EepromWritten { ledger, .. } => {
            records.set(&event.place, &event.drive, Some(ledger.clone()))
        }
        _ => false,
    }
}
