//! What keeps the model fed: the state and then the events, again and again; and what is looked at besides.

use std::time::Duration;

use http_body_util::BodyExt as _;
use tokio::{
    sync::{mpsc::Sender, watch},
    time::{sleep, timeout},
};

use super::{
    happening::Happening,
    model::{News, Wanted},
};
use drived_client::{Answer, Daemon, Frames, Heard, Way, path_of};
use drived_plant::plant::{past::RecordsView, recent::RecentView};
use drived_words::{failure::Failure, json::unix};

/// From a connection that broke to the next try.
const AGAIN: Duration = Duration::from_secs(1);
/// A stream that says nothing for so long is none: there is a sign of life each 5 s.
const SILENT_AFTER: Duration = Duration::from_secs(12);
/// So much is read of what the history has kept, the newest of it: behind any number that there is.
const KEPT: usize = 200;
const NEWEST: i64 = (1 << 53) - 1;
/// Between two readings of what is looked at.
const LOOK: Duration = Duration::from_secs(1);

/// Tells what the daemon tells, whenever it is there.
///
/// # Cancellation
/// Safe to drop.
pub(super) async fn follow(way: Way, news: Sender<News>) {
    loop {
        let why = match streamed(&way, &news).await {
            Ok(()) => continue,
            Err(failure) => failure.to_string(),
        };
        if news.send(News::Interrupted(why)).await.is_err() {
            return;
        }
        sleep(AGAIN).await;
    }
}

/// Tells the state and what comes after it, until there is something that the stream has not told.
async fn streamed(way: &Way, news: &Sender<News>) -> Result<(), Failure> {
    let mut daemon = timely(way.connect()).await?;
    let state = timely(daemon.state()).await?;
    let mut recent: Vec<RecentView> = timely(daemon.read(&["events", "recent"])).await?;
    let since = state.revision;
    // What happened before is told by both, and is taken once.
    recent.retain(|one| one.revision <= since);
    let gone = || Failure::Drive("nobody looks any more".to_owned());
    let kept = before(&mut daemon, recent.first()).await;
    news.send(News::State { state: Box::new(state), recent, kept }).await.map_err(|_| gone())?;
    let answer = timely(daemon.send("GET", &format!("/api/v1/events?since={since}"), None)).await?;
    if !answer.status().is_success() {
        return Err(Failure::Drive(format!("the daemon answers {}", answer.status())));
    }
    let (mut body, mut frames) = (answer.into_body(), Frames::default());
    loop {
        let frame = timeout(SILENT_AFTER, body.frame()).await.map_err(|_| silent())?;
        let Some(Ok(frame)) = frame else { return Err(Failure::Drive("the daemon has ended".to_owned())) };
        for (kind, data) in frames.take(frame.data_ref().map_or(&[][..], |data| data)) {
            match Heard::of(&kind, data) {
                Some(Heard::Reset) => return Ok(()),
                Some(heard) => news.send(News::Heard(heard)).await.map_err(|_| gone())?,
                // What is not understood is told again with the next state.
                None => {}
            }
        }
    }
}

/// What the history has kept of the time before the daemon remembers, the newest last; nothing where none is kept.
async fn before(daemon: &mut Daemon, oldest: Option<&RecentView>) -> Vec<Happening> {
    let oldest = oldest.and_then(|one| Happening::lately(&one.what)).map(|one| one.unix_ms);
    let to = oldest.unwrap_or_else(|| unix(tokio::time::Instant::now()));
    let path = format!(
        "{}?from_unix_ms=0&to_unix_ms={}&before={NEWEST}&limit={KEPT}",
        path_of(&["history", "records"]),
        to.saturating_sub(1)
    );
    let told = timely(daemon.get(&path)).await.and_then(Answer::done::<RecordsView>);
    let records = told.map(|told| told.records).unwrap_or_default();
    records.iter().rev().filter_map(Happening::kept).collect()
}

/// Reads what is wanted, for as long as it is.
///
/// # Cancellation
/// Safe to drop.
pub(super) async fn look(way: Way, mut wanted: watch::Receiver<Option<Wanted>>, news: Sender<News>) {
    let mut connection = None;
    loop {
        let now = wanted.borrow_and_update().clone();
        if let Some(what) = now {
            // What cannot be read now is read the next time; the stream tells why.
            match read(&way, &mut connection, what).await {
                Ok(told) => {
                    if news.send(told).await.is_err() {
                        return;
                    }
                }
                Err(_) => connection = None,
            }
            // Something else is read at once.
            if let Ok(Err(_)) = timeout(LOOK, wanted.changed()).await {
                return;
            }
        } else if wanted.changed().await.is_err() {
            return;
        }
    }
}

async fn read(way: &Way, connection: &mut Option<Daemon>, what: Wanted) -> Result<News, Failure> {
    let daemon = match connection {
        Some(daemon) => daemon,
        None => connection.insert(timely(way.connect()).await?),
    };
    match what {
        Wanted::History(drive) => {
            let history = timely(daemon.read(&["drives", &drive, "history"])).await?;
            Ok(News::History { drive, history })
        }
        Wanted::Line(name) => {
            let line = timely(daemon.read(&["lines", &name])).await?;
            Ok(News::Line(Box::new(line)))
        }
    }
}

async fn timely<T>(answer: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    timeout(SILENT_AFTER, answer).await.map_err(|_| silent())?
}

fn silent() -> Failure {
    Failure::Drive(format!("nothing was heard for {} s", SILENT_AFTER.as_secs()))
}
