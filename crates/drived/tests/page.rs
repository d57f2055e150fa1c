//! The page of the built program, looked at by a headless Chromium over Playwright. Where they are not installed the tests
//! print why they are skipped; where `CI` is set they fail instead, because `.ci/run` installs them.

#![cfg(unix)]

mod support;

use std::{
    io::{BufRead as _, BufReader},
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{Mutex, PoisonError},
};

use drive_testing::peers;
use support::{File, Running, Sim, ask, look_again, path, run};

/// One browser at a time is enough for a machine with two processors: beside a second one the simulated drives answer too late.
static ONE_BY_ONE: Mutex<()> = Mutex::new(());

#[test]
fn the_page_of_the_demo_loads_and_no_view_complains_in_the_console() {
    look_at_the_demo("loads");
}

#[test]
fn a_trip_comes_first_in_the_list_with_its_meaning_what_to_do_and_why_no_start() {
    look_at_three_pumps("trip");
}

#[test]
fn stop_all_by_its_key_accounts_for_every_drive_and_stands_in_the_events() {
    look_at_the_demo("stop_all");
}

#[test]
fn on_a_phone_nothing_scrolls_sideways_and_stop_all_is_in_reach_of_a_thumb() {
    look_at_the_demo("phone");
    look_at_the_demo("phone_french");
}

#[test]
fn a_french_browser_is_shown_the_page_in_french_until_english_is_chosen() {
    look_at_the_demo("french");
}

#[test]
fn values_turn_grey_and_dated_when_their_line_is_cut_and_live_when_it_is_joined() {
    look_at_three_pumps("cable");
}

#[test]
fn a_stop_that_cannot_reach_the_daemon_says_so_loudly_and_is_sent_again() {
    look_at_the_demo("away");
}

#[test]
fn a_stop_that_a_network_swallows_is_said_to_be_unknown_and_sent_again() {
    look_at_the_demo("hung");
}

#[test]
fn what_a_proxy_answers_is_not_known_and_the_command_is_found_by_its_id() {
    look_at_the_demo("proxy");
}

#[test]
fn a_setpoint_is_given_as_it_was_written_with_a_point_or_a_comma() {
    look_at_the_demo("typed");
}

#[test]
fn the_document_alone_stops_the_motors() {
    look_at_the_demo("bare");
}

#[test]
fn each_of_six_pages_of_one_browser_can_stop() {
    look_at_the_demo("tabs");
}

#[test]
fn a_phone_can_stop_while_a_question_or_the_login_stands_open() {
    look_at_three_pumps("questions");
}

#[test]
fn a_long_name_of_a_group_pushes_nothing_off_a_phone_and_what_a_stop_leaves_out_is_named() {
    look_at_three_pumps("long_group");
}

#[test]
fn what_somebody_may_not_do_is_not_offered_to_him_and_a_stop_is() {
    look_at_three_pumps("scoped");
}

#[test]
fn while_the_account_of_a_stop_cannot_be_read_nothing_is_called_live() {
    look_at_three_pumps("unread");
}

#[test]
fn a_daemon_that_was_started_anew_knows_nothing_of_a_stop_and_that_is_said() {
    look_at_three_pumps("restarted");
}

#[test]
fn a_stop_of_a_dead_line_is_told_as_not_confirmed_of_every_drive() {
    look_at_three_pumps("dead");
}

#[test]
fn a_trend_is_the_daemons_record_by_the_daemons_clock_and_a_setpoint_the_one_that_is_followed() {
    look_at_three_pumps("clocks");
}

#[test]
fn a_cable_is_one_row_and_three_clicks_put_right_what_it_has_left_at_every_drive() {
    look_at_three_pumps("folded");
}

#[test]
fn an_alarm_calls_and_is_acknowledged_with_a_note_shelved_and_taken_back() {
    look_at_three_pumps("alarms");
}

#[test]
fn a_setpoint_of_somebody_else_is_said_and_his_name_stands_beside_it() {
    look_at_three_pumps("somebody");
}

#[test]
fn a_question_is_withdrawn_when_it_is_not_as_it_was_shown_and_what_it_has_shown_is_what_is_done_or_nothing() {
    look_at_three_pumps("as_shown");
}

#[test]
fn every_time_is_the_daemons_with_its_zone() {
    look_at_three_pumps("zones");
}

