//! Pieces of what is known of a quantity, joined and summed up: [`joined`] and [`Steps`]. Pure.

use std::collections::BTreeMap;

use crate::column::Point;

/// What was known of a quantity from `start` to `end`, both of them included: outside of it nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    pub start: i64,
    pub end: i64,
    /// In their order. What a count says holds to the next point, or to the end.
    pub points: Vec<Point>,
}

/// Joins pieces that follow each other to one. Where nothing lies between two of them what was known goes on; else a point says that
/// nothing is known.
#[must_use]
pub fn joined(pieces: impl IntoIterator<Item = Piece>) -> Option<Piece> {
    let mut all: Option<Piece> = None;
    for piece in pieces {
        let Some(whole) = &mut all else {
            all = Some(piece);
            continue;
        };
        let known = whole.points.last().and_then(|point| point.count);
        let begins = piece.points.first().map_or(i64::MAX, |point| point.at);
        let is_gap = piece.start > whole.end;
        // A quantity that is not there at the beginning of a piece is not known there.
        if known.is_some() && (is_gap || begins > piece.start) {
            whole.points.push(Point { at: whole.end + 1, count: None });
        }
        for point in piece.points {
            if whole.points.last().and_then(|last| last.count) != point.count {
                whole.points.push(point);
            }
        }
        whole.end = piece.end.max(whole.end);
    }
    all
}

impl Piece {
    /// Its points, with one at the end that says that nothing is known behind it.
    #[must_use]
    pub fn closed(self) -> Vec<Point> {
        let mut points = self.points;
        if points.last().is_some_and(|last| last.count.is_some()) {
            points.push(Point { at: self.end + 1, count: None });
        }
        points
    }

    /// The part of it between two moments, both of them included.
    #[must_use]
    pub fn between(self, from: i64, to: i64) -> Option<Self> {
        let (start, end) = (self.start.max(from), self.end.min(to));
        if start > end {
            return None;
        }
        let before = self.points.partition_point(|point| point.at <= start);
        let held = before.checked_sub(1).and_then(|at| self.points.get(at)).and_then(|point| point.count);
        let first = held.map(|count| Point { at: start, count: Some(count) });
        let inside = self.points.into_iter().skip(before).take_while(|point| point.at <= end);
        Some(Self { start, end, points: first.into_iter().chain(inside).collect() })
    }
}

/// What was known of a quantity within one step of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    pub least: i64,
    pub greatest: i64,
    /// By time, over what is known.
    pub mean: f64,
    /// For how much of the step something is known, in milliseconds.
    pub known_ms: i64,
}

impl Step {
    /// What is known of the same step by two parts of it.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let known_ms = self.known_ms + other.known_ms;
        let mean = match known_ms {
            0 => f64::midpoint(self.mean, other.mean),
            known => {
                let weighted = |step: Self| step.mean * step.known_ms as f64;
                (weighted(self) + weighted(other)) / known as f64
            }
        };
        Self {
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
            mean,
            known_ms,
        }
    }
}

/// Steps of one length, by when they begin: at whole multiples of their length since 1970.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    length: i64,
    pub all: BTreeMap<i64, Step>,
    /// For how long each count held, by the beginning of its step, where that is asked for.
    held_ms: Option<BTreeMap<(i64, i64), i64>>,
}

impl Steps {
    /// None yet, of this many milliseconds each.
    #[must_use]
    pub fn of(length: i64) -> Self {
        Self { length: length.max(1), all: BTreeMap::new(), held_ms: None }
    }

    /// The same of what is no number: they also tell for how long each count held, as far as it is [added](Self::add) in pieces.
    #[must_use]
    pub fn of_words(length: i64) -> Self {
        Self { held_ms: Some(BTreeMap::new()), ..Self::of(length) }
    }

