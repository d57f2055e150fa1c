//! The Omron 3G3EV MODBUS, by S1.

mod rules;

use self::rules::*;
use super::Manual;
use super::answer::{Answer, Effect, Motion, Order, Origin, Reference, Rule, Silence, Start, Stop, Who};
use super::world::{Change, World};

const COMMAND: u16 = 0x0001;
const REFERENCE: u16 = 0x0002;
const ENTER_REGISTER: u16 = 0x0900;
const N02: u16 = 0x0102;
const N05: u16 = 0x0105;
const N39: u16 = 0x0127;
const N40: u16 = 0x0128;

const EXTERNAL_FAULT_BIT: u8 = 4;
const RESET_BIT: u8 = 5;
/// Bits of a command to one drive whose meaning n06 to n08 give.
const FUNCTIONS: u16 = 0x0070;
/// The fault bit of EF0 in 0021h and of the time-over.
const EF: u16 = 1 << 7;
const BUS: u16 = 1 << 14;

/// Settings that act after the supply was cut and restored.
const AFTER_POWER: [u16; 8] = [N02, N39, N40, 0x013F, 0x0140, 0x0141, 0x0142, 0x0143];

pub(super) struct Omron3g3ev;

/// Hundredths of a hertz.
fn bus_reference(world: &World) -> Option<i32> {
    let word = i32::from(world.written.get(&REFERENCE).copied().unwrap_or(0));
    match world.word(N39, 0) {
        _ if world.reference_broadcast => None, // a share of an unknown full scale
        0 => Some(word * 10),
        1 => Some(word / 10 * 10),
        _ => None,
    }
}

