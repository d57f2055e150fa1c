//! What the matrix is to find: families that break their contract, and with the feature `plants` wrong lines of the master.

use std::time::Instant;

use drive_families::{Family, SetUp};
use drive_testing::{
    Contract,
    contract::{ControlWord, Open},
    mutants::Mutant,
};

#[cfg(feature = "plants")]
use super::open;
use super::{Cell, Lived, Plane, live, shuffled};
use crate::report::{Plant, Told};

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

/// The drive of a cell, with this fault in its family.
fn broken(mutant: Mutant, cell: &Cell) -> Box<Open> {
    let family = cell.subject.family();
    let whole = Contract::new(
        family.capabilities(),
        move |port, slave| family.open_with(port, slave, &family.simulated_options()),
        move || family.machine(SetUp::ForTheBus).expect("it has a twin"),
    );
    let control =
        control(family).map(|register| ControlWord { register, words: &[], others: |_| 0, unseen: &[] });
    mutant.of(Contract { control, ..whole }).open
}

/// Attacks each planted defect with the cells of the whole until one finds it, at most so many cells.
pub fn find_plants(seed: u64, at_most: usize) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("fault matrix, against planted defects", "cells");
    for mutant in OF_A_FAMILY {
        let found_by = attack(seed, at_most, &mut told.count, &|cell| broken(mutant, cell));
        told.plants.push(Plant { name: format!("family: {mutant:?}"), found_by });
    }
    #[cfg(feature = "plants")]
    for mutant in drive_bus::mutants::ALL {
        let _chosen = drive_bus::mutants::choose(mutant.name);
        let found_by = attack(seed, at_most, &mut told.count, &|cell| open(cell));
        let reached = drive_bus::mutants::was_reached(mutant.name);
        let name =
            format!("line: {}{}", mutant.name, if reached { "" } else { " (its line was never reached)" });
        told.plants.push(Plant { name, found_by });
    }
    told.took = begun.elapsed();
    told
}

/// The first cell that finds it, turn by turn from each plane.
fn attack(seed: u64, at_most: usize, count: &mut u64, opened: &dyn Fn(&Cell) -> Box<Open>) -> Option<String> {
    let can_exist = |plane| shuffled(plane, seed).filter(|cell: &Cell| cell.cannot_exist().is_none());
    let mut planes = Plane::ALL.map(can_exist);
    for turn in 0..at_most {
        let cell = planes[turn % planes.len()].next()?;
        *count += 1;
        if let Lived::Against(why) = live(&cell, &*opened(&cell)) {
            let why = why.first().map(String::as_str).unwrap_or_default();
            let short: String = why.chars().take(90).collect();
            return Some(format!("{} after {} cells: {short}", cell.name(), turn + 1));
        }
    }
    None
}
