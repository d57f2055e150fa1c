//! `monitor` on a real terminal, over a real daemon on a simulated line: the stop keys, a daemon that goes, a terminal that is
//! held. In real time; nothing here asserts a duration.
#![cfg(target_os = "linux")]

mod support;
#[path = "support/terminal.rs"]
mod terminal;

use std::path::PathBuf;

use support::{Ended, File, Running, Sim, drived, path, run};
use terminal::Terminal;

/// Ctrl-S, Ctrl-T, Ctrl-C.
const STOP_ALL: &str = "\u{13}";
const STOP_THIS: &str = "\u{14}";
const END: &str = "\u{3}";

/// A daemon over two simulated drives, `pump 1` and `pump 2`.
struct Plant {
    daemon: Option<Running>,
    _sim: Sim,
    file: File,
    socket: PathBuf,
}

impl Plant {
    fn start(name: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2"]);
        let text = format!(
            "[http]\nlisten = \"off\"\n[defaults]\ncontrol = true\nwatchdog = {{ time = \"10s\", reaction = \"ramp\" }}\n\
             [groups]\npumps = [\"pump 1\", \"pump 2\"]\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            sim.link()
        );
        let file = File::new(name, &text);
        let mut plant = Self { daemon: None, _sim: sim, file, socket: path(&format!("{name}.sock")) };
        plant.run();
        plant
    }

