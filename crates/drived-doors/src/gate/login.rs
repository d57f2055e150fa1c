//! How sessions begin and end, and how tokens and links are made.

use std::sync::Arc;

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    response::Response,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use super::{
    Door, Gate, Peer,
    caller::{of_token, unreadable},
};
use crate::{
    audit::{Kind, Record},
    codes::{self, Grant},
    refusal::Refusal,
    sessions, token_desk,
    tokens::{self, Token, TokenError},
};
use drived_config::{
    kept::sha256,
    rights::{Caller, Rights, Role},
};
use drived_words::json::line;

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
pub(in super::super) fn link(page: &str, code: &str) -> String {
    format!("{page}#/enter/{code}")
}

/// Who somebody is.
#[derive(Serialize, JsonSchema)]
pub struct SessionView {
    caller: String,
    rights: Rights,
}

impl Gate {
    /// Tokens are made where those stand who have every right without one.
    pub(super) async fn tokens_for(
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

    pub(super) async fn log_in(
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
    pub(super) async fn link_for(
        &self,
        peer: Peer,
        caller: &Caller,
        body: &[u8],
    ) -> Result<Response, Refusal> {
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

    pub(super) fn log_out(&self, door: &Door, caller: &Caller, headers: &HeaderMap) -> Response {
        if let Some(session) = sessions::cookie(headers) {
            // Whoever may see may say any cookie: only the end of a session that was there is written and told.
            if self.sessions.end(session) {
                self.changes.send_replace(());
            }
        }
        self.audit.record(Record::new(Kind::Logout, caller, "logout")).whenever();
        told(caller, None, door.encrypted)
    }
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
