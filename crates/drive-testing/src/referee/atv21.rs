//! The Altivar 21, by S0.

mod rules;

use self::rules::*;
use super::Manual;
use super::answer::{Answer, Effect, Motion, Order, Origin, Reference, Rule, Silence, Start, Stop, Who};
use super::world::{Change, World};

const CMOD: u16 = 0x0003;
const FMOD: u16 = 0x0004;
const UL: u16 = 0x0012;
const F112: u16 = 0x0112;
/// The functions of the inputs and the bit of each in FD06.
const INPUT_FUNCTIONS: [(u16, u8); 4] = [(0x0111, 0), (F112, 1), (0x0113, 2), (0x0118, 7)];
const F110: u16 = 0x0110;
const F207: u16 = 0x0207;
const F603: u16 = 0x0603;
const F803: u16 = 0x0803;
const FA00: u16 = 0xFA00;
const FA01: u16 = 0xFA01;
const FA13: u16 = 0xFA13;

const INJECTION: u8 = 7;
const REVERSE: u8 = 9;
const RUN_BIT: u8 = 10;
const FREEWHEEL_BIT: u8 = 11;
const EMERGENCY_BIT: u8 = 12;
const RESET_BIT: u8 = 13;
const REFERENCE_BIT: u8 = 14;
const COMMAND_BIT: u8 = 15;

const ERR5: u16 = 0x18;
const E: u16 = 0x11;

pub(super) struct Atv21;

/// Whether an input with this function is on.
fn on(world: &World, function: u16) -> bool {
    INPUT_FUNCTIONS.iter().any(|&(word, bit)| world.word(word, 0) == function && world.input(bit))
}

/// A function that overrides the bus in a way that is not said.
fn forced(world: &World) -> Option<&'static Silence> {
    if on(world, 52) || on(world, 53) {
        return Some(&FORCED_FUNCTIONS);
    }
    matches!(world.word(F110, 0), 48 | 52 | 53).then_some(&F110_TERMINAL)
}

fn assigned(world: &World, function: u16) -> bool {
    INPUT_FUNCTIONS.iter().any(|&(word, _)| world.word(word, 0) == function)
}

fn at_err5(world: &World) -> Stop {
    match world.word(F603, 4) {
        0 => Stop::Freewheel,
        1 => Stop::Ramp,
        2 => Stop::Injection { tenths: None },
        _ => Stop::Unsaid,
    }
}

fn by_bus(world: &World) -> Answer<Order> {
    let ended = if world.turning { Order::Stop(Stop::Ramp) } else { Order::Rest };
    if world.command.is_none() {
        return Answer::Says(ended, &NOTHING_STANDS);
    }
    let stop = |how| if world.turning { Order::Stop(how) } else { Order::Locked };
    if world.commanded(FREEWHEEL_BIT) {
        return Answer::Says(stop(Stop::Freewheel), &FREEWHEEL);
    }
    match (world.commanded(INJECTION), world.commanded(RUN_BIT)) {
        (true, true) => Answer::Silent(&INJECTION_AND_RUN),
        (true, false) => Answer::Says(stop(Stop::Injection { tenths: None }), &FORCED_INJECTION),
        (false, false) => Answer::Says(ended, &RAMP_STOP),
        (false, true) => {
            let tends = Atv21.reference(world).said().and_then(|reference| reference.tends);
            Answer::Says(Order::Drive { by: Who::Bus, reverse: world.commanded(REVERSE), tends }, &RUN)
        }
    }
}

fn bus_reference(world: &World) -> Option<i32> {
    match (world.written.get(&FA01).copied().unwrap_or(0), world.written.get(&FA13).copied().unwrap_or(0)) {
        (hundredths, 0) => Some(i32::from(hundredths)),
        _ => None, // revolutions of a motor whose poles are not known, or two references
    }
}

fn reset(world: &mut World) {
    world.tripped = None;
    world.forget_bus();
}

