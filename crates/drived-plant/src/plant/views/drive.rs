//! One drive.

use std::{borrow::Cow, sync::Arc};

use drive_core::{Measurements, Status};
use drive_families::Family;
use drive_fleet::{
    Commanders, DriveHandle, FrequencyLimits, Freshness, Snapshot,
    view::{Judged, SnapshotView},
};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use tokio::time::Instant;

use drived_config::names::KnownAs;

/// A drive: where it is, what it was told, and what is known of it.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct DriveView {
    /// By what it is known that keeps over another name.
    #[serde(flatten)]
    pub known_as: KnownAs,
    pub line: String,
    /// At which machine its commands arrive, whatever it is called: its port, family and address, such as `/dev/ttyUSB0 atv312@1`.
    #[serde(default)]
    pub place: String,
    pub slave: u8,
    /// The family, such as `atv312`.
    pub family: Cow<'static, str>,
    /// What nobody can know of it, in sentences for whoever commands it; absent where its family knows all of that.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_known: Vec<Cow<'static, str>>,
    /// Whether it may be commanded at all.
    pub control: bool,
    /// Who may command it; absent where everybody who may command may.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub commanders: Option<Vec<String>>,
    /// Which setpoints it may be given, besides the drive's own limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<FrequencyLimits>,
    #[serde(flatten)]
    pub snapshot: SnapshotView,
}

impl DriveView {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.snapshot.name
    }

    /// A drive of a line as it is now.
    pub fn of(line: &str, drive: &DriveHandle, known_as: KnownAs) -> Self {
        let settings = drive.settings();
        Self {
            known_as,
            line: line.to_owned(),
            place: drive.place().to_string(),
            slave: drive.slave().number(),
            family: drive.capabilities().key.into(),
            not_known: not_known(drive),
            control: settings.control,
            commanders: match &settings.commanders {
                Commanders::Anyone => None,
                Commanders::Only(names) => Some(names.clone()),
            },
            limits: (!settings.limits.is_empty()).then(|| settings.limits.clone()),
            snapshot: SnapshotView::from(&*drive.snapshot()),
        }
    }
}

/// What its family says that nobody can know; nothing of a family that has no name here.
fn not_known(drive: &DriveHandle) -> Vec<Cow<'static, str>> {
    let family = drive.capabilities().key.parse::<Family>();
    family.map(|family| family.not_known().iter().map(|said| (*said).into()).collect()).unwrap_or_default()
}

/// What is told of a drive, without what changes though nothing happens: ages, and the counters of polls. What is the same
/// so need not be told twice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gist {
    snapshot: Snapshot,
    status: Option<Status>,
    measured: Option<Measurements>,
    freshness: (Freshness, Freshness),
}

impl Gist {
    pub fn of(snapshot: &Snapshot, now: Instant) -> Self {
        let freshness = (snapshot.freshness(now), snapshot.measurements_freshness(now));
        let mut snapshot = snapshot.clone();
        let status = snapshot.status.take().map(|timed| Status { at: None, ..Status::clone(&timed.value) });
        let measured = snapshot.measurements.take();
        let measured = measured.map(|timed| Measurements { at: None, ..Measurements::clone(&timed.value) });
        snapshot.counters.polls = 0;
        snapshot.counters.answered = 0;
        Self { snapshot, status, measured, freshness }
    }

    /// Whether what the drive shows is what it shows now.
    pub fn is_live(&self) -> bool {
        self.freshness.0 == Freshness::Fresh
    }
}

/// What a drive showed when a command ended, with the verdict on its age when this is read.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// Here.
    Live(Arc<Snapshot>),
    /// As it was told.
    Told(Box<Judged<Status>>),
}

impl Shown {
    /// The status, if there is one.
    pub fn status(&self) -> Option<&Status> {
        match self {
            Self::Live(snapshot) => snapshot.status.as_ref().map(|status| &*status.value),
            Self::Told(told) => told.value.as_ref(),
        }
    }
}

impl Serialize for Shown {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Live(snapshot) => {
                let quality = snapshot.freshness(Instant::now());
                Judged { quality, value: self.status().cloned() }.serialize(serializer)
            }
            Self::Told(told) => told.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Shown {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Judged::deserialize(deserializer).map(|told| Self::Told(Box::new(told)))
    }
}

impl JsonSchema for Shown {
    fn schema_name() -> Cow<'static, str> {
        "Shown".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        <Judged<Status>>::json_schema(generator)
    }
}
