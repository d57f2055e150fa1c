//! What somebody was not told, on files: each value of an outage once, over kills, gaps and a clock that is set.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use drived_config::testing::Folder;
use drived_plant::plant::{
    past::IsView,
    untold::{Told, Untold as _, UntoldView},
};
use tokio::time::Instant;

use super::{BEGIN_MS, Pump};
use crate::{
    clocks::Clocks,
    quantity::{Quantity, Set},
    read::{History, pieces},
    record::Moment,
    store::{self, Store},
    tracker::Tracker,
    untold::Ledger,
    write::{
        archive::Archive,
        inbox::{Batch, Inbox, Shown},
    },
};

const HOST: &str = "sparkplug plant/hall 1";
const NOBODY: fn() -> BTreeSet<String> = BTreeSet::new;

/// What came of a value: when by the daemon's own clock and by the wall's, and what it was.
type Came = BTreeMap<(String, String, i64), (i64, Option<IsView>)>;

/// A daemon with its file, whose time is told to it.
struct Daemon {
    archive: Archive,
    store: Store,
    inbox: Inbox,
    ledger: Ledger,
    began: Instant,
    ahead_ms: i64,
    a: Pump,
    b: Pump,
}

impl Daemon {
    /// A run that begins when the wall's clock is there.
    fn begin(folder: &Folder, wall_ms: i64) -> Self {
        let path = folder.file("history.sqlite");
        let mut store = store::open(&path).unwrap().store;
        let mut archive = Archive::begin(Moment { steady_ms: 0, wall_ms });
        archive.begin_run(&mut store.connection, "test").unwrap();
        let (inbox, clocks, began) = (Inbox::default(), Clocks::begin(), Instant::now());
        let ledger = Ledger::new(path, inbox.clone(), clocks);
        let (a, b) = (Pump::of("a"), Pump::of("b"));
        Self { archive, store, inbox, ledger, began, ahead_ms: wall_ms, a, b }
    }

    fn moment(&self, steady_ms: i64) -> Moment {
        Moment { steady_ms, wall_ms: self.ahead_ms + steady_ms }
    }

    /// Lives through these seconds. All values of `a` move in each; `b` stands, and is not heard from 600 to 700.
    fn live(&mut self, seconds: std::ops::RangeInclusive<i64>) {
        for second in seconds {
            let now = self.moment(second * 1_000);
            let shown: Vec<_> =
                (10..18).map(|number| (Quantity(number), 1_000 * second + i64::from(number))).collect();
            self.a.read(&mut self.archive, now, &shown);
            if !(600..700).contains(&second) {
                self.b.read(&mut self.archive, now, &[(Quantity::STATE, 2)]);
            }
        }
    }

    /// Writes what was read up to then.
    fn write(&mut self, second: i64) {
        let now = self.moment(second * 1_000);
        self.archive.take(self.inbox.take(Duration::ZERO), now);
        self.archive.close(now);
        self.archive.write_values(&mut self.store.connection).unwrap();
        self.inbox.has_written_until(now.steady_ms);
    }

    /// Writes what is not to wait for values.
    fn write_at_once(&mut self, second: i64) {
        self.archive.take(self.inbox.take(Duration::ZERO), self.moment(second * 1_000));
        self.archive.write_values(&mut self.store.connection).unwrap();
    }

    fn at(&self, second: u64) -> Instant {
        self.began + Duration::from_secs(second)
    }

    fn note(&self, live: Option<(u64, u64)>, later: Option<(i64, i64)>) {
        let live = live.map(|(since, until)| (self.at(since), self.at(until)));
        let told = Told { whom: HOST.to_owned(), begun: self.began, live, later };
        self.ledger.note(&told).unwrap();
    }

    /// Tells all that is to be told now, and gives it.
    fn tell(&self) -> Came {
        let mut came = Came::new();
        while let Some(part) = self.ledger.next(HOST, &NOBODY()).unwrap() {
            add(&mut came, &part, part.until_ms);
            self.note(None, Some((part.number, part.until_ms)));
        }
        came
    }
}

