//! Whether a drive's settings start its motor again by themselves, and whether that is accepted.

use std::sync::Arc;

use drive_core::{Error, Result, SelfRestart};
use tokio::time::Instant;

use super::{AGAIN, Checks};
use crate::event::EventKind;

impl Checks {
    /// Which settings start the drive again by themselves, once they have been read.
    pub(crate) const fn restarts(&self) -> Option<&Arc<[SelfRestart]>> {
        self.restarts.as_ref()
    }

    /// Whether the settings accept all of them.
    pub(crate) fn restarts_accepted(&self) -> bool {
        let accepts = |restart: &SelfRestart| self.accepted_restarts.iter().any(|code| code == restart.code);
        self.restarts.iter().flat_map(|by| by.iter()).all(accepts)
    }

    pub(crate) fn handle_restarts(
        &mut self,
        now: Instant,
        result: Result<Vec<SelfRestart>>,
    ) -> Option<EventKind> {
        self.restarts_at = matches!(result, Err(Error::Port { .. })).then_some(now + AGAIN);
        let by: Arc<[SelfRestart]> = result.ok()?.into();
        self.restarts = Some(Arc::clone(&by));
        let accepted = self.restarts_accepted();
        (!by.is_empty()).then_some(EventKind::RestartsItself { by, accepted })
    }
}
