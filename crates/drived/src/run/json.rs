//! Events and snapshots for programs.

use drive_core::Percent;
use drive_fleet::{Event, EventKind, ExitAction, Freshness, Link, Outcome, Snapshot, Trip};
use serde::Serialize;
use tokio::time::Instant;

use crate::json::{Motor, line, milliseconds, unix};

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Object<'a> {
    Event(EventObject<'a>),
    Snapshot(SnapshotObject<'a>),
    /// The reader of the events was slow.
    Missed {
        time_unix_ms: u64,
        events: u64,
    },
}

#[derive(Serialize)]
struct EventObject<'a> {
    time_unix_ms: u64,
    drive: &'a str,
    event: &'static str,
    alarm: bool,
    text: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<CommandObject<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<FaultObject>,
    #[serde(skip_serializing_if = "Option::is_none")]
    exit: Option<&'static str>,
}

#[derive(Serialize)]
struct CommandObject<'a> {
    command: String,
    commander: &'a str,
    outcome: &'static str,
}

#[derive(Serialize)]
struct FaultObject {
    #[serde(skip_serializing_if = "Option::is_none")]
    code: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mnemonic: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    remedy: Option<&'static str>,
    by_watchdog: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    before: Option<String>,
    status: String,
}

#[derive(Serialize)]
struct SnapshotObject<'a> {
    time_unix_ms: u64,
    drive: &'a str,
    link: &'static str,
    freshness: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    age_ms: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measurements_age_ms: Option<u64>,
    #[serde(flatten)]
    motor: Motor,
    #[serde(skip_serializing_if = "Option::is_none")]
    setpoint: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    motor_thermal_hundredths_of_percent: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    drive_thermal_hundredths_of_percent: Option<i32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    starts_by_itself: Vec<&'static str>,
    started_here: bool,
    stop_pending: bool,
    polls: u64,
    missed: u64,
    trips: u64,
}

/// An event as a line.
pub(super) fn event(event: &Event) -> String {
    let (command, fault, exit) = match &event.kind {
        EventKind::Command { command, commander, outcome } => {
            (Some(of_command(command, commander, outcome)), None, None)
        }
        EventKind::Tripped(trip) | EventKind::TripExplained(trip) => (None, Some(of_trip(trip)), None),
        EventKind::Exit(action) => (None, None, Some(of_exit(action))),
        _ => (None, None, None),
    };
    line(&Object::Event(EventObject {
        time_unix_ms: unix(event.at),
        drive: &event.drive,
        event: event.kind.name(),
        alarm: event.kind.is_alarm(),
        text: event.kind.to_string(),
        command,
        fault,
        exit,
    }))
}

/// A snapshot as a line.
pub(super) fn snapshot(snapshot: &Snapshot) -> String {
    let now = Instant::now();
    let measured = snapshot.measurements.as_ref().map(|measurements| &*measurements.value);
    line(&Object::Snapshot(SnapshotObject {
        time_unix_ms: unix(now),
        drive: &snapshot.name,
        link: match snapshot.link {
            Link::Connecting => "connecting",
            Link::Connected => "connected",
            Link::Lost => "lost",
        },
        freshness: match snapshot.freshness(now) {
            Freshness::Fresh => "fresh",
            Freshness::Stale => "stale",
            Freshness::Never => "never",
        },
        age_ms: snapshot.status.as_ref().map(|status| milliseconds(status.age(now))),
        measurements_age_ms: snapshot.measurements.as_ref().map(|values| milliseconds(values.age(now))),
        motor: snapshot.status.as_ref().map(|status| Motor::from(&*status.value)).unwrap_or_default(),
        setpoint: snapshot.setpoint.map(|setpoint| setpoint.to_string()),
        motor_thermal_hundredths_of_percent: measured
            .and_then(|measured| measured.motor_thermal)
            .map(Percent::hundredths),
        drive_thermal_hundredths_of_percent: measured
            .and_then(|measured| measured.drive_thermal)
            .map(Percent::hundredths),
        starts_by_itself: snapshot
            .self_restarts
            .iter()
            .flat_map(|all| all.iter())
            .map(|one| one.code)
            .collect(),
        started_here: snapshot.started_here,
        stop_pending: snapshot.stop.is_some(),
        polls: snapshot.counters.polls,
        missed: snapshot.counters.missed,
        trips: snapshot.counters.trips,
    }))
}

/// How many events a slow reader missed, as a line.
pub(super) fn missed(events: u64) -> String {
    line(&Object::Missed { time_unix_ms: unix(Instant::now()), events })
}

fn of_command<'a>(command: &drive_core::Command, commander: &'a str, outcome: &Outcome) -> CommandObject<'a> {
    CommandObject { command: command.to_string(), commander, outcome: outcome.kind() }
}

fn of_trip(trip: &Trip) -> FaultObject {
    let fault = trip.faults.as_ref().and_then(|faults| faults.present.first());
    FaultObject {
        code: fault.map(|fault| fault.code).or(trip.status.value.fault_code),
        mnemonic: fault.and_then(|fault| fault.entry).map(|entry| entry.mnemonic),
        remedy: fault.and_then(drive_core::Fault::remedy),
        by_watchdog: trip.watchdog_after.is_some(),
        before: trip.before.as_ref().map(|before| before.value.to_string()),
        status: trip.status.value.to_string(),
    }
}

const fn of_exit(action: &ExitAction) -> &'static str {
    match action {
        ExitAction::Left => "left",
        ExitAction::Stopped(_) => "stopped",
        ExitAction::Released(_) => "released",
        ExitAction::TimeOver => "time over",
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Command, Direction};

    use super::*;

    #[test]
    fn an_outcome_is_an_object_that_names_command_commander_and_outcome() {
        let told = event(&Event {
            drive: "pump 1".into(),
            at: Instant::now(),
            kind: EventKind::Command {
                command: Command::Start(Direction::Forward),
                commander: "operator".into(),
                outcome: Outcome::Expired,
            },
        });
        let object: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!((&object["kind"], &object["event"]), (&"event".into(), &"command".into()));
        assert_eq!(object["command"]["command"], "start forward");
        assert_eq!(object["command"]["outcome"], "expired");
        assert_eq!(object["text"], "command: start forward by operator: expired");
    }
}
