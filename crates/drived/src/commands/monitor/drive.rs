//! One drive as the daemon has told it, and how old that is now.

use std::time::Duration;

use drive_core::{Control, Direction, Frequency, Setpoint, State, Status};
use serde::de::DeserializeOwned;
use serde_json::Value;
use tokio::time::Instant;

use super::words;
use crate::logging::escaped;

/// A stop that is not confirmed after this time is the worst that can be told of a drive.
const STOP_IS_LATE: Duration = Duration::from_secs(5);

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
    /// For how long a stop had not been confirmed then.
    stop: Option<Duration>,
    heard: Instant,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    Connecting,
    Connected,
    Lost,
}

/// What is wrong with a drive, the worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trouble {
    StopIsLate,
    Tripped,
    Lost,
    /// Another drive than before, or a watchdog that is not as its contract says.
    Changed,
    Warning,
    Old,
    Connecting,
    None,
}

impl Trouble {
    /// Whether somebody should go there.
    pub(super) fn is_severe(self) -> bool {
        self <= Self::Lost
    }

    /// Whether there is anything at all.
    pub(super) fn is_any(self) -> bool {
        self < Self::Connecting
    }
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
            link: match told["link"].as_str() {
                Some("connected") => Link::Connected,
                Some("lost") => Link::Lost,
                _ => Link::Connecting,
            },
            good: status["quality"] == "good",
            age: status["age_ms"].as_u64().map(Duration::from_millis),
            stop: told["stop"].is_object().then(|| milliseconds(&told["stop"]["since_ms"])),
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
        self.stop.is_some()
    }

    pub(super) fn trouble(&self, now: Instant, connected: bool) -> Trouble {
        let stop = self.stop.map(|since| since + self.heard_ago(now));
        let is = |group: &str, check: &str| self.told[group]["check"] == *check;
        if stop.is_some_and(|since| since > STOP_IS_LATE) {
            Trouble::StopIsLate
        } else if self.status.as_ref().is_some_and(Status::is_fault) {
            Trouble::Tripped
        } else if self.link == Link::Lost {
            Trouble::Lost
        } else if is("identity", "changed") || is("watchdog", "broken") {
            Trouble::Changed
        } else if self.status.as_ref().is_some_and(|status| status.warning == Some(true)) {
            Trouble::Warning
        } else if self.link == Link::Connecting {
            Trouble::Connecting
        } else if self.is_live(now, connected) {
            Trouble::None
        } else {
            Trouble::Old
        }
    }

    /// Its state in plain words: a drive that is lost is lost, whatever it showed last.
    pub(super) fn state(&self) -> &'static str {
        match (self.link, &self.status) {
            (Link::Lost, _) => "Lost",
            (Link::Connecting, _) => "Connecting",
            (Link::Connected, None) => "Not known",
            (Link::Connected, Some(_)) if self.stop.is_some() => "Stop pending",
            (Link::Connected, Some(status)) => words::state(status.state),
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
    pub(super) fn remark(&self, now: Instant, connected: bool) -> String {
        let text = |value: &Value| value.as_str().map(escaped);
        match self.trouble(now, connected) {
            Trouble::StopIsLate => {
                format!(
                    "STOP NOT CONFIRMED, sent {} times: the motor may turn",
                    self.told["stop"]["attempts"]
                )
            }
            Trouble::Tripped => {
                text(&self.told["fault"]["meaning"]).unwrap_or_else(|| "no meaning told yet".to_owned())
            }
            Trouble::Lost => text(&self.told["error"]).unwrap_or_else(|| "it does not answer".to_owned()),
            Trouble::Changed if self.told["watchdog"]["check"] == "broken" => {
                let why = text(&self.told["watchdog"]["why"]).unwrap_or_default();
                format!("watchdog not as the contract says: {why}")
            }
            Trouble::Changed => "another drive than before answers at its address".to_owned(),
            Trouble::Warning => "the drive shows an alarm".to_owned(),
            Trouble::Old if connected => "what it shows is old".to_owned(),
            Trouble::Old => String::new(),
            Trouble::Connecting => text(&self.told["error"]).unwrap_or_default(),
            Trouble::None if self.told["control"] == false => "only read".to_owned(),
            Trouble::None => String::new(),
        }
    }
}

fn milliseconds(value: &Value) -> Duration {
    Duration::from_millis(value.as_u64().unwrap_or_default())
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
        warning: status["warning"].as_bool(),
        fault_code: read(&status["fault_code"]),
        control: word("control").and_then(|control| control.parse::<Control>().ok()),
        ..Status::default()
    })
}
