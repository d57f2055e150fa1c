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
/// For how long one that nobody has heard yet is listened to when others want its place.
const MOMENT: Duration = Duration::from_millis(500);
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
    // What has come is heard before anybody makes room.
    let makes_room = tokio::select! {
        biased;
        // Whatever it ended by is the far end's affair.
        _ = connection.as_mut() => return,
        () = place.wanted() => true,
        _ = end.wait_for(|ended| *ended) => false,
    };
    // On a busy machine nobody has said yet what has come: among a thousand who come at once a stop would be closed before it was read.
    if makes_room
        && place.heads() == 0
        && let Some(_moment) = place.moment()
        && timeout(MOMENT, connection.as_mut()).await.is_ok()
    {
        return;
    }
    connection.as_mut().graceful_shutdown();
    // Whoever has asked whole by now is answered; who has not makes room at once.
    if makes_room && (connection.as_mut().now_or_never().is_some() || !place.asks()) {
        return;
    }
    let _ = timeout(DRAINED_WITHIN, connection).await;
}

#[cfg(test)]
mod tests {
    use std::net::IpAddr;

    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _, duplex},
        task::yield_now,
        time::{Instant, sleep},
    };

    use super::*;
    use crate::crowd::{Crowd, Limits};

    /// What somebody is answered whose place is wanted before anybody has heard what he asks.
    async fn answer_beside_others(moments: usize) -> String {
        let crowd = Crowd::new(Limits { connections: 1, for_stops: 0, moments, ..Limits::HTTP });
        let enter = |number| crowd.enter(Some(IpAddr::from([10, 0, 0, number])), Instant::now());
        let (mut far, near) = duplex(4_096);
        let (_end, ended) = watch::channel(false);
        let answer = |_, asking: Asking| async move {
            asking.is_whole();
            Response::new(Body::empty())
        };
        let served = tokio::spawn(serve(near, enter(1).unwrap(), ended, answer));
        yield_now().await;
        let _other = enter(2).expect("who has asked nothing makes room");
        sleep(MOMENT / 4).await;
        let _ = far.write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n").await;
        let mut said = String::new();
        let _ = far.read_to_string(&mut said).await;
        served.await.unwrap();
        said
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_to_make_room_is_answered_where_what_he_asks_is_heard_a_moment_later() {
        let answered = answer_beside_others(1).await;
        assert!(answered.starts_with("HTTP/1.1 200"), "{answered}");
        assert_eq!(answer_beside_others(0).await, "", "not so many that they take all there is");
    }
}
