//! Connecting, losing, tripping, feeding.

use super::*;
use crate::{
    ConcernKind, Periods,
    snapshot::{Freshness, WatchdogCheck},
};

#[test]
fn a_connect_reads_the_state_then_the_identity_then_the_watchdog_and_only_then_arms_it() {
    let mut rig = Rig::controlled();
    rig.pass(200 * MS);
    let arm = Job::ArmWatchdog(CONTRACT.timeout, CONTRACT.reaction);
    assert_eq!(rig.drive.log[..4], [Job::Status { anew: true }, Job::Identify, Job::Watchdog, arm]);
    assert_eq!(rig.events(), ["connected", "identified", "watchdog verified"]);
}

#[test]
fn a_watchdog_that_may_be_armed_is_fed_before_anybody_has_read_it() {
    // The polls alone would be too seldom.
    let seldom = 10 * CONTRACT.timeout;
    let periods = Periods { running: seldom, rest: seldom, slow: Duration::ZERO, max_age: 3 * seldom };
    let mut rig = Rig::new(DriveSettings { periods, ..settings() });
    rig.others_have_the_turn = true;
    rig.pass(CONTRACT.timeout);
    assert_eq!(rig.snapshot().watchdog, WatchdogCheck::Unchecked);
    assert_eq!(rig.drive.log, [Job::Status { anew: true }, Job::KeepAlive]);
}

#[test]
fn a_running_drive_is_adopted_without_a_write() {
    let mut rig = Rig::controlled();
    rig.drive.run();
    rig.pass(60_000 * MS);
    assert_eq!(rig.drive.writes(), []);
    assert!(!rig.snapshot().started_here());
    assert!(matches!(rig.snapshot().watchdog, WatchdogCheck::WaitsForStandstill(_)));
}

#[test]
fn a_drive_may_go_from_any_state_to_any_other_by_itself() {
    const STATES: [State; 9] = [
        State::NotReady,
        State::Disabled,
        State::Ready,
        State::Running,
        State::Stopping,
        State::QuickStop,
        State::FaultReaction,
        State::Fault,
        State::Unknown,
    ];
    for from in STATES {
        for to in STATES {
            let mut rig = Rig::ready();
            for state in [from, to] {
                rig.drive.status.state = state;
                rig.pass(3_000 * MS);
                let snapshot = rig.snapshot();
                let status = snapshot.status.expect("it answers");
                assert_eq!((status.value.state, snapshot.link), (state, Link::Connected), "{from} to {to}");
            }
            assert_eq!(rig.drive.writes(), [], "{from} to {to}: what was not started here is left alone");
        }
    }
}

#[test]
fn a_drive_that_is_only_read_is_never_written() {
    let mut rig = Rig::new(DriveSettings { control: false, ..settings() });
    rig.drive.run();
    rig.pass(2_000 * MS);
    let start = rig.order(START);
    let stop = rig.stop(StopMode::Ramp);
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.pass(2_000 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::ReadOnly)));
    assert_eq!(rig.outcome(stop), Some(&Outcome::Refused(Refused::ReadOnly)));
    assert_eq!(rig.machine.exit_action(), Some(&ExitAction::Left));
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn another_drive_at_the_address_is_not_moved_until_it_is_accepted() {
    let mut rig = Rig::ready();
    rig.drive.failing = Some(PortError::Offline { retry_in: 500 * MS });
    rig.pass(2_000 * MS);
    rig.drive =
        Paper { identity: Identity { model: Some("two".to_owned()), ..Identity::default() }, ..Paper::new() };
    rig.pass(3_000 * MS);
    assert!(rig.events().contains(&"identity changed"));
    let start = rig.order(START);
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::IdentityChanged)));
    assert_eq!(rig.drive.writes(), []);
    let accept = rig.order(accept_of("two"));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(accept), Some(&Outcome::Confirmed));
    let start = rig.order(START);
    rig.pass(500 * MS);
    assert!(rig.outcome(start).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_drive_that_was_exchanged_once_more_is_not_accepted_by_what_the_one_before_it_said() {
    let mut rig = exchanged(Rig::ready());
    rig.pass(1_000 * MS);
    rig.drive.identity.model = Some("three".to_owned());
    line_lost(&mut rig);
    // Given before it has said so: it waits for that.
    let accept = rig.order(accept_of("two"));
    rig.pass(1_000 * MS);
    let now = Identity { model: Some("three".to_owned()), ..Identity::default() };
    let refused = Refused::NotTheShown(Some(Arc::new(now)));
    assert_eq!(rig.outcome(accept), Some(&Outcome::Refused(refused)));
    let start = rig.order(START);
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::IdentityChanged)));
    let accept = rig.order(accept_of("three"));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(accept), Some(&Outcome::Confirmed));
}

