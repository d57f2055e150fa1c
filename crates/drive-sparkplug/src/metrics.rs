//! The metrics of the node or of one device: what they are, what they hold, and what of it has been said.

use std::borrow::Cow;

use crate::{DataType, Metric, Quality, Raw, Value};

/// What a metric is. A birth tells it, and nothing else is ever sent than what a birth has told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// Its name; a `/` makes a folder of what is before it.
    pub name: Cow<'static, str>,
    /// Its type.
    pub data_type: DataType,
}

impl Definition {
    /// A metric of this name and type.
    pub fn new(name: impl Into<Cow<'static, str>>, data_type: DataType) -> Self {
        Self { name: name.into(), data_type }
    }

    /// A reading that this can hold: a number that is not finite is no value.
    fn checked(&self, reading: Reading) -> Result<Reading, MetricError> {
        let (name, expected) = (self.name.clone().into_owned(), self.data_type);
        match &reading.value {
            Some(value) if value.data_type() != expected => {
                Err(MetricError::WrongType { name, expected, found: value.data_type() })
            }
            Some(value) if !value.is_sound() => Ok(Reading { value: None, quality: Quality::Bad, ..reading }),
            _ => Ok(reading),
        }
    }
}

/// What a metric holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// `None`: there is no value. A number that is not finite is none either.
    pub value: Option<Value>,
    /// Whether it is what it says now. A value that is no longer known keeps its last value as [`Quality::Stale`], or none.
    pub quality: Quality,
    /// Since when it is so, in milliseconds since 1970, UTC.
    pub unix_ms: u64,
}

/// Why a metric cannot be defined or set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// Two names that differ in nothing but case, or one of the specification's own.
    #[error("there is already a metric {0:?}: expected a name that differs in more than case")]
    Taken(String),
    /// No birth tells it.
    #[error("there is no metric {0:?}")]
    Unknown(String),
    /// Its value is of another type.
    #[error("metric {name:?} is {expected:?}: a value of type {found:?} is none of it")]
    WrongType {
        /// Its name.
        name: String,
        /// Its type.
        expected: DataType,
        /// What it was given.
        found: DataType,
    },
}

/// The metrics in the order of their definitions.
#[derive(Debug)]
pub(crate) struct Metrics(Vec<Slot>);

#[derive(Debug)]
struct Slot {
    definition: Definition,
    alias: u64,
    reading: Reading,
    /// What the others know of it.
    said: Option<(Option<Value>, Quality)>,
}

impl Metrics {
    /// They begin without a value. `next_alias` gives each its number, unique in the node.
    pub(crate) fn new(
        definitions: Vec<Definition>,
        reserved: &[&str],
        next_alias: &mut u64,
        unix_ms: u64,
    ) -> Result<Self, MetricError> {
        let mut slots: Vec<Slot> = Vec::with_capacity(definitions.len());
        for definition in definitions {
            let lower = definition.name.to_lowercase();
            let mut names = slots.iter().map(|slot| &*slot.definition.name).chain(reserved.iter().copied());
            if names.any(|name| name.to_lowercase() == lower) {
                return Err(MetricError::Taken(definition.name.into_owned()));
            }
            let reading = Reading { value: None, quality: Quality::Bad, unix_ms };
            *next_alias += 1;
            slots.push(Slot { definition, alias: *next_alias, reading, said: None });
        }
        Ok(Self(slots))
    }

    pub(crate) fn set(&mut self, name: &str, reading: Reading) -> Result<(), MetricError> {
        let slot = self.0.iter_mut().find(|slot| slot.definition.name == name);
        let slot = slot.ok_or_else(|| MetricError::Unknown(name.to_owned()))?;
        slot.reading = slot.definition.checked(reading)?;
        Ok(())
    }

    /// What it held once, as data tell it: nothing of what is held or was said now changes.
    pub(crate) fn past(&self, name: &str, reading: Reading) -> Result<Metric, MetricError> {
        let slot = self.0.iter().find(|slot| slot.definition.name == name);
        let slot = slot.ok_or_else(|| MetricError::Unknown(name.to_owned()))?;
        let reading = slot.definition.checked(reading)?;
        let quality = Some(reading.quality);
        Ok(Metric { is_historical: true, quality, ..told(slot.alias, &reading) })
    }

    /// The definition behind the name or the alias of a metric that somebody writes.
    pub(crate) fn definition(&self, name: Option<&str>, alias: Option<u64>) -> Option<&Definition> {
        let slot = self.0.iter().find(|slot| match name {
            Some(name) => slot.definition.name == name,
            None => alias == Some(slot.alias),
        });
        slot.map(|slot| &slot.definition)
    }

    /// All of them, as a birth tells them.
    pub(crate) fn birth(&mut self) -> Vec<Metric> {
        in_order(self.0.iter_mut().map(|slot| {
            slot.note();
            Metric {
                name: Some(slot.definition.name.clone().into_owned()),
                data_type: Some(slot.definition.data_type.code()),
                quality: Some(slot.reading.quality),
                ..slot.metric()
            }
        }))
    }

    /// What has changed since it was said; nothing when nothing has.
    pub(crate) fn changes(&mut self) -> Vec<Metric> {
        let changed = self.0.iter_mut().filter(|slot| !slot.is_said());
        in_order(changed.map(|slot| {
            let said = slot.said.as_ref().map(|(_, quality)| *quality);
            slot.note();
            // A quality holds until another is told.
            let quality = Some(slot.reading.quality).filter(|quality| said != Some(*quality));
            Metric { quality, ..slot.metric() }
        }))
    }
}

impl Slot {
    fn is_said(&self) -> bool {
        let Reading { value, quality, .. } = &self.reading;
        self.said.as_ref().is_some_and(|(said, of_quality)| (said, of_quality) == (value, quality))
    }

    fn note(&mut self) {
        self.said = Some((self.reading.value.clone(), self.reading.quality));
    }

    fn metric(&self) -> Metric {
        told(self.alias, &self.reading)
    }
}

/// A reading under an alias.
fn told(alias: u64, reading: &Reading) -> Metric {
    Metric {
        alias: Some(alias),
        timestamp: Some(reading.unix_ms),
        is_null: reading.value.is_none(),
        value: reading.value.as_ref().map(Value::to_raw),
        ..Metric::default()
    }
}

/// Values have to stand in the order of their times.
pub(crate) fn in_order(metrics: impl Iterator<Item = Metric>) -> Vec<Metric> {
    let mut metrics: Vec<Metric> = metrics.collect();
    metrics.sort_by_key(|metric| metric.timestamp);
    metrics
}

/// A metric of the specification's own: by its name, never by an alias.
pub(crate) fn own(name: &str, value: &Value, unix_ms: u64) -> Metric {
    Metric {
        name: Some(name.to_owned()),
        timestamp: Some(unix_ms),
        data_type: Some(value.data_type().code()),
        value: Some(value.to_raw()),
        ..Metric::default()
    }
}

/// Reads what somebody writes to a metric.
pub(crate) fn read(definition: &Definition, raw: Option<&Raw>) -> Option<Value> {
    Value::read(definition.data_type, raw?).filter(Value::is_sound)
}
