//! What the drive remembers: the chart, edges, trips, and what writes of settings do to other settings.

use super::rules::*;
use super::{at, channel, inputs};
use crate::referee::answer::{Answer, Effect, Who};
use crate::referee::drivecom::{self, RUN as RUN_BITS, State};
use crate::referee::world::{Change, Direction, Key, Spent, World};

const EPF: u16 = 8;
const SLF: u16 = 5;

/// The configuration parameters of BBV51701, "R/WS".
#[rustfmt::skip]
const CONFIGURATION_WORDS: [u16; 105] = [
    3006, 3015, 3052, 3103, 3107, 3110, 3120, 4434, 4444, 4601, 5001, 5002, 5031, 6001, 6003, 6004, 6005, 6051,
    6053, 7002, 7003, 7004, 7006, 7007, 7008, 7009, 7010, 7011, 7012, 7080, 7090, 7122, 7123, 7124, 7125, 7131,
    8001, 8002, 8011, 8401, 8402, 8411, 8413, 8414, 8421, 8423, 8424, 8431, 8432, 9003, 9004, 9010, 9011, 9020,
    9101, 9202, 9601, 9602, 9603, 9604, 9606, 9607, 9611, 9643, 9701, 9702, 9703, 9704, 9706, 10001, 10002, 10003,
    10004, 10005, 10006, 10007, 11001, 11002, 11003, 11101, 11102, 11105, 11110, 11201, 11202, 11203, 11204, 11230,
    11401, 11402, 11403, 11404, 11501, 11502, 11503, 11601, 11602, 11603, 11801, 11802, 11901, 11908, 11909, 11910,
    64001,
];

/// What factory settings leave as it is (p.20, p.55, p.56), bFr, LCC and COd among it.
const KEPT: [u16; 12] = [3015, 3003, 6001, 6003, 6004, 6005, 6051, 6053, at::FLO, at::FLOC, at::RP, at::LCC];

/// Settings that assign a function to a logic input.
const OF_INPUTS: [u16; 24] = [
    at::RRS,
    at::TCT,
    at::RPS,
    at::FST,
    at::DCI,
    at::NST,
    at::JOG,
    at::PS2,
    at::PS4,
    at::PS8,
    at::PS16,
    at::PR2,
    at::PR4,
    at::LC2,
    at::CHP,
    at::ETF,
    at::RSF,
    at::LAF,
    at::LAR,
    at::TUN,
    11501,
    11502,
    7125,
    at::RFC,
];

/// The address that BBV51701 gives to what an ATV28 has elsewhere (p.57).
fn of_312(address: u16) -> u16 {
    match address {
        6 => at::TCC,
        250 => at::HSP,
        251 => at::LSP,
        262 => at::JGF,
        340 => at::ROT,
        400 | at::CMDD => at::CMD,
        401 => at::LFR,
        402 => at::CMI,
        991 => at::LCC,
        other => other,
    }
}

fn trip(world: &mut World, code: u16, cause: bool) {
    world.tripped = Some(code);
    world.cause = cause;
    world.state = State::Fault;
}

fn reset(world: &mut World) {
    if world.tripped.is_some() && !world.cause {
        world.tripped = None;
        world.state = State::SwitchOnDisabled;
        if inputs::by_edge(world) {
            world.latched = None;
        }
        let terminals = channel::commander(world).said() == Some(Who::Terminals);
        if terminals && inputs::by_level(world) && !channel::is_l3(world) {
            world.state = State::OperationEnabled; // p.52: a run that is kept through the reset starts again
        } else if terminals && inputs::asks(world) && !inputs::by_level(world) {
            world.unsure = Some(&RESTART_AFTER_RESET);
        }
    }
}

/// A stop that ends the run command, but for 2-wire control by levels.
fn spend(world: &mut World) {
    if !inputs::by_level(world) {
        world.latched = None;
        if channel::bus_runs(world) {
            world.spent = Spent::Yes;
        }
    }
}

fn command(world: &World, after: &mut World, word: u16) {
    let before = world.command.unwrap_or(0);
    if world.unsure == Some(&WORDS_OVER_POWER) {
        after.unsure = None;
    }
    after.take_command(word, false);
    after.state = drivecom::after(world.state, before, word, world.cause);
    if world.state == State::Fault && after.state != State::Fault {
        after.state = State::Fault;
        reset(after);
    }
    if word & RUN_BITS == RUN_BITS {
        let again = world.command == Some(word);
        after.spent = match world.spent {
            Spent::No => Spent::No,
            _ if again => Spent::SameWordAgain,
            _ => Spent::No,
        };
    } else {
        after.spent = Spent::No;
    }
    external(world, after);
}

