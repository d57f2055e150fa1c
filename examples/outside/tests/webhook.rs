//! The program with the webhook, its receiver played here: each alarm arrives, and none is lost while the receiver is down.
#![cfg(unix)]

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _, Write as _},
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Stdio},
    thread::sleep,
    time::Duration,
};

const A_MOMENT: Duration = Duration::from_millis(50);

/// A program that is killed at the end.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A program, and its input.
fn start(arguments: &[&str]) -> (Running, ChildStdin) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_plant-of-mine"));
    let mut child = program.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let stdin = child.stdin.take().unwrap();
    (Running(child), stdin)
}

/// What it prints until it says this, and the rest to nobody.
fn wait_for(program: &mut Running, text: &str) {
    let mut lines = BufReader::new(program.0.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains(text)), "it ended without {text}");
    std::thread::spawn(|| lines.for_each(drop));
}

/// The next thing that is posted, answered by this status.
fn receive(listener: &TcpListener, status: u16) -> serde_json::Value {
    listener.set_nonblocking(true).unwrap();
    // A program that posts nothing is no reason to wait for ever.
    let accepted = (0..1_200).find_map(|_| listener.accept().map_err(|_| sleep(A_MOMENT)).ok());
    let (mut stream, _) = accepted.expect("something is posted");
    stream.set_nonblocking(false).unwrap();
    let mut request = Vec::new();
    loop {
        let mut bytes = [0; 4_096];
        let count = stream.read(&mut bytes).unwrap();
        assert_ne!(count, 0, "it was cut");
        request.extend_from_slice(&bytes[..count]);
        let text = String::from_utf8_lossy(&request);
        if let Some(told) = text.split_once("\r\n\r\n").and_then(|(_, body)| body.parse().ok()) {
            stream.write_all(format!("HTTP/1.1 {status} \r\n\r\n").as_bytes()).unwrap();
            return told;
        }
    }
}

/// The next alarm that is no loss of the link: a machine that is busy may lose one for a moment.
fn tripped(listener: &TcpListener, status: u16) -> String {
    loop {
        let told = receive(listener, status);
        let text = told["text"].as_str().unwrap_or_default().to_owned();
        if text.starts_with("tripped") {
            return text;
        }
    }
}

fn configuration(folder: &Path, receiver: &str) -> PathBuf {
    let [link, file, state] = ["line", "fans.toml", "state"].map(|name| folder.join(name));
    let text = format!(
        "state = {state:?}\n[http]\nlisten = \"off\"\n[webhook]\nreceiver = \"{receiver}/alarms\"\n\
         [lines.fans]\nport = \"{},19200,8E1\"\n[[drives]]\nline = \"fans\"\ndrive = \"fan1@1\"\n",
        link.display()
    );
    fs::write(&file, text).unwrap();
    file
}

#[test]
fn each_alarm_arrives_once_and_none_is_lost_while_the_receiver_is_down() {
    let folder = std::env::temp_dir().join(format!("webhook-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let receiver = listener.local_addr().unwrap();
    let file = configuration(&folder, &receiver.to_string());
    let (link, socket) = (folder.join("line"), folder.join("socket"));
    let (_sim, mut sim) = start(&["sim", "--pty", link.to_str().unwrap(), "--drive", "fan1@1"]);
    while !link.exists() {
        sleep(A_MOMENT);
    }
    let [file, socket] = [&file, &socket].map(|path| path.to_str().unwrap());
    let (mut daemon, _stdin) = start(&["run", "--json", "--config", file, "--socket", socket]);
    wait_for(&mut daemon, r#""event":"connected""#);
    let mut at_the_fan = |what: &str| writeln!(sim, "fan1@1 {what}").unwrap();
    at_the_fan("trip 3");
    assert_eq!(tripped(&listener, 200), "tripped: fault 3");
    drop(listener);
    at_the_fan("panel reset");
    sleep(A_MOMENT * 40);
    at_the_fan("trip 1");
    sleep(A_MOMENT * 40);
    let listener = TcpListener::bind(receiver).unwrap();
    assert_eq!(tripped(&listener, 503), "tripped: fault 1");
    assert_eq!(tripped(&listener, 200), "tripped: fault 1", "what was refused comes again");
    fs::remove_dir_all(folder).unwrap();
}
