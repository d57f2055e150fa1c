//! The subcommands without a line: they go to the running daemon.
#![cfg(unix)]

mod support;

use std::{os::unix::fs::PermissionsExt as _, path::PathBuf};

use support::{Ended, File, Running, Sim, path, run};

/// A daemon over simulated drives, and its control socket.
struct Daemon {
    running: Option<Running>,
    sim: Sim,
    socket: PathBuf,
    file: File,
}

const WATCHED: &str = "control = true\nwatchdog = { time = \"10s\", reaction = \"ramp\" }";

impl Daemon {
    /// `pump 1` and `pump 2`, the group `pumps`, and what else the configuration says.
    fn start(name: &str, more: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2"]);
        let text = format!(
            "{more}\n[http]\nlisten = \"off\"\n[defaults]\n{WATCHED}\n[groups]\npumps = [\"pump 1\", \"pump 2\"]\n\
             [lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock"));
        let arguments =
            ["run", "--config", file.path(), "--socket", socket.to_str().expect("the path is text")];
        let mut running = Running::start(&arguments);
        for _ in 0..2 {
            running.wait_for(r#""event":"watchdog_verified""#);
        }
        Self { running: Some(running), sim, socket, file }
    }

    fn socket(&self) -> &str {
        self.socket.to_str().expect("the path is text")
    }

    /// Runs a subcommand that goes to it.
    fn ask(&self, subcommand: &[&str]) -> Ended {
        run(&[subcommand, &["--socket", self.socket()]].concat())
    }

    /// Ends it as Ctrl-C does.
    fn end(&mut self) -> (Option<i32>, String) {
        self.running.take().expect("it runs").interrupt()
    }
}

fn json(ended: &Ended) -> serde_json::Value {
    serde_json::from_str(&ended.out).unwrap_or_else(|error| panic!("{error}: {ended:?}"))
}

#[test]
fn every_verb_goes_to_the_running_daemon_by_the_names_of_its_drives() {
    let daemon = Daemon::start("verbs", "");
    let status = daemon.ask(&["status"]);
    let out = status.assert_done();
    assert!(out.starts_with("drive ") && out.contains("pump 1") && out.contains("pump 2"), "{out}");
    assert!(out.lines().all(|line| line.chars().count() <= 80), "{out}");

    let held = daemon.ask(&["setpoint", "pump 1", "30Hz"]);
    assert!(
        held.assert_done().starts_with("pump 1 holds the setpoint 30.00 Hz: the drive shows"),
        "{held:?}"
    );
    let started = daemon.ask(&["start", "pump 1", "--direction", "reverse"]);
    assert!(
        started
            .assert_done()
            .contains("pump 1 started reverse at 30.00 Hz: the drive shows running, reverse"),
        "{started:?}"
    );
    let one = daemon.ask(&["status", "pump 1", "--all"]);
    let out = one.assert_done();
    assert!(out.contains("atv312@1 on line bench") && out.contains("running rev"), "{out}");
    let stopped = daemon.ask(&["stop", "pump 1", "--mode", "freewheel"]);
    let coasts = "pump 1 has no output, the shaft may coast: the drive shows";
    assert!(stopped.assert_done().contains(coasts), "{stopped:?}");
    let shown = daemon.ask(&["status", "pump 1"]);
    assert!(shown.assert_done().contains("output off, the shaft may coast"), "{shown:?}");

    let started = daemon.ask(&["start", "pumps", "--setpoint", "20Hz"]);
    let out = started.assert_done();
    assert!(out.contains("pump 1 started forward") && out.contains("pump 2 started forward"), "{out}");
    let stopped = daemon.ask(&["stop", "--all"]);
    let out = stopped.assert_done();
    assert!(out.contains("pump 1 stands still") && out.contains("pump 2 stands still"), "{out}");

    let reset = daemon.ask(&["reset", "pump 2"]);
    assert!(matches!(reset.code, Some(0 | 1)), "{reset:?}");
    let released = daemon.ask(&["release", "pumps"]);
    assert!(matches!(released.code, Some(0 | 1)), "{released:?}");
}

