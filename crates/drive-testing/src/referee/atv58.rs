//! The Altivar 58 with the card VW3-A58303, by S3. Nearly everything that moves its motor stands in another manual.

use super::answer::{
    Answer, Effect, Mark, Order, Origin, Reference, Rule, Silence, Stop, Who, rules, silences,
};
use super::drivecom::{self, RUN as RUN_BITS, State};
use super::world::{Change, World};
use super::{Family, Manual};

const CMD: u16 = 400;
const REFERENCE_WORD: u16 = 401;

rules! { Atv58 RULES
    REFERENCE A "S3 p.10, p.34 (W401)" "W401 is the frequency reference, a number with sign";
    SHUTDOWN A "S3 p.21, p.45 (write of 6 and 500 to W400 and W401)" "6 in W400 with the reference in W401: the printed command";
    CHART B "register facts §5.3 (0006, 0007, 000F; weak)" "W400 leads through the chart by 6, 7 and 15";
    OFF B "register facts §5.3 (weak)" "outside operation enabled the bus does not run the motor";
    TOLD A "S3 p.4, p.28" "the drive is commanded by the bus, as whoever filled in the world knows";
    FAULT A "S3 p.24, p.48" "the drive reports a fault";
    SPECIFIC A "S3 p.13, p.37 (request F2)" "one UNI-TELWAY request carries CMD, reference, acceleration and deceleration together";
}

silences! { Atv58 SILENCES
    COMMANDER "S3 p.10, p.34 (\"Internal communication variables\" is named)" "who commands: how local and line are configured, and which input hands over"
        => "believes the bit that the map names for the line; resets no fault while local control is forced, or where the map names no such bit";
    TERMINAL_RUN "S3 p.34" "what terminals, keypad and forced local do"
        => "believes the bit that the map names for the line; a run is judged by chart, output and reference";
    HIGH_BITS "S3 p.34" "what bits 4 to 15 of W400 mean: reverse, stops, reset"
        => "writes bits 7 and 11 only, the latter as the map says";
    UNITS "S3 p.10, p.34 (W401)" "the unit of W401, and what its sign does to the direction"
        => "takes both as the map says; starts nothing at a negative W401, and a setpoint leaves the sign of a motor that runs";
    LIMITS "S3 p.12, p.36 (W250 to W253 are read)" "the lowest and the highest frequency, and whether a run at 0 turns the motor"
        => "reads the words that the map names; where there are none, no limit is checked";
    STOP_MODE "S3 p.34" "how the motor stops at a disable operation, a shutdown and a quick stop"
        => "told at rest only once it was seen to come down; else it may coast, as after a trip amid a stop";
    TIME_OUT "S3 p.24, p.48 (note on the lamps)" "10 s without a message, 1 s in ASCII, is a communication fault of the card: what the motor does, and whether it goes on when messages come back"
        => "tells the time and no reaction";
    MAINS "S3 p.33" "the state at switching on, and what stands in W400 then"
        => "a lease ends only where the drive no longer holds the word";
    RESET "S3 p.34" "how a fault is reset from the bus, and whether a run that stands starts then"
        => "the edge of bit 7 once, then 0000h: nothing of this side stands behind it";
    RESTART "S3 p.34" "automatic restart and flying restart"
        => "knows no register for it: a lease ends only where the drive no longer holds the word";
    LISTEN_ONLY "S3 p.19, p.43 (08/04)" "whether a drive in listen only mode trips for want of messages that it does not process"
        => "enters that mode only by a method of its name, which says that the card takes no stop then";
    BROADCAST "S3 p.18, p.42" "whether a broadcast command reaches a drive that others command"
        => "confirms each drive by itself";
}

pub(super) struct Atv58;

