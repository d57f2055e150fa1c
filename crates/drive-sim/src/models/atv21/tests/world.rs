//! The simulated Altivar 21 in its world: the five control configurations of §6.2, what overrides them, and each place
//! where the manual can be read in two ways.

use drive_atv21::registers::address as at;
use drive_core::{Frequency, Percent};

use super::*;
use crate::{Cast, Observation};

const FC90: u16 = at::FAULT_CODE;
const FD01: u16 = at::STATUS_WORD;
const BUS: u16 = 0xC400;

/// A drive with these settings, and 10 Hz written to FA01.
fn drive(settings: &[(u16, u16)]) -> Atv21 {
    let mut drive = Atv21::new();
    for &(register, value) in settings {
        assert!(drive.poke(register, value), "{register:04X}h");
    }
    write(&mut drive, at::FREQUENCY_REFERENCE, 1_000).unwrap();
    act(&mut drive, |around| around.analog("VIA", Percent::from_percent(100)));
    drive
}

fn act(drive: &mut Atv21, act: impl FnOnce(&crate::Surroundings) -> Result<crate::Act, crate::UnknownName>) {
    let act = act(drive.surroundings()).unwrap();
    drive.world(act);
}

fn terminal(drive: &mut Atv21, name: &str, closed: bool) {
    act(drive, |around| around.terminal(name, closed));
}

fn reading(drive: &mut Atv21, name: &str, reading: &str) {
    act(drive, |around| around.reading(name, reading));
}

/// The motor's frequency after a minute.
fn settled(drive: &mut Atv21) -> i32 {
    drive.advance(SECOND * 60);
    drive.observe().output_frequency
}

/// FE45 and FE46.
fn sources(drive: &mut Atv21) -> (u16, u16) {
    (drive.read(at::COMMAND_SOURCE).unwrap(), drive.read(at::REFERENCE_SOURCE).unwrap())
}

fn bit(drive: &mut Atv21, bit: u16) -> bool {
    drive.read(FD01).unwrap() >> bit & 1 == 1
}

#[test]
fn control_by_the_network_alone_ignores_the_terminals_6_2_p_12() {
    let mut drive = drive(&[(at::COMMAND_MODE, 2), (at::REFERENCE_MODE, 4)]);
    terminal(&mut drive, "F", true);
    assert_eq!(settled(&mut drive), 0);
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert_eq!((settled(&mut drive), sources(&mut drive)), (1_000, (2, 4)));
}

#[test]
fn the_terminals_command_and_the_network_watches_6_2_p_13() {
    let mut drive = drive(&[]);
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert_eq!((settled(&mut drive), sources(&mut drive)), (0, (0, 1)));
    terminal(&mut drive, "F", true);
    assert_eq!((settled(&mut drive), drive.read(at::LOGIC_INPUTS)), (5_000, Ok(1)));
    terminal(&mut drive, "F", false);
    terminal(&mut drive, "R", true);
    act(&mut drive, |around| around.analog("VIA", Percent::from_percent(50)));
    assert_eq!((settled(&mut drive), drive.read(at::ANALOG_INPUT_VIA)), (-2_497, Ok(511)));
    terminal(&mut drive, "F", true);
    assert_eq!(settled(&mut drive), 0, "neither of the two");
}

#[test]
fn bits_14_and_15_switch_reference_and_command_each_for_itself_6_2_p_14() {
    for (word, frequency, seen) in
        [(0x8400, 5_000, (2, 1)), (0x4000, 1_000, (0, 4)), (0xC400, 1_000, (2, 4)), (0x0400, 5_000, (0, 1))]
    {
        let mut drive = drive(&[]);
        terminal(&mut drive, "F", true);
        write(&mut drive, at::COMMAND_WORD, word).unwrap();
        assert_eq!((settled(&mut drive), sources(&mut drive)), (frequency, seen), "{word:04X}h");
    }
}

