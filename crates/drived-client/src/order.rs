//! A command to the daemon, and what became of it.

use std::{sync::Arc, time::Duration};

use serde_json::{Value, json};
use tokio::time::{Instant, timeout_at};

use super::{Daemon, DaemonArgs, Remote, Target};
use drived_plant::{
    follow::{Follower, News, Source},
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
/// For how long a daemon that does not answer is asked again: a busy one is late now and then.
const OUT_OF_SIGHT: Duration = Duration::from_secs(15);
/// Between two words about a command that is not settled.
const TOLD_EVERY: Duration = Duration::from_secs(5);

/// Of a motor that was started again and again behind its stop.
const RUNS_AGAIN: &str = "that came more than once, and the motor may run again: end it where it is given, such as at another master of the \
                          line, or use the emergency stop";

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
    let source = Remote::new(daemon, &first.id, ASKED_EVERY);
    let say = |text: String| output::done(if args.is_json() { Ok(()) } else { output::say(text) });
    let command = settled(Follower::from(source, Arc::new(first)), say).await?;
    if args.is_json() {
        let is_first = command.outcome != OutcomeWord::Pending && !answer.status.is_success();
        output::done(output::say_as_it_is(if is_first { answer.body } else { json!(command) }))?;
    }
    let Some(several) = &command.several else { return one(args, told, &command) };
    let mut left = Vec::new();
    for drive in &several.drives {
        match drive.outcome {
            OutcomeWord::Confirmed if runs_again(drive) => {
                left.push(format!("{}: {RUNS_AGAIN}", sentence(told, drive)));
            }
            OutcomeWord::Confirmed if args.is_json() => {}
            OutcomeWord::Confirmed => output::done(output::say(sentence(told, drive)))?,
            // A stop of several asks nothing of those that are only read and stand.
            OutcomeWord::Nothing => {
                if !args.is_json() {
                    output::done(output::say(format_args!("{}: {}", name(drive), why(drive))))?;
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
        OutcomeWord::Confirmed if runs_again(command) => {
            Err(Failure::Drive(format!("{}: {RUNS_AGAIN}", sentence(told, command))))
        }
        OutcomeWord::Confirmed if args.is_json() => Ok(()),
        OutcomeWord::Confirmed => output::done(output::say(sentence(told, command))),
        // Who has no right has asked for the wrong thing.
        OutcomeWord::Refused if command.reason.as_deref() == Some("no_right") => {
            Err(Failure::Input(command.text.clone().unwrap_or_else(why)))
        }
        _ => Err(Failure::Drive(why())),
    }
}

/// Whether somebody has started the motor behind its stop more than once: whoever does so by a cycle does so again.
fn runs_again(command: &CommandView) -> bool {
    command.restarts.is_some_and(|times| times > 1)
}

/// Follows a command until nothing is pending, and says what there is to say meanwhile.
async fn settled(
    mut follower: Follower<impl Source>,
    mut say: impl FnMut(String) -> Result<(), Failure>,
) -> Result<Arc<CommandView>, Failure> {
    let until = Instant::now() + WAITED;
    let mut out_of_sight: Option<(Instant, String)> = None;
    while follower.last().outcome == OutcomeWord::Pending && Instant::now() < until {
        say(match &out_of_sight {
            None => pending(&follower.last()),
            Some((_, why)) => out_of_sight_of(&follower.last(), why),
        })?;
        let tell_at = until.min(Instant::now() + TOLD_EVERY);
        while follower.last().outcome == OutcomeWord::Pending {
            let wake_at =
                out_of_sight.as_ref().map_or(tell_at, |(since, _)| tell_at.min(*since + OUT_OF_SIGHT));
            match timeout_at(wake_at, follower.next()).await {
                Ok(Some(News::Told(_))) => out_of_sight = None,
                Ok(Some(News::OutOfSight(why))) => {
                    out_of_sight = Some((Instant::now(), why));
                    break;
                }
                Ok(Some(News::Gone(why))) => return Err(Failure::Drive(why)),
                Ok(None) => return Ok(follower.last()),
                Err(_) => break,
            }
        }
        if let Some((_, why)) = out_of_sight.take_if(|(since, _)| since.elapsed() >= OUT_OF_SIGHT) {
            return Err(Failure::Drive(why));
        }
    }
    Ok(follower.last())
}

/// What is told while the daemon does not answer: it may be late, and it may be no more.
fn out_of_sight_of(command: &CommandView, why: &str) -> String {
    match command.action {
        ActionWord::Stop => {
            format!("{why}: the motor may turn, use the emergency stop; the daemon is asked again")
        }
        _ => format!("{why}: nobody knows what becomes of it; the daemon is asked again"),
    }
}

/// What is told of a command that is not settled.
fn pending(command: &CommandView) -> String {
    let Some(several) = &command.several else {
        return format!("{} has not confirmed it yet: it goes on", name(command));
    };
    let drives = &several.drives;
    let left = drives.iter().filter(|drive| drive.outcome == OutcomeWord::Pending);
    let left: Vec<&str> = left.map(|drive| name(drive)).collect();
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
    let outcome = match command.outcome {
        OutcomeWord::Nothing => "nothing to be done".to_owned(),
        outcome => outcome.to_string().replace('_', " "),
    };
    match command.text.as_deref() {
        Some(text) if text.starts_with(&outcome) => text.to_owned(),
        Some(text) => format!("{outcome}: {text}"),
        None => outcome,
    }
}

#[cfg(test)]
mod tests {
    use drived_plant::follow::Lost;
    use tokio::time::sleep;

    use super::*;

    /// A daemon that is asked every half second and answers so, the last for ever.
    struct Answers(Vec<Result<&'static str, Lost>>);

    impl Source for Answers {
        async fn news(&mut self) -> Result<Arc<CommandView>, Lost> {
            sleep(ASKED_EVERY).await;
            let next = if self.0.len() > 1 { self.0.remove(0) } else { self.0[0].clone() };
            next.map(stop)
        }
    }

    fn stop(outcome: &str) -> Arc<CommandView> {
        let view = json!({"id": "a", "drive": "fan 1", "action": "stop", "command": "ramp stop", "caller": "local",
            "origin": "socket", "outcome": outcome, "open": outcome == "pending", "time_unix_ms": 1});
        Arc::new(serde_json::from_value(view).unwrap())
    }

    #[tokio::test(start_paused = true)]
    async fn a_daemon_that_is_late_once_is_asked_again_and_one_that_stays_silent_is_given_up() {
        let late = || Err(Lost::ForNow("the daemon does not answer".to_owned()));
        let told = std::cell::RefCell::new(Vec::new());
        let follow = async |answers| {
            told.borrow_mut().clear();
            let say = |text| {
                told.borrow_mut().push(text);
                Ok(())
            };
            settled(Follower::from(Answers(answers), stop("pending")), say).await
        };
        let ended =
            follow(vec![Ok("pending"), late(), late(), Ok("pending"), Ok("confirmed")]).await.unwrap();
        assert_eq!(ended.outcome, OutcomeWord::Confirmed);
        let silent = "the daemon does not answer: the motor may turn, use the emergency stop; the daemon is asked again";
        assert_eq!(*told.borrow(), ["fan 1 has not confirmed it yet: it goes on", silent]);

        let began = Instant::now();
        assert!(matches!(follow(vec![late()]).await, Err(Failure::Drive(_))));
        assert_eq!(began.elapsed(), ASKED_EVERY + OUT_OF_SIGHT);
        let gone = follow(vec![Err(Lost::ForGood("started anew".to_owned()))]).await;
        assert!(matches!(gone, Err(Failure::Drive(_))));
    }

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
