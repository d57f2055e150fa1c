//! The event stream: server-sent events, resumed by their revision.

use std::{collections::VecDeque, convert::Infallible};

use axum::{
    body::{Body, Bytes},
    extract::{Query, State},
    http::{
        HeaderMap, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
};
use futures_util::stream;
use serde::Deserialize;

use super::{ask::Viewer, problem::Problem};
use drived_plant::plant::{
    Plant,
    revisions::{Next, Reader},
};

/// Told at the beginning, so that who waits for it knows that the stream is there; and how soon to come again.
const BEGIN: Bytes = Bytes::from_static(b"retry: 1000\n\n");

#[derive(Deserialize)]
pub(super) struct Since {
    since: Option<u64>,
}

pub(super) async fn events(
    State(plant): State<Plant>,
    _: Viewer,
    headers: HeaderMap,
    since: Result<Query<Since>, axum::extract::rejection::QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Since { since }) = since?;
    let last = match headers.get("last-event-id").map(|id| id.to_str().unwrap_or_default().parse()) {
        Some(Ok(last)) => Some(last),
        Some(Err(_)) => {
            return Err(Problem::new(StatusCode::BAD_REQUEST, "Last-Event-ID: expected a revision"));
        }
        // A browser that connects again says where it was; what the address says is older.
        None => since,
    };
    let told = Told { reader: plant.revisions().reader(last), plant, frames: [BEGIN].into(), is_over: false };
    let body = Body::from_stream(stream::unfold(told, Told::next));
    let headers = [(CONTENT_TYPE, "text/event-stream"), (CACHE_CONTROL, "no-store")];
    Ok((headers, body).into_response())
}

/// What is written at once to a reader: for each write of so many streams the doors ask the system.
const AT_ONCE: usize = 16 << 10;

/// The next frames, as many as are written at once.
fn together(frames: &mut VecDeque<Bytes>) -> Option<Bytes> {
    let first = frames.pop_front()?;
    if frames.front().is_none_or(|next| first.len() + next.len() > AT_ONCE) {
        return Some(first);
    }
    let mut all = Vec::from(first);
    while let Some(next) = frames.front().filter(|next| all.len() + next.len() <= AT_ONCE) {
        all.extend_from_slice(next);
        frames.pop_front();
    }
    Some(all.into())
}

/// How far one stream has come.
struct Told {
    plant: Plant,
    reader: Reader,
    /// What is to be sent, a little at a time: nothing is taken for a reader who does not read.
    frames: VecDeque<Bytes>,
    is_over: bool,
}

impl Told {
    async fn next(mut self) -> Option<(Result<Bytes, Infallible>, Self)> {
        loop {
            if let Some(frames) = together(&mut self.frames) {
                return Some((Ok(frames), self));
            }
            if self.is_over {
                return None;
            }
            match self.plant.revisions().next(&mut self.reader).await {
                Next::Frames(frames) => self.frames = frames.into(),
                Next::Reset(frame) => {
                    self.frames = [frame].into();
                    self.is_over = true;
                }
                Next::End => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_wait_are_written_together_in_their_order_as_far_as_they_go() {
        let large = Bytes::from(vec![b'x'; AT_ONCE]);
        let mut frames =
            VecDeque::from([Bytes::from("a"), "b".into(), "c".into(), large.clone(), "d".into()]);
        let all: Vec<_> = std::iter::from_fn(|| together(&mut frames)).collect();
        assert_eq!(all, [Bytes::from("abc"), large, "d".into()]);
    }
}
