//! Faults, their resets, and restarts by themselves.

use super::*;

/// At L1, run by LI1 by its level at 20 Hz.
fn run_by_terminals(settings: &[(u16, u16)]) -> Atv312 {
    let mut drive = Atv312::new();
    for &(address, value) in [(ADC, 0), (TCT, 0)].iter().chain(settings) {
        write(&mut drive, address, value).unwrap();
    }
    analog(&mut drive, "AI1", 40);
    terminal(&mut drive, "LI1", true);
    drive.advance(4 * SECOND);
    assert_eq!(drive.observe().output_frequency, 2_000);
    drive
}

fn run_by_bus(settings: &[(u16, u16)]) -> Atv312 {
    let mut drive = Atv312::under_bus_control();
    for &(address, value) in [(ADC, 0), (TCT, 0)].iter().chain(settings) {
        write(&mut drive, address, value).unwrap();
    }
    start(&mut drive, 200);
    drive.advance(4 * SECOND);
    drive
}

// p. 51: attempts after 1 s, 5 s, 10 s, then every minute; R1 shows no fault meanwhile.
#[test]
fn an_automatic_restart_runs_the_motor_again_when_the_cause_is_gone() {
    let mut drive = run_by_terminals(&[(ATR, 1), (ETF, 134)]);
    drive.trip(18);
    drive.advance(Duration::from_millis(999));
    assert_eq!((drive.observe().trip, drive.read(IOLR).unwrap() & 0x0100), (Some(18), 0x0100));
    drive.advance(Duration::from_millis(1));
    assert_eq!((drive.observe().trip, drive.observe().running), (None, true));
    terminal(&mut drive, "LI6", true);
    drive.advance(5_999 * SECOND / 1_000);
    terminal(&mut drive, "LI6", false);
    assert_eq!(
        drive.observe().trip,
        Some(EPF),
        "the attempt after 1 s found the cause; the next comes after 5 s more"
    );
    drive.advance(Duration::from_millis(1));
    assert!(drive.observe().running);
    drive.trip(9);
    drive.advance(3_600 * SECOND);
    assert_eq!(drive.observe().trip, Some(9), "an overcurrent is none of the list");
}

// p. 51: once tAr has elapsed "the drive remains locked until it is powered down then powered up".
#[test]
fn a_restart_that_does_not_succeed_in_time_locks_the_drive_until_its_supply_was_off() {
    let mut drive = run_by_terminals(&[(ATR, 1), (ETF, 134)]);
    drive.bank.save();
    terminal(&mut drive, "LI6", true);
    drive.advance(400 * SECOND);
    terminal(&mut drive, "LI6", false);
    drive.advance(3_600 * SECOND);
    write(&mut drive, RP, 1).unwrap();
    // The cause of the fault is gone, and a reset is authorised no more than before.
    assert_eq!(drive.observe().trip, Some(EPF));
    drive.power_cycle();
    assert_eq!(drive.observe().trip, None);
}

// p. 10, 51: a reset leads to "switch on disabled"; a restart is to run the motor on.
#[test]
fn a_drive_that_the_bus_runs_runs_on_after_a_restart_or_is_locked() {
    for (reading, runs) in [("runs-on", true), ("locks", false)] {
        let mut drive = run_by_bus(&[(ATR, 1)]);
        read_as(&mut drive, "restart", reading);
        drive.trip(18);
        drive.advance(SECOND);
        assert_eq!((drive.observe().running, state(&mut drive) == 0x27), (runs, runs), "{reading}");
    }
}

// p. 9, 51, 53: a silent line is a cause that persists until a frame comes.
#[test]
fn a_restart_after_a_silent_line_waits_for_a_frame() {
    let mut drive = run_by_bus(&[(ATR, 1), (TTO, 20)]);
    drive.frame_seen(Cast::Unicast);
    drive.advance(30 * SECOND);
    assert_eq!(drive.observe().trip, Some(SLF));
    drive.frame_seen(Cast::Unicast);
    drive.advance(60 * SECOND - Duration::from_millis(1));
    assert!(drive.observe().running);
}

