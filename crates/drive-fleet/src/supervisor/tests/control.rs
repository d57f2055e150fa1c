//! Control that somebody else takes and gives back, and drives that start again by themselves.

use super::*;
use crate::Became;

/// A drive that runs by our command.
fn running(settings: DriveSettings) -> Rig {
    let mut rig = Rig::new(settings);
    rig.pass(1_500 * MS);
    rig.order(run_at(40));
    rig.pass(1_500 * MS);
    assert!(rig.snapshot().started_here());
    rig.outputs.clear();
    rig.drive.log.clear();
    rig
}

#[test]
fn the_run_command_is_withdrawn_when_somebody_else_takes_control() {
    let mut rig = running(settings());
    rig.drive.status.control = Some(Control::Terminals);
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw]);
    assert_eq!(rig.events(), ["control taken", "command"]);
    rig.drive.status.control = Some(Control::Bus);
    rig.drive.stand();
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw], "nothing is left to be done when he gives it back");
}

#[test]
fn the_run_command_is_withdrawn_after_a_trip_unless_the_drive_may_start_again_by_itself() {
    let accepting = DriveSettings { accept_self_restart: vec!["Atr".to_owned()], ..settings() };
    for (settings, writes) in [(settings(), &[Job::Withdraw][..]), (accepting, &[])] {
        let mut rig = running(settings);
        rig.drive.trip(9);
        rig.pass(2_000 * MS);
        assert_eq!(rig.drive.writes(), writes);
    }
}

#[test]
fn control_that_a_drive_tells_only_when_somebody_else_has_it_is_seen_to_be_taken_and_given_back() {
    let mut rig = running(settings());
    rig.drive.status.control = None;
    rig.pass(2_000 * MS);
    assert_eq!(rig.events(), [""; 0]);
    rig.drive.status.control = Some(Control::Local);
    rig.pass(2_000 * MS);
    assert_eq!(rig.events(), ["control taken", "command"]);
    rig.drive.status.control = None;
    rig.pass(2_000 * MS);
    assert_eq!(rig.events().last(), Some(&"control returned"));
}

#[test]
fn a_withdrawal_that_is_not_heard_is_repeated_and_becomes_an_alarm_in_its_time() {
    let mut rig = running(settings());
    rig.drive.status.control = Some(Control::Terminals);
    while rig.machine.withdrawal.is_none() {
        rig.pass(20 * MS);
    }
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(2_900 * MS);
    assert!(rig.drive.writes().iter().filter(|job| **job == Job::Withdraw).count() >= 3);
    assert!(rig.events().contains(&"run command stands"), "{:?}", rig.events());
    rig.drive.failing = None;
    rig.pass(2_000 * MS);
    assert!(rig.machine.withdrawal.is_none());
}

#[test]
fn a_family_that_cannot_withdraw_is_an_alarm_and_its_drive_is_stopped_when_control_is_back() {
    let mut rig = running(settings());
    rig.drive.withdraws = false;
    rig.drive.status.control = Some(Control::Terminals);
    rig.pass(3_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw], "what it does not have is asked for once");
    assert!(rig.events().contains(&"run command stands"));
    rig.drive.status.control = Some(Control::Bus);
    rig.pass(1_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw, Job::Stop(StopMode::Ramp)]);
}

#[test]
fn nothing_is_withdrawn_where_the_policy_says_so_or_the_drive_is_only_read_or_did_not_run() {
    let report = DriveSettings { on_control_taken: OnControlTaken::Report, ..settings() };
    let mut rig = running(report);
    rig.drive.status.control = Some(Control::Terminals);
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), []);

    let mut watched = Rig::new(DriveSettings::watched("pump"));
    watched.drive.run();
    watched.pass(1_500 * MS);
    watched.drive.status.control = Some(Control::Terminals);
    watched.pass(2_000 * MS);
    assert_eq!(watched.drive.writes(), []);

    let mut standing = Rig::ready();
    standing.drive.status.control = Some(Control::Terminals);
    standing.pass(2_000 * MS);
    assert_eq!(standing.drive.writes(), []);
}