/// Nothing is sent by it, and nothing else takes its alarm away.
#[test]
fn another_drive_that_is_only_read_is_accepted_too() {
    let mut rig = Rig::new(DriveSettings { watchdog: None, control: false, ..settings() });
    rig.pass(2_000 * MS);
    let mut rig = exchanged(rig);
    rig.pass(2_000 * MS);
    let trouble = |rig: &Rig| rig.snapshot().concern(rig.now).map(|worst| worst.kind);
    assert_eq!(trouble(&rig), Some(ConcernKind::IdentityChanged));
    let accept = rig.order(accept_of("two"));
    rig.pass(500 * MS);
    assert_eq!((rig.outcome(accept), trouble(&rig)), (Some(&Outcome::Confirmed), None));
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn nothing_restarts_after_a_loss_a_trip_or_a_reset() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
    rig.pass(10_000 * MS);
    rig.drive.failing = None;
    rig.drive.trip(18);
    rig.pass(10_000 * MS);
    let reset = rig.order(Order::ResetFaults);
    rig.pass(10_000 * MS);
    assert_eq!(rig.outcome(reset), Some(&Outcome::Confirmed));
    assert_eq!(rig.drive.writes(), [Job::Withdraw, Job::ResetFaults]);
    assert_eq!(rig.drive.status.state, State::Ready);
}

#[test]
fn a_trip_after_a_lost_line_is_told_as_the_watchdogs_and_reset_once_by_policy() {
    for (policy, resets) in [(OnFault::Report, 0), (OnFault::ResetWatchdogTrip, 1)] {
        let mut rig = Rig::ready();
        rig.machine.settings.on_fault = policy;
        rig.order(START);
        rig.pass(1_000 * MS);
        rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
        rig.pass(10_000 * MS);
        rig.drive.failing = None;
        rig.drive.trip(18);
        rig.pass(10_000 * MS);
        let snapshot = rig.snapshot();
        let trip = snapshot.trips.back().unwrap();
        assert!(trip.watchdog_after.unwrap() >= CONTRACT.timeout);
        assert_eq!(trip.before.as_ref().unwrap().value.state, State::Running, "the frame before the trip");
        assert_eq!(trip.status.value.fault_code, Some(18));
        assert_eq!(rig.drive.writes().iter().filter(|job| **job == Job::ResetFaults).count(), resets);
    }
}

#[test]
fn a_trip_without_a_lost_line_is_not_the_watchdogs() {
    let mut rig = Rig::ready();
    rig.machine.settings.on_fault = OnFault::ResetWatchdogTrip;
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.trip(4);
    rig.pass(5_000 * MS);
    let snapshot = rig.snapshot();
    assert_eq!(snapshot.trips.back().unwrap().watchdog_after, None);
    assert_eq!(rig.drive.status.state, State::Fault);
    assert!(rig.drive.log.contains(&Job::Faults), "its explanation is read");
    assert!(rig.events().contains(&"trip explained"));
}

/// An Altivar's LFt names the last fault, whichever that was when the trip was seen first; its status need not show it.
#[test]
fn a_fault_that_comes_in_the_place_of_another_is_told_and_explained_and_no_policy_resets_it() {
    for (is_shown, second) in [(true, 9), (true, 18), (false, 9), (false, 18)] {
        let mut rig = Rig::ready();
        rig.machine.settings.on_fault = OnFault::ResetWatchdogTrip;
        let trip = |rig: &mut Rig, code| {
            rig.drive.trip(code);
            rig.drive.status.fault_code = is_shown.then_some(code);
            rig.drive.names_fault = Some(code);
        };
        trip(&mut rig, 4);
        rig.pass(10_000 * MS);
        trip(&mut rig, second);
        rig.pass(30_000 * MS);
        let snapshot = rig.snapshot();
        let told = snapshot.trips.back().and_then(Trip::fault).map(|fault| fault.code);
        assert_eq!(told, Some(second), "{is_shown}");
        let events = rig.events();
        let told = |name| events.iter().filter(|event| **event == name).count();
        assert_eq!((told("tripped"), told("trip explained"), told("fault changed")), (1, 1, 1), "{events:?}");
        assert!(!rig.drive.log.contains(&Job::ResetFaults), "{second}, {is_shown}");
        assert_eq!(snapshot.counters.trips, 1);
    }
}

#[test]
fn the_last_trips_are_kept_and_their_number_is_bounded() {
    let mut rig = Rig::ready();
    for code in 0..40 {
        rig.drive.trip(code);
        rig.pass(1_500 * MS);
        rig.drive.stand();
        rig.pass(1_500 * MS);
    }
    let snapshot = rig.snapshot();
    assert_eq!(snapshot.trips.len(), 16);
    assert_eq!(snapshot.trips.back().unwrap().status.value.fault_code, Some(39));
    assert_eq!(snapshot.counters.trips, 40);
}

