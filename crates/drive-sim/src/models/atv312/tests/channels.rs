//! Who commands, and whose reference counts.

use drive_core::Frequency;

use super::*;

/// LRS3 bits 0 and 1: reference and command by the second channel.
const BY_SECOND: u16 = 0x0003;

/// At L3, with these settings and the inputs free for functions of their own.
fn level_3(settings: &[(u16, u16)]) -> Atv312 {
    let mut drive = Atv312::under_bus_control();
    for &(address, value) in [(ADC, 0), (SA2, 0), (PS4, 0), (PS2, 0)].iter().chain(settings) {
        write(&mut drive, address, value).unwrap();
    }
    drive
}

fn at(drive: &mut Atv312, seconds: u32) -> i32 {
    drive.advance(seconds * SECOND);
    drive.observe().output_frequency
}

fn commander(drive: &Atv312) -> u16 {
    drive.peek(ETI).unwrap() & 0x6000
}

// p. 15, 33: LI1 forward, LI2 reverse, AI1 the reference; tCt = trn wants an edge.
#[test]
fn from_the_factory_an_edge_of_li1_or_li2_runs_at_the_reference_of_ai1() {
    let mut drive = Atv312::new();
    analog(&mut drive, "AI1", 40);
    terminal(&mut drive, "LI1", true);
    assert_eq!((at(&mut drive, 4), commander(&drive)), (2_000, 0x0000));
    terminal(&mut drive, "LI1", false);
    assert_eq!(at(&mut drive, 4), 0);
    terminal(&mut drive, "LI2", true);
    assert_eq!(at(&mut drive, 4), -2_000);
    assert_eq!(drive.read(IOLR).unwrap() & 0x3F, 0x02);
}

// p. 33: "in order to help prevent accidental restarts after a break in the power supply".
#[test]
fn an_input_that_is_on_at_power_up_runs_by_level_and_not_by_transition() {
    for (tct, runs) in [(0, true), (1, false), (2, true)] {
        let mut drive = Atv312::new();
        write(&mut drive, TCT, tct).unwrap();
        drive.bank.save();
        analog(&mut drive, "AI1", 40);
        terminal(&mut drive, "LI1", true);
        drive.power_cycle();
        assert_eq!(at(&mut drive, 4) > 0, runs, "tCt = {tct}");
    }
}

// p. 33: PFO.
#[test]
fn with_forward_priority_forward_wins_over_a_reverse_that_runs() {
    for (tct, ends_at) in [(2, 2_000), (0, -2_000)] {
        let mut drive = Atv312::new();
        write(&mut drive, TCT, tct).unwrap();
        analog(&mut drive, "AI1", 40);
        terminal(&mut drive, "LI2", true);
        at(&mut drive, 4);
        terminal(&mut drive, "LI1", true);
        assert_eq!(at(&mut drive, 6), ends_at, "tCt = {tct}");
    }
}

// p. 33: "a forward or reverse pulse is sufficient to control starting, a stop pulse to control stopping".
#[test]
fn with_three_wires_pulses_start_and_stop() {
    let mut drive = Atv312::new();
    write(&mut drive, TCC, 1).unwrap();
    analog(&mut drive, "AI1", 40);
    let pulse = |drive: &mut Atv312, name| {
        terminal(drive, name, true);
        terminal(drive, name, false);
    };
    pulse(&mut drive, "LI2");
    assert_eq!(at(&mut drive, 4), 0, "the stop input is open");
    terminal(&mut drive, "LI1", true);
    pulse(&mut drive, "LI2");
    assert_eq!(at(&mut drive, 4), 2_000);
    pulse(&mut drive, "LI3");
    assert_eq!(at(&mut drive, 6), -2_000);
    terminal(&mut drive, "LI1", false);
    terminal(&mut drive, "LI1", true);
    assert_eq!(at(&mut drive, 6), 0);
}

