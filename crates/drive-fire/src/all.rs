//! Every part in turn, round after round with other numbers, until its time is over: what attacks for as long as anybody lets it.

use std::{collections::BTreeMap, time::Duration};

use crate::{
    fuzz,
    matrix::{self, story},
    model,
    report::Told,
    soak,
};

/// What a round takes of each part. Together about a minute of one processor.
const CELLS: u64 = 1_500;
const STORIES: u64 = 1_500;
const OF_EACH_TARGET: Duration = Duration::from_secs(1);
const PLANT: soak::Size = soak::Size { lines: 2, drives: 8, time: Duration::from_secs(3_600) };

/// How deep each model is explored in the first round; in those behind it nothing is left of that.
const DEPTH: usize = 4;

/// One round, or where it goes `on_and_on` rounds until `go_on` says no; what each part tells of all of them. `after` hears of each round.
pub fn run(
    seed: u64,
    on_and_on: bool,
    mut go_on: impl FnMut() -> bool,
    mut after: impl FnMut(u64, &[Told]),
) -> Vec<Told> {
    let mut told: Vec<Told> = Vec::new();
    let mut places = BTreeMap::new();
    for round in 0.. {
        let seed = seed.wrapping_add(round);
        let mut add = |again: Told| match places.get(again.part) {
            Some(at) => {
                let of_part: &mut Told = &mut told[*at];
                of_part.add(again);
            }
            None => {
                places.insert(again.part, told.len());
                told.push(again);
            }
        };
        add(matrix::run(seed, CELLS, &mut go_on));
        add(story::run(seed, STORIES, &mut go_on));
        add(fuzz::run(seed, OF_EACH_TARGET, &mut go_on));
        if round == 0 {
            model::ALL.into_iter().for_each(|model| add(model::run(model, DEPTH, &mut go_on)));
        }
        add(soak::run(seed, PLANT, &mut go_on));
        after(round + 1, &told);
        if !on_and_on || !go_on() {
            break;
        }
    }
    told
}
