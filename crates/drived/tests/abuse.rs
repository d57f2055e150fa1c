//! The HTTP server under abuse: the drives do not notice.
#![cfg(unix)]

mod support;

use std::{
    io::{ErrorKind, Read as _, Write as _},
    net::TcpStream,
    time::Duration,
};

use support::{File, Running, Sim, ask, free_port, path, run};

/// A command as a program sends it.
fn post(port: u16, target: &str, headers: &str, body: &str) -> String {
    let length = body.len();
    ask(
        port,
        &format!(
            "POST {target} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\
             Connection: close\r\n{headers}\r\n{body}"
        ),
    )
}

#[track_caller]
fn assert_status(answer: &str, status: u16) {
    assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "expected {status}: {answer}");
}

/// 100 MB in pieces, as long as they are taken; then what is answered, unless what was sent into the closed connection has taken it
/// with it.
fn pour(port: u16, head: &str, piece: &[u8]) -> Option<String> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    stream.write_all(head.as_bytes()).expect("it reads the head");
    for _ in 0..100_000_000 / piece.len() {
        if stream.write_all(piece).is_err() {
            break;
        }
    }
    let mut answer = Vec::new();
    match stream.read_to_end(&mut answer) {
        Err(error) if error.kind() == ErrorKind::ConnectionReset => None,
        _ => Some(String::from_utf8_lossy(&answer).into_owned()),
    }
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the test has a thread of its own")]
fn whatever_comes_over_http_statuses_keep_coming_and_a_stop_is_carried_out() {
    let mut sim = Sim::serve("abused", &["atv312@1-2"]);
    let port = free_port();
    let file = File::new(
        "abused",
        &format!(
            "snapshots = \"500ms\"\n[http]\nlisten = \"127.0.0.1:{port}\"\n[defaults]\ncontrol = true\n\
             watchdog = {{ time = \"10s\", reaction = \"ramp\" }}\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            sim.link()
        ),
    );
    let socket = path("abused.sock");
    let socket = socket.to_str().expect("the path is text");
    let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
    daemon.wait_for_log("the page is at http://127.0.0.1");
    for _ in 0..2 {
        daemon.wait_for(r#""event":"watchdog_verified""#);
    }
    run(&["start", "pump 1", "--setpoint", "20Hz", "--socket", socket]).assert_done();

    // Those who ask for nothing, those who ask too slowly, and those who never read what they asked for.
    let idle: Vec<_> = (0..1_000).filter_map(|_| TcpStream::connect(("127.0.0.1", port)).ok()).collect();
    let mut slow = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    slow.write_all(b"GET /api/v1/state HTTP/1.1\r\nHost: loc").expect("it reads");
    let stream = |_| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        let request = "GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
        stream.write_all(request.as_bytes()).ok().map(|()| stream)
    };
    let mut streams: Vec<_> = (0..200).filter_map(stream).collect();
    let unread = streams.split_off(streams.len() / 2);
    let readers: Vec<_> = streams
        .into_iter()
        .map(|mut stream| {
            std::thread::spawn(move || while stream.read(&mut [0; 4_096]).is_ok_and(|read| read > 0) {})
        })
        .collect();

    // Those who say what they should not. While nobody has heard those who are silent, the places that are left are for stops.
    let start = "/api/v1/drives/pump%202/start";
    let refused = (0..40).find_map(|_| {
        let answer = post(port, start, "", "{}");
        let waits = answer.starts_with("HTTP/1.1 503 ") && answer.contains("retry-after: 1");
        std::thread::sleep(Duration::from_millis(if waits { 1_000 } else { 0 }));
        (!waits).then_some(answer)
    });
    assert_status(&refused.expect("it is heard"), 401);
    assert_status(&post(port, start, "Authorization: Bearer drv_0\r\n", "{}"), 401);
    assert_status(&post(port, start, "Origin: http://evil.example\r\n", "{}"), 403);
    assert_status(&post(port, "/api/v1/stop", "Sec-Fetch-Site: cross-site\r\n", "{}"), 403);
    // What cannot be understood of a stop keeps nobody from it.
    assert_status(&post(port, "/api/v1/drives/pump%202/stop", "", "{\"mode\":"), 200);
    assert_status(
        &ask(port, "GET /api/v1/state HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n"),
        421,
    );
    let form = "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\nContent-Length: 2\r\n\
                Connection: close\r\n\r\n{}";
    assert_status(&ask(port, form), 415);
    // Who says too much is refused; a stop is one whatever else it says.
    let head =
        |target| format!("POST {target} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n");
    let piece = format!("10000\r\n{}\r\n", " ".repeat(65_536));
    for (target, status) in [("/api/v1/login", 413), ("/api/v1/drives/pump%202/stop", 200)] {
        let head = head(target);
        let answers = [
            pour(port, &format!("{head}Content-Length: 100000000\r\n\r\n"), &[b' '; 65_536]),
            pour(port, &format!("{head}Transfer-Encoding: chunked\r\n\r\n"), piece.as_bytes()),
        ];
        for answer in answers.iter().flatten() {
            assert_status(answer, status);
        }
    }

    // Meanwhile the drives are asked and answer, and whoever has the right stops them.
    for _ in 0..4 {
        let snapshot = daemon.wait_for(r#""kind":"snapshot""#);
        assert!(snapshot.contains(r#""quality":"good""#) && snapshot.contains(r#""lost":0"#), "{snapshot}");
    }
    let stopped = post(port, "/api/v1/stop?wait=30s", "", "{}");
    assert_status(&stopped, 200);
    assert!(stopped.contains(r#""outcome":"confirmed""#), "{stopped}");
    assert!(sim.say("atv312@1 show", "output").starts_with("not fed"));
    drop((idle, slow, unread));

    // The streams are ended by the daemon's end, which no reader holds up.
    assert_eq!(daemon.interrupt().0, Some(0));
    for reader in readers {
        reader.join().expect("it has ended");
    }
}