// p. 11: "priorities between channels are managed by the drive".
#[test]
fn at_level_1_the_bus_keeps_command_or_the_newest_command_has_it() {
    for (reading, ends_at) in [("bus", 1_000), ("newest", 2_000)] {
        let mut drive = Atv312::new();
        read_as(&mut drive, "priority", reading);
        analog(&mut drive, "AI1", 40);
        write(&mut drive, LFR, 100).unwrap();
        write(&mut drive, CMD, 0x000F).unwrap();
        assert_eq!((at(&mut drive, 4), commander(&drive)), (1_000, 0x4000));
        terminal(&mut drive, "LI1", true);
        assert_eq!(at(&mut drive, 4), ends_at, "{reading}");
        write(&mut drive, CMD, 0x000F).unwrap();
        assert_eq!((at(&mut drive, 4), commander(&drive)), (1_000, 0x4000));
    }
}

// p. 36, 37: with CHCF = SIM the command comes from where the reference comes from; LRS3 says which (p. 23).
#[test]
fn combined_channels_follow_the_input_of_rfc() {
    let mut drive = level_3(&[(CHCF, 1), (FR2, 1), (RFC, 133), (TCT, 0)]);
    analog(&mut drive, "AI1", 40);
    start(&mut drive, 300);
    assert_eq!(
        (at(&mut drive, 4), commander(&drive), drive.read(LRS3).unwrap() & BY_SECOND),
        (3_000, 0x4000, 0)
    );
    terminal(&mut drive, "LI5", true);
    assert_eq!((commander(&drive), drive.read(LRS3).unwrap() & BY_SECOND), (0x0000, BY_SECOND));
    assert_eq!(at(&mut drive, 4), 0, "no input gives a run command");
    terminal(&mut drive, "LI1", true);
    assert_eq!(at(&mut drive, 4), 2_000);
}

// p. 37: bit 13 of the control word switches to Cd2; a stop word without it hands command to the terminals.
#[test]
fn a_bit_of_the_control_word_switches_the_command_channel() {
    let mut drive = level_3(&[(DCI, 0), (CD1, 1), (CD2, 10), (CCS, 189), (TCT, 0)]);
    for word in [0x2006, 0x2007, 0x200F] {
        write(&mut drive, CMD, word).unwrap();
    }
    write(&mut drive, LFR, 200).unwrap();
    assert_eq!(
        (at(&mut drive, 4), commander(&drive), drive.read(LRS3).unwrap() & BY_SECOND),
        (2_000, 0x4000, 2)
    );
    terminal(&mut drive, "LI1", true);
    write(&mut drive, CMD, 0x100F).unwrap();
    assert_eq!(commander(&drive), 0x0000);
    assert_eq!(at(&mut drive, 4), 2_000, "the motor runs on by LI1");
    write(&mut drive, CMD, 0x300F).unwrap();
    assert_eq!((at(&mut drive, 4), commander(&drive)), (0, 0x4000));
}

// p. 36: references are switched while running; what a standing word then does is not said.
#[test]
fn when_command_comes_back_the_word_that_stands_acts_or_a_new_one_is_due() {
    for (reading, ends_at) in [("new-word", 0), ("standing-word", 3_000)] {
        let mut drive = level_3(&[(CHCF, 1), (FR2, 1), (RFC, 133)]);
        read_as(&mut drive, "given-back", reading);
        start(&mut drive, 300);
        terminal(&mut drive, "LI5", true);
        assert_eq!(at(&mut drive, 4), 0);
        terminal(&mut drive, "LI5", false);
        assert_eq!((at(&mut drive, 4), commander(&drive)), (ends_at, 0x4000), "{reading}");
    }
}

