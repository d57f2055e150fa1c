//! Beyond this machine: what the history keeps is sent on to a database that takes the line protocol of Influx, from the history's own place in what
//! it keeps. An outage of the other side is filled behind it, for as long as values are kept as they were read.

mod batch;
mod line;
mod post;
mod target;

use std::{path::PathBuf, time::Duration};

use tokio::{sync::watch, time::sleep};

pub use self::target::Target;
use self::{
    batch::{Part, next_part},
    post::post,
};
use crate::{
    doubt::ask,
    read::History,
    store::{Place, StoreError},
    write::inbox::Inbox,
};

/// What is sent on, and where to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forward {
    pub target: Target,
    /// The file of the token that it wants, if it wants one.
    pub token: Option<PathBuf>,
}

/// Between two looks at whether there is something new.
const LOOK: Duration = Duration::from_secs(5);
/// Before something that was not taken is tried again, at first and at the longest.
const AGAIN: Duration = Duration::from_secs(1);
const AGAIN_AT_MOST: Duration = Duration::from_secs(30);

/// Sends on what is in the file, until it is dropped. It waits for the other side, and nobody waits for it.
pub async fn run(path: PathBuf, forward: Forward, inbox: Inbox, health: watch::Sender<Option<String>>) {
    let mut place = None;
    // A server that has taken nothing yet may refuse everything for how it was named: a database that is missing is 400 at some.
    let mut has_taken = false;
    loop {
        match look(path.clone(), forward.target.to_string(), place.clone(), inbox.clone()).await {
            Ok(Some(part)) => {
                if let Some(skipped) = part.skipped() {
                    tracing::warn!("{}: {skipped}", forward.target);
                }
                has_taken |= deliver(&forward, &part, has_taken, &health).await;
                let next = part.next;
                if next.is_whole() {
                    inbox.sent(forward.target.to_string(), next.clone());
                }
                place = Some(next);
            }
            // The file is not there yet, or cannot be read now: its own alarm tells that. One that is damaged is put aside.
            Ok(None) | Err(_) => sleep(LOOK).await,
        }
    }
}

async fn look(
    path: PathBuf,
    target: String,
    place: Option<Place>,
    inbox: Inbox,
) -> Result<Option<Part>, StoreError> {
    let read = move || {
        let history = History::open(&path)?;
        let place = match &place {
            Some(place) => place.clone(),
            None => Place::kept(&history.0, &target)?,
        };
        next_part(&history.0, &place)
    };
    let read = tokio::task::spawn_blocking(move || ask(&inbox, read));
    read.await.unwrap_or(Ok(None))
}

/// Sends a part again and again until it is taken, or refused for what is in it by a server that has taken others. Gives whether lines
/// were taken.
async fn deliver(
    forward: &Forward,
    part: &Part,
    has_taken: bool,
    health: &watch::Sender<Option<String>>,
) -> bool {
    let mut wait = AGAIN;
    loop {
        let told = match part.lines.is_empty() {
            true => Ok(()),
            false => post(forward, part.lines.clone()).await,
        };
        let is_taken = told.is_ok() && !part.lines.is_empty();
        let failing = match told {
            Ok(()) => None,
            Err(error) if error.is_of_content && has_taken => {
                tracing::error!("{} refuses a part of what it was sent: {error}", forward.target);
                None
            }
            Err(error) => Some(error.to_string()),
        };
        health.send_if_modified(|known| {
            let is_other = known.is_some() != failing.is_some();
            known.clone_from(&failing);
            is_other
        });
        if failing.is_none() {
            return is_taken;
        }
        sleep(wait).await;
        wait = (wait * 2).min(AGAIN_AT_MOST);
    }
}
