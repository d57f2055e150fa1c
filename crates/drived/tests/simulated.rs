//! `sim`, and the other subcommands against it over a pty.
#![cfg(unix)]

mod support;

use support::{File, Running, Sim, path, run};

#[test]
fn a_drive_is_started_watched_and_stopped_by_the_words_that_it_confirms() {
    let sim = Sim::serve("start-stop", &["atv312@7"]);

    sim.on("atv312@7", &["setpoint", "30Hz"]);
    let held = sim.on("atv312@7", &["setpoint", "30Hz"]);
    assert!(held.assert_done().starts_with("atv312@7 holds the setpoint 30.00 Hz"), "{held:?}");
    let started = sim.on("atv312@7", &["start", "--direction", "reverse"]);
    assert!(
        started
            .assert_done()
            .starts_with("atv312@7 started reverse at 30.00 Hz: the drive shows running, reverse")
    );
    let status = sim.on("atv312@7", &["status", "--all"]);
    let out = status.assert_done();
    assert!(out.contains("state             running, reverse") && out.contains("line voltage"), "{out}");
    let stopped = sim.on("atv312@7", &["stop", "--mode", "freewheel"]);
    let coasts = "atv312@7 has no output, the shaft may coast: the drive shows";
    assert!(stopped.assert_done().contains(coasts), "{stopped:?}");
}

#[test]
fn an_altivar_58_is_started_and_stopped_on_each_protocol_of_its_card() {
    for (baud, format, silence) in [
        ("19200", "8O1", "(t3.5 is 2.00 ms)"),
        ("9600", "7E1,ascii", "(a character in ASCII is 1.04 ms)"),
        ("19200", "8O1,unitelway", "(UNI-TELWAY's 10 bits are 0.52 ms)"),
    ] {
        let sim = Sim::serve_with("protocols", &["atv58@1-3"], &["--baud", baud, "--format", format]);
        let line = format!("{},{baud},{format}", sim.link());
        let on = |subcommand: &[&str]| run(&[subcommand, &["--line", &line, "--drive", "atv58@2"]].concat());
        assert!(on(&["setpoint", "30Hz"]).assert_done().contains("holds the setpoint 30.00 Hz"), "{format}");
        assert!(
            on(&["start"]).assert_done().contains("started forward at 30.00 Hz: the drive shows running"),
            "{format}"
        );
        assert!(on(&["stop"]).assert_done().contains("stands still"), "{format}");
        let polled = on(&["poll", "--period", "0", "--seconds", "1"]);
        assert!(polled.assert_done().contains(silence), "{polled:?}");
    }
}

#[test]
fn a_simulated_drive_does_not_understand_a_master_at_another_speed() {
    let sim = Sim::serve("speeds", &["atv312@7"]);
    for (baud, code) in [("19200", 0), ("9600", 1), ("4800", 1), ("19200", 0)] {
        let line = format!("{},{baud},8E1", sim.link());
        let status = run(&["status", "--line", &line, "--drive", "atv312@7"]);
        assert_eq!(status.code, Some(code), "{baud}: {status:?}");
    }
}

#[test]
fn a_drive_without_a_fault_says_so() {
    let sim = Sim::serve("faults", &["atv312@1"]);
    let faults = sim.on("atv312@1", &["faults"]);
    assert!(faults.assert_done().starts_with("atv312@1 has no fault\n"), "{faults:?}");
    let reset = sim.on("atv312@1", &["reset"]);
    assert!(reset.assert_done().starts_with("atv312@1 has no fault: "), "{reset:?}");
}

#[test]
fn a_drive_that_does_not_answer_is_named_and_the_exit_code_is_1() {
    let sim = Sim::serve("mute", &["atv312@1"]);
    for subcommand in [&["status"][..], &["start"], &["reset"]] {
        sim.on("atv312@2", subcommand).assert_refused(1, "atv312@2 does not answer");
    }
    let stop = sim.on("atv312@2", &["stop"]);
    stop.assert_stop_not_confirmed();
    assert!(stop.out.starts_with("atv312@2 has not confirmed the stop after 1 s"), "{stop:?}");
    let poll =
        run(&["poll", "--line", sim.link(), "--drive", "atv312@1-2", "--period", "0", "--seconds", "3"]);
    assert_eq!(poll.code, Some(1), "{poll:?}");
    assert!(poll.err.lines().last().is_some_and(|line| line.contains("no status from atv312@2")), "{poll:?}");
}

