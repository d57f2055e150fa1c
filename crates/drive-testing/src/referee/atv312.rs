//! The Altivar 312, by BBV51701 and BBV52816.

mod channel;
mod frequency;
mod inputs;
mod memory;
mod rules;
#[cfg(test)]
mod tests;

use self::rules::*;
use super::Manual;
use super::answer::{Answer, Effect, Motion, Order, Reference, Rule, Silence, Start, Stop, Who};
use super::drivecom::State;
use super::world::{Change, Direction, Spent, World};

/// Addresses, by the mnemonics of BBV51701.
#[rustfmt::skip]
mod at {
    pub(super) const LAC: u16 = 3006;    pub(super) const BFR: u16 = 3015;    pub(super) const CFG: u16 = 3052;
    pub(super) const HSP: u16 = 3104;    pub(super) const LSP: u16 = 3105;    
    pub(super) const STP: u16 = 7004;    pub(super) const EPL: u16 = 7006;    pub(super) const SLL: u16 = 7010;
    pub(super) const OHL: u16 = 7008;    pub(super) const OLL: u16 = 7009;    pub(super) const COL: u16 = 7011;
    pub(super) const LET: u16 = 7090;    pub(super) const ATR: u16 = 7122;    pub(super) const RSF: u16 = 7124;
    pub(super) const RP: u16 = 7128;     pub(super) const ETF: u16 = 7131;    pub(super) const FCS: u16 = 8002;
    pub(super) const CHP: u16 = 8011;    pub(super) const CHCF: u16 = 8401;   pub(super) const COP: u16 = 8402;
    pub(super) const RFC: u16 = 8411;    pub(super) const FR1: u16 = 8413;    pub(super) const FR2: u16 = 8414;
    pub(super) const CCS: u16 = 8421;    pub(super) const CD1: u16 = 8423;    pub(super) const CD2: u16 = 8424;
    pub(super) const FLO: u16 = 8431;    pub(super) const FLOC: u16 = 8432;   pub(super) const CMD: u16 = 8501;
    pub(super) const LFR: u16 = 8502;    pub(super) const CMI: u16 = 8504;    pub(super) const CMDD: u16 = 8601;
    pub(super) const LFRD: u16 = 8602;   pub(super) const RPS: u16 = 9010;    pub(super) const LC2: u16 = 9202;
    pub(super) const TUN: u16 = 9608;    pub(super) const TCC: u16 = 11101;   pub(super) const TCT: u16 = 11102;
    pub(super) const RRS: u16 = 11105;   pub(super) const JOG: u16 = 11110;   pub(super) const JGF: u16 = 11111;
    pub(super) const STT: u16 = 11201;   pub(super) const NST: u16 = 11202;   pub(super) const DCI: u16 = 11203;
    pub(super) const FST: u16 = 11204;   pub(super) const TDC: u16 = 11211;   pub(super) const JPF: u16 = 11301;
    pub(super) const JF2: u16 = 11302;   pub(super) const PS2: u16 = 11401;   pub(super) const PS4: u16 = 11402;
    pub(super) const PS8: u16 = 11403;   pub(super) const PS16: u16 = 11404;  pub(super) const LAF: u16 = 11601;
    pub(super) const LAR: u16 = 11602;   pub(super) const TLS: u16 = 11701;   pub(super) const SA2: u16 = 11801;
    pub(super) const SA3: u16 = 11802;   pub(super) const PR2: u16 = 11909;   pub(super) const PR4: u16 = 11910;
    pub(super) const ROT: u16 = 64001;   pub(super) const PST: u16 = 64002;   pub(super) const LCC: u16 = 64003;
}

pub(super) struct Atv312;

/// The stop that a fault's setting says; 0 ignores the fault.
fn at_fault(setting: u16) -> Stop {
    match setting {
        1 => Stop::Freewheel,
        6 => Stop::Ramp,
        7 => Stop::Fast,
        _ => Stop::Unsaid,
    }
}

