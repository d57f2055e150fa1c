//! `capture` and `explain` on a port that is only listened to, a serial server that gives what it hears to each connection;
//! and `replay` of what was heard.

mod support;

use std::{
    fs,
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::PathBuf,
    time::Duration,
};

use drive_bus::{
    Line, LineConfig,
    capture::{self, Captured, Direction, Dissector, Writer},
    exchange::rtu,
};
use drive_core::{
    SerialSettings,
    tokio_modbus::{Request, Response, client::Client as _},
};
use support::{Running, path, run};

/// BBV51701 p. 10: 0627h is "operation enabled".
const READ: &[u8] = &[3, 0x0C, 0x81, 0, 1];
const STATUS: &[u8] = &[3, 2, 0x06, 0x27];
const WRITE: &[u8] = &[6, 0x21, 0x35, 0, 0x0F];

/// A serial server, and the port by which it is listened to.
fn server() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("rtu+tcp://{},19200,8E1", listener.local_addr().unwrap());
    (listener, port)
}

fn says(line: &mut TcpStream, frames: &[&[u8]]) {
    let bytes: Vec<u8> = frames.iter().flat_map(|pdu| rtu::frame(2, pdu)).collect();
    line.write_all(&bytes).unwrap();
}

/// What came back from whoever listens, until it went.
fn assert_nothing_was_written(mut line: TcpStream) {
    let mut written = Vec::new();
    // The end of a process may be a reset.
    let _ = line.read_to_end(&mut written);
    assert!(written.is_empty(), "{written:02X?}");
}

#[test]
fn a_port_is_explained_frame_by_frame_as_it_is_heard_and_nothing_is_written_to_it() {
    let (server, port) = server();
    let mut explain = Running::start(&["explain", "--line", &port, "--drive", "atv312@2"]);
    let (mut line, _) = server.accept().unwrap();
    explain.wait_for("nothing is ever written");
    says(&mut line, &[READ]);
    explain.wait_for("> atv312@2: reads ETA");
    says(&mut line, &[STATUS, WRITE, WRITE]);
    explain.wait_for("< atv312@2: answers ETA 0627h");
    explain.wait_for("> atv312@2: writes CMD 000Fh");
    explain.wait_for("< atv312@2: done");
    let (code, rest) = explain.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("2 requests, 2 answers, 0 exceptions, 0 without an answer, 0 damaged"), "{rest}");
    // The frames came without a pause between them, behind a network: nobody is accused.
    assert!(rest.contains("0 silences too short; ") && rest.contains("too close to call"), "{rest}");
    assert_nothing_was_written(line);
}

#[test]
fn a_capture_of_a_port_ends_with_a_whole_file_whenever_it_ends() {
    let (server, port) = server();
    let file = path("listened.pcapng");
    let name = file.to_str().unwrap();
    let capture = Running::start(&["capture", "--line", &port, "--to", name]);
    let (mut line, _) = server.accept().unwrap();
    says(&mut line, &[READ, STATUS, WRITE, WRITE]);
    line.write_all(&[1, 2, 3]).unwrap();
    while frames(&file) < 4 {
        support::look_again();
    }
    let (code, rest) = capture.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("4 frames, 31 bytes") || rest.contains("5 frames, 34 bytes"), "{rest}");
    assert_nothing_was_written(line);
    let recording = capture::read(&fs::read(&file).unwrap()).unwrap();
    assert_eq!(recording.dissector, Dissector::Rtu);
    assert!(recording.late.is_some());
    let explained = run(&["explain", name, "--drive", "atv312@2"]);
    assert!(explained.assert_done().contains("< atv312@2: answers ETA 0627h"), "{explained:?}");
    // What is there already is not written over, and what ends by itself says so too.
    let again = run(&["capture", "--line", &port, "--to", name]);
    again.assert_refused(2, "exists");
    fs::remove_file(&file).unwrap();
    let timed = run(&["capture", "--line", &port, "--to", name, "--seconds", "1", "--json"]);
    assert!(timed.assert_done().contains("\"frames\":0"), "{timed:?}");
    fs::remove_file(&file).unwrap();
}

fn frames(file: &PathBuf) -> usize {
    fs::read(file).ok().and_then(|bytes| capture::read(&bytes).ok()).map_or(0, |read| read.frames.len())
}

