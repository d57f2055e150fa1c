//! What is refused: good profiles, damaged in one place each. The refusal names the line, the reason and what to write.

use drive_profile::{LONGEST, Level, read, shipped};

/// A profile that is shipped, by its place.
fn good(name: &str) -> &'static str {
    shipped::TEXTS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).expect("it is shipped")
}

/// The profile with one place of it changed.
fn damaged(name: &str, place: &str, by: &str) -> String {
    let text = good(name);
    assert_eq!(text.matches(place).count(), 1, "{name}: {place}");
    text.replace(place, by)
}

/// That a damage is refused for this reason, in the line in which it stands or begins.
#[track_caller]
fn refused(name: &str, place: &str, by: &str, reason: &str) {
    let text = damaged(name, place, by);
    let refusals = read(&text).map(|profile| profile.level()).expect_err(reason).0;
    let found = refusals.iter().find(|refusal| refusal.reason.contains(reason));
    let found = found.unwrap_or_else(|| panic!("{reason:?} is not among {refusals:#?}"));
    assert!(!found.write.is_empty() && (1..=text.lines().count()).contains(&found.line), "{found}");
}

const V20: &str = "siemens/v20";
const GOODRIVE: &str = "invt/goodrive";
const ALTIVAR: &str = "schneider/altivar";
const RAMP: &str = "ramp = { steps = [{ write = \"STW\", words = [0x047E] }]";

#[test]
fn a_stop_that_reads_first() {
    let by = "ramp = { steps = [{ await = { register = \"ZSW\", mask = 1, value = 1, source = \"oi2012\" }, within_ms = 100 }, { write = \"STW\", words = [0x047E] }]";
    refused(V20, RAMP, by, "reads or waits before it stops");
}

#[test]
fn a_stop_that_unlocks_first() {
    let by = "ramp = { steps = [{ write = \"HSW\", words = [0] }, { write = \"STW\", words = [0x047E] }]";
    refused(V20, RAMP, by, "more than one write");
}

#[test]
fn a_stop_that_holds_a_run_bit() {
    refused(V20, RAMP, "ramp = { steps = [{ write = \"STW\", words = [0x047F] }]", "holds a run bit");
}

#[test]
fn a_stop_that_nothing_shows() {
    refused(
        V20,
        "words = [0x047E] }], seen = [\"ready\", \"disabled\", \"not_ready\", \"fault\"]",
        "words = [0x047E] }]",
        "left in silence",
    );
}

#[test]
fn a_stop_that_is_done_while_the_motor_runs() {
    let by = "words = [0x047E] }], seen = [\"ready\", \"running\", \"fault\"]";
    refused(
        V20,
        "words = [0x047E] }], seen = [\"ready\", \"disabled\", \"not_ready\", \"fault\"]",
        by,
        "while the motor runs",
    );
}

#[test]
fn a_stop_of_a_drive_that_was_not_read_and_that_is_none() {
    refused(V20, "unread = \"ramp\"", "unread = \"dc_injection\"", "none that is known");
}

/// Without their run bit in [command] too, by the words alone.
#[test]
fn run_words_that_are_equal_to_a_stop() {
    let text = good(GOODRIVE).replace(
        "forward = { steps = [{ write = \"CMD\", words = [1] }]",
        "forward = { steps = [{ write = \"CMD\", words = [5] }]",
    );
    let refusals = read(&text).expect_err("5 is a stop");
    assert!(refusals.to_string().contains("by which a start ends"), "{refusals}");
}

#[test]
fn a_start_that_runs_before_its_last_step() {
    refused(
        V20,
        "{ write = \"STW\", words = [0x0C7E] }, { await",
        "{ write = \"STW\", words = [0x0C7F] }, { await",
        "before its last step",
    );
}

#[test]
fn a_start_that_runs_nothing() {
    refused(
        GOODRIVE,
        "reverse = { steps = [{ write = \"CMD\", words = [2] }]",
        "reverse = { steps = [{ write = \"CMD\", words = [9] }]",
        "does not end with a word that runs",
    );
}

#[test]
fn a_reset_with_a_run_bit() {
    refused(V20, "words = [0x04FE]", "words = [0x04FF]", "reset writes 04FFh, which holds a run bit");
}

#[test]
fn a_reset_that_is_left_standing() {
    refused(
        V20,
        "{ write = \"STW\", words = [0x04FE] }, { write = \"STW\", words = [0x047E] }]",
        "{ write = \"STW\", words = [0x04FE] }]",
        "left standing",
    );
}