// p. 52: "the run command is maintained after reset of current detected fault"; p. 33: only by level.
#[test]
fn a_reset_runs_a_motor_whose_run_command_stands_at_the_terminals_by_level() {
    for (tct, runs) in [(0, true), (1, false)] {
        let mut drive = run_by_terminals(&[]);
        if tct == 1 {
            assert!(drive.poke(TCT, tct));
        }
        drive.trip(9);
        write(&mut drive, RP, 1).unwrap();
        drive.advance(4 * SECOND);
        assert_eq!((drive.observe().trip, drive.observe().output_frequency > 0), (None, runs), "tCt = {tct}");
    }
}

// p. 12: whether bit 7 counts while another channel commands is not said.
#[test]
fn the_reset_of_the_bus_acts_while_others_command_or_does_not() {
    for (reading, resets) in [("commander", false), ("any", true)] {
        let mut drive = Atv312::under_bus_control();
        write(&mut drive, CD1, 1).unwrap();
        read_as(&mut drive, "reset", reading);
        drive.trip(9);
        write(&mut drive, CMD, 0x0080).unwrap();
        assert_eq!(drive.observe().trip.is_none(), resets, "{reading}");
    }
}

// p. 51: rSF clears the fault by an input.
#[test]
fn an_input_resets_a_fault_at_its_edge() {
    let mut drive = run_by_bus(&[(RSF, 133)]);
    terminal(&mut drive, "LI5", true);
    drive.trip(9);
    terminal(&mut drive, "LI5", false);
    assert_eq!(drive.observe().trip, Some(9));
    terminal(&mut drive, "LI5", true);
    assert_eq!((drive.observe().trip, state(&mut drive)), (None, 0x40));
}

// p. 52: EtF by an input at 1 or, with LEt = LO, at 0; EPL says what follows.
#[test]
fn an_external_fault_by_an_input_does_what_epl_says() {
    for (epl, code, rfr) in [(0, None, 2_000), (1, Some(EPF), 0), (6, Some(EPF), 1_000)] {
        let mut drive = run_by_bus(&[(ETF, 133), (EPL, epl)]);
        terminal(&mut drive, "LI5", true);
        drive.advance(Duration::from_millis(600));
        assert_eq!((drive.observe().trip, drive.observe().output_frequency), (code, rfr), "EPL = {epl}");
    }
    let mut drive = run_by_bus(&[(LET, 0)]);
    drive.world(Act::Terminal("LI5", true));
    assert!(drive.poke(ETF, 133));
    assert_eq!(drive.observe().trip, None);
    terminal(&mut drive, "LI5", false);
    assert_eq!(drive.observe().trip, Some(EPF));
    write(&mut drive, CMD, 0x0080).unwrap();
    assert_eq!(drive.observe().trip, Some(EPF), "its cause is there");
}

// p. 54: LFL, with AI3 below 3 mA; p. 22: LRS1 bit 12.
#[test]
fn a_lost_signal_at_ai3_trips_falls_back_or_keeps_the_speed_as_lfl_says() {
    for (lfl, trip, speed) in [(0, None, 500), (1, Some(LFF), 0), (4, None, 1_000), (5, None, 2_000)] {
        let mut drive = Atv312::under_bus_control();
        for (address, value) in [(ADC, 0), (SA2, 0), (FR1, 3), (LSP, 50)] {
            write(&mut drive, address, value).unwrap();
        }
        // 4 mA + 1/3 of the span are 1/3 of the way from LSP to HSP.
        drive.world(Act::Analog("AI3", Percent::from_hundredths(4_668)));
        write(&mut drive, LFL, lfl).unwrap();
        start(&mut drive, 0);
        drive.advance(4 * SECOND);
        assert_eq!((drive.observe().output_frequency / 10, drive.read(LRS1).unwrap() & 0x1000), (200, 0));
        analog(&mut drive, "AI3", 10);
        drive.advance(4 * SECOND);
        let seen = drive.observe();
        assert_eq!((seen.trip, seen.output_frequency / 10 * 10), (trip, speed), "LFL = {lfl}");
        assert_eq!(drive.read(LRS1).unwrap() & 0x1000, 0x1000);
    }
    let mut drive = Atv312::under_bus_control();
    write(&mut drive, LFL, 1).unwrap();
    assert_eq!(drive.observe().trip, Some(LFF), "nothing is connected to AI3 (note on p. 54)");
}

