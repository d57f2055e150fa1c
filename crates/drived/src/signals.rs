//! Being asked to end: Ctrl-C, and SIGTERM where there is one.

use std::io;

use crate::failure::Failure;

/// Hears the requests to end from when it is made, so that none is lost between two waits.
pub(crate) struct Ending {
    /// When a test asks.
    #[cfg(test)]
    at: Option<tokio::time::Instant>,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
}

impl Ending {
    #[cfg(unix)]
    pub(crate) fn listen() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        let listen = |kind| signal(kind).map_err(|error| cannot_listen(&error));
        Ok(Self {
            #[cfg(test)]
            at: None,
            interrupt: listen(SignalKind::interrupt())?,
            terminate: listen(SignalKind::terminate())?,
        })
    }

    #[cfg(not(unix))]
    pub(crate) fn listen() -> Result<Self, Failure> {
        Ok(Self {
            #[cfg(test)]
            at: None,
        })
    }

    /// Asks once, at this time.
    #[cfg(test)]
    pub(crate) const fn at(&mut self, at: tokio::time::Instant) {
        self.at = Some(at);
    }

    /// Waits until the program is asked to end. Safe to drop.
    #[cfg(unix)]
    pub(crate) async fn asked(&mut self) {
        #[cfg(test)]
        if let Some(at) = self.at {
            tokio::time::sleep_until(at).await;
            self.at = None;
            return;
        }
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }

    /// Waits until the program is asked to end. Safe to drop.
    #[cfg(not(unix))]
    pub(crate) async fn asked(&mut self) {
        if let Err(error) = tokio::signal::ctrl_c().await {
            tracing::warn!("{}", cannot_listen(&error));
            std::future::pending().await
        }
    }
}

fn cannot_listen(error: &io::Error) -> Failure {
    Failure::Input(format!("cannot listen to Ctrl-C: {error}"))
}
