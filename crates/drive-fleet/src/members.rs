//! [`Members`]: who belongs to a fleet.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::Arc,
};

use crate::{handle::Entry, line_entry::LineEntry, place::Place};

/// By which a member is known as long as it is one, whatever it is called: none is given twice, and who came later has a higher one.
pub(crate) type Number = u64;

/// The lines and drives of a fleet. Each is found by its name, its place and its line without a walk over all: a stop of all asks for every
/// one of them, and a reload may change every one.
#[derive(Clone, Default)]
pub(crate) struct Members {
    /// How many were added.
    added: Number,
    lines: Named<LineEntry>,
    drives: Named<Entry>,
    by_place: BTreeSet<(Place, Number)>,
    by_line: HashMap<Arc<str>, BTreeSet<Number>>,
}

/// In the order in which they were added, and by their names.
struct Named<T> {
    all: BTreeMap<Number, Arc<T>>,
    by_name: HashMap<Arc<str>, Number>,
}

impl<T> Clone for Named<T> {
    fn clone(&self) -> Self {
        Self { all: self.all.clone(), by_name: self.by_name.clone() }
    }
}

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self { all: BTreeMap::new(), by_name: HashMap::new() }
    }
}

impl<T> Named<T> {
    fn get(&self, name: &str) -> Option<&Arc<T>> {
        self.all.get(self.by_name.get(name)?)
    }

    fn put(&mut self, number: Number, name: &Arc<str>, new: Arc<T>) {
        self.by_name.insert(Arc::clone(name), number);
        self.all.insert(number, new);
    }
}

impl Members {
    pub(crate) fn lines(&self) -> impl Iterator<Item = &Arc<LineEntry>> {
        self.lines.all.values()
    }

    pub(crate) fn drives(&self) -> impl Iterator<Item = &Arc<Entry>> {
        self.drives.all.values()
    }

    pub(crate) fn line(&self, name: &str) -> Option<&Arc<LineEntry>> {
        self.lines.get(name)
    }

    pub(crate) fn drive(&self, name: &str) -> Option<&Arc<Entry>> {
        self.drives.get(name)
    }

    pub(crate) fn drive_at(&self, place: &Place) -> Option<&Arc<Entry>> {
        let (at, number) = self.by_place.range((place.clone(), Number::MIN)..).next()?;
        self.drives.all.get(number).filter(|_| at == place)
    }

    /// In the order in which they were added.
    pub(crate) fn on_line(&self, line: &str) -> impl Iterator<Item = &Arc<Entry>> {
        let numbers = self.by_line.get(line).into_iter().flatten();
        numbers.filter_map(|number| self.drives.all.get(number))
    }

    /// Those of these names that are there, in the order in which they were added.
    pub(crate) fn numbered(&self, names: &[&str]) -> BTreeMap<Number, Arc<Entry>> {
        let number = |name: &&str| self.drives.by_name.get(*name);
        let entry = |number: &Number| Some((*number, Arc::clone(self.drives.all.get(number)?)));
        names.iter().filter_map(number).filter_map(entry).collect()
    }

    /// Adds a line; one that is there stays.
    pub(crate) fn add_line(&mut self, line: Arc<LineEntry>) {
        if self.line(&line.name).is_none() {
            self.added += 1;
            let name = Arc::clone(&line.name);
            self.lines.put(self.added, &name, line);
        }
    }

    pub(crate) fn add_drive(&mut self, drive: Arc<Entry>) {
        self.added += 1;
        let number = self.added;
        self.by_place.insert((drive.place.clone(), number));
        self.by_line.entry(Arc::clone(&drive.line.name)).or_default().insert(number);
        let name = Arc::clone(&drive.name);
        self.drives.put(number, &name, drive);
    }

    /// The drive is called otherwise, as this entry of it has it.
    pub(crate) fn rename(&mut self, old: &str, renamed: Arc<Entry>) {
        if let Some(number) = self.drives.by_name.remove(old) {
            let name = Arc::clone(&renamed.name);
            self.drives.put(number, &name, renamed);
        }
    }

    /// Takes a drive out, whatever it is called by now.
    pub(crate) fn remove_drive(&mut self, number: Number) {
        let Some(entry) = self.drives.all.remove(&number) else { return };
        self.drives.by_name.remove(&entry.name);
        self.by_place.remove(&(entry.place.clone(), number));
        if let Some(others) = self.by_line.get_mut(&entry.line.name) {
            others.remove(&number);
            if others.is_empty() {
                self.by_line.remove(&entry.line.name);
            }
        }
    }

    /// Takes a line out that has no drive.
    pub(crate) fn remove_line(&mut self, name: &str) -> Option<Arc<LineEntry>> {
        if self.by_line.contains_key(name) {
            return None;
        }
        let number = self.lines.by_name.remove(name)?;
        self.lines.all.remove(&number)
    }
}