// p. 52: IPL is a fast stop or nothing; OPL trips, or not, or expects a contactor.
#[test]
fn a_lost_phase_does_what_ipl_and_opl_say() {
    for (setting, value, code, trip) in [
        (IPL, 0, 21, None),
        (IPL, 1, 21, Some(21)),
        (OPL, 0, 20, None),
        (OPL, 1, 20, Some(20)),
        (OPL, 2, 33, None),
    ] {
        let mut drive = run_by_bus(&[(setting, value)]);
        drive.trip(code);
        assert_eq!(drive.observe().trip, trip, "W{setting} = {value}");
        assert_eq!(
            drive.observe().running,
            code == 21 || trip.is_none(),
            "a fast stop for a phase of the line"
        );
    }
}

// p. 54: StP; p. 20: nothing is saved with USF.
#[test]
fn without_line_supply_the_drive_stops_as_stp_says_and_trips_usf_until_it_is_back() {
    for (stp, running) in [(0, false), (1, true), (2, true), (3, true)] {
        let mut drive = run_by_bus(&[(STP, stp)]);
        drive.world(Act::MotorSupply(false));
        assert_eq!((drive.observe().running, drive.observe().trip), (running, Some(USF)), "StP = {stp}");
        drive.advance(4 * SECOND);
        assert_eq!((drive.observe().running, drive.read(ULN), state(&mut drive)), (false, Ok(0), 0x08));
        write(&mut drive, CMD, 0x0080).unwrap();
        assert_eq!(drive.observe().trip, Some(USF));
        drive.world(Act::MotorSupply(true));
        write(&mut drive, CMD, 0x0000).unwrap();
        write(&mut drive, CMD, 0x0080).unwrap();
        assert_eq!((drive.observe().trip, drive.read(ULN)), (None, Ok(4_000)));
    }
}

// p. 54: InH.
#[test]
fn an_input_inhibits_all_faults() {
    let mut drive = run_by_bus(&[(INH, 133)]);
    terminal(&mut drive, "LI5", true);
    drive.trip(9);
    assert!(drive.observe().running);
    terminal(&mut drive, "LI5", false);
    drive.trip(9);
    assert_eq!(drive.observe().trip, Some(9));
}

// p. 55: rPr falls back to nO; only rtH resets.
#[test]
fn the_operating_time_goes_back_to_zero_by_rth_alone() {
    let mut drive = run_by_bus(&[]);
    drive.advance(7_200 * SECOND);
    write(&mut drive, CMD, 0x0000).unwrap();
    assert_eq!((write(&mut drive, RPR, 0), drive.read(RTH)), (Ok(()), Ok(2)));
    assert_eq!((write(&mut drive, RPR, 2), drive.read(RPR), drive.read(RTH)), (Ok(()), Ok(0), Ok(0)));
}

// p. 53: SLL.
#[test]
fn a_silent_line_stops_the_motor_as_sll_says() {
    for (sll, trip, running) in
        [(0, None, true), (1, Some(SLF), false), (6, Some(SLF), true), (7, Some(SLF), true)]
    {
        let mut drive = run_by_bus(&[(SLL, sll), (TTO, 20)]);
        drive.frame_seen(Cast::Unicast);
        drive.advance(2 * SECOND);
        assert_eq!((drive.observe().trip, drive.observe().running), (trip, running), "SLL = {sll}");
    }
}
