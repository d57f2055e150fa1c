//! Confirmed means in force: every control configuration of the five manuals, every world around the drive (before a command, in its
//! midst, in the midst of a run, and afterwards), against every command. Shaft, twin and referee judge: see `drive_testing::worlds`.

use drive_families::Family;
use drive_testing::worlds::Share;
use support::contracts::contract;

/// Of so many worlds under a doubtful reading of a manual one is lived through, and one of a twelfth of that under the usual reading:
/// `DRIVED_ONE_IN`, 1 for all of them.
fn share() -> Share {
    let given = std::env::var("DRIVED_ONE_IN").map_or(Ok(401), |one_in| one_in.parse());
    let doubtful_one_in: usize = given.expect("DRIVED_ONE_IN is a number");
    Share { one_in: doubtful_one_in.div_ceil(12), doubtful_one_in }
}

async fn holds(family: Family) {
    let tally = contract(family).is_true_in_worlds(share()).await;
    println!("{tally}");
    for ((operation, outcome), count) in tally.outcomes {
        println!("{family} | {operation} | {outcome} | {count}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_21_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::ATV21).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_28_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::ATV28).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_58_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::ATV58).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_312_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::ATV312).await;
}

#[tokio::test(start_paused = true)]
async fn what_a_3g3ev_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::OMRON_3G3EV).await;
}