impl Manual for Atv21 {
    fn rules(&self) -> &'static [&'static Rule] {
        RULES
    }

    fn silences(&self) -> &'static [&'static Silence] {
        SILENCES
    }

    fn standing_run(&self) -> Option<&'static Silence> {
        Some(&STANDING_RUN)
    }

    fn is_command(&self, address: u16) -> bool {
        address == FA00
    }

    fn commander(&self, world: &World) -> Answer<Who> {
        if world.panel.local {
            return Answer::Says(Who::Keypad, &LOC_REM);
        }
        if let Some(silence) = forced(world) {
            return Answer::Silent(silence);
        }
        if on(world, 48) {
            return Answer::Says(Who::Terminals, &FORCED_LOCAL_INPUT);
        }
        if world.commanded(COMMAND_BIT) {
            return Answer::Says(Who::Bus, &COMMAND_PRIORITY);
        }
        match world.word(CMOD, 0) {
            0 if assigned(world, 48) => Answer::Silent(&SWITCHED_BY_INPUT),
            0 => Answer::Says(Who::Terminals, &CMOD_TERMINALS),
            2 => Answer::Says(Who::Bus, &CMOD_BUS),
            _ => Answer::Says(Who::Keypad, &CMOD_KEYPAD),
        }
    }

    fn reference(&self, world: &World) -> Answer<Reference> {
        let from = |origin| Reference { origin, asks: None, negative: Some(false), tends: None };
        let bus = || {
            let asks = bus_reference(world);
            let limit = world.words.get(&UL).map_or(i32::MAX, |&limit| i32::from(limit));
            let tends = asks.filter(|&asks| asks != 0).map(|asks| asks.min(limit).unsigned_abs());
            Reference { origin: Origin::Bus, asks, negative: Some(false), tends }
        };
        if world.panel.local {
            return Answer::Says(from(Origin::Keypad), &LOC_REM);
        }
        if let Some(silence) = forced(world) {
            return Answer::Silent(silence);
        }
        if on(world, 48) {
            return Answer::Says(from(Origin::Analog(1)), &FORCED_LOCAL_INPUT);
        }
        if world.command.unwrap_or(0) & 7 != 0 {
            return Answer::Says(from(Origin::Preset), &PRESET);
        }
        let priority = world.commanded(REFERENCE_BIT);
        if on(world, 38) {
            return match (priority, world.word(F207, 0)) {
                (false, 1) => Answer::Says(from(Origin::Analog(1)), &FCHG),
                _ => Answer::Silent(&FCHG_AND_PRIORITY),
            };
        }
        if priority {
            return Answer::Says(bus(), &REFERENCE_PRIORITY);
        }
        match world.word(FMOD, 1) {
            1 if assigned(world, 48) => Answer::Silent(&SWITCHED_BY_INPUT),
            1 => Answer::Says(from(Origin::Analog(1)), &FMOD_VIA),
            4 => Answer::Says(bus(), &FMOD_BUS),
            2 => Answer::Says(from(Origin::Analog(2)), &FMOD_LIST),
            5 => Answer::Says(from(Origin::UpDown), &FMOD_LIST),
            _ => Answer::Says(from(Origin::Keypad), &FMOD_LIST),
        }
    }

    fn order(&self, world: &World) -> Answer<Order> {
        if !world.mains {
            return Answer::Says(Order::Locked, &UNDERVOLTAGE);
        }
        if let Some(code) = world.tripped {
            let stop = if code == ERR5 { at_err5(world) } else { Stop::Unsaid };
            let rule = if code == ERR5 { &TIME_OUT } else { &TRIPPED };
            return Answer::Says(Order::Tripped(stop), rule);
        }
        match self.commander(world) {
            Answer::Silent(silence) => Answer::Silent(silence),
            Answer::Says(Who::Bus, _) => by_bus(world),
            Answer::Says(Who::Keypad, _) => Answer::Silent(&KEYPAD_RUN),
            Answer::Says(..) if on(world, 48) => Answer::Silent(&LOCAL_INPUT_LEVELS),
            Answer::Says(..) => Answer::Silent(&TERMINAL_RUN),
        }
    }

    fn step(&self, world: &World, change: &Change) -> World {
        let mut after = world.clone();
        after.note(change);
        match *change {
            Change::Write { address: FA00, value } | Change::Broadcast { address: FA00, value } => {
                let broadcast = matches!(change, Change::Broadcast { .. });
                after.take_command(value, broadcast);
                if after.commanded(EMERGENCY_BIT) {
                    after.tripped = Some(E);
                    after.cause = false;
                } else if after.commanded(RESET_BIT)
                    && world.command.unwrap_or(0) >> RESET_BIT & 1 == 0
                    && world.tripped.is_some()
                    && !world.cause
                {
                    if self.commander(&after).said() == Some(Who::Bus) {
                        reset(&mut after);
                    } else {
                        after.unsure = Some(&RESET_WITHOUT_COMMAND);
                    }
                }
            }
            Change::Write { address, value } | Change::Broadcast { address, value } => {
                let words = if address >= 0xFA00 { &mut after.written } else { &mut after.words };
                words.insert(address, value);
            }
            Change::Key { key: super::Key::Reset, held: true } if world.tripped.is_some() => {
                after.unsure = Some(&RESET_BY_PANEL);
            }
            Change::Link(false) if world.word(F803, 3) != 0 => {
                after.tripped = Some(ERR5);
                after.cause = true;
            }
            Change::Link(true) if world.tripped == Some(ERR5) => after.cause = false,
            Change::Mains(on) => {
                after.forget_bus();
                after.unsure = None;
                if on {
                    after.tripped = None;
                }
            }
            _ => {}
        }
        after
    }

    fn forbids(&self, world: &World, motion: Motion) -> Option<&'static Rule> {
        let driven = matches!(motion, Motion::Turning { .. });
        (driven && !world.mains).then_some(&UNDERVOLTAGE)
    }

    fn of_itself(&self, world: &World, change: &Change) -> Option<Answer<Start>> {
        (*change == Change::Wait && world.mains && world.tripped.is_some()).then_some(Answer::Silent(&RETRY))
    }

    fn said_of(&self, world: &World, change: &Change) -> Vec<Answer<Effect>> {
        let mut all = Vec::new();
        let (Change::Write { address: FA00, value } | Change::Broadcast { address: FA00, value }) = *change
        else {
            return all;
        };
        for (bit, rule) in [(COMMAND_BIT, &COMMAND_PRIORITY), (REFERENCE_BIT, &REFERENCE_PRIORITY)] {
            match (value >> bit & 1 == 1, world.commanded(bit)) {
                (true, false) => all.push(Answer::Says(Effect::Takes, rule)),
                (false, true) => all.push(Answer::Says(Effect::Releases, rule)),
                _ => {}
            }
        }
        if value >> EMERGENCY_BIT & 1 == 1 {
            all.push(Answer::Says(Effect::Trips, &EMERGENCY));
        } else if value >> RESET_BIT & 1 == 1 && world.tripped.is_some() {
            let after = self.step(world, change);
            all.push(match after.unsure {
                Some(silence) => Answer::Silent(silence),
                None if after.tripped.is_none() => Answer::Says(Effect::Resets, &RESET),
                None => Answer::Says(Effect::Nothing, &RESET),
            });
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::referee::{Family, Key, Verdict, commander, effects, explains, order, reference, starts_by};

    fn write(address: u16, value: u16) -> Change {
        Change::Write { address, value }
    }

    fn bus() -> World {
        World::switched_on(Family::Atv21, [(CMOD, 2), (FMOD, 4)].into())
    }

    const SIXTY: Motion = Motion::Turning { reverse: false, tends: Some(6000) };

    #[test]
    fn c400_runs_forward_by_the_bus_whatever_cmod_and_fmod_are() {
        // S0 §8.4 p.31, and the block write of §7.8 p.24: C400h and 1770h = 60 Hz
        let world = World::factory(Family::Atv21).after(&[write(FA00, 0xC400), write(FA01, 0x1770)]);
        assert_eq!(commander(&world).said(), Some(Who::Bus));
        assert_eq!(explains(&world, SIXTY), Verdict::Must);
        assert_eq!(explains(&world, Motion::Turning { reverse: true, tends: None }), Verdict::MustNot);
    }

    #[test]
    fn without_priority_and_with_cmod_0_the_same_run_bit_is_not_a_command() {
        // S0 §6.2 p.14
        let world = World::factory(Family::Atv21).after(&[write(FA00, 0x0400)]);
        assert_eq!(commander(&world).said(), Some(Who::Terminals));
    }

    #[test]
    fn bit_9_turns_the_motor_round() {
        // S0 §8.4 p.31: 0600h is reverse with CMOD and FMOD on the serial link
        let world = bus().after(&[write(FA01, 8000), write(FA00, 0x0600)]);
        assert_eq!(explains(&world, Motion::Turning { reverse: true, tends: Some(8000) }), Verdict::Must);
    }

    #[test]
    fn emergency_stop_trips_even_while_the_terminals_command() {
        // S0 §8.4 p.31
        let world = World::factory(Family::Atv21).after(&[write(FA00, 0x1000)]);
        assert_eq!(world.tripped, Some(E));
        assert_eq!(explains(&world, SIXTY), Verdict::MustNot);
    }

    #[test]
    fn the_reset_of_a_trip_forgets_the_run_command_the_reference_and_the_priorities() {
        // S0 §8.2 p.28: initial values come back at a reset after a trip
        let tripped = World::factory(Family::Atv21).after(&[
            write(FA01, 6000),
            write(FA00, 0xC400),
            Change::Trip(0x0C),
            Change::CauseGone,
        ]);
        let reset = tripped.after(&[write(FA00, 0xE400)]);
        assert_eq!((reset.tripped, reset.command, reset.written.get(&FA01)), (None, None, None));
        assert_eq!(commander(&reset).said(), Some(Who::Terminals));
    }

    #[test]
    fn loc_rem_takes_control_from_the_bus_and_its_return_is_left_open() {
        // S0 §6.2 p.12
        let running = bus().after(&[write(FA01, 6000), write(FA00, 0x0400)]);
        let local = running.after(&[Change::Key { key: Key::Local, held: true }]);
        assert_eq!(commander(&local).said(), Some(Who::Keypad));
        assert_eq!(starts_by(&local, &Change::Key { key: Key::Local, held: false }), Start::ManualSilent);
    }

    #[test]
    fn an_input_with_function_48_hands_control_to_the_terminals_while_it_is_on() {
        // S0 §6.2 p.15
        let world = World::switched_on(Family::Atv21, [(F112, 48)].into());
        let on = world.after(&[Change::Input { bit: 1, closed: true }, write(FA00, 0xC400)]);
        assert_eq!(commander(&on).said(), Some(Who::Terminals));
        assert_eq!(commander(&on.after(&[Change::Input { bit: 1, closed: false }])).said(), Some(Who::Bus));
        assert!(commander(&world).is_silent());
    }

    #[test]
    fn the_input_fchg_turns_the_reference_to_via_and_back() {
        // S0 §6.2 p.16
        let world = World::switched_on(Family::Atv21, [(CMOD, 2), (FMOD, 4), (F207, 1), (F112, 38)].into());
        assert_eq!(reference(&world).said().map(|reference| reference.origin), Some(Origin::Bus));
        let on = world.after(&[Change::Input { bit: 1, closed: true }]);
        assert_eq!(reference(&on).said().map(|reference| reference.origin), Some(Origin::Analog(1)));
    }

    #[test]
    fn a_preset_speed_counts_before_every_reference() {
        // S0 §8.4 p.31
        let world = bus().after(&[write(FA01, 6000), write(FA00, 0x0403)]);
        assert_eq!(reference(&world).said().map(|reference| reference.origin), Some(Origin::Preset));
    }

    #[test]
    fn silence_on_the_line_trips_also_a_drive_that_the_terminals_command() {
        // S0 §6.4 p.19: F803 = 3 s as delivered
        let world = World::factory(Family::Atv21).after(&[Change::Link(false)]);
        assert_eq!(order(&world).said(), Some(Order::Tripped(Stop::Unsaid)));
        let off = World::switched_on(Family::Atv21, [(F803, 0)].into()).after(&[Change::Link(false)]);
        assert_eq!(off.tripped, None);
    }

    #[test]
    fn a_return_of_the_mains_finds_no_run_command_of_the_bus() {
        // S0 §8.2 p.28
        let running = bus().after(&[write(FA01, 6000), write(FA00, 0x0400)]);
        let off = running.after(&[Change::Mains(false)]);
        assert_eq!(starts_by(&off, &Change::Mains(true)), Start::MayNot);
    }

    #[test]
    fn a_write_of_freewheel_lets_a_driven_motor_coast() {
        // S0 §8.4 p.31
        let mut running = bus().after(&[write(FA01, 6000), write(FA00, 0x0400)]);
        running.turning = true;
        let all = effects(&running, &write(FA00, 0x0800));
        assert_eq!(all.last().and_then(|effect| effect.said()), Some(Effect::Stops(Stop::Freewheel)));
    }
}