/// What is told is lost on a full disk, and not what was done.
#[cfg(target_os = "linux")]
#[test]
fn a_setpoint_whose_outcome_cannot_be_written_is_told_as_given() {
    let sim = Sim::serve("full-output", &["atv312@1"]);
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("it is there");
    let asked = ["setpoint", "--line", sim.link(), "--drive", "atv312@1", "20Hz"];
    let ended = support::drived(&asked).stdout(full).output().expect("the program starts");
    let why = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(0), "{why}");
    assert!(why.contains("the output cannot be written"), "{why}");
    let held = sim.on("atv312@1", &["setpoint", "20Hz"]);
    assert!(held.assert_done().starts_with("atv312@1 holds the setpoint 20.00 Hz"), "{held:?}");
}

/// ETA bit 10, "reference reached" (BBV51701 p. 13), is of the setpoint before.
#[test]
fn a_setpoint_is_told_with_what_the_drive_shows_behind_it() {
    let sim = Sim::serve("behind", &["atv312@1"]);
    sim.on("atv312@1", &["setpoint", "5Hz"]).assert_done();
    sim.on("atv312@1", &["start"]).assert_done();
    while !sim.on("atv312@1", &["status"]).assert_done().contains("at reference") {}
    let told = sim.on("atv312@1", &["setpoint", "45Hz"]);
    assert!(!told.assert_done().contains("at reference"), "{told:?}");
    sim.on("atv312@1", &["stop"]).assert_done();
}

#[test]
fn a_stop_that_is_given_up_says_that_it_is_not_confirmed() {
    let sim = Sim::serve("given-up", &["atv312@1"]);
    let mut stop = Running::start(&["stop", "--line", sim.link(), "--drive", "atv312@2"]);
    stop.wait_for("has not confirmed the stop after 1 s");
    stop.ask_to_end();
    stop.wait_for_log(
        "STOP NOT CONFIRMED, the motor may turn: use the emergency stop. atv312@2: asked to end",
    );
    assert_eq!(stop.end().0, Some(1));
}

#[test]
fn a_port_that_another_program_uses_is_refused() {
    let sim = Sim::serve("in-use", &["atv312@1"]);
    let mut poll = Running::start(&["poll", "--line", sim.link(), "--drive", "atv312@1"]);
    poll.wait_for("atv312@1");
    sim.on("atv312@1", &["status"]).assert_refused(2, sim.link());
}

#[test]
fn polling_ends_with_a_summary_of_each_drive_and_of_the_line() {
    let sim = Sim::serve("summary", &["atv312@1-3", "atv21@4"]);
    let line = format!("{},19200,8E1", sim.link());
    let poll = ["poll", "--line", &line, "--drive", "atv312@1-3", "--drive", "atv21@4", "--period", "0"];
    let mut running = Running::start(&poll);
    for _ in 0..4 {
        running.wait_for("@");
    }
    let (code, rest) = running.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("damaged") && rest.contains("atv21@4") && rest.contains("sweeps/s"), "{rest}");
}

#[test]
fn polling_for_programs_prints_objects() {
    let sim = Sim::serve("json", &["atv312@1"]);
    let arguments =
        ["poll", "--line", sim.link(), "--drive", "atv312@1", "--period", "0", "--seconds", "1", "--json"];
    let poll = run(&arguments);
    let objects: Vec<serde_json::Value> =
        poll.assert_done().lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    let (summary, statuses) = objects.split_last().expect("at least the summary");
    assert!(!statuses.is_empty() && statuses.iter().all(|object| object["kind"] == "status"), "{objects:?}");
    assert_eq!(summary["kind"], "summary");
    // How many there are is the machine's affair: the simulator is a program too, which a busy one keeps waiting.
    assert!(summary["drives"][0]["timeouts"].is_u64(), "{summary}");
    assert!(
        summary["line"]["shortest_silence_us"].as_u64() >= summary["line"]["needed_silence_us"].as_u64(),
        "{summary}"
    );
}

#[test]
fn a_parameter_is_read_written_and_read_back_and_it_is_said_where_it_is_kept() {
    let sim = Sim::serve("param", &["atv312@1"]);
    let read = sim.on("atv312@1", &["param", "get", "ACC"]);
    assert!(read.assert_done().contains("3.0 s"), "{read:?}");
    let written = sim.on("atv312@1", &["param", "set", "ACC", "4.5"]);
    assert!(written.assert_done().starts_with("atv312@1 ACC is now 4.5 s (kept in RAM"), "{written:?}");
    let again = sim.on("atv312@1", &["param", "set", "ACC", "4.5 s"]);
    assert!(again.assert_done().contains("was already 4.5 s"), "{again:?}");
    sim.on("atv312@1", &["param", "set", "ACC", "50000"]).assert_refused(2, "ACC (9001)");
}

