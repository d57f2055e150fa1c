//! Listens to the plant: every drive's snapshots, the stream of what happens, and each line minute by minute. It takes what there is, and
//! waits for nobody.

mod said;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Display,
    sync::Arc,
    time::Duration,
};

use drive_fleet::{DriveHandle, Snapshot};
use drived_face::Plant;
use drived_plant::plant::{
    revisions::Next,
    views::{ExchangeView, NoticeView},
};
use serde::Serialize;
use tokio::{
    sync::watch,
    task::{AbortHandle, JoinSet},
    time::{Instant, MissedTickBehavior, interval, sleep, timeout},
};

use self::said::{Alarms, is_of_an_alarm, said};
use crate::{
    captured::{self, Wanted},
    clocks::{Clocks, milliseconds},
    departure::Departure,
    errors::Errors,
    gone::Gone,
    quantity::{Quantity, Set, numbers, of_measurements, of_status},
    reason::Reasons,
    record::{Kind, LineMinute, Moment, Record},
    stop_key::StopKey,
    tracker::Tracker,
    write::{
        frames,
        inbox::{Inbox, Shown},
        writer::Health,
    },
};

/// Between two looks at who belongs to the fleet.
const LOOK: Duration = Duration::from_secs(1);
const MINUTE: Duration = Duration::from_secs(60);
/// Between two looks at whether this program goes on,
const PULSE: Duration = Duration::from_millis(500);
/// and what is no delay of a busy machine any more.
const STOOD_STILL: Duration = Duration::from_secs(2);
/// An alarm of the program is looked for once in a second.
const SEEN_WITHIN: Duration = Duration::from_secs(3);
/// An alarm and what it comes of are told by two tasks, and hardly further from each other than this.
const TOGETHER: Duration = Duration::from_millis(20);
/// So many of the last exchanges of its line are kept beside a trip.
const EXCHANGES: usize = 40;

/// Listens until it is dropped.
pub(crate) struct Listening(#[expect(dead_code, reason = "its tasks end with it")] JoinSet<()>);

impl Listening {
    /// Begins to listen.
    #[must_use]
    pub(crate) fn start(
        plant: &Plant,
        inbox: &Inbox,
        clocks: Clocks,
        health: watch::Receiver<Health>,
    ) -> Self {
        let mut tasks = JoinSet::new();
        tasks.spawn(drives(plant.clone(), inbox.clone(), clocks));
        let wanted = Wanted::default();
        tasks.spawn(stream(plant.clone(), inbox.clone(), clocks, wanted.clone()));
        tasks.spawn(captured::follow(plant.clone(), inbox.clone(), clocks, wanted));
        tasks.spawn(lines(plant.clone(), inbox.clone(), clocks));
        tasks.spawn(pauses(inbox.clone(), clocks));
        tasks.spawn(tell(plant.clone(), health));
        Self(tasks)
    }
}

/// A task that ends with whoever holds this.
struct Ending(AbortHandle);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Follows the drives that there are, those that a reload has brought too.
async fn drives(plant: Plant, inbox: Inbox, clocks: Clocks) {
    let mut followed: BTreeMap<Arc<str>, Ending> = BTreeMap::new();
    let mut looks = interval(LOOK);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        looks.tick().await;
        for drive in plant.fleet().drives() {
            if followed.get(drive.name()).is_none_or(|known| known.0.is_finished()) {
                let name = Arc::clone(drive.name());
                let task = tokio::spawn(follow(drive, inbox.clone(), clocks));
                followed.insert(name, Ending(task.abort_handle()));
            }
        }
    }
}

