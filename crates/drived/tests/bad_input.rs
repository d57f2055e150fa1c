//! Bad input: one clear line on stderr, exit code 2, never a panic.

mod support;

use support::run;

const PORT: &str = "/dev/there-is-no-such-port";

#[test]
fn an_unknown_family_is_answered_with_the_families_that_there_are() {
    for arguments in [
        &["poll", "--line", PORT, "--drive", "atv999@1"][..],
        &["sim", "--pty", PORT, "--drive", "atv999@1"],
        &["status", "--line", PORT, "--drive", "atv999@1"],
        &["param", "list", "atv999"],
    ] {
        let ended = run(arguments);
        ended.assert_refused(2, "\"atv999\" is not a family of drives");
        for family in ["atv21", "atv28", "atv58", "atv312", "3g3ev"] {
            ended.assert_refused(2, family);
        }
    }
}

#[test]
fn an_address_that_no_slave_can_have_is_refused() {
    for (drive, reason) in [
        ("atv312@0", "0 is not a slave address: expected 1 to 247"),
        ("atv312@248", "248 is not a slave address: expected 1 to 247"),
        ("atv312@1000", "\"1000\" is not an address"),
        ("atv312@1-", "\"\" is not an address"),
        ("atv312@3-1", "the range 3-1 runs backwards"),
        ("atv312@1,1", "the address 1 is named twice"),
        ("atv28@32", "has addresses 1 to 31"),
        ("atv312", "expected FAMILY@ADDRESSES"),
    ] {
        run(&["poll", "--line", PORT, "--drive", drive]).assert_refused(2, reason);
        run(&["sim", "--pty", PORT, "--drive", drive]).assert_refused(2, reason);
        run(&["stop", "--line", PORT, "--drive", drive]).assert_refused(2, reason);
    }
}

#[test]
fn two_drives_at_one_address_are_refused() {
    let ended = run(&["poll", "--line", PORT, "--drive", "atv312@1-3", "--drive", "atv58@3"]);
    ended.assert_refused(2, "atv312@3 and atv58@3: two drives cannot have one address");
}

#[test]
fn a_subcommand_for_one_drive_refuses_several() {
    run(&["start", "--line", PORT, "--drive", "atv312@1-2"]).assert_refused(2, "names several drives");
}

#[test]
fn an_impossible_line_is_refused() {
    for (line, reason) in [
        ("/dev/ttyUSB0,0", "0 bit/s is not a serial speed"),
        ("/dev/ttyUSB0,12345", "atv312@1: 12345 bit/s: Schneider Altivar 312 has 4800, 9600, 19200"),
        ("/dev/ttyUSB0,fast", "\"fast\" is not a speed"),
        ("/dev/ttyUSB0,19200,9X9", "\"9X9\" is not a character format"),
        ("/dev/ttyUSB0,19200,7E1", "atv312@1: format 7E1: Schneider Altivar 312 has"),
        ("tcp://gateway", "\"gateway\" is not HOST:PORT"),
        ("tcp://gateway:502,19200", "Modbus TCP has no speed"),
        ("http://gateway", "expected PATH"),
    ] {
        run(&["poll", "--line", line, "--drive", "atv312@1"]).assert_refused(2, reason);
    }
    let ended = run(&["sim", "--pty", PORT, "--drive", "atv312@1", "--baud", "0"]);
    ended.assert_refused(2, "0 bit/s is not a serial speed");
    let ended = run(&["sim", "--pty", PORT, "--drive", "atv312@1", "--format", "8X1"]);
    ended.assert_refused(2, "\"8X1\" is not a character format");
}

#[test]
fn drives_that_cannot_share_a_line_are_refused_by_name() {
    let drives = ["--drive", "atv312@1", "--drive", "atv28@2"];
    let ended = run(&[&["poll", "--line", PORT], &drives[..]].concat());
    ended.assert_refused(2, "say which speed and format the line has");
    let line = "/dev/ttyUSB0,19200,8E1";
    let ended = run(&[&["poll", "--line", line], &drives[..]].concat());
    ended.assert_refused(2, "atv28@2: format 8E1");
}

#[test]
fn a_missing_port_is_named() {
    for subcommand in ["poll", "status", "start", "faults", "reset"] {
        run(&[subcommand, "--line", PORT, "--drive", "atv312@1"]).assert_refused(2, PORT);
    }
    // A motor that was to be stopped is more than bad input.
    run(&["stop", "--line", PORT, "--drive", "atv312@1"]).assert_refused(1, "STOP NOT CONFIRMED");
    run(&["setpoint", "30Hz", "--line", PORT, "--drive", "atv312@1"]).assert_refused(2, PORT);
    // Nobody listens on the discard port of this machine.
    let line = "rtu+tcp://127.0.0.1:9";
    run(&["status", "--line", line, "--drive", "atv312@1"]).assert_refused(2, "127.0.0.1:9");
}

