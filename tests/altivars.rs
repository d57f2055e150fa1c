//! Who moves the motor of an Altivar 28, 58 and 312, looked at in every status for as long as a run command of this side stands:
//! one promise a test, kept by all three. Expected from BBV51701 (p. 57 for the Altivar 28) and VVDED397054; what only the Altivar
//! 312 has stands in its own tests.

use std::time::Duration;

use drive_bus::Protocol;
use drive_core::{
    Direction, Drive, Error, Frequency, Ground, Identity, Lack, Motion, Recognised, Row, STATUSES_PER_TURN,
    Setpoint, Speed, Status, StopMode, Verdict, Withdrawn,
};
use drive_families::Family;
use drive_testing::{bench, rig::Rig, truth::contradiction};
use support::drives::{self, Five, five};
use tokio::time::sleep;

const ALTIVARS: [Family; 3] = [Family::ATV28, Family::ATV58, Family::ATV312];
const TWENTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(20));

/// In how many statuses what shows in a drive's words is told, as the READMEs print it: each looks for one thing more.
const WITHIN: u16 = 5;

/// Where a family has its control word, its references and its high speed.
struct Registers {
    cmd: u16,
    lfr: u16,
    lfrd: Option<u16>,
    hsp: u16,
}

fn registers(family: Family) -> Registers {
    match five(family) {
        Five::Atv312 => Registers { cmd: 8501, lfr: 8502, lfrd: Some(8602), hsp: 3104 },
        Five::Atv28 => Registers { cmd: 400, lfr: 401, lfrd: Some(603), hsp: 250 },
        _ => Registers { cmd: 400, lfr: 401, lfrd: None, hsp: 250 },
    }
}

struct Bench {
    family: Family,
    rig: Rig,
}

impl Bench {
    fn new(family: Family) -> Self {
        let (settings, machine) = (family.capabilities().factory, drives::machine(family));
        let open = |port, slave| drives::drive(family, port, slave);
        Self { family, rig: Rig::new(Protocol::Rtu, settings, machine, open) }
    }

    /// Runs at 20 Hz by our command.
    async fn running(family: Family) -> Self {
        let mut bench = Self::new(family);
        bench.drive().set_setpoint(TWENTY).await.unwrap();
        bench.drive().start(Direction::Forward).await.unwrap();
        bench.rig.until_machine("20 Hz", |seen| seen.output_frequency == 2_000).await;
        let status = bench.status().await;
        assert_eq!((status.verdict, status.motion), (Some(Verdict::InForce), Motion::Driven), "{family}");
        bench
    }

    fn drive(&mut self) -> &mut dyn Drive {
        &mut *self.rig.drive
    }

    async fn status(&mut self) -> Status {
        let status = self.drive().status().await.unwrap();
        assert_eq!(contradiction(&status, &self.rig.machine.observe()), None, "the words against the shaft");
        status
    }

