//! Settings that were read.

use drived_plant::plant::past::PastParameterView;
use rusqlite::Connection;

use crate::store::StoreError;

/// Every value of the settings of a drive that was ever read, by address, the newest last.
///
/// # Errors
/// It cannot be read.
pub fn parameters(connection: &Connection, drive: &str) -> Result<Vec<PastParameterView>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT address, code, word, text, first_ms, last_ms, times FROM parameter
         WHERE drive = ?1 ORDER BY address, id LIMIT 20000",
    )?;
    let rows = find.query_map([drive], |row| {
        Ok(PastParameterView {
            address: row.get(0)?,
            mnemonic: row.get(1)?,
            raw: row.get(2)?,
            text: row.get(3)?,
            first_unix_ms: row.get(4)?,
            last_unix_ms: row.get(5)?,
            times: row.get(6)?,
        })
    })?;
    Ok(rows.collect::<Result<_, _>>()?)
}
