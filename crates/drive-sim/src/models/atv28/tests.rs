use drive_core::{Frequency, Percent};

use super::*;
use crate::{Block, Cast, Exception, Model, Panel, world::Act};

const SECOND: Duration = Duration::from_secs(1);

fn write(drive: &mut Atv28, address: u16, value: u16) -> Result<(), Exception> {
    drive.write(address, value, Cast::Unicast)
}

fn terminal(drive: &mut Atv28, name: &'static str, closed: bool) {
    drive.world(Act::Terminal(name, closed));
}

fn analog(drive: &mut Atv28, name: &'static str, percent: i16) {
    drive.world(Act::Analog(name, Percent::from_percent(percent)));
}

fn at(drive: &mut Atv28, seconds: u32) -> i32 {
    drive.advance(seconds * SECOND);
    drive.observe().output_frequency
}

fn running() -> Atv28 {
    let mut drive = Atv28::new();
    // The manual's own sample: 15 to W400, 200 to W401.
    write(&mut drive, 400, 15).unwrap();
    write(&mut drive, 401, 200).unwrap();
    drive.advance(3 * SECOND);
    drive
}

#[test]
fn at_power_up_operation_is_enabled_by_the_terminals_and_15_runs_at_once() {
    let mut drive = Atv28::new();
    assert_eq!((drive.read(458), drive.read(459)), (Ok(0x0627), Ok(0x0002)));
    assert!(!drive.observe().running);
    drive = running();
    assert_eq!((drive.read(451), drive.read(458)), (Ok(200), Ok(0x0627)));
    assert_eq!(drive.read(459).unwrap() & 0x6010, 0x4010, "the bus commands, the motor runs");
}

#[test]
fn the_block_of_the_manuals_sample_is_readable_and_what_is_not_listed_is_not() {
    let mut drive = running();
    for address in 450..=460 {
        assert!(drive.read(address).is_ok(), "{address}");
    }
    for address in [0, 403, 461, 463, 488, 616, 3201] {
        assert_eq!(drive.read(address), Err(Exception::ILLEGAL_ADDRESS), "{address}");
    }
    assert!(drive.check_read(Block { function: 3, first: 450, quantity: 7 }).is_ok());
}

#[test]
fn the_speed_words_show_the_same_machine_in_rpm() {
    let mut drive = running();
    assert_eq!((drive.read(605), drive.read(604)), (Ok(600), Ok(600)));
    write(&mut drive, 603, (-900_i16).cast_unsigned()).unwrap();
    drive.advance(10 * SECOND);
    assert_eq!(drive.read(451), Ok((-300_i16).cast_unsigned()));
    assert_eq!((drive.read(606), drive.read(608)), (Ok(0), Ok(1_500)));
    write(&mut drive, 608, 600).unwrap();
    assert_eq!(drive.read(250), Ok(200));
}

#[test]
fn a_configuration_register_waits_for_standstill_and_then_locks_the_drive() {
    let mut drive = running();
    assert_eq!(write(&mut drive, 53, 600), Err(Exception::FAILURE));
    write(&mut drive, 400, 0).unwrap();
    assert_eq!(write(&mut drive, 53, 600), Ok(()));
    assert_eq!(drive.read(458).unwrap() & 0x6F, 0x40);
    assert_eq!(write(&mut drive, 250, 5_001), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, 450, 0), Err(Exception::ILLEGAL_ADDRESS));
}

#[test]
fn a_trip_stands_in_lft_and_moves_on_to_the_history() {
    let mut drive = running();
    for code in [9, 18, 16] {
        drive.trip(code);
        write(&mut drive, 400, 0x80).unwrap();
        write(&mut drive, 400, 0).unwrap();
    }
    let codes = [457, 462, 464, 466, 468].map(|address| drive.read(address).unwrap());
    assert_eq!(codes, [16, 18, 9, 0, 0]);
    assert_eq!(drive.read(600), Ok(0x4210));
    assert_eq!(drive.read(458).unwrap() & 0x6F, 0x40);
}

#[test]
fn a_parameter_is_kept_through_a_power_cycle_and_a_command_is_not() {
    let mut drive = running();
    write(&mut drive, 252, 50).unwrap();
    drive.power_cycle();
    assert_eq!((drive.read(252), drive.read(400), drive.read(401)), (Ok(50), Ok(0), Ok(0)));
    assert_eq!(drive.observe().eeprom_writes, 1);
    drive.advance(SECOND);
    assert!(!drive.observe().running);
}

