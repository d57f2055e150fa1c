//! Pictures as somebody expects them who stands before the plant.

use std::{sync::Arc, time::Duration};

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use drive_fleet::{Concern, ConcernKind, view::ConcernView};
use proptest::prelude::*;
use ratatui::{Terminal, backend::TestBackend};
use serde_json::{Value, json};
use tokio::{
    runtime::{Builder, EnterGuard, Runtime},
    time::{Instant, advance},
};

use super::{
    super::{
        account::{Progress, Stop},
        happening::Happening,
        model::{Ask, Model, News, View},
    },
    draw,
};
use drived_client::Heard;
use drived_plant::plant::{self, views::CommandView};

/// A running drive as the daemon tells it.
fn drive(name: &str) -> Value {
    let mut drive = plant::testing::told(name);
    let more = json!({
        "status": {"quality": "good", "age_ms": 120, "state": "running", "direction": "forward",
                   "output_frequency_hz": 29.5, "current_a": 3.2, "control": "bus", "warning": false,
                   "raw": [{"address": 3201, "code": "ETA", "value": 1575}]},
        "measurements": {"quality": "good", "age_ms": 2_000, "torque_percent": 40.0, "running_time_h": 1200.5,
                         "before_trip": false, "raw": []},
        "setpoint": {"frequency_hz": 30.0}, "shows": "running",
    });
    drive.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    drive
}

/// The same with something else.
fn with(name: &str, more: &[(&str, Value)]) -> Value {
    let mut drive = drive(name);
    for (path, value) in more {
        *drive.pointer_mut(path).unwrap_or_else(|| panic!("{path}")) = value.clone();
    }
    drive
}

/// What troubles a drive, as the daemon tells it.
fn concern(kind: ConcernKind, detail: &str) -> Value {
    let concern = Concern { kind, since: None, detail: Some(detail.to_owned()) };
    json!([ConcernView::of(&concern, Instant::now())])
}

fn tripped(name: &str) -> Value {
    let mut drive =
        with(name, &[("/status/state", json!("fault")), ("/status/output_frequency_hz", json!(0.0))]);
    drive["shows"] = "fault".into();
    drive["fault"] = json!({
        "code": 9, "mnemonic": "OLF", "meaning": "motor overload", "remedy": "let the motor cool down",
        "by_watchdog": false, "time_unix_ms": 1_700_000_000_000_u64,
        "before": {"state": "running", "direction": "forward", "output_frequency_hz": 48.5, "current_a": 9.9, "raw": []},
        "at_trip": {"state": "fault", "output_frequency_hz": 12.5, "raw": []},
    });
    drive["concerns"] = concern(ConcernKind::Tripped, "9 OLF: motor overload");
    drive
}

fn lost(name: &str) -> Value {
    let stale =
        [("/link", json!("lost")), ("/status/quality", json!("stale")), ("/status/age_ms", json!(21_000))];
    let mut drive = with(name, &stale);
    (drive["error"], drive["shows"]) = ("no answer".into(), "lost".into());
    drive["concerns"] = concern(ConcernKind::Lost, "no answer");
    drive
}

fn errors(no_answer: u64) -> Value {
    json!({"no_answer": no_answer, "damaged": 0, "late": 0, "mismatched": 0, "exception": 0})
}

fn state(drives: &[Value]) -> Value {
    json!({
        "revision": 7, "time_unix_ms": 1_700_000_000_000_u64,
        "daemon": {"version": "0.1.0", "started_unix_ms": 1_700_000_000_000_u64, "demo": false, "caller": "local",
                   "rights": {"view": true, "stop": true, "operate": false, "engineer": false}}, "drives": drives,
        "lines": [{"name": "north", "link": "connected", "utilisation_percent": 68.2, "worst_case_stop_ms": 608,
                   "port": "/dev/ttyUSB0,19200,8E1", "protocol": "rtu", "exchanges": 1_234, "cycle_ms": 888,
                   "utilisation_since_opening_percent": 61.0, "errors": errors(3),
                   "slaves": [
                       {"slave": 1, "drive": "pump 1", "exchanges": 900, "off_line": false, "errors": errors(0), "probes": 0, "timeout_ms": 100,
                        "answer_ms": {"p50": 8.1, "p99": 12.0, "max": 30.0}},
                       {"slave": 3, "drive": "pump 3", "exchanges": 34, "off_line": true, "next_probe_ms": 3_200,
                        "errors": errors(3), "probes": 9, "timeout_ms": 100},
                   ]}],
        "groups": [{"name": "fans", "drives": ["fan 1"]}],
    })
}

