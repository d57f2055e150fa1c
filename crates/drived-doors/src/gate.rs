//! What every request passes, by whichever door it came: whom it was meant for, who asks, how much he says, and the audit
//! log; then the router.

mod body;
mod caller;
mod door;
mod login;

use std::{
    net::IpAddr,
    sync::{Arc, Mutex, OnceLock},
    time::Duration,
};

use axum::{
    Router,
    body::{Body, Bytes},
    http::{
        HeaderMap, HeaderValue, Method, Request, StatusCode,
        header::{self, HeaderName},
    },
    response::Response,
};
use http_body_util::BodyExt as _;
use hyper::body::Body as _;
use serde::Deserialize;
use tokio::{
    runtime::Handle,
    sync::watch,
    task::JoinSet,
    time::{Instant, sleep, timeout},
};
use tower::ServiceExt as _;

pub use self::login::{LoginBody, MadeLink, NewLink, SessionView};
use self::{
    body::{BODY, BODY_OF_NOBODY_WITHIN, BODY_WITHIN, LOGIN_BODY, STOP_WITHIN, read, what_comes},
    caller::lock,
    door::freely,
};
pub(super) use self::{
    door::{Door, Peer},
    login::link,
};
use super::{
    audit::{Audit, Kind, Record, bounded},
    authority::Authority,
    codes::Codes,
    crowd::Asking,
    failures::Failures,
    host,
    kept::Kept,
    pace::Pace,
    refusal::Refusal,
    sessions::Sessions,
    threads::Threads,
    token_desk,
    tokens::Tokens,
};
use drived_config::rights::{Caller, Heard, Rights};

/// How long an answer may take to begin: the longest wait for a command, and 10 s.
const ANSWERED_WITHIN: Duration = Duration::from_secs(40);

const API: &str = "/api/";
pub const LOGIN: &str = "/api/v1/login";
pub const LOGOUT: &str = "/api/v1/logout";
/// Where links are made by which a browser begins a session, over the control socket.
pub const LINKS: &str = "/api/v1/links";

/// When a request came, in its extensions: before its body was read, and before a disk was waited for. What it asks expires from then
/// on, and a stop that comes meanwhile came after it.
#[derive(Debug, Clone, Copy)]
pub struct Arrived(pub Instant);

/// The checks, and what lies behind them.
pub(super) struct Gate {
    pub(super) router: Router,
    /// The addresses of the router that stop, as it has them: `/api/v1/drives/{name}/stop`.
    pub(super) stops: Vec<&'static str>,
    pub(super) tokens: Option<Arc<Tokens>>,
    pub(super) audit: Audit,
    pub(super) sessions: Sessions,
    pub(super) codes: Codes,
    /// Where the page is, as soon as it is served.
    pub(super) page: Arc<OnceLock<String>>,
    /// Wrong tokens, by address.
    pub(super) failures: Mutex<Failures<Option<IpAddr>>>,
    /// What somebody may not do and has asked for, by caller.
    pub(super) refused: Mutex<Failures<String>>,
    /// How fast each address is refused.
    pub(super) pace: Mutex<Pace>,
    /// Told when somebody may have lost what he was let in by.
    pub(super) changes: watch::Sender<()>,
    /// True when the server ends.
    pub(super) end: watch::Receiver<bool>,
    pub(super) threads: Threads,
}

