//! Stops, and what flows through the motor without a run command.

use super::*;

/// Running at 50 Hz without a current at standstill, the inputs free.
fn plain(settings: &[(u16, u16)]) -> Atv312 {
    let mut drive = Atv312::under_bus_control();
    for &(address, value) in [(ADC, 0), (SA2, 0), (PS4, 0), (PS2, 0)].iter().chain(settings) {
        write(&mut drive, address, value).unwrap();
    }
    for &(function, _) in settings.iter().filter(|(_, value)| (129..=134).contains(value)) {
        // Active at 0, but for the injection.
        let input = usize::from(drive.bank.value(function) - 129);
        terminal(&mut drive, ["LI1", "LI2", "LI3", "LI4", "LI5", "LI6"][input], function != DCI);
    }
    start(&mut drive, 500);
    drive.advance(4 * SECOND);
    assert_eq!(drive.read(RFR), Ok(500));
    drive
}

fn rfr_after(drive: &mut Atv312, milliseconds: u64) -> u16 {
    drive.advance(Duration::from_millis(milliseconds));
    drive.read(RFR).unwrap()
}

// p. 8, 40: a fast stop by an input at 0 keeps "operation enabled"; whether the standing command then acts again depends on
// the wiring (p. 40), or it does in any case (p. 8).
#[test]
fn a_fast_stop_by_an_input_ends_with_it_by_level_by_reading_or_not() {
    for (reading, tct, runs) in
        [("as-wired", 1, false), ("as-wired", 0, true), ("as-wired", 2, true), ("standing-word", 1, true)]
    {
        let mut drive = plain(&[(FST, 133), (TCT, tct)]);
        read_as(&mut drive, "stop-released", reading);
        terminal(&mut drive, "LI5", false);
        assert_eq!(drive.read(ETI).unwrap() & 0x1000, 0x1000, "fast stop in progress");
        assert_eq!((rfr_after(&mut drive, 750), state(&mut drive)), (0, 0x27));
        terminal(&mut drive, "LI5", true);
        assert_eq!(rfr_after(&mut drive, 4_000) == 500, runs, "{reading}, tCt = {tct}");
        write(&mut drive, CMD, 0x000F).unwrap();
        assert_eq!(rfr_after(&mut drive, 4_000), 500, "a new run command acts");
    }
}

// p. 8, 41: a freewheel stop by an input at 0 leads to "switch on disabled", and the transitions are due.
#[test]
fn a_freewheel_stop_by_an_input_locks_the_drive_until_the_chart_is_climbed_again() {
    let mut drive = plain(&[(NST, 133)]);
    terminal(&mut drive, "LI5", false);
    assert_eq!((state(&mut drive), drive.observe().running), (0x40, false));
    start(&mut drive, 500);
    assert_eq!(state(&mut drive), 0x40, "not while the input is open");
    terminal(&mut drive, "LI5", true);
    write(&mut drive, CMD, 0x000F).unwrap();
    assert_eq!(state(&mut drive), 0x40);
    start(&mut drive, 500);
    assert_eq!(state(&mut drive), 0x27);
}

// p. 8, 40: the injection by an input lasts as long as the input is at 1 and keeps "operation enabled".
#[test]
fn an_injection_by_an_input_lasts_as_long_as_the_input() {
    let mut drive = plain(&[(DCI, 133)]);
    terminal(&mut drive, "LI5", true);
    drive.advance(600 * SECOND);
    assert_eq!((drive.read(ETI).unwrap() & 0x0020, state(&mut drive)), (0x0020, 0x27));
    terminal(&mut drive, "LI5", false);
    assert_eq!(rfr_after(&mut drive, 4_000), 500);
}

// p. 8: "3-wire control stop via STOP logic input (LI1)".
#[test]
fn the_stop_input_of_three_wire_control_locks_a_drive_that_the_bus_runs() {
    let mut drive = Atv312::under_bus_control();
    write(&mut drive, TCC, 1).unwrap();
    terminal(&mut drive, "LI1", true);
    start(&mut drive, 500);
    assert_eq!(rfr_after(&mut drive, 4_000), 500);
    terminal(&mut drive, "LI1", false);
    assert_eq!((state(&mut drive), drive.observe().running), (0x40, false));
}

// p. 38: PSt gives the STOP key priority over every channel; without it the bus goes on.
#[test]
fn the_stop_key_stops_a_drive_that_the_bus_runs_unless_pst_takes_its_priority() {
    for (pst, locks) in [(1, true), (0, false)] {
        let mut drive = plain(&[(PST, pst)]);
        drive.panel(Panel::Stop);
        assert_eq!((state(&mut drive) == 0x40, drive.read(ETA).unwrap() & 0x4000 != 0), (locks, locks));
    }
}