fn told(state: Value, recent: Value) -> News {
    let state = serde_json::from_value(state).unwrap_or_else(|error| panic!("{error}"));
    let recent = serde_json::from_value(recent).unwrap_or_else(|error| panic!("{error}"));
    News::State { state, recent, kept: Vec::new() }
}

/// A stop of which this is told, and what every command tells.
fn command(told: Value) -> Arc<CommandView> {
    let mut command = json!({
        "id": "c-1", "action": "stop", "command": "ramp stop", "caller": "local", "origin": "socket uid 0",
        "outcome": "pending", "open": false, "time_unix_ms": 1_700_000_000_000_u64, "refused": 0, "failed": 0,
    });
    command.as_object_mut().unwrap().extend(told.as_object().unwrap().clone());
    for drive in command["drives"].as_array_mut().into_iter().flatten() {
        *drive = json!(super::tests::command(drive.clone()));
    }
    serde_json::from_value(command).unwrap_or_else(|error| panic!("{error}"))
}

/// The monitor, what it was told and when. The clock goes on only while somebody waits: what is told to be so old is so old.
struct Monitor {
    model: Model,
    now: Instant,
    _clock: EnterGuard<'static>,
}

thread_local! {
    static CLOCK: &'static Runtime = {
        let clock = Builder::new_current_thread().enable_time().start_paused(true).build().unwrap();
        Box::leak(Box::new(clock))
    };
}

fn standing_clock() -> EnterGuard<'static> {
    CLOCK.with(|clock| clock.enter())
}

impl Monitor {
    fn of(drives: &[Value]) -> Self {
        let _clock = standing_clock();
        let now = Instant::now();
        let mut model = Model::new("a test".to_owned(), now);
        model.take(told(state(drives), json!([])), now);
        Self { model, now, _clock }
    }

    fn tell(&mut self, kind: &str, data: Value) {
        self.model.take(News::Heard(Heard::of(kind, data).unwrap()), self.now);
    }

    fn wait(&mut self, seconds: u64) {
        CLOCK.with(|clock| clock.block_on(advance(Duration::from_secs(seconds))));
        self.now = Instant::now();
    }

    fn press(&mut self, code: KeyCode) -> Option<Ask> {
        self.model.press(KeyEvent::new(code, KeyModifiers::NONE), self.now)
    }

    fn control(&mut self, letter: char) -> Option<Ask> {
        self.model.press(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::CONTROL), self.now)
    }

    fn screen(&mut self, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(&mut self.model, self.now, frame)).unwrap();
        let rows: Vec<String> = terminal
            .backend()
            .to_string()
            .lines()
            .map(|row| row.trim_matches('"').trim_end().to_owned())
            .collect();
        rows.join("\n")
    }

    /// The row of a drive.
    fn row(&mut self, name: &str, width: u16) -> String {
        let screen = self.screen(width, 24);
        let row = screen.lines().find(|row| row.contains(name) && !row.contains("Ctrl-S"));
        row.unwrap_or_else(|| panic!("{name} is not there:\n{screen}")).to_owned()
    }
}

#[test]
fn those_in_trouble_stand_first_and_say_what_it_is() {
    let mut monitor = Monitor::of(&[drive("pump 1"), lost("pump 2"), tripped("pump 3")]);
    let screen = monitor.screen(120, 24);
    let rows: Vec<&str> = screen.lines().collect();
    assert!(rows[0].contains("3 drives, 2 in trouble") && rows[0].contains("live"), "{screen}");
    assert!(rows[2].contains("!pump 3") && rows[2].contains("fault OLF"), "{screen}");
    assert!(rows[2].contains("motor overload"), "{screen}");
    assert!(rows[3].contains("!pump 2") && rows[3].contains("lost"), "{screen}");
    assert!(rows[4].contains(" pump 1") && rows[4].contains("running fwd"), "{screen}");
    assert!(screen.contains("north: 68 % used, a stop waits 608 ms at most"), "{screen}");
}

