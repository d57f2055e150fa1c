//! Whose doing something was, in nights that somebody had staged: what looks like somebody's at the drive, and was not.

use drive_fleet::{Outcome, Refused, Unconfirmed};
use serde_json::json;

use super::{Certainty, NIGHT_MS, Says as _, Written};
use crate::{
    quantity::{Quantity, Set},
    record::Kind,
    tracker::Tracker,
};

/// As the file has them: the places of their words.
const READY: i64 = 2;
const RUNNING: i64 = 3;
const STOPPING: i64 = 4;
const BUS: i64 = 0;
const TERMINALS: i64 = 1;

/// The mains of the plant was away from 303.0 to 308.0 s; a V20 then shows a run command that is not in force.
#[test]
fn a_block_that_is_shown_behind_a_silence_of_several_is_first_of_all_one_of_their_supply() {
    for (state, is_supply) in [("ready", true), ("running", false)] {
        let mut night = Written::begin(&format!("moment-block-{state}"));
        night.heard_between(&[(0, 303), (309, 400)]);
        let lost = || Some(json!({ "silent_for_ms": 2_949 }));
        night.kept(Kind::Event, Some("pump 2"), 305_540, "lost", "lost for 2.9 s: off-line", lost());
        night.event(305_552, "lost", "lost for 2.9 s: off-line", lost());
        let shown = || Some(json!({ "status": { "state": state, "control": "bus" } }));
        night.kept(Kind::Event, Some("pump 2"), 308_600, "connected", "connected", shown());
        let own = json!({ "status": { "state": "ready", "control": "bus" } });
        night.event(308_682, "connected", "connected: ready", Some(own));
        let text = "output blocked: something that the drive does not tell, such as a stop at it, an input, another master or its supply, decides instead";
        night.event(308_682, "output_blocked", text, None);
        let story = night.told(308_000);
        let about = story.about.as_ref().unwrap();
        assert_eq!(about.certainty == Certainty::Likely, is_supply, "{about:?}");
        assert_eq!(about.text.contains("likely with its supply"), is_supply, "{about:?}");
        assert_eq!(story.why(Certainty::Said).contains("a stop at it"), !is_supply, "{story:?}");
        if is_supply {
            let first = &story.why[0];
            assert!(
                first.certainty == Certainty::Likely && first.text.contains("its supply was away"),
                "{story:?}"
            );
            assert!(story.why(Certainty::Likely).contains("a stop at it"), "{story:?}");
            assert!(story.why(Certainty::Seen).contains("pump 2 fell silent with it"), "{story:?}");
        }
    }
}

/// A run that shift had started; the program was killed, begun again, and had not taken the run over when it ended and stopped the motor.
#[test]
fn a_run_that_this_program_had_begun_before_it_was_killed_is_not_told_as_somebody_else_s() {
    let mut night = Written::begin("moment-killed");
    night.asked(230_000, "start", "start forward at 30.00 Hz by shift from http 127.0.0.1: confirmed");
    night.changed(230_823, "ready", "running", "command");
    night.killed_until(317_333);
    night.event(317_533, "connected", "connected: running, forward, 30.00 Hz", None);
    night.changed(338_373, "running", "stopping", "drive");
    let text =
        "run not adopted: whatever turns the motor is not ours: it does not stand in the drive any more";
    night.event(338_373, "run_not_adopted", text, None);
    let by_exit = json!({ "cause": { "by": "policy", "policy": "exit" } });
    night.event(339_268, "command", "command: stop by ramp by exit: confirmed", Some(by_exit));
    let story = night.told(338_000);
    let told = format!("{:?} {:?}", story.about, story.why);
    assert!(!told.contains("not ours"), "{story:?}");
    assert!(
        story.about.as_ref().unwrap().text.contains("this program had begun before it was killed"),
        "{story:?}"
    );
    assert!(story.why(Certainty::Seen).contains("by shift"), "{story:?}");
    let likely = story.why(Certainty::Likely);
    assert!(
        likely.contains("this program was ending") && likely.contains("stop by ramp by exit"),
        "{story:?}"
    );
    assert!(!story.why(Certainty::NotKnown).contains("at the drive"), "{story:?}");
    // A run of which nothing is recorded here is not told as one of here.
    let mut other = Written::begin("moment-foreign");
    other.event(317_533, "connected", "connected: running, forward, 30.00 Hz", None);
    other.event(338_373, "run_not_adopted", text, None);
    let story = other.told(338_000);
    assert!(story.about.as_ref().unwrap().text.contains("is not ours"), "{story:?}");
}

