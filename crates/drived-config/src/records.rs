//! What is kept of each drive in a file of the state folder, beyond the life of the program: by the place of the drive, for it belongs to
//! a machine and not to a name.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use drive_core::StopMode;
use drive_fleet::{EepromLedger, Event, EventKind, Events, Place, Received, RunRecord, WatchdogBefore};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};
use tokio::task::{JoinHandle, spawn_blocking};

use self::read::Read;
use crate::{
    kept::{Kept, Stale},
    places::Places,
};

mod read;

/// What is kept of a drive.
pub trait Record: Serialize + DeserializeOwned + Clone + PartialEq {
    /// What is so where the file cannot be read, or could not be written.
    const LOSS: &'static str;
    /// What becomes of the file where it cannot be written.
    const STALE: Stale = Stale::Emptied;

    /// Whether a stop is in it that was not confirmed.
    fn stops(&self) -> bool {
        false
    }

    /// Whether a stop may be in it by what of it is not known here.
    fn may_hide_a_stop(&self) -> bool {
        false
    }

    /// What is taken from one that cannot be read.
    fn rescued(_record: &Value) -> Option<Self> {
        None
    }

    /// Whether it stays at its place as well where it goes by the name to another one: that may be another machine.
    fn stays_behind(&self) -> bool {
        false
    }

    /// What is so where the configuration has nobody at its place, in words.
    fn alone(&self) -> &'static str;
}

impl Record for RunRecord {
    const LOSS: &'static str = "no motor that turns is taken for one of ours, and no stop is given anew that was not confirmed: A MOTOR MAY TURN";

    fn stops(&self) -> bool {
        self.stop.is_some()
    }

    /// One that has its stop is given it.
    fn may_hide_a_stop(&self) -> bool {
        self.stop.is_none()
    }

    /// A stop that was given is given anew, by the ramp where its way is not known here, with as much as can be read: one stop too many is better
    /// than one too few.
    fn rescued(record: &Value) -> Option<Self> {
        let said = record.get("stop").filter(|said| !said.is_null())?;
        let is_known = serde_json::from_value::<StopMode>(said.clone()).is_ok();
        let stop = if is_known { said.clone() } else { serde_json::to_value(StopMode::Ramp).ok()? };
        let with = |keys: &[&str]| {
            let keys = keys.iter().filter_map(|key| Some(((*key).to_owned(), record.get(key)?.clone())));
            let all = keys.chain([("stop".to_owned(), stop.clone())]).collect::<Map<_, _>>();
            serde_json::from_value(Value::Object(all)).ok()
        };
        with(&["identity", "lease"]).or_else(|| with(&["identity"]))
    }

    /// A stop is given where its name is, and told. A run is adopted there, or it stands where it was and nobody watches it.
    fn stays_behind(&self) -> bool {
        self.stop.is_none()
    }

    fn alone(&self) -> &'static str {
        match self.stop {
            Some(_) => "a stop of it was not confirmed, and nobody gives it: THE MOTOR MAY TURN",
            None => "a run command of this program may stand in it: THE MOTOR MAY TURN",
        }
    }
}

impl Record for WatchdogBefore {
    const LOSS: &'static str = "watchdogs that an earlier run, or one that is killed, has armed stay armed";

    fn alone(&self) -> &'static str {
        "its watchdog may be armed by this program"
    }
}

impl Record for EepromLedger {
    const LOSS: &'static str = "the writes to EEPROM since the last that was kept are not counted";
    // One that counts too few is better than one that begins anew.
    const STALE: Stale = Stale::Left;

    fn alone(&self) -> &'static str {
        "its EEPROM was written"
    }
}

/// One record of each drive, in a file. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Records<T>(Arc<Mutex<Inner<T>>>);

#[derive(Debug)]
struct Inner<T> {
    file: Option<Kept>,
    /// By the places of the drives, or what stands for one: the name, where a version before this one has kept no place.
    drives: BTreeMap<Place, Entry<T>>,
    /// Writing has failed, which is told once.
    failing: bool,
    /// What could not be read, in words, and to which nobody has seen.
    lost: Option<String>,
}

#[derive(Debug)]
struct Entry<T> {
    /// What the drive was called; `None`: nobody has kept where it is, and what is by the names is its name.
    name: Option<String>,
    record: T,
    /// Nobody is there.
    is_alone: bool,
}

/// As it stands in the file.
#[derive(Serialize)]
#[serde(untagged)]
enum Written<T> {
    /// By the place.
    At { drive: String, record: T },
    /// By the name.
    Of(T),
}

