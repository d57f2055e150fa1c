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
/// So many stops, and lost connections, of a gateway's line: what more of them do to what is known of it is open.
const MOST_STOPS: usize = 2;
const MOST_LOSSES: usize = 1;
/// Invariants that long orders break, and nobody has mended yet; the README says by which. They are counted apart.
const OPEN: [&str; 7] = [
    "each slave has its pause",
    "3.5 characters of silence stand before each request",
    "a gateway that does one thing at a time is given nothing but a stop while it is at a question",
    "it is not taken to wait for more than twice as long as it does",
    "what is owed is over at its time",
    "a drive that answers again is asked again",
    "a stop waits no longer than the printed bound",
];

pub(super) fn schedule(rng: &mut Source) -> Result<(), String> {
    let setting = Setting::ALL[rng.usize(..Setting::ALL.len())];
    let steps = steps(rng, &master::Step::ALL);
    shrunk(steps, "master", &format!("{setting:?}"), &master::Step::ALL, |steps| {
        master::lives(setting, steps)
    })
}

pub(super) fn far_end(rng: &mut Source) -> Result<(), String> {
    let setting = Gateways::ALL[rng.usize(..Gateways::ALL.len())];
    let mut steps = steps(rng, &gateway::Step::ALL);
    let (stops, losses) = (rng.usize(..=MOST_STOPS), rng.usize(..=MOST_LOSSES));
    keep_only(&mut steps, stops, |step| matches!(step, gateway::Step::Stop | gateway::Step::StopInVain));
    keep_only(&mut steps, losses, |step| matches!(step, gateway::Step::Lost));
    shrunk(steps, "gateway", &format!("{setting:?}"), &gateway::Step::ALL, |steps| {
        gateway::lives(setting, steps)
    })
}

fn steps<S: Copy>(rng: &mut Source, alphabet: &[S]) -> Vec<S> {
    (0..rng.usize(1..=LONGEST)).map(|_| alphabet[rng.usize(..alphabet.len())]).collect()
}

/// The first so many of those that are `such`, and all others.
fn keep_only<S>(steps: &mut Vec<S>, so_many: usize, such: impl Fn(&S) -> bool) {
    let mut seen = 0;
    steps.retain(|step| {
        seen += usize::from(such(step));
        !such(step) || seen <= so_many
    });
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
    let kind = if OPEN.contains(&what) { "open: " } else { "" };
    Err(format!(
        "{kind}{setting}: not so: {what}, by {steps:?}: model {model} --setting {setting} --steps {letters}"
    ))
}
