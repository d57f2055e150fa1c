//! Ways to the line: what can be opened, and what is read and written.

mod given;
#[cfg(feature = "serial")]
mod low_latency;
#[cfg(feature = "serial")]
mod serial;
#[cfg(feature = "tcp")]
mod tcp;

pub(crate) use given::{Guarded, begin};
#[cfg(feature = "serial")]
pub use low_latency::adapter_latency;

use std::{
    any::Any,
    io,
    path::PathBuf,
    pin::Pin,
    task::{Context, Poll},
};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::{
    config::{Endpoint, LineConfig},
    protocol::ProtocolMismatch,
};

/// What a line reads and writes.
pub(crate) trait Stream: AsyncRead + AsyncWrite + Any + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Any + Send + Unpin> Stream for T {}

pub(crate) type BoxedStream = Box<dyn Stream>;
pub(crate) type Opening<E> = Pin<Box<dyn Future<Output = Result<BoxedStream, E>> + Send>>;
pub(crate) type Given = Box<dyn FnMut() -> Opening<io::Error> + Send>;

/// What is there to read now, without a wait for the runtime to be told of it: its poll may be in the hands of another
/// thread, which sleeps.
pub(crate) fn poll_read_now(
    stream: &mut dyn Stream,
    context: &mut Context<'_>,
    buffer: &mut [u8],
) -> Poll<io::Result<usize>> {
    #[cfg(feature = "serial")]
    if let Some(port) = of_kind::<tokio_serial::SerialStream>(stream) {
        return match port.try_read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Poll::Pending,
            read => Poll::Ready(read),
        };
    }
    let mut buffer = ReadBuf::new(buffer);
    Pin::new(stream).poll_read(context, &mut buffer).map_ok(|()| buffer.filled().len())
}

/// A connection is to end with a reset, not with what may still be on its way.
pub(crate) fn reset_when_dropped(stream: &mut BoxedStream) {
    #[cfg(feature = "tcp")]
    if let Some(stream) = of_kind::<tokio::net::TcpStream>(stream.as_mut()) {
        tcp::reset_when_dropped(stream);
    }
    #[cfg(not(feature = "tcp"))]
    let _ = stream;
}

/// The stream of this kind that it is, whoever has made it.
#[cfg(any(feature = "serial", feature = "tcp"))]
fn of_kind<T: 'static>(stream: &mut dyn Stream) -> Option<&mut T> {
    let any: &mut dyn Any = stream;
    if any.is::<T>() {
        return any.downcast_mut();
    }
    any.downcast_mut().map(|Guarded(stream)| stream)
}

/// Why a line could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// There is no such port.
    #[error("there is no serial port {}", path.display())]
    NotFound {
        /// The path asked for.
        path: PathBuf,
    },
    /// Another program has the port.
    #[error("serial port {} is in use by another program", path.display())]
    InUse {
        /// The path asked for.
        path: PathBuf,
    },
    /// The user may not open it.
    #[error("no permission to open serial port {} (its group is usually dialout)", path.display())]
    Denied {
        /// The path asked for.
        path: PathBuf,
    },
    /// The port is there and cannot be used.
    #[error("serial port {} cannot be opened: {reason}", path.display())]
    Serial {
        /// The path asked for.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The port cannot be switched to RS-485 as configured.
    #[error("serial port {} has no RS-485 mode of the kernel: {reason} (an adapter that switches by itself needs none)", path.display())]
    Rs485 {
        /// The path asked for.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The far end of a connection cannot be reached.
    #[error("cannot connect to {address}: {reason}")]
    Connect {
        /// Host and port asked for.
        address: String,
        /// What the system says.
        reason: String,
    },
    /// The protocol cannot be spoken with the configured characters.
    #[error(transparent)]
    Protocol(#[from] ProtocolMismatch),
    /// A line over a given stream has nothing that could be opened.
    #[error("the configuration names no port")]
    NoPort,
}

/// Opens the stream of a line, again and again.
pub(crate) enum Connector {
    #[cfg(feature = "serial")]
    Serial(serial::SerialPort),
    #[cfg(feature = "tcp")]
    Tcp(String),
    Given(Given),
    None,
}

impl Connector {
    pub(crate) fn to(config: &LineConfig) -> Result<Self, OpenError> {
        config.protocol.check(config.serial)?;
        match &config.endpoint {
            #[cfg(all(feature = "serial", feature = "tcp"))]
            Endpoint::Serial(_) if !config.protocol.is_paced() => Err(ProtocolMismatch::Tcp.into()),
            #[cfg(feature = "serial")]
            Endpoint::Serial(_) => Ok(Self::Serial(serial::SerialPort::new(config.clone()))),
            #[cfg(feature = "tcp")]
            Endpoint::Tcp(address) => Ok(Self::Tcp(address.clone())),
            Endpoint::Stream => Err(OpenError::NoPort),
        }
    }

    /// Whether there is something to open, also once more.
    pub(crate) const fn reopens(&self) -> bool {
        !matches!(self, Self::None)
    }

    /// Begins to open the stream; `None` when there is nothing to open.
    pub(crate) fn connect(&mut self) -> Option<Opening<OpenError>> {
        Some(match self {
            #[cfg(feature = "serial")]
            Self::Serial(port) => {
                let port = port.clone();
                Box::pin(async move { port.open() })
            }
            #[cfg(feature = "tcp")]
            Self::Tcp(address) => Box::pin(tcp::connect(address.clone())),
            Self::Given(open) => {
                let opening = open();
                Box::pin(async move {
                    opening.await.map_err(|error| OpenError::Connect {
                        address: "the stream".to_owned(),
                        reason: error.to_string(),
                    })
                })
            }
            Self::None => return None,
        })
    }
}
