//! The writer of JSON lines. Writing may block for as long as the reader likes, so it has a thread of its own: the fleet
//! goes on meanwhile, and a reader that is slow is told how many events it missed.

use std::{io::Write, time::Duration};

use drive_fleet::{Events, Fleet, Received};
use tokio::{
    sync::{mpsc, oneshot},
    task::JoinHandle,
    time::{Instant, Interval, MissedTickBehavior, interval_at},
};

use super::json;
use crate::failure::Failure;

/// Lines that wait for the writer.
const WAITING: usize = 64;
/// How long the reader of stdout has for the last events.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// Events and snapshots on their way to stdout.
pub(super) struct JsonLines {
    reader: JoinHandle<()>,
    writer: oneshot::Receiver<Result<(), Failure>>,
}

impl JsonLines {
    /// Writes all events, and a snapshot of every drive each period; zero: no snapshots.
    pub(super) fn start(fleet: Fleet, events: Events, snapshots: Duration) -> Self {
        let (lines, waiting) = mpsc::channel(WAITING);
        let reader = tokio::spawn(read(fleet, events, snapshots, lines));
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

async fn read(fleet: Fleet, mut events: Events, snapshots: Duration, lines: mpsc::Sender<String>) {
    let mut ticks = (!snapshots.is_zero()).then(|| {
        let mut ticks = interval_at(Instant::now() + snapshots, snapshots);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        ticks
    });
    loop {
        tokio::select! {
            received = events.recv() => {
                let line = match received {
                    Received::Event(event) => json::event(&event),
                    Received::Missed(events) => json::missed(events),
                    Received::End => return,
                };
                if lines.send(line).await.is_err() {
                    return;
                }
            }
            () = tick(&mut ticks) => {
                for drive in fleet.drives() {
                    if lines.send(json::snapshot(&drive.snapshot())).await.is_err() {
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

fn write(mut lines: mpsc::Receiver<String>) -> Result<(), Failure> {
    let mut stdout = std::io::stdout();
    while let Some(line) = lines.blocking_recv() {
        writeln!(stdout, "{line}").and_then(|()| stdout.flush()).map_err(|error| Failure::output(&error))?;
    }
    Ok(())
}
