//! A command to the daemon, and what became of it.

use std::time::Duration;

use axum::http::StatusCode;
use serde_json::Value;
use tokio::time::{Instant, sleep};

use super::{Answer, Daemon, DaemonArgs, Target, path_of, show};
use crate::{failure::Failure, output};

/// How often it is asked for what became of it.
const ASKED_EVERY: Duration = Duration::from_millis(500);
/// The longest ramp and then some: the daemon goes on when nobody asks any more.
const WAITED: Duration = Duration::from_secs(90);
/// Between two words about a command that is not settled.
const TOLD_EVERY: Duration = Duration::from_secs(5);

/// A command as the API takes it.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    /// `start`, `stop`, `setpoint`, `reset`, `release`.
    pub(crate) action: &'static str,
    pub(crate) body: Value,
    /// What a person reads when it is confirmed.
    pub(crate) done: String,
}

/// Gives a command and waits for what becomes of it.
///
/// # Errors
///
/// It is not confirmed, for each drive; or it cannot be given.
pub(crate) async fn order(
    args: &DaemonArgs,
    daemon: &mut Daemon,
    target: &Target,
    told: &Told,
) -> Result<(), Failure> {
    let path = format!("{}?wait=2s", target.path(told.action));
    let answer = settled(args, daemon.post(&path, &told.body).await?, daemon).await?;
    let body = &answer.body;
    if body["outcome"].is_null() && body["drives"].is_null() {
        return Err(answer.failure());
    }
    if args.is_json() {
        output::say_as_it_is(body)?;
    }
    let Some(drives) = body["drives"].as_array() else {
        return one(args, told, body, &answer);
    };
    let mut left = Vec::new();
    for drive in drives {
        match drive["outcome"].as_str() {
            Some("confirmed") if args.is_json() => {}
            Some("confirmed") => output::say(sentence(told, drive))?,
            // Those that are only read were never meant.
            _ if body["outcome"] == "confirmed" => {
                if !args.is_json() {
                    output::say(format_args!("{}: {}", name(drive), why(drive)))?;
                }
            }
            _ => left.push(format!("{}: {}", name(drive), why(drive))),
        }
    }
    match left.len() {
        0 => Ok(()),
        number => Err(Failure::Drive(format!(
            "{number} of {} not confirmed: {}",
            output::counted(drives.len(), "drive", "drives"),
            left.join("; ")
        ))),
    }
}

fn one(args: &DaemonArgs, told: &Told, command: &Value, answer: &Answer) -> Result<(), Failure> {
    match command["outcome"].as_str() {
        Some("confirmed") if args.is_json() => Ok(()),
        Some("confirmed") => output::say(sentence(told, command)),
        _ if answer.status.is_client_error()
            && answer.status != StatusCode::CONFLICT
            && answer.status != StatusCode::GONE =>
        {
            Err(answer.failure())
        }
        _ => Err(Failure::Drive(format!("{}: {}", name(command), why(command)))),
    }
}

/// Asks on until nothing is pending.
async fn settled(args: &DaemonArgs, mut answer: Answer, daemon: &mut Daemon) -> Result<Answer, Failure> {
    let until = Instant::now() + WAITED;
    let mut tell_at = Instant::now();
    while answer.body["outcome"] == "pending" && Instant::now() < until {
        let Some(id) = answer.body["id"].as_str().map(str::to_owned) else { break };
        if !args.is_json() && Instant::now() >= tell_at {
            tell_at = Instant::now() + TOLD_EVERY;
            output::say(pending(&answer.body))?;
        }
        sleep(ASKED_EVERY).await;
        answer = daemon.get(&path_of(&["commands", &id])).await?;
    }
    Ok(answer)
}

/// What is told of a command that is not settled.
fn pending(body: &Value) -> String {
    let Some(drives) = body["drives"].as_array() else {
        return format!("{} has not confirmed it yet: it goes on", name(body));
    };
    let confirmed = drives.iter().filter(|drive| drive["outcome"] == "confirmed").count();
    let left = drives.iter().filter(|drive| drive["outcome"] == "pending").map(name);
    let left: Vec<&str> = left.collect();
    format!("{confirmed} of {} have confirmed it, waiting for {}", drives.len(), left.join(", "))
}

fn name(command: &Value) -> &str {
    command["drive"].as_str().unwrap_or("the drive")
}

fn sentence(told: &Told, command: &Value) -> String {
    let shows = show::status_in_words(&command["status"]);
    let shows = shows.map(|shows| format!(": the drive shows {shows}")).unwrap_or_default();
    format!("{} {}{shows}", name(command), told.done)
}

fn why(command: &Value) -> String {
    let outcome = command["outcome"].as_str().unwrap_or("unknown").replace('_', " ");
    match command["text"].as_str().or_else(|| command["detail"].as_str()) {
        Some(text) if text.starts_with(&outcome) => text.to_owned(),
        Some(text) => format!("{outcome}: {text}"),
        None => outcome,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_left_of_a_group_is_named() {
        let body = json!({"drives": [
            {"drive": "fan 1", "outcome": "confirmed"}, {"drive": "fan 2", "outcome": "pending"},
        ]});
        assert_eq!(pending(&body), "1 of 2 have confirmed it, waiting for fan 2");
    }
}
