//! The page: files that are in the binary, served as they are. No build chain makes them, and they ask nobody but this
//! daemon for anything.

mod files;
#[cfg(test)]
mod tests;

use axum::{
    Router,
    extract::Request,
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH},
    },
    response::{IntoResponse, Response},
    routing::get,
};
use sha2::{Digest, Sha256};

use self::files::{FILES, File};

/// The routes of the page: `/` and each of its files.
///
/// A file is kept by browsers and asked for again each time, with the hash of its content as the tag: a page of an older
/// version never meets an API of a newer one. Nothing is compressed: over the network of a plant the whole first look is
/// smaller than one picture.
pub(crate) fn router() -> Router {
    FILES.iter().fold(Router::new(), |router, file| {
        let served = Served::of(file);
        router.route(file.path, get(move |request: Request| async move { served.answer(request.headers()) }))
    })
}

/// A file with what is said about it in every answer.
#[derive(Clone)]
struct Served {
    content: &'static [u8],
    kind: &'static str,
    tag: HeaderValue,
}

impl Served {
    fn of(file: &'static File) -> Self {
        let hash = Sha256::digest(file.content);
        let tag: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
        let tag = HeaderValue::try_from(format!("\"{tag}\"")).expect("hexadecimal digits are a header");
        Self { content: file.content, kind: file.kind(), tag }
    }

    fn answer(&self, asked: &HeaderMap) -> Response {
        let headers = [(ETAG, self.tag.clone()), (CACHE_CONTROL, HeaderValue::from_static("no-cache"))];
        if asked.get(IF_NONE_MATCH).is_some_and(|known| self.is_named_by(known)) {
            return (StatusCode::NOT_MODIFIED, headers).into_response();
        }
        (headers, [(CONTENT_TYPE, self.kind)], self.content).into_response()
    }

    /// Whether an `If-None-Match`, which may list several tags, names this content.
    fn is_named_by(&self, known: &HeaderValue) -> bool {
        let Ok(known) = known.to_str() else { return false };
        known.split(',').any(|tag| tag.trim().trim_start_matches("W/").as_bytes() == self.tag.as_bytes())
    }
}
