//! The event stream.

use std::time::Duration;

use drive_core::StopMode;
use drived_plant::plant::revisions::{Next, Subject, data_of};
use serde_json::json;
use tokio::time::timeout;

use super::*;

/// A stream that is read as a browser reads it.
struct Stream {
    body: Body,
    text: String,
}

impl Stream {
    async fn open(plant: &Plant, path: &str, last: Option<&str>) -> Self {
        let mut request = Request::get(path);
        if let Some(last) = last {
            request = request.header("last-event-id", last);
        }
        let request = request.body(Body::empty()).unwrap();
        let response = api(plant, "reader", ALL).oneshot(request).await.unwrap();
        assert_eq!(response.headers()["content-type"], "text/event-stream");
        Self { body: response.into_body(), text: String::new() }
    }

    /// The next event: its id, its name, its data.
    async fn next(&mut self) -> Option<(u64, String, Value)> {
        loop {
            if let Some((event, rest)) = self.text.clone().split_once("\n\n") {
                self.text = rest.to_owned();
                let field = |name: &str| event.lines().find_map(|line| line.strip_prefix(name));
                if let Some(id) = field("id: ") {
                    let data = serde_json::from_str(field("data: ").unwrap()).unwrap();
                    return Some((id.parse().unwrap(), field("event: ").unwrap().to_owned(), data));
                }
                continue;
            }
            let frame = self.body.frame().await?.unwrap();
            self.text.push_str(std::str::from_utf8(frame.data_ref().unwrap()).unwrap());
        }
    }

