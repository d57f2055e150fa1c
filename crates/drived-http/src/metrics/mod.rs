//! `/metrics`: what a metrics store scrapes, in Prometheus' text format 0.0.4, or in OpenMetrics 1.0 for whoever prefers it.
//!
//! Everything is read from snapshots and counters when it is asked for, by a writer of our own: the fleet's state is there
//! already, so that a registry beside it would only have to be cleared of drives and values that are gone. A value that is
//! not known or too old is absent. No task of a line waits for a scrape.

mod alarms;
mod dashboard;
mod drives;
mod lines;
#[cfg(test)]
mod named;
mod negotiation;
mod process;
mod requests;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use axum::{
    Json, Router,
    extract::State,
    http::{
        HeaderMap, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE, VARY},
    },
    middleware::from_fn_with_state,
    response::{IntoResponse, Response},
    routing::get,
};
use tokio::{sync::Mutex, time::Instant};

pub use self::dashboard::dashboard;
use self::{negotiation::wanted, requests::Requests};
use crate::api::Viewer;
use drived_config::names::Kind;
use drived_plant::{
    counts::{Id, Samples, Source, samples, table},
    plant::Plant,
};
use drived_words::json::unix;

/// The alert rules for Prometheus; `tests/alerts.test.yml` has each fire and not fire.
pub const ALERTS: &str = include_str!("alerts.yml");

/// A router with `/metrics`, the alert rules and the board of a plant and of `sources`, and with every answer of it counted.
pub fn serve(router: Router, plant: Plant, sources: Vec<Arc<dyn Source>>) -> Router {
    let requests = Requests::default();
    let sources = sources.into_iter().chain([Arc::new(requests.clone()) as Arc<dyn Source>]).collect();
    let began = (unix(Instant::now()), Instant::now());
    let metrics = Arc::new(Metrics { plant, sources, began, turn: Mutex::default() });
    let metrics = Router::new()
        .route("/metrics", get(scrape))
        .route("/alerts.yml", get(async |_: Viewer| ([(CONTENT_TYPE, "application/yaml")], ALERTS)))
        .route("/grafana.json", get(async |_: Viewer| Json(dashboard())))
        .with_state(metrics);
    router.merge(metrics).layer(from_fn_with_state(requests, requests::count))
}

/// Whatever is told.
struct Metrics {
    plant: Plant,
    sources: Vec<Arc<dyn Source>>,
    /// The beginning, by the wall clock and by the steady one.
    began: (u64, Instant),
    /// One text is made at a time, however many ask.
    turn: Mutex<()>,
}

impl Metrics {
    fn samples(&self) -> Samples {
        let mut samples = Samples::default();
        samples.add(Id::BuildInfo, &[env!("CARGO_PKG_VERSION")], 1.0);
        let (wall, steady) = self.began;
        let drift = unix(Instant::now()) as f64 - wall as f64 - steady.elapsed().as_millis() as f64;
        samples.add(Id::ClockDrift, &[], drift / 1_000.0);
        let (fleet, counts) = (self.plant.fleet(), self.plant.tally().counts());
        samples.add_histogram(Id::StopConfirm, &[], counts.stops_up_to(), counts.stopping.as_secs_f64());
        for (name, line) in fleet.lines() {
            let plan = fleet.plan(&name);
            // Their series are the same whatever they are called.
            let id = self.plant.known_as(Kind::Line, &name).id;
            let drives: Vec<_> = fleet
                .drives_on(&name)
                .into_iter()
                .map(|drive| (self.plant.known_as(Kind::Drive, drive.name()).id, drive))
                .collect();
            lines::collect((&id, &name), &line, plan, &drives, &mut samples);
            for (drive_id, drive) in &drives {
                drives::collect([&id, drive_id], plan, drive, &mut samples);
            }
            lines::collect_commands(&id, &drives, &counts, &mut samples);
        }
        alarms::collect(&self.plant, &mut samples);
        process::collect(&mut samples);
        for source in &self.sources {
            source.collect(&mut samples);
        }
        samples
    }
}

async fn scrape(State(metrics): State<Arc<Metrics>>, _: Viewer, headers: HeaderMap) -> Response {
    let format = wanted(&headers);
    let turn = metrics.turn.lock().await;
    let made = Arc::clone(&metrics);
    // On a thread beside those that serve the lines.
    let text = tokio::task::spawn_blocking(move || made.samples().text(format)).await;
    drop(turn);
    let headers = [(CONTENT_TYPE, format.content_type()), (CACHE_CONTROL, "no-store"), (VARY, "Accept")];
    match text {
        Ok(text) => (headers, text).into_response(),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}
