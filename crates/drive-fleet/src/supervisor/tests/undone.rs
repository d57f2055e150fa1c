//! Stops that somebody undoes: behind each of them the motor runs again.

use super::*;

/// The time of a stop until its alarm, and until standstill.
const ALARM: Duration = Duration::from_secs(2);
const STANDSTILL: Duration = Duration::from_secs(5);

/// A motor at 40 Hz that comes down along its ramp when it is stopped.
fn running() -> Rig {
    let mut rig = Rig::ready();
    (rig.machine.settings.times.stop_alarm, rig.machine.settings.times.standstill) = (ALARM, STANDSTILL);
    rig.drive.ramps = true;
    rig.drive.reference = Some(Frequency::from_hertz(40).into());
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.outputs.clear();
    rig.drive.log.clear();
    rig
}

/// A second master writes its run word at this period, for this time. The motor begins again at the output which that leaves.
fn fight(rig: &mut Rig, period: Duration, time: Duration, output: impl Fn(u32) -> u32) {
    let until = rig.now + time;
    for round in 0.. {
        if rig.now >= until {
            return;
        }
        rig.pass(period.min(until - rig.now));
        rig.drive.run();
        rig.drive.status.output_frequency = Some(Frequency::from_centihertz(output(round)));
    }
}

fn is_in_force(rig: &Rig, id: CallId) -> bool {
    rig.outputs.iter().any(|output| matches!(output, Output::InForce(of, _) if *of == id))
}

fn alarms(rig: &Rig) -> usize {
    rig.events().iter().filter(|name| **name == "stop unconfirmed").count()
}

/// Why it is not confirmed, as the alarm says it.
fn reason(rig: &Rig) -> Option<Refusal> {
    rig.happened().find_map(|happened| match &happened.kind {
        EventKind::StopUnconfirmed {
            outcome: Outcome::NotConfirmed(Unconfirmed::TimeOver { because, .. }),
            ..
        } => *because,
        _ => None,
    })
}

#[test]
fn a_stop_that_a_second_master_keeps_undoing_is_an_alarm_in_its_time_and_ends_at_its_limit() {
    for period in [300, 410, 700] {
        let mut rig = running();
        let id = rig.stop(StopMode::Ramp);
        fight(&mut rig, period * MS, ALARM - 100 * MS, |_| 4_000);
        assert_eq!(alarms(&rig), 0, "{period}: it has its time");
        assert!(is_in_force(&rig, id), "{period}: it was seen without a run command");
        fight(&mut rig, period * MS, 1_500 * MS, |_| 4_000);
        assert_eq!(alarms(&rig), 1, "{period}: {:?}", rig.events());
        fight(&mut rig, period * MS, STANDSTILL - ALARM - 1_500 * MS, |_| 4_000);
        assert_eq!(rig.outcome(id), None, "{period}: its limit is not over");
        fight(&mut rig, period * MS, 200 * MS, |_| 4_000);
        assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{period}: {:?}", rig.outcome(id));

        // The alarm stands, whether the drive shows that it has taken it or not, and the stop is written all the while.
        let written = rig.drive.writes().len();
        for _ in 0..60 {
            fight(&mut rig, period * MS, 1_000 * MS, |_| 4_000);
            assert!(rig.snapshot().stop.is_some_and(|stop| stop.alarm), "{period}");
        }
        let written = rig.drive.writes().len() - written;
        assert!((30..1_000).contains(&written), "{period}: {written}");
        assert_eq!(alarms(&rig), 1, "{period}: it is told once");
        rig.pass(3_000 * MS);
        assert!(rig.snapshot().stop.is_some_and(|stop| stop.taken && stop.alarm), "{period}: it turns still");
        rig.drive.stand();
        rig.pass(1_000 * MS);
        assert!(rig.snapshot().stop.is_none() && rig.events().contains(&"stop confirmed"), "{period}");
    }
}

#[test]
fn a_motor_that_sinks_while_its_stop_is_undone_has_no_more_time_than_any_other() {
    let mut rig = running();
    let id = rig.stop(StopMode::Ramp);
    fight(&mut rig, 700 * MS, STANDSTILL + 500 * MS, |round| 4_000 - 20 * round);
    assert_eq!(alarms(&rig), 1, "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{:?}", rig.outcome(id));
}