/// Adds what a part tells up to a moment. Nothing comes twice.
fn add(came: &mut Came, part: &UntoldView, until_ms: i64) {
    assert!(part.points.len() <= 4_000, "{}", part.points.len());
    assert!(part.points.is_sorted_by_key(|point| point.at_ms));
    for point in part.points.iter().filter(|point| point.at_ms <= until_ms) {
        let key = (part.drive.clone(), point.value.to_owned(), point.at_ms);
        let before = came.insert(key.clone(), (point.point.time_unix_ms, point.point.is.clone()));
        assert_eq!(before, None, "{key:?} comes twice");
    }
}

/// When values of a drive came, each with how many: in seconds.
fn seconds(came: &Came, drive: &str) -> Vec<(i64, usize)> {
    let mut times: BTreeMap<i64, usize> = BTreeMap::new();
    for (of, _, at) in came.keys().filter(|(of, ..)| of == drive) {
        assert_eq!(of, drive);
        *times.entry(at.div_euclid(1_000)).or_default() += 1;
    }
    times.into_iter().collect()
}

fn each(seconds: std::ops::RangeInclusive<i64>) -> Vec<(i64, usize)> {
    seconds.map(|second| (second, 8)).collect()
}

#[tokio::test(start_paused = true)]
async fn each_value_of_an_outage_is_told_once_and_a_gap_as_a_gap() {
    let folder = Folder::new("untold-outage");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    daemon.note(Some((300, 500)), None);
    daemon.live(0..=400);
    assert_eq!(daemon.tell(), Came::new(), "nothing of this run stands in the file");
    daemon.write(304);
    assert_eq!(daemon.tell(), Came::new(), "what was read just before its end may still come");
    daemon.write(305);
    let came = daemon.tell();
    assert_eq!(seconds(&came, "a"), each(1..=300));
    assert_eq!(seconds(&came, "b"), [], "it stood, and was known before");
    assert_eq!(daemon.tell(), Came::new());

    // Away from 500 to 1500.
    daemon.live(401..=1_600);
    daemon.note(Some((1_500, 1_500)), None);
    daemon.write(1_600);
    let came = daemon.tell();
    assert_eq!(seconds(&came, "a"), each(501..=1_500));
    for ((drive, value, at), (wall, is)) in came.iter().filter(|((drive, ..), _)| drive == "a") {
        assert_eq!(*wall, BEGIN_MS + at, "{drive} {value}");
        let quantity = Quantity::named(value).unwrap();
        let count = (at + i64::from(quantity.0)) as f64;
        assert_eq!(*is, Some(IsView::Number(quantity.value(count))));
    }
    let state = |at: i64| came.get(&("b".to_owned(), "state".to_owned(), at)).cloned();
    assert_eq!(seconds(&came, "b"), [(599, 1), (700, 1)]);
    assert_eq!(state(599_001), Some((BEGIN_MS + 599_001, None)));
    assert_eq!(state(700_000), Some((BEGIN_MS + 700_000, Some(IsView::Word("ready".to_owned())))));
}

