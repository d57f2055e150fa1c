//! The configuration file: lines, drives, periods, policies.
//!
//! Read in two steps: the keys one by one ([`raw`], [`values`]), then seen together, against the families and against the
//! arithmetic of the lines. Whatever is wrong is told with its file, line and field.

mod checks;
mod described;
mod doors;
mod gateway;
mod groups;
mod mqtt;
mod place;
mod raw;
mod sparkplug;
mod state;
mod values;

use std::{collections::BTreeMap, ops::Range, path::Path, time::Duration};

use drive_bus::{LineConfig, Protocol};
use drive_core::{StopMode, WatchdogCapability};
use drive_families::{OptionEntry, Options};
use drive_fleet::{
    Alarms, Commanders, Demand, DriveSettings, FrequencyLimits, LineBudget, OnControlTaken, OnExit,
    OnExitAdopted, OnExitWatchdog, OnFault, OnLoss, Periods, WatchdogContract, check_settings, plan,
};

pub(crate) use self::{
    doors::{DoorsConfig, Http, HttpConfig, SocketConfig, TlsFiles},
    gateway::{GatewayConfig, Network, Units},
    groups::Group,
    mqtt::{Address, Discovery, MqttConfig},
    place::{ConfigError, Source as Place},
    sparkplug::SparkplugConfig,
    state::State,
};
use self::{
    place::Source,
    raw::{DriveEntry, File, LineEntry},
    values::{Adopted, Exit},
};
use crate::{drive_spec::DriveName, failure::Failure, line_spec};

/// How often snapshots are printed unless the file says otherwise.
const SNAPSHOTS: Duration = Duration::from_secs(5);
/// How long the exit may take unless the file says otherwise.
const SHUTDOWN: Duration = Duration::from_secs(60);
/// How long an answer may take unless the file says otherwise: the slowest family needs 50 ms.
const RESPONSE_TIMEOUT: Duration = Duration::from_millis(200);

const SHORTEST_TIMEOUT: Duration = Duration::from_millis(10);
const LONGEST_TIMEOUT: Duration = Duration::from_secs(10);

/// The part of a line that polls of unnamed periods may take, in millionths; the rest is for commands.
const ROOM_PPM: u64 = 800_000;
/// Periods of more than half a minute are nobody's wish.
const LONGEST_STRETCH: u32 = 60;

/// A configuration whose fields are right. Whether its lines can work is another question: see [`Self::workable`].
#[derive(Debug)]
pub(crate) struct Config {
    /// How often a snapshot of every drive is printed; zero: never.
    pub(crate) snapshots: Duration,
    /// How long the exit may take.
    pub(crate) shutdown: Duration,
    /// Who may come in, and by which door.
    pub(crate) doors: DoorsConfig,
    pub(crate) lines: Vec<LinePart>,
    pub(crate) groups: Vec<Group>,
    pub(crate) gateways: Vec<GatewayConfig>,
    /// The broker to which everything is told; `None`: nothing is.
    pub(crate) mqtt: Option<MqttConfig>,
    /// The edge node that the daemon is on the same brokers.
    pub(crate) sparkplug: Option<SparkplugConfig>,
}

/// A line and its drives.
#[derive(Debug)]
pub(crate) struct LinePart {
    pub(crate) name: String,
    pub(crate) config: LineConfig,
    pub(crate) budget: LineBudget,
    pub(crate) drives: Vec<DrivePart>,
    /// Why the line cannot work, with the arithmetic.
    pub(crate) problem: Option<ConfigError>,
}

/// A drive of a line.
#[derive(Debug)]
pub(crate) struct DrivePart {
    pub(crate) name: DriveName,
    pub(crate) settings: DriveSettings,
    pub(crate) options: SaidOptions,
}

/// The options of a drive, and the texts by which the file says them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SaidOptions {
    pub(crate) values: Options,
    pub(crate) texts: BTreeMap<&'static str, String>,
}

