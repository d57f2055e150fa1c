//! What is no parameter, though it stands in the map.

use super::Row;
use crate::error::{Error, Result};

/// Refuses to write one of the registers that command the motor, its control words and references, as a parameter: a
/// write of a parameter looks at nothing that a command looks at.
///
/// # Errors
/// [`Error::Unsupported`] when the row is one of `commands`.
pub fn refuse_commands(row: &Row, commands: &[u16]) -> Result<()> {
    if commands.contains(&row.address) {
        return Err(Error::Unsupported {
            what: "writing a command as a parameter",
            reason: "start, stop, fault reset and setpoint check the drive first; use them",
        });
    }
    Ok(())
}
