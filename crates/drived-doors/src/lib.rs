//! The doors by which everybody comes in: the control socket and the HTTP server. Both lead through the same checks
//! ([`gate`]) to the same router; whoever has come through them stands as a [`Caller`] in the request's extensions.
//!
//! Neither holds up a line: what is slow, idle or hostile is bounded, and what does not fit is turned away.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod audit;
mod authority;
mod codes;
pub mod config;
mod connection;
pub mod crowd;
mod failures;
mod gate;
mod host;
mod kept;
mod network;
pub mod outward;
mod pace;
mod patient;
mod refusal;
mod secret;
mod sessions;
#[cfg(unix)]
mod socket;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod threads;
#[cfg_attr(not(feature = "tls"), path = "no_tls.rs")]
mod tls;
mod token_desk;
pub mod tokens;

use std::{
    io,
    net::{IpAddr, SocketAddr},
    sync::{Arc, OnceLock},
    time::Duration,
};

use axum::Router;
use drive_fleet::Events;
use tokio::{
    net::{TcpListener, TcpSocket, TcpStream},
    sync::{mpsc, watch},
    task::JoinHandle,
    time::{Instant, sleep, timeout},
};

pub use self::gate::Arrived;
#[cfg(unix)]
pub use self::gate::{LINKS, LOGIN, LOGOUT, LoginBody, MadeLink, NewLink, SessionView};
#[cfg(unix)]
use self::socket::Unbound;
pub use self::socket::usual_places;
#[cfg(feature = "tls")]
pub use self::tls::{believed, identity};
use self::{
    audit::{Audit, Kind, Record},
    codes::{Codes, Grant},
    config::{DoorsConfig, HttpConfig, SocketConfig},
    connection::DRAINED_WITHIN,
    crowd::{Crowd, Limits, Place},
    gate::{Door, Gate, Peer},
    host::Hosts,
    sessions::Sessions,
    threads::Own,
    tokens::{Right, Tokens},
};
pub use self::{
    network::Network,
    refusal::lacking,
    secret::{private, secret},
    tls::{Pair, Tls, certificate_doubt},
    token_desk::{
        MadeToken, NewToken, RemovedToken, Rotation, TOKENS, TokensView, added, of_hours, replaced,
    },
    tokens::of_days,
};
use drived_config::names::Names;
pub use drived_config::rights::{Caller, Rights, Role, Scope};
use drived_words::failure::Failure;

/// A system without such sockets.
#[cfg(not(unix))]
pub fn usual_places() -> Vec<std::path::PathBuf> {
    Vec::new()
}

/// From one try to open a door or to accept a connection to the next, when the system has no room for it.
pub const TRIED_AGAIN: Duration = Duration::from_secs(1);

/// Connections that wait to be let in. One that finds no room there comes again after a second, with whatever stop it brings: so there is
/// as much as a system gives.
const QUEUE: u32 = 4_096;

/// The open doors.
pub struct Doors {
    ended: watch::Sender<bool>,
    /// Closed when the last connection has gone.
    gone: mpsc::Receiver<()>,
    /// Whether every door listens.
    listening: watch::Receiver<bool>,
    audit: Audit,
    codes: Codes,
    page: Arc<OnceLock<String>>,
    has_tokens: bool,
    _threads: Own,
}

/// Doors that only have to be opened: what they need has been found.
pub struct Prepared {
    tokens: Option<Arc<Tokens>>,
    audit: Audit,
    sessions: Sessions,
    #[cfg(unix)]
    socket: Option<Entrance>,
    http: Option<HttpDoor>,
}

/// The door of HTTP.
struct HttpDoor {
    config: HttpConfig,
    tls: Option<Tls>,
    /// `None`: its address cannot be had yet.
    listener: Option<TcpListener>,
}

/// What every door and connection has.
#[derive(Clone)]
struct Shared {
    gate: Arc<Gate>,
    end: watch::Receiver<bool>,
    /// Held as long as there is somebody to wait for at the end.
    _here: mpsc::Sender<()>,
}

