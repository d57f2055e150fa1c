//! How a drive was a moment before something was told of it: as it was read last before the reading that shows it, each value with how old it is.

use drived_plant::plant::past::{Certainty, RecordView, SentenceView as Sentence};
use rusqlite::Connection;

use super::{
    body::body,
    facts::{Facts, Fall, begins, known_spans, lasting},
};
use crate::{column::Point, quantity::Quantity, read::pieces, store::StoreError};

/// So long before a moment it is looked.
const MINUTE_MS: i64 = 60_000;
/// What a reading shows is told so shortly before or behind it; the next one is later.
const TOLD_BEFORE_MS: i64 = 20;
const TOLD_BEHIND_MS: i64 = 300;
/// A change of state is told this long behind its reading at the most, and a trip as long as it is asked what it was by.
const STATE_TOLD_MS: i64 = 1_500;
const TRIP_TOLD_MS: i64 = 5_000;
/// What is told with a drive that is heard again is told of the same reading.
const WITH_IT_MS: i64 = 150;
/// What was read longer than this before it was told is told as that.
const LATE_MS: i64 = 1_000;
/// A value is known for so long behind its reading.
const HELD_MS: i64 = 3_000;
/// An output that is off for longer is that of a motor that is told to stand.
const OFF_MS: i64 = 5_000;
/// The slow set is read at least every so often, unless it is set up otherwise.
pub(super) const SLOW_MS: i64 = 15_000;

/// How the drive was a moment before something happened; and before its output fell, where it was seen falling.
pub(super) fn before(
    connection: &Connection,
    facts: &Facts,
    about: Option<&RecordView>,
    moment: i64,
    fall: Option<Fall>,
) -> Result<Vec<Sentence>, StoreError> {
    let states = states(connection, facts, moment - MINUTE_MS, moment + TOLD_BEHIND_MS)?;
    let shown = about.and_then(|about| reading_of(facts, about, &states));
    // What passed its limit was read with what is told, and is no value of before.
    let limit = about.filter(|about| about.what == "limit").map(|_| moment - TOLD_BEHIND_MS);
    let shown = match (shown, limit) {
        (Some(shown), Some(limit)) => Some(shown.min(limit)),
        (shown, limit) => shown.or(limit),
    };
    let at = shown.unwrap_or(moment) - 1;
    let spans = known_spans(&states);
    let known = spans.iter().rev().find(|(start, _)| *start <= at).map(|(_, end)| (*end).min(at));
    let silent = silent_since(facts, moment, at);
    let seen = known.map(|known| silent.unwrap_or(known).min(known));
    let values = match seen {
        Some(seen) => values(connection, facts, &states, seen)?,
        None => Vec::new(),
    };
    let (Some(seen), false) = (seen, values.is_empty()) else {
        let text = match facts.ends_soon_after(moment) {
            Some(_) => {
                "how it was a moment before is not known, or not written yet: what is read is written within a minute"
            }
            None => "how it was a moment before is not known",
        };
        return Ok(vec![Sentence::of(Certainty::NotKnown, text)]);
    };
    let values = values.join(", ");
    // When it was read that it was so nobody has kept, where every poll showed the same: no moment is told for it.
    let mut said = vec![match shown.filter(|shown| moment - shown > LATE_MS) {
        _ if seen < at => {
            let text = format!("{values} (as it was read last, {} before)", lasting(moment - seen));
            Sentence::of(Certainty::Seen, text).at(seen)
        }
        _ if about.is_some_and(|about| facts.is_found_unanswered(about.time_unix_ms)) => {
            let text = format!("{values} (as it was read last; a poll behind that was not answered)");
            Sentence::of(Certainty::Seen, text)
        }
        Some(shown) => Sentence::of(
            Certainty::Seen,
            format!(
                "{values} (as the poll before showed it; what is told was read {} before it was told)",
                lasting(moment - shown)
            ),
        ),
        None => Sentence::of(Certainty::Seen, format!("{values} (as the poll before showed it)")),
    }];
    let fell = fall.map(|fall| fall.since).filter(|since| shown.is_none_or(|shown| *since < shown));
    if let Some(fell) = fell.or_else(|| off_since(facts, &states, seen)) {
        let states = self::states(connection, facts, fell - MINUTE_MS, fell)?;
        let values = self::values(connection, facts, &states, fell - 1)?.join(", ");
        let text = format!("before its output was read lower: {values}");
        let first = Sentence::of(Certainty::Seen, text).at(fell);
        said.extend(Some(first).filter(|_| !values.is_empty()));
    }
    Ok(said)
}

/// Since when the output of a motor that was read as running was read as off: what was read with it is of a moment at which its run had ended.
fn off_since(facts: &Facts, states: &[Point], at: i64) -> Option<i64> {
    let state = stands_since(states, at)?;
    let (since, _) = facts.output_since(at).filter(|(_, output)| *output == Some(0))?;
    let runs = Quantity::STATE.text(state.count?) == "running";
    (runs && since > state.at && at - since <= OFF_MS).then_some(since)
}