#[test]
fn a_setpoint_without_limits() {
    refused(V20, "limits = { low = 0, high = 16384 }\n", "", "`limits` is left in silence");
    refused(V20, "limits = { low = 0, high = 16384 }", "limits = { low = 0, high = 0 }", "without limits");
    refused(V20, "limits = { low = 0, high = 16384 }", "limits = { low = 0, high = 40000 }", "cannot hold");
}

#[test]
fn a_setpoint_of_which_nobody_says_what_is_all_of_it() {
    refused(V20, "full_scale = \"REF_FREQ\"\n", "", "of how much it counts percent");
}

#[test]
fn a_setpoint_in_the_eeprom() {
    let text =
        good(GOODRIVE).replace("storage = \"unknown\"\nunit = \"Hz\"", "storage = \"eeprom\"\nunit = \"Hz\"");
    assert!(read(&text).expect_err("it wears").to_string().contains("wears an EEPROM"));
}

#[test]
fn a_question_left_in_silence() {
    for question in [
        "setup = \"unknown\"\n",
        "standstill = \"unknown\"\n",
        "reads_back = \"unknown\"\n",
        "from_factory = \"unknown\"\n",
    ] {
        let name = question.split(' ').next().unwrap_or_default();
        refused(V20, question, "", &format!("`{name}` is left in silence"));
    }
}

#[test]
fn a_key_that_is_none() {
    refused(V20, "acts = \"level\"", "acts = \"level\"\nramps = 3", "`ramps` is no key");
}

#[test]
fn a_command_among_the_parameters() {
    refused(
        V20,
        "what = \"control word\"",
        "what = \"control word\"\nparameter = true",
        "which is a parameter",
    );
    refused(
        V20,
        "what = \"main setpoint\"",
        "what = \"main setpoint\"\nparameter = true",
        "among the parameters",
    );
}

#[test]
fn a_command_among_what_is_never_written() {
    refused(V20, "{ from = 40004, to = 40007", "{ from = 40004, to = 40107", "which is never written");
}

#[test]
fn states_that_overlap() {
    refused(
        V20,
        "state = \"running\", bits = { register = \"ZSW\", mask = 0x0004, value = 0x0004",
        "state = \"running\", bits = { register = \"ZSW\", mask = 0x000C, value = 0x000C",
        "is never seen",
    );
}

#[test]
fn a_trip_that_another_state_hides() {
    let running = "    { state = \"running\", bits = { register = \"ZSW\", mask = 0x0004, value = 0x0004, source = \"oi2012 wb\" } },\n";
    let fault = "    { state = \"fault\", bits = { register = \"ZSW\", mask = 0x0008, value = 0x0008, source = \"oi2012 wb\" } },\n";
    let text = good(V20).replace(&format!("{fault}{running}"), &format!("{running}{fault}"));
    assert!(read(&text).expect_err("it hides").to_string().contains("a trip may be told as \"running\""));
}

#[test]
fn a_state_that_nobody_can_leave() {
    refused(
        ALTIVAR,
        "do = \"write\", register = \"CMD\", word = 0x0006",
        "do = \"write\"",
        "nobody can leave",
    );
    let text = good(ALTIVAR).replace("do = \"run\"", "do = \"wait\"");
    assert!(
        read(&text).expect_err("it waits for ever").to_string().contains("no rung leads to the run command")
    );
}

#[test]
fn a_ladder_that_runs_the_motor() {
    refused(
        ALTIVAR,
        "register = \"CMD\", word = 0x0007",
        "register = \"CMD\", word = 0x000F",
        "runs the motor before it is asked to",
    );
}

