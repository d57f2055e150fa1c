//! Decides what is told, when and how: a pure machine. Time is an argument, it does no input or output.

mod telling;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use drive_bus::stats::Stats;
use drive_core::{Command, Error, Frequency, PortError, Status};
use drive_fleet::{DriveHandle, Event, EventKind, ExitAction, Outcome, Snapshot, Trip};
use tokio::time::Instant;
use tracing::Level;

use super::{
    Entry, Place,
    noise::Noise,
    repeats::Repeats,
    words::{Hertz, Span, cause, doing, fault, left, listed},
};

/// How long drives that share a fate are waited for, to be told together.
const TOGETHER: Duration = Duration::from_secs(3);
/// How long the drive may take to explain a trip.
const EXPLAINED: Duration = Duration::from_secs(4);
/// A fault that goes within this time after a reset went by the reset.
const RESET: Duration = Duration::from_secs(5);
/// What belongs to one moment is told within this time.
const MOMENT: Duration = Duration::from_millis(200);
/// A port that is opened for the first time has this long before it is an alarm.
const FIRST_OPENING: Duration = Duration::from_secs(1);

/// What follows the name of a drive without a colon.
const VERBS: [&str; 5] = ["lost", "back", "connected", "tripped", "shows"];

/// A line as it is now.
pub(super) struct LineLook {
    pub(super) is_open: bool,
    /// Why not, where a drive was told.
    pub(super) why: Option<String>,
    pub(super) stats: Stats,
    /// Its drives as they are, or were when they were last heard.
    pub(super) drives: Vec<Arc<Snapshot>>,
}

