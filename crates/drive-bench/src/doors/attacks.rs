//! Who does what at which door, for as long as it is wanted.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here: each attacker is a thread")]

use std::{
    io::{Read as _, Write as _},
    net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream},
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use socket2::{Domain, Socket, Type};

use super::{PATIENCE, loads::Got};

/// Attackers come from another address than whoever stops: limits are by address.
const ATTACKER: IpAddr = IpAddr::V4(Ipv4Addr::new(127, 0, 0, 2));

/// Whom it meets.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub(super) http: SocketAddr,
    pub(super) gateway: SocketAddr,
    pub(super) socket: PathBuf,
    /// By which somebody may operate.
    pub(super) token: String,
    /// The audit log of the daemon.
    pub(super) audit: PathBuf,
}

/// What somebody does until it is over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attack {
    /// As the command line names it.
    pub(super) key: &'static str,
    pub(super) name: &'static str,
    /// What it got, where it counts that.
    pub(super) act: fn(&Target, &AtomicBool) -> Vec<Got>,
}

pub(super) const fn attack(
    key: &'static str,
    name: &'static str,
    act: fn(&Target, &AtomicBool) -> Vec<Got>,
) -> Attack {
    Attack { key, name, act }
}

pub(super) const ATTACKS: [Attack; 8] = [
    attack("calm", "nobody does anything", |_, over| wait(over)),
    attack("silent", "512 connections that say nothing", |to, over| hold(to.http, 512, b"", over)),
    attack("half-heads", "512 half-sent heads", |to, over| {
        hold(to.http, 512, b"POST /api/v1/stop HTTP/1.1\r\nHost: loc", over)
    }),
    attack("slow-logins", "64 slow bodies of logins", |to, over| {
        hold(to.http, 64, b"POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 60000\r\n\r\n{", over)
    }),
    attack("wrong-tokens", "8 who try tokens on stops", |to, over| {
        flood(
            to.http,
            8,
            "POST /api/v1/stop?wait=0 HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer drv_wrong\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}",
            over,
        )
    }),
    attack("large-bodies", "8 who send 64 KiB that they may not", |to, over| {
        let body = " ".repeat(65_000);
        let start = format!(
            "POST /api/v1/drives/pump%201/start HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        flood(to.http, 8, &start, over)
    }),
    attack("unread-streams", "256 event streams that nobody reads", |to, over| {
        hold(to.http, 256, b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n", over)
    }),
    attack("silent-gateway", "256 silent clients of the gateway", |to, over| {
        hold(to.gateway, 256, b"", over)
    }),
];

/// Opens connections, says the same on each and keeps them; those that are closed are opened again.
fn hold(to: SocketAddr, count: usize, head: &[u8], over: &AtomicBool) -> Vec<Got> {
    let mut held: Vec<Option<TcpStream>> = (0..count).map(|_| None).collect();
    while !over.load(Ordering::Relaxed) {
        for place in &mut held {
            let is_open = place.as_ref().is_some_and(|stream| {
                !matches!(stream.peek(&mut [0]), Ok(0))
                    && stream.take_error().is_ok_and(|error| error.is_none())
            });
            if !is_open {
                *place = connect(to).ok().and_then(|mut stream| {
                    stream.write_all(head).ok()?;
                    stream.set_nonblocking(true).ok().map(|()| stream)
                });
            }
        }
        thread::sleep(Duration::from_millis(10));
    }
    Vec::new()
}

/// Asks the same again and again on some connections at once, as fast as it is answered.
fn flood(to: SocketAddr, count: usize, request: &str, over: &AtomicBool) -> Vec<Got> {
    thread::scope(|scope| {
        for _ in 0..count {
            scope.spawn(|| {
                let mut stream = None;
                let mut answer = [0; 4_096];
                while !over.load(Ordering::Relaxed) {
                    let Ok(mut open) = stream.take().map_or_else(|| connect(to), Ok) else {
                        thread::yield_now();
                        continue;
                    };
                    let answered = open.write_all(request.as_bytes()).and_then(|()| open.read(&mut answer));
                    stream = answered.is_ok_and(|read| read > 0).then_some(open);
                }
            });
        }
    });
    Vec::new()
}

/// A connection from the address of attackers on which nothing lasts for ever.
pub(super) fn connect(to: SocketAddr) -> std::io::Result<TcpStream> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None)?;
    socket.bind(&SocketAddr::new(ATTACKER, 0).into())?;
    socket.connect_timeout(&to.into(), PATIENCE)?;
    socket.set_read_timeout(Some(PATIENCE))?;
    // Where nobody reads, what is sent would wait for ever, and whoever waits for the attackers' end with it.
    socket.set_write_timeout(Some(PATIENCE))?;
    Ok(socket.into())
}

pub(super) fn wait(over: &AtomicBool) -> Vec<Got> {
    while !over.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_millis(10));
    }
    Vec::new()
}