#[test]
fn a_silent_line_trips_nobody() {
    let mut drive = running();
    drive.frame_seen(Cast::Unicast);
    drive.advance(3_600 * SECOND);
    assert!(drive.observe().running);
}

// BBV51701 p. 35: its level L1 is "interchangeable with ATV28"; p. 15, 33, 42 for the inputs, p. 11 for the priority.
#[test]
fn the_terminals_command_until_the_bus_does_or_whenever_they_are_the_newest() {
    for (reading, ends_at) in [("bus", 2_000), ("newest", 3_000)] {
        let mut drive = Atv28::new();
        drive.world(Act::Reading("priority", reading));
        analog(&mut drive, "AI1", 50);
        terminal(&mut drive, "LI1", true);
        assert_eq!((at(&mut drive, 4), drive.read(ETI).unwrap() & 0x6000), (2_500, 0x0000));
        terminal(&mut drive, "LI3", true);
        assert_eq!(at(&mut drive, 4), 1_000, "SP2");
        terminal(&mut drive, "LI3", false);
        analog(&mut drive, "AI2", 10);
        assert_eq!((at(&mut drive, 4), drive.read(IOLR).unwrap() & 0x3F), (3_000, 0x01));
        write(&mut drive, LFR, 200).unwrap();
        write(&mut drive, CMD, 0x000F).unwrap();
        assert_eq!((at(&mut drive, 4), drive.read(ETI).unwrap() & 0x6000), (2_000, 0x4000));
        terminal(&mut drive, "LI1", false);
        terminal(&mut drive, "LI1", true);
        assert_eq!(at(&mut drive, 4), ends_at, "{reading}");
    }
}

// p. 33 of the twin: by level a run command that stands at power-up runs.
#[test]
fn a_run_input_that_is_on_at_power_up_runs_by_level_only() {
    for (reading, runs) in [("transition", false), ("level", true)] {
        let mut drive = Atv28::new();
        drive.world(Act::Reading("2-wire", reading));
        analog(&mut drive, "AI1", 50);
        terminal(&mut drive, "LI1", true);
        drive.power_cycle();
        assert_eq!(at(&mut drive, 4) > 0, runs, "{reading}");
    }
}

// p. 38 of the twin: with LCC the keys of the remote terminal command, and a run word of the bus does not.
#[test]
fn under_the_remote_terminal_a_run_word_does_nothing() {
    let mut drive = Atv28::new();
    write(&mut drive, LCC, 1).unwrap();
    write(&mut drive, LFR, 200).unwrap();
    write(&mut drive, CMD, 0x000F).unwrap();
    assert_eq!((at(&mut drive, 4), drive.read(ETI).unwrap() & 0x6000), (0, 0x2000));
    drive.panel(Panel::Reference(Frequency::from_hertz(30)));
    drive.panel(Panel::Run);
    assert_eq!(at(&mut drive, 4), 3_000);
    write(&mut drive, CMD, 0x0000).unwrap();
    assert_eq!(at(&mut drive, 4), 3_000);
    drive.panel(Panel::Stop);
    assert_eq!(at(&mut drive, 4), 0);
}

// p. 40 of the twin.
#[test]
fn an_injection_lasts_as_long_as_bit_13() {
    let mut drive = running();
    write(&mut drive, CMD, 0x200F).unwrap();
    drive.advance(600 * SECOND);
    assert_eq!(drive.read(ETI).unwrap() & 0x0020, 0x0020);
    write(&mut drive, CMD, 0x000F).unwrap();
    assert_eq!(at(&mut drive, 4), 2_000);
}

// p. 28 of the twin.
#[test]
fn after_its_time_at_low_speed_a_setpoint_starts_the_motor_again() {
    let mut drive = running();
    write(&mut drive, TLS, 20).unwrap();
    write(&mut drive, LFR, 0).unwrap();
    drive.advance(10 * SECOND);
    assert!(!drive.observe().running);
    write(&mut drive, LFR, 100).unwrap();
    assert_eq!(at(&mut drive, 4), 1_000);
}

#[test]
fn without_its_line_supply_it_trips_usf_until_the_supply_is_back() {
    let mut drive = running();
    drive.world(Act::MotorSupply(false));
    write(&mut drive, CMD, 0x0080).unwrap();
    assert_eq!((drive.observe().trip, drive.read(ULN)), (Some(USF), Ok(0)));
    drive.world(Act::MotorSupply(true));
    write(&mut drive, CMD, 0x0000).unwrap();
    write(&mut drive, CMD, 0x0080).unwrap();
    assert_eq!(drive.observe().trip, None);
}
