//! Our run command from the moment it is written until the drive shows that it stands no more.

mod rig;

use drive_3g3ev::ROWS;
use drive_core::{
    Direction, Drive, Error, ErrorKind, Frequency, Ground, Lack, Lease, Motion, Refusal, Result, Row,
    Setpoint, State, StopMode, Verdict, Withdrawn,
};
use drive_sim::{ALWAYS, Fault, Faults, Panel, SimSlave};
use drive_testing::{
    bench,
    words::{Asked, Words},
};
use rig::{Judged, Rig, one, ready, running, with};
use tokio::time::{Duration, sleep};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));
const TENTH: Duration = Duration::from_millis(100);

fn lacks(verdict: Option<Verdict>) -> Option<(Lack, String)> {
    match verdict {
        Some(Verdict::NotInForce { lacks, because }) => Some((lacks, because.to_string())),
        _ => None,
    }
}

/// Asks until a status says that the run command is not in force, so many times at the most.
async fn lost(drive: &mut Judged, statuses: usize) -> (Lack, String) {
    for _ in 0..statuses {
        if let Some(told) = lacks(drive.status().await.unwrap().verdict) {
            return told;
        }
        sleep(TENTH).await;
    }
    panic!("nothing was said in {statuses} statuses");
}

async fn until(drive: &mut Judged, machine: &SimSlave, frequency: i32) {
    while machine.observe().output_frequency != frequency {
        drive.status().await.unwrap();
        sleep(TENTH).await;
    }
}

/// A motor that runs at 50 Hz by our run command.
async fn started() -> (Judged, SimSlave, Rig) {
    let (mut drive, machine, rig) = one();
    drive.set_setpoint(FIFTY).await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!((status.verdict, status.reference), (Some(Verdict::InForce), Some(Frequency::from_hertz(50))));
    until(&mut drive, &machine, 5_000).await;
    assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
    (drive, machine, rig)
}

/// Nothing moves for a while, with the drive asked all the while.
async fn stays_still(drive: &mut Judged, machine: &SimSlave) {
    for _ in 0..50 {
        drive.status().await.unwrap();
        sleep(TENTH).await;
        assert!(!machine.observe().running);
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_ours_from_before_it_is_written_until_a_stop_is_seen() {
    let (mut drive, machine, _rig) = started().await;
    assert_eq!(drive.lease(), Some(Lease::new(Direction::Forward, 1)));
    drive.forget();
    assert!(drive.lease().is_some(), "a reconnect does not end it");
    let stopped = drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!((drive.lease(), stopped.status.verdict), (None, None));
    until(&mut drive, &machine, 0).await;
    let status = drive.status().await.unwrap();
    assert_eq!((status.motion, status.is_standstill(), status.verdict), (Motion::AtRest, true, None));
}

/// Exception 05h says that the drive works on it. Here it never takes the word, and its motor comes down for another reason: 002Ch of a
/// drive that the bus commands, 0020h that runs (p. 42), no output.
#[tokio::test(start_paused = true)]
async fn a_stop_that_is_acknowledged_and_never_taken_is_repeated_and_not_confirmed() {
    let mut words = with(&[(0x0001, 1), (0x0020, 0x0085), (0x002C, 0x0061)]);
    words.refuses_writes = Some(5);
    let mut drive = rig::drive(words);
    drive.adopt(Lease::new(Direction::Forward, 1));
    drive.stop(StopMode::Ramp).await.expect_err("0001h holds the run command");
    assert!(drive.lease().is_some());
    let stops = drive.into_port().written().into_iter().filter(|(at, word)| *at == 1 && word & 1 == 0);
    assert!(stops.count() > 1);
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_is_first_seen_at_a_reconnect_is_withdrawn_and_reset_at_the_panel_starts_nothing() {
    // n40 = 0: the watchdog trips it; after a reset a run command acts that was never 0.
    let (mut drive, machine, _rig) = started().await;
    machine.reading("after-reset", "runs").unwrap();
    machine.mute();
    sleep(Duration::from_secs(5)).await;
    machine.unmute();
    drive.forget();
    let status = loop {
        if let Ok(status) = drive.status().await {
            break status;
        }
        sleep(TENTH).await;
    };
    assert_eq!(status.state, State::Fault);
    let withdrawn = drive.withdraw().await.unwrap();
    assert!(matches!(withdrawn, Withdrawn::Ended(_)), "{withdrawn:?}");
    assert_eq!((machine.peek(1), drive.lease()), (Some(0), None));
    machine.panel(Panel::Reset);
    stays_still(&mut drive, &machine).await;
    let writes = bench::writes(&machine);
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Nothing(_)));
    assert_eq!(bench::writes(&machine), writes, "there was nothing to withdraw");
}

#[tokio::test(start_paused = true)]
async fn a_panel_that_takes_control_is_told_with_the_next_status() {
    let (mut drive, machine, _rig) = started().await;
    machine.panel(Panel::TakeControl);
    let (lack, because) = lost(&mut drive, 1).await;
    assert_eq!(lack, Lack::Command);
    assert!(because.contains("bit A of 002Ch"), "{because}");
    machine.reading("remote-again", "runs").unwrap();
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Ended(_)));
    while machine.observe().running {
        drive.status().await.unwrap();
        sleep(TENTH).await;
    }
    machine.panel(Panel::ReleaseControl);
    stays_still(&mut drive, &machine).await;
}

