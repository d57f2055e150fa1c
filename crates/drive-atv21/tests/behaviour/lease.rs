//! Our run command from the moment it is written until the drive shows that it stands no more. Pages are the manual's.

use std::{collections::BTreeSet, time::Duration};

use drive_atv21::{Atv21, CAPABILITIES, ROWS};
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, Frequency, Ground, Lack, Lease, Motion, Reaction,
    Recognised, Refusal, Result, Row, State, StopMode, Verdict, Withdrawn,
};
use drive_sim::{Panel, SimSlave, models::atv21::Atv21 as Model};
use drive_testing::{bench, words::Words};

use crate::support::{HALF_SPEED, Judged, Rig, SECOND, refusal};

/// A motor that runs at 25 Hz by the bus: FA00, FA01, FD00, FD01, FE02, FE45, FE46, UL.
const RUNNING: [(u16, u16); 8] = [
    (0xFA00, 0xC400),
    (0xFA01, 2_500),
    (0xFD00, 2_500),
    (0xFD01, 0x6400),
    (0xFE02, 2_500),
    (0xFE45, 2),
    (0xFE46, 4),
    (0x0012, 5_000),
];

fn lacks(verdict: Option<Verdict>) -> Option<(Lack, String)> {
    match verdict {
        Some(Verdict::NotInForce { lacks, because }) => Some((lacks, because.to_string())),
        _ => None,
    }
}

async fn verdict(drive: &mut Judged) -> Option<Verdict> {
    drive.status().await.unwrap().verdict
}

/// Asks until a status says that the run command is not in force, so many times at the most.
async fn lost(drive: &mut Judged, statuses: usize) -> (Lack, String) {
    for _ in 0..statuses {
        if let Some(told) = lacks(verdict(drive).await) {
            return told;
        }
        tokio::time::sleep(SECOND / 10).await;
    }
    panic!("nothing was said in {statuses} statuses");
}

fn terminal(machine: &SimSlave, name: &str, closed: bool) {
    machine.terminal(name, closed).unwrap();
}

/// A motor at rest, in a drive that answers every write by this exception.
fn refusing(exception: u8) -> Atv21<Words> {
    let mut words = Words::new(&CAPABILITIES, &[(0xFD01, 0x4000), (0xFE46, 1), (0x0012, 5_000)]);
    words.refuses_writes = Some(exception);
    Atv21::new(words, bench::address(1))
}

async fn running() -> (Rig, Judged) {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert_eq!(verdict(&mut drive).await, Some(Verdict::InForce));
    (rig, drive)
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_ours_from_before_it_is_written_until_a_stop_is_seen() {
    let (rig, mut drive) = Rig::factory();
    assert_eq!((drive.lease(), verdict(&mut drive).await), (None, None));
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    let status = drive.start(Direction::Reverse).await.unwrap();
    assert_eq!(drive.lease(), Some(Lease::new(Direction::Reverse, 0xC600)));
    assert_eq!(status.verdict, Some(Verdict::InForce));
    assert_eq!(status.reference, Some(HALF_SPEED), "it names the setpoint that it uses");
    drive.forget();
    assert!(drive.lease().is_some(), "a reconnect does not end it");
    rig.at_rest(&mut drive).await;
    assert_eq!((drive.lease(), verdict(&mut drive).await), (None, None));
}

/// W:346590 of `drive-fire`: a status of no words at all was one of a motor that may coast, and confirmed a stop.
#[tokio::test(start_paused = true)]
async fn a_status_word_that_is_refused_tells_nothing_of_the_motor_and_confirms_no_stop() {
    let mut words = Words::new(&CAPABILITIES, &RUNNING);
    words.refused.insert(0xFD01, 2);
    let mut drive = Atv21::new(words, bench::address(1));
    assert_eq!(drive.status().await.map_err(|error| error.kind()), Err(ErrorKind::Exception));
    for mode in [StopMode::Ramp, StopMode::DcInjection] {
        assert!(drive.stop(mode).await.is_err(), "{mode}");
    }
}

#[tokio::test(start_paused = true)]
async fn st_that_opens_and_closes_is_told_while_it_lasts_and_the_motor_coasts() {
    let (rig, mut drive) = running().await;
    terminal(&rig.machine, "ST", false);
    let status = drive.status().await.unwrap();
    let (lack, because) = lacks(status.verdict).unwrap();
    assert_eq!((lack, status.state, status.motion), (Lack::Output, State::Disabled, Motion::Coasting));
    assert!(because.contains("FD01 bit 11"), "{because}");
    assert!(rig.machine.observe().shaft_frequency > 0 && !status.is_standstill());
    assert!(drive.lease().is_some(), "it starts again by itself when ST closes");
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Ended(_)));
    terminal(&rig.machine, "ST", true);
    tokio::time::sleep(2 * SECOND).await;
    assert!(!rig.machine.observe().running);
    assert_eq!(drive.lease(), None);
}