impl Doors {
    /// Finds what the doors of a configuration need, and takes their addresses where they are free: whoever connects from now on waits.
    /// Nobody is let in before they are [opened](Prepared::open).
    ///
    /// # Errors
    ///
    /// A certificate, the tokens or the audit log cannot be read or written, or the control socket is somebody else's.
    pub fn prepare(config: DoorsConfig) -> Result<Prepared, Failure> {
        let tokens = match config.state.tokens.as_deref().map(Tokens::open).transpose() {
            Err(error) if !config.state.has_tokens => {
                tracing::warn!("{error}: nobody comes by a token: name a folder by state = \"FOLDER\"");
                None
            }
            tokens => tokens.map_err(|error| Failure::Input(error.to_string()))?.map(Arc::new),
        };
        let http = config.http.map(|config| {
            let tls = config.tls.as_ref().map(Tls::open).transpose().map_err(Failure::Input)?;
            let listener = bound(config.listen).ok();
            Ok(HttpDoor { config, tls, listener })
        });
        let http = http.transpose()?;
        let sessions = Sessions::in_folder(config.state.folder.as_deref(), Instant::now());
        let audit = config.state.audit.as_deref().map(Audit::open).transpose().map_err(Failure::Input)?;
        #[cfg(unix)]
        let socket = config.socket.as_ref().map(Entrance::of_socket).transpose()?.flatten();
        Ok(Prepared {
            tokens,
            audit: audit.unwrap_or_default(),
            sessions,
            #[cfg(unix)]
            socket,
            http,
        })
    }
}

impl Prepared {
    /// The audit log, which whoever else takes commands writes too.
    pub fn audit(&self) -> Audit {
        self.audit.clone()
    }

    /// The certificate by which the page is served, which another may take the place of; `None`: it is served in clear, or not at all.
    pub fn certificate(&self) -> Option<Tls> {
        self.http.as_ref()?.tls.clone()
    }

    /// Opens the doors before a router, of which these addresses stop: what is asked there has a way of its own. An address of the HTTP server that is taken, or not there yet, is tried again and
    /// again, and told once.
    pub fn open(self, router: Router, stops: Vec<&'static str>) -> Doors {
        let (ended, end) = watch::channel(false);
        let (here, gone) = mpsc::channel(1);
        let (listens, listening) = watch::channel(self.http.is_none());
        let Self { tokens, audit, sessions, .. } = self;
        let (failures, refused, pace, changes) = Default::default();
        let (threads, own) = Own::start();
        let doors = threads.doors.clone();
        let (codes, page, has_tokens) =
            (Codes::default(), Arc::<OnceLock<String>>::default(), tokens.is_some());
        let gate = Gate {
            router,
            stops,
            tokens,
            audit: audit.clone(),
            sessions,
            codes: codes.clone(),
            page: Arc::clone(&page),
            failures,
            refused,
            pace,
            changes,
            end: end.clone(),
            threads,
        };
        // What was listened on before is heard there from now on.
        let _there = doors.enter();
        let shared = Shared { gate: Arc::new(gate), end, _here: here };
        audit.record(Record::of_program(Kind::Daemon, "the daemon serves")).whenever();
        #[cfg(unix)]
        if let Some(entrance) = self.socket {
            match entrance.heard_here() {
                Ok(entrance) => {
                    doors.spawn(until_the_end(shared.clone(), entrance.serve_all(shared.clone())));
                }
                Err(error) => tracing::error!("nobody can be heard on the control socket: {error}"),
            }
        }
        if let Some(door) = self.http {
            let listener = door.listener.and_then(|listener| heard_here(listener).ok());
            let door = HttpDoor { listener, ..door };
            doors.spawn(until_the_end(shared.clone(), serve_http(door, listens, shared)));
        }
        Doors { ended, gone, listening, audit, codes, page, has_tokens, _threads: own }
    }
}

impl Doors {
    /// Becomes true when every door listens.
    pub fn listening(&self) -> watch::Receiver<bool> {
        self.listening.clone()
    }

