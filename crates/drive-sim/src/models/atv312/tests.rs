mod channels;
mod faults;
mod stops;

use drive_core::Percent;

use super::*;
use crate::Block;

const SECOND: Duration = Duration::from_secs(1);

fn write(drive: &mut Atv312, address: u16, value: u16) -> Result<(), Exception> {
    drive.write(address, value, Cast::Unicast)
}

fn state(drive: &mut Atv312) -> u16 {
    drive.read(3201).unwrap() & 0x6F
}

fn terminal(drive: &mut Atv312, name: &'static str, closed: bool) {
    drive.world(Act::Terminal(name, closed));
}

fn analog(drive: &mut Atv312, name: &'static str, percent: i16) {
    drive.world(Act::Analog(name, Percent::from_percent(percent)));
}

fn read_as(drive: &mut Atv312, name: &'static str, reading: &'static str) {
    assert!(drive.surroundings().reading(name, reading).is_ok());
    drive.world(Act::Reading(name, reading));
}

/// Up the chart, with a reference in tenths of a hertz.
fn start(drive: &mut Atv312, reference: u16) {
    write(drive, LFR, reference).unwrap();
    for word in [0x0006, 0x0007, 0x000F] {
        write(drive, CMD, word).unwrap();
    }
}

/// Set up for the bus, climbed up the chart, at 50 Hz.
fn running() -> Atv312 {
    let mut drive = Atv312::under_bus_control();
    for word in [0x0006, 0x0007, 0x000F] {
        write(&mut drive, 8501, word).unwrap();
    }
    write(&mut drive, 8502, 500).unwrap();
    drive.advance(4 * SECOND);
    drive
}

fn stopped() -> Atv312 {
    Atv312::under_bus_control()
}

#[test]
fn at_level_l3_it_comes_up_locked_and_follows_the_chart() {
    let mut drive = stopped();
    assert_eq!(drive.read(3201), Ok(0x0240));
    write(&mut drive, 8501, 0x000F).unwrap();
    assert_eq!(state(&mut drive), 0x40, "000Fh alone does nothing here");
    for (word, eta) in [(0x0006, 0x21), (0x0007, 0x23), (0x000F, 0x27)] {
        write(&mut drive, 8501, word).unwrap();
        assert_eq!(state(&mut drive), eta);
    }
}

#[test]
fn from_the_factory_the_terminals_command_until_the_bus_does() {
    let mut drive = Atv312::new();
    assert_eq!(state(&mut drive), 0x27);
    assert_eq!(drive.read(3206).unwrap() & 0x6000, 0x0000);
    write(&mut drive, 8502, 300).unwrap();
    write(&mut drive, 8501, 0x000F).unwrap();
    drive.advance(4 * SECOND);
    assert_eq!(drive.read(3202), Ok(300));
    assert_eq!(drive.read(3206).unwrap() & 0x6000, 0x4000);
}

#[test]
fn the_examples_of_page_10_come_out_as_printed() {
    let mut drive = running();
    assert_eq!(drive.read(3201), Ok(0x0627), "forward, speed reached");
    write(&mut drive, 8501, 0x080F).unwrap();
    drive.advance(SECOND);
    assert_eq!(drive.read(3201), Ok(0x0227), "still forward, decelerating");
    drive.advance(4 * SECOND);
    assert_eq!(drive.read(3201), Ok(0x8227), "reverse, accelerating");
    drive.advance(2 * SECOND);
    assert_eq!(drive.read(3201), Ok(0x8627), "reverse, speed reached");
    write(&mut drive, 8501, 0x100F).unwrap();
    drive.advance(4 * SECOND);
    assert_eq!(drive.read(3201), Ok(0x0627), "normal stop");
}

#[test]
fn every_row_is_readable_and_what_is_not_listed_is_not() {
    let mut drive = stopped();
    for row in ROWS {
        assert!(drive.read(row.address).is_ok(), "{}", row.code);
    }
    for address in [0, 1, 452, 460, 463, 3000, 3208, 5241, 8400, 65535] {
        assert_eq!(drive.read(address), Err(Exception::ILLEGAL_ADDRESS), "{address}");
    }
}

#[test]
fn the_addresses_of_an_altivar_28_reach_the_same_registers() {
    let mut drive = running();
    assert_eq!(drive.read(458), drive.read(3201));
    assert_eq!(drive.read(451), Ok(500));
    write(&mut drive, 252, 77).unwrap();
    assert_eq!(drive.read(9001), Ok(77));
    assert_eq!(aliases::resolve(991), 64003);
    for alias in 0..1_000 {
        let own = aliases::resolve(alias);
        assert!(own == alias || ROWS.iter().any(|row| row.address == own), "{alias}");
    }
}

