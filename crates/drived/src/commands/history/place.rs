//! Where the history is.

use std::path::PathBuf;

use drived_client::{ANSWERED_WITHIN, Daemon, path_of};
use drived_file::Config;
use drived_history::{
    config::HistoryConfig,
    read::{self, History},
    store::StoreError,
};
use drived_words::failure::Failure;

/// Where the history is.
#[derive(Debug, clap::Args)]
pub(crate) struct HistoryArgs {
    /// The configuration, whose state folder keeps the history
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    /// The file of the history itself, wherever it is
    #[arg(long, value_name = "FILE", conflicts_with = "config")]
    file: Option<PathBuf>,
}

impl HistoryArgs {
    /// Opens it, where it has something of this drive.
    pub(crate) fn open(&self, drive: &str) -> Result<History, Failure> {
        let history = History::open(&self.path()?).map_err(failed)?;
        let known = read::drives(&history.0).map_err(failed)?;
        match known.iter().any(|name| name == drive) {
            true => Ok(history),
            false => {
                let known = if known.is_empty() { "none yet".to_owned() } else { known.join(", ") };
                Err(Failure::Input(format!("the history has nothing of a drive {drive:?}: it has {known}")))
            }
        }
    }

    /// Has a daemon that keeps it write what it has read within the last minute, by asking it for the same story; without one the file is
    /// told as it is, and so it is where that has another drive of this name.
    pub(crate) async fn have_written(&self, drive: &str, at: i64) -> Result<(), Failure> {
        if self.file.is_some() {
            return Ok(());
        }
        let config = Config::load(&self.config).map_err(|error| Failure::Input(error.to_string()))?;
        let Some(socket) = config.doors.socket else { return Ok(()) };
        let asked = async {
            let mut daemon = Daemon::connect(socket.path.as_deref(), None).await?;
            let path = format!("{}?at_unix_ms={at}", path_of(&["drives", drive, "why"]));
            daemon.get(&path).await
        };
        // Whatever it answers, or that it does not.
        let _ = tokio::time::timeout(ANSWERED_WITHIN, asked).await;
        Ok(())
    }

    fn path(&self) -> Result<PathBuf, Failure> {
        if let Some(file) = &self.file {
            return Ok(file.clone());
        }
        let config = Config::load(&self.config).map_err(|error| Failure::Input(error.to_string()))?;
        let face = config.face("history").and_then(drived_history::config_of);
        let file = face.and_then(|HistoryConfig { file, .. }| file.clone());
        file.ok_or_else(|| {
            Failure::Input(format!("{}: no history is kept by this configuration", self.config.display()))
        })
    }
}

pub(crate) fn failed(error: StoreError) -> Failure {
    Failure::Input(error.to_string())
}