async fn follow(drive: DriveHandle, inbox: Inbox, clocks: Clocks) {
    let mut watch = drive.watch();
    let mut sets = Set::ALL.map(|set| (set, Tracker::default()));
    let (mut departure, mut gone, mut stop_key) = (Departure::default(), Gone::default(), StopKey::default());
    let numbers = numbers(drive.capabilities());
    loop {
        let snapshot = watch.look();
        if let Some(left) = departure.look(&snapshot) {
            inbox.record(fact(&drive, clocks.now(), "output_departed", &left));
        }
        if let Some(pressed) = stop_key.look(drive.capabilities().stop_key, &snapshot) {
            inbox.record(fact(&drive, clocks.now(), "stop_key", &pressed));
        }
        if let Some(went) = gone.look(&snapshot) {
            inbox.record(fact(&drive, clocks.now(), "command_gone", &went));
        }
        for (set, tracker) in &mut sets {
            let Some((at, max_age, values)) = read(*set, &snapshot, &numbers) else { continue };
            if *set == Set::Status && snapshot.retracted {
                // What it showed counts for nothing any more, and what comes next is no continuation of it.
                tracker.break_off();
                continue;
            }
            let Some(seen) = tracker.see(clocks.of(at), milliseconds(max_age), &values) else { continue };
            let shown = Shown { drive: Arc::clone(drive.name()), set: *set, seen };
            if inbox.show(shown).is_err() {
                tracker.break_off();
            }
        }
        if watch.changed().await.is_err() {
            return;
        }
    }
}

/// What was seen of a drive here, as something that happened to it.
fn fact<T: Display + Serialize>(drive: &DriveHandle, at: Moment, what: &str, fact: &T) -> Record {
    Record {
        kind: Kind::Event,
        drive: Some(drive.name().to_string()),
        line: Some(drive.line().0.to_string()),
        body: serde_json::to_string(fact).ok(),
        ..Record::of_history(at, what, fact.to_string())
    }
}

/// When a set was read, how old it may become, and what it shows.
type Reading = (Instant, Duration, Vec<(Quantity, i64)>);

/// What is known of a set of a drive.
fn read(set: Set, snapshot: &Snapshot, numbers: &BTreeSet<u16>) -> Option<Reading> {
    match set {
        Set::Status => {
            let status = snapshot.status.as_ref()?;
            Some((status.at, snapshot.max_age, of_status(&status.value, snapshot, numbers)))
        }
        Set::Measurements => {
            let measured = snapshot.measurements.as_ref()?;
            Some((measured.at, snapshot.measurements_max_age, of_measurements(&measured.value)))
        }
    }
}

/// Keeps what the event stream tells.
async fn stream(plant: Plant, inbox: Inbox, clocks: Clocks, wanted: Wanted) {
    let (mut reader, is_gone) = plant.revisions().keeper();
    if is_gone {
        inbox.record(told_anew(clocks.now()));
    }
    let (mut alarms, mut reasons) = (Alarms::default(), Reasons::default());
    loop {
        let next = plant.revisions().next(&mut reader).await;
        let now = clocks.now();
        match next {
            Next::Frames(mut frames) => {
                let mut is_gone = false;
                if frames.iter().any(|frame| is_of_an_alarm(frame)) {
                    // What it comes of is told by another task.
                    sleep(TOGETHER).await;
                    match timeout(Duration::ZERO, plant.revisions().next(&mut reader)).await {
                        Ok(Next::Frames(more)) => frames.extend(more),
                        Ok(Next::Reset(_)) => is_gone = true,
                        Ok(Next::End) | Err(_) => {}
                    }
                }
                let mut records = Vec::new();
                for frame in frames {
                    let frame = std::str::from_utf8(&frame).ok();
                    let told = frame.and_then(|frame| said(frame, now, &mut alarms));
                    let Some(mut record) = told else { continue };
                    reasons.look(&mut record);
                    // Whoever asks what else happened on a line finds it by that.
                    let drive = record.drive.as_ref().and_then(|drive| plant.fleet().drive(drive));
                    if record.line.is_none() {
                        record.line = drive.as_ref().map(|drive| drive.line().0.to_string());
                    }
                    if let Some(line) = record.line.as_ref().filter(|_| frames::has_one(&record)) {
                        wanted.note(line);
                        record.exchanges = exchanges(&plant, line);
                    }
                    let kept = drive.filter(|_| record.what == "trip_explained").and_then(|drive| {
                        own_record(&drive.snapshot(), Record { body: None, ..record.clone() })
                    });
                    put(&mut records, record);
                    records.extend(kept);
                }
                records.into_iter().for_each(|record| inbox.record(record));
                if is_gone {
                    inbox.record(told_anew(now));
                }
            }
            // Too much at once: whether something is missing nobody knows.
            Next::Reset(_) => inbox.record(told_anew(now)),
            Next::End => return,
        }
        plant.revisions().is_kept(&reader);
    }
}

