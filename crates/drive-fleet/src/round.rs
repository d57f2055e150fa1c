//! [`Round`]: what is told of a stop of several drives waits until each of them has been given its own.

use tokio::sync::watch;

/// The part of one drive in a stop of several. A drive that has gone holds up nobody: its part goes with it.
#[derive(Debug)]
pub(crate) struct Round {
    /// Nothing is sent: they are counted by it.
    part: Option<watch::Sender<()>>,
    all: watch::Receiver<()>,
}

impl Round {
    /// The part of whoever gives the stop. It is dropped when each drive has its own.
    pub(crate) fn begin() -> Self {
        let (part, all) = watch::channel(());
        Self { part: Some(part), all }
    }

    /// The part of one more drive.
    pub(crate) fn part(&self) -> Self {
        Self { part: self.part.clone(), all: self.all.clone() }
    }

    /// The stop of this drive waits for its line, or it needs none.
    pub(crate) fn give(&mut self) {
        self.part = None;
    }

    pub(crate) const fn is_given(&self) -> bool {
        self.part.is_none()
    }

    /// Waits until that of every drive does.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub(crate) async fn all_are_given(&mut self) {
        while self.all.changed().await.is_ok() {}
    }
}