#[test]
fn the_simulator_removes_its_link_when_it_is_asked_to_end() {
    let sim = Sim::serve("link", &["atv21@1"]);
    let link = std::path::PathBuf::from(sim.link());
    assert!(link.symlink_metadata().is_ok());
    let (code, rest) = sim.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(link.symlink_metadata().is_err());
}

#[test]
fn the_simulator_does_not_replace_a_file() {
    let path = support::path("a-file");
    std::fs::write(&path, "mine").expect("the file can be written");
    let text = path.to_str().expect("the path is text");
    run(&["sim", "--pty", text, "--drive", "atv312@1"])
        .assert_refused(2, "is no link that a simulator left behind");
    assert_eq!(std::fs::read_to_string(&path).expect("the file is still there"), "mine");
    std::fs::remove_file(path).expect("the file can be removed");
}

#[test]
fn the_demo_drives_its_motors_and_stops_them_when_it_is_asked_to_end() {
    let mut demo = Running::start(&["demo"]);
    demo.wait_for("running");
    let (code, rest) = demo.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("Ctrl-C: the motors were asked to stop"), "{rest}");
    assert!(rest.contains("stands still") && !rest.contains("NOT CONFIRMED"), "{rest}");
}

#[test]
fn a_3g3ev_is_reset_once_its_owner_says_which_input_function_resets_faults() {
    let sim = Sim::serve("option", &["3g3ev@4-5"]);
    sim.on("3g3ev@4", &["setpoint", "30Hz"]).assert_done();
    sim.on("3g3ev@4", &["start"]).assert_done();
    // While only its neighbour is asked, its time-over detection trips. Every look feeds it anew.
    let mut shown = String::new();
    for seconds in ["3", "4", "5", "6"] {
        sim.on("3g3ev@5", &["poll", "--seconds", seconds]).assert_done();
        shown = sim.on("3g3ev@4", &["faults"]).assert_done().to_owned();
        if shown.contains("has tripped") {
            break;
        }
    }
    assert!(shown.contains("3g3ev@4 has tripped"), "{shown}");

    let untold = sim.on("3g3ev@4", &["reset"]);
    untold.assert_refused(1, "by --option: fault-reset-function, saves");
    let told = sim.on("3g3ev@4", &["reset", "--option", "fault-reset-function=3"]);
    assert!(told.assert_done().starts_with("3g3ev@4 has no fault: "), "{told:?}");

    let foreign = sim.on("3g3ev@4", &["status", "--option", "authority=settings"]);
    foreign.assert_refused(
        2,
        "3g3ev@4: option authority belongs to the atv21: the 3g3ev has fault-reset-function",
    );
}

