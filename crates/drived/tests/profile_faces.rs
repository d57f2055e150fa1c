//! A drive from a file at every face: what it does not tell is told by none as a value, neither as zero nor as good; what is known is.
#![cfg(target_os = "linux")]

#[path = "support/page.rs"]
mod page;
#[path = "mqtt/rig.rs"]
mod rig;
mod support;
#[path = "support/terminal.rs"]
mod terminal;

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _, Write as _},
    net::TcpStream,
};

use serde_json::Value;
use support::{File, Running, Sim, drived, free_port, get, path, run};
use terminal::Terminal;

/// A WJ200 by a file of somebody who does not know where its output stands.
const WJ200: &str = include_str!("../../drive-profile/profiles/hitachi/wj200.toml");

/// What a WJ200 does not tell.
const OWNER: &str = "whether the drive tells who commands it is not known";

/// A text of a face; what has to be in it, and what must not.
struct Row {
    face: &'static str,
    said: String,
    has: &'static [&'static str],
    lacks: &'static [&'static str],
}

#[test]
fn what_nobody_can_know_of_a_drive_is_said_by_each_face_and_shown_by_none_as_a_value() {
    let broker = rig::Mosquitto::start("profile-faces");
    let mut ear = broker.as_ref().map(|broker| broker.hear(&["drived/#"]));
    let sim = Sim::serve_with("profile-faces", &["wj200@3"], &["--baud", "19200", "--format", "8N1"]);
    let (http, gateway, state) = (free_port(), free_port(), path("profile-faces-state"));
    let mqtt = broker.as_ref().map_or_else(String::new, |broker| {
        format!("[mqtt]\nservers = [\"mqtt://127.0.0.1:{}\"]\n", broker.port)
    });
    let profiles = path("profile-faces-profiles");
    fs::create_dir_all(&profiles).expect("there is room");
    let blind = WJ200.replacen("key = \"wj200\"", "key = \"blind\"", 1).replacen(
        "output = \"D001\"",
        "output = \"unknown\"",
        1,
    );
    fs::write(profiles.join("blind.toml"), blind).expect("it can be written");
    let text = format!(
        "profiles = \"{}\"\nstate = \"{}\"\n{mqtt}[http]\nlisten = \"127.0.0.1:{http}\"\n[[gateways]]\nlisten = \"127.0.0.1:{gateway}\"\n\
         [groups]\npumps = [\"pump\"]\n[lines.bench]\nport = \"{},19200,8N1\"\n[[drives]]\nline = \"bench\"\ndrive = \"blind@3\"\nname = \"pump\"\ncontrol = true\n\
         options = {{ highest = \"50Hz\", commands-alone = \"yes\" }}\n",
        profiles.display(),
        state.display(),
        sim.link()
    );
    let file = File::new("profile-faces", &text);
    let socket = path("profile-faces.sock");
    let socket = socket.to_str().expect("the path is text");
    let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
    daemon.wait_for(r#""event":"connected""#);
    let stream = events(http);
    let started = run(&["start", "pump", "--setpoint", "20Hz", "--socket", socket]);
    assert_eq!(started.code, Some(0), "{started:?}");

    let report = path("profile-faces.html");
    let page = report.to_str().expect("the path is text");
    run(&["report", "--to", page, "--socket", socket]).assert_done();
    let in_french = path("profile-faces-fr.html");
    let page_fr = in_french.to_str().expect("the path is text");
    run(&["report", "--language", "fr", "--to", page_fr, "--socket", socket]).assert_done();
    let french = fs::read_to_string(&in_french).expect("it was written");
    let _ = fs::remove_file(&in_french);
    let (about, heard) = ear.as_mut().map_or_else(Default::default, |ear| {
        let (_, about, _) =
            ear.until(|topic, said| topic.ends_with("/about") && said.get("family").is_some());
        let (_, state, _) = ear.until(|topic, said| topic.ends_with("/state") && said["shows"] == "running");
        (about.to_string(), state.to_string())
    });
    let shown = run(&["profile", "show", "wj200"]);
    if page::Page::is_installed() {
        the_page_tells_it_in_both_languages(http);
    }
    // On a terminal: what is not told is a dash there too.
    let mut monitor = Terminal::start(&mut drived(&["monitor", "--socket", socket]), 120, 40);
    let screen = monitor.wait_for("running");
    monitor.press("q");
    assert_eq!(monitor.end().0, Some(0), "{screen}");
    let none: &[&str] = &[];
    let rows = [
        Row {
            face: "start",
            said: started.out + &started.err,
            has: &["running", OWNER],
            lacks: &[" 0.00 Hz", "is in force"],
        },
        Row {
            face: "status",
            said: run(&["status", "--socket", socket]).assert_done().to_owned(),
            has: &["running", "-/20.0"],
            lacks: none,
        },
        Row { face: "monitor", said: screen, has: &["pump", "-/20.0"], lacks: none },
        Row {
            face: "API",
            said: get(http, "/api/v1/drives", "application/json"),
            has: &["not_known", OWNER, "\"verdict\":\"not_known\""],
            lacks: &["output_frequency", "\"verdict\":\"in_force\""],
        },
        Row {
            face: "metrics",
            said: get(http, "/metrics", "text/plain"),
            has: &["drived_drive_motor_current_amperes{line=\"bench\",drive=\"pump\"}"],
            lacks: &["drived_drive_output_frequency_hertz{line=\"bench\",drive=\"pump\"}"],
        },
        Row {
            face: "report",
            said: fs::read_to_string(&report).expect("it was written"),
            has: &[OWNER],
            lacks: none,
        },
        Row {
            face: "MQTT",
            said: heard,
            has: if broker.is_some() { &["running"] } else { none },
            lacks: &["output_frequency", "in_force"],
        },
        Row {
            face: "MQTT, about",
            said: about,
            has: if broker.is_some() { &["not_known", OWNER] } else { none },
            lacks: none,
        },
        Row {
            face: "event stream",
            said: told_of(stream),
            has: &["\"not_known\"", OWNER],
            lacks: &["output_frequency"],
        },
        Row { face: "profile show", said: shown.assert_done().to_owned(), has: &[OWNER], lacks: none },
        Row {
            face: "families",
            said: run(&["families", "wj200"]).assert_done().to_owned(),
            has: &[OWNER],
            lacks: none,
        },
        Row {
            face: "French report",
            said: french,
            has: &["on ne sait pas si le variateur dit qui le commande"],
            lacks: &[OWNER],
        },
    ];
    for Row { face, said, has, lacks } in rows {
        for words in has {
            assert!(said.contains(words), "{face} says nothing of {words:?}: {said}");
        }
        for words in lacks {
            assert!(!said.contains(words), "{face} says {words:?}: {said}");
        }
    }
    // Printed 0002, the frequency by the bus, through the gateway: 20 Hz by the hundredth.
    assert_eq!(asked(gateway, 3, 1), [0x07, 0xD0]);
    // What cannot be read is an exception, and no zero.
    assert_eq!(asked(gateway, 3, 0x2000), [0x83]);
    run(&["stop", "pump", "--socket", socket]).assert_done();
    // All setpoints of a group come before its starts, and of this drive only a start shows one.
    let started = run(&["start", "pumps", "--setpoint", "25Hz", "--socket", socket]);
    assert_eq!(started.code, Some(0), "{started:?}");
    run(&["stop", "pumps", "--socket", socket]).assert_done();
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    // The tools on the line, when nobody else holds it.
    let looked = sim.on("wj200@3", &["doctor", "--for", "1s"]);
    assert!(looked.out.contains("wj200@3") && looked.out.contains(OWNER), "{looked:?}");
    let backup = path("profile-faces-backup.toml");
    let (backup, line) = (backup.to_str().expect("the path is text"), format!("{},19200,8N1", sim.link()));
    let kept = run(&["param", "backup", "--to", backup, "--line", &line, "wj200@3"]);
    assert!(kept.code != Some(0) && kept.err.contains("its family has no parameters"), "{kept:?}");
    let _ = fs::remove_file(&report);
    let _ = fs::remove_dir_all(&state);
    let _ = fs::remove_dir_all(&profiles);
}

/// The event stream, by which the page goes.
fn events(http: u16) -> TcpStream {
    let mut stream = TcpStream::connect(("127.0.0.1", http)).expect("it listens");
    stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").expect("it hears");
    stream
}

/// What it tells of the drive, once that runs.
fn told_of(stream: TcpStream) -> String {
    let mut lines = BufReader::new(stream).lines().map(|line| line.expect("it is text"));
    let mut is_drive = false;
    lines
        .find(|line| {
            let is_it = is_drive && line.starts_with("data:") && line.contains("running");
            is_drive = line == "event: drive" || is_drive && !line.is_empty();
            is_it
        })
        .expect("it tells of the drive")
}

/// Each sentence in the language of the page, and beside a parameter that is no holding register where it stands.
fn the_page_tells_it_in_both_languages(http: u16) {
    let mut page = page::Page::open(http);
    let shown = page.shows("unseen pump");
    let of = |language: &str| {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let list = |value: &Value| {
            value.as_array().map(|all| all.iter().map(text).collect::<Vec<_>>()).unwrap_or_default()
        };
        let panel = &shown[language]["unseen"][0];
        (
            text(&panel["title"]),
            list(&panel["said"]),
            list(&panel["marked"]),
            list(&shown[language]["registers"]),
        )
    };
    let (title, said, marked, registers) = of("en");
    assert_eq!(title, "What its file cannot tell of this drive");
    assert!(said.iter().any(|said| said == OWNER) && marked.iter().all(String::is_empty), "{shown}");
    assert!(registers.iter().any(|place| place == "RUN coil 0"), "{registers:?}");
    let (title, said, marked, registers) = of("fr");
    assert_eq!(title, "Ce que son fichier ne peut dire de ce variateur");
    assert!(said.iter().any(|said| said == "on ne sait pas si le variateur dit qui le commande"), "{said:?}");
    assert!(
        said.iter().all(|said| !said.contains("known")) && marked.iter().all(String::is_empty),
        "{shown}"
    );
    assert!(registers.iter().any(|place| place == "RUN bobine 0"), "{registers:?}");
    page.close();
}

/// One holding register through a gateway: its word, or the function of the exception.
fn asked(port: u16, slave: u8, register: u16) -> Vec<u8> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    let [high, low] = register.to_be_bytes();
    stream.write_all(&[0, 1, 0, 0, 0, 6, slave, 3, high, low, 0, 1]).expect("it hears");
    let mut head = [0; 8];
    stream.read_exact(&mut head).expect("it answers");
    if head[7] & 0x80 != 0 {
        return vec![head[7]];
    }
    let mut rest = [0; 3];
    stream.read_exact(&mut rest).expect("it answers");
    rest[1..].to_vec()
}
