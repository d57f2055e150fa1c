//! `[lines.NAME]`: the table of what a line is told, and its drives.

use std::{collections::BTreeMap, ops::Range, time::Duration};

use drive_bus::{
    Gateway, LineConfig, Protocol,
    config::{FarEndSettings, MOST_CONNECTIONS},
};
use drive_families::Options;
use drive_fleet::{Demand, DriveSettings, LineBudget, Periods, plan};
use toml::Spanned;

use super::{
    ConfigError, DrivePart, LinePart,
    drive::{self, DriveEntry},
    of,
    place::Source,
    table::{Entry as _, settings, within},
    values::Parsed,
};
use drived_words::{
    drive_spec::DriveName,
    duration::Time,
    line_spec::{self, LineSpec},
};

/// How long an answer may take unless the file says otherwise: the slowest family needs 50 ms.
const RESPONSE_TIMEOUT: Duration = Duration::from_millis(200);
const SHORTEST_TIMEOUT: Duration = Duration::from_millis(10);
const LONGEST_TIMEOUT: Duration = Duration::from_secs(10);

/// The part of a line that polls of unnamed periods may take, in millionths; the rest is for commands.
pub const ROOM_PPM: u64 = 800_000;
/// Periods of more than half a minute are nobody's wish.
const LONGEST_STRETCH: u32 = 60;

/// The lines as they are written, by their names.
pub type LineEntries = BTreeMap<Spanned<String>, LineEntry>;

/// The settings of a line while they are read.
pub struct Draft {
    config: LineConfig,
    response: Option<Duration>,
    segments: u8,
}

settings! {
    /// `[lines.NAME]`.
    LineEntry sets Draft;

    /// the line, [named as on the command line](../README.md#how-lines-and-drives-are-named); a serial port or a serial server is one line's only
    port: Parsed<LineSpec> = "must be given";
    /// the longest time that an answer may take, 10 ms to 10 s; a stop waits for an answer that does not come
    response_timeout: Parsed<Time> = "`\"200ms\"`",
        |to, said| to.config.response_timeout = within(
            said.0.0,
            SHORTEST_TIMEOUT..=LONGEST_TIMEOUT,
            ", for a stop waits for an answer that does not come",
        )?;
    /// the usual time, which the plan calculates with; not longer than that
    response: Parsed<Time> = "`\"10ms\"`", |to, said| to.response = Some(said.0.0);
    /// extra silence before a request to another drive than the last, for slow adapters
    slave_change_gap: Parsed<Time> = "none", |to, said| to.config.slave_change_gap = said.0.0;
    /// the longest pause that an adapter makes inside an answer, up to 1 s: what is damaged is given up behind it, and a stop waits for that
    chunk_gap: Parsed<Time> = "`\"20ms\"`",
        |to, said| to.config.chunk_gap = within(
            said.0.0,
            Duration::from_millis(1)..=Duration::from_secs(1),
            ", for a stop waits for what is damaged",
        )?;
    /// ask a USB adapter to deliver at once
    low_latency: bool = "`true`", |to, said| to.config.low_latency = *said;
    /// how many segments the line has: one, and one more behind each repeater; a segment carries 31 drives, with an Altivar 28
    /// among them 18
    segments: u8 = "`1`",
        |to, said| to.segments = within(*said, 1..=u8::MAX, ": one, and one more for each repeater")?;
    /// what stands between the port and the drives: `"none"` where each drive answers for itself, else how long it waits for a
    /// drive that does not answer, as `"3x1s"` for three attempts of a second, with `/N` behind it where it serves N requests at
    /// once. A stop waits for that; also `gateway=3x1s` behind the port
    gateway: Parsed<Gateway> = "unknown over TCP: 3 s are assumed, and a stop may wait twice; none on a serial port";
    /// how many connections the far end grants this line at once, 1 or 2: a stop takes the second while the first waits for a drive
    /// that does not answer; also `connections=2` behind the port
    connections: u8 = "2 on Modbus TCP, where it is given up if it is not granted; 1 elsewhere";
    /// `false`: the adapter, or the program behind the port, is faster than the line's speed; also `far-end-paces=no` behind the
    /// port
    far_end_paces: bool = "`true` on a serial port, `false` elsewhere";
}

impl LineEntry {
    /// How it is reached. The line is named here.
    fn port(
        &self,
        source: Source<'_>,
        name: Range<usize>,
    ) -> Result<&Spanned<Parsed<LineSpec>>, ConfigError> {
        let missing = "expected port = \"PORT\", such as \"/dev/ttyUSB0,19200,8E1\" or \"tcp://HOST:502\"";
        self.port.as_ref().ok_or_else(|| source.error(name, missing))
    }
}

impl LineEntry {
    fn connections(&self, source: Source<'_>) -> Result<Option<u8>, ConfigError> {
        let Some(said) = &self.connections else { return Ok(None) };
        let number = within(*said.get_ref(), 1..=MOST_CONNECTIONS, ": a line has use for two at the most");
        number.map(Some).map_err(|error| source.error(said.span(), error))
    }
}

/// What is wrong with a file that has to have a drive, and has none.
pub const NO_DRIVE: &str = "no drive: expected [[drives]] with line and drive";

/// The drives of the file, by line.
pub struct Members(BTreeMap<String, Vec<Member>>);

/// One drive of a line.
pub(super) struct Member {
    pub(super) drive: DriveName,
    pub(super) settings: DriveSettings,
    pub(super) options: Options,
    pub(super) slot: Option<u16>,
    pub(super) is_guess: bool,
    /// Whether the file says how often it is asked.
    pub(super) has_own_periods: bool,
}

