//! Nights that are staged on a simulated plant in virtual time, and the stories that are told of them. What a story has to say is written
//! here by what was staged; that it says nothing else for certain is looked at too.

use std::time::Duration;

use drive_core::{Direction, Frequency, StopMode};
use drive_fleet::Until;
use drive_sim::Panel;
use drived_config::{
    rights::{Caller, Rights},
    testing::Folder,
};
use drived_plant::plant::{
    commands::{Action, Request, Target},
    testing::TestPlant,
};
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};

use super::{Certainty, Story, tell};
use crate::{
    listen::{Clocks, Listening},
    record::{Kind, Moment, Record},
    store,
    write::{archive::Archive, inbox::Inbox, writer::Health},
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
            let (lifetime, arrived) = (Duration::from_secs(1), Instant::now());
            let request = Request { id: None, target: Target::Drive(drive), action, lifetime, arrived };
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

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_by_what_the_drive_says_and_what_brought_it_there_is_left_open() {
    let night = Night::begin(2).await;
    let at = night.now();
    // OBF, overbraking: BBV51701, fault code 18.
    night.plant.machines[0].trip(18);
    let story = night.asked("trip", "pump 1", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("tripped"), "{story:?}");
    assert!(story.why(Certainty::Said).contains("ObF"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("load, mains, wiring, setting"), "{story:?}");
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz, setpoint 30.00 Hz"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "", "nothing else was tripped");
    let neighbour = tell_nothing_of(&story, "pump 2");
    assert!(neighbour, "the other pump ran on: {story:?}");
    assert_eq!(story.about.unwrap().text, "tripped: 18 ObF: DC bus overvoltage");
}

fn tell_nothing_of(story: &Story, drive: &str) -> bool {
    !story.course().contains(drive)
}

#[tokio::test(start_paused = true)]
async fn one_silent_drive_is_told_as_that_and_its_neighbours_speak_for_the_line() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines[0].mute();
    let story = night.asked("one", "pump 1", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("lost"), "{story:?}");
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("no other drive of its line is recorded as lost within"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("its supply"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "");
}

#[tokio::test(start_paused = true)]
async fn a_cut_line_is_told_as_what_its_drives_share_and_never_as_one_of_them() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines.iter().for_each(drive_sim::SimSlave::mute);
    let story = night.asked("line", "pump 2", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("lost"), "{story:?}");
    assert!(
        story.why(Certainty::Seen).contains("pump 1, pump 3 of its line fell silent with it"),
        "{story:?}"
    );
    assert!(story.why(Certainty::Likely).contains("the cable, its adapter, or the supply"), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_somebody_asked_for_is_told_with_who_and_through_which_door() {
    let night = Night::begin(2).await;
    let at = night.now();
    let stop = Action::Stop(StopMode::Ramp.into());
    night.ask("anna", "http 10.0.0.7", Target::Drive("pump 1".to_owned()), stop).await;
    let story = night.asked("asked", "pump 1", at).await;
    let why = story.why(Certainty::Seen);
    assert!(
        why.contains("anna") && story.course().contains("by anna from http 10.0.0.7: confirmed"),
        "{story:?}"
    );
    assert_eq!(story.why(Certainty::Likely), "");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_nobody_here_stopped_is_told_so_and_who_did_is_not_guessed() {
    let night = Night::begin(2).await;
    let at = night.now();
    night.plant.machines[0].panel(Panel::Stop);
    let story = night.asked("panel", "pump 1", at).await;
    let sure = format!("{}\n{}", story.why(Certainty::Seen), story.why(Certainty::Said));
    assert!(!sure.contains("operator asked"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).is_empty(), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn two_drives_that_trip_together_have_one_cause_as_likely_and_not_as_certain() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines[0].trip(18);
    night.plant.machines[1].trip(18);
    let story = night.asked("two", "pump 1", at).await;
    assert!(story.why(Certainty::Likely).contains("pump 2 tripped within 5 s"), "{story:?}");
    assert!(!story.why(Certainty::Seen).contains("mains"), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn a_quiet_night_is_told_as_quiet_with_the_share_that_is_known() {
    let night = Night::begin(1).await;
    sleep(Duration::from_secs(1_800)).await;
    let at = night.now();
    sleep(Duration::from_secs(600)).await;
    let story = night.asked("quiet", "pump 1", at).await;
    assert_eq!((story.about, story.course), (None, Vec::new()));
    assert!(story.not_known.last().unwrap().text.contains("100 % of the"), "{:?}", story.not_known);
}

/// What the API tells of a trip, as far as a story looks at it.
fn fault(by_watchdog: bool, found: bool) -> Option<String> {
    Some(serde_json::json!({ "fault": { "by_watchdog": by_watchdog, "found": found } }).to_string())
}

#[test]
fn a_trip_by_the_watchdog_behind_a_cut_line_is_told_by_the_silence_and_never_by_the_mains() {
    let folder = Folder::new("history-night-watchdog");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let on_wall = |steady_ms| Moment { steady_ms, wall_ms: NIGHT_MS + steady_ms };
    let mut archive = Archive::begin(on_wall(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let mut event = |at, drive: &str, what: &str, text: &str, body| {
        let record = Record::of_history(on_wall(at), what, text);
        let (drive, line) = (Some(drive.to_owned()), Some("north".to_owned()));
        archive.record(Record { kind: Kind::Event, drive, line, body, ..record });
    };
    for drive in ["pump 1", "pump 2", "pump 3"] {
        event(100_000, drive, "lost", "lost for 2.0 s: no answer", None);
    }
    for drive in ["pump 1", "pump 2", "pump 3"] {
        event(123_000, drive, "tripped", "tripped, found so", fault(false, true));
        let text = "trip explained, found so by its communication watchdog: 5 SLF: Modbus communication interruption";
        event(123_200, drive, "trip_explained", text, fault(true, true));
    }
    archive.end_run(&mut store.connection, on_wall(200_000)).unwrap();
    let story = tell(&store.connection, "pump 3", NIGHT_MS + 123_000).unwrap();
    assert!(story.about.as_ref().unwrap().text.contains("5 SLF"), "{story:?}");
    let (seen, likely) = (story.why(Certainty::Seen), story.why(Certainty::Likely));
    assert!(
        seen.contains("it had not answered before")
            && seen.contains("pump 1, pump 2 of its line fell silent with it"),
        "{story:?}"
    );
    assert!(
        likely.contains("the cable, its adapter, or the supply") && !likely.contains("mains"),
        "{story:?}"
    );
}