    /// Which counts held within the step that begins then, and for how many milliseconds each.
    pub fn held(&self, start: i64) -> impl Iterator<Item = (i64, i64)> + '_ {
        let range = (start, i64::MIN)..=(start, i64::MAX);
        let held = self.held_ms.iter().flat_map(move |held| held.range(range.clone()));
        held.map(|((_, count), lasts)| (*count, *lasts))
    }

    /// Adds what a piece knows.
    pub fn add(&mut self, piece: Piece) {
        let points = piece.closed();
        for (at, point) in points.iter().enumerate() {
            let Some(count) = point.count else { continue };
            let until = match points.get(at + 1) {
                Some(Point { at, count: None }) => at - 1,
                Some(next) => next.at,
                None => point.at,
            };
            self.hold(count, point.at, until);
        }
    }

    /// Adds a step that was summed up before; one that is longer than these, or begins elsewhere, counts for the step in which it begins.
    pub fn add_step(&mut self, start: i64, step: Step) {
        let start = start - start.rem_euclid(self.length);
        self.all.entry(start).and_modify(|known| *known = known.with(step)).or_insert(step);
    }

    /// Adds steps that follow each other: those of one step of these are summed up before they are added.
    pub fn add_steps(&mut self, steps: impl IntoIterator<Item = (i64, Step)>) {
        let mut open: Option<(i64, Step)> = None;
        for (at, step) in steps {
            match &mut open {
                Some((start, sum)) if (*start..*start + self.length).contains(&at) => *sum = sum.with(step),
                _ => {
                    let next = (at - at.rem_euclid(self.length), step);
                    if let Some((start, sum)) = open.replace(next) {
                        self.add_step(start, sum);
                    }
                }
            }
        }
        if let Some((start, sum)) = open {
            self.add_step(start, sum);
        }
    }

    /// A count held from one moment to another.
    fn hold(&mut self, count: i64, from: i64, until: i64) {
        let mut at = from;
        loop {
            let start = at - at.rem_euclid(self.length);
            let end = until.min(start + self.length);
            let held =
                Step { least: count, greatest: count, mean: count as f64, known_ms: (end - at).max(0) };
            self.add_step(start, held);
            if let Some(all) = &mut self.held_ms {
                *all.entry((start, count)).or_default() += held.known_ms;
            }
            if end >= until {
                return;
            }
            at = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(start: i64, end: i64, points: &[(i64, Option<i64>)]) -> Piece {
        Piece { start, end, points: points.iter().map(|&(at, count)| Point { at, count }).collect() }
    }

    #[test]
    fn what_goes_on_is_joined_and_what_lies_between_is_a_gap() {
        let one = piece(0, 10, &[(0, Some(1)), (5, Some(2))]);
        let next = piece(10, 20, &[(10, Some(2)), (15, Some(3))]);
        let behind_a_gap = piece(30, 40, &[(30, Some(3))]);
        let whole = joined([one, next, behind_a_gap]).unwrap();
        let points = [(0, Some(1)), (5, Some(2)), (15, Some(3)), (21, None), (30, Some(3))];
        assert_eq!(whole, piece(0, 40, &points));
        assert_eq!(whole.closed().last(), Some(&Point { at: 41, count: None }));
    }

    #[test]
    fn a_quantity_that_a_piece_begins_without_is_not_known_there() {
        let whole = joined([piece(0, 10, &[(0, Some(1))]), piece(10, 20, &[(15, Some(1))])]).unwrap();
        assert_eq!(whole, piece(0, 20, &[(0, Some(1)), (11, None), (15, Some(1))]));
    }

    #[test]
    fn a_part_begins_with_what_held_then() {
        let whole = piece(0, 100, &[(0, Some(1)), (50, Some(2)), (80, None)]);
        assert_eq!(whole.clone().between(20, 60), Some(piece(20, 60, &[(20, Some(1)), (50, Some(2))])));
        assert_eq!(whole.clone().between(90, 200), Some(piece(90, 100, &[])));
        assert_eq!(whole.between(101, 200), None);
    }

    #[test]
    fn a_step_tells_the_least_the_mean_by_time_the_greatest_and_how_much_is_known() {
        let mut steps = Steps::of(100);
        // 10 for 60 ms, 20 for 40 ms, 20 for 10 ms more, then nothing, and 40 for one moment.
        steps.add(piece(0, 150, &[(0, Some(10)), (60, Some(20)), (111, None), (150, Some(40))]));
        let step = |least, mean, greatest, known_ms| Step { least, greatest, mean, known_ms };
        assert_eq!(steps.all[&0], step(10, 14.0, 20, 100));
        assert_eq!(steps.all[&100], step(20, 20.0, 40, 10));
        assert_eq!(steps.all.len(), 2);
    }
}
