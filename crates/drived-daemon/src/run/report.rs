//! What stdout is told, as JSON lines or as text. Writing may block for as long as the reader likes, so it has a thread of
//! its own: the fleet goes on meanwhile, and a reader that is slow is told how many events it missed.

use std::{
    collections::BTreeMap,
    io::{self, Write as _},
    sync::Arc,
    time::Duration,
};

use drive_fleet::{Events, Fleet, Received, Snapshot, view::SnapshotView};
use tokio::{
    sync::{mpsc, oneshot},
    task::JoinHandle,
    time::{Instant, Interval, MissedTickBehavior, interval_at},
};

use super::json;
use drived_screen::row;
use drived_words::failure::Failure;

/// Lines that wait for the writer.
const WAITING: usize = 64;
/// How long the reader of stdout has for the last events.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// What stdout is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// A program: every event and every snapshot.
    Json,
    /// A person, who reads the events in the log: what the drives show, where it has changed.
    Text,
    /// The table of a terminal, which shows both: nothing more.
    Table,
}

/// Events and snapshots on their way to stdout.
pub(super) struct Report {
    reader: JoinHandle<()>,
    writer: oneshot::Receiver<Result<(), Failure>>,
}

impl Report {
    /// Writes all events, and a snapshot of every drive each period; zero: no snapshots.
    pub(super) fn start(fleet: Fleet, events: Events, snapshots: Duration, form: Form) -> Self {
        let (lines, waiting) = mpsc::channel(WAITING);
        let reader =
            tokio::spawn(read(fleet, events, snapshots, Writer { form, lines, shown: BTreeMap::new() }));
        let (ended, writer) = oneshot::channel();
        // Not a thread of the runtime, which would wait at its end for a reader that never reads again.
        std::thread::spawn(move || {
            let _ = ended.send(write(waiting));
        });
        Self { reader, writer }
    }

    /// Waits until nobody reads stdout any more. Safe to drop.
    pub(super) async fn ended(&mut self) -> Result<(), Failure> {
        (&mut self.writer).await.unwrap_or(Err(Failure::OutputClosed))
    }

    /// Writes what is left of the events of a fleet that has ended, if they find a reader in time.
    pub(super) async fn finish(self) {
        let Self { reader, writer } = self;
        let rest = async {
            // Either may have ended before; the fleet does not depend on them.
            let _ = reader.await;
            let _ = writer.await;
        };
        if tokio::time::timeout(LAST_WORDS, rest).await.is_err() {
            tracing::warn!("stdout is not read: the last events are lost");
        }
    }
}

/// Puts what is told into lines.
struct Writer {
    form: Form,
    lines: mpsc::Sender<String>,
    /// What the text said of each drive last.
    shown: BTreeMap<Arc<str>, String>,
}

impl Writer {
    fn of_received(&self, received: &Received) -> Option<String> {
        match (received, self.form) {
            (Received::Event(event), Form::Json) => Some(json::event(event)),
            (Received::Missed(events), Form::Json) => Some(json::missed(*events)),
            (Received::Event(_) | Received::Missed(_), Form::Text | Form::Table) | (Received::End, _) => None,
        }
    }

    fn of_snapshot(&mut self, snapshot: &Snapshot) -> Option<String> {
        match self.form {
            Form::Json => return Some(json::snapshot(snapshot)),
            Form::Table => return None,
            Form::Text => {}
        }
        let text = text(snapshot);
        let known = self.shown.insert(Arc::clone(&snapshot.name), text.clone());
        (known.as_ref() != Some(&text)).then(|| format!("{:<16} {text}", snapshot.name))
    }

    /// Whether somebody still takes lines.
    async fn write(&self, line: Option<String>) -> bool {
        match line {
            Some(line) => self.lines.send(line).await.is_ok(),
            None => true,
        }
    }
}

/// What a person reads of a drive.
pub(super) fn text(snapshot: &Snapshot) -> String {
    let known = SnapshotView::from(snapshot);
    row::sentence(&known, known.status.is_good())
}

async fn read(fleet: Fleet, mut events: Events, snapshots: Duration, mut writer: Writer) {
    let mut ticks = (!snapshots.is_zero()).then(|| {
        let mut ticks = interval_at(Instant::now() + snapshots, snapshots);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        ticks
    });
    loop {
        tokio::select! {
            received = events.recv() => {
                if received == Received::End || !writer.write(writer.of_received(&received)).await {
                    return;
                }
            }
            () = tick(&mut ticks) => {
                for drive in fleet.drives() {
                    let line = writer.of_snapshot(&drive.snapshot());
                    if !writer.write(line).await {
                        return;
                    }
                }
            }
        }
    }
}

async fn tick(ticks: &mut Option<Interval>) {
    match ticks {
        Some(ticks) => {
            ticks.tick().await;
        }
        None => std::future::pending().await,
    }
}

/// Writes until nobody is left to read. What cannot be written for another reason, such as a full disk, is lost, and what
/// comes after it is tried again.
fn write(mut lines: mpsc::Receiver<String>) -> Result<(), Failure> {
    let mut stdout = std::io::stdout();
    let mut failing = false;
    while let Some(line) = lines.blocking_recv() {
        // A line of which only a part could be written must not run into the next.
        let start = if failing { "\n" } else { "" };
        match writeln!(stdout, "{start}{line}").and_then(|()| stdout.flush()) {
            Ok(()) => failing = false,
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Err(Failure::OutputClosed),
            Err(error) => {
                if !failing {
                    tracing::warn!(%error, "stdout cannot be written: events and snapshots are lost");
                }
                failing = true;
            }
        }
    }
    Ok(())
}