impl Gate {
    /// Answers a request.
    pub(super) async fn answer<B>(
        self: &Arc<Self>,
        door: &Door,
        peer: Peer,
        request: Request<B>,
        asking: Asking,
    ) -> Response
    where
        B: hyper::body::Body<Data = Bytes, Error: Into<axum::BoxError>> + Send + 'static,
    {
        let of_api = request.uri().path().starts_with(API);
        let (peer, proxied) = door.whose(peer, request.version(), request.headers());
        let mut heard = Heard::default();
        let passed = self.pass(door, (peer, proxied), request, &asking, &mut heard).await;
        let mut answer = match passed {
            Ok(answer) => answer,
            Err(refusal) => {
                // Its connection makes room for others meanwhile.
                if refusal.is_of_the_caller()
                    && let Some(address) = peer.address()
                {
                    let hold = lock(&self.pace).hold(address, Instant::now());
                    if !hold.is_zero() {
                        sleep(hold).await;
                    }
                }
                refusal.into_response()
            }
        };
        let is_stream = |headers: &HeaderMap| {
            headers
                .get(header::CONTENT_TYPE)
                .is_some_and(|kind| kind.as_bytes().starts_with(b"text/event-stream"))
        };
        let streams = is_stream(answer.headers());
        if streams && !asking.may_stream() {
            let why = "too many event streams are open: close another page";
            answer = Refusal::new(StatusCode::TOO_MANY_REQUESTS, why)
                .after(Duration::from_secs(5))
                .into_response();
        }
        // An answer that is made as it goes, such as an event stream or a capture.
        let goes_on = answer.status().is_success() && answer.body().size_hint().exact().is_none();
        protect(answer.headers_mut(), of_api, door.encrypted);
        if goes_on {
            // What ends it ends its connection, so that whoever reads it sees so at once.
            answer.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        answer.map(|body| {
            Body::new(match goes_on {
                true => Kept::stream(body, asking, self.end.clone(), async move { heard.ends().await }),
                false => Kept::whole(body, asking),
            })
        })
    }

    async fn pass<B>(
        self: &Arc<Self>,
        door: &Door,
        (peer, proxied): (Peer, bool),
        request: Request<B>,
        asking: &Asking,
        heard: &mut Heard,
    ) -> Result<Response, Refusal>
    where
        B: hyper::body::Body<Data = Bytes, Error: Into<axum::BoxError>> + Send + 'static,
    {
        let (mut parts, body) = request.into_parts();
        parts.extensions.insert(Arrived(Instant::now()));
        if drive_fleet::mutant!("any-host", !door.hosts.allow(&parts.headers), false) {
            let why =
                "this server has no such name: allowed_hosts in the configuration names those that it has";
            return Err(Refusal::new(StatusCode::MISDIRECTED_REQUEST, why));
        }
        if let Some(why) = host::foreign(&parts.method, &parts.headers) {
            return Err(Refusal::new(StatusCode::FORBIDDEN, why));
        }
        let reads = parts.method == Method::GET || parts.method == Method::HEAD;
        if !reads && !host::is_json(&parts.headers) {
            let why = "expected JSON, and the header Content-Type: application/json";
            return Err(Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, why));
        }
        let path = parts.uri.path().to_owned();
        let is_stop = self.stops.iter().any(|stop| fits(stop, &path));
        let stops = parts.method == Method::POST
            && drive_fleet::mutant!(
                "selected-stop-is-no-stop",
                is_stop,
                is_stop && !path.contains("/selected/")
            );
        if asking.is_for_stops() && !stops {
            let why = "all places are taken: this one is for stops";
            return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, why).after(Duration::from_secs(1)));
        }
        let logs_in = parts.method == Method::POST && path == LOGIN;
        let freely = freely(door, peer, proxied, &parts.headers);
        let (caller, authority) = match logs_in {
            true => (freely, Authority::Freely),
            false => self.caller(freely, peer, &parts.headers, stops)?,
        };
        let is_known = authority != Authority::Freely || peer.address().is_none();
        *heard = self.heard(authority);
        let caller = Caller { heard: heard.clone(), ..caller };
        // But one that says whom it means.
        let stops_whatever_it_says = stops && !path.contains("/selected/");
        let read = async |limit: usize| {
            if stops_whatever_it_says {
                let came = what_comes(body, limit, STOP_WITHIN).await;
                asking.is_whole();
                return Ok(came);
            }
            let body = read(body, limit, if is_known { BODY_WITHIN } else { BODY_OF_NOBODY_WITHIN }).await?;
            asking.is_whole();
            Ok(body)
        };
        if let Some(name) = token_desk::named(&path) {
            let is_read = !reads && peer.address().is_none();
            let body = if is_read { read(BODY).await? } else { Bytes::new() };
            return self.tokens_for(peer, &caller, (&parts.method, name), &body).await;
        }
        if reads {
            asking.is_whole();
            parts.extensions.insert(caller);
            let request = Request::from_parts(parts, Body::empty());
            return self.route(request, Some(&self.threads.readings)).await;
        }
        if logs_in {
            return self.log_in(door, peer, caller, &read(LOGIN_BODY).await?).await;
        }
        if path == LINKS {
            let body = if peer.address().is_none() { read(BODY).await? } else { Bytes::new() };
            return self.link_for(peer, &caller, &body).await;
        }
        if caller.rights == Rights::NONE {
            return Err(Refusal::unauthorized("a token is needed"));
        }
        if parts.method == Method::POST && path == LOGOUT {
            return Ok(self.log_out(door, &caller, &parts.headers));
        }
        let Rights { stop, operate, engineer, .. } = caller.rights;
        let may = drive_fleet::mutant!("viewer-commands", operate || engineer || stops && stop, true);
        if !drive_fleet::mutant!("stop-wants-operate", may, operate || engineer) {
            self.note_refused(&caller, &parts);
            return Err(Refusal::lacks_right(&caller, if stops { "stop" } else { "operate" }));
        }
        let body = read(BODY).await?;
        let record = |kind| {
            let what = parts.uri.path_and_query().map_or(path.as_str(), |path| path.as_str());
            Record::new(kind, &caller, format!("{} {what}", parts.method))
        };
        let came = Record { body: bounded(&body), ..record(Kind::Command) };
        let written = self.audit.record(came);
        if drive_fleet::mutant!("stop-waits-for-the-disk", stops, false) {
            // No disk holds up a stop.
            written.whenever();
        } else if let Err(error) = written.done().await {
            let why = format!("{error}: until it can, only stops are carried out");
            return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, why));
        }
        let answered = record(Kind::Answer);
        parts.extensions.insert(caller);
        let elsewhere = (!stops).then_some(&self.threads.commands);
        let answer = self.route(Request::from_parts(parts, Body::from(body)), elsewhere).await;
        self.audited(answered, answer).await
    }

    /// Has the router answer, here and at once or elsewhere.
    async fn route(&self, request: Request<Body>, elsewhere: Option<&Handle>) -> Result<Response, Refusal> {
        let answer = self.router.clone().oneshot(request);
        let answered = async {
            let Some(elsewhere) = elsewhere else { return Some(answer.await) };
            // It ends with whoever asks.
            let mut one = JoinSet::new();
            one.spawn_on(answer, elsewhere);
            one.join_next().await?.ok()
        };
        match timeout(ANSWERED_WITHIN, answered).await {
            Ok(Some(Ok(answer))) => Ok(answer),
            Ok(Some(Err(never))) => match never {},
            Ok(None) => Err(Refusal::new(
                StatusCode::INTERNAL_SERVER_ERROR,
                "this cannot be answered: see the log of the daemon",
            )),
            Err(_) => Err(Refusal::new(
                StatusCode::GATEWAY_TIMEOUT,
                "no answer in time: nobody knows what became of it",
            )),
        }
    }

    /// Writes into the audit log what is answered to a command.
    async fn audited(&self, record: Record, answer: Result<Response, Refusal>) -> Result<Response, Refusal> {
        #[derive(Default, Deserialize)]
        struct Outcome {
            id: Option<String>,
            outcome: Option<String>,
        }
        let answer = answer.unwrap_or_else(Refusal::into_response);
        let (parts, body) = answer.into_parts();
        // Answers to commands are made here and are whole.
        let body = body.collect().await.map(http_body_util::Collected::to_bytes).unwrap_or_default();
        let Outcome { id, outcome } = serde_json::from_slice(&body).unwrap_or_default();
        self.audit.record(Record { id, outcome, status: Some(parts.status.as_u16()), ..record }).whenever();
        Ok(Response::from_parts(parts, Body::from(body)))
    }
}

/// Whether a path is one of those that a router has at this address: what stands in braces is any level.
fn fits(address: &str, path: &str) -> bool {
    let fits = |(level, said): (&str, &str)| level == said || level.starts_with('{') && !said.is_empty();
    address.split('/').count() == path.split('/').count() && address.split('/').zip(path.split('/')).all(fits)
}

/// What a browser is told about every answer.
fn protect(headers: &mut HeaderMap, of_api: bool, encrypted: bool) {
    /// A browser that has been here once comes by TLS for a year, also where somebody types the address without it.
    const ONLY_ENCRYPTED: &str = "max-age=31536000";
    const POLICY: &str = "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'";
    for (name, value) in [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if encrypted {
        headers.insert(header::STRICT_TRANSPORT_SECURITY, HeaderValue::from_static(ONLY_ENCRYPTED));
    }
    // The page's document says itself what may stand in it.
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(POLICY));
    if of_api {
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
}
