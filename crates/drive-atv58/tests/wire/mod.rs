//! A port that speaks RTU bytes to a script: every request it must send, and the answer that it then gets; and the
//! other side, a script that speaks RTU bytes to a simulated drive.

use std::{collections::VecDeque, io, time::Duration};

use async_trait::async_trait;
use bytes::Bytes;
use drive_core::{Port, PortError, SerialSettings};
use drive_sim::{Model, SimLine, Wiring};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_modbus::{ExceptionCode, Request, Response, Slave, client::Client, slave::SlaveContext};

/// The script: requests and answers as the manual prints them, without the CRC, which is computed as it says.
#[derive(Debug)]
pub(crate) struct Wire {
    slave: u8,
    script: VecDeque<(Vec<u8>, Vec<u8>)>,
}

impl Wire {
    /// Each pair is a request and its answer, in hexadecimal and with spaces as one likes; an empty answer is none. A
    /// frame whose CRC is printed ends in `|` and the CRC.
    pub(crate) fn new(script: &[(&str, &str)]) -> Self {
        let script = script.iter().map(|(request, answer)| (frame(request), frame(answer))).collect();
        Self { slave: 0, script }
    }

    /// Whether everything was sent.
    pub(crate) fn is_done(&self) -> bool {
        self.script.is_empty()
    }
}

impl Port for Wire {}

impl SlaveContext for Wire {
    fn set_slave(&mut self, slave: Slave) {
        self.slave = slave.0;
    }
}

#[async_trait]
impl Client for Wire {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let function = request.function_code().value();
        let mut sent = vec![self.slave];
        sent.extend(pdu(&request));
        seal(&mut sent);
        let (expected, answer) = self.script.pop_front().expect("the script has ended");
        assert_eq!(sent, expected, "sent {sent:02X?} instead of {expected:02X?}");
        let Some(data) = answer.len().checked_sub(2).and_then(|end| answer.get(1..end)) else {
            let silence = PortError::Timeout { after: Duration::from_millis(100) };
            return Err(tokio_modbus::Error::Transport(silence.into_io()));
        };
        if data[0] == function | 0x80 {
            return Ok(Err(ExceptionCode::new(data[1])));
        }
        if let Request::Custom(..) = request {
            return Ok(Ok(Response::Custom(function, Bytes::copy_from_slice(&data[1..]))));
        }
        Ok(Ok(Response::try_from(Bytes::copy_from_slice(data)).map_err(io::Error::other)?))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Sends each request to a simulated drive and expects the answer, of which `xx` may be any byte, with its CRC; an empty
/// one is none.
pub(crate) async fn answers(
    settings: SerialSettings,
    slave: u8,
    model: impl Model + 'static,
    script: &[(&str, &str)],
) {
    let line = SimLine::new(Wiring::rtu(settings));
    line.add(slave, model).unwrap();
    let mut master = line.in_memory();
    for (request, answer) in script {
        master.write_all(&frame(request)).await.unwrap();
        let expected = frame(&answer.replace("xx", "00"));
        let mut got = vec![0; expected.len()];
        master.read_exact(&mut got).await.unwrap();
        if answer.contains("xx") {
            let (printed, _) = answer.split_once("xx").unwrap();
            assert!(got.starts_with(&hexadecimal(printed)), "{request}: {got:02X?}");
            let mut sealed = got[..got.len() - 2].to_vec();
            seal(&mut sealed);
            assert_eq!(got, sealed, "{request}");
        } else {
            assert_eq!(got, expected, "{request}");
        }
        // The silence that ends a frame, and the time in which an answer would come that must not.
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert!(line.violations().is_empty(), "{:?}", line.violations());
}

/// A frame as printed, with its CRC: computed, and equal to the printed one where there is one.
fn frame(text: &str) -> Vec<u8> {
    let (text, printed) = text.split_once('|').map_or((text, None), |(frame, crc)| (frame, Some(crc)));
    let mut bytes = hexadecimal(text);
    if bytes.is_empty() {
        return bytes;
    }
    seal(&mut bytes);
    if let Some(crc) = printed {
        assert!(bytes.ends_with(&hexadecimal(crc)), "{text}: the CRC is {:02X?}", &bytes[bytes.len() - 2..]);
    }
    bytes
}

fn hexadecimal(text: &str) -> Vec<u8> {
    let digits: Vec<u8> =
        text.chars().filter_map(|digit| digit.to_digit(16)).map(|digit| digit as u8).collect();
    digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect()
}

/// "Calcul du CRC16": initialise to FFFFh; XOR each byte; shift right eight times, XOR A001h when a 1 falls out; least
/// significant byte first.
fn seal(frame: &mut Vec<u8>) {
    let mut crc = 0xFFFF_u16;
    for &byte in frame.iter() {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            let out = crc & 1;
            crc >>= 1;
            if out == 1 {
                crc ^= 0xA001;
            }
        }
    }
    frame.extend(crc.to_le_bytes());
}

/// The requests that the manual lists, as its frame tables say.
fn pdu(request: &Request<'_>) -> Vec<u8> {
    let mut pdu = vec![request.function_code().value()];
    match request {
        Request::ReadHoldingRegisters(first, count) | Request::ReadInputRegisters(first, count) => {
            pdu.extend(first.to_be_bytes());
            pdu.extend(count.to_be_bytes());
        }
        Request::WriteSingleRegister(at, word) => {
            pdu.extend(at.to_be_bytes());
            pdu.extend(word.to_be_bytes());
        }
        Request::WriteMultipleRegisters(first, words) => {
            pdu.extend(first.to_be_bytes());
            pdu.extend((words.len() as u16).to_be_bytes());
            pdu.push(words.len() as u8 * 2);
            pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
        }
        Request::Custom(_, data) => pdu.extend(data.iter()),
        other => panic!("the manual has no {other:?}"),
    }
    pdu
}
