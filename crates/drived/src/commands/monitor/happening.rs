//! What has happened: a command with what became of it, a trip, a drive lost or back.

use serde_json::Value;

use super::words;
use crate::logging::escaped;

/// Which of them are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    All,
    Commands,
    Alarms,
}

impl Kind {
    pub(super) const fn next(self) -> Self {
        match self {
            Self::All => Self::Commands,
            Self::Commands => Self::Alarms,
            Self::Alarms => Self::All,
        }
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::All => "everything",
            Self::Commands => "commands",
            Self::Alarms => "alarms",
        }
    }
}

/// One of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Happening {
    pub(super) unix_ms: u64,
    /// Whom it concerns; empty where that is the program.
    pub(super) drive: String,
    pub(super) text: String,
    /// Whether somebody has to see to it.
    pub(super) is_alarm: bool,
    /// The id of a command.
    command: Option<String>,
    is_command: bool,
}

impl Happening {
    /// Takes what the daemon told; `None` where that is neither a command nor an event.
    pub(super) fn told(kind: &str, told: &Value) -> Option<Self> {
        let text = |key: &str| told[key].as_str().map(escaped).unwrap_or_default();
        let unix_ms = told["time_unix_ms"].as_u64()?;
        Some(match kind {
            "command" => {
                let outcome = told["outcome"].as_str().unwrap_or("unknown");
                Self {
                    unix_ms,
                    drive: match told["group"].as_str() {
                        Some(group) => format!("group {}", escaped(group)),
                        None if told["drive"].is_null() => "all drives".to_owned(),
                        None => text("drive"),
                    },
                    text: command(told, outcome),
                    is_alarm: !["confirmed", "pending", "superseded"].contains(&outcome),
                    command: Some(text("id")),
                    is_command: true,
                }
            }
            "event" | "notice" => Self {
                unix_ms,
                drive: text("drive"),
                text: text("text").trim_start_matches("command: ").to_owned(),
                is_alarm: told["alarm"] == true,
                command: None,
                is_command: told["event"] == "command",
            },
            _ => return None,
        })
    }

    pub(super) const fn is(&self, kind: Kind) -> bool {
        match kind {
            Kind::All => true,
            Kind::Commands => self.is_command,
            Kind::Alarms => self.is_alarm,
        }
    }

    /// Whether both tell of one command.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.command.is_some() && (&self.command, self.unix_ms) == (&other.command, other.unix_ms)
    }

    /// All of it but the time.
    pub(super) fn sentence(&self) -> String {
        let alarm = if self.is_alarm { "ALARM " } else { "" };
        let drive = if self.drive.is_empty() { "the program" } else { &self.drive };
        format!("{alarm}{drive}: {}", self.text)
    }
}

/// What was asked, by whom, from where, what became of it, and how long that took.
fn command(told: &Value, outcome: &str) -> String {
    let text = |key: &str| told[key].as_str().map(escaped);
    let what = text("command").or_else(|| text("action")).unwrap_or_default();
    let who: Vec<String> = [text("caller"), text("origin")].into_iter().flatten().collect();
    let count = |key: &str, what: &str| told[key].as_u64().map(|count| format!("{count} {what}"));
    let counts = [
        count("confirmed", "confirmed"),
        count("pending", "pending"),
        count("not_reachable", "not reachable"),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    let took = told["took_ms"].as_u64().filter(|_| outcome != "pending");
    let parts = [
        format!("{what} by {}", who.join(", ")),
        words::outcome(outcome).to_owned(),
        counts.join(", "),
        text("text").filter(|_| outcome != "confirmed").unwrap_or_default(),
        took.map(|took| format!("after {took} ms")).unwrap_or_default(),
    ];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ")
}