/// What a rung writes is a command like the steps of an action: here into another register than the command word.
#[test]
fn a_ladder_that_writes_what_no_command_may_write() {
    const RUNG: &str = "register = \"CMD\", word = 0x0006";
    refused(ALTIVAR, RUNG, "register = \"ETA\", word = 0x0006", "no word that can be written");
    let register = |more: &str| {
        let text = damaged(ALTIVAR, RUNG, "register = \"RUNG\", word = 0x0006");
        text.replace("[register.CMD]\n", &format!("[register.RUNG]\nwhat = \"made\"\naddress = 12000\n{more}source = \"rule\"\n\n[register.CMD]\n"))
    };
    let never = "never_written = [{ from = 11999, to = 12001, why = \"it saves\", source = \"rule\" }]\n";
    for (more, reason) in [
        ("access = \"read_write\"\nstorage = \"eeprom\"\n", "wears an EEPROM"),
        ("access = \"read_write\"\nstorage = \"ram\"\nparameter = true\n", "which is a parameter"),
        ("access = \"read_write\"\nstorage = \"ram\"\nspace = \"coil\"\n", "no word that can be written"),
        ("access = \"read_write\"\nstorage = \"ram\"\nbyte = \"low\"\n", "a part of what is written"),
    ] {
        let told = read(&register(more)).expect_err(reason).to_string();
        assert!(told.contains("the ladder writes") || told.contains("the ladder has"), "{told}");
        assert!(told.contains(reason), "{told}");
    }
    let text = register("access = \"read_write\"\nstorage = \"ram\"\n");
    read(&text).expect("any other register is right");
    let (head, tail) = text.split_once("never_written = ").expect("it says so");
    let (_, tail) = tail.split_once('\n').expect("it is one line");
    let told = read(&format!("{head}{never}{tail}")).expect_err("it saves").to_string();
    assert!(told.contains("the ladder writes RUNG, which is never written"), "{told}");
}

/// A byte of the command word is the whole word when it is written.
#[test]
fn a_command_in_a_byte_of_a_word() {
    let byte = "what = \"control word\"\nbyte = \"high\"";
    refused(V20, "what = \"control word\"", byte, "stop.ramp has STW, which is a part of what is written");
    refused(V20, "what = \"control word\"", byte, "[command] has STW, which is a part of what is written");
    // By another name, while [command] has the whole word.
    let text = damaged(V20, RAMP, "ramp = { steps = [{ write = \"LOW\", words = [0x047E] }]").replace(
        "[register.HSW]\n",
        "[register.LOW]\nwhat = \"made\"\naddress = 40100\nbyte = \"low\"\naccess = \"read_write\"\nstorage = \"ram\"\nsource = \"wb\"\n\n[register.HSW]\n",
    );
    assert!(read(&text).expect_err("a byte").to_string().contains("stop.ramp has LOW, which is a part"));
}

/// A block writes whatever lies in it.
#[test]
fn a_block_that_passes_over_what_is_never_written_or_only_read() {
    let ramp = "ramp = { steps = [{ write = \"STW\", words = [0x047E, 0] }]";
    let text = damaged(V20, RAMP, ramp).replace("write_words = 1\n", "write_words = 4\n");
    let never = text.replace("{ from = 40004, to = 40007", "{ from = 40101, to = 40107");
    let told = read(&never).expect_err("it is never written").to_string();
    assert!(told.contains("stop.ramp writes STW, or beyond it, which is never written"), "{told}");
    let (head, tail) = text.split_once("address = 40101\naccess = \"read_write\"\n").expect("HSW");
    let told = read(&format!("{head}address = 40101\naccess = \"read\"\n{tail}"))
        .expect_err("it is read")
        .to_string();
    assert!(told.contains("stop.ramp writes 0064h, which can only be read"), "{told}");
    let worn = format!(
        "{head}address = 40101\naccess = \"read_write\"\n{}",
        tail.replacen("storage = \"ram\"", "storage = \"eeprom\"", 1)
    );
    let told = read(&worn).expect_err("it wears").to_string();
    assert!(told.contains("stop.ramp writes 0064h, which wears an EEPROM"), "{told}");
}

#[test]
fn a_scale_that_cannot_be_turned_round() {
    for scale in ["[0, 10]", "[1, 0]", "[-1, 10]"] {
        let text = good(ALTIVAR).replace(
            "scale = [1, 10]\nsource = \"invlib\"\n\n[register.HSP]",
            &format!("scale = {scale}\nsource = \"invlib\"\n\n[register.HSP]"),
        );
        assert!(read(&text).expect_err(scale).to_string().contains("cannot be turned round"), "{scale}");
    }
}

#[test]
fn a_mask_without_a_value_and_a_value_that_never_fits() {
    refused(
        V20,
        "warning = { register = \"ZSW\", mask = 0x0080, value = 0x0080",
        "warning = { register = \"ZSW\", mask = 0x0080",
        "`value` is left in silence",
    );
    refused(
        V20,
        "warning = { register = \"ZSW\", mask = 0x0080, value = 0x0080",
        "warning = { register = \"ZSW\", mask = 0x0080, value = 0x0180",
        "never fit",
    );
}

