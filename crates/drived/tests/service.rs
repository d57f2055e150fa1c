//! `run` under a service manager: what it tells it, over a socket of the test that stands for systemd's.
#![cfg(unix)]

mod support;

use std::os::unix::net::UnixDatagram;

use support::{File, Running, Sim, drived, path};

/// The socket of a service manager.
struct Manager {
    socket: UnixDatagram,
    path: std::path::PathBuf,
}

impl Manager {
    fn new(name: &str) -> Self {
        let path = path(&format!("{name}.notify"));
        let socket = UnixDatagram::bind(&path).expect("the directory can be written");
        Self { socket, path }
    }

    /// Starts the daemon as a service whose watchdog wants a word each two seconds.
    fn start(&self, file: &File) -> Running {
        let mut command = drived(&["run", "--config", file.path()]);
        command.env("NOTIFY_SOCKET", &self.path).env("WATCHDOG_USEC", "2000000");
        Running::of(&mut command)
    }

    /// The next message that has a line that begins so, and what came before it.
    fn wait_for(&self, begins: &str) -> (Vec<String>, Vec<String>) {
        let mut before = Vec::new();
        loop {
            let mut bytes = [0; 4_096];
            let read = self.socket.recv(&mut bytes).expect("it is listened to");
            let text = std::str::from_utf8(&bytes[..read]).expect("it is text");
            let lines: Vec<String> = text.lines().map(str::to_owned).collect();
            if lines.iter().any(|line| line.starts_with(begins)) {
                return (lines, before);
            }
            before.extend(lines);
        }
    }
}

impl Drop for Manager {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// A line `NAME` with one drive.
fn line(name: &str, port: &str, keys: &str) -> String {
    format!(
        "[lines.{name}]\nport = \"{port},19200,8E1\"\n[[drives]]\nline = \"{name}\"\ndrive = \"atv312@1\"\n\
         name = \"{name} 1\"\n{keys}\n"
    )
}

#[test]
fn the_service_is_ready_says_what_it_does_and_lives_although_a_port_is_missing() {
    let sim = Sim::serve("service", &["atv312@1"]);
    let text = [line("north", sim.link(), ""), line("south", "/dev/nowhere", "")].concat();
    let file = File::new("service", &text);
    let manager = Manager::new("service");
    let daemon = manager.start(&file);
    let (_, before) = manager.wait_for("READY=1");
    assert!(!before.iter().any(|line| line.starts_with("WATCHDOG")), "{before:?}");
    manager.wait_for("STATUS=1 of 2 drives connected; lost: south 1");
    for _ in 0..3 {
        manager.wait_for("WATCHDOG=1");
    }
    let told = std::thread::spawn(move || daemon.interrupt().0);
    manager.wait_for("STOPPING=1");
    assert_eq!(told.join().expect("it ends"), Some(0));
}

#[test]
fn a_service_whose_motors_come_down_asks_for_the_time_that_they_need() {
    let mut sim = Sim::serve("ramps", &["atv312@1"]);
    sim.on("atv312@1", &["setpoint", "30Hz"]).assert_done();
    sim.on("atv312@1", &["start"]).assert_done();
    let file = File::new("ramps", &line("north", sim.link(), "control = true\non_exit_adopted = \"stop\""));
    let manager = Manager::new("ramps");
    let mut daemon = manager.start(&file);
    daemon.wait_for(r#""state":"running""#);
    sim.say("line cut", "done");
    daemon.wait_for(r#""event":"lost""#);
    daemon.signal("-TERM");
    manager.wait_for("STOPPING=1");
    for _ in 0..2 {
        // It may have been asked to end before its drives were.
        let (words, before) = manager.wait_for("STATUS=ending, waits for north 1");
        assert!(words.contains(&"EXTEND_TIMEOUT_USEC=10000000".to_owned()), "{words:?}");
        assert!(!before.iter().any(|line| line.starts_with("WATCHDOG")), "{before:?}");
    }
    sim.say("line join", "done");
    // The motor is stopped, and the service ends well.
    assert_eq!(daemon.end().0, Some(0));
}

#[test]
fn a_service_that_reads_its_configuration_again_says_when_it_began_and_when_it_is_ready() {
    let sim = Sim::serve("reloading", &["atv312@1"]);
    let file = File::new("reloading", &line("north", sim.link(), ""));
    let manager = Manager::new("reloading");
    let mut daemon = manager.start(&file);
    manager.wait_for("READY=1");
    daemon.signal("-HUP");
    // sd_notify(3): the monotonic clock in microseconds, in the same message.
    let (words, before) = manager.wait_for("RELOADING=1");
    let clock = words.iter().find_map(|word| word.strip_prefix("MONOTONIC_USEC="));
    assert!(clock.is_some_and(|clock| clock.parse::<u64>().is_ok_and(|clock| clock > 0)), "{words:?}");
    assert!(!before.contains(&"READY=1".to_owned()), "{before:?}");
    manager.wait_for("READY=1");
    let told = std::thread::spawn(move || daemon.interrupt().0);
    manager.wait_for("STOPPING=1");
    assert_eq!(told.join().expect("it ends"), Some(0));
}