#[test]
fn a_stop_that_is_undone_once_and_taken_again_in_its_time_is_no_alarm() {
    let mut rig = running();
    let id = rig.stop(StopMode::Ramp);
    rig.pass(300 * MS);
    rig.drive.run();
    rig.pass(4_000 * MS);
    rig.drive.stand();
    rig.pass(900 * MS);
    assert_eq!(alarms(&rig), 0, "{:?}", rig.events());
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp); 2]);
}

/// Behind a line that was lost on its ramp some drives show no more than a motor that is driven, because what tells a stop from a run is
/// read anew.
#[test]
fn a_stop_behind_which_its_line_was_lost_is_given_anew_where_that_does_not_show_and_undone_by_nobody() {
    for shows in [true, false] {
        let mut rig = running();
        let id = rig.stop(StopMode::Ramp);
        rig.pass(3_000 * MS);
        let before = rig.snapshot().stop.unwrap();
        assert!(before.taken);
        if rig.machine.handle_line_lost(rig.now) {
            rig.machine.handle_dropped(rig.now);
        }
        if !shows {
            rig.drive.run();
        }
        while !rig.snapshot().stop.unwrap().taken {
            assert_eq!(rig.snapshot().stop.unwrap().undone_since(&before), 0, "{shows}");
            rig.pass(10 * MS);
        }
        rig.drive.stand();
        rig.pass(1_000 * MS);
        assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed), "{shows}: {:?}", rig.outcome(id));
        let stops = rig.drive.writes();
        assert_eq!(stops.len(), if shows { 1 } else { 2 }, "{shows}: {stops:?}");
        assert_eq!((alarms(&rig), reason(&rig)), (0, None), "{shows}: {:?}", rig.events());
    }
}

/// It had come down to 30 Hz, and turns at 40 again: somebody else's run command has come meanwhile.
#[test]
fn a_motor_that_has_risen_while_its_line_was_lost_amid_its_stop_was_run_by_somebody_else() {
    let mut rig = running();
    rig.stop(StopMode::Ramp);
    for hertz in (30..40).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(200 * MS);
    }
    let before = rig.snapshot().stop.unwrap();
    assert!(before.taken);
    if rig.machine.handle_line_lost(rig.now) {
        rig.machine.handle_dropped(rig.now);
    }
    rig.drive.run();
    while !rig.snapshot().stop.unwrap().taken {
        rig.pass(10 * MS);
    }
    assert_eq!(rig.snapshot().stop.unwrap().undone_since(&before), 1);
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp); 2]);
}

#[test]
fn a_stop_that_is_undone_late_on_its_ramp_is_an_alarm_and_over_as_soon_as_that_is_seen() {
    let mut rig = running();
    let id = rig.stop(StopMode::Ramp);
    for hertz in (30..40).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(3_000 * MS);
    }
    assert!(alarms(&rig) == 0 && rig.outcome(id).is_none(), "it comes down: {:?}", rig.events());
    rig.drive.run();
    rig.pass(1_000 * MS);
    assert_eq!(alarms(&rig), 1, "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{:?}", rig.outcome(id));
}

#[test]
fn the_alarm_of_a_stop_that_is_undone_says_who_runs_the_motor() {
    for (control, verdict) in [
        (Control::Bus, None),
        (Control::Bus, Some(Verdict::InForce)),
        (Control::Terminals, None),
        (Control::Panel, None),
    ] {
        let mut rig = running();
        rig.stop(StopMode::Ramp);
        rig.pass(500 * MS);
        rig.drive.obeys = false;
        rig.drive.run();
        rig.drive.status.control = Some(control);
        rig.drive.lease = verdict.map(|_| Lease::new(Direction::Forward, 0x000F));
        rig.pass(4_000 * MS);
        let said = reason(&rig).expect("it says why").to_string();
        let who = match (control, verdict) {
            (Control::Terminals, _) => "the terminals command the drive",
            (Control::Panel, _) => "the panel commands the drive",
            (_, Some(_)) => "the run command of this program",
            _ => "a run command that this program has not given",
        };
        assert!(said.starts_with(who), "{control}: {said}");
    }
}

#[test]
fn an_exit_that_is_undone_says_in_its_time_that_its_stop_is_not_confirmed() {
    let mut rig = running();
    rig.drive.stand();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.machine.handle_dropped(rig.now);
    fight(&mut rig, 300 * MS, STANDSTILL + 500 * MS, |_| 4_000);
    let action = rig.machine.exit_action();
    assert!(
        matches!(action, Some(ExitAction::Stopped(Outcome::NotConfirmed(_)))),
        "{action:?}, {:?}",
        rig.events()
    );
    assert_eq!(alarms(&rig), 1);
}
