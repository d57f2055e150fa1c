//! Alarms of a daemon that is killed and started again, by the command line. Over a pty, in real time; nothing here asserts a duration.
#![cfg(unix)]

mod support;

use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

use serde_json::Value;
use support::{File, Running, Sim, look_again, path, run};

/// How long something may take to come true.
const PATIENCE: Duration = Duration::from_secs(30);
/// Hours and starts are counted once in a minute.
const COUNTED: Duration = Duration::from_secs(120);

struct Plant {
    sim: Sim,
    file: File,
    state: PathBuf,
    socket: String,
}

impl Plant {
    fn new(name: &str) -> Self {
        Self::with(name, "")
    }

    /// With more in its file.
    fn with(name: &str, more: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1"]);
        let state = path(&format!("{name}-state"));
        let text = format!(
            "state = \"{}\"\n[http]\nlisten = \"off\"\n{more}[lines.bench]\nport = \"{},19200,8E1\"\n[[drives]]\n\
             line = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump\"\ncontrol = true\n",
            state.display(),
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock")).to_str().expect("the path is text").to_owned();
        Self { sim, file, state, socket }
    }

    fn daemon(&self) -> Running {
        let mut daemon = Running::start(&["run", "--config", self.file.path(), "--socket", &self.socket]);
        daemon.wait_for(r#""event":"identified""#);
        daemon
    }

    fn alarms(&self, arguments: &[&str]) -> Value {
        let mut all = vec!["alarms"];
        all.extend(arguments);
        all.extend(["--json", "--socket", &self.socket]);
        let told = run(&all);
        serde_json::from_str(told.assert_done()).expect("it is JSON")
    }

    /// The only alarm, once it is so.
    fn alarm_that(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        self.alarm_within(PATIENCE, what, is_so)
    }

    fn alarm_within(&self, patience: Duration, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let until = Instant::now() + patience;
        loop {
            let told = self.alarms(&["list"]);
            let alarms = told["alarms"].as_array().expect("a list");
            assert!(alarms.len() < 2, "{told}");
            if let Some(alarm) = alarms.first().filter(|alarm| is_so(alarm)) {
                return alarm.clone();
            }
            assert!(Instant::now() < until, "{what}: {told}");
            look_again();
        }
    }

    fn wait_until_kept(&self, text: &str) {
        let until = Instant::now() + PATIENCE;
        let file = self.state.join("alarms.json");
        while !fs::read_to_string(&file).is_ok_and(|kept| kept.contains(text)) {
            assert!(Instant::now() < until, "{text} is not kept");
            look_again();
        }
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.state);
    }
}

#[test]
fn a_standing_trip_is_one_alarm_with_its_note_after_the_daemon_was_killed_and_started_again() {
    let mut plant = Plant::new("alarms-killed");
    let mut daemon = plant.daemon();
    plant.sim.say("atv312@1 trip OCF", "done");
    let alarm = plant.alarm_that("it has tripped", |alarm| {
        alarm["text"].as_str().is_some_and(|text| text.contains("OCF"))
    });
    assert_eq!((&alarm["state"], &alarm["count"]), (&"unacknowledged".into(), &1.into()));
    let done = plant.alarms(&["acknowledge", "--all", "--note", "the mechanic comes"]);
    assert_eq!(done["alarms"][0]["state"], "acknowledged", "{done}");
    plant.wait_until_kept("the mechanic comes");
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    let daemon = plant.daemon();
    let after = plant.alarm_that("it is there", |_| true);
    for same in ["id", "count", "state", "first_unix_ms", "acknowledged"] {
        assert_eq!(after[same], done["alarms"][0][same], "{same}");
    }
    // It is over with the trip.
    run(&["reset", "pump", "--socket", &plant.socket]).assert_done();
    let until = Instant::now() + PATIENCE;
    while plant.alarms(&["list"])["alarms"] != Value::Array(Vec::new()) {
        assert!(Instant::now() < until, "it is not over");
    }
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
}

#[test]
fn maintenance_is_an_alarm_after_so_many_starts_until_somebody_says_that_it_was_done() {
    let plant = Plant::with(
        "alarms-maintenance",
        "[history]\nmaintenance = [{ drive = \"pump\", part = \"contactor\", starts = 2 }]\n",
    );
    let daemon = plant.daemon();
    for _ in 0..2 {
        assert_eq!(plant.alarms(&["list"])["alarms"], Value::Array(Vec::new()));
        run(&["start", "pump", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
        run(&["stop", "pump", "--socket", &plant.socket]).assert_done();
    }
    let due = plant.alarm_within(COUNTED, "it is due", |alarm| alarm["kind"] == "maintenance");
    assert_eq!((&due["drive"], &due["state"]), (&"pump".into(), &"unacknowledged".into()), "{due}");
    assert_eq!(due["text"], "maintenance is due: contactor, after 2 starts", "{due}");
    let number = due["id"].to_string();
    let done = plant.alarms(&["done", &number, "--note", "both contacts filed"]);
    assert_eq!(done["acknowledged"]["note"], "both contacts filed", "{done}");
    let until = Instant::now() + COUNTED;
    while plant.alarms(&["list"])["alarms"] != Value::Array(Vec::new()) {
        assert!(Instant::now() < until, "it is not over");
    }
    let told = run(&["history", "pump", "--config", plant.file.path()]);
    assert!(told.assert_done().contains("maintenance done by"), "{}", told.out);
    run(&["alarms", "done", &number, "--socket", &plant.socket]).assert_refused(2, "there is no alarm");
    daemon.interrupt();
}

#[test]
fn a_file_of_alarms_that_is_damaged_is_told_and_put_aside() {
    let mut plant = Plant::new("alarms-damaged");
    fs::create_dir_all(&plant.state).expect("it can be made");
    fs::write(plant.state.join("alarms.json"), "{\"schema\":1,\"al").expect("it can be written");
    let mut daemon = plant.daemon();
    daemon.wait_for_log("nobody knows which alarms were acknowledged");
    assert!(plant.state.join("alarms.json.damaged").exists());
    plant.sim.say("atv312@1 trip OCF", "done");
    plant.alarm_that("alarms come anew", |alarm| alarm["kind"] == "tripped");
    daemon.interrupt();
}

#[test]
fn an_alarm_is_shelved_with_a_reason_and_an_unknown_one_is_bad_input() {
    let mut plant = Plant::new("alarms-shelved");
    let daemon = plant.daemon();
    plant.sim.say("atv312@1 trip OCF", "done");
    let number = plant.alarm_that("it has tripped", |_| true)["id"].to_string();
    let shelved = plant.alarms(&["shelve", &number, "--for", "60", "--why", "is being repaired"]);
    assert_eq!(shelved["state"], "shelved", "{shelved}");
    let listed = run(&["alarms", "list", "--socket", &plant.socket]);
    assert!(listed.assert_done().contains("is being repaired"), "{}", listed.out);
    assert_eq!(plant.alarms(&["unshelve", &number])["state"], "unacknowledged");
    let nobody = run(&["alarms", "acknowledge", "7", "--socket", &plant.socket]);
    nobody.assert_refused(2, "there is no alarm 7");
    daemon.interrupt();
}