// p. 55: in forced local mode terminals or display regain control, "PI functions, summing inputs etc. are not active".
#[test]
fn forced_local_control_by_its_input_takes_everything_from_the_bus() {
    let mut drive = level_3(&[(FLO, 134), (PS2, 131), (TCT, 0)]);
    start(&mut drive, 300);
    analog(&mut drive, "AI1", 40);
    terminal(&mut drive, "LI3", true);
    assert_eq!(at(&mut drive, 4), 1_000, "the preset speed SP2");
    terminal(&mut drive, "LI6", true);
    assert_eq!((drive.read(ETA).unwrap() & 0x0200, commander(&drive), drive.observe().local), (0, 0, true));
    terminal(&mut drive, "LI1", true);
    assert_eq!(at(&mut drive, 4), 2_000, "AI1, without the preset speed");
    write(&mut drive, CMD, 0x0000).unwrap();
    assert_eq!(at(&mut drive, 4), 2_000);
    for (floc, commander_shown) in [(16, 0x0000), (163, 0x2000)] {
        let mut drive = level_3(&[(FLO, 134), (FLOC, floc)]);
        terminal(&mut drive, "LI6", true);
        analog(&mut drive, "AIV1", 40);
        drive.panel(Panel::Reference(Frequency::from_hertz(20)));
        drive.panel(Panel::Run);
        assert_eq!((at(&mut drive, 4), commander(&drive)), (2_000, commander_shown), "FLOC = {floc}");
        drive.panel(Panel::Stop);
        assert_eq!(at(&mut drive, 4), 0);
    }
}

// p. 38: LCC; p. 22: ETI bit 13. "The speed reference is then given by parameter LFr page 19".
#[test]
fn the_remote_terminal_commands_by_its_keys_and_its_reference_is_its_own_or_lfr() {
    for (reading, ends_at) in [("own", 2_000), ("LFr", 1_000)] {
        let mut drive = Atv312::new();
        read_as(&mut drive, "terminal-reference", reading);
        write(&mut drive, LCC_KEYS, 1).unwrap();
        write(&mut drive, LFR, 100).unwrap();
        write(&mut drive, CMD, 0x000F).unwrap();
        assert_eq!((at(&mut drive, 4), commander(&drive)), (0, 0x2000), "the bus does not command");
        drive.panel(Panel::Reference(Frequency::from_hertz(20)));
        drive.panel(Panel::Run);
        assert_eq!(at(&mut drive, 4), ends_at, "{reading}");
        drive.panel(Panel::Stop);
        assert_eq!(at(&mut drive, 4), 0);
    }
}

// p. 38: "if the drive/terminal connection is cut ... the drive locks in an SLF detected fault".
#[test]
fn a_remote_terminal_that_commands_and_is_unplugged_trips_slf() {
    let mut drive = Atv312::new();
    terminal(&mut drive, "HMI", false);
    assert_eq!(drive.observe().trip, None);
    terminal(&mut drive, "HMI", true);
    write(&mut drive, LCC_KEYS, 1).unwrap();
    terminal(&mut drive, "HMI", false);
    assert_eq!(drive.observe().trip, Some(SLF));
}

// p. 42: SA2 is AI2 from the factory and adds to Fr1 only; p. 23: AI2 goes below 0.
#[test]
fn a_summing_input_adds_to_the_first_reference_only() {
    for (rfc, ends_at) in [(96, 3_000), (97, 2_000)] {
        let mut drive = level_3(&[(SA2, 2), (FR2, 164), (RFC, rfc)]);
        start(&mut drive, 200);
        analog(&mut drive, "AI2", 20);
        assert_eq!(at(&mut drive, 4), ends_at, "rFC = {rfc}");
        assert_eq!(drive.read(AI2C), Ok(2_000));
        assert_eq!(drive.read(FRH), Ok((ends_at / 10).unsigned_abs() as u16));
    }
    let mut drive = level_3(&[(SA2, 2), (SA3, 2)]);
    start(&mut drive, 200);
    analog(&mut drive, "AI2", -80);
    assert_eq!(at(&mut drive, 10), -5_000, "two of them, held to HSP");
}

// p. 42–44: PS2 to PS16 and SP2 to SP16, "limited by parameter HSP"; p. 14: priority over analog references.
#[test]
fn preset_speeds_replace_the_reference_and_are_limited_by_hsp_alone() {
    let mut drive = level_3(&[(PS2, 131), (PS4, 132), (PS8, 133), (PS16, 134)]);
    assert_eq!(write(&mut drive, SP16, 5_001), Err(Exception::ILLEGAL_VALUE));
    start(&mut drive, 50);
    for (number, ends_at) in [(1, 1_000), (2, 1_500), (3, 2_000), (8, 4_500), (15, 5_000), (0, 500)] {
        for (bit, name) in ["LI3", "LI4", "LI5", "LI6"].into_iter().enumerate() {
            terminal(&mut drive, name, number >> bit & 1 == 1);
        }
        assert_eq!(at(&mut drive, 5), ends_at, "{number}");
    }
}

