//! What the terminals ask, and the stops that inputs, keys and the high bits of CMD ask.

use super::rules::*;
use super::{at, channel};
use crate::referee::answer::{Answer, Rule, Stop, Who};
use crate::referee::world::{Direction, World};

/// The level of the logic input that a setting assigns.
pub(super) fn level(world: &World, assigned: u16) -> Option<bool> {
    matches!(assigned, 129..=134).then(|| world.input((assigned - 129) as u8))
}

/// The bit of CMD that a setting assigns, with L3.
fn bit(world: &World, assigned: u16) -> Option<bool> {
    (channel::is_l3(world) && matches!(assigned, 171..=175)).then(|| {
        let bit = (assigned - 171 + 11) as u8;
        world.commanded(bit) || world.other_command >> bit & 1 == 1
    })
}

/// An input at 1 or a bit at 1.
pub(super) fn active_at_1(world: &World, assigned: u16) -> bool {
    level(world, assigned).or_else(|| bit(world, assigned)).unwrap_or(false)
}

fn active_at_0(world: &World, assigned: u16) -> bool {
    level(world, assigned).map_or_else(|| bit(world, assigned).unwrap_or(false), |level| !level)
}

pub(super) fn three_wire(world: &World) -> bool {
    world.word(at::TCC, 0) == 1
}

/// 2-wire control by levels.
pub(super) fn by_level(world: &World) -> bool {
    world.word(at::TCC, 0) == 0 && matches!(world.word(at::TCT, 1), 0 | 2)
}

pub(super) fn by_edge(world: &World) -> bool {
    world.word(at::TCC, 0) == 0 && world.word(at::TCT, 1) == 1
}

/// The input for reverse.
pub(super) fn reverse_input(world: &World) -> u16 {
    let factory = [130, 131, 0][usize::from(world.word(at::TCC, 0).min(2))];
    world.word(at::RRS, factory)
}

/// Whether the terminals ask for a run, as far as anybody can know.
pub(super) fn asks(world: &World) -> bool {
    match run(world) {
        Answer::Says(run, _) => run.is_some(),
        Answer::Silent(_) => true,
    }
}

/// The run command at the terminals.
pub(super) fn run(world: &World) -> Answer<Option<Direction>> {
    let forward = world.input(0);
    if three_wire(world) {
        return if forward {
            Answer::Silent(&THREE_WIRE_START)
        } else {
            Answer::Says(None, &THREE_WIRE_STOP)
        };
    }
    let reverse = level(world, reverse_input(world)).unwrap_or(false);
    let rule = match world.word(at::TCT, 1) {
        0 => &LEVEL,
        2 => &FORWARD_FIRST,
        _ => &EDGE,
    };
    match (forward, reverse) {
        (true, true) if world.word(at::TCT, 1) != 2 => Answer::Silent(&BOTH_DIRECTIONS),
        _ if by_edge(world) => Answer::Says(world.latched, rule),
        (true, _) => Answer::Says(Some(Direction::Forward), rule),
        (_, true) => Answer::Says(Some(Direction::Reverse), &REVERSE_INPUT),
        _ => Answer::Says(None, rule),
    }
}

/// How a normal stop comes down.
pub(super) fn normal_stop(world: &World) -> Stop {
    match world.word(at::STT, 0) {
        0 => Stop::Ramp,
        1 => Stop::Fast,
        2 => Stop::Freewheel,
        _ => Stop::Injection { tenths: Some(world.word(at::TDC, 5)) },
    }
}

/// Whether any setting gives bit 12 of CMD another meaning than stop, or bit 11 another than reverse.
pub(super) fn reassigned(world: &World, bit: u16) -> bool {
    let by_cd = [at::RPS, at::FST, at::DCI, at::PS2, at::PS4, at::PS8, at::PS16, at::PR2, at::PR4];
    let also = [at::LC2, at::CHP, at::ETF];
    channel::is_l3(world)
        && (by_cd.iter().chain(&also).any(|&address| world.word(address, 0) == 171 + bit - 11)
            || world.word(at::RFC, 96) == 187 + bit - 11
            || (world.word(at::CHCF, 1) == 2 && world.word(at::CCS, 98) == 187 + bit - 11))
}

fn of_command(world: &World) -> Vec<(Stop, &'static Rule)> {
    let mut all = Vec::new();
    if world.commanded(12) && !reassigned(world, 12) {
        all.push((normal_stop(world), &CMD_STOP));
    }
    if !channel::is_l3(world) {
        if world.commanded(13) {
            all.push((Stop::Injection { tenths: None }, &CMD_INJECTION));
        }
        if world.commanded(14) {
            all.push((Stop::Fast, &CMD_FAST));
        }
    }
    all
}

/// The stop in force, if any; two at once stop in a way that is not said.
pub(super) fn stop(world: &World, by: Who) -> Option<(Stop, &'static Rule)> {
    let mut all = if by == Who::Bus { of_command(world) } else { Vec::new() };
    if level(world, world.word(at::NST, 0)) == Some(false) {
        all.push((Stop::Freewheel, &FREEWHEEL_INPUT));
    }
    if active_at_0(world, world.word(at::FST, 0)) {
        all.push((Stop::Fast, &FAST_INPUT));
    }
    if active_at_1(world, world.word(at::DCI, 0)) {
        all.push((Stop::Injection { tenths: None }, &INJECTION_INPUT));
    }
    if three_wire(world) && !world.input(0) {
        all.push((Stop::Unsaid, &THREE_WIRE_STOP));
    }
    if world.panel.stop && world.word(at::PST, 1) == 1 {
        all.push((Stop::Unsaid, &STOP_KEY));
    }
    match all.as_slice() {
        [] => None,
        [one] => Some(*one),
        _ => Some((Stop::Unsaid, &STOPS_FIRST)),
    }
}

/// Whether nothing stops but bits of CMD while another channel commands: the manual leaves open whether they act.
pub(super) fn is_stopped_by_bits_elsewhere(world: &World, by: Who) -> bool {
    by != Who::Bus && stop(world, by).is_some() && stop(&without_bits(world), by).is_none()
}

/// The world without the bits of the control words.
pub(super) fn without_bits(world: &World) -> World {
    World { command: None, other_command: 0, ..world.clone() }
}
