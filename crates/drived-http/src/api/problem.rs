//! What is answered instead: problem documents, RFC 9457.

use axum::{
    Json,
    extract::rejection::{BytesRejection, PathRejection, QueryRejection},
    http::{
        HeaderValue, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE, WWW_AUTHENTICATE},
    },
    response::{IntoResponse, Response},
};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Serialize, Serializer};
use serde_json::Value;

use drived_config::rights::Caller;
use drived_doors::lacking;
use drived_plant::plant::{
    commands::{OutcomeWord, Rejected},
    views::CommandView,
};
use drived_words::strict::Unclear;

/// The kind of a command that was refused.
const REFUSED: &str = "urn:drived:refused";

/// A problem document. That of a command which was taken and did not end well has the members of the command, too.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Problem {
    /// Which kind of problem it is: `about:blank` where the status says it all, and otherwise
    /// `urn:drived:` and the outcome.
    #[serde(rename = "type")]
    kind: &'static str,
    title: &'static str,
    /// The HTTP status.
    status: u16,
    /// What is wrong here, in words.
    detail: String,
    /// The address of the command that did not end well.
    #[serde(skip_serializing_if = "Option::is_none")]
    instance: Option<String>,
    #[serde(flatten)]
    why: Option<Why>,
}

/// What is known of a command that was refused or did not end well.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
enum Why {
    Refused(Refused),
    Ended(Ended),
}

/// A command that was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
struct Refused {
    outcome: OutcomeWord,
    /// Why, in one word.
    reason: &'static str,
}

/// The members of a command; what the drive showed is its `drive_status` here, for `status` is that of the answer.
#[derive(Debug, Clone, PartialEq)]
struct Ended(Box<CommandView>);

impl Serialize for Ended {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut members = serde_json::to_value(&self.0).map_err(serde::ser::Error::custom)?;
        rename_status(&mut members);
        members.serialize(serializer)
    }
}

impl JsonSchema for Ended {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Ended".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = CommandView::json_schema(generator);
        schema.get_mut("properties").map(rename_status);
        schema
    }
}

fn rename_status(members: &mut Value) {
    if let Value::Object(members) = members
        && let Some(status) = members.remove("status")
    {
        members.insert("drive_status".to_owned(), status);
    }
}

impl Problem {
    pub(super) fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self {
            kind: "about:blank",
            title: status.canonical_reason().unwrap_or("Problem"),
            status: status.as_u16(),
            detail: detail.into(),
            instance: None,
            why: None,
        }
    }

    pub(super) fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, detail)
    }

    pub(super) fn unprocessable(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, detail)
    }

    pub(super) fn method_not_allowed() -> Self {
        Self::new(StatusCode::METHOD_NOT_ALLOWED, "nothing here is asked so: see /api/v1/openapi.json")
    }

    /// A caller lacks a right: somebody who has not said who he is may say so, and others may not do it.
    pub(super) fn lacks_right(caller: &Caller, right: &str) -> Self {
        let (status, detail) = lacking(caller, right);
        let why = Refused { outcome: OutcomeWord::Refused, reason: "no_right" };
        Self { why: Some(Why::Refused(why)), ..Self::new(status, detail) }
    }

    /// A caller has the right, and for other drives.
    pub(super) fn out_of_scope(caller: &Caller, drive: &str) -> Self {
        let rejected = Rejected::OutOfScope { caller: caller.name.clone(), drive: drive.to_owned() };
        let (outcome, reason) = rejected.told();
        let why = Some(Why::Refused(Refused { outcome, reason }));
        Self { why, ..Self::new(StatusCode::FORBIDDEN, rejected.to_string()) }
    }

    pub(super) fn rejected(rejected: &Rejected, caller: &Caller) -> Self {
        let detail = rejected.to_string();
        match rejected {
            Rejected::NoRight { right, .. } => Self::lacks_right(caller, right),
            Rejected::OutOfScope { drive, .. } => Self::out_of_scope(caller, drive),
            Rejected::NoDrive(_) | Rejected::NoGroup(_) => Self::not_found(detail),
            Rejected::FromTheFuture(_) => Self::unprocessable(detail),
            Rejected::Stopped(_)
            | Rejected::Otherwise(_)
            | Rejected::Closing
            | Rejected::TooOld { .. }
            | Rejected::ClockSetBack(_)
            | Rejected::IdReused(_) => {
                let (outcome, reason) = rejected.told();
                let why = Some(Why::Refused(Refused { outcome, reason }));
                Self { kind: REFUSED, why, ..Self::new(StatusCode::CONFLICT, detail) }
            }
        }
    }

    /// A drive cannot be asked, or refuses.
    pub(super) fn refused(refused: &drive_fleet::Refused) -> Self {
        Self::refused_as(refused.word(), refused.to_string())
    }

    /// Something is not done, though it could be at another time.
    pub(super) fn refused_as(reason: &'static str, detail: impl Into<String>) -> Self {
        let why = Some(Why::Refused(Refused { outcome: OutcomeWord::Refused, reason }));
        Self { kind: REFUSED, why, ..Self::new(StatusCode::CONFLICT, detail) }
    }

    /// A command that has ended, and not by a confirmation.
    pub(super) fn of_command(command: &CommandView) -> Self {
        let (status, title, kind) = match command.outcome {
            OutcomeWord::Refused if command.reason.as_deref() == Some("no_right") => {
                (StatusCode::FORBIDDEN, "The command was refused", REFUSED)
            }
            OutcomeWord::Refused => (StatusCode::CONFLICT, "The command was refused", REFUSED),
            OutcomeWord::Superseded => {
                (StatusCode::CONFLICT, "Something newer took its place", "urn:drived:superseded")
            }
            OutcomeWord::Expired => (StatusCode::GONE, "The command has expired", "urn:drived:expired"),
            OutcomeWord::NotConfirmed => {
                (StatusCode::GATEWAY_TIMEOUT, "The command is not confirmed", "urn:drived:not_confirmed")
            }
            OutcomeWord::Unknown | OutcomeWord::Pending | OutcomeWord::Confirmed | OutcomeWord::Nothing => {
                (StatusCode::GATEWAY_TIMEOUT, "The outcome is unknown", "urn:drived:unknown")
            }
        };
        let detail = command.text.clone().unwrap_or_else(|| command.several_in_words());
        Self {
            kind,
            title,
            instance: Some(format!("/api/v1/commands/{}", command.id)),
            why: Some(Why::Ended(Ended(Box::new(command.clone())))),
            ..Self::new(status, detail)
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, Json(self)).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        Self::new(StatusCode::BAD_REQUEST, rejection.body_text())
    }
}

impl From<Unclear> for Problem {
    fn from(unclear: Unclear) -> Self {
        match unclear {
            Unclear::NoJson(why) => Self::new(StatusCode::BAD_REQUEST, format!("the body is no JSON: {why}")),
            unclear => Self::unprocessable(unclear.to_string()),
        }
    }
}

impl From<PathRejection> for Problem {
    fn from(rejection: PathRejection) -> Self {
        Self::new(StatusCode::BAD_REQUEST, rejection.body_text())
    }
}

impl From<BytesRejection> for Problem {
    fn from(rejection: BytesRejection) -> Self {
        Self::new(rejection.status(), rejection.body_text())
    }
}
