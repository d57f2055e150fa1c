//! Nights that are staged on a simulated plant in virtual time, and the stories that are told of them. What a story has to say is written
//! here by what was staged; that it says nothing else for certain is looked at too.

mod causes;
mod certain;
mod doings;
mod moment;
mod nights;
mod outsider;
mod returns;
mod stops;
mod whose;
mod written;

use std::time::Duration;

use drive_core::{Direction, Frequency};
use drive_fleet::Until;
use drived_config::{
    rights::{Caller, Rights},
    testing::Folder,
};
use drived_plant::plant::{
    commands::{Action, LIFETIME, Request, Target},
    past::Certainty,
    testing::TestPlant,
};
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};

use super::{Story, tell};
use crate::{
    clocks::Clocks,
    listen::Listening,
    quantity::{Quantity, Set},
    record::{Kind, Moment, Record},
    store,
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Inbox, Shown},
        writer::Health,
    },
};

/// 2026-11-21 03:00 UTC.
const NIGHT_MS: i64 = 1_795_230_000_000;

/// A plant whose pumps run, with a black box that listens.
struct Night {
    plant: TestPlant,
    inbox: Inbox,
    clocks: Clocks,
    _listening: Listening,
}

impl Night {
    async fn begin(pumps: u8) -> Self {
        let plant = TestPlant::of(pumps).await;
        let (inbox, clocks) = (Inbox::default(), Clocks::begin());
        let (_health, seen) = watch::channel(Health::Writing);
        let listening = Listening::start(&plant.plant, &inbox, clocks, seen);
        let night = Self { plant, inbox, clocks, _listening: listening };
        sleep(Duration::from_secs(5)).await;
        let setpoint = Some(Frequency::from_hertz(30).into());
        let action = Action::Start { direction: Direction::Forward, setpoint, until: Until::default() };
        night.ask("operator", "page", Target::All, action).await;
        sleep(Duration::from_secs(150)).await;
        night
    }

    async fn ask(&self, who: &str, from: &str, target: Target, action: Action) {
        let caller = Caller::new(who, from, Rights::ALL);
        let drives = match target {
            Target::All => self.plant.plant.drives().iter().map(|drive| drive.name().to_string()).collect(),
            Target::Drive(name) => vec![name],
            Target::Selected(names) => names,
            Target::Group(_) => Vec::new(),
        };
        for drive in drives {
            let (lifetime, arrived) = (LIFETIME, Instant::now());
            let request =
                Request { id: None, target: Target::Drive(drive), action, expects: None, lifetime, arrived };
            let _ = self.plant.plant.command(&caller, request, Duration::from_secs(10)).await;
        }
    }

    /// Now, on the night's wall.
    fn now(&self) -> i64 {
        NIGHT_MS + self.clocks.now().steady_ms
    }

    /// Some time later the file is written, and asked.
    async fn asked(self, name: &str, drive: &str, at: i64) -> Story {
        sleep(Duration::from_secs(200)).await;
        let end = self.clocks.now().steady_ms;
        let on_wall = |steady_ms| Moment { steady_ms, wall_ms: NIGHT_MS + steady_ms };
        let folder = Folder::new(&format!("history-night-{name}"));
        let path = folder.file("history.sqlite");
        let mut store = store::open(&path).unwrap().store;
        let mut archive = Archive::begin(on_wall(0));
        archive.begin_run(&mut store.connection, "test").unwrap();
        let mut batch = self.inbox.take(Duration::ZERO);
        assert!(batch.lost.is_nothing(), "{:?}", batch.lost);
        batch.records.iter_mut().for_each(|record| record.at = on_wall(record.at.steady_ms));
        archive.take(batch, on_wall(end));
        archive.end_run(&mut store.connection, on_wall(end)).unwrap();
        let story = tell(&store.connection, drive, at).unwrap();
        println!("{}", serde_json::to_string_pretty(&story).unwrap());
        story
    }
}

trait Says {
    /// Everything that it says of why, of this certainty.
    fn why(&self, certainty: Certainty) -> String;

    fn course(&self) -> String;
}