impl LinePart {
    /// What its drives want of it.
    pub(crate) fn demands(&self) -> Vec<Demand> {
        let protocol = self.config.protocol;
        self.drives
            .iter()
            .map(|drive| demand(drive.name, &drive.settings, &drive.options, protocol))
            .collect()
    }
}

impl Config {
    /// Reads a file.
    pub(crate) fn load(file: &Path) -> Result<Self, ConfigError> {
        match checks::read_file(file) {
            Ok(text) => Self::read(file, &text),
            Err(why) => Err(Source { file, text: "" }.error_of_file(format_args!("cannot be read: {why}"))),
        }
    }

    /// Reads a file whose lines can work.
    pub(crate) fn load_workable(file: &Path) -> Result<Self, Failure> {
        Self::load(file).and_then(Self::workable).map_err(|error| Failure::Input(error.to_string()))
    }

    /// Reads the text of a file.
    fn read(file: &Path, text: &str) -> Result<Self, ConfigError> {
        let source = Source { file, text };
        let raw: File = toml::from_str(text).map_err(|error| match error.span() {
            Some(span) => source.error(span, error.message()),
            None => source.error_of_file(error.message()),
        })?;
        let said = state::Said {
            state: raw.state.as_deref(),
            watchdogs: raw.watchdogs.as_deref(),
            tokens: raw.tokens.as_deref(),
            audit: raw.audit.as_deref(),
        };
        let state = State::of(source, said, &state::Environment::of_process());
        let members = Members::of(source, &raw)?;
        let mut lines = Vec::new();
        for (name, entry) in &raw.lines {
            lines.push(line_part(source, name.get_ref(), name.span(), entry, &members)?);
        }
        checks::ports(source, &raw, &lines)?;
        let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
        let names = drives.map(|drive| drive.settings.name.as_str());
        let groups = groups::groups(source, &raw.groups, names)?;
        let mqtt = raw.mqtt.as_ref().map(|entry| {
            let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
            let drives = drives.map(|drive| drive.settings.name.as_str()).collect();
            let names = [
                ("lines", lines.iter().map(|line| line.name.as_str()).collect()),
                ("drives", drives),
                ("groups", groups.iter().map(|group| group.name.as_str()).collect()),
            ];
            MqttConfig::read(source, entry, names)
        });
        let sparkplug = raw.mqtt.as_ref().and_then(|entry| entry.sparkplug.as_ref()).map(|entry| {
            let drives = lines.iter().flat_map(|line: &LinePart| &line.drives);
            let drives = drives.map(|drive| drive.settings.name.as_str());
            let lines = lines.iter().map(|line| line.name.as_str());
            SparkplugConfig::read(source, entry, drives, lines, &state)
        });
        let doors = DoorsConfig::read(source, raw.http.as_ref(), raw.socket.as_ref(), state)?;
        let gateways = gateway::gateways(source, &raw.gateways, &lines)?;
        Ok(Self {
            doors,
            gateways,
            snapshots: checks::snapshots(source, raw.snapshots.as_ref())?.unwrap_or(SNAPSHOTS),
            shutdown: raw.shutdown.as_ref().map_or(SHUTDOWN, |time| time.get_ref().0.0),
            lines,
            groups,
            mqtt: mqtt.transpose()?,
            sparkplug: sparkplug.transpose()?,
        })
    }

    /// The same, if every line can work.
    fn workable(mut self) -> Result<Self, ConfigError> {
        match self.lines.iter_mut().find_map(|line| line.problem.take()) {
            Some(problem) => Err(problem),
            None => Ok(self),
        }
    }
}

/// The drives of the file, by line.
struct Members(BTreeMap<String, Vec<Member>>);

/// One drive of a line.
struct Member {
    drive: DriveName,
    settings: DriveSettings,
    options: SaidOptions,
    /// Whether the file says how often it is asked.
    has_own_periods: bool,
}

