//! What cells and stories are to find: families that break their contract, and with the feature `plants` wrong lines of the master.

use std::time::Instant;

use drive_families::{Family, SetUp};
use drive_testing::{
    Contract,
    contract::{ControlWord, Open},
    mutants::Mutant,
};

use super::{Cell, Lived, Plane, Subject, live, open, shuffled, story::Story, tell};
use crate::report::{Find, Plant, Told};

/// The ways in which a family breaks its contract that show in what it says and does, and not only in how it asks.
const OF_A_FAMILY: [Mutant; 10] = [
    Mutant::StartConfirmedByAnything,
    Mutant::StopConfirmedByAnything,
    Mutant::ResetConfirmedByAnything,
    Mutant::SetpointNotCompared,
    Mutant::CommandsLiveForEver,
    Mutant::AlwaysInForce,
    Mutant::ForgetEndsTheLease,
    Mutant::StopSentEndsTheLease,
    Mutant::NoOutputIsStandstill,
    Mutant::AnyReferenceIsOurs,
];

/// The register of a family's control word, by its manual.
fn control(family: Family) -> Option<u16> {
    Some(match family.capabilities().key {
        "atv21" => 0xFA00,
        "atv28" | "atv58" => 400,
        "atv312" => 8501,
        "3g3ev" => 1,
        _ => return None,
    })
}

/// A drive with this fault in its family.
fn broken(mutant: Mutant, family: Family) -> Box<Open> {
    let whole = Contract::new(
        family.capabilities(),
        move |port, slave| family.open_with(port, slave, &family.simulated_options()),
        move || family.machine(SetUp::ForTheBus).expect("it has a twin"),
    );
    let control =
        control(family).map(|register| ControlWord { register, words: &[], others: |_| 0, unseen: &[] });
    mutant.of(Contract { control, ..whole }).open
}

/// Attacks each planted defect, or `only` this one, with the cells of the whole until one finds it, at most so many cells.
pub fn find_plants(seed: u64, at_most: usize, only: Option<&str>) -> Told {
    let can_exist = |plane| shuffled(plane, seed).filter(|cell: &Cell| cell.cannot_exist().is_none());
    let cells = || {
        let mut planes = Plane::ALL.map(can_exist);
        (0..at_most).map_while(move |turn| planes[turn % Plane::ALL.len()].next())
    };
    let attack = |plant: Planted, cell: &Cell| {
        let (lived, reached) = plant.attacks(cell.subject, |open| live(cell, open));
        (lived, reached, cell.name())
    };
    hunt(Told::new("fault matrix, against planted defects", "cells"), only, cells, attack)
}

/// The same with stories.
pub fn find_plants_by_stories(seed: u64, at_most: usize, only: Option<&str>) -> Told {
    let begin = seed.wrapping_mul(1_000_000_007);
    let stories = || (1..).filter_map(move |turn| Story::of(begin.wrapping_add(turn))).take(at_most);
    let attack = |plant: Planted, story: &Story| {
        let (lived, reached) = plant.attacks(story.subject, |open| tell(story, open));
        (lived, reached, story.to_string())
    };
    hunt(Told::new("worlds generated, against planted defects", "stories"), only, stories, attack)
}

/// Each planted defect, or `only` this one, until one of the cases finds it.
fn hunt<C, I: Iterator<Item = C>>(
    mut told: Told,
    only: Option<&str>,
    cases: impl Fn() -> I,
    attack: impl Fn(Planted, &C) -> (Lived, bool, String),
) -> Told {
    let begun = Instant::now();
    for (name, planted) in all().filter(|(name, _)| only.is_none_or(|only| only == name)) {
        let (mut found_by, mut was_reached) = (None, false);
        for (case, number) in cases().zip(1..) {
            told.count += 1;
            let (lived, reached, by) = attack(planted, &case);
            was_reached |= reached;
            if let Lived::Against(why) = lived {
                let why: String =
                    why.first().map(String::as_str).unwrap_or_default().chars().take(90).collect();
                found_by = Some(format!("{by} after {number}: {why}"));
                break;
            }
        }
        let name = format!("{name}{}", if was_reached { "" } else { " (its line was never reached)" });
        let plant = Plant { name, found_by };
        eprintln!("{plant:?}");
        told.plants.push(plant);
    }
    told.took = begun.elapsed();
    told
}

