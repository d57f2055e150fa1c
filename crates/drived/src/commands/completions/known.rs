//! The names of a plant: from the configuration that the command line names, else from the running daemon. No port is
//! touched, and nobody waits for a daemon that is slow.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use drive_families::Family;
use tokio::time::timeout;

use super::place::Place;
use drived_client::Daemon;
use drived_file::Config;
use drived_plant::plant::views::{DriveView, StateView};

/// Who presses the tab key waits no longer than this.
const WITHIN: Duration = Duration::from_millis(500);

/// The names of a plant.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Known {
    pub(super) drives: Vec<KnownDrive>,
    pub(super) groups: Vec<String>,
    pub(super) lines: Vec<String>,
}

/// A drive and its family.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KnownDrive {
    pub(super) name: String,
    pub(super) family: Option<Family>,
    /// What stands beside its name: `atv312@7 on north`.
    pub(super) place: String,
}

impl Known {
    /// What can be known at a place; nothing where neither a file nor a daemon tells it.
    pub(super) async fn at(place: &Place<'_>) -> Self {
        if let Some(file) = place.given("config") {
            return Config::load(Path::new(file)).map(|config| Self::of_config(&config)).unwrap_or_default();
        }
        let path = |name| place.given(name).map(PathBuf::from);
        let state = state(path("socket"), path("token-file"));
        timeout(WITHIN, state).await.ok().flatten().map(|state| Self::of_state(&state)).unwrap_or_default()
    }

    /// The family of a drive.
    pub(super) fn family(&self, name: &str) -> Option<Family> {
        self.drives.iter().find(|drive| drive.name == name)?.family
    }

    fn of_config(config: &Config) -> Self {
        let drives = config.lines.iter().flat_map(|line| {
            line.drives.iter().map(|drive| KnownDrive {
                name: drive.settings.name.clone(),
                family: Some(drive.name.family),
                place: format!("{} on {}", drive.name, line.name),
            })
        });
        Self {
            drives: drives.collect(),
            groups: config.groups.iter().map(|group| group.name.clone()).collect(),
            lines: config.lines.iter().map(|line| line.name.clone()).collect(),
        }
    }

    fn of_state(state: &StateView) -> Self {
        let drive = |drive: &DriveView| KnownDrive {
            name: drive.name().to_owned(),
            family: drive.family.parse().ok(),
            place: format!("{}@{} on {}", drive.family, drive.slave, drive.line),
        };
        Self {
            drives: state.drives.iter().map(drive).collect(),
            groups: state.groups.iter().map(|group| group.name.clone()).collect(),
            lines: state.lines.iter().map(|line| line.name.clone()).collect(),
        }
    }
}

async fn state(socket: Option<PathBuf>, token_file: Option<PathBuf>) -> Option<StateView> {
    let mut daemon = Daemon::connect(socket.as_deref(), token_file.as_deref()).await.ok()?;
    daemon.state().await.ok()
}

#[cfg(all(test, unix))]
mod tests {
    use clap::CommandFactory as _;
    use tokio::time::Instant;

    use super::*;
    use crate::cli::Cli;

    async fn known(words: &[&str]) -> Known {
        let mut root = Cli::command();
        root.build();
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        Known::at(&Place::find(&root, &words)).await
    }

    #[tokio::test(start_paused = true)]
    async fn nobody_waits_for_a_daemon_that_says_nothing() {
        let path = std::env::temp_dir().join(format!("drived-tab-{}.sock", std::process::id()));
        let stalled = tokio::net::UnixListener::bind(&path).unwrap();
        let began = Instant::now();
        let found = known(&["drived", "status", "--socket", path.to_str().unwrap(), ""]).await;
        assert_eq!(found, Known::default());
        assert!(began.elapsed() <= WITHIN + Duration::from_millis(1), "{:?}", began.elapsed());
        drop(stalled);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(
            known(&["drived", "status", "--socket", path.to_str().unwrap(), ""]).await,
            Known::default()
        );
    }

    #[tokio::test]
    async fn a_file_that_is_named_tells_its_names_and_a_wrong_one_none() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/drives.toml");
        let found = known(&["drived", "explain", "x.pcapng", "--config", file, "--name", ""]).await;
        assert!(found.lines.contains(&"north".to_owned()) && !found.drives.is_empty(), "{found:?}");
        assert!(found.drives.iter().all(|drive| found.family(&drive.name).is_some()));
        let none = known(&["drived", "explain", "x.pcapng", "--config", "/dev/null/x", "--name", ""]).await;
        assert_eq!(none, Known::default());
    }
}
