//! What a request is made of: who asks, when it came, its body, and how long he waits.

use std::{convert::Infallible, time::Duration};

use axum::{
    Extension,
    body::Bytes,
    extract::{FromRequest, FromRequestParts, Path, Query, Request},
    http::{StatusCode, header::CONTENT_TYPE, request::Parts},
};
use serde::{Deserialize, de::DeserializeOwned};
use tokio::time::Instant;

use super::problem::Problem;
use drived_doors::Caller;
use drived_plant::plant::commands::Said;
use drived_words::duration::Time;
use drived_words::strict::body;

/// How long an answer is waited for, unless it is said, and at the longest.
const WAIT: Duration = Duration::from_secs(2);
const LONGEST_WAIT: Duration = Duration::from_secs(30);

/// Who asks.
pub(super) struct By(pub(super) Caller);

impl<S: Send + Sync> FromRequestParts<S> for By {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match Extension::<Caller>::from_request_parts(parts, state).await {
            Ok(Extension(caller)) => Ok(Self(caller)),
            Err(_) => Err(Problem::new(StatusCode::UNAUTHORIZED, "nobody knows who asks")),
        }
    }
}

/// Somebody who may see the plant.
pub struct Viewer(pub Caller);

impl<S: Send + Sync> FromRequestParts<S> for Viewer {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let By(caller) = By::from_request_parts(parts, state).await?;
        if caller.rights.view { Ok(Self(caller)) } else { Err(Problem::lacks_right(&caller, "view")) }
    }
}

/// When the request came, as its door has seen it: now, where there is none.
pub(super) struct Arrived(pub(super) Instant);

impl<S: Send + Sync> FromRequestParts<S> for Arrived {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let came = parts.extensions.get::<drived_doors::Arrived>();
        Ok(Self(came.map_or_else(Instant::now, |came| came.0)))
    }
}

/// A name in the path.
pub(super) struct Named(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let Path(name) = Path::from_request_parts(parts, state).await?;
        Ok(Self(name))
    }
}

/// `?wait=`.
pub(super) struct Wait(pub(super) Duration);

#[derive(Deserialize)]
struct WaitQuery {
    wait: Option<String>,
}

impl<S: Send + Sync> FromRequestParts<S> for Wait {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let Query(WaitQuery { wait }) = Query::from_request_parts(parts, state).await?;
        let Some(text) = wait else { return Ok(Self(WAIT)) };
        match text.parse() {
            Ok(Time(wait)) if wait <= LONGEST_WAIT => Ok(Self(wait)),
            _ => {
                let detail = format!("wait={text}: expected 0 to 30s, such as 500ms or 2s");
                Err(Problem::new(StatusCode::BAD_REQUEST, detail))
            }
        }
    }
}

/// `?wait=` of a stop, which is one whatever it says: what is not understood is the ordinary time.
pub(super) struct StoppingWait(pub(super) Duration);

impl<S: Send + Sync> FromRequestParts<S> for StoppingWait {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Infallible> {
        let said = Wait::from_request_parts(parts, state).await;
        Ok(Self(said.map_or(WAIT, |Wait(wait)| wait)))
    }
}

/// `?wait=`, where many answers of a drive are waited for: as long as may be unless it is said.
pub(super) struct Patience(pub(super) Duration);

impl<S: Send + Sync> FromRequestParts<S> for Patience {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let is_said = parts.uri.query().is_some_and(|query| query.contains("wait="));
        let Wait(wait) = Wait::from_request_parts(parts, state).await?;
        Ok(Self(if is_said { wait } else { LONGEST_WAIT }))
    }
}

/// A body in JSON, read strictly; an empty one stands for an object without members.
pub(super) struct Sent<T>(pub(super) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Sent<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        Ok(Self(body(&json(request, state).await?)?))
    }
}

/// The body of a stop, which is one whatever it says.
pub(super) struct Stopping(pub(super) Said);

impl<S: Send + Sync> FromRequest<S> for Stopping {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let body = json(request, state).await?;
        Ok(Self(Said::stopping(&body)))
    }
}

/// What is sent as JSON.
async fn json<S: Send + Sync>(request: Request, state: &S) -> Result<Bytes, Problem> {
    let kind = request.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
    let kind = kind.and_then(|kind| kind.split(';').next()).map(str::trim);
    if !kind.is_some_and(|kind| kind.eq_ignore_ascii_case("application/json")) {
        let detail = "expected the header Content-Type: application/json";
        return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, detail));
    }
    Ok(Bytes::from_request(request, state).await?)
}
