use super::*;
use crate::Block;

const SECOND: Duration = Duration::from_secs(1);

fn write(drive: &mut Atv28, address: u16, value: u16) -> Result<(), Exception> {
    drive.write(address, value, Cast::Unicast)
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
