//! The files of what has to outlive the daemon.

use std::path::{Path, PathBuf};

use super::place::Source;

/// What each watchdog was before it was armed.
pub(super) const WATCHDOGS: &str = "watchdogs.json";

/// The file that is said, beside the configuration unless its path is whole; else the one of this name where systemd keeps
/// the state of the daemon, if it does.
pub(super) fn file(source: Source<'_>, said: Option<&Path>, name: &str) -> Option<PathBuf> {
    match said {
        Some(said) => Some(source.file.parent().unwrap_or(Path::new("")).join(said)),
        None => folder().map(|folder| folder.join(name)),
    }
}

fn folder() -> Option<PathBuf> {
    let folders = std::env::var_os("STATE_DIRECTORY")?;
    std::env::split_paths(&folders).next().filter(|folder| folder.is_absolute())
}