#[test]
fn what_a_family_cannot_do_is_refused_before_the_port_is_opened() {
    let ended = run(&["setpoint", "1450rpm", "--line", PORT, "--drive", "3g3ev@1"]);
    ended.assert_refused(2, "takes no speed in rpm");
    let ended = run(&["setpoint", "fast", "--line", PORT, "--drive", "atv312@1"]);
    ended.assert_refused(2, "expected a frequency");
    let ended = run(&["setpoint", "30", "--line", PORT, "--drive", "atv312@1"]);
    ended.assert_refused(2, "\"30\" of what? 30Hz, or 30rpm");
    let ended = run(&["stop", "--mode", "sideways", "--line", PORT, "--drive", "atv312@1"]);
    ended.assert_refused(2, "expected one of ramp, fast, freewheel, DC injection");
    let ended = run(&["param", "set", "ETA", "1", "--line", PORT, "--drive", "atv312@1"]);
    ended.assert_refused(2, "ETA (3201): the register can only be read");
    let ended = run(&["param", "get", "NOPE", "--line", PORT, "--drive", "atv312@1"]);
    ended.assert_refused(2, "has no register \"NOPE\": drived param list atv312 has all");
}

#[test]
fn an_option_that_no_drive_of_the_line_has_is_refused() {
    for (drive, option, reason) in [
        ("3g3ev@1", "saves", "expected NAME=VALUE"),
        ("3g3ev@1", "speed=5", "\"speed\" is not an option of a drive: expected one of authority,"),
        ("3g3ev@1", "saves=many", "option saves: \"many\" is not a value of it: expected a whole number"),
        ("atv312@1", "saves=1", "atv312@1: option saves belongs to the 3g3ev: the atv312 has none"),
    ] {
        for subcommand in ["poll", "status", "stop"] {
            let ended = run(&[subcommand, "--line", PORT, "--drive", drive, "--option", option]);
            ended.assert_refused(2, reason);
        }
    }
}

#[test]
fn what_is_missing_or_misspelt_is_said() {
    for (arguments, reason) in [
        (&["poll"][..], "--line <LINE>"),
        (&["poll", "--line", PORT], "--drive <FAMILY@ADDRESSES>"),
        (&["poll", "--line", PORT, "--drive", "atv312@1", "--period", "1"], "such as 500ms, 1s or 2min"),
        (&["fly"], "unrecognized subcommand 'fly'"),
    ] {
        run(arguments).assert_refused(2, reason);
    }
}

#[test]
fn a_program_is_told_the_same_words_in_an_object() {
    for arguments in [
        &["status", "--line", PORT, "--drive", "atv312@1"][..],
        &["stop", "--line", PORT, "--drive", "atv312@1"],
        &["poll", "--line", PORT],
        &["fly"],
    ] {
        let said = run(arguments);
        let told = run(&[arguments, &["--json"]].concat());
        assert_eq!((told.code, told.out.as_str()), (said.code, ""), "{told:?}");
        let objects = told.err.lines().map(|line| serde_json::from_str(line).expect("an object"));
        let objects: Vec<serde_json::Value> = objects.collect();
        let (object, before) = objects.split_last().expect("why it ended");
        assert!(before.iter().all(|object| object["warning"].is_string()), "{told:?}");
        assert_eq!(object["exit_code"].as_i64(), said.code.map(i64::from), "{object}");
        let words = object["error"].as_str().expect("a text");
        // What is told to try instead names the arguments, which differ.
        let same = said.err.trim_end().strip_prefix("drived: ").expect("its name").split(" (usage").next();
        assert!(same.is_some_and(|same| words.starts_with(same)), "{words}\n{said:?}");
    }
    // Behind two dashes it is a name.
    run(&["status", "--", "--json"]).assert_refused(2, "no daemon serves");
}

#[test]
fn a_plan_that_cannot_work_is_refused_with_the_arithmetic() {
    let plan = ["plan", "--line", PORT, "--drive", "atv312@1-31"];
    let ended = run(&[&plan[..], &["--period", "500ms"]].concat());
    ended.assert_refused(2, "one status of 31 drives takes");
    let ended = run(&[&plan[..], &["--watchdog", "1s"]].concat());
    ended.assert_refused(2, "the watchdog of atv312@1 is 1s, and it might hear nothing for");
    let works = run(&[&plan[..], &["--watchdog", "10s"]].concat());
    assert!(works.assert_done().contains("with 3 dead"), "{works:?}");
}
