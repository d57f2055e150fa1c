//! The story of a moment in words: what came first, what followed, who did what, and what is not known.
//!
//! Nothing is told as certain but what the drive says, what somebody asked for here, and what was seen. A cause that the facts only speak for is
//! told as likely, and one that cannot be told from another with that other.

mod about;
mod body;
mod cause;
mod course;
mod facts;
#[cfg(test)]
mod tests;
mod values;

use drived_plant::plant::past::{Certainty, SentenceView as Sentence, StoryView as Story};
use rusqlite::Connection;

pub use self::facts::AFTER_MS as LOOKED_AFTER_MS;
use self::{
    about::{Asked, about, beside},
    course::{AFTER_MS, BEFORE_MS, course, not_known, settings, with_settings},
    facts::Facts,
    values::{before, moved},
};
use crate::store::StoreError;

/// Tells the story of a drive at a moment; at that minute, where it is a whole one.
///
/// # Errors
/// The file cannot be read.
pub fn tell(connection: &Connection, drive: &str, at: i64) -> Result<Story, StoreError> {
    let facts = Facts::gather(connection, drive, at)?;
    let about = about(&facts, Asked::of(at));
    let moment = about.map_or(at, |found| found.time_unix_ms);
    let moved = match about {
        Some(about) if about.what != "limit" => Vec::new(),
        _ => moved(connection, &facts, at)?,
    };
    let mut why = match about {
        Some(about) => cause::causes(&facts, about),
        None => cause::of_nothing(&facts, at, !moved.is_empty()),
    };
    let settings = settings(connection, drive, moment - BEFORE_MS, moment + AFTER_MS)?;
    if about.is_some_and(|about| about.what == "tripped") {
        let written = settings.iter().filter(|setting| setting.time_unix_ms < Some(moment));
        why.extend(written.cloned());
    }
    let headline = match about {
        Some(found) => Some(Sentence::of(Certainty::Seen, facts.in_words(found)).at(found.time_unix_ms)),
        None => moved.first().cloned(),
    };
    why.extend(moved);
    let beside = beside(&facts, about, moment, &why);
    why.extend(beside);
    Ok(Story {
        drive: drive.to_owned(),
        about: headline,
        why,
        before: before(connection, &facts, moment)?,
        course: with_settings(course(&facts, moment), settings),
        not_known: not_known(&facts, moment, about.is_some()),
    })
}
