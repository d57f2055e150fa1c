//! The times in which somebody was not told what was read, as a list that is kept: [`Outages`]. Pure; moments are those of the daemon's own clock.

use std::collections::BTreeMap;

/// So many are kept. Each is the time of a drive, or of all of them until it is looked at.
const MOST: usize = 8_192;
/// What lies before everything of a run, and what lies behind it.
const BEGINNING: i64 = i64::MIN / 2;
pub(crate) const END: i64 = i64::MAX / 2;

/// A time in which somebody was not told what was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outage {
    /// The run in the file; `None`: the present one.
    pub run: Option<i64>,
    /// The drive; `None`: each.
    pub drive: Option<String>,
    /// It begins behind this moment of that run.
    pub from_ms: i64,
    /// The last moment of it; `None`: it goes on.
    pub to_ms: Option<i64>,
}

/// What is to be written of a list: each by its number, with what it is now; `None`: it is over.
pub type Changes = BTreeMap<i64, Option<Outage>>;

/// The outages of somebody. The last one goes on for as long as nobody says that he was told.
#[derive(Debug)]
pub(crate) struct Outages {
    all: BTreeMap<i64, Outage>,
    /// The number of the one that goes on.
    open: i64,
    changes: Changes,
    /// Whether one of the changes is to be written before values are.
    is_urgent: bool,
}

impl Outages {
    /// Those that were kept of runs before, and what is not told of this one. Where nothing was kept it begins at `begun`.
    pub(crate) fn of(kept: BTreeMap<i64, Outage>, begun: i64) -> Self {
        let open = kept.keys().next_back().map_or(1, |last| last + 1);
        let from_ms = if kept.is_empty() { begun } else { BEGINNING };
        let mut outages = Self { all: kept, open, changes: Changes::new(), is_urgent: true };
        // What went on when a run ended went on to its end.
        let ended: Vec<i64> =
            outages.all.iter().filter(|(_, one)| one.to_ms.is_none()).map(|(number, _)| *number).collect();
        for number in ended {
            outages.change(number, |one| one.to_ms = Some(END));
        }
        outages.set(open, Some(Outage { run: None, drive: None, from_ms, to_ms: None }));
        outages
    }

    /// Everything that was read behind the first moment up to the second was told.
    pub(crate) fn told(&mut self, since: i64, until: i64) {
        let Some(open) = self.all.get(&self.open) else { return };
        if since <= open.from_ms {
            let from_ms = open.from_ms.max(until);
            return self.change(self.open, |open| open.from_ms = from_ms);
        }
        self.change(self.open, |over| over.to_ms = Some(since));
        self.open = self.next_number();
        self.set(self.open, Some(Outage { run: None, drive: None, from_ms: until.max(since), to_ms: None }));
        self.is_urgent = true;
    }

    /// Of the outage of this number everything up to a moment was told.
    pub(crate) fn made_up(&mut self, number: i64, until: i64) {
        let Some(outage) = self.all.get(&number).filter(|_| number != self.open) else { return };
        self.is_urgent = true;
        match outage.to_ms.is_some_and(|to| until >= to) {
            true => self.set(number, None),
            false => self.change(number, |outage| outage.from_ms = outage.from_ms.max(until)),
        }
    }

    /// Nothing is to be told of the outage of this number.
    pub(crate) fn forget(&mut self, number: i64) {
        self.made_up(number, i64::MAX);
    }

    /// Those that are over, the oldest first.
    pub(crate) fn over(&self) -> impl Iterator<Item = (i64, &Outage)> {
        self.all.iter().filter(|(number, _)| **number != self.open).map(|(number, one)| (*number, one))
    }

    /// Makes of the outage of all drives one of each, so that one that is away holds up no other. Gives how many outages had no place.
    pub(crate) fn part(&mut self, number: i64, drives: impl IntoIterator<Item = String>) -> usize {
        let Some(whole) = self.all.get(&number).cloned().filter(|_| number != self.open) else { return 0 };
        for drive in drives {
            let number = self.next_number();
            self.set(number, Some(Outage { drive: Some(drive), ..whole.clone() }));
        }
        self.forget(number);
        let mut lost = 0;
        while self.all.len() > MOST {
            let oldest = self.over().next().map(|(oldest, _)| oldest);
            let Some(oldest) = oldest else { break };
            self.forget(oldest);
            lost += 1;
        }
        lost
    }

    /// What is to be written, and whether at once; nothing, if nothing has changed since.
    pub(crate) fn take_changes(&mut self) -> Option<(Changes, bool)> {
        let is_urgent = std::mem::take(&mut self.is_urgent);
        let changes = std::mem::take(&mut self.changes);
        (!changes.is_empty()).then_some((changes, is_urgent))
    }

    fn next_number(&self) -> i64 {
        self.all.keys().next_back().map_or(1, |last| last + 1).max(self.open + 1)
    }

    fn change(&mut self, number: i64, how: impl FnOnce(&mut Outage)) {
        if let Some(mut outage) = self.all.get(&number).cloned() {
            how(&mut outage);
            self.set(number, Some(outage));
        }
    }

