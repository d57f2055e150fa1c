//! The Altivar 28, by S2 and by the table of its addresses in the manual of its successor.

use super::answer::{
    Answer, Effect, Mark, Order, Origin, Reference, Rule, Silence, Stop, Who, rules, silences,
};
use super::drivecom::{self, RUN as RUN_BITS, State};
use super::world::{Change, World};
use super::{Family, Manual};

const CMD: u16 = 400;
const LFR: u16 = 401;
const CMI: u16 = 402;
const HSP: u16 = 250;
const LSP: u16 = 251;
const LCC: u16 = 991;

rules! { Atv28 RULES
    RUN A "S2 p.12 (write of 15 and 200 to W400 and W401)" "15 in W400 with the reference in W401: the printed command";
    CHART B "BBV p.57, p.35 (L1 is interchangeable with ATV28), p.10 to p.12" "W400 is CMD: its bits 0 to 3 and 7 lead through the chart";
    SWITCHED_ON B "BBV p.11, p.35" "at switching on in operation enabled, by the terminals; a run command starts without the chart";
    HIGH_BITS B "BBV p.19 (L1), p.57" "bit 11 reverse, bit 12 stop, bit 13 DC injection, bit 14 fast stop";
    REFERENCE B "S2 p.12, BBV p.57 (401 is LFr)" "W401 is the reference, signed, 0.1 Hz";
    LIMITS B "BBV p.57 (250 HSP, 251 LSP), p.27" "the output stays between LSP and HSP";
    OFF B "BBV p.11, p.57" "outside operation enabled the drive is locked";
    FAULT B "BBV p.11, p.57" "a detected fault locks the drive";
    REMOTE B "BBV p.57 (991 LCC), p.38" "LCC = 1: the remote terminal commands";
    TOLD B "BBV p.22 (ETI), p.57 (459)" "the drive itself tells who controls it";
}

silences! { Atv28 SILENCES
    TERMINAL_RUN "S2 (variables manual named on p.4); BBV p.57" "which inputs run and stop the motor, level or edge (tCt has no address), at which reference"
        => "resets no fault and writes neither tCC nor LCC while any input LI1 to LI6 is closed, or where IOLR is not there";
    PRIORITIES "S2 p.4; BBV p.11" "which of terminals and bus has priority when both have commanded"
        => "believes ETI and ETA bit 9, in each status";
    STOP_INPUTS "BBV p.57" "fast stop, DC injection and freewheel by inputs: no address says whether one is assigned, so an open input may stop or lock"
        => "believes ETI bits 5 and 12 and the chart: a run is not in force while one of them acts";
    AFTER_DISABLE "BBV p.11, p.35" "whether 15 starts again at once after W400 was 0, without the chart"
        => "climbs the chart, and waits until the motor turns";
    TIME_OUT "S2 p.8 to p.12" "whether the drive watches the line, how long, and what the motor does"
        => "arms nothing: the watchdog is unsupported";
    MAINS "S2 p.4" "what the motor does at a loss and at a return of the mains, and what stands in W400 then"
        => "reads CMD before it believes it; a lease ends only where the drive no longer holds the word";
    RESTART "S2 p.4" "automatic restart after a fault, and flying restart"
        => "knows no register for it: a motor that runs again without a start of this side is in no status told as this side's";
    REMOTE_KEYS "BBV p.38" "what stands at the remote terminal"
        => "believes ETI: under the remote terminal a run is not in force, and a start is refused";
    BOTH_SIGNS "S2 p.12" "reverse command with a negative reference"
        => "starts nothing at a negative reference; a setpoint leaves the sign of a motor that runs";
    STOP_MODE "BBV p.57" "how a normal stop comes down: Stt has no address"
        => "takes 100Fh for a ramp: told at rest only once it was seen to come down; a trip or a lock amid it may coast";
    EXTENDED "BBV p.57 (402 CMI)" "which bits CMI has on an ATV28"
        => "never writes CMI";
    BROADCAST "S2 p.9, p.11" "whether a broadcast command reaches a drive that the terminals command"
        => "confirms each drive by itself";
}

pub(super) struct Atv28;

fn run_word(world: &World) -> bool {
    world.command.is_some_and(|word| word & RUN_BITS == RUN_BITS)
}

