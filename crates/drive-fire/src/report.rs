//! What a part tells: how much it tried, what it found, which of its planted defects it found, and how long it took.

use std::{
    collections::BTreeMap,
    fmt,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// What is under way, and since when.
static UNDER_WAY: Mutex<Option<(String, Instant)>> = Mutex::new(None);

/// This begins.
pub fn begins(what: &impl fmt::Display) {
    *UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner) = Some((what.to_string(), Instant::now()));
}

/// Nothing is under way that could go round for ever.
pub fn ends() {
    *UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

/// What is under way for longer than this in real time: it goes round where virtual time stands still, and nothing else ends it.
#[must_use]
pub fn stuck(longest: Duration) -> Option<String> {
    let under_way = UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner);
    under_way.as_ref().filter(|(_, since)| since.elapsed() > longest).map(|(what, _)| what.clone())
}

/// What was found, and how it is found again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Find {
    /// What contradicts what.
    pub what: String,
    /// The command that replays it.
    pub replay: String,
}

/// A defect that was planted, and whether the part found it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plant {
    /// Its name.
    pub name: String,
    /// What found it first; `None`: it lived.
    pub found_by: Option<String>,
}

/// What a part tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Told {
    /// Which part.
    pub part: &'static str,
    /// What it counts.
    pub unit: &'static str,
    /// How many of them were tried.
    pub count: u64,
    /// What was found.
    pub finds: Vec<Find>,
    /// What was planted.
    pub plants: Vec<Plant>,
    /// How often what came of it.
    pub tally: BTreeMap<String, u64>,
    /// More, line by line.
    pub details: Vec<String>,
    /// How long it took.
    pub took: Duration,
}

impl Told {
    /// A part that has tried nothing yet.
    #[must_use]
    pub const fn new(part: &'static str, unit: &'static str) -> Self {
        Self {
            part,
            unit,
            count: 0,
            finds: Vec::new(),
            plants: Vec::new(),
            tally: BTreeMap::new(),
            details: Vec::new(),
            took: Duration::ZERO,
        }
    }

    /// So many more came of it.
    pub fn count_as(&mut self, what: impl Into<String>, more: u64) {
        *self.tally.entry(what.into()).or_default() += more;
    }

    /// The same part once more: what it tells is added; a plant is found once it was found. Where both name details the later ones stand.
    pub fn add(&mut self, again: Self) {
        self.count += again.count;
        self.took += again.took;
        self.finds.extend(again.finds);
        for plant in again.plants {
            match self.plants.iter_mut().find(|known| known.name == plant.name) {
                Some(known) => known.found_by = known.found_by.take().or(plant.found_by),
                None => self.plants.push(plant),
            }
        }
        for (what, more) in again.tally {
            self.count_as(what, more);
        }
        if !again.details.is_empty() {
            self.details = again.details;
        }
    }

    /// What it tried and found, in one line.
    #[must_use]
    pub fn in_a_line(&self) -> String {
        let Self { part, unit, count, finds, plants, took, .. } = self;
        let planted = match plants.len() {
            0 => String::new(),
            all => format!(", {} of {all} planted defects found", self.plants_found()),
        };
        format!("{part}: {count} {unit} in {:.1} s, {} found{planted}", took.as_secs_f64(), finds.len())
    }

    /// How many of the planted defects were found.
    #[must_use]
    pub fn plants_found(&self) -> usize {
        self.plants.iter().filter(|plant| plant.found_by.is_some()).count()
    }
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { finds, plants, tally, details, .. } = self;
        writeln!(f, "{}", self.in_a_line())?;
        for (what, times) in tally {
            writeln!(f, "  {times:>9} {what}")?;
        }
        for line in details {
            writeln!(f, "  {line}")?;
        }
        if !plants.is_empty() {
            for Plant { name, found_by } in plants {
                match found_by {
                    Some(by) => writeln!(f, "    found  {name}, by {by}")?,
                    None => writeln!(f, "    LIVED  {name}")?,
                }
            }
        }
        finds.iter().try_for_each(|find| write!(f, "{find}"))
    }
}

impl fmt::Display for Find {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, replay } = self;
        writeln!(f, "  FOUND {what}")?;
        match replay.strip_prefix("drive-fire ") {
            Some(part) => writeln!(f, "    again by: cargo run -p drive-fire -- {part}"),
            None => writeln!(f, "    again by: {replay}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plant_that_is_hunted_again_is_one_plant_and_found_once_it_was_found() {
        let told = |found_by: Option<&str>| {
            let plants = vec![Plant { name: "a".to_owned(), found_by: found_by.map(str::to_owned) }];
            Told { count: 3, plants, ..Told::new("part", "cases") }
        };
        let mut sum = told(None);
        sum.add(told(Some("the second")));
        sum.add(told(None));
        assert_eq!((sum.count, sum.plants_found(), sum.plants.len()), (9, 1, 1));
    }
}