#[test]
fn a_drive_that_is_lost_is_told_once_and_stopped_on_return_where_the_policy_says_so() {
    for (policy, stops) in [(OnLoss::Report, 0), (OnLoss::Stop(StopMode::Ramp), 1)] {
        let mut rig = Rig::ready();
        rig.machine.settings.on_loss = policy;
        rig.order(START);
        rig.pass(1_000 * MS);
        rig.drive.log.clear();
        rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
        rig.pass(30_000 * MS);
        assert_eq!(rig.events().iter().filter(|name| **name == "lost").count(), 1);
        rig.drive.failing = None;
        rig.pass(5_000 * MS);
        assert_eq!(rig.drive.writes().len(), stops);
    }
}

/// `max_age` says for how long nobody needs to hear of a motor.
#[test]
fn a_drive_that_its_line_calls_off_line_for_less_than_max_age_is_lost_and_not_stopped() {
    let mut rig = Rig::ready();
    rig.machine.settings.on_loss = OnLoss::Stop(StopMode::Ramp);
    rig.machine.settings.periods.max_age = 30_000 * MS;
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    for (away, stops) in [(20_000, 0), (31_000, 1)] {
        rig.drive.failing = Some(PortError::Offline { retry_in: 500 * MS });
        rig.pass(away * MS);
        assert_eq!(rig.snapshot().link, Link::Lost);
        rig.drive.failing = None;
        rig.pass(5_000 * MS);
        assert_eq!(rig.drive.writes().len(), stops, "away for {away} ms");
    }
}

#[test]
fn a_watchdog_is_fed_by_a_frame_of_its_own_when_no_poll_does() {
    let mut rig = Rig::new(DriveSettings {
        periods: crate::settings::Periods { rest: 2_500 * MS, slow: Duration::ZERO, ..Default::default() },
        ..settings()
    });
    rig.pass(500 * MS);
    rig.drive.log.clear();
    rig.pass(20_000 * MS);
    assert!(rig.drive.log.iter().filter(|job| **job == Job::KeepAlive).count() >= 8, "{:?}", rig.drive.log);
}

/// Of a family that lists none: whether a drive by file has one is a word of its register.
#[test]
fn a_watchdog_that_only_the_drive_tells_of_is_read_and_fed_as_it_is_found() {
    let periods =
        Periods { running: 4_000 * MS, rest: 4_000 * MS, slow: Duration::ZERO, max_age: 12_000 * MS };
    let mut rig = Rig::controlled();
    rig.machine =
        Supervisor::new(rig.now, DriveSettings { periods, watchdog: None, ..settings() }, None, None);
    rig.drive.watchdog = Watchdog { timeout: Some(2_000 * MS), reaction: None };
    rig.pass(500 * MS);
    let found = Some(rig.drive.watchdog);
    assert_eq!(rig.snapshot().watchdog, WatchdogCheck::NoContract { found });
    rig.drive.log.clear();
    rig.pass(20_000 * MS);
    let asked = rig.drive.log.len();
    assert!(asked >= 18, "something within each half of its time: {:?}", rig.drive.log);
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn a_stream_of_orders_does_not_blind_the_fleet() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(200 * MS);
    rig.drive.log.clear();
    for hertz in 0..500 {
        rig.order(setpoint(hertz % 50));
        rig.pass(20 * MS);
    }
    let statuses = rig.drive.log.iter().filter(|job| matches!(job, Job::Status { .. })).count();
    assert!(statuses >= 6, "{statuses} statuses in 10 s");
}

#[test]
fn a_reply_for_which_no_frame_was_sent_does_not_put_off_the_frame_that_feeds_the_watchdog() {
    let mut rig = Rig::ready();
    let feed_at = rig.machine.checks.feed_at();
    assert!(feed_at.is_some_and(|at| at <= rig.now + CONTRACT.timeout / 2), "{feed_at:?}");
    rig.now += 500 * MS;
    let error = Error::Unsupported { what: "identity", reason: "it has none" };
    rig.machine.handle_reply(rig.now, Reply::Identity(Err(error)));
    assert_eq!(rig.machine.checks.feed_at(), feed_at);
}

#[test]
fn a_status_whose_frames_are_answered_is_not_cut_for_a_keep_alive() {
    let mut rig = Rig::ready();
    while !matches!(rig.next(), Step::Do { job: Job::Status { .. }, .. }) {
        rig.now += 20 * MS;
    }
    let feed_at = rig.machine.checks.feed_at().expect("it has a watchdog");
    assert_eq!(rig.machine.goes_on(feed_at), None, "nothing was heard in time");
    rig.machine.handle_heard(feed_at - 100 * MS);
    let until = feed_at - 100 * MS + CONTRACT.timeout / 2;
    assert_eq!(rig.machine.goes_on(feed_at), Some(until));
}

