//! The story of a moment in words: what came first, what followed, who did what, and what is not known.
//!
//! Nothing is told as certain but what the drive says, what somebody asked for here, and what was seen. A cause that the facts only speak for is
//! told as likely, and one that cannot be told from another with that other.

mod about;
mod before;
mod body;
mod cause;
mod course;
mod facts;
mod journal;
#[cfg(test)]
mod tests;
mod values;

use drived_plant::plant::past::{RecordView, StoryView as Story};
use rusqlite::Connection;

use self::{
    about::{Asked, about, also, beside, later},
    before::before,
    body::body,
    course::{AFTER_MS, BEFORE_MS, course, not_known, settings, with_settings},
    facts::Facts,
    values::moved,
};
pub use self::{
    facts::AFTER_MS as LOOKED_AFTER_MS,
    journal::{Line, lines},
};
use crate::store::StoreError;

/// Tells the story of a drive at a moment; at that minute, where it is a whole one.
///
/// # Errors
/// The file cannot be read.
pub fn tell(connection: &Connection, drive: &str, at: i64) -> Result<Story, StoreError> {
    let (facts, asked) = (Facts::gather(connection, drive, at)?, Asked::of(at));
    let about = about(&facts, asked);
    let moment = about.map_or(at, |found| found.time_unix_ms);
    let movement = match about {
        Some(about) if about.what != "limit" => None,
        _ => Some(moved(connection, &facts, asked)?),
    };
    let has_moved = movement.as_ref().is_some_and(|movement| movement.is_of(asked));
    let moved = movement.map(|movement| movement.told(asked)).unwrap_or_default();
    let mut why = match about {
        Some(about) => cause::causes(&facts, about),
        None => cause::of_nothing(&facts, at, has_moved),
    };
    let settings = settings(connection, drive, moment - BEFORE_MS, moment + AFTER_MS)?;
    if about.is_some_and(|about| about.what == "tripped") {
        let written = settings.iter().filter(|setting| setting.time_unix_ms < Some(moment));
        why.extend(written.cloned());
    }
    let headline = match about {
        Some(found) => Some(cause::headline(&facts, found)),
        None => moved.first().filter(|_| has_moved).cloned(),
    };
    why.extend(moved);
    // First of all: it is not what was asked for.
    why.splice(0..0, about.and_then(|about| later(&facts, about, asked)));
    let also = about.map(|about| also(&facts, about, asked, &why)).unwrap_or_default();
    why.extend(also);
    let beside = beside(&facts, about, moment, &why);
    why.extend(beside);
    let fall = about.filter(|about| shows_late(about)).and_then(|_| facts.fall_before(moment));
    Ok(Story {
        drive: drive.to_owned(),
        about: headline,
        why,
        before: before(connection, &facts, about, moment, fall)?,
        course: with_settings(course(&facts, moment), settings),
        not_known: not_known(&facts, moment, about.is_some()),
    })
}

/// Whether a drive may show something only when its motor has been ramping down for a while.
fn shows_late(about: &RecordView) -> bool {
    match &*about.what {
        "command_overridden" | "reference_taken" | "output_blocked" | "control_taken" | "tripped" => true,
        "state_changed" => body(about).from.as_deref() == Some("running"),
        _ => false,
    }
}
