//! Commands: their bodies, and what is answered.

use std::{sync::Arc, time::Duration};

use axum::{
    Json,
    extract::State,
    http::{
        StatusCode,
        header::{CACHE_CONTROL, LOCATION},
    },
    response::{IntoResponse, Response},
};
use drive_core::{Direction, Setpoint, StopMode};
use drive_fleet::Until;
use schemars::JsonSchema;
use serde::{Deserialize, de::DeserializeOwned};
use tokio::time::Instant;

use super::{
    ask::{Arrived, By, Named, Sent, Viewer, Wait},
    problem::Problem,
};
use crate::{
    doors::Caller,
    plant::{
        Plant,
        commands::{Action, LIFETIME, LONGEST_LIFETIME, OutcomeWord, Request, Target},
        views::CommandView,
    },
};

/// How long an id may be.
const LONGEST_ID: usize = 64;

/// A body that asks for something.
pub(super) trait Asks: DeserializeOwned + Send + 'static {
    fn asked(self) -> Asked;
}

/// What a body says: the caller's id, how long the command may wait until it is sent, and what is to be done.
pub(super) struct Asked {
    id: Option<String>,
    expires_in_ms: Option<u64>,
    action: Action,
}

/// Starts the motor.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Start {
    /// The caller's name of the command: one that comes again within ten minutes is answered, and not repeated.
    #[schemars(length(min = 1, max = LONGEST_ID))]
    id: Option<String>,
    /// After this time from its arrival it is not sent any more; 1000 unless it is said.
    #[schemars(range(min = 1, max = 10_000))]
    expires_in_ms: Option<u64>,
    /// `forward` unless it is said.
    direction: Option<Direction>,
    /// Given first; without it the motor starts at what the drive holds.
    setpoint: Option<Setpoint>,
    /// When it is confirmed; `in_force` unless it is said.
    until: Option<Until>,
}

/// Stops the motor. It never expires, and is carried out each time it arrives.
#[derive(Debug, Deserialize, JsonSchema)]
pub(super) struct Stop {
    /// The caller's name of the command, by which its outcome is found. It need not be new.
    #[schemars(length(min = 1, max = LONGEST_ID))]
    id: Option<String>,
    /// `ramp` unless it is said.
    mode: Option<StopMode>,
}

/// Changes the setpoint.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NewSetpoint {
    /// The caller's name of the command: one that comes again within ten minutes is answered, and not repeated.
    #[schemars(length(min = 1, max = LONGEST_ID))]
    id: Option<String>,
    /// After this time from its arrival it is not sent any more; 1000 unless it is said.
    #[schemars(range(min = 1, max = 10_000))]
    expires_in_ms: Option<u64>,
    setpoint: Setpoint,
    /// When it is confirmed; `in_force` unless it is said.
    until: Option<Until>,
}

/// A command that has nothing to say about itself.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Plain {
    /// The caller's name of the command: one that comes again within ten minutes is answered, and not repeated.
    #[schemars(length(min = 1, max = LONGEST_ID))]
    id: Option<String>,
    /// After this time from its arrival it is not sent any more; 1000 unless it is said.
    #[schemars(range(min = 1, max = 10_000))]
    expires_in_ms: Option<u64>,
}

/// Resets the present fault, once.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct Reset(Plain);

/// Saves the parameters to EEPROM.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct Save(Plain);

/// Gives control back to the panel or the terminals.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct Release(Plain);

impl Asks for Start {
    fn asked(self) -> Asked {
        let Self { id, expires_in_ms, direction, setpoint, until } = self;
        let (direction, until) = (direction.unwrap_or(Direction::Forward), until.unwrap_or_default());
        Asked { id, expires_in_ms, action: Action::Start { direction, setpoint, until } }
    }
}

impl Asks for Stop {
    fn asked(self) -> Asked {
        let action = Action::Stop(self.mode.unwrap_or(StopMode::Ramp));
        Asked { id: self.id, expires_in_ms: None, action }
    }
}