#[test]
fn input_r_with_48_gives_command_and_reference_to_the_terminals_and_back_6_2_p_15() {
    let mut drive = drive(&[(at::INPUT_R_FUNCTION, 48)]);
    write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
    assert_eq!(settled(&mut drive), 1_000);
    terminal(&mut drive, "R", true);
    assert_eq!((settled(&mut drive), sources(&mut drive)), (0, (0, 1)));
    terminal(&mut drive, "F", true);
    assert_eq!(settled(&mut drive), 5_000);
    terminal(&mut drive, "R", false);
    assert_eq!(settled(&mut drive), 1_000, "the run command that still stands in FA00 acts again");
}

#[test]
fn with_48_off_the_bus_commands_by_its_priority_or_at_once_6_2_p_15() {
    for (name, frequency, seen) in [("priority", 0, (0, 1)), ("bus", 1_000, (2, 4))] {
        let mut drive = drive(&[(at::INPUT_R_FUNCTION, 48)]);
        reading(&mut drive, "local-off", name);
        write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
        assert_eq!((settled(&mut drive), sources(&mut drive)), (frequency, seen), "{name}");
    }
}

#[test]
fn input_r_with_38_switches_the_reference_to_f207_6_2_p_16() {
    let settings = [
        (at::COMMAND_MODE, 2),
        (at::REFERENCE_MODE, 4),
        (at::SECOND_REFERENCE, 1),
        (at::INPUT_R_FUNCTION, 38),
    ];
    for (name, word, frequency) in
        [("over-priority", 0x0400, 5_000), ("over-priority", BUS, 5_000), ("under-priority", BUS, 1_000)]
    {
        let mut drive = drive(&settings);
        reading(&mut drive, "FCHG", name);
        write(&mut drive, at::COMMAND_WORD, word).unwrap();
        assert_eq!(settled(&mut drive), 1_000, "R is off");
        terminal(&mut drive, "R", true);
        assert_eq!(settled(&mut drive), frequency, "{name} {word:04X}h");
        assert_eq!(sources(&mut drive), (2, if frequency == 5_000 { 1 } else { 4 }));
        assert_eq!(drive.read(at::REFERENCE_BEFORE_RAMP).map(i32::from), Ok(frequency));
    }
}

#[test]
fn functions_52_and_53_override_the_bus_on_any_input_8_4_p_31_8_5_p_33() {
    for (register, name) in
        [(at::INPUT_R_FUNCTION, "R"), (at::INPUT_RES_FUNCTION, "RES"), (at::INPUT_VIA_FUNCTION, "VIA")]
    {
        for function in [52, 53] {
            let via = u16::from(name == "VIA");
            let mut drive = drive(&[(register, function), (at::VIA_IS_LOGIC, via), (at::REFERENCE_MODE, 2)]);
            write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
            assert_eq!(settled(&mut drive), 1_000);
            terminal(&mut drive, name, true);
            assert_eq!((settled(&mut drive), sources(&mut drive)), (0, (0, 2)), "{name} {function}");
            terminal(&mut drive, name, false);
            assert_eq!(settled(&mut drive), 1_000);
        }
    }
    let mut always = drive(&[(at::ALWAYS_FUNCTION, 48)]);
    write(&mut always, at::COMMAND_WORD, BUS).unwrap();
    assert_eq!((settled(&mut always), sources(&mut always).0), (0, 0), "F110");
}