#[test]
fn control_that_panel_or_terminals_take_is_told_and_told_when_it_is_back() {
    let mut rig = Rig::ready();
    rig.drive.status.control = Some(Control::Panel);
    rig.pass(2_000 * MS);
    rig.drive.status.control = Some(Control::Bus);
    rig.pass(2_000 * MS);
    assert_eq!(rig.events(), ["control taken", "control returned"]);
}

#[test]
fn a_watchdog_that_reads_back_otherwise_forbids_motion() {
    let mut rig = Rig::controlled();
    rig.pass(60 * MS);
    rig.machine
        .handle_reply(rig.now, Reply::Watchdog(Err(Error::Unsupported { what: "watchdog", reason: "none" })));
    let id = rig.order(START);
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::Refused(Refused::WatchdogUnverified)));
}

#[test]
fn after_a_silence_in_which_it_can_have_been_switched_off_a_drive_is_checked_again() {
    let mut rig = Rig::ready();
    rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
    rig.pass(1_500 * MS);
    assert_eq!(rig.snapshot().link, Link::Connected, "it is not lost yet");
    rig.drive.failing = None;
    rig.drive.watchdog = Watchdog { timeout: None, reaction: None };
    rig.drive.log.clear();
    rig.pass(1_500 * MS);
    let arm = Job::ArmWatchdog(CONTRACT.timeout, CONTRACT.reaction);
    assert_eq!(rig.drive.log[..4], [Job::Status { anew: true }, Job::Identify, Job::Watchdog, arm]);
}

#[test]
fn a_status_is_as_old_as_the_exchange_that_brought_it_and_not_as_its_call() {
    let mut rig = Rig::ready();
    rig.drive.status.at = Some(rig.now);
    let read = rig.now;
    rig.now += 2_000 * MS;
    let status = rig.drive.status.clone();
    rig.machine.accept_status(rig.now, status);
    let snapshot = rig.snapshot();
    assert_eq!(snapshot.status.as_ref().map(|status| status.at), Some(read));
    assert_eq!(snapshot.freshness(read + snapshot.max_age), Freshness::Fresh);
    assert_eq!(snapshot.freshness(read + snapshot.max_age + MS), Freshness::Stale);
}

/// Rule 4.
#[test]
fn a_status_that_is_older_than_it_may_be_moves_nothing() {
    let rig = Rig::ready();
    let snapshot = rig.snapshot();
    let read = snapshot.status.as_ref().map(|status| status.at).unwrap();
    let refused = |at| rig.machine.leave(at, "tester", Direction::Forward, None).err();
    assert_eq!(refused(read + snapshot.max_age), None);
    assert_eq!(refused(read + snapshot.max_age + MS), Some(Refused::Stale));
}

#[test]
fn a_leave_to_start_is_gone_once_a_stop_has_been_asked_for() {
    let mut rig = Rig::ready();
    let leave = rig.machine.leave(rig.now, "tester", Direction::Forward, None).unwrap();
    let asker = rig.asker();
    assert_eq!(rig.machine.refuse_at_once(&asker, &START, Some(leave)), None);
    rig.stop(StopMode::Ramp);
    rig.pass(3_000 * MS);
    assert_eq!(
        rig.machine.refuse_at_once(&asker, &START, Some(leave)),
        Some(Refused::Stopped),
        "it is confirmed"
    );
    assert_eq!(rig.machine.refuse_at_once(&asker, &START, None), None);
}

#[test]
fn a_value_that_another_answer_withdraws_is_told_is_not_good_any_more_and_moves_nothing() {
    let mut rig = Rig::ready();
    let read = rig.snapshot().status.map(|status| status.at).unwrap();
    let freshness = |rig: &Rig| rig.snapshot().freshness(rig.now);
    assert_eq!(freshness(&rig), Freshness::Fresh);
    for _ in 0..3 {
        rig.machine.handle_retracted(rig.now, read);
    }
    rig.collect();
    assert_eq!(rig.events(), ["value withdrawn"], "it is told once");
    assert_eq!(freshness(&rig), Freshness::Stale);
    let refused = rig.machine.leave(rig.now, "tester", Direction::Forward, None);
    assert_eq!(refused, Err(Refused::Stale), "nothing rests on it");
    rig.pass(100 * MS);
    assert_eq!(freshness(&rig), Freshness::Fresh, "the next is asked for at once");
    // That of a value which nothing shows any more withdraws nothing.
    rig.machine.handle_retracted(rig.now, read - MS);
    rig.collect();
    assert_eq!(freshness(&rig), Freshness::Fresh);
    assert_eq!(rig.events(), ["value withdrawn"]);
}

