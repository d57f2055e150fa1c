//! Who is told of alarms by a POST: the recipes of the crate's README with receivers of this test in the places of the hosts they name,
//! one of them over somebody else's library. Over a pty, in real time; nothing here asserts a duration.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::{ErrorKind, Read as _, Write as _},
    net::{TcpListener, TcpStream},
    os::unix::fs::PermissionsExt as _,
    path::PathBuf,
    process::Command,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use support::{Running, Sim, free_port, get, look_again, path, python_with, run};

/// How long something may take to come true.
const PATIENCE: Duration = Duration::from_secs(60);
const README: &str = include_str!("../../drived-webhook/README.md");

/// A drive, and a daemon with receivers of its alarms.
struct Plant {
    sim: Sim,
    folder: PathBuf,
    http: u16,
}

impl Plant {
    fn new(name: &str) -> Self {
        let folder = path(&format!("{name}-folder"));
        fs::create_dir_all(&folder).expect("the directory can be written");
        Self { sim: Sim::serve(name, &["atv312@1"]), folder, http: free_port() }
    }

    fn file(&self, name: &str) -> String {
        self.folder.join(name).to_str().expect("the path is text").to_owned()
    }

    fn secret(&self, name: &str, text: &str) {
        fs::write(self.file(name), text).expect("it can be written");
        fs::set_permissions(self.file(name), fs::Permissions::from_mode(0o600)).expect("it is ours");
    }

    fn configure(&self, webhooks: &str) {
        let text = format!(
            "state = \"state\"\n[http]\nlisten = \"127.0.0.1:{}\"\n[lines.bench]\nport = \"{},19200,8E1\"\n[[drives]]\n\
             line = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump\"\ncontrol = true\n{webhooks}",
            self.http,
            self.sim.link()
        );
        fs::write(self.file("drives.toml"), text).expect("it can be written");
    }

    fn daemon(&self) -> Running {
        let (file, socket) = (self.file("drives.toml"), self.file("socket"));
        let mut daemon = Running::start(&["run", "--config", &file, "--socket", &socket]);
        daemon.wait_for(r#""event":"identified""#);
        daemon
    }

    fn on_socket(&self, arguments: &[&str]) -> Value {
        let socket = self.file("socket");
        let told = run(&[arguments, &["--json", "--socket", &socket]].concat());
        serde_json::from_str(told.assert_done()).expect("it is JSON")
    }

    fn tripped(&self) -> Option<Value> {
        let alarms = self.on_socket(&["alarms", "list"]);
        let mut alarms = alarms["alarms"].as_array().expect("a list").iter();
        alarms.find(|alarm| alarm["kind"] == "tripped").cloned()
    }

    fn acknowledge(&self, note: &str) {
        let id = self.tripped().expect("it is tripped")["id"].to_string();
        self.on_socket(&["alarms", "acknowledge", &id, "--note", note]);
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// What was posted: its head in small letters, and its body.
struct Posted {
    head: String,
    body: String,
}

impl Posted {
    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }

    fn id(&self) -> &str {
        self.head.lines().find_map(|line| line.strip_prefix("webhook-id: ")).expect("each message has an id")
    }
}

/// The next thing that is posted about a trip, answered by this status. A busy machine may lose the link for a moment, which is told too.
fn receive(listener: &TcpListener, status: &str) -> Posted {
    listener.set_nonblocking(true).expect("it can be asked");
    let until = Instant::now() + PATIENCE;
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                let (posted, mut stream) = read(stream);
                let is_of_trip = posted.body.contains("tripped");
                let status = if is_of_trip { status } else { "204 No Content" };
                write!(stream, "HTTP/1.1 {status}\r\n\r\n").expect("it is read");
                if is_of_trip {
                    return posted;
                }
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => look_again(),
            Err(error) => panic!("{error}"),
        }
        assert!(Instant::now() < until, "nothing is posted");
    }
}