/// RUN of 0020h and 002Ch may stand for as long as the motor turns, and no word names a STOP at the panel (§5.2).
#[tokio::test(start_paused = true)]
async fn a_motor_that_a_stop_at_the_panel_brings_down_is_not_told_in_force() {
    let (mut drive, machine, _rig) = started().await;
    machine.panel(Panel::Stop);
    let mut looks = 0;
    while machine.observe().running {
        let verdict = drive.status().await.unwrap().verdict;
        assert!(verdict.is_some_and(|verdict| !verdict.is_in_force()), "{verdict:?}");
        sleep(TENTH).await;
        looks += 1;
    }
    assert!(looks > 3);
    assert_eq!(lost(&mut drive, 1).await.0, Lack::Output);
}

#[tokio::test(start_paused = true)]
async fn an_output_that_an_input_cuts_is_told_while_it_lasts_and_the_motor_coasts() {
    let (mut drive, machine, _rig) = started().await;
    machine.reading("n06", "base-block").unwrap();
    machine.terminal("S1", true).unwrap();
    let status = drive.status().await.unwrap();
    let (lack, because) = lacks(status.verdict).unwrap();
    assert_eq!((lack, status.motion), (Lack::Output, Motion::Coasting));
    assert!(because.contains("bit 8 of 002Ch"), "{because}");
    assert!(machine.observe().shaft_frequency > 0 && status.state != State::Running);
    assert!(drive.lease().is_some(), "it starts again by itself when the input opens");
    drive.withdraw().await.unwrap();
    machine.terminal("S1", false).unwrap();
    stays_still(&mut drive, &machine).await;
}

#[tokio::test(start_paused = true)]
async fn another_speed_that_an_input_chooses_is_told_with_the_next_status() {
    let (mut drive, machine, _rig) = started().await;
    machine.reading("n06", "preset-speed").unwrap();
    machine.terminal("S1", true).unwrap();
    let (lack, because) = lost(&mut drive, 1).await;
    assert_eq!(lack, Lack::Reference);
    assert!(because.contains("0023h"), "{because}");
}

#[tokio::test(start_paused = true)]
async fn another_masters_words_are_told() {
    // Its reference shows in 0023h at once.
    let (mut drive, machine, _rig) = started().await;
    machine.written_by_another(2, 300).unwrap();
    assert_eq!(lost(&mut drive, 1).await.0, Lack::Reference);
    for _ in 0..40 {
        assert!(lacks(drive.status().await.unwrap().verdict).is_some(), "it is not taken for ours later");
    }
    drive.set_setpoint(FIFTY).await.unwrap();
    assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
    // Its word runs the motor the same way, and shows in nothing but 0001h.
    machine.written_by_another(1, 0x0021).unwrap();
    assert_eq!(lost(&mut drive, 20).await.0, Lack::Command);
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Nothing(_)));
    assert_eq!((machine.peek(1), drive.lease()), (Some(0x21), None), "his word is left");
}

