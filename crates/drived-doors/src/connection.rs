//! One connection: HTTP/1.1, with a limit to everything that the far end can make last.

use std::{convert::Infallible, pin::pin, sync::Arc, time::Duration};

use axum::{body::Body, http::Request, response::Response};
use futures_util::FutureExt as _;
use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    sync::watch,
    time::timeout,
};

use super::{
    crowd::{Asking, Place},
    patient::Patient,
};

/// How long a connection may ask for nothing.
const HEAD_WITHIN: Duration = Duration::from_secs(5);
/// The most that the head of a request may be.
const HEAD: usize = 16 * 1024;
const HEADERS: usize = 64;
/// How long what was asked before the end has to be answered.
pub(super) const DRAINED_WITHIN: Duration = Duration::from_secs(2);

/// Serves a connection until it ends, its place is wanted by somebody else, or the server ends.
pub(super) async fn serve<S, F>(
    stream: S,
    place: Place,
    mut end: watch::Receiver<bool>,
    answer: impl Fn(Request<Incoming>, Asking) -> F,
) where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    F: Future<Output = Response<Body>>,
{
    let place = Arc::new(place);
    let asked = Arc::clone(&place);
    let service = service_fn(move |request| {
        let answer = answer(request, asked.ask());
        async move { Ok::<_, Infallible>(answer.await) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        // Who says no more has asked all the same, and a stop among it is carried out and answered.
        .half_close(true)
        .header_read_timeout(HEAD_WITHIN)
        .max_headers(HEADERS)
        .max_buf_size(HEAD)
        .serve_connection(TokioIo::new(Patient::new(stream, Arc::clone(&place))), service);
    let mut connection = pin!(connection);
    let makes_room = tokio::select! {
        // Whatever it ended by is the far end's affair.
        _ = connection.as_mut() => return,
        () = place.wanted() => true,
        _ = end.wait_for(|ended| *ended) => false,
    };
    connection.as_mut().graceful_shutdown();
    // Whoever has asked whole by now is answered; who has not makes room at once.
    if makes_room && (connection.as_mut().now_or_never().is_some() || !place.asks()) {
        return;
    }
    let _ = timeout(DRAINED_WITHIN, connection).await;
}
