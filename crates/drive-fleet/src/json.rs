//! What a fleet knows, as programs read it: the objects that differ from the fields of their types.

use std::sync::Arc;

use drive_core::{Command, Fault, Measurements, Setpoint, Status};
use serde::{Serialize, Serializer};
use tokio::time::Instant;

use crate::{
    event::{Event, EventKind, ExitAction},
    outcome::Outcome,
    snapshot::{Counters, Freshness, IdentityCheck, Link, PendingStop, Snapshot, Trip, WatchdogCheck},
};

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct SnapshotObject<'a> {
    name: &'a str,
    link: Link,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    status: Judged<&'a Status>,
    measurements: Judged<&'a Measurements>,
    #[serde(skip_serializing_if = "Option::is_none")]
    setpoint: Option<Setpoint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reached: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<&'a Trip>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stop: Option<PendingStop>,
    started_here: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_refused: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    starts_by_itself: Option<Vec<&'static str>>,
    identity: &'a IdentityCheck,
    watchdog: &'a WatchdogCheck,
    counters: Counters,
}

/// A value beside the verdict on its age.
#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct Judged<T> {
    quality: Freshness,
    #[serde(flatten)]
    value: Option<T>,
}

impl<'a> From<&'a Snapshot> for SnapshotObject<'a> {
    fn from(snapshot: &'a Snapshot) -> Self {
        let now = Instant::now();
        let restarts = snapshot.self_restarts.as_ref();
        Self {
            name: &snapshot.name,
            link: snapshot.link,
            error: snapshot.error.as_ref().map(ToString::to_string),
            status: Judged {
                quality: snapshot.freshness(now),
                value: snapshot.status.as_ref().map(|status| &*status.value),
            },
            measurements: Judged {
                quality: snapshot.measurements_freshness(now),
                value: snapshot.measurements.as_ref().map(|measurements| &*measurements.value),
            },
            setpoint: snapshot.setpoint,
            reached: snapshot.has_reached_setpoint(now),
            fault: snapshot.present_trip(),
            stop: snapshot.stop,
            started_here: snapshot.started_here,
            start_refused: snapshot.start_refused(now).map(ToString::to_string),
            starts_by_itself: restarts.map(|all| all.iter().map(|one| one.code).collect()),
            identity: &snapshot.identity,
            watchdog: &snapshot.watchdog,
            counters: snapshot.counters,
        }
    }
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct TripObject<'a> {
    #[serde(flatten)]
    fault: Option<Fault>,
    by_watchdog: bool,
    #[serde(serialize_with = "drive_core::serialize::unix_ms")]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    time_unix_ms: Instant,
    #[serde(skip_serializing_if = "Option::is_none")]
    before: Option<&'a Status>,
    at_trip: &'a Status,
}

impl<'a> From<&'a Trip> for TripObject<'a> {
    fn from(trip: &'a Trip) -> Self {
        Self {
            fault: trip.fault(),
            by_watchdog: trip.by_watchdog,
            time_unix_ms: trip.at,
            before: trip.before.as_ref().map(|before| &*before.value),
            at_trip: &trip.status.value,
        }
    }
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct EventObject<'a> {
    #[serde(serialize_with = "drive_core::serialize::unix_ms")]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    time_unix_ms: Instant,
    drive: &'a str,
    event: String,
    alarm: bool,
    text: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<CommandObject<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<&'a Trip>,
    #[serde(skip_serializing_if = "Option::is_none")]
    exit: Option<&'a ExitAction>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct CommandObject<'a> {
    #[serde(flatten)]
    command: Command,
    commander: &'a str,
    #[serde(flatten)]
    outcome: &'a Outcome,
}

impl<'a> From<&'a Event> for EventObject<'a> {
    fn from(event: &'a Event) -> Self {
        let kind = &event.kind;
        let mut object = Self {
            time_unix_ms: event.at,
            drive: &event.drive,
            event: kind.name().replace(' ', "_"),
            alarm: kind.is_alarm(),
            text: kind.to_string(),
            command: None,
            fault: None,
            exit: None,
        };
        match kind {
            EventKind::Command { command, commander, outcome } => {
                object.command = Some(CommandObject { command: *command, commander, outcome });
            }
            EventKind::Tripped(trip) | EventKind::TripExplained(trip) => object.fault = Some(trip),
            EventKind::Exit(action) => object.exit = Some(action),
            _ => {}
        }
        object
    }
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct OutcomeObject {
    outcome: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
}

impl From<&Outcome> for OutcomeObject {
    fn from(outcome: &Outcome) -> Self {
        let text = match outcome {
            Outcome::Confirmed | Outcome::Expired => None,
            Outcome::NotConfirmed(why) => Some(why.to_string()),
            Outcome::OutcomeUnknown(unknown) => Some(unknown.to_string()),
            Outcome::Refused(why) => Some(why.to_string()),
        };
        Self { outcome: outcome.word(), reason: outcome.reason(), text }
    }
}

/// What became of a drive of a group.
#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct OfDrive<'a> {
    drive: &'a str,
    #[serde(flatten)]
    outcome: &'a Outcome,
}

pub(crate) fn by_drive<S: Serializer>(
    outcomes: &[(Arc<str>, Outcome)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(outcomes.iter().map(|(drive, outcome)| OfDrive { drive, outcome }))
}

/// Why a watchdog is not as it has to be.
#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct Why<'a> {
    why: &'a str,
}

pub(crate) fn why<S: Serializer>(why: &str, serializer: S) -> Result<S::Ok, S::Error> {
    Why { why }.serialize(serializer)
}

/// Writes a type as its object.
macro_rules! written_as {
    ($($type:ident as $object:ty;)*) => {
        $(
            impl Serialize for $type {
                fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    <$object>::from(self).serialize(serializer)
                }
            }

            #[cfg(feature = "schemars")]
            impl schemars::JsonSchema for $type {
                fn schema_name() -> std::borrow::Cow<'static, str> {
                    stringify!($type).into()
                }

                fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                    <$object>::json_schema(generator)
                }
            }
        )*
    };
}

written_as! {
    Snapshot as SnapshotObject<'_>;
    Trip as TripObject<'_>;
    Event as EventObject<'_>;
    Outcome as OutcomeObject;
}

#[cfg(test)]
mod tests;
