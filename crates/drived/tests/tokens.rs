//! Tokens of a running daemon, made, replaced and removed by the command line over its socket, and what ends with them.
#![cfg(unix)]

mod support;

use std::{
    io::{BufRead as _, BufReader, Read as _, Write as _},
    net::TcpStream,
    path::PathBuf,
    time::Duration,
};

use serde_json::{Value, json};
use support::{Ended, File, Running, Sim, ask, free_port, path, run};

/// A daemon over two simulated pumps that keeps its tokens in a folder of its own.
struct Daemon {
    running: Option<Running>,
    _sim: Sim,
    file: File,
    folder: PathBuf,
    socket: PathBuf,
    port: u16,
}

impl Daemon {
    fn start(name: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2"]);
        let (folder, port) = (path(&format!("{name}-state")), free_port());
        let text = format!(
            "state = {:?}\n[http]\nlisten = \"127.0.0.1:{port}\"\nwithout_login = \"nothing\"\n[defaults]\ncontrol = true\n\
             watchdog = {{ time = \"10s\", reaction = \"ramp\" }}\n[groups]\nhall = [\"pump 1\"]\n\
             [lines.bench]\nport = \"{}\"\n[[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            folder.to_str().expect("the path is text"),
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock"));
        let mut running = Running::start(&[
            "run",
            "--config",
            file.path(),
            "--socket",
            socket.to_str().expect("it is text"),
        ]);
        for _ in 0..2 {
            running.wait_for(r#""event":"watchdog_verified""#);
        }
        Self { running: Some(running), _sim: sim, file, folder, socket, port }
    }

    fn token(&self, words: &[&str]) -> Ended {
        let socket = self.socket.to_str().expect("the path is text");
        run(&[&["token"], words, &["--config", self.file.path(), "--socket", socket]].concat())
    }

    fn secret(&self, words: &[&str]) -> String {
        self.token(words).assert_done().trim().to_owned()
    }

    /// What is answered to a request with this header.
    fn answer(&self, method: &str, path: &str, header: &str, body: &Value) -> (u16, Value) {
        let body = body.to_string();
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: localhost\r\n{header}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
        let answer = ask(self.port, &request);
        let (head, body) = answer.split_once("\r\n\r\n").expect("an answer has a head");
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
        (status, serde_json::from_str(body).unwrap_or_default())
    }

    fn state(&self, header: &str) -> (u16, Value) {
        self.answer("GET", "/api/v1/state", header, &json!({}))
    }

    /// A session that begins with this secret, as a header.
    fn session(&self, secret: &str) -> String {
        let body = json!({ "token": secret }).to_string();
        let request = format!(
            "POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\
             Connection: close\r\n\r\n{body}",
            body.len()
        );
        let answer = ask(self.port, &request);
        let (_, cookie) = answer.split_once("set-cookie: ").expect("a login sets a cookie");
        format!("Cookie: {}", cookie.split(';').next().expect("it has a value"))
    }

    /// The events as somebody follows them with this header, from the first on.
    fn events(&self, header: &str) -> BufReader<TcpStream> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        // So that a test that fails ends.
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("it is a socket");
        let request = format!("GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n{header}\r\n\r\n");
        stream.write_all(request.as_bytes()).expect("it reads");
        let mut events = BufReader::new(stream);
        let mut line = String::new();
        while !line.starts_with("event: ") {
            line.clear();
            assert_ne!(events.read_line(&mut line).expect("it answers in time"), 0, "the stream ended");
        }
        events
    }

    /// Whether a stream goes on: something comes after a stop that somebody gives now, and not its end.
    fn goes_on(&self, events: &mut BufReader<TcpStream>) -> bool {
        let socket = self.socket.to_str().expect("the path is text");
        run(&["stop", "pump 2", "--socket", socket]).assert_done();
        let mut line = String::new();
        loop {
            line.clear();
            match events.read_line(&mut line) {
                Ok(0) => return false,
                Ok(_) if line.starts_with("event: command") => return true,
                Ok(_) => {}
                Err(error) => panic!("neither an event nor its end: {error}"),
            }
        }
    }

    fn end(&mut self) {
        let (code, _) = self.running.take().expect("it runs").interrupt();
        assert_eq!(code, Some(0));
        std::fs::remove_dir_all(&self.folder).expect("it is ours");
    }
}

fn bearer(secret: &str) -> String {
    format!("Authorization: Bearer {secret}")
}

/// It ends by itself: whoever reads it comes to its end.
fn ends(events: &mut BufReader<TcpStream>) {
    let mut rest = Vec::new();
    events.read_to_end(&mut rest).expect("it ends, and in time");
}

#[test]
fn a_token_is_replaced_over_the_socket_and_whatever_came_by_the_old_one_ends() {
    let mut daemon = Daemon::start("token-rotated");
    let old = daemon.secret(&["add", "panel", "--role", "operate"]);
    let other = daemon.secret(&["add", "other", "--role", "view"]);
    let session = daemon.session(&old);
    let mut streams = [bearer(&old), session.clone()].map(|header| daemon.events(&header));
    let mut of_other = daemon.events(&bearer(&other));
    // With an overlap both are good.
    let new = daemon.secret(&["rotate", "panel", "--hours", "24"]);
    assert_ne!(new, old);
    for secret in [&old, &new] {
        assert_eq!(daemon.state(&bearer(secret)).0, 200);
    }
    assert!(streams.iter_mut().all(|events| daemon.goes_on(events)));
    // Without one that which it was is no more, nor is what came by it.
    let newest = daemon.secret(&["rotate", "panel", "--hours", "0"]);
    for events in &mut streams {
        ends(events);
    }
    for header in [bearer(&old), bearer(&new), session] {
        assert_eq!(daemon.state(&header).0, 401, "{header}");
    }
    let (status, state) = daemon.state(&bearer(&newest));
    assert_eq!((status, &state["daemon"]["caller"]), (200, &"panel".into()));
    assert_eq!(state["daemon"]["rights"]["operate"], true, "its role stays");
    assert!(daemon.goes_on(&mut of_other));
    daemon
        .token(&["rotate", "nobody"])
        .assert_refused(2, "there is no token \"nobody\": there are panel, other");
    let log = std::fs::read_to_string(daemon.folder.join("audit")).expect("it is kept there");
    assert!(log.contains("token panel replaced; the one before it is good for 24 h yet"), "{log}");
    daemon.end();
}

#[test]
fn a_token_ends_by_itself_and_what_came_by_it_with_it() {
    let mut daemon = Daemon::start("token-expired");
    let secret = daemon.secret(&["add", "fitter", "--role", "operate", "--days", "2"]);
    let listed = daemon.token(&["list", "--json"]);
    let listed: Value = serde_json::from_str(listed.assert_done()).expect("an object");
    let [made, ends_at] = ["made_unix_s", "expires_unix_s"].map(|key| listed[key].as_u64().expect("a time"));
    assert_eq!(ends_at - made, 2 * 86_400, "{listed}");
    let session = daemon.session(&secret);
    let mut streams = [bearer(&secret), session.clone()].map(|header| daemon.events(&header));
    assert!(streams.iter_mut().all(|events| daemon.goes_on(events)));
    // Its time is over now.
    let file = daemon.folder.join("tokens");
    let kept = std::fs::read_to_string(&file).expect("it is kept there");
    let over = kept.replace(&format!("expires = {ends_at}"), &format!("expires = {made}"));
    assert_ne!(over, kept);
    std::fs::write(&file, over).expect("it is ours");
    for events in &mut streams {
        ends(events);
    }
    for header in [bearer(&secret), session] {
        assert_eq!(daemon.state(&header).0, 401, "{header}");
    }
    daemon.end();
}

#[test]
fn a_token_for_one_group_commands_its_drives_alone_and_stops_all() {
    let mut daemon = Daemon::start("token-scope");
    daemon
        .token(&["add", "hall", "--role", "operate", "--group", "hal"])
        .assert_refused(2, "there is no group \"hal\" in ");
    daemon
        .token(&["add", "hall", "--role", "operate", "--drive", "pump 3"])
        .assert_refused(2, "there is no drive \"pump 3\" in ");
    let secret = daemon.secret(&["add", "hall", "--role", "operate", "--group", "hall"]);
    assert!(daemon.token(&["list"]).assert_done().contains("group hall"));
    let header = bearer(&secret);
    let start = |drive: &str| {
        let path = format!("/api/v1/drives/pump%20{drive}/start?wait=20s");
        daemon.answer("POST", &path, &header, &json!({ "setpoint": { "frequency_hz": 20.0 } }))
    };
    let (status, problem) = start("2");
    assert_eq!((status, &problem["detail"]), (403, &"the token hall is not for pump 2".into()));
    assert_eq!(start("1").0, 200);
    assert_eq!(daemon.state(&header).1["daemon"]["scope"], json!(["pump 1"]));
    let (status, told) = daemon.answer("POST", "/api/v1/stop?wait=20s", &header, &json!({}));
    assert_eq!((status, &told["confirmed"]), (200, &2.into()), "{told}");
    let log = std::fs::read_to_string(daemon.folder.join("audit")).expect("it is kept there");
    assert!(log.contains("token hall added, role operate, for group hall"), "{log}");
    // Another secret, and for the same drives.
    let secret = daemon.secret(&["rotate", "hall", "--hours", "0"]);
    assert_eq!(daemon.state(&bearer(&secret)).1["daemon"]["scope"], json!(["pump 1"]));
    daemon.end();
}
