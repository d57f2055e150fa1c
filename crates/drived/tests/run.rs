//! `run` and `check`: the fleet as a daemon, over a pty.
#![cfg(unix)]

mod support;

use support::{File, Running, Sim, run};

fn configuration(port: &str, drives: &str, defaults: &str) -> String {
    format!(
        "snapshots = \"500ms\"\n[defaults]\n{defaults}\n[lines.bench]\nport = \"{port},19200,8E1\"\n\
         [[drives]]\nline = \"bench\"\ndrive = \"{drives}\"\nname = \"pump {{}}\"\n"
    )
}

#[test]
fn a_daemon_tells_events_and_snapshots_and_at_its_end_what_each_drive_did() {
    let sim = Sim::serve("daemon", &["atv312@1-2"]);
    let control = "control = true\nwatchdog = { time = \"5s\", reaction = \"ramp\" }";
    let file = File::new("daemon", &configuration(sim.link(), "atv312@1-2", control));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    let connected: serde_json::Value =
        serde_json::from_str(&daemon.wait_for(r#""event":"connected""#)).expect("an object");
    assert!(["pump 1", "pump 2"].map(serde_json::Value::from).contains(&connected["drive"]), "{connected}");
    daemon.wait_for(r#""event":"watchdog_verified""#);
    let snapshot: serde_json::Value =
        serde_json::from_str(&daemon.wait_for(r#""kind":"snapshot""#)).expect("an object");
    assert_eq!((&snapshot["link"], &snapshot["status"]["quality"]), (&"connected".into(), &"good".into()));
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    for drive in ["pump 1", "pump 2"] {
        let left =
            rest.lines().filter(|line| line.contains(drive) && line.contains(r#""exit":{"action":"left"}"#));
        assert_eq!(left.count(), 1, "{rest}");
    }
}

#[test]
fn a_daemon_whose_stdout_and_log_nobody_reads_any_more_watches_its_drives_on() {
    let sim = Sim::serve("unread", &["atv312@1"]);
    let control = "control = true\nwatchdog = { time = \"5s\", reaction = \"ramp\" }";
    let file = File::new("unread", &configuration(sim.link(), "atv312@1", control));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"watchdog_verified""#);
    daemon.close_stdout();
    daemon.wait_for_log("nobody reads stdout any more");
    daemon.close_log();
    // Its port is its own as long as it watches.
    sim.on("atv312@1", &["status"]).assert_refused(2, sim.link());
    // What it logs at its end is no reason to panic.
    assert_eq!(daemon.interrupt().0, Some(1), "its last events were not heard");
    sim.on("atv312@1", &["status"]).assert_done();
}

#[test]
fn a_configuration_is_checked_without_a_port() {
    let file = File::new("check", &configuration("/dev/nowhere", "atv312@1-10", "control = true"));
    let checked = run(&["check", "--config", file.path()]);
    let out = checked.assert_done();
    assert!(
        out.starts_with("line bench: 10 drives, 10 under control, on /dev/nowhere, 19200 8E1 rtu\n"),
        "{out}"
    );
    assert!(
        out.contains(
            "atv312@1-10 (pump 1 … pump 10)\n    commands          by anyone\n    status            every 500ms running"
        ),
        "{out}"
    );
    assert!(out.contains("at the exit       stopped if it was started here (ramp stop)"), "{out}");
}

#[test]
fn the_options_of_each_drive_are_part_of_what_a_configuration_means() {
    let text = "[defaults]\noptions = { authority = \"settings\", saves = 120, fault-reset-function = 5 }\n\
                [lines.bench]\nport = \"/dev/nowhere,9600,8N1\"\n\
                [[drives]]\nline = \"bench\"\ndrive = \"3g3ev@1-2\"\n\
                [[drives]]\nline = \"bench\"\ndrive = \"3g3ev@3\"\noptions = { saves = 7 }\n\
                [[drives]]\nline = \"bench\"\ndrive = \"atv312@4\"\n";
    let file = File::new("options", text);
    let checked = run(&["check", "--config", file.path()]);
    let out = checked.assert_done();
    // What stands between the head of a drive and the next.
    let options = |drive: &str| {
        let block = out.lines().skip_while(|line| !line.starts_with(&format!("  {drive} "))).skip(1);
        let mut lines = block.take_while(|line| line.starts_with("    "));
        lines.find_map(|line| line.trim().strip_prefix("options")).map(str::trim)
    };
    assert_eq!(options("3g3ev@1,2"), Some("fault-reset-function = 5, saves = 120"), "{out}");
    assert_eq!(options("3g3ev@3"), Some("fault-reset-function = 5, saves = 7"), "{out}");
    assert_eq!(options("atv312@4"), None, "{out}");
}

#[test]
fn names_that_look_alike_are_doubted_and_stop_no_plant() {
    // The first letter of the second is Cyrillic.
    let named = configuration("/dev/nowhere", "atv312@1", "").replace("pump {}", "pump 1");
    let drive = |address: u8, name: &str| {
        format!("[[drives]]\nline = \"bench\"\ndrive = \"atv312@{address}\"\nname = \"{name}\"\n")
    };
    let file =
        File::new("alike", &format!("{named}{}{}", drive(8, "\u{440}ump 1"), drive(9, "fan\\u200B 1")));
    let out = run(&["check", "--config", file.path()]).assert_done().to_owned();
    for doubt in [
        "DOUBTFUL: drive or group \"pump 1\" and \"\u{440}ump 1\" (U+0440) look alike: expected names that nobody confuses",
        "DOUBTFUL: drive or group \"fan 1\" (U+200B): U+200B in it is not seen: expected a name without",
    ] {
        assert!(out.lines().any(|line| line == doubt), "{out}");
    }
}

#[test]
fn what_is_wrong_is_one_line_with_file_line_and_field() {
    let text = configuration("/dev/nowhere", "atv312@1-20", "running = \"soon\"");
    let file = File::new("wrong", &text);
    for subcommand in ["check", "run"] {
        let refused = run(&[subcommand, "--config", file.path()]);
        refused.assert_refused(2, ".toml:3: running: \"soon\": expected a whole number and a unit");
    }
    run(&["check", "--config", "nowhere.toml"]).assert_refused(2, "nowhere.toml: cannot be read");
}
