//! The mistakes of a tired engineer, in two profiles that one wrote from the makers' manuals alone: a PowerFlex 400, with what it needs
//! to tell itself and without, and an M-Max. Each let a drive reach motion, or said in words that did not help what is wrong.

use drive_profile::{Level, Profile, Refusals, read, shipped};

const MMAX: &str = include_str!("data/mmax.toml");
const POWERFLEX: &str = include_str!("data/pf400.toml");

fn shipped(name: &str) -> &'static str {
    shipped::TEXTS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).expect("it is shipped")
}

#[track_caller]
fn damaged(text: &str, place: &str, by: &str) -> String {
    assert_eq!(text.matches(place).count(), 1, "{place}");
    text.replace(place, by)
}

/// That a text is refused in the line that has this, for this reason, with this to write.
#[track_caller]
fn refused(text: &str, line: &str, reason: &str, write: &str) {
    let refusals = match read(text) {
        Ok(profile) => panic!("it reaches {}: {reason}", profile.level()),
        Err(Refusals(refusals)) => refusals,
    };
    let at = text.lines().position(|of| of.contains(line)).expect("it is there") + 1;
    let found = refusals.iter().find(|of| of.reason.contains(reason) && of.write.contains(write));
    let found = found.unwrap_or_else(|| panic!("{reason:?} is not among {refusals:#?}"));
    assert_eq!(found.line, at, "{found}");
}

/// That a text is held below a level in the line that has this, and by what.
#[track_caller]
fn held(text: &str, below: Level, line: &str, because: &str) -> Profile {
    let profile = read(text).unwrap_or_else(|refusals| panic!("{refusals}"));
    let at = text.lines().position(|of| of.contains(line)).expect("it is there") + 1;
    let gap = profile.gaps().iter().find(|gap| gap.what.contains(because));
    let gap = gap.unwrap_or_else(|| panic!("{because:?} is not among {:#?}", profile.gaps()));
    assert_eq!((gap.keeps_from, gap.line), (Some(below), at), "{gap}");
    assert!(profile.level() < below, "{because}");
    profile
}

#[test]
fn both_are_right_as_they_were_written() {
    assert_eq!(read(MMAX).expect("it is right").level(), Level::Motion);
    // 2000h has other words at each maker's, and nothing tells a PowerFlex 400 from theirs.
    assert_eq!(read(POWERFLEX).expect("it is right").level(), Level::Stop);
}

/// The run bit of the control word stands on: the next setpoint turns the motor.
#[test]
fn a_stop_by_a_setpoint_of_zero_leaves_the_run_command_standing() {
    const STOP: &str = "ramp = { steps = [{ write = \"CONTROL\", words = [0x0010] }]";
    let reset = MMAX.lines().find(|line| line.starts_with("reset = ")).expect("it has one");
    let none = damaged(MMAX, reset, "reset = \"unknown\"");
    let stop = "ramp = { steps = [{ write = \"SPEED_SETPOINT\", words = [0] }]";
    refused(&damaged(&none, STOP, stop), stop, "leaves the run command of start.forward standing", "run bit");
    // Before it is known how it is started.
    let starts: Vec<&str> = none
        .lines()
        .filter(|line| line.starts_with("forward = ") || line.starts_with("reverse = "))
        .collect();
    let without = damaged(&damaged(&none, STOP, stop), starts[0], "forward = \"unknown\"");
    let without = damaged(&without, starts[1], "reverse = \"unknown\"");
    refused(&without, stop, "leaves the run words of [command] standing", "run bit");
}

/// Of a drive whose setpoint is its run command it is the stop.
#[test]
fn a_stop_by_a_setpoint_of_zero_stops_what_a_setpoint_starts() {
    assert_eq!(read(include_str!("data/signed.toml")).expect("it is right").level(), Level::Motion);
}