/// Where the chart goes to switch on disabled by the STOP key and by a stop at the terminals (p.10: transitions 9 and 12).
const fn leaves_for_disabled(state: State) -> bool {
    matches!(state, State::OperationEnabled | State::QuickStop)
}

/// The external fault by input or bit.
fn external(world: &World, after: &mut World) {
    let assigned = after.word(at::ETF, 0);
    let high = after.word(at::LET, 1) == 1;
    let fault = match (inputs::level(after, assigned), high) {
        (Some(level), high) => level == high,
        (None, true) => inputs::active_at_1(after, assigned),
        (None, false) => false,
    };
    if fault && world.tripped.is_none() && after.word(at::EPL, 1) != 0 {
        trip(after, EPF, true);
    } else if !fault && after.tripped == Some(EPF) {
        after.cause = false;
    }
}

fn factory(after: &mut World) {
    after.words.retain(|address, _| KEPT.contains(address));
    after.latched = None;
    after.unsure = Some(&AFTER_FACTORY);
}

fn configure(world: &World, after: &mut World, address: u16, value: u16) {
    if world.turning {
        return;
    }
    match (address, value) {
        (at::FCS, 0) => return,
        (at::FCS, _) | (at::CFG, _) => return factory(after),
        (at::LAC, value) => {
            if value <= world.word(at::LAC, 0) {
                return; // only factory settings lead back
            }
            if value == channel::L3 {
                for address in [at::FR1, at::CD1, at::CHCF, at::TCC] {
                    after.words.remove(&address);
                }
            }
        }
        (at::TCC, _) => {
            for address in OF_INPUTS {
                after.words.remove(&address);
            }
        }
        _ => {}
    }
    after.words.insert(address, value);
    if matches!(world.state, State::Ready | State::SwitchedOn | State::OperationEnabled | State::QuickStop) {
        after.state = State::SwitchOnDisabled;
        after.latched = None;
    }
}

fn write(world: &World, after: &mut World, address: u16, value: u16) {
    match of_312(address) {
        at::CMD => command(world, after, value),
        at::CMI => {
            after.written.insert(at::CMI, value & !0b11);
            if value & 1 == 1 && !world.turning {
                factory(after);
            }
            if value >> 3 & 1 == 1 && world.tripped.is_none() && world.word(at::EPL, 1) != 0 {
                trip(after, EPF, false);
            }
        }
        at::RP if value == 1 && world.tripped.is_some() => {
            reset(after);
            after.unsure = Some(&STATE_AFTER_RP);
        }
        address @ (at::LFR | at::LFRD) => {
            after.written.insert(address, value);
        }
        address if CONFIGURATION_WORDS.contains(&address) || matches!(address, at::PST | at::LCC) => {
            configure(world, after, address, value);
        }
        address => {
            after.words.insert(address, value);
        }
    }
}

fn input(world: &World, after: &mut World, bit: u8, closed: bool) {
    let rises = closed && !world.input(bit);
    let falls = !closed && world.input(bit);
    let code = 129 + u16::from(bit);
    let assigned = |address| world.word(address, 0) == code;
    if assigned(at::RSF) && rises {
        reset(after);
    }
    if falls && (assigned(at::NST) || (bit == 0 && inputs::three_wire(world))) {
        if !inputs::by_level(world) {
            after.latched = None;
        }
        let freewheel_with_level = assigned(at::NST) && inputs::by_level(world);
        let bus = channel::commander(world).said() == Some(Who::Bus);
        if bus && leaves_for_disabled(world.state) {
            after.state = State::SwitchOnDisabled;
            if freewheel_with_level && channel::bus_runs(world) {
                after.unsure = Some(&FREEWHEEL_LEVEL);
            }
        }
    }
    if falls && assigned(at::FST) {
        spend(after);
    }
    if falls && assigned(at::DCI) && channel::bus_runs(world) {
        after.unsure = Some(&INJECTION_RELEASED);
    }
    if inputs::by_edge(world) {
        let direction = match code {
            129 => Some(Direction::Forward),
            code if code == inputs::reverse_input(world) => Some(Direction::Reverse),
            _ => None,
        };
        let stopped = inputs::stop(after, Who::Terminals).is_some();
        match direction {
            Some(direction) if rises && !stopped && world.mains && world.tripped.is_none() => {
                after.latched = Some(direction);
            }
            // Whether this edge began a run is as open as whether those bits stop.
            Some(_) if rises && inputs::is_stopped_by_bits_elsewhere(after, Who::Terminals) => {
                after.unsure = Some(&STOP_BITS_ELSEWHERE);
            }
            Some(direction) if falls && world.latched == Some(direction) => after.latched = None,
            _ => {}
        }
    }
    external(world, after);
}