#[test]
fn parameters_are_saved_to_eeprom_only_when_that_is_asked_for_and_also_when_they_were_written_before() {
    let sim = Sim::serve_with("save", &["atv312@1", "3g3ev@2"], &["--baud", "19200", "--format", "8E1"]);
    let line = format!("{},19200,8E1", sim.link());
    let state = path("save-state");
    let drive = |(spec, name): (&str, &str)| {
        format!("[[drives]]\nline = \"bench\"\ndrive = \"{spec}\"\nname = \"{name}\"\n")
    };
    let drives: String = [("atv312@1", "pump"), ("3g3ev@2", "fan")].map(drive).concat();
    let head = format!("state = \"{}\"\n[lines.bench]\nport = \"{line}\"\n", state.display());
    let config = File::new("save", &(head + &drives));
    let on = |drive: &str, command: &[&str]| {
        let named = ["--line", &line, "--drive", drive, "--config", config.path()];
        run(&[&["param"], command, &named].concat())
    };
    for (drive, register, value, by) in
        [("atv312@1", "ACC", "45", "CMI bit 1"), ("3g3ev@2", "n20", "4.5", "ENTER, a write to 0900h")]
    {
        let written = on(drive, &["set", register, value]);
        assert!(
            written.assert_done().contains("is now") && !written.out.contains("saved its"),
            "{written:?}"
        );
        let saved = format!(
            "{drive} has saved its parameters to EEPROM by {by}: all that it kept in RAM, not one alone; saves counted: 1"
        );
        for command in [&["set", register, value, "--save"][..], &["save"]] {
            let kept = on(drive, command);
            assert_eq!(kept.assert_done().lines().last(), Some(saved.as_str()));
        }
    }
    let counted = on("3g3ev@2", &["save", "--option", "saves=120"]);
    assert!(counted.assert_done().ends_with("; saves counted: 121\n"), "{counted:?}");
    // In the ledger of the daemon that has these drives: what was saved, and nothing of what was kept in RAM.
    let ledger = std::fs::read_to_string(state.join("eeprom.json")).expect("it is kept");
    let ledger: serde_json::Value = serde_json::from_str(&ledger).expect("it is JSON");
    let writes = |drive: &str| {
        let mut kept = ledger.as_object().into_iter().flat_map(serde_json::Map::values);
        kept.find(|kept| kept["drive"] == drive).map(|kept| kept["record"]["writes"].clone())
    };
    assert_eq!((writes("pump"), writes("fan")), (Some(2.into()), Some(3.into())), "{ledger}");
    std::fs::remove_dir_all(state).expect("it was kept there");
    let nowhere =
        run(&["param", "save", "--line", &line, "--drive", "atv312@1", "--config", "/nowhere.toml"]);
    assert!(
        nowhere.err.contains("the writes to the drive's EEPROM are counted nowhere: /nowhere.toml: "),
        "{nowhere:?}"
    );
    on("atv312@1", &["set", "LFr", "30", "--save"]).assert_refused(2, "LFr (8502) is kept in RAM only");
    on("atv58@3", &["set", "ACC", "4.5", "--save"]).assert_refused(2, "no command that saves its parameters");
    on("atv28@3", &["save"]).assert_refused(2, "no command that saves its parameters");
}

#[test]
fn a_scan_says_how_long_it_takes_then_names_who_answers_and_how_to_go_on() {
    let sim = Sim::serve_with("scan", &["atv312@1-2", "3g3ev@5"], &["--baud", "19200", "--format", "8E1"]);
    let line = format!("{},19200,8E1", sim.link());
    let scan = run(&["scan", "--line", &line, "--addresses", "1-6"]);
    let out = scan.assert_done();
    // Six times 8 characters, the 100 ms of the wait and the 7 characters of an answer that began at its end: 651.6 ms, and what
    // it takes to open the port, which is measured.
    let told = out.split(" ms if none answers").next().and_then(|rest| rest.rsplit(' ').next());
    let told: u32 = told.and_then(|told| told.parse().ok()).unwrap_or_default();
    assert!(out.starts_with("asking 6 addresses on ") && told >= 652, "{out}");
    assert!(
        out.contains("    2  atv312 (TELEMECANIQUE ATV312HU15N4 0102, 1.5 kW, 4.1 A), by its own words\n"),
        "{out}"
    );
    assert!(out.contains("    5  likely 3g3ev, by its registers\n"), "{out}");
    assert!(out.contains("3 of 6 addresses answer\n"), "{out}");
    let next = format!("drived poll --line {line} --drive atv312@1,2 --drive 3g3ev@5");
    assert!(out.contains(&next), "{out}");

    run(&["scan", "--line", &line, "--addresses", "7-8"]).assert_refused(1, "nobody answers at 2 addresses");
    run(&["scan", "--line", sim.link()]).assert_refused(2, "say which speed and format the line has");
    run(&["scan", "--line", &line, "--addresses", "0-8"]).assert_refused(2, "0 is not a slave address");
    run(&["scan", "--line", &line, "--wait", "0"]).assert_refused(2, "how long to wait");
    run(&["scan", "--line", &line, "--speeds", "9600"])
        .assert_refused(2, "every motor on this line has to stand");
    run(&["scan", "--line", "tcp://127.0.0.1:9", "--standstill"]).assert_refused(2, "is for serial ports");
}

