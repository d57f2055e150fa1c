//! What the values of a drive show around a moment.

use drived_plant::plant::past::{Certainty, SentenceView as Sentence};
use rusqlite::Connection;

use super::{
    about::Asked,
    before::{SLOW_MS, stands_since, states},
    facts::{Facts, lasting},
};
use crate::{quantity::Quantity, read::pieces, store::StoreError};

/// Within this time behind a moment a value moves that belongs to it.
const MOVES_MS: i64 = 15_000;

/// An event so shortly behind a moment belongs to it.
const BELONGS_MS: i64 = 1_000;

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
    let states = states(connection, facts, at - 2 * SLOW_MS, until)?;
    let state = stands_since(&states, at);
    let turns =
        state.and_then(|state| state.count).is_some_and(|state| Quantity::STATE.text(state) == "running")
            && facts.output_at(at) != Some(0);
    // What is read rarely may have moved when the state became another, and long before it was read.
    let is_late = !turns || state.is_some_and(|state| at - state.at < SLOW_MS);
    for (quantity, label, unit) in shown {
        if is_late && quantity == Quantity::TORQUE {
            continue;
        }
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
    Ok(Movement { moved, load: load.filter(|_| is_steady && turns) })
}
