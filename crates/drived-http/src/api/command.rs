//! Commands, and what is answered.

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
use drive_core::StopMode;
use tokio::time::Instant;

use super::{
    ask::{Arrived, By, Named, Sent, Stopping, StoppingWait, Viewer, Wait},
    problem::Problem,
    selected::{Selected, StoppingSelected},
};
use drived_doors::Caller;
use drived_plant::plant::{
    Plant,
    commands::{Action, Asks, LIFETIME, OutcomeWord, Request, Said, Target, age::age_of},
    views::CommandView,
};

/// A command to a drive.
pub(super) async fn to_drive<B: Asks>(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    Wait(wait): Wait,
    Named(name): Named,
    Sent(body): Sent<B>,
) -> Result<Response, Problem> {
    let request = request(&plant, &caller, Target::Drive(name), body, arrived)?;
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
    let request = request(&plant, &caller, Target::Group(name), body, arrived)?;
    carry_out(&plant, &caller, request, wait).await
}

/// A command to drives that somebody has selected.
pub(super) async fn to_selected<B: Asks>(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    Wait(wait): Wait,
    Sent(Selected { drives, body }): Sent<Selected<B>>,
) -> Result<Response, Problem> {
    let request = request(&plant, &caller, Target::Selected(drives), body, arrived)?;
    carry_out(&plant, &caller, request, wait).await
}

/// A stop of a drive.
pub(super) async fn stop_drive(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    StoppingWait(wait): StoppingWait,
    Named(name): Named,
    Stopping(said): Stopping,
) -> Result<Response, Problem> {
    carry_out(&plant, &caller, stop(Target::Drive(name), said, arrived), wait).await
}

/// A stop of a group.
pub(super) async fn stop_group(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    StoppingWait(wait): StoppingWait,
    Named(name): Named,
    Stopping(said): Stopping,
) -> Result<Response, Problem> {
    carry_out(&plant, &caller, stop(Target::Group(name), said, arrived), wait).await
}

/// A stop of drives that somebody has selected.
pub(super) async fn stop_selected(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    StoppingWait(wait): StoppingWait,
    StoppingSelected(drives, said): StoppingSelected,
) -> Result<Response, Problem> {
    carry_out(&plant, &caller, stop(Target::Selected(drives), said, arrived), wait).await
}

/// A stop of all drives.
pub(super) async fn stop_all(
    State(plant): State<Plant>,
    By(caller): By,
    Arrived(arrived): Arrived,
    StoppingWait(wait): StoppingWait,
    Stopping(said): Stopping,
) -> Result<Response, Problem> {
    carry_out(&plant, &caller, stop(Target::All, said, arrived), wait).await
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

/// The request of a body. One that says when it was issued may have been on its way for as long: its time counts from then.
fn request(
    plant: &Plant,
    caller: &Caller,
    target: Target,
    body: impl Asks,
    arrived: Instant,
) -> Result<Request, Problem> {
    let asked = body.asked();
    let issued = [asked.issued_unix_ms, None];
    let mut request = asked.of(target, arrived).map_err(Problem::unprocessable)?;
    let age = age_of(issued, arrived, request.lifetime.time(), plant.clock_set_back())
        .map_err(|rejected| Problem::rejected(&rejected, caller))?;
    request.arrived = arrived.checked_sub(age).unwrap_or(arrived);
    Ok(request)
}

fn stop(target: Target, said: Said, arrived: Instant) -> Request {
    let action = Action::Stop(said.stops().unwrap_or(StopMode::Ramp.into()));
    let expects = said.expects();
    Request { id: said.id, target, action, expects, lifetime: LIFETIME, arrived }
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
        OutcomeWord::Confirmed | OutcomeWord::Nothing => Ok((no_store, Json(command)).into_response()),
        OutcomeWord::Pending => {
            let location = [(LOCATION, format!("/api/v1/commands/{}", command.id))];
            Ok((StatusCode::ACCEPTED, no_store, location, Json(command)).into_response())
        }
        _ => Err(Problem::of_command(&command)),
    }
}
