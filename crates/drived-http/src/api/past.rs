//! What was: values, events and stories of the history, where one is kept.

use std::sync::Arc;

use axum::{
    extract::{Query, State, rejection::QueryRejection},
    http::StatusCode,
    response::{IntoResponse as _, Response},
};
use serde::{Deserialize, Serialize};
use tokio::{sync::Semaphore, task::spawn_blocking};

use super::{
    ask::{Named, Viewer},
    capture,
    problem::Problem,
    read::{fresh, no_drive},
};
use drived_plant::plant::{
    Plant,
    past::{CurvesAsked, DaysAsked, GivenUp, Past, PastError, RecordsAsked, ValuesAsked},
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
    line: Option<String>,
    kind: Option<String>,
    what: Option<String>,
    #[serde(default)]
    only_alarms: bool,
    after: Option<i64>,
    before: Option<i64>,
    limit: Option<usize>,
}

/// Between which moments.
#[derive(Deserialize)]
pub(super) struct Between {
    from_unix_ms: i64,
    to_unix_ms: i64,
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
    let asked = ValuesAsked { drive: drive.clone(), value, from_unix_ms, to_unix_ms, every_ms };
    told_of(&plant, drive, move |past, _, given_up| past.values(&asked, given_up)).await
}

/// What stands in a question in which a key may come more than once.
struct Keys(Vec<(String, String)>);

impl Keys {
    fn all(&self, key: &str) -> Vec<String> {
        self.0.iter().filter(|(name, _)| name == key).map(|(_, value)| value.clone()).collect()
    }

    fn moment(&self, key: &str) -> Result<i64, Problem> {
        let said = self.0.iter().find(|(name, _)| name == key);
        let expected = || Problem::new(StatusCode::BAD_REQUEST, format!("{key}: expected milliseconds"));
        let number = said.and_then(|(_, value)| value.parse().ok()).ok_or_else(expected)?;
        are_moments([number]).map(|()| number)
    }
}

/// A question whose keys may come more than once.
type Many = Result<Query<Vec<(String, String)>>, QueryRejection>;

pub(super) async fn curves(State(plant): State<Plant>, _: Viewer, query: Many) -> Result<Response, Problem> {
    let keys = Keys(query?.0);
    let asked = CurvesAsked {
        drives: keys.all("drive"),
        values: keys.all("value"),
        from_unix_ms: keys.moment("from_unix_ms")?,
        to_unix_ms: keys.moment("to_unix_ms")?,
        every_ms: keys.moment("every_ms")?,
    };
    told(&plant, move |past, given_up| past.curves(&asked, given_up)).await
}

pub(super) async fn days(State(plant): State<Plant>, _: Viewer, query: Many) -> Result<Response, Problem> {
    let keys = Keys(query?.0);
    let asked = DaysAsked {
        drives: keys.all("drive"),
        from_unix_ms: keys.moment("from_unix_ms")?,
        to_unix_ms: keys.moment("to_unix_ms")?,
    };
    told(&plant, move |past, given_up| past.days(&asked, given_up)).await
}

pub(super) async fn about(State(plant): State<Plant>, _: Viewer) -> Result<Response, Problem> {
    told(&plant, |past, _| past.about()).await
}

pub(super) async fn moment(
    State(plant): State<Plant>,
    _: Viewer,
    query: Result<Query<At>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(At { at_unix_ms }) = query?;
    are_moments([at_unix_ms])?;
    told(&plant, move |past, given_up| past.moment(at_unix_ms, given_up)).await
}

pub(super) async fn lines(
    State(plant): State<Plant>,
    _: Viewer,
    query: Result<Query<Between>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Between { from_unix_ms, to_unix_ms }) = query?;
    are_moments([from_unix_ms, to_unix_ms])?;
    told(&plant, move |past, _| past.lines(from_unix_ms, to_unix_ms)).await
}

pub(super) async fn frames(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
    query: Result<Query<Between>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Between { from_unix_ms, to_unix_ms }) = query?;
    are_moments([from_unix_ms, to_unix_ms])?;
    told_of(&plant, drive, move |past, drive, _| past.frames(drive, from_unix_ms, to_unix_ms)).await
}

