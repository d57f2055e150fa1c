//! What the receivers have been told, in a file of the state folder, so that a start tells nothing twice and forgets nothing.

use std::{
    collections::BTreeMap,
    io::{self, Read as _},
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use drived_config::kept::{Kept, Readers};
use serde::{Deserialize, Serialize};
use tokio::{sync::watch, task::spawn_blocking};

use crate::outbox::Told;

/// The file of the state folder.
const FILE: &str = "webhooks.json";
/// The form in which it is written.
const SCHEMA: u32 = 1;
/// What is longer is nothing that was kept.
const LONGEST: u64 = 16 << 20;

/// Of all receivers, by their names. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Memory(Arc<Inner>);

struct Inner {
    file: Option<Kept>,
    receivers: Mutex<BTreeMap<String, Told>>,
    changed: watch::Sender<u64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    schema: u32,
    receivers: BTreeMap<String, Told>,
}

impl Memory {
    /// That of this state folder; without one it is as long as the program. What cannot be read is told: what stands is posted again then.
    pub(crate) fn in_folder(folder: Option<&Path>) -> Self {
        let file = folder.map(|folder| Kept::at(&folder.join(FILE)));
        let read = file.as_ref().map_or_else(|| Ok(BTreeMap::new()), read);
        let receivers = read.unwrap_or_else(|error| {
            tracing::warn!("{FILE} in the state folder: {error}: what stands is posted once more");
            BTreeMap::new()
        });
        Self(Arc::new(Inner { file, receivers: Mutex::new(receivers), changed: watch::Sender::new(0) }))
    }

    /// Takes out what was kept of those that are there; of others nothing is kept any more.
    pub(crate) fn keep_only(&self, names: &[&str]) {
        self.receivers().retain(|name, _| names.contains(&name.as_str()));
    }

    pub(crate) fn of(&self, name: &str) -> Told {
        self.receivers().get(name).cloned().unwrap_or_default()
    }

    /// One has been told so much. It is written a little later.
    pub(crate) fn set(&self, name: &str, told: &Told) {
        self.receivers().insert(name.to_owned(), told.clone());
        self.0.changed.send_modify(|times| *times += 1);
    }

    /// Writes it whenever it has changed, until this is dropped.
    pub(crate) async fn keep(self) {
        let mut changed = self.0.changed.subscribe();
        let mut is_failing = false;
        while changed.changed().await.is_ok() {
            let written = self.write().await;
            if let (Err(error), false) = (&written, is_failing) {
                tracing::warn!(
                    "{FILE} in the state folder: {error}: the next start posts once more what stands"
                );
            }
            is_failing = written.is_err();
        }
    }

    /// Writes it as it is.
    pub(crate) async fn write(&self) -> io::Result<()> {
        let Some(file) = self.0.file.clone() else { return Ok(()) };
        let receivers = self.receivers().clone();
        let written = spawn_blocking(move || {
            let text = serde_json::to_vec(&Written { schema: SCHEMA, receivers })?;
            file.replace(&text, Readers::Owner)
        });
        written.await.map_err(io::Error::other)?
    }

    fn receivers(&self) -> MutexGuard<'_, BTreeMap<String, Told>> {
        self.0.receivers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn read(file: &Kept) -> io::Result<BTreeMap<String, Told>> {
    let Some(open) = file.open()? else { return Ok(BTreeMap::new()) };
    let mut text = Vec::new();
    open.take(LONGEST).read_to_end(&mut text)?;
    let Written { schema, receivers } = serde_json::from_slice(&text)?;
    match schema {
        SCHEMA => Ok(receivers),
        other => Err(io::Error::other(format!("it is written in form {other}, and {SCHEMA} is known here"))),
    }
}
