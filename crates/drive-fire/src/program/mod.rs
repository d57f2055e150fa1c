//! The program itself, built, from outside: a daemon over simulated drives is asked what nobody asks over HTTP and Modbus TCP, and its tools
//! are given files that somebody else has changed. It does not panic, it ends or goes on, it says nothing that has no form, it keeps no more
//! than it kept before, and what is asked rightly behind all that is answered rightly.

mod beside;
mod broker;
mod doors;
mod files;
mod host;
mod judge;
mod misfortunes;
mod mqtt;
mod plant;
mod plants;
mod process;
mod promises;

use std::{
    cell::Cell,
    collections::BTreeMap,
    io,
    path::Path,
    time::{Duration, Instant},
};

pub use judge::find_plants;
pub use plants::find_plants as find_plants_in;

use crate::{
    fuzz::Source,
    report::{Find, Told},
};
use plant::Plant;

/// What is attacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Requests of HTTP.
    Http,
    /// Frames of Modbus TCP, at the gateway.
    Gateway,
    /// Messages of a broker.
    Mqtt,
    /// `explain`, of captures as pcap and pcapng.
    Captures,
    /// `check`, of a configuration.
    Configuration,
    /// `param diff`, of a backup.
    Backup,
    /// `history`, of the file of the black box.
    History,
    /// What befalls the process: killed, without descriptors, with a full disk.
    Misfortunes,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Http,
        Self::Gateway,
        Self::Mqtt,
        Self::Captures,
        Self::Configuration,
        Self::Backup,
        Self::History,
        Self::Misfortunes,
    ];

    /// This one, and then all others.
    fn and_others(self) -> impl Iterator<Item = Self> {
        let all = Self::ALL.len();
        Self::ALL.into_iter().cycle().skip_while(move |target| *target != self).take(all)
    }

    /// With which one a round begins behind one that ended in this: with itself where it was cut short, unless it had that whole round for
    /// itself already.
    fn next_round(self, was_cut_short: bool, round_began_with: Self) -> Self {
        let is_again = was_cut_short && self != round_began_with;
        self.and_others().nth(usize::from(!is_again)).unwrap_or(self)
    }
}

/// Its gateway beside this mbusd: the same questions to both, for so long.
///
/// # Errors
/// One of the two cannot be run, or does not answer.
pub fn beside_mbusd(program: &Path, mbusd: &Path, seed: u64, time: Duration) -> io::Result<Told> {
    beside::run(&Plant::start(program)?, mbusd, seed, time)
}

/// On ptys, commanded over HTTP all the time, while its host misbehaves, for as long as it goes on.
///
/// # Errors
/// The program cannot be run as it is to be: what is found is no error.
pub fn on_ptys(program: &Path, seed: u64, go_on: impl FnMut() -> bool) -> io::Result<Told> {
    host::run(program, None, seed, go_on)
}

/// What a wrong program would say or do there, and whether it is taken for wrong.
pub fn find_plants_on_ptys() -> Told {
    host::find_plants()
}

/// How much more the daemon may hold behind it all, in KiB: caches fill, and allocators keep what they have had.
const GROWTH: u64 = 64 * 1024;

/// A round of attacks.
#[derive(Debug)]
pub struct Round<'a> {
    /// For so long each target.
    pub of_each: Duration,
    /// For so long all of them, from when the program has begun.
    pub share: Duration,
    /// With which it begins; then with which the next one is to begin, so that each has its turn however early a round ends.
    pub first: &'a Cell<Target>,
}

