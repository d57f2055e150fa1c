//! The connection to a broker, on which nobody waits for anybody's acknowledgement.
//!
//! Most brokers gather what is small for as long as something before it is not acknowledged (Nagle's algorithm: mosquitto's
//! `set_tcp_nodelay` is off), and a system acknowledges what it has nothing to answer to when it likes, after 40 ms on Linux. A stop that
//! comes through the broker a moment after anything else would wait for as long. So what has been read is acknowledged at once.

use std::{
    io::{self, IoSlice},
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use futures_util::{StreamExt as _, stream::FuturesUnordered};
use rumqttc::{NetworkOptions, default_socket_connect};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::{TcpStream, lookup_host},
    time::sleep,
};

/// A name may have an address that nobody answers at: the next is tried after so long (RFC 8305, section 5).
const ONE_AFTER_ANOTHER: Duration = Duration::from_millis(250);

/// A stream to a broker.
#[derive(Debug)]
pub(super) struct Prompt(TcpStream);

/// Connects to a broker. What is said to it is not gathered either.
pub(super) async fn connect(address: String, mut options: NetworkOptions) -> io::Result<Prompt> {
    options.set_tcp_nodelay(true);
    let mut tries = FuturesUnordered::new();
    for (one, later) in lookup_host(address).await?.zip(0_u32..) {
        let options = options.clone();
        tries.push(async move {
            sleep(ONE_AFTER_ANOTHER * later).await;
            default_socket_connect(one.to_string(), options).await
        });
    }
    let mut failed = io::Error::new(io::ErrorKind::NotFound, "its name has no address");
    while let Some(tried) = tries.next().await {
        match tried {
            Ok(stream) => return Ok(Prompt(stream)),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

impl Prompt {
    /// Acknowledges what has been read. It holds until the system thinks otherwise, so it is said each time; where it cannot be said,
    /// all is as it was.
    fn acknowledge(&self) {
        #[cfg(target_os = "linux")]
        let _ = socket2::SockRef::from(&self.0).set_tcp_quickack(true);
    }
}

impl AsyncRead for Prompt {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        ready!(Pin::new(&mut self.0).poll_read(context, buffer))?;
        self.acknowledge();
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Prompt {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write_vectored(context, bytes)
    }

    fn is_write_vectored(&self) -> bool {
        self.0.is_write_vectored()
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        net::TcpListener,
    };

    use super::*;

    /// tcp(7): `TCP_QUICKACK` is whether acknowledgements are sent at once.
    #[tokio::test]
    async fn what_a_broker_says_is_acknowledged_at_once_and_what_is_said_to_it_not_gathered() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let mut near = connect(address, NetworkOptions::new()).await.unwrap();
        let (mut broker, _) = listener.accept().await.unwrap();
        assert!(near.0.nodelay().unwrap());
        let at_once = |near: &Prompt| socket2::SockRef::from(&near.0).tcp_quickack().unwrap();
        for _ in 0..20 {
            broker.write_all(b"puback").await.unwrap();
            near.read_exact(&mut [0; 6]).await.unwrap();
            assert!(at_once(&near));
            // Whoever answers is taken for one who always does, and whose answers acknowledge.
            near.write_all(b"publish").await.unwrap();
            broker.read_exact(&mut [0; 7]).await.unwrap();
        }
        assert!(!at_once(&near), "the system has thought otherwise each time");
    }
}
