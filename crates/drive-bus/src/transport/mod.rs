//! Ways to the line: what can be opened, and what is read and written.

mod low_latency;
mod serial;

pub use low_latency::adapter_latency;

use std::{
    any::Any,
    io,
    path::PathBuf,
    pin::Pin,
    sync::{Arc, atomic::AtomicBool},
    task::{Context, Poll},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::TcpStream,
};
use tokio_serial::SerialStream;

use crate::{
    config::{Endpoint, LineConfig},
    protocol::ProtocolMismatch,
};

/// How long a connection may take to come about.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

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
    if let Some(port) = (stream as &mut dyn Any).downcast_mut::<SerialStream>() {
        return match port.try_read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Poll::Pending,
            read => Poll::Ready(read),
        };
    }
    let mut buffer = ReadBuf::new(buffer);
    Pin::new(stream).poll_read(context, &mut buffer).map_ok(|()| buffer.filled().len())
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
    Serial {
        config: Box<LineConfig>,
        /// Whether it was said that the adapter holds answers back.
        warned: Arc<AtomicBool>,
    },
    Tcp(String),
    Given(Given),
    None,
}

impl Connector {
    pub(crate) fn to(config: &LineConfig) -> Result<Self, OpenError> {
        if !config.is_mbap() {
            config.protocol.check(config.serial)?;
        }
        match &config.endpoint {
            Endpoint::Serial(_) => {
                Ok(Self::Serial { config: Box::new(config.clone()), warned: Arc::default() })
            }
            Endpoint::RtuOverTcp(address) | Endpoint::ModbusTcp(address) => Ok(Self::Tcp(address.clone())),
            Endpoint::Stream => Err(OpenError::NoPort),
        }
    }

    /// Begins to open the stream; `None` when there is nothing to open.
    pub(crate) fn connect(&mut self) -> Option<Opening<OpenError>> {
        Some(match self {
            Self::Serial { config, warned } => {
                let (config, warned) = (config.clone(), Arc::clone(warned));
                Box::pin(async move { serial::open(&config, &warned) })
            }
            Self::Tcp(address) => Box::pin(connect(address.clone())),
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

async fn connect(address: String) -> Result<BoxedStream, OpenError> {
    let connected = tokio::time::timeout(CONNECT_LIMIT, TcpStream::connect(&address)).await;
    let stream = match connected {
        Ok(Ok(stream)) => stream,
        Ok(Err(error)) => return Err(OpenError::Connect { address, reason: error.to_string() }),
        Err(_) => {
            return Err(OpenError::Connect {
                address,
                reason: format!("no answer within {CONNECT_LIMIT:?}"),
            });
        }
    };
    // A frame is one small write: it must not wait for the next.
    let _ = stream.set_nodelay(true);
    Ok(Box::new(stream))
}
