//! Reads a file of records, each by itself: what is wrong with one takes nothing from another, and what stands before the place at which a file
//! is cut off is read as it stands.

use std::{fmt, io};

use drive_fleet::Place;
use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::{Kept, Record};

/// What stands in a file.
pub(super) struct Read<T> {
    /// The name of each drive, where it is unless nobody has kept that, and its record.
    pub records: Vec<(String, Option<Place>, T)>,
    /// What could not be read, and why.
    pub lost: Vec<String>,
    /// What was read otherwise than it stands there.
    pub doubts: Vec<String>,
}

impl<T> Default for Read<T> {
    fn default() -> Self {
        Self { records: Vec::new(), lost: Vec::new(), doubts: Vec::new() }
    }
}

impl<T: Record> Read<T> {
    /// Reads it; one that is not there has nothing.
    pub(super) fn of(file: &Kept) -> Self {
        let mut read = Self::default();
        match file.read_secured() {
            Ok(Some(content)) => read.take(&content),
            Ok(None) => {}
            Err(error) => read.lost.push(error.to_string()),
        }
        read
    }

    fn take(&mut self, content: &[u8]) {
        let mut entries = Vec::new();
        let mut text = serde_json::Deserializer::from_slice(content);
        let whole = Entries(&mut entries).deserialize(&mut text).and_then(|()| text.end());
        for (key, value) in entries {
            match value {
                Some(value) => self.take_one(key, value),
                None => self.lost.push(format!("the record of {key}")),
            }
        }
        if let Err(error) = whole {
            self.lost.push(error.to_string());
        }
    }

    /// By the place, with the name beside the record, or as it was written once: by the name.
    fn take_one(&mut self, key: String, mut value: Value) {
        let (of, name, place, record) = match value.get_mut("record").map(Value::take) {
            None => (key.clone(), key, None, value),
            Some(record) => match value.get("drive").and_then(Value::as_str) {
                Some(name) => (format!("{name} ({key})"), name.to_owned(), Some(Place::from(&*key)), record),
                // Its place says which it is.
                None => (key.clone(), key.clone(), Some(Place::from(&*key)), record),
            },
        };
        match serde_json::from_value::<T>(record.clone()) {
            Ok(read) => {
                let known = serde_json::to_value(&read).unwrap_or_default();
                let unknown = unknown(&record, &known);
                if !unknown.is_empty() {
                    let told =
                        format!("the record of {of} has what is not known here: {}", unknown.join(", "));
                    if read.may_hide_a_stop() { &mut self.lost } else { &mut self.doubts }.push(told);
                }
                self.records.push((name, place, read));
            }
            Err(error) => {
                match T::rescued(&record) {
                    Some(read) => {
                        self.doubts.push(format!("the record of {of}: {error}: the stop that it has is given as far as it can be read"));
                        self.records.push((name, place, read));
                    }
                    None => self.lost.push(format!("the record of {of}: {error}")),
                }
            }
        }
    }
}

/// What stands in one and not in the other.
fn unknown(written: &Value, known: &Value) -> Vec<String> {
    let Value::Object(written) = written else { return Vec::new() };
    let mut all = Vec::new();
    for (key, value) in written {
        match known.get(key) {
            Some(known) => all.extend(unknown(value, known)),
            // What is left out is not there either.
            None if value.is_null() => {}
            None => all.push(key.clone()),
        }
    }
    all
}

/// Keeps every entry as soon as it is read; one that has no value was cut off in it.
struct Entries<'a>(&'a mut Vec<(String, Option<Value>)>);

impl<'de> DeserializeSeed<'de> for Entries<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Entries<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("records by the places of their drives")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key()? {
            self.0.push((key, None));
            let value = map.next_value()?;
            if let Some((_, last)) = self.0.last_mut() {
                *last = Some(value);
            }
        }
        Ok(())
    }
}

/// Where a file is put aside of which not all could be read.
fn aside(file: &Kept) -> Kept {
    file.beside(".damaged")
}

/// Puts it aside, where it can be looked at, and gives where. What could be read of it stays in its place until it is written anew.
pub(super) fn put_aside(file: &Kept) -> io::Result<Kept> {
    let aside = aside(file);
    match file.copy_to(&aside) {
        Ok(()) => Ok(aside),
        // A name needs no room, and nothing is read for it.
        Err(_) => file.rename(&aside).map(|_| aside),
    }
}

/// What could not be read of a file that an earlier run has put aside, and to which nobody has seen.
pub(super) fn lost_before<T: Record>(file: &Kept) -> Option<String> {
    let aside = aside(file);
    let Ok(None) = aside.stamp() else { return Some(told(&Read::<T>::of(&aside).lost, Some(&aside))) };
    None
}

/// Somebody has seen to what could not be read: it is there to be looked at, and is told no more.
pub(super) fn see_to(file: &Kept) -> io::Result<()> {
    aside(file).rename(&file.beside(".damaged.seen")).map(|_| ())
}

/// In words.
pub(super) fn told(lost: &[String], aside: Option<&Kept>) -> String {
    let place = aside.map(|aside| format!("{} has what was there", aside.path().display()));
    lost.iter().cloned().chain(place).collect::<Vec<_>>().join("; ")
}
