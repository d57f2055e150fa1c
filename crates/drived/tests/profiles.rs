//! Drives from files at every door that the five families have: on a line of one's own, and in the daemon, with a folder, a reload and the
//! audit log. Over ptys, in real time; nothing here asserts a duration.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _, Write as _},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use support::{Ended, File, Running, Sim, drived, free_port, path, python_with, run};

/// The shipped profile of the Goodrive under a name of somebody's own.
const OWN: &str = include_str!("../../drive-profile/profiles/invt/goodrive.toml");

/// A folder with one profile; removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = path(&format!("{name}-profiles"));
        fs::create_dir_all(&folder).expect("it can be made");
        let folder = Self(folder);
        folder.write("");
        folder
    }

    /// Writes the profile with something behind it.
    fn write(&self, more: &str) {
        let text = OWN.replace("key = \"goodrive\"", "key = \"own-drive\"") + more;
        fs::write(self.0.join("own.toml"), text).expect("it can be written");
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// What an order of a drive from a file has said: on stderr is what is not known.
fn done(ended: &Ended) -> &str {
    assert_eq!(ended.code, Some(0), "{ended:?}");
    &ended.out
}

fn refused(ended: &Ended, reason: &str) {
    assert!(ended.code == Some(1) && ended.err.contains(reason), "{reason}: {ended:?}");
}

#[test]
fn a_drive_from_a_file_is_asked_and_commanded_on_a_line_as_the_five_are() {
    let sim = Sim::serve("profile-line", &["goodrive@3"]);
    let on = |words: &[&str]| sim.on("goodrive@3", words);
    assert!(on(&["status"]).assert_done().contains("ready"));
    // Its highest setpoint is its owner's to say.
    refused(&on(&["setpoint", "20Hz"]), "highest");
    done(&on(&["setpoint", "20Hz", "--option", "highest=50Hz"]));
    let started = on(&["start", "--option", "highest=50Hz"]);
    assert!(done(&started).contains("running"), "{}", started.out);
    assert!(started.err.contains("may start the motor when its power comes back"), "{}", started.err);
    // A start that is refused has changed nothing: neither the direction nor the speed of a motor that runs.
    for words in
        [&["start", "--setpoint", "40Hz"][..], &["start", "--direction", "reverse", "--setpoint", "40Hz"]]
    {
        let again = on(&[words, &["--option", "highest=50Hz"]].concat());
        refused(&again, "stop the motor first");
        assert!(on(&["param", "get", "FREQ"]).assert_done().contains("20.00 Hz"), "{again:?}");
    }
    on(&["stop"]).assert_done();
    assert!(on(&["param", "dump"]).assert_done().contains("STATE"));
    assert!(on(&["faults"]).code == Some(0));
    assert!(run(&["families", "goodrive"]).assert_done().contains("INVT Goodrive"));
    let plan = run(&["plan", "--line", "/dev/ttyUSB0,19200,8E1", "--drive", "goodrive@1-10"]);
    plan.assert_done();
}

#[test]
fn an_order_beyond_the_level_of_a_drive_is_refused_with_what_keeps_it_from_there() {
    let sim = Sim::serve("profile-level", &["ms300@4"]);
    let start = sim.on("ms300@4", &["start"]);
    refused(&start, "its profile reaches stop and no further");
    refused(&start, "other makers have other words");
    sim.on("ms300@4", &["stop"]).assert_done();
}

#[test]
fn profiles_are_listed_shown_and_checked_and_a_template_asks_the_next_question() {
    let listed = run(&["profile", "list"]);
    for words in ["v20", "Siemens SINAMICS V20", "motion", "ms300", "stop", "shipped"] {
        assert!(listed.assert_done().contains(words), "{}", listed.out);
    }
    let shown = run(&["profile", "show", "v20"]);
    for words in ["level motion", "How it is stopped", "write STW 047Eh", "Operating Instructions"] {
        assert!(shown.assert_done().contains(words), "{}", shown.out);
    }
    let shown = run(&["profile", "show", "v20", "--json"]);
    assert!(shown.assert_done().contains("\"level\":\"motion\""), "{}", shown.out);
    let file = path("new-profile.toml");
    let file = file.to_str().expect("the path is text");
    run(&["profile", "new", "my-drive", "--to", file]).assert_done();
    run(&["profile", "new", "my-drive", "--to", file]).assert_refused(2, "it is there already");
    let checked = run(&["profile", "check", file]);
    assert!(checked.assert_done().contains("it reaches watch"), "{}", checked.out);
    assert!(checked.out.contains("next question"), "{}", checked.out);
    let damaged = fs::read_to_string(file).expect("it is there").replace("[who]\n", "[who]\ncolour = 1\n");
    fs::write(file, damaged).expect("it can be written");
    let refused = run(&["profile", "check", file]);
    refused.assert_refused(2, "refused");
    assert!(refused.out.contains("colour") && refused.out.contains("write"), "{}", refused.out);
    fs::remove_file(file).expect("it is there");
    let tried = run(&["profile", "try", "wj200", "--sim"]);
    for words in [
        "not that it is true",
        "start forward: confirmed, not known whether",
        "start reverse: confirmed",
        "stop: confirmed",
        "trip: it is told",
        "reset: confirmed",
    ] {
        assert!(tried.assert_done().contains(words), "{words}: {}", tried.out);
    }
    run(&["profile", "try", "wj200", "--sim", "--person", "A. Fitter"]).assert_refused(2, "--person");
    run(&["profile", "try", "wj200"]).assert_refused(2, "--line");
    run(&["profile", "show", "no-such-drive"]).assert_refused(2, "there is no profile");
    assert!(run(&["export", "profile-schema"]).assert_done().contains("$schema"));
}

#[test]
fn the_environment_names_a_folder_for_every_subcommand_and_a_broken_file_there_stops_nobody() {
    let folder = Folder::new("environment");
    let with = |words: &[&str]| {
        let output = drived(words).env("DRIVED_PROFILES", &folder.0).output().expect("the program runs");
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr),
        )
    };
    let (code, said) = with(&["profile", "list"]);
    assert!(code == Some(0) && said.contains("own-drive") && said.contains("own.toml"), "{said}");
    fs::write(folder.0.join("broken.toml"), "format = 1\n").expect("it can be written");
    let (code, said) = with(&["families"]);
    assert!(code == Some(0) && said.contains("broken.toml") && said.contains("atv312"), "{said}");
    // Which of two files of one key is meant nobody can tell: neither is taken.
    fs::copy(folder.0.join("own.toml"), folder.0.join("twice.toml")).expect("it can be copied");
    let (code, said) = with(&["families", "own-drive"]);
    assert!(code == Some(2) && said.contains("neither is taken") && said.contains("broken.toml"), "{said}");
    assert!(said.contains("twice.toml") && said.contains("give one of them another"), "{said}");
}

