//! A drive in one row: **the words and numbers of it that every table shows, each formatted once**. `status`, the monitor, the
//! picture of `run` and the demo's take from it what fits; the page has the same words from the same JSON.

mod picture;
mod table;
mod text;

use drive_core::{Direction, Frequency, Setpoint, State, Status};
use drive_fleet::{Severity, Shows, view::SnapshotView};
use ratatui::style::Color;
use tokio::time::Instant;

pub use self::{
    picture::{alarm, line_of_plant, old},
    table::Columns,
    text::{fitted, height_of},
};
use drived_plant::plant::views::DriveView;
use drived_words::{logging::escaped, output};

/// A drive that is read so rarely that somebody should know it: then its age stands there though it is live.
const RARELY: std::time::Duration = std::time::Duration::from_secs(3);

/// What is told of a drive behind its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// The word of what it does, with the direction of a motor that turns or the mnemonic of the fault.
    State,
    /// Output and setpoint.
    Frequency,
    /// How old all this is.
    Age,
    Current,
    /// Who commands.
    Control,
}

impl Column {
    /// All of them; those that go first where there is no room stand last.
    pub const ALL: [Self; 5] = [Self::State, Self::Frequency, Self::Age, Self::Current, Self::Control];

    /// What stands above it.
    pub const fn head(self) -> &'static str {
        match self {
            Self::State => "state",
            Self::Frequency => "out/set Hz",
            Self::Age => "age",
            Self::Current => "current",
            Self::Control => "control",
        }
    }
}

/// One drive in words and numbers.
#[derive(Debug, Clone)]
pub struct Row {
    pub name: String,
    /// How badly something troubles it.
    pub trouble: Option<Severity>,
    is_live: bool,
    shows: Shows,
    /// In the order of [`Column::ALL`].
    cells: [String; 5],
    colour: Color,
    /// Its output, with the setpoint, where that is known now.
    bar: Option<(Frequency, Frequency)>,
    /// What is to be said of it: the worst that troubles it. Empty where nothing is.
    pub note: String,
}

impl Row {
    /// A drive as it is known now.
    pub fn of(drive: &DriveView, now: Instant) -> Self {
        Self::told(drive, drive.snapshot.status.is_good(), now, now)
    }

    /// A drive as it was told then; whether that is so now says who knows it.
    pub fn told(drive: &DriveView, is_live: bool, told: Instant, now: Instant) -> Self {
        let known = &drive.snapshot;
        let dated = |text: String| if is_live || text == "-" { text } else { format!("({text})") };
        let status = known.status.value.as_ref();
        let output = status.and_then(|status| status.output_frequency);
        let (setpoint, asked) = match known.setpoint {
            Some(Setpoint::Frequency(frequency)) => (Some(frequency), hertz(frequency)),
            Some(setpoint) => (None, setpoint.to_string()),
            None => (None, "-".to_owned()),
        };
        let as_setpoint = setpoint.is_none_or(|setpoint| Some(setpoint) == output);
        let control = status.and_then(|status| status.control);
        let at = status.and_then(|status| status.at);
        let is_rare = at.is_some_and(|at| told.saturating_duration_since(at) > RARELY);
        let age = match (is_live, at.map(|at| output::age(now.saturating_duration_since(at)))) {
            (true, Some(age)) if is_rare => age,
            (true, _) => "live".to_owned(),
            (false, Some(age)) => format!("{age} old"),
            (false, None) => "-".to_owned(),
        };
        Self {
            name: known.name.to_string(),
            trouble: known.concern().map(|concern| concern.severity),
            is_live,
            shows: known.shows,
            cells: [
                state(known, is_live),
                format!("{}/{asked}", dated(output::or_dash(output.map(hertz)))),
                age,
                dated(output::or_dash(status.and_then(output::current))),
                dated(output::or_dash(control)),
            ],
            colour: status.map_or(Color::Reset, |status| colour(known.shows, status, as_setpoint)),
            bar: output.filter(|_| is_live).map(|output| (output, setpoint.unwrap_or_default())),
            note: note(drive),
        }
    }

    /// One of its cells.
    pub fn cell(&self, column: Column) -> &str {
        self.cells.get(column as usize).map_or("", String::as_str)
    }

    /// Whether somebody should see to it.
    pub fn is_in_trouble(&self) -> bool {
        self.trouble.is_some_and(Severity::is_trouble)
    }
}

