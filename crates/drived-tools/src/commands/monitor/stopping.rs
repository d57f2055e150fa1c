//! One press of a stop key: on a connection of its own, told again until the daemon has it, and followed until nothing more
//! becomes of it.

use std::{sync::Arc, time::Duration};

use serde_json::json;
use tokio::{
    sync::mpsc::UnboundedSender,
    time::{Instant, sleep},
};

use super::{
    account::{Progress, Stop},
    model::News,
    source::Source,
};
use drived_client::{AGAIN, Answer, Daemon, GIVEN_UP_AFTER, Remote, Target, timely};
use drived_plant::follow::{self, Follower};
use drived_words::failure::Failure;

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
    let mut follower = loop {
        let why = match given(&source, &path).await {
            Ok((daemon, answer)) => match answer.command() {
                Some(command) => {
                    let remote = Remote::new(daemon, &command.id, LOOK);
                    break Follower::from(remote, Arc::new(command));
                }
                None if answer.status.is_server_error() => answer.failure().to_string(),
                None => return tell(Progress::Over(answer.failure().to_string())),
            },
            Err(failure) => failure.to_string(),
        };
        if Instant::now() >= until {
            return tell(Progress::Over(why));
        }
        tell(Progress::Again(why));
        sleep(AGAIN).await;
    };
    tell(Progress::Answer(follower.last()));
    while let Some(news) = follower.next().await {
        tell(match news {
            follow::News::Told(command) => Progress::Answer(command),
            follow::News::OutOfSight(why) => Progress::OutOfSight(why),
            follow::News::Gone(why) => Progress::Over(why),
        });
    }
}

/// Gives the stop to the daemon, on a new connection.
async fn given(source: &Source, path: &str) -> Result<(Daemon, Answer), Failure> {
    let mut daemon = timely(source.way.connect()).await?;
    let answer = timely(daemon.post(path, &json!({}))).await?;
    Ok((daemon, answer))
}
