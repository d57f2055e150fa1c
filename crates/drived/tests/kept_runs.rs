//! The daemon is killed while a motor runs by its command, and started again: whose run it is then. Over a pty, in real time;
//! nothing here asserts a duration.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::PathBuf,
    time::Duration,
};

use support::{File, Running, Sim, path, run};

/// One drive whose watchdog is patient, and the program over it again and again.
struct Plant {
    sim: Sim,
    file: File,
    state: PathBuf,
    socket: String,
}

impl Plant {
    fn new(name: &str) -> Self {
        Self::of(name, &[("atv312@1", "pump")])
    }

    /// With these drives, each with its name.
    fn of(name: &str, drives: &[(&str, &str)]) -> Self {
        let sim = Sim::serve(name, &drives.iter().map(|(drive, _)| *drive).collect::<Vec<_>>());
        let state = path(&format!("{name}-state"));
        let drives: String = drives.iter().map(|(drive, name)| table(drive, name)).collect();
        let text = format!(
            "state = \"{}\"\n[http]\nlisten = \"off\"\n[lines.bench]\nport = \"{},19200,8E1\"\n{drives}",
            state.display(),
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock")).to_str().expect("the path is text").to_owned();
        Self { sim, file, state, socket }
    }

    fn daemon(&self) -> Running {
        Running::start(&["run", "--config", self.file.path(), "--socket", &self.socket])
    }

    /// The motor runs forward by the command of a daemon, and that is killed.
    fn run_and_kill(&self) {
        let mut daemon = self.daemon();
        daemon.wait_for(r#""event":"identified""#);
        run(&["start", "pump", "--setpoint", "20Hz", "--socket", &self.socket]).assert_done();
        assert!(self.record().exists(), "it is kept before the run command is given");
        daemon.signal("-KILL");
        assert_eq!(daemon.end().0, None);
    }

    fn record(&self) -> PathBuf {
        self.state.join("runs.json")
    }

    fn kept(&self) -> String {
        fs::read_to_string(self.record()).expect("it is there")
    }

    /// What the daemon that runs shows of it.
    fn daemon_shows(&self) -> String {
        run(&["status", "pump", "--socket", &self.socket]).out
    }

    /// What the drive shows to somebody who only asks.
    fn shown(&self) -> String {
        self.sim.on("atv312@1", &["status"]).out
    }
}

/// The table of a drive in the file.
fn table(drive: &str, name: &str) -> String {
    format!("[[drives]]\nline = \"bench\"\ndrive = \"{drive}\"\nname = \"{name}\"\ncontrol = true\n")
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.state);
    }
}

