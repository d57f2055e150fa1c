//! The log of a daemon, as it stands in a file.
#![cfg(unix)]

mod support;

use support::{File, Running, Sim, drived};

/// A daemon that watches two pumps on a simulated line.
fn plant(name: &str) -> (Sim, File) {
    let sim = Sim::serve(name, &["atv312@1-2"]);
    let text = format!(
        "snapshots = \"0\"\n[lines.north]\nport = \"{},19200,8E1\"\n[[drives]]\nline = \"north\"\n\
         drive = \"atv312@1-2\"\nname = \"pump {{}}\"\nrest = \"300ms\"\nmax_age = \"1s\"\n",
        sim.link()
    );
    let file = File::new(name, &text);
    (sim, file)
}

#[test]
fn a_loss_and_a_return_are_one_line_each_with_local_time_and_no_colours() {
    let (mut sim, file) = plant("loss");
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    let mut log = daemon.log_until("connected: pump 1, pump 2 disabled, the shaft may coast");
    sim.say("atv312@2 cable cut", "done");
    log += &daemon.log_until("pump 2 lost with output off: no answer for ");
    sim.say("atv312@2 cable join", "done");
    log += &daemon.log_until("pump 2 back after ");
    daemon.ask_to_end();
    log += &daemon.log_until("at the exit: ");
    for once in [" WARN  north: pump 2 lost ", " INFO  north: pump 2 back after "] {
        assert_eq!(log.matches(once).count(), 1, "{log}");
    }
    let of_pump_2 = log.lines().filter(|line| line.contains("pump 2") || line.contains("slave")).count();
    assert!(of_pump_2 <= 5, "{log}");
    for line in log.lines() {
        // 2026-11-21 14:03:21.350+01:00 INFO  …
        let stamp: String = line.chars().take(29).collect();
        let shape: String = stamp.chars().map(|one| if one.is_ascii_digit() { '0' } else { one }).collect();
        assert_eq!(shape.replace("-00:00", "+00:00").as_str(), "0000-00-00 00:00:00.000+00:00", "{line:?}");
        assert!(!line.contains('\u{1b}'), "{line:?}");
    }
}

#[test]
fn the_time_in_the_log_is_that_of_the_plant_with_its_offset() {
    let (_sim, file) = plant("offset");
    let mut command = drived(&["run", "--config", file.path()]);
    // POSIX counts west of Greenwich: this is five and a half hours east.
    let mut daemon = Running::of(command.env("TZ", "XXX-5:30"));
    let log = daemon.log_until("connected: ");
    assert!(log.lines().all(|line| line.contains("+05:30 ")), "{log}");
}

#[test]
fn an_unknown_level_is_one_line_and_exit_code_2() {
    let ended = drived(&["families"]).env("DRIVED_LOG", "loud").output().expect("the program starts");
    let said = String::from_utf8(ended.stderr).expect("stderr is text");
    assert_eq!((ended.status.code(), said.lines().count()), (Some(2), 1), "{said}");
    assert!(
        said.starts_with("drived: DRIVED_LOG: \"loud\" is no level: expected off, error, warn"),
        "{said}"
    );
}
