//! `[mqtt]`: the broker to which everything is told, and by which commands may come.

use std::{
    collections::BTreeMap,
    fmt,
    net::IpAddr,
    path::{Path, PathBuf},
    str::FromStr,
    time::Duration,
};

use serde::Deserialize;
use toml::Spanned;

use super::sparkplug::SparkplugEntry;
use drived_config::{
    config::{ConfigError, Parsed, Source},
    names::topic_id,
    rights::Role,
};
use drived_doors::config::TlsFiles;
use drived_words::duration::Time;

/// How often everything is told again unless the file says otherwise, and how often at the most.
const HEARTBEAT: Duration = Duration::from_secs(30);
const SHORTEST_HEARTBEAT: Duration = Duration::from_secs(1);
/// How long a value may wait until the next one is told.
const INTERVAL: Duration = Duration::from_secs(1);
/// The same of the slow values.
const MEASUREMENTS: Duration = Duration::from_secs(10);
/// The first levels of every topic.
const BASE: &str = "drived";
/// The first levels of the topics that Home Assistant reads.
const PREFIX: &str = "homeassistant";
/// Where the broker listens unless the file says otherwise.
const CLEAR_PORT: u16 = 1883;
const TLS_PORT: u16 = 8883;

/// The broker, what it is told, and who may command through it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MqttConfig {
    /// Tried in turn.
    pub servers: Vec<Address>,
    /// The certificates of those who vouch for the broker; `None`: those of the system.
    pub authorities: Option<PathBuf>,
    /// By which the broker knows us.
    pub identity: Option<TlsFiles>,
    pub user: Option<String>,
    /// The file of the password.
    pub password: Option<PathBuf>,
    pub client_id: String,
    /// The first levels of every topic.
    pub base: String,
    /// How often everything is told again though nothing has changed.
    pub heartbeat: Duration,
    /// Between two tellings of values that change all the time.
    pub interval: Duration,
    /// The same of the slow values.
    pub measurements: Duration,
    /// Whether anybody may command through the broker.
    pub commands: bool,
    /// What those may do whose names are the last level of the topic; empty: everybody operates, and is called `mqtt`.
    pub commanders: BTreeMap<String, Role>,
    /// Whether a start and a setpoint have to say when they were issued.
    pub needs_issued: bool,
    pub discovery: Discovery,
    /// The first levels of the topics that Home Assistant reads.
    pub discovery_prefix: String,
}

/// A broker as the file names it: `mqtts://HOST`, `mqtt://HOST:PORT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    pub host: String,
    pub port: u16,
    pub tls: bool,
}

/// How Home Assistant is told of the drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Discovery {
    #[default]
    Off,
    /// One document for each drive, as Home Assistant has it since the end of 2024.
    Device,
    /// One document for each value, which older ones know too.
    Component,
}

impl FromStr for Discovery {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "off" => Ok(Self::Off),
            "device" => Ok(Self::Device),
            "component" => Ok(Self::Component),
            _ => Err("expected device, component or off"),
        }
    }
}

impl FromStr for Address {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        const EXPECTED: &str = "expected mqtts://HOST or mqtts://HOST:PORT, or mqtt:// in clear";
        let (tls, rest) = match text.split_once("://") {
            Some(("mqtts", rest)) => (true, rest),
            Some(("mqtt", rest)) => (false, rest),
            _ => return Err(EXPECTED),
        };
        let (host, port) = match rest.rsplit_once(':') {
            Some((host, port)) if !host.ends_with(':') && !port.ends_with(']') => {
                (host, port.parse().map_err(|_| EXPECTED)?)
            }
            _ => (rest, if tls { TLS_PORT } else { CLEAR_PORT }),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']');
        let allowed = |character: char| character.is_ascii_alphanumeric() || ".-_:".contains(character);
        if host.is_empty() || port == 0 || !host.chars().all(allowed) {
            return Err(EXPECTED);
        }
        Ok(Self { host: host.to_owned(), port, tls })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port, tls } = self;
        write!(f, "{}://{host}:{port}", if *tls { "mqtts" } else { "mqtt" })
    }
}

impl Address {
    /// Whether what is said in clear stays on this machine.
    fn is_here(&self) -> bool {
        self.host == "localhost" || self.host.parse().is_ok_and(|address: IpAddr| address.is_loopback())
    }
}

/// `[mqtt]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MqttEntry {
    servers: Spanned<Vec<Spanned<Parsed<Address>>>>,
    #[serde(default)]
    plain: bool,
    authorities: Option<PathBuf>,
    identity: Option<TlsFiles>,
    user: Option<String>,
    password: Option<Spanned<PathBuf>>,
    client_id: Option<Spanned<String>>,
    base: Option<Spanned<String>>,
    heartbeat: Option<Spanned<Parsed<Time>>>,
    interval: Option<Parsed<Time>>,
    measurements: Option<Parsed<Time>>,
    #[serde(default)]
    commands: bool,
    #[serde(default)]
    commanders: BTreeMap<Spanned<String>, Role>,
    needs_issued: Option<Spanned<bool>>,
    discovery: Option<Parsed<Discovery>>,
    discovery_prefix: Option<Spanned<String>>,
    pub sparkplug: Option<SparkplugEntry>,
}

