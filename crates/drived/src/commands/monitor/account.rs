//! What became of a stop, counted until every drive is accounted for.

use axum::http::StatusCode;
use serde_json::Value;

use super::words;
use crate::{client::Answer, logging::escaped};

/// Whose motors are to stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stop {
    All,
    One(String),
}

/// One press of a stop key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Account {
    pub(super) number: u64,
    pub(super) stop: Stop,
    /// When it was pressed, on the wall's clock.
    pub(super) unix_ms: u64,
    pub(super) state: Sent,
}

/// How far it has come.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Sent {
    /// It has been given to so many drives as were known, and nobody has answered yet; so often in vain.
    Sending { drives: usize, failed: u32, why: String },
    /// The daemon has it, and said last so.
    Taken { count: Count, out_of_sight: Option<String> },
    /// It could not be given, or nobody knows what became of it.
    Failed(String),
}

/// Every drive once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Count {
    pub(super) confirmed: u64,
    pub(super) pending: u64,
    pub(super) not_reachable: u64,
    /// Drives that are only read.
    pub(super) refused: u64,
    pub(super) failed: u64,
    /// Those that are not confirmed, each with what is known of it.
    pub(super) left: Vec<(String, String)>,
    /// Whether anything may still change.
    pub(super) is_open: bool,
}

/// What the task that carries it out has to say.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Progress {
    /// Another try has failed, and it is tried again.
    Again(String),
    /// What the daemon answered.
    Answer(Value),
    /// It cannot be asked what became of it for now.
    OutOfSight(String),
    Over(String),
}

impl Account {
    /// Takes what is told of it. `is_silent`: the one drive that is meant does not answer.
    pub(super) fn take(&mut self, progress: Progress, is_silent: bool) {
        match (progress, &mut self.state) {
            (Progress::Answer(answer), state) => {
                *state = Sent::Taken { count: Count::of(&answer, is_silent), out_of_sight: None };
            }
            (Progress::Again(text), Sent::Sending { failed, why, .. }) => {
                *failed += 1;
                *why = text;
            }
            (Progress::OutOfSight(why), Sent::Taken { out_of_sight, .. }) => *out_of_sight = Some(why),
            (Progress::Again(_) | Progress::OutOfSight(_), _) => {}
            (Progress::Over(why), state) => *state = Sent::Failed(why),
        }
    }

    /// Whether it may still change.
    pub(super) const fn is_open(&self) -> bool {
        match &self.state {
            Sent::Sending { .. } => true,
            Sent::Taken { count, .. } => count.is_open,
            Sent::Failed(_) => false,
        }
    }

    /// Whether every motor that was meant is known to stand.
    pub(super) const fn is_done(&self) -> bool {
        matches!(
            &self.state,
            Sent::Taken { count: Count { is_open: false, not_reachable: 0, failed: 0, .. }, .. }
        )
    }

    /// What is told of it: first what was done, then how it stands.
    pub(super) fn sentence(&self) -> String {
        let what = match &self.stop {
            Stop::All => "STOP ALL".to_owned(),
            Stop::One(name) => format!("STOP {name}"),
        };
        match &self.state {
            Sent::Sending { drives, failed: 0, .. } => {
                let drives = crate::output::counted(*drives, "drive", "drives");
                format!("{what}: given to {drives}, no answer yet")
            }
            Sent::Sending { failed, why, .. } => {
                format!("{what}: NOT SENT YET, tried {failed} times: {why}: use the emergency stop")
            }
            Sent::Taken { count, out_of_sight } => {
                let sight = out_of_sight.as_ref().map(|why| format!("; out of sight: {why}"));
                format!("{what}: {}{}", count.sentence(), sight.unwrap_or_default())
            }
            Sent::Failed(why) => format!("{what}: NOT CONFIRMED: {why}: use the emergency stop"),
        }
    }

    /// Who is left, by name.
    pub(super) fn left(&self) -> String {
        let Sent::Taken { count, .. } = &self.state else { return String::new() };
        let mut kinds: Vec<(&str, Vec<&str>)> = Vec::new();
        for (name, what) in &count.left {
            match kinds.iter_mut().find(|(kind, _)| kind == what) {
                Some((_, names)) => names.push(name),
                None => kinds.push((what, vec![name])),
            }
        }
        let told = kinds.iter().map(|(kind, names)| format!("{kind}: {}", names.join(", ")));
        told.collect::<Vec<_>>().join("; ")
    }
}

impl Count {
    /// Counts an answer of the API: that to a stop of one drive, or of several.
    fn of(answer: &Value, is_silent: bool) -> Self {
        let Some(drives) = answer["drives"].as_array() else { return Self::of_one(answer, is_silent) };
        let count = |key: &str| answer[key].as_u64().unwrap_or_default();
        let not_done = drives.iter().filter(|drive| drive["outcome"] != "confirmed");
        Self {
            confirmed: count("confirmed"),
            pending: count("pending"),
            not_reachable: count("not_reachable"),
            refused: count("refused"),
            failed: count("failed"),
            left: not_done.map(left).collect(),
            is_open: drives.iter().any(|drive| drive["outcome"] == "pending"),
        }
    }

    fn of_one(answer: &Value, is_silent: bool) -> Self {
        let mut count = Self::default();
        let outcome = answer["outcome"].as_str().unwrap_or("unknown");
        *match outcome {
            "confirmed" => &mut count.confirmed,
            "refused" => &mut count.refused,
            _ if is_silent => &mut count.not_reachable,
            "pending" => &mut count.pending,
            _ => &mut count.failed,
        } = 1;
        count.left = (outcome != "confirmed").then(|| left(answer)).into_iter().collect();
        count.is_open = outcome == "pending";
        count
    }

    fn sentence(&self) -> String {
        let Self { confirmed, pending, not_reachable, refused, failed, .. } = self;
        let always = format!("{confirmed} confirmed, {pending} pending, {not_reachable} not reachable");
        let some = [(*refused, "only read"), (*failed, "NOT CONFIRMED")];
        let some =
            some.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}"));
        some.fold(always, |text, more| text + &more)
    }
}

/// Who is left, and what is known of it.
fn left(command: &Value) -> (String, String) {
    let name = escaped(command["drive"].as_str().unwrap_or("the drive"));
    let outcome = words::outcome(command["outcome"].as_str().unwrap_or("unknown"));
    (name, outcome.to_owned())
}

/// What the answer to a stop means.
pub(super) fn judged(answer: &Answer) -> Progress {
    let of_command = answer.body["outcome"].is_string() || answer.body["drives"].is_array();
    match answer.status {
        _ if of_command => Progress::Answer(answer.body.clone()),
        StatusCode::NOT_FOUND => Progress::Over(
            "the daemon does not know of this stop, it was started anew: press again".to_owned(),
        ),
        status if status.is_server_error() => Progress::Again(answer.failure().to_string()),
        _ => Progress::Over(answer.failure().to_string()),
    }
}
