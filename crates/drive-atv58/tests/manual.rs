//! The card's manual a second time, from its text and not from the driver: VW3-A58303, VVDED397054, French and English
//! pages.

use std::time::Duration;

use drive_atv58::{Atv58, Atv58Map, CAPABILITIES, Counters, ROWS, words};
use drive_bus::Slave;
use drive_core::{
    Class, Drive, Error, ExceptionMeaning, Registers, Row, State, Status, StopMode,
    registers::{Confidence, Form},
    serial::CharacterFormat,
};
use drive_sim::models;
use drive_testing::{
    bench::address as slave,
    frames::{self, OtherEnd, Printed},
    words::{Asked, Words},
};

/// p. 20/44 and 21/45: what is printed with a CRC. The words that the answer of function 03 holds are not printed.
const READ: Printed<'_> = ("01 03 01CF 0004 | 75CA", "01 03 08 0000 0000 0000 0000");
const WRITE: Printed<'_> = ("01 06 00FC 0315 | 88C5", "01 06 00FC 0315 | 88C5");
const WRITE_TWO: Printed<'_> = ("02 10 0190 0002 04 0006 01F4 | 1801", "02 10 0190 0002 | 402A");

/// A drive on a line whose other end is played by the script.
fn drive(number: u8, script: &[Printed<'_>]) -> (Atv58<Slave>, OtherEnd) {
    let (line, other_end) = frames::scripted(CAPABILITIES.factory, script);
    (Atv58::new(line.slave(number), slave(number)), other_end)
}

fn row(address: u16) -> &'static Row {
    ROWS.iter().find(|row| row.address == address).unwrap()
}

#[test]
fn every_word_that_the_manual_names_is_a_row_and_marked_so() {
    // p. 10/34: W401, W483. p. 12/36: W250 to W253. p. 20/44: W463 to W466, W252. p. 21/45: W400, W401.
    let named: Vec<u16> = (250..=253).chain([400, 401]).chain(463..=466).chain([483]).collect();
    let manual: Vec<u16> =
        ROWS.iter().filter(|row| row.confidence == Confidence::Manual).map(|row| row.address).collect();
    assert_eq!(manual, named);
}

#[test]
fn what_the_manual_does_not_name_is_raw_and_says_why() {
    for row in ROWS.iter().filter(|row| row.confidence == Confidence::Elsewhere) {
        assert!(row.unit.symbol.is_empty() && row.unit.decimals == 0, "{}", row.code);
        assert!(
            row.name.starts_with("raw word") && row.source.starts_with("not in VVDED397054"),
            "{}",
            row.code
        );
    }
    for address in [250, 251, 253, 463, 464, 465, 466] {
        assert!(row(address).name.starts_with("raw word"), "{address}");
    }
}

#[test]
fn produced_words_cannot_be_written() {
    // p. 10/34: "data produced by the speed controller can only be accessed in read".
    for address in (450..=459).chain(463..=466).chain([483]) {
        assert!(!row(address).access.is_writable(), "{address}");
    }
    // p. 20/44, 21/45: written in samples.
    for address in [252, 400, 401] {
        assert!(row(address).access.is_writable(), "{address}");
    }
}

#[test]
fn acceleration_is_in_tenths_of_a_second_and_the_reference_has_no_printed_unit() {
    // p. 20/44: "H'0315' = 789 ( ACC = 78,9s )".
    assert_eq!(row(252).show(0x0315), "78.9 s");
    assert_eq!(row(401).show(500), "500");
    assert_eq!(row(400).unit.form, Form::Bits);
}

#[test]
fn functions_limits_speeds_and_formats_are_those_of_the_tables() {
    // p. 18/42: 03 and 04 63 words, 06, 08, 11, 16 60 words. p. 9/33: speeds and formats, addresses 0 to 31.
    assert_eq!(CAPABILITIES.functions, [3, 4, 6, 8, 11, 16]);
    assert_eq!((CAPABILITIES.read_words, CAPABILITIES.write_words), (63, 60));
    assert_eq!(CAPABILITIES.speeds, [4_800, 9_600, 19_200]);
    assert_eq!(CAPABILITIES.highest_address, 31);
    for format in ["7O1", "7E1", "7O2", "7E2", "8O1", "8E1", "8N1", "8N2"] {
        let format: CharacterFormat = format.parse().unwrap();
        assert!(CAPABILITIES.formats.contains(&format), "{format}");
    }
    // p. 24/48: no message for 10 s.
    assert_eq!(CAPABILITIES.watchdog.map(|watchdog| watchdog.max), Some(Duration::from_secs(10)));
}

