//! A web service with two drives in it: what is known of them as JSON, what happens to them as an event stream, and the
//! commands. The types of the library are the answers: there is no type of this program's own for any of them.
//!
//! ```console
//! $ cargo run -p examples --example http_service                 # simulated; Ctrl-C stops the motors
//! $ cargo run -p examples --example http_service /dev/ttyUSB0    # Altivar 312 at 1 and 2, 19200 8E1
//! $ curl localhost:8080/drives/1
//! $ curl -X POST localhost:8080/drives/1/run -H 'Content-Type: application/json' -d '{"frequency_hz": 30.5}'
//! $ curl -X POST localhost:8080/drives/1/stop
//! $ curl -N localhost:8080/events
//! ```
//!
//! Whoever reaches the port may command. `drived` is the program for a plant: it has rights, an audit log and a page.

use std::{convert::Infallible, error::Error, sync::Arc};

use axum::{
    Json, Router,
    extract::{Path, State},
    http::StatusCode,
    response::sse::{Event, Sse},
    routing::{get, post},
};
use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, SerialSettings, Setpoint, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, Fleet, Outcome, Received, Snapshot};
use drive_sim::{SimLine, Wiring, models};
use futures_util::{Stream, StreamExt as _};
use tokio::{net::TcpListener, time::Duration};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let line = match std::env::args().nth(1) {
        Some(path) => Line::open(LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT)).await?,
        None => simulated()?.1,
    };
    let fleet = fleet(&line)?;
    let listener = TcpListener::bind("127.0.0.1:8080").await?;
    println!("http://{}/drives", listener.local_addr()?);
    tokio::select! {
        served = axum::serve(listener, service(fleet.clone())).into_future() => served?,
        _ = tokio::signal::ctrl_c() => {}
    }
    for (drive, action) in fleet.shutdown(Duration::from_secs(30)).await {
        println!("{drive}: {action}");
    }
    Ok(())
}

/// The drives, named by their addresses.
fn fleet(line: &Line) -> Result<Fleet, drive_fleet::FleetError> {
    let mut fleet = Fleet::builder().line("line", line.clone());
    for address in [1, 2] {
        let settings = DriveSettings::controlled(address.to_string());
        fleet = fleet.drive("line", address, settings, |port, slave| Box::new(Atv312::new(port, slave)));
    }
    fleet.start()
}

fn service(fleet: Fleet) -> Router {
    Router::new()
        .route("/drives", get(drives))
        .route("/drives/{name}", get(drive))
        .route("/drives/{name}/run", post(run))
        .route("/drives/{name}/stop", post(stop))
        .route("/events", get(events))
        .with_state(fleet)
}

async fn drives(State(fleet): State<Fleet>) -> Json<Vec<Arc<Snapshot>>> {
    Json(fleet.drives().iter().map(DriveHandle::snapshot).collect())
}

async fn drive(
    State(fleet): State<Fleet>,
    Path(name): Path<String>,
) -> Result<Json<Arc<Snapshot>>, StatusCode> {
    Ok(Json(find(&fleet, &name)?.snapshot()))
}

/// Forward at a setpoint. A client that goes away before the answer takes its start back; a stop goes on whoever goes away.
async fn run(
    State(fleet): State<Fleet>,
    Path(name): Path<String>,
    Json(setpoint): Json<Setpoint>,
) -> Result<(StatusCode, Json<Outcome>), StatusCode> {
    Ok(answer(find(&fleet, &name)?.start_at(Direction::Forward, setpoint).await))
}

async fn stop(
    State(fleet): State<Fleet>,
    Path(name): Path<String>,
) -> Result<(StatusCode, Json<Outcome>), StatusCode> {
    Ok(answer(find(&fleet, &name)?.stop(StopMode::Ramp).await))
}

async fn events(State(fleet): State<Fleet>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    Sse::new(fleet.events().map(|received| {
        Ok(match received {
            Received::Event(event) => Event::default().json_data(&event).unwrap_or_default(),
            Received::Missed(events) => Event::default().event("missed").data(events.to_string()),
            Received::End => Event::default().event("end"),
        })
    }))
}