impl Manual for Atv58 {
    fn rules(&self) -> &'static [&'static Rule] {
        RULES
    }

    fn silences(&self) -> &'static [&'static Silence] {
        SILENCES
    }

    fn standing_run(&self) -> Option<&'static Silence> {
        Some(&COMMANDER)
    }

    fn is_command(&self, address: u16) -> bool {
        address == CMD
    }

    fn commander(&self, world: &World) -> Answer<Who> {
        world.told.map_or(Answer::Silent(&COMMANDER), |who| Answer::Says(who, &TOLD))
    }

    fn reference(&self, world: &World) -> Answer<Reference> {
        if world.told != Some(Who::Bus) {
            return Answer::Silent(&COMMANDER);
        }
        let word = world.written.get(&REFERENCE_WORD).copied().unwrap_or(0) as i16;
        let reference = Reference { origin: Origin::Bus, asks: None, negative: Some(word < 0), tends: None };
        Answer::Says(reference, &REFERENCE)
    }

    fn order(&self, world: &World) -> Answer<Order> {
        if !world.mains {
            return Answer::Silent(&MAINS);
        }
        if world.tripped.is_some() {
            return Answer::Says(Order::Tripped(Stop::Unsaid), &FAULT);
        }
        match world.told {
            Some(Who::Bus) => {}
            Some(_) => return Answer::Silent(&TERMINAL_RUN),
            None => return Answer::Silent(&COMMANDER),
        }
        let word = world.command.unwrap_or(0);
        if word & !RUN_BITS != 0 {
            return Answer::Silent(&HIGH_BITS);
        }
        let stop = if world.turning { Order::Stop(Stop::Unsaid) } else { Order::Locked };
        match world.state {
            State::Unknown => Answer::Silent(&MAINS),
            State::OperationEnabled => match self.reference(world).said().and_then(|given| given.negative) {
                Some(false) => {
                    Answer::Says(Order::Drive { by: Who::Bus, reverse: false, tends: None }, &CHART)
                }
                _ => Answer::Silent(&UNITS),
            },
            _ => Answer::Says(stop, &OFF),
        }
    }

    fn step(&self, world: &World, change: &Change) -> World {
        let mut after = world.clone();
        after.note(change);
        match *change {
            Change::Write { address: CMD, value } | Change::Broadcast { address: CMD, value } => {
                let broadcast = matches!(change, Change::Broadcast { .. });
                if broadcast && world.told != Some(Who::Bus) {
                    after.unsure = Some(&BROADCAST);
                }
                let before = world.command.unwrap_or(0);
                after.take_command(value, broadcast);
                if world.state == State::Fault && value & !RUN_BITS != 0 {
                    after.unsure = Some(&RESET);
                } else {
                    after.state = drivecom::after(world.state, before, value, world.cause);
                }
            }
            Change::Write { address: REFERENCE_WORD, value }
            | Change::Broadcast { address: REFERENCE_WORD, value } => {
                after.written.insert(REFERENCE_WORD, value);
            }
            Change::Write { address, value } | Change::Broadcast { address, value } => {
                after.words.insert(address, value);
            }
            Change::Link(false) => after.unsure = Some(&TIME_OUT),
            Change::Wait if world.tripped.is_some() => after.unsure = Some(&RESTART),
            Change::Input { .. } | Change::Key { .. } => after.unsure = Some(&TERMINAL_RUN),
            Change::Trip(_) => after.state = State::Fault,
            Change::Mains(on) => {
                after.forget_bus();
                after.unsure = None;
                if on {
                    after.tripped = None;
                    after.state = State::Unknown;
                }
            }
            _ => {}
        }
        after
    }

    fn said_of(&self, _: &World, _: &Change) -> Vec<Answer<Effect>> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::referee::{Motion, Start, Verdict, explains, order, starts_by};

    fn write(address: u16, value: u16) -> Change {
        Change::Write { address, value }
    }

    /// A drive of which it is known that the bus commands it.
    fn by_bus() -> World {
        World { told: Some(Who::Bus), ..World::factory(Family::Atv58) }
    }

    const FORWARD: Motion = Motion::Turning { reverse: false, tends: None };

    #[test]
    fn the_printed_write_of_6_and_500_does_not_turn_the_motor() {
        // S3 p.21: 02 10 0190 0002 04 0006 01F4
        let world = by_bus().after(&[write(CMD, 0), write(CMD, 6), write(REFERENCE_WORD, 500)]);
        assert_eq!(world.state, State::Ready);
        assert_eq!(explains(&world, FORWARD), Verdict::MustNot);
    }

    #[test]
    fn six_seven_and_fifteen_run_it_and_any_higher_bit_is_left_open() {
        // register facts §5.3
        let ready =
            by_bus().after(&[write(CMD, 0), write(REFERENCE_WORD, 500), write(CMD, 6), write(CMD, 7)]);
        assert_eq!(starts_by(&ready, &write(CMD, 15)), Start::MayStart);
        assert!(order(&ready.after(&[write(CMD, 0x080F)])).is_silent());
    }

    #[test]
    fn nothing_is_said_of_a_drive_of_which_nobody_knows_who_commands_it() {
        // S3 p.10
        let world = World::factory(Family::Atv58).after(&[write(CMD, 0), write(CMD, 6), write(CMD, 15)]);
        assert_eq!(explains(&world, FORWARD), Verdict::Silent);
    }

    #[test]
    fn what_the_motor_does_without_messages_is_left_open() {
        // S3 p.24: the lamps speak of a communication fault after 10 s
        assert!(order(&by_bus().after(&[write(CMD, 0), Change::Link(false)])).is_silent());
    }
}
