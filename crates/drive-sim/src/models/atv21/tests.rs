//! The simulated Altivar 21 against its manual: every frame that is printed with its CRC, byte for byte, and what the
//! sections say of behaviour.

use std::time::Duration;

use drive_core::SerialSettings;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    time::timeout,
};

use super::Atv21;
use crate::{Exception, Model, Panel, SimLine, SimSlave, Wiring};

/// Longer than any frame and its turnaround takes at 19200 bit/s.
const SILENCE: Duration = Duration::from_millis(200);
const SECOND: Duration = Duration::from_secs(1);

struct Rig {
    drive: SimSlave,
    master: DuplexStream,
}

impl Rig {
    fn new(model: Atv21) -> Self {
        let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let drive = line.add(1, model).unwrap();
        Self { drive, master: line.in_memory() }
    }

    /// Sends a frame as printed, CRC included; the answer, empty when there is none.
    async fn ask(&mut self, frame: &str) -> Vec<u8> {
        tokio::time::sleep(Duration::from_millis(5)).await;
        self.master.write_all(&hexadecimal(frame)).await.unwrap();
        let mut answer = Vec::new();
        while timeout(SILENCE, self.master.read_buf(&mut answer)).await.is_ok_and(|read| read.unwrap() > 0) {}
        answer
    }

    /// Asks and compares.
    async fn exchange(&mut self, section: &str, request: &str, answer: &str) {
        assert_eq!(self.ask(request).await, hexadecimal(answer), "{section}: {request}");
    }
}

fn hexadecimal(text: &str) -> Vec<u8> {
    let digits: Vec<u8> =
        text.chars().filter_map(|digit| digit.to_digit(16)).filter_map(|d| d.try_into().ok()).collect();
    digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect()
}

/// A drive that the bus commands, with the blocks of the manual's examples in effect; they outlive a power cycle.
fn with_blocks() -> Atv21 {
    let mut drive = Atv21::new().with_blocks();
    drive.poke(0x0003, 2);
    drive.poke(0x0004, 4);
    drive.power_cycle();
    drive.advance(SECOND);
    drive
}

fn at_60_hertz() -> Atv21 {
    let mut drive = with_blocks();
    for (address, value) in [(0x0012, 6_000), (0xFA01, 6_000), (0xFA00, 0x0400)] {
        assert!(drive.poke(address, value));
    }
    drive.advance(Duration::from_secs(60));
    drive
}

#[tokio::test(start_paused = true)]
async fn reading_one_word_as_in_7_4() {
    let mut rig = Rig::new(at_60_hertz());
    rig.exchange("7.4", "01 03 FD 00 00 01 B5 A6", "01 03 02 17 70 B6 50").await;
    rig.exchange("7.4, two words", "01 03 FD 00 00 02 F5 A7", "01 83 03 01 31").await;
}

#[tokio::test(start_paused = true)]
async fn reading_the_block_as_in_7_5() {
    let mut drive = at_60_hertz();
    // The example's motor runs at 60 Hz without a current and with an undercurrent alarm.
    for (address, value) in [(0xFC91, 0x0080), (0xFE03, 0), (0xFE05, 9_979)] {
        assert!(drive.poke(address, value));
    }
    let mut rig = Rig::new(drive);
    let five = "01 03 0A 64 04 17 70 00 00 26 FB 00 80 1E 29";
    rig.exchange("7.5", "01 03 18 75 00 05 92 B3", five).await;
    rig.exchange("7.5, two words", "01 03 18 75 00 02 D3 71", "01 03 04 64 04 17 70 AA D6").await;
    rig.exchange("7.5, start address", "01 03 18 76 00 02 23 71", "01 83 03 01 31").await;
    rig.exchange("7.5, quantity", "01 03 18 75 00 06 D2 B2", "01 83 03 01 31").await;
}

#[tokio::test(start_paused = true)]
async fn writing_one_word_as_in_7_6_and_7_7() {
    let mut rig = Rig::new(with_blocks());
    rig.exchange("7.6", "01 06 FA 01 17 70 E6 C6", "01 06 FA 01 17 70 E6 C6").await;
    rig.exchange("7.6, address", "01 06 FF FF 00 00 89 EE", "01 86 02 C3 A1").await;
    rig.exchange("7.7", "01 10 FA 01 00 01 02 17 70 F3 9A", "01 10 FA 01 00 01 60 D1").await;
    assert_eq!(rig.drive.peek(0xFA01), Some(6_000));
    // 80 Hz; the CRC is printed as B5 A6 and is E1 12.
    rig.exchange("8.5", "01 06 FA 01 1F 40 E1 12", "01 06 FA 01 1F 40 E1 12").await;
}