    async fn find(&mut self, name: &str, is_it: impl Fn(&Value) -> bool) -> (u64, Value) {
        loop {
            let (id, event, data) = self.next().await.expect("the stream goes on");
            if event == name && is_it(&data) {
                return (id, data);
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn what_happens_is_told_to_every_reader_by_the_same_numbers() {
    let plant = TestPlant::of(2).await;
    let revision = get(&plant.plant, "/api/v1/state").await.1["revision"].as_u64().unwrap();
    let path = format!("/api/v1/events?since={revision}");
    let (mut one, mut two) =
        (Stream::open(&plant.plant, &path, None).await, Stream::open(&plant.plant, &path, None).await);
    let body = json!({"id": "run", "setpoint": {"frequency_hz": 30.0}});
    let (_, _) = command(&plant.plant, "/api/v1/drives/pump%201/start", &body).await;
    for stream in [&mut one, &mut two] {
        let (first, told) = stream.find("command", |told| told["outcome"] == "confirmed").await;
        assert_eq!((&told["id"], &told["drive"]), (&"run".into(), &"pump 1".into()));
        assert!(first > revision);
    }
    plant.machines[1].trip(9);
    let (id, event) = one.find("event", |event| event["event"] == "tripped").await;
    assert_eq!((&event["drive"], &event["alarm"]), (&"pump 2".into(), &true.into()), "{event}");
    assert_eq!(two.find("event", |event| event["event"] == "tripped").await.0, id);
    let (_, drive) = two.find("drive", |drive| drive["fault"].is_object()).await;
    assert_eq!((&drive["name"], &drive["status"]["state"]), (&"pump 2".into(), &"fault".into()));
    one.find("line", |line| line["name"] == "north").await;
    let (id, tick) = one.find("tick", |_| true).await;
    assert_eq!(tick["revision"], id);
}

#[tokio::test(start_paused = true)]
async fn a_reader_that_comes_again_gets_what_it_missed_and_one_from_too_long_ago_begins_anew() {
    let plant = TestPlant::of(1).await;
    let mut stream = Stream::open(&plant.plant, "/api/v1/events", None).await;
    let (seen, _, _) = stream.next().await.unwrap();
    drop(stream);
    tokio::time::sleep(Duration::from_secs(20)).await;
    // The header is newer than the address that the browser repeats.
    let mut again = Stream::open(&plant.plant, "/api/v1/events?since=1", Some(&seen.to_string())).await;
    for number in 1..=3 {
        assert_eq!(again.next().await.unwrap().0, seen + number);
    }
    let mut late = Stream::open(&plant.plant, "/api/v1/events?since=1", None).await;
    let (id, name, _) = late.next().await.unwrap();
    assert_eq!(name, "reset");
    assert!(id > seen && late.next().await.is_none(), "and the stream ends");
}

#[tokio::test(start_paused = true)]
async fn a_reader_that_does_not_read_is_told_to_begin_anew_and_holds_nobody_up() {
    let plant = TestPlant::of(1).await;
    let mut slow = Stream::open(&plant.plant, "/api/v1/events", None).await;
    slow.next().await.unwrap();
    for _ in 0..5_000 {
        plant.plant.revisions().push(drived_plant::plant::revisions::Subject::Event, &"x");
    }
    let (_, drive) = get(&plant.plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["status"]["quality"], "good");
    slow.find("reset", |_| true).await;
    assert!(slow.next().await.is_none());
}

#[tokio::test(start_paused = true)]
async fn a_value_that_grows_old_is_told_without_being_asked() {
    let plant = TestPlant::of(1).await;
    tokio::time::sleep(Duration::from_secs(15)).await;
    let mut stream = Stream::open(&plant.plant, "/api/v1/events", None).await;
    plant.line.cut();
    let (_, drive) = stream.find("drive", |drive| drive["status"]["quality"] == "stale").await;
    assert_eq!(
        (&drive["link"], &drive["measurements"]["quality"]),
        (&"lost".into(), &"stale".into()),
        "{drive}"
    );
    plant.line.join();
    stream.find("drive", |drive| drive["status"]["quality"] == "good").await;
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_has_gone_is_told_to_nobody_who_has_read_the_state_since() {
    for after in (0..100).step_by(5) {
        let plant = TestPlant::of(1).await;
        let body = json!({"setpoint": {"frequency_hz": 30.0}});
        command(&plant.plant, "/api/v1/drives/pump%201/start", &body).await;
        tokio::time::sleep(Duration::from_millis(300 + after)).await;
        let (fleet, revisions) = (plant.plant.fleet(), plant.plant.revisions());
        let mut reader = revisions.reader(None);
        let gone = fleet.remove(&["pump 1"], Duration::from_secs(20)).await;
        assert_eq!(gone.len(), 1);
        revisions.begin_anew();

        let mut is_shown = true;
        while let Ok(next) = timeout(Duration::from_secs(5), revisions.next(&mut reader)).await {
            is_shown = match next {
                Next::Reset(_) => false,
                Next::Frames(frames) => {
                    is_shown || frames.iter().any(|frame| data_of(frame, Subject::Drive).is_some())
                }
                Next::End => break,
            };
        }
        assert!(!is_shown, "{after} ms");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_of_which_nothing_changes_is_told_now_and_then_so_that_its_ages_stay_right() {
    let plant = TestPlant::of(1).await;
    tokio::time::sleep(Duration::from_secs(30)).await;
    let mut stream = Stream::open(&plant.plant, "/api/v1/events", None).await;
    let began = tokio::time::Instant::now();
    for _ in 0..4 {
        stream.find("drive", |_| true).await;
    }
    let took = began.elapsed();
    assert!((Duration::from_secs(15)..Duration::from_secs(30)).contains(&took), "{took:?}");
}

async fn recent(plant: &Plant) -> Vec<Value> {
    let (status, recent) = get(plant, "/api/v1/events/recent").await;
    assert_eq!(status, StatusCode::OK);
    recent.as_array().unwrap().clone()
}

#[tokio::test(start_paused = true)]
async fn whoever_comes_later_is_told_what_happened_before_the_newest_last() {
    let plant = TestPlant::of(2).await;
    let body = json!({"id": "run", "setpoint": {"frequency_hz": 30.0}});
    assert_eq!(command(&plant.plant, "/api/v1/drives/pump%201/start", &body).await.0, StatusCode::OK);
    plant.machines[1].trip(9);
    tokio::time::sleep(Duration::from_secs(3)).await;
    let told = recent(&plant.plant).await;
    let at = |is_it: &dyn Fn(&Value) -> bool| told.iter().position(is_it).expect("it is told");
    let run = at(&|told| told["kind"] == "command" && told["id"] == "run");
    let tripped = at(&|told| told["kind"] == "event" && told["event"] == "tripped");
    assert_eq!((&told[run]["outcome"], &told[run]["caller"]), (&"confirmed".into(), &"operator".into()));
    assert_eq!((&told[tripped]["drive"], &told[tripped]["alarm"]), (&"pump 2".into(), &true.into()));
    assert!(run < tripped);
    let revision = get(&plant.plant, "/api/v1/state").await.1["revision"].as_u64().unwrap();
    assert!(told.iter().all(|told| told["revision"].as_u64().is_some_and(|its| its <= revision)));
}

#[tokio::test(start_paused = true)]
async fn a_command_stands_once_among_the_events_with_its_outcome() {
    let plant = TestPlant::of(2).await;
    let mut stream = Stream::open(&plant.plant, "/api/v1/events", None).await;
    let body = json!({"id": "run", "setpoint": {"frequency_hz": 30.0}});
    assert_eq!(command(&plant.plant, "/api/v1/drives/pump%201/start", &body).await.0, StatusCode::OK);
    assert_eq!(command(&plant.plant, "/api/v1/stop", &json!({"id": "all"})).await.0, StatusCode::OK);
    tokio::time::sleep(Duration::from_secs(3)).await;
    // What somebody else in the program commands has no other way to be told.
    let _ = plant.plant.fleet().drive("pump 2").unwrap().commanded_by("the demo").stop(StopMode::Ramp).await;
    let (_, told) = stream.find("event", |told| told["event"] == "command").await;
    assert_eq!(
        told["command"]["commander"], "the demo",
        "nothing of the operator's is told a second time: {told}"
    );
    let commands: Vec<Value> =
        recent(&plant.plant).await.into_iter().filter(|told| !told["command"].is_null()).collect();
    let known: Vec<_> = commands.iter().map(|told| (&told["kind"], told["id"].as_str())).collect();
    let (command, event) = (Value::from("command"), Value::from("event"));
    assert_eq!(known, [(&command, Some("run")), (&command, Some("all")), (&event, None)]);
    assert_eq!((&commands[1]["outcome"], &commands[1]["confirmed"]), (&"confirmed".into(), &2.into()));
}

#[tokio::test(start_paused = true)]
async fn an_audit_log_that_cannot_be_written_is_an_alarm_among_the_events() {
    let plant = TestPlant::of(1).await;
    let mut stream = Stream::open(&plant.plant, "/api/v1/events", None).await;
    let failing = tokio::sync::watch::Sender::new(false);
    plant.plant.follow_audit(failing.subscribe());
    for is_failing in [true, false] {
        failing.send_replace(is_failing);
        let (_, told) = stream.find("event", |told| told["event"] == "audit_log").await;
        assert_eq!(told["alarm"], is_failing, "{told}");
        assert!(
            told["drive"].is_null() && told["text"].as_str().is_some_and(|text| text.contains("audit log"))
        );
    }
    assert_eq!(recent(&plant.plant).await.last().unwrap()["event"], "audit_log");
}