/// Every start would be borne out by its own echo.
#[test]
fn an_output_that_is_what_was_written_shows_nothing() {
    let text = damaged(MMAX, "output = \"FREQUENCY\"", "output = \"SPEED_SETPOINT\"");
    refused(
        &text,
        "output = \"SPEED",
        "SPEED_SETPOINT is what was written, and shows nothing of the motor",
        "the register of the output",
    );
    let text = damaged(MMAX, "speed = \"SPEED\"", "speed = \"SPEED_SETPOINT\"");
    refused(
        &text,
        "speed = \"SPEED_",
        "SPEED_SETPOINT is what was written, and shows nothing of the motor",
        "the register of the output",
    );
}

#[test]
fn a_register_that_every_healthy_drive_reads_so_or_that_changes_is_no_fingerprint() {
    let with = |register: &str, is: &str| {
        let by = format!(
            "\nfingerprints = [{{ what = \"it is a PowerFlex\", register = \"{register}\", {is}, source = \"manual\" }}]"
        );
        damaged(POWERFLEX, "\nfingerprints = \"unknown\"", &by)
    };
    let line = "fingerprints = [{ what = \"it is a PowerFlex";
    for (register, is, reason) in [
        ("ERROR", "is = [0]", "changes while the drive works"),
        ("FEEDBACK", "is = [1]", "changes while the drive works"),
        ("STATUS", "mask = 0x0080, is = [0x0080]", "does not read so while it is running"),
        ("P036", "is = [5]", "is a guard as well: a setting tells no drive from another"),
        ("REFERENCE", "is = [5]", "can be written: a setting tells no drive from another"),
    ] {
        refused(&with(register, is), line, reason, "a register that holds the type of the drive");
    }
    let typed = |is: &str| {
        let register = "[register.TYPE]\nwhat = \"type\"\naddress = 300\naccess = \"read\"\nunit = \"code\"\nsource = \"manual\"\n\n[register.P036]";
        damaged(&with("TYPE", is), "[register.P036]", register)
    };
    refused(
        &typed("is = [0]"),
        line,
        "0 is what most registers of most drives read",
        "a register that holds the type",
    );
    assert_eq!(read(&typed("is = [0x0190]")).expect("it is right").level(), Level::Motion);
    // Whatever is not one number.
    held(&typed("is_not = [9]"), Level::Motion, line, "nothing tells this drive from theirs");
}

#[test]
fn a_state_that_needs_its_ladder_and_no_ladder() {
    let altivar = shipped("schneider/altivar");
    let (head, rest) = altivar.split_once("ladder = [\n").expect("it has one");
    let (_, tail) = rest.split_once("\n]\n").expect("it ends");
    let without = format!("{head}ladder = \"none\"\n{tail}");
    refused(&without, "ladder = \"none\"", "a state that nobody can leave", "a rung for each state");
    // 40h is seen, and no rung takes it.
    let rung = "    { bits = { register = \"ETA\", mask = 0x004F, value = 0x0040, source = \"invlib sketch\" }, do = \"write\", register = \"CMD\", word = 0x0006 },\n";
    let state = "{ state = \"disabled\", bits = { register = \"ETA\", mask = 0x004F, value = 0x0040";
    refused(
        &damaged(altivar, rung, ""),
        state,
        "a state that nobody can leave: no rung is for it",
        "do = \"write\"",
    );
}

/// From 31h the word that has led there leads no further.
#[test]
fn two_rungs_that_write_the_same_word() {
    let altivar = shipped("schneider/altivar");
    let rung = "value = 0x0031, source = \"invlib\" }, do = \"write\", register = \"CMD\", word = 0x0007 }";
    let again = rung.replace("0x0007", "0x0006");
    held(&damaged(altivar, rung, &again), Level::Motion, &again, "two rungs of its ladder write 0006h");
}

/// A quick stop is another stop, and the output of a drive in one is not gone.
#[test]
fn a_quick_stop_shows_no_stop_along_the_ramp() {
    let altivar = shipped("schneider/altivar");
    let ramp = altivar.lines().find(|line| line.starts_with("ramp = {")).expect("it has one");
    let (head, rest) = ramp.split_once("seen = [").expect("it is seen");
    let (_, tail) = rest.split_once(']').expect("it ends");
    let by = format!("{head}seen = [\"disabled\", \"ready\", \"quick_stop\"]{tail}");
    refused(
        &damaged(altivar, ramp, &by),
        &by,
        "stop.ramp is said to be done in a quick stop, which is another one and brakes on",
        "stop.fast alone",
    );
    // Where it belongs, as at the Altivar 312.
    read(include_str!("../../../tests/profiles/atv312.toml")).expect("its fast stop is a quick stop");
}

