//! [`Fleet`]: the handle of it all.

use std::{
    fmt,
    future::poll_fn,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, ready},
    time::Duration,
};

use drive_bus::Line;
use futures_core::Stream;
use futures_util::future::join_all;
use tokio::{
    sync::broadcast::{self, error::RecvError},
    time::Instant,
};

use crate::{
    event::{Event, ExitAction},
    handle::{DriveHandle, Entry},
    plan::LinePlan,
    task::Urgent,
};

/// A line of the fleet.
pub(crate) struct LineEntry {
    pub(crate) name: Arc<str>,
    pub(crate) line: Line,
    pub(crate) plan: LinePlan,
    /// When the commands of groups may use it again; who holds it is using it.
    pub(crate) commands: tokio::sync::Mutex<Instant>,
}

/// Many drives on many lines, each watched by a task of its own. Cheap to clone.
///
/// [`shutdown`](Self::shutdown) is the end that acts by each drive's policy. When the last handle is dropped without it
/// the tasks end and nothing is written: the drives go on until their own watchdogs act.
#[derive(Clone)]
pub struct Fleet {
    inner: Arc<Inner>,
}

struct Inner {
    lines: Vec<LineEntry>,
    entries: Vec<Arc<Entry>>,
    /// The tasks hold the senders, so that readers see the end of the fleet.
    events: broadcast::WeakSender<Event>,
    /// For the first reader, which misses nothing of the start.
    first: Mutex<Option<broadcast::Receiver<Event>>>,
}

impl fmt::Debug for Fleet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let drives: Vec<_> = self.inner.entries.iter().map(|entry| &entry.name).collect();
        f.debug_struct("Fleet").field("drives", &drives).finish_non_exhaustive()
    }
}

impl Fleet {
    pub(crate) fn new(
        lines: Vec<LineEntry>,
        entries: Vec<Arc<Entry>>,
        events: &broadcast::Sender<Event>,
        first: broadcast::Receiver<Event>,
    ) -> Self {
        let (events, first) = (events.downgrade(), Mutex::new(Some(first)));
        Self { inner: Arc::new(Inner { lines, entries, events, first }) }
    }

    /// The drive with a name.
    #[must_use]
    pub fn drive(&self, name: &str) -> Option<DriveHandle> {
        let entry = self.inner.entries.iter().find(|entry| &*entry.name == name)?;
        Some(DriveHandle::new(Arc::clone(entry)))
    }

    /// All drives, in the order in which they were added.
    #[must_use]
    pub fn drives(&self) -> Vec<DriveHandle> {
        self.inner.entries.iter().map(|entry| DriveHandle::new(Arc::clone(entry))).collect()
    }

    /// The lines by their names, in the order in which they were added.
    #[must_use]
    pub fn lines(&self) -> Vec<(Arc<str>, Line)> {
        self.inner.lines.iter().map(|entry| (Arc::clone(&entry.name), entry.line.clone())).collect()
    }

    /// The drives of a line, in the order in which they were added.
    #[must_use]
    pub fn drives_on(&self, line: &str) -> Vec<DriveHandle> {
        let number = self.inner.lines.iter().position(|entry| &*entry.name == line);
        let on_line = self.inner.entries.iter().filter(|entry| Some(entry.line) == number);
        on_line.map(|entry| DriveHandle::new(Arc::clone(entry))).collect()
    }

    /// What happens to the drives, from now on; the first reader gets it from the start of the fleet.
    #[must_use]
    pub fn events(&self) -> Events {
        let first = self.inner.first.lock().unwrap_or_else(PoisonError::into_inner).take();
        Events::new(first.or_else(|| self.inner.events.upgrade().map(|events| events.subscribe())))
    }

    /// The reckoning of a line.
    #[must_use]
    pub fn plan(&self, line: &str) -> Option<LinePlan> {
        self.inner.lines.iter().find(|entry| &*entry.name == line).map(|entry| entry.plan)
    }

    /// Ends the fleet: each drive's policy acts, and what was done is listed. What is not done after `limit` is given up;
    /// a drive that is still stopping then has [`ExitAction::TimeOver`].
    #[must_use = "a drive that was not stopped may run"]
    pub async fn shutdown(&self, limit: Duration) -> Vec<(Arc<str>, ExitAction)> {
        let entries = &self.inner.entries;
        let tell = |message: fn() -> Urgent| {
            for entry in entries {
                // A task that is gone has its action in the watch.
                let _ = entry.urgent.send(message());
            }
        };
        let all_done = || join_all(entries.iter().map(|entry| exit_action(entry)));
        tell(|| Urgent::Exit);
        let actions = match tokio::time::timeout(limit, all_done()).await {
            Ok(actions) => actions,
            Err(_) => {
                tell(|| Urgent::ExitTimeOver);
                all_done().await
            }
        };
        entries.iter().map(|entry| Arc::clone(&entry.name)).zip(actions).collect()
    }

    pub(crate) fn line_entries(&self) -> &[LineEntry] {
        &self.inner.lines
    }

    pub(crate) fn entries(&self) -> &[Arc<Entry>] {
        &self.inner.entries
    }
}

async fn exit_action(entry: &Entry) -> ExitAction {
    let mut exit = entry.exit.clone();
    match exit.wait_for(Option::is_some).await {
        Ok(action) => action.clone().unwrap_or(ExitAction::TimeOver),
        Err(_) => ExitAction::TimeOver,
    }
}

/// A reader of the fleet's events: by [`recv`](Self::recv), or as a [`Stream`] that ends with the fleet.
pub struct Events {
    /// The wait for the next; `None` when the fleet has ended.
    next: Option<Next>,
}

type Next =
    Pin<Box<dyn Future<Output = (Result<Event, RecvError>, broadcast::Receiver<Event>)> + Send + Sync>>;

/// What a reader of events gets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// An event.
    Event(Event),
    /// The reader was slow: so many events are gone. The next is the oldest that is left.
    Missed(u64),
    /// The fleet has ended.
    End,
}

impl Events {
    fn new(receiver: Option<broadcast::Receiver<Event>>) -> Self {
        Self { next: receiver.map(next) }
    }

    /// The next event, or how many were missed.
    ///
    /// # Cancellation
    /// Safe to drop: nothing is lost.
    pub async fn recv(&mut self) -> Received {
        poll_fn(|context| Pin::new(&mut *self).poll_next(context)).await.unwrap_or(Received::End)
    }
}

fn next(mut receiver: broadcast::Receiver<Event>) -> Next {
    Box::pin(async move {
        let received = receiver.recv().await;
        (received, receiver)
    })
}

/// Its items are never [`Received::End`]: the end of the fleet is the end of the stream.
impl Stream for Events {
    type Item = Received;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Received>> {
        let Some(waiting) = &mut self.next else { return Poll::Ready(None) };
        let (received, receiver) = ready!(waiting.as_mut().poll(context));
        self.next = (received != Err(RecvError::Closed)).then(|| next(receiver));
        Poll::Ready(match received {
            Ok(event) => Some(Received::Event(event)),
            Err(RecvError::Lagged(missed)) => Some(Received::Missed(missed)),
            Err(RecvError::Closed) => None,
        })
    }
}

impl fmt::Debug for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Events").finish_non_exhaustive()
    }
}
