//! Events and snapshots for programs.

use drive_core::serialize::unix_ms;
use drive_fleet::{Event, Snapshot};
use serde::Serialize;
use tokio::time::Instant;

use drived_words::json::line;

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Object<'a> {
    Event(&'a Event),
    Snapshot {
        #[serde(serialize_with = "unix_ms")]
        time_unix_ms: Instant,
        #[serde(flatten)]
        snapshot: &'a Snapshot,
    },
    /// The reader of the events was slow.
    Missed {
        #[serde(serialize_with = "unix_ms")]
        time_unix_ms: Instant,
        events: u64,
    },
}

/// An event as a line.
pub(super) fn event(event: &Event) -> String {
    line(&Object::Event(event))
}

/// A snapshot as a line.
pub(super) fn snapshot(snapshot: &Snapshot) -> String {
    line(&Object::Snapshot { time_unix_ms: Instant::now(), snapshot })
}

/// How many events a slow reader missed, as a line.
pub(super) fn missed(events: u64) -> String {
    line(&Object::Missed { time_unix_ms: Instant::now(), events })
}

#[cfg(test)]
mod tests {
    use drive_core::{Command, Direction};
    use drive_fleet::{Cause, EventKind, Outcome};

    use super::*;

    #[test]
    fn an_outcome_is_an_object_that_names_command_commander_and_outcome() {
        let command = EventKind::Command {
            command: Command::Start(Direction::Forward),
            setpoint: None,
            commander: "operator".into(),
            outcome: Outcome::Expired,
        };
        let told = event(&Event::now("pump 1", command, Cause::Command("operator".into())));
        let object: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!((&object["kind"], &object["event"]), (&"event".into(), &"command".into()));
        assert_eq!(object["command"]["command"], "start forward");
        assert_eq!(object["command"]["outcome"], "expired");
        assert_eq!(
            object["text"],
            "command: start forward by operator: expired: its time was over before it was sent: it never will be"
        );
    }
}