#[test]
fn a_framing_that_is_not_modbus_by_its_name() {
    for (protocol, told) in [
        ("huanyang", "functions of its own"),
        ("isaver", "C3h"),
        ("h2a non-standard", "two bytes"),
        ("ascii", "no framing"),
    ] {
        refused(V20, "protocol = \"modbus_rtu\"", &format!("protocol = \"{protocol}\""), told);
    }
}

#[test]
fn a_function_that_is_no_access_to_a_register() {
    refused(V20, "functions = [3, 6, 16]", "functions = [3, 6, 8]", "function 8 reads or writes no register");
    refused(V20, "functions = [3, 6, 16]", "functions = [3]", "no function of the drive writes STW");
}

#[test]
fn names_that_nothing_has() {
    refused(V20, "output = \"FREQ_OUTPUT\"", "output = \"FREQUENCY\"", "there is no register \"FREQUENCY\"");
    refused(
        V20,
        "fed_by = \"command_write\"\nsource = \"oi2012\"",
        "fed_by = \"command_write\"\nsource = \"oi2013\"",
        "\"oi2013\" is no source",
    );
    refused(
        V20,
        "fed_by = \"command_write\"\nsource = \"oi2012\"",
        "fed_by = \"command_write\"\nsource = \"\"",
        "without a source",
    );
}

#[test]
fn two_registers_of_one_address_and_addresses_that_are_none() {
    refused(V20, "address = 40111", "address = 40110", "have one address");
    refused(V20, "address = 40111", "address = 111", "no address as this file counts them");
}

#[test]
fn a_register_of_two_words_whose_second_is_another() {
    let text = include_str!("data/signed.toml").replace("address = 0x0100", "address = 0x0111");
    let refusals = read(&text).expect_err("STATUS stands in OUTPUT").0;
    assert!(
        refusals.iter().any(|of| of.reason == "OUTPUT has two words, and STATUS is one of them"),
        "{refusals:#?}"
    );
    let both = text.replacen("words = 2\norder = \"high_first\"\naccess", "access", 1);
    read(&both).expect("one word each");
}

#[test]
fn what_is_seen_in_another_quantitys_unit() {
    let signed = include_str!("data/signed.toml");
    for (seen, of) in
        [("output", "OUTPUT"), ("current", "SPEED"), ("speed", "STATUS"), ("dc_bus_voltage", "OUTPUT")]
    {
        let text = match seen {
            "output" => signed.replace("unit = \"Hz\"\nscale = [1, 100]", "unit = \"A\"\nscale = [1, 100]"),
            _ => signed.replace(&format!("{seen} = \"none\""), &format!("{seen} = \"{of}\"")),
        };
        let refusals = read(&text).expect_err(seen).0;
        let reason = format!("{of} does not tell the {} that is seen in it", seen.replace('_', " "));
        assert!(refusals.iter().any(|refusal| refusal.reason.starts_with(&reason)), "{refusals:#?}");
    }
}

#[test]
fn a_register_of_which_nobody_says_where_it_is_kept() {
    let text = good(V20).replace(
        "address = 40100\naccess = \"read_write\"\nstorage = \"ram\"\n",
        "address = 40100\naccess = \"read_write\"\n",
    );
    assert!(read(&text).expect_err("it is silent").to_string().contains("where a value lives"));
}

