//! The simulated drive against its manual. The printed frames are in the tests of the family's crate, byte for byte.

mod world;

use std::time::Duration;

use super::*;
use crate::{Act, Cast, Exception, Model, Panel, pdu};

const SECOND: Duration = Duration::from_secs(1);
/// A number for "fault reset" that the manual does not print.
const RESET: u16 = 77;

fn drive() -> Drive3g3ev {
    let mut drive = Drive3g3ev::new().with_fault_reset_function(RESET);
    drive.poke(at::N07, RESET);
    drive
}

fn write(drive: &mut Drive3g3ev, address: u16, value: u16) {
    drive.write(address, value, Cast::Unicast).unwrap();
}

/// Running forward at 50 Hz.
fn running() -> Drive3g3ev {
    let mut drive = drive();
    write(&mut drive, at::REFERENCE, 500);
    write(&mut drive, at::COMMAND, 1);
    drive.advance(3 * SECOND);
    assert_eq!(drive.observe().output_frequency, 5_000);
    drive
}

fn ask(drive: &mut Drive3g3ev, request: &[u8], cast: Cast) -> Result<Vec<u8>, Exception> {
    pdu::answer(drive, request, cast)
}

#[test]
fn the_ramps_are_n20_and_a_stop_keeps_run_until_the_motor_stands() {
    let mut drive = drive();
    write(&mut drive, at::N20, 20);
    write(&mut drive, at::REFERENCE, 600);
    write(&mut drive, at::COMMAND, 3);
    drive.advance(SECOND);
    assert_eq!(
        (drive.read(at::OUTPUT_FREQUENCY), drive.read(at::SIGNALS).map(|word| word & 3)),
        (Ok(300), Ok(3))
    );
    drive.advance(SECOND);
    assert_eq!(drive.observe().output_frequency, -6_000);
    write(&mut drive, at::COMMAND, 0);
    drive.advance(SECOND);
    assert_eq!(
        (drive.read(at::OUTPUT_FREQUENCY), drive.read(at::STATE).map(|word| word & 1)),
        (Ok(300), Ok(1))
    );
    drive.advance(SECOND);
    assert_eq!(drive.read(at::SIGNALS), Ok(0x84));
    assert_eq!(drive.read(at::STATE), Ok(0x0152), "zero speed, below n53, ready, output off");
}

#[test]
fn more_than_eight_registers_an_unknown_function_and_function_06_are_refused() {
    let mut drive = drive();
    let mut refused = |request: &[u8]| ask(&mut drive, request, Cast::Unicast).unwrap_err();
    assert_eq!(refused(&[0x03, 0, 0x20, 0, 9]), Exception(3));
    assert_eq!(refused(&[0x03, 0, 0x20, 0, 0]), Exception(3));
    assert_eq!(refused(&[0x06, 0, 1, 0, 1]), Exception(1));
    assert_eq!(refused(&[0x04, 0, 0x20, 0, 1]), Exception(1));
    assert_eq!(
        refused(&[0x10, 0, 2, 0, 1, 4, 0, 1, 0, 1]),
        Exception(3),
        "byte count is not twice the quantity"
    );
    let nine = [&[0x10, 1, 1, 0, 9, 18][..], &[0; 18]].concat();
    assert_eq!(refused(&nine), Exception(3));
}

#[test]
fn each_error_of_section_4_4_has_its_cause() {
    let mut drive = running();
    assert_eq!(drive.read(at::ENTER), Err(Exception(0x02)), "ENTER is read");
    for address in [0x0000, 0x0004, 0x0008, 0x0100, 0x0145, 0x0901] {
        assert_eq!(drive.read(address), Err(Exception(0x02)), "{address:04X}h");
        assert_eq!(drive.write(address, 0, Cast::Unicast), Err(Exception(0x02)), "{address:04X}h");
    }
    assert_eq!(drive.write(at::VF_GAIN, 19, Cast::Unicast), Err(Exception(0x21)));
    assert_eq!(drive.write(at::VF_GAIN, 2_001, Cast::Unicast), Err(Exception(0x21)));
    assert_eq!(drive.read(at::LINK), Ok(0x08), "limit exceeded");
    assert_eq!(drive.write(at::VF_GAIN, 2_000, Cast::Unicast), Ok(()));
    assert_eq!(drive.read(at::LINK), Ok(0));
    assert_eq!(drive.write(at::REFERENCE, 601, Cast::Unicast), Err(Exception(0x21)));
    assert_eq!(drive.write(at::OUTPUT_FREQUENCY, 1, Cast::Unicast), Err(Exception(0x22)), "read only");
    assert_eq!(drive.write(at::N39, 1, Cast::Unicast), Err(Exception(0x22)), "a constant during run");
    assert_eq!(drive.write(at::N20, 20, Cast::Unicast), Ok(()), "§6 changes n20 during run");
    drive.trip(0xC);
    drive.advance(60 * SECOND);
    assert_eq!(
        drive.write(at::N39, 1, Cast::Unicast),
        Err(Exception(0x22)),
        "a constant during undervoltage"
    );
}

