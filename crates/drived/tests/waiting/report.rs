//! `drived report` of the built program, looked at and printed by a headless Chromium over Playwright. Where they are not
//! installed the tests print why they are skipped; where `CI` is set they fail instead, because `.ci/run` installs them.

use std::{path::Path, process::Command};

use crate::support::{File, Running, Sim, path, run};

#[test]
fn the_report_of_a_line_needs_nothing_else_and_prints_on_as_many_pages_as_it_has_drives_and_some() {
    let mut sim = Sim::serve("report-line", &["atv312@1-31"]);
    // BBV51701, LFT: 9 is OCF.
    sim.say("atv312@5 trip OCF", "done");
    sim.say("atv312@7 power off", "done");
    let file = path("report-line.html");
    let told = run(&[
        "report",
        "--line",
        sim.link(),
        "--drive",
        "atv312@1-31",
        "--without-parameters",
        "--watch",
        "3s",
        "--title",
        "Hall <3>",
        "--note",
        "yearly service",
        "--to",
        file.to_str().expect("the path is text"),
    ]);
    told.assert_refused(1, "atv312@7 does not answer: the report says so");
    assert!(told.out.contains("31 drives"), "{told:?}");
    look(&file, "line");
    std::fs::remove_file(&file).expect("it was written");
}

#[test]
fn the_report_of_the_daemon_has_its_drives_groups_and_lines_by_name_and_their_parameters() {
    let sim = Sim::serve("report-daemon", &["atv312@1-2"]);
    let text = format!(
        "[lines.north]\nport = \"{}\"\n[[drives]]\nline = \"north\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n[groups]\nall = [\"pump 1\", \"pump 2\"]\n",
        sim.link()
    );
    let config = File::new("report-daemon", &text);
    let socket = path("report-daemon.sock");
    let socket = socket.to_str().expect("the path is text");
    let mut daemon =
        Running::start(&["run", "--config", config.path(), "--http", "off", "--socket", socket, "--json"]);
    daemon.wait_for("\"measurements\"");
    let file = path("report-daemon.html");
    let to = file.to_str().expect("the path is text");
    for (name, drives) in [("pump 2", "1 drive"), ("all", "2 drives"), ("north", "2 drives")] {
        let told =
            run(&["report", name, "--socket", socket, "--to", to, "--without-parameters", "--overwrite"]);
        assert!(told.assert_done().contains(&format!(": {drives}\n")), "{told:?}");
        // What was read within the last minute waits to be written, and is written for whoever asks.
        let told = std::fs::read_to_string(&file).expect("it was written");
        assert!(!told.contains("Nothing is kept of it."), "it was read a moment ago");
    }
    run(&["report", "pump 3", "--socket", socket, "--to", to, "--overwrite"])
        .assert_refused(2, "no drive and no group");
    run(&["report", "pump 1", "--socket", socket, "--to", to]).assert_refused(2, "--overwrite");
    run(&["report", "pump 1", "--socket", socket, "--to", to, "--overwrite"]).assert_done();
    look(&file, "daemon");
    std::fs::remove_file(&file).expect("it was written");
}

/// Looks at a report, and prints it.
fn look(file: &Path, scene: &str) {
    let Some(python) = crate::support::python_with("playwright") else { return };
    if !crate::support::is_there("/usr/bin/chromium", &["--version"]) {
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/report.py");
    let seen = Command::new(python).arg(script).arg(scene).arg(file).status().expect("the script starts");
    assert!(seen.success(), "{scene} is not as it should be");
}