fn key(world: &World, after: &mut World, key: Key, held: bool) {
    let by = channel::commander(world).said();
    let keys = matches!(by, Some(Who::Keypad | Who::RemoteTerminal));
    match key {
        Key::Run if held && keys && !world.panel.stop && world.tripped.is_none() => {
            let reverse = match by {
                Some(Who::RemoteTerminal) => world.panel.reverse,
                _ => world.word(at::ROT, 0) == 1 || world.panel.reverse,
            };
            after.latched = Some(if reverse { Direction::Reverse } else { Direction::Forward });
        }
        Key::Stop if held && (keys || world.word(at::PST, 1) == 1) => {
            after.latched = None;
            if by == Some(Who::Bus) && leaves_for_disabled(world.state) {
                after.state = State::SwitchOnDisabled;
            } else if by == Some(Who::Terminals) && inputs::by_level(world) && inputs::asks(world) {
                after.unsure = Some(&STOP_KEY_MODE);
            }
        }
        Key::Reset if held && keys => reset(after),
        _ => {}
    }
}

pub(super) fn step(world: &World, change: &Change) -> World {
    let mut after = world.clone();
    after.note(change);
    match *change {
        Change::Write { address, value } | Change::Broadcast { address, value } => {
            write(world, &mut after, address, value);
        }
        Change::Input { bit, closed } => input(world, &mut after, bit, closed),
        Change::Key { key: which, held } => key(world, &mut after, which, held),
        Change::Link(false) => {
            let no_watch = world.written.get(&at::CMI).is_some_and(|word| word >> 14 & 1 == 1);
            if world.word(at::SLL, 1) != 0 && !no_watch && world.tripped.is_none() {
                match channel::commander(world).said() {
                    Some(Who::Bus) => trip(&mut after, SLF, true),
                    _ => after.unsure = Some(&LINK_NOT_COMMANDING),
                }
            }
        }
        Change::Link(true) if world.tripped == Some(SLF) => after.cause = false,
        Change::Trip(_) => {
            after.state = State::Fault;
            if inputs::by_edge(world) {
                after.latched = None;
            }
        }
        Change::Mains(on) => {
            after.unsure = match world.unsure {
                Some(silence) if on && silence == &WORDS_OVER_POWER => Some(silence),
                _ => (!on && !channel::is_l3(world) && channel::run_word(world)).then_some(&WORDS_OVER_POWER),
            };
            after.forget_bus();
            after.latched = None;
            if on {
                after.tripped = None;
                let by_chart = channel::is_l3(world);
                after.state = if by_chart { State::SwitchOnDisabled } else { State::OperationEnabled };
                external(world, &mut after);
            }
        }
        _ => {}
    }
    after
}

pub(super) fn said_of(world: &World, change: &Change) -> Vec<Answer<Effect>> {
    let (Change::Write { address, value } | Change::Broadcast { address, value }) = *change else {
        return Vec::new();
    };
    let after = step(world, change);
    let mut all = Vec::new();
    if world.tripped.is_none() && after.tripped == Some(EPF) {
        all.push(Answer::Says(Effect::Trips, &EXTERNAL));
    }
    match of_312(address) {
        at::CMD if world.tripped.is_some() && after.tripped.is_none() => {
            all.push(Answer::Says(Effect::Resets, &RESET));
        }
        at::RP if value == 1 && world.tripped.is_some() => {
            all.push(Answer::Says(Effect::Resets, &RESET_WORD));
        }
        at::CMI => {
            if value >> 1 & 1 == 1 {
                all.push(Answer::Says(Effect::Saves, &SAVE));
            }
            if value & 1 == 1 && !world.turning {
                all.push(Answer::Says(Effect::Restores, &FACTORY));
            }
            if value >> 14 & 1 == 1 {
                all.push(Answer::Says(Effect::Nothing, &NO_WATCH));
            }
        }
        at::FCS if value != 0 && !world.turning => all.push(Answer::Says(Effect::Restores, &FACTORY)),
        at::CFG if !world.turning => all.push(Answer::Says(Effect::Restores, &FACTORY)),
        at::LAC if value == channel::L3 && !world.turning => {
            all.push(Answer::Says(Effect::Restores, &LAC_L3));
            all.push(Answer::Silent(&L3_AND_INPUTS));
        }
        at::TUN => all.push(Answer::Silent(&TUNING)),
        at::TCC if !world.turning => all.push(Answer::Says(Effect::Restores, &TCC_WRITTEN)),
        address if CONFIGURATION_WORDS.contains(&address) => {
            all.push(Answer::Says(Effect::Nothing, &CONFIGURATION));
        }
        _ => {}
    }
    all
}