/// 2000h is where the manual has the command, beside 2001h (22C-UM001 p. E-2).
#[test]
fn an_address_in_hex_without_its_0x() {
    let text = damaged(POWERFLEX, "address = 8192", "address = 2000");
    held(&text, Level::Stop, "address = 2000", "2000h would stand beside them");
}

/// 0013h starts it with the bit of the stop (bit 0), where 0012h is meant (22C-UM001 p. E-2).
#[test]
fn a_start_that_holds_the_bit_of_the_stop() {
    let forward = POWERFLEX.lines().find(|line| line.starts_with("forward = {")).expect("it has one");
    let by = damaged(forward, "0x0012", "0x0013");
    refused(
        &damaged(POWERFLEX, forward, &by),
        &by,
        "start.forward writes 0013h, which holds the bit of stop.ramp (0001h)",
        "without the bit of the stop",
    );
    // What a start holds because the run command does: 7 below Fh (BBV51701 p. 11), both ways.
    read(include_str!("../../../tests/profiles/atv312.toml")).expect("its starts hold its stop");
}

#[test]
fn a_highest_setpoint_in_seconds() {
    const LIMITS: &str = "limits = { low = 0, high = 10000 }";
    let by = "limits = { low = 0, high = 10000, high_in = \"S2_7\" }";
    refused(
        &damaged(MMAX, LIMITS, by),
        by,
        "S2_7 counts in s, and the setpoint in %",
        "high_in = a register in %",
    );
    let by = "full_scale = \"S2_7\"";
    refused(&damaged(MMAX, "full_scale = \"owner\"", by), by, "S2_7 counts in s", "a register in Hz");
}

/// The frames would go to A411h. It may be so at a drive: a person's trial shows it.
#[test]
fn addresses_as_a_manual_prints_them_from_40001_under_another_numbering() {
    for numbering in ["wire", "from_one"] {
        let by = format!("numbering = \"{numbering}\"");
        let text = damaged(MMAX, "numbering = \"from_40001\"", &by);
        held(&text, Level::Stop, &by, "all its addresses are 40001 to 49999");
    }
}

#[test]
fn a_setpoint_of_next_to_nothing_and_a_count_of_a_hundred_hertz() {
    const LIMITS: &str = "limits = { low = 0, high = 10000 }";
    let by = "limits = { low = 0, high = 50 }";
    held(&damaged(MMAX, LIMITS, by), Level::Motion, by, "no higher than 0.50 %");
    let (head, tail) = MMAX.split_once("[register.FREQUENCY]").expect("it has one");
    let turned =
        format!("{head}[register.FREQUENCY]{}", tail.replacen("scale = [1, 100]", "scale = [100, 1]", 1));
    held(&turned, Level::Motion, "scale = [100, 1]", "one count of FREQUENCY would be 100.00 Hz");
}

#[test]
fn a_manual_without_its_title() {
    let source = MMAX.lines().find(|line| line.starts_with("manual = ")).expect("it has one");
    let by = "manual = { document = \"unknown\", edition = \"unknown\", page = \"unknown\", mark = \"P\" }";
    refused(&damaged(MMAX, source, by), by, "names no document or no page", "mark = \"M\"");
}

#[test]
fn a_trial_on_a_day_that_is_none_or_written_by_hand_without_what_was_tried() {
    let tried = |day: &str| {
        let table = format!(
            "tried = [{{ person = \"A. Fitter\", drive = \"1.5 kW\", firmware = \"5.1\", day = \"{day}\", seen = \"it stops\" }}]"
        );
        damaged(POWERFLEX, "tried = \"none\"", &table)
    };
    refused(&tried("27.11.2026"), "tried = [", "is no day on which it was tried", "\"2026-11-24\"");
    let profile = read(&tried("2026-11-27")).expect("it is right");
    let said = profile.gaps().iter().any(|gap| gap.what.contains("does not say what was tried"));
    assert!(profile.level() == Level::Stop && said, "{:#?}", profile.gaps());
}