#[tokio::test(start_paused = true)]
async fn writing_the_block_as_in_7_8() {
    let mut rig = Rig::new(with_blocks());
    let request = "01 10 18 70 00 02 04 C4 00 17 70 6D AF";
    // The CRC of the answer is printed as 43 B3 and is 46 B3.
    rig.exchange("7.8", request, "01 10 18 70 00 02 46 B3").await;
    assert_eq!((rig.drive.peek(0xFA00), rig.drive.peek(0xFA01)), (Some(0xC400), Some(6_000)));
    rig.drive.refuse_next(Exception::FAILURE);
    rig.exchange("7.8, busy", request, "01 90 04 4D C3").await;
    rig.exchange("7.8, start address", "01 10 18 71 00 02 04 C4 00 17 70 AC 63", "01 90 03 0C 01").await;
    rig.exchange("7.8, quantity", "01 10 18 70 00 03 04 C4 00 17 70 6C 7E", "01 90 03 0C 01").await;
    rig.exchange("7.8, bytes", "01 10 18 70 00 02 03 C4 00 17 70 D8 6F", "01 90 03 0C 01").await;
    let mut unset = Rig::new(Atv21::new());
    unset.exchange("7.8, F870 = 0", request, "01 90 04 4D C3").await;
}

#[tokio::test(start_paused = true)]
async fn identification_as_in_7_9() {
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
    assert_eq!(write(&mut drive, 0xFD00, 0), Err(Exception::ILLEGAL_ADDRESS));
    assert_eq!(write(&mut drive, 0xFA13, 24_001), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, 0xFA51, 1_024), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, 0xFA01, 8_001), Err(Exception::ILLEGAL_VALUE), "above FH");
    assert_eq!(write(&mut drive, 0x0803, 101), Err(Exception::ILLEGAL_VALUE));
    assert_eq!(write(&mut drive, 0xFA01, 8_000), Ok(()));
}

#[test]
fn the_block_configuration_takes_effect_after_a_reset_6_3() {
    let mut drive = Atv21::new();
    write(&mut drive, 0x0875, 2).unwrap();
    drive.poke(0xFC91, 4);
    assert_eq!(drive.read(0x1875), Ok(0));
    drive.power_cycle();
    drive.advance(SECOND);
    drive.poke(0xFA01, 1_000);
    write(&mut drive, 0xFA00, 0xC400).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!(drive.read(0x1875), Ok(1_000));
    assert_eq!(drive.observe().eeprom_writes, 1);
}

#[test]
fn the_terminals_command_until_the_priority_is_set_6_2() {
    let mut drive = Atv21::new();
    write(&mut drive, 0xFA01, 3_000).unwrap();
    write(&mut drive, 0xFA00, 0x0400).unwrap();
    assert!(!drive.observe().running, "CMOD = 0");
    write(&mut drive, 0xFA00, 0xC600).unwrap();
    drive.advance(SECOND * 20);
    assert_eq!(drive.observe().output_frequency, -3_000);
    assert_eq!((drive.read(0xFE45), drive.read(0xFE46)), (Ok(2), Ok(4)));
    assert_eq!(drive.read(0xFD01), Ok(0x6600));
    // Inputs F on and the priority gone: the terminals run it at what VIA says.
    drive.poke(0xFD06, 0x0001);
    drive.poke(0xFE35, 1_023);
    write(&mut drive, 0xFA00, 0).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!(drive.observe().output_frequency, 5_000);
    assert_eq!((drive.read(0xFE45), drive.read(0xFE46)), (Ok(0), Ok(1)));
}

#[test]
fn input_r_forces_local_control_where_f112_says_so_6_2() {
    let mut drive = with_blocks();
    write(&mut drive, 0x0112, 48).unwrap();
    write(&mut drive, 0xFA00, 0x0400).unwrap();
    assert!(drive.observe().running);
    drive.poke(0xFD06, 0x0002);
    assert_eq!(drive.read(0xFE45), Ok(0));
    assert_eq!(drive.read(0xFD01).unwrap() & 0x8400, 0x8000);
}

#[test]
fn a_preset_speed_overrides_the_reference_8_4() {
    let mut drive = with_blocks();
    write(&mut drive, 0xFA01, 3_000).unwrap();
    write(&mut drive, 0xFA00, 0x0402).unwrap();
    drive.advance(SECOND * 20);
    assert_eq!(drive.read(0xFE46), Ok(255));
    assert_eq!(drive.observe().output_frequency, 1_000);
}

