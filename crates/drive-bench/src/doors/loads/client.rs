//! One of many clients: a connection from an address of his own, which he keeps for as long as he is answered on it.

use std::{io, net::SocketAddr, time::Duration};

use tokio::{
    net::{TcpSocket, TcpStream},
    time::{sleep, timeout},
};

use super::Tally;
use crate::doors::PATIENCE;

/// Whoever could not connect, or was closed, comes again a little later.
pub(super) const AGAIN: Duration = Duration::from_millis(100);

/// A client by his number.
pub(super) struct Client {
    number: u16,
    to: SocketAddr,
    open: Option<TcpStream>,
}

impl Client {
    pub(super) const fn new(number: u16, to: SocketAddr) -> Self {
        Self { number, to, open: None }
    }

    /// Asks on the connection that he has, or on a new one. What does not come of it is counted, named by `what` he does.
    pub(super) async fn ask<T>(
        &mut self,
        what: &str,
        tally: &mut Tally,
        asked: impl AsyncFnOnce(&mut TcpStream) -> io::Result<T>,
    ) -> Option<T> {
        let mut open = match self.open.take() {
            Some(open) => open,
            None => match connect(self.number, self.to).await {
                Ok(open) => open,
                Err(_) => {
                    tally.count(format!("{what} that could not connect"));
                    sleep(AGAIN).await;
                    return None;
                }
            },
        };
        match timeout(PATIENCE, asked(&mut open)).await {
            Err(_) => {
                tally.count(format!("{what} without an answer within 5 s"));
                None
            }
            Ok(Err(_)) => {
                tally.count(format!("{what} whose connection was closed"));
                None
            }
            Ok(Ok(told)) => {
                self.open = Some(open);
                Some(told)
            }
        }
    }

    /// He comes anew the next time.
    pub(super) fn leave(&mut self) {
        self.open = None;
    }
}

/// A connection from an address of one's own on this machine: each of them is somebody else to the daemon.
pub(super) async fn connect(number: u16, to: SocketAddr) -> io::Result<TcpStream> {
    let [high, low] = number.to_be_bytes();
    let socket = TcpSocket::new_v4()?;
    socket.bind(SocketAddr::from(([127, 1, high, low.max(1)], 0)))?;
    let stream = timeout(PATIENCE, socket.connect(to)).await??;
    stream.set_nodelay(true)?;
    Ok(stream)
}