impl Manual for Omron3g3ev {
    fn rules(&self) -> &'static [&'static Rule] {
        RULES
    }

    fn silences(&self) -> &'static [&'static Silence] {
        SILENCES
    }

    fn standing_run(&self) -> Option<&'static Silence> {
        None
    }

    fn is_command(&self, address: u16) -> bool {
        address == COMMAND
    }

    fn commander(&self, world: &World) -> Answer<Who> {
        match world.word(N02, 5) {
            2 | 5 => Answer::Says(Who::Bus, &N02_BUS),
            1 | 4 => Answer::Says(Who::Terminals, &N02_TERMINALS),
            0 | 3 => Answer::Says(Who::Keypad, &N02_KEYPAD),
            _ => Answer::Silent(&ROW_3),
        }
    }

    fn reference(&self, world: &World) -> Answer<Reference> {
        match world.word(N02, 5) {
            4 | 5 => {
                let asks = bus_reference(world);
                let tends = asks.filter(|&asks| asks != 0).map(i32::unsigned_abs);
                let rule = if asks.is_some() { &UNIT } else { &REFERENCE_BUS };
                let reference = Reference { origin: Origin::Bus, asks, negative: Some(false), tends };
                Answer::Says(reference, rule)
            }
            3 => Answer::Silent(&ROW_3),
            _ => {
                let reference =
                    Reference { origin: Origin::Keypad, asks: None, negative: Some(false), tends: None };
                Answer::Says(reference, &REFERENCE_KEYPAD)
            }
        }
    }

    fn order(&self, world: &World) -> Answer<Order> {
        if !world.mains {
            return Answer::Says(Order::Locked, &UNDERVOLTAGE);
        }
        match world.tripped {
            Some(BUS) => return Answer::Silent(&LINK_LOST),
            Some(_) => return Answer::Says(Order::Tripped(Stop::Unsaid), &FAULT),
            None => {}
        }
        match self.commander(world) {
            Answer::Says(Who::Bus, _) => {}
            Answer::Says(Who::Terminals, _) => return Answer::Silent(&TERMINAL_RUN),
            Answer::Says(..) => return Answer::Silent(&KEYPAD_RUN),
            Answer::Silent(silence) => return Answer::Silent(silence),
        }
        let Some(word) = world.command else {
            return Answer::Says(Order::Rest, &WAITING);
        };
        if !world.command_broadcast && word & FUNCTIONS != 0 {
            return Answer::Silent(&FUNCTION_BITS);
        }
        if word & 1 == 0 {
            let order = if world.turning { Order::Stop(Stop::Unsaid) } else { Order::Rest };
            return Answer::Says(order, &STOP);
        }
        let reverse = word & 2 != 0;
        if reverse && world.word(N05, 0) == 1 {
            return Answer::Silent(&REVERSE_FORBIDDEN);
        }
        let tends = self.reference(world).said().and_then(|reference| reference.tends);
        Answer::Says(Order::Drive { by: Who::Bus, reverse, tends }, &RUN)
    }

    fn step(&self, world: &World, change: &Change) -> World {
        let mut after = world.clone();
        after.note(change);
        match *change {
            Change::Write { address: COMMAND, value } => {
                after.take_command(value, false);
                if value & FUNCTIONS != 0 && world.tripped.is_some() {
                    after.unsure = Some(&FUNCTION_BITS);
                }
            }
            Change::Broadcast { address: COMMAND, value } => {
                after.take_command(value, true);
                if self.commander(world).said() != Some(Who::Bus) {
                    after.unsure = Some(&BROADCAST_NOT_COMMANDED);
                } else if value >> EXTERNAL_FAULT_BIT & 1 == 1 {
                    after.tripped = Some(EF);
                    after.cause = false;
                } else if value >> RESET_BIT & 1 == 1 && world.tripped.is_some() && !world.cause {
                    after.tripped = None;
                    if value & 1 == 1 {
                        after.unsure = Some(&RESET_AND_RUN);
                    }
                }
            }
            Change::Write { address: REFERENCE, value } => {
                after.reference_broadcast = false;
                after.written.insert(REFERENCE, value);
            }
            Change::Broadcast { address: REFERENCE, value } => {
                after.reference_broadcast = true;
                after.written.insert(REFERENCE, value);
            }
            Change::Write { address: ENTER_REGISTER, .. } => {
                let mut stored = world.words.clone();
                stored.extend(&world.pending);
                after.stored = Some(stored);
            }
            Change::Write { address, value } if AFTER_POWER.contains(&address) => {
                after.stored.get_or_insert_with(|| world.words.clone());
                after.pending.insert(address, value);
            }
            Change::Write { address, value } => {
                after.stored.get_or_insert_with(|| world.words.clone());
                after.words.insert(address, value);
            }
            Change::Key { key: super::Key::Reset, held: true } if world.tripped.is_some() => {
                after.unsure = Some(&FAULT_AND_RUN);
            }
            Change::Link(false) if world.word(N40, 0) == 0 => {
                after.tripped = Some(BUS);
                after.cause = true;
            }
            Change::Link(true) if world.tripped == Some(BUS) => after.cause = false,
            Change::Mains(false) => {
                after.forget_bus();
                after.unsure = None;
            }
            Change::Mains(true) => {
                after.forget_bus();
                after.tripped = None;
                after.pending.clear();
                if let Some(stored) = after.stored.take() {
                    after.words = stored;
                }
            }
            _ => {}
        }
        after
    }

    fn forbids(&self, world: &World, motion: Motion) -> Option<&'static Rule> {
        match motion {
            Motion::Turning { .. } if !world.mains => Some(&UNDERVOLTAGE),
            Motion::Turning { reverse: true, .. } if world.word(N05, 0) == 1 => Some(&NO_REVERSE),
            _ => None,
        }
    }

    fn of_itself(&self, world: &World, change: &Change) -> Option<Answer<Start>> {
        (*change == Change::Wait && world.mains && world.tripped.is_some())
            .then_some(Answer::Silent(&RESTART))
    }

    fn said_of(&self, world: &World, change: &Change) -> Vec<Answer<Effect>> {
        let mut all = Vec::new();
        match *change {
            Change::Broadcast { address: COMMAND, value } => {
                if value >> EXTERNAL_FAULT_BIT & 1 == 1 {
                    all.push(Answer::Says(Effect::Trips, &EXTERNAL_FAULT));
                } else if value >> RESET_BIT & 1 == 1 && world.tripped.is_some() {
                    all.push(Answer::Says(Effect::Resets, &RESET));
                }
            }
            Change::Write { address: ENTER_REGISTER, .. } => {
                all.push(Answer::Says(Effect::Saves, &ENTER));
            }
            Change::Write { address, .. } if AFTER_POWER.contains(&address) => {
                all.push(Answer::Says(Effect::Nothing, &POWER_CYCLE));
            }
            _ => {}
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::referee::{Family, Verdict, commander, effects, explains, order, reference, starts_by};

    fn write(address: u16, value: u16) -> Change {
        Change::Write { address, value }
    }

    fn broadcast(value: u16) -> Change {
        Change::Broadcast { address: COMMAND, value }
    }

    fn drive() -> World {
        World::factory(Family::Omron3g3ev)
    }

    const SIXTY: Motion = Motion::Turning { reverse: false, tends: Some(6000) };

    #[test]
    fn the_printed_write_of_two_registers_runs_forward_at_60_hz() {
        // S1 §4.3.2 p.15: 0001h = 0001, 0002h = 0258
        let world = drive().after(&[write(COMMAND, 1), write(REFERENCE, 0x0258)]);
        assert_eq!(explains(&world, SIXTY), Verdict::Must);
    }

    #[test]
    fn the_printed_broadcast_runs_every_drive() {
        // S1 §6 p.21: 0010 0001 0001 02 0001
        let world = drive().after(&[write(REFERENCE, 0x0258)]);
        assert_eq!(starts_by(&world, &broadcast(1)), Start::MayStart);
    }

    #[test]
    fn a_broadcast_reset_without_the_run_bit_stops_the_drives_that_ran() {
        // S1 §5.1 p.17: bits 0, 4 and 5 stand in one register
        let mut world = drive().after(&[write(REFERENCE, 600), write(COMMAND, 1)]);
        world.turning = true;
        let all = effects(&world, &broadcast(0x0020));
        assert_eq!(all.last().and_then(|effect| effect.said()), Some(Effect::Stops(Stop::Unsaid)));
    }

    #[test]
    fn bit_4_trips_all_drives_by_broadcast_and_means_n06_to_one() {
        // S1 §5.1 p.17
        assert_eq!(drive().after(&[broadcast(0x0010)]).tripped, Some(EF));
        assert!(order(&drive().after(&[write(COMMAND, 0x0010)])).is_silent());
    }

    #[test]
    fn the_second_decimal_of_a_reference_is_dropped() {
        // S1 §2.1 p.6, note 1
        let world =
            World::switched_on(Family::Omron3g3ev, [(N39, 1)].into()).after(&[write(REFERENCE, 5019)]);
        assert_eq!(reference(&world).said().and_then(|reference| reference.asks), Some(5010));
    }

    #[test]
    fn n02_acts_after_enter_and_a_power_cycle_only() {
        // S1 §2.1 p.6 note 3, §4.5 p.16
        let cycle = [Change::Mains(false), Change::Mains(true)];
        let written = drive().after(&[write(N02, 1)]);
        assert_eq!(commander(&written).said(), Some(Who::Bus));
        assert_eq!(commander(&written.after(&cycle)).said(), Some(Who::Bus));
        let stored = written.after(&[write(ENTER_REGISTER, 0)]).after(&cycle);
        assert_eq!(commander(&stored).said(), Some(Who::Terminals));
    }

    #[test]
    fn reverse_is_never_explained_where_n05_forbids_it() {
        // S1 §5.3 p.20, OP6
        let world = World::switched_on(Family::Omron3g3ev, [(N05, 1)].into()).after(&[write(COMMAND, 3)]);
        let reverse = Motion::Turning { reverse: true, tends: None };
        assert_eq!(explains(&world, reverse), Verdict::MustNot);
        assert_eq!(explains(&world, SIXTY), Verdict::Silent);
    }

    #[test]
    fn bit_1_alone_is_no_run_command() {
        // S1 §5.1 p.17
        assert_eq!(order(&drive().after(&[write(COMMAND, 2)])).said(), Some(Order::Rest));
    }
}
