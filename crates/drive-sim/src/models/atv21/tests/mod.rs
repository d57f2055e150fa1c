//! The simulated Altivar 21 against its manual, section by section. The printed frames are in the tests of
//! `drive-atv21`.

mod world;

use std::time::Duration;

use drive_atv21::{blocks, registers::address as at};

use super::Atv21;
use crate::{Exception, Model, Panel};

const SECOND: Duration = Duration::from_secs(1);

/// A drive that the bus commands, with the blocks of the manual's examples in effect; they outlive a power cycle.
fn with_blocks() -> Atv21 {
    let mut drive = Atv21::new().with_blocks();
    drive.poke(at::COMMAND_MODE, 2);
    drive.poke(at::REFERENCE_MODE, 4);
    drive.power_cycle();
    drive.advance(SECOND);
    drive
}

fn at_60_hertz() -> Atv21 {
    let mut drive = with_blocks();
    for (address, value) in
        [(at::UPPER_LIMIT, 6_000), (at::FREQUENCY_REFERENCE, 6_000), (at::COMMAND_WORD, 0x0400)]
    {
        assert!(drive.poke(address, value));
    }
    drive.advance(Duration::from_secs(60));
    drive
}

#[test]
fn identification_as_in_7_9() {
    let mut drive = Atv21::new();
    for code in 1..=3 {
        let answer = drive.other(&[0x2B, 0x0E, code, 0x00]).unwrap();
        assert_eq!(answer[..7], [0x2B, 0x0E, code, 0x01, 0x00, 0x00, 0x03]);
        // Address, function and CRC make it the 45 bytes that the manual counts.
        assert_eq!(answer.len() + 3, 45);
        assert_eq!(answer[7..9], [0x00, 0x0D]);
        assert_eq!(answer[22..24], [0x01, 0x0C]);
        assert_eq!(&answer[24..36], b"ATV21H075M3X");
        assert_eq!(answer[36..38], [0x02, 0x04]);
        assert_eq!(&answer[38..], b"0201");
    }
    assert_eq!(drive.other(&[0x2B, 0x0D, 1, 0]), Err(Exception::ILLEGAL_FUNCTION));
    assert_eq!(drive.other(&[0x2B, 0x0E, 4, 0]), Err(Exception::ILLEGAL_VALUE));
}

fn write(drive: &mut Atv21, address: u16, value: u16) -> Result<(), Exception> {
    drive.write(address, value, crate::Cast::Unicast)
}

#[test]
fn a_monitored_word_cannot_be_written_and_a_range_is_kept_7_10() {
    let mut drive = Atv21::new();
    assert_eq!(write(&mut drive, at::OUTPUT_FREQUENCY, 0), Err(Exception::ILLEGAL_ADDRESS));
    assert_eq!(write(&mut drive, at::SPEED_REFERENCE, 24_001), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, at::ANALOG_OUTPUT_COMMAND, 1_024), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, at::FREQUENCY_REFERENCE, 8_001), Err(Exception::ILLEGAL_VALUE), "above FH");
    assert_eq!(write(&mut drive, at::TIME_OUT, 101), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, at::FREQUENCY_REFERENCE, 8_000), Ok(()));
}

#[test]
fn the_block_configuration_takes_effect_after_a_reset_6_3() {
    let mut drive = Atv21::new();
    write(&mut drive, at::READ_SLOT_1, 2).unwrap();
    drive.poke(at::ALARM_CODE, 4);
    assert_eq!(drive.read(blocks::READ_BLOCK), Ok(0));
    drive.power_cycle();
    drive.advance(SECOND);
    drive.poke(at::FREQUENCY_REFERENCE, 1_000);
    write(&mut drive, at::COMMAND_WORD, 0xC400).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!(drive.read(blocks::READ_BLOCK), Ok(1_000));
    assert_eq!(drive.observe().eeprom_writes, 1);
}

#[test]
fn the_terminals_command_until_the_priority_is_set_6_2() {
    let mut drive = Atv21::new();
    write(&mut drive, at::FREQUENCY_REFERENCE, 3_000).unwrap();
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert!(!drive.observe().running, "CMOD = 0");
    write(&mut drive, at::COMMAND_WORD, 0xC600).unwrap();
    drive.advance(SECOND * 20);
    assert_eq!(drive.observe().output_frequency, -3_000);
    assert_eq!((drive.read(at::COMMAND_SOURCE), drive.read(at::REFERENCE_SOURCE)), (Ok(2), Ok(4)));
    assert_eq!(drive.read(at::STATUS_WORD), Ok(0x6600));
    // Inputs F on and the priority gone: the terminals run it at what VIA says.
    drive.poke(at::LOGIC_INPUTS, 0x0001);
    drive.poke(at::ANALOG_INPUT_VIA, 1_023);
    write(&mut drive, at::COMMAND_WORD, 0).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!(drive.observe().output_frequency, 5_000);
    assert_eq!((drive.read(at::COMMAND_SOURCE), drive.read(at::REFERENCE_SOURCE)), (Ok(0), Ok(1)));
}

#[test]
fn input_r_forces_local_control_where_f112_says_so_6_2() {
    let mut drive = with_blocks();
    write(&mut drive, at::INPUT_R_FUNCTION, 48).unwrap();
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert!(drive.observe().running);
    drive.poke(at::LOGIC_INPUTS, 0x0002);
    assert_eq!(drive.read(at::COMMAND_SOURCE), Ok(0));
    assert_eq!(drive.read(at::STATUS_WORD).unwrap() & 0x8400, 0x8000);
}

