//! A scripted server at the far end of a TCP connection, in real time: every step waits for an event, and [`PATIENCE`]
//! only ends a test that would hang.

use std::{io, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{PortError, Terms};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    task::JoinHandle,
    time::timeout,
};
use tokio_modbus::{Request, Response, client::Client};

/// Longer than anything takes on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// A server that waits for connections.
pub(crate) struct Server {
    listener: TcpListener,
}

impl Server {
    pub(crate) async fn bind() -> Self {
        Self { listener: TcpListener::bind("127.0.0.1:0").await.unwrap() }
    }

    pub(crate) fn address(&self) -> String {
        self.listener.local_addr().unwrap().to_string()
    }

    pub(crate) async fn accept(&self) -> Connection {
        let (stream, _) = timeout(PATIENCE, self.listener.accept()).await.unwrap().unwrap();
        stream.set_nodelay(true).unwrap();
        Connection { stream }
    }

    /// A line to this server, and its end of the connection.
    pub(crate) async fn serve(&self, config: LineConfig) -> (Line, Connection) {
        let line = Line::open(config).await.unwrap();
        (line, self.accept().await)
    }
}

impl From<TcpListener> for Server {
    fn from(listener: TcpListener) -> Self {
        Self { listener }
    }
}

/// One connection. Dropping it closes it.
pub(crate) struct Connection {
    stream: TcpStream,
}

impl Connection {
    /// The next request, so many bytes long.
    pub(crate) async fn request<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        timeout(PATIENCE, self.stream.read_exact(&mut bytes)).await.unwrap().unwrap();
        bytes
    }

    /// Sends these bytes in one segment.
    pub(crate) async fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).await.unwrap();
    }

    /// Sends these bytes in segments of one byte, and lets the line read in between.
    pub(crate) async fn send_one_by_one(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.send(&[*byte]).await;
            tokio::task::yield_now().await;
        }
    }

    /// Waits until the line has closed its end, and takes what it still sent before that.
    pub(crate) async fn rest(mut self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        timeout(PATIENCE, self.stream.read_to_end(&mut bytes)).await.unwrap().map(|_| bytes)
    }
}

/// A call that goes on while the test plays the server.
pub(crate) fn call(
    line: &Line,
    slave: u8,
    terms: Terms,
    request: Request<'static>,
) -> JoinHandle<Result<Response, PortError>> {
    let mut slave = line.slave(slave).with_terms(terms);
    tokio::spawn(async move {
        let answer = slave.call(request).await.map_err(PortError::from_modbus)?;
        Ok(answer.expect("no slave refuses anything here"))
    })
}

/// The outcome of a call.
pub(crate) async fn outcome(call: JoinHandle<Result<Response, PortError>>) -> Result<Response, PortError> {
    timeout(PATIENCE, call).await.unwrap().unwrap()
}
