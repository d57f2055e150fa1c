//! What cells and stories are to find: families that break their contract, and with the feature `plants` wrong lines of the master.

use std::time::Instant;

use drive_families::{Family, SetUp};
use drive_testing::{
    Contract,
    contract::{ControlWord, Open},
    mutants::Mutant,
};

use super::{Cell, Lived, Plane, Subject, live, shuffled, story::Story, tell};
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
    let control = control(family).map(|register| ControlWord {
        register,
        words: &[],
        others: |_| 0,
        unseen: &[],
        once: &[],
    });
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
    ("line: sent-told-as-unsent", "F:4374893"),
    ("line: late-answer-unfeared", "W:29902"),
];

/// The same of the stories.
const FOUND_BY_STORIES: &[(&str, &str)] = &[
    (
        "family: StartConfirmedByAnything",
        "5.0.0.o4.f35x3.f58x3.o6.o7.l7.o5.f62x0.f33x4.o14.f70x4.o9.l7.f68x5",
    ),
    ("family: AlwaysInForce", "2.4.5.e20.o6.o10.o10.o14.l6.f70x5.o11.f30x5.o4.f65x4.o6.e8"),
    ("family: ForgetEndsTheLease", "6.4.7.f67x2.e9.o5.f47x3.o5"),
    ("family: StopSentEndsTheLease", "5.3.9.o6.o1.l8.l8.o8.l8"),
    ("family: NoOutputIsStandstill", "6.4.0.l6.l3.l7.l1.e6.o4.l2.o5.o10.o1.o11.o10.o5.o4"),
    ("line: another-slaves-answer", "7.3.0.f35x1.o5.o6"),
    ("line: crc-unchecked", "7.3.0.o6.l1.o11.f28x3.o7.l6"),
    ("line: transaction-unchecked", "7.4.0.o11.o5.o3.o11.f12x2.l5.o9.f71x2.o11.l6.f63x2.o11.o8"),
    ("line: early-answer-believed", "1.0.0.f34x0.o10"),
    ("line: late-answer-unfeared", "7.0.0.o10.l6.f69x1.o11.f10x0.o5.o7.o3.l3.o6.o0.o8"),
    ("line: edge-repeated", "2.1.0.l4.l2.f31x0.e10.o1.f25x1.l7.o15.o12.o8.f42x4.f34x0.o11.f33x4"),
    ("line: command-sent-late", "1.4.0.o5.f16x0.o9.o7.e15.f70x5.e12.o6.l8.o11.f62x2.o5.e5.o5.l8"),
    ("line: sent-told-as-unsent", "0.4.0.o5.l5.l4.o19.o8.f62x0.l8.o10.o19.o6.f35x3.e18.f16x1.o16.f13x0"),
    ("line: lost-write-told-as-expired", "0.4.7.f50x3.o7.o11.l3.f61x4.o5.f15x2"),
];

/// Each planted defect that the matrix has found, against the cell that found it, which is sound without it.
pub fn find_again() -> Told {
    let told = Told::new("fault matrix, against planted defects", "cells");
    again(told, FOUND, Cell::named, |cell| cell.subject, live, "drive-fire matrix --cell")
}

/// The same of the stories.
pub fn find_again_by_stories() -> Told {
    let told = Told::new("worlds generated, against planted defects", "stories");
    again(told, FOUND_BY_STORIES, Story::read, |story| story.subject, tell, "drive-fire worlds --story")
}

fn again<C>(
    mut told: Told,
    found: &[(&str, &str)],
    read: fn(&str) -> Option<C>,
    subject: fn(&C) -> Subject,
    lives: fn(&C, &Open) -> Lived,
    replay: &str,
) -> Told {
    let begun = Instant::now();
    let planted: Vec<(String, Planted)> = all().collect();
    for (name, by) in found.iter().filter(|(name, _)| cfg!(feature = "plants") || !name.starts_with("line")) {
        let plant = planted.iter().find(|(known, _)| known == name).map(|(_, plant)| *plant);
        let (Some(plant), Some(case)) = (plant, read(by)) else {
            let what = format!("{name} is no plant here, or {by} is not read");
            told.finds.push(Find { what, replay: String::new() });
            continue;
        };
        told.count += 1;
        let subject = subject(&case);
        let is_found = matches!(plant.attacks(subject, |open| lives(&case, open)).0, Lived::Against(_));
        if let Lived::Against(why) = lives(&case, &*super::drive_of(subject.family())) {
            let what = format!("{by} without a plant\n    {}", why.join("\n    "));
            told.finds.push(Find { what, replay: format!("{replay} {by}") });
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
