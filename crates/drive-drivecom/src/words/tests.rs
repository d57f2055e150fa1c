//! Words of every pattern, and what is told of them.

use drive_core::{Frequency, Lease, StopMode, Told};

use super::*;
use crate::{DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON};

/// ETA bits 10 and 15, ETI bits 9 and 10 (p. 21, 22).
#[test]
fn which_way_a_motor_turns_and_whether_it_comes_down_is_told_as_the_drive_says_it() {
    use Direction::{Forward, Reverse};
    for (eta, eti, told) in [
        (0x0627, 0x4012, (Some(Forward), Some(false))),
        (0x8627, 0x4012, (Some(Reverse), Some(false))),
        (0x8227, 0x4212, (Some(Reverse), Some(false))),
        (0x8227, 0x4412, (Some(Reverse), Some(true))),
        (0x8227, 0x4812, (Some(Reverse), None)),
        (0x8223, 0x4412, (None, Some(true))),
    ] {
        assert_eq!(StatusWords::new(eta, eti).turning(), told, "{eta:04X}h {eti:04X}h");
    }
}

#[test]
fn every_pair_of_words_has_a_state_and_none_outside_the_table_is_called_a_known_one() {
    for eta in 0..=u16::MAX {
        for eti in [0x0000, 0x4000, 0x4010, 0xFFFF] {
            let words = StatusWords::new(eta, eti);
            assert_eq!(words.state(None) == State::Unknown, ChartState::of(eta).is_none(), "{eta:04X}h");
            assert_eq!(words.status(None).is_fault(), words.is_tripped(), "{eta:04X}h");
        }
    }
}

#[test]
fn forced_local_mode_outranks_the_control_source() {
    assert_eq!(StatusWords::new(0x0227, 0x4000).control(), Control::Bus);
    assert_eq!(StatusWords::new(0x0027, 0x4000).control(), Control::Local);
}

#[test]
fn the_control_word_tells_a_stop_from_a_run_while_the_bus_commands() {
    let [run, stop] = [0x000F, 0x100F].map(|word| Some(ControlWord::from_bits_retain(word)));
    let turning = StatusWords::new(0x0227, 0x4410);
    assert_eq!(turning.state(run), State::Running);
    assert_eq!(turning.state(stop), State::Stopping);
    let standing = StatusWords::new(0x0627, 0x4002);
    assert_eq!(standing.state(run), State::Running, "at a setpoint of zero");
    assert_eq!(standing.state(stop), State::Ready);
    let by_terminals = StatusWords::new(0x0227, 0x0410);
    assert_eq!(by_terminals.state(stop), State::Running, "the word is not in force");
}

#[test]
fn a_word_that_the_drive_contradicts_is_held_no_longer() {
    let [run, stop, quick] = [0x000F, 0x100F, 0x0002].map(ControlWord::from_bits_retain);
    let held = |eta, eti| [run, stop, quick].map(|word| StatusWords::new(eta, eti).can_hold(word));
    assert_eq!(held(0x0227, 0x4210), [true, false, true], "speeding up");
    assert_eq!(held(0x0227, 0x4410), [true; 3], "slowing down");
    assert_eq!(held(0x0627, 0x4010), [true, false, true], "at its reference");
    assert_eq!(held(0x0627, 0x4030), [true; 3], "braked by direct current");
    assert_eq!(held(0x0223, 0x4000), [false, true, true], "switched on");
    assert_eq!(held(0x0027, 0x4010), [false, true, true], "forced local");
    assert_eq!(held(0x0227, 0x0010), [false, true, true], "by the terminals");
}

#[test]
fn a_motor_that_direct_current_brakes_has_not_come_to_a_stop() {
    let injection = StatusWords::new(0x0627, 0x4020);
    let [run, stop] = [0x000F, 0x200F].map(|word| Some(ControlWord::from_bits_retain(word)));
    assert_eq!([None, run, stop].map(|held| injection.state(held)), [State::Stopping; 3]);
    assert!(injection.shows_stop(ControlWord::from_bits_retain(0x200F)));
}

#[test]
fn a_run_command_shows_in_the_direction_of_the_motor_and_not_of_the_reference_alone() {
    let fifty = Frequency::from_hertz(50);
    let shown = |eta, eti| StatusWords::new(eta, eti).shows_run(Direction::Reverse, fifty, None);
    assert_eq!(shown(0x0227, 0xC410), RunShown::TurningRound, "forward, slowing down");
    assert_eq!(shown(0x8227, 0xC210), RunShown::InForce);
    assert_eq!(shown(0x8227, 0x4210), RunShown::NotYet, "the reference asks for forward");
    assert_eq!(shown(0x0227, 0xC000), RunShown::NotYet, "the motor stands");
    assert_eq!(shown(0x8227, 0x8210), RunShown::NotYet, "the terminals command");
    let stands = StatusWords::new(0x0627, 0x4002).shows_run(Direction::Reverse, Frequency::ZERO, None);
    assert_eq!(stands, RunShown::InForce, "at a reference of zero");
}