#[test]
fn functions_52_and_53_run_the_motor_by_themselves_where_they_are_read_so_8_4_p_31() {
    for (name, after) in [("ends", 1_000), ("stays", 5_000)] {
        let mut drive = drive(&[(at::INPUT_R_FUNCTION, 53)]);
        reading(&mut drive, "forced", "runs");
        reading(&mut drive, "forced-off", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        terminal(&mut drive, "R", true);
        assert_eq!(settled(&mut drive), 5_000);
        write(&mut drive, at::COMMAND_WORD, 0xC000).unwrap();
        assert_eq!(settled(&mut drive), 5_000, "no stop of the bus ends it");
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        terminal(&mut drive, "R", false);
        assert_eq!(settled(&mut drive), after, "{name}");
    }
}

#[test]
fn nothing_runs_without_st_8_6_p_34() {
    for (name, bit_10) in [("ordered", true), ("in-force", false)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "FD01.10-ST", name);
        terminal(&mut drive, "ST", false);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        assert_eq!(settled(&mut drive), 0);
        assert_eq!(
            [10, 11, 13, 14].map(|number| bit(&mut drive, number)),
            [bit_10, true, false, true],
            "{name}"
        );
        terminal(&mut drive, "ST", true);
        assert_eq!(settled(&mut drive), 1_000);
        assert_eq!([10, 11, 13, 14].map(|number| bit(&mut drive, number)), [true, false, true, true]);
        terminal(&mut drive, "ST", false);
        assert!(!drive.observe().running && drive.observe().shaft_frequency > 0, "it coasts");
    }
}

#[test]
fn a_reset_lets_closed_terminals_start_the_motor_because_it_zeroes_the_priority_8_2_p_28() {
    for (name, frequency) in [("runs", 5_000), ("waits", 0)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "closed-at-start", name);
        write(&mut drive, at::COMMAND_WORD, 0xC000).unwrap();
        terminal(&mut drive, "F", true);
        assert_eq!(settled(&mut drive), 0, "the bus has control and orders nothing");
        drive.trip(14);
        write(&mut drive, at::COMMAND_WORD, 0xE000).unwrap();
        drive.advance(SECOND);
        assert!(!drive.listens() && !drive.observe().running, "it restarts for some two seconds");
        assert_eq!((settled(&mut drive), drive.read(at::COMMAND_WORD)), (frequency, Ok(0)), "{name}");
        terminal(&mut drive, "F", false);
        terminal(&mut drive, "F", true);
        assert_eq!(settled(&mut drive), 5_000, "closed anew it runs in any case");
    }
}

#[test]
fn bit_13_resets_whoever_commands_or_only_for_the_bus_8_4_p_31() {
    for (name, without, with) in [("always", 0, 0), ("command", 14, 0)] {
        for (word, code) in [(0x2000, without), (0xE000, with)] {
            let mut drive = drive(&[]);
            reading(&mut drive, "reset-bit", name);
            drive.trip(14);
            write(&mut drive, at::COMMAND_WORD, word).unwrap();
            drive.advance(SECOND * 3);
            assert_eq!(drive.read(FC90), Ok(code), "{name} {word:04X}h");
        }
    }
}

#[test]
fn the_reset_input_and_the_keypad_reset_too_8_8_p_38() {
    let by_input = |drive: &mut Atv21| terminal(drive, "RES", true);
    let by_key = |drive: &mut Atv21| drive.panel(Panel::Reset);
    for reset in [&by_input as &dyn Fn(&mut Atv21), &by_key] {
        let mut drive = drive(&[]);
        drive.trip(14);
        reset(&mut drive);
        drive.advance(SECOND * 3);
        assert_eq!(drive.observe().trip, None);
    }
}

#[test]
fn a_drive_that_retries_starts_again_by_itself_8_6_p_34() {
    for (name, frequency) in [("none", 0), ("after-1s", 1_000)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "retries", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        assert_eq!(settled(&mut drive), 1_000);
        drive.trip(14);
        assert!(!drive.observe().running && bit(&mut drive, 1), "{name}");
        assert_eq!(settled(&mut drive), frequency, "{name}");
    }
}

