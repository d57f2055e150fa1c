//! The program runs and says what a reader expects. No test here looks at how fast anything was.

use std::process::Command;

use serde_json::Value;

/// The rows of one run in its smallest form.
fn rows(section: &str) -> Vec<Value> {
    let output = Command::new(env!("CARGO_BIN_EXE_drive-bench"))
        .args([
            section,
            "--json",
            "--seconds",
            "1",
            "--transactions",
            "4000",
            "--lines",
            "2",
            "--most-lines",
            "3",
        ])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn row<'a>(rows: &'a [Value], begins: &str) -> &'a Value {
    let found = rows.iter().find(|row| row["measured"].as_str().is_some_and(|name| name.starts_with(begins)));
    found.unwrap_or_else(|| panic!("no row {begins:?} in {rows:?}"))
}

#[test]
fn over_every_fault_our_line_accepts_no_wrong_value() {
    let rows = rows("faults");
    let wrong = row(&rows, "wrong values accepted as right");
    assert_eq!(wrong["value"], 0.0);
    assert_eq!(wrong["met"], true);
    assert!(row(&rows, "… answered right")["value"].as_f64().unwrap() > 2_000.0);
}

#[test]
fn lines_in_one_process_are_counted_by_a_simulator_in_another() {
    let rows = rows("lines");
    assert!(rows.iter().all(|row| row["section"] == "lines"));
    let utilisation = row(&rows, "2 lines: utilisation, mean");
    assert_eq!(utilisation["goal"]["relation"], "≥");
    assert!(utilisation["value"].as_f64().is_some_and(|value| value > 0.0));
}

#[test]
fn three_masters_are_measured_on_a_line_without_pacing() {
    let rows = rows("cpu");
    for master in ["this line", "loop by hand", "stock tokio-modbus"] {
        let each = row(&rows, &format!("processor time per transaction, {master}"));
        assert!(each["value"].as_f64().is_some_and(|value| value > 0.0));
    }
}

#[test]
fn the_growth_is_measured_line_by_line_and_no_silence_is_too_short() {
    let rows = rows("growth");
    for lines in [1, 3] {
        assert_eq!(row(&rows, &format!("{lines} lines: silences too short"))["value"], 0.0);
        let share = &row(&rows, &format!("{lines} lines: utilisation, mean"))["value"];
        assert!(share.as_f64().is_some_and(|share| share > 0.0));
    }
}

#[test]
fn a_whole_plant_is_polled_in_its_periods_and_a_stop_of_all_of_it_is_confirmed_within_its_bound() {
    let rows = rows("fleet");
    assert_eq!(row(&rows, "3 lines x 31 drives: statuses that are missing or too old")["value"], 0.0);
    assert_eq!(row(&rows, "3 lines x 31 drives: … until the last drive has it, by the bound")["met"], true);
    let confirmed = &row(&rows, "3 lines x 31 drives: … until all is confirmed")["value"];
    assert!(confirmed.as_f64().is_some_and(|ms| ms > 0.0));
}

#[test]
fn our_line_is_measured_beside_the_masters_of_others() {
    let rows = rows("utilisation");
    for master in
        ["this line", "this line, not staying awake", "loop that never sleeps", "stock tokio-modbus"]
    {
        let share = &row(&rows, &format!("{master}: utilisation"))["value"];
        assert!(share.as_f64().is_some_and(|share| share > 0.0), "{master}");
    }
    // A drive that a busy machine keeps waiting answers late, into the next request: of silences only the virtual line can tell.
    assert_eq!(row(&rows, "its machines alone, virtual time: silences shorter")["value"], 0.0);
    assert!(row(&rows, "this line by the best of the others")["value"].as_f64().is_some());
}

#[test]
fn behind_strangers_nothing_is_wrong_and_the_living_are_read() {
    let rows = rows("strangers");
    assert_eq!(row(&rows, "200 reconnects")["value"], 0.0);
    assert_eq!(row(&rows, "100 stalls")["value"], 0.0);
    assert_eq!(row(&rows, "a connection that goes mute")["met"], true, "{rows:?}");
    for connections in [1, 2] {
        for serves in ["one wire", "a wire for each connection"] {
            for what in ["values of the living", "a stop confirmed within"] {
                let goal = format!("this line over {connections} on {serves}: {what}");
                assert_eq!(row(&rows, &goal)["met"], true, "{rows:?}");
            }
        }
    }
}
