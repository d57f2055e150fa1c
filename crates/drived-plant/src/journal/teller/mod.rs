//! Decides what is told, when and how: a pure machine. Time is an argument, it does no input or output.

mod drives;
mod lines;
mod telling;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use drive_core::Frequency;
use drive_fleet::{Event, EventKind, Snapshot};
use tokio::time::Instant;
use tracing::Level;

pub(super) use self::lines::LineLook;
use super::{Entry, noise::Noise, repeats::Repeats, words::Span};

/// How long drives that share a fate are waited for, to be told together.
const TOGETHER: Duration = Duration::from_secs(3);
/// A fault that goes within this time after a reset went by the reset.
const RESET: Duration = Duration::from_secs(5);
/// What belongs to one moment is told within this time.
const MOMENT: Duration = Duration::from_millis(200);

/// What follows the name of a drive without a colon.
const VERBS: [&str; 5] = ["lost", "back", "connected", "tripped", "shows"];

/// What is known of a line.
struct LineState {
    name: String,
    drives: Vec<(Arc<str>, u8)>,
    /// Since when its port is away, and whether that was told.
    away: Option<(Instant, bool)>,
    noise: Noise,
}

/// What is known of a drive.
#[derive(Default)]
struct DriveState {
    line: usize,
    seen: bool,
    tripped: bool,
    /// Since when it has not been heard, and how fast its motor turned then.
    lost: Option<(Instant, Option<Frequency>)>,
    /// It was lost with its line.
    with_line: bool,
    /// When it was last lost or came back.
    changed_at: Option<Instant>,
    /// A stop is not confirmed, since this time, and that was told.
    stop_alarm: Option<Instant>,
    identity: Option<String>,
    /// Its watchdog was verified, and that was told.
    watchdog: bool,
    /// When it was reset last.
    reset_at: Option<Instant>,
}

/// What is told as soon as more is known of it, and without that when its time is over.
struct Held {
    until: Instant,
    drive: Arc<str>,
    what: What,
}

enum What {
    /// Whether it is news, and the drive's own number of the fault.
    Trip {
        when: When,
        is_new: bool,
        code: Option<u16>,
    },
    FaultCleared,
    StopUnconfirmed {
        since: Duration,
        attempts: u32,
        outcome: String,
    },
}

/// When a trip was seen.
#[derive(Clone, Copy)]
enum When {
    /// When the drive was first heard.
    First,
    /// When it came back after this time, alone or with its line.
    Back(Duration),
    /// While it was heard, and its motor turned so fast.
    Heard(Option<Frequency>),
}

/// What drives of a line share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fate {
    Connected,
    Identified,
    Silent,
    Lost,
    Back,
    AtExit,
}

/// Those that share it, since the first was told.
struct Together {
    until: Instant,
    level: Level,
    longest: Duration,
    drives: Vec<(Arc<str>, String)>,
}

pub(super) struct Teller {
    lines: Vec<LineState>,
    drives: BTreeMap<Arc<str>, DriveState>,
    held: Vec<Held>,
    together: BTreeMap<(usize, Fate), Together>,
    repeats: Repeats,
    entries: VecDeque<Entry>,
    began: Instant,
}

