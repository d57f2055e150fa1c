//! `run` and the signals: a configuration that is read again, and a program that no signal kills without its policies.
#![cfg(unix)]

mod support;

use std::process::{Command, Stdio};

use support::{File, Running, Sim, run};

fn configuration(port: &str, drives: &[(u8, &str)]) -> String {
    let head = format!("snapshots = \"500ms\"\n[lines.bench]\nport = \"{port},19200,8E1\"\n");
    let drive = |(address, keys): &(u8, &str)| {
        format!(
            "[[drives]]\nline = \"bench\"\ndrive = \"atv312@{address}\"\nname = \"pump {address}\"\n{keys}\n"
        )
    };
    drives.iter().map(drive).fold(head, |text, drive| text + &drive)
}

#[test]
fn a_hangup_reads_the_configuration_again_and_touches_only_what_has_changed() {
    let sim = Sim::serve("reload", &["atv312@1-3"]);
    sim.on("atv312@1", &["setpoint", "30Hz"]).assert_done();
    sim.on("atv312@1", &["start"]).assert_done();
    let file = File::new("reload", &configuration(sim.link(), &[(1, "control = true"), (2, "")]));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    for _ in 0..2 {
        daemon.wait_for(r#""event":"connected""#);
    }
    let changed = "control = true\nalarms = { current = 50 }\non_exit_adopted = \"leave\"";
    std::fs::write(file.path(), configuration(sim.link(), &[(1, changed), (3, "")]))
        .expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log(
        "pump 1 has other settings and goes on; pump 2 removed, by its policy of the exit; pump 3 added",
    );
    let connected = daemon.wait_for(r#""event":"connected""#);
    assert!(connected.contains("pump 3"), "{connected}");
    let shown = loop {
        let snapshot = daemon.wait_for(r#""kind":"snapshot""#);
        if snapshot.contains("pump 1") {
            break snapshot;
        }
    };
    assert!(shown.contains(r#""state":"running""#) && shown.contains(r#""lost":0"#), "{shown}");
    let (code, rest) = daemon.interrupt();
    assert_eq!(code, Some(0), "{rest}");
}

#[test]
fn without_drives_it_begins_says_what_to_do_and_has_those_that_a_scan_writes_down_without_a_restart() {
    let sim = Sim::serve("begins", &["atv312@1-2"]);
    let file = File::new("begins", "");
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for_log("no drive yet: find them at the page");
    // It writes no file that is there.
    std::fs::remove_file(file.path()).expect("it is there");
    let line = format!("{},19200,8E1", sim.link());
    let scan = run(&["scan", "--line", &line, "--addresses", "1-3", "--save", file.path()]);
    scan.assert_done();
    daemon.signal("-HUP");
    daemon.wait_for_log("line main added; drive 1 added; drive 2 added");
    for _ in 0..2 {
        daemon.wait_for(r#""event":"connected""#);
    }
    // An empty file is no wish that all of them leave.
    std::fs::write(file.path(), "").expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log("the old configuration holds on");
    assert_eq!(daemon.interrupt().0, Some(0));
    // Whoever names a file that is not there has misspelt it.
    run(&["run", "--config", "/nowhere/drives.toml"]).assert_refused(2, "cannot be read");
}

#[test]
fn a_configuration_that_has_lost_its_drives_does_not_bring_in_those_that_were_added_at_the_page() {
    let sim = Sim::serve("aside", &["atv312@1-2"]);
    let state = support::path("aside-state");
    std::fs::create_dir_all(&state).expect("it can be made");
    let head = format!("state = {:?}\n", state.to_str().expect("the path is text"));
    std::fs::write(
        state.join("added.toml"),
        configuration(sim.link(), &[(2, "")]).replace("snapshots = \"500ms\"\n", ""),
    )
    .expect("it can be written");
    let file = File::new("aside", &format!("{head}{}", configuration(sim.link(), &[(1, "")])));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for_log("added.toml do not hold");
    let connected = daemon.wait_for(r#""event":"connected""#);
    assert!(connected.contains("pump 1"), "{connected}");
    std::fs::write(file.path(), &head).expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log("the old configuration holds on");
    assert_eq!(daemon.interrupt().0, Some(0));
    // A start is another matter: they hold then, and it is said by check.
    let checked = run(&["check", "--config", file.path()]);
    assert!(checked.assert_done().contains("pump 2"), "{checked:?}");
    let _ = std::fs::remove_dir_all(state);
}

#[test]
fn a_new_name_that_looks_like_another_is_not_taken_and_one_that_is_there_is_lived_with() {
    let sim = Sim::serve("alike-reload", &["atv312@1-3"]);
    let named = |drives: &[(u8, &str)]| {
        drives.iter().fold(configuration(sim.link(), &[]), |text, (address, name)| {
            let head = format!("[[drives]]\nline = \"bench\"\ndrive = \"atv312@{address}\"\n");
            format!("{text}{head}name = \"{name}\"\n")
        })
    };
    // The first letter of the second and the last of the third are Cyrillic.
    let (one, other, third) = ((1, "pump a"), (2, "\u{440}ump a"), (3, "pump \u{430}"));
    let file = File::new("alike-reload", &named(&[one, other]));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for_log("look alike");
    daemon.wait_for(r#""event":"connected""#);
    std::fs::write(file.path(), named(&[one, other, third])).expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log("a new name: drive or group");
    // Another order of names that are there already is nothing new.
    std::fs::write(file.path(), named(&[other, one, (3, "fan")])).expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log("fan added");
    assert_eq!(daemon.interrupt().0, Some(0));
}

#[test]
fn a_configuration_with_an_error_is_not_taken_and_the_old_one_holds_on() {
    let sim = Sim::serve("wrong-reload", &["atv312@1"]);
    let file = File::new("wrong-reload", &configuration(sim.link(), &[(1, "")]));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"connected""#);
    std::fs::write(file.path(), configuration(sim.link(), &[(1, "running = \"soon\"")]))
        .expect("it can be written");
    daemon.signal("-HUP");
    daemon.wait_for_log("the old configuration holds on");
    daemon.wait_for(r#""kind":"snapshot""#);
    assert_eq!(daemon.interrupt().0, Some(0));
}

#[test]
fn sigusr1_says_how_the_drives_are_and_sigquit_ends_the_program_by_its_policies() {
    let sim = Sim::serve("signals", &["atv312@1"]);
    let file = File::new("signals", &configuration(sim.link(), &[(1, "control = true")]));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"connected""#);
    for signal in ["-USR1", "-USR2"] {
        daemon.signal(signal);
        daemon.wait_for_log("bench: pump 1: ");
    }
    daemon.signal("-QUIT");
    let (code, rest) = daemon.end();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains(r#""event":"exit""#), "{rest}");
}

#[test]
fn a_closed_terminal_ends_the_program_by_its_policies() {
    let sim = Sim::serve("terminal", &["atv312@1"]);
    let told = support::path("terminal.log");
    let file = File::new("terminal", &configuration(sim.link(), &[(1, "control = true")]));
    // script gives the program a terminal of its own; when it is killed that terminal is closed. That means something to the
    // program also where the tests are run by nohup.
    let socket = support::path("terminal.sock");
    let program = format!(
        "exec env --default-signal=HUP {} run --json --socket {} --config {} >{} 2>&1",
        env!("CARGO_BIN_EXE_drived"),
        socket.display(),
        file.path(),
        told.display()
    );
    let mut terminal = Command::new("script")
        .args(["-q", "-c", &program, "/dev/null"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("script runs");
    wait_for(&told, r#""event":"connected""#);
    terminal.kill().expect("it runs");
    terminal.wait().expect("it ends");
    wait_for(&told, "the terminal is closed: the program ends by each drive's policy");
    wait_for(&told, r#""event":"exit""#);
    std::fs::remove_file(&told).expect("it is there");
}

/// Waits until a file contains this.
#[expect(clippy::disallowed_methods, reason = "a file tells nobody that it has grown")]
fn wait_for(file: &std::path::Path, text: &str) {
    for _ in 0..600 {
        if std::fs::read_to_string(file).is_ok_and(|said| said.contains(text)) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("it does not say {text:?}: {:?}", std::fs::read_to_string(file));
}

/// The answer to a read of register 3201 (ETA) of unit 1 at this address; `None`: nobody listens there.
fn asked_by_scada(address: &str) -> Option<[u8; 11]> {
    use std::io::{Read as _, Write as _};
    let mut stream = std::net::TcpStream::connect(address).ok()?;
    stream.write_all(&[0, 1, 0, 0, 0, 6, 1, 3, 0x0C, 0x81, 0, 1]).ok()?;
    let mut answer = [0; 11];
    stream.read_exact(&mut answer).ok()?;
    Some(answer)
}

#[test]
fn a_face_is_opened_exchanged_and_closed_by_a_reload_and_no_drive_is_touched_by_it() {
    let sim = Sim::serve("faces-reload", &["atv312@1"]);
    let drives = configuration(sim.link(), &[(1, "control = true")]);
    let [one, other] = [(); 2].map(|()| {
        let free = std::net::TcpListener::bind("127.0.0.1:0").expect("there is a port");
        free.local_addr().expect("it is bound").to_string()
    });
    let with = |listen: &str| format!("{drives}[[gateways]]\nlisten = \"{listen}\"\n");
    let file = File::new("faces-reload", &drives);
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"connected""#);
    let mut reload = |text: &str, told: &str| {
        std::fs::write(file.path(), text).expect("it can be written");
        daemon.signal("-HUP");
        daemon.wait_for_log(told);
    };
    reload(&with(&one), "configuration read again: gateways opened\n");
    wait_until(|| asked_by_scada(&one).is_some_and(|answer| answer[7] == 3));
    reload(&with(&other), "configuration read again: gateways closed and opened anew\n");
    wait_until(|| asked_by_scada(&other).is_some_and(|answer| answer[7] == 3));
    assert_eq!(asked_by_scada(&one), None, "nobody listens there any more");
    reload(&with(&other), "nothing has changed");
    let in_vain =
        format!("{drives}[mqtt]\nservers = [\"mqtts://127.0.0.1\"]\nauthorities = \"nowhere.pem\"\n");
    reload(&in_vain, "the old configuration holds on");
    assert!(asked_by_scada(&other).is_some(), "what cannot be opened closes nothing");
    reload(&drives, "configuration read again: gateways closed\n");
    assert_eq!(asked_by_scada(&other), None);
    let shown = daemon.wait_for(r#""kind":"snapshot""#);
    assert!(shown.contains(r#""lost":0"#), "{shown}");
    assert_eq!(daemon.interrupt().0, Some(0));
}

/// A gateway listens on a task of its own.
#[expect(clippy::disallowed_methods, reason = "a port tells nobody that it is listened at")]
fn wait_until(is_so: impl Fn() -> bool) {
    for _ in 0..600 {
        if is_so() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("it does not become so");
}
