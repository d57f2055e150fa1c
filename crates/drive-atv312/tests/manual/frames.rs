//! Every frame that BBV52816 04/2009 prints, byte for byte: what the driver sends and how it reads the answer, and what
//! the simulated drive answers.

use drive_atv312::{Atv312, CAPABILITIES};
use drive_bus::Line;
use drive_core::{Class, Drive, Error, ExceptionMeaning, Identity, Registers, Row};
use drive_sim::models;
use drive_testing::{
    bench,
    frames::{self, OtherEnd, Printed},
};
use tokio_modbus::prelude::ReadCode;

/// p. 12, function 3: W3102 to W3105 of slave 2.
const READ: Printed<'_> = ("02 03 0C1E 0004 | 276C", "02 03 08 0028 0258 01F4 0000 | 52B0");
/// p. 12, function 6: 000Dh to W9001 of slave 2; request and answer.
const WRITE: Printed<'_> = ("02 06 2329 000D | 9270", "02 06 2329 000D | 9270");
/// p. 14, function 43: the answer in its four lines.
const IDENTIFICATION: Printed<'_> = (
    "02 2B 0E 01 00 | 3477",
    "02 2B 0E 01 02 00 00 03 \
     00 0D 54 45 4C 45 4D 45 43 41 4E 49 51 55 45 \
     01 0F 41 54 56 33 31 48 55 30 39 4D 33 53 32 33 32 \
     02 04 30 32 30 31 | A80F",
);
/// p. 14, function 16: 20 and 30 to W9001 and W9002 of slave 2. The printed CRCs 517F and 8FED are those of the address
/// 6189h; the frame has these.
const WRITE_TWO: Printed<'_> = ("02 10 2329 0002 04 0014 001E | 73A4", "02 10 2329 0002 | 9BB7");
const PRINTED: [Printed<'_>; 4] = [READ, WRITE, IDENTIFICATION, WRITE_TWO];

/// A line whose other end is played by the script.
fn scripted(script: &[Printed<'_>]) -> (Line, OtherEnd) {
    frames::scripted(CAPABILITIES.factory, script)
}

fn registers(line: &Line) -> Registers<drive_bus::Slave> {
    Registers::new(line.slave(2), bench::address(2), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown)
}

/// What the simulated drive at address 2 answers, one request after the other.
async fn answered(exchanges: &[Printed<'_>]) {
    let model = models::atv312::Atv312::new().identified_as("ATV31HU09M3S232", "0201");
    frames::answered(CAPABILITIES.factory, 2, model, exchanges).await;
}

#[test]
fn the_printed_crcs_are_right_but_for_two() {
    assert_eq!(frames::with_crc(&PRINTED), 8);
    for frame in PRINTED.into_iter().flat_map(|(request, answer)| [request, answer]) {
        // Whose CRC is not the printed one panics.
        assert!(!frames::frame(frame).is_empty());
    }
    for misprinted in ["02 10 6189 0002 04 0014 001E | 517F", "02 10 6189 0002 | 8FED"] {
        assert!(!frames::frame(misprinted).is_empty(), "they fit another address");
    }
}

#[tokio::test(start_paused = true)]
async fn every_printed_frame_is_sent_and_read() {
    frames::sent_and_read(&CAPABILITIES, &PRINTED).await;
}

#[tokio::test(start_paused = true)]
async fn every_printed_frame_is_answered() {
    // The factory settings are the values of the first sample.
    answered(&PRINTED).await;
}

#[tokio::test(start_paused = true)]
async fn function_3_page_12() {
    let (line, other_end) = scripted(&[READ]);
    let words = registers(&line).at(Class::Background).read_words(3102, 4).await.unwrap();
    assert_eq!(words, [0x0028, 0x0258, 0x01F4, 0x0000]);
    let shown: Vec<String> = [3102, 3103, 3104, 3105]
        .into_iter()
        .zip(words)
        .map(|(address, word)| {
            let row: &Row =
                Atv312::<drive_bus::Slave>::ROWS.iter().find(|row| row.address == address).unwrap();
            format!("{} = {}", row.code, row.show(word))
        })
        .collect();
    assert_eq!(shown, ["SFr = 4.0 kHz", "tFr = 60.0 Hz", "HSP = 50.0 Hz", "LSP = 0.0 Hz"]);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_6_page_12() {
    let (line, other_end) = scripted(&[WRITE]);
    registers(&line).at(Class::Background).write_word(9001, 0x000D).await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_43_pages_13_and_14() {
    assert_eq!(frames::frame(IDENTIFICATION.1).len(), 48, "p. 13: the total response size");
    let (line, other_end) = scripted(&[IDENTIFICATION]);
    let identity = registers(&line).at(Class::Background).identification(ReadCode::Basic).await.unwrap();
    let expected = Identity {
        vendor: Some("TELEMECANIQUE".to_owned()),
        model: Some("ATV31HU09M3S232".to_owned()),
        version: Some("0201".to_owned()),
        codes: Vec::new(),
    };
    assert_eq!(identity, expected);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_negative_response_to_function_43_page_14() {
    for (code, meaning) in [
        (0, ExceptionMeaning::Unknown),
        (1, ExceptionMeaning::NoSuchFunction),
        (2, ExceptionMeaning::NoSuchRegister),
    ] {
        let (line, other_end) = scripted(&[(IDENTIFICATION.0, &format!("02 AB 0E {code:02X}"))]);
        let slave = bench::address(2);
        let mut registers =
            Registers::new(line.slave(2), slave, &CAPABILITIES, drive_atv312::exception_meaning);
        let error = registers.at(Class::Background).identification(ReadCode::Basic).await.unwrap_err();
        assert!(
            matches!(error, Error::Exception { code: told, meaning: means, .. } if (told, means) == (code, meaning)),
            "{error}"
        );
        other_end.is_done().await;
    }
    // The simulated drive: another identification code, another object.
    answered(&[("02 2B 0E 02 00", "02 AB 0E 01"), ("02 2B 0E 01 05", "02 AB 0E 02")]).await;
}

#[tokio::test(start_paused = true)]
async fn function_16_page_14() {
    let (line, other_end) = scripted(&[WRITE_TWO]);
    registers(&line).at(Class::Background).write_words(9001, &[20, 30]).await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn exceptions_page_15() {
    for (code, meaning) in [
        (1, ExceptionMeaning::NoSuchFunction),
        (2, ExceptionMeaning::NoSuchRegister),
        (3, ExceptionMeaning::ValueRefused),
        (4, ExceptionMeaning::Failed),
        (5, ExceptionMeaning::Accepted),
        (7, ExceptionMeaning::Unknown),
    ] {
        let (line, other_end) = scripted(&[("02 03 0C81 0001", &format!("02 83 {code:02X}"))]);
        let mut drive = Atv312::new(line.slave(2), bench::address(2));
        let error = drive.keep_alive().await.unwrap_err();
        assert!(matches!(error, Error::Exception { meaning: means, .. } if means == meaning), "{error}");
        other_end.is_done().await;
    }
    answered(&[
        ("02 04 0C81 0001", "02 84 01"),
        ("02 08 0000 A537", "02 88 01"),
        ("02 03 0C88 0001", "02 83 02"),
        ("02 03 0C81 001E", "02 83 03"),
        ("02 06 0C81 0000", "02 86 02"),
        ("02 06 1B62 0002", "02 86 03"),
    ])
    .await;
}

#[tokio::test(start_paused = true)]
async fn a_request_beyond_the_words_of_page_12_is_never_sent() {
    let (line, other_end) = scripted(&[]);
    let mut registers = registers(&line);
    let read = registers.at(Class::Background).read_words(11401, 30).await;
    assert!(matches!(read, Err(Error::TooManyWords { words: 30, limit: 29, .. })));
    let write = registers.at(Class::Background).write_words(11410, &[0; 28]).await;
    assert!(matches!(write, Err(Error::TooManyWords { words: 28, limit: 27, .. })));
    other_end.is_done().await;
}