#[test]
fn a_configuration_parameter_waits_for_standstill_and_then_locks_the_drive() {
    let mut drive = running();
    assert_eq!(write(&mut drive, 3103, 700), Err(Exception::FAILURE));
    assert_eq!(write(&mut drive, 9001, 20), Ok(()), "an adjustment parameter does not wait");
    write(&mut drive, 8501, 0x0007).unwrap();
    drive.advance(5 * SECOND);
    assert_eq!(state(&mut drive), 0x23);
    assert_eq!(write(&mut drive, 3103, 700), Ok(()));
    assert_eq!(state(&mut drive), 0x40);
}

#[test]
fn stops_at_level_l3_need_their_assignment() {
    for (assignment, word) in [(11203, 0x200F), (11204, 0x400F)] {
        let mut drive = stopped();
        write(&mut drive, assignment, 0).unwrap();
        for word in [0x0006, 0x0007, 0x000F] {
            write(&mut drive, 8501, word).unwrap();
        }
        write(&mut drive, 8502, 500).unwrap();
        drive.advance(4 * SECOND);
        write(&mut drive, 8501, word).unwrap();
        drive.advance(4 * SECOND);
        assert_eq!(drive.read(3202), Ok(500), "{word:04X}h does nothing");
        let mut drive = running();
        write(&mut drive, 8501, word).unwrap();
        drive.advance(4 * SECOND);
        assert_eq!(
            (drive.read(3202), state(&mut drive)),
            (Ok(0), 0x27),
            "{word:04X}h stops and keeps enabled"
        );
    }
}

#[test]
fn after_a_quick_stop_only_disabling_the_voltage_leads_on() {
    let mut drive = running();
    write(&mut drive, 8501, 0x0002).unwrap();
    assert_eq!(state(&mut drive), 0x07);
    drive.advance(2 * SECOND);
    write(&mut drive, 8501, 0x000F).unwrap();
    assert_eq!(state(&mut drive), 0x07);
    write(&mut drive, 8501, 0x0000).unwrap();
    assert_eq!(state(&mut drive), 0x40);
}

#[test]
fn a_bit_that_is_assigned_to_preset_speeds_no_longer_reverses() {
    let mut drive = stopped();
    write(&mut drive, 11401, 171).unwrap();
    for word in [0x0006, 0x0007, 0x080F] {
        write(&mut drive, 8501, word).unwrap();
    }
    write(&mut drive, 8502, 500).unwrap();
    drive.advance(5 * SECOND);
    assert_eq!(drive.read(3202), Ok(100), "SP2, forward");
}

#[test]
fn level_l3_changes_what_stands_in_the_manual_and_is_left_by_a_factory_setting_only() {
    let mut drive = Atv312::new();
    assert_eq!(write(&mut drive, 8413, 164), Err(Exception::ILLEGAL_VALUE), "Mdb needs L3");
    write(&mut drive, 8413, 2).unwrap();
    write(&mut drive, 3006, 2).unwrap();
    assert_eq!(drive.read(8413), Ok(1));
    write(&mut drive, 8413, 164).unwrap();
    assert_eq!(write(&mut drive, 3006, 0), Err(Exception::ILLEGAL_VALUE));
    write(&mut drive, 6005, 30).unwrap();
    write(&mut drive, 8504, 1).unwrap();
    assert_eq!((drive.read(3006), drive.read(8413), drive.read(8504)), (Ok(0), Ok(1), Ok(0)));
    assert_eq!(drive.read(6005), Ok(30), "communication parameters stay");
}

#[test]
fn values_exclude_each_other_as_printed() {
    let mut drive = stopped();
    for (address, value) in [
        (3105, 501),  // LSP above HSP
        (3104, 601),  // HSP above tFr
        (9006, 91),   // tA2 above 100 - tA1
        (7122, 1),    // Atr without 2-wire level control
        (11910, 129), // Pr4 before Pr2
        (8002, 11),   // FIL1 without the remote terminal
        (9201, 62),   // CLI above 1.5 In
        (9601, 501),  // UnS of an N4
        (7010, 2),    // SLL is none of its list
        (64003, 1),   // LCC at L3
    ] {
        assert_eq!(write(&mut drive, address, value), Err(Exception::ILLEGAL_VALUE), "W{address} = {value}");
    }
    write(&mut drive, 11102, 0).unwrap();
    assert_eq!(write(&mut drive, 7122, 1), Ok(()));
    write(&mut drive, 10001, 2).unwrap();
    assert_eq!((drive.read(9003), drive.read(9611)), (Ok(0), Ok(1)), "bLC forces brA and OPL");
    write(&mut drive, 9611, 2).unwrap();
    assert_eq!(drive.read(10001), Ok(0), "OPL = OAC forces bLC");
    write(&mut drive, 3015, 1).unwrap();
    assert_eq!([3103, 3104, 9602, 11003].map(|w| drive.read(w)), [Ok(720), Ok(600), Ok(600), Ok(600)]);
}