impl LineLook {
    pub(super) fn at(place: &Place) -> Self {
        let stats = place.line.stats();
        let drives: Vec<_> = place.drives.iter().map(DriveHandle::snapshot).collect();
        let why = drives.iter().find_map(|drive| line_down(drive.error.as_ref())).map(str::to_owned);
        Self { is_open: stats.opened > stats.lost, why, stats, drives }
    }
}

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
            EventKind::StopConfirmed => {
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
            EventKind::Command { command, commander, outcome } => {
                self.commanded(now, drive, command, commander, outcome);
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
            EventKind::StateChanged { .. } => {}
            EventKind::WatchdogRestored(_) | EventKind::WatchdogStays { .. } => {
                self.share(now, drive, Fate::AtExit, Level::INFO, Duration::ZERO, event.kind.to_string());
            }
            EventKind::Exit(action) => self.exited(now, drive, action),
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

    /// How a line is now.
    pub(super) fn handle_look(&mut self, now: Instant, line: &str, look: LineLook) {
        let LineLook { is_open, why, stats, drives } = look;
        let Some(index) = self.index_of(line) else { return };
        let Some(line) = self.lines.get_mut(index) else { return };
        match (is_open, line.away) {
            (true, Some((since, true))) => {
                line.away = None;
                let after = Span(now.saturating_duration_since(since)).to_string();
                let text = match stats.opened {
                    1 => format!("line {} is open after {after}", line.name),
                    _ => format!("line {} back after {after}", line.name),
                };
                self.note(now, format!("{index} back"), Level::INFO, text);
            }
            (true, _) => line.away = None,
            (false, None) => line.away = Some((now, false)),
            (false, Some((since, false))) => {
                let first = stats.opened == 0;
                if first && now.saturating_duration_since(self.began) < FIRST_OPENING {
                    return;
                }
                line.away = Some((since, true));
                let why = why.unwrap_or_else(|| "its port is gone".to_owned());
                let text = match first {
                    true => format!("line {} cannot be opened, and is tried again: {why}", line.name),
                    false => format!("line {} lost: {why}; {}", line.name, with_it(&drives)),
                };
                self.note(now, format!("{index} lost"), Level::ERROR, text);
            }
            (false, Some((_, true))) => {}
        }
        self.listen(now, index, &stats);
    }

    fn listen(&mut self, now: Instant, index: usize, stats: &Stats) {
        let Some(line) = self.lines.get_mut(index).filter(|line| line.noise.is_due(now)) else { return };
        let minute_ago = now.checked_sub(Duration::from_secs(60)).unwrap_or(now);
        let drive =
            |slave: u8| line.drives.iter().find(|(_, address)| *address == slave).map(|(drive, _)| drive);
        let was_away = |slave| {
            let state = drive(slave).and_then(|drive| self.drives.get(drive));
            state.is_none_or(|state| {
                !state.seen || state.lost.is_some() || state.changed_at.is_some_and(|at| at >= minute_ago)
            })
        };
        let name = |slave| drive(slave).map_or_else(|| format!("address {slave}"), ToString::to_string);
        if let Some(text) = line.noise.minute(now, stats, was_away, name) {
            let text = format!("line {}: {text}", line.name);
            self.entries.push_back(Entry { level: Level::WARN, text });
        }
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

    fn connected(&mut self, now: Instant, drive: &Arc<str>, status: &Status, snapshot: &Snapshot) {
        let state = self.state(drive);
        let was_tripped = std::mem::take(&mut state.tripped);
        let is_first = !std::mem::replace(&mut state.seen, true);
        let lost = state.lost.take();
        let after = lost.map(|(since, _)| now.saturating_duration_since(since)).unwrap_or_default();
        let turned = lost.and_then(|(_, turned)| turned);
        state.changed_at = Some(now);
        if status.is_fault() {
            state.tripped = true;
            let when = if is_first { When::First } else { When::Back(after) };
            let explained =
                snapshot.trips.back().filter(|_| was_tripped).and_then(|trip| trip.faults.clone());
            let what = What::Trip { when, is_new: !was_tripped, code: status.fault_code };
            let held = Held { until: now + EXPLAINED, drive: Arc::clone(drive), what };
            match explained.as_ref().and_then(|faults| faults.present.first()) {
                Some(present) => self.release(now, held, Some(fault(present))),
                None => self.held.push(held),
            }
            return;
        }
        let cleared = if was_tripped { ", no fault any more" } else { "" };
        match turned {
            _ if is_first => self.share(now, drive, Fate::Connected, Level::INFO, after, doing(status)),
            Some(turned) if status.is_standstill() => {
                let said = format!("at standstill: it turned at {} when it was lost", Hertz(turned));
                self.back(now, drive, Level::WARN, after, said);
            }
            _ => self.back(now, drive, Level::INFO, after, format!("{}{cleared}", doing(status))),
        }
    }

    fn lost(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        silent_for: Duration,
        error: Option<&Error>,
        snapshot: &Snapshot,
    ) {
        let status = snapshot.status.as_ref().map(|status| &*status.value);
        let turned =
            status.filter(|status| !status.is_standstill()).and_then(|status| status.output_frequency);
        let line = self.line_of(drive);
        let with_line =
            line_down(error).is_some() || self.lines.get(line).is_some_and(|line| line.away.is_some());
        let state = self.state(drive);
        state.lost = Some((now.checked_sub(silent_for).unwrap_or(now), turned));
        (state.with_line, state.changed_at) = (with_line, Some(now));
        if with_line {
            return;
        }
        let why = cause(error, silent_for);
        let Some(status) = status else {
            self.share(now, drive, Fate::Silent, Level::WARN, silent_for, String::new());
            return;
        };
        let level = if status.is_standstill() { Level::WARN } else { Level::ERROR };
        if self.together.contains_key(&(line, Fate::Lost)) {
            self.share(now, drive, Fate::Lost, level, silent_for, left(status));
        } else {
            let during = if status.is_fault() { "while " } else { "" };
            self.say(now, drive, level, "lost", format!("lost {during}{}: {why}", left(status)));
            self.expect(now, drive, Fate::Lost);
        }
    }

    fn tripped(&mut self, now: Instant, drive: &Arc<str>, trip: &Trip) {
        self.state(drive).tripped = true;
        if self.held.iter().any(|held| held.drive == *drive && matches!(held.what, What::Trip { .. })) {
            return;
        }
        let before = trip.before.as_ref().map(|before| &*before.value);
        let turned =
            before.filter(|before| !before.is_standstill()).and_then(|before| before.output_frequency);
        let code = trip.status.value.fault_code;
        self.hold(now + EXPLAINED, drive, What::Trip { when: When::Heard(turned), is_new: true, code });
    }

    fn explained(&mut self, now: Instant, drive: &Arc<str>, trip: &Trip) {
        let Some(present) = trip.faults.as_ref().and_then(|faults| faults.present.first()) else { return };
        let mut text = fault(present);
        if let Some(silence) = trip.watchdog_after {
            text = format!("{text}, by its communication watchdog after {} without a message", Span(silence));
        }
        let is_it = |held: &Held| held.drive == *drive && matches!(held.what, What::Trip { .. });
        match self.held.iter().position(is_it) {
            Some(index) => {
                let held = self.held.remove(index);
                self.release(now, held, Some(text));
            }
            None => self.say(now, drive, Level::INFO, "explained", format!("the trip was {text}")),
        }
    }

    fn commanded(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        command: &Command,
        commander: &str,
        outcome: &Outcome,
    ) {
        let mine = |what: &What| match (what, command) {
            (What::FaultCleared, Command::ResetFaults) => outcome.is_confirmed(),
            (What::StopUnconfirmed { .. }, Command::Stop(_)) => !outcome.is_confirmed(),
            _ => false,
        };
        let index = self.held.iter().position(|held| held.drive == *drive && mine(&held.what));
        let held = index.map(|index| self.held.remove(index));
        if let (Some(Held { what: What::StopUnconfirmed { .. }, .. }), true) = (&held, commander != "exit") {
            let text = format!("STOP NOT CONFIRMED, the motor may turn: {command} by {commander}: {outcome}");
            self.say(now, drive, Level::ERROR, "stop", text);
            return;
        }
        // What was done at the exit is told as that, and a run command that stands although it is to be withdrawn.
        if commander == "exit" || *command == Command::Withdraw && outcome.is_confirmed() {
            self.held.extend(held);
            return;
        }
        if *command == Command::ResetFaults && outcome.is_confirmed() {
            self.state(drive).reset_at = Some(now);
        }
        let level = if outcome.is_confirmed() { Level::INFO } else { Level::WARN };
        let key = match command {
            Command::Setpoint(_) => format!("setpoint {commander} {}", outcome.kind()),
            command => format!("{command} {commander} {}", outcome.kind()),
        };
        self.say(now, drive, level, &key, format!("{command} by {commander}: {outcome}"));
    }

    fn exited(&mut self, now: Instant, drive: &Arc<str>, action: &ExitAction) {
        if !action.is_alarm() {
            let said = match action {
                ExitAction::Stopped(_) => "stopped",
                ExitAction::Released(_) => "released",
                _ => "left as before",
            };
            self.share(now, drive, Fate::AtExit, Level::INFO, Duration::ZERO, said.to_owned());
        } else {
            self.say(now, drive, Level::ERROR, "exit", format!("at the exit: {action}"));
        }
    }

    fn line_of(&self, drive: &str) -> usize {
        self.drives.get(drive).map_or(0, |state| state.line)
    }

    fn state(&mut self, drive: &Arc<str>) -> &mut DriveState {
        self.drives.entry(Arc::clone(drive)).or_default()
    }
}

/// What the line said, when it is its port that is gone.
fn line_down(error: Option<&Error>) -> Option<&str> {
    match error {
        Some(Error::Port { problem: PortError::LineDown(why), .. }) => Some(why),
        _ => None,
    }
}

/// What the drives of a line did when it was lost.
fn with_it(drives: &[Arc<Snapshot>]) -> String {
    let said = drives.iter().map(|drive| {
        let status = drive.status.as_ref().map(|status| left(&status.value));
        (Arc::clone(&drive.name), status.unwrap_or_else(|| "never heard".to_owned()))
    });
    format!("with it {}", listed(&said.collect::<Vec<_>>(), drives.len()))
}