/// Somebody starts a drive, and somebody else stops it before it is confirmed: before its run word went out, or behind it.
#[test]
fn a_start_that_a_stop_overtook_is_a_cause_where_it_was_sent_and_none_where_it_was_not() {
    for (overtaken, is_cause) in [
        (Outcome::NotConfirmed(Unconfirmed::Stopped), true),
        (Outcome::NotConfirmed(Unconfirmed::Superseded), true),
        (Outcome::Refused(Refused::Stopped), false),
        (Outcome::Refused(Refused::Superseded), false),
    ] {
        let mut night =
            Written::begin(&format!("moment-overtaken-{}-{is_cause}", overtaken.reason().unwrap()));
        night.heard_for(400);
        let text = format!("start forward by shift from http 127.0.0.1: {overtaken}");
        let body = json!({ "outcome": overtaken.word(), "text": overtaken.text() });
        night.kept(Kind::Command, Some("pump 1"), 302_000, "start", &text, Some(body));
        night.changed(302_500, "ready", "running", "drive");
        let story = night.told(302_000);
        assert_eq!(story.why(Certainty::Likely).contains("by shift"), is_cause, "{story:?}");
        assert_eq!(format!("{:?}", story.why).contains("nobody here asked"), !is_cause, "{story:?}");
    }
}

