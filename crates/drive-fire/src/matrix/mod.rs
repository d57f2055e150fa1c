//! The fault matrix: what goes wrong on the wire × what stands between × what happens to the drive × what is asked of it, for every
//! family and shipped profile with a simulated twin, on every protocol, in virtual time.
//!
//! Each cell ends in a right value with a true age, a typed error, or "not known". Never in a wrong value, a hang, a panic, a command
//! done twice, a silence broken, a motor that moves and that neither a lease nor that world's own commander explains.

mod axes;
mod cell;
mod fault;
mod frames;
mod judge;
mod live;
mod plants;
mod stage;
pub mod story;
mod tap;
mod telling;
mod untold;

use std::{collections::BTreeMap, time::Instant};

pub use axes::{Event, FarEnd, Operation, Subject, Way};
pub use cell::{Cell, Plane};
pub use fault::Fault;
pub use live::{Lived, live, tell};
#[cfg(feature = "plants")]
pub(crate) use plants::at_a_line;
pub(crate) use plants::{Planted, all as planted};
pub use plants::{find_again, find_again_by_stories, find_plants, find_plants_by_stories};
pub use untold::Untold;

use drive_families::Family;
use drive_testing::contract::Open;

use crate::report::{self, Find, Told};

/// The drive of a cell as its family makes it.
#[must_use]
pub fn open(cell: &Cell) -> Box<Open> {
    drive_of(cell.subject.family())
}

/// The same of a family.
#[must_use]
pub fn drive_of(family: Family) -> Box<Open> {
    Box::new(move |port, slave| family.open_with(port, slave, &family.simulated_options()))
}

/// The cells of a plane in an order in which neighbours have nothing in common, each once; the same seed, the same order.
pub fn shuffled(plane: Plane, seed: u64) -> impl Iterator<Item = Cell> {
    let len = plane.cells();
    // A permutation of as many numbers as the next power of four holds, in four rounds; what is beyond the plane is passed over.
    let half = (64 - (len.max(2) - 1).leading_zeros()).div_ceil(2);
    let mask = (1_u64 << half) - 1;
    let round = move |value: u64, round: u64| {
        let mixed = (value ^ seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ round << 56)
            .wrapping_mul(0xD6E8_FEB8_6659_FD93);
        (mixed ^ mixed >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 32 & mask
    };
    (0..1_u64 << (2 * half)).filter_map(move |turn| {
        let (mut left, mut right) = (turn >> half, turn & mask);
        for number in 0..4 {
            (left, right) = (right, left ^ round(right, number));
        }
        Cell::of(plane, left << half | right)
    })
}

/// So many cells of each plane, or of the `only` one of this letter, that can exist and came to what is asked of them, in turn, or as many
/// as time allows; `go_on` is asked before each.
pub fn run(seed: u64, of_each: u64, only: Option<char>, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fault matrix", "cells");
    let can_exist = |plane| shuffled(plane, seed).filter(|cell: &Cell| cell.cannot_exist().is_none());
    let asked = Plane::ALL.into_iter().filter(|plane| only.is_none_or(|only| only == plane.letter()));
    let mut planes: Vec<_> = asked.map(|plane| (plane, can_exist(plane), 0)).collect();
    while !planes.is_empty() {
        planes.retain_mut(|(plane, cells, lived)| {
            let Some(cell) = cells.next().filter(|_| *lived < of_each && go_on()) else { return false };
            if live_and_tell(&cell, &mut told) {
                *lived += 1;
                told.count += 1;
                told.count_as(format!("cells of plane {plane:?}"), 1);
            }
            true
        });
    }
    report::ends();
    told.took = begun.elapsed();
    told
}

/// Whether the cell came to what is asked of it.
fn live_and_tell(cell: &Cell, told: &mut Told) -> bool {
    report::begins(cell);
    let (what, came) = match live(cell, &*open(cell)) {
        Lived::Told(word) => (word.to_owned(), true),
        Lived::BeyondTelling(why) => (format!("wrong, and nobody can tell: {why}"), true),
        Lived::NotBegun => ("not counted: never came to its operation".to_owned(), false),
        Lived::NotReached => ("not counted: the operation has fewer exchanges".to_owned(), false),
        Lived::Against(why) => {
            let replay = format!("drive-fire matrix --cell {}", cell.name());
            told.finds.push(Find { what: format!("{cell}\n    {}", why.join("\n    ")), replay });
            ("found".to_owned(), true)
        }
    };
    told.count_as(what, 1);
    came
}

/// How many cells there are in each plane, how many of them cannot exist, and why; of the largest plane by a sample of this many.
#[must_use]
pub fn census(sample: u64) -> Vec<String> {
    let mut lines = Vec::new();
    for plane in Plane::ALL {
        let looked = plane.cells().min(sample);
        let mut why = BTreeMap::<&str, u64>::new();
        for cell in shuffled(plane, 1).take(looked as usize) {
            *why.entry(cell.cannot_exist().unwrap_or("can exist")).or_default() += 1;
        }
        let share =
            |count: u64| (u128::from(count) * u128::from(plane.cells()) / u128::from(looked.max(1))) as u64;
        let counted = if looked < plane.cells() { "about " } else { "" };
        lines.push(format!("{plane:?}: {} cells", plane.cells()));
        lines.extend(
            why.into_iter().map(|(why, count)| format!("{:>12} {why}", format!("{counted}{}", share(count)))),
        );
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_plane_is_shuffled_without_losing_or_doubling_a_cell() {
        let numbers: BTreeSet<u64> = shuffled(Plane::Events, 3).map(|cell| cell.number).collect();
        assert_eq!(numbers.len() as u64, Plane::Events.cells());
        let first = |seed| shuffled(Plane::All, seed).next().map(|cell| cell.number);
        assert_eq!(first(1), first(1));
        assert_ne!(first(1), first(2));
    }

    #[test]
    fn the_name_of_a_cell_is_that_cell() {
        let cell = Cell::of(Plane::All, 123_456_789).expect("it is one");
        assert_eq!(Cell::named(&cell.name()), Some(cell));
        assert_eq!(Cell::named("W:99999999999"), None);
    }
}
