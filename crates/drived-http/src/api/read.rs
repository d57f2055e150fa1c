//! What is read.

use axum::{
    Json,
    extract::{Query, State, rejection::QueryRejection},
    http::{HeaderValue, header::CACHE_CONTROL},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};

use super::{
    ask::{Named, Viewer},
    problem::Problem,
};
use drived_plant::plant::Plant;

pub(super) async fn state(State(plant): State<Plant>, Viewer(caller): Viewer) -> Response {
    fresh(&plant.state(&caller))
}

pub(super) async fn drives(State(plant): State<Plant>, _: Viewer) -> Response {
    fresh(&plant.drives())
}

pub(super) async fn drive(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
) -> Result<Response, Problem> {
    plant.drive(&name).map(|drive| fresh(&drive)).ok_or_else(|| no_drive(&name))
}

pub(super) async fn settings(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
) -> Result<Response, Problem> {
    plant.settings(&name).map(|settings| fresh(&settings)).ok_or_else(|| no_drive(&name))
}

#[derive(Deserialize)]
pub(super) struct SinceTime {
    since_unix_ms: Option<u64>,
}

pub(super) async fn history(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
    since: Result<Query<SinceTime>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(SinceTime { since_unix_ms }) = since?;
    plant.history(&name, since_unix_ms).map(|history| fresh(&history)).ok_or_else(|| no_drive(&name))
}

pub(super) async fn curves(State(plant): State<Plant>, _: Viewer) -> Response {
    fresh(&plant.curves())
}

pub(super) async fn lines(State(plant): State<Plant>, _: Viewer) -> Response {
    fresh(&plant.lines())
}

pub(super) async fn line(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
) -> Result<Response, Problem> {
    plant
        .line(&name)
        .map(|line| fresh(&line))
        .ok_or_else(|| Problem::not_found(format!("there is no line {name:?}")))
}

pub(super) async fn recent(State(plant): State<Plant>, _: Viewer) -> Response {
    fresh(&plant.recent())
}

pub(super) fn no_drive(name: &str) -> Problem {
    Problem::not_found(format!("there is no drive {name:?}"))
}

/// An answer that nobody keeps: it is old as soon as it is read.
pub(super) fn fresh(value: &impl Serialize) -> Response {
    let mut response = Json(value).into_response();
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}