#[test]
fn a_stale_value_is_in_brackets_with_its_age_and_never_shown_as_live() {
    let mut monitor = Monitor::of(&[drive("pump 1"), lost("pump 2")]);
    for width in [60, 80, 120] {
        let row = monitor.row("pump 2", width);
        assert!(row.contains("(29.5)/30.0") && row.contains("21 s old"), "{row}");
        assert!(!row.contains("live") && !row.contains('█'), "{row}");
        let row = monitor.row("pump 1", width);
        assert!(row.contains(" 29.5/30.0") && row.contains("live"), "{row}");
    }
    monitor.wait(9);
    monitor.tell("tick", json!({}));
    assert!(monitor.row("pump 2", 80).contains("30 s old"), "ages go on");
    monitor.tell("drive", drive("pump 2"));
    assert!(monitor.row("pump 2", 80).contains("live"));
}

#[test]
fn everything_is_old_as_soon_as_the_connection_is_gone_and_live_again_with_the_next_state() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    monitor.model.take(News::Interrupted("the daemon has ended".to_owned()), monitor.now);
    monitor.wait(5);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("NOT CONNECTED for 5.0 s, trying again: everything below is old"), "{screen}");
    assert!(
        screen.contains("(29.5)/30.0") && screen.contains("(3.2 A)") && screen.contains("5.1 s old"),
        "{screen}"
    );
    assert!(!screen.contains("live") && screen.contains("(was 68 % used)"), "{screen}");
    let state = state(&[drive("pump 1")]);
    monitor.model.take(told(state, json!([])), monitor.now);
    let screen = monitor.screen(80, 24);
    assert!(!screen.contains("NOT CONNECTED") && screen.contains(" 29.5/30.0"), "{screen}");
}

#[test]
fn a_drive_of_which_nothing_is_heard_any_more_is_old_though_it_was_told_to_be_good() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    for _ in 0..3 {
        monitor.wait(5);
        monitor.tell("tick", json!({}));
    }
    let row = monitor.row("pump 1", 80);
    assert!(row.contains("(29.5)/30.0") && row.contains("15 s old"), "{row}");
    monitor.wait(13);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("SILENT") && screen.contains("nothing was heard for 13 s"), "{screen}");
}

#[test]
fn the_stop_key_stops_all_while_a_search_is_typed_and_says_so_at_once() {
    let mut monitor = Monitor::of(&[drive("pump 1"), drive("fan 1")]);
    assert_eq!(monitor.press(KeyCode::Char('/')), None);
    for letter in "pumps".chars() {
        assert_eq!(monitor.press(KeyCode::Char(letter)), None);
    }
    assert_eq!(monitor.control('s'), Some(Ask::Stop { number: 1, stop: Stop::All }));
    let screen = monitor.screen(60, 20);
    assert!(screen.contains("STOP ALL") && screen.contains("given to 2 drives, no answer yet"), "{screen}");
    assert!(screen.contains("no emergency stop") && screen.contains("search: pumps_"), "{screen}");
}

#[test]
fn the_stop_key_works_in_every_view_without_a_question_and_without_a_connection() {
    for keys in
        [&[][..], &[KeyCode::Enter], &[KeyCode::Char('2')], &[KeyCode::Char('3')], &[KeyCode::Char('?')]]
    {
        for connected in [true, false] {
            let mut monitor = Monitor::of(&[drive("pump 1")]);
            if !connected {
                monitor.model.take(News::Interrupted("gone".to_owned()), monitor.now);
            }
            for key in keys {
                monitor.press(*key);
            }
            assert_eq!(monitor.control('s'), Some(Ask::Stop { number: 1, stop: Stop::All }), "{keys:?}");
            assert_eq!(
                monitor.control('s'),
                Some(Ask::Stop { number: 2, stop: Stop::All }),
                "again is again"
            );
            let screen = monitor.screen(80, 24);
            assert!(screen.contains("STOP ALL") && screen.contains("no emergency stop"), "{screen}");
        }
    }
}

#[test]
fn no_key_that_is_typed_in_a_text_stops_anything_or_starts_anything() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    for view in ['1', '2', '3', '/'] {
        monitor.press(KeyCode::Char(view));
        for letter in (' '..='~').filter(|letter| *letter != 'q' || view == '/') {
            assert_eq!(monitor.press(KeyCode::Char(letter)), None, "{letter} after {view}");
            monitor.press(KeyCode::Enter);
            monitor.press(KeyCode::Esc);
            monitor.press(KeyCode::Char(view));
        }
        monitor.press(KeyCode::Esc);
    }
}