#[test]
fn a_stop_that_was_confirmed_by_a_value_which_is_withdrawn_goes_on() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.stop(StopMode::Fast);
    let mut read = None;
    while rig.snapshot().stop.is_some() {
        rig.pass(20 * MS);
        read = rig.snapshot().status.map(|status| status.at);
    }
    rig.drive.log.clear();
    rig.drive.run();
    rig.machine.handle_retracted(rig.now, read.unwrap());
    rig.pass(1_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Fast)]);
    assert_eq!(rig.cause_of("stop confirmed"), Some(Cause::Policy { policy: Policy::ValueWithdrawn }));
}

#[test]
fn a_watchdog_that_is_changed_under_a_contract_is_told_and_nothing_starts_before_it_is_the_contracts_again() {
    let mut rig = Rig::ready();
    // Somebody else has set it to nothing, and it takes no other setting any more.
    rig.drive.watchdog = Watchdog { timeout: None, reaction: None };
    rig.drive.keeps_watchdog = true;
    rig.machine.handle_changed(rig.now, drive_core::Ground::Watchdog);
    let start = rig.order(START);
    rig.pass(3_000 * MS);
    assert!(rig.events().contains(&"contract changed"), "{:?}", rig.events());
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::WatchdogUnverified)));
    assert!(!rig.drive.log.contains(&Job::Start(Direction::Forward)));
    assert!(matches!(rig.snapshot().watchdog, WatchdogCheck::Broken(_)));
}

#[test]
fn a_watchdog_that_was_set_otherwise_while_the_motor_stood_is_found_by_a_start_and_set_up_before_it() {
    let mut rig = Rig::ready();
    rig.pass(60_000 * MS);
    rig.drive.log.clear();
    rig.outputs.clear();
    rig.drive.watchdog = Watchdog { timeout: None, reaction: None };
    let start = rig.order(START);
    rig.pass(1_000 * MS);
    assert!(rig.outcome(start).is_some_and(Outcome::is_confirmed));
    let arm = Job::ArmWatchdog(CONTRACT.timeout, CONTRACT.reaction);
    assert_eq!(rig.drive.writes(), [arm, Job::Start(Direction::Forward)]);
    assert_eq!(rig.events()[..2], ["contract changed", "watchdog verified"], "{:?}", rig.events());
    rig.stop(StopMode::Ramp);

    // What nobody has changed is no news, and what was read a moment ago is not read again.
    rig.pass(60_000 * MS);
    rig.outputs.clear();
    for reads in [1, 0] {
        rig.drive.log.clear();
        rig.order(START);
        rig.pass(1_000 * MS);
        assert_eq!(rig.drive.log.iter().filter(|job| **job == Job::Watchdog).count(), reads);
        rig.stop(StopMode::Ramp);
        rig.pass(1_000 * MS);
    }
    assert!(!rig.events().contains(&"watchdog verified"), "{:?}", rig.events());
}

#[test]
fn a_watchdog_whose_reading_before_a_start_finds_no_answer_once_is_read_again() {
    let mut rig = Rig::ready();
    rig.pass(60_000 * MS);
    rig.drive.log.clear();
    let start = rig.order(START);
    let step = rig.next();
    assert!(matches!(step, Step::Do { job: Job::Watchdog, .. }), "{step:?}");
    rig.now += 200 * MS;
    rig.machine
        .handle_reply(rig.now, Reply::Watchdog(Err(port_error(PortError::Timeout { after: 200 * MS }))));
    rig.pass(700 * MS);
    assert!(rig.outcome(start).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(start));
    assert_eq!(rig.drive.log.first(), Some(&Job::Watchdog));
}

#[test]
fn a_watchdog_that_is_changed_under_a_motor_that_turns_is_an_alarm() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.outputs.clear();
    rig.drive.log.clear();
    rig.drive.watchdog = Watchdog { timeout: None, reaction: None };
    rig.machine.handle_changed(rig.now, drive_core::Ground::Watchdog);
    rig.pass(1_000 * MS);
    assert_eq!(rig.events(), ["contract changed", "watchdog not in force"]);
    assert_eq!(rig.drive.writes(), [], "a motor that turns is not disturbed");
}