#[test]
fn a_block_is_written_whole_or_not_at_all() {
    let mut drive = drive();
    let request = [0x10, 0, 1, 0, 3, 6, 0, 1, 2, 0x58, 0xFF, 0xFF];
    assert_eq!(ask(&mut drive, &request, Cast::Unicast), Err(Exception(0x21)));
    assert_eq!(
        (drive.read(at::COMMAND), drive.read(at::REFERENCE), drive.read(at::VF_GAIN)),
        (Ok(0), Ok(0), Ok(1_000))
    );
}

#[test]
fn a_broadcast_has_its_own_bits_registers_and_unit() {
    let mut drive = drive();
    let say = |drive: &mut Drive3g3ev, address, value| drive.write(address, value, Cast::Broadcast);
    assert_eq!(say(&mut drive, 2, 15_000), Ok(()));
    assert_eq!(drive.read(at::REFERENCE), Ok(300), "50 % of 60 Hz in the unit of n39");
    assert_eq!(say(&mut drive, 1, 1), Ok(()));
    drive.advance(3 * SECOND);
    assert_eq!(drive.observe().output_frequency, 3_000);
    for address in [3, 9, 0x0900, 0x0114] {
        assert_eq!(say(&mut drive, address, 0), Err(Exception(2)), "{address}");
    }
    assert_eq!(say(&mut drive, 1, 1 << 4), Ok(()));
    assert_eq!((drive.read(at::ERRORS), drive.observe().running), (Ok(0x80), false));
    assert_eq!(say(&mut drive, 1, 1 << 5), Ok(()));
    assert_eq!(drive.read(at::ERRORS), Ok(0));
    drive.advance(3 * SECOND);
    assert!(!drive.observe().running);
}

#[test]
fn a_fault_is_reset_by_the_rising_edge_of_the_input_that_is_set_to_it() {
    let mut drive = running();
    drive.trip(0);
    assert_eq!(drive.read(at::SIGNALS).map(|word| word & 0xF), Ok(8));
    assert_eq!(drive.read(at::STATE).map(|word| word >> 0xE & 1), Ok(1));
    for word in [1, 1 << 4, 1 << 6] {
        write(&mut drive, at::COMMAND, word);
        assert_eq!(drive.read(at::ERRORS), Ok(1), "{word:04X}h");
    }
    write(&mut drive, at::COMMAND, 1 << 5);
    assert_eq!(drive.read(at::ERRORS), Ok(0));
    drive.trip(0);
    write(&mut drive, at::COMMAND, 1 << 5);
    assert_eq!(drive.read(at::ERRORS), Ok(1), "it was set already");
}

#[test]
fn a_run_command_that_was_held_through_a_fault_does_not_act_after_its_reset() {
    let mut drive = running();
    drive.trip(0);
    write(&mut drive, at::COMMAND, 1 | 1 << 5);
    drive.advance(10 * SECOND);
    assert_eq!((drive.read(at::ERRORS), drive.observe().running), (Ok(0), false));
    write(&mut drive, at::COMMAND, 0);
    write(&mut drive, at::COMMAND, 1);
    assert!(drive.observe().running);
}

#[test]
fn every_fault_has_its_bit_and_the_lowest_is_observed() {
    let mut drive = drive();
    for bit in (0..16).rev() {
        drive.trip(bit);
        assert_eq!(drive.observe().trip, Some(bit));
    }
    assert_eq!(drive.read(at::ERRORS), Ok(0xFFFF));
    drive.trip(16);
    assert_eq!(drive.read(at::ERRORS), Ok(0xFFFF));
}

#[test]
fn two_seconds_without_a_frame_trip_with_bus() {
    let mut drive = running();
    drive.advance(10 * SECOND);
    assert_eq!(drive.observe().trip, None, "no frame has come yet");
    drive.frame_seen(Cast::Unicast);
    drive.advance(2 * SECOND - Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, None);
    drive.advance(Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, Some(0xE));
    assert_eq!((drive.read(at::ERRORS), drive.read(at::LINK_ERROR)), (Ok(0x4000), Ok(0x40)));
    assert_eq!(drive.read(at::STATE).map(|word| word >> 0xE), Ok(3));
}

#[test]
fn the_parameters_of_section_2_1_act_at_the_next_power_up() {
    let mut drive = drive();
    write(&mut drive, at::N40, 1);
    write(&mut drive, at::N39, 1);
    write(&mut drive, at::ENTER, 0);
    write(&mut drive, at::REFERENCE, 500);
    assert_eq!(drive.read(at::REFERENCE_SEEN), Ok(500));
    drive.frame_seen(Cast::Unicast);
    drive.advance(2 * SECOND);
    assert_eq!(drive.observe().trip, Some(0xE));
    drive.power_cycle();
    write(&mut drive, at::REFERENCE, 5_009);
    assert_eq!(
        drive.read(at::REFERENCE_SEEN),
        Ok(5_000),
        "0.01 Hz, of which the drive keeps the first decimal"
    );
    drive.frame_seen(Cast::Unicast);
    drive.advance(60 * SECOND);
    assert_eq!(drive.observe().trip, None);
}

