//! Fuzzing: honest loops over whatever takes bytes, texts or orders of events from outside, from corpora of frames that manuals print.
//! Each target has something to hold what comes out against, besides that nothing panics and everything ends. The numbers of an
//! execution are those of a seed, or bytes of a file.

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
    panic,
    time::{Duration, Instant},
};

use crate::report::{Find, Plant, Told};
use broken::Defect;
pub(crate) use bytes::change;
pub(crate) use machines::spoken;
pub use source::Source;

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
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 15] = [
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
    ];

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

/// All that is hunted of what is planted.
#[must_use]
pub fn hunts(seed: u64) -> Vec<Told> {
    let told = vec![find_plants(seed, 20_000)];
    #[cfg(feature = "plants")]
    let told = [told, vec![find_plants_by_orders(seed, 150)]].concat();
    told
}

/// By which targets wrong lines of drive-bus and of drive-fleet are hunted.
#[cfg(feature = "plants")]
const OF_THE_LINE: &[Target] = &[Target::Schedule, Target::FarEnd];
#[cfg(feature = "plants")]
const OF_THE_FLEET: &[Target] = &[Target::Supervisor];

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

/// The same of every wrong line of drive-bus and drive-fleet, by orders of events.
#[cfg(feature = "plants")]
pub fn find_plants_by_orders(seed: u64, at_most: u64) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fuzzing by orders of events, against planted defects", "executions");
    let fleet = crate::mutation::names_of("drive-fleet").map(|name| (name, OF_THE_FLEET));
    let lines = drive_bus::mutants::ALL.iter().map(|mutant| (mutant.name, OF_THE_LINE));
    for (name, targets) in lines.chain(fleet) {
        let _chosen = drive_bus::mutants::choose(name);
        let tries = (0..at_most).flat_map(|number| targets.iter().map(move |target| (number, *target)));
        let mut found_by = None;
        for (number, target) in tries {
            told.count += 1;
            if let Err(why) = target.execute(seed.wrapping_add(number)) {
                let why: String = why.chars().take(200).collect();
                found_by = Some(format!("{target:?} at execution {number}: {why}"));
                break;
            }
        }
        let reached =
            if drive_bus::mutants::was_reached(name) { "" } else { " (its line was never reached)" };
        told.plants.push(Plant { name: format!("{name}{reached}"), found_by });
    }
    told.took = begun.elapsed();
    told
}
