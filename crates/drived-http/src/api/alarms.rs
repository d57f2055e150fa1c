//! The alarms, and what is done about them.

use std::time::Duration;

use axum::{extract::State, http::StatusCode, response::Response};
use drive_fleet::alarms::AlarmRefused;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    ask::{By, Named, Sent, Viewer},
    problem::Problem,
    read::fresh,
};
use drived_doors::Caller;
use drived_plant::plant::{
    Plant,
    alarms::{AlarmAct, AlarmRejected},
};

/// Somebody has taken note of an alarm.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Acknowledge {
    /// What is to be remembered of it, 500 characters at most.
    note: Option<String>,
    /// How often it had come when it was seen: it is not acknowledged where it has come again since.
    count: Option<u32>,
}

/// An alarm is put aside for a time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Shelve {
    /// For how long: 1 to 1440.
    minutes: u32,
    /// Why, 500 characters at most.
    why: String,
}

/// What an alarm of maintenance asks for was done.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Done {
    /// What is to be remembered of it, 500 characters at most.
    note: Option<String>,
}

/// Nothing besides.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Unshelve {}

pub(super) async fn alarms(State(plant): State<Plant>, _: Viewer) -> Response {
    fresh(&plant.alarms())
}

pub(super) async fn acknowledge(
    State(plant): State<Plant>,
    By(caller): By,
    Named(id): Named,
    Sent(Acknowledge { note, count }): Sent<Acknowledge>,
) -> Result<Response, Problem> {
    act(&plant, &caller, &id, &AlarmAct::Acknowledge { note, count })
}

pub(super) async fn shelve(
    State(plant): State<Plant>,
    By(caller): By,
    Named(id): Named,
    Sent(Shelve { minutes, why }): Sent<Shelve>,
) -> Result<Response, Problem> {
    let time = Duration::from_secs(u64::from(minutes) * 60);
    act(&plant, &caller, &id, &AlarmAct::Shelve { time, why })
}

pub(super) async fn unshelve(
    State(plant): State<Plant>,
    By(caller): By,
    Named(id): Named,
    Sent(Unshelve {}): Sent<Unshelve>,
) -> Result<Response, Problem> {
    act(&plant, &caller, &id, &AlarmAct::Unshelve)
}

pub(super) async fn done(
    State(plant): State<Plant>,
    By(caller): By,
    Named(id): Named,
    Sent(Done { note }): Sent<Done>,
) -> Result<Response, Problem> {
    act(&plant, &caller, &id, &AlarmAct::Done { note })
}

fn act(plant: &Plant, caller: &Caller, id: &str, act: &AlarmAct) -> Result<Response, Problem> {
    let done = plant.act_on_alarm(caller, number(id)?, act);
    done.map(|alarm| fresh(&alarm)).map_err(|rejected| problem(caller, &rejected))
}

fn problem(caller: &Caller, rejected: &AlarmRejected) -> Problem {
    let detail = rejected.to_string();
    match rejected {
        AlarmRejected::NoRight(_) => Problem::lacks_right(caller, "operate"),
        AlarmRejected::OutOfScope { of, .. } => Problem::out_of_scope(caller, of),
        AlarmRejected::Refused(AlarmRefused::NoSuchAlarm(_)) => Problem::not_found(detail),
        AlarmRejected::CameAgain | AlarmRejected::Refused(AlarmRefused::OfMotion) => {
            Problem::refused_as(rejected.reason(), detail)
        }
        AlarmRejected::NotKept => Problem::not_found(detail),
        AlarmRejected::NoMaintenance | AlarmRejected::Refused(_) => {
            Problem::new(StatusCode::UNPROCESSABLE_ENTITY, detail)
        }
    }
}

fn number(id: &str) -> Result<u64, Problem> {
    id.parse().map_err(|_| Problem::not_found(format!("there is no alarm {id:?}, or it is over")))
}