impl Members {
    fn of(source: Source<'_>, raw: &File) -> Result<Self, ConfigError> {
        let none = DriveEntry::default();
        let defaults = raw.defaults.as_ref().unwrap_or(&none);
        let misplaced = [
            defaults.line.as_ref().map(toml::Spanned::span),
            defaults.drive.as_ref().map(toml::Spanned::span),
            defaults.name.as_ref().map(toml::Spanned::span),
        ];
        if let Some(span) = misplaced.into_iter().flatten().next() {
            return Err(source.error(span, "a default names no line and no drive: expected in [[drives]]"));
        }
        if raw.drives.is_empty() {
            return Err(source.error_of_file("no drive: expected [[drives]] with line and drive"));
        }
        let mut groups: BTreeMap<String, Vec<Member>> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for entry in &raw.drives {
            let (span, entry) = (entry.span(), entry.get_ref());
            let Some(line) = &entry.line else {
                return Err(source.error(span, "expected line = \"NAME\" of one of the lines"));
            };
            let on = raw.lines.iter().find(|(name, _)| name.get_ref() == line.get_ref());
            let Some((_, on)) = on else {
                let problem = format_args!("there is no line {:?}: expected a [lines.NAME]", line.get_ref());
                return Err(source.error(line.span(), problem));
            };
            let protocol = on.port.get_ref().0.protocol();
            let Some(drive) = &entry.drive else {
                return Err(source.error(span, "expected drive = \"FAMILY@ADDRESSES\", such as atv312@1-31"));
            };
            let named: Vec<DriveName> = drive.get_ref().0.names().collect();
            for name in &named {
                let place = entry.name.as_ref().map_or(drive.span(), toml::Spanned::span);
                let options = options(source, entry, defaults, *name)?;
                let watchdog = line_spec::watchdog(*name, &options.values, protocol);
                let settings = settings(source, entry, defaults, *name, named.len(), watchdog)?;
                if names.insert(settings.name.clone(), *name).is_some() {
                    let problem = format_args!("two drives are named {:?}", settings.name);
                    return Err(source.error(place, problem));
                }
                let group = groups.entry(line.get_ref().clone()).or_default();
                if group.iter().any(|other| other.drive.slave == name.slave) {
                    let problem = format_args!("address {} of this line is taken", name.slave);
                    return Err(source.error(drive.span(), problem));
                }
                let has_own_periods = [entry, defaults].into_iter().any(DriveEntry::has_periods);
                group.push(Member { drive: *name, settings, options, has_own_periods });
            }
        }
        Ok(Self(groups))
    }
}

fn line_part(
    source: Source<'_>,
    name: &str,
    span: Range<usize>,
    entry: &LineEntry,
    members: &Members,
) -> Result<LinePart, ConfigError> {
    let Some(group) = members.0.get(name) else {
        return Err(source.error(span, "no drive is on this line: expected a [[drives]] that names it"));
    };
    let names: Vec<DriveName> = group.iter().map(|member| member.drive).collect();
    let port = entry.port.get_ref();
    let config = port.0.config(&names).map_err(|error| source.error(entry.port.span(), error))?;
    if name.trim().is_empty() || name.chars().any(char::is_control) {
        return Err(source.error(span, "expected a name without control characters for the line"));
    }
    let config = LineConfig {
        response_timeout: response_timeout(source, entry)?,
        slave_change_gap: entry.slave_change_gap.map_or(config.slave_change_gap, |time| time.0.0),
        low_latency: entry.low_latency.unwrap_or(config.low_latency),
        ..config
    };
    let budget = LineBudget::of(&config);
    let response = entry.response.as_ref().map_or(budget.response, |time| time.get_ref().0.0);
    if let Some(time) = entry.response.as_ref().filter(|_| response > config.response_timeout) {
        let problem = format_args!(
            "{response:?} as the usual time of an answer, and {:?} as the longest: expected less",
            config.response_timeout
        );
        return Err(source.error(time.span(), problem));
    }
    let segments = entry.segments.as_ref().map_or(1, |segments| *segments.get_ref());
    if let Some(said) = entry.segments.as_ref().filter(|_| segments == 0) {
        return Err(source.error(said.span(), "0 segments: expected 1, and one more for each repeater"));
    }
    let budget = LineBudget { response, segments, ..budget };
    let stretch = fitting_stretch(budget, group);
    let part = |member: &Member| DrivePart {
        name: member.drive,
        settings: member.settings_with(stretch),
        options: member.options.clone(),
    };
    let drives = group.iter().map(part).collect();
    let line = LinePart { name: name.to_owned(), config, budget, drives, problem: None };
    let problem = plan(budget, &line.demands()).err().map(|problem| source.error(span, problem));
    Ok(LinePart { problem, ..line })
}

