//! Long orders of events through what the small cases of `model` explore to the end: the master of a line, and what it knows of a gateway.
//! There each order up to a depth is lived through, here a few of those that are far longer.

use std::fmt;

use super::source::Source;
use crate::model::{
    Held,
    gateway::{self, Setting as Gateways},
    master::{self, Setting},
};

/// So many steps at the most. Each call of the master's model has a value of its own, of which there are 255.
const LONGEST: usize = 60;
pub(super) fn schedule(rng: &mut Source) -> Result<(), String> {
    let setting = Setting::ALL[rng.usize(..Setting::ALL.len())];
    let steps = steps(rng, &master::Step::ALL);
    shrunk(steps, "master", &format!("{setting:?}"), &master::Step::ALL, |steps| {
        master::lives(setting, steps)
    })
}

pub(super) fn far_end(rng: &mut Source) -> Result<(), String> {
    let setting = Gateways::ALL[rng.usize(..Gateways::ALL.len())];
    let steps = steps(rng, &gateway::Step::ALL);
    shrunk(steps, "gateway", &format!("{setting:?}"), &gateway::Step::ALL, |steps| {
        gateway::lives(setting, steps)
    })
}

fn steps<S: Copy>(rng: &mut Source, alphabet: &[S]) -> Vec<S> {
    (0..rng.usize(1..=LONGEST)).map(|_| alphabet[rng.usize(..alphabet.len())]).collect()
}

/// What does not hold of these steps, by as few of them as break the same, and as the model is told them.
fn shrunk<S: Copy + PartialEq + fmt::Debug>(
    mut steps: Vec<S>,
    model: &str,
    setting: &str,
    alphabet: &[S],
    lives: impl Fn(&[S]) -> Held,
) -> Result<(), String> {
    let Err(what) = lives(&steps) else { return Ok(()) };
    for at in (0..steps.len()).rev() {
        let mut fewer = steps.clone();
        fewer.remove(at);
        if lives(&fewer) == Err(what) {
            steps = fewer;
        }
    }
    let number = |step: &S| alphabet.iter().position(|known| known == step).unwrap_or_default();
    let letters: String = steps.iter().map(|step| char::from(b'a' + number(step) as u8)).collect();
    Err(format!(
        "{setting}: not so: {what}, by {steps:?}: model {model} --setting {setting} --steps {letters}"
    ))
}