#[tokio::test(start_paused = true)]
async fn every_printed_frame_is_sent_read_and_answered() {
    let printed = [READ, WRITE, WRITE_TWO];
    assert_eq!(frames::with_crc(&printed), 5);
    frames::sent_and_read(&CAPABILITIES, &printed).await;
    for (slave, exchanges) in [(1, &[READ, WRITE][..]), (2, &[WRITE_TWO])] {
        frames::answered(CAPABILITIES.factory, slave, models::atv58::Atv58::new(), exchanges).await;
    }
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_function_03_is_the_second_request_of_the_measurements() {
    // p. 20/44: "read words W463 to W466 of slave 1".
    let wire = [
        ("01 03 01C2 0007", "01 03 0E 01F4 0000 0000 0000 0FA3 0037 0028"),
        (READ.0, "01 03 08 0001 0002 0003 FFFF"),
    ];
    let (mut drive, other_end) = drive(1, &wire);
    let measurements = drive.measurements().await.unwrap();
    let raw: Vec<_> =
        measurements.raw.iter().filter(|word| word.address >= 463).map(|word| word.value).collect();
    assert_eq!(raw, [1, 2, 3, 0xFFFF]);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_function_06_is_what_setting_the_acceleration_sends() {
    // p. 20/44: "write value H'0315' = 789 in word W252 of slave 1 ( ACC = 78,9s )".
    let wire = [("01 03 00FC 0001", "01 03 02 0064"), WRITE, ("01 03 00FC 0001", "01 03 02 0315")];
    let (mut drive, other_end) = drive(1, &wire);
    assert!(drive.write_parameter(row(252), 789).await.unwrap().changed);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_the_ascii_mode_carries_the_same_request() {
    // p. 23/47: "write value 10 in word W252 of slave 2", `:020600FC000AF2`; the line adds colon, LRC and delimiters.
    let wire = [
        ("02 03 00FC 0001", "02 03 02 0064"),
        ("02 06 00FC 000A", "02 06 00FC 000A"),
        ("02 03 00FC 0001", "02 03 02 000A"),
    ];
    let (mut drive, other_end) = drive(2, &wire);
    assert!(drive.write_parameter(row(252), 10).await.unwrap().changed);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_function_16_is_what_the_register_access_sends() {
    // p. 21/45: "write values 6 and 500 in words W400 and W401 of slave 2".
    let (line, other_end) = frames::scripted(CAPABILITIES.factory, &[WRITE_TWO]);
    let mut registers =
        Registers::new(line.slave(2), slave(2), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown);
    registers.at(Class::Command).write_words(400, &[6, 500]).await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_04_has_the_layout_of_function_03() {
    let (mut drive, other_end) = drive(1, &[("01 04 01CF 0002", "01 04 04 0001 0002")]);
    assert_eq!(drive.read_input_words(463, 2).await.unwrap(), [1, 2]);
    for count in [0, 64] {
        let refused = drive.read_input_words(400, count).await;
        assert!(matches!(refused, Err(Error::TooManyWords { limit: 63, .. })));
    }
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn each_sub_code_of_function_08_is_sent_as_the_table_says() {
    // p. 19/43 and the table of p. 21/45.
    let wire = [
        ("01 08 0000 A537", "01 08 0000 A537"),
        ("01 08 0001 0000", "01 08 0001 0000"),
        ("01 08 0003 2300", "01 08 0003 2300"),
        ("01 08 0004 0000", ""),
        ("01 08 000A 0000", "01 08 000A 0000"),
    ];
    let (mut drive, other_end) = drive(1, &wire);
    drive.echo(0xA537).await.unwrap();
    drive.restart_communication().await.unwrap();
    drive.change_ascii_delimiter(b'#').await.unwrap();
    drive.enter_listen_only().await.unwrap();
    drive.clear_counters().await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_counters_of_function_08_are_a_record() {
    let wire = [
        ("01 08 000B 0000", "01 08 000B FFFF"),
        ("01 08 000C 0000", "01 08 000C 0002"),
        ("01 08 000D 0000", "01 08 000D 0003"),
        ("01 08 000E 0000", "01 08 000E 0104"),
        ("01 08 000F 0000", "01 08 000F 0005"),
        ("01 08 0010 0000", "01 08 0010 0000"),
        ("01 08 0011 0000", "01 08 0011 0000"),
        ("01 08 0012 0000", "01 08 0012 0008"),
    ];
    let expected = Counters {
        messages: 0xFFFF,
        check_errors: 2,
        exceptions: 3,
        addressed: 0x0104,
        broadcasts: 5,
        naq: 0,
        not_ready: 0,
        characters: 8,
    };
    let (mut drive, other_end) = drive(1, &wire);
    assert_eq!(drive.counters().await.unwrap(), expected);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_0b_reads_the_event_counter_behind_a_status_of_zero() {
    // p. 21/45.
    let (mut counting, _) = drive(1, &[("01 0B", "01 0B 0000 0108")]);
    assert_eq!(counting.event_counter().await.unwrap(), 0x0108);
    let (mut other, _) = drive(1, &[("01 0B", "01 0B FFFF 0108")]);
    let refused = other.event_counter().await;
    assert!(matches!(refused, Err(Error::Answer { .. })));
}

#[tokio::test]
async fn an_answer_of_another_sub_code_or_with_other_data_is_refused() {
    // The line itself refuses an answer that is not its request's; a plain port may pass it on.
    let says = |answer: [u8; 4]| {
        let mut words = Words::new(&CAPABILITIES, &[]);
        words.loop_back = Some(answer.to_vec());
        words
    };
    let mut other = Atv58::new(says([0, 0x0B, 0, 0]), slave(1));
    assert!(matches!(other.clear_counters().await, Err(Error::Answer { .. })));
    let mut answered = Atv58::new(says([0, 0x04, 0, 1]), slave(1));
    assert!(matches!(answered.enter_listen_only().await, Err(Error::Answer { .. })));
}

#[tokio::test(start_paused = true)]
async fn the_simulated_drive_answers_as_the_frames_of_the_manual_say() {
    let one = [
        // p. 20/44.
        (READ.0, "01 03 08 xxxx xxxx xxxx xxxx"),
        ("01 04 01CF 0004", "01 04 08 xxxx xxxx xxxx xxxx"),
        WRITE,
        // p. 21/45, the table of sub-codes, and p. 19/43 for listen-only mode.
        ("01 08 0000 A537", "01 08 0000 A537"),
        ("01 08 000A 0000", "01 08 000A 0000"),
        ("01 08 000B 0000", "01 08 000B xxxx"),
        ("01 08 000C 0000", "01 08 000C 0000"),
        ("01 08 000D 0000", "01 08 000D 0000"),
        ("01 08 000E 0000", "01 08 000E xxxx"),
        ("01 08 000F 0000", "01 08 000F 0000"),
        ("01 08 0010 0000", "01 08 0010 0000"),
        ("01 08 0011 0000", "01 08 0011 0000"),
        ("01 08 0012 0000", "01 08 0012 0000"),
        ("01 08 0003 2300", "01 08 0003 2300"),
        ("01 08 0004 0000", ""),
        (READ.0, ""),
        ("01 08 0001 FF00", "01 08 0001 FF00"),
        ("01 08 0001 0000", "01 08 0001 0000"),
        ("01 0B", "01 0B 0000 xxxx"),
        // p. 22/46: no such function, no such word, too many words.
        ("01 2B 0E 01 00", "01 AB 01"),
        ("01 03 0064 0001", "01 83 02"),
        ("01 03 01CF 0040", "01 83 03"),
        // p. 18/42: a broadcast is never answered.
        ("00 06 00FC 000A", ""),
        ("01 03 00FC 0001", "01 03 02 000A"),
    ];
    frames::answered(CAPABILITIES.factory, 1, models::atv58::Atv58::new(), &one).await;
    // p. 21/45.
    frames::answered(CAPABILITIES.factory, 2, models::atv58::Atv58::new(), &[WRITE_TWO]).await;
}

#[tokio::test(start_paused = true)]
async fn each_exception_has_its_meaning() {
    // p. 22/46, codes 1 to 4.
    let meanings = [
        ("01", ExceptionMeaning::NoSuchFunction, false),
        ("02", ExceptionMeaning::NoSuchRegister, false),
        ("03", ExceptionMeaning::ValueRefused, false),
        ("04", ExceptionMeaning::Failed, true),
        ("09", ExceptionMeaning::Unknown, false),
    ];
    for (code, expected, retry) in meanings {
        let (mut drive, other_end) = drive(1, &[("01 08 0000 0001", &format!("01 88 {code}"))]);
        let error = drive.echo(1).await.unwrap_err();
        other_end.is_done().await;
        let Error::Exception { meaning, .. } = error else { panic!("{error}") };
        assert_eq!((meaning, meaning.is_worth_a_retry()), (expected, retry));
    }
}

#[test]
fn every_control_word_of_a_stop_is_one_of_drivecom() {
    // p. 21/45 writes 6; 7 and 15 are the other words of the chart that are reported, 0 and 2 those of DRIVECOM.
    let drive = Atv58::new(Words::new(&CAPABILITIES, &[]), slave(1));
    let values: Vec<_> =
        StopMode::ALL.into_iter().map(|mode| drive.broadcast_stop(mode).map(|write| write.value)).collect();
    assert_eq!(values, [Some(7), Some(2), Some(0), None]);
}

#[test]
fn the_fault_register_has_sixteen_bits_that_keep_their_numbers() {
    // p. 10/34: "W483,2 designates the bit in row 2 of register W483".
    assert_eq!(words::FaultRegister(0x0004).bits().collect::<Vec<_>>(), [2]);
    assert_eq!(words::FaultRegister(0xFFFF).bits().collect::<Vec<_>>(), (0..16).collect::<Vec<_>>());
}

#[tokio::test]
async fn every_status_word_is_decoded_and_the_chart_comes_out_as_drivecom_has_it() {
    for eta in 0..=u16::MAX {
        let words = Words::new(&CAPABILITIES, &[(458, eta), (483, 0x0024)]);
        let mut drive = Atv58::new(words, slave(1));
        let status: Status = drive.status().await.unwrap();
        let expected = match eta & 0x006F {
            0x00 | 0x20 => State::NotReady,
            0x40 | 0x60 | 0x21 => State::Disabled,
            0x23 => State::Ready,
            0x27 => State::Running,
            0x07 => State::QuickStop,
            0x08 | 0x28 => State::Fault,
            0x0F | 0x2F => State::FaultReaction,
            _ => State::Unknown,
        };
        assert_eq!(status.state, expected, "{eta:04X}h");
        // The lowest of the bits 2 and 5, read only when there is a fault.
        assert_eq!(status.fault_code, status.is_fault().then_some(2), "{eta:04X}h");
        let asked = drive.into_port().asked;
        assert_eq!(asked.contains(&Asked::Read(Class::Status, 483, 1)), status.is_fault());
    }
}

#[tokio::test]
async fn another_map_reads_other_words_and_a_wide_one_reads_them_one_by_one() {
    let map = Atv58Map {
        status: 600,
        output_frequency: Some(463),
        current: None,
        remote: 0,
        at_reference: 0,
        ..Atv58Map::default()
    };
    let words = Words::new(&CAPABILITIES, &[(600, 0x0027), (463, 0x01F4)]);
    let mut drive = Atv58::with_map(words, slave(1), map);
    let status = drive.status().await.unwrap();
    let one_by_one = [Asked::Read(Class::Status, 600, 1), Asked::Read(Class::Status, 463, 1)];
    assert_eq!(drive.into_port().asked, one_by_one);
    assert_eq!(status.to_string(), "running, forward, 50.00 Hz");
    assert_eq!((status.current, status.at_reference, status.control), (None, None, None));
}