#[test]
fn the_key_of_one_drive_stops_the_one_that_is_marked_and_in_sight() {
    let mut monitor = Monitor::of(&[drive("pump 1"), drive("pump 2"), drive("fan 1")]);
    assert_eq!(monitor.control('t'), None, "nobody has marked one");
    assert!(monitor.screen(80, 24).contains("NOTHING WAS STOPPED"));
    monitor.press(KeyCode::Down);
    monitor.press(KeyCode::Down);
    let one = |name: &str, number| Some(Ask::Stop { number, stop: Stop::One(name.to_owned()) });
    assert_eq!(monitor.control('t'), one("pump 2", 1));
    assert!(monitor.screen(80, 24).contains("STOP pump 2"));
    monitor.press(KeyCode::Char('/'));
    for letter in "fan".chars() {
        monitor.press(KeyCode::Char(letter));
    }
    assert_eq!(monitor.control('t'), one("fan 1", 2), "the one that was marked is out of sight");
    monitor.press(KeyCode::Enter);
    monitor.press(KeyCode::Enter);
    assert_eq!(monitor.model.view, View::Drive("fan 1".to_owned()));
    assert_eq!(monitor.control('t'), one("fan 1", 3));
    monitor.press(KeyCode::Char('3'));
    assert_eq!(monitor.control('t'), None, "no drive is marked among the events");
    assert!(monitor.screen(80, 24).contains("NOTHING WAS STOPPED"));
}

#[test]
fn a_stop_is_counted_until_every_drive_is_accounted_for() {
    let mut monitor = Monitor::of(&[drive("pump 1"), drive("pump 2"), lost("pump 3")]);
    monitor.control('s');
    let told = |outcomes: [&str; 3], confirmed, pending, not_reachable| {
        let names = ["pump 1", "pump 2", "pump 3"];
        let drives = names.into_iter().zip(outcomes);
        let drives = drives.map(|(drive, outcome)| json!({"drive": drive, "outcome": outcome}));
        let answer = json!({"id": "c-1", "outcome": "pending", "drives": drives.collect::<Vec<_>>(),
                            "confirmed": confirmed, "pending": pending, "not_reachable": not_reachable});
        News::Stop { number: 1, progress: Progress::Answer(command(answer)) }
    };
    monitor.model.take(told(["pending", "confirmed", "pending"], 1, 1, 1), monitor.now);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("1 confirmed, 1 pending, 1 not reachable"), "{screen}");
    assert!(screen.contains("pending: pump 1, pump 3"), "{screen}");
    monitor.press(KeyCode::Esc);
    assert_eq!(monitor.model.unconfirmed_stops().count(), 1, "what is open is not closed by a key");
    monitor.model.take(told(["confirmed", "confirmed", "not_confirmed"], 2, 0, 1), monitor.now);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("2 confirmed, 0 pending, 1 not reachable"), "{screen}");
    assert!(screen.contains("NOT confirmed: pump 3"), "{screen}");
    assert_eq!(monitor.model.unconfirmed_stops().count(), 1, "whoever ends it now is told");
    monitor.press(KeyCode::Esc);
    assert_eq!(monitor.model.unconfirmed_stops().count(), 0);
    assert!(!monitor.screen(80, 24).contains("not reachable"));
}

#[test]
fn what_was_told_of_a_stop_goes_when_a_motor_that_confirmed_it_is_started() {
    let mut monitor = Monitor::of(&[drive("pump 1"), drive("pump 2")]);
    monitor.control('s');
    let drives = ["pump 1", "pump 2"].map(|drive| json!({"drive": drive, "outcome": "confirmed"}));
    let answer = json!({"id": "c-1", "outcome": "confirmed", "drives": drives,
                        "confirmed": 2, "pending": 0, "not_reachable": 0});
    monitor.model.take(News::Stop { number: 1, progress: Progress::Answer(command(answer)) }, monitor.now);
    let stopped = 1_700_000_000_000_u64;
    let start = |outcome: &str, at: u64| {
        let told = json!({"id": "c-2", "drive": "pump 2", "action": "start", "outcome": outcome, "time_unix_ms": at});
        News::Heard(Heard::Command(Box::new(Arc::unwrap_or_clone(command(told)))))
    };
    // The last is from before the stop, and told behind it.
    for (outcome, at) in [("pending", stopped + 5), ("refused", stopped + 5), ("confirmed", stopped - 5)] {
        monitor.model.take(start(outcome, at), monitor.now);
        assert!(monitor.screen(80, 24).contains("2 confirmed"), "{outcome}: it stands still");
    }
    monitor.model.take(start("confirmed", stopped + 5), monitor.now);
    assert!(!monitor.screen(80, 24).contains("2 confirmed"), "{}", monitor.screen(80, 24));
}

