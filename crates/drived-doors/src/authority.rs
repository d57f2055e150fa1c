//! By what somebody was let in. It is looked at again for as long as he is answered.

use std::time::Duration;

use tokio::{
    sync::watch,
    time::{MissedTickBehavior, interval},
};

use drived_config::rights::Role;

/// From one look to the next, beside those that a change in this program brings: another program changes the file of tokens.
const LOOKED_AT_EVERY: Duration = Duration::from_millis(500);

/// By what somebody was let in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Authority {
    /// By what the door gives to everybody.
    Freely,
    /// By a token, which had this role.
    Token { sha256: String, role: Role },
    /// By a session that was begun with a token.
    Session { secret: String, sha256: String, role: Role },
}

impl Authority {
    /// Waits until it does not hold any more: the token is removed or has another role, the session is ended or is over, or
    /// nobody can tell, as `holds` says. Safe to drop.
    pub(super) async fn ends(self, holds: impl Fn(&Self) -> bool, mut changes: watch::Receiver<()>) {
        if self == Self::Freely {
            return std::future::pending().await;
        }
        let mut looks = interval(LOOKED_AT_EVERY);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        while holds(&self) {
            tokio::select! {
                _ = looks.tick() => {}
                // Where nobody could tell a change any more, the gate has gone.
                changed = changes.changed() => if changed.is_err() { return },
            }
        }
    }
}
