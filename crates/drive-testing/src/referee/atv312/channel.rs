//! Who commands, by access level, channels, forced local and the remote terminal.

use super::rules::*;
use super::{at, inputs};
use crate::referee::answer::{Answer, Who};
use crate::referee::drivecom::{RUN as RUN_BITS, State};
use crate::referee::world::World;

pub(super) const L3: u16 = 2;

pub(super) fn is_l3(world: &World) -> bool {
    world.word(at::LAC, 0) == L3
}

/// The first (false) or the second (true) of two channels, by a selecting setting.
fn second(world: &World, selector: u16, of_second: u16) -> bool {
    match selector {
        129..=134 => world.input((selector - 129) as u8),
        187..=191 => world.commanded((selector - 187 + 11) as u8),
        203..=207 => world.other_command >> (selector - 203 + 11) & 1 == 1,
        other => other == of_second,
    }
}

/// The setting Fr1 or Fr2 that counts, and whether it is Fr1.
pub(super) fn reference_channel(world: &World) -> (u16, bool) {
    if second(world, world.word(at::RFC, 96), 97) {
        (world.word(at::FR2, 0), false)
    } else {
        (world.word(at::FR1, 1), true)
    }
}

/// Whether forced local is in force.
pub(super) fn forced_local(world: &World) -> Option<bool> {
    match (world.word(at::FLO, 0), world.forced_local) {
        (_, Some(known)) => Some(known),
        (0, None) => Some(false),
        (_, None) => None,
    }
}

fn of_forced_local(world: &World) -> Answer<Who> {
    if !is_l3(world) {
        return Answer::Silent(&FORCED_LOCAL_NOT_L3);
    }
    let who = match world.word(at::FLOC, 1) {
        16 => Who::Keypad,
        163 => Who::RemoteTerminal,
        _ => Who::Terminals,
    };
    Answer::Says(who, &FORCED_LOCAL)
}

/// Whether the last word of the bus is a run command.
pub(super) fn run_word(world: &World) -> bool {
    world.command.is_some_and(|word| word & RUN_BITS == RUN_BITS)
}

/// A run command of the bus that has taken effect in the chart.
pub(super) fn bus_runs(world: &World) -> bool {
    world.state == State::OperationEnabled && run_word(world)
}

fn in_priority_mode(world: &World) -> Answer<Who> {
    if world.word(at::LCC, 0) == 1 {
        return Answer::Says(Who::RemoteTerminal, &LCC_YES);
    }
    let local = world.word(at::TCC, 0) == 2;
    let asked_locally = if local { world.latched.is_some() } else { inputs::asks(world) };
    match (asked_locally, bus_runs(world), world.command.is_some()) {
        (true, _, true) => Answer::Silent(&PRIORITIES),
        (false, true, _) => Answer::Says(Who::Bus, &PRIORITY_MODE),
        (false, false, true) => Answer::Says(Who::Bus, &PRIORITY_MODE),
        _ if local => Answer::Says(Who::Keypad, &TCC_LOCAL),
        _ => Answer::Says(Who::Terminals, &PRIORITY_MODE),
    }
}

fn combined(world: &World) -> Answer<Who> {
    match reference_channel(world).0 {
        164 => Answer::Says(Who::Bus, &COMBINED),
        167 => Answer::Says(Who::OtherBus, &COMBINED),
        163 => Answer::Says(Who::RemoteTerminal, &COMBINED),
        1..=3 => Answer::Says(Who::Terminals, &COMBINED),
        0 => Answer::Silent(&REFERENCE_NONE),
        _ => Answer::Silent(&SIM_DIAL),
    }
}

fn separate(world: &World) -> Answer<Who> {
    let channel = if second(world, world.word(at::CCS, 98), 99) {
        world.word(at::CD2, 10)
    } else {
        world.word(at::CD1, 1)
    };
    let who = match channel {
        2 => Who::Keypad,
        3 => Who::RemoteTerminal,
        10 => Who::Bus,
        20 => Who::OtherBus,
        _ => Who::Terminals,
    };
    Answer::Says(who, &SEPARATE)
}

pub(super) fn commander(world: &World) -> Answer<Who> {
    if let Some(who) = world.told {
        return Answer::Says(who, &TOLD);
    }
    match (forced_local(world), is_l3(world)) {
        (None, _) => Answer::Silent(&FORCED_LOCAL_LEVEL),
        (Some(true), _) => of_forced_local(world),
        (Some(false), false) => in_priority_mode(world),
        (Some(false), true) if world.word(at::CHCF, 1) == 2 => separate(world),
        (Some(false), true) => combined(world),
    }
}
