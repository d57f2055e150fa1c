//! Random drives in random worlds under random commands. A run that contradicts itself prints its seed, and `DRIVED_SEED=…` plays it
//! again.

use drive_families::Family;
use support::contracts::contract;

async fn contradiction(seed: u64) -> Option<String> {
    let families = Family::BUILT_IN.len() as u64;
    let family = Family::BUILT_IN[(seed % families) as usize];
    contract(family).contradiction_in_random_world(seed).await
}

/// So many runs as `DRIVED_RUNS` says, 1 000 without it; one alone when `DRIVED_SEED` names it.
#[tokio::test(start_paused = true)]
async fn nothing_is_confirmed_that_is_not_in_force_and_nothing_moves_that_was_not_started() {
    if let Ok(seed) = std::env::var("DRIVED_SEED") {
        let seed = seed.parse().expect("DRIVED_SEED is a number");
        assert_eq!(contradiction(seed).await, None);
        return;
    }
    let runs = std::env::var("DRIVED_RUNS").map_or(Ok(1_000), |runs| runs.parse());
    let runs: u64 = runs.expect("DRIVED_RUNS is a number");
    let mut wrong = Vec::new();
    for seed in 0..runs {
        wrong.extend(contradiction(seed).await);
        if wrong.len() >= 20 {
            break;
        }
    }
    assert!(wrong.is_empty(), "{} of {runs} runs:\n{}", wrong.len(), wrong.join("\n\n"));
}
