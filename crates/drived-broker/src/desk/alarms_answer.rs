//! What is asked to be done with alarms, and what is answered.

use serde::Serialize;
use serde_json::Value;

use drived_plant::plant::{alarms::AlarmsAsked, commands::OutcomeWord};

/// What is asked, and by what it is known.
#[derive(Debug, Clone)]
pub(super) struct AlarmsOrder {
    pub(super) id: Option<String>,
    pub(super) asked: AlarmsAsked,
}

/// What was done with alarms, as it is told. It is `confirmed` where something was done with each of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AlarmsAnswer {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    pub outcome: OutcomeWord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// What became of each.
    pub alarms: Vec<Value>,
    pub caller: String,
    pub origin: String,
    pub time_unix_ms: u64,
}
