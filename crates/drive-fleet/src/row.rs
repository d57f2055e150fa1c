//! The row in which the drives of a line take their turn, one after the other.

use std::{future::ready, pin::Pin, sync::Arc};

use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};

/// What comes when it is a drive's turn.
type Coming = Pin<Box<dyn Future<Output = Result<OwnedSemaphorePermit, AcquireError>> + Send>>;

/// A drive's place in such a row, which it keeps until it leaves.
pub(crate) struct Row {
    row: Arc<Semaphore>,
    coming: Option<Coming>,
    turn: Option<OwnedSemaphorePermit>,
}

impl Row {
    pub(crate) fn of(row: &Arc<Semaphore>) -> Self {
        Self { row: Arc::clone(row), coming: None, turn: None }
    }

    /// Stands in the row, where it does not yet; whether others are before it.
    pub(crate) fn stand(&mut self) -> bool {
        if self.coming.is_some() {
            return false;
        }
        // Who has had it, and wants it again, comes behind those who wait.
        drop(self.turn.take());
        let free = Arc::clone(&self.row).try_acquire_owned();
        let are_others = free.is_err();
        self.coming = Some(match free {
            Ok(turn) => Box::pin(ready(Ok(turn))),
            Err(_) => Box::pin(Arc::clone(&self.row).acquire_owned()),
        });
        are_others
    }

    /// Gives its turn to the next, or its place.
    pub(crate) fn leave(&mut self) {
        self.coming = None;
        drop(self.turn.take());
    }

    /// Until its turn has come, and for ever where it does not stand in the row.
    pub(crate) async fn come(&mut self) {
        match &mut self.coming {
            // Nobody closes the row.
            Some(coming) => self.turn = coming.await.ok(),
            None => std::future::pending().await,
        }
        self.coming = None;
    }
}
