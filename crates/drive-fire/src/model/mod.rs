//! Model checking: small cases explored to the end.

pub mod lease;
pub mod master;

use std::time::Instant;

#[cfg(feature = "plants")]
use crate::report::Plant;
use crate::report::{Find, Told};
use master::{Setting, explore};

/// Explores the master to this depth.
pub fn run(depth: usize, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("model of the master", "states");
    for setting in Setting::ALL {
        let explored = explore(setting, depth, false, &mut go_on);
        told.count += explored.states;
        told.details.push(format!("{setting:?}: {} states to a depth of {depth}", explored.states));
        for broken in explored.broken {
            let replay = format!("drive-fire model --setting {setting:?} --steps {}", code(&broken.steps));
            told.finds.push(Find { what: format!("{setting:?}: {broken}"), replay });
        }
    }
    told.took = begun.elapsed();
    told
}

/// Steps as letters.
#[must_use]
pub fn code(steps: &[master::Step]) -> String {
    let letter = |step| {
        master::Step::ALL
            .iter()
            .position(|known| *known == step)
            .map_or('?', |at| char::from(b'a' + at as u8))
    };
    steps.iter().map(|step| letter(*step)).collect()
}

/// The steps of these letters.
#[must_use]
pub fn steps(code: &str) -> Option<Vec<master::Step>> {
    code.bytes()
        .map(|letter| master::Step::ALL.get(usize::from(letter.checked_sub(b'a')?)).copied())
        .collect()
}

/// Explores each wrong line of the master until an invariant breaks.
///
/// # Panics
/// When one breaks without a plant.
#[cfg(feature = "plants")]
pub fn find_plants(depth: usize) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("model of the master, against planted defects", "states");
    // What is broken without a plant would be found for each of them.
    let sound = run(depth, || true);
    assert!(sound.finds.is_empty(), "{sound}");
    for mutant in drive_bus::mutants::ALL {
        let _chosen = drive_bus::mutants::choose(mutant.name);
        let mut found_by = None;
        for setting in Setting::ALL {
            let explored = explore(setting, depth, true, || true);
            told.count += explored.states;
            found_by = explored.broken.iter().next().map(|broken| format!("{setting:?}: {broken}"));
            if found_by.is_some() {
                break;
            }
        }
        let reached =
            if drive_bus::mutants::was_reached(mutant.name) { "" } else { " (its line was never reached)" };
        told.plants.push(Plant { name: format!("{}{reached}", mutant.name), found_by });
    }
    told.took = begun.elapsed();
    told
}
