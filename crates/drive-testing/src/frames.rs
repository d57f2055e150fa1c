//! Frames as manuals print them, byte for byte on a wire.
//!
//! A frame is text: hexadecimal digits, spaced as one likes. Behind a `|` stands the CRC that the manual prints, which
//! must be the right one; without it the CRC is computed. An empty answer is none. In what a simulated drive answers `x`
//! is any digit, for values that the manual leaves open.

use std::{io, time::Duration};

use bytes::Bytes;
use drive_bus::{Line, LineConfig};
use drive_core::{
    Capabilities, Class, Error, ExceptionMeaning, Exchange, Registers, SerialSettings, SlaveAddress,
};
use drive_sim::{Model, SimLine, Wiring};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinHandle,
};
use tokio_modbus::{Request, Response, client::Client};

/// A request and its answer.
pub type Printed<'a> = (&'a str, &'a str);

/// The silence that ends a frame, and the time in which an answer would come that must not.
const SILENCE: Duration = Duration::from_millis(200);

/// The bytes of a frame, with its CRC.
///
/// # Panics
/// When the printed CRC is not that of the frame.
#[must_use]
pub fn frame(text: &str) -> Vec<u8> {
    let (text, printed) = text.split_once('|').map_or((text, None), |(frame, crc)| (frame, Some(crc)));
    let mut bytes = hexadecimal(text);
    if bytes.is_empty() {
        return bytes;
    }
    let crc = crc(&bytes);
    if let Some(printed) = printed {
        assert_eq!(hexadecimal(printed), crc, "the CRC of {text}");
    }
    bytes.extend(crc);
    bytes
}

