//! The mistakes that were found in other projects' published tables and programs for drives, each given as a profile: refused, or held below
//! motion. Where each was read stands in its line.

use drive_profile::{Level, read, shipped};

/// What becomes of a mistake.
enum Ends {
    /// It is refused, for this reason.
    Refused(&'static str),
    /// Its drive is never started, and this is said.
    Below(&'static str),
}

use Ends::{Below, Refused};

/// Where it was read, the profile that has it, the places in which it has it, and what becomes of it.
type Mistake = (&'static str, &'static str, &'static [(&'static str, &'static str)], Ends);

const V20: &str = "siemens/v20";
const GOODRIVE: &str = "invt/goodrive";
const MS300: &str = "delta/ms300";
const FC51: &str = "danfoss/danfoss-fc51";
const VFS15: &str = "toshiba/vfs15";
const WJ200: &str = "hitachi/wj200";

const MISTAKES: &[Mistake] = &[
    (
        "FluidNC: an empty command for off passes, and a truncated frame is sent",
        V20,
        &[(
            "ramp = { steps = [{ write = \"STW\", words = [0x047E] }]",
            "ramp = { steps = [{ write = \"STW\", words = [] }]",
        )],
        Refused("writes what STW does not take"),
    ),
    (
        "FluidNC: a stop that failed is remembered as done",
        V20,
        &[(
            "words = [0x047E] }], seen = [\"ready\", \"disabled\", \"not_ready\", \"fault\"]",
            "words = [0x047E] }]",
        )],
        Refused("left in silence"),
    ),
    (
        "FluidNC: the V20 is driven with its direction by a bit whose sense is the machine's: 0C7Fh forward and stop at once",
        V20,
        &[(
            "ramp = { steps = [{ write = \"STW\", words = [0x047E] }]",
            "ramp = { steps = [{ write = \"STW\", words = [0x0C7F] }]",
        )],
        Refused("holds a run bit"),
    ),
    (
        "grblHAL: the run word is written before the speed",
        V20,
        &[(
            "{ write = \"STW\", words = [0x047F] }], source = \"wb\" }\nreverse",
            "{ write = \"STW\", words = [0x047F] }, { write = \"HSW\", words = [0x2000] }], source = \"wb\" }\nreverse",
        )],
        Refused("start.forward"),
    ),
    (
        "Buildbotics: an error replays rows that hold fault resets, and the run row behind them",
        GOODRIVE,
        &[(
            "reset = { steps = [{ write = \"CMD\", words = [7] }]",
            "reset = { steps = [{ write = \"CMD\", words = [7] }, { write = \"CMD\", words = [1] }]",
        )],
        Refused("holds a run bit"),
    ),
    (
        "Buildbotics: the tables of MX2, WJ200, Teco, EM60 and Fuling have no row that stops",
        WJ200,
        &[(
            "ramp = { steps = [{ write = \"RUN\", coils = [false] }], seen = [\"ready\", \"stopping\", \"disabled\", \"not_ready\", \"fault\"], source = \"manual linuxcnc\" }",
            "ramp = \"unknown\"",
        )],
        Refused("the reset is left standing"),
    ),
    (
        "Buildbotics: a highest frequency of 0, by which it divides",
        V20,
        &[("limits = { low = 0, high = 16384 }", "limits = { low = 0, high = 0 }")],
        Refused("without limits"),
    ),
    (
        "ESPHome: the last state is written again at boot",
        V20,
        &[("acts = \"level\"", "acts = \"level\"\nrestore_mode = \"RESTORE_DEFAULT_OFF\"")],
        Refused("`restore_mode` is no key"),
    ),
    (
        "ESPHome: code among the data",
        V20,
        &[("acts = \"level\"", "acts = \"level\"\nwrite_lambda = \"return x * 200;\"")],
        Refused("`write_lambda` is no key"),
    ),
    (
        "LinuxCNC mitsub_vfd: the computer link of letters, which is not Modbus",
        GOODRIVE,
        &[("protocol = \"modbus_rtu\"", "protocol = \"mitsubishi_computer_link\"")],
        Refused("a protocol of letters"),
    ),
    (
        "LinuxCNC vfs11_vfd: 0 for a stop, which gives run command and frequency away",
        VFS15,
        &[(
            "ramp = { steps = [{ write = \"FA00\", words = [0xC000] }]",
            "ramp = { steps = [{ write = \"FA00\", words = [0x0000] }]",
        )],
        Refused("the reset is left standing"),
    ),
    (
        "wb-mqtt-serial: the setup of the FC 51 writes 043Ch, and is written again on each reconnect",
        FC51,
        &[(
            "setup = \"none\"",
            "setup = { steps = [{ write = \"CTW\", words = [0x043C] }], source = \"guides\" }",
        )],
        Refused("setup writes CTW"),
    ),
    (
        "wb-mqtt-serial: switches write single bits of a command word that is written as a whole as well",
        V20,
        &[("address = 40100", "address = 40005")],
        Refused("which is never written"),
    ),
    (
        "wb-mqtt-serial: a switch that is turned off writes 0 to a register of command codes, which stops nothing",
        GOODRIVE,
        &[
            (
                "[sources]",
                "[sources]\ntemplate = { document = \"a template\", edition = \"none\", page = \"VF51\", mark = \"W\" }",
            ),
            (
                "ramp = { steps = [{ write = \"CMD\", words = [5] }], seen = [\"ready\", \"not_ready\", \"fault\"], source = \"manuals\"",
                "ramp = { steps = [{ write = \"CMD\", words = [0] }], seen = [\"ready\", \"not_ready\", \"fault\"], source = \"template\"",
            ),
        ],
        Below("stop.ramp rests on what is not sure"),
    ),
    (
        "ESPHome, Home Assistant, mb2hal: what was asked for is taken for what is, and no state is read",
        V20,
        &[(
            "    { state = \"running\", bits = { register = \"ZSW\", mask = 0x0004, value = 0x0004, source = \"oi2012 wb\" } },\n",
            "",
        )],
        Below("nothing shows that it runs"),
    ),
    (
        "FluidNC: a setpoint is cut to sixteen bits",
        V20,
        &[("limits = { low = 0, high = 16384 }", "limits = { low = 0, high = 70000 }")],
        Refused("HSW cannot hold 70000"),
    ),
    (
        "LinuxCNC wj200_vfd: an alarm is reset while the run command stands, and the motor starts by it",
        WJ200,
        &[(
            "reset = { steps = [{ write = \"RUN\", coils = [false] }, { write = \"RESET\", coils = [true] }, { pause_ms = 1500 }, { write = \"RESET\", coils = [false] }, { write = \"RUN\", coils = [false] }]",
            "reset = { steps = [{ write = \"RESET\", coils = [true] }, { write = \"RESET\", coils = [false] }]",
        )],
        Refused("the reset is left standing"),
    ),
    (
        "ESPHome: the setpoint is a number without limits",
        V20,
        &[("limits = { low = 0, high = 16384 }\n", "")],
        Refused("left in silence"),
    ),
    (
        "ESPHome: percent with what 100 % is baked into a factor",
        V20,
        &[("full_scale = \"REF_FREQ\"\n", "")],
        Refused("%"),
    ),
    (
        "LinuxCNC wj200_vfd: a status that cannot be read skips the stop",
        WJ200,
        &[(
            "ramp = { steps = [{ write = \"RUN\", coils = [false] }]",
            "ramp = { steps = [{ await = { register = \"STATE\", mask = 0xFFFF, value = 3, source = \"manual\" }, within_ms = 500 }, { write = \"RUN\", coils = [false] }]",
        )],
        Refused("reads or waits before it stops"),
    ),
    (
        "LinuxCNC vfdb_vfd: disable writes 0 to 2000h, which is no function there",
        MS300,
        &[
            ("mark = \"R\" }\n\n[who]", "mark = \"X\" }\n\n[who]"),
            (
                "reset = { steps = [{ write = \"CMD\", words = [0x0001] }, { write = \"CMD2\", words = [0x0002] }, { write = \"CMD2\", words = [0x0000] }, { write = \"CMD\", words = [0x0001] }], clears_itself = false, source = \"um drivers\" }",
                "reset = \"unknown\"",
            ),
            (
                "ramp = { steps = [{ write = \"CMD\", words = [0x0001] }]",
                "ramp = { steps = [{ write = \"CMD\", words = [0x0000] }]",
            ),
        ],
        Below("its sources contradict each other"),
    ),
    (
        "LinuxCNC vfs11_vfd: reset and emergency bits that are held restart the drive again and again",
        VFS15,
        &[("{ pause_ms = 2000 }, { write = \"FA00\", words = [0xC000] }]", "{ pause_ms = 2000 }]")],
        Refused("reset"),
    ),
    (
        "A fork of Klipper: speed at 2000h and control at 2001h, the map of a Delta turned round",
        MS300,
        &[
            ("address = 0x2000\n", "address = 0x2FFF\n"),
            ("address = 0x2001\n", "address = 0x2000\n"),
            ("address = 0x2FFF\n", "address = 0x2001\n"),
        ],
        Below("its command stands where other makers have other words"),
    ),
    (
        "A fork of Klipper: the old Huanyang is given as standard Modbus",
        GOODRIVE,
        &[("protocol = \"modbus_rtu\"", "protocol = \"huanyang\"")],
        Refused("is not Modbus RTU"),
    ),
    (
        "FluidNC: an H2A in its own mode, whose answer has a length of two bytes",
        GOODRIVE,
        &[("protocol = \"modbus_rtu\"", "protocol = \"modbus_rtu_h2a\"")],
        Refused("a length of two bytes"),
    ),
    (
        "A pool pump's table: functions C3h and D0h",
        GOODRIVE,
        &[("functions = [3, 6", "functions = [195, 6")],
        Refused("function 195 reads or writes no register"),
    ),
    (
        "A public project for the Delta EL: run 1, stop 5 and emergency stop 3, of which 1 is a stop and 3 jogs",
        MS300,
        &[(
            "ramp = { steps = [{ write = \"CMD\", words = [0x0001] }]",
            "ramp = { steps = [{ write = \"CMD\", words = [0x0003] }]",
        )],
        Refused("holds a run bit"),
    ),
    (
        "Web guides of the V20: command and setpoint at 40001 and 40002, ON in bits 8 to 14",
        V20,
        &[("mark = \"R\" }\nbits", "mark = \"W\" }\nbits"), ("address = 40100", "address = 40001")],
        Below("rests on what is not sure"),
    ),
    (
        "A web guide of Mitsubishi: 40009 as it is printed on the wire, with a base that nobody says",
        V20,
        &[("numbering = \"from_40001\"\n", "")],
        Refused("left in silence"),
    ),
    (
        "Mitsubishi 40009: a register that is the command when written and the status when read, read as the command in force",
        V20,
        &[("reads_back = \"unknown\"", "reads_back = { register = \"ZSW\", source = \"wb\" }")],
        Refused("reads_back"),
    ),
    (
        "Optidrive: the reset of one model is the second ramp of another, by the sources of both",
        FC51,
        &[("mark = \"D\" }", "mark = \"X\" }")],
        Below("its sources contradict each other"),
    ),
];

#[test]
fn each_mistake_of_a_published_table_is_refused_or_moves_nothing() {
    let mut wrong = Vec::new();
    for (what, name, places, ends) in MISTAKES {
        let (_, text) = shipped::TEXTS.iter().find(|(known, _)| known == name).expect("it is shipped");
        let mut text = (*text).to_owned();
        for (place, by) in *places {
            if !text.contains(place) {
                wrong.push(format!("{what}: {name} has not {place:?}"));
            }
            text = text.replacen(place, by, 1);
        }
        match (read(&text), ends) {
            (Err(refusals), Refused(reason)) if refusals.to_string().contains(reason) => {
                println!("refused: {what}: {}", refusals.0[0]);
            }
            (Ok(profile), Below(said)) if profile.level() < Level::Motion => {
                let gap =
                    profile.gaps().iter().find(|gap| gap.keeps_from.is_some() && gap.what.contains(said));
                match gap {
                    Some(gap) => println!("held at {}: {what}: {gap}", profile.level()),
                    None => wrong.push(format!("{what}: held by {:#?}", profile.gaps())),
                }
            }
            (Err(refusals), _) => wrong.push(format!("{what}: refused for another reason:\n{refusals}")),
            (Ok(profile), _) => wrong.push(format!("{what}: it reaches {}", profile.level())),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Bits of which two sources say different things, by model or by reading: nothing that is shipped rests on them.
const CONTRADICTED: &[(&str, &str, u16, &str)] = &[
    (
        "danfoss-fc",
        "STW",
        0xF000,
        "12 is brake fault in one guide and stopped by itself in another, 14 current or torque, 15 thermal or timer",
    ),
    ("danfoss-fc51", "STW", 0xF000, "the same"),
    ("v20", "ZSW", 0x0800, "11 is low at the current limit, or high while no torque limit is reached"),
    ("g120", "ZSW", 0x0800, "the same"),
    ("ms300", "STATE", 0x1000, "12 is running, standby included, of the GS4 alone"),
];

#[test]
fn nothing_that_is_shipped_rests_on_a_bit_of_which_sources_contradict_each_other() {
    for &(key, register, mask, why) in CONTRADICTED {
        let file = shipped::find(key).expect("it is shipped").file();
        assert!(file.register.contains_key(register), "{key}: {register}");
        let told = [&file.see.at_setpoint, &file.see.warning, &file.state.standstill];
        let owners = [&file.ownership.command, &file.ownership.reference];
        let all = (file.state.is.iter().map(|is| is.get_ref().bits.get_ref()))
            .chain(
                told.into_iter()
                    .filter_map(|answer| answer.given())
                    .map(drive_profile::format::Spanned::get_ref),
            )
            .chain(owners.into_iter().filter_map(|answer| answer.given()).map(|owner| &owner.get_ref().bits));
        for bits in all.filter(|bits| bits.register.get_ref() == register) {
            assert_eq!(bits.mask.get_ref() & mask, 0, "{key} {register}: {why}");
        }
    }
    // Printed 0028h is ZS, an output of 0 Hz: no shaft that stands. RUN is printed 0013h, and no trip.
    for key in ["wj200", "mx2"] {
        let file = shipped::find(key).expect("it is shipped").file();
        assert!(file.state.standstill.given().is_none(), "{key}");
        assert!(
            file.register.values().all(|register| *register.get_ref().address.get_ref() != 0x28),
            "{key}"
        );
        let rests =
            file.state.is.iter().any(|is| is.get_ref().bits.get_ref().register.get_ref() == "RUN_OUTPUT");
        assert!(!rests, "{key}");
    }
    // Without bit 10 a word is dropped by ABB DRV FULL.
    let abb = shipped::find("acs550").expect("it is shipped");
    for (name, requests) in abb.requests().into_iter().filter(|(name, _)| name.starts_with("stop.")) {
        for request in requests {
            let drive_core::tokio_modbus::Request::WriteSingleRegister(0, word) = request else {
                panic!("{name}: {request:?}")
            };
            assert_eq!(word & 0x0400, 0x0400, "{name}");
        }
    }
}