pub(super) async fn capture_of_frame(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
    query: Result<Query<At>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(At { at_unix_ms }) = query?;
    are_moments([at_unix_ms])?;
    let ask = of(&plant, drive, move |past, drive, _| past.capture(drive, at_unix_ms));
    told_as(&plant, ask, |file| (capture::heads("trip.pcapng"), file).into_response()).await
}

pub(super) async fn parameters(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
) -> Result<Response, Problem> {
    told_of(&plant, drive, |past, drive, _| past.parameters(drive)).await
}

pub(super) async fn records(
    State(plant): State<Plant>,
    _: Viewer,
    query: Result<Query<Records>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(Records {
        from_unix_ms,
        to_unix_ms,
        drive,
        line,
        kind,
        what,
        only_alarms,
        after,
        before,
        limit,
    }) = query?;
    are_moments([from_unix_ms, to_unix_ms])?;
    let after = after.unwrap_or_default();
    let asked =
        RecordsAsked { from_unix_ms, to_unix_ms, drive, line, kind, what, only_alarms, after, before, limit };
    told(&plant, move |past, _| past.records(&asked)).await
}

pub(super) async fn why(
    State(plant): State<Plant>,
    _: Viewer,
    Named(drive): Named,
    query: Result<Query<At>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(At { at_unix_ms }) = query?;
    are_moments([at_unix_ms])?;
    told_of(&plant, drive, move |past, drive, _| past.story(drive, at_unix_ms)).await
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
async fn told<T: Serialize + 'static>(
    plant: &Plant,
    ask: impl FnOnce(&dyn Past, &GivenUp) -> Result<T, PastError> + Send + 'static,
) -> Result<Response, Problem> {
    told_as(plant, ask, |view| fresh(&view)).await
}

/// The same of a drive: one that is there, or one that was and of which something is kept.
async fn told_of<T: Serialize + 'static>(
    plant: &Plant,
    drive: String,
    ask: impl FnOnce(&dyn Past, &str, &GivenUp) -> Result<T, PastError> + Send + 'static,
) -> Result<Response, Problem> {
    told(plant, of(plant, drive, ask)).await
}

fn of<T, F: FnOnce(&dyn Past, &str, &GivenUp) -> Result<T, PastError>>(
    plant: &Plant,
    drive: String,
    ask: F,
) -> impl FnOnce(&dyn Past, &GivenUp) -> Result<T, PastError> + use<T, F> {
    let is_there = plant.fleet().drive(&drive).is_some();
    move |past, given_up| match is_there || past.knows(&drive)? {
        true => ask(past, &drive, given_up),
        false => Err(PastError::NoDrive(drive)),
    }
}

/// The same in a form of its own.
async fn told_as<T: 'static>(
    plant: &Plant,
    ask: impl FnOnce(&dyn Past, &GivenUp) -> Result<T, PastError> + Send + 'static,
    form: impl FnOnce(T) -> Response + Send + 'static,
) -> Result<Response, Problem> {
    let past: Arc<dyn Past> =
        plant.past().ok_or_else(|| Problem::not_found("no history is kept by this program"))?;
    let unreadable = |why: String| Problem::new(StatusCode::SERVICE_UNAVAILABLE, why);
    let place = AT_ONCE.acquire().await.map_err(|error| unreadable(error.to_string()))?;
    // Whoever goes does not wait any more: what is read for him ends.
    let waits = Waits(GivenUp::default());
    let given_up = waits.0.clone();
    let answer = spawn_blocking(move || {
        let _place = place;
        ask(&*past, &given_up).map(form)
    });
    match answer.await.map_err(|error| unreadable(error.to_string()))? {
        Ok(answer) => Ok(answer),
        Err(PastError::NoDrive(name)) => Err(no_drive(&name)),
        Err(error @ PastError::Asked(_)) => Err(Problem::new(StatusCode::BAD_REQUEST, error.to_string())),
        Err(error) => Err(unreadable(error.to_string())),
    }
}

/// Gives up with whoever waits.
struct Waits(GivenUp);

impl Drop for Waits {
    fn drop(&mut self) {
        self.0.give_up();
    }
}