    /// A link by which a browser has every right for a day, once and within ten minutes: for whoever has started this program and
    /// reads its terminal. `None`: no page is served, or nobody can be known by a token.
    pub fn link_for_whoever_started(
        &self,
        name: &str,
    ) -> impl Future<Output = Option<String>> + Send + use<> {
        let (mut listening, page, codes) =
            (self.listening.clone(), Arc::clone(&self.page), self.codes.clone());
        let grant = Grant { name: name.to_owned(), right: Right::New(Role::Engineer, 1) };
        let has_tokens = self.has_tokens;
        async move {
            if !has_tokens {
                return None;
            }
            listening.wait_for(|listens| *listens).await.ok()?;
            let code = codes.make(grant, Instant::now()).ok()?;
            Some(gate::link(page.get()?, &code))
        }
    }

    /// The audit log, for what does not come through a door.
    pub fn audit(&self) -> Audit {
        self.audit.clone()
    }

    /// Keeps in the audit log what becomes of each command, until the fleet ends.
    pub fn follow(&self, names: Names, events: Events) -> JoinHandle<()> {
        tokio::spawn(audit::follow(self.audit.clone(), names, events))
    }

    /// Lets nobody in any more, ends the event streams, and waits a little for answers that are under way.
    pub async fn close(mut self) {
        self.audit.record(Record::of_program(Kind::Daemon, "the daemon ends")).whenever();
        self.ended.send_replace(true);
        let _ = timeout(DRAINED_WITHIN, self.gone.recv()).await;
    }
}

async fn until_the_end(shared: Shared, serve: impl Future<Output = ()>) {
    let mut end = shared.end;
    tokio::select! {
        () = serve => {}
        _ = end.wait_for(|ended| *ended) => {}
    }
}

async fn serve_http(door: HttpDoor, listens: watch::Sender<bool>, shared: Shared) {
    let HttpDoor { config, tls, listener } = door;
    let listener = match listener {
        Some(listener) => listener,
        None => listen(config.listen).await,
    };
    let scheme = if tls.is_some() { "https" } else { "http" };
    let address = listener.local_addr().unwrap_or(config.listen);
    tracing::info!("the page is at {scheme}://{address}/");
    let _ = shared.gate.page.set(match (config.allowed_hosts.first(), address.ip().is_unspecified()) {
        (Some(host), true) => format!("{scheme}://{host}:{}/", address.port()),
        // It listens everywhere, and nobody goes there by that.
        (None, true) => format!("{scheme}://localhost:{}/", address.port()),
        _ => format!("{scheme}://{address}/"),
    });
    listens.send_replace(true);
    let door = Door {
        hosts: Hosts::new(Some(address), &config.allowed_hosts),
        freely: config.freely(false),
        through_a_proxy: config.freely(true),
        proxies: config.proxies.clone(),
        encrypted: tls.is_some(),
    };
    let listener = Listener::Tcp(listener, tls);
    let entrance =
        Entrance { name: "the HTTP server", listener, door: Arc::new(door), crowd: Crowd::new(Limits::HTTP) };
    entrance.serve_all(shared).await;
}

/// Listens on an address as soon as it can be had.
pub async fn listen(address: SocketAddr) -> TcpListener {
    let mut told = false;
    loop {
        match bound(address) {
            Ok(listener) => return listener,
            Err(error) if !told => {
                told = true;
                tracing::error!("nobody can be served at {address}: {error}: it is tried again and again");
            }
            Err(_) => {}
        }
        sleep(TRIED_AGAIN).await;
    }
}

/// The same, heard by the runtime in which this is called.
fn heard_here(listener: TcpListener) -> io::Result<TcpListener> {
    TcpListener::from_std(listener.into_std()?)
}

fn bound(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // An address that was served a moment ago may be served again; elsewhere than on Unix that means something else.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(QUEUE)
}

/// A door and who stands in it.
struct Entrance {
    name: &'static str,
    listener: Listener,
    door: Arc<Door>,
    crowd: Crowd,
}

enum Listener {
    Tcp(TcpListener, Option<Tls>),
    #[cfg(unix)]
    Unix(socket::Socket),
}

enum Stream {
    Tcp(TcpStream, Option<Tls>),
    #[cfg(unix)]
    Unix(tokio::net::UnixStream),
}

