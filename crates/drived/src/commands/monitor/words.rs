//! What the API says in one word, in plain words: those of the page.

use std::time::Duration;

use crate::plant::commands::OutcomeWord;

/// What became of a command.
pub(super) fn outcome(word: OutcomeWord) -> String {
    match word {
        OutcomeWord::NotConfirmed => "NOT confirmed".to_owned(),
        OutcomeWord::Unknown => "outcome unknown".to_owned(),
        OutcomeWord::Superseded => "superseded by a later command".to_owned(),
        word => word.to_string(),
    }
}

/// A word of the API whose parts are joined, as it is spoken.
pub(super) fn spoken(word: &str) -> String {
    word.replace('_', " ")
}

/// An age or a length of time, in one unit that a person takes in at a glance.
pub(super) fn time(time: Duration) -> String {
    let milliseconds = time.as_millis();
    match milliseconds {
        0..1_000 => format!("{milliseconds} ms"),
        1_000..10_000 => format!("{}.{} s", milliseconds / 1_000, milliseconds % 1_000 / 100),
        10_000..120_000 => format!("{} s", milliseconds / 1_000),
        120_000..7_200_000 => format!("{} min", milliseconds / 60_000),
        _ => format!("{} h", milliseconds / 3_600_000),
    }
}

/// A moment on the wall's clock.
pub(super) fn clock(unix_ms: u64) -> String {
    let at = i64::try_from(unix_ms).ok().and_then(chrono::DateTime::from_timestamp_millis);
    at.map_or_else(|| "-".to_owned(), |at| at.with_timezone(&chrono::Local).format("%H:%M:%S").to_string())
}