    fn run(&mut self) {
        let mut daemon = Running::start(&["run", "--config", self.file.path(), "--socket", self.socket()]);
        for _ in 0..2 {
            daemon.wait_for(r#""event":"watchdog_verified""#);
        }
        self.daemon = Some(daemon);
    }

    /// Both motors turn.
    fn turn(&self) {
        let started = self.ask(&["start", "pumps", "--setpoint", "20Hz"]);
        started.assert_done();
    }

    fn end(&mut self) {
        self.daemon.take().expect("it runs").interrupt();
    }

    fn socket(&self) -> &str {
        self.socket.to_str().expect("the path is text")
    }

    fn ask(&self, subcommand: &[&str]) -> Ended {
        run(&[subcommand, &["--socket", self.socket()]].concat())
    }

    fn monitor(&self, columns: u16, rows: u16) -> Terminal {
        Terminal::start(&mut drived(&["monitor", "--socket", self.socket()]), columns, rows)
    }

    /// Whether each drive says that its motor stands.
    fn stands(&self) -> bool {
        let state: serde_json::Value =
            serde_json::from_str(self.ask(&["status", "--json"]).assert_done()).expect("an object");
        let drives = state["drives"].as_array().expect("there are drives");
        drives.iter().all(|drive| {
            let status = &drive["status"];
            status["quality"] == "good"
                && status["state"] != "running"
                && status["output_frequency_hz"] == 0.0
        })
    }
}

#[test]
fn the_stop_key_stops_every_motor_while_a_search_is_typed_and_counts_them_until_all_are_confirmed() {
    let plant = Plant::start("monitor-stop");
    plant.turn();
    let mut monitor = plant.monitor(80, 24);
    monitor.wait_until("two that run", |screen| screen.matches("running fwd").count() == 2);
    monitor.press("/2");
    monitor.wait_for("search: 2_");
    monitor.press(STOP_ALL);
    let screen = monitor.wait_for("2 confirmed, 0 pending, 0 not reachable");
    assert!(screen.contains("STOP ALL") && screen.contains("no emergency stop"), "{screen}");
    assert!(plant.stands());
    monitor.press("\u{1b}");
    monitor.wait_until("an end of the search", |screen| !screen.contains("search:"));
    monitor.press("3");
    monitor.wait_for("ramp stop by local, socket");
    monitor.press(END);
    let (code, screen, is_given_back) = monitor.end();
    assert_eq!((code, is_given_back), (Some(0), true), "{screen}");
}

#[test]
fn the_key_of_one_drive_stops_that_one_alone() {
    let plant = Plant::start("monitor-one");
    plant.turn();
    let mut monitor = plant.monitor(60, 20);
    monitor.wait_until("two that run", |screen| screen.matches("running fwd").count() == 2);
    monitor.press("\u{1b}[B\u{1b}[B");
    monitor.wait_for("▸ pump 2");
    monitor.press(STOP_THIS);
    monitor.wait_for("STOP pump 2");
    let screen = monitor.wait_for("1 confirmed, 0 pending, 0 not reachable");
    assert!(screen.contains("running fwd"), "{screen}");
    monitor.press("q");
    assert_eq!(monitor.end().0, Some(0));
}

#[test]
fn a_terminal_that_is_held_holds_up_no_stop() {
    let plant = Plant::start("monitor-held");
    plant.turn();
    let mut monitor = plant.monitor(120, 40);
    monitor.wait_until("two that run", |screen| screen.matches("running fwd").count() == 2);
    monitor.hold(true);
    monitor.press(STOP_ALL);
    while !plant.stands() {}
    monitor.hold(false);
    monitor.wait_for("2 confirmed, 0 pending, 0 not reachable");
    monitor.press(END);
    let (code, screen, is_given_back) = monitor.end();
    assert_eq!((code, is_given_back), (Some(0), true), "{screen}");
}

#[test]
fn everything_is_old_when_the_daemon_has_gone_and_a_stop_is_given_as_soon_as_it_is_back() {
    let mut plant = Plant::start("monitor-gone");
    let mut monitor = plant.monitor(80, 24);
    monitor.wait_until("live drives", |screen| screen.matches("live").count() >= 3);
    plant.end();
    let screen = monitor.wait_for("everything below is old");
    assert!(screen.contains("NOT CONNECTED"), "{screen}");
    let screen = monitor.wait_until("ages", |screen| screen.matches(" old").count() >= 3);
    assert!(screen.contains("(0.0)") && !screen.contains("live"), "{screen}");
    monitor.press(STOP_ALL);
    monitor.wait_for("NOT SENT YET");
    plant.run();
    monitor.wait_for("2 confirmed, 0 pending, 0 not reachable");
    monitor.wait_until("live drives", |screen| screen.matches("live").count() >= 3);
    monitor.press(END);
    assert_eq!(monitor.end().0, Some(0));
}

#[test]
fn a_line_of_its_own_has_a_stop_key_too_and_a_stop_that_is_not_confirmed_ends_with_an_alarm() {
    let mut sim = Sim::serve("monitor-line", &["atv312@1-2"]);
    let arguments = ["monitor", "--line", sim.link(), "--drive", "atv312@1-2"];
    let mut monitor = Terminal::start(&mut drived(&arguments), 80, 24);
    monitor.wait_until("live drives", |screen| screen.matches("live").count() >= 3);
    monitor.press(STOP_ALL);
    monitor.wait_for("2 confirmed, 0 pending, 0 not reachable");
    sim.say("atv312@2 cable cut", "done");
    monitor.wait_for("!atv312@2");
    monitor.press(STOP_ALL);
    monitor.wait_for("1 confirmed, 0 pending, 1 not reachable");
    monitor.press("q");
    let (code, screen, is_given_back) = monitor.end();
    assert_eq!((code, is_given_back), (Some(1), true), "{screen}");
    assert!(screen.contains("STOP NOT CONFIRMED"), "{screen}");
}

#[test]
fn it_draws_what_the_terminal_has_and_ends_in_order_with_it() {
    let sim = Sim::serve("monitor-plain", &["atv312@1"]);
    let arguments = ["monitor", "--line", sim.link(), "--drive", "atv312@1"];
    let mut monitor = Terminal::start(drived(&arguments).env("LANG", "C"), 80, 24);
    let screen =
        monitor.wait_until("a live drive", |screen| screen.contains("0.0 A") && screen.contains("live"));
    assert!(screen.is_ascii(), "{screen}");
    assert!(!monitor.loses_output_by_a_signal());
    monitor.hang_up();
    let (code, screen, is_given_back) = monitor.end();
    assert_eq!((code, is_given_back), (Some(0), true), "{screen}");
    let dumb = Terminal::start(drived(&arguments).env("TERM", "dumb"), 80, 24);
    let (code, screen, _) = dumb.end();
    assert!(
        code == Some(2) && screen.contains("TERM=dumb has none: drived watch prints"),
        "{code:?} {screen}"
    );
}

#[test]
fn without_a_terminal_it_is_refused_and_told_what_to_use() {
    run(&["monitor"]).assert_refused(2, "needs a terminal for its picture and its keys: drived watch prints");
}
