//! The ear at a port.

use std::{
    future, io,
    pin::Pin,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use tokio::{
    io::{AsyncRead, AsyncReadExt},
    time::{Instant, sleep_until},
};

use super::{Ear, Heard};
use crate::{
    config::{Endpoint, LineConfig},
    protocol::ProtocolMismatch,
    transport::{Connector, OpenError},
};

/// What a busy host adds to the time at which it is handed something: one slice of its scheduler.
const HOST: Duration = Duration::from_millis(4);
/// What USB adds, where the adapter's driver does not say how long it collects.
#[cfg(feature = "serial")]
const USB: Duration = Duration::from_millis(1);
/// What a serial server and the network add at the most, as far as one can say.
#[cfg(feature = "tcp")]
const NETWORK: Duration = Duration::from_millis(100);
/// What a UART collects before it hands anything over, and how long it waits for more.
#[cfg(feature = "serial")]
const COLLECTED: usize = 8 + 4;

/// Listens to a port, and never writes to it.
///
/// ```
/// use drive_bus::{LineConfig, listen::{Listener, Role}};
/// use drive_core::SerialSettings;
/// # #[tokio::main(flavor = "current_thread")]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // A master asks slave 1 for the word at 0C81h.
/// let asked: &[u8] = &[0x01, 0x03, 0x0C, 0x81, 0x00, 0x01, 0xD7, 0x72];
/// let line = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
/// let mut listener = Listener::over(asked, &line)?;
/// let heard = listener.next().await?.ok_or("the line has ended")?;
/// assert_eq!(heard.role, Role::Request);
/// assert!(listener.next().await?.is_none());
/// # Ok(())
/// # }
/// ```
pub struct Listener {
    stream: Pin<Box<dyn AsyncRead + Send>>,
    ear: Ear,
    /// One moment by two clocks.
    began: (Duration, Instant),
    late: Duration,
    has_ended: bool,
}

impl Listener {
    /// Opens the port of this configuration: a serial port, or a serial server that gives what it hears to each connection
    /// (RTU over TCP). What that does to a line stands in the [module's documentation](super#the-port).
    ///
    /// # Errors
    /// [`OpenError`]; also for Modbus TCP, which is no line.
    pub async fn open(config: &LineConfig) -> Result<Self, OpenError> {
        if !config.protocol.is_paced() {
            return Err(ProtocolMismatch::NoLine.into());
        }
        let opening = Connector::to(config)?.connect().ok_or(OpenError::NoPort)?;
        let stream = opening.await?;
        Self::over(stream, config)
    }

    /// Listens to a stream: in memory, a pty, a pipe.
    ///
    /// # Errors
    /// [`OpenError::Protocol`] for Modbus TCP, which is no line.
    pub fn over(stream: impl AsyncRead + Send + 'static, config: &LineConfig) -> Result<Self, OpenError> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let ear = Ear::new(config, since).ok_or(ProtocolMismatch::NoLine)?;
        let (stream, began) = (Box::pin(stream), (since, Instant::now()));
        Ok(Self { stream, ear, began, late: lateness(config), has_ended: false })
    }

    /// How much later than its last bit a frame is handed over at the most, as far as the port and its adapter tell: the
    /// error of every time of [`Heard`], and of every silence between two of them.
    #[must_use]
    pub const fn late(&self) -> Duration {
        self.late
    }

    /// The next frame, or the next bytes that make none, with times since 1970 that no change of the clock disturbs. `None`:
    /// the stream has ended.
    ///
    /// # Errors
    /// The port's.
    ///
    /// # Cancellation
    /// Nothing is lost.
    pub async fn next(&mut self) -> io::Result<Option<Heard>> {
        let mut buffer = [0; 512];
        loop {
            if let Some(heard) = self.ear.next() {
                return Ok(Some(heard));
            }
            if self.has_ended {
                return Ok(None);
            }
            let (since, began) = self.began;
            let deadline = self.ear.deadline().map(|at| began + at.saturating_sub(since));
            tokio::select! {
                // What is there to read counts before the time is over.
                biased;
                read = self.stream.read(&mut buffer) => match buffer.get(..read?) {
                    None | Some([]) => {
                        self.has_ended = true;
                        self.ear.handle_timeout();
                    }
                    Some(bytes) => self.ear.hear(since + began.elapsed(), bytes),
                },
                () = passed(deadline) => self.ear.handle_timeout(),
            }
        }
    }
}

fn lateness(config: &LineConfig) -> Duration {
    let way = match &config.endpoint {
        #[cfg(feature = "serial")]
        Endpoint::Serial(path) => {
            crate::transport::adapter_latency(path).unwrap_or(USB) + config.characters(COLLECTED)
        }
        #[cfg(feature = "tcp")]
        Endpoint::Tcp(_) => NETWORK,
        Endpoint::Stream => Duration::ZERO,
    };
    way + HOST
}

async fn passed(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => sleep_until(deadline).await,
        None => future::pending().await,
    }
}

impl std::fmt::Debug for Listener {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Listener").field("ear", &self.ear).finish_non_exhaustive()
    }
}
