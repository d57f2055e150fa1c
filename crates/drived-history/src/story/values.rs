//! What the values of a drive show around a moment.

use drived_plant::plant::past::{Certainty, SentenceView as Sentence};
use rusqlite::Connection;

use super::facts::{Facts, lasting};
use crate::{quantity::Quantity, read::pieces, store::StoreError};

/// Within this time behind a moment a value moves that belongs to it.
const MOVES_MS: i64 = 15_000;

/// An event so shortly behind a moment belongs to it.
const BELONGS_MS: i64 = 1_000;
/// A value is known for so long behind its reading.
const HELD_MS: i64 = 3_000;

/// When the drive was last seen within a minute before a moment: behind a trip without a fault, unless it had one all the time.
fn last_seen(
    connection: &Connection,
    facts: &Facts,
    at: i64,
    is_trip: bool,
) -> Result<Option<i64>, StoreError> {
    let pieces = pieces(connection, &facts.drive, Quantity::STATE, at - 60_000, at)?;
    let (mut seen, mut seen_well) = (None, None);
    for piece in &pieces {
        for (place, point) in piece.points.iter().enumerate() {
            let Some(count) = point.count else { continue };
            let until = piece.points.get(place + 1).map_or(piece.end, |next| next.at - 1).min(at);
            seen = Some(until);
            if Quantity::STATE.text(count) != "fault" {
                seen_well = Some(until);
            }
        }
    }
    Ok(seen_well.filter(|_| is_trip).or(seen))
}

/// How the drive was a moment before something happened.
pub(super) fn before(
    connection: &Connection,
    facts: &Facts,
    moment: i64,
) -> Result<Vec<Sentence>, StoreError> {
    let mut said = Vec::new();
    let shown = [
        (Quantity::STATE, "", ""),
        (Quantity::OUTPUT_FREQUENCY, "output ", " Hz"),
        (Quantity::SETPOINT, "setpoint ", " Hz"),
        (Quantity::CURRENT, "current ", " A"),
        (Quantity::TORQUE, "torque ", " %"),
        (Quantity::DC_BUS_VOLTAGE, "DC bus ", " V"),
        (Quantity::MOTOR_THERMAL, "motor's thermal state ", " %"),
    ];
    // The status that shows what happened was read at that moment; the one before it is asked for, or the last one before it was not seen.
    let gap = facts.gap_before(moment).map(|(start, _)| start);
    let at = gap.unwrap_or(moment - 1_000);
    // A fault that is read with a trip is the trip; one that stands when something else happens is how the drive was.
    let is_trip = facts.records.iter().any(|found| {
        found.what == "tripped"
            && facts.is_of_drive(found)
            && (found.time_unix_ms - moment).abs() <= BELONGS_MS
    });
    let (at, gap) = match last_seen(connection, facts, at, is_trip)? {
        Some(seen) if at - seen > HELD_MS => (seen, Some(seen)),
        Some(seen) => (seen.min(at), gap),
        None => (at, gap),
    };
    let mut known = Vec::new();
    for (quantity, label, unit) in shown {
        let pieces = pieces(connection, &facts.drive, quantity, moment - 60_000, at)?;
        let points: Vec<_> = pieces.iter().flat_map(|piece| &piece.points).collect();
        let Some(last) = points.last() else { continue };
        let held = pieces.last().filter(|piece| at - piece.end <= HELD_MS).and(last.count);
        let Some(count) = held else { continue };
        let text = format!("{label}{}{unit}", quantity.text(count));
        let counts = || points.iter().filter_map(|point| point.count).filter(|_| quantity.is_number());
        let least = counts().min().filter(|least| *least < count - quantity.deadband());
        let most = counts().max().filter(|most| *most > count + quantity.deadband());
        let from = least.map(|least| format!("{} at the least", quantity.text(least)));
        let to = most.map(|most| format!("{} at the most", quantity.text(most)));
        let range: Vec<String> = from.into_iter().chain(to).collect();
        known.push(match range.is_empty() {
            false => format!("{text} ({} in the minute before)", range.join(", ")),
            true => text,
        });
    }
    match known.is_empty() {
        true => said.push(Sentence::of(Certainty::NotKnown, "how it was a moment before is not known")),
        false => {
            // When it was read that it was so nobody has kept, where every poll showed the same: no moment is told for it.
            said.push(match gap {
                Some(start) => {
                    let text = format!(
                        "{} (as it was read last, {} before)",
                        known.join(", "),
                        lasting(moment - start)
                    );
                    Sentence::of(Certainty::Seen, text).at(at)
                }
                None => Sentence::of(
                    Certainty::Seen,
                    format!("{} (as the poll before showed it)", known.join(", ")),
                ),
            });
        }
    }
    Ok(said)
}

/// Which values moved behind a moment at which nothing is recorded: by more than a quarter, and far more than they are kept for.
pub(super) fn moved(connection: &Connection, facts: &Facts, at: i64) -> Result<Vec<Sentence>, StoreError> {
    let shown = [
        (Quantity::OUTPUT_FREQUENCY, "output", "Hz"),
        (Quantity::CURRENT, "current", "A"),
        (Quantity::TORQUE, "torque", "%"),
        (Quantity::DC_BUS_VOLTAGE, "DC bus", "V"),
    ];
    let (mut said, mut load, mut is_steady) = (Vec::new(), None, false);
    // What moves behind the next event moves by that.
    let next = facts.records.iter().find(|found| {
        found.kind != "history" && facts.is_of_drive(found) && found.time_unix_ms > at + BELONGS_MS
    });
    let until = next.map_or(at + MOVES_MS, |next| next.time_unix_ms.min(at + MOVES_MS) - 1);
    for (quantity, label, unit) in shown {
        let pieces = pieces(connection, &facts.drive, quantity, at - MOVES_MS, until)?;
        let points = || pieces.iter().flat_map(|piece| &piece.points);
        let count_then = points().take_while(|point| point.at <= at).last().and_then(|point| point.count);
        let Some(then) = count_then else { continue };
        let later =
            points().skip_while(|point| point.at <= at).filter_map(|point| Some((point.at, point.count?)));
        let farthest = later.max_by_key(|(_, count)| count.abs_diff(then));
        let is_far = |count: i64| {
            let by = count.abs_diff(then);
            by > 10 * quantity.deadband().max(1).unsigned_abs()
                && by * 4 > count.unsigned_abs().max(then.unsigned_abs())
        };
        let Some((seen, count)) = farthest.filter(|(_, count)| is_far(*count)) else {
            is_steady |= quantity == Quantity::OUTPUT_FREQUENCY;
            continue;
        };
        let text =
            format!("its {label} went from {} to {} {unit}", quantity.text(then), quantity.text(count));
        said.push(Sentence::of(Certainty::Seen, text).at(seen));
        if matches!(quantity, Quantity::CURRENT | Quantity::TORQUE) {
            load = Some(if count > then { "rose" } else { "fell" });
        }
    }
    if let Some(way) = load.filter(|_| is_steady) {
        let text = format!("the load of its motor {way}: current or torque moved, and the output did not");
        said.push(Sentence::of(Certainty::Likely, text));
    }
    Ok(said)
}
