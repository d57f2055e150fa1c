//! Large documents, made smaller for who reads them over a slow network.

use axum::{
    body::{Body, HttpBody as _, to_bytes},
    extract::Request,
    http::{
        HeaderValue,
        header::{ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_LENGTH, CONTENT_TYPE, VARY},
    },
    middleware::Next,
    response::Response,
};

use crate::page::{compressed, reads_compressed};

/// What is smaller than this travels as fast as it is.
const WORTH_IT: u64 = 2_048;

/// A document as a browser reads it; a stream, and what is small or not JSON, as it is.
pub(super) async fn over_a_slow_network(request: Request, next: Next) -> Response {
    let is_asked = reads_compressed(request.headers());
    let answer = next.run(request).await;
    let is_json = |kind: &HeaderValue| kind.as_bytes().starts_with(b"application/json");
    let is_document = answer.headers().get(CONTENT_TYPE).is_some_and(is_json);
    let size = answer.body().size_hint().exact().unwrap_or(0);
    if !is_asked || !is_document || size < WORTH_IT {
        return answer;
    }
    let (mut head, body) = answer.into_parts();
    // It is in memory already: its size is known.
    let Ok(body) = to_bytes(body, usize::MAX).await else {
        return Response::from_parts(head, Body::empty());
    };
    head.headers.remove(CONTENT_LENGTH);
    head.headers.insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    head.headers.insert(VARY, ACCEPT_ENCODING.into());
    Response::from_parts(head, Body::from(compressed(&body)))
}