fn find(fleet: &Fleet, name: &str) -> Result<DriveHandle, StatusCode> {
    fleet.drive(name).ok_or(StatusCode::NOT_FOUND)
}

/// Only what the drive's own words show is a success.
fn answer(outcome: Outcome) -> (StatusCode, Json<Outcome>) {
    let code = match &outcome {
        Outcome::Confirmed | Outcome::Started(_) | Outcome::Stopped(_) => StatusCode::OK,
        Outcome::Refused(_) | Outcome::Expired => StatusCode::CONFLICT,
        _ => StatusCode::GATEWAY_TIMEOUT,
    };
    (code, Json(outcome))
}

fn simulated() -> Result<(SimLine, Line), Box<dyn Error>> {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    for address in [1, 2] {
        simulated.add(address, models::atv312::Atv312::under_bus_control())?;
    }
    let line = Line::over(simulated.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    Ok((simulated, line))
}

/// A service is tested without a port and without waiting: under tokio's paused clock a ramp of seconds takes none.
#[cfg(test)]
mod tests {
    use axum::{
        body::{Body, to_bytes},
        http::Request,
    };
    use serde_json::{Value, json};
    use tokio::time::Instant;
    use tower::ServiceExt as _;

    use super::*;

    async fn ask(service: &Router, method: &str, path: &str, body: &Value) -> (StatusCode, Value) {
        let request = Request::builder().method(method).uri(path).header("content-type", "application/json");
        let request = request.body(Body::from(body.to_string())).unwrap();
        let answer = service.clone().oneshot(request).await.unwrap();
        let code = answer.status();
        let body = to_bytes(answer.into_body(), 65_536).await.unwrap();
        (code, serde_json::from_slice(&body).unwrap_or_default())
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_runs_trips_and_is_said_to_have_tripped() {
        let (simulated, line) = simulated().unwrap();
        let fleet = fleet(&line).unwrap();
        let service = service(fleet.clone());
        let pump = fleet.drive("1").unwrap();
        pump.ready(Duration::from_secs(5)).await.unwrap();
        let (code, outcome) = ask(&service, "POST", "/drives/1/run", &json!({ "frequency_hz": 30.5 })).await;
        assert_eq!((code, &outcome["outcome"]), (StatusCode::OK, &json!("confirmed")), "{outcome}");
        pump.wait_until(|known| known.has_reached_setpoint(Instant::now()) == Some(true)).await;
        let (_, shown) = ask(&service, "GET", "/drives/1", &Value::Null).await;
        assert_eq!(shown["status"]["state"], "running");
        assert_eq!(shown["status"]["output_frequency_hz"], 30.5);
        simulated.slave(1).unwrap().trip(17);
        pump.wait_until(|now| now.present_trip().is_some_and(|trip| trip.fault().is_some())).await;
        let (_, shown) = ask(&service, "GET", "/drives/1", &Value::Null).await;
        assert_eq!(shown["fault"]["mnemonic"], "OLF");
        let (code, outcome) = ask(&service, "POST", "/drives/1/run", &json!({ "frequency_hz": 30.5 })).await;
        assert_eq!((code, &outcome["outcome"]), (StatusCode::CONFLICT, &json!("refused")), "{outcome}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_setpoint_that_no_register_holds_and_a_drive_that_is_not_there_are_told() {
        let (_simulated, line) = simulated().unwrap();
        let service = service(fleet(&line).unwrap());
        let (code, _) = ask(&service, "POST", "/drives/1/run", &json!({ "frequency_hz": 30.005 })).await;
        assert_eq!(code, StatusCode::UNPROCESSABLE_ENTITY);
        let (code, _) = ask(&service, "POST", "/drives/7/stop", &Value::Null).await;
        assert_eq!(code, StatusCode::NOT_FOUND);
    }
}
