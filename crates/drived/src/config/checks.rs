//! What one field alone does not show: that a safety key acts on nothing, that two lines share a port, that a file is none.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Read as _,
    net::{SocketAddr, ToSocketAddrs as _},
    ops::Range,
    path::Path,
    time::Duration,
};

use drive_bus::Endpoint;
use drive_core::Capabilities;
use drive_fleet::{DriveSettings, OnExit};
use toml::Spanned;

use super::{
    ConfigError, LinePart,
    place::Source,
    raw::{self, DriveEntry},
    values::{Adopted, Exit, Parsed},
};
use crate::duration::Time;

/// A configuration that is longer is no configuration.
const LONGEST_FILE: u64 = 1 << 20;
/// Snapshots come at most so often.
const SNAPSHOTS_APART: Duration = Duration::from_millis(100);

/// The text of a configuration. A pipe or a device would never end.
pub(super) fn read_file(path: &Path) -> Result<String, String> {
    let metadata = fs::metadata(path).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is no ordinary file: expected a text file".to_owned());
    }
    let mut text = String::new();
    let mut file = File::open(path).map_err(|error| error.to_string())?.take(LONGEST_FILE + 1);
    file.read_to_string(&mut text).map_err(|error| error.to_string())?;
    match file.limit() {
        0 => Err(format!("it is longer than {} KiB: expected a configuration", LONGEST_FILE >> 10)),
        _ => Ok(text),
    }
}

/// How often snapshots are printed: each is a line for every drive.
pub(super) fn snapshots(
    source: Source<'_>,
    said: Option<&Spanned<Parsed<Time>>>,
) -> Result<Option<Duration>, ConfigError> {
    let Some(said) = said else { return Ok(None) };
    match said.get_ref().0.0 {
        time if time.is_zero() || time >= SNAPSHOTS_APART => Ok(Some(time)),
        time => {
            let problem = format_args!("{time:?}: expected \"0\" for never, or {SNAPSHOTS_APART:?} or more");
            Err(source.error(said.span(), problem))
        }
    }
}

/// What a drive's settings say against each other and against its family.
pub(super) fn drive(
    source: Source<'_>,
    entry: &DriveEntry,
    defaults: &DriveEntry,
    settings: &DriveSettings,
    capabilities: &Capabilities,
) -> Result<(), ConfigError> {
    if !settings.control {
        return match acts(entry).into_iter().flatten().next() {
            Some((key, span)) => {
                let problem = format_args!(
                    "{key} without control = true: {} is only read, and nothing would act",
                    settings.name.escape_debug()
                );
                Err(source.error(span, problem))
            }
            None => Ok(()),
        };
    }
    let mode = entry.stop_mode.as_ref().or(defaults.stop_mode.as_ref());
    if let Some(mode) = mode.filter(|mode| !capabilities.stop_modes.contains(&mode.get_ref().0)) {
        let has: Vec<String> = capabilities.stop_modes.iter().map(ToString::to_string).collect();
        let problem = format_args!(
            "{}: a {} has no {} stop: expected one of {}",
            settings.name.escape_debug(),
            capabilities.name,
            mode.get_ref().0,
            has.join(", ")
        );
        return Err(source.error(mode.span(), problem));
    }
    if let (OnExit::Leave, Some(contract)) = (settings.on_exit, settings.watchdog) {
        let said = entry.on_exit.as_ref().or(defaults.on_exit.as_ref());
        let problem = format_args!(
            "{}: a motor that is left at the exit would be tripped by its watchdog {:?} later: expected on_exit = \
             \"stop\" or \"release\", or no watchdog",
            settings.name.escape_debug(),
            contract.timeout
        );
        return Err(source.error(said.map(Spanned::span).unwrap_or_default(), problem));
    }
    Ok(())
}