#[test]
fn a_stop_that_takes_its_time_is_waited_for_without_a_word_of_a_daemon_that_is_silent() {
    let mut daemon = Daemon::start("slow-ramp", "");
    // 30 s from 50 Hz.
    daemon.sim.say("atv312@1 set dEC 300", "done");
    daemon.ask(&["start", "pump 1", "--setpoint", "20Hz"]).assert_done();
    while !daemon.sim.say("atv312@1 show", "output").contains("output 20.00 Hz") {}
    let stopped = daemon.ask(&["stop", "pump 1"]);
    let out = stopped.assert_done();
    assert!(
        out.contains("has not confirmed it yet: it goes on") && !out.contains("does not answer"),
        "{out}"
    );
    assert!(out.contains("pump 1 stands still"), "{out}");
}

/// A disk that is full, and a reader who has gone: what is confirmed is no alarm for that.
#[cfg(target_os = "linux")]
#[test]
fn a_stop_by_a_daemon_that_is_read_by_nobody_is_the_drives_own_end() {
    let daemon = Daemon::start("unread", "");
    for gone in [false, true] {
        daemon.ask(&["start", "pump 1", "--setpoint", "20Hz"]).assert_done();
        let unread = || -> std::process::Stdio {
            if gone {
                let (_, writer) = std::io::pipe().expect("there is one");
                return writer.into();
            }
            full_disk().into()
        };
        let mut stop = support::drived(&["stop", "pump 1", "--socket", daemon.socket()]);
        let ended = stop.stdout(unread()).output().expect("the program starts");
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(0), "{said}");
        assert_eq!(
            (said.contains("STOP NOT CONFIRMED"), said.contains("cannot be written")),
            (false, !gone),
            "{said}"
        );
    }
}

/// What is only asked for is not known then to whoever asked; what is done is done.
#[cfg(target_os = "linux")]
#[test]
fn what_the_daemon_has_done_is_no_failure_for_an_output_that_cannot_be_written() {
    let daemon = Daemon::start("full-output", "");
    for (asked, code) in [
        (&["reload"][..], 0),
        (&["reload", "--dry-run"], 1),
        (&["alarms", "acknowledge", "--all"], 0),
        (&["alarms", "list"], 1),
    ] {
        let asked = [asked, &["--socket", daemon.socket()]].concat();
        let ended = support::drived(&asked).stdout(full_disk()).output().expect("the program starts");
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(code), "{asked:?}: {said}");
        assert!(said.contains("the output cannot be written"), "{asked:?}: {said}");
    }
}

#[cfg(target_os = "linux")]
fn full_disk() -> std::fs::File {
    std::fs::OpenOptions::new().write(true).open("/dev/full").expect("it is there")
}

#[test]
fn a_stop_by_injection_goes_through_the_daemon_with_its_seconds() {
    let daemon = Daemon::start("injection", "");
    daemon.ask(&["start", "pump 1", "--setpoint", "30Hz"]).assert_done();
    let stopped = daemon.ask(&["stop", "pump 1", "--injection", "2"]);
    assert!(stopped.assert_done().contains("DC injection stop held for 2s"), "{stopped:?}");
    daemon.ask(&["start", "pump 1", "--setpoint", "30Hz"]).assert_done();
    let stopped = json(&daemon.ask(&["stop", "pump 1", "--injection", "3", "--json"]));
    let modes = serde_json::json!({"asked": "dc_injection", "used": "dc_injection", "injection_asked_ms": 3_000, "injection_used_ms": 3_000});
    assert_eq!((&stopped["outcome"], &stopped["stop"]), (&"confirmed".into(), &modes), "{stopped}");
    daemon.ask(&["stop", "pump 1", "--injection", "31"]).assert_refused(2, "30");
}

