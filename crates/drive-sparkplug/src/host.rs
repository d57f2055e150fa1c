//! The primary host: without it nobody acts on what an edge node says, so it says nothing.

use serde::Deserialize;

/// What a host says of itself on `spBv1.0/STATE/host`. Other keys are no error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(crate) struct HostState {
    online: bool,
    /// Milliseconds since 1970, UTC: when it connected, or when it left.
    timestamp: u64,
}

/// What a state changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Heard {
    Online,
    Offline,
    /// It is older than what was heard before.
    Outdated,
}

/// The host as it was heard on this connection. Each server has its own times: what was heard on another says nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Host {
    latest: Option<HostState>,
}

impl Host {
    pub(crate) fn is_online(&self) -> bool {
        self.latest.is_some_and(|state| state.online)
    }

    pub(crate) fn handle(&mut self, state: HostState) -> Heard {
        if self.latest.is_some_and(|latest| state.timestamp < latest.timestamp) {
            return Heard::Outdated;
        }
        self.latest = Some(state);
        if state.online { Heard::Online } else { Heard::Offline }
    }
}
