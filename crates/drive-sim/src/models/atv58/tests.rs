use drive_core::Percent;

use super::*;
use crate::{Cast, Exception, Panel, world::Act};

const SECOND: Duration = Duration::from_secs(1);

fn write(drive: &mut Atv58, address: u16, value: u16) {
    drive.write(address, value, Cast::Unicast).unwrap();
}

fn running() -> Atv58 {
    let mut drive = Atv58::new();
    // The manual's own sample, 6 to W400 and 500 to W401, and the chart's way on.
    for (address, value) in [(400, 6), (401, 500), (400, 7), (400, 15)] {
        write(&mut drive, address, value);
    }
    drive.advance(3 * SECOND);
    drive
}

#[test]
fn shutdown_is_the_first_rung_and_the_reference_of_the_sample_is_fifty_hertz() {
    let mut drive = Atv58::new();
    assert_eq!(drive.read(458), Ok(0x0240));
    write(&mut drive, 400, 6);
    assert_eq!(drive.read(458), Ok(0x0221));
    drive = running();
    assert_eq!(drive.observe().output_frequency, 5_000);
    write(&mut drive, 400, 0x080F);
    drive.advance(6 * SECOND);
    assert_eq!(drive.observe().output_frequency, -5_000);
}

#[test]
fn the_acceleration_of_the_sample_is_78_9_seconds() {
    let mut drive = Atv58::new();
    write(&mut drive, 252, 0x0315);
    for (address, value) in [(401, 500), (400, 6), (400, 15)] {
        write(&mut drive, address, value);
    }
    drive.advance(Duration::from_millis(78_899));
    assert_ne!(drive.observe().output_frequency, 5_000);
    drive.advance(Duration::from_millis(1));
    assert_eq!(drive.observe().output_frequency, 5_000);
}

#[test]
fn a_trip_sets_its_bit_of_the_fault_register_until_it_is_reset() {
    let mut drive = running();
    drive.trip(2);
    assert_eq!((drive.read(483), drive.observe().trip), (Ok(0x0004), Some(2)));
    write(&mut drive, 400, 0x80);
    assert_eq!((drive.read(483), drive.observe().trip), (Ok(0), None));
}

#[test]
fn ten_seconds_without_a_message_are_a_fault() {
    let mut drive = running();
    drive.frame_seen(Cast::Unicast);
    drive.advance(10 * SECOND - Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, None);
    drive.advance(Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, Some(LINK_FAULT));
}

#[test]
fn in_ascii_one_second_without_a_message_is_a_fault() {
    let mut drive = Atv58::new();
    drive.join(1, Protocol::Ascii);
    drive.frame_seen(Cast::Unicast);
    drive.advance(SECOND - Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, None);
    drive.advance(Duration::from_nanos(1));
    assert_eq!(drive.observe().trip, Some(LINK_FAULT));
}

#[test]
fn what_the_drive_produces_is_not_written_and_what_it_does_not_have_is_not_read() {
    let mut drive = running();
    for address in [458, 463, 483] {
        assert_eq!(drive.write(address, 0, Cast::Unicast), Err(Exception::ILLEGAL_ADDRESS));
    }
    for address in [0, 249, 403, 461, 3201] {
        assert_eq!(drive.read(address), Err(Exception::ILLEGAL_ADDRESS));
    }
    for address in (250..=253).chain(463..=466) {
        assert!(drive.read(address).is_ok());
    }
}

fn at(drive: &mut Atv58, seconds: u32) -> i32 {
    drive.advance(seconds * SECOND);
    drive.observe().output_frequency
}

// The local control of the drive is in a manual that is not public.
#[test]
fn forced_local_control_gives_the_motor_to_the_terminals() {
    let mut drive = running();
    drive.world(Act::Analog("AI1", Percent::from_percent(50)));
    drive.panel(Panel::TakeControl);
    assert_eq!((at(&mut drive, 4), drive.read(W458).unwrap() & 0x0200), (0, 0));
    drive.world(Act::Terminal("LI2", true));
    assert_eq!(at(&mut drive, 4), -2_500);
    write(&mut drive, CMD, 0);
    assert_eq!(at(&mut drive, 4), -2_500);
}

#[test]
fn a_run_word_that_stands_acts_when_control_is_given_back_or_does_not() {
    for (reading, runs) in [("new-word", false), ("standing-word", true)] {
        let mut drive = running();
        drive.world(Act::Reading("given-back", reading));
        drive.panel(Panel::TakeControl);
        at(&mut drive, 4);
        drive.panel(Panel::ReleaseControl);
        assert_eq!(at(&mut drive, 4) > 0, runs, "{reading}");
    }
}

// The sample writes 500 and names no unit (p. 21/45).
#[test]
fn a_count_of_the_reference_is_a_tenth_or_a_hundredth_of_a_hertz() {
    for (reading, ends_at) in [("tenths", 5_000), ("hundredths", 500)] {
        let mut drive = Atv58::new();
        drive.world(Act::Reading("W401", reading));
        for (address, value) in [(CMD, 6), (W401, 500), (CMD, 7), (CMD, 15)] {
            write(&mut drive, address, value);
        }
        assert_eq!(at(&mut drive, 4), ends_at, "{reading}");
    }
}

// What the control word's bits 12 to 14 do is in a manual that is not public.
#[test]
fn the_high_bits_stop_or_do_nothing() {
    for (reading, speeds) in [("nothing", [5_000; 3]), ("stops", [3_333, 0, 0])] {
        for (word, speed) in [0x100F, 0x200F, 0x400F].into_iter().zip(speeds) {
            let mut drive = running();
            drive.world(Act::Reading("CMD.12-14", reading));
            write(&mut drive, CMD, word);
            assert_eq!(at(&mut drive, 1), speed, "{reading} {word:04X}h");
        }
    }
}

#[test]
fn without_the_supply_of_its_power_stage_it_is_locked() {
    let mut drive = running();
    drive.world(Act::MotorSupply(false));
    write(&mut drive, CMD, 6);
    assert_eq!((drive.observe().running, drive.read(W458).unwrap() & 0x6F), (false, 0x40));
    drive.world(Act::MotorSupply(true));
    for word in [6, 7, 15] {
        write(&mut drive, CMD, word);
    }
    assert!(drive.observe().running);
}
