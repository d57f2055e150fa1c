//! A time in the text of a line.

use std::time::Duration;

/// Milliseconds that a setting can have: longer ones are somebody's mistake.
const LONGEST: u64 = 60_000;

/// Whole milliseconds or seconds, such as `150ms` or `2s`, at most 60 s.
pub(crate) fn read(text: &str) -> Option<Duration> {
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1),
        None => (text.strip_suffix('s')?, 1_000),
    };
    let millis = number.trim_end().parse::<u32>().ok().map(|number| u64::from(number) * unit)?;
    (millis <= LONGEST).then(|| Duration::from_millis(millis))
}

/// The same as a text.
pub(crate) fn said(time: Duration) -> String {
    let millis = time.as_millis();
    if millis >= 1_000 && millis.is_multiple_of(1_000) {
        format!("{}s", millis / 1_000)
    } else {
        format!("{millis}ms")
    }
}