fn tripped(world: &World, code: u16) -> Answer<Order> {
    let by = |address| Order::Tripped(at_fault(world.word(address, 1)));
    match code {
        5 => Answer::Says(by(at::SLL), &LINK_LOST),
        8 => Answer::Says(by(at::EPL), &EXTERNAL),
        16 => Answer::Says(by(at::OHL), &TRIPPED),
        17 => Answer::Says(by(at::OLL), &TRIPPED),
        34 => Answer::Says(by(at::COL), &TRIPPED),
        _ => Answer::Says(Order::Tripped(Stop::Unsaid), &TRIPPED),
    }
}

/// What ends a motion, or rest.
fn ended(world: &World, how: Stop) -> Order {
    if world.turning { Order::Stop(how) } else { Order::Rest }
}

fn drive(world: &World, by: Who, reverse: bool, rule: &'static Rule) -> Answer<Order> {
    let reference = match frequency::reference(world) {
        Answer::Silent(silence) => return Answer::Silent(silence),
        Answer::Says(reference, _) => reference,
    };
    match reference.negative {
        None => Answer::Silent(&OTHER_BUS_RUN),
        Some(true) if reverse => Answer::Silent(&BOTH_SIGNS),
        Some(negative) => {
            Answer::Says(Order::Drive { by, reverse: reverse != negative, tends: reference.tends }, rule)
        }
    }
}

fn by_bus(world: &World) -> Answer<Order> {
    match world.state {
        State::QuickStop => return Answer::Says(ended(world, Stop::Fast), &QUICK_STOP),
        State::OperationEnabled => {}
        State::SwitchedOn if world.turning => {
            return Answer::Says(Order::Stop(inputs::normal_stop(world)), &NO_RUN);
        }
        // L1 and L2 promise a start without the chart at switching on only
        State::SwitchOnDisabled if !channel::is_l3(world) && channel::run_word(world) => {
            return Answer::Silent(&CHART_AFTER_DISABLE);
        }
        _ => return Answer::Says(Order::Locked, &NO_SWITCH_ON),
    }
    if !channel::bus_runs(world) {
        return Answer::Says(ended(world, inputs::normal_stop(world)), &NOT_WRITTEN);
    }
    match world.spent {
        Spent::Yes => return Answer::Says(ended(world, Stop::Fast), &SPENT_RUN),
        Spent::SameWordAgain => return Answer::Silent(&SAME_WORD_AGAIN),
        Spent::No => {}
    }
    if inputs::reassigned(world, 11) && world.commanded(11) {
        return Answer::Silent(&ASSIGNED_BITS);
    }
    drive(world, Who::Bus, world.commanded(11), &RUN)
}

fn by_terminals(world: &World) -> Answer<Order> {
    if channel::is_l3(world) && world.state == State::Fault {
        return Answer::Silent(&TERMINALS_IN_L3);
    }
    match inputs::run(world) {
        Answer::Silent(silence) => Answer::Silent(silence),
        Answer::Says(None, rule) => Answer::Says(ended(world, inputs::normal_stop(world)), rule),
        Answer::Says(Some(_), _) if !channel::is_l3(world) && world.state != State::OperationEnabled => {
            Answer::Silent(&CHART_AFTER_DISABLE)
        }
        Answer::Says(Some(direction), rule) => {
            drive(world, Who::Terminals, direction == Direction::Reverse, rule)
        }
    }
}

fn by_keys(world: &World, by: Who) -> Answer<Order> {
    let rule = if by == Who::Keypad { &RUN_KEY } else { &REMOTE_KEYS };
    match world.latched {
        None => Answer::Says(ended(world, Stop::Unsaid), rule),
        Some(direction) => drive(world, by, direction == Direction::Reverse, rule),
    }
}

