//! What every request passes, by whichever door it came: whom it was meant for, who asks, how much he says, and the audit
//! log; then the router.

use std::{
    net::IpAddr,
    pin::pin,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    time::Duration,
};

use axum::{
    Router,
    body::{Body, Bytes},
    http::{
        HeaderMap, HeaderValue, Method, Request, StatusCode, Version,
        header::{self, HeaderName},
        request::Parts,
    },
    response::Response,
};
use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use hyper::body::Body as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::{
    runtime::Handle,
    sync::watch,
    task::JoinSet,
    time::{Instant, sleep, timeout, timeout_at},
};
use tower::ServiceExt as _;

use super::{
    audit::{Audit, Kind, Record, bounded},
    authority::Authority,
    codes::{self, Codes, Grant},
    crowd::Asking,
    failures::Failures,
    host::{self, Hosts},
    kept::Kept,
    network::Network,
    pace::Pace,
    refusal::Refusal,
    sessions::{self, Sessions},
    threads::Threads,
    token_desk,
    tokens::{self, Token, TokenError, Tokens},
};
use drived_config::{
    kept::sha256,
    rights::{Caller, Rights, Role},
};
use drived_words::json::line;

/// The most that a request may say.
const BODY: usize = 64 * 1024;
/// The most that whoever begins a session may say.
const LOGIN_BODY: usize = 4 * 1024;
/// How long whoever has brought a right token may take to say it, and whoever has not.
const BODY_WITHIN: Duration = Duration::from_secs(10);
const BODY_OF_NOBODY_WITHIN: Duration = Duration::from_secs(1);
/// How long a stop may take to say how: whoever is cut off in the middle of it has asked for one.
const STOP_WITHIN: Duration = Duration::from_millis(250);
/// How long an answer may take to begin: the longest wait for a command, and 10 s.
const ANSWERED_WITHIN: Duration = Duration::from_secs(40);

const API: &str = "/api/";
pub const LOGIN: &str = "/api/v1/login";
pub const LOGOUT: &str = "/api/v1/logout";
/// Where links are made by which a browser begins a session, over the control socket.
pub const LINKS: &str = "/api/v1/links";

/// By which a session begins: one of the two.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoginBody {
    token: Option<String>,
    /// A code of `drived token link`, which is good once.
    code: Option<String>,
}

/// A link that is wished for.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewLink {
    /// The token by whose name and rights the browser is known.
    name: String,
    /// What it may, if there is no such token when the link is used.
    #[serde(default)]
    role: Option<Role>,
    /// For how many days that one is good then; 1 unless it is said.
    #[serde(default)]
    days: Option<u32>,
}

/// A link by which a browser begins a session, once.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct MadeLink {
    pub name: String,
    pub link: String,
    pub good_for_s: u64,
}

/// The address at which the page begins a session. What stands behind `#` is sent to nobody by a browser.
pub(super) fn link(page: &str, code: &str) -> String {
    format!("{page}#/enter/{code}")
}

/// Who somebody is.
#[derive(Serialize, JsonSchema)]
pub struct SessionView {
    caller: String,
    rights: Rights,
}

/// When a request came, in its extensions: before its body was read, and before a disk was waited for. What it asks expires from then
/// on, and a stop that comes meanwhile came after it.
#[derive(Debug, Clone, Copy)]
pub struct Arrived(pub Instant);

/// What holds for one door.
#[derive(Debug, Clone)]
pub(super) struct Door {
    pub(super) hosts: Hosts,
    /// What is given to those who bring no token.
    pub(super) freely: Rights,
    /// The same, where a proxy stands between.
    pub(super) through_a_proxy: Rights,
    /// Those who say truly for whom they ask.
    pub(super) proxies: Vec<Network>,
    pub(super) encrypted: bool,
}

/// What a proxy adds to what it passes on.
const OF_PROXIES: [&str; 10] = [
    "forwarded",
    "x-forwarded-for",
    "x-forwarded-host",
    "x-forwarded-port",
    "x-forwarded-proto",
    "x-forwarded-server",
    "x-real-ip",
    "via",
    "cf-connecting-ip",
    "true-client-ip",
];