fn read(mut stream: TcpStream) -> (Posted, TcpStream) {
    stream.set_nonblocking(false).expect("it waits");
    stream.set_read_timeout(Some(PATIENCE)).expect("it does not wait for ever");
    let mut request = String::new();
    loop {
        let mut bytes = [0; 4_096];
        let count = stream.read(&mut bytes).expect("it is posted whole");
        assert_ne!(count, 0, "it was cut: {request}");
        request.push_str(std::str::from_utf8(&bytes[..count]).expect("it is text in one piece"));
        let Some((head, body)) = request.split_once("\r\n\r\n") else { continue };
        let head = head.to_ascii_lowercase();
        let length = head.lines().find_map(|line| line.strip_prefix("content-length: "));
        if length.is_some_and(|length| length.parse() == Ok(body.len())) {
            let body = body.to_owned();
            return (Posted { head, body }, stream);
        }
    }
}

fn listener() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a port");
    let address = listener.local_addr().expect("it is bound");
    (listener, format!("http://{address}"))
}

/// The blocks of the README in this language, in their order.
fn recipes(language: &str) -> Vec<&'static str> {
    let begin = format!("```{language}\n");
    let blocks = README.split(begin.as_str()).skip(1);
    blocks.map(|block| block.split("```").next().unwrap_or_default()).collect()
}

/// Trips the drive, and takes the trip back.
fn trip(sim: &mut Sim) {
    sim.say("atv312@1 trip 9", "done");
}

fn reset(sim: &mut Sim) {
    sim.say("atv312@1 panel reset", "done");
}