/// What a drive does in words, with the direction of a motor that turns or the mnemonic of the fault: in brackets where it
/// was so.
fn state(drive: &SnapshotView, is_live: bool) -> String {
    let shows = drive.shows;
    if !shows.is_of_the_drive() {
        return shows.to_string();
    }
    let status = drive.status.value.as_ref();
    let turning = status.filter(|status| !status.is_undriven() && shows != Shows::StopPending);
    let more = fault(drive).or_else(|| Some(direction(turning?.direction?).to_owned()));
    let text = more.map_or_else(|| shows.to_string(), |more| format!("{shows} {more}"));
    if is_live { text } else { format!("({text})") }
}

/// The mnemonic of the present fault, or its code.
pub fn fault(drive: &SnapshotView) -> Option<String> {
    let status = drive.status.value.as_ref().filter(|status| status.is_fault())?;
    let told = drive.fault.as_ref().and_then(|trip| trip.fault);
    let mnemonic = told.and_then(|fault| Some(escaped(fault.entry?.mnemonic)));
    mnemonic.or_else(|| Some(told.map(|fault| fault.code).or(status.fault_code)?.to_string()))
}

/// What is to be said of a drive behind its numbers.
pub fn note(drive: &DriveView) -> String {
    match drive.snapshot.concern() {
        Some(concern) => escaped(&concern.text),
        None if !drive.control => "only read".to_owned(),
        None => String::new(),
    }
}

/// All that a drive shows, in a sentence: in brackets where it was so.
pub fn sentence(drive: &SnapshotView, is_live: bool) -> String {
    let shows = drive.shows;
    match (is_live, &drive.status.value) {
        (true, Some(status)) if shows == Shows::StopPending => format!("{shows}: {status}"),
        (true, Some(status)) => status.to_string(),
        (false, Some(status)) if shows.is_of_the_drive() => format!("not live: ({status})"),
        (false, Some(status)) => format!("{shows}: ({status})"),
        (_, None) => shows.to_string(),
    }
}

/// Running is green at the reference. A drive that does not tell whether it is there is there when its output is as the
/// setpoint.
fn colour(shows: Shows, status: &Status, as_setpoint: bool) -> Color {
    match (status.state, status.at_reference.or(Some(as_setpoint))) {
        (State::Fault | State::FaultReaction | State::Unknown, _) => Color::Red,
        _ if shows == Shows::StopPending => Color::Yellow,
        (State::Running, Some(true)) => Color::Green,
        (State::Running, _) => Color::Cyan,
        (State::Stopping | State::QuickStop, _) => Color::Yellow,
        (State::NotReady | State::Disabled | State::Ready, _) => Color::Gray,
    }
}

/// As keypads have it.
const fn direction(direction: Direction) -> &'static str {
    match direction {
        Direction::Forward => "fwd",
        Direction::Reverse => "rev",
    }
}

/// With one decimal, rounded up.
pub fn hertz(frequency: Frequency) -> String {
    let tenths = frequency.centihertz().div_ceil(10);
    format!("{}.{}", tenths / 10, tenths % 10)
}

#[cfg(test)]
mod tests {
    use super::*;
    use drived_plant::plant::testing::read;

    #[tokio::test(start_paused = true)]
    async fn an_old_value_is_never_shown_as_if_it_were_live() {
        let mut told = drived_plant::plant::testing::told("pump 1");
        told["shows"] = "running".into();
        told["status"] = serde_json::json!({"quality": "good", "age_ms": 120, "state": "running",
            "direction": "forward", "output_frequency_hz": 30.0, "current_a": 3.1, "control": "bus", "raw": []});
        let cells = |told: &serde_json::Value| {
            let row = Row::of(&read(told), Instant::now());
            Column::ALL.map(|column| row.cell(column).to_owned())
        };
        assert_eq!(cells(&told), ["running fwd", "30.0/-", "live", "3.1 A", "bus"]);
        told["status"]["quality"] = "stale".into();
        told["status"]["age_ms"] = 21_000.into();
        assert_eq!(cells(&told), ["(running fwd)", "(30.0)/-", "21 s old", "(3.1 A)", "(bus)"]);
        (told["shows"], told["link"]) = ("lost".into(), "lost".into());
        assert_eq!(cells(&told), ["lost", "(30.0)/-", "21 s old", "(3.1 A)", "(bus)"]);
        told["status"] = serde_json::json!({"quality": "missing"});
        assert_eq!(cells(&told), ["lost", "-/-", "-", "-", "-"]);
    }
}