#[test]
fn a_silent_line_trips_slf_after_tto_unless_nto_or_sll_say_no() {
    for (setting, trips) in [(None, true), (Some((7010, 0)), false), (Some((8504, 1 << 14)), false)] {
        let mut drive = stopped();
        if let Some((address, value)) = setting {
            write(&mut drive, address, value).unwrap();
        }
        drive.frame_seen(Cast::Unicast);
        drive.advance(Duration::from_millis(9_999));
        assert_eq!(drive.observe().trip, None);
        drive.advance(Duration::from_millis(1));
        assert_eq!(drive.observe().trip, trips.then_some(5), "{setting:?}");
    }
}

#[test]
fn a_fault_goes_to_the_history_with_the_state_at_the_time() {
    let mut drive = running();
    drive.trip(9);
    assert_eq!((drive.read(7121), drive.read(8606), state(&mut drive)), (Ok(9), Ok(0x2310), 0x08));
    write(&mut drive, 8501, 0x0080).unwrap();
    write(&mut drive, 8501, 0x0000).unwrap();
    assert_eq!((drive.read(7121), state(&mut drive)), (Ok(9), 0x40), "LFt stays after the reset");
    drive.power_cycle();
    assert_eq!(drive.read(7121), Ok(9), "and after the supply was off");
    drive.trip(17);
    assert_eq!((drive.read(7121), drive.read(7201)), (Ok(17), Ok(9)));
    let at_trip = drive.read(7211).unwrap();
    assert_eq!(at_trip & 0x6027, 0x4023, "ready, no emergency stop, running, by Modbus: {at_trip:04X}h");
}

#[test]
fn parameters_last_only_after_a_save_that_takes_its_time() {
    let mut drive = stopped();
    write(&mut drive, 9001, 99).unwrap();
    drive.power_cycle();
    assert_eq!(drive.read(9001), Ok(30));
    write(&mut drive, 9001, 99).unwrap();
    let before = drive.observe().eeprom_writes;
    write(&mut drive, 8504, 2).unwrap();
    assert_eq!((drive.read(8504), drive.read(3206).unwrap() & 1), (Ok(0), 1));
    assert_eq!(write(&mut drive, 9001, 50), Err(Exception::FAILURE), "not while it saves");
    drive.advance(SECOND);
    assert_eq!(drive.read(3206).unwrap() & 1, 0);
    assert_eq!(drive.observe().eeprom_writes, before + 1);
    drive.power_cycle();
    assert_eq!(drive.read(9001), Ok(99));
}

#[test]
fn with_an_undervoltage_nothing_is_saved() {
    let mut drive = stopped();
    drive.trip(22);
    write(&mut drive, 8504, 2).unwrap();
    assert_eq!((drive.read(8504), drive.read(3206).unwrap() & 1), (Ok(2), 0));
}

#[test]
fn a_configuration_is_put_aside_and_comes_back() {
    let mut drive = stopped();
    write(&mut drive, 9001, 44).unwrap();
    write(&mut drive, 8001, 2).unwrap();
    write(&mut drive, 9001, 55).unwrap();
    write(&mut drive, 8002, 2).unwrap();
    assert_eq!((drive.read(9001), drive.read(8001), drive.read(8002)), (Ok(44), Ok(0), Ok(0)));
}

#[test]
fn at_high_resolution_32767_are_600_hertz() {
    let mut drive = running();
    write(&mut drive, 8504, 1 << 9).unwrap();
    assert_eq!(drive.read(3202), Ok(2_730));
    write(&mut drive, 8502, 2_184).unwrap();
    drive.advance(3 * SECOND);
    assert_eq!((drive.read(3203), drive.read(8521)), (Ok(399), Ok(2_184)));
}

#[test]
fn speeds_in_rpm_are_those_of_a_four_pole_motor() {
    let mut drive = running();
    assert_eq!((drive.read(8604), drive.read(8605)), (Ok(1_500), Ok(1_500)));
    assert_eq!((drive.read(8607), drive.read(8609)), (Ok(0), Ok(1_500)));
    write(&mut drive, 8602, (-900_i16).cast_unsigned()).unwrap();
    drive.advance(6 * SECOND);
    assert_eq!(drive.read(3202), Ok((-300_i16).cast_unsigned()));
    assert_eq!(drive.read(12002), Ok((-900_i16).cast_unsigned()));
    assert_eq!(drive.read(12003), Ok(0xFFFF));
    write(&mut drive, 8609, 600).unwrap();
    assert_eq!(drive.read(3104), Ok(200));
}

