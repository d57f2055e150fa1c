//! Closing a line at the end of the program.

use std::time::Duration;

use drive_bus::Line;
use tokio::time::timeout;

/// How long a port has to let itself be closed.
const CLOSED_WITHIN: Duration = Duration::from_secs(1);

/// Closes a port, if it lets itself be closed.
pub async fn close(line: &Line) {
    // The program ends, and with it the port.
    let _ = timeout(CLOSED_WITHIN, line.clone().close()).await;
}
