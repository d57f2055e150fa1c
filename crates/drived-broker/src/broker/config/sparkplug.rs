//! `[mqtt.sparkplug]`: the daemon as an edge node of Sparkplug B, for the SCADA hosts of the same brokers.

use std::{path::PathBuf, time::Duration};

use drive_sparkplug::{Id, NodeName};
use serde::Deserialize;
use toml::Spanned;

use drived_config::{
    config::{ConfigError, Parsed, Source, State, words},
    host::host_name,
    rights::Role,
};
use drived_plant::plant::commands::LONGEST_LIFETIME;
use drived_words::duration::Time;

/// How old a command may be, by the clock of the host that has sent it, unless it says so itself.
const LIFETIME: Duration = Duration::from_secs(1);
/// Between two births that a host asks for.
const REBIRTH_PAUSE: Duration = Duration::from_secs(5);

/// The edge node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SparkplugConfig {
    pub name: NodeName,
    /// The host without which nothing is said.
    pub primary_host: Option<Id>,
    /// What hosts may do; `None`: nothing, and no command is heard.
    pub commands: Option<Role>,
    /// How old a command may be that does not say so itself.
    pub lifetime: Duration,
    pub rebirth_pause: Duration,
    /// Whether what the history kept while nobody was told is told later.
    pub historical: bool,
    /// The file of the number that joins deaths to births.
    pub state: PathBuf,
}

words! {
    /// What hosts may do.
    Commands(Option<Role>):
    "off" => None,
    "stop" => Some(Role::Stop),
    "operate" => Some(Role::Operate)
}

/// `[mqtt.sparkplug]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SparkplugEntry {
    group: Spanned<String>,
    edge_node: Option<Spanned<String>>,
    primary_host: Option<Spanned<String>>,
    commands: Option<Parsed<Commands>>,
    lifetime: Option<Spanned<Parsed<Time>>>,
    rebirth_pause: Option<Parsed<Time>>,
    #[serde(default)]
    historical: bool,
    state: Option<PathBuf>,
}

impl SparkplugConfig {
    /// The section of a file with these drives and lines.
    pub fn read<'a>(
        source: Source<'_>,
        entry: &SparkplugEntry,
        drives: impl Iterator<Item = &'a str>,
        lines: impl Iterator<Item = &'a str>,
        kept: &State,
    ) -> Result<Self, ConfigError> {
        let id = |said: &Spanned<String>| {
            Id::new(said.get_ref().as_str()).map_err(|error| source.error(said.span(), error))
        };
        let edge_node = match &entry.edge_node {
            Some(said) => id(said)?,
            None => host_name().and_then(|name| Id::new(name).ok()).ok_or_else(|| {
                let problem = "this machine has no name for it: expected edge_node = \"NAME\"";
                source.error(entry.group.span(), problem)
            })?,
        };
        let mut devices: Vec<&str> = Vec::new();
        for drive in drives {
            Id::new(drive).map_err(|error| {
                source.error(entry.group.span(), format_args!("as a device, drive {error}"))
            })?;
            devices.push(drive);
        }
        for (kind, names) in [("drives", devices), ("lines", lines.collect())] {
            if let Some((one, other)) = alike(&names) {
                let problem = format_args!(
                    "{kind} {one:?} and {other:?} differ in nothing but case: hosts may take one for the other"
                );
                return Err(source.error(entry.group.span(), problem));
            }
        }
        let lifetime = entry.lifetime.as_ref().map_or(LIFETIME, |said| said.get_ref().0.0);
        if let Some(said) =
            entry.lifetime.as_ref().filter(|_| lifetime.is_zero() || lifetime > LONGEST_LIFETIME)
        {
            let problem = format_args!("{lifetime:?}: expected up to {LONGEST_LIFETIME:?}");
            return Err(source.error(said.span(), problem));
        }
        let state = kept.bd_seq(source, entry.state.as_deref()).ok_or_else(|| {
            let problem = "bdSeq has to outlive the daemon: expected state = \"FOLDER\" at the top level";
            source.error(entry.group.span(), problem)
        })?;
        Ok(Self {
            name: NodeName { group: id(&entry.group)?, edge_node },
            primary_host: entry.primary_host.as_ref().map(id).transpose()?,
            commands: entry.commands.and_then(|commands| commands.0.0),
            lifetime,
            rebirth_pause: entry.rebirth_pause.map_or(REBIRTH_PAUSE, |time| time.0.0),
            historical: entry.historical,
            state,
        })
    }
}

/// The first two names that differ in nothing but case.
fn alike<'a>(names: &[&'a str]) -> Option<(&'a str, &'a str)> {
    let mut lower: Vec<(String, &str)> = names.iter().map(|name| (name.to_lowercase(), *name)).collect();
    lower.sort_unstable();
    lower.windows(2).find(|pair| pair[0].0 == pair[1].0).map(|pair| (pair[0].1, pair[1].1))
}
