//! Which number each drive has for those who know drives by numbers, such as a SCADA that reads the virtual unit of a gateway: given
//! once, kept in the state folder, and given to no other drive before a person says so.

use std::{
    io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use serde::{Deserialize, Serialize};

use crate::{
    config::LinePart,
    kept::{Kept, Readers},
};

/// The file of the state folder.
const FILE: &str = "names.json";

/// A drive of the configuration, as the numbers are given to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Where it is, whatever it is called: its port, its family and its address.
    pub place: String,
}

/// The drives of these lines, in the order of the configuration.
pub fn of_lines(lines: &[LinePart]) -> Vec<Named> {
    let of = |line: &LinePart| {
        let port = line.config.endpoint.to_string();
        let named = line.drives.iter().map(move |drive| Named {
            name: drive.settings.name.clone(),
            place: format!("{port} {}", drive.name),
        });
        named.collect::<Vec<_>>()
    };
    lines.iter().flat_map(of).collect()
}

/// What is kept of a drive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Where it was when it was last configured.
    pub place: String,
    /// Its number, from 0.
    pub slot: u16,
    /// It is in the configuration no more; its number is kept for it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gone: bool,
}

/// The numbers of all drives that were ever configured and not forgotten.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// In the order of their numbers.
    pub drives: Vec<Known>,
}

impl Table {
    /// Makes these the drives that there are. Who is known by his name keeps his number; who is not, and stands where one stood who
    /// is gone, is that one by another name; everybody else gets the next number that nobody has had. Gives what has changed, in words.
    pub fn take_up(&mut self, drives: &[Named]) -> Vec<String> {
        let mut told = Vec::new();
        let is_there = |name: &str| drives.iter().any(|drive| drive.name == name);
        let is_first = self.drives.is_empty();
        for Named { name, place } in drives {
            if let Some(known) = self.drives.iter_mut().find(|known| known.name == *name) {
                known.place.clone_from(place);
            } else if let Some(known) =
                self.drives.iter_mut().find(|known| known.place == *place && !is_there(&known.name))
            {
                told.push(format!("{} is called {name} now: it keeps its number {}", known.name, known.slot));
                known.name.clone_from(name);
            }
        }
        for known in &mut self.drives {
            let is_gone = !is_there(&known.name);
            if is_gone && !known.gone {
                told.push(format!("{} is gone: its number {} is kept for it", known.name, known.slot));
            }
            known.gone = is_gone;
        }
        for Named { name, place } in drives {
            if self.drives.iter().any(|known| known.name == *name) {
                continue;
            }
            match self.next() {
                Some(slot) => {
                    if !is_first {
                        told.push(format!("{name} has the number {slot}"));
                    }
                    self.drives.push(Known { name: name.clone(), place: place.clone(), slot, gone: false });
                }
                None => told.push(format!("{name} has no number: none is left")),
            }
        }
        if is_first && !drives.is_empty() {
            told.push("given for the first time, in the order of the configuration".to_owned());
        }
        told
    }

    /// The number that comes next: above all that were given.
    fn next(&self) -> Option<u16> {
        match self.drives.iter().map(|known| known.slot).max() {
            None => Some(0),
            Some(highest) => highest.checked_add(1),
        }
    }

    /// Forgets a drive that is gone, so that its number is free. Gives it.
    ///
    /// # Errors
    /// It is configured, or not known: in words.
    pub fn forget(&mut self, name: &str) -> Result<u16, String> {
        match self.drives.iter().position(|known| known.name == name) {
            None => Err(format!("no number is kept for {name}")),
            Some(at) if !self.drives[at].gone => {
                Err(format!("{name} is in the configuration: take it out there first"))
            }
            Some(at) => Ok(self.drives.remove(at).slot),
        }
    }

    /// Gives a drive a number that no other has.
    ///
    /// # Errors
    /// It is not known, or another has it: in words.
    pub fn give(&mut self, name: &str, slot: u16) -> Result<(), String> {
        if let Some(other) = self.drives.iter().find(|known| known.slot == slot && known.name != name) {
            let gone = if other.gone { ", which is gone: drived names forget it first" } else { "" };
            return Err(format!("{slot} is the number of {}{gone}", other.name));
        }
        let known = self.drives.iter_mut().find(|known| known.name == name);
        known.ok_or_else(|| format!("no number is kept for {name}"))?.slot = slot;
        Ok(())
    }