#[test]
fn what_is_pasted_is_searched_for_where_that_is_typed_and_is_no_key() {
    let mut monitor = Monitor::of(&[drive("pump 1"), drive("quiet fan")]);
    monitor.model.paste("q1?");
    assert!(monitor.screen(80, 24).contains("pump 1"));
    monitor.press(KeyCode::Char('/'));
    monitor.model.paste("quiet\n fan");
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("search: quiet fan") && !screen.contains("pump 1"), "{screen}");
}

#[test]
fn a_stop_that_could_not_be_given_says_so_and_names_the_emergency_stop() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    monitor.control('s');
    let again = Progress::Again("the daemon does not answer".to_owned());
    monitor.model.take(News::Stop { number: 1, progress: again }, monitor.now);
    let screen = monitor.screen(100, 24);
    assert!(screen.contains("NOT SENT YET, tried 1 times: the daemon does not answer"), "{screen}");
    assert!(screen.contains("use the emergency stop"), "{screen}");
    let over = Progress::Over("anonymous has no right to stop".to_owned());
    monitor.model.take(News::Stop { number: 1, progress: over }, monitor.now);
    let screen = monitor.screen(100, 24);
    assert!(screen.contains("NOT CONFIRMED: anonymous has no right to stop"), "{screen}");
}

#[test]
fn a_stop_of_one_drive_that_is_lost_is_counted_as_not_reachable() {
    let mut monitor = Monitor::of(&[lost("pump 1")]);
    monitor.press(KeyCode::Down);
    monitor.control('t');
    let answer = json!({"id": "c-1", "drive": "pump 1", "outcome": "pending"});
    monitor.model.take(News::Stop { number: 1, progress: Progress::Answer(command(answer)) }, monitor.now);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("0 confirmed, 0 pending, 1 not reachable"), "{screen}");
}

#[test]
fn one_drive_shows_its_fault_with_what_to_do_and_what_it_was_before() {
    let mut monitor = Monitor::of(&[tripped("pump 1")]);
    monitor.press(KeyCode::Enter);
    let screen = monitor.screen(120, 40);
    for expected in [
        "atv312@1 on north",
        "Tripped: 9 OLF: motor overload",
        "let the motor cool down",
        "running, forward, 48.50 Hz, 9.9 A",
        "1200.5 h",
        "ETA 0627h: ",
    ] {
        assert!(screen.contains(expected), "{expected}:\n{screen}");
    }
}

#[test]
fn the_last_ten_minutes_of_a_drive_are_drawn_and_read_at_a_cursor_in_units() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    monitor.press(KeyCode::Enter);
    assert!(monitor.model.wanted().is_some());
    let times: Vec<u64> = (0..1_200).map(|sample| 1_700_000_000_000 + sample * 500).collect();
    let ramp = |most: f64| (0..1_200).map(|sample| f64::from(sample) / 1_199.0 * most).collect::<Vec<_>>();
    let mut torque: Vec<Value> = ramp(80.0).into_iter().map(Value::from).collect();
    torque[1_199] = Value::Null;
    let history = json!({"step_ms": 500, "time_unix_ms": times, "frequency_hz": ramp(50.0), "setpoint_hz": ramp(50.0),
                         "current_a": ramp(4.0), "torque_percent": torque});
    monitor.model.take(
        News::History {
            drive: "pump 1".to_owned(),
            history: serde_json::from_value(history.clone()).unwrap(),
        },
        monitor.now,
    );
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("-10 min") && screen.contains("50 Hz"), "{screen}");
    assert!(screen.contains("50.0 Hz, setpoint 50.0 Hz, 4.0 A"), "{screen}");
    assert!(
        !screen.contains("torque -") && !screen.contains("torque 0"),
        "what is not known is not 0: {screen}"
    );
    monitor.press(KeyCode::Left);
    assert_eq!(monitor.model.wanted(), None, "it stands still");
    let screen = monitor.screen(80, 24);
    assert!(
        screen.contains("HELD at") && screen.contains("49.8 Hz") && screen.contains("torque 79.7 %"),
        "{screen}"
    );
    monitor.press(KeyCode::Char(' '));
    assert!(monitor.model.wanted().is_some(), "it goes on");
    monitor.press(KeyCode::Char('c'));
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("current, A") && screen.contains("torque, %"), "{screen}");
}