#[test]
fn the_time_out_starts_with_the_first_frame_and_trips_err5_6_4() {
    for (reaction, running) in [(0, false), (1, true), (2, true), (4, false)] {
        let mut drive = at_60_hertz();
        drive.poke(0x0603, reaction);
        drive.advance(SECOND * 100);
        assert_eq!(drive.observe().trip, None, "no frame yet");
        drive.frame_seen(crate::Cast::Unicast);
        drive.advance(SECOND * 3 - Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, None);
        drive.advance(Duration::from_millis(10));
        assert_eq!(drive.observe().trip, Some(24));
        assert_eq!(drive.observe().running, running, "F603 = {reaction}");
        assert_eq!((drive.read(0xFC90), drive.read(0xFE10)), (Ok(24), Ok(24)));
        // Just before the trip it ran at 60 Hz.
        assert_eq!((drive.read(0xFE00), drive.read(0xFE01)), (Ok(6_000), Ok(0x6400)));
        drive.advance(SECOND * 30);
        assert!(!drive.observe().running);
    }
}

#[test]
fn a_reset_restarts_the_drive_and_clears_the_control_registers_8_2() {
    let mut drive = at_60_hertz();
    write(&mut drive, 0xFA00, 0x1400).unwrap();
    assert_eq!(drive.observe().trip, Some(17));
    assert_eq!(drive.read(0xFD01).unwrap() & 0x5003, 0x1003);
    write(&mut drive, 0xFA00, 0x0400).unwrap();
    assert!(!drive.observe().running, "a trip does not go away by itself");
    write(&mut drive, 0xFA00, 0x2000).unwrap();
    assert!(!drive.listens());
    drive.advance(SECOND * 2);
    assert!(drive.listens());
    assert_eq!(drive.observe().trip, None);
    assert_eq!((drive.read(0xFA00), drive.read(0xFA01)), (Ok(0), Ok(0)));
}

#[test]
fn dc_braking_lasts_as_long_as_its_bit_and_freewheel_lets_go_8_4() {
    let mut drive = at_60_hertz();
    write(&mut drive, 0xFA00, 0x0080).unwrap();
    drive.advance(SECOND * 60);
    assert!(drive.observe().running, "direct current flows on at rest");
    assert_eq!(drive.read(0xFD01).unwrap() & 0x0480, 0x0080);
    write(&mut drive, 0xFA00, 0x0000).unwrap();
    assert!(!drive.observe().running);
    write(&mut drive, 0xFA00, 0x0800).unwrap();
    assert_eq!(drive.read(0xFD01).unwrap() & 0x0800, 0x0800);
}

#[test]
fn command_word_2_resets_the_energy_and_chooses_the_stall_level_8_4() {
    let mut drive = at_60_hertz();
    drive.advance(SECOND * 36_000);
    assert_eq!(drive.read(0xFE77), Ok(751), "ten hours at rated power, and a minute");
    write(&mut drive, 0xFA20, 0x0002).unwrap();
    assert_eq!((drive.read(0xFE77), drive.read(0xFD42)), (Ok(0), Ok(0x0002)));
    write(&mut drive, 0xFA20, 0x1000).unwrap();
    assert_eq!(drive.read(0xFD42), Ok(0), "without the command priority");
    write(&mut drive, 0xFA00, 0xC400).unwrap();
    assert_eq!(drive.read(0xFD42), Ok(0x1000));
}

#[test]
fn the_keypad_takes_control_and_the_order_of_the_bus_does_not_come_back_with_it() {
    let mut drive = at_60_hertz();
    drive.panel(Panel::TakeControl);
    drive.advance(SECOND * 60);
    assert!(!drive.observe().running);
    assert_eq!((drive.read(0xFE45), drive.read(0xFD01).unwrap() & 0x8000), (Ok(1), 0x8000));
    drive.panel(Panel::ReleaseControl);
    assert!(!drive.observe().running);
    write(&mut drive, 0xFA00, 0x0400).unwrap();
    assert!(drive.observe().running);
}

#[test]
fn speed_and_frequency_are_converted_by_the_poles_8_3_8_5() {
    let mut drive = with_blocks();
    write(&mut drive, 0xFA13, 1_500).unwrap();
    write(&mut drive, 0xFA00, 0x0400).unwrap();
    drive.advance(SECOND * 60);
    assert_eq!((drive.read(0xFD00), drive.read(0xFE90)), (Ok(5_000), Ok(1_500)));
}
