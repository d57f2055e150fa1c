//! The log: to stderr, as much as `DRIVED_LOG` says (`debug`, `drive_bus=trace,warn`).

use std::io::{self, IsTerminal as _};

use tracing::Level;
use tracing_subscriber::{EnvFilter, filter::LevelFilter};

const VARIABLE: &str = "DRIVED_LOG";

/// Starts the log at a level, or at what the environment says instead. `None`: no log, because the screen is a table.
pub(crate) fn start(level: Option<Level>) {
    let Some(level) = level else { return };
    let filter = EnvFilter::builder()
        .with_default_directive(LevelFilter::from_level(level).into())
        .with_env_var(VARIABLE)
        .from_env_lossy();
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .with_target(false)
        .init();
}