#[test]
fn a_line_tells_how_it_is_used_what_went_wrong_and_who_is_off_it() {
    let mut monitor = Monitor::of(&[drive("pump 1")]);
    monitor.press(KeyCode::Char('2'));
    let mut line = state(&[])["lines"][0].clone();
    line["planned"] =
        json!({"cycle_ms": 888.0, "utilisation_percent": 70.0, "all_stopped_ms": 2_000.0, "stop_ms": 608.0});
    line["measured"] = json!({
        "elapsed_ms": 60_000, "utilisation_percent": 61.0, "stop_ms": 300.0, "retries": 0, "noise_bytes": 0, "lost": 0,
        "lag_ms": {"count": 934, "min": 0.0, "p50": 0.05, "p99": 0.4, "max": 3.25},
        "answers": [{"slave": 1, "answered": 40, "went_offline": 0, "times": [{"up_to_ms": 7.17, "count": 30}, {"up_to_ms": 8.0, "count": 10}]},
                    {"slave": 3, "answered": 10, "went_offline": 1, "times": [{"up_to_ms": 9.22, "count": 10}]}],
    });
    line["last"] = json!([{"time_unix_ms": 1_700_000_000_000_u64, "slave": 3, "request": "03 03 0C 81", "answer": "",
                           "result": "no_answer", "took_ms": 100.5}]);
    monitor.model.take(News::Line(serde_json::from_value(line).unwrap()), monitor.now);
    let screen = monitor.screen(100, 40);
    for expected in [
        "68 % lately, 61 % since it was opened",
        "608 ms at most, whatever happens",
        "3 no answer",
        "3.25 ms at most",
        "to 8 ms ████████████████████████████████████████ 40",
        "to 10 ms ██████████ 10",
        "1 pump 1: answers; usually 8.1 ms, 1 % above 12.0 ms, longest 30.0 ms",
        "3 pump 3: OFF-LINE, only probed, next in 3.2 s",
        "slave 3: no answer 100.5 ms: 03 03 0C 81",
    ] {
        assert!(screen.contains(expected), "{expected}:\n{screen}");
    }
}

#[test]
fn events_tell_who_asked_from_where_what_came_of_it_and_how_long_it_took_also_from_before() {
    let _clock = standing_clock();
    let now = Instant::now();
    let mut model = Model::new("a test".to_owned(), now);
    let at = 1_700_000_000_000_u64;
    let recent = json!([
        {"revision": 3, "kind": "event", "time_unix_ms": at, "drive": "pump 1", "event": "tripped", "alarm": true,
         "order": 1, "cause": {"by": "drive"},
         "fault": {"by_watchdog": false, "time_unix_ms": at, "at_trip": {"state": "fault", "raw": []}},
         "text": "tripped: fault 9 OLF"},
        {"revision": 4, "kind": "command", "id": "c-1", "time_unix_ms": at + 1, "drive": "pump 1", "action": "stop",
         "command": "ramp stop", "caller": "operator", "origin": "page 10.0.0.7", "outcome": "pending", "open": true},
    ]);
    model.take(told(state(&[drive("pump 1")]), recent), now);
    let mut monitor = Monitor { model, now, _clock };
    monitor.tell(
        "command",
        json!({"id": "c-1", "time_unix_ms": at + 1, "drive": "pump 1", "action": "stop", "command": "ramp stop",
               "caller": "operator", "origin": "page 10.0.0.7", "outcome": "confirmed", "open": false, "took_ms": 420}),
    );
    monitor.press(KeyCode::Char('3'));
    let screen = monitor.screen(100, 24);
    assert!(screen.contains("ALARM pump 1: tripped: fault 9 OLF"), "{screen}");
    let told = "pump 1: ramp stop by operator, page 10.0.0.7: confirmed: after 420 ms";
    assert!(screen.contains(told), "{screen}");
    assert!(screen.contains("everything: 2"), "one command is told once: {screen}");
    monitor.press(KeyCode::Char('f'));
    let screen = monitor.screen(100, 24);
    assert!(screen.contains(told) && !screen.contains("OLF"), "{screen}");
}