impl MqttConfig {
    /// The section of a file. Files that it names stand beside the file, where their paths are not whole.
    pub fn read(source: Source<'_>, entry: &MqttEntry) -> Result<Self, ConfigError> {
        let folder = source.file.parent().unwrap_or(Path::new(""));
        let servers = servers(source, entry)?;
        let base = levels(source, entry.base.as_ref(), BASE)?;
        let client_id = entry.client_id.as_ref().map(|id| (id.get_ref().clone(), id.span()));
        if let Some((_, span)) = client_id.as_ref().filter(|(id, _)| !is_plain(id) || id.is_empty()) {
            return Err(source.error(span.clone(), "expected a name without spaces and control characters"));
        }
        let nobody = "nobody may command through the broker: expected commands = true";
        for name in entry.commanders.keys() {
            if topic_id(name.get_ref()) != *name.get_ref() || name.get_ref().is_empty() {
                let problem = "it is a level of a topic: expected letters, digits, - and _";
                return Err(source.error(name.span(), problem));
            }
            if !entry.commands {
                return Err(source.error(name.span(), nobody));
            }
        }
        let needs_issued = entry.needs_issued.as_ref().filter(|said| *said.get_ref());
        if let Some(said) = needs_issued.filter(|_| !entry.commands) {
            return Err(source.error(said.span(), nobody));
        }
        let heartbeat = entry.heartbeat.as_ref().map_or(HEARTBEAT, |time| time.get_ref().0.0);
        if let Some(said) = entry.heartbeat.as_ref().filter(|_| heartbeat < SHORTEST_HEARTBEAT) {
            let problem = format_args!("{heartbeat:?}: expected {SHORTEST_HEARTBEAT:?} or more");
            return Err(source.error(said.span(), problem));
        }
        if let Some(password) = entry.password.as_ref().filter(|_| entry.user.is_none()) {
            return Err(source.error(password.span(), "a password of nobody: expected user = \"NAME\" too"));
        }
        let beside = |path: &PathBuf| folder.join(path);
        Ok(Self {
            servers,
            authorities: entry.authorities.as_ref().map(beside),
            identity: entry.identity.as_ref().map(|TlsFiles { certificate, key }| TlsFiles {
                certificate: beside(certificate),
                key: beside(key),
            }),
            user: entry.user.clone(),
            password: entry.password.as_ref().map(|path| beside(path.get_ref())),
            client_id: client_id.map_or_else(|| base.replace('/', "-"), |(id, _)| id),
            base,
            heartbeat,
            interval: entry.interval.map_or(INTERVAL, |time| time.0.0).min(heartbeat),
            measurements: entry.measurements.map_or(MEASUREMENTS, |time| time.0.0).min(heartbeat),
            commands: entry.commands,
            commanders: entry.commanders.iter().map(|(name, role)| (name.get_ref().clone(), *role)).collect(),
            needs_issued: needs_issued.is_some(),
            discovery: entry.discovery.map(|discovery| discovery.0).unwrap_or_default(),
            discovery_prefix: levels(source, entry.discovery_prefix.as_ref(), PREFIX)?,
        })
    }
}

/// The brokers: what crosses a network in clear is said to.
fn servers(source: Source<'_>, entry: &MqttEntry) -> Result<Vec<Address>, ConfigError> {
    let said = entry.servers.get_ref();
    if said.is_empty() {
        return Err(source.error(entry.servers.span(), "expected one at least, such as [\"mqtts://broker\"]"));
    }
    if let Some(server) = said.iter().find(|server| !(server.get_ref().0.tls || server.get_ref().0.is_here()))
        && !entry.plain
    {
        let problem = "commands and passwords would cross the network in clear: expected mqtts://, or plain = true where \
                       something else encrypts";
        return Err(source.error(server.span(), problem));
    }
    Ok(said.iter().map(|server| server.get_ref().0.clone()).collect())
}

/// The first levels of topics.
fn levels(source: Source<'_>, said: Option<&Spanned<String>>, usually: &str) -> Result<String, ConfigError> {
    let Some(said) = said else { return Ok(usually.to_owned()) };
    let text = said.get_ref();
    let is_level = |level: &str| !level.is_empty() && is_plain(level) && !level.contains(['+', '#']);
    match text.len() <= 128 && !text.starts_with('$') && text.split('/').all(is_level) {
        true => Ok(text.clone()),
        false => Err(source.error(
            said.span(),
            "expected levels such as plant/north, without +, #, spaces and an empty one",
        )),
    }
}

/// Whether a text has nothing but characters that are seen.
fn is_plain(text: &str) -> bool {
    !text.chars().any(|character| character.is_control() || character.is_whitespace())
}