impl<T: Record> Records<T> {
    /// Reads the file, and gives what stands in it to whom it belongs. What belongs to nobody is told, and kept. What cannot be read keeps
    /// no motor from being watched, and no other record from being read: it is told what is missing then, and the file is put aside.
    pub fn open(file: Option<&Path>, places: &Places) -> Self {
        let file = file.map(Kept::at);
        let told = file.as_ref().map_or(Path::new(""), Kept::path).display().to_string();
        let Read { records, lost, doubts } = file.as_ref().map_or_else(Read::default, Read::<T>::of);
        for doubt in doubts {
            tracing::warn!("{told}: {doubt}");
        }
        // What stands there is not overwritten before it stands elsewhere.
        let (mut is_other, lost) = match &file {
            Some(file) if !lost.is_empty() => {
                let aside = read::put_aside(file).inspect_err(|error| {
                    tracing::error!("{told}: it cannot be put aside: {error}");
                });
                let lost = read::told(&lost, aside.as_ref().ok());
                tracing::error!("{told}: {lost}. Of what could not be read: {}", T::LOSS);
                (aside.is_ok(), Some(lost))
            }
            Some(file) => (false, read::lost_before::<T>(file)),
            None => (false, None),
        };
        let (mut drives, mut others) = (BTreeMap::new(), Vec::new());
        for (name, place, record) in records {
            match place.as_ref().and_then(|place| Some((place, places.name_at(place)?))) {
                Some((place, now)) => {
                    is_other |= now != name;
                    drives.insert(place.clone(), Entry::of(now, record));
                }
                None => others.push((name, place, record)),
            }
        }
        // Whoever is at the place of a record comes first.
        for (name, place, record) in others {
            let at = place.as_ref().map_or("a place that was not kept".to_owned(), Place::to_string);
            let now = places.now(&name, place.as_ref(), record.stops());
            if let Some(now) = now.filter(|now| !drives.contains_key(*now)) {
                if let Some(place) = place {
                    let text = format!(
                        "{told}: {name} was at {at}, where nobody is any more, and what was kept of it goes to {name} at {now}. If these are \
                         two drives: {} at {at}",
                        record.alone()
                    );
                    tell(&record, &text);
                    if record.stays_behind() {
                        let (name, record) = (Some(name.clone()), record.clone());
                        drives.insert(place, Entry { name, record, is_alone: true });
                    }
                }
                is_other = true;
                drives.insert(now.clone(), Entry::of(&name, record));
                continue;
            }
            let text = format!(
                "{told}: {name} at {at} is not in the configuration: {}; it is kept until it is there again",
                record.alone()
            );
            tell(&record, &text);
            let (key, name) = match place {
                Some(place) => (place, Some(name)),
                None => (Place::from(&*name), None),
            };
            drives.insert(key, Entry { name, record, is_alone: true });
        }
        let records = Self(Arc::new(Mutex::new(Inner { file, drives, failing: false, lost })));
        if is_other {
            // What is there says the same, in other words.
            records.write_or(Stale::Left);
        }
        records
    }

    /// The record of the drive at a place.
    pub fn of(&self, place: &Place) -> Option<T> {
        self.lock().drives.get(place).map(|entry| entry.record.clone())
    }

    /// The records of those who are there: by their places, with their names.
    pub fn all(&self) -> Vec<(Place, String, T)> {
        let there = |(place, entry): (&Place, &Entry<T>)| {
            let name = entry.name.clone().filter(|_| !entry.is_alone)?;
            Some((place.clone(), name, entry.record.clone()))
        };
        self.lock().drives.iter().filter_map(there).collect()
    }

    /// The records of drives that are not in the configuration: by their places, which drive each is of.
    pub fn left(&self) -> BTreeMap<Place, (String, T)> {
        let left = |(place, entry): (&Place, &Entry<T>)| {
            let of =
                entry.name.as_ref().map_or_else(|| place.to_string(), |name| format!("{name} ({place})"));
            entry.is_alone.then(|| (place.clone(), (of, entry.record.clone())))
        };
        self.lock().drives.iter().filter_map(left).collect()
    }

    /// Has this be the record of the drive at a place, which is called so now. Gives whether the file is to be written for it.
    pub fn set(&self, place: &Place, drive: &str, record: Option<T>) -> bool {
        let mut inner = self.lock();
        let Some(record) = record else { return inner.drives.remove(place).is_some() };
        let new = Entry::of(drive, record);
        let before = inner.drives.get(place);
        let is_same =
            |before: &Entry<T>| before.record == new.record && before.name == new.name && !before.is_alone;
        if before.is_some_and(is_same) {
            return false;
        }
        inner.drives.insert(place.clone(), new);
        true
    }

