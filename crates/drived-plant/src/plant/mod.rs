//! What every face shares: the fleet, the groups, and what is told of them. No HTTP is in it.

pub mod alarms;
pub mod commands;
pub mod history;
mod last;
pub mod parameters;
pub mod past;
mod progress;
mod pulse;
pub mod quick_stops;
pub mod recent;
pub mod revisions;
pub mod tally;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod untold;
mod usage;
pub mod views;
pub mod watched;
mod watching;

use std::{
    collections::HashMap,
    env,
    sync::{
        Arc, OnceLock, PoisonError, RwLock,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use drive_bus::Line;
use drive_families::Options;
use drive_fleet::{DriveHandle, Fleet};
use tokio::{
    runtime::Handle,
    sync::{Mutex, watch},
    time::Instant,
};

pub use self::last::LastCommandView;
use self::views::{
    DaemonView, DriveView, ExchangeView, GroupView, LineDetailView, LineView, MeasuredLineView, NoticeView,
    PlannedLineView, SettingsView, StateView,
};
use self::{
    alarms::KeptAlarms,
    commands::{Log, Stopped},
    history::{CurvesView, History, HistoryView},
    last::LastCommands,
    parameters::Words,
    progress::Progress,
    pulse::Pulse,
    quick_stops::QuickStops,
    recent::{Recent, RecentView},
    revisions::Revisions,
    tally::Tally,
    usage::Usage,
    watched::Watched,
};
use drived_config::{
    config::Group,
    names::{Kind, KnownAs, Names},
    rights::Caller,
};
use drived_words::json::unix;

/// How many of its last exchanges a line keeps, for whoever looks at it after something has gone wrong: 20 KiB a line.
const EXCHANGES: usize = 100;

/// The plant as its faces see it. Cheap to clone.
#[derive(Clone)]
pub struct Plant(Arc<Inner>);

struct Inner {
    fleet: Fleet,
    groups: RwLock<Vec<Group>>,
    options: RwLock<HashMap<String, Options>>,
    started_unix_ms: u64,
    demo: bool,
    commands: Log,
    /// When a stop was last asked of each drive.
    stopped: Stopped,
    /// The program is about to end.
    closing: AtomicBool,
    pulse: Pulse,
    /// Where commands go on, whoever has given them.
    runtime: Handle,
    /// One group starts at a time.
    group_starts: Mutex<()>,
    revisions: Revisions,
    history: History,
    words: Words,
    progress: Progress,
    recent: Recent,
    last_commands: LastCommands,
    tally: Tally,
    usage: Usage,
    alarms: alarms::Desk,
    names: OnceLock<Names>,
    past: RwLock<Option<Arc<dyn past::Past>>>,
    has_kept_past: AtomicBool,
    untold: RwLock<Option<Arc<dyn untold::Untold>>>,
    watched: Watched,
    quick_stops: QuickStops,
}

impl Plant {
    /// By how much the clock of this computer was set back within the last minute: by so much more may a message be old that says when it was
    /// sent.
    pub fn clock_set_back(&self) -> Duration {
        self.0.pulse.set_back()
    }

    /// A plant whose alarms live as long as the program.
    pub fn start(fleet: Fleet, groups: Vec<Group>, demo: bool) -> Self {
        Self::start_with(
            fleet,
            groups,
            demo,
            &KeptAlarms::default(),
            (Watched::default(), QuickStops::default()),
        )
    }

    /// A plant that goes on with the alarms that were kept, with those who have to be heard, and with the drives that are locked.
    pub fn start_with(
        fleet: Fleet,
        groups: Vec<Group>,
        demo: bool,
        kept: &KeptAlarms,
        (watched, quick_stops): (Watched, QuickStops),
    ) -> Self {
        let inner = Arc::new(Inner {
            fleet,
            groups: RwLock::new(groups),
            options: RwLock::default(),
            started_unix_ms: unix(Instant::now()),
            demo,
            commands: Log::default(),
            stopped: Stopped::default(),
            closing: AtomicBool::new(false),
            pulse: Pulse::new(),
            runtime: Handle::current(),
            group_starts: Mutex::default(),
            revisions: Revisions::new(),
            history: History::default(),
            words: Words::default(),
            progress: Progress::default(),
            recent: Recent::default(),
            last_commands: LastCommands::default(),
            tally: Tally::default(),
            usage: Usage::default(),
            alarms: alarms::Desk::new(kept),
            names: OnceLock::new(),
            past: RwLock::default(),
            has_kept_past: AtomicBool::new(false),
            untold: RwLock::default(),
            watched,
            quick_stops,
        });
        watching::start(&inner);
        tokio::spawn(pulse::beat(Arc::downgrade(&inner)));
        history::start(&inner);
        Self(inner)
    }

    pub fn fleet(&self) -> Fleet {
        self.0.fleet.clone()
    }

    /// The program is about to end: by whichever face somebody comes, stops are taken from now on, and nothing else that is asked of a
    /// drive.
    pub fn close(&self) {
        self.0.closing.store(true, Ordering::Release);
    }

    /// Whether the program is about to end.
    pub fn is_closing(&self) -> bool {
        self.0.closing.load(Ordering::Acquire)
    }

    pub fn groups(&self) -> Vec<Group> {
        self.0.groups.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn state(&self, caller: &Caller) -> StateView {
        let now = Instant::now();
        let group = |group: Group| {
            let known_as = self.known_as(Kind::Group, &group.name);
            GroupView::of(group, known_as)
        };
        StateView {
            revision: self.0.revisions.last(),
            time_unix_ms: unix(now),
            daemon: DaemonView {
                version: env!("CARGO_PKG_VERSION").into(),
                started_unix_ms: self.0.started_unix_ms,
                zone: zone(),
                demo: self.0.demo,
                rights: caller.rights,
                caller: caller.name.clone(),
                scope: caller.scope.is_some().then(|| self.commanded_by(caller)),
                names_revision: self.0.names.get().and_then(Names::revision),
                names_problem: self.names_problem(),
            },
            lines: self.lines(),
            drives: self.drives(),
            groups: self.groups().into_iter().map(group).collect(),
            alarms: self.alarms().alarms,
        }
    }

    /// Whether somebody may command a drive, as far as his rights go.
    pub fn may_command(&self, caller: &Caller, drive: &str) -> bool {
        caller.may_command(drive, &self.groups())
    }

    /// The drives that somebody may command, as far as his rights go.
    fn commanded_by(&self, caller: &Caller) -> Vec<String> {
        let (groups, fleet) = (self.groups(), self.fleet());
        let names = fleet.drives().into_iter().map(|drive| drive.name().to_string());
        names.filter(|name| caller.may_command(name, &groups)).collect()
    }

    /// Tells what happened to the program itself.
    pub fn tell_notice(&self, notice: NoticeView) {
        self.0.tell_notice(notice);
    }

    /// The stream of what happens.
    pub fn revisions(&self) -> &Revisions {
        &self.0.revisions
    }

    /// How many commands ended how.
    pub fn tally(&self) -> &Tally {
        &self.0.tally
    }

    /// Tells in the event stream whether the audit log can be written.
    pub fn follow_audit(&self, failing: watch::Receiver<bool>) {
        watching::follow_audit(&self.0, failing);
    }

    /// The groups are these from now on.
    pub fn set_groups(&self, groups: Vec<Group>) {
        *self.0.groups.write().unwrap_or_else(PoisonError::into_inner) = groups;
    }

    /// Who has which number is told by these from now on.
    pub fn set_names(&self, names: Names) {
        // It has them once, as long as the program.
        let _ = self.0.names.set(names);
    }

    /// By what a drive, a line or a group of this name is known.
    pub fn known_as(&self, kind: Kind, name: &str) -> KnownAs {
        self.0.known_as(kind, name)
    }

    /// The name of what is known by an id; `None`: nothing is, that is configured.
    pub fn name_of(&self, kind: Kind, id: &str) -> Option<String> {
        match self.0.names.get() {
            Some(names) => names.name_of(kind, id),
            None => Some(id.to_owned()),
        }
    }

    /// Why nobody can say for certain who is known by an id; `None`: everybody has the one that he had.
    pub fn names_problem(&self) -> Option<String> {
        self.0.names.get().and_then(Names::problem)
    }

    /// A drive of a line as it is told.
    pub fn view_of(&self, line: &str, drive: &DriveHandle) -> DriveView {
        self.0.view_of(line, drive)
    }

    /// What the configuration says of a drive that the bus cannot tell: its words mean nothing for certain without it.
    pub fn options(&self, drive: &str) -> Options {
        let options = self.0.options.read().unwrap_or_else(PoisonError::into_inner);
        options.get(drive).cloned().unwrap_or_default()
    }

    /// This is what the configuration says of the drives from now on, by their names.
    pub fn set_options(&self, options: HashMap<String, Options>) {
        *self.0.options.write().unwrap_or_else(PoisonError::into_inner) = options;
    }

    /// What happened lately, the newest last.
    pub fn recent(&self) -> Vec<RecentView> {
        self.0.recent.all()
    }

    pub fn lines(&self) -> Vec<LineView> {
        self.0.lines()
    }

    /// A line with its plan, what was measured on it, and its last exchanges.
    pub fn line(&self, name: &str) -> Option<LineDetailView> {
        let (name, line) = self.0.fleet.lines().into_iter().find(|(known, _)| **known == *name)?;
        let last = line.exchanges().iter().map(ExchangeView::of).collect();
        Some(LineDetailView {
            line: self.0.line(&name, &line)?,
            planned: PlannedLineView::of(&line, self.0.fleet.plan(&name)?),
            measured: MeasuredLineView::of(&line, &self.0.fleet.drives_on(&name)),
            last,
        })
    }

    /// The lines on which no drive has been asked for longer than its periods allow.
    pub fn standing_lines(&self) -> Vec<String> {
        self.0.progress.standing(&self.0.fleet)
    }

    /// The drives, line by line.
    pub fn drives(&self) -> Vec<DriveView> {
        self.members().map(|(line, drive)| self.view_of(&line, &drive)).collect()
    }

    pub fn drive(&self, name: &str) -> Option<DriveView> {
        let (line, drive) = self.members().find(|(_, drive)| **drive.name() == *name)?;
        Some(self.view_of(&line, &drive))
    }

    /// What a drive was told when the fleet was started, and what the plan of its line makes of it.
    pub fn settings(&self, name: &str) -> Option<SettingsView> {
        let drive = self.0.fleet.drive(name)?;
        let plan = self.0.fleet.plan(drive.line().0)?;
        Some(SettingsView::of(&drive, plan))
    }

    /// A drive of the fleet is called otherwise from now on: what is known of it is known of it by the new name.
    pub fn renamed(&self, old: &str, new: &str) {
        self.0.history.rename(old, new);
        self.rename_alarms(old, new);
        if let Some(drive) = self.0.fleet.drive(new) {
            self.0.watched.call(drive.place(), new);
            self.0.quick_stops.call(&drive);
        }
    }

    /// Tells that a drive which was never here by another name had one before it came: while no program ran, or before a reload took it out.
    pub fn tell_renamed(&self, old: &str, new: &str) {
        let text = drive_fleet::EventKind::Renamed(Arc::from(old)).to_string();
        let time_unix_ms = unix(Instant::now());
        let event = serde_json::json!({
            "time_unix_ms": time_unix_ms, "drive": new, "event": "renamed", "was": old, "alarm": false, "text": text,
        });
        self.0.revisions.push(revisions::Subject::Event, &event);
    }

    /// The last ten minutes of a drive.
    pub fn history(&self, name: &str, since_unix_ms: Option<u64>) -> Option<HistoryView> {
        self.0.fleet.drive(name).map(|_| self.0.history.of(name, since_unix_ms))
    }

    /// The frequencies of all drives in the last ten minutes, in a few steps each.
    pub fn curves(&self) -> CurvesView {
        self.0.history.curves()
    }

    fn members(&self) -> impl Iterator<Item = (Arc<str>, DriveHandle)> {
        let fleet = self.fleet();
        fleet.lines().into_iter().flat_map(move |(name, _)| {
            fleet.drives_on(&name).into_iter().map(move |drive| (Arc::clone(&name), drive))
        })
    }
}

/// The zone of this host's clock by its name, as the log tells its times.
fn zone() -> Option<String> {
    let told = env::var("TZ").ok().map(|zone| zone.trim_start_matches(':').to_owned());
    told.filter(|zone| !zone.is_empty()).or_else(|| iana_time_zone::get_timezone().ok())
}

impl Inner {
    fn known_as(&self, kind: Kind, name: &str) -> KnownAs {
        self.names.get().map_or_else(|| KnownAs::of_name(name), |names| names.known_as(kind, name))
    }

    fn view_of(&self, line: &str, drive: &DriveHandle) -> DriveView {
        DriveView::of(line, drive, self.known_as(Kind::Drive, drive.name()))
    }

    fn lines(&self) -> Vec<LineView> {
        self.fleet.lines().iter().filter_map(|(name, line)| self.line(name, line)).collect()
    }

    fn line(&self, name: &str, line: &Line) -> Option<LineView> {
        let plan = self.fleet.plan(name)?;
        let known_as = self.known_as(Kind::Line, name);
        Some(LineView::of((name, known_as), line, plan, &self.fleet.drives_on(name), &self.usage))
    }

    /// Looks at the lines, once a second: those that a reload has brought keep their last exchanges from then on.
    fn look_at_lines(&self) {
        let lines = self.fleet.lines();
        for (_, line) in &lines {
            line.keep_exchanges(EXCHANGES);
        }
        self.usage.look(lines.iter().map(|(name, line)| (name, line.stats())));
    }
}
