//! What the API says in one word, in plain words: those of the page.

use drived_plant::plant::commands::OutcomeWord;
use drived_words::moment;

/// What became of a command.
pub(super) fn outcome(word: OutcomeWord) -> String {
    match word {
        OutcomeWord::NotConfirmed => "NOT confirmed".to_owned(),
        OutcomeWord::Unknown => "outcome unknown".to_owned(),
        OutcomeWord::Nothing => "nothing to be done".to_owned(),
        word => word.to_string(),
    }
}

/// A moment on the wall's clock.
pub(super) fn clock(unix_ms: u64) -> String {
    let told = i64::try_from(unix_ms).ok().and_then(|at| moment::told_here(at, "%H:%M:%S"));
    told.unwrap_or_else(|| "-".to_owned())
}
