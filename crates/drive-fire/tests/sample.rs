//! A bounded sample of each part, for every change: what is here finds nothing, and finds what is planted.

use drive_fire::{matrix, model, report::Told, story};

fn finds_nothing(told: &Told, least: u64) {
    println!("{told}");
    assert!(told.finds.is_empty(), "{told}");
    assert!(told.count >= least, "{told}");
}

#[test]
fn no_cell_of_the_sample_is_wrong() {
    finds_nothing(&matrix::run(1, 600, || true), 1_000);
}

#[test]
fn no_story_of_the_sample_is_wrong() {
    finds_nothing(&story::run(1, 400, || true), 400);
}

#[test]
fn no_small_case_of_the_master_breaks_an_invariant() {
    finds_nothing(&model::run(3, || true), 4_758);
}
