//! Whether the program lives, and whether its lines make progress: for supervisors that restart or alarm.

use axum::{Json, extract::State, http::StatusCode};
use schemars::JsonSchema;
use serde::Serialize;

use super::problem::Problem;
use drived_plant::plant::{Plant, commands::Rejected};

/// All is well.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(super) struct Health {
    status: &'static str,
}

pub(super) async fn lives() -> Json<Health> {
    Json(Health { status: "lives" })
}

pub(super) async fn ready(State(plant): State<Plant>) -> Result<Json<Health>, Problem> {
    if plant.is_closing() {
        return Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, Rejected::Closing.to_string()));
    }
    let standing = plant.standing_lines();
    if standing.is_empty() {
        return Ok(Json(Health { status: "ready" }));
    }
    let detail = format!("nothing is asked on {}", standing.join(", "));
    Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail))
}