#[test]
fn an_answer_for_programs_is_the_object_of_the_api() {
    let daemon = Daemon::start("json", "");
    let state = json(&daemon.ask(&["status", "--json"]));
    assert_eq!(state["drives"].as_array().map(Vec::len), Some(2), "{state}");
    assert_eq!(state["daemon"]["caller"], "local");
    assert_eq!(json(&daemon.ask(&["status", "pump 2", "--json"]))["name"], "pump 2");
    let stop = json(&daemon.ask(&["stop", "pump 2", "--json"]));
    assert_eq!(
        (&stop["drive"], &stop["action"], &stop["outcome"]),
        (&"pump 2".into(), &"stop".into(), &"confirmed".into())
    );
    let all = json(&daemon.ask(&["stop", "--all", "--json"]));
    assert_eq!((&all["outcome"], &all["confirmed"]), (&"confirmed".into(), &2.into()), "{all}");
}

#[test]
fn a_name_that_is_not_there_is_answered_with_the_nearest_on_one_line() {
    let daemon = Daemon::start("names", "");
    for subcommand in
        [&["stop", "pmp 1"][..], &["start", "Pump1"], &["status", "pumpe 1"], &["setpoint", "pum 1", "20Hz"]]
    {
        daemon.ask(subcommand).assert_refused(2, "the nearest are pump 1");
    }
    daemon.ask(&["start"]).assert_refused(2, "say which drive");
    daemon.ask(&["setpoint", "20Hz"]).assert_refused(2, "say which drive");
    daemon.ask(&["setpoint", "pump 1", "fast"]).assert_refused(2, "expected a frequency");
    daemon.ask(&["start", "pump 1", "--setpoint", "400Hz"]).assert_refused(1, "pump 1: refused");
}

