//! What turns the fleet into revisions: its events, and every change of a drive or a line.

use std::{
    collections::BTreeMap,
    sync::{Arc, Weak},
    time::{Duration, SystemTime},
};

use drive_fleet::{DriveHandle, Events, Received};
use schemars::JsonSchema;
use serde::Serialize;
use tokio::{
    sync::watch,
    task::AbortHandle,
    time::{Instant, MissedTickBehavior, interval, sleep_until, timeout},
};

use super::{
    Inner,
    revisions::Subject,
    views::{Gist, LineView, NoticeView},
};
use drived_words::json::unix;

/// Between two revisions of one drive at the least: what its task tells in between is told together.
const TOGETHER: Duration = Duration::from_millis(100);
/// A drive of which nothing changes is told anew after this time, so that a reader who counts its ages on stays right.
const ANEW: Duration = Duration::from_secs(5);
/// Between two looks at the lines.
const LINES: Duration = Duration::from_secs(1);
/// A clock that is off by less than this was not set but regulated.
const STEP: Duration = Duration::from_secs(1);
/// Between two signs of life.
const TICK: Duration = Duration::from_secs(5);

/// A sign of life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub(super) struct TickView {
    pub revision: u64,
    pub time_unix_ms: u64,
}

/// Watches all of a plant, for as long as anybody holds it.
pub(super) fn start(plant: &Arc<Inner>) {
    tokio::spawn(events(Arc::downgrade(plant), plant.fleet.events()));
    tokio::spawn(lines(Arc::downgrade(plant)));
}

/// Tells as an alarm that the audit log cannot be written, and when it can again.
pub(super) fn follow_audit(plant: &Arc<Inner>, mut failing: watch::Receiver<bool>) {
    let plant = Arc::downgrade(plant);
    tokio::spawn(async move {
        let mut told = false;
        loop {
            let is_failing = *failing.borrow_and_update();
            if is_failing != told {
                let Some(plant) = plant.upgrade() else { return };
                plant.tell_notice(NoticeView::new(
                    "audit_log",
                    is_failing,
                    match is_failing {
                        true => "the audit log cannot be written: only stops are carried out",
                        false => "the audit log is written again",
                    },
                ));
                told = is_failing;
            }
            if failing.changed().await.is_err() {
                return;
            }
        }
    });
}

/// Watches the drives that are not watched yet: those that a reload has brought, too.
fn watch(plant: &Arc<Inner>, watched: &mut BTreeMap<Arc<str>, AbortHandle>) {
    for (line, _) in plant.fleet.lines() {
        for drive in plant.fleet.drives_on(&line) {
            if watched.get(drive.name()).is_none_or(AbortHandle::is_finished) {
                let (plant, line, name) =
                    (Arc::downgrade(plant), Arc::clone(&line), Arc::clone(drive.name()));
                watched.insert(name, tokio::spawn(changes(plant, line, drive)).abort_handle());
            }
        }
    }
}

async fn events(plant: Weak<Inner>, mut events: Events) {
    loop {
        let received = events.recv().await;
        let Some(plant) = plant.upgrade() else { return };
        match received {
            Received::Event(event) => plant.tell_event(event),
            Received::Missed(_) => {}
            Received::End => return,
        }
    }
}