/// How long an answer may take: nothing is an answer in no time, and a stop waits for the longest one.
fn response_timeout(source: Source<'_>, entry: &LineEntry) -> Result<Duration, ConfigError> {
    let Some(said) = &entry.response_timeout else { return Ok(RESPONSE_TIMEOUT) };
    let time = said.get_ref().0.0;
    if (SHORTEST_TIMEOUT..=LONGEST_TIMEOUT).contains(&time) {
        return Ok(time);
    }
    let problem = format_args!(
        "{time:?}: expected {SHORTEST_TIMEOUT:?} to {LONGEST_TIMEOUT:?}, for a stop waits for an answer that does not come"
    );
    Err(source.error(said.span(), problem))
}

/// By how much the periods that the file does not name are longer than usual: as little as leaves a fifth of the line for
/// commands. Periods that the file names stay as they are.
fn fitting_stretch(budget: LineBudget, group: &[Member]) -> u32 {
    let fits = |stretch: &u32| {
        let demand = |member: &Member| {
            demand(member.drive, &member.settings_with(*stretch), &member.options, budget.protocol)
        };
        let demands: Vec<_> = group.iter().map(demand).collect();
        plan(budget, &demands).is_ok_and(|plan| plan.utilisation_ppm <= ROOM_PPM)
    };
    let longest = if group.iter().all(|member| member.has_own_periods) { 1 } else { LONGEST_STRETCH };
    (1..=longest).find(fits).unwrap_or(1)
}

fn demand(drive: DriveName, settings: &DriveSettings, options: &SaidOptions, protocol: Protocol) -> Demand {
    Demand {
        drive: settings.name.clone(),
        capabilities: drive.family.capabilities(),
        watchdog_capability: line_spec::watchdog(drive, &options.values, protocol),
        periods: settings.periods,
        watchdog: settings.watchdog,
    }
}

impl Member {
    /// Its settings, with periods that the file does not name so many times as long.
    fn settings_with(&self, stretch: u32) -> DriveSettings {
        let mut settings = self.settings.clone();
        if !self.has_own_periods {
            let Periods { running, rest, slow, max_age } = settings.periods;
            settings.periods = Periods {
                running: running * stretch,
                rest: rest * stretch,
                slow: slow * stretch,
                max_age: max_age * stretch,
            };
        }
        settings
    }
}