#[test]
fn a_drive_that_is_lost_is_shown_as_it_was_and_never_as_live() {
    let mut daemon = Daemon::start("lost", "");
    daemon.sim.say("atv312@2 power off", "done");
    daemon.running.as_mut().expect("it runs").wait_for(r#""event":"lost""#);
    let status = daemon.ask(&["status"]);
    assert_eq!(status.code, Some(1), "{status:?}");
    assert!(status.out.contains("pump 2  lost") && status.out.contains("(0.0)"), "{status:?}");
    assert!(status.err.contains("pump 2 does not answer"), "{status:?}");
    let one = daemon.ask(&["status", "pump 2"]);
    assert!(one.out.contains("NOT LIVE: what stands in brackets was so"), "{one:?}");
    assert_eq!(daemon.ask(&["status", "pump 1"]).code, Some(0));
}

#[test]
fn without_a_daemon_it_is_said_how_to_start_one_and_a_stop_is_an_alarm() {
    let nowhere = path("nowhere.sock");
    let nowhere = nowhere.to_str().expect("the path is text");
    for subcommand in [&["status"][..], &["start", "pump 1"], &["watch"], &["reload"]] {
        let ended = run(&[subcommand, &["--socket", nowhere]].concat());
        ended.assert_refused(2, "start one by drived run --config FILE, or go to a drive directly by --line");
    }
    run(&["stop", "pump 1", "--socket", nowhere]).assert_refused(1, "STOP NOT CONFIRMED, the motor may turn");
    run(&["stop", "--all", "--socket", nowhere]).assert_refused(1, "STOP NOT CONFIRMED, the motor may turn");
    let both = run(&["status", "pump 1", "--line", "/dev/nowhere", "--drive", "atv312@1"]);
    both.assert_refused(2, "cannot be used with");
}

#[test]
fn a_port_that_the_daemon_holds_is_told_with_its_name_and_what_to_type() {
    let mut daemon = Daemon::start("held", "");
    let arguments = ["status", "--line", daemon.sim.link(), "--drive", "atv312@2"];
    // No daemon is known: the system says who has it.
    run(&arguments).assert_refused(2, "is held by drived (process ");
    let folder = path("held-runtime");
    std::fs::create_dir_all(&folder).expect("the directory can be written");
    std::os::unix::fs::symlink(&daemon.socket, folder.join("drived.sock")).expect("a link can be made");
    let known =
        support::drived(&arguments).env("XDG_RUNTIME_DIR", &folder).output().expect("the program starts");
    std::fs::remove_dir_all(&folder).expect("it can be removed");
    let told = String::from_utf8_lossy(&known.stderr).into_owned();
    assert!(told.contains("is line bench of the running daemon (process "), "{told}");
    assert!(
        told.contains("leave out --line and --drive, and name the drive as it does, \"pump 2\""),
        "{told}"
    );
    assert_eq!(daemon.end().0, Some(0));
}

#[test]
fn two_callers_at_once_each_get_the_outcome_of_their_own_command() {
    let daemon = Daemon::start("two-callers", "");
    // What decides a start is read once, 18 blocks of each: both at once in the first second are too late for the line.
    for pump in ["pump 1", "pump 2"] {
        daemon.ask(&["start", pump, "--setpoint", "15Hz"]).assert_done();
        daemon.ask(&["stop", pump]).assert_done();
    }
    let (one, other) = std::thread::scope(|scope| {
        let one = scope.spawn(|| daemon.ask(&["start", "pump 1", "--setpoint", "20Hz", "--json"]));
        let other = scope.spawn(|| daemon.ask(&["start", "pump 2", "--setpoint", "25Hz", "--json"]));
        (one.join().expect("it ends"), other.join().expect("it ends"))
    });
    assert_eq!((&json(&one)["drive"], &json(&one)["outcome"]), (&"pump 1".into(), &"confirmed".into()));
    assert_eq!((&json(&other)["drive"], &json(&other)["outcome"]), (&"pump 2".into(), &"confirmed".into()));
    let stops: Vec<Ended> = std::thread::scope(|scope| {
        let stops: Vec<_> = (0..4).map(|_| scope.spawn(|| daemon.ask(&["stop", "--all"]))).collect();
        stops.into_iter().map(|stop| stop.join().expect("it ends")).collect()
    });
    for stop in stops {
        stop.assert_done();
    }
}

#[test]
fn what_happens_is_watched_as_it_happens() {
    let daemon = Daemon::start("watched", "");
    let mut watch = Running::start(&["watch", "--socket", daemon.socket()]);
    watch.wait_for("pump 1: ");
    daemon.ask(&["stop", "pump 1"]).assert_done();
    assert!(watch.wait_for("stop").contains("pump 1"));
    let mut objects = Running::start(&["watch", "--json", "--socket", daemon.socket()]);
    let object: serde_json::Value = serde_json::from_str(&objects.wait_for("kind")).expect("an object");
    assert!(object["data"].is_object(), "{object}");
}

#[test]
fn a_command_is_audited_with_its_caller_and_a_token_names_the_commander() {
    let folder = path("audited-files");
    std::fs::create_dir_all(&folder).expect("the directory can be written");
    let in_folder = |name: &str| folder.join(name).to_str().expect("the path is text").to_owned();
    let (tokens, audit) = (in_folder("tokens"), in_folder("audit"));
    let named = format!("tokens = \"{tokens}\"\naudit = \"{audit}\"");
    let config = File::new(
        "audited-tokens",
        &format!(
            "{named}\n[lines.a]\nport = \"/dev/nowhere\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n"
        ),
    );
    let with_config = |subcommand: &[&str]| run(&[subcommand, &["--config", config.path()]].concat());
    let added = with_config(&["token", "add", "panel", "--role", "operate"]);
    let secret = added.assert_done().trim().to_owned();
    assert!(secret.starts_with("drv_") && secret.len() == 68, "{secret}");
    with_config(&["token", "add", "panel", "--role", "view"])
        .assert_refused(2, "there is a token panel already");
    assert!(with_config(&["token", "list"]).assert_done().contains("panel  operate"));
    let mode = std::fs::metadata(&tokens).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);

    let mut daemon = Daemon::start("audited", &named);
    let token = in_folder("token");
    std::fs::write(&token, &secret).expect("the directory can be written");
    daemon.ask(&["stop", "pump 1"]).assert_done();
    daemon.ask(&["stop", "pump 2", "--token-file", &token]).assert_done();
    with_config(&["token", "remove", "panel"]).assert_done();
    daemon.ask(&["stop", "pump 2", "--token-file", &token]).assert_refused(1, "the token is wrong");
    daemon.end();

    let log = std::fs::read_to_string(&audit).expect("it is there");
    for told in [
        "\"caller\":\"local\"",
        "\"caller\":\"panel\"",
        "socket uid ",
        "token panel added",
        "token panel removed",
        "\"outcome\":\"confirmed\"",
        "\"kind\":\"outcome\"",
        "pump 2: exit",
    ] {
        assert!(log.contains(told), "{told}: {log}");
    }
    assert!(!log.contains(&secret[4..]), "no secret in a log");
    let refused = std::fs::read_to_string(in_folder("audit.refused")).expect("it is there");
    assert!(refused.contains("login_failed") && !refused.contains(&secret[4..]), "{refused}");
    let shown = with_config(&["audit", "show", "--caller", "panel", "--about", "pump 2"]);
    let shown = shown.assert_done();
    assert!(shown.contains("POST /api/v1/drives/pump 2/stop") && !shown.contains("local"), "{shown}");
    let verified = with_config(&["audit", "verify"]);
    assert!(verified.assert_done().contains("unbroken"), "{verified:?}");
    std::fs::write(&audit, log.replacen("pump%202", "pump%201", 1)).expect("it can be written");
    run(&["audit", "verify", &audit]).assert_refused(1, "the chain is broken");
    std::fs::remove_dir_all(&folder).expect("it can be removed");
}

