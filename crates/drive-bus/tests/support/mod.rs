//! A scripted peer at the far end of an in-memory stream: it sees what the line sends and answers what the test says.

#![allow(dead_code, reason = "each test file uses its part")]

pub(crate) mod by_hand;
pub(crate) mod doubling;
pub(crate) mod rig;
pub(crate) mod script;
#[cfg(feature = "tcp")]
pub(crate) mod server;
#[cfg(feature = "unitelway")]
pub(crate) mod telway;
#[cfg(feature = "tcp")]
pub(crate) mod truth;
#[cfg(feature = "unitelway")]
pub(crate) mod unitelway;

use std::time::Duration;

use drive_bus::{Line, LineConfig, Slave, exchange::rtu};
use drive_core::{PortError, serial::SerialSettings};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinHandle,
    time::{Instant, sleep, sleep_until},
};
use tokio_modbus::{Request, Response, client::Client};

pub(crate) const MS: Duration = Duration::from_millis(1);

/// How a call ends.
pub(crate) type Called = tokio_modbus::Result<Response>;

/// One line at 19200 8E1 and the far end of its stream.
pub(crate) fn line(change: impl FnOnce(LineConfig) -> LineConfig) -> (Line, Peer) {
    let (ours, theirs) = tokio::io::duplex(4_096);
    let line = Line::over(ours, change(LineConfig::stream(SerialSettings::MODBUS_DEFAULT)));
    (line, Peer { stream: theirs, last: None })
}

/// The far end.
pub(crate) struct Peer {
    stream: DuplexStream,
    last: Option<Instant>,
}

impl Peer {
    /// The next request: everything that comes in one piece.
    pub(crate) async fn request(&mut self) -> Vec<u8> {
        let mut bytes = vec![0; 512];
        let len = self.stream.read(&mut bytes).await.unwrap();
        bytes.truncate(len);
        assert!(rtu::is_frame(&bytes), "the line sent {bytes:02X?}");
        // The line hands a frame over at once; on the wire it takes its characters.
        self.last = Some(Instant::now() + characters(len));
        bytes
    }

    /// Whether the port is closed, and nothing more comes before that.
    pub(crate) async fn closed(&mut self) -> bool {
        self.stream.read(&mut [0; 512]).await.unwrap() == 0
    }

    /// The next request, answered at once with `pdu` by the slave that it was for.
    pub(crate) async fn answer(&mut self, pdu: &[u8]) -> Vec<u8> {
        let request = self.request().await;
        self.after(5 * MS, &rtu::frame(request[0], pdu)).await;
        request
    }

    /// Bytes on the line, their last character `pause` and the characters' own time after the end of the last request.
    pub(crate) async fn after(&mut self, pause: Duration, bytes: &[u8]) {
        let from = self.last.unwrap_or_else(Instant::now);
        sleep_until(from + pause + characters(bytes.len())).await;
        self.stream.write_all(bytes).await.unwrap();
    }

    /// Bytes on the line, one by one, as a UART delivers them.
    pub(crate) async fn one_by_one(&mut self, bytes: &[u8]) {
        // The slave begins when it has heard the request.
        sleep_until(self.last.unwrap_or_else(Instant::now)).await;
        for byte in bytes {
            sleep(characters(1)).await;
            self.stream.write_all(&[*byte]).await.unwrap();
        }
    }

    /// Bytes on the line now.
    pub(crate) async fn now(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).await.unwrap();
    }

    /// Nothing comes for this long.
    pub(crate) async fn hears_nothing_for(&mut self, time: Duration) {
        let mut byte = [0];
        let heard = tokio::time::timeout(time, self.stream.read(&mut byte)).await;
        assert!(heard.is_err(), "the line sent {byte:02X?} too early");
    }
}

/// FC03, `quantity` registers from `address`.
pub(crate) async fn read(slave: &mut Slave, address: u16, quantity: u16) -> Result<Vec<u16>, PortError> {
    match slave.call(Request::ReadHoldingRegisters(address, quantity)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => Ok(words),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

/// FC06, one register.
pub(crate) async fn write(slave: &mut Slave, address: u16, word: u16) -> Result<(), PortError> {
    match slave.call(Request::WriteSingleRegister(address, word)).await {
        Ok(Ok(Response::WriteSingleRegister(got, value))) if (got, value) == (address, word) => Ok(()),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

/// A call that goes on by itself.
pub(crate) fn calls(mut slave: Slave, request: Request<'static>) -> JoinHandle<Called> {
    tokio::spawn(async move { slave.call(request).await })
}

/// The same read, that goes on by itself.
pub(crate) fn reads(
    mut slave: Slave,
    address: u16,
    quantity: u16,
) -> JoinHandle<Result<Vec<u16>, PortError>> {
    tokio::spawn(async move { read(&mut slave, address, quantity).await })
}

/// The same write, that goes on by itself.
pub(crate) fn writes(mut slave: Slave, address: u16, word: u16) -> JoinHandle<Result<(), PortError>> {
    tokio::spawn(async move { write(&mut slave, address, word).await })
}

/// The time of so many characters at 19200 8E1.
pub(crate) fn characters(count: usize) -> Duration {
    SerialSettings::MODBUS_DEFAULT.characters(count)
}
