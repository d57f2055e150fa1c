//! What each watchdog was before this program armed it, kept beyond the life of the program: one that is killed puts
//! nothing back, and the next finds the drive armed.

use drive_fleet::{Event, EventKind, WatchdogBefore};

use drived_config::records::Records;

/// Notes what has happened. Gives whether the file is another now.
pub(super) fn note(records: &Records<WatchdogBefore>, event: &Event) -> bool {
    let Event { drive, place, kind, .. } = event;
    match kind {
        EventKind::WatchdogVerified { before: Some(before), .. } => {
            records.set(place, drive, Some(WatchdogBefore::clone(before)))
        }
        EventKind::WatchdogRestored(_) | EventKind::IdentityChanged { .. } => records.set(place, drive, None),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use drive_core::{Reaction, Watchdog};
    use drive_fleet::Cause;
    use drived_config::places::Places;

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
        let event = |kind| Event::now("pump 1", kind, Cause::Drive);
        let records = Records::open(None, &Places::default());
        assert!(note(&records, &event(verified.clone())) && !note(&records, &event(verified)));
        assert_eq!(records.of(&"pump 1".into()), Some(before));
        assert!(note(&records, &event(EventKind::WatchdogRestored(armed(10)))));
        assert_eq!(records.of(&"pump 1".into()), None);
    }
}
