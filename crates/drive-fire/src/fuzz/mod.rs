//! Fuzzing: honest loops over whatever takes bytes, texts or orders of events from outside, from corpora of frames that manuals print.
//! Each target has something to hold what comes out against, besides that nothing panics and everything ends. The numbers of an
//! execution are those of a seed, or bytes of a file: so a fuzzer that coverage guides attacks the same (the workspace `guided`).

mod broken;
mod bytes;
mod machines;
mod messages;
mod orders;
mod readers;
mod source;
mod supervisor;

use std::{
    collections::BTreeMap,
    fs, io, panic,
    path::Path,
    time::{Duration, Instant},
};

use crate::report::{Find, Plant, Told};
use broken::Defect;
pub(crate) use bytes::change;
pub(crate) use machines::spoken;
pub use source::Source;

/// By so many orders of events each wrong line is hunted at the most, unless it is said.
pub const ORDERS: u64 = 150;

/// What is fuzzed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The exchange of Modbus RTU, in any chunks at any times.
    Rtu,
    /// That of Modbus ASCII.
    Ascii,
    /// That of Modbus TCP.
    Mbap,
    /// That of UNI-TELWAY.
    UniTelway,
    /// The ear that only listens to a line, in each protocol.
    Ear,
    /// The reader of captures.
    Capture,
    /// Profiles.
    Profile,
    /// Lines of text to the simulator.
    Control,
    /// Addresses, settings, lines and setpoints as people write them.
    Words,
    /// Commands in JSON, beside serde_json.
    Json,
    /// Payloads of Sparkplug B.
    Sparkplug,
    /// Drives and lines of a command line.
    Specs,
    /// The master of a line, by what is asked of it and what becomes of that.
    Schedule,
    /// The same with what it knows of a gateway.
    FarEnd,
    /// Whoever looks after a drive, by what the drive replies.
    Supervisor,
    /// Several hands at the drives of one line.
    Hands,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::Rtu,
        Self::Ascii,
        Self::Mbap,
        Self::UniTelway,
        Self::Ear,
        Self::Capture,
        Self::Profile,
        Self::Control,
        Self::Words,
        Self::Json,
        Self::Sparkplug,
        Self::Specs,
        Self::Schedule,
        Self::FarEnd,
        Self::Supervisor,
        Self::Hands,
    ];

    /// The one of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| format!("{target:?}") == name)
    }

    /// One execution with the numbers of a seed.
    ///
    /// # Errors
    /// What does not hold.
    pub fn execute(self, seed: u64) -> Result<(), String> {
        self.execute_with(Source::seeded(seed), None)
    }

    /// One execution with the numbers that these bytes are.
    ///
    /// # Errors
    /// What does not hold.
    pub fn execute_on(self, bytes: &[u8]) -> Result<(), String> {
        self.execute_with(Source::of(bytes), None)
    }

    /// Writes the bytes of so many executions from this one on into files of their own, for whoever chooses bytes to begin with: the frames
    /// and texts of manuals stand in them as they are.
    ///
    /// # Errors
    /// As the file system has it.
    pub fn write_corpus(self, seed: u64, count: u64, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        (seed..seed.saturating_add(count)).try_for_each(|number| {
            let (source, told) = Source::recorded(number);
            // What it finds it finds again by these bytes.
            drop(self.execute_with(source, None));
            fs::write(folder.join(number.to_string()), told.try_iter().flatten().collect::<Vec<u8>>())
        })
    }

    fn execute_with(self, mut rng: Source, defect: Option<Defect>) -> Result<(), String> {
        let run = panic::AssertUnwindSafe(|| match self {
            Self::Rtu | Self::Ascii | Self::Mbap | Self::UniTelway => {
                machines::execute(self, &mut rng, defect)
            }
            Self::Ear => readers::ear(&mut rng),
            Self::Capture => readers::capture(&mut rng),
            Self::Profile => readers::profile(&mut rng),
            Self::Control => readers::control(&mut rng),
            Self::Words => readers::words(&mut rng),
            Self::Json => messages::json(&mut rng),
            Self::Sparkplug => messages::sparkplug(&mut rng),
            Self::Specs => messages::specs(&mut rng),
            Self::Schedule => orders::schedule(&mut rng),
            Self::FarEnd => orders::far_end(&mut rng),
            Self::Supervisor => supervisor::execute(rng),
            Self::Hands => supervisor::execute_hands(rng),
        });
        panic::catch_unwind(run).unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().cloned();
            let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
            Err(format!("a panic: {}", said.unwrap_or_default()))
        })
    }
}

/// Fuzzes each of these targets for so long.
pub fn run(targets: &[Target], seed: u64, of_each: Duration, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fuzzing", "executions");
    for target in targets {
        let (began, mut count, mut whys) = (Instant::now(), 0, BTreeMap::new());
        while began.elapsed() < of_each && go_on() {
            let number = seed.wrapping_mul(1_000_000_007).wrapping_add(count);
            count += 1;
            if let Err(why) = target.execute(number) {
                // One of each kind: what follows the first words is its data.
                let kind: String = why.chars().take(40).collect();
                whys.entry(kind).or_insert((number, why));
            }
        }
        told.count += count;
        told.count_as(format!("{target:?}"), count);
        for (number, why) in whys.into_values() {
            let replay = format!("drive-fire fuzz --target {target:?} --execution {number}");
            told.finds.push(Find { what: format!("{target:?}: {why}"), replay });
        }
    }
    told.took = begun.elapsed();
    told
}