impl Teller {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            lines: Vec::new(),
            drives: BTreeMap::new(),
            held: Vec::new(),
            together: BTreeMap::new(),
            repeats: Repeats::default(),
            entries: VecDeque::new(),
            began: now,
        }
    }

    /// A line has these drives, by name and address. Lines and drives that are gone are remembered: what is told of their
    /// end has their names.
    pub(super) fn handle_members(&mut self, now: Instant, line: &str, drives: Vec<(Arc<str>, u8)>) {
        let index = self.index_of(line).unwrap_or(self.lines.len());
        for (drive, _) in &drives {
            self.state(drive).line = index;
        }
        match self.lines.get_mut(index) {
            Some(line) => line.drives = drives,
            None => {
                self.lines.push(LineState {
                    name: line.to_owned(),
                    drives,
                    away: None,
                    noise: Noise::new(now),
                });
            }
        }
    }

    fn index_of(&self, line: &str) -> Option<usize> {
        self.lines.iter().position(|other| other.name == line)
    }

    /// What is to be told, in order.
    pub(super) fn poll_entry(&mut self) -> Option<Entry> {
        self.entries.pop_front()
    }

    /// Something happened to a drive, which is so now.
    pub(super) fn handle_event(&mut self, now: Instant, event: &Event, snapshot: &Snapshot) {
        let drive = &event.drive;
        match &event.kind {
            EventKind::Connected(status) => self.connected(now, drive, status, snapshot),
            EventKind::Lost { silent_for, error } => {
                self.lost(now, drive, *silent_for, error.as_ref(), snapshot);
            }
            EventKind::Tripped(trip) => self.tripped(now, drive, trip),
            EventKind::TripExplained(trip) => self.explained(now, drive, trip),
            EventKind::FaultChanged(trip) => self.fault_changed(now, drive, trip),
            EventKind::FaultCleared => {
                let state = self.state(drive);
                let is_news = std::mem::take(&mut state.tripped);
                let was_reset = state.reset_at.is_some_and(|at| now.saturating_duration_since(at) <= RESET);
                if is_news && !was_reset {
                    self.hold(now + MOMENT, drive, What::FaultCleared);
                }
            }
            EventKind::StopUnconfirmed { since, attempts, outcome } => {
                self.state(drive).stop_alarm = Some(now.checked_sub(*since).unwrap_or(now));
                let (since, attempts, outcome) = (*since, *attempts, outcome.to_string());
                self.hold(now + MOMENT, drive, What::StopUnconfirmed { since, attempts, outcome });
            }
            EventKind::StopConfirmed { .. } => {
                if let Some(since) = self.state(drive).stop_alarm.take() {
                    let after = Span(now.saturating_duration_since(since)).to_string();
                    self.say(
                        now,
                        drive,
                        Level::INFO,
                        "stop confirmed",
                        format!("stop confirmed after {after}"),
                    );
                }
            }
            EventKind::Command { command, commander, outcome, .. } => {
                self.commanded(now, drive, command, commander, &event.cause, outcome);
            }
            EventKind::Identified(_) => {
                let text = event.kind.to_string();
                if self.state(drive).identity.replace(text.clone()).as_ref() != Some(&text) {
                    let said = text.trim_start_matches("identified: ").to_owned();
                    self.share(now, drive, Fate::Identified, Level::INFO, Duration::ZERO, said);
                }
            }
            EventKind::WatchdogVerified { written, .. } => {
                if !std::mem::replace(&mut self.state(drive).watchdog, true) || *written {
                    self.say(now, drive, Level::INFO, "watchdog verified", event.kind.to_string());
                }
            }
            EventKind::RestartsItself { by, .. } if by.is_empty() => {}
            // Whoever commands is told the outcome, and what happens without a command is told as what it is.
            EventKind::StateChanged { .. } | EventKind::StartTookCommand(_) => {}
            EventKind::WatchdogRestored(_) | EventKind::WatchdogStays { .. } => {
                self.share(now, drive, Fate::AtExit, Level::INFO, Duration::ZERO, event.kind.to_string());
            }
            EventKind::Exit(action) => self.exited(now, drive, action),
            EventKind::Removed(action) => {
                let level = if action.is_alarm() { Level::ERROR } else { Level::INFO };
                self.say(now, drive, level, "removed", event.kind.to_string());
                // Who comes by this name behind it, such as on a line that is called otherwise, comes for the first time and not back.
                let state = self.state(drive);
                *state = DriveState { line: state.line, ..DriveState::default() };
            }
            EventKind::Renamed(old) => {
                // What was known of it is known of it by its new name.
                if let Some(known) = self.drives.remove(old) {
                    let state = self.state(drive);
                    *state = DriveState { line: state.line, ..known };
                }
                self.say(now, drive, Level::INFO, event.kind.name(), event.kind.to_string());
            }
            kind => {
                let level = match kind {
                    EventKind::RunCommandStands(_) | EventKind::IdentityChanged { .. } => Level::ERROR,
                    kind if kind.is_alarm() => Level::WARN,
                    _ => Level::INFO,
                };
                self.say(now, drive, level, kind.name(), kind.to_string());
            }
        }
    }

    /// The reader of the events was slow.
    pub(super) fn handle_missed(&mut self, events: u64) {
        let text = format!("{events} events came too fast to be told");
        self.entries.push_back(Entry { level: Level::WARN, text });
    }

    /// What was held back for long enough is told.
    pub(super) fn handle_time(&mut self, now: Instant) {
        let (due, held) = std::mem::take(&mut self.held).into_iter().partition(|held| held.until <= now);
        self.held = held;
        for held in due {
            self.release(now, held, None);
        }
        let over: Vec<_> =
            self.together.iter().filter(|(_, all)| all.until <= now).map(|(&key, _)| key).collect();
        for key in over {
            self.tell_together(key);
        }
        let repeated = self.repeats.due(now);
        self.entries.extend(repeated);
    }

    /// The fleet has ended: everything is told.
    pub(super) fn handle_end(&mut self, now: Instant) {
        for held in std::mem::take(&mut self.held) {
            self.release(now, held, None);
        }
        for key in self.together.keys().copied().collect::<Vec<_>>() {
            self.tell_together(key);
        }
        let repeated = self.repeats.rest(now);
        self.entries.extend(repeated);
    }

    fn line_of(&self, drive: &str) -> usize {
        self.drives.get(drive).map_or(0, |state| state.line)
    }

    fn state(&mut self, drive: &Arc<str>) -> &mut DriveState {
        self.drives.entry(Arc::clone(drive)).or_default()
    }
}
