//! Drivers that call done what the status that they give for it denies: the first mistake in a family of somebody's own.

use super::*;

fn is_in_force(rig: &Rig, id: CallId) -> bool {
    rig.outputs.iter().any(|output| matches!(output, Output::InForce(of, _) if *of == id))
}

#[test]
fn a_stop_that_its_driver_calls_done_while_the_motor_is_driven_is_not_taken_and_is_an_alarm() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.outputs.clear();
    rig.drive.log.clear();
    rig.drive.obeys = false;
    rig.drive.lease = Some(Lease::new(Direction::Forward, 0x000F));
    let id = rig.stop(StopMode::Ramp);
    rig.pass(1_900 * MS);
    assert!(rig.outcome(id).is_none() && !rig.events().contains(&"stop unconfirmed"), "it has its time");
    rig.pass(8_000 * MS);
    assert_eq!(rig.events().iter().filter(|name| **name == "stop unconfirmed").count(), 1);
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{:?}", rig.outcome(id));
    assert!(!is_in_force(&rig, id), "each status says that it is driven");
    let said = rig.outcome(id).map(ToString::to_string).unwrap_or_default();
    assert!(said.contains("the run command of this program, which stands in the drive"), "{said}");
    let stop = rig.snapshot().stop.expect("it goes on");
    assert!(!stop.taken && stop.alarm, "{stop:?}");
    // It is repeated 50 ms to 1 s apart, and does not take the line from the others.
    let written = rig.drive.writes().len();
    assert!((10..20).contains(&written), "{written}");
}

#[test]
fn a_start_that_its_driver_calls_done_while_the_drive_shows_no_run_command_is_not_confirmed_and_is_taken_back()
 {
    for order in [START, run_at(30)] {
        let mut rig = Rig::ready();
        rig.drive.obeys = false;
        let id = rig.order(order);
        rig.pass(1_000 * MS);
        assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{:?}", rig.outcome(id));
        assert!(!is_in_force(&rig, id));
        assert_eq!(rig.drive.writes().last(), Some(&Job::Stop(StopMode::Ramp)), "it may stand in the drive");
    }
}

#[test]
fn a_start_that_its_driver_calls_done_while_it_says_what_keeps_it_from_acting_is_not_confirmed() {
    let mut rig = Rig::ready();
    rig.drive.says = Some(Verdict::lacks(Lack::Command, ANOTHER_WORD));
    let id = rig.order(START);
    rig.pass(1_000 * MS);
    let said = rig.outcome(id).map(ToString::to_string).unwrap_or_default();
    assert!(said.contains(&ANOTHER_WORD.to_string()) && said.starts_with("not confirmed"), "{said}");
}

/// A reference of zero: the run command acts, and nothing turns.
#[test]
fn a_start_that_is_in_force_in_a_drive_without_an_output_is_confirmed() {
    let mut rig = Rig::ready();
    rig.drive.obeys = false;
    rig.drive.lease = Some(Lease::new(Direction::Forward, 0x000F));
    rig.drive.says = Some(Verdict::InForce);
    let id = rig.order(START);
    rig.pass(1_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(id));
}
