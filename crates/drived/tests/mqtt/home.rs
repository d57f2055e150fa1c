//! Home Assistant itself, headless, with its own mqtt integration.

// Not every test program uses everything here.
#![allow(dead_code)]

use std::{
    fs,
    io::{BufRead as _, BufReader, Write as _},
    path::PathBuf,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use serde_json::Value;

use super::{
    rig::Mosquitto,
    support::{free_port, is_there},
};

/// Home Assistant in a folder of its own; killed when dropped.
pub(crate) struct HomeAssistant {
    child: Child,
    input: ChildStdin,
    lines: BufReader<ChildStdout>,
    folder: PathBuf,
}

impl HomeAssistant {
    /// `None` where it is not installed.
    pub(crate) fn python() -> Option<String> {
        let python = std::env::var("DRIVED_HOME_ASSISTANT_PYTHON").unwrap_or_else(|_| "python3".to_owned());
        is_there(&python, &["-c", "import homeassistant.components.mqtt.client"]).then_some(python)
    }

    pub(crate) fn start(python: &str, folder: PathBuf, broker: &Mosquitto) -> Self {
        fs::create_dir_all(&folder).expect("the directory can be written");
        fs::write(folder.join("configuration.yaml"), "").expect("the directory can be written");
        let mut child = Command::new(python)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mqtt/home_assistant.py"))
            .arg(&folder)
            .args([broker.port.to_string(), free_port().to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python runs");
        let (input, out) = (child.stdin.take().expect("a pipe"), child.stdout.take().expect("a pipe"));
        let mut home = Self { child, input, lines: BufReader::new(out), folder };
        println!("Home Assistant {}", home.answer());
        home
    }

    fn answer(&mut self) -> Value {
        let mut line = String::new();
        self.lines.read_line(&mut line).expect("it is text");
        assert!(!line.is_empty(), "Home Assistant has ended");
        serde_json::from_str(&line).expect("it is JSON")
    }

    /// Says a line, and gives what is answered.
    #[track_caller]
    pub(crate) fn say(&mut self, line: &str) -> Value {
        writeln!(self.input, "{line}").expect("it reads");
        let answer = self.answer();
        assert!(answer.get("error").is_none(), "{line}: {answer:#}");
        answer
    }

    /// Waits until an entity is in a state, and gives its attributes.
    #[track_caller]
    pub(crate) fn wait(&mut self, entity: &str, state: &str) -> Value {
        self.say(&format!("wait {entity} {state}"))
    }

    /// Commands a drive, and gives what became of it; once more where that expired before it was sent, as a person does whose disk is
    /// slow to write the audit log.
    #[track_caller]
    pub(crate) fn command(&mut self, line: &str, drive: &str) -> Value {
        let last = format!("sensor.{drive}_last_command");
        loop {
            let before = self.entity(&last)["attributes"]["arrived_unix_ms"].to_string();
            self.say(line);
            let told = self.say(&format!("outcome {last} {before}"));
            if told["outcome"] != "expired" {
                return told;
            }
        }
    }

    /// An entity as it is now: its state, its attributes, and when that was told.
    #[track_caller]
    pub(crate) fn entity(&mut self, entity: &str) -> Value {
        self.say(&format!("entity {entity}"))
    }

    #[track_caller]
    pub(crate) fn state(&mut self, entity: &str) -> String {
        let states = self.say("states");
        states[entity].as_str().unwrap_or_else(|| panic!("{entity} is none of {states:#}")).to_owned()
    }

    /// The states that an entity has been in since they were forgotten.
    #[track_caller]
    pub(crate) fn seen(&mut self, entity: &str) -> Vec<String> {
        serde_json::from_value(self.say(&format!("seen {entity}"))["states"].take()).expect("states")
    }

    /// What it has complained of but for the connection, which the test cuts, and for its own integration.
    #[track_caller]
    pub(crate) fn complaints(&mut self) -> Vec<String> {
        let log: Vec<String> = serde_json::from_value(self.say("log")["log"].take()).expect("lines");
        let is_of_the_cut = |line: &String| line.contains("connect") || line.contains("Connect");
        let is_its_own = |line: &String| line.starts_with("homeassistant.helpers.frame: ");
        log.into_iter().filter(|line| !is_of_the_cut(line) && !is_its_own(line)).collect()
    }

    /// Ends it as its own service does, and gives its folder.
    pub(crate) fn end(mut self) -> PathBuf {
        self.say("end");
        self.child.wait().expect("it ends");
        std::mem::take(&mut self.folder)
    }
}

impl Drop for HomeAssistant {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if !self.folder.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}
