//! How many requests the doors have let through to the router, by the template of their path: never the path itself, so that
//! nobody makes series by asking for names that are not there.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use axum::{
    extract::{MatchedPath, Request, State},
    http::Method,
    middleware::Next,
    response::Response,
};

use super::{
    samples::{Samples, Source},
    table::Id,
};

/// The counts so far. Cheap to clone.
#[derive(Clone, Default)]
pub(super) struct Requests(Arc<Mutex<BTreeMap<Key, u64>>>);

/// Template, method and status.
type Key = (String, &'static str, u16);

/// Counts one request and its answer.
pub(super) async fn count(State(requests): State<Requests>, request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let method = named(request.method());
    let answer = next.run(request).await;
    let key = (route, method, answer.status().as_u16());
    *requests.0.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default() += 1;
    answer
}

/// A method that clients make up is none of ours.
fn named(method: &Method) -> &'static str {
    let usual = [Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::DELETE, Method::OPTIONS];
    let names = ["GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"];
    usual.iter().zip(names).find(|(usual, _)| *usual == method).map_or("other", |(_, name)| name)
}

impl Source for Requests {
    fn collect(&self, samples: &mut Samples) {
        let counts = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for ((route, method, status), count) in &counts {
            samples.count(Id::HttpRequests, &[route, method, &status.to_string()], *count);
        }
    }
}