#[test]
fn a_scan_at_standstill_finds_the_speed_and_saves_a_configuration_that_passes_check() {
    let sim = Sim::serve_with("scan-all", &["atv312@1", "atv28@3"], &["--baud", "9600", "--format", "8N1"]);
    let to = support::path("scan-saved.toml");
    let to = to.to_str().expect("the path is text");
    let arguments =
        ["scan", "--line", sim.link(), "--standstill", "--first", "--addresses", "1-3", "--wait", "50ms"];
    let scan = run(&[&arguments[..], &["--save", to, "--json"]].concat());
    let out = &scan.out;
    assert_eq!(scan.code, Some(0), "{scan:?}");
    assert!(scan.err.contains("every motor on this line has to stand"), "{}", scan.err);
    let lines: Vec<serde_json::Value> =
        out.lines().map(|line| serde_json::from_str(line).expect("it is an object")).collect();
    let [one, other, summary] = &lines[..] else { panic!("{out}") };
    for (find, address, family) in [(one, 1, "atv312"), (other, 3, "atv28")] {
        assert_eq!(find["address"], address, "{find}");
        assert_eq!((&find["baud"], &find["format"]), (&9_600.into(), &"8N1".into()), "{find}");
        assert_eq!(find["families"][0]["family"], family, "{find}");
        assert_eq!(find["line"], format!("{},9600,8N1", sim.link()), "{find}");
    }
    assert_eq!(summary["summary"]["found"], 2, "{summary}");
    // Three addresses at 30 settings are 90 questions; it ended with the first setting at which somebody answered.
    assert!(summary["summary"]["questions"].as_u64().is_some_and(|asked| asked < 45), "{summary}");
    // ttO is 10 s from the factory (BBV51701 p. 55), and half of it is how often it is asked.
    assert_eq!(one["fed_every_ms"], 5_000, "{one}");
    run(&["check", "--config", to]).assert_done();
    run(&[&arguments[..], &["--save", to]].concat()).assert_refused(2, "name another by --save");
    std::fs::remove_file(to).expect("it was ours");
}

#[test]
fn lines_on_standard_input_act_on_the_world_of_the_simulated_drives() {
    let mut sim = Sim::serve("world", &["atv312@1", "atv21@2"]);
    sim.say("help", "DRIVE terminal NAME on | off");
    sim.say("drives", "atv21@2");
    sim.say("atv312@1 trip OCF", "done");
    let status = sim.on("atv312@1", &["status"]);
    assert!(status.assert_done().contains("fault"), "{status:?}");
    sim.say("atv21@2 power off", "done");
    sim.on("atv21@2", &["status"]).assert_refused(1, "atv21@2 does not answer");
    let refused = sim.say("atv312@2 power on", "refused:");
    assert!(refused.contains("\"atv312@2\" is no drive of this line: it has atv312@1, atv21@2"), "{refused}");
    sim.say("atv21@2 power on", "done");
    sim.on("atv21@2", &["status"]).assert_done();
    sim.say("line cut", "done");
    sim.on("atv21@2", &["status"]).assert_refused(1, "atv21@2 does not answer");
}

#[test]
fn a_stop_goes_on_against_a_drive_that_says_that_it_is_busy_and_is_an_alarm_in_its_time() {
    let mut sim = Sim::serve("busy", &["atv28@1"]);
    sim.on("atv28@1", &["setpoint", "30Hz"]).assert_done();
    sim.on("atv28@1", &["start"]).assert_done();
    sim.say("atv28@1 busy on", "done");
    let stop = sim.on("atv28@1", &["stop"]);
    stop.assert_stop_not_confirmed();
    assert!(sim.say("atv28@1 show", "output").starts_with("fed"), "nothing has stopped it");

    let mut stop = Running::start(&["stop", "--line", sim.link(), "--drive", "atv28@1"]);
    stop.wait_for("has not confirmed the stop after 1 s");
    sim.say("atv28@1 busy off", "done");
    let (code, rest) = stop.end();
    assert_eq!(code, Some(0), "{rest}");
    // A process that stood still while the ramp ended has not seen it.
    assert!(["stands still", "may coast"].iter().any(|end| rest.contains(end)), "{rest}");
    assert!(sim.say("atv28@1 show", "output").starts_with("not fed"));
}

