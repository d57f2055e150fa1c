//! What the API told of an event, as far as a story looks at it.

use drived_plant::plant::past::RecordView;
use serde::Deserialize;

/// A command for several drives, as far as it is looked at here.
#[derive(Debug, Deserialize)]
pub(super) struct OfSeveral {
    #[serde(default)]
    pub(super) drives: Vec<OfOne>,
}

/// What became of it at one of them.
#[derive(Debug, Deserialize)]
pub(super) struct OfOne {
    pub(super) drive: Option<String>,
    pub(super) outcome: String,
    /// Why, in words.
    #[serde(default)]
    pub(super) text: Option<String>,
}

/// An event as far as it is looked at here.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Body {
    #[serde(default)]
    pub(super) cause: Option<Cause>,
    #[serde(default)]
    pub(super) from: Option<String>,
    #[serde(default)]
    pub(super) to: Option<String>,
    #[serde(default)]
    pub(super) fault: Option<Fault>,
    #[serde(default)]
    pub(super) words: Vec<Word>,
    #[serde(default)]
    pub(super) last_known_unix_ms: Option<i64>,
    #[serde(default)]
    pub(super) since_unix_ms: Option<i64>,
    /// From where to where the clock was set.
    #[serde(default)]
    pub(super) from_unix_ms: Option<i64>,
    #[serde(default)]
    pub(super) to_unix_ms: Option<i64>,
    /// For how long a lost drive had been silent.
    #[serde(default)]
    pub(super) silent_for_ms: Option<u64>,
    /// How many records could not be kept.
    #[serde(default)]
    pub(super) records: Option<u64>,
    #[serde(default)]
    pub(super) outcome: Option<String>,
    /// How long it took until that was told.
    #[serde(default)]
    pub(super) took_ms: Option<i64>,
    /// What became of the reference of a run command that went.
    #[serde(default)]
    pub(super) reference_before_hz: Option<f64>,
    #[serde(default)]
    pub(super) reference_hz: Option<f64>,
    /// How far the two readings lie apart between which it went.
    #[serde(default)]
    pub(super) unread_ms: Option<i64>,
    /// What a drive showed that was heard, for the first time or again.
    #[serde(default)]
    pub(super) status: Option<Shown>,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Shown {
    #[serde(default)]
    pub(super) state: Option<String>,
    #[serde(default)]
    pub(super) control: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "by", rename_all = "snake_case")]
pub(super) enum Cause {
    Command {
        commander: String,
        #[serde(default)]
        door: Option<String>,
    },
    Policy {
        policy: String,
    },
    Drive,
    Found,
}

#[derive(Debug, Deserialize)]
pub(super) struct Fault {
    #[serde(default)]
    pub(super) by_watchdog: bool,
    /// For how long it had not been heard, where that is longer than its watchdog waits.
    pub(super) watchdog_after_ms: Option<u64>,
    #[serde(default)]
    pub(super) found: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct Word {
    pub(super) code: String,
    pub(super) value: u16,
    #[serde(default)]
    pub(super) before: Option<u16>,
}

/// What the API told of it; nothing where that was not kept or is of another kind.
pub(super) fn body(found: &RecordView) -> Body {
    found.body.as_ref().and_then(|body| serde_json::from_str(body.get()).ok()).unwrap_or_default()
}