#[test]
fn a_running_daemon_makes_and_removes_its_tokens_itself_and_keeps_all_in_one_folder() {
    let folder = path("one-folder-state");
    let mut daemon =
        Daemon::start("one-folder", &format!("state = {:?}", folder.to_str().expect("the path is text")));
    let config = File::new(
        "one-folder-unsaid",
        "[lines.a]\nport = \"/dev/nowhere\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n",
    );
    let socket = daemon.socket().to_owned();
    let tokens = |words: &[&str]| {
        run(&[&["token"], words, &["--config", config.path(), "--socket", &socket]].concat())
    };
    let secret = tokens(&["add", "panel", "--role", "operate"]).assert_done().trim().to_owned();
    tokens(&["add", "panel", "--role", "view"]).assert_refused(2, "there is a token panel already");
    assert!(tokens(&["list"]).assert_done().contains("panel  operate"));
    let token = folder.join("token");
    std::fs::write(&token, &secret).expect("the daemon has made it");
    let token = token.to_str().expect("the path is text");
    daemon.ask(&["stop", "pump 2", "--token-file", token]).assert_done();
    assert_eq!(tokens(&["remove", "panel"]).assert_done().trim(), "panel is removed");
    daemon.ask(&["stop", "pump 2", "--token-file", token]).assert_refused(1, "the token is wrong");
    daemon.end();
    let log = std::fs::read_to_string(folder.join("audit")).expect("it is kept there");
    for told in ["token panel added", "token panel removed", "\"caller\":\"panel\"", "socket uid "] {
        assert!(log.contains(told), "{told}: {log}");
    }
    std::fs::remove_dir_all(&folder).expect("it can be removed");
}

#[test]
fn a_second_daemon_on_one_socket_is_refused_and_what_is_no_socket_is_never_replaced() {
    let mut daemon = Daemon::start("second", "");
    let text = "[http]\nlisten = \"off\"\n[lines.a]\nport = \"/dev/nowhere\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n";
    let other = File::new("second-other", text);
    let second = run(&["run", "--config", other.path(), "--socket", daemon.socket()]);
    second.assert_refused(2, "another drived serves the control socket");
    run(&["run", "--config", other.path(), "--socket", other.path()]).assert_refused(2, "is no socket");
    assert_eq!(std::fs::read_to_string(other.path()).expect("it is there"), text);
    daemon.ask(&["status"]).assert_done();
    assert_eq!(daemon.end().0, Some(0));
    assert!(!daemon.socket.exists(), "it takes its socket away");
}