/// Tells a drive whenever it has changed, and its values when they have become old: nobody else says so then.
async fn changes(plant: Weak<Inner>, line: Arc<str>, drive: DriveHandle) {
    let mut watch = drive.watch();
    let mut told: Option<(Gist, Instant)> = None;
    loop {
        let now = Instant::now();
        let snapshot = watch.look();
        let known = Gist::of(&snapshot, now);
        // Also where nothing is new: what is not seen for long enough becomes an alarm by that alone.
        let Some(looked_for) = plant.upgrade() else { return };
        looked_for.look_for_alarms_of(&line, &snapshot);
        drop(looked_for);
        let is_new = told.as_ref().is_none_or(|(last, at)| {
            *last != known || now.saturating_duration_since(*at) >= ANEW && known.is_live()
        });
        if is_new {
            let Some(plant) = plant.upgrade() else { return };
            let is_there = || plant.fleet.drive(drive.name()).is_some();
            if !is_there() {
                return;
            }
            plant.revisions.push(Subject::Drive, &plant.view_of(&line, &drive));
            told = Some((known, now));
            // It went between the two, and whoever has read the state by now would show it as it was for ever.
            if !is_there() {
                return plant.revisions.begin_anew();
            }
        }
        sleep_until(now + TOGETHER).await;
        // The status is stale a moment after its age has been reached.
        let stale_at = snapshot.status.as_ref().map(|status| status.at + snapshot.max_age);
        let next = stale_at.filter(|at| *at >= now).map_or(ANEW, |at| at.saturating_duration_since(now));
        let patience = next + Duration::from_millis(1);
        // In vain is no harm: the drive is looked at again.
        if let Ok(Err(_)) = timeout(patience, watch.changed()).await {
            return;
        }
    }
}

/// The wall's clock beside one that is never set.
struct WallClock {
    wall: SystemTime,
    steady: std::time::Instant,
}

impl WallClock {
    fn begin() -> Self {
        Self { wall: SystemTime::now(), steady: std::time::Instant::now() }
    }

    /// What is to be said where the wall's clock was set since this was last asked.
    fn step(&mut self, wall: SystemTime, steady: std::time::Instant) -> Option<String> {
        let expected = self.wall + steady.saturating_duration_since(self.steady);
        (self.wall, self.steady) = (wall, steady);
        let (by, way) = match wall.duration_since(expected) {
            Ok(ahead) => (ahead, "forward"),
            Err(back) => (back.duration(), "back"),
        };
        (by >= STEP).then(|| {
            let seconds = by.as_secs();
            format!("the clock was set {way} by {seconds} s: the times before and after do not compare, the order does")
        })
    }
}

/// Tells the lines where somebody reads along, and the signs of life.
async fn lines(plant: Weak<Inner>) {
    let mut looks = interval(LINES);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut told, mut watched): (Vec<LineView>, _) = Default::default();
    let mut tick_at = Instant::now() + TICK;
    let mut clock = WallClock::begin();
    loop {
        looks.tick().await;
        let Some(plant) = plant.upgrade() else { return };
        if let Some(step) = clock.step(SystemTime::now(), std::time::Instant::now()) {
            plant.tell_notice(NoticeView::new("clock_stepped", false, step));
        }
        plant.progress.look(&plant.fleet);
        plant.look_at_lines();
        watch(&plant, &mut watched);
        plant.look_for_alarms();
        if plant.revisions.readers() > 0 {
            let lines = plant.lines();
            for line in lines.iter().filter(|line| !told.contains(line)) {
                plant.revisions.push(Subject::Line, line);
            }
            told = lines;
        }
        if Instant::now() >= tick_at {
            tick_at += TICK;
            let revision = plant.revisions.last() + 1;
            plant.revisions.push(Subject::Tick, &TickView { revision, time_unix_ms: unix(Instant::now()) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_is_told_once_and_one_that_is_regulated_is_not() {
        let (wall, steady) = (SystemTime::now(), std::time::Instant::now());
        let mut clock = WallClock { wall, steady };
        let seconds = Duration::from_secs;
        let mut at = |wall: SystemTime, after: u64| clock.step(wall, steady + seconds(after));
        assert_eq!(at(wall + seconds(1), 1), None);
        assert_eq!(at(wall + Duration::from_millis(2_300), 2), None);
        let back = at(wall + seconds(3) - seconds(3_600), 3).unwrap();
        assert!(back.starts_with("the clock was set back by 3600 s"), "{back}");
        assert_eq!(at(wall + seconds(4) - seconds(3_600), 4), None);
    }
}