#[tokio::test(start_paused = true)]
async fn a_start_under_each_of_these_worlds_ends_as_not_confirmed_with_its_reason() {
    for (reading, terminal, named) in
        [("local", "S1", "bit A"), ("preset-speed", "S1", "0023h"), ("base-block", "S1", "bit 8")]
    {
        let (mut drive, machine, _rig) = one();
        drive.set_setpoint(FIFTY).await.unwrap();
        machine.reading("n06", reading).unwrap();
        let comes = async {
            machine.wait_until(|seen| seen.running).await;
            machine.terminal(terminal, true).unwrap();
        };
        let (started, ()) = tokio::join!(drive.start(Direction::Forward), comes);
        let Err(Error::NotConfirmed { because: Some(because), status, .. }) = started else {
            panic!("{reading}: {started:?}")
        };
        assert!(because.to_string().contains(named), "{because}");
        assert!(lacks(status.verdict).is_some(), "{:?}", status.verdict);
        assert!(drive.lease().is_some(), "it stands, and is taken back by a stop");
        drive.stop(StopMode::Ramp).await.ok();
        assert_eq!(drive.lease(), None);
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_adopted_only_where_that_very_word_stands() {
    let (drive, _machine, rig) = started().await;
    let lease = drive.lease().unwrap();
    let mut other = rig.drive(1);
    other.adopt(lease);
    let mut last = None;
    for _ in 0..3 {
        last = other.status().await.unwrap().verdict;
    }
    assert_eq!((last, other.lease()), (Some(Verdict::InForce), Some(lease)));
    other.adopt(Lease::new(Direction::Reverse, 3));
    other.status().await.unwrap();
    assert_eq!(other.lease(), None);
}

#[tokio::test(start_paused = true)]
async fn what_proves_a_run_command_costs_a_twentieth_and_one_exchange_of_a_status_at_most() {
    let (mut drive, machine, _rig) = started().await;
    let begun = machine.all_requests();
    for _ in 0..100 {
        let before = machine.all_requests();
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
        assert!(machine.all_requests() - before <= 3);
    }
    assert_eq!(machine.all_requests() - begun, 210, "of 100 statuses");
}

#[tokio::test(start_paused = true)]
async fn a_setting_that_a_contract_rests_on_is_told_within_eighty_statuses() {
    let (mut drive, machine, _rig) = started().await;
    drive.watchdog().await.unwrap();
    for (register, word, ground) in
        [(0x0128, 1, Ground::Watchdog), (0x0102, 0, Ground::Inputs), (0x0127, 1, Ground::Units)]
    {
        for _ in 0..80 {
            drive.status().await.unwrap();
        }
        assert_eq!(drive.take_changed(), None);
        machine.poke(register, word);
        for _ in 0..80 {
            drive.status().await.unwrap();
        }
        assert_eq!((drive.take_changed(), drive.take_changed()), (Some(ground), None));
    }
    // Nobody knows what counts until it was switched off.
    let refused = drive.set_setpoint(FIFTY).await.unwrap_err();
    assert!(refused.to_string().contains("n39"), "{refused}");
}

#[tokio::test(start_paused = true)]
async fn an_output_that_goes_while_it_comes_down_was_cut() {
    let (mut drive, machine, _rig) = started().await;
    machine.reading("n06", "base-block").unwrap();
    machine.poke(0x0114, 200);
    drive.stop(StopMode::Ramp).await.unwrap();
    for _ in 0..3 {
        sleep(TENTH).await;
        assert_eq!(drive.status().await.unwrap().motion, Motion::Braking);
    }
    machine.terminal("S1", true).unwrap();
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
    assert!(machine.observe().shaft_frequency > 0);
}

#[tokio::test(start_paused = true)]
async fn nothing_that_may_start_it_is_changed_or_saved_under_a_run_command() {
    fn refused<T: std::fmt::Debug>(result: Result<T>) {
        let Err(Error::Refused { reason: Refusal::MotorRunning, .. }) = result else { panic!("{result:?}") };
    }
    // It stands in 0001h and does not act: an input cuts the output.
    let mut words = running();
    words.words.extend([(0x20, 0x04), (0x2C, 0x0142), (0x24, 0)]);
    let mut drive = rig::drive(words);
    for code in ["n02", "n06", "n07", "n08"] {
        refused(drive.write_parameter(Row::find(ROWS, code).unwrap(), 1).await);
    }
    assert_eq!(drive.into_port().written(), []);
    let mut drive = rig::drive(running());
    drive.assume_changed();
    refused(drive.persist().await);
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn no_function_of_an_input_is_changed_while_one_is_on() {
    // By the terminal strip, and by bits 4 to 6 of 0001h: S1 is on, and n06 is what it does.
    for on in [(0x2B, 0x04), (0x01, 0x10)] {
        let mut words = ready();
        words.words.extend([on]);
        let mut drive = rig::drive(words);
        for code in ["n06", "n07", "n08", "n02"] {
            let refused = drive.write_parameter(Row::find(ROWS, code).unwrap(), 1).await.unwrap_err();
            assert!(refused.to_string().contains("an input that is on"), "{code}: {refused}");
        }
        assert_eq!(drive.into_port().written(), []);
    }
    let mut drive = rig::drive(ready());
    assert!(drive.write_parameter(Row::find(ROWS, "n06").unwrap(), 1).await.unwrap().changed);
}

#[tokio::test(start_paused = true)]
async fn nothing_is_saved_while_the_motor_comes_down_or_under_a_run_command_that_does_not_act() {
    // How long the drive takes no stop while it writes its EEPROM, its manual does not say.
    for more in [&[(0x24, 80), (0x2C, 0x0042)][..], &[(0x01, 1)]] {
        let mut words = ready();
        words.words.extend(more.iter().copied());
        let mut drive = rig::drive(words);
        drive.assume_changed();
        let refused = drive.persist().await.unwrap_err();
        assert!(matches!(refused, Error::Refused { reason: Refusal::MotorRunning, .. }), "{refused}");
        assert_eq!(drive.into_port().written(), []);
    }
}

#[tokio::test(start_paused = true)]
async fn a_register_that_the_drive_lacks_takes_no_other_along() {
    for missing in [0x21, 0x22, 0x23, 0x24, 0x27, 0x28, 0x2B, 0x2D, 0x31, 0x3D, 0x0127] {
        let mut words = running();
        words.words.extend([(0x23, 500), (0x27, 42), (0x31, 325)]);
        words.refused.insert(missing, 2);
        let mut drive = rig::drive(words);
        for _ in 0..2 {
            let status = drive.status().await.unwrap();
            assert_eq!(status.state, State::Running, "{missing:04X}h");
            assert_eq!(status.current.is_none(), missing == 0x27);
            assert_eq!(status.output_frequency.is_none(), [0x24, 0x0127].contains(&missing));
            assert_eq!(status.reference.is_none(), [0x23, 0x0127].contains(&missing));
            let told = if missing == 0x24 { Motion::NotKnown } else { Motion::Driven };
            assert_eq!((status.motion, status.is_standstill()), (told, false));
        }
        let measured = drive.measurements().await.unwrap();
        assert_eq!(measured.output_voltage.is_none(), missing == 0x28);
        assert_eq!(measured.dc_bus_voltage.is_none(), missing == 0x31);
        assert_eq!(measured.inputs.is_none(), missing == 0x2B);
        // Whether there is a fault is not known without 0021h; that it answered is.
        assert_eq!(drive.faults().await.map_err(|error| error.kind()).err().is_some(), missing == 0x21);
        let asked = drive.into_port().asked;
        let asked = asked.iter().filter(|asked| matches!(asked, Asked::Read(_, at, 1) if *at == missing));
        assert!(asked.count() <= 2, "it is asked for again and again");
    }
    for missing in [0x20, 0x2C] {
        let mut words = running();
        words.refused.insert(missing, 2);
        let error = rig::drive(words).status().await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Exception, "it has answered: {error}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_ours_that_shows_late_is_nobody_elses_word() {
    let (mut drive, machine, _rig) = started().await;
    machine.mute();
    assert!(drive.stop(StopMode::Ramp).await.is_err());
    assert!(drive.lease().is_some(), "nobody has seen it");
    machine.unmute();
    // The drive has taken it all the same.
    machine.poke(1, 0);
    drive.forget();
    let status = loop {
        if let Ok(status) = drive.status().await {
            break status;
        }
        sleep(TENTH).await;
    };
    assert_eq!((lacks(status.verdict), drive.lease()), (None, None));
}

#[tokio::test(start_paused = true)]
async fn a_start_after_a_power_cut_names_the_setpoint_of_zero_that_it_uses() {
    let (mut drive, machine, _rig) = started().await;
    machine.power_cycle();
    drive.forget();
    drive.status().await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(status.reference, Some(Frequency::ZERO));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_refuses_every_write_has_answered() {
    fn answered<T>(result: Result<T>) {
        let error = result.err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
    }
    let refusing = |mut words: Words| {
        words.refuses_writes = Some(2);
        rig::drive(words)
    };
    answered(refusing(ready()).set_setpoint(FIFTY).await);
    let mut drive = refusing(ready());
    answered(drive.start(Direction::Forward).await);
    assert_eq!(drive.lease(), None, "nothing was taken");
    answered(refusing(running()).stop(StopMode::Ramp).await);
}

#[tokio::test(start_paused = true)]
async fn a_withdrawal_is_not_confirmed_while_the_drive_holds_the_run_command() {
    let lease = Lease::new(Direction::Forward, 1);
    let mut words = running();
    words.words.insert(1, 1);
    words.deaf = true;
    let mut drive = rig::drive(words);
    drive.adopt(lease);
    let error = drive.withdraw().await.unwrap_err();
    assert_eq!((error.kind(), drive.lease()), (ErrorKind::NotConfirmed, Some(lease)), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_in_hertz_under_a_unit_in_percent_says_what_to_write() {
    for unit in [2, 3] {
        let mut words = ready();
        words.words.insert(0x0127, unit);
        let error = rig::drive(words).set_setpoint(FIFTY).await.unwrap_err();
        assert!(error.to_string().contains("give it in percent, or write 0 to n39"), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_run_rests_on_outlives_a_lost_line_and_a_reference_that_came_meanwhile_is_anothers() {
    let (mut drive, machine, _rig) = started().await;
    drive.forget();
    for _ in 0..30 {
        assert_eq!(lacks(drive.status().await.unwrap().verdict), None, "nobody has written another");
    }
    drive.forget();
    machine.poke(2, machine.peek(2).unwrap() / 2);
    let (lack, because) = lost(&mut drive, 3).await;
    assert_eq!(lack, Lack::Reference);
    assert!(because.contains("0002h"), "{because}");
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_whose_answer_was_lost_is_no_reference_of_another_master() {
    let mut arrived = 0;
    for after in (0..150).step_by(5).map(Duration::from_millis) {
        let (mut drive, machine, rig) = started().await;
        let (before, loses) = (machine.peek(2), Faults::seeded(1).with(Fault::Lost, ALWAYS));
        let (given, ()) = tokio::join!(drive.set_setpoint(Frequency::from_hertz(20).into()), async {
            sleep(after).await;
            rig.sim.set_faults(loses);
        });
        rig.sim.set_faults(Faults::seeded(1));
        arrived += usize::from(given.is_err() && machine.peek(2) != before);
        let mut answered = 0;
        while answered < 30 {
            sleep(TENTH).await;
            let Ok(status) = drive.status().await else { continue };
            answered += 1;
            let told = lacks(status.verdict);
            assert!(!told.is_some_and(|(_, because)| because.contains("0002h")), "{after:?}: {given:?}");
        }
    }
    assert!(arrived > 0);
}