#[test]
fn an_external_fault_comes_by_cmi_or_by_an_assigned_bit() {
    let mut drive = running();
    write(&mut drive, 8504, 1 << 3).unwrap();
    assert_eq!(drive.observe().trip, Some(8));
    let mut drive = stopped();
    write(&mut drive, 7131, 175).unwrap();
    for word in [0x0006, 0x0007, 0x000F, 0x800F] {
        write(&mut drive, 8501, word).unwrap();
    }
    assert_eq!(drive.observe().trip, Some(8));
}

#[test]
fn a_locked_drive_does_not_run() {
    for lock in [1 << 13, 1 << 15] {
        let mut drive = stopped();
        write(&mut drive, 8504, lock).unwrap();
        write(&mut drive, 8502, 500).unwrap();
        for word in [0x0006, 0x0007, 0x000F] {
            write(&mut drive, 8501, word).unwrap();
        }
        drive.advance(SECOND);
        assert!(!drive.observe().running);
        assert_eq!(drive.read(3206).unwrap() & 2 == 0, lock == 1 << 15);
    }
}

#[test]
fn a_refused_identification_has_its_own_form() {
    let mut drive = stopped();
    assert!(drive.other(&[0x2B, 0x0E, 0x01, 0x00]).unwrap().starts_with(&[0x2B, 0x0E, 0x01, 0x02, 0, 0, 3]));
    assert_eq!(drive.other(&[0x2B, 0x0E, 0x02, 0x00]), Ok(vec![0xAB, 0x0E, 0x01]));
    assert_eq!(drive.other(&[0x2B, 0x0D, 0x01, 0x00]), Ok(vec![0xAB, 0x0E, 0x01]));
    assert_eq!(drive.other(&[0x2B, 0x0E, 0x01, 0x07]), Ok(vec![0xAB, 0x0E, 0x02]));
    assert_eq!(drive.other(&[0x08, 0, 0, 0, 0]), Err(Exception::ILLEGAL_FUNCTION));
}

#[test]
fn only_outputs_without_a_function_are_written() {
    let mut drive = stopped();
    write(&mut drive, 5240, 0xFFFF).unwrap();
    assert_eq!(drive.read(5240), Ok(0x0700), "R1 shows no fault, R2 and LO are free, inputs stay");
    assert_eq!(write(&mut drive, 5261, 5_000), Ok(()));
    write(&mut drive, 5031, 130).unwrap();
    assert_eq!(write(&mut drive, 5261, 0), Err(Exception::ILLEGAL_VALUE));
}

#[test]
fn any_word_at_any_register_leaves_a_drive_that_answers() {
    let mut drive = stopped();
    let mut word: u16 = 1;
    for round in 0..40 {
        for row in ROWS {
            word = word.wrapping_mul(25_173).wrapping_add(13_849);
            let value = if round % 2 == 0 { word } else { word % 200 };
            let _ = write(&mut drive, row.address, value);
            drive.advance(Duration::from_millis(u64::from(word % 50)));
            assert!(drive.read(3201).is_ok());
        }
    }
    assert!(drive.check_read(Block { function: 3, first: 3201, quantity: 7 }).is_ok());
}

// p. 20: a block with one word that is refused writes nothing; one word of it may allow the next (p. 43).
#[test]
fn no_block_is_half_written() {
    let mut drive = Atv312::under_bus_control();
    let mut block = |first: u16, values: &[u16]| {
        let mut request = vec![0x10];
        for word in [first, values.len() as u16] {
            request.extend(word.to_be_bytes());
        }
        request.push(values.len() as u8 * 2);
        request.extend(values.iter().flat_map(|value| value.to_be_bytes()));
        (crate::pdu::answer(&mut drive, &request, Cast::Unicast).map(|_| ()), drive.bank.value(first))
    };
    assert_eq!(block(ACC, &[50, 0]), (Err(Exception::ILLEGAL_VALUE), 30));
    assert_eq!(block(CMD, &[0x0006, 100, 1_001]), (Err(Exception::ILLEGAL_VALUE), 0));
    assert_eq!(block(PS4, &[0, 0]), (Ok(()), 0));
    assert_eq!(block(PS2, &[0, 0]), (Ok(()), 0));
    assert_eq!(block(PS2, &[131, 132]), (Ok(()), 131));
}
