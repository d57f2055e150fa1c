//! Random drives in random worlds under random commands. A run that contradicts itself prints its seed, and `DRIVED_SEED=…` plays it
//! again.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
};

use drive_families::Family;
use support::contracts::contract;

fn contradiction(seed: u64) -> Option<String> {
    let families = Family::BUILT_IN.len() as u64;
    let family = Family::BUILT_IN[(seed % families) as usize];
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
    runtime.expect("a runtime").block_on(contract(family).contradiction_in_random_world(seed))
}

/// So many runs as `DRIVED_RUNS` says, 500 without it, on all processors; one alone when `DRIVED_SEED` names it.
#[test]
fn nothing_is_confirmed_that_is_not_in_force_and_nothing_moves_that_was_not_started() {
    if let Ok(seed) = std::env::var("DRIVED_SEED") {
        let seed = seed.parse().expect("DRIVED_SEED is a number");
        assert_eq!(contradiction(seed), None);
        return;
    }
    let runs = std::env::var("DRIVED_RUNS").map_or(Ok(500), |runs| runs.parse());
    let runs: u64 = runs.expect("DRIVED_RUNS is a number");
    let (next, wrong) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                let seeds = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
                for found in seeds.take_while(|&seed| seed < runs).filter_map(contradiction) {
                    wrong.lock().expect("no run panics").push(found);
                }
            });
        }
    });
    let wrong = wrong.into_inner().expect("no run panics");
    let shown: Vec<_> = wrong.iter().take(20).map(String::as_str).collect();
    assert!(wrong.is_empty(), "{} of {runs} runs:\n{}", wrong.len(), shown.join("\n\n"));
}