#[test]
fn a_setpoint_that_was_given_before_the_units_changed_is_believed_no_more_and_is_what_was_asked_where_the_limits_did()
 {
    for ground in [drive_core::Ground::Limits, drive_core::Ground::Units] {
        let mut rig = Rig::ready();
        rig.order(setpoint(40));
        rig.pass(500 * MS);
        assert!(rig.snapshot().setpoint.is_some());
        rig.machine.handle_changed(rig.now, ground);
        rig.pass(100 * MS);
        // Whether the motor follows it within other limits is watched.
        assert_eq!(rig.snapshot().setpoint.is_some(), ground == drive_core::Ground::Limits, "{ground}");
        assert!(rig.events().contains(&"contract changed"), "{:?}", rig.events());
    }
}

#[test]
fn a_motor_that_gets_too_hot_is_told_and_told_when_it_is_back() {
    let mut rig = Rig::ready();
    rig.machine.settings.alarms.motor_thermal = Some(drive_core::Percent::from_percent(90));
    for (percent, told) in [(90, 0), (95, 1), (96, 1), (80, 2)] {
        let motor_thermal = Some(drive_core::Percent::from_percent(percent));
        let measurements = Measurements { motor_thermal, ..Measurements::default() };
        rig.machine.handle_reply(rig.now, Reply::Measurements(Ok(measurements)));
        rig.collect();
        let limits = rig.happened().filter(|happened| matches!(happened.kind, EventKind::Limit { .. }));
        assert_eq!(limits.count(), told, "{percent} %");
    }
}

#[test]
fn what_is_above_a_limit_that_is_taken_away_or_raised_is_above_none_and_below_a_lowered_one_it_is_at_once() {
    use drive_core::{Current, Percent};
    type Set = fn(&mut crate::settings::DriveSettings, Option<u16>);
    let limits: [(&str, Set); 4] = [
        ("frequency", |settings, limit| settings.limits.high = limit.map(Frequency::from_hertz)),
        ("current", |settings, limit| {
            settings.alarms.current = limit.map(|limit| Current::from_deciamperes(limit.into()));
        }),
        ("drive thermal", |settings, limit| {
            settings.alarms.drive_thermal = limit.map(|limit| Percent::from_percent(limit.cast_signed()));
        }),
        ("motor thermal", |settings, limit| {
            settings.alarms.motor_thermal = limit.map(|limit| Percent::from_percent(limit.cast_signed()));
        }),
    ];
    for (name, set) in limits {
        let mut rig = Rig::ready();
        rig.drive.run();
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(30));
        rig.drive.status.current = Some(Current::from_deciamperes(30));
        rig.pass(1_500 * MS);
        let hot = Some(Percent::from_percent(30));
        let measured = Measurements { drive_thermal: hot, motor_thermal: hot, ..Measurements::default() };
        rig.machine.handle_reply(rig.now, Reply::Measurements(Ok(measured)));
        for (limit, above) in [(Some(20), true), (Some(40), false), (Some(20), true), (None, false)] {
            let mut settings = rig.machine.settings.clone();
            set(&mut settings, limit);
            rig.machine.handle_settings(rig.now, &settings);
            assert_eq!(!rig.snapshot().exceeded.is_empty(), above, "{name} {limit:?}");
        }
    }
}

#[test]
fn what_is_set_up_otherwise_in_a_drive_is_an_alarm_that_says_what_for_as_long_as_it_is_so() {
    const OTHERWISE: Refusal = Refusal::Settings("A001 reads 1: set A001 to 3 at the drive");
    let mut rig = Rig::ready();
    for (unmet, told) in [(None, None), (Some(OTHERWISE), Some(OTHERWISE.to_string())), (None, None)] {
        rig.machine.handle_unmet(unmet);
        let concern = rig.snapshot().concern(rig.now);
        assert!(concern.iter().all(|concern| concern.kind == ConcernKind::SetUpOtherwise), "{concern:?}");
        assert_eq!(concern.and_then(|concern| concern.detail), told);
    }
}

#[test]
fn what_is_set_up_otherwise_is_an_event_once_when_it_begins_and_once_when_it_ends() {
    const A001: Refusal = Refusal::Settings("A001 reads 1: set A001 to 3 at the drive");
    const A002: Refusal = Refusal::Settings("A002 reads 1: set A002 to 3 at the drive");
    let mut rig = Rig::ready();
    for unmet in [None, Some(A001), Some(A001), Some(A002), None, None] {
        rig.machine.handle_unmet(unmet);
        rig.pass(100 * MS);
    }
    let told = rig.outputs.iter().filter_map(|output| match output {
        Output::Event(happened) => Some(happened.kind.to_string()),
        _ => None,
    });
    let told: Vec<String> = told.filter(|text| text.starts_with("set up otherwise")).collect();
    let all = [
        format!("set up otherwise: {A001}"),
        format!("set up otherwise: {A002}"),
        format!("set up otherwise, not any more; it was: {A002}"),
    ];
    assert_eq!(told, all);
    // Of another drive that is told, and no setting.
    let mut another = Rig::ready();
    another.drive.recognised = Recognised::NotMine { it_is: "another" };
    another.drive.identity = Identity { model: Some("two".to_owned()), ..Identity::default() };
    line_lost(&mut another);
    another.machine.handle_unmet(Some(A001));
    another.pass(5_000 * MS);
    let events = another.events();
    assert!(events.contains(&"other family") && !events.contains(&"set up otherwise"), "{events:?}");
}

