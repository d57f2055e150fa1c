//! A time by a wall's clock that was set back: it was then twice, or ends before it begins. [`Reading`] is a part of it in which the clock went on.

use drived_plant::plant::past::StepView;
use rusqlite::{Connection, params};
use serde::Deserialize;

use super::{
    steps::{empty, told},
    told_in,
};
use crate::{curve::Piece, quantity::Quantity, store::StoreError};

/// A clock that was set back by more is not looked for: nobody asks by both readings of it.
const LONGEST_MS: i64 = 24 * 3_600_000;
/// Nor one that was set back by less.
const SHORTEST_MS: i64 = 1_000;
/// A clock that was set is noticed within this time.
const NOTICED_MS: i64 = 1_000;

/// A moment of the daemon's own clock, over all its runs.
type Own = (i64, i64);

/// That the clock was set, or that it stood lower when the daemon began than when it had ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Turn {
    own: Own,
    from_ms: i64,
    to_ms: i64,
}

/// A part of a time in which the wall's clock was not set back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    pub from_ms: i64,
    pub to_ms: i64,
    /// The clock was set back just before it, from and to these,
    pub set_before: Option<(i64, i64)>,
    /// and behind it.
    pub set_behind: Option<(i64, i64)>,
    since: Own,
    until: Own,
}

/// The readings that a time has, in the daemon's own order: one, unless the clock was set back in it or to before it. None: it ends before it
/// begins, and no clock was set back between.
///
/// # Errors
/// It cannot be read.
pub fn readings(connection: &Connection, from: i64, to: i64) -> Result<Vec<Reading>, StoreError> {
    Ok(within(&turns(connection, from, to)?, from, to))
}

/// Where the clock was set back, in the daemon's own order, near to a time.
fn turns(connection: &Connection, from: i64, to: i64) -> Result<Vec<Turn>, StoreError> {
    #[derive(Deserialize)]
    struct Body {
        from_unix_ms: i64,
        to_unix_ms: i64,
    }
    let mut find = connection.prepare_cached(
        "SELECT run, steady_ms, wall_ms, what, body,
            (SELECT wall_ms FROM record AS before WHERE before.id < record.id ORDER BY id DESC LIMIT 1)
         FROM record WHERE wall_ms BETWEEN ?1 AND ?2 AND kind = 'history'
            AND what IN ('clock_stepped', 'began', 'began_after_kill', 'history_opened') ORDER BY id",
    )?;
    let near = [from.min(to).saturating_sub(LONGEST_MS), from.max(to)];
    let rows = find.query_map(near, |row| {
        let (what, body): (String, Option<String>) = (row.get(3)?, row.get(4)?);
        let (at, before): (i64, Option<i64>) = (row.get(2)?, row.get(5)?);
        let (from_ms, to_ms) = match &*what {
            "clock_stepped" => {
                let body: Option<Body> = body.and_then(|body| serde_json::from_str(&body).ok());
                body.map_or((at, at), |body| (body.from_unix_ms, body.to_unix_ms))
            }
            _ => (before.unwrap_or(at), at),
        };
        Ok(Turn { own: (row.get(0)?, row.get(1)?), from_ms, to_ms })
    })?;
    let all: Vec<Turn> = rows.collect::<Result<_, _>>()?;
    Ok(all.into_iter().filter(|turn| turn.from_ms - turn.to_ms >= SHORTEST_MS).collect())
}

/// The readings of a time, by where the clock was set back.
fn within(turns: &[Turn], from: i64, to: i64) -> Vec<Reading> {
    let set = |turn: &Turn| (turn.from_ms, turn.to_ms);
    // Each goes from one turn to the next.
    let all: Vec<Reading> = (0..=turns.len())
        .map(|place| {
            let before = place.checked_sub(1).and_then(|before| turns.get(before));
            let behind = turns.get(place);
            Reading {
                from_ms: before.map_or(i64::MIN, |turn| turn.to_ms),
                to_ms: behind.map_or(i64::MAX, |turn| turn.from_ms),
                set_before: before.map(set),
                set_behind: behind.map(set),
                since: before.map_or((i64::MIN, 0), |turn| turn.own),
                until: behind.map_or((i64::MAX, 0), |turn| turn.own),
            }
        })
        .collect();
    let has = |reading: &Reading, at: i64| (reading.from_ms..=reading.to_ms).contains(&at);
    if from > to {
        // What was asked for begins in one reading and ends in a later one: the last of those that do.
        let Some(last) = all.iter().rposition(|reading| has(reading, to)) else { return Vec::new() };
        let Some(first) = all[..last].iter().rposition(|reading| has(reading, from)) else {
            return Vec::new();
        };
        let mut meant = all[first..=last].to_vec();
        meant[0].from_ms = from;
        meant[last - first].to_ms = to;
        return meant;
    }
    let part = |reading: &Reading| Reading {
        from_ms: reading.from_ms.max(from),
        to_ms: reading.to_ms.min(to),
        ..*reading
    };
    let parts: Vec<Reading> = all.iter().map(part).filter(|part| part.from_ms <= part.to_ms).collect();
    match parts[..] {
        // Nothing of it was twice.
        [_] | [] => vec![Reading {
            from_ms: from,
            to_ms: to,
            set_before: None,
            set_behind: None,
            since: (i64::MIN, 0),
            until: (i64::MAX, 0),
        }],
        _ => parts,
    }
}

