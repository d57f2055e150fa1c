//! A TCP connection.

use std::time::Duration;

use socket2::{SockRef, TcpKeepalive};
use tokio::net::TcpStream;

use super::{BoxedStream, OpenError};

/// How long a connection may take to come about: a serial server that is there answers in milliseconds, and one that is
/// not would otherwise be waited for as long as the system repeats its SYN, two minutes on Linux.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// After how long without a word the far end is asked whether it is there, and how often.
const KEEPALIVE: (Duration, Duration) = (Duration::from_secs(5), Duration::from_secs(1));

/// How long what was sent may go unacknowledged until the connection counts as lost; the system itself waits a quarter of an
/// hour.
#[cfg(target_os = "linux")]
const UNACKNOWLEDGED: Duration = Duration::from_secs(5);

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
    watch(&stream);
    Ok(Box::new(stream))
}

/// A far end that is gone without a word is noticed, also while nothing is asked. What a system cannot do it leaves.
fn watch(stream: &TcpStream) {
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(KEEPALIVE.0);
    #[cfg(any(target_os = "linux", target_os = "macos", target_os = "windows", target_os = "freebsd"))]
    let keepalive = keepalive.with_interval(KEEPALIVE.1);
    let _ = socket.set_tcp_keepalive(&keepalive);
    #[cfg(target_os = "linux")]
    let _ = socket.set_tcp_user_timeout(Some(UNACKNOWLEDGED));
}

/// The connection ends with a reset: what its far end has kept for it goes with it.
pub(super) fn reset_when_dropped(stream: &TcpStream) {
    let _ = SockRef::from(stream).set_linger(Some(Duration::ZERO));
}
