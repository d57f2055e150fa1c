//! Who is who, for those who know drives by a number or by a topic, such as a SCADA that reads the virtual unit of a gateway, and the
//! readers of a broker: given once, kept in the state folder, and given to no other before a person says so.

mod table;

use std::{
    io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use crc::{CRC_16_MODBUS, Crc};
use drive_fleet::Place;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::table::{Configured, Kind, Known, Named, Table, Told, topic_id};
use crate::{
    config::{Group, LinePart},
    kept::{Kept, Stale},
};

/// How many drives a virtual unit has places for.
pub const PLACES: usize = 496;

/// The file of the state folder.
const FILE: &str = "names.json";
/// What only a daemon writes there that has written that file before: where one of them is and that file is not, it was lost.
const WRITTEN_LATER: [&str; 3] = ["alarms.json", "history.sqlite", "webhooks.json"];

/// What something is known as, whatever it is called at the moment.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct KnownAs {
    /// The same for as long as it is not forgotten: the name that it had first, or one like it. Sparkplug and the metrics know it by this.
    #[serde(default)]
    pub id: String,
    /// The same in letters, digits, `-` and `_`: in topics of MQTT, and to Home Assistant.
    #[serde(default)]
    pub short_name: String,
    /// The number of a drive, from 0, by which it stands in the virtual unit of a gateway; absent where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
}

impl KnownAs {
    /// What follows from a name alone.
    pub fn of_name(name: &str) -> Self {
        Self { id: name.to_owned(), short_name: topic_id(name), slot: None }
    }
}

/// What there is by these lines and groups, in the order of the configuration.
pub fn configured(lines: &[LinePart], groups: &[Group]) -> Configured {
    let mut there = Configured::default();
    for line in lines {
        let port = line.config.endpoint.to_string();
        there.drives.extend(line.drives.iter().map(|drive| Named {
            name: drive.settings.name.clone(),
            place: line.place(drive.name).to_string(),
            slot: drive.slot,
        }));
        there.lines.push(Named { name: line.name.clone(), place: port, slot: None });
    }
    let group =
        |group: &Group| Named { name: group.name.clone(), place: group.drives.join(", "), slot: None };
    there.groups = groups.iter().map(group).collect();
    there
}

/// The register as the program has it. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Names(Arc<Mutex<Inner>>);

#[derive(Debug)]
struct Inner {
    file: Option<Kept>,
    /// `None`: what is kept cannot be read, and nobody has a number before a person has seen to it.
    table: Option<Table>,
    /// The topics of meanwhile: those that follow from the names.
    stopgap: Table,
    /// Why what is kept cannot be read.
    problem: Option<String>,
}

impl Default for Inner {
    fn default() -> Self {
        Self { file: None, table: Some(Table::default()), stopgap: Table::default(), problem: None }
    }
}

impl Names {
    /// Those of this state folder; without one everything follows the configuration, from start to start.
    pub fn in_folder(folder: Option<&Path>) -> Self {
        let file = folder.map(|folder| Kept::at(&file_in(folder)));
        Self(Arc::new(Mutex::new(Inner { file, ..Inner::default() })))
    }

    /// Gives what there is its numbers and topics, and keeps them. What cannot be read is left as it is, and nobody has a number
    /// then: a number that was made up would tell one drive's values as another's. Gives what has changed, in words.
    ///
    /// # Errors
    /// What is kept cannot be read, or what has changed cannot be kept: in words. It holds then in this program alone.
    pub fn take_up(&self, there: &Configured) -> Result<Told, String> {
        let mut inner = self.lock();
        let Inner { file, table, stopgap, problem } = &mut *inner;
        *stopgap = Table::default();
        stopgap.take_up(there);
        let Some(file) = file else { return Ok(table.get_or_insert_default().take_up(there)) };
        let kept = changed(file, |table| Ok(table.take_up(there)));
        *table = match &kept {
            Ok((now, _)) => Some(now.clone()),
            // What can be read and not be kept holds in this program alone.
            Err(_) => read(file).ok().map(|mut now| {
                now.take_up(there);
                now
            }),
        };
        *problem = kept.as_ref().err().filter(|_| table.is_none()).cloned();
        kept.map(|(_, told)| told)
    }

    /// Who has each number now, from 0 to the highest; `None`: what is kept cannot be read.
    pub fn slots(&self) -> Option<Vec<Option<Arc<str>>>> {
        self.lock().table.as_ref().map(Table::slots)
    }

    /// The number that tells this order of the drives from another; `None`: what is kept cannot be read.
    pub fn revision(&self) -> Option<u16> {
        self.slots().map(|slots| revision(&slots))
    }

    /// Why nobody has a number, in words; `None`: everybody has what he had.
    pub fn problem(&self) -> Option<String> {
        self.lock().problem.clone()
    }

    /// What something is known as, by its name.
    pub fn known_as(&self, kind: Kind, name: &str) -> KnownAs {
        let inner = self.lock();
        let table = inner.table.as_ref().unwrap_or(&inner.stopgap);
        let known = table.of(kind).iter().find(|known| known.name == name && !known.gone);
        // The numbers of meanwhile are nobody's.
        let slot = |known: &Known| known.slot.filter(|_| inner.table.is_some());
        known.map_or_else(
            || KnownAs::of_name(name),
            |known| KnownAs { id: known.id.clone(), short_name: known.topic.clone(), slot: slot(known) },
        )
    }

