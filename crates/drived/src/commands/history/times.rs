//! Moments, as somebody says and reads them.

use chrono::{DateTime, Local};
use drived_words::{failure::Failure, moment, output};

/// A moment that somebody has said, in milliseconds since 1970; an hour that comes twice is told.
pub(crate) fn moment_of(text: &str) -> Result<i64, Failure> {
    let now = Local::now();
    let said = moment::said(text, &now).map_err(|error| Failure::Input(error.to_string()))?;
    let is_time_alone = text.trim().chars().all(|one| one.is_ascii_digit() || matches!(one, ':' | '.'));
    if is_time_alone && day(&said.at) != day(&now) {
        output::complain(format_args!(
            "{text} is still to come today: yesterday, {}, is meant; of a clock that was set back since, write \"today {text}\"",
            day(&said.at)
        ));
    }
    if let Some(again) = said.again {
        output::complain(format_args!(
            "{text} was twice: {} is meant; for the second write {}",
            said.at.to_rfc3339(),
            again.to_rfc3339()
        ));
    }
    Ok(said.at.timestamp_millis())
}

/// A moment as a person reads it.
pub(crate) fn said(unix_ms: i64) -> String {
    moment::told_here(unix_ms, "%Y-%m-%d %H:%M:%S%.3f").unwrap_or_else(|| unix_ms.to_string())
}

/// The day of a moment.
fn day(at: &DateTime<Local>) -> String {
    at.format("%Y-%m-%d").to_string()
}

pub(crate) fn offset(unix_ms: i64) -> String {
    local(unix_ms).map(|time| format!("UTC{}", time.format("%:z"))).unwrap_or_default()
}

fn local(unix_ms: i64) -> Option<DateTime<Local>> {
    DateTime::from_timestamp_millis(unix_ms).map(|time| time.with_timezone(&Local))
}

/// The offsets of the zone at both ends, where they differ.
pub(super) fn offsets(from: i64, to: i64) -> String {
    let (first, last) = (offset(from), offset(to));
    if first == last { first } else { format!("{first}, then {last}: the clocks were changed between") }
}

/// A moment that no zone changes.
pub(super) fn whole(unix_ms: i64) -> String {
    local(unix_ms).map_or_else(
        || unix_ms.to_string(),
        |time| time.to_rfc3339_opts(chrono::SecondsFormat::Millis, false),
    )
}