    /// Who has each number, from 0 to the highest; `None`: nobody, or somebody who is gone.
    pub fn slots(&self) -> Vec<Option<Arc<str>>> {
        let highest = self.drives.iter().map(|known| usize::from(known.slot) + 1).max();
        let mut slots = vec![None; highest.unwrap_or(0)];
        for known in self.drives.iter().filter(|known| !known.gone) {
            slots[usize::from(known.slot)] = Some(Arc::from(known.name.as_str()));
        }
        slots
    }

    /// What has to be well in what was read: no number and no name twice.
    fn is_sound(&self) -> bool {
        let twice = |at: usize, known: &Known| {
            self.drives[..at].iter().any(|other| other.slot == known.slot || other.name == known.name)
        };
        !self.drives.iter().enumerate().any(|(at, known)| twice(at, known))
    }
}

/// The numbers as the program has them. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Names(Arc<Mutex<Kind>>);

#[derive(Debug)]
struct Kind {
    file: Option<Kept>,
    /// `None`: what is kept cannot be read, and nobody has a number before a person has seen to it.
    table: Option<Table>,
}

impl Default for Kind {
    fn default() -> Self {
        Self { file: None, table: Some(Table::default()) }
    }
}

impl Names {
    /// Those of this state folder; without one the numbers follow the order of the configuration, from start to start.
    pub fn in_folder(folder: Option<&Path>) -> Self {
        let file = folder.map(|folder| Kept::at(&place(folder)));
        Self(Arc::new(Mutex::new(Kind { file, ..Kind::default() })))
    }

    /// Gives numbers to the drives of these lines, and keeps them. What cannot be read is left as it is, and nobody has a number
    /// then: a number that was made up would tell one drive's values as another's. Gives what has changed, in words.
    ///
    /// # Errors
    /// What is kept cannot be read, or what has changed cannot be kept: in words. The numbers hold then in this program alone.
    pub fn take_up(&self, lines: &[LinePart]) -> Result<Vec<String>, String> {
        self.take(&of_lines(lines))
    }

    /// The same for drives of which somebody else says where they are.
    ///
    /// # Errors
    /// As [`take_up`](Self::take_up).
    pub fn take(&self, drives: &[Named]) -> Result<Vec<String>, String> {
        let mut kind = self.lock();
        let Kind { file, table } = &mut *kind;
        let Some(file) = file else { return Ok(table.get_or_insert_default().take_up(drives)) };
        let kept = changed(file, |table| Ok(table.take_up(drives)));
        *table = match &kept {
            Ok((now, _)) => Some(now.clone()),
            // What can be read and not be kept holds in this program alone.
            Err(_) => read(file).ok().map(|mut now| {
                now.take_up(drives);
                now
            }),
        };
        kept.map(|(_, told)| told)
    }

    /// Who has each number now, from 0 to the highest; `None`: what is kept cannot be read.
    pub fn slots(&self) -> Option<Vec<Option<Arc<str>>>> {
        self.lock().table.as_ref().map(Table::slots)
    }

    fn lock(&self) -> MutexGuard<'_, Kind> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The file of a state folder.
pub fn place(folder: &Path) -> PathBuf {
    folder.join(FILE)
}

/// What is kept in a file; nothing where there is none.
///
/// # Errors
/// It cannot be read, or is damaged: in words, with what to do.
pub fn read(file: &Kept) -> Result<Table, String> {
    let read = match file.read() {
        Ok(Some((text, _))) => serde_json::from_slice::<Table>(&text).map_err(io::Error::from),
        Ok(None) => Ok(Table::default()),
        Err(error) => Err(error),
    };
    let sound = read.and_then(|table| match table.is_sound() {
        true => Ok(table),
        false => Err(io::Error::other("a number or a name stands there twice")),
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
    let before = read(file)?;
    let mut table = before.clone();
    let done = change(&mut table)?;
    table.drives.sort_by_key(|known| known.slot);
    if table != before {
        let text = serde_json::to_vec_pretty(&table).map_err(|error| wrong(error.into()))?;
        file.replace(&text, Readers::Owner).map_err(wrong)?;
    }
    Ok((table, done))
}

/// Puts what is kept aside, where it can be looked at, and numbers the drives of these lines anew. Gives where it is now.
///
/// # Errors
/// The folder cannot be written: in words.
pub fn renewed(file: &Kept, lines: &[LinePart]) -> Result<(Table, Option<PathBuf>), String> {
    let aside = file.beside(".old");
    let moved = file.rename(&aside).or_else(|error| match error.kind() {
        io::ErrorKind::NotFound => Ok(false),
        _ => Err(format!("{}: {error}", file.path().display())),
    })?;
    let (table, _) = changed(file, |table| Ok(table.take_up(&of_lines(lines))))?;
    Ok((table, moved.then(|| aside.path().to_owned())))
}

#[cfg(test)]
mod tests;
