//! A mosquitto, its clients, and a daemon over two simulated pumps on it.

// Not every test program uses everything here.
#![allow(dead_code)]

use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
};

use serde_json::{Value, json};

use super::support::{File, Running, Sim, free_port, is_there, look_again, path};

/// Longer than anything here takes: what hangs fails.
pub(crate) const PATIENCE_S: &str = "60";

/// A mosquitto; killed when dropped.
pub(crate) struct Mosquitto {
    pub(crate) child: Child,
    pub(crate) port: u16,
    pub(crate) config: PathBuf,
}

impl Mosquitto {
    /// `None` where it is not installed.
    pub(crate) fn start(name: &str) -> Option<Self> {
        Self::with(name, "allow_anonymous true")
    }

    /// The same with these lines of its configuration.
    pub(crate) fn with(name: &str, more: &str) -> Option<Self> {
        if !is_there("sh", &["-c", "command -v mosquitto mosquitto_pub mosquitto_sub"]) {
            return None;
        }
        let (port, config) = (free_port(), path(&format!("{name}.mosquitto")));
        // As whoever runs the test: its files are in a folder of his.
        fs::write(&config, format!("user root\nlistener {port} 127.0.0.1\n{more}\n"))
            .expect("it can be written");
        let mut broker = Self { child: spawn(&config), port, config };
        broker.wait();
        Some(broker)
    }

    /// Kills it as a power cut does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it ends");
    }

    pub(crate) fn start_again(&mut self) {
        self.child = spawn(&self.config);
        self.wait();
    }

    /// Waits until it takes connections.
    pub(crate) fn wait(&mut self) {
        while std::net::TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            assert!(self.child.try_wait().expect("it can be waited for").is_none(), "mosquitto has ended");
            look_again();
        }
    }

    /// Publishes as a client of mosquitto does, over MQTT v5.
    pub(crate) fn publish(&self, topic: &str, payload: &str, more: &[&str]) {
        let port = self.port.to_string();
        let mut command = Command::new("mosquitto_pub");
        command.args(["-V", "5", "-p", &port, "-t", topic, "-m", payload]).args(more);
        let output = command.output().expect("mosquitto_pub runs");
        assert!(output.status.success(), "{output:?}");
    }

    /// Hears these topics from now on.
    pub(crate) fn hear(&self, topics: &[&str]) -> Ear {
        self.hear_as(topics, &[])
    }

    pub(crate) fn hear_as(&self, topics: &[&str], more: &[&str]) -> Ear {
        let port = self.port.to_string();
        let mut command = Command::new("mosquitto_sub");
        command.args(["-V", "5", "-p", &port, "-q", "1", "-W", PATIENCE_S, "-F", "%r %t %p"]).args(more);
        // It hears itself before anything else: it is subscribed then.
        let own = format!("heard/{}", path("ear").display().to_string().replace('/', ""));
        for topic in topics.iter().chain(&[own.as_str()]) {
            command.args(["-t", topic]);
        }
        let mut child = command.stdout(Stdio::piped()).spawn().expect("mosquitto_sub runs");
        let lines = BufReader::new(child.stdout.take().expect("stdout is read"));
        Ear { child, lines }
    }
}

pub(crate) fn spawn(config: &Path) -> Child {
    let mut command = Command::new("mosquitto");
    command.args(["-c", config.to_str().expect("the path is text")]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("mosquitto runs")
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_file(&self.config);
    }
}

/// A mosquitto_sub.
pub(crate) struct Ear {
    pub(crate) child: Child,
    pub(crate) lines: BufReader<ChildStdout>,
}

impl Ear {
    /// The next message that is as it should be: its topic, its payload as JSON or as text, and whether it was retained.
    #[track_caller]
    pub(crate) fn until(&mut self, is_it: impl Fn(&str, &Value) -> bool) -> (String, Value, bool) {
        let mut heard = Vec::new();
        loop {
            let mut line = String::new();
            self.lines.read_line(&mut line).expect("it is text");
            assert!(!line.is_empty(), "the message did not come; heard: {heard:#?}");
            let mut parts = line.trim_end_matches('\n').splitn(3, ' ');
            let mut part = || parts.next().unwrap_or_default();
            let (retained, topic, payload) = (part() == "1", part().to_owned(), part());
            let payload = serde_json::from_str(payload).unwrap_or_else(|_| Value::from(payload));
            if is_it(&topic, &payload) {
                return (topic, payload, retained);
            }
            heard.push(line);
        }
    }

    /// The next final outcome of the command of this id.
    #[track_caller]
    pub(crate) fn outcome(&mut self, id: &str) -> Value {
        self.until(|to, said| {
            !to.ends_with("/last_command")
                && said["id"] == id
                && said["outcome"] != "accepted"
                && said.get("outcome").is_some()
        })
        .1
    }
}

impl Drop for Ear {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A daemon over two simulated pumps on a broker.
pub(crate) struct Daemon {
    pub(crate) running: Option<Running>,
    pub(crate) sim: Sim,
    pub(crate) file: File,
    pub(crate) socket: PathBuf,
}

impl Daemon {
    pub(crate) fn start(name: &str, mqtt: &str) -> Self {
        Self::start_with(name, "", mqtt)
    }

    /// The same with more at the head of its configuration.
    pub(crate) fn start_with(name: &str, head: &str, mqtt: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2"]);
        let text = format!(
            "{head}[http]\nlisten = \"off\"\n[mqtt]\ncommands = true\n{mqtt}\n[defaults]\ncontrol = true\n\
             watchdog = {{ time = \"10s\", reaction = \"ramp\" }}\nfrequency = {{ forbidden = [[20, 22]] }}\n\
             [lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            sim.link()
        );
        let mut daemon =
            Self { running: None, sim, file: File::new(name, &text), socket: path(&format!("{name}.sock")) };
        daemon.start_again();
        daemon
    }

    pub(crate) fn on(name: &str, broker: &Mosquitto) -> Self {
        Self::start(name, &format!("servers = [\"mqtt://127.0.0.1:{}\"]\nheartbeat = \"1s\"", broker.port))
    }

    pub(crate) fn start_again(&mut self) {
        let socket = self.socket.to_str().expect("the path is text");
        self.running = Some(Running::start(&["run", "--config", self.file.path(), "--socket", socket]));
    }

    pub(crate) fn log_until(&mut self, text: &str) {
        self.running.as_mut().expect("it runs").wait_for_log(text);
    }

    /// Whether the motor of the first pump turns, as somebody sees who stands beside it.
    pub(crate) fn turns(&mut self) -> bool {
        let seen = self.sim.say("atv312@1 show", "shaft");
        !seen.contains("shaft 0.00 Hz")
    }

    pub(crate) fn kill(&mut self) {
        let mut running = self.running.take().expect("it runs");
        running.signal("-KILL");
        let _ = running.end();
    }
}

/// Waits until a drive can be started.
pub(crate) fn ready(ear: &mut Ear, number: u8) {
    let topic = format!("drived/drive/pump_{number}/state");
    ear.until(|to, said| to == topic && said["link"] == "connected" && said.get("start_refused").is_none());
}

pub(crate) fn start(id: &str) -> String {
    json!({ "id": id, "action": "start", "setpoint": { "frequency_hz": 30.0 }, "expires_in_ms": 10_000 })
        .to_string()
}