/// The same rig with another drive at the end of its line, which was opened again.
fn exchanged(mut rig: Rig) -> Rig {
    let identity = Identity { model: Some("two".to_owned()), ..Identity::default() };
    rig.drive = Paper { identity, ..Paper::new() };
    line_lost(&mut rig);
    rig
}

fn line_lost(rig: &mut Rig) {
    if rig.machine.handle_line_lost(rig.now) {
        rig.machine.handle_dropped(rig.now);
    }
}

#[test]
fn another_drive_behind_a_line_that_was_lost_for_a_moment_is_not_moved() {
    for order in [START, run_at(20), setpoint(20), Order::ResetFaults, Order::Release, Order::Persist] {
        let mut rig = exchanged(Rig::ready());
        rig.drive.trip(18);
        let id = rig.order(order);
        rig.pass(3_000 * MS);
        assert_eq!(rig.outcome(id), Some(&Outcome::Refused(Refused::IdentityChanged)), "{order:?}");
        assert_eq!(rig.drive.writes(), [], "{order:?}");
        assert!(rig.events().contains(&"identity changed"), "{:?}", rig.events());
    }
}

#[test]
fn behind_a_line_that_was_lost_for_a_moment_a_start_waits_until_the_drive_has_said_that_it_is_the_same() {
    let mut rig = Rig::ready();
    rig.order(setpoint(40));
    rig.pass(500 * MS);
    rig.drive.log.clear();
    line_lost(&mut rig);
    assert_eq!(rig.snapshot().setpoint, None, "another may not have it");
    let id = rig.order(START);
    rig.pass(900 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(id));
    let start = Job::Start(Direction::Forward);
    assert_eq!(rig.drive.log[..4], [Job::Status { anew: true }, Job::Identify, Job::Watchdog, start]);
}

#[test]
fn a_drive_that_cannot_say_which_it_is_is_read_anew_behind_a_lost_line_and_moved() {
    let mut rig = Rig::ready();
    line_lost(&mut rig);
    let start = rig.order(START);
    rig.drive.log.clear();
    assert!(matches!(rig.next(), Step::Do { job: Job::Status { anew: true }, .. }));
    let status = rig.drive.answer(Job::Status { anew: true });
    rig.machine.handle_reply(rig.now, status);
    assert!(matches!(rig.next(), Step::Do { job: Job::Identify, .. }));
    let speechless = Error::Unsupported { what: "identity", reason: "it has none" };
    rig.machine.handle_reply(rig.now, Reply::Identity(Err(speechless)));
    rig.pass(900 * MS);
    assert!(rig.outcome(start).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(start));
}

#[test]
fn nothing_is_sent_while_the_drive_behind_a_lost_line_does_not_answer() {
    let mut rig = Rig::ready();
    line_lost(&mut rig);
    rig.drive.failing = Some(PortError::Timeout { after: 20 * MS });
    let start = rig.order(START);
    rig.pass(2_000 * MS);
    assert!(matches!(rig.outcome(start), Some(Outcome::Refused(_))), "{:?}", rig.outcome(start));
    assert_eq!(rig.drive.writes(), []);
    assert!(!rig.drive.log.contains(&Job::Identify), "{:?}", rig.drive.log);
}

#[test]
fn a_start_under_way_when_its_line_is_lost_is_dropped_and_taken_back() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    assert!(matches!(rig.next(), Step::Do { job: Job::Start(_), .. }));
    assert!(rig.machine.handle_line_lost(rig.now), "the rest of it is not sent");
    rig.machine.handle_dropped(rig.now);
    rig.pass(900 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::NotConfirmed(Unconfirmed::Lost)));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)]);
    let cause = Cause::Policy { policy: Policy::StartNotConfirmed };
    assert_eq!(rig.cause_of("stop confirmed"), Some(cause));
}

#[test]
fn a_start_whose_setpoint_was_given_before_its_line_was_lost_is_over() {
    let mut rig = Rig::ready();
    let id = rig.order(run_at(20));
    while !rig.drive.log.iter().any(|job| matches!(job, Job::SetSetpoint(..))) {
        rig.pass(MS);
    }
    let mut rig = exchanged(rig);
    rig.pass(1_500 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::NotConfirmed(Unconfirmed::Lost)));
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn a_stop_goes_on_whatever_answers_behind_a_lost_line() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    let stop = rig.stop(StopMode::Ramp);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    assert!(!rig.machine.handle_line_lost(rig.now));
    let reply = rig.drive.answer(Job::Stop(StopMode::Ramp));
    rig.machine.handle_reply(rig.now, reply);
    rig.pass(1_000 * MS);
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed));
    assert!(rig.drive.log.contains(&Job::Identify), "{:?}", rig.drive.log);
}

