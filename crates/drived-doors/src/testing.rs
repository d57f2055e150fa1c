//! The doors before a router that only says who came, for tests.

use std::{convert::Infallible, fs};

use axum::{
    Extension, Router,
    body::{Body, Bytes},
    http::{HeaderMap, Request, StatusCode, header},
    response::{IntoResponse as _, Response},
    routing::{get, post},
};
use drived_config::testing::Folder;
use http_body_util::{BodyExt as _, Full, StreamBody};
use hyper::body::Frame;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex},
    sync::watch,
};

use crate::{config::DoorsConfig, gate::Peer, *};

/// The addresses that stop, as the API has them, which its crate compares.
pub const STOPS: [&str; 4] =
    ["/api/v1/stop", "/api/v1/selected/stop", "/api/v1/drives/{name}/stop", "/api/v1/groups/{name}/stop"];

/// What stands behind the doors here: it says who came, and streams without end.
fn router() -> Router {
    async fn who(Extension(caller): Extension<Caller>) -> String {
        let Rights { view, stop, operate, engineer } = caller.rights;
        let rights = [(view, 'v'), (stop, 's'), (operate, 'o'), (engineer, 'e')];
        let rights: String = rights.into_iter().filter(|(has, _)| *has).map(|(_, letter)| letter).collect();
        format!("{} {} {rights}", caller.name, caller.origin)
    }
    async fn events() -> Response {
        let ticks = futures_util::stream::unfold((), |()| async {
            sleep(Duration::from_secs(5)).await;
            Some((Ok::<_, Infallible>(Frame::data(Bytes::from_static(b"event: tick\n\n"))), ()))
        });
        ([(header::CONTENT_TYPE, "text/event-stream")], Body::new(StreamBody::new(Box::pin(ticks))))
            .into_response()
    }
    async fn started() -> Response {
        (StatusCode::CONFLICT, r#"{"id":"c-1","outcome":"refused"}"#).into_response()
    }
    async fn came(Extension(Arrived(at)): Extension<Arrived>) -> String {
        format!("{} ms ago", at.elapsed().as_millis())
    }
    async fn waits(Extension(caller): Extension<Caller>) -> &'static str {
        caller.heard.ends().await;
        "not heard any more"
    }
    Router::new()
        .route("/api/v1/drives/{name}/reset", post(waits))
        .route("/api/v1/state", get(who).post(who))
        .route("/api/v1/stop", post(who))
        .route("/api/v1/drives/{name}/start", post(started))
        .route("/api/v1/drives/{name}/setpoint", post(came))
        .route("/api/v1/events", get(events))
}

/// A gate, its door, and the tokens and the log behind it.
#[allow(dead_code, reason = "the tests of this crate use all of it, those of others a part")]
pub struct Rig {
    pub(crate) gate: Arc<Gate>,
    pub(crate) door: Door,
    pub(crate) crowd: Crowd,
    pub(crate) end: watch::Sender<bool>,
    pub(crate) folder: Folder,
}