impl Members {
    /// The drives that a file says, with the lines and the defaults that it says.
    pub fn of(
        source: Source<'_>,
        lines: &LineEntries,
        drives: &[Spanned<DriveEntry>],
        defaults: Option<&DriveEntry>,
    ) -> Result<Self, ConfigError> {
        let none = DriveEntry::default();
        let defaults = defaults.unwrap_or(&none);
        if let Some(span) =
            ["line", "drive", "name", "guessed", "slot"].into_iter().find_map(|key| defaults.place(key))
        {
            return Err(source.error(span, "a default names no line and no drive: expected in [[drives]]"));
        }
        // A file without either is one of which nothing is known yet.
        if drives.is_empty() && !lines.is_empty() {
            return Err(source.error_of_file(NO_DRIVE));
        }
        let mut groups: BTreeMap<String, Vec<Member>> = BTreeMap::new();
        let (mut names, mut slots) = (BTreeMap::new(), BTreeMap::new());
        for entry in drives {
            let (span, entry) = (entry.span(), entry.get_ref());
            let Some(line) = &entry.line else {
                return Err(source.error(span, "expected line = \"NAME\" of one of the lines"));
            };
            let Some((named, on)) = lines.get_key_value(line) else {
                let problem = format_args!("there is no line {:?}: expected a [lines.NAME]", line.get_ref());
                return Err(source.error(line.span(), problem));
            };
            let protocol = on.port(source, named.span())?.get_ref().0.protocol();
            let Some(drive) = &entry.drive else {
                return Err(source.error(span, "expected drive = \"FAMILY@ADDRESSES\", such as atv312@1-31"));
            };
            let named: Vec<DriveName> = drive.get_ref().0.names().collect();
            for (name, number) in named.iter().zip(0_u16..) {
                let place = entry.name.as_ref().map_or(drive.span(), Spanned::span);
                let options = drive::options(source, entry, defaults, *name)?;
                let watchdog = line_spec::watchdog(*name, &options, protocol);
                let settings = drive::settings(source, entry, defaults, *name, named.len(), watchdog)?;
                if names.insert(settings.name.clone(), *name).is_some() {
                    let problem = format_args!("two drives are named {:?}", settings.name);
                    return Err(source.error(place, problem));
                }
                let slot = entry.slot.as_ref().map(|said| (said, said.get_ref().saturating_add(number)));
                if let Some((said, slot)) = slot
                    && let Some(other) = slots.insert(slot, settings.name.clone())
                {
                    let problem =
                        format_args!("slot {slot} is given to {other:?} and to {:?}", settings.name);
                    return Err(source.error(said.span(), problem));
                }
                let slot = slot.map(|(_, slot)| slot);
                let group = groups.entry(line.get_ref().clone()).or_default();
                if group.iter().any(|other| other.drive.slave == name.slave) {
                    let problem = format_args!("address {} of this line is taken", name.slave);
                    return Err(source.error(drive.span(), problem));
                }
                let has_own_periods = [entry, defaults].into_iter().any(DriveEntry::has_periods);
                let is_guess = entry.guessed.as_ref().is_some_and(|said| *said.get_ref());
                group.push(Member { drive: *name, settings, options, slot, is_guess, has_own_periods });
            }
        }
        Ok(Self(groups))
    }
}

/// A line with its drives, and whether it can work.
pub fn line_part(
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
    let port = entry.port(source, span.clone())?;
    let far_end = FarEndSettings {
        gateway: of(&entry.gateway).map(|gateway| gateway.0),
        connections: entry.connections(source)?,
        paces: of(&entry.far_end_paces).copied(),
    };
    let config = port.get_ref().0.with_far_end(far_end).config(&names);
    let config = config.map_err(|error| source.error(port.span(), error))?;
    if name.trim().is_empty() || name.chars().any(char::is_control) {
        return Err(source.error(span, "expected a name without control characters for the line"));
    }
    let config = LineConfig { response_timeout: RESPONSE_TIMEOUT, ..config };
    let mut draft = Draft { config, response: None, segments: 1 };
    entry.set(source, &mut draft)?;
    let Draft { config, response, segments } = draft;
    let budget = LineBudget { segments, ..LineBudget::of(&config) };
    let response = response.unwrap_or(budget.response);
    if let Some(place) = entry.place("response").filter(|_| response > config.response_timeout) {
        let problem = format_args!(
            "{response:?} as the usual time of an answer, and {:?} as the longest: expected less",
            config.response_timeout
        );
        return Err(source.error(place, problem));
    }
    let budget = LineBudget { response, ..budget };
    let stretch = fitting_stretch(budget, group);
    let part = |member: &Member| DrivePart {
        name: member.drive,
        settings: member.settings_with(stretch),
        options: member.options.clone(),
        slot: member.slot,
        is_guess: member.is_guess,
    };
    let drives = group.iter().map(part).collect();
    let line = LinePart { name: name.to_owned(), config, budget, drives, problem: None };
    let problem = plan(budget, &line.demands()).err().map(|problem| source.error(span, problem));
    Ok(LinePart { problem, ..line })
}

/// By how much the periods that the file does not name are longer than usual: as little as leaves a fifth of the line for
/// commands. Periods that the file names stay as they are.
pub(super) fn fitting_stretch(budget: LineBudget, group: &[Member]) -> u32 {
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

pub(super) fn demand(
    drive: DriveName,
    settings: &DriveSettings,
    options: &Options,
    protocol: Protocol,
) -> Demand {
    Demand {
        drive: settings.name.clone(),
        capabilities: drive.family.capabilities(),
        watchdog_capability: line_spec::watchdog(drive, options, protocol),
        periods: settings.periods,
        watchdog: settings.watchdog,
    }
}

impl Member {
    /// Its settings, with periods that the file does not name so many times as long.
    pub(super) fn settings_with(&self, stretch: u32) -> DriveSettings {
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