impl Door {
    /// Who asks, and whether through a proxy. Of one that is not named nothing is believed but that it is one.
    fn whose(&self, peer: Peer, version: Version, headers: &HeaderMap) -> (Peer, bool) {
        let Peer::Address(address) = peer else { return (peer, false) };
        let is_named = |address: IpAddr| self.proxies.iter().any(|network| network.has(address));
        if !is_named(address) {
            // No browser and none of ours speaks the older one; proxies do where they are not told otherwise.
            let proxied =
                version == Version::HTTP_10 || OF_PROXIES.into_iter().any(|name| headers.contains_key(name));
            return (peer, proxied);
        }
        // Each proxy adds whom it heard behind what it was told: the last that is none of ours is believed.
        let all = headers.get_all("x-forwarded-for").iter().filter_map(|said| said.to_str().ok());
        let said: Vec<IpAddr> =
            all.flat_map(|said| said.split(',')).map_while(|one| one.trim().parse().ok()).collect();
        let of_them =
            said.into_iter().rev().map(|one: IpAddr| one.to_canonical()).find(|one| !is_named(*one));
        (Peer::Address(of_them.unwrap_or(address)), true)
    }
}

/// The far end of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Peer {
    Address(IpAddr),
    /// A user of this machine on the socket.
    User(Option<u32>),
}