/// The settings of one drive: what its entry says, else the defaults, else what holds anyway.
fn settings(
    source: Source<'_>,
    entry: &DriveEntry,
    defaults: &DriveEntry,
    drive: DriveName,
    of: usize,
    capability: Option<WatchdogCapability>,
) -> Result<DriveSettings, ConfigError> {
    let capabilities = drive.family.capabilities();
    let name = name(source, entry, drive, of)?;
    let anyway = Periods::default();
    let period = |of: fn(&DriveEntry) -> Option<Duration>, anyway| {
        of(entry).or_else(|| of(defaults)).unwrap_or(anyway)
    };
    let periods = Periods {
        running: period(|entry| entry.running.as_ref().map(|time| time.get_ref().0.0), anyway.running),
        rest: period(|entry| entry.rest.as_ref().map(|time| time.get_ref().0.0), anyway.rest),
        slow: period(|entry| entry.slow.as_ref().map(|time| time.get_ref().0.0), anyway.slow),
        max_age: period(|entry| entry.max_age.as_ref().map(|time| time.get_ref().0.0), anyway.max_age),
    };
    let mode = said(entry, defaults, |entry| &entry.stop_mode).map_or(StopMode::Ramp, |mode| mode.0);
    let settings = DriveSettings {
        control: entry.control.or(defaults.control).unwrap_or(false),
        commanders: match said(entry, defaults, |entry| &entry.commanders) {
            Some(names) => Commanders::Only(names.clone()),
            None => Commanders::Anyone,
        },
        periods,
        limits: limits(entry, defaults),
        alarms: alarms(entry, defaults),
        watchdog: watchdog(entry, defaults, capability),
        on_exit: match said(entry, defaults, |entry| &entry.on_exit).map_or(Exit::Stop, |policy| policy.0.0) {
            Exit::Stop => OnExit::Stop(mode),
            Exit::Release => OnExit::Release(mode),
            Exit::Leave => OnExit::Leave,
        },
        on_exit_adopted: match said(entry, defaults, |entry| &entry.on_exit_adopted) {
            Some(policy) if policy.0.0 == Adopted::Stop => OnExitAdopted::Stop(mode),
            Some(policy) if policy.0.0 == Adopted::Leave => OnExitAdopted::Leave,
            _ => OnExitAdopted::Report,
        },
        on_exit_watchdog: said(entry, defaults, |entry| &entry.on_exit_watchdog)
            .map_or(OnExitWatchdog::default(), |policy| policy.0.0),
        on_loss: match said(entry, defaults, |entry| &entry.on_loss).is_some_and(|policy| policy.0.0) {
            true => OnLoss::Stop(mode),
            false => OnLoss::Report,
        },
        on_fault: match said(entry, defaults, |entry| &entry.on_fault).is_some_and(|policy| policy.0.0) {
            true => OnFault::ResetWatchdogTrip,
            false => OnFault::Report,
        },
        on_control_taken: said(entry, defaults, |entry| &entry.on_control_taken)
            .map_or(OnControlTaken::default(), |policy| policy.0.0),
        accept_self_restart: said(entry, defaults, |entry| &entry.accept_self_restart)
            .cloned()
            .unwrap_or_default(),
        accept_resume: said(entry, defaults, |entry| &entry.accept_resume)
            .map(|lacks| lacks.iter().map(|lack| lack.0.0).collect())
            .unwrap_or_default(),
        coast: said(entry, defaults, |entry| &entry.coast).map(|time| time.0.0),
        ..DriveSettings::watched(name)
    };
    check_settings(&settings, capabilities, capability).map_err(|problem| {
        let place = place_of(problem.setting, entry).or_else(|| place_of(problem.setting, defaults));
        let place = place.or_else(|| entry.drive.as_ref().map(toml::Spanned::span)).unwrap_or_default();
        source.error(place, format_args!("{}: {problem}", settings.name.escape_debug()))
    })?;
    checks::drive(source, entry, defaults, &settings, capabilities)?;
    Ok(settings)
}

/// What the entry of a drive says, else the defaults.
fn said<'a, T>(
    entry: &'a DriveEntry,
    defaults: &'a DriveEntry,
    of: impl Fn(&'a DriveEntry) -> &'a Option<toml::Spanned<T>>,
) -> Option<&'a T> {
    of(entry).as_ref().or(of(defaults).as_ref()).map(toml::Spanned::get_ref)
}