#[tokio::test(start_paused = true)]
async fn a_loss_of_the_main_circuit_keeps_the_run_command_ours() {
    let (rig, mut drive) = running().await;
    rig.machine.motor_supply(false);
    let status = drive.status().await.unwrap();
    assert_eq!(lacks(status.verdict).map(|(lack, _)| lack), Some(Lack::Output));
    assert_eq!((status.state, status.motion), (State::NotReady, Motion::Coasting));
    // It stands long since, and starts by itself when the supply is back (§8.6 p. 34).
    rig.until(|seen| seen.shaft_frequency == 0).await;
    drive.status().await.unwrap();
    assert!(drive.lease().is_some());
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Ended(_)));
    rig.machine.motor_supply(true);
    tokio::time::sleep(2 * SECOND).await;
    assert!(!rig.machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_keypad_that_runs_it_at_45_hz_is_told_with_the_next_status() {
    let (rig, mut drive) = running().await;
    rig.machine.panel(Panel::TakeControl);
    rig.machine.panel(Panel::Reference(Frequency::from_hertz(45)));
    rig.machine.panel(Panel::Run);
    let (lack, because) = lost(&mut drive, 1).await;
    assert_eq!(lack, Lack::Command);
    assert!(because.contains("keypad"), "{because}");
}

/// LOC/REM is always active (6.2 p. 12), and nothing says that it stops the motor: FD01 is read before FE45, and who takes control between
/// the two runs on a motor that did not run by then; so does who takes it while FA00 is read. Behind the last look he is told by the
/// next status.
#[tokio::test(start_paused = true)]
async fn a_stop_is_not_confirmed_at_a_motor_that_the_keypad_takes_before_its_last_look_and_runs_on() {
    // FA00 is read in 29 ms, with the pause before it; FE45 is answered by 73 ms.
    let last_exchange = Duration::from_millis(30);
    let mut confirmed = 0;
    for milliseconds in (20..=128).step_by(6) {
        let (rig, mut drive) = running().await;
        rig.machine.reading("LOC", "runs-on").unwrap();
        let begun = tokio::time::Instant::now();
        let took = Duration::from_millis(milliseconds);
        let ((stopped, ended), ()) =
            tokio::join!(async { (drive.stop(StopMode::Ramp).await, begun.elapsed()) }, async {
                tokio::time::sleep(took).await;
                rig.machine.panel(Panel::TakeControl);
            });
        assert!(rig.machine.observe().running && rig.machine.observe().local);
        if stopped.is_ok() {
            confirmed += 1;
            assert!(ended < took + last_exchange, "taken after {took:?}, told by {ended:?}: {stopped:?}");
        }
        let status = drive.status().await.unwrap();
        assert_eq!(status.control, Some(Control::Panel), "{status}");
        assert_eq!(status.state, State::Running, "{status}");
    }
    assert!(confirmed > 0, "the stop takes less than that");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_function_48_would_start_when_f_and_r_go_off_is_seen_and_withdrawn() {
    // §6.2 p. 15: R on gives the terminals the command; F runs it.
    let (rig, mut drive) = Rig::factory();
    for (register, word) in [(0x0112, 48), (0x0111, 2), (0xFE35, 614)] {
        rig.machine.poke(register, word);
    }
    rig.at_speed(&mut drive).await;
    rig.machine.poke(0xFD06, 3);
    let (lack, because) = lost(&mut drive, 1).await;
    assert_eq!(lack, Lack::Command);
    assert!(because.contains("48"), "{because}");
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Ended(_)));
    for inputs in [2, 0] {
        rig.machine.poke(0xFD06, inputs);
        rig.until(|seen| !seen.running).await;
    }
    tokio::time::sleep(10 * SECOND).await;
    assert!(!rig.machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_start_under_each_of_these_worlds_ends_as_not_confirmed_with_its_reason() {
    // The world comes as soon as the run command stands: FD01, FE45, FE46 or FE02 show it (§8.4 to §8.6).
    for (register, word, named) in [
        (0xFD01, 0x6C00, "FD01 bit 11"),
        (0xFD01, 0x4480, "FD01 bit 7"),
        (0xFD01, 0x0408, "FD01 bit 3"),
        (0xFE45, 1, "keypad"),
        (0xFE45, 0, "48, 52 or 53"),
        (0xFE46, 255, "preset speed"),
        (0xFE02, 3_000, "FE02"),
    ] {
        let (rig, mut drive) = Rig::factory();
        drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
        let comes = async {
            rig.machine.wait_until(|seen| seen.running).await;
            rig.machine.poke(register, word);
        };
        let (started, ()) = tokio::join!(drive.start(Direction::Forward), comes);
        let Err(Error::NotConfirmed { because: Some(because), status, .. }) = started else {
            panic!("{register:04X}h = {word:04X}h: {started:?}")
        };
        assert!(because.to_string().contains(named), "{because}");
        assert!(lacks(status.verdict).is_some(), "{:?}", status.verdict);
        assert!(drive.lease().is_some(), "it stands, and is taken back by a stop");
        drive.stop(StopMode::Ramp).await.ok();
        assert_eq!(drive.lease(), None);
    }
}

#[tokio::test(start_paused = true)]
async fn another_masters_word_ends_the_lease_and_is_told_within_twelve_statuses() {
    // A preset speed by the bus (§8.4 p. 31): FD01 and FE45 show nothing of it.
    let (rig, mut drive) = running().await;
    bench::write(&rig.line, 0xFA00, 0xC401).await;
    let (lack, because) = lost(&mut drive, 12).await;
    assert!([Lack::Command, Lack::Reference].contains(&lack), "{because}");
    for _ in 0..12 {
        drive.status().await.unwrap();
    }
    let withdrawn = drive.withdraw().await.unwrap();
    assert!(matches!(withdrawn, Withdrawn::Nothing(_)), "{withdrawn:?}");
    assert_eq!((rig.machine.peek(0xFA00), drive.lease()), (Some(0xC401), None), "his word is left");
}

#[tokio::test(start_paused = true)]
async fn a_reference_that_is_switched_away_is_told_as_soon_as_the_motor_moves() {
    // §6.2 p. 16: R switches to VIA by its function 38.
    let (rig, mut drive) = running().await;
    for (register, word) in [(0x0112, 38), (0x0207, 1), (0xFE35, 1_023), (0xFD06, 2)] {
        rig.machine.poke(register, word);
    }
    let (lack, because) = lost(&mut drive, 20).await;
    assert_eq!(lack, Lack::Reference);
    assert!(because.contains("VIA"), "{because}");
    assert!(rig.machine.observe().output_frequency < 3_300, "{:?}", rig.machine.observe());
}

#[tokio::test(start_paused = true)]
async fn another_masters_setpoint_is_told() {
    let (rig, mut drive) = running().await;
    bench::write(&rig.line, 0xFA01, 4_800).await;
    let (lack, because) = lost(&mut drive, 12).await;
    assert_eq!(lack, Lack::Reference);
    assert!(because.contains("FE02"), "{because}");
    // One of our own is in force again.
    drive.set_setpoint(Frequency::from_hertz(30).into()).await.unwrap();
    assert_eq!(verdict(&mut drive).await, Some(Verdict::InForce));
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_something_behind_the_reference_holds_elsewhere_is_told_and_no_ramp_is() {
    // PID control, the lower limit: FE02 is what FA01 holds, and FD00 stays at 30 Hz.
    let mut words = Words::new(&CAPABILITIES, &RUNNING);
    words.words.insert(0xFD00, 3_000);
    let mut drive = Atv21::new(words, bench::address(1));
    drive.start(Direction::Forward).await.unwrap();
    let mut told = None;
    for _ in 0..30 {
        tokio::time::sleep(SECOND).await;
        told = told.or(lacks(drive.status().await.unwrap().verdict));
    }
    let (lack, because) = told.unwrap();
    assert_eq!(lack, Lack::Reference);
    assert!(because.contains("PID"), "{because}");
    // The longest ramp, 3200 s to 80 Hz.
    let (rig, mut drive) = Rig::factory();
    rig.machine.poke(0x0009, 32_000);
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    for _ in 0..60 {
        tokio::time::sleep(SECOND).await;
        assert_eq!(verdict(&mut drive).await, Some(Verdict::InForce));
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_is_turned_round_on_the_longest_ramp_is_in_force_all_the_way() {
    let (rig, mut drive) = running().await;
    rig.machine.poke(0x0010, 32_000);
    drive.start(Direction::Reverse).await.unwrap();
    for _ in 0..120 {
        tokio::time::sleep(SECOND).await;
        assert_eq!(verdict(&mut drive).await, Some(Verdict::InForce));
    }
    assert!(rig.machine.observe().output_frequency > 0, "it comes down still");
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_is_first_seen_at_a_reconnect_is_withdrawn_on_the_wire() {
    let (rig, mut drive) = running().await;
    rig.machine.trip(24);
    drive.forget();
    assert!(drive.status().await.unwrap().is_fault());
    let withdrawn = drive.withdraw().await.unwrap();
    assert!(matches!(withdrawn, Withdrawn::Ended(_)), "{withdrawn:?}");
    assert_eq!((rig.machine.peek(0xFA00), drive.lease()), (Some(0xC000), None));
    let writes = bench::writes(&rig.machine);
    let withdrawn = drive.withdraw().await.unwrap();
    assert!(matches!(withdrawn, Withdrawn::Nothing(_)), "{withdrawn:?}");
    assert_eq!(bench::writes(&rig.machine), writes, "there was nothing to withdraw");
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_adopted_only_where_that_very_word_stands() {
    let (rig, drive) = running().await;
    let lease = drive.lease().unwrap();
    let mut other = rig.another();
    other.adopt(lease);
    let mut last = None;
    for _ in 0..4 {
        last = verdict(&mut other).await;
    }
    assert_eq!((last, other.lease()), (Some(Verdict::InForce), Some(lease)));
    other.adopt(Lease::new(Direction::Reverse, 0xC600));
    verdict(&mut other).await;
    assert_eq!(other.lease(), None);
}

#[tokio::test(start_paused = true)]
async fn a_freewheel_stop_leaves_a_shaft_that_coasts_and_a_ramp_one_at_rest() {
    let (rig, mut drive) = Rig::factory();
    drive.set_setpoint(Frequency::from_hertz(50).into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    rig.until(|seen| seen.output_frequency == 5_000).await;
    let stopped = drive.stop(StopMode::Freewheel).await.unwrap();
    assert_eq!((stopped.status.motion, stopped.status.is_standstill()), (Motion::Coasting, false));
    assert!(rig.machine.observe().shaft_frequency > 4_000);
    rig.at_speed(&mut drive).await;
    drive.status().await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    rig.until(|seen| !seen.running).await;
    assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest);
    assert_eq!(rig.machine.observe().shaft_frequency, 0);
}

/// A start that is refused because the panel runs the motor has seen that it does, in its own reading.
#[tokio::test(start_paused = true)]
async fn a_motor_that_a_refused_start_saw_running_and_that_has_tripped_by_the_next_status_may_coast() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    rig.at_rest(&mut drive).await;
    assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest);
    rig.machine.panel(Panel::TakeControl);
    rig.machine.panel(Panel::Reference(HALF_SPEED));
    rig.machine.panel(Panel::Run);
    rig.until(|seen| seen.shaft_frequency > 1_000).await;
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Panel));
    rig.machine.trip(14);
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
}

/// Exception 05h says that the drive works on it. Here it never takes the word, and its motor comes down for another reason.
#[tokio::test(start_paused = true)]
async fn a_stop_that_is_acknowledged_and_never_taken_is_repeated_and_not_confirmed() {
    let mut words = Words::new(&CAPABILITIES, &[&RUNNING[..], &[(0xFD00, 0)]].concat());
    words.refuses_writes = Some(5);
    let mut drive = Atv21::new(words, bench::address(1));
    drive.adopt(Lease::new(Direction::Forward, 0xC400));
    drive.stop(StopMode::Ramp).await.expect_err("FA00 holds the run command");
    assert!(drive.lease().is_some());
    let stops =
        drive.into_port().written().into_iter().filter(|(at, word)| *at == 0xFA00 && word & 0x0400 == 0);
    assert!(stops.count() > 1);
}

#[tokio::test(start_paused = true)]
async fn what_an_always_active_function_would_start_no_reset_release_or_parameter_does() {
    // F110 = 2 runs it forward as soon as the terminals command.
    let (rig, mut drive) = Rig::new(Model::new().restarting_in(std::time::Duration::ZERO));
    rig.at_speed(&mut drive).await;
    rig.at_rest(&mut drive).await;
    rig.machine.poke(0x0110, 2);
    let named = |result: Refusal| assert!(result.to_string().contains("F110"), "{result}");
    named(refusal(drive.release().await));
    rig.machine.trip(14);
    named(refusal(drive.reset_faults().await));
    tokio::time::sleep(5 * SECOND).await;
    assert!(!rig.machine.observe().running);
    rig.machine.poke(0x0003, 2);
    drive.reset_faults().await.unwrap();
    named(refusal(drive.write_parameter(Row::find(ROWS, "CMOD").unwrap(), 0).await));
    assert!(!rig.machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn f110_as_the_twin_is_delivered_keeps_st_on_and_runs_nothing() {
    let (rig, mut drive) = Rig::new(Model::new().restarting_in(std::time::Duration::ZERO));
    rig.machine.poke(0x0110, 1);
    rig.machine.trip(14);
    drive.reset_faults().await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn who_commands_is_not_changed_under_a_run_command_that_stands_and_does_not_act() {
    let (rig, mut drive) = running().await;
    terminal(&rig.machine, "ST", false);
    rig.until(|seen| seen.shaft_frequency == 0).await;
    for (code, word) in [("CMOD", 2), ("F112", 48), ("F109", 1)] {
        let refused = refusal(drive.write_parameter(Row::find(ROWS, code).unwrap(), word).await);
        assert_eq!(refused, Refusal::MotorRunning, "{code}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_priorities_are_set_only_where_the_settings_do_not_give_the_bus_command() {
    for (command, reference, run) in [(2, 4, 0x0400), (2, 1, 0x4400), (0, 4, 0x8400), (0, 1, 0xC400)] {
        let (rig, mut drive) = Rig::factory();
        rig.machine.poke(0x0003, command);
        rig.machine.poke(0x0004, reference);
        rig.at_speed(&mut drive).await;
        assert_eq!(rig.machine.peek(0xFA00), Some(run), "CMOD = {command}, FMOD = {reference}");
        rig.at_rest(&mut drive).await;
        assert_eq!(rig.machine.peek(0xFA00), Some(run & 0xC000));
    }
}

#[tokio::test(start_paused = true)]
async fn a_register_that_the_drive_lacks_takes_no_other_along() {
    let words = |missing: &[u16], more: &[(u16, u16)]| {
        let mut words = Words::new(&CAPABILITIES, &[&RUNNING[..], more].concat());
        words.refused.extend(missing.iter().map(|register| (*register, 2)));
        Atv21::new(words, bench::address(1))
    };
    // FE03, FE76, FE18, FE90, FD07.
    for missing in [0xFE03, 0xFE76, 0xFE18, 0xFE90, 0xFD07] {
        let mut drive = words(&[missing], &[]);
        let status = drive.status().await.unwrap();
        assert_eq!((status.state, status.current_share.is_none()), (State::Running, missing == 0xFE03));
        let measured = drive.measurements().await.unwrap();
        assert!(measured.raw.iter().all(|word| word.address != missing));
        assert_eq!(measured.output_energy, Some(0));
        let before = drive.status().await.unwrap();
        assert_eq!(before.state, State::Running);
    }
    // CMOD, F110, F111, F118: of a tripped drive with no input on.
    for missing in [0x0003, 0x0110, 0x0111, 0x0118] {
        let error = words(&[missing], &[(0xFD01, 0x0003)]).reset_faults().await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{missing:04X}h, it was sent: {error}");
    }
    // FD06: only where the inputs command nothing.
    let error = words(&[0xFD06], &[(0xFD01, 0x0003), (0x0003, 2)]).reset_faults().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    let refused = refusal(words(&[0xFD06], &[(0xFD01, 0x0003), (0x0111, 2)]).reset_faults().await);
    assert!(refused.to_string().contains("FD06"), "{refused}");
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_refuses_every_write_has_answered() {
    fn answered<T>(result: Result<T>) {
        let error = result.err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
    }
    answered(refusing(2).set_setpoint(HALF_SPEED.into()).await);
    answered(refusing(2).arm_watchdog(2 * SECOND, Reaction::Ramp).await);
    answered(refusing(2).stop(StopMode::Ramp).await);
    let mut drive = refusing(2);
    answered(drive.start(Direction::Forward).await);
    assert_eq!(drive.lease(), None, "nothing was taken");
}

#[tokio::test(start_paused = true)]
async fn what_43_14_names_is_what_the_drive_is_and_the_codes_tell_where_it_names_nothing() {
    let (_rig, mut drive) = Rig::factory();
    let identity = drive.identify().await.unwrap();
    assert_eq!(drive.recognise(&identity), Recognised::Mine);
    let named = |model: &str| {
        let mut identity = identity.clone();
        identity.model = Some(model.to_owned());
        drive.recognise(&identity)
    };
    assert_eq!(named("ATV21HD11N4"), Recognised::Mine);
    for (model, family) in [
        ("ATV312HU15N4", "atv312"),
        ("ATV212HU15N4", "Altivar 212"),
        ("ATV71HU15N4", "Altivar 71"),
        ("X", "43/14"),
    ] {
        let Recognised::NotMine { it_is } = named(model) else { panic!("{model}") };
        assert!(it_is.contains(family), "{it_is}");
    }
    let mut unnamed = identity.clone();
    unnamed.model = None;
    assert_eq!(drive.recognise(&unnamed), Recognised::Mine, "FB05 and FB72");
    unnamed.codes.clear();
    assert_eq!(drive.recognise(&unnamed), Recognised::CannotTell);
    let codes: BTreeSet<u16> = identity.codes.iter().map(|word| word.address).collect();
    assert_eq!(codes, BTreeSet::from([0xFB05, 0xFB72]));
}

#[tokio::test(start_paused = true)]
async fn a_stranger_is_asked_once_what_it_is_read_stopped_and_not_written_to() {
    let (rig, mut drive) = Rig::new(Model::new().identified_as("ATV71HU15N4"));
    fn another<T: std::fmt::Debug>(result: Result<T>) {
        let Err(Error::Refused { reason: Refusal::AnotherDrive(it_is), .. }) = result else {
            panic!("{result:?}")
        };
        assert!(it_is.contains("Altivar 71"), "{it_is}");
    }
    another(drive.start(Direction::Forward).await);
    another(drive.set_setpoint(HALF_SPEED.into()).await);
    another(drive.arm_watchdog(2 * SECOND, Reaction::Ramp).await);
    another(drive.write_parameter(Row::find(ROWS, "ACC").unwrap(), 100).await);
    rig.machine.trip(14);
    another(drive.reset_faults().await);
    assert_eq!((bench::writes(&rig.machine), rig.machine.requests(0x2B)), (0, 1));
    drive.status().await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(bench::writes(&rig.machine), 1, "a stop is written to any drive");
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_ours_that_shows_late_is_nobody_elses_word() {
    let (rig, mut drive) = running().await;
    rig.machine.mute();
    assert!(drive.stop(StopMode::Ramp).await.is_err());
    assert!(drive.lease().is_some(), "nobody has seen it");
    rig.machine.unmute();
    // The drive has taken it all the same.
    rig.machine.poke(0xFA00, 0xC000);
    drive.forget();
    let status = loop {
        if let Ok(status) = drive.status().await {
            break status;
        }
        tokio::time::sleep(SECOND / 10).await;
    };
    assert_eq!((lacks(status.verdict), drive.lease()), (None, None));
}

#[tokio::test(start_paused = true)]
async fn a_start_after_a_power_cut_or_a_reset_names_the_setpoint_of_zero_that_it_uses() {
    // §8.2 p. 28: FA00 and FA01 go back to 0 when the supply is cut, and at the reset of a trip.
    for by_reset in [false, true] {
        let (rig, mut drive) = Rig::new(Model::new().restarting_in(std::time::Duration::ZERO));
        rig.at_speed(&mut drive).await;
        if by_reset {
            rig.machine.trip(14);
            drive.reset_faults().await.unwrap();
        } else {
            rig.power_cycle().await;
            drive.forget();
        }
        assert_eq!((rig.machine.peek(0xFA01), rig.machine.observe().running), (Some(0), false));
        drive.status().await.unwrap();
        let status = drive.start(Direction::Forward).await.unwrap();
        assert_eq!(status.reference, Some(Frequency::ZERO), "by a reset: {by_reset}");
    }
}

#[tokio::test(start_paused = true)]
async fn direct_current_is_held_for_the_time_of_its_owner_or_the_printed_one_and_then_the_motor_stands() {
    for (owner, held) in [(None, 5), (Some(2), 2), (Some(600), 30)] {
        let (rig, mut drive) = running().await;
        drive.set_injection_time(owner.map(|seconds| seconds * SECOND));
        let stopped = drive.stop(StopMode::DcInjection).await.unwrap();
        assert_eq!((stopped.mode, stopped.injects_for), (StopMode::DcInjection, Some(held * SECOND)));
        let begun = tokio::time::Instant::now();
        while drive.status().await.unwrap().motion != Motion::Held {
            assert!(begun.elapsed() < (held + 1) * SECOND, "{held} s");
            tokio::time::sleep(SECOND / 10).await;
        }
        assert!(begun.elapsed() + SECOND / 5 >= held * SECOND, "{:?} of {held} s", begun.elapsed());
        assert_eq!(rig.machine.observe().shaft_frequency, 0);
        assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().injects_for, None);
        assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest);
    }
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_that_is_changed_under_a_contract_is_told_within_120_statuses() {
    let (rig, mut drive) = Rig::factory();
    drive.arm_watchdog(5 * SECOND, Reaction::Ramp).await.unwrap();
    rig.at_speed(&mut drive).await;
    for _ in 0..120 {
        drive.status().await.unwrap();
    }
    assert_eq!(drive.take_changed(), None);
    rig.machine.poke(0x0803, 0);
    for _ in 0..120 {
        drive.status().await.unwrap();
    }
    assert_eq!(drive.take_changed(), Some(Ground::Watchdog));
    assert_eq!(drive.take_changed(), None, "once");
    // UL is lowered: what is above it is refused from then on.
    rig.machine.poke(0x0012, 3_000);
    for _ in 0..120 {
        drive.status().await.unwrap();
    }
    assert_eq!(drive.take_changed(), Some(Ground::Limits));
    assert!(drive.set_setpoint(Frequency::from_hertz(45).into()).await.is_err());
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_that_is_refused_at_rest_is_not_waited_for() {
    let refused = refusal(refusing(4).arm_watchdog(2 * SECOND, Reaction::Ramp).await);
    assert!(refused.to_string().contains("though the motor stands"), "{refused}");
}
