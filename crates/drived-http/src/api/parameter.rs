//! What is read from a drive on request, and the registers that are written: between its polls, when its turn comes.

use std::time::Duration;

use axum::{
    Json,
    extract::{Path, State},
    http::StatusCode,
    response::Response,
};
use drive_core::{Refusal, Row, registers::Storage};
use drive_fleet::{Act, DriveHandle, Order, Outcome, Refused, Snapshot};
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::time::{Instant, timeout};

use super::{
    ask::{By, Named, Patience, Sent, Viewer},
    problem::Problem,
    read::{fresh, no_drive},
};
use drived_plant::plant::{
    Plant,
    commands::{Expects, Rejected},
    parameters::{WrittenView, may_have_written},
};
use drived_words::registers::wanted;

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
    /// Write only if a status that is read from now on shows standstill.
    #[serde(default)]
    only_at_standstill: bool,
    /// What was shown of the drive: it is written so, or refused.
    expects: Option<Expects>,
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
    Sent(NewValue { value, save, only_at_standstill, expects }): Sent<NewValue>,
) -> Result<Json<WrittenView>, Problem> {
    let Path((name, register)) = path?;
    if !caller.rights.engineer {
        return Err(Problem::lacks_right(&caller, "change parameters"));
    }
    if !plant.may_command(&caller, &name) {
        return Err(Problem::out_of_scope(&caller, &name));
    }
    if let Some(expects) = &expects {
        let judged = plant.is_as_shown(expects, std::slice::from_ref(&name));
        judged.map_err(|otherwise| Problem::rejected(&Rejected::Otherwise(otherwise), &caller))?;
    }
    let drive = find(&plant, &name)?.commanded_by(Act::of(&caller.name).through(&caller.origin));
    let row = row(&drive, &register)?;
    let text = match value {
        Value::Number(number) => number.to_string(),
        Value::Text(text) => text,
    };
    let shown = answered(plant.in_units(&drive, row)).await?;
    let word = wanted(&shown, &text).map_err(|failure| Problem::unprocessable(failure.to_string()))?;
    if let Some(why) = answered(async { Ok(plant.forbids(&drive, &[(row, word)]).await) }).await? {
        return Err(Problem::unprocessable(why));
    }
    if only_at_standstill {
        standing(&drive).await?;
    }
    // Nobody who goes away leaves it half done.
    let writing = tokio::spawn(async move {
        let written = plant.write_parameter(&drive, row, word).await?;
        plant.tell_written(&caller, &drive, row, word, written.changed);
        if save && row.storage == Storage::RamUntilSaved {
            match drive.order(Order::Persist).await {
                Outcome::Refused(refused) => return Err(refused),
                outcome => return Ok((written, Some(outcome))),
            }
        }
        Ok((written, None))
    });
    let written = answered(async {
        match writing.await.unwrap_or(Err(Refused::ShutDown)) {
            // It was sent: to call that refused would be wrong.
            Err(Refused::Drive(error)) if may_have_written(&error) => Ok(Err(error)),
            written => written.map(Ok),
        }
    });
    let written = written.await?.map_err(|error| {
        Problem::new(StatusCode::GATEWAY_TIMEOUT, format!("{}: {error}: read it back", row.code))
    })?;
    match written {
        (written, None | Some(Outcome::Confirmed)) => Ok(Json(written)),
        (_, Some(outcome)) => {
            let detail = format!("{} is written, and not saved: {outcome}", row.code);
            Err(Problem::new(StatusCode::GATEWAY_TIMEOUT, detail))
        }
    }
}

/// Waits for a status of the drive that is read from now on, and refuses unless it shows standstill.
async fn standing(drive: &DriveHandle) -> Result<(), Problem> {
    let asked = Instant::now();
    let is_newer = |snapshot: &Snapshot| snapshot.status.as_ref().is_some_and(|status| status.at >= asked);
    let Ok(snapshot) = timeout(ANSWERED_WITHIN, drive.wait_until(is_newer)).await else {
        return Err(Problem::refused(&Refused::Stale));
    };
    match &snapshot.status {
        Some(status) if status.value.is_undriven() => Ok(()),
        _ => Err(Problem::refused(&Refused::Because(Refusal::MotorRunning))),
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
