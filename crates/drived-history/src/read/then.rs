//! What was known of a drive at a moment.

use std::collections::BTreeMap;

use drived_plant::plant::past::{DriveThenView, IsView};
use rusqlite::Connection;

use super::{all_quantities, pieces, steps};
use crate::{quantity::Quantity, store::StoreError};

const MINUTE_MS: i64 = 60_000;
const HOUR_MS: i64 = 3_600_000;

/// What a drive showed at a moment: as it was read, or, where that is not kept any more, by the means of its minute or hour. What was not known
/// then is not there.
///
/// # Errors
/// It cannot be read.
pub fn then(connection: &Connection, drive: &str, at: i64) -> Result<DriveThenView, StoreError> {
    let (mut values, mut exact) = (BTreeMap::new(), true);
    for quantity in all_quantities(connection, drive)? {
        let is =
            match pieces(connection, drive, quantity, at, at)?.last().and_then(|piece| piece.points.last()) {
                Some(point) => quantity.point(*point).is,
                None if quantity.is_number() => {
                    let mean = mean_around(connection, drive, quantity, at)?;
                    exact &= mean.is_none();
                    mean.map(IsView::Number)
                }
                None => None,
            };
        values.extend(is.map(|is| (quantity.to_string(), is)));
    }
    Ok(DriveThenView { drive: drive.to_owned(), values, exact })
}

/// The mean of the minute, or hour, of which nothing finer is kept. Where the minute itself is known to be a gap, nothing.
fn mean_around(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    at: i64,
) -> Result<Option<f64>, StoreError> {
    if super::oldest_kept(connection, drive, quantity)?.is_some_and(|oldest| at >= oldest) {
        return Ok(None);
    }
    // Where minutes are kept, one that is not there is a gap.
    let length = match super::steps::oldest_minute_of(connection, drive, quantity)? {
        Some(oldest) if oldest <= at => MINUTE_MS,
        _ => HOUR_MS,
    };
    let start = at - at.rem_euclid(length);
    let found = steps(connection, drive, quantity, start, start + length - 1, length, &|| true)?;
    Ok(found.first().filter(|step| step.known > 0.5).and_then(|step| step.mean))
}