#[test]
fn loc_rem_takes_command_and_reference_in_every_configuration_6_2_p_12() {
    for (back, frequency) in [("waits", 0), ("resumes", 1_000)] {
        let mut drive = drive(&[(at::COMMAND_MODE, 2), (at::REFERENCE_MODE, 4)]);
        reading(&mut drive, "LOC/REM", back);
        write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
        assert_eq!(settled(&mut drive), 1_000);
        drive.panel(Panel::TakeControl);
        assert_eq!((settled(&mut drive), sources(&mut drive), bit(&mut drive, 15)), (0, (1, 3), true));
        drive.panel(Panel::Reference(Frequency::from_hertz(25)));
        drive.panel(Panel::Run);
        assert_eq!(settled(&mut drive), 2_500);
        drive.panel(Panel::Stop);
        assert_eq!(settled(&mut drive), 0);
        drive.panel(Panel::ReleaseControl);
        let after = if back == "resumes" { 0 } else { frequency };
        assert_eq!((settled(&mut drive), sources(&mut drive)), (after, (2, 4)), "the STOP key ended it");
        write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
        drive.panel(Panel::TakeControl);
        drive.panel(Panel::ReleaseControl);
        assert_eq!(settled(&mut drive), frequency, "{back}");
    }
}

#[test]
fn a_motor_whose_control_the_keypad_takes_stops_or_runs_on_6_2_p_12() {
    for (name, frequency) in [("stops", 0), ("runs-on", -1_000)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "LOC", name);
        write(&mut drive, at::COMMAND_WORD, BUS | 0x0200).unwrap();
        assert_eq!(settled(&mut drive), -1_000);
        drive.panel(Panel::TakeControl);
        write(&mut drive, at::COMMAND_WORD, 0xC000).unwrap();
        assert_eq!(settled(&mut drive), frequency, "{name}");
    }
}

#[test]
fn the_local_bit_is_for_any_local_control_or_for_the_keypad_8_6_p_34() {
    for (name, terminals) in [("any", true), ("keypad", false)] {
        let mut drive = drive(&[(at::INPUT_R_FUNCTION, 48)]);
        reading(&mut drive, "FD01.15", name);
        terminal(&mut drive, "R", true);
        assert_eq!(bit(&mut drive, 15), terminals, "{name}");
        drive.panel(Panel::TakeControl);
        assert!(bit(&mut drive, 15));
    }
}

#[test]
fn the_run_bit_is_an_order_or_a_movement_8_6_p_34() {
    for (name, stopping) in [("ordered", false), ("turning", true)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "FD01.10", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        assert_eq!(settled(&mut drive), 1_000);
        write(&mut drive, at::COMMAND_WORD, 0xC000).unwrap();
        drive.advance(Duration::from_millis(500));
        assert_eq!(bit(&mut drive, 10), stopping, "{name}");
        settled(&mut drive);
        assert!(!bit(&mut drive, 10));
    }
}

#[test]
fn of_two_references_the_newest_counts_or_the_speed_8_5_p_33() {
    for (name, frequency) in [("newest", 1_000), ("speed", 5_000)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "two-references", name);
        write(&mut drive, at::SPEED_REFERENCE, 1_500).unwrap();
        write(&mut drive, at::FREQUENCY_REFERENCE, 1_000).unwrap();
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        assert_eq!(settled(&mut drive), frequency, "{name}");
        assert_eq!(sources(&mut drive), (2, 4), "FE46 does not tell them apart, FE02 does");
        assert_eq!(drive.read(at::REFERENCE_BEFORE_RAMP).map(i32::from), Ok(frequency));
    }
}

#[test]
fn f856_counts_poles_or_pairs_of_them_8_5_p_33() {
    for (name, frequency) in [("poles", 2_500), ("pairs", 5_000)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "poles", name);
        write(&mut drive, at::SPEED_REFERENCE, 750).unwrap();
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        assert_eq!((settled(&mut drive), drive.read(at::OUTPUT_SPEED)), (frequency, Ok(750)), "{name}");
    }
}

#[test]
fn the_words_of_a_trip_are_from_before_it_or_live_8_3_p_29() {
    for (name, load) in [("frozen", true), ("live", false)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "before-trip", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        settled(&mut drive);
        drive.trip(14);
        for word in [at::OUTPUT_VOLTAGE, at::MOTOR_LOAD, at::EXCITATION_CURRENT] {
            assert_eq!(drive.read(word).unwrap() > 0, load, "{name} {word:04X}h");
        }
        assert_eq!(drive.read(at::OUTPUT_CURRENT), Ok(0), "not remarked so");
        assert_eq!(drive.read(at::TRIP_OUTPUT_FREQUENCY), Ok(1_000));
    }
}

