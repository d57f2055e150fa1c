//! An answer to a request that does not reach the router: a problem document (RFC 9457).

use std::time::Duration;

use axum::{
    body::Body,
    http::{HeaderValue, StatusCode, header},
    response::Response,
};

use drived_config::rights::Caller;

/// Why a request is not taken.
#[derive(Debug)]
pub(super) struct Refusal {
    status: StatusCode,
    why: String,
    /// When it can be tried again.
    after: Option<Duration>,
    /// Whether whoever asks lacks a right.
    no_right: bool,
}

/// What is answered to a caller who lacks a right: somebody who has not said who he is may say so, and others may not do it.
pub fn lacking(caller: &Caller, right: &str) -> (StatusCode, String) {
    match caller.name.as_str() {
        "anonymous" => (StatusCode::UNAUTHORIZED, format!("this needs a token with the right to {right}")),
        name => (StatusCode::FORBIDDEN, format!("{name} has no right to {right}")),
    }
}

impl Refusal {
    pub(super) fn new(status: StatusCode, why: impl Into<String>) -> Self {
        Self { status, why: why.into(), after: None, no_right: false }
    }

    pub(super) fn unauthorized(why: &str) -> Self {
        Self::new(StatusCode::UNAUTHORIZED, why)
    }

    pub(super) fn lacks_right(caller: &Caller, right: &str) -> Self {
        let (status, why) = lacking(caller, right);
        Self { no_right: true, ..Self::new(status, why) }
    }

    pub(super) fn after(self, time: Duration) -> Self {
        Self { after: Some(time), ..self }
    }

    /// Whether it is for what the caller is or says, and not for what fails here.
    pub(super) fn is_of_the_caller(&self) -> bool {
        self.status.is_client_error()
    }

    pub(super) fn into_response(self) -> Response {
        let Self { status, why, after, no_right } = self;
        let title = status.canonical_reason().unwrap_or("Refused");
        let mut problem = serde_json::json!({
            "type": "about:blank", "title": title, "status": status.as_u16(), "detail": why,
        });
        if no_right {
            problem["outcome"] = "refused".into();
            problem["reason"] = "no_right".into();
        }
        let mut answer = Response::new(Body::from(problem.to_string()));
        *answer.status_mut() = status;
        let headers = answer.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if let Some(after) = after {
            headers.insert(header::RETRY_AFTER, after.as_secs().max(1).into());
        }
        answer
    }
}