    /// The topic of something, by its name.
    pub fn topic(&self, kind: Kind, name: &str) -> String {
        self.known_as(kind, name).short_name
    }

    /// The name of something, by its id.
    pub fn name_of(&self, kind: Kind, id: &str) -> Option<String> {
        let inner = self.lock();
        let table = inner.table.as_ref().unwrap_or(&inner.stopgap);
        let known = table.of(kind).iter().find(|known| known.id == id && !known.gone);
        known.map(|known| known.name.clone())
    }

    /// Whether something of the configuration has this topic.
    pub fn has(&self, kind: Kind, topic: &str) -> bool {
        let inner = self.lock();
        let table = inner.table.as_ref().unwrap_or(&inner.stopgap);
        table.of(kind).iter().any(|known| known.topic == topic && !known.gone)
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A number that tells one order of the drives from another: the CRC-16 of Modbus over their names, each with its place.
pub fn revision(slots: &[Option<Arc<str>>]) -> u16 {
    const CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
    let mut digest = CHECK.digest();
    for (slot, name) in slots.iter().enumerate() {
        if let Some(name) = name {
            digest.update(format!("{slot}\t{name}\n").as_bytes());
        }
    }
    digest.finalize()
}

/// The file of a state folder.
pub fn file_in(folder: &Path) -> PathBuf {
    folder.join(FILE)
}

/// Where drives were by the configuration before this one, and those of before that are gone; none where nobody can say.
pub fn places_before(folder: Option<&Path>) -> Vec<Place> {
    let kept = folder.and_then(|folder| read(&Kept::at(&file_in(folder))).ok());
    kept.map(|table| table.drives.into_iter().map(|known| Place::from(&*known.place)).collect())
        .unwrap_or_default()
}

/// What is kept in a file; nothing before the first start.
///
/// # Errors
/// It cannot be read, is damaged, or is not there though what a daemon writes after it is: in words, with what to do.
pub fn read(file: &Kept) -> Result<Table, String> {
    let read = match file.read() {
        Ok(Some((text, _))) => {
            serde_json::from_slice::<Table>(&text).map_err(io::Error::from).map(|mut table| {
                table.complete();
                table
            })
        }
        Ok(None) => {
            match WRITTEN_LATER.into_iter().find(|later| file.path().with_file_name(later).exists()) {
                None => Ok(Table::default()),
                Some(later) => Err(io::Error::other(format!(
                    "it is lost: {later} beside it is of an earlier start, which had it"
                ))),
            }
        }
        Err(error) => Err(error),
    };
    let sound = read.and_then(|table| match table.is_sound() {
        true => Ok(table),
        false => Err(io::Error::other("a number, a name, an id or a topic stands there twice")),
    });
    sound.map_err(|error| {
        format!(
            "{}: {error}: no drive has a number until it is mended; drived names renew numbers them anew, as the configuration has them",
            file.path().display()
        )
    })
}

/// Changes what is kept in a file, and gives what stands there then.
///
/// # Errors
/// As `change` says; what is there cannot be read, or cannot be replaced: in words.
pub fn changed<T>(
    file: &Kept,
    change: impl FnOnce(&mut Table) -> Result<T, String>,
) -> Result<(Table, T), String> {
    let wrong = |error: io::Error| format!("{}: {error}", file.path().display());
    // Two at once would each forget what the other has written.
    let _lock = file.lock().map_err(wrong)?;
    let mut table = read(file)?;
    let before = file.path().exists().then(|| table.clone());
    let done = change(&mut table)?;
    table.drives.sort_by_key(|known| known.slot);
    // Also where nothing is known yet: a later start sees by the file that there was this one.
    if before.as_ref() != Some(&table) {
        write(file, &table).map_err(wrong)?;
    }
    Ok((table, done))
}

fn write(file: &Kept, table: &Table) -> io::Result<()> {
    // What it has follows from the configuration once more; without it nobody would have the number that he had.
    Ok(file.secure(serde_json::to_vec_pretty(table), Stale::Left)?)
}

/// Puts what is kept aside, where it can be looked at, and numbers what there is anew. Gives where it is now.
///
/// # Errors
/// The folder cannot be written: in words.
pub fn renewed(file: &Kept, there: &Configured) -> Result<(Table, Option<PathBuf>), String> {
    let wrong = |error: io::Error| format!("{}: {error}", file.path().display());
    let _lock = file.lock().map_err(wrong)?;
    let aside = file.beside(".old");
    let moved = file.rename(&aside).or_else(|error| match error.kind() {
        io::ErrorKind::NotFound => Ok(false),
        _ => Err(wrong(error)),
    })?;
    let mut table = Table::default();
    table.take_up(there);
    table.drives.sort_by_key(|known| known.slot);
    write(file, &table).map_err(wrong)?;
    Ok((table, moved.then(|| aside.path().to_owned())))
}

#[cfg(test)]
mod tests;
