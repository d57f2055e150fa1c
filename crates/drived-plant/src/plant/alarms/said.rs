//! What a message says that is to be done with alarms, read strictly: what is not understood is refused by the name of the key.

use std::time::Duration;

use drived_words::strict::{Unclear, object, strict, unambiguous};
use serde::Deserialize;
use serde_json::{Value, json};

use super::{AlarmAct, AlarmRejected, AlarmView, Plant, together::SeenAlarm};
use crate::plant::commands::is_id;
use drived_config::rights::Caller;

/// So many alarms are acted on by one message.
const MOST: usize = 1_000;

/// A message about alarms, as far as it can be understood.
#[derive(Debug, Clone)]
pub struct AlarmsSaid {
    /// For the audit log.
    pub body: Value,
    pub id: Option<String>,
    /// When it was issued, as it says itself.
    pub issued_unix_ms: Option<u64>,
    pub asked: Result<AlarmsAsked, Unclear>,
}

/// What is to be done with which alarms.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlarmsAsked {
    pub alarms: Vec<SeenAlarm>,
    pub act: AlarmAct,
}

/// What was done with one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct AlarmDone {
    pub id: u64,
    pub done: Result<AlarmView, AlarmRejected>,
}

/// As it is written. Each alarm is named with how often it has come: whoever has not seen its last coming does nothing with it, and a
/// message that comes twice does the same as once.
#[derive(Debug, Deserialize)]
#[serde(tag = "action", rename_all = "snake_case", deny_unknown_fields)]
enum Written {
    Acknowledge {
        id: Option<String>,
        issued_unix_ms: Option<u64>,
        alarms: Vec<SeenAlarm>,
        note: Option<String>,
    },
    Shelve {
        id: Option<String>,
        issued_unix_ms: Option<u64>,
        alarms: Vec<SeenAlarm>,
        minutes: u32,
        why: String,
    },
    Unshelve {
        id: Option<String>,
        issued_unix_ms: Option<u64>,
        alarms: Vec<SeenAlarm>,
    },
    Done {
        id: Option<String>,
        issued_unix_ms: Option<u64>,
        alarms: Vec<SeenAlarm>,
        note: Option<String>,
    },
}

impl AlarmsSaid {
    /// An object with its `action`: `acknowledge`, `shelve`, `unshelve` or, of maintenance and of what a run has left, `done`.
    pub fn of(text: &str) -> Self {
        let object = match object(text.as_bytes()) {
            Ok(object) => object,
            Err(unclear) => return Self::unclear(unclear, Value::from(text)),
        };
        let body = object.shown();
        let written = unambiguous(&object).and_then(|()| strict(object)).and_then(|members| {
            serde_json::from_value::<Written>(Value::Object(members))
                .map_err(|error| Unclear::Malformed(error.to_string()))
        });
        match written {
            Ok(written) => Self::read(written, body),
            Err(unclear) => Self::unclear(unclear, body),
        }
    }

    /// What cannot be understood.
    pub const fn unclear(unclear: Unclear, body: Value) -> Self {
        Self { body, id: None, issued_unix_ms: None, asked: Err(unclear) }
    }

    fn read(written: Written, body: Value) -> Self {
        let (id, issued_unix_ms, alarms, act) = match written {
            Written::Acknowledge { id, issued_unix_ms, alarms, note } => {
                (id, issued_unix_ms, alarms, AlarmAct::Acknowledge { note, count: None })
            }
            Written::Shelve { id, issued_unix_ms, alarms, minutes, why } => {
                let time = Duration::from_secs(u64::from(minutes) * 60);
                (id, issued_unix_ms, alarms, AlarmAct::Shelve { time, why })
            }
            Written::Unshelve { id, issued_unix_ms, alarms } => {
                (id, issued_unix_ms, alarms, AlarmAct::Unshelve)
            }
            Written::Done { id, issued_unix_ms, alarms, note } => {
                (id, issued_unix_ms, alarms, AlarmAct::Done { note })
            }
        };
        let malformed = |why: String| Err(Unclear::Malformed(why));
        let asked = match id.as_deref() {
            Some(id) if !is_id(id) => {
                malformed("id: expected printable ASCII characters without spaces".to_owned())
            }
            _ if alarms.len() > MOST => malformed(format!("alarms: at most {MOST} at once")),
            _ => Ok(AlarmsAsked { alarms, act }),
        };
        Self { body, id: id.filter(|id| is_id(id)), issued_unix_ms, asked }
    }
}

impl Plant {
    /// Does this with each of these alarms that has not come again since it was seen, in their order.
    pub fn act_on_alarms(&self, caller: &Caller, asked: &AlarmsAsked) -> Vec<AlarmDone> {
        let one = |seen: &SeenAlarm| {
            let act = match &asked.act {
                AlarmAct::Acknowledge { note, .. } => {
                    AlarmAct::Acknowledge { note: note.clone(), count: Some(seen.count) }
                }
                other => other.clone(),
            };
            let has_come = self.alarm(seen.id).is_some_and(|alarm| alarm.alarm.count != seen.count);
            let done = match has_come {
                true => Err(AlarmRejected::CameAgain),
                false => self.act_on_alarm(caller, seen.id, &act),
            };
            AlarmDone { id: seen.id, done }
        };
        asked.alarms.iter().map(one).collect()
    }
}

impl AlarmDone {
    /// The same for programs.
    pub fn told(&self) -> Value {
        match &self.done {
            Ok(alarm) => json!({ "id": self.id, "outcome": "confirmed", "state": alarm.state }),
            Err(rejected) => json!({
                "id": self.id, "outcome": "refused", "reason": rejected.reason(), "text": rejected.to_string(),
            }),
        }
    }
}