impl Says for Story {
    fn why(&self, certainty: Certainty) -> String {
        let why = self.why.iter().filter(|sentence| sentence.certainty == certainty);
        why.map(|sentence| sentence.text.clone()).collect::<Vec<_>>().join("\n")
    }

    fn course(&self) -> String {
        self.course.iter().map(|sentence| sentence.text.clone()).collect::<Vec<_>>().join("\n")
    }
}

/// What the API tells of a trip, as far as a story looks at it.
fn fault(by_watchdog: bool, found: bool) -> Option<String> {
    Some(serde_json::json!({ "fault": { "by_watchdog": by_watchdog, "found": found } }).to_string())
}

/// A history that is written by hand: what happened to `pump 1` on line `north`, and what the history tells of itself.
struct Written {
    _folder: Folder,
    store: store::Store,
    archive: Archive,
}

const fn on_wall(steady_ms: i64) -> Moment {
    Moment { steady_ms, wall_ms: NIGHT_MS + steady_ms }
}

impl Written {
    fn begin(name: &str) -> Self {
        let folder = Folder::new(&format!("history-night-{name}"));
        let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
        let mut archive = Archive::begin(on_wall(0));
        archive.begin_run(&mut store.connection, "test").unwrap();
        Self { _folder: folder, store, archive }
    }

    fn event(&mut self, at: i64, what: &str, text: &str, body: Option<serde_json::Value>) {
        self.kept(Kind::Event, Some("pump 1"), at, what, text, body);
    }

    fn kept(
        &mut self,
        kind: Kind,
        drive: Option<&str>,
        at: i64,
        what: &str,
        text: &str,
        body: Option<serde_json::Value>,
    ) {
        let record = Record::of_history(on_wall(at), what, text);
        let (drive, line) = (drive.map(str::to_owned), Some("north".to_owned()));
        let body = body.map(|body| body.to_string());
        self.archive.record(Record { kind, drive, line, body, ..record });
    }

    /// It is read every second, and shows that it is ready.
    fn heard_for(&mut self, seconds: i64) {
        self.heard_between(&[(0, seconds)]);
    }

    /// Likewise from each of these seconds to the other.
    fn heard_between(&mut self, spans: &[(i64, i64)]) {
        let mut tracker = Tracker::default();
        for at in spans.iter().flat_map(|(from, to)| *from..*to).map(|second| second * 1_000) {
            let Some(seen) = tracker.see(at, 3_000, &[(Quantity::STATE, 2)]) else { continue };
            let shown = vec![Shown { drive: "pump 1".into(), set: Set::Status, seen }];
            self.archive.take(Batch { shown, ..Batch::default() }, on_wall(at));
        }
    }

    fn asked(&mut self, at: i64, what: &str, text: &str) {
        let body = serde_json::json!({ "outcome": "confirmed" });
        self.kept(Kind::Command, Some("pump 1"), at, what, text, Some(body));
    }

    fn changed(&mut self, at: i64, from: &str, to: &str, by: &str) {
        let body = serde_json::json!({ "from": from, "to": to, "cause": { "by": by, "commander": "bert" } });
        self.event(at, "state_changed", &format!("state changed: {from} to {to}"), Some(body));
    }

    fn stops(&mut self, at: i64) {
        let body = serde_json::json!({ "from": "running", "to": "ready", "cause": { "by": "drive" } });
        self.event(at, "state_changed", "state changed: running to ready", Some(body));
    }

    /// It is killed, and begins again.
    fn killed_until(&mut self, at: i64) {
        self.archive.write_records(&mut self.store.connection, on_wall(at)).unwrap();
        self.archive = Archive::begin(on_wall(at));
        self.archive.begin_run(&mut self.store.connection, "test").unwrap();
    }

    fn told(self, at: i64) -> Story {
        self.told_until(at, 900_000)
    }

    /// Likewise of what is kept until then.
    fn told_until(mut self, at: i64, end: i64) -> Story {
        self.archive.end_run(&mut self.store.connection, on_wall(end)).unwrap();
        tell(&self.store.connection, "pump 1", NIGHT_MS + at).unwrap()
    }
}
