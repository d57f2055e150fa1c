//! How far the history was sent on.

use rusqlite::{Connection, OptionalExtension as _};

use super::StoreError;

/// How far it was sent: up to a moment of one clock, and within the window behind that up to a drive.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    pub segment: i64,
    pub until_ms: i64,
    /// The window that is being sent, and the last drive of it that was.
    pub(crate) window: Option<(i64, String)>,
}

impl Place {
    /// That of the file.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn kept(connection: &Connection, target: &str) -> Result<Self, StoreError> {
        let mut find = connection.prepare_cached("SELECT segment, until_ms FROM sent WHERE target = ?1")?;
        let row =
            |row: &rusqlite::Row<'_>| Ok(Self { segment: row.get(0)?, until_ms: row.get(1)?, window: None });
        Ok(find
            .query_row([target], row)
            .optional()?
            .unwrap_or(Self { until_ms: i64::MIN, ..Self::default() }))
    }

    /// Whether everything up to it was sent.
    #[must_use]
    pub const fn is_whole(&self) -> bool {
        self.window.is_none()
    }
}
