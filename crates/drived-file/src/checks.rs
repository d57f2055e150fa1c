//! What one table alone does not show: that two lines share a port, that a file is none.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Read as _,
    net::{SocketAddr, ToSocketAddrs as _},
    path::Path,
};

use drive_bus::Endpoint;
use drive_families::Family;

use serde::Deserialize as _;
use toml::de::{DeTable, Deserializer};

use super::{added, added::Added, file};
use drived_config::{
    config::{ConfigError, Entry as _, LinePart, Source, State, of},
    profiles::Folder,
};

/// A configuration that is longer is no configuration.
const LONGEST_FILE: u64 = 1 << 20;

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

/// What was added at the page, or is to be; `is_aside`: the configuration has drives of its own.
pub(super) fn added(
    state: &State,
    is_aside: bool,
    instead: Option<&str>,
) -> Result<Option<Added>, ConfigError> {
    let Some(folder) = &state.folder else { return Ok(None) };
    let file = folder.join(added::FILE);
    let text = match (instead, read_file(&file)) {
        (Some(instead), _) => Some(instead.to_owned()),
        (None, Ok(text)) => Some(text),
        (None, Err(_)) if !file.exists() => None,
        // Whoever starts without drives that he has would not be told that they are gone.
        (None, Err(_)) if is_aside => None,
        (None, Err(why)) => {
            let source = Source { file: &file, text: "" };
            return Err(source.error_of_file(format_args!("cannot be read: {why}")));
        }
    };
    Ok(Some(Added { file, is_aside, text }))
}

/// What cannot be read, with the place; an option of a family that stands where every drive's settings do is told where it
/// belongs.
pub(super) fn refused(source: Source<'_>, error: &toml::de::Error) -> ConfigError {
    let unknown = error.message().strip_prefix("unknown field `").and_then(|rest| rest.split('`').next());
    let option = unknown.filter(|name| Family::all().iter().any(|family| family.has_option(name)));
    let problem = match option {
        Some(name) => format!(
            "it is an option of the drive's family: expected options = {{ {name} = … }}; limits of setpoints for a drive of any \
             family are frequency = {{ low = …, high = … }}"
        ),
        None => error.message().to_owned(),
    };
    match error.span() {
        Some(span) => source.error(span, problem),
        None => source.error_of_file(problem),
    }
}

/// A file that has lines and drives, and nothing else.
pub(super) fn only_plant(source: Source<'_>) -> Result<file::File, ConfigError> {
    let wrong = |error| refused(source, &error);
    let tables = DeTable::parse(source.text).map_err(wrong)?;
    let other = tables.get_ref().keys().find(|key| !["lines", "drives"].contains(&&**key.get_ref()));
    if let Some(other) = other {
        let problem = "expected lines and drives alone here: everything else stands in the configuration";
        return Err(source.error(other.span(), problem));
    }
    file::File::deserialize(Deserializer::from(tables)).map_err(wrong)
}

/// A drive whose profile has been taken out of the folder is one of which nothing is known, whatever this process has read before.
pub(super) fn profiles(source: Source<'_>, raw: &file::File, folder: &Folder) -> Result<(), ConfigError> {
    let drives = of(&raw.drives).into_iter().flatten().filter_map(|entry| entry.get_ref().drive.as_ref());
    for drive in drives {
        if let Some(gone) = drive
            .get_ref()
            .0
            .names()
            .find(|name| !folder.has(name.family) || folder.why_not(name.family).is_some())
        {
            let problem = match folder.why_not(gone.family) {
                Some(why) => format!("{} is not driven by its profile: {why}", gone.family),
                None => format!("no profile in the folder says any more what {} is", gone.family),
            };
            return Err(source.error(drive.span(), problem));
        }
    }
    Ok(())
}

/// Two lines over one port would talk into each other. A gateway for Modbus TCP keeps its connections apart, but not two
/// masters of one unit.
pub(super) fn ports(source: Source<'_>, raw: &file::File, lines: &[LinePart]) -> Result<(), ConfigError> {
    let mut taken: BTreeMap<Wire, &str> = BTreeMap::new();
    let mut hosts = Hosts::default();
    for line in lines {
        let entry = raw.lines().find(|(name, _)| *name.get_ref() == line.name);
        let span = entry.and_then(|(_, entry)| entry.place("port")).unwrap_or_default();
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

/// Whether two lines would talk into each other, by whatever names they are called: one serial port, or one server. A name of a
/// server is looked up: it may take a while.
#[must_use]
pub fn is_one_wire(one: &Endpoint, other: &Endpoint) -> bool {
    match (one, other) {
        (Endpoint::Serial(one), Endpoint::Serial(other)) => Wire::serial(one) == Wire::serial(other),
        (Endpoint::Tcp(one), Endpoint::Tcp(other)) => {
            let mut hosts = Hosts::default();
            hosts.of(one) == hosts.of(other)
        }
        _ => false,
    }
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