/// The keys of an entry that promise that something is done to the drive.
fn acts(entry: &DriveEntry) -> [Option<(&'static str, Range<usize>)>; 12] {
    let span = |key, span: Option<Range<usize>>| span.map(|span| (key, span));
    let on_exit = entry.on_exit.as_ref().filter(|policy| policy.get_ref().0.0 != Exit::Leave);
    let adopted = entry.on_exit_adopted.as_ref().filter(|policy| policy.get_ref().0.0 == Adopted::Stop);
    [
        span("watchdog", entry.watchdog.as_ref().map(Spanned::span)),
        span("frequency", entry.frequency.as_ref().map(Spanned::span)),
        span("stop_mode", entry.stop_mode.as_ref().map(Spanned::span)),
        span("commanders", entry.commanders.as_ref().map(Spanned::span)),
        span("accept_self_restart", entry.accept_self_restart.as_ref().map(Spanned::span)),
        span("accept_resume", entry.accept_resume.as_ref().map(Spanned::span)),
        span("on_exit", on_exit.map(Spanned::span)),
        span("on_exit_adopted", adopted.map(Spanned::span)),
        span("on_exit_watchdog", entry.on_exit_watchdog.as_ref().map(Spanned::span)),
        span("on_loss", entry.on_loss.as_ref().filter(|policy| policy.get_ref().0.0).map(Spanned::span)),
        span("on_fault", entry.on_fault.as_ref().filter(|policy| policy.get_ref().0.0).map(Spanned::span)),
        span("on_control_taken", entry.on_control_taken.as_ref().map(Spanned::span)),
    ]
}

/// Two lines over one port would talk into each other. A gateway for Modbus TCP keeps its connections apart, but not two
/// masters of one unit.
pub(super) fn ports(source: Source<'_>, raw: &raw::File, lines: &[LinePart]) -> Result<(), ConfigError> {
    let mut taken: BTreeMap<Wire, &str> = BTreeMap::new();
    let mut hosts = Hosts::default();
    for line in lines {
        let entry = raw.lines.iter().find(|(name, _)| *name.get_ref() == line.name);
        let span = entry.map(|(_, entry)| entry.port.span()).unwrap_or_default();
        let wires = match &line.config.endpoint {
            Endpoint::Serial(path) => {
                terminal(path).map_err(|problem| source.error(span.clone(), problem))?;
                vec![Wire::serial(path)]
            }
            Endpoint::Tcp(address) if line.config.protocol.is_paced() => {
                vec![Wire::Server(hosts.of(address))]
            }
            Endpoint::Tcp(address) => {
                let host = hosts.of(address);
                line.drives.iter().map(|drive| Wire::Unit(host.clone(), drive.name.slave.number())).collect()
            }
            _ => continue,
        };
        for wire in wires {
            let unit = if let Wire::Unit(_, unit) = &wire { Some(*unit) } else { None };
            if let Some(other) = taken.insert(wire, &line.name).filter(|other| *other != line.name) {
                let problem = match unit {
                    Some(unit) => {
                        format!("its unit {unit} is on line {other:?} too: expected it on one line")
                    }
                    None => {
                        format!("it is the port of line {other:?} too: expected all its drives on one line")
                    }
                };
                return Err(source.error(span, problem));
            }
        }
    }
    Ok(())
}

/// What only one line can have.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Wire {
    /// A serial port that is not there now, by its name.
    Named(String),
    /// A serial port, by the device behind its names.
    Device(u64),
    Server(Host),
    Unit(Host, u8),
}

impl Wire {
    #[cfg(unix)]
    fn serial(path: &Path) -> Self {
        use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
        match fs::metadata(path) {
            Ok(metadata) if metadata.file_type().is_char_device() => Self::Device(metadata.rdev()),
            _ => Self::Named(path.display().to_string()),
        }
    }

    #[cfg(not(unix))]
    fn serial(path: &Path) -> Self {
        Self::Named(path.display().to_string().to_ascii_lowercase())
    }
}

/// A path that is there and cannot be a serial port. One that is not there may come.
#[cfg(unix)]
fn terminal(path: &Path) -> Result<(), String> {
    use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
    /// `/dev/null`, `/dev/zero` and the like.
    const MEMORY: u64 = 1;
    match fs::metadata(path) {
        Ok(metadata) if !metadata.file_type().is_char_device() || metadata.rdev() >> 8 & 0xFFF == MEMORY => {
            Err(format!("{} is no terminal: expected a serial port, such as /dev/ttyUSB0", path.display()))
        }
        _ => Ok(()),
    }
}

#[cfg(not(unix))]
fn terminal(_: &Path) -> Result<(), String> {
    Ok(())
}

/// A server: by its addresses where its name had to be looked up, else by its name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Host {
    port: String,
    name: String,
}

/// The servers so far.
#[derive(Default)]
struct Hosts(Vec<(Host, Vec<SocketAddr>)>);

impl Hosts {
    /// The server of `HOST:PORT`, the same for each of its names. Names are looked up only where two of them have one port.
    fn of(&mut self, address: &str) -> Host {
        let (name, port) = address.rsplit_once(':').unwrap_or((address, ""));
        let name = name.trim_end_matches('.').to_ascii_lowercase();
        let host = Host { port: port.to_owned(), name };
        if let Some((known, _)) = self.0.iter().find(|(known, _)| *known == host) {
            return known.clone();
        }
        let others = self.0.iter_mut().filter(|(other, _)| other.port == host.port);
        let look_up = |host: &Host| -> Vec<SocketAddr> {
            // A name that nobody knows now is nobody's second name.
            format!("{}:{}", host.name, host.port)
                .to_socket_addrs()
                .map(Iterator::collect)
                .unwrap_or_default()
        };
        let mut addresses = Vec::new();
        for (other, known) in others {
            if addresses.is_empty() {
                addresses = look_up(&host);
            }
            if known.is_empty() {
                *known = look_up(other);
            }
            if known.iter().any(|address| addresses.contains(address)) {
                return other.clone();
            }
        }
        self.0.push((host.clone(), addresses));
        host
    }
}
