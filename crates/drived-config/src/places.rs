//! Where a drive is, and whose is what was kept of it: what outlives the program belongs to a machine, and a name is what a person calls
//! it at the moment.

use std::collections::{BTreeMap, BTreeSet};

use drive_fleet::Place;

/// Which drives there are, and where there were some by earlier configurations.
#[derive(Debug, Clone, Default)]
pub struct Places {
    names: BTreeMap<Place, String>,
    by_name: BTreeMap<String, Place>,
    before: BTreeSet<Place>,
}

impl Places {
    /// The same, where there were drives at these places by the configuration before this one.
    #[must_use]
    pub fn after(self, before: impl IntoIterator<Item = Place>) -> Self {
        Self { before: before.into_iter().collect(), ..self }
    }

    /// The name of the drive at a place.
    pub fn name_at(&self, place: &Place) -> Option<&str> {
        self.names.get(place).map(String::as_str)
    }

    /// Whether there is a drive of this name.
    pub fn has(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// The place of the drive to which something belongs that was kept of one of this name; `None`: there is none.
    ///
    /// - Who is at the place has it, whatever he is called.
    /// - A version before this one has kept no place: whoever has the name has it.
    /// - Where nobody is at the place any more, but the name is at one where nobody was before, its owner has said anew where the drive is: a
    ///   port that has another path has the same drives. A drive of another family or address may be another machine: it gets a stop that
    ///   is not confirmed (`stops`), for one too many is better than one too few, and nothing else.
    /// - Where the name is at a place where there was a drive before, that is another machine, which has nothing to do with it.
    pub fn now(&self, name: &str, place: Option<&Place>, stops: bool) -> Option<&Place> {
        let Some(place) = place else { return self.by_name.get(name) };
        if let Some((place, _)) = self.names.get_key_value(place) {
            return Some(place);
        }
        let named = self.by_name.get(name).filter(|named| !self.before.contains(*named))?;
        (stops || named.drive() == place.drive()).then_some(named)
    }
}

/// Names with their places.
impl<N: Into<String>> FromIterator<(N, Place)> for Places {
    fn from_iter<T: IntoIterator<Item = (N, Place)>>(drives: T) -> Self {
        let by_name: BTreeMap<String, Place> =
            drives.into_iter().map(|(name, place)| (name.into(), place)).collect();
        let names = by_name.iter().map(|(name, place)| (place.clone(), name.clone())).collect();
        Self { names, by_name, before: BTreeSet::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(drives: &[(&str, &str)], before: &[&str]) -> Places {
        let drives = drives.iter().map(|(name, place)| (*name, Place::from(*place)));
        drives.collect::<Places>().after(before.iter().map(|place| Place::from(*place)))
    }

    const ONE: &str = "/dev/ttyUSB0 atv312@1";
    const TWO: &str = "/dev/ttyUSB0 atv312@2";

    fn now(places: &Places, name: &str, place: Option<&str>, stops: bool) -> Option<Place> {
        places.now(name, place.map(Place::from).as_ref(), stops).cloned()
    }

    fn at(place: &str) -> Option<Place> {
        Some(place.into())
    }

    #[test]
    fn what_was_kept_belongs_to_whoever_is_at_the_place_by_whatever_name() {
        let swapped = places(&[("south", ONE), ("north", TWO)], &[ONE, TWO]);
        assert_eq!(now(&swapped, "north", Some(ONE), true), at(ONE));
        assert_eq!(swapped.name_at(&ONE.into()), Some("south"));
        // A version before this one has kept the name alone.
        assert_eq!(now(&swapped, "north", None, true), at(TWO));
        assert_eq!(now(&swapped, "east", None, true), None);
    }

    #[test]
    fn what_was_kept_for_a_place_that_is_nobodys_belongs_to_the_name_where_that_is_no_other_machine() {
        let port = "/dev/serial/by-id/usb-1 atv312@1";
        let renamed = places(&[("north", port)], &[ONE]);
        assert_eq!(now(&renamed, "north", Some(ONE), false), at(port));
        // Another address may be another machine: it gets stops alone.
        let moved = places(&[("north", "/dev/ttyUSB0 atv312@3")], &[ONE]);
        assert_eq!(now(&moved, "north", Some(ONE), false), None);
        assert_eq!(now(&moved, "north", Some(ONE), true), at("/dev/ttyUSB0 atv312@3"));
        // The machine that was called south is called north now.
        let other = places(&[("north", TWO)], &[ONE, TWO]);
        assert_eq!(now(&other, "north", Some(ONE), true), None);
        assert_eq!(now(&renamed, "south", Some(TWO), true), None);
    }
}