#[test]
fn every_view_is_whole_in_both_languages_at_three_widths_and_high_enough_for_a_thumb() {
    look_at_three_pumps("touched");
}

#[test]
fn no_view_breaks_a_rule_of_axe() {
    look_at_three_pumps("axe");
    look_at_three_pumps("axe_dark");
}

#[test]
fn the_first_hour_goes_from_an_empty_daemon_to_a_turning_motor_in_the_browser() {
    begin_at_the_page("first_hour");
}

#[test]
fn the_first_hour_can_be_gone_through_by_the_keyboard_alone() {
    begin_at_the_page("first_hour_keys");
}

#[test]
fn with_a_mouse_the_stop_hides_nothing_that_stands_beside_it() {
    look_at_the_demo("mouse");
}

#[test]
fn whom_a_command_for_several_means_is_named_it_expires_and_a_stop_unheard_is_sent_again_under_one_id() {
    look_at_three_pumps("several");
}

#[test]
fn what_was_is_shown_as_long_trends_as_a_moment_and_as_a_journal() {
    look_at_three_pumps("past");
}

#[test]
fn a_moment_of_the_doubled_hour_is_asked_for_twice_and_told_with_its_zone() {
    look_at_three_pumps("autumn");
}

#[test]
fn two_hundred_drives_are_listed_and_searched() {
    let Some(python) = python() else { return };
    let lines: Vec<_> = (0..8).map(|line| Sim::serve(&format!("page-{line}"), &["atv312@1-25"])).collect();
    let mut text = String::new();
    for (number, line) in lines.iter().enumerate() {
        text += &format!("[lines.l{number}]\nport = \"{}\"\n", line.link());
    }
    for drive in 0..200 {
        let (line, slave) = (drive / 25, drive % 25 + 1);
        text += &format!(
            "[[drives]]\nline = \"l{line}\"\ndrive = \"atv312@{slave}\"\nname = \"drive {}\"\n",
            drive + 1
        );
    }
    let config = File::new("page-200", &text);
    look(&python, "many", &["run", "--config", config.path()], &[], None);
}

/// A daemon without a drive beside a line with three, one of a family that is built in and two that files describe, of which one looks
/// like its family: a browser that is let in by a link finds them, names them, looks, and takes control of one.
fn begin_at_the_page(scene: &str) {
    let Some(python) = python() else { return };
    let mut sim = Sim::serve(&format!("page-{scene}"), &["atv312@1", "wj200@3", "goodrive@5"]);
    let (state, socket) = (path(&format!("page-{scene}-state")), path(&format!("page-{scene}.sock")));
    let config =
        File::new(&format!("page-{scene}"), &format!("state = {:?}\n", state.to_str().expect("it is text")));
    let socket = socket.to_str().expect("the path is text");
    let link = || {
        let named = ["anna", "--role", "engineer", "--config", config.path(), "--socket", socket];
        run(&[&["token", "link"], &named[..]].concat()).assert_done().trim().to_owned()
    };
    let port = sim.link().to_owned();
    look_with(
        &python,
        scene,
        &["run", "--config", config.path(), "--socket", socket],
        || vec![link(), port],
        Some(&mut sim),
    );
    // What it has written is read by a person, and by the next daemon.
    let written = std::fs::read_to_string(state.join("added.toml")).expect("it is written");
    assert!(written.starts_with("# Drives that were added at the page of drived."), "{written}");
    assert_eq!(written.matches("control = true").count(), 1, "{written}");
    let checked = run(&["check", "--config", config.path()]);
    assert!(checked.assert_done().contains("added.toml, added at the page"), "{checked:?}");
    // A configuration with drives of its own wins whole, and says so.
    let own = "[lines.a]\nport = \"tcp://192.0.2.1:502\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n";
    let own = File::new(
        &format!("page-{scene}-own"),
        &format!("state = {:?}\n{own}", state.to_str().expect("it is text")),
    );
    let checked = run(&["check", "--config", own.path()]);
    assert!(checked.assert_done().contains("NOT READ: the drives of"), "{checked:?}");
    let _ = std::fs::remove_dir_all(state);
}