#[allow(dead_code, reason = "the tests of this crate use all of it, those of others a part")]
impl Rig {
    pub fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        let config = HttpConfig { demo: false, ..DoorsConfig::of_demo(None).http.unwrap() };
        let door = Door {
            hosts: Hosts::new(Some(config.listen), &[]),
            freely: config.freely(false),
            through_a_proxy: config.freely(true),
            proxies: Vec::new(),
            encrypted: false,
        };
        let (end, ended) = watch::channel(false);
        let (sessions, failures, refused, pace, changes) = Default::default();
        let tokens = Some(Arc::new(Tokens::open(&folder.file("tokens")).unwrap()));
        let audit = Audit::open(&folder.file("audit")).unwrap();
        let gate = Arc::new(Gate {
            router: router(),
            stops: STOPS.to_vec(),
            tokens,
            audit,
            sessions,
            codes: crate::codes::Codes::default(),
            page: Arc::new(OnceLock::from("http://127.0.0.1:7580/".to_owned())),
            failures,
            refused,
            pace,
            changes,
            end: ended,
            threads: threads::Threads::of_this_runtime(),
        });
        Self { gate, door, crowd: Crowd::new(crowd::Limits::HTTP), end, folder }
    }

    pub fn token(&self, name: &str, role: Role) -> String {
        self.gate.tokens.as_ref().unwrap().add(name, (role, None), None).unwrap()
    }

    /// Asks from an address.
    pub(crate) async fn ask_from(&self, address: [u8; 4], request: &Asked<'_>) -> Answer {
        self.ask_as(&self.door, Peer::Address(address.into()), request).await
    }

    /// Asks as root does on the control socket.
    pub async fn ask_on_socket(&self, request: &Asked<'_>) -> Answer {
        let door = Door { freely: Rights::ALL, ..self.door.clone() };
        self.ask_as(&door, Peer::User(Some(0)), request).await
    }

    pub(crate) async fn ask_as(&self, door: &Door, peer: Peer, request: &Asked<'_>) -> Answer {
        let place = self.crowd.enter(peer.address(), Instant::now()).unwrap();
        let mut builder = Request::builder().method(request.method).uri(request.path);
        let usual = [("host", "localhost:7580"), ("content-type", "application/json")];
        let kept = usual.iter().filter(|(name, _)| !request.headers.iter().any(|(other, _)| other == name));
        for (name, value) in kept.chain(request.headers) {
            builder = builder.header(*name, *value);
        }
        let request = builder.body(Full::new(Bytes::copy_from_slice(request.body.as_bytes()))).unwrap();
        let answer = self.gate.answer(door, peer, request, place.ask()).await;
        let (parts, body) = answer.into_parts();
        let body = body.collect().await.unwrap().to_bytes();
        Answer {
            status: parts.status,
            headers: parts.headers,
            body: String::from_utf8(body.to_vec()).unwrap(),
        }
    }

    pub async fn ask(&self, request: &Asked<'_>) -> Answer {
        self.ask_from([127, 0, 0, 1], request).await
    }

    /// A connection to the door.
    pub(crate) fn connect(&self) -> DuplexStream {
        self.connect_from([127, 0, 0, 1]).unwrap()
    }

    /// A connection from an address, if there is room for it.
    pub(crate) fn connect_from(&self, address: [u8; 4]) -> Option<DuplexStream> {
        let (near, far) = duplex(4_096);
        let address = std::net::IpAddr::from(address);
        let place = self.crowd.enter(Some(address), Instant::now())?;
        let (gate, door) = (Arc::clone(&self.gate), self.door.clone());
        let end = self.end.subscribe();
        tokio::spawn(async move {
            let answer = |request, asking| {
                let (gate, door) = (Arc::clone(&gate), door.clone());
                async move { gate.answer(&door, Peer::Address(address), request, asking).await }
            };
            connection::serve(near, place, end, answer).await;
        });
        Some(far)
    }

    /// An event stream with these headers, of which something has been heard.
    pub(crate) async fn stream(&self, headers: &str) -> DuplexStream {
        let mut stream = self.connect();
        let request = format!("GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut heard = Vec::new();
        while !heard.windows(4).any(|four| four == b"tick") {
            assert_ne!(stream.read_buf(&mut heard).await.unwrap(), 0, "{}", String::from_utf8_lossy(&heard));
        }
        stream
    }

    /// What the audit log has of it, kind and outcome, once all is written.
    pub(crate) async fn audited(&self) -> Vec<String> {
        let last = Record::of_program(Kind::Daemon, "last");
        self.gate.audit.record(last.clone()).done().await.unwrap();
        // That of what was refused has a writer of its own.
        self.gate.audit.record_refused(last);
        while !fs::read_to_string(self.folder.file("audit.refused")).unwrap().contains("\"what\":\"last\"") {
            tokio::task::yield_now().await;
        }
        let text = ["audit", "audit.refused"]
            .map(|name| fs::read_to_string(self.folder.file(name)).unwrap())
            .concat();
        let told = |line: &str| {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            let text = |key: &str| line[key].as_str().unwrap_or("-").to_owned();
            [text("kind"), text("caller"), text("outcome")].join(" ")
        };
        text.lines().map(told).filter(|line| !line.starts_with("daemon")).collect()
    }
}

#[derive(Clone, Copy)]
pub struct Asked<'a> {
    pub method: &'a str,
    pub path: &'a str,
    pub headers: &'a [(&'a str, &'a str)],
    pub body: &'a str,
}

pub const STATE: Asked<'_> = Asked { method: "GET", path: "/api/v1/state", headers: &[], body: "" };
pub const STOP: Asked<'_> = Asked { method: "POST", path: "/api/v1/stop", headers: &[], body: "" };
pub const START: Asked<'_> =
    Asked { method: "POST", path: "/api/v1/drives/pump%201/start", headers: &[], body: "{}" };

#[derive(Debug)]
pub struct Answer {
    pub status: StatusCode,
    pub headers: HeaderMap,
    pub body: String,
}

impl Answer {
    #[track_caller]
    pub fn assert_refused(&self, status: u16) {
        assert_eq!(self.status.as_u16(), status, "{self:?}");
        let problem: serde_json::Value = serde_json::from_str(&self.body).unwrap();
        assert_eq!(problem["status"], status);
        assert_eq!(self.headers[header::CONTENT_TYPE], "application/problem+json");
    }
}