#[test]
fn a_certificate_that_is_missing_or_none_ends_the_program_before_a_drive_is_spoken_to() {
    let none = File::new("no-certificate", "this is no certificate");
    for (file, reason) in
        [("/nowhere/certificate.pem", "/nowhere/certificate.pem"), (none.path(), "no certificate")]
    {
        let text = format!(
            "[http]\nlisten = \"127.0.0.1:0\"\ntls = {{ certificate = \"{file}\", key = \"{file}\" }}\n\
             [lines.a]\nport = \"/dev/nowhere\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n"
        );
        let config = File::new("tls", &text);
        run(&["run", "--config", config.path()]).assert_refused(2, reason);
    }
}

#[test]
fn a_daemon_is_told_to_read_its_configuration_again() {
    let daemon = Daemon::start("reloaded", "");
    assert!(daemon.ask(&["reload"]).assert_done().starts_with("nothing has changed"));
    let file = daemon.file.path();
    let text = std::fs::read_to_string(file).expect("it is there");
    std::fs::write(file, text.replace("[defaults]", "[defaults]\nfrequency = { high = 40 }"))
        .expect("it can be written");
    let would = daemon.ask(&["reload", "--dry-run"]);
    assert!(would.assert_done().contains("pump 1"), "{would:?}");
    let done = daemon.ask(&["reload"]);
    assert!(done.assert_done().contains("pump 1"), "{done:?}");
    assert!(daemon.ask(&["reload"]).assert_done().starts_with("nothing has changed"));
    daemon.ask(&["setpoint", "pump 1", "45Hz"]).assert_refused(1, "pump 1: refused");
    std::fs::write(file, "nonsense").expect("it can be written");
    daemon.ask(&["reload"]).assert_refused(2, "nonsense");
    daemon.ask(&["status"]).assert_done();
}