/// All that is hunted of what is planted, or what is hunted by orders of events to this target `only`, by so many orders at the most.
#[must_use]
#[cfg_attr(
    not(feature = "plants"),
    allow(unused_variables, reason = "no wrong line is in a build without them")
)]
pub fn hunts(seed: u64, orders: u64, only: Option<Target>) -> Vec<Told> {
    let told = if only.is_none() { vec![find_plants(seed, 20_000)] } else { Vec::new() };
    #[cfg(feature = "plants")]
    let told = [told, find_plants_by_orders(seed, orders, only)].concat();
    told
}

/// Fuzzes each planted defect until it is found, at most so often; those of the line with the feature `plants`.
pub fn find_plants(seed: u64, at_most: u64) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fuzzing, against planted defects", "executions");
    let machines = [Target::Rtu, Target::Ascii, Target::Mbap, Target::UniTelway];
    let mut attack = |name: String, targets: &[Target], defect| {
        let tries = (0..at_most).flat_map(|number| targets.iter().map(move |target| (number, *target)));
        let mut found_by = None;
        for (number, target) in tries {
            told.count += 1;
            if let Err(why) = target.execute_with(Source::seeded(seed.wrapping_add(number)), defect) {
                let why: String = why.chars().take(200).collect();
                found_by = Some(format!("{target:?} at execution {number}: {why}"));
                break;
            }
        }
        told.plants.push(Plant { name, found_by });
    };
    for defect in Defect::ALL {
        attack(format!("machine: {defect:?}"), &machines, Some(defect));
    }
    #[cfg(feature = "plants")]
    for mutant in [
        "another-slaves-answer",
        "crc-unchecked",
        "lrc-unchecked",
        "transaction-unchecked",
        "confirmed-value-unchecked",
        "confirmed-address-unchecked",
    ] {
        let _chosen = drive_bus::mutants::choose(mutant);
        attack(format!("line: {mutant}"), &machines, None);
    }
    told.took = begun.elapsed();
    told
}

/// The same of every wrong line of drive-bus and drive-fleet, by orders of events: each target by itself, and `only` this one.
#[cfg(feature = "plants")]
pub fn find_plants_by_orders(seed: u64, at_most: u64, only: Option<Target>) -> Vec<Told> {
    let lines = || drive_bus::mutants::ALL.iter().map(|mutant| mutant.name).collect();
    let fleet = || crate::mutation::names_of("drive-fleet").collect();
    let of_each: [(Target, &'static str, Vec<&'static str>); 4] = [
        (Target::Schedule, "fuzzing by orders of a line, against planted defects", lines()),
        (Target::FarEnd, "fuzzing by orders of a gateway's line, against planted defects", lines()),
        (Target::Supervisor, "fuzzing by lives of a drive, against planted defects", fleet()),
        (Target::Hands, "fuzzing by several hands, against planted defects", fleet()),
    ];
    let wanted = of_each.into_iter().filter(|(target, ..)| only.is_none_or(|only| only == *target));
    wanted.map(|(target, part, names)| find_plants_of(target, part, &names, seed, at_most)).collect()
}

/// The same of these wrong lines alone.
#[cfg(feature = "plants")]
pub fn find_plants_of(
    target: Target,
    part: &'static str,
    names: &[&'static str],
    seed: u64,
    at_most: u64,
) -> Told {
    let begun = Instant::now();
    let mut told = Told::new(part, "executions");
    for &name in names {
        let (mut found_by, mut was_reached) = (None, false);
        for number in seed..seed.saturating_add(at_most) {
            told.count += 1;
            let held = {
                let _chosen = drive_bus::mutants::choose(name);
                let held = target.execute(number);
                was_reached |= drive_bus::mutants::was_reached(name);
                // A fleet goes on behind a panic.
                let ends = !drive_bus::mutants::went_on_for_ever();
                held.and_then(|()| ends.then_some(()).ok_or_else(|| "it goes on without end".to_owned()))
            };
            let Err(why) = held else { continue };
            // A plant is found by an order that is sound without it.
            if target.execute(number).is_err() {
                continue;
            }
            let why: String = why.chars().take(200).collect();
            found_by = Some(format!("execution {number}: {why}"));
            break;
        }
        let reached = if was_reached { "" } else { " (its line was never reached)" };
        let plant = Plant { name: format!("{name}{reached}"), found_by };
        eprintln!("{plant:?}");
        told.plants.push(plant);
    }
    told.took = begun.elapsed();
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_execution_finds_is_found_by_its_recorded_bytes() {
        let defect = Some(Defect::MakesUp);
        // The numbers of Modbus TCP begin anywhere.
        for target in [Target::Rtu, Target::Ascii] {
            let found = (0..20_000).find_map(|seed| {
                let (source, told) = Source::recorded(seed);
                let why = target.execute_with(source, defect).err()?;
                Some((why, told.try_iter().flatten().collect::<Vec<u8>>()))
            });
            // All that was heard stands in it.
            let (why, bytes) = found.expect("it is found");
            assert_eq!(target.execute_with(Source::of(&bytes), defect), Err(why), "{bytes:02X?}");
        }
    }
}
