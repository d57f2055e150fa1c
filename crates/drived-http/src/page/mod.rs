//! The page: files that are in the binary. No build chain makes them, and they ask nobody but this daemon for anything.
//!
//! It is made for a bad network: what stops the motors stands in the first bytes of the document and works before anything
//! else has come; the rest is one script and one style sheet, compressed.

mod bundle;
mod files;
pub mod french;
#[cfg(test)]
mod tests;

use std::io::Write as _;

use axum::{
    Router,
    body::Bytes,
    extract::Request,
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{
            ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG,
            IF_NONE_MATCH, VARY,
        },
    },
    response::{IntoResponse, Response},
    routing::get,
};
use base64::{Engine as _, engine::general_purpose::STANDARD};
use flate2::{Compression, write::GzEncoder};
use ring::digest::{SHA256, digest};

use self::files::{File, STOP_SCRIPT, STOP_STYLE, files};
use drived_config::kept::sha256;

/// The routes of the page: `/` and each of its files.
///
/// A file is kept by browsers and asked for again each time, with the hash of its content as the tag: a page of an older
/// version never meets an API of a newer one.
pub fn router() -> Router {
    files().iter().fold(Router::new(), |router, file| {
        let served = Served::of(file);
        router.route(file.path, get(move |request: Request| async move { served.answer(request.headers()) }))
    })
}

/// A body, made smaller for who reads it over a slow network.
pub fn compressed(body: &[u8]) -> Bytes {
    let mut smaller = GzEncoder::new(Vec::new(), Compression::default());
    let whole = smaller.write_all(body).and_then(|()| smaller.finish());
    whole.expect("memory takes what is written").into()
}

/// Whether somebody reads what is [`compressed`].
pub fn reads_compressed(asked: &HeaderMap) -> bool {
    let said = asked.get(ACCEPT_ENCODING).and_then(|said| said.to_str().ok()).unwrap_or_default();
    said.split(',')
        .any(|one| one.split(';').next().is_some_and(|name| name.trim() == "gzip") && !one.ends_with("q=0"))
}

/// A file with what is said about it in every answer.
#[derive(Clone)]
struct Served {
    content: Bytes,
    smaller: Bytes,
    kind: &'static str,
    tag: HeaderValue,
    policy: Option<HeaderValue>,
}

impl Served {
    fn of(file: &File) -> Self {
        let tag = HeaderValue::try_from(format!("W/\"{}\"", &sha256(&file.content)[..32]))
            .expect("hexadecimal digits are a header");
        Self {
            content: file.content.clone().into(),
            smaller: compressed(&file.content),
            kind: file.kind(),
            tag,
            policy: (file.path == "/").then(policy),
        }
    }

    fn answer(&self, asked: &HeaderMap) -> Response {
        let said = [
            (ETAG, &self.tag),
            (CACHE_CONTROL, &HeaderValue::from_static("no-cache")),
            (VARY, &ACCEPT_ENCODING.into()),
        ]
        .map(|(name, value)| (name, value.clone()));
        let is_known = asked.get(IF_NONE_MATCH).is_some_and(|known| self.is_named_by(known));
        let mut answer = match (is_known, reads_compressed(asked)) {
            (true, _) => (StatusCode::NOT_MODIFIED, said).into_response(),
            (false, true) => (said, [(CONTENT_ENCODING, "gzip")], self.smaller.clone()).into_response(),
            (false, false) => (said, self.content.clone()).into_response(),
        };
        answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(self.kind));
        if let Some(policy) = &self.policy {
            answer.headers_mut().insert(CONTENT_SECURITY_POLICY, policy.clone());
        }
        answer
    }

    /// Whether an `If-None-Match`, which may list several tags, names this content.
    fn is_named_by(&self, known: &HeaderValue) -> bool {
        let strong = |tag: &[u8]| tag.strip_prefix(b"W/").unwrap_or(tag).to_vec();
        let Ok(known) = known.to_str() else { return false };
        known.split(',').any(|tag| strong(tag.trim().as_bytes()) == strong(self.tag.as_bytes()))
    }
}

/// What the document may do: the path of a stop stands in it and is allowed by its hash, and nothing else in line is.
fn policy() -> HeaderValue {
    let hash = |text: &str| STANDARD.encode(digest(&SHA256, text.as_bytes()));
    let policy = format!(
        "default-src 'self'; script-src 'self' 'sha256-{}'; style-src 'self' 'sha256-{}'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'",
        hash(STOP_SCRIPT),
        hash(STOP_STYLE),
    );
    HeaderValue::try_from(policy).expect("hashes in base 64 are a header")
}
