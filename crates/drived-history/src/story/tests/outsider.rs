//! What somebody who knew the manuals and no code found wrong or overclaimed in the stories of nights that he had staged.

use serde_json::{Value, json};

use super::{Certainty, Says as _, Written, fault};
use crate::{
    quantity::{Quantity, Set},
    record::Kind,
    tracker::Tracker,
};

/// As the file has them: the places of their words.
const RUNNING: i64 = 3;
const FAULT: i64 = 7;
const PANEL: i64 = 2;

fn lost() -> Option<Value> {
    Some(json!({ "silent_for_ms": 1_900 }))
}

fn found(by_watchdog: bool) -> Option<Value> {
    fault(by_watchdog, true).map(|body| serde_json::from_str(&body).unwrap())
}

/// A drive that falls silent at 298.1 s, and shows a fault when it is heard again.
fn silent(name: &str) -> Written {
    let mut night = Written::begin(name);
    night.heard_between(&[(0, 298), (306, 400)]);
    night.event(300_000, "lost", "lost for 1.9 s: no answer", lost());
    let shown = json!({ "status": { "state": "fault", "control": "bus" } });
    night.event(306_000, "connected", "connected: fault", Some(shown));
    night
}

const OPEN: &str = "its supply, its branch of the cable, its address or its settings";

#[test]
fn what_is_told_a_millisecond_behind_the_return_of_a_drive_is_told_with_it() {
    let mut night = silent("millisecond");
    night.event(306_001, "tripped", "tripped, found so", found(false));
    let text =
        "trip explained, found so by its communication watchdog: 5 SLF: Modbus communication interruption";
    night.event(307_200, "trip_explained", text, found(true));
    let story = night.told(299_000);
    assert!(!story.why(Certainty::NotKnown).contains(OPEN), "{story:?}");
    assert!(story.why(Certainty::Likely).contains("its supply was not away"), "{story:?}");
}