impl Entrance {
    /// Where nobody has said where the socket is to be, and there is no place for it, the daemon goes on without.
    #[cfg(unix)]
    fn of_socket(config: &SocketConfig) -> Result<Option<Self>, Failure> {
        let path = config.path.clone().or_else(|| usual_places().into_iter().next()).unwrap_or_default();
        let socket = match socket::Socket::bind(&path, config.mode) {
            Ok(socket) => socket,
            Err(error @ Unbound::System { .. }) if config.path.is_none() => {
                tracing::error!("{error}: name a place by --socket");
                return Ok(None);
            }
            Err(error) => return Err(Failure::Input(error.to_string())),
        };
        let hosts = Hosts::new(None, &[]);
        let door = Door {
            hosts,
            freely: Rights::ALL,
            through_a_proxy: Rights::ALL,
            proxies: Vec::new(),
            encrypted: false,
        };
        let (listener, crowd) = (Listener::Unix(socket), Crowd::new(Limits::SOCKET));
        Ok(Some(Self { name: "the control socket", listener, door: Arc::new(door), crowd }))
    }

    /// The same, heard by the runtime in which this is called.
    #[cfg(unix)]
    fn heard_here(self) -> io::Result<Self> {
        let listener = match self.listener {
            Listener::Tcp(listener, tls) => Listener::Tcp(heard_here(listener)?, tls),
            Listener::Unix(socket) => Listener::Unix(socket.heard_here()?),
        };
        Ok(Self { listener, ..self })
    }

    /// Accepts connections for ever, and serves each on a task of its own. When the system has no room for one more, such
    /// as no file descriptor, it is tried again a little later.
    async fn serve_all(self, shared: Shared) {
        let (mut failed, mut refused) = (0_u64, 0_u64);
        loop {
            let (stream, peer) = match self.listener.accept().await {
                Ok(accepted) => accepted,
                Err(error) => {
                    failed += 1;
                    if failed.is_power_of_two() {
                        tracing::warn!("{} cannot accept a connection, {failed} in all: {error}", self.name);
                    }
                    if drive_fleet::mutant!("door-ends-without-descriptors", false, true) {
                        return;
                    }
                    sleep(TRIED_AGAIN).await;
                    continue;
                }
            };
            // Behind a proxy there are many.
            let is_proxy = |address: &IpAddr| self.door.proxies.iter().any(|network| network.has(*address));
            let address = peer.address().filter(|address| !is_proxy(address));
            match self.crowd.enter(address, Instant::now()) {
                Some(place) => {
                    tokio::spawn(serve(shared.clone(), Arc::clone(&self.door), stream, peer, place));
                }
                None => {
                    refused += 1;
                    if refused.is_power_of_two() {
                        tracing::warn!("{} is full: {refused} connections were turned away", self.name);
                    }
                }
            }
        }
    }
}

impl Listener {
    async fn accept(&self) -> io::Result<(Stream, Peer)> {
        match self {
            Self::Tcp(listener, tls) => {
                let (stream, address) = listener.accept().await?;
                // An answer is written at once: there is nothing to be gathered.
                let _ = stream.set_nodelay(true);
                Ok((Stream::Tcp(stream, tls.clone()), Peer::Address(address.ip().to_canonical())))
            }
            #[cfg(unix)]
            Self::Unix(socket) => {
                let (stream, _) = socket.listener.accept().await?;
                let user = stream.peer_cred().ok().map(|user| user.uid());
                Ok((Stream::Unix(stream), Peer::User(user)))
            }
        }
    }
}

async fn serve(shared: Shared, door: Arc<Door>, stream: Stream, peer: Peer, place: Place) {
    let Shared { gate, end, _here } = shared;
    let answer = |request, asking| {
        let (gate, door) = (Arc::clone(&gate), Arc::clone(&door));
        async move { gate.answer(&door, peer, request, asking).await }
    };
    match stream {
        Stream::Tcp(stream, None) => connection::serve(stream, place, end, answer).await,
        Stream::Tcp(stream, Some(tls)) => {
            // Who is slow to agree makes room for others.
            let accepted = tokio::select! {
                accepted = tls.accept(stream) => accepted,
                () = place.wanted() => None,
            };
            if let Some(stream) = accepted {
                connection::serve(stream, place, end, answer).await;
            }
        }
        #[cfg(unix)]
        Stream::Unix(stream) => connection::serve(stream, place, end, answer).await,
    }
}

#[cfg(test)]
mod tests;
