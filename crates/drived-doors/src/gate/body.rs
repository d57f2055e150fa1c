//! How much of a request is read, and for how long it is waited for.

use std::{pin::pin, time::Duration};

use axum::{body::Bytes, http::StatusCode};
use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use tokio::time::{Instant, timeout, timeout_at};

use crate::refusal::Refusal;

/// The most that a request may say.
pub(super) const BODY: usize = 64 * 1024;
/// The most that whoever begins a session may say.
pub(super) const LOGIN_BODY: usize = 4 * 1024;
/// How long whoever has brought a right token may take to say it, and whoever has not.
pub(super) const BODY_WITHIN: Duration = Duration::from_secs(10);
pub(super) const BODY_OF_NOBODY_WITHIN: Duration = Duration::from_secs(1);
/// How long a stop may take to say how: whoever is cut off in the middle of it has asked for one.
pub(super) const STOP_WITHIN: Duration = Duration::from_millis(250);

/// The body of a request, as far as it may go.
pub(super) async fn read<B>(body: B, limit: usize, within: Duration) -> Result<Bytes, Refusal>
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
pub(super) async fn what_comes<B>(body: B, limit: usize, within: Duration) -> Bytes
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
