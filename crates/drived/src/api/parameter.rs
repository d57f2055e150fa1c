//! What is read from a drive on request, and the registers that are written: between its polls, when its turn comes.

use std::time::Duration;

use axum::{
    Json,
    extract::{Path, State},
    http::StatusCode,
    response::Response,
};
use drive_core::{Row, registers::Storage};
use drive_fleet::{DriveHandle, Order, Outcome, Refused};
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::time::timeout;

use super::{
    ask::{By, Named, Patience, Sent, Viewer},
    problem::Problem,
    read::{fresh, no_drive},
};
use crate::{
    commands::param::wanted,
    plant::{Plant, parameters::WrittenView},
};

/// How long one answer of a drive is waited for.
const ANSWERED_WITHIN: Duration = Duration::from_secs(10);

/// A value for a register.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NewValue {
    value: Value,
    /// Then save the drive's parameters to its EEPROM, where this one is only kept in RAM.
    #[serde(default)]
    save: bool,
}

/// In its unit, as a hexadecimal word such as `0627h`, or the mnemonic of a listed value.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Value {
    Number(f64),
    Text(String),
}

pub(super) async fn faults(
    State(plant): State<Plant>,
    _: Viewer,
    Named(name): Named,
) -> Result<Response, Problem> {
    let drive = find(&plant, &name)?;
    Ok(fresh(&answered(drive.faults()).await?))
}

pub(super) async fn parameters(
    State(plant): State<Plant>,
    _: Viewer,
    Patience(wait): Patience,
    Named(name): Named,
) -> Result<Response, Problem> {
    let drive = find(&plant, &name)?;
    Ok(fresh(&plant.parameters(&drive, wait).await))
}

pub(super) async fn parameter(
    State(plant): State<Plant>,
    _: Viewer,
    path: Result<Path<(String, String)>, axum::extract::rejection::PathRejection>,
) -> Result<Response, Problem> {
    let Path((name, register)) = path?;
    let drive = find(&plant, &name)?;
    let row = row(&drive, &register)?;
    Ok(fresh(&answered(plant.parameter(&drive, row)).await?))
}

pub(super) async fn write(
    State(plant): State<Plant>,
    By(caller): By,
    path: Result<Path<(String, String)>, axum::extract::rejection::PathRejection>,
    Sent(NewValue { value, save }): Sent<NewValue>,
) -> Result<Json<WrittenView>, Problem> {
    let Path((name, register)) = path?;
    if !caller.rights.engineer {
        return Err(Problem::lacks_right(&caller, "change parameters"));
    }
    let drive = find(&plant, &name)?.commanded_by(&caller.name);
    let row = row(&drive, &register)?;
    let text = match value {
        Value::Number(number) => number.to_string(),
        Value::Text(text) => text,
    };
    let word = wanted(row, &text).map_err(|failure| Problem::unprocessable(failure.to_string()))?;
    // Nobody who goes away leaves it half done.
    let writing = tokio::spawn(async move {
        let written = plant.write_parameter(&drive, row, word).await?;
        if save && row.storage == Storage::RamUntilSaved {
            match drive.order(Order::Persist).await {
                Outcome::Refused(refused) => return Err(refused),
                outcome => return Ok((written, Some(outcome))),
            }
        }
        Ok((written, None))
    });
    match answered(async { writing.await.unwrap_or(Err(Refused::ShutDown)) }).await? {
        (written, None | Some(Outcome::Confirmed)) => Ok(Json(written)),
        (_, Some(outcome)) => {
            let detail = format!("{} is written, and not saved: {outcome}", row.code);
            Err(Problem::new(StatusCode::GATEWAY_TIMEOUT, detail))
        }
    }
}

fn find(plant: &Plant, name: &str) -> Result<DriveHandle, Problem> {
    plant.fleet().drive(name).ok_or_else(|| no_drive(name))
}

fn row(drive: &DriveHandle, register: &str) -> Result<&'static Row, Problem> {
    let capabilities = drive.capabilities();
    Row::find(capabilities.rows, register)
        .ok_or_else(|| Problem::not_found(format!("a {} has no register {register:?}", capabilities.name)))
}

async fn answered<T>(asked: impl Future<Output = Result<T, Refused>>) -> Result<T, Problem> {
    match timeout(ANSWERED_WITHIN, asked).await {
        Ok(told) => told.map_err(|refused| Problem::refused(&refused)),
        Err(_) => {
            let detail = format!("the drive had no turn to answer in {ANSWERED_WITHIN:?}");
            Err(Problem::new(StatusCode::GATEWAY_TIMEOUT, detail))
        }
    }
}