/// Its states, each from its moment on, and since when nothing is known.
pub(super) fn states(
    connection: &Connection,
    facts: &Facts,
    from: i64,
    to: i64,
) -> Result<Vec<Point>, StoreError> {
    let pieces = pieces(connection, &facts.drive, Quantity::STATE, from, to)?;
    Ok(pieces.into_iter().flat_map(crate::curve::Piece::closed).collect())
}

/// Since when its state is as it is at a moment.
pub(super) fn stands_since(states: &[Point], at: i64) -> Option<&Point> {
    states.iter().rev().find(|point| point.at <= at)
}

/// When that was read which shows what is told: of a state its first reading, of anything else the last one at which something changed.
fn reading_of(facts: &Facts, about: &RecordView, states: &[Point]) -> Option<i64> {
    let moment = about.time_unix_ms;
    let state = |state: &str, within: i64| {
        let is_it = |point: &&Point| {
            (moment - within..=moment + TOLD_BEHIND_MS).contains(&point.at)
                && point.count.is_some_and(|count| Quantity::STATE.text(count) == state)
        };
        states.iter().rev().find(is_it).map(|point| point.at)
    };
    let of_state = match &*about.what {
        _ if about.kind != "event" => return None,
        "tripped" => state("fault", TRIP_TOLD_MS),
        _ => state_with(facts, about).and_then(|to| state(&to, STATE_TOLD_MS)),
    };
    let changed = || {
        let known = states.iter().filter(|point| point.count.is_some()).map(|point| point.at);
        known
            .chain(facts.readings())
            .filter(|at| (moment - TOLD_BEHIND_MS..=moment + TOLD_BEFORE_MS).contains(at))
    };
    of_state.or_else(|| changed().max())
}

/// The state that is told with something, of the same reading.
fn state_with(facts: &Facts, about: &RecordView) -> Option<String> {
    let changed = facts.records.iter().find(|found| {
        found.what == "state_changed"
            && found.drive == about.drive
            && (found.time_unix_ms - about.time_unix_ms).abs() <= TOLD_BEFORE_MS
    });
    body(changed?).to
}

/// Since when nothing had been read of it, where it was lost and what shows it is what was read when it was heard again.
fn silent_since(facts: &Facts, moment: i64, at: i64) -> Option<i64> {
    let mut own = facts.records.iter().rev().filter(|found| {
        found.kind == "event"
            && found.drive.as_deref() == Some(&*facts.drive)
            && found.time_unix_ms <= moment
            && (found.what == "lost"
                || found.what == "connected" && found.time_unix_ms < at.min(moment - WITH_IT_MS))
    });
    own.next().filter(|found| found.what == "lost").map(begins)
}

/// What was known of it at a moment.
fn values(
    connection: &Connection,
    facts: &Facts,
    states: &[Point],
    at: i64,
) -> Result<Vec<String>, StoreError> {
    let shown = [
        (Quantity::STATE, "", ""),
        (Quantity::OUTPUT_FREQUENCY, "output ", " Hz"),
        (Quantity::SETPOINT, "setpoint ", " Hz"),
        (Quantity::CURRENT, "current ", " A"),
        (Quantity::TORQUE, "torque ", " %"),
        (Quantity::DC_BUS_VOLTAGE, "DC bus ", " V"),
        (Quantity::MOTOR_THERMAL, "motor's thermal state ", " %"),
    ];
    let stands = stands_since(states, at).map_or(at, |point| point.at);
    let mut known = Vec::new();
    for (quantity, label, unit) in shown {
        let pieces = pieces(connection, &facts.drive, quantity, at - MINUTE_MS, at)?;
        let points: Vec<_> = pieces.iter().flat_map(|piece| &piece.points).collect();
        let Some(last) = points.last() else { continue };
        let held = pieces.last().filter(|piece| at - piece.end <= HELD_MS).and(last.count);
        let Some(count) = held else { continue };
        let Some(age) = age(quantity, last.at, at, stands) else { continue };
        let text = format!("{label}{}{unit}", quantity.text(count));
        let counts = || points.iter().filter_map(|point| point.count).filter(|_| quantity.is_number());
        let least = counts().min().filter(|least| *least < count - quantity.deadband());
        let most = counts().max().filter(|most| *most > count + quantity.deadband());
        let from = least.map(|least| format!("{} at the least", quantity.text(least)));
        let to = most.map(|most| format!("{} at the most", quantity.text(most)));
        let range: Vec<String> = from.into_iter().chain(to).collect();
        let range = (!range.is_empty()).then(|| format!("{} in the minute before", range.join(", ")));
        let beside: Vec<String> = range.into_iter().chain(age).collect();
        known.push(match beside.is_empty() {
            false => format!("{text} ({})", beside.join("; ")),
            true => text,
        });
    }
    Ok(known)
}

/// How old a value is that is read more rarely than the state, in words; `None`: it may have been read when the state was another.
fn age(quantity: Quantity, changed: i64, at: i64, stands: i64) -> Option<Option<String>> {
    match at - changed {
        _ if !quantity.is_measured() => Some(None),
        age @ ..SLOW_MS => (changed >= stands).then(|| Some(format!("read {} before that", lasting(age)))),
        _ => (at - stands >= SLOW_MS).then(|| Some("read more rarely".to_owned())),
    }
}