#[test]
fn what_the_history_has_kept_from_before_the_daemon_began_is_there_on_opening_and_once() {
    let began = 1_700_000_000_000_u64;
    let event = |at: u64, text: &str| {
        json!({"kind": "event", "time_unix_ms": at, "drive": "pump 1", "event": "tripped", "alarm": true, "order": 1,
               "cause": {"by": "drive"},
               "fault": {"by_watchdog": false, "time_unix_ms": at, "at_trip": {"state": "fault", "raw": []}}, "text": text})
    };
    let record = |number: i64, kind: &str, body: &Value| {
        let record = json!({"number": number, "run": 1, "time_unix_ms": body["time_unix_ms"], "steady_ms": 0, "kind": kind,
                            "what": "tripped", "drive": "pump 1", "alarm": true, "text": "x", "body": body});
        let record: plant::past::RecordView = serde_json::from_str(&record.to_string()).unwrap();
        Happening::kept(&record)
    };
    let (first, last) =
        (event(began - 60_000, "tripped: fault 9 OCF"), event(began, "tripped: fault 16 OHF"));
    let own = record(2, "history", &json!({ "time_unix_ms": began - 50_000 }));
    assert_eq!(own, None, "what the history tells of itself is none of it");
    let kept: Vec<Happening> =
        [record(1, "event", &first), own, record(3, "event", &last)].into_iter().flatten().collect();
    let mut recent = last.clone();
    recent["revision"] = 3.into();
    let _clock = standing_clock();
    let now = Instant::now();
    let mut model = Model::new("a test".to_owned(), now);
    // The connection breaks, and comes back.
    for _ in 0..2 {
        let News::State { state, recent, .. } = told(state(&[drive("pump 1")]), json!([recent])) else {
            panic!("it tells a state");
        };
        model.take(News::State { state, recent, kept: kept.clone() }, now);
    }
    let mut monitor = Monitor { model, now, _clock };
    monitor.press(KeyCode::Char('3'));
    let screen = monitor.screen(100, 24);
    assert!(screen.contains("ALARM pump 1: tripped: fault 9 OCF"), "{screen}");
    assert!(screen.contains("ALARM pump 1: tripped: fault 16 OHF"), "{screen}");
    assert!(screen.contains("everything: 2"), "each once: {screen}");
}

#[test]
fn two_hundred_drives_are_scrolled_searched_and_grouped() {
    let mut drives: Vec<Value> = (1..=199).map(|number| drive(&format!("pump {number}"))).collect();
    drives.push(drive("fan 1"));
    let mut monitor = Monitor::of(&drives);
    let screen = monitor.screen(80, 24);
    assert!(
        screen.contains("200 drives") && screen.contains("pump 20 ") && !screen.contains("pump 150"),
        "{screen}"
    );
    monitor.press(KeyCode::Down);
    monitor.press(KeyCode::End);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("▸ fan 1") && screen.contains("pump 199"), "{screen}");
    monitor.press(KeyCode::PageUp);
    assert!(monitor.screen(80, 24).contains("▸ pump 18"));
    monitor.press(KeyCode::Char('g'));
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("group fans: 1 of 200") && !screen.contains("pump"), "{screen}");
    monitor.press(KeyCode::Esc);
    monitor.press(KeyCode::Char('/'));
    for letter in "PUMP 77".chars() {
        monitor.press(KeyCode::Char(letter));
    }
    monitor.press(KeyCode::Enter);
    let screen = monitor.screen(80, 24);
    assert!(screen.contains("\"PUMP 77\": 2 of 200") && screen.contains("▸ pump 77 "), "{screen}");
    assert!(screen.contains("pump 177"), "{screen}");
}

#[test]
fn what_begins_to_be_in_trouble_is_in_sight_until_somebody_marks_something_else() {
    let drives: Vec<Value> = (1..=100).map(|number| drive(&format!("pump {number}"))).collect();
    let mut monitor = Monitor::of(&drives);
    for number in [90, 80, 70] {
        monitor.tell("drive", tripped(&format!("pump {number}")));
        assert!(monitor.row(&format!("!pump {number}"), 80).contains("fault OLF"));
    }
    monitor.press(KeyCode::Down);
    assert!(monitor.screen(80, 24).contains("▸!pump 70"), "the first of those in trouble");
    monitor.press(KeyCode::Esc);
    assert!(!monitor.screen(80, 24).contains('▸'));
}

