//! What was written to each drive's EEPROM, kept beyond the life of the program: what was tried in vain is not tried again by the
//! next, and a day is a day.

use drive_fleet::{EepromLedger, EventKind};

use super::records::Records;

/// The file of the state folder.
pub(super) const FILE: &str = "eeprom.json";
/// What is not so where they cannot be kept.
pub(super) const LOSS: &str = "the next run of this program counts the writes to EEPROM anew";

/// Notes what has happened. Gives whether the file is another now.
pub(super) fn note(records: &mut Records<EepromLedger>, drive: &str, kind: &EventKind) -> bool {
    match kind {
        EventKind::EepromWritten { ledger, .. } => records.set(drive, Some(ledger.clone())),
        _ => false,
    }
}
