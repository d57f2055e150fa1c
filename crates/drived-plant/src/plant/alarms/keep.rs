//! The alarms in a file of the state folder, so that none goes away with the program.

use std::{
    collections::BTreeMap,
    io,
    path::Path,
    sync::{Arc, Weak},
};

use drive_fleet::{
    Place, RunRecord,
    alarms::{Alarm, Alarms},
};
use serde::{Deserialize, Serialize};
use tokio::task::{JoinHandle, spawn_blocking};

use super::super::{Inner, Plant};
use drived_config::{
    kept::{Kept, Stale, Unwritten},
    places::Places,
    records::Records,
};

/// The form in which they are written.
const SCHEMA: u32 = 1;
/// The file of the state folder.
const FILE: &str = "alarms.json";
/// What is so where they cannot be read, or could not be written.
const LOSS: &str =
    "nobody knows which alarms were acknowledged, nor which there were; what is wrong becomes an alarm anew";

/// The alarms that were kept, and where.
#[derive(Debug, Clone, Default)]
pub struct KeptAlarms {
    file: Option<Kept>,
    pub(super) alarms: Alarms,
    /// Where the drives of the alarms are.
    places: DrivePlaces,
    /// What is kept of the drives' runs and stops.
    pub(super) runs: Option<Records<RunRecord>>,
}

/// By the names of the drives.
type DrivePlaces = BTreeMap<String, Place>;

/// As it stands in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    schema: u32,
    alarms: Alarms,
    /// A version before this one has kept none.
    #[serde(default)]
    places: DrivePlaces,
}

impl KeptAlarms {
    /// Those of this state folder; without one they live as long as the program. An alarm is of a machine: whoever is where its drive was has
    /// it, and that of a drive whose name another has now says where it was. What cannot be read is told and put aside, where it can
    /// be looked at: what is wrong now becomes an alarm anew.
    pub fn in_folder(folder: Option<&Path>, there: &Places) -> Self {
        let Some(file) = folder.map(|folder| Kept::at(&folder.join(FILE))) else { return Self::default() };
        let (mut alarms, places) = read(&file).unwrap_or_else(|error| {
            let aside = file.beside(".damaged");
            let is_aside = file.rename(&aside).unwrap_or_default();
            let place =
                if is_aside { format!(", it is in {} now", aside.path().display()) } else { String::new() };
            tracing::error!("{}: {error}{place}: {LOSS}", file.path().display());
            (Alarms::default(), DrivePlaces::new())
        });
        let names = names(&alarms, &places, there);
        alarms.rename_all(&names);
        let places = places.into_iter().map(|(name, place)| match names.get(&name) {
            Some(now) => (now.clone(), place),
            None => (name, place),
        });
        Self { file: Some(file), alarms, places: places.collect(), runs: None }
    }

    /// The same, where a stop or a run command that is kept of a drive which is not in the configuration is an alarm.
    #[must_use]
    pub fn with_runs_of(self, runs: Records<RunRecord>) -> Self {
        Self { runs: Some(runs), ..self }
    }
}

/// What the drives of these alarms are called now, by the names that they had, where these are others.
fn names(alarms: &Alarms, places: &DrivePlaces, there: &Places) -> BTreeMap<String, String> {
    let of_motion = |name: &str| {
        let of_drive = |alarm: &&Alarm| alarm.drive.as_deref() == Some(name);
        alarms.all().iter().filter(of_drive).any(|alarm| alarm.kind.is_of_motion())
    };
    let now = |(name, place): (&String, &Place)| {
        // Such an alarm goes with the stop.
        let now = there.now(name, Some(place), of_motion(name)).and_then(|place| there.name_at(place));
        let now = match now {
            Some(now) => now.to_owned(),
            None if there.has(name) => format!("{name} at {place}"),
            None => return None,
        };
        (now != *name).then(|| (name.clone(), now))
    };
    places.iter().filter_map(now).collect()
}

fn read(file: &Kept) -> io::Result<(Alarms, DrivePlaces)> {
    let Some(content) = file.read_secured()? else { return Ok(Default::default()) };
    let Written { schema, alarms, places } = serde_json::from_slice(&content)?;
    match schema {
        SCHEMA => Ok((alarms, places)),
        other => Err(io::Error::other(format!("it is written in form {other}, and {SCHEMA} is known here"))),
    }
}

impl Plant {
    /// Keeps the alarms in their file whenever they have changed, and ends with [`close_alarms`](Self::close_alarms).
    pub fn keep_alarms(&self, kept: KeptAlarms) -> JoinHandle<()> {
        let plant = Arc::downgrade(&self.0);
        let (changed, closed) = (self.0.alarms.changed.subscribe(), self.0.alarms.is_closed.subscribe());
        tokio::spawn(async move {
            let (mut changed, mut closed) = (changed, closed);
            let KeptAlarms { file: Some(file), mut places, .. } = kept else { return };
            let mut is_failing = false;
            loop {
                let is_last = *closed.borrow_and_update();
                changed.mark_unchanged();
                let Some(written) = write(&plant, &file, &mut places).await else { return };
                if let (Err(error), false) = (&written, is_failing) {
                    tracing::error!("{}: {error} {LOSS}", file.path().display());
                }
                is_failing = written.is_err();
                if is_last {
                    return;
                }
                tokio::select! {
                    changed = changed.changed() => if changed.is_err() { return },
                    closed = closed.changed() => if closed.is_err() { return },
                }
            }
        })
    }
}

/// Writes them as they are, and where their drives are; `None`: the plant or the runtime is gone.
async fn write(plant: &Weak<Inner>, file: &Kept, places: &mut DrivePlaces) -> Option<Result<(), Unwritten>> {
    let inner = plant.upgrade()?;
    let alarms = inner.alarms.lock().clone();
    let drives = alarms.all().iter().filter_map(|alarm| alarm.drive.clone());
    let place = |drive: String| {
        // Of one that is gone it is known from when it was there.
        let now = inner.fleet.drive(&drive).map(|known| known.place().clone());
        now.or_else(|| places.get(&drive).cloned()).map(|place| (drive, place))
    };
    *places = drives.filter_map(place).collect();
    drop(inner);
    let (file, places) = (file.clone(), places.clone());
    let written = spawn_blocking(move || {
        file.secure(serde_json::to_vec(&Written { schema: SCHEMA, alarms, places }), Stale::Emptied)
    });
    written.await.ok()
}
