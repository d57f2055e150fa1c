//! One drive as the daemon has told it, and how old that is now.

use std::time::Duration;

use drive_core::{Control, Direction, Frequency, Setpoint, State, Status};
use drive_fleet::{Link, Severity, view::ConcernView};
use serde::de::DeserializeOwned;
use serde_json::Value;
use tokio::time::Instant;

use crate::{client, logging::escaped};

/// What was heard longer ago is old, whatever it says of itself: a drive of which nothing changes is told anew each 5 s.
const HEARD_WITHIN: Duration = Duration::from_secs(12);

/// A line with many drives reads each of them so rarely that somebody should know it.
const RARELY: Duration = Duration::from_secs(3);

/// What a drive is told to be, and when that was heard.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) name: String,
    pub(super) line: String,
    /// What it showed last; it may be old.
    pub(super) status: Option<Status>,
    pub(super) setpoint: Option<Setpoint>,
    /// Everything, as the daemon has told it.
    pub(super) told: Value,
    link: Link,
    /// Whether the daemon held the status for good.
    good: bool,
    /// How old it was then.
    age: Option<Duration>,
    /// Whether a stop was not confirmed then.
    stop: bool,
    concerns: Vec<ConcernView>,
    heard: Instant,
}

impl Drive {
    /// Takes what was told of a drive; `None` where that is no drive.
    pub(super) fn told(told: Value, heard: Instant) -> Option<Self> {
        let status = &told["status"];
        Some(Self {
            name: told["name"].as_str()?.to_owned(),
            line: told["line"].as_str().unwrap_or_default().to_owned(),
            status: status_of(status),
            setpoint: read(&told["setpoint"]),
            link: read(&told["link"]).unwrap_or_default(),
            good: status["quality"] == "good",
            age: status["age_ms"].as_u64().map(Duration::from_millis),
            stop: told["stop"].is_object(),
            concerns: client::concerns(&told),
            heard,
            told,
        })
    }

    /// Whether what it shows is what it shows now, as far as whoever is connected can know.
    pub(super) fn is_live(&self, now: Instant, connected: bool) -> bool {
        connected && self.good && self.heard_ago(now) < HEARD_WITHIN
    }

    /// Whether the status was old when it was told, though the line has no newer one: then its age is told too.
    pub(super) fn is_rarely_read(&self) -> bool {
        self.age.is_some_and(|age| age > RARELY)
    }

    /// How old the status is.
    pub(super) fn age(&self, now: Instant) -> Option<Duration> {
        self.age.map(|age| age + self.heard_ago(now))
    }

    /// How long ago all this was told.
    pub(super) fn heard_ago(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.heard)
    }

    /// Whether a stop of it is not confirmed.
    pub(super) const fn stop_is_pending(&self) -> bool {
        self.stop
    }

    /// All that troubles it, the worst first.
    pub(super) fn concerns(&self) -> &[ConcernView] {
        &self.concerns
    }

    /// The worst that troubles it.
    pub(super) fn concern(&self) -> Option<&ConcernView> {
        self.concerns.first()
    }

    /// Its place among all: who troubles nobody comes last.
    pub(super) fn rank(&self) -> usize {
        self.concern().map_or(usize::MAX, |concern| concern.rank)
    }

    /// Whether somebody should see to it.
    pub(super) fn is_in_trouble(&self) -> bool {
        self.concern().is_some_and(|concern| concern.severity.is_trouble())
    }

    /// Whether somebody should go there now.
    pub(super) fn is_alarming(&self) -> bool {
        self.concern().is_some_and(|concern| concern.severity == Severity::Alarm)
    }

    /// Whether it does not answer.
    pub(super) fn is_lost(&self) -> bool {
        self.link == Link::Lost
    }

    /// Its state in plain words: a drive that is lost is lost, whatever it showed last.
    pub(super) fn state(&self) -> String {
        match (self.link, &self.status) {
            (Link::Lost | Link::Connecting, _) => self.link.to_string(),
            (Link::Connected, None) => "not known".to_owned(),
            (Link::Connected, Some(_)) if self.stop => "stop pending".to_owned(),
            (Link::Connected, Some(status)) => status.state.to_string(),
        }
    }

    /// The mnemonic of the present fault, or what is known of it.
    pub(super) fn fault(&self) -> Option<String> {
        let status = self.status.as_ref().filter(|status| status.is_fault())?;
        let code = || self.told["fault"]["code"].as_u64().or(status.fault_code.map(u64::from));
        let mnemonic = self.told["fault"]["mnemonic"].as_str().map(escaped);
        Some(mnemonic.or_else(|| code().map(|code| code.to_string())).unwrap_or_else(|| "yes".to_owned()))
    }

    /// What is to be said of it in a sentence; empty where nothing is.
    pub(super) fn remark(&self) -> String {
        match self.concern() {
            Some(concern) => escaped(&concern.text),
            None if self.told["control"] == false => "only read".to_owned(),
            None => String::new(),
        }
    }
}

/// A value of one of the library's own types; `None` where there is none, or none that this program knows.
pub(super) fn read<T: DeserializeOwned>(value: &Value) -> Option<T> {
    serde_json::from_value(value.clone()).ok()
}

/// The status in the library's own type, so that it is drawn as everywhere. Its raw words stay where they are.
pub(super) fn status_of(status: &Value) -> Option<Status> {
    let word = |key: &str| status[key].as_str();
    Some(Status {
        state: word("state")?.parse().unwrap_or(State::Unknown),
        direction: word("direction").and_then(|direction| direction.parse::<Direction>().ok()),
        output_frequency: read::<Frequency>(&status["output_frequency_hz"]),
        current: read(&status["current_a"]),
        current_share: read(&status["current_percent"]),
        at_reference: status["at_reference"].as_bool(),
        motion: read(&status["motion"]).unwrap_or_default(),
        warning: status["warning"].as_bool(),
        fault_code: read(&status["fault_code"]),
        control: word("control").and_then(|control| control.parse::<Control>().ok()),
        ..Status::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::testing::every_pair_of_troubles;

    #[tokio::test(start_paused = true)]
    async fn of_every_pair_of_troubles_the_worst_is_told_as_by_everybody() {
        let now = Instant::now();
        for (_, told, worst) in every_pair_of_troubles(now) {
            assert_eq!(Drive::told(told, now).map(|drive| drive.remark()), Some(worst));
        }
    }
}
