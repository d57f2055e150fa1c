//! The HTTP API v1 over the plant: a table of routes, from which both the router and its description are made.

mod alarms;
mod ask;
mod capture;
mod command;
mod compress;
pub mod demo;
mod document;
mod health;
mod parameter;
mod past;
mod problem;
mod read;
mod reload;
mod route;
mod routes;
mod selected;
pub mod setup;
mod stream;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use axum::{
    Extension, Router,
    body::Bytes,
    extract::DefaultBodyLimit,
    http::header::{CACHE_CONTROL, CONTENT_TYPE},
    middleware::from_fn,
    routing::{any, get},
};

pub use self::{
    ask::Viewer,
    reload::{Changes, Reload, reload_router},
};
use self::{
    demo::Stage,
    problem::Problem,
    route::Route,
    routes::{demo_routes, door_routes, reload_routes, routes, setup_routes},
};
use drived_plant::plant::Plant;

/// The largest body that is read.
const LARGEST_BODY: usize = 64 << 10;

/// Everything under `/api/v1`, `/healthz` and `/readyz`. Who asks is a [`Caller`](drived_config::rights::Caller) in the extensions
/// of each request.
pub fn router(plant: Plant) -> Router {
    let mut all = routes();
    all.extend(reload_routes());
    all.extend(setup_routes());
    of(all, plant)
}

/// The same with what a demonstration has besides.
pub fn demo_router(plant: Plant, stage: Stage) -> Router {
    let mut all = routes();
    all.extend(demo_routes());
    of(all, plant).layer(Extension(stage))
}

/// The addresses at which something is stopped, as the doors have to know them.
pub fn stops() -> Vec<&'static str> {
    routes().into_iter().filter(|route| route.stops).map(|route| route.path).collect()
}

/// The description of a daemon's API.
pub fn described() -> serde_json::Value {
    document::of(
        &[routes(), reload_routes(), setup_routes(), door_routes()].into_iter().flatten().collect::<Vec<_>>(),
    )
}

fn of(mut routes: Vec<Route>, plant: Plant) -> Router {
    routes.extend(door_routes());
    let document = Bytes::from(document::of(&routes).to_string());
    let headers = [(CONTENT_TYPE, "application/json"), (CACHE_CONTROL, "no-store")];
    let router = Router::new().route(document::PATH, get(move || async move { (headers, document) }));
    routes
        .into_iter()
        .filter_map(|route| Some((route.path, route.handler?)))
        .fold(router, |router, (path, handler)| router.route(path, handler))
        .route("/api/{*rest}", any(|| async { Problem::not_found("there is nothing at this address") }))
        .method_not_allowed_fallback(async || Problem::method_not_allowed())
        .layer(DefaultBodyLimit::max(LARGEST_BODY))
        .layer(from_fn(compress::over_a_slow_network))
        .with_state(plant)
}