#[test]
fn percent_counts_of_the_reference() {
    for (unit, full) in [(2, 30_000), (3, 1_000)] {
        let mut drive = drive();
        drive.poke(at::N39, unit);
        drive.power_cycle();
        write(&mut drive, at::REFERENCE, full / 2);
        write(&mut drive, at::COMMAND, 1);
        drive.advance(3 * SECOND);
        assert_eq!(
            (drive.read(at::OUTPUT_FREQUENCY), drive.observe().output_frequency),
            (Ok(full / 2), 3_000)
        );
        assert_eq!(drive.write(at::REFERENCE, full + full / 100, Cast::Unicast), Err(Exception(0x21)));
    }
}

#[test]
fn what_was_not_saved_is_lost_at_power_off() {
    let mut drive = drive();
    let before = drive.observe().eeprom_writes;
    write(&mut drive, at::N20, 40);
    drive.power_cycle();
    assert_eq!(drive.read(at::N20), Ok(30));
    write(&mut drive, at::N20, 40);
    write(&mut drive, at::ENTER, 0);
    drive.power_cycle();
    assert_eq!((drive.read(at::N20), drive.observe().eeprom_writes - before), (Ok(40), 1));
}

#[test]
fn n02_decides_whose_run_command_and_reference_count() {
    for (mode, local_run, local_reference) in
        [(0, 1, 1), (1, 1, 1), (2, 0, 1), (3, 1, 1), (4, 1, 0), (5, 0, 0)]
    {
        let mut drive = drive();
        drive.poke(at::N02, mode);
        drive.power_cycle();
        write(&mut drive, at::COMMAND, 1);
        assert_eq!(
            drive.read(at::STATE).map(|word| (word >> 0xA & 1, word >> 9 & 1)),
            Ok((local_run, local_reference))
        );
        assert_eq!(drive.observe().running, local_run == 0, "n02 = {mode}");
    }
}

#[test]
fn reverse_is_not_obeyed_where_n05_forbids_it() {
    let mut drive = drive();
    write(&mut drive, at::N05, 1);
    write(&mut drive, at::REFERENCE, 500);
    write(&mut drive, at::COMMAND, 3);
    drive.advance(SECOND);
    assert!(!drive.observe().running);
    assert_eq!(drive.read(at::SIGNALS).map(|word| word & 0x14), Ok(0x10), "OP6: data error, not ready");
}

#[test]
fn contradictory_parameters_are_a_data_error() {
    for (address, value) in [(0x0107, 1), (0x012A, 1), (0x0139, 1), (0x013A, 1)] {
        let mut drive = drive();
        write(&mut drive, address, value);
        write(&mut drive, at::COMMAND, 1);
        assert_eq!(drive.read(at::SIGNALS).map(|word| word & 0x15), Ok(0x10), "{address:04X}h");
    }
}

#[test]
fn outputs_follow_0009h_where_n09_and_n10_are_15() {
    let mut drive = drive();
    write(&mut drive, at::OUTPUTS, 3);
    assert_eq!(
        (drive.read(at::OUTPUT_CONTACTS), drive.read(at::SIGNALS).map(|word| word & 0x60)),
        (Ok(0), Ok(0))
    );
    write(&mut drive, at::N10, 15);
    assert_eq!(
        (drive.read(at::OUTPUT_CONTACTS), drive.read(at::SIGNALS).map(|word| word & 0x60)),
        (Ok(2), Ok(0x40))
    );
    write(&mut drive, at::N09, 15);
    assert_eq!(
        (drive.read(at::OUTPUT_CONTACTS), drive.read(at::SIGNALS).map(|word| word & 0x60)),
        (Ok(3), Ok(0x60))
    );
}

#[test]
fn reserved_registers_answer_0_or_an_exception() {
    let reserved = (0x25..=0x26).chain(0x29..=0x2A).chain(0x2E..=0x30).chain(0x32..=0x3C).chain(0x3E..=0xFF);
    let (mut zero, mut refusing) = (drive(), drive().refusing_reserved());
    for address in reserved {
        assert_eq!(zero.read(address), Ok(0));
        assert_eq!(refusing.read(address), Err(Exception(2)));
    }
}

#[test]
fn the_panel_takes_the_motor_and_its_stop_key_stops_it() {
    let mut drive = running();
    drive.panel(Panel::TakeControl);
    assert_eq!(drive.read(at::STATE).map(|word| word >> 9 & 3), Ok(3));
    drive.advance(10 * SECOND);
    assert!(!drive.observe().running);
    drive.panel(Panel::ReleaseControl);
    drive.advance(SECOND);
    assert!(!drive.observe().running, "the old run command does not act again by itself");
    let mut drive = running();
    drive.panel(Panel::Stop);
    drive.advance(10 * SECOND);
    assert!(!drive.observe().running);
}