/// Attacks this program, every target, or one of them by one execution.
///
/// # Errors
/// The program cannot be run as it is to be: what is found is no error.
pub fn run(
    program: &Path,
    seed: u64,
    Round { of_each, share, first }: &Round<'_>,
    only: Option<(Target, u64)>,
    mut go_on: impl FnMut() -> bool,
) -> io::Result<Told> {
    let begun = Instant::now();
    let mut told = Told::new("the program from outside", "executions");
    let mut plant = Plant::start(program)?;
    let files = files::Files::of(&plant)?;
    let before = plant.memory();
    let attacked = Instant::now();
    let mut go_on = || go_on() && attacked.elapsed() < *share;
    for target in Target::ALL {
        told.count_as(format!("{target:?}"), 0);
    }
    let begins_with = first.get();
    for target in begins_with.and_others().filter(|target| only.is_none_or(|(one, _)| one == *target)) {
        let (began, mut count, mut whys) = (Instant::now(), 0, BTreeMap::new());
        // Of the misfortunes, and of what is promised at a broker, each comes once at the least.
        let least = match target {
            Target::Misfortunes => misfortunes::COUNT,
            Target::Mqtt => mqtt::COUNT,
            _ => 0,
        };
        let wants_more = |count| began.elapsed() < *of_each || count < least;
        while wants_more(count) && go_on() && (only.is_none() || count == 0) {
            let number =
                only.map_or(seed.wrapping_mul(1_000_000_007).wrapping_add(count), |(_, number)| number);
            count += 1;
            let mut rng = Source::seeded(number);
            let held = match target {
                Target::Http => doors::http(&plant, &mut rng),
                Target::Gateway => doors::gateway(&plant, &mut rng),
                Target::Misfortunes => misfortunes::execute(number, &mut plant, &mut rng),
                Target::Mqtt => mqtt::execute(number, &plant, &mut rng),
                _ => files.execute(target, &plant, &mut rng),
            };
            // What lives as before is not asked after each.
            let held = held.and_then(|()| if count % 64 == 1 { doors::lives(&plant) } else { Ok(()) });
            if let Err(why) = held {
                if let Some((_, what)) = why.split_once("skipped: ") {
                    told.count_as(format!("not tried: {what}"), 1);
                    continue;
                }
                let kind: String = why.chars().take(40).collect();
                whys.entry(kind).or_insert((number, why));
            }
        }
        told.count += count;
        told.count_as(format!("{target:?}"), count);
        for (number, why) in whys.into_values() {
            let replay = format!("drive-fire program --target {target:?} --execution {number}");
            told.finds.push(Find { what: format!("{target:?}: {why}"), replay });
        }
        if !go_on() {
            first.set(target.next_round(wants_more(count), begins_with));
            break;
        }
    }
    let mut find = |what| told.finds.push(Find { what, replay: format!("drive-fire program --seed {seed}") });
    doors::lives(&plant).unwrap_or_else(&mut find);
    judge::log(&plant.log()).unwrap_or_else(&mut find);
    doors::nothing_moves(&plant).unwrap_or_else(&mut find);
    if let (Some(before), Some(after)) = (before, plant.memory()) {
        judge::memory(before, after, GROWTH).unwrap_or_else(&mut find);
        told.details.push(format!("the daemon: {before} KiB before, {after} KiB behind it"));
    }
    told.took = begun.elapsed();
    Ok(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The targets of a round that has room for so much, where each takes a second of it and one with a least as much as that.
    fn round(first: &Cell<Target>, room: u64) -> Vec<Target> {
        let (begins_with, mut left, mut came) = (first.get(), room, Vec::new());
        for target in begins_with.and_others() {
            let takes = match target {
                Target::Mqtt => 9,
                Target::Misfortunes => 6,
                _ => 1,
            };
            came.push(target);
            let had = takes.min(left);
            left -= had;
            if left == 0 {
                first.set(target.next_round(had < takes, begins_with));
                break;
            }
        }
        came
    }

    #[test]
    fn every_target_has_its_turn_however_early_each_round_ends() {
        for room in 1..16 {
            let first = Cell::new(Target::Http);
            let mut came: Vec<Target> = (0..16).flat_map(|_| round(&first, room)).collect();
            came.sort_unstable();
            came.dedup();
            assert_eq!(came, Target::ALL, "{room}");
        }
    }

    #[test]
    fn a_target_that_was_cut_short_has_the_next_round_for_itself_and_not_the_one_behind_that() {
        let first = Cell::new(Target::Http);
        assert_eq!(round(&first, 4), [Target::Http, Target::Gateway, Target::Mqtt]);
        assert_eq!(round(&first, 4), [Target::Mqtt]);
        assert_eq!(round(&first, 4)[0], Target::Captures);
    }
}