    /// Something happens around the machine, as a line of the simulator's text.
    fn happens(&self, deed: &str) {
        let line = format!("{} {deed}", self.rig.machine.name());
        self.rig.simulated.control(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
    }

    /// Another master writes a register.
    async fn written(&self, register: u16, word: u16) {
        let answer = bench::write_to(&self.rig.line, drive_testing::rig::ADDRESS, register, word).await;
        assert!(answer, "{register}");
    }

    /// What the run command lacks, in the first status of so many that says so.
    async fn told_within(&mut self, statuses: u16) -> Option<Lack> {
        for _ in 0..statuses {
            if let Some(Verdict::NotInForce { lacks, .. }) = self.status().await.verdict {
                return Some(lacks);
            }
            sleep(Duration::from_millis(100)).await;
        }
        None
    }

    fn wrote(&self) -> Vec<u16> {
        bench::written(&self.rig.machine, registers(self.family).cmd)
    }
}

#[tokio::test(start_paused = true)]
async fn what_takes_the_run_command_its_output_or_its_reference_is_told_within_a_few_statuses() {
    for family in ALTIVARS {
        let Registers { cmd, lfr, lfrd, .. } = registers(family);
        let stop = if family == Family::ATV58 { 0x0007 } else { 0x100F };
        let mut cases = vec![
            ("panel takes".to_owned(), None, Lack::Command),
            ("motor-supply off".to_owned(), None, Lack::Output),
            (format!("trip {}", drives::a_trip(family)), None, Lack::Output),
            ("another reference".to_owned(), Some((lfr, 480)), Lack::Reference),
            ("another sign".to_owned(), Some((lfr, 0xFF38)), Lack::Reference),
            ("another stop".to_owned(), Some((cmd, stop)), Lack::Command),
        ];
        if family != Family::ATV58 {
            cases.push(("panel stop".to_owned(), None, Lack::Output));
        }
        if family == Family::ATV312 {
            // FSt by LI6 and nSt by LI5, which are open (p. 8, 40, 41).
            cases.push(("set FSt 134".to_owned(), None, Lack::Output));
            cases.push(("set nSt 133".to_owned(), None, Lack::Output));
        }
        if let Some(lfrd) = lfrd {
            cases.push(("another speed".to_owned(), Some((lfrd, 900)), Lack::Reference));
        }
        for (what, write, lack) in cases {
            let mut bench = Bench::running(family).await;
            match write {
                Some((register, word)) => bench.written(register, word).await,
                None => bench.happens(&what),
            }
            assert_eq!(bench.told_within(WITHIN).await, Some(lack), "{family}: {what}");
            let ended = what == "another stop";
            assert_eq!(
                bench.drive().lease().is_none(),
                ended,
                "{family}, {what}: it stands until it was seen not to"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_reference_in_hertz_of_another_master_is_told_beside_a_setpoint_in_rpm_of_ours() {
    for family in [Family::ATV28, Family::ATV312] {
        let mut bench = Bench::new(family);
        bench.drive().set_setpoint(Speed::from_rpm(600).into()).await.unwrap();
        bench.drive().start(Direction::Forward).await.unwrap();
        bench.rig.until_machine("20 Hz", |seen| seen.output_frequency == 2_000).await;
        for _ in 0..4 {
            bench.status().await;
        }
        assert_eq!(bench.status().await.verdict, Some(Verdict::InForce), "{family}");
        bench.written(registers(family).lfr, 300).await;
        assert_eq!(bench.told_within(WITHIN).await, Some(Lack::Reference), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_summing_input_that_moves_in_the_middle_of_a_run_is_told_by_its_name() {
    // SA2 is AI2 as an Altivar 312 leaves the factory, and is added to whatever Fr1 is (p. 15, 42).
    let mut bench = Bench::new(Family::ATV312);
    bench.happens("set SA2 2");
    bench.drive().set_setpoint(TWENTY).await.unwrap();
    bench.drive().start(Direction::Forward).await.unwrap();
    bench.rig.until_machine("20 Hz", |seen| seen.output_frequency == 2_000).await;
    bench.happens("analog AI2 60%");
    assert_eq!(bench.told_within(WITHIN).await, Some(Lack::Reference));
    bench.rig.poll_for(Duration::from_secs(5)).await;
    let told = bench.status().await.verdict.unwrap().to_string();
    assert!(told.contains("SA2"), "{told}");
}

#[tokio::test(start_paused = true)]
async fn direct_current_into_a_motor_at_rest_is_standstill_whatever_gives_it() {
    // AdC = Ct (p. 41); dCI by LI5, closed while the motor stands (p. 8, 40).
    for (before, behind) in [("set AdC 2", ""), ("set dCI 133", "terminal LI5 on")] {
        let mut bench = Bench::new(Family::ATV312);
        bench.happens(before);
        bench.drive().set_setpoint(TWENTY).await.unwrap();
        bench.drive().start(Direction::Forward).await.unwrap();
        bench.rig.until_machine("20 Hz", |seen| seen.output_frequency == 2_000).await;
        bench.rig.poll_for(Duration::from_secs(10)).await;
        bench.drive().stop(StopMode::Ramp).await.unwrap();
        let mut turned = 0;
        for round in 0..100 {
            let status = bench.status().await;
            let shaft = bench.rig.machine.observe().shaft_frequency;
            assert!(!status.is_standstill() || shaft == 0, "{before}: {} at {shaft}", status.motion);
            turned += usize::from(shaft != 0);
            if round == 60 && !behind.is_empty() {
                bench.happens(behind);
            }
            sleep(Duration::from_millis(100)).await;
        }
        assert!(turned < 60, "{before}: the motor has stopped");
        let status = bench.status().await;
        assert!(bench.rig.machine.observe().running, "{before}: current flows");
        assert_eq!((status.motion, status.is_standstill()), (Motion::Held, true), "{before}");
    }
}

#[tokio::test(start_paused = true)]
async fn wires_that_are_changed_take_the_functions_of_the_inputs_along_and_the_next_stop_knows_it() {
    // p. 33: tCC puts every function of a logic input back, dCI among them.
    let mut bench = Bench::new(Family::ATV312);
    bench.drive().self_restarts().await.unwrap();
    let row = Row::find(drive_atv312::ROWS, "tCC").unwrap();
    bench.drive().write_parameter(row, 1).await.unwrap();
    // 3-wire: LI1 open stops whatever commands (p. 8).
    bench.happens("terminal LI1 on");
    bench.drive().set_setpoint(TWENTY).await.unwrap();
    bench.drive().start(Direction::Forward).await.unwrap();
    let stopped = bench.drive().stop(StopMode::DcInjection).await.unwrap();
    assert_eq!(
        stopped.mode == StopMode::DcInjection,
        bench.rig.machine.peek(11203) == Some(173),
        "{stopped}"
    );
    bench.drive().start(Direction::Forward).await.unwrap();
    bench.happens("terminal LI1 off");
    assert_eq!(bench.told_within(WITHIN).await, Some(Lack::Output));
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_is_first_seen_behind_a_reconnect_is_withdrawn_on_the_wire() {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        bench.rig.machine.trip(drives::a_trip(family));
        bench.drive().forget();
        assert_eq!(bench.told_within(3).await, Some(Lack::Output), "{family}");
        let withdrawn = bench.drive().withdraw().await.unwrap();
        assert!(matches!(withdrawn, Withdrawn::Ended(_)), "{family}");
        let word = if family == Family::ATV58 { 0x0000 } else { 0x100F };
        assert_eq!(bench.wrote().last(), Some(&word), "{family}");
        assert_eq!(bench.drive().lease(), None, "{family}");
        let again = bench.drive().withdraw().await.unwrap();
        assert!(matches!(again, Withdrawn::Nothing(_)), "{family}: and then there is nothing");
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_adopted_where_the_drive_holds_it_and_ends_where_it_does_not() {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        let lease = bench.drive().lease().unwrap();
        let again = |bench: &Bench| {
            let slave = bench::address(drive_testing::rig::ADDRESS);
            let mut drive = drives::drive(family, bench.rig.line.slave(drive_testing::rig::ADDRESS), slave);
            drive.adopt(lease);
            drive
        };
        bench.rig.drive = again(&bench);
        for _ in 0..3 {
            bench.status().await;
        }
        assert_eq!(bench.status().await.verdict, Some(Verdict::InForce), "{family}");
        bench.drive().stop(StopMode::Ramp).await.unwrap();
        bench.rig.drive = again(&bench);
        assert_eq!(bench.told_within(2).await, Some(Lack::Command), "{family}");
        assert_eq!((bench.drive().lease(), bench.status().await.verdict), (None, None), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_leaves_the_direction_of_a_motor_whose_reference_another_master_has_turned_round() {
    // LFr, LFRD and W401 are signed (BBV51701 p. 16, 19; VVDED397054 p. 10/34).
    for family in ALTIVARS {
        let Registers { lfr, lfrd, .. } = registers(family);
        for (register, word) in [Some((lfr, 0xFF38)), lfrd.map(|lfrd| (lfrd, 0xFDA8))].into_iter().flatten() {
            let mut bench = Bench::running(family).await;
            bench.written(register, word).await;
            bench.rig.until_machine("20 Hz in reverse", |seen| seen.output_frequency == -2_000).await;
            assert_eq!(bench.status().await.direction, Some(Direction::Reverse), "{family}");
            bench.drive().set_setpoint(Frequency::from_hertz(10).into()).await.unwrap();
            bench.rig.until_machine("10 Hz in reverse", |seen| seen.output_frequency == -1_000).await;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn no_stop_is_told_at_rest_before_the_shaft_stands() {
    for family in ALTIVARS {
        for mode in StopMode::ALL {
            for load in [0, 50] {
                let mut bench = Bench::running(family).await;
                bench.rig.machine.set_load(load);
                bench.drive().stop(mode).await.unwrap();
                let mut last = Motion::NotKnown;
                for _ in 0..120 {
                    let status = bench.status().await;
                    let shaft = bench.rig.machine.observe().shaft_frequency;
                    assert!(
                        !status.is_standstill() || shaft == 0,
                        "{family}, {mode}: {} at {shaft}",
                        status.motion
                    );
                    last = status.motion;
                    sleep(Duration::from_millis(50)).await;
                }
                let ends_as = match (mode, five(family)) {
                    (StopMode::Freewheel, _) => Motion::Coasting,
                    (StopMode::DcInjection, Five::Atv28 | Five::Atv312) => Motion::Held,
                    _ => Motion::AtRest,
                };
                assert_eq!(last, ends_as, "{family}, {mode}");
            }
        }
        let mut bench = Bench::running(family).await;
        bench.drive().set_coast_time(Some(Duration::from_secs(30)));
        bench.drive().stop(StopMode::Freewheel).await.unwrap();
        bench.rig.poll_for(Duration::from_secs(31)).await;
        assert_eq!(bench.status().await.motion, Motion::AtRest, "{family}: as its owner says");
    }
}

#[tokio::test(start_paused = true)]
async fn a_fast_stop_that_another_masters_stop_turns_into_a_freewheel_is_not_told_at_rest_while_the_motor_coasts()
 {
    // Bit 12 stops in the way of Stt (p. 12, 40), which lets the motor coast here.
    for looks in [0, 1, 3] {
        let mut bench = Bench::new(Family::ATV312);
        bench.happens("set Stt 2");
        bench.drive().set_setpoint(TWENTY).await.unwrap();
        bench.drive().start(Direction::Forward).await.unwrap();
        bench.rig.until_machine("20 Hz", |seen| seen.output_frequency == 2_000).await;
        bench.drive().stop(StopMode::Fast).await.unwrap();
        for _ in 0..looks {
            bench.status().await;
            sleep(Duration::from_millis(20)).await;
        }
        bench.written(registers(Family::ATV312).cmd, 0x100F).await;
        for _ in 0..10 {
            let status = bench.status().await;
            let shaft = bench.rig.machine.observe().shaft_frequency;
            assert!(!status.is_standstill() || shaft == 0, "{looks}: {} at {shaft}", status.motion);
            sleep(Duration::from_millis(100)).await;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn limits_that_are_lowered_at_the_keypad_are_found_in_their_turn_and_hold_for_setpoints_within_ten_seconds()
 {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        assert!(bench.rig.machine.poke(registers(family).hsp, 400));
        let mut found = None;
        // Two things take their turn on the Altivar 28 and 58; on the 312 the settings do as well.
        let things = if family == Family::ATV312 { 2 * 21 } else { 2 };
        for _ in 0..things * STATUSES_PER_TURN {
            bench.status().await;
            found = found.or(bench.drive().take_changed());
        }
        assert_eq!(found, Some(Ground::Limits), "{family}");
        sleep(Duration::from_secs(10)).await;
        let error = bench.drive().set_setpoint(Frequency::from_hertz(45).into()).await.unwrap_err();
        assert!(matches!(error, Error::Setpoint { .. }), "{family}: {error}");
    }
}

/// Whether `FrH` is kept between the limits no manual says ("before ramp", BBV51701 p. 21): these drives keep it there.
#[tokio::test(start_paused = true)]
async fn a_limit_that_is_set_across_the_setpoint_of_a_motor_that_runs_is_no_other_reference() {
    for family in ALTIVARS {
        let (hsp, lsp) = (registers(family).hsp, registers(family).hsp + 1);
        for (limit, word) in [(hsp, 150), (lsp, 300)] {
            let mut bench = Bench::running(family).await;
            assert!(bench.rig.machine.poke(limit, word));
            assert_eq!(bench.told_within(100).await, None, "{family}: {limit}");
            let runs_at = bench.rig.machine.observe().output_frequency;
            assert_eq!(runs_at, i32::from(word) * 10, "{family}: {limit}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_stands_at_a_setpoint_of_zero_leaves_the_limits_their_turn() {
    for family in ALTIVARS {
        let mut bench = Bench::new(family);
        bench.drive().set_setpoint(Frequency::ZERO.into()).await.unwrap();
        bench.drive().start(Direction::Forward).await.unwrap();
        for _ in 0..20 {
            bench.status().await;
        }
        assert!(bench.rig.machine.poke(registers(family).hsp, 400));
        let mut found = None;
        for _ in 0..42 * STATUSES_PER_TURN {
            bench.status().await;
            found = found.or(bench.drive().take_changed());
        }
        assert_eq!(found, Some(Ground::Limits), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn no_reset_starts_a_motor_whose_terminals_ask_for_a_run() {
    // Forced local with LI1 closed (58); the run input on another input than LI1 and LI2 (28); at L1 (312).
    for (family, deeds, commands) in [
        (Family::ATV58, &["panel takes", "terminal LI1 on"][..], false),
        (Family::ATV28, &["terminal LI3 on"][..], true),
        (Family::ATV28, &["terminal LI1 on"][..], false),
        (Family::ATV312, &["set Cd1 1", "set tCt 0", "terminal LI1 on"][..], false),
    ] {
        for wires in ["level", "edge"] {
            let mut bench = Bench::new(family);
            if commands {
                // The bus has had command.
                bench.drive().stop(StopMode::Ramp).await.unwrap();
            }
            bench.happens(&format!("trip {}", drives::a_trip(family)));
            deeds.iter().for_each(|deed| bench.happens(deed));
            let before = bench.wrote();
            let error = bench.drive().reset_faults().await.unwrap_err();
            assert!(matches!(error, Error::Refused { .. }), "{family} {wires}: {error}");
            sleep(Duration::from_secs(5)).await;
            assert!(!bench.rig.machine.observe().running, "{family}");
            assert_eq!(bench.wrote(), before, "{family}: nothing was written");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn nothing_that_moves_control_is_written_to_an_altivar_28_while_an_input_is_closed_or_a_run_command_stands()
 {
    // tCC changes what each input does (twin p. 33), LCC who commands (twin p. 38).
    for code in ["tCC", "LCC"] {
        let row = Row::find(drive_atv28::ROWS, code).unwrap();
        let mut bench = Bench::new(Family::ATV28);
        bench.happens("terminal LI3 on");
        let error = bench.drive().write_parameter(row, 1).await.unwrap_err();
        assert!(error.to_string().contains("LI3"), "{code}: {error}");
        bench.happens("terminal LI3 off");
        bench.written(400, 0x000F).await;
        let error = bench.drive().write_parameter(row, 1).await.unwrap_err();
        assert!(matches!(error, Error::Refused { .. }), "{code}: {error}");
        assert_eq!(bench.rig.machine.peek(row.address), Some(0), "{code}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_says_which_setpoint_it_uses_also_after_a_power_cut() {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        let status = bench.drive().start(Direction::Forward).await.unwrap();
        assert_eq!(status.reference, Some(Frequency::from_hertz(20)), "{family}");
        bench.rig.machine.power_cycle();
        sleep(Duration::from_secs(5)).await;
        bench.drive().forget();
        bench.told_within(3).await;
        let status = bench.drive().start(Direction::Forward).await.unwrap();
        assert_eq!(status.reference, Some(Frequency::ZERO), "{family}");
        assert!(!bench.rig.machine.observe().running || bench.rig.machine.observe().output_frequency == 0);
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_family_cannot_tell_of_its_drives_is_said_and_what_it_can_is_judged() {
    let says = |model: &str| Identity { model: Some(model.to_owned()), ..Identity::default() };
    for (family, model, expected) in [
        (Family::ATV28, None, Recognised::CannotTell),
        (Family::ATV58, None, Recognised::CannotTell),
        (Family::ATV58, Some("ATV58HU18N4"), Recognised::Mine),
        (Family::ATV312, Some("ATV312HU15N4"), Recognised::Mine),
    ] {
        let mut bench = Bench::new(family);
        let identity = model.map_or_else(Identity::default, says);
        assert_eq!(bench.drive().recognise(&identity), expected, "{family} {model:?}");
    }
    for family in [Family::ATV58, Family::ATV312] {
        let its = Bench::new(family).drive().recognise(&says("ATV71HU15N4"));
        assert!(matches!(its, Recognised::NotMine { .. }), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_costs_one_exchange_more_in_twenty_statuses() {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        bench.drive().self_restarts().await.unwrap();
        for _ in 0..40 {
            bench.status().await;
        }
        let before = bench.rig.machine.all_requests();
        for _ in 0..200 {
            bench.status().await;
        }
        let ordinary = 200 * u64::from(family.capabilities().status_exchanges);
        let further = 200 / u64::from(STATUSES_PER_TURN);
        assert_eq!(bench.rig.machine.all_requests() - before, ordinary + further, "{family}");
        bench.drive().stop(StopMode::Ramp).await.unwrap();
        bench.rig.until_standstill().await;
        let before = bench.rig.machine.all_requests();
        for _ in 0..200 {
            bench.status().await;
        }
        assert_eq!(bench.rig.machine.all_requests() - before, ordinary, "{family}: at rest nothing more");
    }
}

#[tokio::test(start_paused = true)]
async fn whoever_stops_by_another_mode_says_so_and_why() {
    for family in ALTIVARS {
        let mut bench = Bench::running(family).await;
        bench.drive().stop(StopMode::Fast).await.unwrap();
        let stopped = bench.drive().stop(StopMode::DcInjection).await.unwrap();
        if family == Family::ATV58 {
            assert_eq!(
                stopped.mode == StopMode::DcInjection,
                stopped.instead.is_none(),
                "{family}: {stopped}"
            );
            assert!(stopped.instead.is_some(), "{family}: {stopped}");
        } else {
            assert_eq!((stopped.mode, stopped.instead), (StopMode::DcInjection, None), "{family}: {stopped}");
        }
    }
    // At L3 as it is delivered no bit of the control word brakes: dCI is not assigned (p. 40).
    let mut bench = Bench::new(Family::ATV312);
    bench.happens("set dCI 0");
    bench.happens("set FSt 0");
    bench.drive().set_setpoint(TWENTY).await.unwrap();
    bench.drive().start(Direction::Forward).await.unwrap();
    let stopped = bench.drive().stop(StopMode::DcInjection).await.unwrap();
    assert_eq!(stopped.mode, StopMode::Ramp, "{stopped}");
    assert!(stopped.instead.is_some_and(|why| why.contains("dCI")), "{stopped}");
}

/// BBV51701 p. 27, and the same of the others: HSP is changed at the keypad at any time.
#[tokio::test(start_paused = true)]
async fn a_high_speed_that_is_lowered_at_the_keypad_holds_ten_seconds_after_it_was_read_at_the_latest() {
    for family in ALTIVARS {
        let mut bench = Bench::new(family);
        bench.drive().set_setpoint(TWENTY).await.unwrap();
        assert!(bench.rig.machine.poke(registers(family).hsp, 300), "{family}");
        for _ in 0..20 {
            bench.status().await;
            sleep(Duration::from_millis(500)).await;
        }
        let error = bench.drive().set_setpoint(Frequency::from_hertz(40).into()).await.unwrap_err();
        assert!(matches!(error, Error::Setpoint { .. }), "{family}: {error}");
    }
}