/// The acceleration ramp of a Goodrive, P00.11, with where a value lives.
const RAMP: &str = "\n[register.P0011]\nwhat = \"acceleration time (P00.11)\"\naddress = 0x000B\naccess = \"read_write\"\nparameter = true\n\
    storage = \"eeprom\"\nunit = \"s\"\nscale = [1, 10]\nrange = [0, 36000]\nsource = \"manuals\"\n\n[state]\n";

#[test]
fn parameters_of_a_drive_from_a_file_are_kept_compared_and_restored() {
    let folder = Folder::new("restored");
    let text = OWN.replace("key = \"goodrive\"", "key = \"own-drive\"").replacen("\n[state]\n", RAMP, 1);
    fs::write(folder.0.join("own.toml"), text).expect("it can be written");
    let (link, kept) = (path("restored-line"), path("restored-kept.toml"));
    let (link, kept) = (link.to_str().expect("the path is text"), kept.to_str().expect("the path is text"));
    let serve = ["sim", "--pty", link, "--drive", "own-drive@3", "--baud", "19200", "--format", "8E1"];
    let mut sim = drived(&serve)
        .env("DRIVED_PROFILES", &folder.0)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut said = String::new();
    BufReader::new(sim.stdout.as_mut().expect("it is piped")).read_line(&mut said).expect("it speaks");
    let line = format!("{link},19200,8E1");
    let on = |words: &[&str]| {
        let words = [&["param"], words, &["--line", &line]].concat();
        let output = drived(&words).env("DRIVED_PROFILES", &folder.0).output().expect("the program runs");
        let told = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        (output.status.code(), told.into_owned())
    };
    let right = |(code, told): (Option<i32>, String)| {
        assert_eq!(code, Some(0), "{told}");
        told
    };
    right(on(&["set", "--drive", "own-drive@3", "P0011", "3.0"]));
    right(on(&["backup", "own-drive@3", "--to", kept]));
    right(on(&["set", "--drive", "own-drive@3", "P0011", "4.5"]));
    let (code, told) = on(&["diff", kept, "own-drive@3"]);
    assert!(code == Some(1) && told.contains("P0011") && told.contains("4.5"), "{code:?} {told}");
    right(on(&["restore", kept, "--write"]));
    assert!(right(on(&["get", "--drive", "own-drive@3", "P0011"])).contains("3.0 s"));
    sim.kill().expect("it runs");
    sim.wait().expect("it ends");
    let _ = fs::remove_file(kept);
}

