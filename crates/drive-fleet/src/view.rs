//! What a fleet knows, as programs write it **and read it back**: the objects of [`Snapshot`], [`Event`], [`Outcome`] and
//! [`Trip`]. Each is what the type of its name is written as. A sentence stands beside the fields that it is made of, never
//! instead of them.
//!
//! ```
//! use drive_fleet::{Cause, Event, EventKind, view::{EventView, Happened}};
//! use drive_core::State;
//!
//! let kind = EventKind::StateChanged { from: State::Ready, to: State::Running };
//! let told = serde_json::to_string(&Event::now("pump 1", kind, Cause::Drive))?;
//! let read: EventView = serde_json::from_str(&told)?;
//! assert_eq!(read.what, Happened::StateChanged { from: State::Ready, to: State::Running });
//! # Ok::<_, serde_json::Error>(())
//! ```

mod event;
mod finding;
mod outcome;
mod snapshot;

use std::time::{Duration, SystemTime};

use drive_core::{Error, ErrorKind, Refusal};
use serde::{Deserialize, Serialize, Serializer};

use crate::{
    event::{Event, ExitAction},
    outcome::Outcome,
    snapshot::{Snapshot, Trip},
};

pub(crate) use self::outcome::by_drive;
pub use self::{
    event::{EventView, Happened},
    finding::FindingFigures,
    outcome::{CommandedView, Ended, ExitView, OfDrive, OutcomeView, SeenView, StopModesView},
    snapshot::{ConcernView, Judged, SnapshotView, TripView},
};

/// Why something is not so, as programs read it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RefusalView {
    /// In one word.
    pub reason: String,
    /// In a sentence.
    pub text: String,
}

impl From<&Refusal> for RefusalView {
    fn from(refusal: &Refusal) -> Self {
        Self { reason: refusal.word().to_owned(), text: refusal.to_string() }
    }
}

/// What went wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ErrorView {
    /// Of which kind.
    pub kind: ErrorKind,
    /// The slave, the register and the reason, in a sentence.
    pub text: String,
}

impl From<&Error> for ErrorView {
    fn from(error: &Error) -> Self {
        Self { kind: error.kind(), text: error.to_string() }
    }
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
    Snapshot as SnapshotView;
    Trip as TripView;
    Event as EventView;
    Outcome as OutcomeView;
    ExitAction as ExitView;
}

fn unix_ms(at: SystemTime) -> u64 {
    whole_ms(at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default())
}

fn whole_ms(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