/// Three pumps, of which whoever has no token sees and stops all; the tokens that a scene asks for are for all and for one.
fn look_at_three_pumps(scene: &str) {
    let Some(python) = python() else { return };
    let mut pumps = Sim::serve(&format!("page-{scene}"), &["atv312@1-6"]);
    let state = path(&format!("page-{scene}-state"));
    let text = format!(
        "state = {:?}\n[lines.north]\nport = \"{}\"\n[[drives]]\nline = \"north\"\ndrive = \"atv312@1-3\"\nname = \"pump {{}}\"\ncontrol = true\nslow = \"60min\"\n[groups]\n\"the pumps of the second hall behind the old boiler house\" = [\"pump 1\", \"pump 2\", \"pump 3\"]\n",
        state.to_str().expect("the path is text"),
        pumps.link()
    );
    // A stop of all leaves out whom nobody may command here, and says so.
    let text = match scene {
        "long_group" => text.replace(
            "drive = \"atv312@1-3\"\nname = \"pump {}\"\ncontrol = true\n",
            "drive = \"atv312@1-2\"\nname = \"pump {}\"\ncontrol = true\n[[drives]]\nline = \"north\"\ndrive = \"atv312@3\"\nname = \"pump 3\"\n",
        ),
        _ => text,
    };
    let text = if scene == "folded" { text.replace("atv312@1-3", "atv312@1-6") } else { text };
    let config = File::new(&format!("page-{scene}"), &text);
    let token_of = |role, words: &[&str]| {
        let add = ["token", "add", "--role", role, "--config", config.path()];
        run(&[&add, words].concat()).assert_done().trim().to_owned()
    };
    let token = |words: &[&str]| token_of("operate", words);
    let tokens: &[String] = match scene {
        "trip" | "questions" | "axe" | "axe_dark" | "folded" | "alarms" | "touched" | "past" | "several" => {
            &[token(&["operator"])]
        }
        "as_shown" => &[token(&["operator"]), token_of("engineer", &["chief"]), config.path().to_owned()],
        "scoped" | "somebody" => &[token(&["operator"]), token(&["second", "--drive", "pump 2"])],
        _ => &[],
    };
    look(&python, scene, &["run", "--config", config.path()], tokens, Some(&mut pumps));
    let _ = std::fs::remove_dir_all(state);
}

fn look_at_the_demo(scene: &str) {
    if let Some(python) = python() {
        look(&python, scene, &["demo"], &[], None);
    }
}

/// Plays a scene with the page of the program that these arguments start; what it wants to happen is said to the drives.
fn look(python: &Path, scene: &str, arguments: &[&str], tokens: &[String], drives: Option<&mut Sim>) {
    look_with(python, scene, arguments, || tokens.to_vec(), drives);
}

/// The same with what is found out when the program runs.
fn look_with(
    python: &Path,
    scene: &str,
    arguments: &[&str],
    told: impl FnOnce() -> Vec<String>,
    mut drives: Option<&mut Sim>,
) {
    let _alone = ONE_BY_ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let port =
        TcpListener::bind("127.0.0.1:0").expect("a port is free").local_addr().expect("it has one").port();
    let address = format!("127.0.0.1:{port}");
    let log = path(&format!("page-{scene}.log"));
    let file = std::fs::File::create(&log).expect("the directory can be written");
    let mut served = Running::start_unread(&[arguments, &["--http", &address]].concat(), file);
    // The system takes a connection before the program knows where its page is, of which it gives links.
    let is_there = || std::net::TcpStream::connect(&address).is_ok();
    let hello = "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    while !is_there() || ask(port, hello).is_empty() {
        assert!(!served.has_ended(), "{scene}: {}", std::fs::read_to_string(&log).unwrap_or_default());
        look_again();
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page.py");
    let mut looking = Command::new(python)
        .arg(script)
        .args([scene, &format!("http://{address}/")])
        .args(told())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the script starts");
    let orders = BufReader::new(looking.stdout.take().expect("it is piped")).lines();
    for order in orders.map(|line| line.expect("it is text")) {
        drives.as_mut().expect("it wants nothing of the demo").say(&order, "");
    }
    let seen = looking.wait().expect("it is a child");
    assert!(seen.success(), "{scene} is not as it should be");
    let _ = std::fs::remove_file(log);
}

/// A Python with Playwright beside a Chromium, or `None` with the reason printed. `DRIVED_PYTHON` names the interpreter.
fn python() -> Option<PathBuf> {
    let chromium = peers::is_there(peers::runs("/usr/bin/chromium", &["--version"]), "Chromium");
    peers::python_with("playwright, axe_playwright_python").filter(|_| chromium)
}
