//! What each watchdog was before this program armed it, kept beyond the life of the program: one that is killed puts
//! nothing back, and the next finds the drive armed.

use drive_fleet::{EventKind, WatchdogBefore};

use drived_config::records::Records;

/// What is not so where they cannot be kept.
pub(super) const LOSS: &str = "watchdogs that an earlier run, or one that is killed, has armed stay armed";

/// Notes what has happened. Gives whether the file is another now.
pub(super) fn note(records: &mut Records<WatchdogBefore>, drive: &str, kind: &EventKind) -> bool {
    match kind {
        EventKind::WatchdogVerified { before: Some(before), .. } => {
            records.set(drive, Some(WatchdogBefore::clone(before)))
        }
        EventKind::WatchdogRestored(_) | EventKind::IdentityChanged { .. } => records.set(drive, None),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use drive_core::{Reaction, Watchdog};

    use super::*;

    fn armed(seconds: u64) -> Watchdog {
        Watchdog { timeout: Some(Duration::from_secs(seconds)), reaction: Some(Reaction::Freewheel) }
    }

    #[test]
    fn what_was_found_is_kept_and_forgotten_once_it_is_put_back() {
        let found = Watchdog { timeout: None, reaction: Some(Reaction::Unknown(7)) };
        let before = WatchdogBefore { identity: "ATV312 1.3".to_owned(), set: armed(10), found };
        let verified = EventKind::WatchdogVerified {
            watchdog: armed(10),
            written: true,
            before: Some(Arc::new(before.clone())),
        };
        let mut records = Records::open(None, LOSS);
        assert!(note(&mut records, "pump 1", &verified) && !note(&mut records, "pump 1", &verified));
        assert_eq!(records.of("pump 1"), Some(&before));
        assert!(note(&mut records, "pump 1", &EventKind::WatchdogRestored(armed(10))));
        assert_eq!(records.of("pump 1"), None);
    }
}