#[test]
fn a_refusal_says_what_decides_instead_and_what_to_set() {
    /// What happens around the drive, the subcommand, and what is said of it.
    type Case = (&'static [&'static str], &'static [&'static str], &'static [&'static str]);
    let cases: [(&str, &[Case]); 5] = [
        (
            "atv21@1",
            &[
                (
                    &["terminal F on", "set CMOD 0"],
                    &["start"],
                    &["terminals command the drive", "switch off"],
                ),
                (&["set FMOD 1"], &["setpoint", "20Hz"], &["input VIA (FE46 = 1) decides", "set FMOD = 4"]),
                (&["trip 14"], &["reset"], &["input F, which is on", "set CMOD = 2"]),
            ],
        ),
        ("atv28@1", &[(&["panel takes"], &["start"], &["terminals or the panel command", "local control"])]),
        ("atv58@1", &[(&["panel takes"], &["start"], &["terminals or the panel command", "local control"])]),
        (
            "atv312@1",
            &[
                (&["set Atr 1"], &["start"], &["by Atr", "switch Atr off", "accept-self-restart Atr"]),
                (&["set Atr 0", "set Fr1 1"], &["start"], &["the reference channel Fr1", "set Fr1 to Mdb"]),
                (
                    &["set Fr1 164", "set PS2 131", "terminal LI3 on"],
                    &["start"],
                    &["a preset speed (PS2 to PS16)", "open the input, or set PS2 to PS16 to nO"],
                ),
                (&["set nSt 132"], &["start"], &["a stop by a logic input (nSt", "close the input of nSt"]),
            ],
        ),
        (
            "3g3ev@1",
            &[
                (&["panel takes"], &["start"], &["the panel or the terminals", "give the command back"]),
                (&["panel releases", "trip 9"], &["start"], &["tripped (fault 9)", "remove the cause"]),
            ],
        ),
    ];
    for (drive, cases) in cases {
        let mut sim = Sim::serve("refusals", &[drive]);
        for (deeds, subcommand, said) in cases {
            for deed in *deeds {
                sim.say(&format!("{drive} {deed}"), "done");
            }
            let refused = sim.on(drive, subcommand);
            assert_eq!(refused.code, Some(1), "{drive} {deeds:?}: {refused:?}");
            for words in *said {
                refused.assert_refused(1, words);
            }
        }
    }
}

#[test]
fn a_stop_that_takes_the_place_of_another_says_why_and_control_is_given_back() {
    let never = run(&["release", "--line", "/dev/nowhere", "--drive", "atv28@3"]);
    never.assert_refused(2, "cannot give control back: take it at the drive");
    let sim = Sim::serve("replaced", &["atv312@2"]);
    sim.on("atv312@2", &["setpoint", "5Hz"]).assert_done();
    sim.on("atv312@2", &["start"]).assert_done();
    sim.on("atv312@2", &["release"]).assert_refused(1, "the motor runs: stop it first");
    let stop = sim.on("atv312@2", &["stop"]);
    let told =
        "stop mode replaced: fast stop instead of ramp, the settings that decide what the control word does";
    assert!(stop.assert_done().contains(told), "{stop:?}");
    let released = sim.on("atv312@2", &["release"]);
    assert!(
        released.assert_done().starts_with("atv312@2 has given control back: the drive shows"),
        "{released:?}"
    );
}

#[test]
fn a_program_gets_one_object_of_every_subcommand_on_a_line() {
    let sim = Sim::serve("objects", &["atv312@1"]);
    let json = |subcommand: &[&str]| {
        let ended = sim.on("atv312@1", &[subcommand, &["--json"]].concat());
        assert_eq!(ended.code, Some(0), "{ended:?}");
        let said: serde_json::Value =
            serde_json::from_str(&ended.out).unwrap_or_else(|error| panic!("{error}: {ended:?}"));
        said
    };
    assert_eq!(json(&["status", "--all"])["status"]["state"], "disabled");
    for (subcommand, action) in [
        (&["setpoint", "20Hz"][..], "setpoint"),
        (&["start"], "start"),
        (&["stop"], "stop"),
        (&["reset"], "reset"),
        (&["param", "save"], "save"),
    ] {
        let said = json(subcommand);
        assert_eq!((&said["drive"], &said["action"]), (&"atv312@1".into(), &action.into()), "{said}");
        assert_eq!(said["outcome"], "confirmed", "{said}");
    }
    assert!(json(&["faults"])["history"].is_array());
    // BBV51701: ACC is 9001; its factory setting is 3.0 s.
    assert_eq!(json(&["param", "get", "ACC"])[0]["address"], 9001);
    let written = json(&["param", "set", "ACC", "5s"]);
    assert_eq!((&written["raw"], &written["changed"]), (&50.into(), &true.into()), "{written}");
    let saved = json(&["param", "set", "ACC", "6s", "--save"]);
    assert_eq!((&saved["raw"], &saved["saves"]), (&60.into(), &1.into()), "one object: {saved}");
    assert!(json(&["param", "dump"]).as_array().is_some_and(|rows| rows.len() > 100));
}