/// A drive with a coil, an input, an input register and a holding register of one address.
const SPACES: &str = include_str!("../../drive-profile/tests/data/spaces.toml");

/// Coils and inputs as parameters, over the simulator of the same file, and over a slave of another hand.
#[test]
fn a_parameter_is_read_and_written_in_whichever_of_the_four_spaces_it_stands() {
    let folder = Folder::new("spaces");
    fs::write(folder.0.join("own.toml"), SPACES).expect("it can be written");
    let link = path("spaces-line");
    let link = link.to_str().expect("the path is text");
    let mut sim = drived(&["sim", "--pty", link, "--drive", "spaces@3", "--baud", "9600", "--format", "8E1"]);
    serves(sim.env("DRIVED_PROFILES", &folder.0), || {
        in_four_spaces(&folder, &format!("{link},9600,8E1"), None);
    });
    if let Some(python) = python_with("pymodbus") {
        let port = free_port().to_string();
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/peers/spaces.py");
        let mut stranger = Command::new(python);
        // What its coil, its inputs and its register hold from the beginning.
        let held = ["0 off", "1 on", "325.0 V", "3.0 s"];
        serves(stranger.args([script, &port]), || {
            in_four_spaces(&folder, &format!("tcp://127.0.0.1:{port}"), Some(held));
        });
    }
}

/// Runs a server until this is done.
fn serves(command: &mut Command, then: impl FnOnce()) {
    let mut server = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it runs");
    let mut said = String::new();
    BufReader::new(server.stdout.as_mut().expect("it is piped")).read_line(&mut said).expect("it speaks");
    then();
    server.kill().expect("it runs");
    server.wait().expect("it ends");
}

