//! A capture of a line as a download that Wireshark opens.

use std::{convert::Infallible, io, time::Duration};

use axum::{
    body::{Body, Bytes},
    extract::{Query, State},
    http::{
        HeaderName, StatusCode,
        header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
};
use futures_util::stream;
use serde::Deserialize;
use tokio::{
    sync::mpsc,
    time::{Instant, timeout_at},
};

use super::{
    ask::{Named, Viewer},
    problem::Problem,
};
use drived_plant::plant::Plant;

/// How long a capture is unless it is said, and at the longest.
const SECONDS: u64 = 10;
const LONGEST: u64 = 600;
/// Pieces that wait for a slow reader; then frames are left out.
const WAITING: usize = 64;

#[derive(Deserialize)]
pub(super) struct Length {
    seconds: Option<u64>,
}

/// What the thread of a capture writes to.
struct Pieces(mpsc::Sender<Bytes>);

impl io::Write for Pieces {
    fn write(&mut self, piece: &[u8]) -> io::Result<usize> {
        // The head of the file is written where no thread may wait; there is room for it.
        let piece_or_none = match self.0.try_send(Bytes::copy_from_slice(piece)) {
            Ok(()) => None,
            Err(mpsc::error::TrySendError::Full(piece)) => Some(piece),
            Err(mpsc::error::TrySendError::Closed(_)) => return Err(io::ErrorKind::BrokenPipe.into()),
        };
        if let Some(piece) = piece_or_none {
            self.0.blocking_send(piece).map_err(|_| io::ErrorKind::BrokenPipe)?;
        }
        Ok(piece.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The frames of a line from now on. A capture that begins ends the one before it.
pub(super) async fn capture(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
    length: Result<Query<Length>, axum::extract::rejection::QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Length { seconds }) = length?;
    let seconds = seconds.unwrap_or(SECONDS);
    if !(1..=LONGEST).contains(&seconds) {
        let detail = format!("seconds={seconds}: expected 1 to {LONGEST}");
        return Err(Problem::new(StatusCode::BAD_REQUEST, detail));
    }
    let line = plant.fleet().lines().into_iter().find(|(known, _)| **known == *name);
    let (_, line) = line.ok_or_else(|| Problem::not_found(format!("there is no line {name:?}")))?;
    let (pieces, read) = mpsc::channel(WAITING);
    line.capture(Pieces(pieces))
        .map_err(|error| Problem::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string()))?;
    let until = Instant::now() + Duration::from_secs(seconds);
    let body = stream::unfold(read, move |mut read| async move {
        let piece = timeout_at(until, read.recv()).await.ok().flatten()?;
        Some((Ok::<Bytes, Infallible>(piece), read))
    });
    Ok((heads("line.pcapng"), Body::from_stream(body)).into_response())
}

/// What a browser is told of a capture: to keep it as a file of this name.
pub(super) fn heads(name: &str) -> [(HeaderName, String); 3] {
    [
        (CONTENT_TYPE, "application/x-pcapng".to_owned()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (CACHE_CONTROL, "no-store".to_owned()),
    ]
}