#[test]
fn what_cannot_be_listened_to_is_refused_with_the_reason() {
    for (arguments, reason) in [
        (&["explain", "--line", "tcp://127.0.0.1:1"][..], "Modbus TCP cannot be listened to"),
        (&["explain", "--line", "/dev/no-such-port,19200,8E1"], "there is no serial port"),
        (&["explain", "--line", "/dev/no-such-port"], "say which speed and format the line has"),
        // Nothing comes by the pipe either.
        (&["explain"], "standard input: nothing in it looks like a frame"),
        (&["capture", "--to", "/tmp/never"], "LINE"),
    ] {
        run(arguments).assert_refused(2, reason);
    }
}

/// A capture of frames that were only heard, each with the end of its last character in microseconds.
fn listened(name: &str, late: Duration, frames: &[(Direction, u64, &[u8])]) -> PathBuf {
    let file = path(&format!("listened-{name}.pcapng"));
    let mut writer = Writer::of_listener(fs::File::create(&file).unwrap(), Dissector::Rtu, late).unwrap();
    for &(direction, at, pdu) in frames {
        let at = Duration::from_secs(1_700_000_000) + Duration::from_micros(at);
        writer.write(&Captured { at, direction, bytes: rtu::frame(2, pdu) }).unwrap();
    }
    file
}

#[test]
fn a_silence_that_was_only_heard_is_blamed_only_beyond_the_error_of_its_times() {
    // 1200 8E1: a character is 9.17 ms, 3.5 are 32.08 ms, and a request of 8 characters takes 73.33 ms. The answer of 7
    // takes 64.17 ms, and begins 10 ms behind the request; the next request 30 ms behind the answer.
    let frames = [
        (Direction::Sent, 100_000, READ),
        (Direction::Received, 174_167, STATUS),
        (Direction::Sent, 277_500, READ),
    ];
    let explained = |late: u64| {
        let file = listened("silence", Duration::from_millis(late), &frames);
        let ended = run(&["explain", file.to_str().unwrap(), "--serial", "1200,8E1"]);
        fs::remove_file(file).unwrap();
        ended.assert_done().to_owned()
    };
    let said = explained(5);
    assert!(said.contains("! silence before it at most 15.00 ms, 3.5 characters are 32.08 ms"), "{said}");
    assert!(said.contains("1 silences too short; 1 silence too close to call"), "{said}");
    assert!(said.contains("answers 3201 (0C81h) = 1575, after about 10 ms"), "{said}");
    let said = explained(25);
    assert!(said.contains("0 silences too short; 2 silences too close to call"), "{said}");
}

#[test]
fn a_frame_that_may_be_a_write_or_its_confirmation_is_not_said_to_be_the_one_or_the_other() {
    let file = listened("either", Duration::from_millis(5), &[(Direction::Unknown, 0, WRITE)]);
    let ended = run(&["explain", file.to_str().unwrap(), "--drive", "atv312@2"]);
    let said = ended.assert_done();
    assert!(said.contains("? atv312@2: writes CMD 000Fh, or confirms it"), "{said}");
    assert!(said.contains("0 requests, 0 answers"), "{said}");
    fs::remove_file(file).unwrap();
}

#[cfg(unix)]
#[test]
fn what_was_heard_is_played_back_to_whoever_asks_the_same() {
    let frames =
        [(Direction::Sent, 0, READ), (Direction::Received, 30_000, STATUS), (Direction::Sent, 100_000, READ)];
    let file = listened("replay", Duration::from_millis(5), &frames);
    let name = file.to_str().unwrap();
    let link = path("replay.pty");
    let pty = link.to_str().unwrap();
    let mut replay = Running::start(&["replay", name, "--pty", pty, "--drive", "atv312@2"]);
    replay.wait_for("slave 2: 1 exchange, 1 different request");
    let config = LineConfig { retries: 0, ..LineConfig::serial(&link, SerialSettings::MODBUS_DEFAULT) };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let answers = runtime.block_on(async {
        let line = Line::open(config).await.unwrap();
        let mut slave = line.slave(2);
        let mut answers = Vec::new();
        for register in [3201, 3201, 9] {
            let answer = slave.call(Request::ReadHoldingRegisters(register, 1)).await;
            answers.push(answer.ok().map(|answer| answer.unwrap()));
        }
        answers
    });
    let status = Some(Response::ReadHoldingRegisters(vec![0x0627]));
    assert_eq!(answers, [status.clone(), status, None]);
    replay.wait_for("not in the capture: slave 2: reads 9 (0009h)");
    let (code, rest) = replay.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("3 requests, 2 answers; 1 not in the capture"), "{rest}");
    fs::remove_file(&file).unwrap();
    run(&["replay", "/dev/null", "--pty", pty])
        .assert_refused(2, "/dev/null: it is a device: expected a file, or a pipe");
}
