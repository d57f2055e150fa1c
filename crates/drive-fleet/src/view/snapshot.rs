//! What is known of a drive, as programs read it: its values with the verdict on their age, its trip, and what troubles it.

use std::sync::Arc;

use drive_core::{Fault, Measurements, Setpoint, Status};
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use super::{unix_ms, whole_ms};
use crate::{
    concern::{Concern, ConcernKind, Severity},
    shows::Shows,
    snapshot::{Counters, Freshness, IdentityCheck, Link, PendingStop, Snapshot, Trip, WatchdogCheck},
};

/// What is known of a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SnapshotView {
    /// Its name.
    pub name: Arc<str>,
    /// What it does, in the one word with which its row begins.
    #[serde(default)]
    pub shows: Shows,
    /// Whether it answers.
    pub link: Link,
    /// What went wrong last since its last status.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The fast set.
    pub status: Judged<Status>,
    /// The slow set.
    pub measurements: Judged<Measurements>,
    /// The setpoint that it was given last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setpoint: Option<Setpoint>,
    /// Whether its output has reached it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<bool>,
    /// The trip that it shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<TripView>,
    /// A stop that is not confirmed yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<PendingStop>,
    /// Whether this fleet started the motor.
    pub started_here: bool,
    /// Why a start would be refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_refused: Option<String>,
    /// The settings by which it starts its motor again by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts_by_itself: Option<Vec<String>>,
    /// Which drive it is.
    pub identity: IdentityCheck,
    /// Its communication watchdog.
    pub watchdog: WatchdogCheck,
    /// All that troubles it, the worst first.
    #[serde(default)]
    pub concerns: Vec<ConcernView>,
    /// Counters.
    pub counters: Counters,
}

impl SnapshotView {
    /// The worst that troubles it.
    #[must_use]
    pub fn concern(&self) -> Option<&ConcernView> {
        self.concerns.first()
    }

    /// Its place among all by what troubles it: 0 is the worst, and who troubles nobody comes last.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.concern().map_or(usize::MAX, |concern| concern.rank)
    }

    /// What is known of it at `now`.
    #[must_use]
    pub fn of(snapshot: &Snapshot, now: Instant) -> Self {
        let restarts = snapshot.self_restarts.as_ref();
        Self {
            name: Arc::clone(&snapshot.name),
            shows: snapshot.shows(),
            link: snapshot.link,
            error: snapshot.error.as_ref().map(ToString::to_string),
            status: Judged {
                quality: snapshot.freshness(now),
                value: snapshot.status.as_ref().map(|status| Status::clone(&status.value)),
            },
            measurements: Judged {
                quality: snapshot.measurements_freshness(now),
                value: snapshot.measurements.as_ref().map(|measured| Measurements::clone(&measured.value)),
            },
            setpoint: snapshot.setpoint,
            reached: snapshot.has_reached_setpoint(now),
            fault: snapshot.present_trip().map(TripView::from),
            stop: snapshot.stop,
            started_here: snapshot.started_here(),
            start_refused: snapshot.start_refused(now).map(ToString::to_string),
            starts_by_itself: restarts.map(|all| all.iter().map(|one| one.code.to_owned()).collect()),
            identity: snapshot.identity.clone(),
            watchdog: snapshot.watchdog.clone(),
            concerns: snapshot.concerns(now).iter().map(|concern| ConcernView::of(concern, now)).collect(),
            counters: snapshot.counters,
        }
    }
}

impl From<&Snapshot> for SnapshotView {
    fn from(snapshot: &Snapshot) -> Self {
        Self::of(snapshot, Instant::now())
    }
}

/// A value beside the verdict on its age.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Judged<T> {
    /// The verdict.
    pub quality: Freshness,
    /// The value.
    #[serde(flatten)]
    pub value: Option<T>,
}

impl<T> Judged<T> {
    /// Whether the value is so now.
    #[must_use]
    pub const fn is_good(&self) -> bool {
        matches!(self.quality, Freshness::Fresh)
    }
}

/// Something that troubles a drive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ConcernView {
    /// What.
    pub kind: ConcernKind,
    /// Its place among all kinds: 0 is the worst.
    pub rank: usize,
    /// How badly.
    pub severity: Severity,
    /// Whether somebody is woken for it.
    pub wakes: bool,
    /// For how long, by the clock of whoever told it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since_ms: Option<u64>,
    /// It in a sentence.
    pub text: String,
    /// The part of the sentence that is of this drive, behind the words of the kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
    /// What to do first.
    pub remedy: String,
}

impl ConcernView {
    /// What troubles a drive at `now`.
    #[must_use]
    pub fn of(concern: &Concern, now: Instant) -> Self {
        let kind = concern.kind;
        Self {
            kind,
            rank: kind.rank(),
            severity: kind.severity(),
            wakes: kind.wakes(),
            since_ms: concern.lasts(now).map(whole_ms),
            text: concern.to_string(),
            detail: concern.detail.clone(),
            remedy: kind.remedy().to_owned(),
        }
    }
}

/// A trip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct TripView {
    /// What it tripped by; absent while the drive has not said.
    #[serde(flatten)]
    pub fault: Option<Fault>,
    /// Whether by its communication watchdog, as its own code says.
    pub by_watchdog: bool,
    /// How long it had not been heard then, where that is longer than its watchdog waits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watchdog_after_ms: Option<u64>,
    /// Whether it was found so: it tripped at some time before.
    #[serde(default)]
    pub found: bool,
    /// When it was seen, by the wall's clock.
    pub time_unix_ms: u64,
    /// The last status before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<Status>,
    /// The first that shows it.
    pub at_trip: Status,
}

impl From<&Trip> for TripView {
    fn from(trip: &Trip) -> Self {
        Self {
            fault: trip.fault(),
            by_watchdog: trip.by_watchdog,
            watchdog_after_ms: trip.watchdog_after.map(whole_ms),
            found: trip.found,
            time_unix_ms: unix_ms(trip.wall),
            before: trip.before.as_ref().map(|before| Status::clone(&before.value)),
            at_trip: Status::clone(&trip.status.value),
        }
    }
}
