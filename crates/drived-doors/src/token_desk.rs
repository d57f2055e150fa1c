//! `/api/v1/tokens`: whoever has every right on the control socket makes, lists, replaces and removes tokens. The daemon does it itself, so that
//! nobody with more rights than it has writes in its folder.

use std::{path::PathBuf, sync::Arc, time::Duration};

use axum::{
    body::Body,
    http::{HeaderValue, Method, StatusCode, header},
    response::Response,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tokio::task::spawn_blocking;

use super::{
    audit::{Audit, Kind, Record},
    refusal::Refusal,
    tokens::{Token, TokenError, TokenView, Tokens, of_days},
};
use drived_config::rights::{Caller, Role, Scope};
use drived_words::{json::line, strict};

/// Where tokens are made, listed and, with the name of one behind it, removed.
pub const TOKENS: &str = "/api/v1/tokens";

/// The tokens, and where they are kept.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct TokensView {
    pub file: PathBuf,
    pub tokens: Vec<TokenView>,
}

/// A token that is wished for.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewToken {
    name: String,
    role: Role,
    /// Which drives it is for; every drive where it is not said.
    #[serde(default)]
    scope: Option<Scope>,
    /// For how many days; for ever where it is not said.
    #[serde(default)]
    days: Option<u32>,
}

/// How a token is replaced.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// How many hours that which it was is good for yet.
    hours: u32,
}

/// A token that was made: what it is itself is told this once.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct MadeToken {
    pub name: String,
    pub role: Role,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<Scope>,
    pub token: String,
}

impl MadeToken {
    /// A token and its secret.
    pub fn of(token: Token, secret: String) -> Self {
        let Token { name, role, scope, .. } = token;
        Self { name, role, scope, token: secret }
    }
}

/// A token that is no more.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RemovedToken {
    pub name: String,
    pub removed: bool,
}

/// For so many hours.
pub const fn of_hours(hours: u32) -> Duration {
    Duration::from_secs(hours as u64 * 3_600)
}

/// What the log of who did what says of a token that was made.
pub fn added(name: &str, role: Role, scope: Option<&Scope>) -> String {
    let scope = scope.map(|scope| format!(", for {scope}")).unwrap_or_default();
    format!("token {name} added, role {}{scope}", role.name())
}

/// What the log of who did what says of a token that was replaced.
pub fn replaced(name: &str, hours: u32) -> String {
    format!("token {name} replaced; the one before it is good for {hours} h yet")
}

/// Whether a path is one of tokens, and the name that it has.
pub(super) fn named(path: &str) -> Option<Option<&str>> {
    match path.strip_prefix(TOKENS)? {
        "" => Some(None),
        name => name.strip_prefix('/').map(Some),
    }
}

/// Does what is asked for. Of a token that nobody could keep in the log of who did what, none is made; one that was removed stays
/// removed.
pub(super) async fn answer(
    tokens: Arc<Tokens>,
    audit: &Audit,
    caller: &Caller,
    (method, name): (&Method, Option<&str>),
    body: &[u8],
) -> Result<Response, Refusal> {
    let record = |what: String| audit.record(Record::new(Kind::Token, caller, what));
    match (method, name) {
        (&Method::GET, None) => {
            let file = tokens.file().to_owned();
            Ok(told(&TokensView { file, tokens: tokens.views().map_err(refused)? }))
        }
        (&Method::POST, None) => {
            let NewToken { name, role, scope, days } = read(body, "{\"name\": …, \"role\": …}")?;
            let rights = (role, scope.clone());
            let add = move |tokens: &Tokens, name: &str| tokens.add(name, rights, days.map(of_days));
            let token = changed(&tokens, name.clone(), add).await?;
            let what = Record::new(Kind::Token, caller, added(&name, role, scope.as_ref()));
            kept_or_removed(&tokens, audit, what, &name).await?;
            Ok(told(&MadeToken { name, role, scope, token }))
        }
        (&Method::PUT, Some(name)) => {
            let Rotation { hours } = read(body, "{\"hours\": …}")?;
            let rotate = move |tokens: &Tokens, name: &str| tokens.rotate(name, of_hours(hours));
            let (token, secret) = changed(&tokens, name.to_owned(), rotate).await?;
            record(replaced(name, hours)).whenever();
            Ok(told(&MadeToken::of(token, secret)))
        }
        (&Method::DELETE, Some(name)) => {
            let name = name.to_owned();
            changed(&tokens, name.clone(), Tokens::remove).await?;
            record(format!("token {name} removed")).whenever();
            Ok(told(&RemovedToken { name, removed: true }))
        }
        _ => {
            Err(Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "tokens are listed, made, replaced and removed"))
        }
    }
}

/// Waits until it stands in the log of who did what that a token was made; where it cannot, the token is removed again.
pub(super) async fn kept_or_removed(
    tokens: &Arc<Tokens>,
    audit: &Audit,
    made: Record,
    name: &str,
) -> Result<(), Refusal> {
    let Err(error) = audit.record(made).done().await else { return Ok(()) };
    changed(tokens, name.to_owned(), Tokens::remove).await?;
    Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string()))
}

/// What is asked for, read as strictly as a command.
pub(super) fn read<T: DeserializeOwned>(body: &[u8], expected: &str) -> Result<T, Refusal> {
    strict::body(body)
        .map_err(|unclear| Refusal::new(StatusCode::BAD_REQUEST, format!("expected {expected}: {unclear}")))
}

/// What changes a file waits for the disk, and no task for that.
pub(super) async fn changed<T: Send + 'static>(
    tokens: &Arc<Tokens>,
    name: String,
    change: impl FnOnce(&Tokens, &str) -> Result<T, TokenError> + Send + 'static,
) -> Result<T, Refusal> {
    let tokens = Arc::clone(tokens);
    match spawn_blocking(move || change(&tokens, &name)).await {
        Ok(changed) => changed.map_err(refused),
        Err(_) => Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "the daemon ends")),
    }
}

pub(super) fn refused(error: TokenError) -> Refusal {
    let status = match error {
        TokenError::Name(_) | TokenError::Reserved(_) | TokenError::Taken(_) | TokenError::Alike(..) => {
            StatusCode::UNPROCESSABLE_ENTITY
        }
        TokenError::Unknown { .. } => StatusCode::NOT_FOUND,
        TokenError::Random(_) | TokenError::File { .. } | TokenError::Open(_) => {
            StatusCode::SERVICE_UNAVAILABLE
        }
    };
    Refusal::new(status, error.to_string())
}

fn told(what: &impl Serialize) -> Response {
    let mut answer = Response::new(Body::from(line(what)));
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    answer
}
