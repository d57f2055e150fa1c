//! `run` on a plant's ordinary bad days, over ptys and sockets.
#![cfg(unix)]

mod support;

use std::net::TcpListener;

use support::{File, Running, Sim, path, run};

const CONTROL: &str = "control = true\nwatchdog = { time = \"5s\", reaction = \"ramp\" }";

/// A line and its drives, `NAME ADDRESS` each.
fn line(name: &str, port: &str, drives: &str, keys: &str) -> String {
    format!(
        "[lines.{name}]\nport = \"{port}\"\n[[drives]]\nline = \"{name}\"\ndrive = \"{drives}\"\n\
         name = \"{name} {{}}\"\n{keys}\n"
    )
}

#[test]
fn a_line_whose_port_is_missing_at_start_is_an_alarm_and_is_tried_again_while_the_others_run() {
    let sim = Sim::serve("present", &["atv312@1"]);
    let later = path("later");
    let later = later.to_str().expect("the path is text");
    let missing = format!("{later},19200,8E1");
    let refused = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    let refused = format!("rtu+tcp://{},19200,8E1", refused.expect("a port is free"));
    let text = [
        line("north", &format!("{},19200,8E1", sim.link()), "atv312@1", CONTROL),
        line("south", &missing, "atv312@1", CONTROL),
        line("east", &refused, "atv312@1", CONTROL),
    ];
    let file = File::new("missing", &text.concat());
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    let connected = daemon.wait_for(r#""event":"connected""#);
    assert!(connected.contains("north 1"), "{connected}");
    let alarms = [daemon.wait_for(r#""event":"lost""#), daemon.wait_for(r#""event":"lost""#)];
    assert!(alarms.iter().all(|lost| lost.contains(r#""alarm":true"#)), "{alarms:?}");
    assert!(alarms.concat().contains("south 1") && alarms.concat().contains("east 1"), "{alarms:?}");
    let _later = Sim::serve("later", &["atv312@1"]);
    let connected = daemon.wait_for(r#""event":"connected""#);
    assert!(connected.contains("south 1"), "{connected}");
    assert_eq!(daemon.interrupt().0, Some(0));
}

#[test]
fn a_stop_given_up_at_a_second_signal_is_an_alarm_that_names_the_motor() {
    let mut sim = Sim::serve("given-up", &["atv312@1"]);
    sim.on("atv312@1", &["setpoint", "30Hz"]).assert_done();
    sim.on("atv312@1", &["start"]).assert_done();
    let keys = format!("{CONTROL}\non_exit_adopted = \"stop\"");
    let port = format!("{},19200,8E1", sim.link());
    let file = File::new("given-up", &line("north", &port, "atv312@1", &keys));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""state":"running""#);
    sim.say("line cut", "done");
    daemon.wait_for(r#""event":"lost""#);
    daemon.ask_to_end();
    daemon.wait_for_log("the exit waits for north 1");
    daemon.ask_to_end();
    daemon.wait_for_log("THE MOTOR MAY TURN: north 1: given up");
    assert_eq!(daemon.end().0, Some(1));
}

#[test]
fn a_motor_that_was_not_started_here_and_turns_at_the_exit_ends_with_1_unless_its_policy_leaves_it() {
    let sim = Sim::serve("adopted", &["atv312@1"]);
    sim.on("atv312@1", &["setpoint", "30Hz"]).assert_done();
    sim.on("atv312@1", &["start"]).assert_done();
    let port = format!("{},19200,8E1", sim.link());
    for (policy, code) in [("report", 1), ("leave", 0), ("stop", 0)] {
        let keys = format!("control = true\non_exit_adopted = \"{policy}\"");
        let file = File::new(&format!("adopted-{policy}"), &line("north", &port, "atv312@1", &keys));
        let mut daemon = Running::start(&["run", "--config", file.path()]);
        daemon.wait_for(r#""state":"running""#);
        let (ended, rest) = daemon.interrupt();
        assert_eq!(ended, Some(code), "{policy}: {rest}");
    }
}

#[test]
fn what_cannot_be_a_configuration_is_one_clear_line() {
    let good = |keys: &str| line("north", "/dev/nowhere,19200,8N1", "atv312@1", keys);
    let two =
        |one: &str, other: &str| [line("a", one, "atv312@1", ""), line("b", other, "atv312@1", "")].concat();
    let cases = [
        ("on_exit = \"stop\"".to_owned(), "on_exit without control = true"),
        ("watchdog = { time = \"5s\", reaction = \"ramp\" }".to_owned(), "watchdog without control = true"),
        ("on_loss = \"stop\"".to_owned(), "on_loss without control = true"),
        ("frequency = { high = 50 }".to_owned(), "frequency without control = true"),
        (
            "control = true\nfrequency = { low = 20, high = 50, forbidden = [[10, 35], [30, 60]] }"
                .to_owned(),
            "the forbidden bands leave nothing of 20.00 Hz to 50.00 Hz",
        ),
        (format!("{CONTROL}\non_exit = \"leave\""), "would be tripped by its watchdog 5s later"),
        ("control = true\nrunning = 500".to_owned(), "expected a text in quotes, such as \"500ms\""),
        ("control = true\nrunning = \"500\"".to_owned(), "expected a whole number and a unit"),
        ("control = true\nfrequency = { low = -5 }".to_owned(), "expected a number from 0 on"),
    ];
    let mut texts: Vec<(String, &str)> = cases.map(|(keys, reason)| (good(&keys), reason)).into();
    texts.extend([
        (
            line(
                "north",
                "/dev/nowhere,19200,8N1",
                "atv58@1",
                "control = true\nstop_mode = \"dc-injection\"",
            ),
            "has no DC injection stop",
        ),
        (
            format!("snapshots = \"1ms\"\n{}", good("")),
            "snapshots: 1ms: expected \"0\" for never, or 100ms or more",
        ),
        (
            two("rtu+tcp://127.0.0.1:4001,19200,8E1", "rtu+tcp://localhost:4001,19200,8E1"),
            "it is the port of line",
        ),
        (two("tcp://127.0.0.1:502", "tcp://localhost:502"), "its unit 1 is on line"),
        (line("north", "/dev/null,19200,8E1", "atv312@1", ""), "/dev/null is no terminal"),
        (line("north", env!("CARGO_MANIFEST_PATH"), "atv312@1", ""), "Cargo.toml is no terminal"),
    ]);
    for (number, (text, reason)) in texts.iter().enumerate() {
        let file = File::new(&format!("case-{number}"), text);
        run(&["check", "--config", file.path()]).assert_refused(2, reason);
        run(&["run", "--config", file.path()]).assert_refused(2, reason);
    }
}

#[test]
fn one_serial_port_under_two_names_is_refused() {
    let sim = Sim::serve("two-names", &["atv312@1"]);
    let device = std::fs::read_link(sim.link()).expect("it is a link");
    let device = device.to_str().expect("the path is text");
    let text = [line("a", sim.link(), "atv312@1", ""), line("b", device, "atv312@2", "")].concat();
    let file = File::new("two-names", &text);
    run(&["check", "--config", file.path()]).assert_refused(2, "it is the port of line");
}

#[test]
fn a_configuration_that_is_no_file_or_never_ends_is_refused() {
    let pipe = path("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    let pipe = pipe.to_str().expect("the path is text");
    for (file, reason) in [
        (pipe, "it is no ordinary file"),
        ("/dev/zero", "it is no ordinary file"),
        (env!("CARGO_MANIFEST_DIR"), "it is no ordinary file"),
    ] {
        for subcommand in ["check", "run"] {
            run(&[subcommand, "--config", file]).assert_refused(2, reason);
        }
    }
    std::fs::remove_file(pipe).expect("it is there");
    let endless = File::new("endless", &"# and on\n".repeat(200_000));
    run(&["check", "--config", endless.path()]).assert_refused(2, "it is longer than 1024 KiB");
}

#[test]
fn an_unknown_log_level_and_too_few_file_descriptors_are_refused() {
    let file = File::new("limits", &line("north", "/dev/nowhere,19200,8E1", "atv312@1", ""));
    let text = |output: std::process::Output| {
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for level in ["verbose", "drive_bus=loud"] {
        let mut command = support::drived(&["check", "--config", file.path()]);
        let (code, said) = text(command.env("DRIVED_LOG", level).output().expect("it starts"));
        assert_eq!((code, said.lines().count()), (Some(2), 1), "{said}");
        assert!(said.contains("is no level: expected off, error, warn, info, debug or trace"), "{said}");
    }
    let script = format!("ulimit -n 30; exec {} run --config {}", env!("CARGO_BIN_EXE_drived"), file.path());
    let (code, said) =
        text(std::process::Command::new("sh").args(["-c", &script]).output().expect("sh runs"));
    assert_eq!((code, said.lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("too few file descriptors") && said.contains("the limit is 30"), "{said}");
}

#[test]
fn a_setpoint_below_zero_or_without_a_unit_is_refused() {
    for (setpoint, reason) in [
        ("-5Hz", "a setpoint has no sign, the direction is that of the start"),
        ("30", "\"30\" of what?"),
        ("5.001Hz", "a frequency with at most two decimals such as 47.5 Hz"),
    ] {
        run(&["setpoint", setpoint, "--line", "/dev/nowhere", "--drive", "atv312@1"])
            .assert_refused(2, reason);
    }
}

#[test]
fn a_simulator_replaces_nothing_that_it_did_not_make() {
    let sim = Sim::serve("kept", &["atv312@1"]);
    let other = path("other");
    let _ = std::fs::remove_file(&other);
    let target = std::env::temp_dir();
    std::os::unix::fs::symlink(&target, &other).expect("the directory can be written");
    for link in [other.to_str().expect("the path is text"), sim.link()] {
        run(&["sim", "--pty", link, "--drive", "atv312@1"]).assert_refused(2, "is there already");
    }
    assert_eq!(std::fs::read_link(&other).ok(), Some(target));
    sim.on("atv312@1", &["status"]).assert_done();
    std::fs::remove_file(&other).expect("it is there");
}

#[test]
fn a_daemon_puts_back_the_watchdog_that_one_before_it_had_armed_when_it_was_killed() {
    let mut sim = Sim::serve("killed", &["atv312@1"]);
    // NTO, CMI bit 14 (BBV51701 p. 20): the watchdog is off.
    sim.say("atv312@1 set CMI 16384", "done");
    let kept = path("killed.json");
    let text = line("north", &format!("{},19200,8E1", sim.link()), "atv312@1", CONTROL);
    let text = format!("watchdogs = {:?}\n{text}", kept.to_str().expect("the path is text"));
    let file = File::new("killed", &text);
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"watchdog_verified""#);
    while !std::fs::read_to_string(&kept).is_ok_and(|text| text.contains("north 1")) {
        support::look_again();
    }
    daemon.signal("-KILL");
    daemon.end();
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"watchdog_verified""#);
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains(r#""event":"watchdog_put_back""#), "{rest}");
    let text = std::fs::read_to_string(&kept).expect("it was written");
    assert!(!text.contains("north 1"), "{text}");
    let _ = std::fs::remove_file(kept);
}