#[test]
fn another_version_and_a_file_that_is_too_long_or_too_deep() {
    refused(V20, "format = 1\n", "format = 2\n", "format 2 is not read here");
    let long = format!("{}\n# {}", good(V20), "x".repeat(LONGEST));
    assert!(read(&long).expect_err("it is long").to_string().contains("longer than"));
    let deep = format!("texts = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(read(&deep).expect_err("it is deep").to_string().contains("too deep"));
}

/// A profile with the protocol of a trial on a drive, to the end.
fn tried(text: &str) -> String {
    let substance = read(text).expect("it is right").substance().to_owned();
    let by = format!(
        "tried = [{{ person = \"A. Fitter\", drive = \"1.5 kW\", firmware = \"1.10\", day = \"2026-11-24\", seen = \"it turns\", \
         reached = \"started\", on = \"drive\", of = \"{substance}\" }}]"
    );
    assert_eq!(text.matches("tried = \"none\"").count(), 1);
    text.replace("tried = \"none\"", &by)
}

/// A fact that is not sure is no refusal: it holds the drive below.
#[test]
fn what_is_from_memory_or_contradicted_holds_below_motion_and_a_trial_settles_a_contradiction() {
    let marked = |mark| {
        good(V20).replace(
            "page = \"templates; VFD\", mark = \"R\"",
            &format!("page = \"templates; VFD\", mark = \"{mark}\""),
        )
    };
    for mark in ["M", "W", "X"] {
        let profile = read(&marked(mark)).expect("it is right");
        assert!(profile.level() < Level::Motion, "{mark}");
        assert!(profile.gaps()[0].to_string().contains("below"), "{}", profile.gaps()[0]);
    }
    let tried = tried(&marked("X"));
    assert_eq!(read(&tried).expect("it is right").level(), Level::Motion);
}

#[test]
fn an_address_that_other_makers_use_otherwise_wants_a_fingerprint_or_a_trial() {
    let profile = shipped::find("ms300").expect("it is shipped");
    assert_eq!(profile.level(), Level::Stop);
    let tried = tried(good("delta/ms300"));
    assert_eq!(read(&tried).expect("it is right").level(), Level::Motion);
    let text = good(GOODRIVE);
    let (head, rest) = text.split_once("fingerprints = [").expect("it has some");
    let (_, tail) = rest.split_once("\n]\n").expect("they end");
    let bare = format!("{head}fingerprints = \"none\"\n{tail}");
    assert_eq!(read(&bare).expect("it is right").level(), Level::Stop);
}

/// The mistakes of others' published tables, as profiles.
mod others {
    use super::*;

    /// A public project has 1 as run, 5 as stop and 3 as emergency stop of a VFD-EL, where 1 is the stop.
    #[test]
    fn the_words_of_one_maker_in_the_command_register_of_another() {
        let text = good("delta/ms300").replace(
            "forward = { steps = [{ write = \"CMD\", words = [0x0012] }]",
            "forward = { steps = [{ write = \"CMD\", words = [0x0001] }]",
        );
        assert!(read(&text).is_err());
        let fast =
            "fast = { steps = [{ write = \"CMD\", words = [0x0003] }], seen = [\"ready\"], source = \"um\" }";
        refused("delta/ms300", "fast = \"none\"", fast, "holds a run bit");
    }

    /// 0 as the stop of a Delta is "nothing": the words of [command] do not hold it, and the table is only as sure as its source.
    #[test]
    fn a_zero_for_a_stop_from_a_weak_table_stops_nothing() {
        let weak = damaged("delta/ms300", "ramp = { steps = [{ write = \"CMD\", words = [0x0001] }], seen = [\"ready\", \"stopping\", \"fault\"], source = \"um drivers\" }", "ramp = { steps = [{ write = \"CMD\", words = [0x0000] }], seen = [\"ready\", \"stopping\", \"fault\"], source = \"table\" }")
            .replace("[sources]\n", "[sources]\ntable = { document = \"a forum\", edition = \"unknown\", page = \"a post\", mark = \"W\" }\n")
            .replace("{ write = \"CMD2\", words = [0x0000] }, { write = \"CMD\", words = [0x0001] }]", "{ write = \"CMD2\", words = [0x0000] }, { write = \"CMD\", words = [0x0000] }]");
        assert_eq!(read(&weak).expect("it is right").level(), Level::Watch);
    }

    /// AC Tech wants its password before each command.
    #[test]
    fn an_unlock_before_each_command() {
        refused(
            GOODRIVE,
            "ramp = { steps = [{ write = \"CMD\", words = [5] }]",
            "ramp = { steps = [{ write = \"FREQ\", words = [0] }, { write = \"CMD\", words = [5] }]",
            "unlocks first",
        );
    }

    /// LinuxCNC's enable that resets and runs in one word.
    #[test]
    fn a_reset_that_restarts() {
        refused("danfoss/danfoss-fc", "words = [0x04BC]", "words = [0x04FC]", "holds a run bit");
    }

    /// A generated table of an Altivar starts it by writing its register 40001: no document has it.
    #[test]
    fn a_run_word_without_a_document() {
        refused(
            V20,
            "forward = { steps = [{ write = \"STW\", words = [0x047E] }, { await = { register = \"ZSW\", mask = 0x0041, value = 0x0001, source = \"oi2012 wb\" }, within_ms = 1000 }, { write = \"STW\", words = [0x047F] }], source = \"wb\" }",
            "forward = { steps = [{ write = \"STW\", words = [0x047F] }], source = \"\" }",
            "without a source",
        );
    }

    /// Buildbotics divides by a highest frequency of 0; FluidNC by a scale that may be unread.
    #[test]
    fn a_highest_of_zero() {
        refused(
            GOODRIVE,
            "limits = { low = 0, high = 65535",
            "limits = { low = 0, high = 0",
            "without limits",
        );
    }

    /// The W guides of the V20 put ON into another bit.
    #[test]
    fn a_run_bit_in_another_place_contradicts_the_command() {
        refused(
            V20,
            "mask = 0x0001, value = 0x0001, source = \"g120c wb\"",
            "mask = 0x0800, value = 0x0800, source = \"g120c wb\"",
            "does not end with a word that runs",
        );
    }
}

const SIGNED: &str = include_str!("data/signed.toml");

#[track_caller]
fn refused_of_signed(place: &str, by: &str, reason: &str) {
    assert_eq!(SIGNED.matches(place).count(), 1, "{place}");
    let refusals = read(&SIGNED.replace(place, by)).map(|profile| profile.level()).expect_err(reason);
    assert!(refusals.to_string().contains(reason), "{refusals}");
}

/// Whoever gives a setpoint to it starts it: LinuxCNC and FluidNC write a speed before they write a run command.
#[test]
fn a_setpoint_that_runs_the_motor_by_itself() {
    let text = damaged(
        GOODRIVE,
        "runs = [",
        "runs = [{ register = \"FREQ\", mask = 0xFFFF, value = 0, differs = true, source = \"manuals\" }, ",
    );
    let told = read(&text).expect_err("a setpoint starts it").to_string();
    assert!(told.contains("runs the motor by itself"), "{told}");
}

#[test]
fn a_setpoint_that_is_the_command_and_may_be_0_or_has_no_sign_or_is_written_elsewhere() {
    refused_of_signed("limits = { low = 1,", "limits = { low = 0,", "0 is the stop");
    refused_of_signed("sign_is_direction = true", "sign_is_direction = false", "whose sign is no direction");
    refused_of_signed(
        "words = [0] }], seen",
        "setpoint = \"positive\" }], seen",
        "writes a setpoint where none belongs",
    );
    refused_of_signed(
        "{ write = \"SPEED\", setpoint = \"negative\" }",
        "{ write = \"SPEED\", words = [1] }",
        "the other start does",
    );
    refused_of_signed(
        "{ write = \"SPEED\", setpoint = \"negative\" }",
        "{ write = \"RESET\", setpoint = \"negative\" }",
        "where none belongs",
    );
    refused_of_signed("value = 0, differs = true", "value = 1, differs = false", "that it runs nothing");
}

/// Function 23 reads a holding register along: of a drive whose state stands in none it is not known which.
#[test]
fn a_write_by_function_23_of_a_drive_that_has_nothing_to_read_along() {
    let split =
        include_str!("data/split.toml").replace("functions = [3, 4, 6, 16]", "functions = [3, 4, 6, 16, 23]");
    let text = split.replace(
        "ramp = { steps = [{ write = \"RUN\", words = [0] }]",
        "ramp = { steps = [{ write = \"RUN\", words = [0], function = 23 }]",
    );
    assert!(
        read(&split).is_ok()
            && read(&text).expect_err("nothing to read").to_string().contains("by a function")
    );
}

/// Whoever starts it in reverse would turn it forward.
#[test]
fn starts_of_both_directions_with_the_same_words() {
    let forward = "reverse = { steps = [{ write = \"CMD\", words = [2] }]";
    refused(GOODRIVE, forward, "reverse = { steps = [{ write = \"CMD\", words = [1] }]", "turn the same way");
    let split = include_str!("data/split.toml");
    let turned = split.replace(
        "{ write = \"DIRECTION\", words = [1] }, { write = \"RUN\", words = [1] }",
        "{ write = \"DIRECTION\", words = [0] }, { write = \"RUN\", words = [1] }",
    );
    assert!(read(split).is_ok() && turned != split);
    assert!(read(&turned).expect_err("it turns the same way").to_string().contains("turn the same way"));
}

/// Simphoenix E500: 3 stops it, 20h resets a fault and stops nothing.
#[test]
fn a_stop_that_is_the_reset() {
    let text = good(GOODRIVE);
    let reset = text.lines().find(|line| line.starts_with("reset = ")).expect("it has one");
    let stop = "ramp = { steps = [{ write = \"CMD\", words = [5] }]";
    let both = text
        .replace(reset, "reset = { steps = [{ write = \"CMD\", words = [7] }], clears_itself = true, source = \"manuals\" }")
        .replace(stop, "ramp = { steps = [{ write = \"CMD\", words = [7] }]");
    let told = read(&both).expect_err("it stops nothing").to_string();
    assert!(told.contains("nothing but what a stop writes"), "{told}");
}

#[test]
fn a_stop_that_only_a_trip_shows() {
    refused(
        GOODRIVE,
        "words = [5] }], seen = [\"ready\", \"not_ready\", \"fault\"]",
        "words = [5] }], seen = [\"fault\"]",
        "only once the drive has tripped",
    );
}

/// Vacon 20: bit 7 of 2102 says that the fieldbus commands. Once the panel does, a stop would be withheld.
#[test]
fn a_guard_on_bits_that_tell_who_commands_just_now() {
    let guard = |mask: &str| {
        format!(
            "guards = [{{ what = \"the bus commands\", register = \"STATE2\", mask = {mask}, is = [0], source = \"manuals\" }}]"
        )
    };
    refused(GOODRIVE, "guards = \"none\"", &guard("0x0020"), "tells who commands just now");
    assert!(read(&damaged(GOODRIVE, "guards = \"none\"", &guard("0x0001"))).is_ok(), "another bit of it");
}

#[test]
fn a_guard_that_never_reads_so() {
    refused(
        ALTIVAR,
        "register = \"CHCF\", is_not = [3]",
        "register = \"CHCF\", mask = 0x0001, is_not = [3]",
        "0003h has bits that its mask 0001h has not",
    );
}

/// Held below motion, and by what.
#[track_caller]
fn held(text: &str, because: &str) {
    let profile = read(text).unwrap_or_else(|refusals| panic!("{refusals}"));
    assert!(profile.level() < Level::Motion, "{because}");
    let gap = profile.gaps().iter().find(|gap| gap.what.contains(because));
    let gap = gap.unwrap_or_else(|| panic!("{because:?} is not among {:#?}", profile.gaps()));
    assert!(gap.keeps_from == Some(Level::Motion) && gap.line > 1, "{gap}");
}

#[test]
fn what_scales_or_limits_a_setpoint_counts_with_its_source() {
    let register = "\n[register.TOP]\nwhat = \"maximum\"\naddress = 40300\naccess = \"read\"\nunit = \"Hz\"\nscale = [1, 100]\nsource = \"memory\"\n\n[state]\n";
    let memory = "[sources]\nmemory = { document = \"as remembered\", edition = \"unknown\", page = \"none\", mark = \"M\" }\n";
    let base = good(V20).replace("\n[state]\n", register).replace("[sources]\n", memory);
    assert_eq!(read(&base).expect("nothing rests on it").level(), Level::Motion);
    held(&base.replace("full_scale = \"REF_FREQ\"", "full_scale = \"TOP\""), "register TOP");
    let base = base.replace(
        "unit = \"Hz\"\nscale = [1, 100]\nsource = \"memory\"",
        "unit = \"%\"\nscale = [1, 100]\nsource = \"memory\"",
    );
    held(&base.replace("high = 16384 }", "high = 16384, high_in = \"TOP\" }"), "register TOP");
}

/// Of a Simphoenix E500 0.1 Hz are one count, and 65535 of them 6553.5 Hz.
#[test]
fn a_setpoint_beyond_any_speed() {
    let hertz = good(GOODRIVE);
    assert_eq!(read(hertz).expect("it is right").level(), Level::Motion);
    let (head, tail) = hertz.split_once("[register.FREQ]").expect("it has one");
    let coarse = format!("{head}[register.FREQ]{}", tail.replacen("scale = [1, 100]", "scale = [1, 10]", 1));
    held(&coarse, "up to 6553.50 Hz");
    held(
        &damaged(V20, "limits = { low = 0, high = 16384 }", "limits = { low = 0, high = 32767 }")
            .replace("scale = [100, 16384]", "scale = [1000, 16384]"),
        "up to 1999.94 %",
    );
}

#[test]
fn states_from_which_no_start_acts_and_words_that_fit_none() {
    let ready = "    { state = \"ready\", bits = { register = \"STATE\", mask = 0xFFFF, value = 3, source = \"manuals\" } },\n";
    held(&damaged(GOODRIVE, ready, ""), "every start would be refused");
    let (alive, any) = ("mask = 0xA030, value = 0x0000, differs = true", "mask = 0x0001, value = 0x0000");
    let told = |text: &str| {
        let profile = read(text).unwrap_or_else(|refusals| panic!("{refusals}"));
        profile.gaps().iter().any(|gap| gap.what.starts_with("a status of 0000h fits no state"))
    };
    assert!(told(good(V20)) && !told(&damaged(V20, alive, any)), "0 is no word of a drive that is alive");
}

/// What is wrong first, and not what follows from it.
#[test]
fn the_first_message_is_the_cause() {
    let first = |text: &str| read(text).expect_err("it is wrong").0.remove(0);
    let text = good(V20).replace("numbering = \"from_40001\"", "numbering = \"from_one\"");
    let line = |text: &str, place: &str| {
        text.lines().position(|line| line.contains(place)).expect("it is there") + 1
    };
    let at = text.replace("address = 40110", "address = 0");
    assert_eq!(first(&at).line, line(&at, "address = 0"), "{}", first(&at));
    let runs = damaged(
        V20,
        "ramp = { steps = [{ write = \"STW\", words = [0x047E] }]",
        "ramp = { steps = [{ write = \"STW\", words = [0x047F] }]",
    );
    let told = first(&runs);
    assert!(told.line == line(&runs, "ramp = {") && told.reason.contains("run bit"), "{told}");
    let turned =
        [(1, 5), (2, 6), (3, 5), (4, 6)].iter().fold(good(GOODRIVE).to_owned(), |text, (run, stop)| {
            let form = |value: i32| format!("register = \"CMD\", mask = 0xFFFF, value = {value},");
            text.replace(&form(*run), &form(*stop))
        });
    let all = read(&turned).expect_err("it is turned round").0;
    assert!(all.len() == 1 && all[0].reason.contains("by [command] the words of the stops"), "{all:#?}");
}

/// The parser's own words for kinds of values are none of a controls engineer's.
#[test]
fn what_is_no_value_is_told_in_the_words_of_a_file() {
    for (place, by, wanted) in [
        ("mask = 0x0008, value", "mask = \"eight\", value", "one number of 0 to 65535"),
        ("mask = 0x0008, value", "mask = 70000, value", "one number of 0 to 65535"),
        (
            "scale = [1, 1]\nsigned = true\nsource = \"oi2012\"\n\n[register.CURRENT]",
            "scale = 1\nsource = \"oi2012\"\n\n[register.CURRENT]",
            "a list",
        ),
        ("sign_is_direction = false", "sign_is_direction = \"no\"", "true or false"),
        ("format = 1", "format 1", "key = value"),
    ] {
        let told = read(&damaged(V20, place, by)).expect_err(by).0.remove(0);
        let all = told.to_string();
        assert!(
            told.write.contains(wanted) && !all.contains("u16") && !all.contains("sequence"),
            "{by}: {told}"
        );
    }
}

/// A register for each direction, as coils are elsewhere. By a byte of each a run command is told from another, and no more stands in a word.
#[test]
fn a_command_in_two_registers_that_hold_more_than_a_word_can_tell() {
    let coils = include_str!("data/directions.toml");
    let registers = |run: &str| {
        let mut text = coils.replace("space = \"coil\"\n", "");
        for (coils, words) in [
            ("coils = [true, false]", format!("words = [{run}, 0]")),
            ("coils = [false, true]", format!("words = [0, {run}]")),
            ("coils = [false, false]", "words = [0, 0]".to_owned()),
            ("coils = [true]", "words = [1]".to_owned()),
            ("coils = [false]", "words = [0]".to_owned()),
            ("mask = 1, value = 1,", format!("mask = 0xFFFF, value = {run},")),
        ] {
            text = text.replace(coils, &words);
        }
        text
    };
    assert_eq!(read(&registers("2")).map(|profile| profile.level()), Ok(Level::Motion));
    let refusals = read(&registers("300")).expect_err("it does not stand in a byte");
    assert!(refusals.to_string().contains("no run command is told from another"), "{refusals}");
}