#[test]
fn a_preset_speed_overrides_the_reference_8_4() {
    let mut drive = with_blocks();
    write(&mut drive, at::FREQUENCY_REFERENCE, 3_000).unwrap();
    write(&mut drive, at::COMMAND_WORD, 0x0402).unwrap();
    drive.advance(SECOND * 20);
    assert_eq!(drive.read(at::REFERENCE_SOURCE), Ok(255));
    assert_eq!(drive.observe().output_frequency, 1_000);
}

#[test]
fn the_time_out_starts_with_the_first_frame_and_trips_err5_6_4() {
    for (reaction, running) in [(0, false), (1, true), (2, true), (4, false)] {
        let mut drive = at_60_hertz();
        drive.poke(at::TIME_OUT_REACTION, reaction);
        drive.advance(SECOND * 100);
        assert_eq!(drive.observe().trip, None, "no frame yet");
        drive.frame_seen(crate::Cast::Unicast);
        drive.advance(SECOND * 3 - Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, None);
        drive.advance(Duration::from_millis(10));
        assert_eq!(drive.observe().trip, Some(24));
        assert_eq!(drive.observe().running, running, "F603 = {reaction}");
        assert_eq!((drive.read(at::FAULT_CODE), drive.read(at::PAST_FAULT_1)), (Ok(24), Ok(24)));
        // Just before the trip it ran at 60 Hz.
        assert_eq!(
            (drive.read(at::TRIP_OUTPUT_FREQUENCY), drive.read(at::TRIP_STATUS_WORD)),
            (Ok(6_000), Ok(0x6400))
        );
        drive.advance(SECOND * 30);
        assert!(!drive.observe().running);
    }
}

#[test]
fn a_reset_restarts_the_drive_and_clears_the_control_registers_8_2() {
    let mut drive = at_60_hertz();
    write(&mut drive, at::COMMAND_WORD, 0x1400).unwrap();
    assert_eq!(drive.observe().trip, Some(17));
    assert_eq!(drive.read(at::STATUS_WORD).unwrap() & 0x5003, 0x1003);
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert!(!drive.observe().running, "a trip does not go away by itself");
    write(&mut drive, at::COMMAND_WORD, 0x2000).unwrap();
    assert!(!drive.listens());
    drive.advance(SECOND * 2);
    assert!(drive.listens());
    assert_eq!(drive.observe().trip, None);
    assert_eq!((drive.read(at::COMMAND_WORD), drive.read(at::FREQUENCY_REFERENCE)), (Ok(0), Ok(0)));
}

#[test]
fn dc_braking_lasts_as_long_as_its_bit_and_freewheel_lets_go_8_4() {
    let mut drive = at_60_hertz();
    write(&mut drive, at::COMMAND_WORD, 0x0080).unwrap();
    drive.advance(SECOND * 60);
    assert!(drive.observe().running, "direct current flows on at rest");
    assert_eq!(drive.read(at::STATUS_WORD).unwrap() & 0x0480, 0x0080);
    write(&mut drive, at::COMMAND_WORD, 0x0000).unwrap();
    assert!(!drive.observe().running);
    write(&mut drive, at::COMMAND_WORD, 0x0800).unwrap();
    assert_eq!(drive.read(at::STATUS_WORD).unwrap() & 0x0800, 0x0800);
}

#[test]
fn command_word_2_resets_the_energy_and_chooses_the_stall_level_8_4() {
    let mut drive = at_60_hertz();
    drive.advance(SECOND * 36_000);
    assert_eq!(drive.read(at::OUTPUT_ENERGY), Ok(751), "ten hours at rated power, and a minute");
    write(&mut drive, at::COMMAND_WORD_2, 0x0002).unwrap();
    assert_eq!((drive.read(at::OUTPUT_ENERGY), drive.read(at::STATUS_WORD_2)), (Ok(0), Ok(0x0002)));
    write(&mut drive, at::COMMAND_WORD_2, 0x1000).unwrap();
    assert_eq!(drive.read(at::STATUS_WORD_2), Ok(0), "without the command priority");
    write(&mut drive, at::COMMAND_WORD, 0xC400).unwrap();
    assert_eq!(drive.read(at::STATUS_WORD_2), Ok(0x1000));
}

#[test]
fn the_keypad_takes_control_and_the_order_of_the_bus_does_not_come_back_with_it() {
    let mut drive = at_60_hertz();
    drive.panel(Panel::TakeControl);
    drive.advance(SECOND * 60);
    assert!(!drive.observe().running);
    assert_eq!(
        (drive.read(at::COMMAND_SOURCE), drive.read(at::STATUS_WORD).unwrap() & 0x8000),
        (Ok(1), 0x8000)
    );
    drive.panel(Panel::ReleaseControl);
    assert!(!drive.observe().running);
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    assert!(drive.observe().running);
}

#[test]
fn speed_and_frequency_are_converted_by_the_poles_8_3_8_5() {
    let mut drive = with_blocks();
    write(&mut drive, at::SPEED_REFERENCE, 1_500).unwrap();
    write(&mut drive, at::COMMAND_WORD, 0x0400).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!((drive.read(at::OUTPUT_FREQUENCY), drive.read(at::OUTPUT_SPEED)), (Ok(5_000), Ok(1_500)));
}
