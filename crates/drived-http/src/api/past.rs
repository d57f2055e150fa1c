//! What was: values, events and stories of the history, where one is kept.

use std::sync::Arc;

use axum::{
    extract::{Query, State, rejection::QueryRejection},
    http::StatusCode,
    response::Response,
};
use serde::{Deserialize, Serialize};
use tokio::{sync::Semaphore, task::spawn_blocking};

use super::{
    ask::{Named, Viewer},
    problem::Problem,
    read::fresh,
};
use drived_plant::plant::{
    Plant,
    past::{Past, PastError, RecordsAsked, ValuesAsked},
};

/// So many read the disk at once: more would hold up the others, and the machine.
static AT_ONCE: Semaphore = Semaphore::const_new(2);

/// Which values.
#[derive(Deserialize)]
pub(super) struct Values {
    value: String,
    from_unix_ms: i64,
    to_unix_ms: i64,
    every_ms: Option<i64>,
}

/// Which records.
#[derive(Deserialize)]
pub(super) struct Records {
    from_unix_ms: i64,
    to_unix_ms: i64,
    drive: Option<String>,
    kind: Option<String>,
    after: Option<i64>,
    limit: Option<usize>,
}

/// Which moment.
#[derive(Deserialize)]
pub(super) struct At {
    at_unix_ms: i64,
}

pub(super) async fn values(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
    query: Result<Query<Values>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Values { value, from_unix_ms, to_unix_ms, every_ms }) = query?;
    are_moments([from_unix_ms, to_unix_ms])?;
    if every_ms.is_some_and(|every| every < 1) {
        return Err(Problem::new(StatusCode::BAD_REQUEST, "every_ms: expected 1 or more"));
    }
    let asked = ValuesAsked { drive, value, from_unix_ms, to_unix_ms, every_ms };
    told(&plant, move |past| past.values(&asked)).await
}

pub(super) async fn records(
    State(plant): State<Plant>,
    _: Viewer,
    query: Result<Query<Records>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Records { from_unix_ms, to_unix_ms, drive, kind, after, limit }) = query?;
    are_moments([from_unix_ms, to_unix_ms])?;
    let after = after.unwrap_or_default();
    let asked = RecordsAsked { from_unix_ms, to_unix_ms, drive, kind, after, limit };
    told(&plant, move |past| past.records(&asked)).await
}

pub(super) async fn why(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
    query: Result<Query<At>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(At { at_unix_ms }) = query?;
    are_moments([at_unix_ms])?;
    told(&plant, move |past| past.story(&drive, at_unix_ms)).await
}

/// Refuses what is no moment of this calendar: behind it nobody has to think of what overflows. The bounds are those of ECMAScript.
fn are_moments<const N: usize>(all: [i64; N]) -> Result<(), Problem> {
    const FARTHEST: i64 = 8_640_000_000_000_000;
    match all.iter().find(|one| !(-FARTHEST..=FARTHEST).contains(*one)) {
        None => Ok(()),
        Some(one) => Err(Problem::new(StatusCode::BAD_REQUEST, format!("{one} is no time in milliseconds"))),
    }
}

/// Asks whoever keeps the past, on a thread that may wait for a disk.
async fn told<T: Serialize + Send + 'static>(
    plant: &Plant,
    ask: impl FnOnce(&dyn Past) -> Result<T, PastError> + Send + 'static,
) -> Result<Response, Problem> {
    let past: Arc<dyn Past> =
        plant.past().ok_or_else(|| Problem::not_found("no history is kept by this program"))?;
    let unreadable = |why: String| Problem::new(StatusCode::SERVICE_UNAVAILABLE, why);
    let place = AT_ONCE.acquire().await.map_err(|error| unreadable(error.to_string()))?;
    let answer = spawn_blocking(move || {
        // It is given up when it has been read, also where nobody waits for the answer any more.
        let _place = place;
        ask(&*past).map(|view| fresh(&view))
    });
    match answer.await.map_err(|error| unreadable(error.to_string()))? {
        Ok(answer) => Ok(answer),
        Err(error @ PastError::Asked(_)) => Err(Problem::new(StatusCode::BAD_REQUEST, error.to_string())),
        Err(error) => Err(unreadable(error.to_string())),
    }
}
