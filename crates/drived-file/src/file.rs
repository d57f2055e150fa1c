//! The whole file, and what the daemon itself is told there.

use std::{path::PathBuf, time::Duration};

use toml::{Spanned, de::DeTable};

use drived_config::config::{
    ConfigError, DriveEntry, GroupEntries, LineEntries, LineEntry, Parsed, SaidState, Source, of, settings,
};
use drived_doors::config::{HttpEntry, SocketEntry};
use drived_words::duration::Time;

/// Snapshots come at most so often: each is a line for every drive.
const SNAPSHOTS_APART: Duration = Duration::from_millis(100);

/// The daemon's own settings while they are read.
#[allow(unreachable_pub, reason = "the table that sets them is declared as public")]
pub struct Draft {
    pub(super) snapshots: Duration,
    pub(super) shutdown: Duration,
    pub(super) kept: SaidState,
}

impl Default for Draft {
    fn default() -> Self {
        let (snapshots, shutdown) = (Duration::from_secs(5), Duration::from_secs(60));
        Self { snapshots, shutdown, kept: SaidState::default() }
    }
}

settings! {
    /// The whole file.
    File sets Draft;

    /// how often a snapshot of every drive is printed, `"100ms"` or more; `"0"`: never
    snapshots: Parsed<Time> = "`\"5s\"`", |to, said| to.snapshots = snapshots(said.0.0)?;
    /// how long the exit may take
    shutdown: Parsed<Time> = "`\"60s\"`", |to, said| to.shutdown = said.0.0;
    /// the folder of what outlives the daemon: `ballast`, `tokens`, `audit`, `runs.json`, `watched.json`, `quick_stops.json`, `watchdogs.json`, `eeprom.json`, `names.json`, `alarms.json`, `history.sqlite`, `added.toml`, `sessions.json`, `webhooks.json`, `sparkplug-bd-seq`, `lock`, and what belongs to one of these by its name; beside the configuration
    /// unless the path is whole
    state: PathBuf = "the folder that systemd names in `STATE_DIRECTORY`; else one of this user for this configuration, in `$XDG_STATE_HOME/drived` or `~/.local/state/drived`",
        |to, said| to.kept.state = Some(said.clone());
    /// another file for the [tokens](rights-and-audit.md#rights-and-tokens); beside the configuration unless the path is whole
    tokens: PathBuf = "in the state folder", |to, said| to.kept.tokens = Some(said.clone());
    /// another file for the [audit log](rights-and-audit.md#audit-log); beside the configuration unless the path is whole
    audit: PathBuf = "in the state folder; none where that is the user's own",
        |to, said| to.kept.audit = Some(said.clone());
    /// the file that keeps what each drive's communication watchdog was before it was armed, for [the exit](daemon.md#how-it-ends) of the
    /// next run if this one is killed
    watchdogs: PathBuf = "`watchdogs.json` in the state folder",
        |to, said| to.kept.watchdogs = Some(said.clone());
    /// a folder of [profiles](families.md#drives-from-files), for drives that are not built in; beside the configuration unless the path is whole
    profiles: PathBuf = "those that are shipped";
    /// the lines, each with a name
    lines as "[lines.NAME]": LineEntries = "one must be given";
    /// the drives
    drives as "[[drives]]": Vec<Spanned<DriveEntry>> = "one must be given";
    /// any key of `[[drives]]` but `line`, `drive`, `name`: for every drive that does not say otherwise
    defaults as "[defaults]": DriveEntry = "none";
    /// `NAME = ["pump 1", "pump 2"]`: drives that are commanded together by one name
    groups as "[groups]": GroupEntries = "none";
    /// the [HTTP server](http.md)
    http as "[http]": HttpEntry = "`127.0.0.1:7580`";
    /// `path` and `mode` of the [control socket](commands-and-monitor.md#commands-through-the-daemon)
    socket as "[socket]": SocketEntry = "as there, `\"0660\"`";
}

fn snapshots(time: Duration) -> Result<Duration, String> {
    match time.is_zero() || time >= SNAPSHOTS_APART {
        true => Ok(time),
        false => Err(format!("{time:?}: expected \"0\" for never, or {SNAPSHOTS_APART:?} or more")),
    }
}

impl File {
    /// The lines by their names.
    pub(super) fn lines(&self) -> impl Iterator<Item = (&Spanned<String>, &LineEntry)> {
        of(&self.lines).into_iter().flatten()
    }

    /// Whether it says a line or a drive.
    pub(super) fn has_plant(&self) -> bool {
        self.lines().next().is_some() || of(&self.drives).is_some_and(|drives| !drives.is_empty())
    }
}

/// The faces that a program may be built without, each with the feature of `drived` that builds it in.
const FEATURES: [(&str, &str); 4] =
    [("gateways", "gateway"), ("history", "history"), ("mqtt", "mqtt"), ("webhooks", "webhook")];

/// That this program was built without something, and the words that build it in.
#[must_use]
pub fn without(feature: &str) -> String {
    format!("this drived was built without it: cargo install drived --features {feature} builds it in")
}

/// Refuses the table of a face that this program was built without, and says how it is built in.
pub(super) fn not_built_in(source: Source<'_>, left: &DeTable<'_>) -> Result<(), ConfigError> {
    for (table, feature) in FEATURES {
        if let Some((key, _)) = left.get_key_value(table) {
            return Err(source.error(key.span(), without(feature)));
        }
    }
    Ok(())
}