fn by_bus(world: &World) -> Answer<Order> {
    let ended = |how| if world.turning { Order::Stop(how) } else { Order::Rest };
    match world.state {
        State::QuickStop => return Answer::Says(ended(Stop::Fast), &CHART),
        State::OperationEnabled if run_word(world) => {}
        State::OperationEnabled | State::SwitchedOn => return Answer::Says(ended(Stop::Unsaid), &CHART),
        _ if run_word(world) => return Answer::Silent(&AFTER_DISABLE),
        _ => return Answer::Says(Order::Locked, &OFF),
    }
    let stops = [(14, Stop::Fast), (13, Stop::Injection { tenths: None }), (12, Stop::Unsaid)];
    let asked: Vec<_> = stops.iter().filter(|&&(bit, _)| world.commanded(bit)).collect();
    match asked.as_slice() {
        [] => {}
        [(_, one)] => return Answer::Says(ended(*one), &HIGH_BITS),
        _ => return Answer::Says(ended(Stop::Unsaid), &HIGH_BITS),
    }
    let Answer::Says(reference, _) = Atv28.reference(world) else {
        return Answer::Silent(&TERMINAL_RUN);
    };
    let reverse = world.commanded(11);
    match reference.negative {
        Some(true) if reverse => Answer::Silent(&BOTH_SIGNS),
        negative => {
            let reverse = reverse != (negative == Some(true));
            Answer::Says(Order::Drive { by: Who::Bus, reverse, tends: reference.tends }, &RUN)
        }
    }
}