#[test]
fn registers_and_faults_of_a_drive_are_read_and_written_through_the_daemon() {
    let mut daemon = Daemon::start("registers", "");
    let got = daemon.ask(&["param", "get", "pump 1", "ACC", "9002"]);
    let out = got.assert_done();
    assert!(out.contains("9001") && out.contains("ACC") && out.contains("dEC"), "{out}");
    let set = daemon.ask(&["param", "set", "pump 1", "ACC", "45"]);
    assert!(set.assert_done().starts_with("pump 1 ACC is now 45"), "{set:?}");
    let again = daemon.ask(&["param", "set", "pump 1", "ACC", "45"]);
    assert!(again.assert_done().starts_with("pump 1 ACC was already 45"), "{again:?}");
    let saved = daemon.ask(&["param", "save", "pump 1"]);
    assert!(saved.assert_done().starts_with("pump 1 has saved its parameters to EEPROM"), "{saved:?}");
    assert!(daemon.ask(&["param", "list", "pump 1"]).assert_done().contains("acceleration ramp time"));
    daemon.ask(&["param", "set", "pump 1", "ETA", "1"]).assert_refused(2, "can only be read");
    daemon.ask(&["param", "get", "pump 1", "NOPE"]).assert_refused(2, "NOPE");
    daemon.ask(&["param", "get", "pump 1"]).assert_refused(2, "expected NAME and one or more");

    assert!(daemon.ask(&["faults", "pump 1"]).assert_done().starts_with("pump 1 has no fault"));
    daemon.sim.say("atv312@1 trip OCF", "done");
    daemon.running.as_mut().expect("it runs").wait_for(r#""event":"tripped""#);
    let faults = daemon.ask(&["faults", "pump 1"]);
    let out = faults.assert_done();
    assert!(
        out.contains("pump 1 has tripped, fault 9 OCF: overcurrent") && out.contains("what to do: "),
        "{out}"
    );
    let status = daemon.ask(&["status"]);
    assert!(status.assert_done().contains("fault OCF"), "{status:?}");
    daemon.ask(&["start", "pump 1"]).assert_refused(1, "pump 1: refused");
    let reset = daemon.ask(&["reset", "pump 1"]);
    assert!(reset.assert_done().starts_with("pump 1 has no fault: the drive shows"), "{reset:?}");
}

#[test]
fn after_a_reload_a_group_is_who_the_file_says_and_never_more() {
    let daemon = Daemon::start("regroup", "");
    let text = std::fs::read_to_string(daemon.file.path()).expect("it is there");
    let other = text
        .replace("[\"pump 1\", \"pump 2\"]", "[\"pump 1\"]")
        .replace("[http]", "[socket]\nmode = \"600\"\n[http]");
    std::fs::write(daemon.file.path(), other).expect("it can be written");
    let dry = daemon.ask(&["reload", "--dry-run"]);
    let told = dry.assert_done();
    assert!(told.contains("groups changed") && told.contains("[socket]: from the next start on"), "{told}");
    let reloaded = daemon.ask(&["reload"]);
    let told = reloaded.assert_done();
    assert!(told.contains("groups changed") && told.contains("[socket]: from the next start on"), "{told}");
    let started = daemon.ask(&["start", "pumps", "--setpoint", "20Hz"]);
    let told = started.assert_done();
    assert!(told.contains("pump 1 started forward") && !told.contains("pump 2"), "{told}");
    let other = json(&daemon.ask(&["status", "pump 2", "--json"]));
    assert_ne!(other["status"]["state"], "running", "{other}");
    let dry = daemon.ask(&["reload", "--dry-run"]);
    let told = dry.assert_done();
    assert!(
        !told.contains("groups") && told.contains("[socket]"),
        "what does not hold yet is said again: {told}"
    );
    daemon.ask(&["stop", "--all"]).assert_done();
}

#[test]
fn parameters_are_kept_compared_and_restored_through_the_daemon() {
    let daemon = Daemon::start("restore", "");
    let folder = path("restore.kept");
    let folder = folder.to_str().expect("the path is text");
    let kept = daemon.ask(&["param", "backup", "bench", "--to", folder]);
    assert!(kept.assert_done().contains("pump 1: ") && kept.out.contains("pump 2: "), "{kept:?}");
    let (one, two) = (format!("{folder}/pump 1.toml"), format!("{folder}/pump 2.toml"));
    daemon.ask(&["param", "set", "pump 1", "ACC", "4.5"]).assert_done();
    let differs = daemon.ask(&["param", "diff", &one, "--json"]);
    assert_eq!(differs.code, Some(1), "{differs:?}");
    let differs = json(&differs);
    assert_eq!(differs["differences"][0]["mnemonic"], "ACC");
    assert_eq!(differs["differences"][0]["left"]["value"], "3.0 s");
    assert_eq!(differs["differences"][0]["right"]["value"], "4.5 s");

    daemon.ask(&["start", "pump 1", "--setpoint", "20Hz"]).assert_done();
    let running = daemon.ask(&["param", "restore", &one, "--write"]);
    running.assert_refused(1, "stopped at ACC");
    assert!(running.err.contains("not written: ACC"), "{running:?}");
    daemon.ask(&["stop", "pump 1"]).assert_done();
    let done = json(&daemon.ask(&["param", "restore", &one, "--write", "--save", "--json"]));
    assert_eq!(done["restored"][0]["written"], serde_json::json!(["ACC"]), "{done}");
    assert_eq!(done["restored"][0]["saved"], true, "{done}");

    daemon.ask(&["param", "backup", "pump 1", "--to", daemon.file.path()]).assert_refused(2, "is no backup");
    daemon.ask(&["param", "restore", daemon.file.path()]).assert_refused(2, "");
    daemon.ask(&["param", "diff", "nowhere.toml"]).assert_refused(2, "nowhere.toml");
    daemon.ask(&["param", "diff", &one, &two]).assert_done();
    std::fs::remove_dir_all(folder).expect("it is there");
}
