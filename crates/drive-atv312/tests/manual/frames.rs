//! Every frame that BBV52816 04/2009 prints, byte for byte: what the driver sends and how it reads the answer, and what
//! the simulated drive answers.

use drive_atv312::{Atv312, CAPABILITIES};
use drive_bus::{Line, LineConfig};
use drive_core::{
    Class, Drive, Error, ExceptionMeaning, Identity, Registers, Row, SerialSettings, SlaveAddress,
};
use drive_sim::{SimLine, Wiring, models};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_modbus::prelude::ReadCode;

/// p. 12, function 3: W3102 to W3105 of slave 2.
const READ: (&str, &str) = ("02 03 0C1E 0004 276C", "02 03 08 0028 0258 01F4 0000 52B0");
/// p. 12, function 6: 000Dh to W9001 of slave 2; request and answer.
const WRITE: (&str, &str) = ("02 06 2329 000D 9270", "02 06 2329 000D 9270");
/// p. 14, function 43: the answer in its four lines.
const IDENTIFICATION: (&str, &str) = (
    "02 2B 0E 01 00 3477",
    "02 2B 0E 01 02 00 00 03 \
     00 0D 54 45 4C 45 4D 45 43 41 4E 49 51 55 45 \
     01 0F 41 54 56 33 31 48 55 30 39 4D 33 53 32 33 32 \
     02 04 30 32 30 31 A80F",
);
/// p. 14, function 16: 20 and 30 to W9001 and W9002 of slave 2. The printed CRCs 517F and 8FED are those of the address
/// 6189h; the frame has these.
const WRITE_TWO: (&str, &str) = ("02 10 2329 0002 04 0014 001E 73A4", "02 10 2329 0002 9BB7");

fn hexadecimal(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap();
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// The CRC as p. 15 prints its calculation, low byte first.
fn crc(bytes: &[u8]) -> [u8; 2] {
    let mut crc: u16 = 0xFFFF;
    for &byte in bytes {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            let out = crc & 1 == 1;
            crc >>= 1;
            if out {
                crc ^= 0xA001;
            }
        }
    }
    crc.to_le_bytes()
}

/// A frame of hexadecimal text with its CRC.
fn sealed(text: &str) -> Vec<u8> {
    let mut frame = hexadecimal(text);
    let crc = crc(&frame);
    frame.extend(crc);
    frame
}

fn slave() -> SlaveAddress {
    SlaveAddress::try_from(2).unwrap()
}