/// What the matrix has found of what is planted, each by the cell that found it: a number is a cell, and names it for as long as no
/// axis of the matrix changes. Those of the line stand at the end; without the feature `plants` nobody can plant them.
const FOUND: &[(&str, &str)] = &[
    ("family: StartConfirmedByAnything", "W:187809"),
    ("family: ResetConfirmedByAnything", "F:3591731"),
    ("family: AlwaysInForce", "E:24482"),
    ("family: ForgetEndsTheLease", "E:19106"),
    ("family: StopSentEndsTheLease", "E:35943"),
    ("family: NoOutputIsStandstill", "F:1525394"),
    ("line: crc-unchecked", "A:35571058"),
    ("line: transaction-unchecked", "W:201890"),
    ("line: silence-unkept", "E:76152"),
    ("line: pause-unkept", "E:18204"),
    ("line: command-sent-late", "E:26300"),
    ("line: lost-write-told-as-expired", "A:200156991"),
    ("line: sent-told-as-unsent", "F:2066341"),
    ("line: late-answer-unfeared", "F:2261288"),
];

/// Each planted defect that the matrix has found, against the cell that found it, which is sound without it.
pub fn find_again() -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fault matrix, against planted defects", "cells");
    let planted: Vec<(String, Planted)> = all().collect();
    for (name, by) in FOUND.iter().filter(|(name, _)| cfg!(feature = "plants") || !name.starts_with("line")) {
        let plant = planted.iter().find(|(known, _)| known == name).map(|(_, plant)| *plant);
        let (Some(plant), Some(cell)) = (plant, Cell::named(by)) else {
            told.finds.push(Find {
                what: format!("{name} is no plant here, or {by} no cell"),
                replay: String::new(),
            });
            continue;
        };
        told.count += 1;
        let is_found = matches!(plant.attacks(cell.subject, |open| live(&cell, open)).0, Lived::Against(_));
        if let Lived::Against(why) = live(&cell, &*open(&cell)) {
            let replay = format!("drive-fire matrix --cell {by}");
            told.finds
                .push(Find { what: format!("{cell} without a plant\n    {}", why.join("\n    ")), replay });
        }
        told.plants.push(Plant { name: (*name).to_owned(), found_by: is_found.then(|| (*by).to_owned()) });
    }
    told.took = begun.elapsed();
    told
}

/// A planted defect.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Planted {
    Family(Mutant),
    #[cfg(feature = "plants")]
    Line(&'static str),
}

/// Those that a name chooses.
#[cfg(feature = "plants")]
pub(crate) const fn at_a_line(name: &'static str) -> Planted {
    Planted::Line(name)
}

/// Those of families and, with the feature `plants`, of the line.
pub(crate) fn all() -> impl Iterator<Item = (String, Planted)> {
    let families = OF_A_FAMILY.map(|mutant| (format!("family: {mutant:?}"), Planted::Family(mutant)));
    #[cfg(feature = "plants")]
    let lines = drive_bus::mutants::ALL
        .iter()
        .map(|mutant| (format!("line: {}", mutant.name), Planted::Line(mutant.name)));
    #[cfg(not(feature = "plants"))]
    let lines = std::iter::empty();
    families.into_iter().chain(lines)
}

impl Planted {
    /// What makes a drive of this family that has the defect, where it stands in families.
    pub(crate) fn open(self, family: Family) -> Box<Open> {
        match self {
            Self::Family(mutant) => broken(mutant, family),
            #[cfg(feature = "plants")]
            Self::Line(_) => super::drive_of(family),
        }
    }

    /// What comes of it with this defect, and whether its line was reached.
    pub(crate) fn while_chosen<T>(self, lives: impl FnOnce() -> T) -> (T, bool) {
        match self {
            Self::Family(_) => (lives(), true),
            #[cfg(feature = "plants")]
            Self::Line(name) => {
                // Chosen anew for each: what goes round without end in one of them is ended.
                let _chosen = drive_bus::mutants::choose(name);
                (lives(), drive_bus::mutants::was_reached(name))
            }
        }
    }

    /// How a drive of this subject lives with this defect, and whether its line was reached.
    fn attacks(self, subject: Subject, lives: impl Fn(&Open) -> Lived) -> (Lived, bool) {
        self.while_chosen(|| lives(&*self.open(subject.family())))
    }
}
