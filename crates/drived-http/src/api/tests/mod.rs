//! The API over a simulated plant in virtual time, asked as a client asks it.

mod alarms;
mod as_shown;
mod commanding;
mod described;
mod doors;
mod past;
mod reading;
mod streaming;

use axum::{
    Extension, Router,
    body::Body,
    http::{Request, StatusCode},
};
use http_body_util::BodyExt as _;
use serde_json::Value;
use tower::ServiceExt as _;

use super::router;
use drived_doors::{Caller, Rights};
use drived_plant::plant::{Plant, testing::TestPlant};

const ALL: Rights = Rights { view: true, stop: true, operate: true, engineer: true };

/// The API as a caller of this name and with these rights meets it.
fn api(plant: &Plant, name: &str, rights: Rights) -> Router {
    let caller = Caller::new(name, "test", rights);
    router(plant.clone()).layer(Extension(caller))
}

/// What came of a request.
async fn send(router: Router, request: Request<Body>) -> (StatusCode, Value) {
    let response = router.oneshot(request).await.unwrap();
    let status = response.status();
    let body = response.into_body().collect().await.unwrap().to_bytes();
    (status, serde_json::from_slice(&body).unwrap_or(Value::Null))
}

/// A request with a body, as JSON.
fn post(path: &str, body: &Value) -> Request<Body> {
    let request = Request::post(path).header("content-type", "application/json");
    request.body(Body::from(body.to_string())).unwrap()
}

async fn command(plant: &Plant, path: &str, body: &Value) -> (StatusCode, Value) {
    send(api(plant, "operator", ALL), post(path, body)).await
}

async fn get(plant: &Plant, path: &str) -> (StatusCode, Value) {
    send(api(plant, "reader", ALL), Request::get(path).body(Body::empty()).unwrap()).await
}
