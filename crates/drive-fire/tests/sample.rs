//! A bounded sample of each part, for every change: what is here finds nothing, and finds what is planted.

use std::time::Duration;

use drive_fire::{
    fuzz,
    matrix::{self, story},
    model,
    report::Told,
};

fn finds_nothing(told: &Told, least: u64) {
    println!("{told}");
    assert!(told.finds.is_empty(), "{told}");
    assert!(told.count >= least, "{told}");
}

#[test]
fn no_cell_of_the_sample_is_wrong() {
    finds_nothing(&matrix::run(1, 500, None, || true), 2_500);
}

#[test]
fn no_story_of_the_sample_is_wrong() {
    finds_nothing(&story::run(1, 400, || true), 400);
}

#[test]
fn no_small_case_of_the_master_or_of_a_gateway_breaks_an_invariant() {
    for (name, least) in [("master", 4_758), ("gateway", 3_330)] {
        let model = model::Model::named(name).expect("it is one");
        finds_nothing(&model::run(model, 3, || true), least);
    }
}

#[test]
fn nothing_that_comes_from_outside_upsets_whoever_reads_it() {
    finds_nothing(&fuzz::run(&fuzz::Target::ALL, 1, Duration::from_secs(1), || true), 1_000);
}

#[test]
fn fuzzing_finds_what_is_planted() {
    // The rarest, an answer in ASCII whose LRC alone is wrong, comes at execution 34 541.
    let told = fuzz::find_plants(2, 60_000);
    println!("{told}");
    assert_eq!(told.plants_found(), told.plants.len(), "{told}");
}

/// With `--features plants` those of the line as well.
#[test]
fn matrix_and_stories_find_again_what_is_planted() {
    for (told, (least, with_the_line)) in
        [(matrix::find_again(), (6, 14)), (matrix::find_again_by_stories(), (5, 14))]
    {
        println!("{told}");
        assert_eq!((told.plants_found(), &told.finds), (told.plants.len(), &Vec::new()), "{told}");
        assert!(told.plants.len() >= if cfg!(feature = "plants") { with_the_line } else { least }, "{told}");
    }
}

#[test]
fn no_small_case_of_the_lease_or_of_identities_breaks_an_invariant_and_each_plant_breaks_one() {
    for (name, depth, least) in [("lease", 5, 402_233), ("identities", 4, 22_620)] {
        let model = model::Model::named(name).expect("it is one");
        finds_nothing(&model::run(model, depth, || true), least);
        let told = model::find_plants(model, depth);
        assert!(told.plants.len() >= 10, "{told}");
        assert_eq!(told.plants_found(), told.plants.len(), "{told}");
    }
}

/// With `--features plants`: ten of the wrong lines at least are found; which live is printed.
#[cfg(feature = "plants")]
mod planted {
    use super::{fuzz, model};

    #[test]
    fn orders_of_events_find_what_is_planted() {
        for target in [fuzz::Target::Schedule, fuzz::Target::FarEnd] {
            for told in fuzz::hunts(1, 30, Some(target)) {
                println!("{told}");
                assert!(told.plants_found() >= 10 && told.finds.is_empty(), "{told}");
            }
        }
    }

    /// What outsiders found by several hands at one line.
    #[test]
    fn several_hands_find_what_outsiders_found() {
        let names = ["order-judged-once", "group-overrules-a-later-start", "any-reference-started-at"];
        let told = fuzz::find_plants_of(fuzz::Target::Hands, "several hands", &names, 1, 600);
        println!("{told}");
        assert_eq!((told.plants_found(), &told.finds), (names.len(), &Vec::new()), "{told}");
    }

    /// What can be told is no less found for what cannot: here the late answer is of the one length that is owed.
    #[test]
    fn an_answer_later_than_its_window_to_a_read_that_can_differ_is_found_where_nobody_fears_it() {
        let again = || model::Model::named("master").expect("it is one").again("Wire", "fiml");
        assert_eq!(again(), Ok(()));
        let _chosen = drive_bus::mutants::choose("late-answer-unfeared");
        let found = again().expect_err("it is taken");
        assert!(found.contains("a value is the answer to its own question"), "{found}");
    }

    #[test]
    fn the_models_find_what_is_planted() {
        for name in ["master", "gateway"] {
            let told = model::find_plants(model::Model::named(name).expect("it is one"), 3);
            println!("{told}");
            assert!(told.plants_found() >= 10, "{told}");
        }
    }
}