#[test]
fn the_factory_value_of_f603_trips_or_does_nothing_6_4_p_19() {
    for (name, trip) in [("coasts", Some(24)), ("runs-on", None)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "F603=4", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        drive.frame_seen(Cast::Unicast);
        settled(&mut drive);
        assert_eq!(drive.observe().trip, trip, "{name}");
    }
}

#[test]
fn the_time_out_acts_at_once_when_f803_is_written_6_4_p_19() {
    let mut drive = drive(&[]);
    drive.frame_seen(Cast::Unicast);
    write(&mut drive, at::TIME_OUT, 0).unwrap();
    settled(&mut drive);
    assert_eq!(drive.observe().trip, None);
    write(&mut drive, at::TIME_OUT, 1).unwrap();
    drive.advance(Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, Some(24));
}

#[test]
fn without_supply_of_the_motor_it_shows_moff_or_trips_8_6_p_34() {
    for (name, code, back) in [("alarm", 0, 1_000), ("trip", 30, 0)] {
        let mut drive = drive(&[]);
        reading(&mut drive, "undervoltage", name);
        write(&mut drive, at::COMMAND_WORD, BUS).unwrap();
        settled(&mut drive);
        drive.world(crate::Act::MotorSupply(false));
        assert!(!drive.observe().running && drive.observe().shaft_frequency > 0, "it coasts");
        assert_eq!((drive.read(FC90), drive.read(at::ALARM_CODE)), (Ok(code), Ok(0x2020)), "{name}");
        assert_eq!([2, 3, 14].map(|number| bit(&mut drive, number)), [true, true, false]);
        assert_eq!(settled(&mut drive), 0);
        drive.world(crate::Act::MotorSupply(true));
        assert_eq!(settled(&mut drive), back, "{name}");
    }
}

#[test]
fn the_address_acts_at_once_and_0_is_mute_6_1_p_11() {
    let mut drive = Atv21::new();
    drive.join(5, crate::Protocol::Rtu);
    assert_eq!((drive.own_address(), drive.read(at::ADDRESS)), (Some(5), Ok(5)));
    for address in [9, 0] {
        write(&mut drive, at::ADDRESS, address).unwrap();
        assert_eq!(drive.own_address().map(u16::from), Some(address));
    }
}

#[test]
fn a_supply_that_comes_back_finds_the_terminals_as_they_are_and_the_control_words_at_0_8_2_p_28() {
    let mut drive = drive(&[]);
    write(&mut drive, at::COMMAND_WORD, 0xC000).unwrap();
    terminal(&mut drive, "F", true);
    drive.power(false);
    let Observation { running, .. } = drive.observe();
    assert!(!running);
    assert_eq!(settled(&mut drive), 0, "nothing acts without supply");
    drive.power(true);
    assert!(!drive.listens());
    assert_eq!(settled(&mut drive), 5_000);
}

#[test]
fn a_block_is_written_whole_or_not_at_all_7_8_p_24() {
    let mut drive = drive(&[(at::WRITE_SLOT_1, 1), (at::WRITE_SLOT_2, 3)]);
    drive.power_cycle();
    drive.advance(SECOND);
    // FA00 = C400h, FA01 = 8001 of 8000.
    let request = [0x10, 0x18, 0x70, 0, 2, 4, 0xC4, 0x00, 0x1F, 0x41];
    assert_eq!(crate::pdu::answer(&mut drive, &request, Cast::Unicast), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(drive.read(at::COMMAND_WORD), Ok(0));
}

#[test]
fn every_switch_has_two_readings_and_a_section() {
    for switch in Atv21::new().surroundings().switches {
        assert_eq!(switch.readings.len(), 2, "{}", switch.name);
        assert!(switch.question.contains('§'), "{}", switch.name);
    }
}