/// A manual that prints 1 to 255 has addresses that no Modbus line has.
#[test]
fn an_address_beyond_247_is_told_where_it_stands_and_why() {
    let text = damaged(MMAX, "highest_address = 247", "highest_address = 255");
    refused(&text, "highest_address = 255", "248 to 255 are no addresses of Modbus", "highest_address = 247");
}

/// What the parser of TOML says of these helps nobody who does not know TOML.
#[test]
fn what_is_no_toml_is_told_in_the_words_of_whoever_wrote_it() {
    const FAULT: &str = "state = \"fault\", bits = { register = \"STATUS\", mask = 0x0008";
    let hex = FAULT.replace("0x0008", "0008h");
    refused(&damaged(MMAX, FAULT, &hex), &hex, "0008h is no number", "0x0008");
    let smart = "key = \u{201C}mmax\u{201D}";
    refused(&damaged(MMAX, "key = \"mmax\"", smart), smart, "these quotes are none", "straight quotes");
    let (head, tail) = MMAX.split_once("[register.CURRENT]").expect("it has one");
    let comma = format!("{head}[register.CURRENT]{}", tail.replacen("scale = [1, 100]", "scale = 0,1", 1));
    refused(&comma, "scale = 0,1", "0,1 is no number", "scale = [1, 10] for 0.1");
    let table =
        "[register.CURRENT]\nwhat = \"again\"\naddress = 42199\naccess = \"read\"\nsource = \"manual\"\n";
    let twice = MMAX.replace("[state]\n", &format!("{table}\n[state]\n"));
    let told = read(&twice).expect_err("it stands twice").to_string();
    let first = MMAX.lines().position(|line| line == "[register.CURRENT]").expect("it has one") + 1;
    assert!(told.contains(&format!("[register.CURRENT] stands twice, first in line {first}")), "{told}");
    for (name, plain) in [("P6.1", "P6_1"), ("Control place", "Control_place")] {
        let header = format!("[register.{name}]");
        let text = damaged(MMAX, "[register.P6_1]", &header);
        refused(&text, &header, "is no name of a register", &format!("[register.{plain}]"));
    }
}

#[test]
fn a_question_that_is_missing_above_the_first_table_is_asked_for_there() {
    refused(
        &damaged(MMAX, "setup = \"unknown\"\n", ""),
        "[sources]",
        "`setup` is left in silence",
        "above the first [table]: setup = ",
    );
    let told = read("key = \"x\"\n").expect_err("nothing is said").to_string();
    assert!(told.contains("drived profile new"), "{told}");
}

#[test]
fn a_fault_code_of_three_parts_and_a_full_scale_that_is_a_number_and_a_reset_that_ends_otherwise() {
    const CODE: &str = "[81, \"F81\", \"Communication Loss\", \"\"]";
    let three = "[81, \"F81\", \"Communication Loss\"]";
    refused(
        &damaged(POWERFLEX, CODE, three),
        three,
        "3 does not belong there",
        "\"what to do first, or nothing\"",
    );
    const CLEARED: &str = "words = [0x0004] }, { write = \"CONTROL\", words = [0x0010] }";
    let otherwise = CLEARED.replace("0x0010", "0x0000");
    refused(&damaged(MMAX, CLEARED, &otherwise), &otherwise, "it ends with 0000h", "0010h of stop.ramp");
}

/// The trip that stands behind three states was told three times.
#[test]
fn a_trip_that_stands_last_is_told_once_by_the_words_of_the_file() {
    let fault = "    { state = \"fault\", bits = { register = \"STATUS\", mask = 0x0008, value = 0x0008, source = \"manual\" } },\n";
    let last = "    { state = \"not_ready\", bits = { register = \"STATUS\", mask = 0x0001, value = 0x0000, source = \"manual\" } },\n";
    let text = damaged(&damaged(MMAX, fault, ""), last, &format!("{last}{fault}"));
    let all = read(&text).expect_err("it hides the trip").0;
    assert!(all.len() == 1 && all[0].reason.contains("may be told as \"running\""), "{all:#?}");
}