impl Asks for NewSetpoint {
    fn asked(self) -> Asked {
        let Self { id, expires_in_ms, setpoint, until } = self;
        Asked { id, expires_in_ms, action: Action::Setpoint { setpoint, until: until.unwrap_or_default() } }
    }
}

impl Asks for Reset {
    fn asked(self) -> Asked {
        self.0.asked_to(Action::Reset)
    }
}

impl Asks for Release {
    fn asked(self) -> Asked {
        self.0.asked_to(Action::Release)
    }
}

impl Asks for Save {
    fn asked(self) -> Asked {
        self.0.asked_to(Action::Save)
    }
}

impl Plain {
    fn asked_to(self, action: Action) -> Asked {
        Asked { id: self.id, expires_in_ms: self.expires_in_ms, action }
    }
}

/// A command to a drive.
pub(super) async fn to_drive<B: Asks>(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    Wait(wait): Wait,
    Named(name): Named,
    Sent(body): Sent<B>,
) -> Result<Response, Problem> {
    let request = request(Target::Drive(name), body, arrived)?;
    carry_out(&plant, &caller, request, wait).await
}

/// A command to a group.
pub(super) async fn to_group<B: Asks>(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    Wait(wait): Wait,
    Named(name): Named,
    Sent(body): Sent<B>,
) -> Result<Response, Problem> {
    let request = request(Target::Group(name), body, arrived)?;
    carry_out(&plant, &caller, request, wait).await
}

/// A stop of all drives.
pub(super) async fn stop_all(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    Wait(wait): Wait,
    Sent(body): Sent<Stop>,
) -> Result<Response, Problem> {
    let request = request(Target::All, body, arrived)?;
    carry_out(&plant, &caller, request, wait).await
}

/// What became of a command.
pub(super) async fn command(
    State(plant): State<Plant>,
    Viewer(_): Viewer,
    Wait(wait): Wait,
    Named(id): Named,
) -> Result<Json<Arc<CommandView>>, Problem> {
    let command = plant.command_of(&id, wait).await;
    command.map(Json).ok_or_else(|| Problem::not_found(format!("there is no command {id:?} any more")))
}

fn request(target: Target, body: impl Asks, arrived: Instant) -> Result<Request, Problem> {
    let Asked { id, expires_in_ms, action } = body.asked();
    if let Some(id) = &id
        && (id.is_empty() || id.len() > LONGEST_ID || !id.bytes().all(|byte| byte.is_ascii_graphic()))
    {
        let detail = format!("id: expected 1 to {LONGEST_ID} printable ASCII characters without spaces");
        return Err(Problem::unprocessable(detail));
    }
    let lifetime = expires_in_ms.map_or(LIFETIME, Duration::from_millis);
    if lifetime.is_zero() || lifetime > LONGEST_LIFETIME {
        let detail = format!("expires_in_ms: expected 1 to {}", LONGEST_LIFETIME.as_millis());
        return Err(Problem::unprocessable(detail));
    }
    Ok(Request { id, target, action, lifetime, arrived })
}

async fn carry_out(
    plant: &Plant,
    caller: &Caller,
    request: Request,
    wait: Duration,
) -> Result<Response, Problem> {
    let command = plant.command(caller, request, wait).await;
    let command = command.map_err(|rejected| Problem::rejected(&rejected, caller))?;
    let no_store = [(CACHE_CONTROL, "no-store")];
    match command.outcome {
        OutcomeWord::Confirmed => Ok((no_store, Json(command)).into_response()),
        OutcomeWord::Pending => {
            let location = [(LOCATION, format!("/api/v1/commands/{}", command.id))];
            Ok((StatusCode::ACCEPTED, no_store, location, Json(command)).into_response())
        }
        _ => Err(Problem::of_command(&command)),
    }
}
