//! A command to the daemon, and what became of it.

use std::{sync::Arc, time::Duration};

use serde_json::{Value, json};
use tokio::time::{Instant, timeout_at};

use super::{Daemon, DaemonArgs, Remote, Target};
use drived_plant::{
    follow::{Follower, News},
    plant::{
        commands::{ActionWord, OutcomeWord},
        views::CommandView,
    },
};

use drived_words::{failure::Failure, output, values};

/// How often it is asked for what became of it.
const ASKED_EVERY: Duration = Duration::from_millis(500);
/// The longest ramp and then some: the daemon goes on when nobody asks any more.
const WAITED: Duration = Duration::from_secs(90);
/// Between two words about a command that is not settled.
const TOLD_EVERY: Duration = Duration::from_secs(5);

/// A command as the API takes it.
#[derive(Debug, Clone)]
pub struct Told {
    pub action: ActionWord,
    pub body: Value,
    /// What a person reads when it is confirmed.
    pub done: String,
}

/// Gives a command and waits for what becomes of it.
///
/// # Errors
///
/// It is not confirmed, for each drive; or it cannot be given.
pub async fn order(
    args: &DaemonArgs,
    mut daemon: Daemon,
    target: &Target,
    told: &Told,
) -> Result<(), Failure> {
    let path = format!("{}?wait=2s", target.path(told.action.name()));
    let answer = daemon.post(&path, &told.body).await?;
    let Some(first) = answer.command() else { return Err(answer.failure()) };
    let command = settled(args, Arc::new(first), daemon).await?;
    if args.is_json() {
        let is_first = command.outcome != OutcomeWord::Pending && !answer.status.is_success();
        output::say_as_it_is(if is_first { answer.body } else { json!(command) })?;
    }
    let Some(several) = &command.several else { return one(args, told, &command) };
    let mut left = Vec::new();
    for drive in &several.drives {
        match drive.outcome {
            OutcomeWord::Confirmed if args.is_json() => {}
            OutcomeWord::Confirmed => output::say(sentence(told, drive))?,
            // Those that are only read were never meant.
            _ if command.outcome == OutcomeWord::Confirmed => {
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
            output::counted(several.drives.len(), "drive", "drives"),
            left.join("; ")
        ))),
    }
}

fn one(args: &DaemonArgs, told: &Told, command: &CommandView) -> Result<(), Failure> {
    let why = || format!("{}: {}", name(command), why(command));
    match command.outcome {
        OutcomeWord::Confirmed if args.is_json() => Ok(()),
        OutcomeWord::Confirmed => output::say(sentence(told, command)),
        // Who has no right has asked for the wrong thing.
        OutcomeWord::Refused if command.reason.as_deref() == Some("no_right") => {
            Err(Failure::Input(command.text.clone().unwrap_or_else(why)))
        }
        _ => Err(Failure::Drive(why())),
    }
}

/// Follows a command until nothing is pending.
async fn settled(
    args: &DaemonArgs,
    first: Arc<CommandView>,
    daemon: Daemon,
) -> Result<Arc<CommandView>, Failure> {
    let until = Instant::now() + WAITED;
    let mut follower = Follower::from(Remote::new(daemon, &first.id, ASKED_EVERY), first);
    while follower.last().outcome == OutcomeWord::Pending && Instant::now() < until {
        if !args.is_json() {
            output::say(pending(&follower.last()))?;
        }
        let tell_at = until.min(Instant::now() + TOLD_EVERY);
        while follower.last().outcome == OutcomeWord::Pending {
            match timeout_at(tell_at, follower.next()).await {
                Ok(Some(News::Told(_))) => {}
                Ok(Some(News::OutOfSight(why) | News::Gone(why))) => return Err(Failure::Drive(why)),
                Ok(None) => return Ok(follower.last()),
                Err(_) => break,
            }
        }
    }
    Ok(follower.last())
}

/// What is told of a command that is not settled.
fn pending(command: &CommandView) -> String {
    let Some(several) = &command.several else {
        return format!("{} has not confirmed it yet: it goes on", name(command));
    };
    let drives = &several.drives;
    let left = drives.iter().filter(|drive| drive.outcome == OutcomeWord::Pending).map(name);
    let left: Vec<&str> = left.collect();
    let confirmed = several.confirmed;
    format!("{confirmed} of {} have confirmed it, waiting for {}", drives.len(), left.join(", "))
}

fn name(command: &CommandView) -> &str {
    command.drive.as_deref().unwrap_or("the drive")
}

fn sentence(told: &Told, command: &CommandView) -> String {
    let status = command.status.as_ref().and_then(|shown| shown.status());
    let shows = status.map(|shows| format!(": the drive shows {shows}")).unwrap_or_default();
    if let Some(started) = command.started {
        return format!("{} {started}{shows}", name(command));
    }
    let by = command.stop.is_some().then_some(command.text.as_deref()).flatten();
    let by = by.map(|by| format!(", {by}")).unwrap_or_default();
    let done = if told.action == ActionWord::Stop { values::stopped(status) } else { &told.done };
    format!("{} {done}{by}{shows}", name(command))
}

fn why(command: &CommandView) -> String {
    let outcome = command.outcome.to_string().replace('_', " ");
    match command.text.as_deref() {
        Some(text) if text.starts_with(&outcome) => text.to_owned(),
        Some(text) => format!("{outcome}: {text}"),
        None => outcome,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_of_a_group_is_named() {
        let part = |drive: &str, outcome: &str| {
            json!({"id": "a", "drive": drive, "action": "stop", "command": "ramp stop", "caller": "local",
                "origin": "socket", "outcome": outcome, "open": outcome == "pending", "time_unix_ms": 1})
        };
        let mut body = part("", "pending");
        body["drives"] = json!([part("fan 1", "confirmed"), part("fan 2", "pending")]);
        for (key, count) in
            [("confirmed", 1), ("pending", 1), ("not_reachable", 0), ("refused", 0), ("failed", 0)]
        {
            body[key] = count.into();
        }
        let command = serde_json::from_value(body).unwrap();
        assert_eq!(pending(&command), "1 of 2 have confirmed it, waiting for fan 2");
    }
}
