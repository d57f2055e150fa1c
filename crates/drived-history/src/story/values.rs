//! What the values of a drive show around a moment.

use drived_plant::plant::past::{Certainty, SentenceView as Sentence};
use rusqlite::Connection;

use super::{
    about::Asked,
    facts::{Facts, lasting},
};
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

/// A value that moved.
pub(super) struct Moved {
    /// When it was seen to,
    pub(super) at: i64,
    /// and from what to what.
    pub(super) text: String,
}

/// What moved behind a moment at which nothing is recorded.
pub(super) struct Movement {
    /// In its order.
    pub(super) moved: Vec<Moved>,
    /// What that says of the load, where the output did not move.
    load: Option<&'static str>,
}

impl Movement {
    /// Whether something moved with a moment, and not only seconds later.
    pub(super) fn is_of(&self, asked: Asked) -> bool {
        self.moved.iter().any(|one| asked.is_met_by(one.at))
    }

    /// As it is told; with how long after a moment it was, where it does not belong to it.
    pub(super) fn told(self, asked: Asked) -> Vec<Sentence> {
        let is_of = self.is_of(asked);
        let text = |one: &Moved| match is_of {
            true => one.text.clone(),
            false => format!("{} after it {}", lasting(asked.distance(one.at)), one.text),
        };
        let mut said: Vec<Sentence> =
            self.moved.iter().map(|one| Sentence::of(Certainty::Seen, text(one)).at(one.at)).collect();
        said.extend(self.load.map(|way| {
            let text =
                format!("the load of its motor {way}: current or torque moved, and the output did not");
            Sentence::of(Certainty::Likely, text)
        }));
        said
    }
}

/// Which values moved behind a moment at which nothing is recorded: by more than a quarter, and far more than they are kept for.
pub(super) fn moved(connection: &Connection, facts: &Facts, asked: Asked) -> Result<Movement, StoreError> {
    let shown = [
        (Quantity::OUTPUT_FREQUENCY, "output", "Hz"),
        (Quantity::CURRENT, "current", "A"),
        (Quantity::TORQUE, "torque", "%"),
        (Quantity::DC_BUS_VOLTAGE, "DC bus", "V"),
    ];
    let (mut moved, mut load, mut is_steady) = (Vec::new(), None, false);
    let at = asked.from;
    // What moves behind the next event, or is read with it, moves by that.
    let next = facts.records.iter().find(|found| {
        found.kind != "history" && facts.is_of_drive(found) && found.time_unix_ms > at + BELONGS_MS
    });
    let until = next.map_or(i64::MAX, |next| next.time_unix_ms - BELONGS_MS).min(asked.to + MOVES_MS);
    for (quantity, label, unit) in shown {
        let pieces = pieces(connection, &facts.drive, quantity, at - MOVES_MS, until)?;
        let points = || pieces.iter().flat_map(|piece| &piece.points);
        let count_then = points().take_while(|point| point.at <= at).last().and_then(|point| point.count);
        let Some(then) = count_then else { continue };
        let is_far = |count: i64| {
            let by = count.abs_diff(then);
            by > 10 * quantity.deadband().max(1).unsigned_abs()
                && by * 4 > count.unsigned_abs().max(then.unsigned_abs())
        };
        let later =
            points().skip_while(|point| point.at <= at).filter_map(|point| Some((point.at, point.count?)));
        let far: Vec<(i64, i64)> = later.filter(|(_, count)| is_far(*count)).collect();
        let farthest = far.iter().map(|(_, count)| *count).max_by_key(|count| count.abs_diff(then));
        let (Some((seen, _)), Some(count)) = (far.first(), farthest) else {
            is_steady |= quantity == Quantity::OUTPUT_FREQUENCY;
            continue;
        };
        let text =
            format!("its {label} went from {} to {} {unit}", quantity.text(then), quantity.text(count));
        moved.push(Moved { at: *seen, text });
        if matches!(quantity, Quantity::CURRENT | Quantity::TORQUE) {
            load = Some(if count > then { "rose" } else { "fell" });
        }
    }
    moved.sort_by_key(|one| one.at);
    Ok(Movement { moved, load: load.filter(|_| is_steady) })
}
