//! What the program says and does when the line, the port or the drive behaves badly. The other end of the line is a TCP
//! server of the test.

mod support;

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    sync::{Arc, Mutex},
    thread,
};

use support::{Running, run};

/// A server that does this with every connection. Gives its port.
fn server(behave: impl Fn(TcpStream) + Clone + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = listener.local_addr().expect("it has an address").port();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let behave = behave.clone();
            thread::spawn(move || behave(stream));
        }
    });
    port
}

/// How a stop of an Altivar 28 at address 1 begins: function 06, CMD 400.
const STOP: [u8; 4] = [1, 6, 0x01, 0x90];

/// A line over a server, as Modbus RTU and as Modbus TCP.
fn lines(port: u16) -> [String; 2] {
    [format!("rtu+tcp://127.0.0.1:{port},19200,8N1"), format!("tcp://127.0.0.1:{port}")]
}

/// Says bytes without end that are no frame, and keeps what it hears.
#[expect(clippy::disallowed_methods, reason = "it has a thread of its own")]
fn babbler(heard: &Arc<Mutex<Vec<u8>>>) -> u16 {
    let heard = Arc::clone(heard);
    server(move |mut stream| {
        let (heard, mut ear) = (Arc::clone(&heard), stream.try_clone().expect("a socket has two ends"));
        thread::spawn(move || {
            let mut bytes = [0; 256];
            while let Ok(read @ 1..) = ear.read(&mut bytes) {
                heard.lock().expect("nobody panics").extend(&bytes[..read]);
            }
        });
        while stream.write_all(&[0xFF; 16]).is_ok() {
            // Shorter than the silence between two frames.
            thread::sleep(std::time::Duration::from_micros(300));
        }
    })
}

#[test]
fn a_stop_over_a_port_that_cannot_be_opened_is_an_alarm() {
    // A port at which nobody listens any more.
    let port = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    let port = port.expect("a port is free").port();
    for line in lines(port) {
        let stop = run(&["stop", "--line", &line, "--drive", "atv312@1"]);
        stop.assert_stop_not_confirmed();
        let status = run(&["status", "--line", &line, "--drive", "atv312@1"]);
        assert_eq!(status.code, Some(2), "{status:?}");
    }
}

#[test]
fn a_stop_over_a_port_that_accepts_and_closes_is_an_alarm_in_its_time() {
    let port = server(|stream| {
        let _ = stream.shutdown(Shutdown::Both);
    });
    for line in lines(port) {
        let stop = run(&["stop", "--line", &line, "--drive", "atv312@1"]);
        stop.assert_stop_not_confirmed();
    }
}

#[test]
fn a_line_that_is_never_quiet_ends_status_and_scan_with_words_and_the_stop_is_sent_all_the_same() {
    let heard = Arc::default();
    let [rtu, _] = lines(babbler(&heard));
    // Where the machine holds the babbler up, a request finds its way between two bytes and no answer.
    for subcommand in ["status", "start"] {
        run(&[subcommand, "--line", &rtu, "--drive", "atv312@1"])
            .assert_refused(1, "something else is sending");
    }
    let scan = run(&["scan", "--line", &rtu, "--addresses", "1-3"]);
    assert!(format!("{}{}", scan.out, scan.err).contains("something else is sending"), "{scan:?}");
    heard.lock().expect("nobody panics").clear();
    let stop = run(&["stop", "--line", &rtu, "--drive", "atv28@1"]);
    stop.assert_stop_not_confirmed();
    let heard = heard.lock().expect("nobody panics").clone();
    assert!(heard.windows(4).any(|bytes| bytes == STOP), "{heard:02X?}");
}

#[test]
fn a_stop_counts_the_attempts_in_which_it_was_sent() {
    let heard: Arc<Mutex<Vec<u8>>> = Arc::default();
    let kept = Arc::clone(&heard);
    // It hears and never answers.
    let port = server(move |mut stream| {
        let mut bytes = [0; 256];
        while let Ok(read @ 1..) = stream.read(&mut bytes) {
            kept.lock().expect("nobody panics").extend(&bytes[..read]);
        }
    });
    let [rtu, _] = lines(port);
    let stop = run(&["stop", "--line", &rtu, "--drive", "atv28@1"]);
    stop.assert_stop_not_confirmed();
    let told = stop.out.lines().rev().find_map(|line| line.split_once("sent in ")?.1.split_once(' '));
    let told: usize = told.map_or(1, |(number, _)| number.parse().expect("a number"));
    let sent = heard.lock().expect("nobody panics").windows(4).filter(|bytes| *bytes == STOP).count();
    assert!(told >= 1 && sent >= told, "{told} told, {sent} sent: {stop:?}");
}

#[test]
fn a_poll_of_a_drive_that_never_answered_ends_with_1_however_short_it_is() {
    let port = server(|mut stream| {
        let mut bytes = [0; 256];
        while let Ok(1..) = stream.read(&mut bytes) {}
    });
    let [rtu, _] = lines(port);
    let poll = run(&["poll", "--line", &rtu, "--drive", "atv312@1", "--seconds", "1"]);
    assert_eq!(poll.code, Some(1), "{poll:?}");
    assert!(poll.err.contains("no status from atv312@1"), "{poll:?}");
    let mut poll = Running::start(&["poll", "--line", &rtu, "--drive", "atv312@1"]);
    // Its first words: a signal within the moment in which it begins to hear signals can be lost.
    poll.wait_for("atv312@1");
    poll.ask_to_end();
    assert_ne!(poll.end().0, Some(0));
}

#[test]
fn dead_drives_polled_as_fast_as_it_goes_are_told_once_each() {
    let port = server(|mut stream| {
        let mut bytes = [0; 256];
        while let Ok(1..) = stream.read(&mut bytes) {}
    });
    for line in lines(port) {
        let poll =
            run(&["poll", "--line", &line, "--drive", "atv312@1-3", "--period", "0", "--seconds", "8"]);
        assert_eq!(poll.code, Some(1), "{poll:?}");
        let is_told = |line: &&str| line.contains("no answer") || line.contains("off-line");
        // Behind TCP may be a gateway that keeps each question for seconds: of whom nothing is known yet that is told, once, and whoever
        // is not told of at all is named at the end.
        let (waits, silent): (Vec<_>, Vec<_>) =
            poll.out.lines().filter(is_told).partition(|line| line.contains("no answer yet"));
        assert!(waits.len() <= 3 && silent.len() <= 3, "{poll:?}");
        assert!(poll.err.contains("no status from atv312@1, atv312@2, atv312@3"), "{poll:?}");
    }
}

#[test]
fn bytes_of_others_stand_in_the_summary_of_a_poll() {
    let [rtu, _] = lines(babbler(&Arc::default()));
    let poll = run(&["poll", "--line", &rtu, "--drive", "atv312@1", "--seconds", "1"]);
    assert!(poll.out.contains("wrong") && poll.out.contains("late"), "{poll:?}");
    assert!(poll.out.contains("from others: "), "{poll:?}");
}
