//! The simulated 3G3EV in its world: who commands and whose reference is in force, what its inputs do, and each place
//! where the manual can be read in two ways.

use drive_core::Frequency;

use super::*;
use crate::Damage;

const RUN: u16 = 1;

fn act(drive: &mut Drive3g3ev, act: impl FnOnce(&Surroundings) -> Result<Act, crate::UnknownName>) {
    let act = act(drive.surroundings()).unwrap();
    drive.world(act);
}

fn terminal(drive: &mut Drive3g3ev, name: &str, closed: bool) {
    act(drive, |around| around.terminal(name, closed));
}

fn reading(drive: &mut Drive3g3ev, name: &str, reading: &str) {
    act(drive, |around| around.reading(name, reading));
}

/// A drive with this n02, 25 Hz at the console and 50 Hz from the bus.
fn with_mode(mode: u16) -> Drive3g3ev {
    let mut drive = Drive3g3ev::new();
    drive.poke(at::N02, mode);
    drive.power_cycle();
    drive.panel(Panel::Reference(Frequency::from_hertz(25)));
    write(&mut drive, at::REFERENCE, 500);
    drive
}

/// The motor's frequency after a minute.
fn settled(drive: &mut Drive3g3ev) -> i32 {
    drive.advance(60 * SECOND);
    drive.observe().output_frequency
}

/// Bits A and 9 of 002Ch: whether run command and reference come from elsewhere than the bus.
fn elsewhere(drive: &mut Drive3g3ev) -> (bool, bool) {
    let state = drive.read(at::STATE).unwrap();
    (state >> 0xA & 1 == 1, state >> 9 & 1 == 1)
}

#[test]
fn bits_9_and_a_of_002ch_say_what_is_in_force_in_every_mode_2_1_5_2() {
    for (mode, bus, terminals, console, seen) in [
        (0, 0, 0, 2_500, (true, true)),
        (1, 0, 2_500, 0, (true, true)),
        (2, 2_500, 0, 0, (false, true)),
        (3, 0, 0, 2_500, (true, true)),
        (4, 0, 5_000, 0, (true, false)),
        (5, 5_000, 0, 0, (false, false)),
    ] {
        let mut by_bus = with_mode(mode);
        write(&mut by_bus, at::COMMAND, RUN);
        assert_eq!((settled(&mut by_bus), elsewhere(&mut by_bus)), (bus, seen), "n02 = {mode}");
        let mut by_terminals = with_mode(mode);
        terminal(&mut by_terminals, "SF", true);
        assert_eq!(settled(&mut by_terminals), terminals, "n02 = {mode}");
        let mut by_console = with_mode(mode);
        by_console.panel(Panel::Run);
        assert_eq!(settled(&mut by_console), console, "n02 = {mode}");
        by_console.panel(Panel::Stop);
        assert_eq!(settled(&mut by_console), 0);
    }
}

#[test]
fn n02_acts_at_the_next_power_up_2_1_note_3() {
    let mut drive = with_mode(2);
    write(&mut drive, at::N02, 5);
    write(&mut drive, at::ENTER, 0);
    write(&mut drive, at::COMMAND, RUN);
    assert_eq!((settled(&mut drive), elsewhere(&mut drive)), (2_500, (false, true)), "25 Hz of the console");
    drive.power_cycle();
    write(&mut drive, at::REFERENCE, 500);
    write(&mut drive, at::COMMAND, RUN);
    assert_eq!((settled(&mut drive), elsewhere(&mut drive)), (5_000, (false, false)));
}

#[test]
fn row_3_of_n02_is_as_printed_or_as_its_pattern_has_it_2_1() {
    for (name, reference) in [("console", true), ("bus", false)] {
        let mut drive = with_mode(3);
        reading(&mut drive, "n02=3", name);
        assert_eq!(elsewhere(&mut drive), (true, reference), "{name}");
    }
}

#[test]
fn the_panel_takes_run_command_and_reference_in_every_mode_5_2() {
    let mut drive = with_mode(5);
    write(&mut drive, at::COMMAND, RUN);
    assert_eq!(settled(&mut drive), 5_000);
    drive.panel(Panel::TakeControl);
    assert_eq!((settled(&mut drive), elsewhere(&mut drive)), (0, (true, true)));
    drive.panel(Panel::Run);
    assert_eq!((settled(&mut drive), drive.read(at::REFERENCE_SEEN)), (2_500, Ok(250)));
}

#[test]
fn back_from_the_panel_a_standing_run_command_waits_or_acts_2_1() {
    for (name, frequency) in [("waits", 0), ("runs", 5_000)] {
        let mut drive = with_mode(5);
        reading(&mut drive, "remote-again", name);
        write(&mut drive, at::COMMAND, RUN);
        drive.panel(Panel::TakeControl);
        drive.panel(Panel::ReleaseControl);
        assert_eq!(settled(&mut drive), frequency, "{name}");
    }
}

#[test]
fn bits_4_to_6_of_0001h_do_what_n06_to_n08_select_and_a_word_without_them_ends_it_5_1() {
    for (switch, bit) in [("n06", 4), ("n07", 5), ("n08", 6)] {
        for (function, frequency, seen) in [
            ("nothing", 5_000, (false, false)),
            ("local", 0, (true, true)),
            ("preset-speed", 1_000, (false, false)),
            ("base-block", 0, (false, false)),
            ("external-fault", 0, (false, false)),
        ] {
            let mut drive = with_mode(5);
            reading(&mut drive, switch, function);
            write(&mut drive, at::COMMAND, RUN | 1 << bit);
            assert_eq!(
                (settled(&mut drive), elsewhere(&mut drive)),
                (frequency, seen),
                "{switch} {function}"
            );
            write(&mut drive, at::COMMAND, RUN);
            let after = if function == "external-fault" { 0 } else { 5_000 };
            assert_eq!(settled(&mut drive), after, "{switch} {function}");
        }
    }
}