#[test]
fn a_run_command_of_another_drive_behind_a_lost_line_is_not_withdrawn() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    let lease = rig.drive.lease;
    let mut rig = exchanged(rig);
    rig.drive.run();
    rig.drive.lease = lease;
    rig.drive.says = Some(Verdict::lacks(Lack::Command, ANOTHER_WORD));
    rig.pass(5_000 * MS);
    assert_eq!(rig.drive.writes(), []);
}

/// Nobody has missed the drive: its family finds at the start that it says another thing of itself than before.
#[test]
fn a_drive_that_was_exchanged_between_two_polls_is_told_and_not_started_until_it_is_accepted() {
    let mut rig = Rig::ready();
    rig.drive.identity.model = Some("two".to_owned());
    rig.drive.withholds_starts = Some(Refusal::Exchanged);
    let refused = rig.order(START);
    rig.pass(500 * MS);
    assert!(matches!(rig.outcome(refused), Some(Outcome::Refused(_))), "{:?}", rig.outcome(refused));
    assert!(rig.events().contains(&"identity changed"), "{:?}", rig.events());
    let anew = [Job::Start(Direction::Forward), Job::Status { anew: true }, Job::Identify];
    assert_eq!(rig.drive.log[..3], anew);
    // Asked again which it is, its family has nothing against it; the fleet has.
    rig.drive.withholds_starts = None;
    let refused = rig.order(run_at(20));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(refused), Some(&Outcome::Refused(Refused::IdentityChanged)));
    rig.order(accept_of("two"));
    let started = rig.order(START);
    rig.pass(500 * MS);
    assert!(rig.outcome(started).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(started));
}

/// A drive of which the line was lost while it ran, and a stop that waits for it.
fn unheard_and_stopped() -> (Rig, CallId) {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 20 * MS });
    let stop = rig.stop(StopMode::Ramp);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    (rig, stop)
}

#[test]
fn a_stop_is_not_confirmed_by_another_drive_at_rest_than_the_one_that_was_to_be_stopped() {
    let (mut rig, stop) = unheard_and_stopped();
    let identity = Identity { model: Some("two".to_owned()), ..Identity::default() };
    rig.drive = Paper { identity, ..Paper::new() };
    let told =
        |rig: &Rig| rig.outputs.iter().any(|output| matches!(output, Output::InForce(id, _) if *id == stop));
    rig.pass(150_000 * MS);
    assert!(!told(&rig), "nor that it has taken it");
    let Some(Outcome::NotConfirmed(Unconfirmed::TimeOver { because, .. })) = rig.outcome(stop) else {
        panic!("{:?}", rig.outcome(stop))
    };
    assert_eq!(*because, Some(Refusal::Exchanged));
    let events = rig.events();
    assert!(events.contains(&"stop unconfirmed") && !events.contains(&"stop confirmed"), "{events:?}");
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)], "it was given, and is not repeated");
    // Whoever accepts it says that it is the one that is meant; so does whoever stops what stands there by now.
    let mut again = exchanged_amid_a_stop();
    let other = again.stop(StopMode::Ramp);
    again.pass(2_000 * MS);
    assert!(again.outcome(other).is_some_and(Outcome::is_confirmed), "{:?}", again.outcome(other));
    rig.order(accept_of("two"));
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"));
}

fn exchanged_amid_a_stop() -> Rig {
    let (mut rig, _) = unheard_and_stopped();
    let identity = Identity { model: Some("two".to_owned()), ..Identity::default() };
    rig.drive = Paper { identity, ..Paper::new() };
    rig.pass(5_000 * MS);
    assert!(rig.snapshot().stop.is_some(), "{:?}", rig.events());
    rig
}

#[test]
fn a_stop_behind_a_loss_is_confirmed_as_soon_as_the_drive_has_said_that_it_is_the_same() {
    let (mut rig, stop) = unheard_and_stopped();
    rig.others_have_the_turn = true;
    rig.drive.failing = None;
    while rig.outcome(stop).is_none() {
        rig.pass(MS);
    }
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(stop));
    let behind = rig.drive.log.iter().skip_while(|job| matches!(job, Job::Status { .. }));
    let behind: Vec<Job> = behind.copied().collect();
    assert_eq!(behind, [Job::Stop(StopMode::Ramp), Job::Identify], "the stop waits for nothing");
}