#[test]
fn a_withdrawal_that_finds_no_run_command_is_told_as_such_and_not_as_confirmed() {
    for (word_stands, became) in [(true, Became::Confirmed), (false, Became::Nothing)] {
        let mut rig = running(settings());
        rig.drive.word_stands = word_stands;
        rig.drive.status.control = Some(Control::Terminals);
        rig.pass(2_000 * MS);
        let told = rig.happened().find_map(|happened| match &happened.kind {
            EventKind::Command { command: Command::Withdraw, outcome, .. } => Some(outcome.became()),
            _ => None,
        });
        assert_eq!(told, Some(became));
        assert_eq!(rig.snapshot().lease, None);
    }
}

/// What a status says of the run command from now on, whatever else it shows.
fn says(rig: &mut Rig, verdict: Verdict) {
    rig.drive.says = Some(verdict);
}

const GUARD: Refusal = Refusal::Overridden { by: "a guard", remedy: "close it" };

#[test]
fn a_run_command_whose_output_is_cut_or_whose_reference_is_taken_is_told_and_withdrawn() {
    for (lacks, name, policy) in [
        (Lack::Output, "output blocked", Policy::OutputBlocked),
        (Lack::Reference, "reference taken", Policy::ReferenceTaken),
        (Lack::Command, "command overridden", Policy::ControlTaken),
    ] {
        let mut rig = running(settings());
        says(&mut rig, Verdict::lacks(lacks, GUARD));
        rig.pass(2_000 * MS);
        assert_eq!(rig.drive.writes(), [Job::Withdraw]);
        assert_eq!(rig.events(), [name, "command"]);
        assert_eq!(
            rig.cause_of("command"),
            Some(Cause::Policy { policy }),
            "the withdrawal names what lacks"
        );
        assert_eq!(rig.snapshot().lease, None);
    }
}

#[test]
fn a_run_command_stands_through_a_cut_output_only_where_that_is_accepted_by_name() {
    let accepts = DriveSettings { accept_resume: vec![Lack::Output], ..settings() };
    let mut rig = running(accepts);
    says(&mut rig, Verdict::lacks(Lack::Output, GUARD));
    rig.drive.stand();
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), []);
    assert_eq!(rig.snapshot().suspended, Some(GUARD));
    assert!(rig.snapshot().started_here(), "it stands at standstill too");
    says(&mut rig, Verdict::lacks(Lack::Reference, GUARD));
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw], "of the reference nobody said so");
}

#[test]
fn a_trip_that_is_first_seen_at_the_return_of_a_drive_has_its_run_command_withdrawn() {
    let mut rig = running(settings());
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(10_000 * MS);
    rig.drive.failing = None;
    rig.drive.trip(9);
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Withdraw]);
    assert_eq!(rig.snapshot().lease, None);
}

#[test]
fn the_exit_stops_a_run_command_that_stands_though_the_motor_does_not_turn() {
    let accepts = DriveSettings { accept_resume: vec![Lack::Output], ..settings() };
    let mut rig = running(accepts);
    says(&mut rig, Verdict::lacks(Lack::Output, GUARD));
    rig.drive.stand();
    rig.pass(2_000 * MS);
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.pass(2_000 * MS);
    assert!(rig.drive.writes().contains(&Job::Stop(StopMode::Ramp)), "{:?}", rig.drive.writes());
}

#[test]
fn a_drive_that_starts_again_by_itself_is_told_at_each_connect_and_is_an_alarm_unless_it_is_accepted() {
    let restart = SelfRestart { code: "Atr", meaning: "starts again after a trip" };
    for accept_self_restart in [vec![], vec!["Atr".to_owned()]] {
        let accepted = !accept_self_restart.is_empty();
        let mut rig = Rig::new(DriveSettings { accept_self_restart, ..settings() });
        rig.drive.self_restarts = vec![restart];
        rig.pass(2_000 * MS);
        let told = EventKind::RestartsItself { by: [restart].into(), accepted };
        assert_eq!(told.is_alarm(), !accepted);
        assert_eq!(rig.times_told(&told), 1);
        assert_eq!(rig.snapshot().self_restarts.as_deref(), Some(&[restart][..]));
    }
}