#[test]
fn the_terminals_of_n06_to_n08_do_the_same_whatever_the_bus_says_5_1() {
    for (switch, name, shown) in [("n06", "S1", 0x04), ("n07", "S2", 0x08), ("n08", "S3", 0x10)] {
        let mut drive = with_mode(5);
        reading(&mut drive, switch, "preset-speed");
        write(&mut drive, at::COMMAND, RUN);
        terminal(&mut drive, name, true);
        assert_eq!((settled(&mut drive), drive.read(at::INPUT_TERMINALS)), (1_000, Ok(shown)), "{name}");
        assert_eq!(drive.read(at::REFERENCE_SEEN), Ok(100), "bit 9 does not tell, 0023h does");
        terminal(&mut drive, name, false);
        assert_eq!(settled(&mut drive), 5_000);
    }
}

#[test]
fn an_external_fault_stays_as_long_as_its_input_5_1_5_2() {
    let mut drive = with_mode(5);
    reading(&mut drive, "n06", "external-fault");
    terminal(&mut drive, "S1", true);
    drive.panel(Panel::Reset);
    assert_eq!(drive.read(at::ERRORS), Ok(0x80));
    terminal(&mut drive, "S1", false);
    assert_eq!(drive.read(at::ERRORS), Ok(0x80), "it is latched");
    drive.panel(Panel::Reset);
    assert_eq!(drive.read(at::ERRORS), Ok(0));
}

#[test]
fn after_a_reset_a_standing_run_command_waits_or_runs_the_motor_5_1() {
    for (name, frequency) in [("waits", 0), ("runs", 5_000)] {
        let mut drive = with_mode(5);
        reading(&mut drive, "after-reset", name);
        reading(&mut drive, "n07", "fault-reset");
        write(&mut drive, at::COMMAND, RUN);
        drive.trip(0);
        write(&mut drive, at::COMMAND, RUN | 1 << 5);
        assert_eq!((settled(&mut drive), drive.read(at::ERRORS)), (frequency, Ok(0)), "{name}");
    }
}

#[test]
fn a_reset_while_a_run_command_stands_acts_or_is_ignored_5_1() {
    for (name, errors) in [("resets", 0), ("ignored", 1)] {
        let mut drive = with_mode(5);
        reading(&mut drive, "reset-with-run", name);
        reading(&mut drive, "n07", "fault-reset");
        drive.trip(0);
        write(&mut drive, at::COMMAND, RUN | 1 << 5);
        assert_eq!(drive.read(at::ERRORS), Ok(errors), "{name}");
        write(&mut drive, at::COMMAND, 0);
        write(&mut drive, at::COMMAND, 1 << 5);
        assert_eq!(drive.read(at::ERRORS), Ok(0));
    }
}

#[test]
fn a_motor_without_supply_is_uv1_which_stays_or_clears_itself_5_2() {
    for (name, errors, frequency) in [("stays", 0x1000, 0), ("clears", 0, 5_000)] {
        let mut drive = with_mode(5);
        reading(&mut drive, "UV1", name);
        write(&mut drive, at::COMMAND, RUN);
        settled(&mut drive);
        drive.world(Act::MotorSupply(false));
        assert_eq!((drive.read(at::ERRORS), drive.read(at::DC_BUS)), (Ok(0x1000), Ok(0)));
        assert_eq!(drive.read(at::STATE).unwrap() >> 7 & 1, 1);
        drive.panel(Panel::Reset);
        assert_eq!(drive.read(at::ERRORS), Ok(0x1000), "its cause is there");
        drive.world(Act::MotorSupply(true));
        assert_eq!((settled(&mut drive), drive.read(at::ERRORS)), (frequency, Ok(errors)), "{name}");
    }
}

#[test]
fn a_damaged_frame_leaves_its_bit_in_003dh_5_2() {
    for (name, after) in [("until-reset", 0x03), ("until-good", 0)] {
        let mut drive = with_mode(5);
        reading(&mut drive, "003Dh", name);
        drive.frame_damaged(Damage::Check);
        drive.frame_damaged(Damage::Length);
        assert_eq!(drive.read(at::LINK_ERROR), Ok(0x03));
        assert_eq!(drive.observe().trip, None, "only the time-over trips");
        drive.frame_seen(Cast::Unicast);
        assert_eq!(drive.read(at::LINK_ERROR), Ok(after), "{name}");
        drive.panel(Panel::Reset);
        assert_eq!(drive.read(at::LINK_ERROR), Ok(0));
    }
}

#[test]
fn without_supply_nothing_acts_and_the_run_command_is_gone_afterwards_5_1() {
    let mut drive = with_mode(5);
    write(&mut drive, at::COMMAND, RUN);
    settled(&mut drive);
    drive.power(false);
    assert!(!drive.observe().running);
    assert_eq!(settled(&mut drive), 0);
    drive.power(true);
    assert_eq!((settled(&mut drive), drive.read(at::COMMAND)), (0, Ok(0)));
}

#[test]
fn every_switch_names_its_section() {
    for switch in Drive3g3ev::new().surroundings().switches {
        assert!(switch.readings.len() > 1 && switch.question.contains('§'), "{}", switch.name);
    }
}
