//! A server that does nothing: what this machine and its attackers leave to whoever is attacked. It lets everybody in, reads one
//! request and answers that it was taken.

use std::{
    io::Result,
    net::{Ipv4Addr, SocketAddr},
    time::Duration,
};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpStream},
    runtime::Runtime,
    time::sleep,
};

const ANSWER: &[u8] = b"HTTP/1.1 202 Accepted\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}";

const LATER: Duration = Duration::from_millis(10);

/// It serves until it is dropped.
pub(super) struct Trivial {
    _serves: Runtime,
    pub(super) address: SocketAddr,
}

impl Trivial {
    pub(super) fn start() -> Result<Self> {
        let runtime = Runtime::new()?;
        let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))?;
        let address = listener.local_addr()?;
        runtime.spawn(async move {
            loop {
                // What cannot be let in now, such as without a descriptor, is let in later.
                match listener.accept().await {
                    Ok((stream, _)) => drop(tokio::spawn(serve(stream))),
                    Err(_) => sleep(LATER).await,
                }
            }
        });
        Ok(Self { _serves: runtime, address })
    }
}

/// Answers once the head has come; the rest is nobody's.
async fn serve(mut stream: TcpStream) -> Result<()> {
    let (mut head, mut buffer) = (Vec::new(), [0; 4_096]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        match stream.read(&mut buffer).await? {
            0 => return Ok(()),
            read => head.extend_from_slice(buffer.get(..read).unwrap_or_default()),
        }
    }
    stream.write_all(ANSWER).await
}