impl Reading {
    /// Whether it is all that was told of its time.
    #[must_use]
    pub const fn is_the_only_one(&self) -> bool {
        self.set_before.is_none() && self.set_behind.is_none()
    }

    /// Whether what was told in its time in a run, at this moment of the daemon's own clock, is of this reading.
    #[must_use]
    pub fn has(&self, run: i64, steady_ms: i64) -> bool {
        let own = (run, steady_ms);
        let (run, steady_ms) = self.since;
        (run, steady_ms.saturating_sub(NOTICED_MS)) <= own && own <= self.until
    }

    /// What is known of a quantity in it, as it was read: nothing where that is not kept any more.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn pieces(
        &self,
        connection: &Connection,
        drive: &str,
        quantity: Quantity,
    ) -> Result<Vec<Piece>, StoreError> {
        let mut find = connection.prepare_cached("SELECT run, steady_ms FROM segment WHERE id = ?1")?;
        let mut pieces = Vec::new();
        for (segment, piece) in told_in(connection, drive, quantity, self.from_ms, self.to_ms)? {
            let own: Own = find.query_row(params![segment], |row| Ok((row.get(0)?, row.get(1)?)))?;
            if self.since <= own && own < self.until {
                pieces.push(piece);
            }
        }
        Ok(pieces)
    }

    /// The same in steps; `None`: what is kept of its time is in steps alone, which have all its readings in them.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn steps(
        &self,
        connection: &Connection,
        drive: &str,
        quantity: Quantity,
        length_ms: i64,
    ) -> Result<Option<Vec<StepView>>, StoreError> {
        let mut steps = empty(quantity, length_ms.max(1));
        let pieces = self.pieces(connection, drive, quantity)?;
        // What is kept as it was read may all be of another reading, as behind a kill soon after the clock was set.
        if pieces.is_empty() && told_in(connection, drive, quantity, self.from_ms, self.to_ms)?.is_empty() {
            return Ok(None);
        }
        pieces.into_iter().for_each(|piece| steps.add(piece));
        Ok(Some(told(&steps, quantity, length_ms.max(1))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(turns: &[(i64, i64)], from: i64, to: i64) -> Vec<(i64, i64)> {
        let turn = |(place, &(from_ms, to_ms)): (usize, &(i64, i64))| Turn {
            own: (1, place as i64),
            from_ms,
            to_ms,
        };
        let turns: Vec<Turn> = turns.iter().enumerate().map(turn).collect();
        within(&turns, from, to).iter().map(|reading| (reading.from_ms, reading.to_ms)).collect()
    }

    #[test]
    fn a_time_over_a_clock_that_was_set_back_is_told_in_both_readings() {
        // At 125 it was set back to 95.
        let back = [(125, 95)];
        assert_eq!(spans(&back, 120, 100), [(120, 125), (95, 100)], "it ends before it begins");
        assert_eq!(spans(&back, 90, 110), [(90, 110), (95, 110)], "it was twice");
        assert_eq!(spans(&back, 110, 130), [(110, 125), (110, 130)]);
        assert_eq!(spans(&back, 10, 90), [(10, 90)], "of what was before there is one");
        assert_eq!(spans(&back, 126, 130), [(126, 130)], "and of what came when all was caught up");
        let twice = [(125, 95), (110, 80)];
        assert_eq!(spans(&twice, 120, 90), [(120, 125), (95, 110), (80, 90)]);
        assert_eq!(spans(&twice, 105, 90), [(105, 110), (80, 90)], "the last of those that are meant");
    }

    #[test]
    fn a_time_that_ends_before_it_begins_without_such_a_step_is_none() {
        assert_eq!(spans(&[], 120, 100), []);
        assert_eq!(spans(&[(125, 95)], 130, 100), [], "the clock had not come so far");
        assert_eq!(spans(&[(125, 95)], 120, 90), [], "nor gone back so far");
    }
}