    /// The same for all that are there: who is not among these has none.
    pub fn set_all(&self, all: impl IntoIterator<Item = (Place, String, T)>) {
        let mut inner = self.lock();
        inner.drives.retain(|_, entry| entry.is_alone);
        let all = all.into_iter().map(|(place, drive, record)| (place, Entry::of(&drive, record)));
        inner.drives.extend(all);
    }

    /// The drive at a place has shown that this record is its own: none of its name is left elsewhere, at another port. Gives whether the file
    /// is to be written for it.
    pub fn settle(&self, place: &Place, drive: &str) -> bool {
        self.take_out(|other, entry| entry.name.as_deref() == Some(drive) && other.drive() == place.drive())
    }

    /// Somebody has seen to what is left at a place of a drive that is not in the configuration. Gives whether the file is to be written for it.
    pub fn forget(&self, place: &Place) -> bool {
        self.take_out(|other, _| other == place)
    }

    /// What could not be read, by this run or an earlier one, in words, until somebody has seen to it.
    pub fn lost(&self) -> Option<String> {
        self.lock().lost.clone()
    }

    /// Somebody has seen to what could not be read.
    pub fn see_to_lost(&self) {
        let file = {
            let mut inner = self.lock();
            inner.lost.take().and(inner.file.clone())
        };
        if let Some((file, Err(error))) = file.map(|file| (file.clone(), read::see_to(&file))) {
            tracing::error!("{}: {error}: it is told anew by the next run", file.path().display());
        }
    }

    /// Takes out what is nobody's, of these.
    fn take_out(&self, is_meant: impl Fn(&Place, &Entry<T>) -> bool) -> bool {
        let drives = &mut self.lock().drives;
        let before = drives.len();
        drives.retain(|place, entry| !entry.is_alone || !is_meant(place, entry));
        drives.len() < before
    }

    /// The drive at a place is called so now. Gives whether the file is to be written for it.
    pub fn call(&self, place: &Place, drive: &str) -> bool {
        let record = self.of(place);
        record.is_some() && self.set(place, drive, record)
    }

    /// Writes the file; whether it could be. What cannot be written is told once, until it can be again.
    pub fn write(&self) -> bool {
        self.write_or(T::STALE)
    }

    fn write_or(&self, stale: Stale) -> bool {
        let (file, text) = {
            let inner = self.lock();
            let Some(file) = inner.file.clone() else { return true };
            let written = |(key, entry): (&Place, &Entry<T>)| {
                let record = entry.record.clone();
                let written = match entry.name.clone() {
                    Some(drive) => Written::At { drive, record },
                    None => Written::Of(record),
                };
                (key.clone(), written)
            };
            let all: BTreeMap<_, _> = inner.drives.iter().map(written).collect();
            (file, serde_json::to_vec_pretty(&all))
        };
        let written = file.secure(text, stale);
        let mut inner = self.lock();
        if let (Err(error), false) = (&written, inner.failing) {
            tracing::error!("{}: {error} {}", file.path().display(), T::LOSS);
        }
        inner.failing = written.is_err();
        written.is_ok()
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Entry<T> {
    fn of(name: &str, record: T) -> Self {
        Self { name: Some(name.to_owned()), record, is_alone: false }
    }
}

fn tell(record: &impl Record, text: &str) {
    if record.stops() {
        tracing::error!("{text}");
    } else {
        tracing::warn!("{text}");
    }
}

/// Follows the drives until the fleet ends: `note` says whether the file is another after an event.
pub fn follow<T>(
    records: Records<T>,
    mut events: Events,
    note: fn(&Records<T>, &Event) -> bool,
) -> JoinHandle<()>
where
    T: Record + Send + 'static,
{
    tokio::spawn(async move {
        loop {
            let event = match events.recv().await {
                Received::Event(event) => event,
                Received::Missed(_) => continue,
                Received::End => return,
            };
            let is_another = match &event.kind {
                EventKind::Renamed(_) => records.call(&event.place, &event.drive),
                _ => note(&records, &event),
            };
            if !is_another {
                continue;
            }
            let writing = records.clone();
            // The runtime ends.
            let Ok(_) = spawn_blocking(move || writing.write()).await else { return };
        }
    })
}

/// The file of this name in the state folder.
pub fn in_folder(folder: Option<&Path>, name: &str) -> Option<PathBuf> {
    folder.map(|folder| folder.join(name))
}

#[cfg(test)]
mod tests;