impl Peer {
    pub(super) const fn address(self) -> Option<IpAddr> {
        match self {
            Self::Address(address) => Some(address),
            Self::User(_) => None,
        }
    }
}

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
        let mut authority = Authority::Freely;
        let passed = self.pass(door, (peer, proxied), request, &asking, &mut authority).await;
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
        let gate = Arc::clone(self);
        let authority = authority.ends(move |authority| gate.holds(authority), self.changes.subscribe());
        protect(answer.headers_mut(), of_api, door.encrypted);
        if goes_on {
            // What ends it ends its connection, so that whoever reads it sees so at once.
            answer.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        answer.map(|body| {
            Body::new(match goes_on {
                true => Kept::stream(body, asking, self.end.clone(), authority),
                false => Kept::whole(body, asking),
            })
        })
    }

    async fn pass<B>(
        &self,
        door: &Door,
        (peer, proxied): (Peer, bool),
        request: Request<B>,
        asking: &Asking,
        authority: &mut Authority,
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
        let caller = match logs_in {
            true => freely,
            false => {
                let caller;
                (caller, *authority) = self.caller(freely, peer, &parts.headers, stops)?;
                caller
            }
        };
        // But one that says whom it means.
        let stops_whatever_it_says = stops && !path.contains("/selected/");
        let read = async |limit: usize| {
            if stops_whatever_it_says {
                let came = what_comes(body, limit, STOP_WITHIN).await;
                asking.is_whole();
                return Ok(came);
            }
            let is_known = *authority != Authority::Freely || peer.address().is_none();
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

    /// Tokens are made where those stand who have every right without one.
    async fn tokens_for(
        &self,
        peer: Peer,
        caller: &Caller,
        what: (&Method, Option<&str>),
        body: &[u8],
    ) -> Result<Response, Refusal> {
        if drive_fleet::mutant!("tokens-over-the-network", peer.address().is_some(), false)
            || !caller.rights.engineer
        {
            return Err(Refusal::new(
                StatusCode::FORBIDDEN,
                "tokens are made and removed over the control socket",
            ));
        }
        let Some(tokens) = &self.tokens else {
            return Err(Refusal::new(StatusCode::NOT_FOUND, "this daemon keeps no tokens"));
        };
        let answer = token_desk::answer(Arc::clone(tokens), &self.audit, caller, what, body).await;
        if let (&(&Method::PUT | &Method::DELETE), Some(name)) = (&what.0, what.1) {
            self.codes.drop_of(name);
        }
        self.changes.send_replace(());
        answer
    }

    /// Whether what somebody was let in by is so still.
    pub(super) fn holds(&self, authority: &Authority) -> bool {
        let of_hash = |hash: &str, role: Role| {
            let token = self.tokens.as_ref().and_then(|tokens| tokens.of_hash(hash).ok().flatten());
            drive_fleet::mutant!("removed-token-holds", token.is_some_and(|token| token.role == role), true)
        };
        match authority {
            Authority::Freely => true,
            Authority::Token { sha256, role } => of_hash(sha256, *role),
            Authority::Session { secret, sha256, role } => {
                let is_begun = self.sessions.token(secret, Instant::now()).as_ref() == Some(sha256);
                is_begun && of_hash(sha256, *role)
            }
        }
    }

    /// Who asks, and by what he is let in. A token that is wrong is never taken for none.
    fn caller(
        &self,
        without: Caller,
        peer: Peer,
        headers: &HeaderMap,
        stops: bool,
    ) -> Result<(Caller, Authority), Refusal> {
        match self.bearer(peer, headers, stops, &without) {
            // A file of tokens that cannot be read keeps nobody from a stop that needs none.
            Err(Unlet::Unreadable(_)) if stops && without.rights.stop => Ok((without, Authority::Freely)),
            Err(Unlet::Unreadable(error)) => Err(unreadable(error)),
            Err(Unlet::Refused(refusal)) => Err(refusal),
            Ok(None) => Ok((without, Authority::Freely)),
            Ok(Some((token, authority))) => Ok((of_token(&token, without), authority)),
        }
    }

    /// The token by which somebody comes, if any.
    fn bearer(
        &self,
        peer: Peer,
        headers: &HeaderMap,
        stops: bool,
        without: &Caller,
    ) -> Result<Option<(Token, Authority)>, Unlet> {
        let Some(authorization) = headers.get(header::AUTHORIZATION) else {
            // A session that is over is no wrong token: who had it is anybody again, and the page says so.
            let Some(secret) = sessions::cookie(headers) else { return Ok(None) };
            let hash = self.sessions.token(secret, Instant::now());
            let (Some(sha256), Some(tokens)) = (hash, &self.tokens) else { return Ok(None) };
            let token = if stops { tokens.of_hash_for_stop(&sha256) } else { tokens.of_hash(&sha256) }?;
            let secret = secret.to_owned();
            return Ok(token.map(|token| {
                let role = token.role;
                (token, Authority::Session { secret, sha256, role })
            }));
        };
        // Whoever has a right token stops his motors, whatever others do at the same address.
        if drive_fleet::mutant!("guessing-keeps-a-stop-out", !stops, true) {
            self.wait(peer).map_err(Unlet::Refused)?;
        }
        let secret = authorization.to_str().ok().and_then(|text| text.split_once(' '));
        let secret = secret
            .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
            .map(|(_, secret)| secret.trim());
        let find = |secret: &str| match &self.tokens {
            Some(tokens) if stops => tokens.of_hash_for_stop(&sha256(secret.as_bytes())),
            _ => self.token(secret),
        };
        match secret.map(find).transpose()?.flatten() {
            Some(token) => {
                // By that which was brought: it may end before the one that has replaced it.
                let sha256 = sha256(secret.unwrap_or_default().as_bytes());
                let authority = Authority::Token { sha256, role: token.role };
                Ok(Some((token, authority)))
            }
            None => drive_fleet::mutant!(
                "wrong-token-is-none",
                Err(Unlet::Refused(self.failed(peer, without))),
                Ok(None)
            ),
        }
    }

    fn token(&self, secret: &str) -> Result<Option<Token>, TokenError> {
        self.tokens.as_ref().map_or(Ok(None), |tokens| tokens.find(secret))
    }

    async fn log_in(
        &self,
        door: &Door,
        peer: Peer,
        caller: Caller,
        body: &[u8],
    ) -> Result<Response, Refusal> {
        const EXPECTED: &str = "{\"token\": \"drv_…\"} or {\"code\": …}";
        self.wait(peer)?;
        let known = match token_desk::read(body, EXPECTED)? {
            LoginBody { token: Some(secret), code: None } => {
                let secret = secret.trim();
                let token = self.token(secret).map_err(unreadable)?;
                token.map(|token| (token, sha256(secret.as_bytes())))
            }
            LoginBody { token: None, code: Some(code) } => self.by_code(code.trim(), &caller).await?,
            LoginBody { .. } => {
                return Err(Refusal::new(StatusCode::BAD_REQUEST, format!("expected {EXPECTED}")));
            }
        };
        let Some((token, hash)) = known else {
            return Err(self.failed(peer, &caller));
        };
        let session = tokens::new_secret().map_err(unreadable)?;
        self.sessions.begin(&session, &hash, Instant::now());
        let caller = of_token(&token, caller);
        self.audit.record(Record::new(Kind::Login, &caller, "login")).whenever();
        Ok(told(&caller, Some(&session), door.encrypted))
    }

    /// The token of whom a code is for, and its hash. The code is none from then on.
    async fn by_code(&self, code: &str, caller: &Caller) -> Result<Option<(Token, String)>, Refusal> {
        let Some(Grant { name, right }) = self.codes.take(code, Instant::now()) else { return Ok(None) };
        let Some(tokens) = self.tokens.clone() else { return Ok(None) };
        let made = token_desk::changed(&tokens, name, move |tokens, name| {
            // Whoever it is for may have lost his token since: then it is good no more.
            match tokens.for_session(name, &right) {
                Err(TokenError::Unknown { .. }) => Ok(None),
                made => made.map(Some),
            }
        });
        let Some((token, is_new)) = made.await? else { return Ok(None) };
        if is_new {
            let what = token_desk::added(&token.name, token.role, None);
            token_desk::kept_or_removed(
                &tokens,
                &self.audit,
                Record::new(Kind::Token, caller, what),
                &token.name,
            )
            .await?;
        }
        let hash = token.sha256.clone();
        Ok(Some((token, hash)))
    }

    /// Makes a link for whoever has every right without one.
    async fn link_for(&self, peer: Peer, caller: &Caller, body: &[u8]) -> Result<Response, Refusal> {
        if peer.address().is_some() || !caller.rights.engineer {
            return Err(Refusal::new(StatusCode::FORBIDDEN, "links are made over the control socket"));
        }
        let NewLink { name, role, days } = token_desk::read(body, "{\"name\": …, \"role\": …}")?;
        let Some(tokens) = &self.tokens else {
            return Err(Refusal::new(StatusCode::NOT_FOUND, "this daemon keeps no tokens"));
        };
        let unusable = |why| Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, why));
        if days == Some(0) {
            return unusable("0 days: expected 1 or more".to_owned());
        }
        let right = match tokens.right_of(&name, role.map(|role| (role, days.unwrap_or(1)))) {
            Err(TokenError::Unknown { .. }) => {
                let why = format!(
                    "there is no token {name:?} that is good: a role makes one when the link is used"
                );
                return unusable(why);
            }
            right => right.map_err(token_desk::refused)?,
        };
        let grant = Grant { name: name.clone(), right };
        let Some(page) = self.page.get() else {
            return Err(Refusal::new(StatusCode::NOT_FOUND, "this daemon serves no page"));
        };
        let written = self.audit.record(Record::new(Kind::Token, caller, format!("link for {name}")));
        if let Err(error) = written.done().await {
            return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string()));
        }
        let code = self.codes.make(grant, Instant::now()).map_err(unreadable)?;
        let made = MadeLink { name, link: link(page, &code), good_for_s: codes::LASTS.as_secs() };
        let mut answer = Response::new(Body::from(line(&made)));
        answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
        Ok(answer)
    }

    fn log_out(&self, door: &Door, caller: &Caller, headers: &HeaderMap) -> Response {
        if let Some(session) = sessions::cookie(headers) {
            // Whoever may see may say any cookie: only the end of a session that was there is written and told.
            if self.sessions.end(session) {
                self.changes.send_replace(());
            }
        }
        self.audit.record(Record::new(Kind::Logout, caller, "logout")).whenever();
        told(caller, None, door.encrypted)
    }

    /// Whether tokens of this address are looked at.
    fn wait(&self, peer: Peer) -> Result<(), Refusal> {
        if peer.address().is_none() {
            return Ok(());
        }
        match lock(&self.failures).wait(&peer.address(), Instant::now()) {
            None => Ok(()),
            Some(wait) => {
                let why = "too many wrong tokens from this address";
                Err(Refusal::new(StatusCode::TOO_MANY_REQUESTS, why).after(wait))
            }
        }
    }

    /// A wrong token has come. Of many only some are told.
    fn failed(&self, peer: Peer, caller: &Caller) -> Refusal {
        if let Some(untold) = lock(&self.failures).count(&peer.address(), Instant::now()) {
            let what = and_before("a wrong token", untold);
            tracing::warn!("{what} from {}", caller.origin);
            self.audit.record_refused(Record::new(Kind::LoginFailed, caller, what));
        }
        Refusal::unauthorized("the token is wrong")
    }

    /// Somebody has asked for what he may not do. Of many only some are told.
    fn note_refused(&self, caller: &Caller, asked: &Parts) {
        let who = format!("{} {}", caller.name, caller.origin);
        if let Some(untold) = lock(&self.refused).count(&who, Instant::now()) {
            let what = and_before(&format!("{} {}", asked.method, asked.uri.path()), untold);
            self.audit.record_refused(Record::new(Kind::Refused, caller, what));
        }
    }
}

