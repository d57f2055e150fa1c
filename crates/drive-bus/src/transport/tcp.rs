//! A TCP connection.

use std::time::Duration;

use tokio::net::TcpStream;

use super::{BoxedStream, OpenError};

/// How long a connection may take to come about: a serial server that is there answers in milliseconds, and one that is
/// not would otherwise be waited for as long as the system repeats its SYN, two minutes on Linux.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// Connects to `host:port`.
pub(super) async fn connect(address: String) -> Result<BoxedStream, OpenError> {
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