// p. 40: bit 12 stops as Stt says.
#[test]
fn the_stop_bit_stops_as_stt_says() {
    for (stt, time, coasts, injects) in
        [(0, 3_000, false, 0), (1, 750, false, 0), (2, 1, true, 0), (3, 1, false, 0x20)]
    {
        let mut drive = plain(&[(STT, stt)]);
        write(&mut drive, CMD, 0x100F).unwrap();
        assert_eq!(drive.read(ETI).unwrap() & 0x0020, injects, "Stt = {stt}");
        drive.advance(Duration::from_millis(time));
        let seen = drive.observe();
        assert_eq!(
            (seen.output_frequency, !seen.running && seen.shaft_frequency > 0),
            (0, coasts),
            "Stt = {stt}"
        );
        drive.advance(10 * SECOND);
        assert!(!drive.observe().running, "tdC ends it");
        assert_eq!(state(&mut drive), 0x27);
    }
}

// p. 10, 12: what 0007h does to the motor is not said.
#[test]
fn disabling_operation_stops_as_stt_says_or_lets_the_motor_coast() {
    for (reading, running) in [("Stt", true), ("freewheel", false)] {
        let mut drive = plain(&[]);
        read_as(&mut drive, "0007h", reading);
        write(&mut drive, CMD, 0x0007).unwrap();
        assert_eq!((drive.observe().running, state(&mut drive)), (running, 0x23), "{reading}");
    }
}

// p. 41: AdC = YES, tdC1 = 5.0 s and then tdC2; p. 20: stopped is ETI.4 = ETI.5 = 0.
#[test]
fn at_the_end_of_a_ramp_direct_current_flows_for_its_two_times() {
    for (reading, shown) in [("any-current", 0x0030), ("output-frequency", 0x0020)] {
        let mut drive = plain(&[(ADC, 1), (TDC2, 20)]);
        read_as(&mut drive, "ETI.4", reading);
        write(&mut drive, CMD, 0x100F).unwrap();
        assert_eq!(rfr_after(&mut drive, 3_000), 0);
        let mut after = |time| {
            drive.advance(Duration::from_millis(time));
            (drive.read(ETI).unwrap() & 0x0030, drive.observe().current)
        };
        assert_eq!(after(4_999), (shown, 27), "SdC1, {reading}");
        assert_eq!(after(1), (shown, 19), "SdC2");
        assert_eq!(after(2_000), (0, 0));
        assert_eq!(write(&mut drive, TFR, 700), Ok(()), "configuration waits for standstill");
    }
    let mut drive = plain(&[(ADC, 1)]);
    write(&mut drive, CMD, 0x100F).unwrap();
    drive.advance(4 * SECOND);
    assert_eq!(write(&mut drive, TFR, 700), Err(Exception::FAILURE), "p. 11");
    write(&mut drive, CMD, 0x000F).unwrap();
    assert_eq!(rfr_after(&mut drive, 4_000), 500, "a run command ends it");
}

// p. 41: "gives rise to the injection of current even if a run command has not been sent".
#[test]
fn a_continuous_injection_needs_no_run_command() {
    let mut drive = Atv312::new();
    assert!(!drive.observe().running);
    write(&mut drive, ADC, 2).unwrap();
    assert_eq!((drive.observe().running, drive.read(ETI).unwrap() & 0x0020), (true, 0x0020));
    drive.advance(3_600 * SECOND);
    assert_eq!(drive.observe().current, 19, "SdC2");
    write(&mut drive, ADC, 0).unwrap();
    assert!(!drive.observe().running);
    let mut locked = Atv312::under_bus_control();
    write(&mut locked, ADC, 2).unwrap();
    assert!(!locked.observe().running, "not while the drive is locked");
}

// p. 28: after tLS at low speed a stop is requested; the motor restarts if the reference is greater than LSP and a run
// command is still present.
#[test]
fn after_its_time_at_low_speed_the_motor_stops_and_a_setpoint_starts_it_again() {
    for (lsp, slowest) in [(0, 0), (100, 100)] {
        let mut drive = plain(&[(TLS, 50), (LSP, lsp)]);
        write(&mut drive, LFR, 0).unwrap();
        assert_eq!(rfr_after(&mut drive, 3_000), slowest);
        drive.advance(Duration::from_millis(4_000));
        assert!(drive.observe().running);
        drive.advance(4 * SECOND);
        assert_eq!(
            (drive.observe().running, drive.read(ETA).unwrap()),
            (false, 0x0627 | if lsp > 0 { 0x800 } else { 0 })
        );
        assert_eq!(drive.read(CMD), Ok(0x000F), "the run command stands");
        write(&mut drive, LFR, lsp).unwrap();
        assert_eq!(rfr_after(&mut drive, 4_000), 0, "LSP is not greater than LSP");
        write(&mut drive, LFR, 300).unwrap();
        assert_eq!(rfr_after(&mut drive, 4_000), 300);
    }
    let mut drive = plain(&[(TLS, 50)]);
    write(&mut drive, LFR, 0).unwrap();
    drive.advance(20 * SECOND);
    write(&mut drive, CMD, 0x100F).unwrap();
    write(&mut drive, LFR, 300).unwrap();
    assert_eq!(rfr_after(&mut drive, 4_000), 0, "without the run command it stays");
}