#[tokio::test(start_paused = true)]
async fn a_kill_in_the_midst_of_it_makes_no_hole_and_what_was_noted_is_not_told_again() {
    let folder = Folder::new("untold-killed");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    daemon.live(0..=1_010);
    daemon.note(Some((1_000, 1_000)), None);
    daemon.write(1_010);
    // Half of what comes first is told, then what is certain of the present session, and that waits for the values.
    let part = daemon.ledger.next(HOST, &NOBODY()).unwrap().unwrap();
    let mut came = Came::new();
    add(&mut came, &part, 200_000);
    daemon.note(None, Some((part.number, 200_000)));
    daemon.write_at_once(1_015);
    daemon.live(1_011..=1_300);
    daemon.note(Some((1_000, 1_200)), None);
    daemon.write(1_300);
    daemon.live(1_301..=1_350);
    daemon.note(Some((1_000, 1_340)), None);
    daemon.write_at_once(1_345);
    // Killed, with what was read since the last values were written.
    drop(daemon);
    let mut daemon = Daemon::begin(&folder, BEGIN_MS + 7_200_000);
    daemon.live(0..=200);
    daemon.note(Some((100, 110)), None);
    assert_eq!(daemon.tell(), Came::new(), "whose values are in the file is not known yet");
    daemon.write(150);
    let rest = daemon.tell();
    let (of_before, of_now): (Came, Came) =
        rest.into_iter().partition(|(_, (wall, _))| *wall < BEGIN_MS + 7_200_000);
    for (key, value) in of_before {
        assert_eq!(came.insert(key.clone(), value), None, "{key:?} comes twice");
    }
    let gaps: Vec<i64> = came.iter().filter(|(_, (_, is))| is.is_none()).map(|((_, _, at), _)| *at).collect();
    let gaps_of_a = gaps.iter().filter(|at| **at == 1_300_001).count();
    assert_eq!(gaps_of_a, 8 + 1, "behind the last values that were written nothing is known: {gaps:?}");
    came.retain(|_, (_, is)| is.is_some());
    let expected = [each(1..=1_000), each(1_201..=1_300)].concat();
    let found = seconds(&came, "a");
    let missing: Vec<_> = expected.iter().filter(|one| !found.contains(one)).collect();
    let more: Vec<_> = found.iter().filter(|one| !expected.contains(one)).collect();
    assert!(missing.is_empty() && more.is_empty(), "all but what was told live: {missing:?}, {more:?}");
    assert_eq!(seconds(&of_now, "a"), each(0..=100));
}