#[test]
fn a_screen_that_is_too_small_is_no_panic() {
    for key in [KeyCode::Null, KeyCode::Enter, KeyCode::Char('2'), KeyCode::Char('3'), KeyCode::Char('?')] {
        let mut monitor = Monitor::of(&[drive("pump 1"), lost("pump 2"), tripped("pump 3")]);
        monitor.press(key);
        monitor.control('s');
        for (width, height) in [(1, 1), (2, 3), (5, 2), (20, 5), (39, 8), (300, 3), (8, 60)] {
            monitor.screen(width, height);
        }
    }
}

/// The numbers of a text, with the points between their digits.
fn numbers(text: &str) -> Vec<String> {
    let split = text.split(|character: char| !character.is_ascii_digit() && character != '.');
    split.map(|number| number.trim_matches('.').to_owned()).filter(|number| !number.is_empty()).collect()
}

proptest! {
    #[test]
    fn no_window_cuts_a_number_of_a_row(
        width in 40_u16..=140,
        output in 0_u32..=100_000,
        setpoint in 0_u32..=100_000,
        current in 0_u32..=65_535,
        age in 0_u64..=10_000_000,
        is_live in any::<bool>(),
        number in 1_u32..=999,
        // In capitals, so that no name has "old" in it.
        name in "[A-Z]{1,24}",
    ) {
        let name = format!("{name} {number}");
        let (output, setpoint) = (f64::from(output) / 100.0, f64::from(setpoint) / 100.0);
        let current = f64::from(current) / 10.0;
        let quality = if is_live { "good" } else { "stale" };
        let mut monitor = Monitor::of(&[with(&name, &[
            ("/status/output_frequency_hz", json!(output)),
            ("/status/current_a", json!(current)),
            ("/setpoint/frequency_hz", json!(setpoint)),
            ("/status/quality", json!(quality)),
            ("/status/age_ms", json!(age)),
        ])]);
        let screen = monitor.screen(width, 24);
        let rows: Vec<&str> = screen.lines().collect();
        // Nothing is added, so that no zero is negative.
        let upper = |hertz: f64| ((hertz * 10.0 - 1e-6).ceil() / 10.0).max(0.0) + 0.0;
        let mut whole = numbers(&name);
        whole.extend([format!("{:.1}", upper(output)), format!("{:.1}", upper(setpoint)), format!("{current:.1}")]);
        whole.extend(numbers(&drived_words::output::age(Duration::from_millis(age))));
        let shown = numbers(rows[2]);
        for number in &shown {
            prop_assert!(whole.contains(number), "{number} is none of {whole:?}:\n{screen}");
        }
        // The name with its number, and the frequencies, are always there; and an old value is dated.
        prop_assert!(shown.starts_with(&whole[..1]), "{screen}");
        prop_assert!(shown.contains(&whole[1]) && shown.contains(&whole[2]), "{screen}");
        prop_assert_eq!(rows[2].contains("old"), !is_live, "{}", screen);
        prop_assert_eq!(rows[2].contains('('), !is_live, "{}", screen);
    }

    #[test]
    fn no_window_cuts_a_number_of_the_account_of_a_stop(width in 40_u16..=140, counts in [0_u64..=200, 0..=200, 0..=200]) {
        let mut monitor = Monitor::of(&[drive("pump 1")]);
        monitor.control('s');
        let [confirmed, pending, silent] = counts;
        let answer = json!({"id": "c-1", "outcome": "pending", "drives": [{"drive": "pump 17", "outcome": "pending"}],
                            "confirmed": confirmed, "pending": pending, "not_reachable": silent});
        monitor.model.take(News::Stop { number: 1, progress: Progress::Answer(command(answer)) }, monitor.now);
        let text = monitor.screen(width, 24).split_whitespace().collect::<Vec<_>>().join(" ");
        let whole = format!("{confirmed} confirmed, {pending} pending, {silent} not reachable");
        prop_assert!(text.contains(&whole), "{text}");
        prop_assert!(text.contains("no emergency stop"), "{text}");
    }
}
