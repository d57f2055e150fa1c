//! What has happened: a command with what became of it, a trip, a drive lost or back.

use super::words;
use drived_plant::plant::{
    commands::OutcomeWord,
    past::RecordView,
    recent::Happened,
    views::{CommandView, HappenedView, SeveralView},
};
use drived_words::logging::escaped;

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
    /// Takes what happened lately.
    pub(super) fn lately(what: &Happened) -> Option<Self> {
        match what {
            Happened::Command(told) => Some(Self::commanded(told)),
            what => what.event().map(|event| Self::happened(&event)),
        }
    }

    /// Takes what the history has kept; nothing where that is told otherwise.
    pub(super) fn kept(record: &RecordView) -> Option<Self> {
        let body = record.body.as_ref()?.get();
        match &*record.kind {
            "command" => serde_json::from_str(body).ok().map(|told| Self::commanded(&told)),
            "event" | "notice" => serde_json::from_str(body).ok().map(|told| Self::happened(&told)),
            _ => None,
        }
    }

    /// Takes what became of a command.
    pub(super) fn commanded(told: &CommandView) -> Self {
        let drive = match (&told.group, &told.drive) {
            (Some(group), _) => format!("group {}", escaped(group)),
            (None, Some(drive)) => escaped(drive),
            (None, None) if !told.selected.is_empty() => format!("{} drives", told.selected.len()),
            (None, None) => "all drives".to_owned(),
        };
        let is_alarm =
            !matches!(told.outcome, OutcomeWord::Confirmed | OutcomeWord::Pending | OutcomeWord::Superseded);
        let (unix_ms, command) = (told.time_unix_ms, Some(told.id.clone()));
        Self { unix_ms, drive, text: sentence(told), is_alarm, command, is_command: true }
    }

    /// Takes what happened to a drive or to the program.
    pub(super) fn happened(told: &HappenedView) -> Self {
        let of_command = told.text.strip_prefix("command: ");
        Self {
            unix_ms: told.time_unix_ms,
            drive: told.drive.as_deref().map(escaped).unwrap_or_default(),
            text: escaped(of_command.unwrap_or(&told.text)),
            is_alarm: told.alarm,
            command: None,
            is_command: of_command.is_some(),
        }
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
fn sentence(told: &CommandView) -> String {
    let counts = told.several.as_ref().map(|several| {
        let SeveralView { confirmed, pending, not_reachable, .. } = several;
        format!("{confirmed} confirmed, {pending} pending, {not_reachable} not reachable")
    });
    let took = told.took_ms.filter(|_| told.outcome != OutcomeWord::Pending);
    let parts = [
        format!("{} by {}, {}", escaped(&told.command), escaped(&told.caller), escaped(&told.origin)),
        words::outcome(told.outcome),
        counts.unwrap_or_default(),
        told.text.as_deref().map(escaped).unwrap_or_default(),
        took.map(|took| format!("after {took} ms")).unwrap_or_default(),
    ];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ")
}
