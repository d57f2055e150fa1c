//! The alarms in a file of the state folder, so that none goes away with the program.

use std::{
    io::{self, Read as _},
    path::Path,
    sync::{Arc, Weak},
};

use drive_fleet::alarms::Alarms;
use serde::{Deserialize, Serialize};
use tokio::task::{JoinHandle, spawn_blocking};

use super::super::{Inner, Plant};
use drived_config::kept::{Kept, Readers};

/// The form in which they are written.
const SCHEMA: u32 = 1;
/// What is longer is nothing that was kept: a thousand drives with ten alarms each have a third of it.
const LONGEST: u64 = 16 << 20;
/// The file of the state folder.
const FILE: &str = "alarms.json";
/// What is said where they cannot be kept.
const LOSS: &str = "a restart forgets which alarms were acknowledged";

/// The alarms that were kept, and where.
#[derive(Debug, Clone, Default)]
pub struct KeptAlarms {
    file: Option<Kept>,
    pub(super) alarms: Alarms,
}

/// As it stands in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    schema: u32,
    alarms: Alarms,
}

impl KeptAlarms {
    /// Those of this state folder; without one they live as long as the program. What cannot be read is told and put aside, where it can
    /// be looked at: what is wrong now becomes an alarm anew.
    pub fn in_folder(folder: Option<&Path>) -> Self {
        let Some(file) = folder.map(|folder| Kept::at(&folder.join(FILE))) else { return Self::default() };
        let alarms = read(&file).unwrap_or_else(|error| {
            let aside = file.beside(".damaged");
            let is_aside = file.rename(&aside).unwrap_or_default();
            let place =
                if is_aside { format!(", it is in {} now", aside.path().display()) } else { String::new() };
            tracing::error!(
                "{}: {error}{place}: nobody knows which alarms were acknowledged",
                file.path().display()
            );
            Alarms::default()
        });
        Self { file: Some(file), alarms }
    }
}

fn read(file: &Kept) -> io::Result<Alarms> {
    let Some(open) = file.open()? else { return Ok(Alarms::default()) };
    let mut content = Vec::new();
    open.take(LONGEST).read_to_end(&mut content)?;
    let Written { schema, alarms } = serde_json::from_slice(&content)?;
    match schema {
        SCHEMA => Ok(alarms),
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
            let Some(file) = kept.file else { return };
            let mut is_failing = false;
            loop {
                let is_last = *closed.borrow_and_update();
                changed.mark_unchanged();
                let Some(written) = write(&plant, &file).await else { return };
                if let (Err(error), false) = (&written, is_failing) {
                    tracing::warn!("{}: {error}: {LOSS}", file.path().display());
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

/// Writes them as they are; `None`: the plant or the runtime is gone.
async fn write(plant: &Weak<Inner>, file: &Kept) -> Option<io::Result<()>> {
    let alarms = plant.upgrade()?.alarms.lock().clone();
    let file = file.clone();
    let written = spawn_blocking(move || {
        let text = serde_json::to_vec(&Written { schema: SCHEMA, alarms })?;
        file.replace(&text, Readers::Owner)
    });
    written.await.ok()
}