impl Manual for Atv312 {
    fn rules(&self) -> &'static [&'static Rule] {
        RULES
    }

    fn silences(&self) -> &'static [&'static Silence] {
        SILENCES
    }

    fn standing_run(&self) -> Option<&'static Silence> {
        Some(&CHANNEL_RETURNS)
    }

    fn is_command(&self, address: u16) -> bool {
        matches!(address, at::CMD | at::CMDD | 400)
    }

    fn commander(&self, world: &World) -> Answer<Who> {
        channel::commander(world)
    }

    fn reference(&self, world: &World) -> Answer<Reference> {
        frequency::reference(world)
    }

    fn order(&self, world: &World) -> Answer<Order> {
        if !world.mains {
            let stop = [Stop::Freewheel, Stop::Unsaid, Stop::Ramp, Stop::Fast];
            let stop = stop[usize::from(world.word(at::STP, 0).min(3))];
            return Answer::Says(Order::Stop(stop), &MAINS_LOST);
        }
        if let Some(code) = world.tripped {
            return tripped(world, code);
        }
        let by = match channel::commander(world) {
            Answer::Silent(silence) => return Answer::Silent(silence),
            Answer::Says(by, _) => by,
        };
        if let Some((stop, rule)) = inputs::stop(world, by) {
            if inputs::is_stopped_by_bits_elsewhere(world, by) {
                return Answer::Silent(&STOP_BITS_ELSEWHERE);
            }
            return Answer::Says(if world.turning { Order::Stop(stop) } else { Order::Locked }, rule);
        }
        let locks = world.written.get(&at::CMI).is_some_and(|word| word & (1 << 13 | 1 << 15) != 0);
        if locks && !world.turning {
            return Answer::Says(Order::Locked, &LOCKED_AT_REST);
        }
        let advanced = world.word(at::LAC, 0) > 0;
        if advanced && (world.word(at::LAF, 0) != 0 || world.word(at::LAR, 0) != 0) {
            return Answer::Silent(&LIMIT_SWITCHES);
        }
        if world.word(at::COP, 0) > 1 && world.regained {
            return Answer::Silent(&COPIED);
        }
        match by {
            Who::Bus => by_bus(world),
            Who::Terminals => by_terminals(world),
            Who::OtherBus => Answer::Silent(&OTHER_BUS_RUN),
            Who::Keypad | Who::RemoteTerminal => by_keys(world, by),
        }
    }

    fn step(&self, world: &World, change: &Change) -> World {
        memory::step(world, change)
    }

    fn forbids(&self, world: &World, motion: Motion) -> Option<&'static Rule> {
        if !matches!(motion, Motion::Turning { .. }) || !world.mains || world.tripped.is_some() {
            return None;
        }
        // stops of the terminals and of the STOP key go before every channel
        inputs::stop(&inputs::without_bits(world), Who::Terminals).map(|(_, rule)| rule)
    }

    fn of_itself(&self, world: &World, change: &Change) -> Option<Answer<Start>> {
        let runs = |world: &World| matches!(super::order(world), Answer::Says(Order::Drive { .. }, _));
        match change {
            Change::Wait if world.tripped.is_some() => {
                let restarts = world.word(at::ATR, 0) == 1 && inputs::by_level(world);
                let may = matches!(world.tripped, Some(5 | 8 | 13 | 16..=21 | 33 | 34));
                if !restarts || !may {
                    return Some(Answer::Says(Start::MayNot, &TRIPPED));
                }
                match channel::commander(world).said() {
                    Some(Who::Terminals) if inputs::asks(world) => {
                        Some(Answer::Says(Start::MayStart, &AUTOMATIC_RESTART))
                    }
                    Some(Who::Terminals) => Some(Answer::Says(Start::MayNot, &AUTOMATIC_RESTART)),
                    _ => Some(Answer::Silent(&RESTART_BY_BUS)),
                }
            }
            // a motor that tLS has stopped stands under a run command
            Change::Write { address: at::LFR | at::LFRD | 401, .. } | Change::Analog { .. }
                if world.word(at::TLS, 0) != 0 && !world.turning && runs(&self.step(world, change)) =>
            {
                Some(Answer::Says(Start::MayStart, &LOW_SPEED_TIME))
            }
            Change::Mains(true) if world.word(at::TUN, 0) == 115 => Some(Answer::Silent(&TUNING)),
            Change::Input { bit, closed: true }
                if !world.input(*bit) && world.word(at::TUN, 0) == 129 + u16::from(*bit) =>
            {
                Some(Answer::Silent(&TUNING))
            }
            Change::Write { address: at::TUN, .. } => Some(Answer::Silent(&TUNING)),
            _ => None,
        }
    }

    fn said_of(&self, world: &World, change: &Change) -> Vec<Answer<Effect>> {
        memory::said_of(world, change)
    }
}
