//! One press of a stop key: on a connection of its own, told again until the daemon has it, and followed until every drive
//! is accounted for.

use std::time::Duration;

use serde_json::json;
use tokio::{
    sync::mpsc::UnboundedSender,
    time::{Instant, sleep, timeout},
};

use super::{
    account::{Progress, Stop, judged},
    model::News,
    source::Source,
};
use crate::{
    client::{Answer, Daemon, Target, path_of},
    failure::Failure,
};

/// How long the daemon may take to say that it has it, before it is told once more on another connection.
const TAKEN_WITHIN: Duration = Duration::from_secs(2);
/// Between two tries, and how long it is tried.
const AGAIN: Duration = Duration::from_millis(500);
const GIVEN_UP_AFTER: Duration = Duration::from_secs(60);
/// Between two questions what became of it.
const LOOK: Duration = Duration::from_millis(250);

/// Carries out a stop and tells how it goes.
///
/// # Cancellation
/// What the daemon has goes on.
pub(super) async fn carry_out(source: Source, number: u64, stop: Stop, told: UnboundedSender<News>) {
    // Nobody is left to be told when the program ends.
    let tell = |progress| drop(told.send(News::Stop { number, progress }));
    source.allow(&stop);
    let path = match &stop {
        Stop::All => Target::All,
        Stop::One(name) => Target::Drive(name.clone()),
    };
    let path = format!("{}?wait=0", path.path("stop"));
    let until = Instant::now() + GIVEN_UP_AFTER;
    // A stop is carried out each time it arrives, so that it may be told twice.
    let (mut daemon, id) = loop {
        let progress = match given(&source, &path).await {
            Ok((daemon, answer)) => {
                let progress = judged(&answer);
                if let Progress::Answer(told) = &progress {
                    let id = told["id"].as_str().map(str::to_owned);
                    let is_settled = told["outcome"] != "pending";
                    tell(progress);
                    match id {
                        Some(id) if !is_settled => break (daemon, id),
                        _ => return,
                    }
                }
                progress
            }
            Err(failure) => Progress::Again(failure.to_string()),
        };
        let is_over = matches!(progress, Progress::Over(_));
        match progress {
            Progress::Again(why) if Instant::now() >= until => return tell(Progress::Over(why)),
            progress => tell(progress),
        }
        if is_over {
            return;
        }
        sleep(AGAIN).await;
    };
    loop {
        sleep(LOOK).await;
        match timely(daemon.get(&path_of(&["commands", &id]))).await {
            Ok(answer) => {
                let progress = judged(&answer);
                let is_over = match &progress {
                    Progress::Answer(told) => told["outcome"] != "pending",
                    Progress::Over(_) => true,
                    _ => false,
                };
                tell(progress);
                if is_over {
                    return;
                }
            }
            Err(failure) => {
                tell(Progress::OutOfSight(failure.to_string()));
                sleep(AGAIN).await;
                if let Ok(again) = timely(source.way.connect()).await {
                    daemon = again;
                }
            }
        }
    }
}

/// Gives the stop to the daemon, on a new connection.
async fn given(source: &Source, path: &str) -> Result<(Daemon, Answer), Failure> {
    let mut daemon = timely(source.way.connect()).await?;
    let answer = timely(daemon.post(path, &json!({}))).await?;
    Ok((daemon, answer))
}

async fn timely<T>(answer: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let late = |_| Failure::Drive("the daemon does not answer".to_owned());
    timeout(TAKEN_WITHIN, answer).await.map_err(late)?
}