/// A line whose other end expects these bytes and answers those.
fn scripted(request: Vec<u8>, answer: Vec<u8>) -> (Line, tokio::task::JoinHandle<DuplexStream>) {
    let (ours, mut theirs) = tokio::io::duplex(512);
    let line = Line::over(ours, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let script = tokio::spawn(async move {
        let mut sent = vec![0; request.len()];
        theirs.read_exact(&mut sent).await.unwrap();
        assert_eq!(sent, request, "sent {sent:02X?} instead of {request:02X?}");
        theirs.write_all(&answer).await.unwrap();
        theirs
    });
    (line, script)
}

fn registers(line: &Line) -> Registers<drive_bus::Slave> {
    Registers::new(line.slave(2), slave(), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown)
}

/// What the simulated drive at address 2 answers to these bytes.
async fn simulated(request: &[u8], answer_length: usize) -> Vec<u8> {
    let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let model = models::atv312::Atv312::new().identified_as("ATV31HU09M3S232", "0201");
    line.add(2, model).unwrap();
    let mut master = line.in_memory();
    master.write_all(request).await.unwrap();
    let mut answer = vec![0; answer_length];
    master.read_exact(&mut answer).await.unwrap();
    answer
}

#[test]
fn the_printed_crcs_are_right_but_for_two() {
    for (request, answer) in [READ, WRITE, IDENTIFICATION, WRITE_TWO] {
        for frame in [request, answer].map(hexadecimal) {
            let (data, printed) = frame.split_at(frame.len() - 2);
            assert_eq!(crc(data), printed, "{frame:02X?}");
        }
    }
    let misprinted = hexadecimal("02 10 6189 0002 04 0014 001E 517F");
    assert_eq!(crc(&misprinted[..11]), misprinted[11..], "they fit another address");
    let misprinted = hexadecimal("02 10 6189 0002 8FED");
    assert_eq!(crc(&misprinted[..6]), misprinted[6..]);
}

#[tokio::test(start_paused = true)]
async fn function_3_page_12() {
    let (line, script) = scripted(hexadecimal(READ.0), hexadecimal(READ.1));
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
    script.await.unwrap();
    // The factory settings are the values of the sample.
    let answer = hexadecimal(READ.1);
    assert_eq!(simulated(&hexadecimal(READ.0), answer.len()).await, answer);
}

#[tokio::test(start_paused = true)]
async fn function_6_page_12() {
    let (line, script) = scripted(hexadecimal(WRITE.0), hexadecimal(WRITE.1));
    registers(&line).at(Class::Background).write_word(9001, 0x000D).await.unwrap();
    script.await.unwrap();
    let answer = hexadecimal(WRITE.1);
    assert_eq!(simulated(&hexadecimal(WRITE.0), answer.len()).await, answer);
}

#[tokio::test(start_paused = true)]
async fn function_43_pages_13_and_14() {
    let answer = hexadecimal(IDENTIFICATION.1);
    assert_eq!(answer.len(), 48, "p. 13: the total response size");
    let (line, script) = scripted(hexadecimal(IDENTIFICATION.0), answer.clone());
    let identity = registers(&line).at(Class::Background).identification(ReadCode::Basic).await.unwrap();
    let expected = Identity {
        vendor: Some("TELEMECANIQUE".to_owned()),
        model: Some("ATV31HU09M3S232".to_owned()),
        version: Some("0201".to_owned()),
        codes: Vec::new(),
    };
    assert_eq!(identity, expected);
    script.await.unwrap();
    assert_eq!(simulated(&hexadecimal(IDENTIFICATION.0), answer.len()).await, answer);
}

#[tokio::test(start_paused = true)]
async fn the_negative_response_to_function_43_page_14() {
    for (code, meaning) in [
        (0, ExceptionMeaning::Unknown),
        (1, ExceptionMeaning::NoSuchFunction),
        (2, ExceptionMeaning::NoSuchRegister),
    ] {
        let answer = sealed(&format!("02 AB 0E {code:02X}"));
        let (line, script) = scripted(hexadecimal(IDENTIFICATION.0), answer);
        let mut registers =
            Registers::new(line.slave(2), slave(), &CAPABILITIES, drive_atv312::exception_meaning);
        let error = registers.at(Class::Background).identification(ReadCode::Basic).await.unwrap_err();
        assert!(
            matches!(error, Error::Exception { code: told, meaning: means, .. } if (told, means) == (code, meaning)),
            "{error}"
        );
        script.await.unwrap();
    }
    // The simulated drive: another identification code, another object.
    for (request, answer) in [("02 2B 0E 02 00", "02 AB 0E 01"), ("02 2B 0E 01 05", "02 AB 0E 02")] {
        let answer = sealed(answer);
        assert_eq!(simulated(&sealed(request), answer.len()).await, answer);
    }
}

#[tokio::test(start_paused = true)]
async fn function_16_page_14() {
    let (line, script) = scripted(hexadecimal(WRITE_TWO.0), hexadecimal(WRITE_TWO.1));
    registers(&line).at(Class::Background).write_words(9001, &[20, 30]).await.unwrap();
    script.await.unwrap();
    let answer = hexadecimal(WRITE_TWO.1);
    assert_eq!(simulated(&hexadecimal(WRITE_TWO.0), answer.len()).await, answer);
}

#[tokio::test(start_paused = true)]
async fn exceptions_page_15() {
    for (code, meaning) in [
        (1, ExceptionMeaning::NoSuchFunction),
        (2, ExceptionMeaning::NoSuchRegister),
        (3, ExceptionMeaning::ValueRefused),
        (4, ExceptionMeaning::Failed),
        (5, ExceptionMeaning::Unknown),
    ] {
        let (line, script) = scripted(sealed("02 03 0C81 0001"), sealed(&format!("02 83 {code:02X}")));
        let mut drive = Atv312::new(line.slave(2), slave());
        let error = drive.keep_alive().await.unwrap_err();
        assert!(matches!(error, Error::Exception { meaning: means, .. } if means == meaning), "{error}");
        script.await.unwrap();
    }
    for (request, answer) in [
        ("02 04 0C81 0001", "02 84 01"),
        ("02 08 0000 A537", "02 88 01"),
        ("02 03 0C88 0001", "02 83 02"),
        ("02 03 0C81 001E", "02 83 03"),
        ("02 06 0C81 0000", "02 86 02"),
        ("02 06 1B62 0002", "02 86 03"),
    ] {
        let answer = sealed(answer);
        assert_eq!(simulated(&sealed(request), answer.len()).await, answer, "{request}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_request_beyond_the_words_of_page_12_is_never_sent() {
    let (line, script) = scripted(Vec::new(), Vec::new());
    let mut registers = registers(&line);
    let read = registers.at(Class::Background).read_words(11401, 30).await;
    assert!(matches!(read, Err(Error::TooManyWords { words: 30, limit: 29, .. })));
    let write = registers.at(Class::Background).write_words(11410, &[0; 28]).await;
    assert!(matches!(write, Err(Error::TooManyWords { words: 28, limit: 27, .. })));
    let mut theirs = script.await.unwrap();
    line.close().await;
    let mut sent = Vec::new();
    theirs.read_to_end(&mut sent).await.unwrap();
    assert!(sent.is_empty());
}
