//! The HTTP API v1 over the plant.

use axum::{
    Extension, Json, Router,
    extract::{Path, State},
    http::StatusCode,
    response::{IntoResponse, Response},
    routing::get,
};

use crate::{doors::Caller, plant::Plant};

/// Everything under `/api/v1`.
pub(crate) fn router(plant: Plant) -> Router {
    Router::new()
        .route("/api/v1/state", get(state))
        .route("/api/v1/drives", get(drives))
        .route("/api/v1/drives/{name}", get(drive))
        .with_state(plant)
}

async fn state(State(plant): State<Plant>, Extension(caller): Extension<Caller>) -> Response {
    Json(plant.state(&caller)).into_response()
}

async fn drives(State(plant): State<Plant>) -> Response {
    Json(plant.drives()).into_response()
}

async fn drive(State(plant): State<Plant>, Path(name): Path<String>) -> Response {
    match plant.drive(&name) {
        Some(drive) => Json(drive).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

#[cfg(test)]
mod tests;