#[test]
fn by_the_recipes_a_phone_is_called_a_channel_told_each_step_and_a_program_sure_who_speaks() {
    let Some(python) = python_with("standardwebhooks") else { return };
    let mut plant = Plant::new("webhook-recipes");
    let ((phone, to_phone), (channel, to_channel), own) = (listener(), listener(), free_port());
    let hosts = [
        ("https://ntfy.example.org", to_phone),
        ("https://hooks.example.com", to_channel),
        ("https://own.example.org", format!("http://127.0.0.1:{own}")),
    ];
    let mut webhooks = recipes("toml").concat();
    for (host, place) in &hosts {
        assert_eq!(webhooks.matches(host).count(), 1, "{webhooks}");
        webhooks = webhooks.replace(host, place);
    }
    plant.secret("ntfy-token", "Bearer tk_of_this_test\n");
    plant.secret("webhook-secret", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n");
    plant.configure(&webhooks);
    fs::write(plant.file("receiver.py"), recipes("python").concat()).expect("it can be written");
    let mut receiver = Command::new(python);
    receiver.args([plant.file("receiver.py"), plant.file("webhook-secret"), own.to_string()]);
    let mut receiver = Running::of(&mut receiver);
    let _daemon = plant.daemon();
    trip(&mut plant.sim);

    // By ntfy's documentation: the body is the message, and the query its title and priority.
    let called = receive(&phone, "200 OK");
    assert!(
        called.head.starts_with("post /plant-7f3a?title=plant&priority=urgent http/1.1"),
        "{}",
        called.head
    );
    assert!(called.head.contains("\r\nauthorization: bearer tk_of_this_test"), "{}", called.head);
    assert!(called.head.contains("\r\ncontent-type: text/plain"), "{}", called.head);
    assert!(called.body.starts_with("pump: tripped: "), "{}", called.body);

    // By Slack's: an object with `text`.
    let told = || receive(&channel, "200 OK").json();
    let first = told();
    let text = first["text"].as_str().expect("a text");
    assert_eq!(first.as_object().map(serde_json::Map::len), Some(1), "{first}");
    assert!(
        text.starts_with("*pump*: tripped: ") && text.contains("(unacknowledged, 1 times since "),
        "{text}"
    );

    let mut known = || {
        let line = receiver.wait_for("\"kind\": \"tripped\"");
        serde_json::from_str::<Value>(&line).expect("it prints what it was told")
    };
    let came = known();
    let listed = plant.tripped().expect("it is tripped");
    assert_eq!(came["alarm"], listed, "what the API tells");
    plant.acknowledge("the mechanic comes at 2");
    let seen = known();
    assert_eq!(seen["alarm"]["acknowledged"]["note"], "the mechanic comes at 2");
    assert_ne!(seen["id"], came["id"]);
    let text = told()["text"].as_str().expect("a text").to_owned();
    assert!(text.contains("(acknowledged, ") && text.ends_with("the mechanic comes at 2"), "{text}");
    reset(&mut plant.sim);
    assert_eq!(known()["alarm"]["state"], "over");
    assert!(told()["text"].as_str().is_some_and(|text| text.contains("(over, ")));
    // The phone is called for the next one, and not for what became of this one.
    trip(&mut plant.sim);
    let called = receive(&phone, "200 OK");
    assert!(called.body.contains("(unacknowledged)"), "{}", called.body);
    // Somebody who does not know the secret is not believed.
    let forged = "{\"id\":\"x\",\"alarm\":{}}\r\n";
    let answer = support::ask(
        own,
        &format!(
            "POST / HTTP/1.0\r\nContent-Length: {}\r\nwebhook-id: x\r\nwebhook-timestamp: 1\r\nwebhook-signature: v1,AAAA\r\n\r\n{forged}",
            forged.len()
        ),
    );
    assert!(answer.contains(" 401 "), "{answer}");
}

#[test]
fn nothing_is_lost_while_a_receiver_is_down_and_a_restart_tells_nothing_twice() {
    let mut plant = Plant::new("webhook-down");
    let (listener, place) = listener();
    plant.configure(&format!("[[webhooks]]\nurl = \"{place}/a\"\nhost = \"north 1\"\n"));
    let daemon = plant.daemon();
    trip(&mut plant.sim);
    let first = receive(&listener, "503 Service Unavailable");
    let again = receive(&listener, "200 OK");
    assert!(first.id().starts_with("north_1-") && first.id() == again.id(), "{} {}", first.id(), again.id());
    assert_eq!(first.body, again.body);
    assert_eq!(again.json()["alarm"]["state"], "unacknowledged");
    assert_eq!(daemon.interrupt().0, Some(0));
    let daemon = plant.daemon();
    plant.acknowledge("seen");
    assert_eq!(
        receive(&listener, "200 OK").json()["alarm"]["state"],
        "acknowledged",
        "the trip is not told again"
    );
    let address = listener.local_addr().expect("it is bound");
    drop(listener);
    reset(&mut plant.sim);
    let until = Instant::now() + PATIENCE;
    while plant.tripped().is_some() {
        assert!(Instant::now() < until, "it is not over");
    }
    drop(daemon);
    let _daemon = plant.daemon();
    let listener = TcpListener::bind(address).expect("the port is free again");
    let over = receive(&listener, "204 No Content").json();
    assert_eq!(
        (&over["alarm"]["state"], &over["alarm"]["id"]),
        (&json!("over"), &again.json()["alarm"]["id"])
    );
}

#[test]
fn a_receiver_that_never_answers_holds_up_neither_another_nor_a_command_and_a_reload_takes_it_out() {
    let mut plant = Plant::new("webhook-silent");
    // Connections to it are made, and nobody ever reads or answers.
    let ((_silent, to_silent), (well, to_well)) = (listener(), listener());
    let of_well = format!("[[webhooks]]\nname = \"well\"\nurl = \"{to_well}/\"\n");
    plant.configure(&format!(
        "[[webhooks]]\nname = \"silent\"\nurl = \"{to_silent}/\"\ntimeout = \"1s\"\n{of_well}"
    ));
    let mut daemon = plant.daemon();
    trip(&mut plant.sim);
    assert_eq!(receive(&well, "200 OK").json()["alarm"]["state"], "unacknowledged");
    let counted = |what: &str| get(plant.http, "/metrics", "text/plain").contains(what);
    let until = Instant::now() + PATIENCE;
    while !counted("drived_webhook_failed_attempts_total{receiver=\"silent\",reason=\"timeout\"} 1") {
        assert!(Instant::now() < until, "nothing is counted");
        look_again();
    }
    assert!(counted("drived_webhook_queue_messages{receiver=\"silent\"} 1"));
    assert!(counted("drived_webhook_queue_messages{receiver=\"well\"} 0"));
    let stopped = plant.on_socket(&["stop", "pump"]);
    assert!(
        ["confirmed", "nothing_to_do"].contains(&stopped["outcome"].as_str().unwrap_or_default()),
        "{stopped}"
    );
    plant.configure(&of_well);
    daemon.signal("-HUP");
    daemon.wait_for_log("configuration read again: webhooks closed and opened anew\n");
    plant.acknowledge("seen");
    assert_eq!(
        receive(&well, "200 OK").json()["alarm"]["state"],
        "acknowledged",
        "what it knows is not told again"
    );
    assert!(!counted("silent"));
    assert_eq!(daemon.interrupt().0, Some(0));
}
