//! What no ordinary status carries and a run command rests on: it takes [`Turns`].

/// Behind every so many statuses of a drive of which a run command stands, or whose watchdog was armed, one thing more is read:
/// on a line of many drives that is less than 5 % of a sweep.
pub const STATUSES_PER_TURN: u16 = 20;

/// Whose turn it is. Each of `n` things is read within `n` times so many statuses as there are from turn to turn.
///
/// ```
/// use drive_core::Turns;
///
/// // Two things, one of them behind every third status.
/// let mut turns = Turns::every(3);
/// let read: Vec<_> = (0..6).map(|_| turns.pass(2)).collect();
/// assert_eq!(read, [None, None, Some(0), None, None, Some(1)]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turns {
    every: u16,
    statuses: u16,
    next: usize,
}

impl Default for Turns {
    fn default() -> Self {
        Self::every(STATUSES_PER_TURN)
    }
}

impl Turns {
    /// A turn behind every so many statuses: fewer for a family whose status takes several exchanges anyway.
    #[must_use]
    pub const fn every(statuses: u16) -> Self {
        Self { every: statuses, statuses: 0, next: 0 }
    }

    /// From now on a turn behind every so many statuses.
    pub const fn set_every(&mut self, statuses: u16) {
        self.every = statuses;
    }

    /// Counts a status. The number of the thing whose turn has come, of so many `things`.
    pub const fn pass(&mut self, things: usize) -> Option<usize> {
        self.statuses = self.statuses.saturating_add(1);
        if self.statuses < self.every || things == 0 {
            return None;
        }
        self.statuses = 0;
        let turn = self.next % things;
        self.next = turn + 1;
        Some(turn)
    }

    /// The thing whose turn had come was not read: it comes again with the next status.
    pub const fn again(&mut self) {
        // One status before the turn: it comes with the next.
        self.statuses = self.every.saturating_sub(1);
        self.next = self.next.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_thing_has_its_turn_once_in_so_many_statuses() {
        let mut turns = Turns::default();
        let mut read = [0; 3];
        for _ in 0..3 * usize::from(STATUSES_PER_TURN) {
            if let Some(thing) = turns.pass(3) {
                read[thing] += 1;
            }
        }
        assert_eq!(read, [1; 3]);
    }

    #[test]
    fn a_family_whose_status_takes_several_exchanges_has_its_turns_more_often() {
        let mut turns = Turns::every(3);
        let told: Vec<_> = (0..9).map(|_| turns.pass(2)).collect();
        assert_eq!(told, [None, None, Some(0), None, None, Some(1), None, None, Some(0)]);
        turns.set_every(1);
        assert_eq!((turns.pass(2), turns.pass(2)), (Some(1), Some(0)));
    }

    #[test]
    fn a_turn_that_was_lost_comes_again_at_once() {
        let mut turns = Turns::default();
        let first = (0..STATUSES_PER_TURN).find_map(|_| turns.pass(3));
        turns.again();
        assert_eq!((first, turns.pass(3)), (Some(0), Some(0)));
    }
}