    fn set(&mut self, number: i64, outage: Option<Outage>) {
        match &outage {
            Some(outage) => drop(self.all.insert(number, outage.clone())),
            None => drop(self.all.remove(&number)),
        }
        self.changes.insert(number, outage);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(outages: &Outages) -> Vec<(Option<i64>, Option<&str>, i64, i64)> {
        let all = outages.over();
        all.map(|(_, one)| (one.run, one.drive.as_deref(), one.from_ms, one.to_ms.unwrap())).collect()
    }

    /// As the file has them when everything is written.
    fn written(outages: &mut Outages, file: &mut BTreeMap<i64, Outage>, run: i64) {
        for (number, change) in outages.take_changes().map(|(changes, _)| changes).unwrap_or_default() {
            match change {
                Some(one) => drop(file.insert(number, Outage { run: one.run.or(Some(run)), ..one })),
                None => drop(file.remove(&number)),
            }
        }
    }

    #[test]
    fn an_outage_is_what_lies_between_what_was_told_for_certain() {
        let mut outages = Outages::of(BTreeMap::new(), 100);
        assert_eq!(over(&outages), [], "it goes on");
        outages.told(250, 300);
        outages.told(250, 400);
        assert_eq!(over(&outages), [(None, None, 100, 250)]);
        // The connection is lost, and there is another from 900 on; what came between was told by neither.
        outages.told(900, 1_000);
        assert_eq!(over(&outages), [(None, None, 100, 250), (None, None, 400, 900)]);
        // A session of which nothing is certain ends no outage.
        outages.told(1_500, 1_500);
        assert_eq!(over(&outages)[2], (None, None, 1_000, 1_500));
    }

    #[test]
    fn what_is_made_up_for_is_over_and_each_drive_for_itself() {
        let mut outages = Outages::of(BTreeMap::new(), 0);
        outages.told(500, 600);
        let (whole, _) = outages.over().next().unwrap();
        assert_eq!(outages.part(whole, ["north".to_owned(), "south".to_owned()]), 0);
        assert_eq!(over(&outages), [(None, Some("north"), 0, 500), (None, Some("south"), 0, 500)]);
        let (north, _) = outages.over().next().unwrap();
        outages.made_up(north, 300);
        outages.made_up(north, 200);
        assert_eq!(over(&outages)[0], (None, Some("north"), 300, 500), "it goes back for nothing");
        outages.made_up(north, 500);
        assert_eq!(over(&outages), [(None, Some("south"), 0, 500)]);
        outages.forget(outages.open);
        outages.told(500, 900);
        outages.told(2_000, 2_100);
        assert_eq!(over(&outages)[0], (None, None, 900, 2_000), "what goes on is not forgotten");
    }

    #[test]
    fn a_run_that_was_killed_leaves_what_it_had_not_told_and_the_next_one_goes_on_with_it() {
        let mut file = BTreeMap::new();
        let mut outages = Outages::of(file.clone(), 100);
        outages.told(250, 300);
        written(&mut outages, &mut file, 7);
        outages.told(250, 900);
        // Killed before that was written.
        let mut outages = Outages::of(file.clone(), 100);
        assert_eq!(over(&outages), [(Some(7), None, 100, 250), (Some(7), None, 300, END)]);
        // Nothing of this run was told before its first birth.
        outages.told(50, 60);
        assert_eq!(over(&outages)[2], (None, None, BEGINNING, 50));
        for number in outages.over().map(|(number, _)| number).collect::<Vec<_>>() {
            outages.forget(number);
        }
        written(&mut outages, &mut file, 8);
        let open = Outage { run: Some(8), drive: None, from_ms: 60, to_ms: None };
        assert_eq!(file.values().collect::<Vec<_>>(), [&open]);
    }

    #[test]
    fn what_was_told_live_waits_for_the_values_and_all_else_is_written_at_once() {
        let mut outages = Outages::of(BTreeMap::new(), 0);
        let is_urgent = |outages: &mut Outages| outages.take_changes().map(|(_, is_urgent)| is_urgent);
        assert_eq!([is_urgent(&mut outages), is_urgent(&mut outages)], [Some(true), None]);
        outages.told(10, 20);
        assert_eq!(is_urgent(&mut outages), Some(true));
        outages.told(10, 30);
        assert_eq!(is_urgent(&mut outages), Some(false));
        let (first, _) = outages.over().next().unwrap();
        outages.made_up(first, 5);
        assert_eq!(is_urgent(&mut outages), Some(true));
    }

    #[test]
    fn their_number_is_bounded_and_the_oldest_go() {
        let mut outages = Outages::of(BTreeMap::new(), 0);
        let mut lost = 0;
        for round in 1..=5 {
            outages.told(round * 100, round * 100 + 50);
            let last = outages.over().map(|(number, _)| number).max().unwrap();
            lost += outages.part(last, (0..2_000).map(|drive| drive.to_string()));
        }
        assert_eq!((outages.all.len(), lost), (MOST, 10_000 + 1 - MOST));
        assert_eq!(outages.over().next().unwrap().1.to_ms, Some(100), "{lost} of the first 2 000 are gone");
    }
}
