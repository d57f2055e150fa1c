//! Model checking: small cases explored to the end. Every sequence of so many steps of a small alphabet, from the beginning, shorter ones
//! first: nothing is drawn, and what was not asked for within the depth was not looked at.

mod clock;
pub mod gateway;
pub mod identities;
pub mod lease;
pub mod master;

use std::{collections::BTreeMap, env, fmt, sync::OnceLock, time::Instant};

use crate::report::{Find, Plant, Told};

/// Whether everything holds, or which invariant does not, in words.
pub type Held = Result<(), &'static str>;

/// Something that is explored.
#[derive(Clone, Copy)]
pub struct Model {
    /// By what it is chosen.
    pub name: &'static str,
    part: &'static str,
    against_plants: &'static str,
    /// The worlds in which it is explored.
    settings: &'static [&'static str],
    steps: fn() -> Vec<String>,
    /// Lives through the steps of these numbers in the setting of that number, with the defect of its own of that number.
    lives: fn(usize, &[usize], Option<usize>) -> Held,
    defects: fn() -> Vec<String>,
    /// Whether the wrong lines of drive-bus are to be found as well, with the feature `plants`.
    #[cfg_attr(not(feature = "plants"), allow(dead_code, reason = "no build without them has wrong lines"))]
    lines: bool,
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// All of them.
pub const ALL: [Model; 4] = [master::MODEL, gateway::MODEL, lease::MODEL, identities::MODEL];

/// What was explored.
#[derive(Debug, Clone, Default)]
struct Explored {
    states: u64,
    /// What does not hold, each invariant by its shortest sequence.
    broken: BTreeMap<&'static str, Vec<usize>>,
}

impl Model {
    /// The one of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        ALL.into_iter().find(|model| model.name == name)
    }

    /// Ends with the first that breaks anything where `first` is set.
    fn explore(
        &self,
        setting: usize,
        depth: usize,
        defect: Option<usize>,
        first: bool,
        mut go_on: impl FnMut() -> bool,
    ) -> Explored {
        let (alphabet, mut explored) = ((self.steps)().len(), Explored::default());
        for len in 1..=depth {
            let mut digits = vec![0_usize; len];
            loop {
                explored.states += 1;
                if let Err(what) = (self.lives)(setting, &digits, defect) {
                    explored.broken.entry(what).or_insert_with(|| digits.clone());
                    if first {
                        return explored;
                    }
                }
                if explored.states % 1_024 == 0 && !go_on() {
                    return explored;
                }
                let Some(at) = digits.iter().rposition(|digit| *digit + 1 < alphabet) else { break };
                digits[at] += 1;
                digits[at + 1..].fill(0);
            }
        }
        explored
    }

    fn in_words(&self, what: &str, steps: &[usize]) -> String {
        let names = (self.steps)();
        let steps: Vec<&str> = steps.iter().filter_map(|step| names.get(*step)).map(String::as_str).collect();
        format!("not so: {what}, by {}", steps.join(", "))
    }

    /// One sequence, as a find names it.
    ///
    /// # Errors
    /// In words: what does not hold, or why these are no steps in no setting.
    pub fn again(&self, setting: &str, code: &str) -> Result<(), String> {
        let settings = self.settings;
        let number = settings.iter().position(|known| *known == setting);
        let number = number.ok_or_else(|| format!("{setting} is none of {settings:?}"))?;
        let alphabet = (self.steps)().len();
        let step = |letter: u8| usize::from(letter.wrapping_sub(b'a'));
        let steps: Vec<usize> = code.bytes().map(step).collect();
        if steps.iter().any(|step| *step >= alphabet) {
            return Err(format!("{code} are no steps: letters from a on, {alphabet} of them"));
        }
        (self.lives)(number, &steps, None).map_err(|what| self.in_words(what, &steps))
    }
}

/// Explores it to this depth.
pub fn run(model: Model, depth: usize, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new(model.part, "states");
    for (number, setting) in model.settings.iter().enumerate() {
        let explored = model.explore(number, depth, None, false, &mut go_on);
        told.count += explored.states;
        told.count_as(format!("{setting}, to a depth of {depth}"), explored.states);
        for (what, steps) in explored.broken {
            let letters: String = steps.iter().map(|step| char::from(b'a' + *step as u8)).collect();
            let replay = format!("drive-fire model {} --setting {setting} --steps {letters}", model.name);
            told.finds.push(Find { what: format!("{setting}: {}", model.in_words(what, &steps)), replay });
        }
    }
    told.took = begun.elapsed();
    told
}

/// Explores each of its planted defects until an invariant breaks.
///
/// # Panics
/// When one breaks without a plant: it would be found for each of them.
pub fn find_plants(model: Model, depth: usize) -> Told {
    let begun = Instant::now();
    let sound = run(model, depth, || true);
    assert!(sound.finds.is_empty(), "{sound}");
    let mut told = Told::new(model.against_plants, "states");
    let mut attack = |name: &str, defect| {
        let mut found_by = None;
        for (number, setting) in model.settings.iter().enumerate() {
            let explored = model.explore(number, depth, defect, true, || true);
            told.count += explored.states;
            let broken = explored.broken.iter().next();
            found_by = broken.map(|(what, steps)| format!("{setting}: {}", model.in_words(what, steps)));
            if found_by.is_some() {
                break;
            }
        }
        told.plants.push(Plant { name: name.to_owned(), found_by });
    };
    for (number, name) in (model.defects)().iter().enumerate() {
        attack(name, Some(number));
    }
    #[cfg(feature = "plants")]
    for mutant in drive_bus::mutants::ALL.iter().filter(|_| model.lines) {
        let _chosen = drive_bus::mutants::choose(mutant.name);
        attack(mutant.name, None);
    }
    #[cfg(feature = "plants")]
    for plant in told.plants.iter_mut().filter(|plant| model.lines && plant.found_by.is_none()) {
        if !drive_bus::mutants::was_reached(&plant.name) {
            plant.name.push_str(" (its line was never reached)");
        }
    }
    told.took = begun.elapsed();
    told
}

/// Tells what happens to whoever looks for why: with `DRIVE_FIRE_TRACE` set, and one sequence alone.
fn trace(now: tokio::time::Instant, what: fmt::Arguments<'_>) {
    static BEGUN: OnceLock<Option<tokio::time::Instant>> = OnceLock::new();
    let begun = BEGUN.get_or_init(|| env::var_os("DRIVE_FIRE_TRACE").map(|_| now));
    if let Some(begun) = begun {
        eprintln!("{:>9.4} s {what}", now.saturating_duration_since(*begun).as_secs_f64());
    }
}

/// The names of steps.
fn names(steps: &[impl fmt::Debug]) -> Vec<String> {
    steps.iter().map(|step| format!("{step:?}")).collect()
}