#[tokio::test(start_paused = true)]
async fn a_clock_that_is_set_back_in_an_outage_costs_no_value() {
    let folder = Folder::new("untold-clock");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    daemon.live(0..=600);
    daemon.note(Some((100, 100)), None);
    daemon.write(600);
    drop(daemon.tell());
    daemon.ahead_ms -= 3_600_000;
    daemon.archive.look_at_clock(daemon.moment(600_500));
    daemon.live(601..=1_300);
    daemon.note(Some((1_200, 1_200)), None);
    daemon.write(1_300);
    let came = daemon.tell();
    let values: Vec<(i64, usize)> = seconds(&came, "a");
    assert_eq!(values, each(101..=1_200));
    let wall = |second: i64| came[&("a".to_owned(), "speed_rpm".to_owned(), second * 1_000)].0;
    assert_eq!([wall(500), wall(700)], [BEGIN_MS + 500_000, BEGIN_MS + 700_000 - 3_600_000]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_told_of_later_holds_up_no_other() {
    let folder = Folder::new("untold-later");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    daemon.live(0..=50);
    daemon.note(Some((40, 40)), None);
    daemon.write(50);
    let later = BTreeSet::from(["a".to_owned()]);
    let part = daemon.ledger.next(HOST, &later).unwrap();
    assert_eq!(part, None, "the other has nothing new");
    daemon.write(60);
    // The same for who is told by another name, and of whom nothing is known.
    assert_eq!(daemon.ledger.next("another", &NOBODY()).unwrap(), None);
    assert_eq!(seconds(&daemon.tell(), "a"), each(1..=40));
}

#[tokio::test(start_paused = true)]
async fn of_a_file_that_was_put_aside_nothing_is_told_from_the_one_in_its_place() {
    let folder = Folder::new("untold-aside");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    daemon.live(0..=50);
    daemon.note(Some((40, 40)), None);
    daemon.write(50);
    drop(daemon);
    let mut daemon = Daemon::begin(&folder, BEGIN_MS + 100_000);
    daemon.live(0..=50);
    daemon.note(Some((30, 40)), None);
    // The file has been put aside: the first run of the new one has the number of the one before.
    daemon.write_at_once(50);
    let outages = "UPDATE outage SET run = (SELECT max(id) FROM run)";
    daemon.store.connection.execute_batch(outages).unwrap();
    daemon.ledger = Ledger::new(folder.file("history.sqlite"), daemon.inbox.clone(), Clocks::begin());
    daemon.note(Some((30, 40)), None);
    daemon.write(50);
    let came = daemon.tell();
    assert!(came.values().all(|(wall, _)| *wall >= BEGIN_MS + 100_000), "{came:?}");
}

#[tokio::test(start_paused = true)]
async fn a_run_in_which_nobody_was_told_anything_is_told_by_a_later_one() {
    let folder = Folder::new("untold-run");
    let hour = |number: i64| BEGIN_MS + number * 3_600_000;
    let mut daemon = Daemon::begin(&folder, hour(0));
    daemon.live(0..=30);
    daemon.note(Some((10, 25)), None);
    daemon.write(30);
    drop(daemon);
    // The broker is away from its beginning to its end by a kill.
    let mut daemon = Daemon::begin(&folder, hour(1));
    daemon.note(None, None);
    daemon.live(0..=60);
    daemon.write(60);
    assert_eq!(daemon.ledger.next(HOST, &NOBODY()).unwrap().unwrap().points.len(), 80);
    drop(daemon);
    let mut daemon = Daemon::begin(&folder, hour(2));
    daemon.note(None, None);
    daemon.live(0..=30);
    daemon.note(Some((5, 5)), None);
    daemon.write(30);
    // Each part is of one run.
    let mut came = [0, 1, 2].map(|_| Came::new());
    while let Some(part) = daemon.ledger.next(HOST, &NOBODY()).unwrap() {
        let run = (part.points[0].point.time_unix_ms - hour(0)) / 3_600_000;
        add(&mut came[usize::try_from(run).unwrap()], &part, part.until_ms);
        daemon.note(None, Some((part.number, part.until_ms)));
    }
    let told = came.map(|mut came| {
        came.retain(|_, (_, is)| is.is_some());
        seconds(&came, "a")
    });
    assert_eq!(told, [[each(1..=10), each(26..=30)].concat(), each(0..=60), each(0..=5)]);
}

/// What is written in between says nothing of the other set of the same drive.
#[tokio::test(start_paused = true)]
async fn a_drive_whose_two_sets_are_written_again_and_again_has_no_gaps_by_that() {
    let folder = Folder::new("untold-sets");
    let mut daemon = Daemon::begin(&folder, BEGIN_MS);
    let mut slow = Tracker::default();
    for second in 0..=100 {
        daemon.live(second..=second);
        if second % 7 == 3 {
            let seen = slow.see(second * 1_000, 10_000, &[(Quantity::INPUTS, second % 2)]).unwrap();
            let shown = Shown { drive: "a".into(), set: Set::Measurements, seen };
            daemon.archive.take(Batch { shown: vec![shown], ..Batch::default() }, daemon.moment(0));
        }
        if second % 20 == 0 {
            daemon.write(second);
        }
    }
    daemon.note(Some((90, 90)), None);
    daemon.write(100);
    let came = daemon.tell();
    let gaps: Vec<_> = came.iter().filter(|(_, (_, is))| is.is_none()).collect();
    assert!(gaps.is_empty(), "{gaps:?}");
    let of_both = |second: i64| (second, 8 + usize::from(second % 7 == 3));
    assert_eq!(seconds(&came, "a"), (1..=90).map(of_both).collect::<Vec<_>>());
    // Read at once, each of its values stands there in its order, too.
    let history = History::open(&folder.file("history.sqlite")).unwrap();
    for quantity in [Quantity(12), Quantity::INPUTS] {
        for piece in pieces(&history.0, "a", quantity, BEGIN_MS, BEGIN_MS + 100_000).unwrap() {
            assert!(piece.points.is_sorted_by(|one, next| one.at < next.at), "{quantity}: {piece:?}");
            assert!(piece.points.iter().all(|point| point.count.is_some()), "{quantity}: {piece:?}");
        }
    }
}