/// Puts a record to those that are told with it: an event before the alarms that may have come of it.
fn put(records: &mut Vec<Record>, record: Record) {
    let comes_of_it = |other: &&Record| {
        record.kind == Kind::Event && other.kind == Kind::Alarm && other.at.wall_ms >= record.at.wall_ms
    };
    let behind = records.iter().rev().take_while(comes_of_it).count();
    records.insert(records.len() - behind, record);
}

fn told_anew(now: Moment) -> Record {
    let text = "too much happened at once: what was told just before may be missing here";
    Record::of_history(now, "stream_anew", text)
}

/// What a line said last, as JSON.
fn exchanges(plant: &Plant, line: &str) -> Option<String> {
    let (_, line) = plant.fleet().lines().into_iter().find(|(name, _)| **name == *line)?;
    let all = line.exchanges();
    let last: Vec<ExchangeView> =
        all[all.len().saturating_sub(EXCHANGES)..].iter().map(ExchangeView::of).collect();
    if last.is_empty() { None } else { serde_json::to_string(&last).ok() }
}

/// The drive's own record of its faults, which was read together with what it tripped by.
fn own_record(snapshot: &Snapshot, of_trip: Record) -> Option<Record> {
    let faults = snapshot.trips.back()?.faults.clone().filter(|faults| !faults.history.is_empty())?;
    let kept: Vec<String> = faults.history.iter().map(ToString::to_string).collect();
    let text = format!("its own record of faults, in its own order: {}", kept.join("; "));
    let body = serde_json::to_string(&*faults).ok();
    Some(Record { what: "fault_record".to_owned(), is_alarm: false, text, body, ..of_trip })
}

/// Tells when this program itself stood still: nobody was asked and nothing was seen in that time, whatever was missed by it.
async fn pauses(inbox: Inbox, clocks: Clocks) {
    let mut ticks = interval(PULSE);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut last = ticks.tick().await;
    loop {
        ticks.tick().await;
        let now = Instant::now();
        let paused = now.saturating_duration_since(last);
        last = now;
        tell_pause(&inbox, clocks, paused);
    }
}

fn tell_pause(inbox: &Inbox, clocks: Clocks, paused: Duration) {
    if paused < STOOD_STILL {
        return;
    }
    let now = clocks.now();
    let body = serde_json::json!({ "since_unix_ms": now.wall_ms - milliseconds(paused) });
    let text = format!(
        "this program stood still for {:.1} s until now: it asked nobody and saw nothing in that time",
        paused.as_secs_f64()
    );
    inbox.record(Record { body: Some(body.to_string()), ..Record::of_history(now, "stood_still", text) });
}