impl Manual for Atv28 {
    fn rules(&self) -> &'static [&'static Rule] {
        RULES
    }

    fn silences(&self) -> &'static [&'static Silence] {
        SILENCES
    }

    fn standing_run(&self) -> Option<&'static Silence> {
        Some(&PRIORITIES)
    }

    fn is_command(&self, address: u16) -> bool {
        address == CMD
    }

    fn commander(&self, world: &World) -> Answer<Who> {
        if let Some(who) = world.told {
            return Answer::Says(who, &TOLD);
        }
        if world.word(LCC, 0) == 1 {
            return Answer::Says(Who::RemoteTerminal, &REMOTE);
        }
        match (world.command, world.inputs) {
            (None, _) => Answer::Says(Who::Terminals, &SWITCHED_ON),
            (Some(_), 0) => Answer::Says(Who::Bus, &SWITCHED_ON),
            (Some(_), _) => Answer::Silent(&PRIORITIES),
        }
    }

    fn reference(&self, world: &World) -> Answer<Reference> {
        if self.commander(world).said() != Some(Who::Bus) {
            return Answer::Silent(&TERMINAL_RUN);
        }
        let asks = i32::from(world.written.get(&LFR).copied().unwrap_or(0) as i16) * 10;
        let high = i32::from(world.word(HSP, 500)) * 10;
        let low = i32::from(world.word(LSP, 0)) * 10;
        let tends = asks.abs().min(high).max(low);
        let rule = if tends == asks.abs() { &REFERENCE } else { &LIMITS };
        let reference = Reference {
            origin: Origin::Bus,
            asks: Some(asks),
            negative: Some(asks < 0),
            tends: Some(tends.unsigned_abs()),
        };
        Answer::Says(reference, rule)
    }

    fn order(&self, world: &World) -> Answer<Order> {
        if !world.mains {
            return Answer::Silent(&MAINS);
        }
        if world.tripped.is_some() {
            return Answer::Says(Order::Tripped(Stop::Unsaid), &FAULT);
        }
        match self.commander(world) {
            Answer::Silent(silence) => Answer::Silent(silence),
            Answer::Says(Who::Bus, _) => by_bus(world),
            Answer::Says(Who::RemoteTerminal | Who::Keypad, _) => Answer::Silent(&REMOTE_KEYS),
            Answer::Says(..) => Answer::Silent(&TERMINAL_RUN),
        }
    }

    fn step(&self, world: &World, change: &Change) -> World {
        let mut after = world.clone();
        after.note(change);
        match *change {
            Change::Write { address: CMD, value } | Change::Broadcast { address: CMD, value } => {
                if world.unsure == Some(&MAINS) {
                    after.unsure = None; // what stands in W400 is known again
                }
                let broadcast = matches!(change, Change::Broadcast { .. });
                if broadcast && self.commander(world).said() != Some(Who::Bus) {
                    after.unsure = Some(&BROADCAST);
                }
                let before = world.command.unwrap_or(0);
                after.take_command(value, broadcast);
                after.state = drivecom::after(world.state, before, value, world.cause);
                if world.state == State::Fault && after.state != State::Fault {
                    after.tripped = None;
                }
            }
            Change::Write { address: CMI, value } | Change::Broadcast { address: CMI, value } => {
                after.written.insert(CMI, value);
                if value != 0 {
                    after.unsure = Some(&EXTENDED);
                }
            }
            Change::Write { address: LFR, value } | Change::Broadcast { address: LFR, value } => {
                after.written.insert(LFR, value);
            }
            Change::Write { address, value } | Change::Broadcast { address, value } => {
                after.words.insert(address, value);
            }
            Change::Link(false) => after.unsure = Some(&TIME_OUT),
            Change::Input { .. } if world.command.is_some() => after.unsure = Some(&STOP_INPUTS),
            Change::Wait if world.tripped.is_some() => after.unsure = Some(&RESTART),
            Change::Trip(_) => after.state = State::Fault,
            Change::Mains(on) => {
                after.unsure = if on { world.unsure } else { world.command.map(|_| &MAINS) };
                after.forget_bus();
                after.latched = None;
                if on {
                    after.tripped = None;
                    after.state = State::OperationEnabled;
                }
            }
            _ => {}
        }
        after
    }

    fn said_of(&self, world: &World, change: &Change) -> Vec<Answer<Effect>> {
        let resets = world.tripped.is_some() && self.step(world, change).tripped.is_none();
        match change {
            Change::Write { address: CMD, .. } if resets => vec![Answer::Says(Effect::Resets, &CHART)],
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::referee::{Motion, Verdict, commander, explains, order, reference};

    fn write(address: u16, value: u16) -> Change {
        Change::Write { address, value }
    }

    fn drive() -> World {
        World::factory(Family::Atv28)
    }

    #[test]
    fn the_printed_write_of_15_and_200_runs_at_20_hz() {
        // S2 p.12: 02 10 0190 0002 04 000F 00C8
        let world = drive().after(&[write(CMD, 15), write(LFR, 200)]);
        assert_eq!(explains(&world, Motion::Turning { reverse: false, tends: Some(2000) }), Verdict::Must);
        assert_eq!(explains(&world, Motion::Turning { reverse: true, tends: None }), Verdict::MustNot);
    }

    #[test]
    fn a_negative_reference_turns_in_reverse_and_both_signs_are_left_open() {
        // BBV p.57: 401 is LFr, signed (p.19)
        let world = drive().after(&[write(CMD, 15), write(LFR, -200_i16 as u16)]);
        assert_eq!(explains(&world, Motion::Turning { reverse: true, tends: Some(2000) }), Verdict::Must);
        assert!(order(&world.after(&[write(CMD, 0x080F)])).is_silent());
    }

    #[test]
    fn hsp_at_its_old_address_limits_the_reference() {
        // BBV p.57: 250 is HSP
        let world = drive().after(&[write(HSP, 300), write(CMD, 15), write(LFR, 450)]);
        assert_eq!(reference(&world).said().and_then(|reference| reference.tends), Some(3000));
    }

    #[test]
    fn an_input_that_moves_under_a_command_of_the_bus_is_left_open() {
        // BBV p.57 has no address for what the inputs do
        let world = drive().after(&[write(CMD, 15), Change::Input { bit: 2, closed: true }]);
        assert!(order(&world).is_silent());
        assert!(commander(&world).is_silent());
    }

    #[test]
    fn voltage_disabled_locks_and_the_next_15_is_left_open() {
        // BBV p.10, transition 9, and p.11 for L1
        let world = drive().after(&[write(CMD, 15), write(CMD, 0)]);
        assert_eq!(order(&world).said(), Some(Order::Locked));
        assert!(order(&world.after(&[write(CMD, 15)])).is_silent());
    }
}