/// The options of one drive: what its entry says, else the defaults of its family.
fn options(
    source: Source<'_>,
    entry: &DriveEntry,
    defaults: &DriveEntry,
    drive: DriveName,
) -> Result<SaidOptions, ConfigError> {
    let mut own = Options::default();
    for (name, value) in &entry.options {
        let set = own.set(name.get_ref(), &value.get_ref().0);
        set.map_err(|error| source.error(value.span(), error))?;
        let checked = own.check(drive.family);
        checked.map_err(|error| source.error(name.span(), format_args!("{drive}: {error}")))?;
    }
    let mut said = SaidOptions::default();
    for (name, value) in defaults.options.iter().chain(&entry.options) {
        let text = &value.get_ref().0;
        let set = said.values.set(name.get_ref(), text);
        let entry = set.and_then(|()| OptionEntry::find(name.get_ref()));
        let entry = entry.map_err(|error| source.error(value.span(), error))?;
        if entry.family == drive.family {
            said.texts.insert(entry.name, text.clone());
        }
    }
    said.values = said.values.of(drive.family);
    Ok(said)
}

/// Where a setting of a drive is written.
fn place_of(setting: &str, entry: &DriveEntry) -> Option<Range<usize>> {
    match setting {
        "name" => entry.name.as_ref().map(toml::Spanned::span),
        "watchdog" => entry.watchdog.as_ref().map(toml::Spanned::span),
        "limits" => entry.frequency.as_ref().map(toml::Spanned::span),
        "periods" => [&entry.max_age, &entry.running, &entry.rest]
            .into_iter()
            .find_map(|time| time.as_ref().map(toml::Spanned::span)),
        _ => None,
    }
}

/// The name of one drive of an entry: `{}` stands for its address.
fn name(source: Source<'_>, entry: &DriveEntry, drive: DriveName, of: usize) -> Result<String, ConfigError> {
    let address = drive.slave.to_string();
    match &entry.name {
        Some(name) if of > 1 && !name.get_ref().contains("{}") => Err(source
            .error(name.span(), format_args!("{of} drives have this name: expected {{}} for the address"))),
        Some(name) => Ok(name.get_ref().replace("{}", &address)),
        None => {
            let line = entry.line.as_ref().map_or("", |line| line.get_ref().as_str());
            Ok(format!("{line} {address}"))
        }
    }
}

fn limits(entry: &DriveEntry, defaults: &DriveEntry) -> FrequencyLimits {
    let Some(frequency) = entry.frequency.as_ref().or(defaults.frequency.as_ref()) else {
        return FrequencyLimits::default();
    };
    let frequency = frequency.get_ref();
    FrequencyLimits {
        low: frequency.low.map(|value| value.0),
        high: frequency.high.map(|value| value.0),
        forbidden: frequency.forbidden.iter().map(|band| band.0).collect(),
        change_per_second: frequency.change_per_second.map(|value| value.0),
    }
}

fn alarms(entry: &DriveEntry, defaults: &DriveEntry) -> Alarms {
    let alarms = entry.alarms.or(defaults.alarms).unwrap_or_default();
    Alarms {
        current: alarms.current.map(|value| value.0),
        drive_thermal: alarms.drive_thermal.map(|value| value.0),
        motor_thermal: alarms.motor_thermal.map(|value| value.0),
    }
}

/// The contract for the watchdog. A default holds for the families whose watchdog the bus can set; what an entry says
/// itself has to fit.
fn watchdog(
    entry: &DriveEntry,
    defaults: &DriveEntry,
    capability: Option<WatchdogCapability>,
) -> Option<WatchdogContract> {
    let settable = capability.is_some_and(|watchdog| watchdog.settable);
    let by_default = defaults.watchdog.as_ref().filter(|_| settable);
    let watchdog = entry.watchdog.as_ref().or(by_default)?.get_ref();
    Some(WatchdogContract { timeout: watchdog.time.0.0, reaction: watchdog.reaction.0.0 })
}

#[cfg(test)]
mod tests;