/// Another master wrote OFF1 at 325.005 s: 27.17 Hz at 325.164 s, 1.26 Hz at 326.719 s, and the withdrawal was confirmed at 326.811 s.
#[test]
fn a_run_whose_output_had_begun_to_fall_a_little_was_not_ended_by_what_this_program_did_upon_it() {
    let mut night = Written::begin("moment-begun");
    let fall =
        [(200_164, RUNNING, 3_000), (325_164, RUNNING, 2_717), (326_719, RUNNING, 126), (326_893, READY, 0)];
    night.read(&fall, 340_000);
    night.event(325_320, "reference_taken", "reference taken: another setpoint than was given", None);
    let by_policy = json!({ "cause": { "by": "policy", "policy": "reference_taken" } });
    night.event(326_811, "command", "command: withdrawal of the run command", Some(by_policy));
    let body =
        json!({ "from": "running", "to": "ready", "cause": { "by": "policy", "policy": "reference_taken" } });
    night.event(326_893, "state_changed", "state changed: running to ready", Some(body));
    let story = night.told(325_000);
    assert!(!story.why(Certainty::Seen).contains("ended the run by itself"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("whether that or what had begun before it"), "{story:?}");
}

/// Another master gave the command to the terminals at 303.0 s; the motor stood at 307.2 s.
#[test]
fn a_motor_that_stopped_when_the_terminals_had_the_command_is_not_told_as_stopped_at_the_drive() {
    let mut night = Written::begin("moment-terminals");
    let mut tracker = Tracker::default();
    for at in (200_216..340_000).step_by(500) {
        let (state, control) = match (at < 303_000, at < 307_000) {
            (true, _) => (RUNNING, BUS),
            (_, true) => (STOPPING, TERMINALS),
            _ => (READY, TERMINALS),
        };
        let values = [(Quantity::STATE, state), (Quantity::CONTROL, control)];
        night.shown(Set::Status, tracker.see(at, 3_000, &values).unwrap());
    }
    night.changed(303_299, "running", "stopping", "drive");
    let text = "command overridden: another run command, which took the place of the one that was given, decides instead: see which master has given it, and stop the motor unless it is to run";
    night.event(303_299, "command_overridden", text, None);
    night.changed(307_287, "stopping", "ready", "drive");
    let story = night.told(306_000);
    let shown = story.why.iter().filter(|one| one.text.contains("command overridden"));
    assert_eq!(shown.count(), 1, "it is told once: {:?}", story.why);
    let told = format!("{story:?}");
    assert!(told.contains("stopping to ready") && told.contains("commanded by terminals"), "{told}");
    assert!(!told.contains("stopped at the drive") && !told.contains("another run command"), "{told}");
}

/// Its supply was off from 334.8 to 335.8 s; ready with 0.00 Hz was read at 336.918 s, and told at 337.369 s.
#[test]
fn an_output_that_was_gone_from_one_reading_to_the_next_had_not_been_falling() {
    let mut night = Written::begin("moment-jump");
    night.read(&[(200_418, RUNNING, 3_000), (336_918, READY, 0)], 360_000);
    night.stops(337_369);
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(337_369, "command_overridden", text, None);
    let story = night.told(337_000);
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz"), "{:?}", story.before);
    assert_eq!(story.before.len(), 1, "{:?}", story.before);
    assert!(!format!("{:?}", story.why).contains("had been falling"), "{story:?}");
    let seen = story.why(Certainty::Seen);
    assert!(
        seen.contains("its output was read as 0.00 Hz 0.5 s before that was seen, and as 30.00 Hz before it"),
        "{story:?}"
    );
    let open = story.why(Certainty::NotKnown);
    assert!(!open.contains("heard all the time") && open.contains("less than two polls"), "{story:?}");
}

/// The same fan as it was: a poll went unanswered, and what it showed then was found so.
#[test]
fn a_run_command_that_was_gone_behind_a_poll_without_an_answer_likely_went_with_the_supply() {
    let mut night = Written::begin("doings-unanswered");
    night.read(&[(200_418, RUNNING, 3_000), (336_918, READY, 0)], 360_000);
    let body = json!({ "from": "running", "to": "ready", "cause": { "by": "found" } });
    night.event(337_369, "state_changed", "state changed: running to ready", Some(body));
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(337_369, "command_overridden", text, None);
    let story = night.told(335_000);
    let about = story.about.as_ref().unwrap();
    assert_eq!(about.certainty, Certainty::Likely, "{about:?}");
    assert!(about.text.contains("with its supply"), "{about:?}");
    let likely = story.why(Certainty::Likely);
    assert!(likely.contains("had not been answered") && likely.contains("its supply was away"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("no silence of it was told"), "{story:?}");
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz"), "{:?}", story.before);
    assert!(
        story.before[0].text.ends_with("(as it was read last; a poll behind that was not answered)"),
        "{:?}",
        story.before
    );
}

/// A drive whose silence began at 315.3 s and was told at 316.58 s; somebody's start was told at 316.19 s.
#[test]
fn what_was_told_behind_a_moment_is_not_before_it() {
    let mut night = Written::begin("moment-after");
    night.heard_between(&[(0, 315), (328, 400)]);
    night.asked(316_190, "start", "start forward at 30.00 Hz by anna from http: not confirmed");
    night.event(316_580, "lost", "lost for 1.3 s: off-line", Some(json!({ "silent_for_ms": 1_300 })));
    let story = night.told(317_000);
    let lost = story.why.iter().find(|one| one.text.contains("lost for 1.3 s")).unwrap();
    assert!(lost.text.contains("began"), "{story:?}");
    assert_eq!(lost.time_unix_ms, Some(NIGHT_MS + 315_280), "{story:?}");
}

/// The program stood still for 15.4 s, and then told of a line that had answered nothing.
#[test]
fn drives_that_nobody_asked_are_not_told_as_drives_that_did_not_answer() {
    let mut night = Written::begin("moment-still");
    night.heard_between(&[(0, 302), (319, 400)]);
    night.event(318_000, "state_changed", "state changed: running to ready", None);
    let detail = json!({ "kind": "line_silent", "detail": "3 drives" });
    let text = "no drive of the line answers: 3 drives";
    night.kept(Kind::Alarm, None, 318_010, "unacknowledged", text, Some(detail));
    let body = json!({ "since_unix_ms": NIGHT_MS + 302_600 });
    let still = "this program stood still for 15.4 s until now: it asked nobody and saw nothing in that time";
    night.kept(Kind::History, None, 318_002, "stood_still", still, Some(body));
    let story = night.told(318_000);
    let course = story.course();
    assert!(course.contains("no drive of the line answers: 3 drives: nobody had asked them"), "{course}");
    let times: Vec<_> = story.course.iter().filter_map(|one| one.time_unix_ms).collect();
    assert!(times.is_sorted(), "{:?}", story.course);
}
