//! Wrong lines in the program, one daemon with each: what is promised at a broker, and what befalls the process, are to find them.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use super::{Target, host, misfortunes, mqtt, plant::Plant, promises};
use crate::{
    fuzz::Source,
    mutation::{self, Fate},
    report::{Plant as Planted, Told},
};

/// The program on ptys, with its host's faults: no target, for it takes its own time.
const ON_PTYS: &str = "Ptys";
/// How long a wrong line is looked for there.
const LONGEST: Duration = Duration::from_secs(120);

/// Of those that tests of their own crates find, the ones that misfortunes, and faults of the host, are to find as well.
const OF_TESTS: [(&str, &str); 5] = [
    ("stop-waits-for-the-disk", "Misfortunes"),
    ("age-of-the-telling", ON_PTYS),
    ("stop-not-repeated", ON_PTYS),
    ("lease-forgotten-at-exit", ON_PTYS),
    ("door-ends-without-descriptors", ON_PTYS),
];

/// Each of them, or those whose name or target is `only`, against this program, which has them all.
pub fn find_plants(program: &Path, only: Option<&str>, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("the program from outside, with wrong lines in it", "attacks");
    let rows = mutation::list().into_iter().filter_map(|row| match row.fate {
        Fate::FoundBy(target) => Some((row.name, target)),
        _ => None,
    });
    let of_tests = OF_TESTS.map(|(name, target)| (name.to_owned(), target.to_owned()));
    let is_wanted =
        |(name, target): &(String, String)| only.is_none_or(|only| only == name || only == target);
    for (name, target) in rows.chain(of_tests).filter(is_wanted) {
        if !go_on() {
            break;
        }
        let found_by = attack(program, &name, &target, &mut told.count);
        let plant = Planted { name: format!("{target}: {name}"), found_by };
        eprintln!("{plant:?}");
        told.plants.push(plant);
    }
    told.took = begun.elapsed();
    told
}

fn attack(program: &Path, name: &str, target: &str, count: &mut u64) -> Option<String> {
    // For as long as the program lives: it is one name of a few dozen.
    let name: &'static str = name.to_owned().leak();
    if target == ON_PTYS {
        let begun = Instant::now();
        return match host::run(program, Some(name), SEEN, || begun.elapsed() < LONGEST) {
            Ok(told) => {
                *count += told.count;
                told.finds.first().map(|find| find.what.chars().take(160).collect())
            }
            Err(error) => Some(format!("it does not begin: {error}")),
        };
    }
    let mut plant = match Plant::with_mutant(program, Some(name)) {
        Ok(plant) => plant,
        Err(error) => return Some(format!("it does not begin: {error}")),
    };
    let is_of = |known: Target| format!("{known:?}") == target;
    let least = if is_of(Target::Mqtt) { promises::COUNT } else { misfortunes::COUNT };
    for number in 0..least {
        *count += 1;
        let held = match is_of(Target::Mqtt) {
            // The even ones are the promises.
            true => mqtt::execute(2 * number, &plant, &mut Source::seeded(number)),
            // By a seed of a kill while a motor was seen to run.
            false => misfortunes::execute(number, &mut plant, &mut Source::seeded(SEEN)),
        };
        if let Err(why) = held
            && !why.starts_with("skipped: ")
        {
            let why: String = why.chars().take(160).collect();
            return Some(format!("{target} at {number}: {}", why.replace('\n', " ")));
        }
    }
    None
}

/// By these numbers a motor was seen to run before the kill.
const SEEN: u64 = 1;