/// How many of these frames the manual prints with a CRC.
#[must_use]
pub fn with_crc(exchanges: &[Printed<'_>]) -> usize {
    exchanges.iter().flat_map(|(request, answer)| [request, answer]).filter(|text| text.contains('|')).count()
}

/// The other end of a line, played by a script.
#[derive(Debug)]
pub struct OtherEnd {
    line: Line,
    played: JoinHandle<Vec<u8>>,
}

impl OtherEnd {
    /// The script is over: everything of it was sent, and nothing else.
    ///
    /// # Panics
    /// When that is not so.
    pub async fn is_done(self) {
        self.line.close().await;
        let more = self.played.await.expect("the script is played to its end");
        assert!(more.is_empty(), "sent beyond the script: {more:02X?}");
    }
}

/// A real line whose other end expects each request byte for byte and then sends its answer.
#[must_use]
pub fn scripted(settings: SerialSettings, script: &[Printed<'_>]) -> (Line, OtherEnd) {
    let (ours, theirs) = tokio::io::duplex(512);
    let line = Line::over(ours, LineConfig::stream(settings));
    let script = script.iter().map(|(request, answer)| (frame(request), frame(answer))).collect();
    let played = tokio::spawn(play(theirs, script));
    (line.clone(), OtherEnd { line, played })
}

async fn play(mut wire: DuplexStream, script: Vec<(Vec<u8>, Vec<u8>)>) -> Vec<u8> {
    for (request, answer) in script {
        let mut sent = vec![0; request.len()];
        wire.read_exact(&mut sent).await.unwrap_or_else(|_| panic!("{request:02X?} was not sent"));
        assert_eq!(sent, request, "sent {sent:02X?} instead of {request:02X?}");
        // Whoever does not wait for the answer of the last exchange has closed the line by now.
        let _ = wire.write_all(&answer).await;
    }
    let mut more = Vec::new();
    let _ = wire.read_to_end(&mut more).await;
    more
}

/// Lets a driver send each of these requests over a real line, through the register access that all families use, and
/// read its answer. What that access refuses to send is seen to be refused, and then given to the line as it is.
///
/// # Panics
/// When another byte is sent, or the answer is read as something else than what it says.
pub async fn sent_and_read(capabilities: &'static Capabilities, exchanges: &[Printed<'_>]) {
    for exchange in exchanges {
        let (line, other_end) = scripted(capabilities.factory, &[*exchange]);
        let (request, answer) = (frame(exchange.0), frame(exchange.1));
        let read = match request.first().copied().and_then(|slave| SlaveAddress::try_from(slave).ok()) {
            Some(slave) => ask(&line, slave, capabilities, &request).await,
            None => line.broadcast().call(decoded(pdu(&request))).await.expect("it is sent").map(|_| None),
        };
        let exception = answer.get(1).is_some_and(|function| function & 0x80 != 0);
        match read {
            Ok(Some(words)) => assert_eq!(words, words_of(pdu(&answer)), "{}", exchange.1),
            Ok(None) => assert!(!exception, "{}", exchange.1),
            Err(code) => assert_eq!(pdu(&answer)[1..], [u8::from(code)], "{}", exchange.1),
        }
        other_end.is_done().await;
    }
}

/// The words that were read, or `None` for what is not read; the exception where the drive refuses.
async fn ask(
    line: &Line,
    slave: SlaveAddress,
    capabilities: &'static Capabilities,
    request: &[u8],
) -> Result<Option<Vec<u16>>, tokio_modbus::ExceptionCode> {
    let mut registers = Registers::new(line.slave(slave.number()), slave, capabilities, meaning);
    let mut calls = registers.at(Class::Command);
    let result = match decoded(pdu(request)) {
        Request::ReadHoldingRegisters(first, count) => calls.read_words(first, count).await.map(Some),
        Request::WriteSingleRegister(at, word) => calls.write_word(at, word).await.map(|()| None),
        Request::WriteMultipleRegisters(first, words) => {
            calls.write_words(first, &words).await.map(|()| None)
        }
        Request::ReadDeviceIdentification(code, 0) => calls.identification(code).await.map(|_| None),
        other => {
            let exchange = Exchange { function: pdu(request)[0], register: None };
            calls.request(other, exchange).await.map(|_| None)
        }
    };
    match result {
        Ok(read) => Ok(read),
        Err(Error::Exception { code, .. }) => Err(tokio_modbus::ExceptionCode::new(code)),
        Err(Error::TooManyWords { .. }) => {
            line.slave(slave.number()).call(decoded(pdu(request))).await.expect("it answers").map(|_| None)
        }
        Err(error) => panic!("{error}"),
    }
}

const fn meaning(_: u8, code: u8) -> ExceptionMeaning {
    ExceptionMeaning::standard(code)
}

/// What a simulated drive at this address of a line of its own answers to each of these requests, one after the other.
///
/// # Panics
/// When the answer is another one.
pub async fn answered(
    settings: SerialSettings,
    slave: u8,
    model: impl Model + 'static,
    exchanges: &[Printed<'_>],
) {
    let line = SimLine::new(Wiring::rtu(settings));
    line.add(slave, model).expect("the address is free");
    let mut master = line.in_memory();
    for exchange in exchanges {
        answered_on(&mut master, *exchange).await;
    }
    assert_eq!(line.violations(), []);
}

/// The same for one exchange on a line that is there already.
///
/// # Panics
/// When the answer is another one.
pub async fn answered_on(master: &mut DuplexStream, (request, answer): Printed<'_>) {
    master.write_all(&frame(request)).await.expect("the line is open");
    let mut got = Vec::new();
    while let Ok(read) = tokio::time::timeout(SILENCE, master.read_buf(&mut got)).await {
        assert_ne!(read.expect("the line is open"), 0, "the line was closed");
    }
    if !answer.contains('x') {
        assert_eq!(got, frame(answer), "{request}: {got:02X?}");
        return;
    }
    let data = got.get(..got.len().saturating_sub(2)).unwrap_or_default();
    assert_eq!(got[data.len()..], crc(data), "{request}: {got:02X?}");
    let digits = data.iter().flat_map(|byte| [byte >> 4, byte & 0xF]);
    let pattern: Vec<char> = answer.chars().filter(char::is_ascii_alphanumeric).collect();
    assert_eq!(pattern.len(), 2 * data.len(), "{request}: {got:02X?}");
    let fits = digits
        .zip(pattern)
        .all(|(digit, printed)| printed == 'x' || printed.to_digit(16) == Some(u32::from(digit)));
    assert!(fits, "{request}: {got:02X?}");
}

/// A frame without its address and CRC.
fn pdu(frame: &[u8]) -> &[u8] {
    frame.get(1..frame.len().saturating_sub(2)).unwrap_or_default()
}

/// A request as tokio-modbus has it; what it does not decode stays what it is.
fn decoded(pdu: &[u8]) -> Request<'static> {
    let bytes = Bytes::copy_from_slice(pdu);
    let custom = || Request::Custom(pdu[0], pdu[1..].to_vec().into());
    Request::try_from(bytes).unwrap_or_else(|_: io::Error| custom())
}

/// The words that the answer of function 03 holds.
fn words_of(pdu: &[u8]) -> Vec<u16> {
    match Response::try_from(Bytes::copy_from_slice(pdu)) {
        Ok(Response::ReadHoldingRegisters(words)) => words,
        other => panic!("{pdu:02X?} is {other:?}"),
    }
}

fn hexadecimal(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let byte = |at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..digits.len()).step_by(2).map(byte).collect();
    bytes.unwrap_or_else(|| panic!("{text} is no frame"))
}

/// As all five manuals print it: initialise to FFFFh; XOR each byte; shift right eight times, XOR A001h when a 1 falls
/// out; the low byte first.
fn crc(frame: &[u8]) -> [u8; 2] {
    let mut crc = 0xFFFF_u16;
    for &byte in frame {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 };
        }
    }
    crc.to_le_bytes()
}