#[test]
fn a_drive_in_the_place_of_another_and_a_fault_of_its_supply_leave_no_four_causes_open() {
    let mut other = silent("exchanged");
    other.event(306_700, "other_family", "other family: an Altivar 28 answers", None);
    let story = other.told(299_500);
    assert!(story.why(Certainty::Said).contains("another drive answers in its place"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains(OPEN), "{story:?}");

    let mut supply = silent("undervoltage");
    supply.event(306_001, "tripped", "tripped, found so", found(false));
    // USF: BBV51701, fault code 22.
    supply.event(
        307_000,
        "trip_explained",
        "trip explained, found so: 22 USF: line supply undervoltage",
        found(false),
    );
    let story = supply.told(299_500);
    assert!(story.why(Certainty::Likely).contains("the drive itself speaks of its supply"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains(OPEN), "{story:?}");
    assert!(!story.why(Certainty::Likely).contains("cable"), "{story:?}");
}

#[test]
fn a_drive_that_is_lost_by_damaged_answers_was_not_silent_and_its_branch_is_not_blamed() {
    let mut night = Written::begin("damaged-answers");
    night.heard_between(&[(0, 296), (301, 400)]);
    let text = "lost for 3.8 s: slave 5, reading register 64768 (FD00h): the answer was damaged (CRC)";
    night.event(300_000, "lost", text, lost());
    let shown = json!({ "status": { "state": "running", "control": "bus" } });
    night.event(301_000, "connected", "connected: running", Some(shown));
    let counted = "in the last minute pump 1: of 307 answers 40 damaged; pump 2: of 300 answers 23 damaged";
    night.kept(Kind::Event, None, 320_000, "line_errors", counted, None);
    let story = night.told(299_000);
    assert!(!story.why(Certainty::Likely).contains("its own branch"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("pump 2: of 300 answers 23 damaged"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("what came of its answers was damaged"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("the whole line or its branch"), "{story:?}");
}

#[test]
fn a_supply_that_was_away_is_told_first_and_with_everybody_who_fell_silent_with_it() {
    let mut night = silent("plant-mains");
    let text = "command overridden: another word, or a power cycle, took the place of the run command";
    night.event(306_000, "command_overridden", text, None);
    let record =
        crate::record::Record::of_history(super::on_wall(300_300), "lost", "lost for 1.9 s: no answer");
    let body = lost().map(|body| body.to_string());
    let (drive, line) = (Some("belt".to_owned()), Some("west".to_owned()));
    night.archive.record(crate::record::Record { kind: Kind::Event, drive, line, body, ..record });
    let story = night.told(306_000);
    let about = &story.about.as_ref().unwrap().text;
    assert!(about.starts_with("its run command went, likely with its supply"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("who or what did it"), "{story:?}");
    assert!(story.why[0].text.contains("its supply was away"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("belt fell silent with it, on other lines too"), "{story:?}");
    assert!(story.why(Certainty::Likely).contains("such as the mains"), "{story:?}");
}

#[test]
fn what_the_program_did_by_itself_upon_something_is_told_with_it() {
    let mut night = Written::begin("policy-told");
    night.heard_for(900);
    night.event(300_000, "reference_taken", "reference taken: another master has written it", None);
    let body = json!({ "from": "running", "to": "stopping", "cause": { "by": "policy", "policy": "reference_taken" } });
    night.event(300_100, "state_changed", "state changed: running to stopping", Some(body));
    let story = night.told(300_000);
    let seen = story.why(Certainty::Seen);
    assert!(
        seen.contains("this program ended the run by itself") && seen.contains("running to stopping"),
        "{story:?}"
    );
}

#[test]
fn what_is_found_behind_a_silence_is_told_with_the_stop_that_was_asked_for_meanwhile() {
    let mut night = Written::begin("found-asked");
    night.heard_between(&[(0, 296), (301, 400)]);
    night.asked(300_700, "stop", "ramp stop by local from socket uid 0: confirmed");
    let body = json!({ "from": "running", "to": "stopping", "cause": { "by": "found" } });
    night.event(301_000, "state_changed", "state changed: running to stopping", Some(body));
    let story = night.told(300_900);
    assert!(story.why(Certainty::Likely).contains("ramp stop by local"), "{story:?}");
}

#[test]
fn a_drive_that_was_seen_to_trip_later_was_not_found_tripped_at_the_same_time() {
    for (at, is_told) in [(310_500, false), (303_000, true)] {
        let mut night = silent(&format!("seen-later-{at}"));
        night.event(306_001, "tripped", "tripped, found so: 9 OCF: overcurrent", found(false));
        let body = fault(false, false).map(|body| serde_json::from_str(&body).unwrap());
        night.kept(Kind::Event, Some("pump 2"), at, "tripped", "tripped: 18 ObF: DC bus overvoltage", body);
        let story = night.told(306_000);
        assert_eq!(
            story.why(Certainty::NotKnown).contains("found tripped too: pump 2"),
            is_told,
            "{story:?}"
        );
    }
}

#[test]
fn how_a_drive_was_before_its_trip_is_not_told_by_the_trip() {
    let mut night = Written::begin("before-fault");
    let mut tracker = Tracker::default();
    for half in 500..640 {
        let (state, output) = if half < 595 { (RUNNING, 3_000) } else { (FAULT, 0) };
        let values = [(Quantity::STATE, state), (Quantity::OUTPUT_FREQUENCY, output)];
        night.shown(Set::Status, tracker.see(half * 500, 3_000, &values).unwrap());
    }
    night.event(300_000, "tripped", "tripped: 3 OC3: overcurrent at constant speed", None);
    let story = night.told(299_500);
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz"), "{:?}", story.before);
}

/// A reset at the panel, some seconds behind a trip.
#[test]
fn a_drive_that_was_in_fault_before_something_else_is_told_in_fault() {
    let mut night = Written::begin("in-fault");
    let mut tracker = Tracker::default();
    for half in 500..660 {
        let (state, output) = if half < 600 { (RUNNING, 3_000) } else { (FAULT, 0) };
        let values = [(Quantity::STATE, state), (Quantity::OUTPUT_FREQUENCY, output)];
        night.shown(Set::Status, tracker.see(half * 500, 3_000, &values).unwrap());
    }
    night.event(300_000, "tripped", "tripped: 3 OC3: overcurrent at constant speed", None);
    night.event(309_000, "fault_cleared", "fault cleared", None);
    let story = night.told(309_000);
    assert!(story.before[0].text.starts_with("fault, output 0.00 Hz"), "{:?}", story.before);
}

#[test]
fn how_a_drive_was_is_told_by_what_was_read_of_it_last_where_that_is_some_seconds_ago() {
    let mut night = Written::begin("before-silence");
    let mut tracker = Tracker::default();
    for second in (200..=296).chain(301..340) {
        let values = [(Quantity::STATE, RUNNING)];
        night.shown(Set::Status, tracker.see(second * 1_000, 1_500, &values).unwrap());
    }
    night.event(
        300_500,
        "lost",
        "lost for 3.8 s: the answer was damaged (CRC)",
        Some(json!({ "silent_for_ms": 3_800 })),
    );
    let story = night.told(299_000);
    assert!(story.before[0].text.starts_with("running (as it was read last"), "{:?}", story.before);
}

#[test]
fn whoever_asks_at_once_is_told_what_may_not_be_there_yet() {
    for (end, is_fresh) in [(303_000, true), (420_000, false)] {
        let mut night = Written::begin(&format!("fresh-{end}"));
        night.heard_for(303);
        night.event(300_000, "lost", "lost for 1.9 s: no answer", lost());
        night.kept(Kind::Event, Some("pump 2"), 200_000, "connected", "connected: ready", None);
        let story = night.told_until(299_000, end);
        let open: Vec<&str> = story.not_known.iter().map(|one| &*one.text).collect();
        assert_eq!(open.iter().any(|text| text.contains("may not be there yet")), is_fresh, "{open:?}");
        let seen = story.why(Certainty::Seen);
        assert_eq!(
            seen.contains("no other drive of its line is recorded as fallen silent"),
            !is_fresh,
            "{story:?}"
        );
    }
}

#[test]
fn a_silent_line_is_told_as_silent_where_its_alarm_speaks_of_the_port() {
    let mut night = Written::begin("silent-line");
    night.heard_for(900);
    night.event(300_000, "lost", "lost for 1.9 s: no answer", lost());
    let detail = "nothing was heard for 8.0 s, whoever was asked";
    let text = format!("the port of the line is away, none of its drives can be reached: {detail}");
    let body = json!({ "kind": "line_away", "detail": detail });
    night.kept(Kind::Alarm, None, 306_000, "unacknowledged", &text, Some(body));
    let course = night.told(298_500).course();
    assert!(course.contains(detail) && !course.contains("port"), "{course}");
}

#[test]
fn a_drive_that_says_that_its_panel_commands_it_is_not_told_as_moved_by_another_master() {
    let mut night = Written::begin("by-panel");
    let mut tracker = Tracker::default();
    for second in 200..340 {
        let values = [(Quantity::STATE, RUNNING), (Quantity::CONTROL, PANEL)];
        night.shown(Set::Status, tracker.see(second * 1_000, 3_000, &values).unwrap());
    }
    night.stops(300_000);
    let story = night.told(299_500);
    assert!(story.why(Certainty::Said).contains("commanded by: panel"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("another master"), "{story:?}");
}

#[test]
fn a_program_that_stood_still_does_not_tell_that_a_drive_had_not_answered() {
    let mut night = silent("stood-still");
    let body = json!({ "since_unix_ms": super::NIGHT_MS + 298_400 });
    let text = "this program stood still for 7.5 s until now: it asked nobody and saw nothing in that time";
    night.kept(Kind::History, None, 305_900, "stood_still", text, Some(body));
    let story = night.told(299_500);
    assert_eq!(
        story.why(Certainty::Seen).matches("this program stood still for 7.5 s").count(),
        1,
        "{story:?}"
    );
    assert!(!story.why(Certainty::NotKnown).contains(OPEN), "{story:?}");
}

#[test]
fn a_time_behind_everything_that_is_kept_has_no_length_below_nothing() {
    let mut night = Written::begin("behind-all");
    night.stops(300_000);
    let story = night.told(90_000_000);
    assert!(story.not_known.iter().all(|one| !one.text.contains('-')), "{:?}", story.not_known);
}

#[test]
fn a_supply_that_was_away_for_two_seconds_is_told_as_one_that_was_away_for_ten() {
    let mut night = Written::begin("short-loss");
    night.heard_between(&[(0, 298), (302, 400)]);
    night.event(300_900, "lost", "lost for 2.0 s: no answer", Some(json!({ "silent_for_ms": 2_000 })));
    let shown = json!({ "status": { "state": "disabled", "control": "bus" } });
    night.event(301_900, "connected", "connected: disabled", Some(shown));
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(301_900, "command_overridden", text, None);
    night.archive.end_run(&mut night.store.connection, super::on_wall(900_000)).unwrap();
    for at in [299_000, 301_900] {
        let story = super::tell(&night.store.connection, "pump 1", super::NIGHT_MS + at).unwrap();
        assert!(story.why(Certainty::Likely).contains("its supply was away"), "{story:?}");
        assert!(!story.why(Certainty::NotKnown).contains(OPEN), "{story:?}");
        assert!(!story.why(Certainty::NotKnown).contains("heard all the time"), "{story:?}");
    }
}

#[test]
fn a_drive_that_answers_by_exceptions_is_not_told_as_cut_off() {
    let mut night = Written::begin("busy");
    night.heard_between(&[(0, 296), (306, 400)]);
    let text = "lost for 3.8 s: slave 2, reading register 3201 (0C81h): exception 06h, the drive is busy";
    night.event(300_000, "lost", text, lost());
    let shown = json!({ "status": { "state": "running", "control": "bus" } });
    night.event(306_000, "connected", "connected: running", Some(shown));
    let story = night.told(299_000);
    assert!(!story.why(Certainty::Likely).contains("cable"), "{story:?}");
    assert!(story.why(Certainty::Said).contains("it answered, by exceptions"), "{story:?}");
}

#[test]
fn an_input_that_changed_seconds_before_did_not_do_what_came_behind_it() {
    let mut night = Written::begin("input-before");
    night.slow_set(Quantity::INPUTS, &[(290_000, 0), (295_000, 1), (310_000, 1)]);
    night.stops(300_000);
    let story = night.told(299_500);
    assert!(!story.why(Certainty::Likely).contains("an input of the drive"), "{story:?}");
}

#[test]
fn values_that_move_behind_the_next_event_are_not_told_of_a_moment_before_it() {
    let mut night = Written::begin("moves-later");
    let mut tracker = Tracker::default();
    for second in 200..340 {
        let output = if second < 312 { 3_000 } else { 0 };
        let values = [(Quantity::STATE, RUNNING), (Quantity::OUTPUT_FREQUENCY, output)];
        night.shown(Set::Status, tracker.see(second * 1_000, 3_000, &values).unwrap());
    }
    night.asked(311_500, "stop", "ramp stop by anna from http 10.0.0.7: confirmed");
    let story = night.told(300_500);
    assert!(!story.why(Certainty::Seen).contains("its values moved"), "{story:?}");
}