#[test]
fn a_run_of_a_killed_daemon_is_ours_again_after_its_restart_and_the_exit_stops_it() {
    let plant = Plant::new("kept-ours");
    plant.run_and_kill();
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"run_adopted""#);
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    assert!(last.contains(r#""action":"stopped""#), "{last}");
    let shown = plant.shown();
    assert!(shown.contains("0.00 Hz") && !shown.contains("running"), "{shown}");
    assert_eq!(plant.kept().trim(), "{}", "it was seen to stand no more");
}

#[test]
fn a_stop_that_was_not_confirmed_when_the_daemon_was_killed_is_given_anew_by_the_next_one() {
    let mut plant = Plant::new("kept-stop");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    run(&["start", "pump", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
    plant.sim.say("line cut", "done");
    let stopped = run(&["stop", "pump", "--socket", &plant.socket]);
    assert_ne!(stopped.code, Some(0), "{stopped:?}");
    let record = plant.kept();
    assert!(record.contains(r#""stop": "ramp""#), "{record}");
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    plant.sim.say("line join", "done");
    let mut daemon = plant.daemon();
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("stop_of_before"), "{confirmed}");
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    assert!(!plant.shown().contains("running"), "{}", plant.shown());
    assert_eq!(plant.kept().trim(), "{}", "it was seen to stand no more");
}

/// Two drives, of which the first, `north`, has a stop that was not confirmed when the daemon was killed; somebody else runs the second since.
fn with_a_stop_pending(name: &str) -> Plant {
    let mut plant = Plant::of(name, &[("atv312@1", "north"), ("atv312@2", "south")]);
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    daemon.wait_for(r#""event":"identified""#);
    run(&["start", "north", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
    plant.sim.say("line cut", "done");
    let stopped = run(&["stop", "north", "--socket", &plant.socket]);
    assert_ne!(stopped.code, Some(0), "{stopped:?}");
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    plant.sim.say("line join", "done");
    let started = plant.sim.on("atv312@2", &["start", "--setpoint", "15Hz"]);
    assert_eq!(started.code, Some(0), "{started:?}");
    plant
}

#[test]
fn a_stop_that_was_not_confirmed_is_given_to_its_machine_where_the_names_were_exchanged_since() {
    let plant = with_a_stop_pending("kept-exchanged");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    let exchanged =
        text.replace("\"north\"", "\"@\"").replace("\"south\"", "\"north\"").replace("\"@\"", "\"south\"");
    fs::write(plant.file.path(), exchanged).expect("it can be written");
    let mut daemon = plant.daemon();
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("\"south\"") && confirmed.contains("stop_of_before"), "{confirmed}");
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(1), "the other turns on, which is an alarm: {last}");
    let [one, other] = ["atv312@1", "atv312@2"].map(|drive| plant.sim.on(drive, &["status"]).out);
    assert!(!one.contains("running"), "{one}");
    assert!(other.contains("running"), "{other}");
    assert_eq!(plant.kept().trim(), "{}", "it was seen to stand");
}

#[test]
fn a_stop_that_was_not_confirmed_of_a_drive_that_is_in_the_file_no_more_is_given_once_it_is_there_again() {
    let plant = with_a_stop_pending("kept-taken-out");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    fs::write(plant.file.path(), text.replace(&table("atv312@1", "north"), "")).expect("it can be written");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    daemon.wait_for_log("nobody gives it: THE MOTOR MAY TURN");
    assert!(plant.kept().contains(r#""stop": "ramp""#), "{}", plant.kept());
    fs::write(plant.file.path(), text.replace("\"north\"", "\"east\"")).expect("it can be written");
    daemon.signal("-HUP");
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("\"east\"") && confirmed.contains("stop_of_before"), "{confirmed}");
    daemon.interrupt();
    let [one, other] = ["atv312@1", "atv312@2"].map(|drive| plant.sim.on(drive, &["status"]).out);
    assert!(!one.contains("running"), "{one}");
    assert!(other.contains("running"), "{other}");
}

#[test]
fn a_stop_by_direct_current_whose_daemon_was_killed_is_ended_by_the_next_one() {
    let plant = Plant::new("kept-injection");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    run(&["start", "pump", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
    let _stop = Running::start(&["stop", "pump", "--injection", "10", "--socket", &plant.socket]);
    daemon.wait_for(r#""to":"stopping""#);
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    // Bit 13 of CMD is a level on which the drive injects (BBV51701 p. 8): nothing of its own ends that.
    assert!(plant.shown().contains("stopping"), "{}", plant.shown());
    let mut daemon = plant.daemon();
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("stop_of_before"), "{confirmed}");
    let shown = plant.daemon_shows();
    assert!(!shown.contains("stopping"), "no current flows any more: {shown}");
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    assert_eq!(plant.kept().trim(), "{}", "it was seen to end");
}

#[test]
fn a_stop_of_a_motor_that_was_not_started_here_is_given_anew_by_the_next_daemon_where_it_was_not_confirmed() {
    let mut plant = Plant::new("kept-stop-of-others");
    let started = plant.sim.on("atv312@1", &["start", "--setpoint", "20Hz"]);
    assert_eq!(started.code, Some(0), "{started:?}");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    plant.sim.say("line cut", "done");
    let stopped = run(&["stop", "pump", "--socket", &plant.socket]);
    assert_ne!(stopped.code, Some(0), "{stopped:?}");
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    plant.sim.say("line join", "done");
    assert!(plant.shown().contains("running"), "{}", plant.shown());
    let mut daemon = plant.daemon();
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("stop_of_before"), "{confirmed}");
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    assert!(!plant.shown().contains("running"), "{}", plant.shown());
    assert_eq!(plant.kept().trim(), "{}", "it was seen to stand");
}

#[test]
fn a_run_that_somebody_else_has_given_since_is_not_ours_and_the_exit_leaves_it_and_says_so() {
    let plant = Plant::new("kept-other");
    plant.run_and_kill();
    let turned = plant.sim.on("atv312@1", &["start", "--direction", "reverse"]);
    assert_eq!(turned.code, Some(0), "{turned:?}");
    let mut daemon = plant.daemon();
    let told = daemon.wait_for(r#""event":"run_not_adopted""#);
    assert!(told.contains("not ours"), "{told}");
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(1), "a motor that turns on is an alarm: {last}");
    assert!(last.contains(r#""action":"left_turning""#), "{last}");
    assert!(plant.shown().contains("running"), "{}", plant.shown());
}

#[test]
fn a_run_without_a_record_is_somebody_elses_and_the_exit_leaves_it_and_says_so() {
    let plant = Plant::new("kept-none");
    plant.run_and_kill();
    fs::remove_file(plant.record()).expect("it can be removed");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    daemon.wait_for(r#""snapshot""#);
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(1), "{last}");
    assert!(last.contains(r#""action":"left_turning""#), "{last}");
    assert!(plant.shown().contains("running"), "{}", plant.shown());
}

#[test]
fn a_reload_that_gives_a_turning_drive_and_its_line_another_name_leaves_its_run_ours() {
    let plant = Plant::new("kept-renamed");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    let left = format!("{text}on_exit = \"leave\"\n");
    fs::write(plant.file.path(), &left).expect("it can be written");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    run(&["start", "pump", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
    let renamed = text.replace("bench", "hall").replace("\"pump\"", "\"fan\"");
    fs::write(plant.file.path(), &renamed).expect("it can be written");
    daemon.signal("-HUP");
    let adopted = daemon.wait_for(r#""event":"run_adopted""#);
    assert!(adopted.contains("\"fan\""), "{adopted}");
    let record = plant.kept();
    assert!(record.contains("\"fan\""), "a kill would be outlived, too: {record}");
    let shown = run(&["status", "fan", "--socket", &plant.socket]);
    assert!(shown.out.contains("running"), "it was not touched: {}", shown.out);
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(!plant.shown().contains("running"), "our run is stopped at the exit: {rest}");
}

/// A client of a gateway, which has to be heard every three seconds.
struct Client(TcpStream);

impl Client {
    /// Gives the plant a gateway, and a daemon, and has the motor run forward by a client.
    fn of(plant: &Plant) -> (Running, Self) {
        // Free now, and hardly anybody's a moment later.
        let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port");
        let text = fs::read_to_string(plant.file.path()).expect("it is there");
        let text = format!(
            "{text}on_exit = \"leave\"\n[[gateways]]\nname = \"scada\"\nlisten = \"{free}\"\nline = \"bench\"\nwrites = \"operate\"\n\
             patience = \"20s\"\nclient_timeout = \"3s\"\non_client_silence = \"stop\"\n"
        );
        fs::write(plant.file.path(), &text).expect("it can be written");
        let mut daemon = plant.daemon();
        daemon.wait_for(r#""event":"identified""#);
        let stream = TcpStream::connect(free).expect("it listens");
        // So that a test that fails ends.
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out can be set");
        let mut client = Self(stream);
        // CMD and LFr: BBV51701 p. 19.
        for (register, word) in [(8_501, 6), (8_502, 200), (8_501, 15)] {
            client.write(register, word);
        }
        let shown = run(&["status", "pump", "--socket", &plant.socket]);
        assert!(shown.out.contains("running"), "{}", shown.out);
        (daemon, client)
    }

    fn write(&mut self, register: u16, word: u16) {
        let [register, word] = [register, word].map(u16::to_be_bytes);
        let request = [&[0x15, 1, 0, 0, 0, 6, 1, 6][..], &register, &word].concat();
        self.0.write_all(&request).expect("it is taken");
        let mut answer = [0; 12];
        self.0.read_exact(&mut answer[..9]).expect("it is answered");
        assert_eq!(answer[..8], request[..8], "{answer:02X?}");
        self.0.read_exact(&mut answer[9..]).expect("it is answered");
    }
}

#[test]
fn a_motor_of_a_client_that_has_to_be_heard_is_stopped_after_a_kill_when_the_client_stays_away() {
    let plant = Plant::new("kept-client");
    let (mut daemon, _client) = Client::of(&plant);
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"run_adopted""#);
    daemon.wait_for(r#""event":"stop_confirmed""#);
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(!plant.shown().contains("running"), "and not by the exit, which leaves it: {}", plant.shown());
}

#[test]
fn a_motor_of_a_client_that_has_to_be_heard_is_stopped_when_line_drive_and_gateway_get_other_names() {
    for names in [
        &[("\"pump\"", "\"fan\"")][..],
        &[("\"scada\"", "\"desk\"")],
        &[("bench", "hall"), ("\"pump\"", "\"fan\""), ("\"scada\"", "\"desk\"")],
    ] {
        let plant = Plant::new("kept-client-renamed");
        let (mut daemon, _client) = Client::of(&plant);
        let text = fs::read_to_string(plant.file.path()).expect("it is there");
        let renamed = names.iter().fold(text, |text, (old, new)| text.replace(old, new));
        fs::write(plant.file.path(), &renamed).expect("it can be written");
        daemon.signal("-HUP");
        daemon.wait_for(r#""event":"stop_confirmed""#);
        let (code, rest) = daemon.interrupt();
        assert_eq!(code, Some(0), "{rest}");
        assert!(!plant.shown().contains("running"), "{names:?}: {}", plant.shown());
    }
}

#[test]
fn what_a_run_leaves_in_its_state_folder_is_what_the_manual_lists() {
    let plant = Plant::new("kept-files");
    run(&["token", "add", "scada", "--role", "view", "--config", plant.file.path()]).assert_done();
    let (mut daemon, _client) = Client::of(&plant);
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    let folder = fs::read_dir(&plant.state).expect("it is there");
    let left: Vec<String> = folder
        .map(|entry| entry.expect("it can be read").file_name().into_string().expect("it is text"))
        .collect();
    let manual = include_str!("../docs/configuration.md");
    let row = manual.lines().find_map(|line| line.strip_prefix("| `state` | ")).expect("it is documented");
    let (list, _) = row.split_once(';').expect("the list ends");
    let listed: Vec<&str> = list.split('`').skip(1).step_by(2).collect();
    // Some have more beside them, by their own name: the log of SQLite, the audit log before this one.
    let is_listed = |name: &String| listed.iter().any(|listed| name.starts_with(listed));
    let unlisted: Vec<_> = left.iter().filter(|name| !is_listed(name)).collect();
    assert!(unlisted.is_empty(), "{unlisted:?} of {left:?}, {listed:?}");
    // What this run keeps in any case; the rest are of faces and commands that it has not.
    for kept in [
        "ballast",
        "tokens",
        "audit",
        "runs.json",
        "watched.json",
        "names.json",
        "alarms.json",
        "history.sqlite",
    ] {
        assert!(left.iter().any(|name| name == kept), "{kept}: {left:?}");
    }
}

#[test]
fn an_empty_configuration_behind_a_kill_is_an_alarm_of_the_motor_that_runs_and_without_a_page_nothing_begins()
{
    let plant = Plant::new("kept-emptied");
    plant.run_and_kill();
    // Nothing could bring it a drive.
    let head = format!("state = \"{}\"\n[http]\nlisten = ", plant.state.display());
    fs::write(plant.file.path(), format!("{head}\"off\"\n")).expect("it can be written");
    for command in [&["run", "--socket", &plant.socket][..], &["check"]] {
        let refused = run(&[command, &["--config", plant.file.path()]].concat());
        refused.assert_refused(2, "no drive: expected [[drives]]");
    }
    fs::write(plant.file.path(), format!("{head}\"127.0.0.1:0\"\n")).expect("it can be written");
    let checked = run(&["check", "--config", plant.file.path()]);
    assert!(checked.assert_done().contains("has no drive: drived begins with it"), "{checked:?}");
    let mut daemon = plant.daemon();
    daemon.wait_for_log("no drive yet");
    let alarm = loop {
        let told = run(&["alarms", "list", "--json", "--socket", &plant.socket]);
        let told: serde_json::Value = serde_json::from_str(&told.out).unwrap_or_default();
        match told["alarms"].as_array().and_then(|all| all.first().cloned()) {
            Some(alarm) => break alarm,
            None => assert!(!daemon.has_ended()),
        }
    };
    assert_eq!(alarm["kind"], "run_left", "{alarm}");
    assert!(alarm["text"].as_str().is_some_and(|text| text.contains("pump (")), "{alarm}");
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
}

#[test]
fn a_stop_whose_drive_is_not_in_the_configuration_any_more_is_an_alarm_until_it_is_there_again() {
    let plant = with_a_stop_pending("kept-left");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    let without = text.replace(&table("atv312@1", "north"), "");
    assert_ne!(without, text);
    fs::write(plant.file.path(), &without).expect("it can be written");
    let alarms = || -> serde_json::Value {
        let told = run(&["alarms", "list", "--json", "--socket", &plant.socket]);
        let told: serde_json::Value = serde_json::from_str(told.assert_done()).expect("it is JSON");
        told["alarms"].clone()
    };
    // Of the program and of nothing else: the other motor is somebody else's.
    let left =
        || alarms().as_array().and_then(|all| all.iter().find(|alarm| alarm["kind"] == "stop_left").cloned());
    let mut ids = Vec::new();
    for _ in 0..2 {
        let mut daemon = plant.daemon();
        daemon.wait_for(r#""event":"identified""#);
        let alarm = loop {
            match left() {
                Some(alarm) => break alarm,
                None => assert!(!daemon.has_ended()),
            }
        };
        assert_eq!(alarm["state"], "unacknowledged", "{alarm}");
        assert!(alarm["text"].as_str().is_some_and(|text| text.contains("north (")), "{alarm}");
        ids.push((alarm["id"].clone(), alarm["count"].clone()));
        let (code, rest) = daemon.interrupt();
        assert_eq!(code, Some(1), "the other motor turns on: {rest}");
    }
    assert_eq!(ids[0], ids[1], "it is the same behind a restart");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    run(&["alarms", "acknowledge", "--all", "--socket", &plant.socket]).assert_done();
    assert_eq!(left().map(|alarm| alarm["state"].clone()), Some("acknowledged".into()));
    fs::write(plant.file.path(), &text).expect("it can be written");
    daemon.signal("-HUP");
    let confirmed = daemon.wait_for(r#""event":"stop_confirmed""#);
    assert!(confirmed.contains("\"north\""), "{confirmed}");
    while left().is_some() {
        assert!(!daemon.has_ended());
    }
    let _ = daemon.interrupt();
}

/// Who is in the place of one that is gone is that one by another name, to whoever counts hours and starts as to everybody else.
#[test]
fn a_motor_that_is_called_otherwise_while_no_daemon_runs_keeps_its_starts() {
    let plant = Plant::new("kept-called");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"identified""#);
    run(&["start", "pump", "--setpoint", "20Hz", "--socket", &plant.socket]).assert_done();
    assert_eq!(daemon.interrupt().0, Some(0));
    let due = "[history]\nmaintenance = [{ drive = \"mill\", part = \"belt\", starts = 1 }]\n";
    let renamed =
        text.replace("[lines.bench]", &format!("{due}[lines.bench]")).replace("\"pump\"", "\"mill\"");
    fs::write(plant.file.path(), renamed).expect("it can be written");
    let mut daemon = plant.daemon();
    let alarms = || run(&["alarms", "list", "--json", "--socket", &plant.socket]).out;
    while !alarms().contains("maintenance is due: belt, after 1 starts") {
        assert!(!daemon.has_ended());
    }
    assert_eq!(daemon.interrupt().0, Some(0));
    let history = plant.state.join("history.sqlite");
    let told = run(&["history", "mill", "--for", "1h", "--file", history.to_str().expect("it is text")]);
    assert_eq!(told.out.matches("renamed: it was called pump").count(), 1, "{told:?}");
}

/// The same name at another port: a path that is another now has the same drive, and another machine may have the name.
#[test]
fn a_run_whose_name_is_at_another_machine_now_is_an_alarm_of_the_first_one_until_somebody_has_seen_to_it() {
    let plant = Plant::new("kept-elsewhere");
    let text = fs::read_to_string(plant.file.path()).expect("it is there");
    let at = |link: &str| {
        let port = |link: &str| format!("port = \"{link},");
        let moved = text.replace(&port(plant.sim.link()), &port(link));
        fs::write(plant.file.path(), moved).expect("it can be written");
    };
    let old_place = format!("pump ({}", plant.sim.link());
    plant.run_and_kill();
    // It is the same machine by another path, which it says itself: nothing is left of it.
    let path = path("kept-elsewhere-path");
    let _ = fs::remove_file(&path);
    std::os::unix::fs::symlink(plant.sim.link(), &path).expect("it can be linked");
    at(path.to_str().expect("it is text"));
    let mut daemon = plant.daemon();
    daemon.wait_for(r#""event":"run_adopted""#);
    while plant.kept().contains(&format!("\"{} ", plant.sim.link())) {
        assert!(!daemon.has_ended());
    }
    daemon.signal("-KILL");
    assert_eq!(daemon.end().0, None);
    // It is another one: that it does not run by us says nothing of the first.
    let other = Sim::serve("kept-elsewhere-other", &["atv312@1"]);
    at(other.link());
    let mut daemon = plant.daemon();
    let old_place = old_place.replace(plant.sim.link(), path.to_str().expect("it is text"));
    let left = || {
        let told = run(&["alarms", "list", "--json", "--socket", &plant.socket]);
        let told: serde_json::Value = serde_json::from_str(&told.out).unwrap_or_default();
        let all = told["alarms"].as_array()?.clone();
        all.into_iter().find(|alarm| alarm["kind"] == "run_left" && alarm["state"] == "unacknowledged")
    };
    let alarm = loop {
        match left() {
            Some(alarm) => break alarm,
            None => assert!(!daemon.has_ended()),
        }
    };
    assert!(alarm["text"].as_str().is_some_and(|text| text.contains(&old_place)), "{alarm}");
    daemon.wait_for(r#""event":"identified""#);
    let number = alarm["id"].to_string();
    run(&["alarms", "done", &number, "--note", "it stands", "--socket", &plant.socket]).assert_done();
    while left().is_some() || plant.kept().trim() != "{}" {
        assert!(!daemon.has_ended());
    }
    assert_eq!(daemon.interrupt().0, Some(0));
    let _ = fs::remove_file(&path);
}