// p. 42: of the summing inputs it is said that they belong to Fr1; of the preset speeds it is not.
#[test]
fn preset_speeds_replace_the_second_reference_or_leave_it() {
    for (reading, ends_at) in [("Fr1", 3_000), ("both", 1_000)] {
        let mut drive = level_3(&[(PS2, 131), (FR2, 164), (RFC, 97)]);
        read_as(&mut drive, "presets", reading);
        start(&mut drive, 300);
        terminal(&mut drive, "LI3", true);
        assert_eq!(at(&mut drive, 4), ends_at, "{reading}");
    }
}

// p. 11, 42–47: at L1 the bus is no reference of the list of Fr1.
#[test]
fn at_level_1_the_reference_of_the_bus_stands_alone_or_in_the_place_of_fr1() {
    for (reading, [sum, preset]) in [("alone", [3_000, 3_000]), ("as-Fr1", [4_000, 1_000])] {
        let mut drive = Atv312::new();
        read_as(&mut drive, "bus-reference", reading);
        write(&mut drive, LFR, 300).unwrap();
        write(&mut drive, CMD, 0x000F).unwrap();
        analog(&mut drive, "AI2", 20);
        assert_eq!(at(&mut drive, 4), sum, "{reading}");
        terminal(&mut drive, "LI3", true);
        assert_eq!(at(&mut drive, 4), preset, "{reading}");
    }
}

// p. 19, 45–47: with PIF the bus gives the regulator's reference by PISP, and LFr is no frequency any more.
#[test]
fn with_a_pi_regulator_lfr_does_not_decide_the_speed() {
    let mut drive = level_3(&[]);
    write(&mut drive, PIF, 1).unwrap();
    write(&mut drive, PISP, 500).unwrap();
    start(&mut drive, 100);
    assert_eq!(at(&mut drive, 4), 5_000, "no feedback: up to HSP");
    analog(&mut drive, "AI1", 60);
    assert_eq!(at(&mut drive, 4), 0, "too much of it: down to LSP");
    write(&mut drive, PIC, 1).unwrap();
    assert_eq!(at(&mut drive, 4), 5_000, "reversed");
    write(&mut drive, PII, 1).unwrap_err();
    write(&mut drive, PISP, 600).unwrap();
    assert_eq!(at(&mut drive, 1), 5_000, "no error: the speed stays");
}

// p. 14, 45: "before configuring it, these functions must be unassigned".
#[test]
fn the_pi_regulator_waits_until_summing_and_preset_speeds_are_unassigned() {
    let mut drive = Atv312::new();
    for (address, value) in [(SA2, 0), (PS4, 0), (PS2, 0)] {
        assert_eq!(write(&mut drive, PIF, 1), Err(Exception::ILLEGAL_VALUE), "W{address}");
        write(&mut drive, address, value).unwrap();
    }
    write(&mut drive, PIF, 1).unwrap();
    for (address, value) in [(SA2, 2), (SA3, 1), (PS2, 131)] {
        assert_eq!(write(&mut drive, address, value), Err(Exception::ILLEGAL_VALUE), "W{address}");
    }
}

// p. 38: rOt says where the RUN key turns.
#[test]
fn the_run_key_turns_as_rot_says_and_only_where_the_keys_command() {
    let mut drive = level_3(&[(CD1, 2), (FR1, 16), (ROT, 1)]);
    analog(&mut drive, "AIV1", 40);
    drive.panel(Panel::Run);
    assert_eq!(at(&mut drive, 4), -2_000);
    let mut drive = level_3(&[(CD1, 1), (FR1, 16)]);
    analog(&mut drive, "AIV1", 40);
    drive.panel(Panel::Run);
    drive.world(Act::Terminal("LI6", true));
    assert_eq!(at(&mut drive, 4), 0);
}