fn in_four_spaces(folder: &Folder, line: &str, held: Option<[&str; 4]>) {
    let on = |words: &[&str]| {
        let words = [&["param"], words, &["--line", line]].concat();
        let output = drived(&words).env("DRIVED_PROFILES", &folder.0).output().expect("the program runs");
        let told = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        (output.status.code(), told.into_owned())
    };
    let one = |words: &[&str]| on(&[words, &["--drive", "spaces@3"]].concat());
    let right = |(code, told): (Option<i32>, String)| {
        assert_eq!(code, Some(0), "{told}");
        told
    };
    let line_of = |told: &str, code: &str| {
        let found = told.lines().find(|line| line.contains(code)).unwrap_or_default();
        found.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let dumped = right(one(&["dump"]));
    let places = [
        ("BRAKE", "coil 512 BRAKE"),
        ("DOOR", "discrete input 512 DOOR"),
        ("SUPPLY", "input register 512 SUPPLY"),
        ("ACC", "512 ACC"),
    ];
    for (at, (code, place)) in places.into_iter().enumerate() {
        let told = line_of(&dumped, code);
        assert!(told.starts_with(place), "{dumped}");
        assert!(held.is_none_or(|held| told.starts_with(&format!("{place} {}", held[at]))), "{dumped}");
    }
    // Each by its name, and each at its address leaves the other there alone.
    right(one(&["set", "ACC", "4.5"]));
    right(one(&["set", "BRAKE", "on"]));
    right(one(&["set", "coil 512", "on"]));
    let got = |register| line_of(&right(one(&["get", register])), "512");
    assert!(got("BRAKE").starts_with("coil 512 BRAKE 1 on"), "{}", got("BRAKE"));
    assert!(got("512").starts_with("512 ACC 4.5 s"), "{}", got("512"));
    // A bit is nothing but on and off, and nobody writes an input.
    let refused = |words: &[&str], why: &str| {
        let (code, told) = one(words);
        assert!(code != Some(0) && told.contains(why), "{why}: {code:?} {told}");
    };
    refused(&["set", "BRAKE", "2"], "expected");
    refused(&["set", "DOOR", "on"], "can only be read");
    refused(&["set", "SUPPLY", "3"], "can only be read");
    // What keeps its value is kept, compared and put back.
    let kept = path("spaces-kept.toml");
    let kept = kept.to_str().expect("the path is text");
    right(on(&["backup", "spaces@3", "--to", kept]));
    let text = fs::read_to_string(kept).expect("it was written");
    let is_kept = |code: &str| text.lines().any(|line| line.starts_with(code));
    assert!(is_kept("BRAKE") && is_kept("ACC") && !is_kept("DOOR") && !is_kept("SUPPLY"), "{text}");
    assert!(line_of(&text, "BRAKE").contains("space = \"coil\""), "{text}");
    right(one(&["set", "BRAKE", "off"]));
    let (code, told) = on(&["diff", kept, "spaces@3"]);
    assert!(code == Some(1) && told.contains("BRAKE") && !told.contains("ACC"), "{code:?} {told}");
    right(on(&["restore", kept, "--write"]));
    assert!(
        got("BRAKE").starts_with("coil 512 BRAKE 1 on") && got("ACC").contains("4.5 s"),
        "{}",
        got("BRAKE")
    );
    // A file of a profile in which the name stood elsewhere puts nothing back.
    fs::write(kept, text.replace("space = \"coil\", ", "")).expect("it can be written");
    let (code, told) = on(&["restore", kept, "--write"]);
    assert!(code == Some(2) && told.contains("BRAKE is a coil"), "{code:?} {told}");
    let _ = fs::remove_file(kept);
}

fn configuration(folder: &Path, state: &Path, port: &str) -> String {
    format!(
        "profiles = \"{}\"\nstate = \"{}\"\nsnapshots = \"500ms\"\n[http]\nlisten = \"off\"\n[lines.bench]\nport = \"{port},19200,8E1\"\n\
         [[drives]]\nline = \"bench\"\ndrive = \"own-drive@3\"\nname = \"pump\"\ncontrol = true\noptions = {{ highest = \"50Hz\" }}\n",
        folder.display(),
        state.display()
    )
}

#[test]
fn the_daemon_drives_it_keeps_to_the_profile_with_which_it_began_and_its_audit_log_names_it() {
    let folder = Folder::new("daemon");
    let state = path("daemon-profiles-state");
    let sim = Sim::serve("profile-daemon", &["goodrive@3"]);
    let file = File::new("profile-daemon", &configuration(&folder.0, &state, sim.link()));
    run(&["check", "--config", file.path()]).assert_done();
    let socket = path("profile-daemon.sock");
    let socket = socket.to_str().expect("the path is text");
    let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
    daemon.wait_for(r#""event":"connected""#);
    let started = run(&["start", "pump", "--setpoint", "20Hz", "--socket", socket]);
    done(&started);
    assert!(started.err.contains("may start the motor when its power comes back"), "{}", started.err);
    folder.write("\n# Something else.\n");
    let reloaded = run(&["reload", "--socket", socket]);
    assert!(
        reloaded.assert_done().contains("the profile of pump: from the next start on"),
        "{}",
        reloaded.out
    );
    let again = run(&["reload", "--socket", socket]);
    assert!(
        again.assert_done().contains("the profile of pump"),
        "it still goes on by the old one: {}",
        again.out
    );
    assert!(run(&["status", "pump", "--socket", socket]).assert_done().contains("running"));
    // A file that is gone is no profile any more, and the old configuration holds.
    fs::remove_file(folder.0.join("own.toml")).expect("it is there");
    run(&["reload", "--socket", socket])
        .assert_refused(2, "no profile in the folder says any more what own-drive is");
    assert!(run(&["status", "pump", "--socket", socket]).assert_done().contains("running"));
    run(&["stop", "pump", "--socket", socket]).assert_done();
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    let log = fs::read_to_string(state.join("audit")).expect("it is there");
    let connected =
        log.lines().find(|line| line.contains("driven by the profile own-drive")).expect("it stands there");
    let hex = connected.split("own-drive ").nth(1).and_then(|rest| rest.get(..64)).unwrap_or_default();
    assert!(hex.len() == 64 && hex.bytes().all(|byte| byte.is_ascii_hexdigit()), "{connected}");
    let _ = fs::remove_dir_all(&state);
}

/// 5 in 2000h is the stop of a Goodrive, and 1 its start (p. "communication command"): a SCADA that writes the one stops the motor, ahead of all.
#[test]
fn the_stop_word_of_a_drive_from_a_file_stops_it_through_a_gateway_and_no_other_word_moves_it() {
    let folder = Folder::new("gateway");
    let state = path("gateway-profiles-state");
    let sim = Sim::serve("profile-gateway", &["goodrive@3"]);
    let port = free_port();
    let gateway = format!(
        "[[gateways]]\nlisten = \"127.0.0.1:{port}\"\nwrites = \"operate\"\nbroadcast = true\npatience = \"9s\"\n"
    );
    let file = File::new("profile-gateway", &(configuration(&folder.0, &state, sim.link()) + &gateway));
    let checked = run(&["check", "--config", file.path()]);
    assert!(checked.assert_done().contains("of drives by file stops alone"), "{}", checked.out);
    let socket = path("profile-gateway.sock");
    let socket = socket.to_str().expect("the path is text");
    let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
    daemon.wait_for(r#""event":"connected""#);
    done(&run(&["start", "pump", "--setpoint", "20Hz", "--socket", socket]));
    let mut scada = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    scada.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out can be set");
    let mut write = |unit: u8, word: u8| {
        scada.write_all(&[0, 1, 0, 0, 0, 6, unit, 6, 0x20, 0, 0, word]).expect("it takes it");
        let mut answer = [0; 9];
        scada.read_exact(&mut answer).expect("each request gets an answer");
        if answer[7] == 6 {
            scada.read_exact(&mut [0; 3]).expect("the echo is whole");
        }
        answer[7]
    };
    // A start, another drive's words for all, and the stop of its own.
    assert_eq!([write(3, 2), write(0, 5)], [0x86, 0x86], "refused");
    assert!(run(&["status", "pump", "--socket", socket]).assert_done().contains("running"));
    assert_eq!(write(3, 5), 6, "the stop is taken");
    assert!(!run(&["status", "pump", "--socket", socket]).assert_done().contains("running"));
    run(&["stop", "pump", "--socket", socket]).assert_done();
    let (code, last) = daemon.interrupt();
    assert_eq!(code, Some(0), "{last}");
    let _ = fs::remove_dir_all(&state);
}

#[test]
fn a_configuration_whose_folder_or_name_cannot_be_is_refused_with_the_line() {
    let folder = Folder::new("refused");
    let state = path("refused-state");
    let text = configuration(&folder.0, &state, "/dev/ttyUSB99");
    for (place, by, reason) in [
        ("profiles = \"", "profiles = \"/nowhere", "nowhere"),
        ("own-drive@3", "other-drive@3", "is not a family of drives"),
    ] {
        let file = File::new("refused-profiles", &text.replacen(place, by, 1));
        run(&["check", "--config", file.path()]).assert_refused(2, reason);
    }
    // What the bus does not set is set at the drive, and its owner says to what.
    let watched =
        text.replacen("own-drive@3\"", "vfs15@3\"\nwatchdog = { time = \"2s\", reaction = \"trip\" }", 1);
    let file = File::new("refused-watchdog", &watched);
    let refused = run(&["check", "--config", file.path()]);
    refused.assert_refused(2, "expected options = { watchdog-time = \"2s\" }");
    let said = text.replacen("own-drive@3", "vfs15@3", 1).replacen(
        "options = { highest",
        "options = { watchdog-time = \"2s\", highest",
        1,
    );
    let file = File::new("said-watchdog", &said);
    run(&["check", "--config", file.path()]).assert_done();
    let planned = run(&["plan", "--config", file.path()]);
    assert!(planned.assert_done().contains("watchdog of 2s, fed within"), "{planned:?}");
    // A file that no drive needs is left out, and said. One that a drive needs keeps it from being driven, by the file's own error.
    fs::write(folder.0.join("v20.toml"), OWN.replace("key = \"goodrive\"", "key = \"v20\""))
        .expect("it can be written");
    fs::write(folder.0.join("other.toml"), "key = \"half-written\"\nformat 1\n").expect("it can be written");
    let file = File::new("refused-taken", &text);
    let checked = run(&["check", "--config", file.path()]);
    let said = format!("{}{}", checked.assert_done(), checked.err);
    assert!(said.contains("is the name of a family that this program has"), "{said}");
    assert!(said.contains("other.toml:2: "), "{said}");
    for (drive, reason) in
        [("v20@3", "v20 is not driven by its profile"), ("half-written@3", "other.toml:2: ")]
    {
        let file = File::new("refused-needed", &text.replacen("own-drive@3", drive, 1));
        run(&["check", "--config", file.path()]).assert_refused(2, reason);
    }
}