/// What is told, and how often it has been so without being told.
fn and_before(what: &str, untold: u64) -> String {
    match untold {
        0 => what.to_owned(),
        untold => format!("{what}, and {untold} before that were not told"),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn unreadable(error: TokenError) -> Refusal {
    tracing::error!(%error, "no token can be looked at");
    Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "no token can be looked at: see the log of the daemon")
}

/// Whoever brings no token.
fn freely(door: &Door, peer: Peer, proxied: bool, headers: &HeaderMap) -> Caller {
    let browser = headers.contains_key("sec-fetch-site") || headers.contains_key(header::COOKIE);
    let (name, origin) = match peer {
        Peer::Address(address) => {
            ("anonymous", format!("{} {}", if browser { "page" } else { "http" }, address.to_canonical()))
        }
        Peer::User(Some(uid)) => ("local", format!("socket uid {uid}")),
        Peer::User(None) => ("local", "socket".to_owned()),
    };
    Caller::new(name, origin, if proxied { door.through_a_proxy } else { door.freely })
}

fn of_token(token: &Token, without: Caller) -> Caller {
    let rights = token.role.rights();
    // Nobody stops less because he has said who he is.
    let stop = rights.stop || without.rights.stop;
    let rights = Rights { stop, ..rights };
    Caller { name: token.name.clone(), rights, scope: token.scope.clone(), ..without }
}

/// Why somebody is not let in.
enum Unlet {
    Refused(Refusal),
    /// Who he is cannot be looked at.
    Unreadable(TokenError),
}

impl From<TokenError> for Unlet {
    fn from(error: TokenError) -> Self {
        Self::Unreadable(error)
    }
}

/// Whether a path is one of those that a router has at this address: what stands in braces is any level.
fn fits(address: &str, path: &str) -> bool {
    let fits = |(level, said): (&str, &str)| level == said || level.starts_with('{') && !said.is_empty();
    address.split('/').count() == path.split('/').count() && address.split('/').zip(path.split('/')).all(fits)
}

/// The body of a request, as far as it may go.
async fn read<B>(body: B, limit: usize, within: Duration) -> Result<Bytes, Refusal>
where
    B: hyper::body::Body<Data = Bytes, Error: Into<axum::BoxError>> + Send + 'static,
{
    match timeout(within, Limited::new(body, limit).collect()).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => {
            Err(Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, format!("this may say {} KiB", limit >> 10)))
        }
        Ok(Err(_)) => Err(Refusal::new(StatusCode::BAD_REQUEST, "the request ended before its end")),
        Err(_) => Err(Refusal::new(StatusCode::REQUEST_TIMEOUT, "the request took too long")),
    }
}

/// What has come of a body within a time, as far as it may go.
async fn what_comes<B>(body: B, limit: usize, within: Duration) -> Bytes
where
    B: hyper::body::Body<Data = Bytes, Error: Into<axum::BoxError>> + Send + 'static,
{
    let (mut body, mut came, until) = (pin!(body), Vec::new(), Instant::now() + within);
    while came.len() < limit
        && let Ok(Some(Ok(frame))) = timeout_at(until, body.frame()).await
    {
        let room = limit - came.len();
        came.extend(frame.data_ref().into_iter().flatten().take(room));
    }
    came.into()
}

/// Who the caller is now, and his cookie.
fn told(caller: &Caller, session: Option<&str>, encrypted: bool) -> Response {
    let known = SessionView { caller: caller.name.clone(), rights: caller.rights };
    let mut answer = Response::new(Body::from(line(&known)));
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    if let Ok(cookie) = sessions::set_cookie(session, encrypted).parse() {
        headers.insert(header::SET_COOKIE, cookie);
    }
    answer
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