/// Behind a panel that has taken and given back control the run command stands, is the bus's, and so is the reference, while the
/// motor is on its way to standstill (ETI bit 10, p. 22).
#[test]
fn a_motor_that_slows_down_below_its_reference_is_not_shown_to_obey_it() {
    let lease = Lease::new(Direction::Forward, 0x000F);
    let thirty = Frequency::from_hertz(30);
    for (eti, output, is_told) in [
        (0x4452, Frequency::from_centihertz(40), false),
        (0x4452, Frequency::from_hertz(40), true),
        (0x4452, thirty, true),
        (0x4252, Frequency::from_centihertz(40), true),
        (0x4C52, Frequency::from_hertz(20), true),
    ] {
        let words = StatusWords::new(0x0227, eti);
        let told = words.evidence(lease, thirty, Some(output)).output;
        assert_eq!(told, if is_told { Told::Yes } else { Told::NotTold }, "{eti:04X}h at {output}");
        let shown = words.shows_run(Direction::Forward, thirty, Some(output));
        assert_eq!(shown == RunShown::InForce, is_told, "{eti:04X}h at {output}");
    }
    // Turning round: it comes down first.
    let round = StatusWords::new(0x8227, 0x4452);
    let shown = round.shows_run(Direction::Forward, thirty, Some(Frequency::from_hertz(9)));
    assert_eq!(shown, RunShown::TurningRound);
}

#[test]
fn a_stop_never_shows_in_a_motor_that_is_called_running() {
    let stops = StopMode::ALL
        .iter()
        .filter_map(|&mode| ControlWord::enabled_stop(mode))
        .chain([QUICK_STOP, SHUTDOWN, SWITCH_ON, DISABLE_VOLTAGE].map(ControlWord::from_bits_retain));
    for stop in stops {
        for eta in 0..=u16::MAX {
            // Every source of commands, with the motor at rest, turning, accelerating, slowing down, braked.
            for source in [0x0000, 0x2000, 0x4000, 0x6000] {
                for motion in [0x0000, 0x0010, 0x0210, 0x0410, 0x0020, 0x0030, 0x1010, 0x1410, 0x9FFF] {
                    let words = StatusWords::new(eta, source | motion);
                    let running = words.state(Some(stop)) == State::Running;
                    assert!(!(running && words.shows_stop(stop)), "{words:?} after {stop:?}");
                }
            }
        }
    }
}

#[test]
fn a_stop_shows_where_no_run_command_acts() {
    let [ramp, quick, freewheel] = [0x100F, 0x0002, 0x0000].map(ControlWord::from_bits_retain);
    let running = StatusWords::new(0x0627, 0x4010);
    let slowing = StatusWords::new(0x0227, 0x4410);
    let quick_stop = StatusWords::new(0x0207, 0x5010);
    let disabled = StatusWords::new(0x0240, 0x4000);
    let shown = |words: StatusWords| [ramp, quick, freewheel].map(|word| words.shows_stop(word));
    assert_eq!(shown(running), [false; 3]);
    assert_eq!(shown(slowing), [true, false, false]);
    assert_eq!(shown(quick_stop), [true, true, false]);
    assert_eq!(shown(disabled), [true; 3]);
    let by_terminals = StatusWords::new(0x0227, 0x0410);
    assert_eq!(shown(by_terminals), [false; 3], "the terminals slow it down to another speed");
    let forced_local = StatusWords::new(0x0027, 0x4410);
    assert_eq!(shown(forced_local), [false; 3]);
    let released = StatusWords::new(0x0227, 0x0000);
    assert_eq!(shown(released), [true; 3], "the terminals command a motor that nothing drives");
    let held = StatusWords::new(0x0227, 0x0020);
    assert_eq!(shown(held), [false; 3], "they brake it with direct current");
    let standing = StatusWords::new(0x0227, 0x4000);
    assert_eq!(shown(standing), [true, false, false]);
    assert_eq!(shown(StatusWords::new(0x0200, 0)), [false; 3], "initialising");
    assert_eq!(shown(StatusWords::new(0x0201, 0)), [false; 3], "a pattern that the table does not have");
}
