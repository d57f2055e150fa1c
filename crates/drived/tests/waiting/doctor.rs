//! `doctor` from outside, on the pty of a simulated line.

use crate::support::{Running, Sim, path, run};
use serde_json::Value;

#[test]
fn a_healthy_line_is_0_and_a_missing_drive_is_1_with_a_report_that_names_it() {
    let mut sim = Sim::serve("doctor", &["atv312@1-2"]);
    let healthy = sim.on("atv312@1-2", &["doctor", "--for", "1s", "--json"]);
    let body: Value = serde_json::from_str(healthy.assert_done()).unwrap();
    assert_eq!((&body["healthy"], &body["verdicts"]), (&Value::Bool(true), &Value::Array(Vec::new())));
    assert_eq!(body["slaves"].as_array().map(Vec::len), Some(2), "{body}");

    assert_eq!(body["tripped"], Value::Array(Vec::new()), "{body}");

    // What is wrong with a drive and not with its line is told as that.
    sim.say("atv312@2 trip SLF", "done");
    let tripped = sim.on("atv312@1-2", &["doctor", "--for", "1s"]);
    assert!(tripped.assert_done().contains("atv312@2 stands TRIPPED"), "{tripped:?}");
    // It does nothing that could be called a stop by a mode.
    let stop = sim.on("atv312@2", &["stop"]);
    let told = stop.assert_done();
    assert!(
        told.contains("atv312@2 has taken the stop: the drive shows") && told.contains("fault"),
        "{told}"
    );
    assert!(!told.contains("is stopping") && !told.contains("asked for a ramp stop"), "{told}");

    let report = path("report.txt");
    let file = report.to_str().unwrap();
    let ended = sim.on("atv312@1-3", &["doctor", "--for", "1s", "--report", file]);
    assert_eq!(ended.code, Some(1), "{ended:?}");
    assert!(
        ended.out.contains("NO ANSWER FROM A DRIVE") && ended.err.contains("1 thing is wrong"),
        "{ended:?}"
    );
    let text = std::fs::read_to_string(&report).unwrap();
    for part in
        ["Report of a line, by drived", "19200 8E1", "atv312@3 never answered", "Questions", "damaged frames"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }

    let again = sim.on("atv312@1", &["doctor", "--for", "1s", "--report", file]);
    again.assert_refused(2, "exists");
    assert_eq!(std::fs::read_to_string(&report).unwrap(), text);
    std::fs::remove_file(report).unwrap();
}

#[test]
fn a_port_that_somebody_holds_is_refused_with_who_it_is() {
    let sim = Sim::serve("doctor-held", &["atv312@1"]);
    let mut poll = Running::start(&["poll", "--line", sim.link(), "--drive", "atv312@1"]);
    poll.wait_for("atv312@1");
    let ended = run(&["doctor", "--line", sim.link(), "--drive", "atv312@1", "--for", "1s"]);
    ended.assert_refused(2, "a line has one master");
}
