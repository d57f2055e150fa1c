//! What only a demonstration has: trips and cables by hand.

use std::collections::BTreeMap;

use axum::{Extension, extract::State, http::StatusCode};
use drive_sim::{SimLine, SimSlave};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    ask::{By, Sent},
    problem::Problem,
    read::no_drive,
};
use drived_plant::plant::Plant;

/// The simulated machines of a demonstration: each with the code of a trip, and its lines.
#[derive(Clone, Default)]
pub struct Stage {
    pub machines: BTreeMap<String, (SimSlave, u16)>,
    pub lines: BTreeMap<String, SimLine>,
}

/// Trips a drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Trip {
    drive: String,
}

/// Pulls the cable of a line, or plugs it in again.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Cable {
    line: String,
    connected: bool,
}

pub(super) async fn trip(
    State(plant): State<Plant>,
    By(caller): By,
    Extension(stage): Extension<Stage>,
    Sent(Trip { drive }): Sent<Trip>,
) -> Result<StatusCode, Problem> {
    if !caller.rights.operate {
        return Err(Problem::lacks_right(&caller, "operate"));
    }
    if !plant.may_command(&caller, &drive) {
        return Err(Problem::out_of_scope(&caller, &drive));
    }
    let (machine, code) = stage.machines.get(&drive).ok_or_else(|| no_drive(&drive))?;
    machine.trip(*code);
    Ok(StatusCode::NO_CONTENT)
}

pub(super) async fn cable(
    State(_): State<Plant>,
    By(caller): By,
    Extension(stage): Extension<Stage>,
    Sent(Cable { line, connected }): Sent<Cable>,
) -> Result<StatusCode, Problem> {
    if !caller.rights.operate || caller.scope.is_some() {
        return Err(Problem::lacks_right(&caller, "operate"));
    }
    let found = stage.lines.get(&line);
    let cable = found.ok_or_else(|| Problem::not_found(format!("there is no line {line:?}")))?;
    if connected {
        cable.join();
    } else {
        cable.cut();
    }
    Ok(StatusCode::NO_CONTENT)
}
