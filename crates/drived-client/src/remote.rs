//! A command of the daemon, asked for over a connection.

use std::{sync::Arc, time::Duration};

use axum::http::StatusCode;
use tokio::time::{sleep, timeout};

use super::{Daemon, path_of};
use drived_plant::{
    follow::{Lost, Source},
    plant::views::CommandView,
};
use drived_words::failure::Failure;

/// How long an answer may take before the daemon is asked on another connection.
pub const ANSWERED_WITHIN: Duration = Duration::from_secs(2);

/// A stop that the daemon has not got is told it again, by whoever gives it: so long between two tries, and for so long. The
/// page does the same. What the daemon has it repeats itself until the drive confirms it.
pub const AGAIN: Duration = Duration::from_millis(500);
pub const GIVEN_UP_AFTER: Duration = Duration::from_secs(60);

/// What is asked again and again what became of a command.
pub struct Remote {
    daemon: Daemon,
    path: String,
    every: Duration,
    is_lost: bool,
}

impl Remote {
    /// Asks for a command of this id so often.
    pub fn new(daemon: Daemon, id: &str, every: Duration) -> Self {
        Self { daemon, path: format!("{}?wait=0s", path_of(&["commands", id])), every, is_lost: false }
    }

    async fn asked(&mut self) -> Result<Arc<CommandView>, Lost> {
        let for_now = |failure: Failure| Lost::ForNow(failure.to_string());
        if self.is_lost {
            self.daemon = timely(self.daemon.way().connect()).await.map_err(for_now)?;
            self.is_lost = false;
        }
        let answer = timely(self.daemon.get(&self.path)).await;
        self.is_lost = answer.is_err();
        let answer = answer.map_err(for_now)?;
        match answer.command() {
            Some(command) => Ok(Arc::new(command)),
            None if answer.status == StatusCode::NOT_FOUND => Err(Lost::ForGood(
                "the daemon does not know of this command, it was started anew: ask again".to_owned(),
            )),
            None if answer.status.is_server_error() => Err(for_now(answer.failure())),
            None => Err(Lost::ForGood(answer.failure().to_string())),
        }
    }
}

impl Source for Remote {
    async fn news(&mut self) -> Result<Arc<CommandView>, Lost> {
        sleep(self.every).await;
        self.asked().await
    }
}

/// What does not come in time does not come.
pub async fn timely<T>(answer: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let late = |_| Failure::Drive("the daemon does not answer".to_owned());
    timeout(ANSWERED_WITHIN, answer).await.map_err(late)?
}

#[cfg(test)]
mod tests {
    use axum::{Json, Router, extract::Query, routing::get};
    use serde_json::{Value, json};

    use super::*;
    use crate::Way;

    /// A daemon waits two seconds for the end of a command, unless it is told how long (`wait`).
    #[tokio::test(start_paused = true)]
    async fn a_command_that_is_pending_is_told_as_that_and_not_as_a_daemon_that_is_silent() {
        let command = json!({"id": "a", "drive": "fan 1", "action": "stop", "command": "ramp stop", "caller": "local",
            "origin": "socket", "outcome": "pending", "open": true, "time_unix_ms": 1});
        let pending = async |Query(asked): Query<Value>| {
            if asked["wait"] != "0s" {
                sleep(Duration::from_secs(2)).await;
            }
            Json(command)
        };
        let router = Router::new().route("/api/v1/commands/a", get(pending));
        let every = Duration::from_millis(500);
        let mut remote = Remote::new(Way::here(router).connect().await.unwrap(), "a", every);
        for _ in 0..3 {
            let told = remote.news().await;
            assert!(told.is_ok(), "{told:?}");
        }
    }
}