/// Counts each line, minute by minute.
async fn lines(plant: Plant, inbox: Inbox, clocks: Clocks) {
    let mut before: BTreeMap<Arc<str>, Counted> = BTreeMap::new();
    let mut errors: BTreeMap<Arc<str>, Errors> = BTreeMap::new();
    let mut minutes = interval(MINUTE);
    minutes.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        minutes.tick().await;
        for (name, line) in plant.fleet().lines() {
            let stats = line.stats();
            let slaves = stats.slaves.values();
            let sum = |of: fn(&drive_bus::stats::SlaveStats) -> u64| slaves.clone().map(of).sum::<u64>();
            let counted = Counted {
                sent: sum(|slave| slave.sent),
                answered: sum(|slave| slave.outcomes.answered),
                damaged: sum(|slave| slave.outcomes.damaged + slave.outcomes.mismatches),
                missing: sum(|slave| slave.outcomes.timeouts),
                foreign: stats.foreign,
                silences: stats.silence.count(),
                silence: stats.silence.mean() * u32::try_from(stats.silence.count()).unwrap_or(u32::MAX),
                elapsed: stats.elapsed,
                busy: stats.busy,
            };
            if let Some(record) = errors.entry(Arc::clone(&name)).or_default().look(&stats) {
                let drives = plant.fleet().drives_on(&name);
                let of = |slave: u8| drives.iter().find(|drive| drive.slave().number() == slave);
                let named = |slave| {
                    of(slave).map_or_else(|| format!("address {slave}"), |drive| drive.name().to_string())
                };
                inbox.record(record.told(&name, clocks.now(), named));
            }
            let last = before.insert(Arc::clone(&name), counted);
            // One that was opened anew, or is seen for the first time, counts from its beginning.
            let last = last.filter(|last| last.elapsed <= counted.elapsed).unwrap_or_default();
            let elapsed = counted.elapsed.saturating_sub(last.elapsed).as_millis().max(1);
            let busy = counted.busy.saturating_sub(last.busy).as_millis() * 1_000 / elapsed;
            let silences = counted.silences.saturating_sub(last.silences);
            let silence = counted.silence.saturating_sub(last.silence);
            inbox.line(LineMinute {
                wall_ms: clocks.now().wall_ms,
                line: name,
                sent: counted.sent.saturating_sub(last.sent),
                answered: counted.answered.saturating_sub(last.answered),
                damaged: counted.damaged.saturating_sub(last.damaged),
                missing: counted.missing.saturating_sub(last.missing),
                foreign: counted.foreign.saturating_sub(last.foreign),
                silences,
                silence_us: u64::try_from(silence.as_micros()).ok().and_then(|sum| sum.checked_div(silences)),
                busy_permille: u64::try_from(busy.min(1_000)).unwrap_or(1_000),
                is_open: stats.opened > stats.lost,
            });
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Counted {
    sent: u64,
    answered: u64,
    damaged: u64,
    missing: u64,
    foreign: u64,
    silences: u64,
    silence: Duration,
    elapsed: Duration,
    busy: Duration,
}

/// Tells as an alarm that the history cannot be written, and when it can again.
async fn tell(plant: Plant, mut health: watch::Receiver<Health>) {
    let mut is_told = false;
    loop {
        let now = health.borrow_and_update().clone();
        let text = match (&now, is_told) {
            (Health::Failing(why), false) => Some(format!("the history cannot be written: {why}")),
            (Health::Writing, true) => Some("the history is written again".to_owned()),
            _ => None,
        };
        if let Some(text) = text {
            is_told = !is_told;
            plant.tell_notice(NoticeView::new("history", is_told, text));
            if is_told {
                // Whoever looks for alarms sees it, however soon it is over.
                sleep(SEEN_WITHIN).await;
            }
        }
        if health.changed().await.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_fleet::alarms::{AlarmKind, AlarmState};
    use drived_config::rights::{Caller, Rights};
    use drived_plant::plant::{revisions::Subject, testing::TestPlant};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn what_a_drive_told_before_the_history_was_open_is_kept_once() {
        let test = TestPlant::of(2).await;
        let inbox = Inbox::default();
        let kept = async || {
            let (_health, seen) = watch::channel(Health::Writing);
            let listening = Listening::start(&test.plant, &inbox, Clocks::begin(), seen);
            tokio::time::sleep(Duration::from_millis(50)).await;
            drop(listening);
            let records = inbox.take(Duration::ZERO).records.into_iter();
            let connected = records.filter(|record| record.what == "connected");
            connected.filter_map(|record| record.drive).collect::<Vec<_>>()
        };
        assert_eq!(kept().await, ["pump 1", "pump 2"]);
        assert!(kept().await.is_empty(), "a history that was opened anew goes on where the one before ended");
    }

    #[tokio::test(start_paused = true)]
    async fn a_file_that_was_put_aside_is_an_alarm_also_where_the_next_is_written_at_once() {
        let test = TestPlant::of(1).await;
        let (health, seen) = watch::channel(Health::Writing);
        let _listening = Listening::start(&test.plant, &Inbox::default(), Clocks::begin(), seen);
        tokio::time::sleep(Duration::from_secs(1)).await;
        for _ in 0..3 {
            health.send_replace(Health::Failing("it is damaged and was put aside".to_owned()));
            tokio::time::sleep(Duration::from_millis(50)).await;
            health.send_replace(Health::Writing);
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        tokio::time::sleep(Duration::from_secs(10)).await;
        let alarms = test.plant.alarms().alarms;
        let of_history = alarms.iter().find(|view| view.alarm.kind == AlarmKind::History);
        let told = of_history.map(|view| (view.state, view.alarm.count));
        assert_eq!(told, Some((AlarmState::Returned, 1)), "{alarms:?}");
    }

    #[test]
    fn only_a_pause_that_no_busy_machine_makes_is_told_and_with_when_it_began() {
        let (inbox, clocks) = (Inbox::default(), Clocks::begin());
        tell_pause(&inbox, clocks, Duration::from_millis(700));
        assert!(inbox.take(Duration::ZERO).records.is_empty());
        tell_pause(&inbox, clocks, Duration::from_secs(15));
        let told = inbox.take(Duration::ZERO).records.remove(0);
        assert_eq!((&*told.what, told.kind), ("stood_still", Kind::History));
        let since = format!("{{\"since_unix_ms\":{}}}", told.at.wall_ms - 15_000);
        assert_eq!(told.body, Some(since));
    }

    /// The tasks that tell alarms and events wait for nobody, so that an alarm may be told first.
    #[tokio::test(start_paused = true)]
    async fn an_alarm_stands_behind_what_it_comes_of_whichever_is_told_first() {
        let test = TestPlant::of(1).await;
        let inbox = Inbox::default();
        let (_health, seen) = watch::channel(Health::Writing);
        let clocks = Clocks::begin();
        let _listening = Listening::start(&test.plant, &inbox, clocks, seen);
        tokio::time::sleep(Duration::from_millis(100)).await;
        let _before = inbox.take(Duration::ZERO);
        let tell = |subject, told| _ = test.plant.revisions().push(subject, &told);
        let wall_ms = clocks.now().wall_ms;
        let event = |what: &str, time_unix_ms: i64| serde_json::json!({ "time_unix_ms": time_unix_ms, "drive": "pump 1", "event": what, "alarm": false, "text": what });
        let alarm = serde_json::json!({ "id": 7, "count": 1, "state": "unacknowledged", "drive": "pump 1", "text": "tripped" });
        tell(Subject::Alarm, alarm);
        tokio::time::sleep(Duration::from_millis(3)).await;
        tell(Subject::Event, event("tripped", wall_ms - 5));
        tell(Subject::Event, event("later", wall_ms + 60_000));
        tokio::time::sleep(Duration::from_millis(100)).await;
        let records = inbox.take(Duration::ZERO).records;
        let told: Vec<&str> = records.iter().map(|record| &*record.what).collect();
        assert_eq!(told, ["tripped", "unacknowledged", "later"]);
    }

    #[tokio::test(start_paused = true)]
    async fn who_wrote_a_parameter_and_through_which_door_is_kept() {
        let test = TestPlant::of(1).await;
        let inbox = Inbox::default();
        let (_health, seen) = watch::channel(Health::Writing);
        let _listening = Listening::start(&test.plant, &inbox, Clocks::begin(), seen);
        let drive = test.plant.fleet().drive("pump 1").unwrap();
        let row = drive.capabilities().rows.iter().find(|row| row.code == "ACC").unwrap();
        let anna = Caller::new("anna", "http 127.0.0.1", Rights::ALL);
        test.plant.tell_written(&anna, &drive, row, 50, true);
        tokio::time::sleep(Duration::from_millis(50)).await;
        let records = inbox.take(Duration::ZERO).records;
        let told = records.iter().find(|record| record.what == "parameter_written").unwrap();
        assert_eq!(told.drive.as_deref(), Some("pump 1"));
        // In which unit it counts Inr says, which nobody has read here.
        assert_eq!(told.text, "parameter ACC written as 50 × Inr by anna from http 127.0.0.1");
    }
}
