//! What a drive shows that is heard again, and what is read of a drive where its values are not kept yet: on histories that are written by hand.

use serde_json::{Value, json};

use super::{Certainty, Says as _, Story, Written, fault};
use crate::record::Kind;

const LOST: &str = "lost for 1.9 s: slave 1, reading register 3201 (0C81h): the slave is off-line";

fn lost() -> Option<Value> {
    Some(json!({ "silent_for_ms": 1_900 }))
}

/// What the API tells of a drive that is heard.
fn heard(state: &str, control: &str) -> Option<Value> {
    Some(json!({ "status": { "state": state, "control": control } }))
}

/// What is told when a drive is heard again.
type Returns = fn(&mut Written);

/// A drive that runs falls silent, its neighbour too if that is said, and is heard again at 306 s with what follows.
fn silence(name: &str, is_neighbour_lost: bool, back: impl FnOnce(&mut Written)) -> Story {
    let mut night = Written::begin(name);
    night.heard_between(&[(0, 298), (306, 400)]);
    night.event(300_000, "lost", LOST, lost());
    if is_neighbour_lost {
        night.kept(Kind::Event, Some("pump 2"), 300_100, "lost", LOST, lost());
    }
    back(&mut night);
    night.told(299_000)
}

fn runs_on(night: &mut Written) {
    night.event(306_000, "connected", "connected: running, forward, 30.00 Hz", heard("running", "bus"));
}

fn by_watchdog(night: &mut Written) {
    night.event(306_000, "connected", "connected: fault, forward, 0.00 Hz", heard("fault", "bus"));
    let found = |by| fault(by, true).map(|body| serde_json::from_str(&body).unwrap());
    night.event(306_000, "tripped", "tripped, found so", found(false));
    let text =
        "trip explained, found so by its communication watchdog: 5 SLF: Modbus communication interruption";
    night.event(306_700, "trip_explained", text, found(true));
}

fn command_gone(night: &mut Written) {
    night.event(306_000, "connected", "connected: ready, forward, 0.00 Hz", heard("ready", "bus"));
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(306_000, "command_overridden", text, None);
}

#[test]
fn a_drive_that_ran_on_or_whose_watchdog_acted_was_fed_while_it_was_silent() {
    let backs: [(&str, Returns); 2] = [("on", runs_on), ("watchdog", by_watchdog)];
    for (name, back) in backs {
        let story = silence(&format!("fed-{name}"), false, back);
        let likely = story.why(Certainty::Likely);
        assert!(likely.contains("its own branch of the cable") && likely.contains("not away"), "{story:?}");
        assert!(!story.why(Certainty::NotKnown).contains("its supply"), "{story:?}");
        assert!(
            story.why(Certainty::Seen).contains("heard again 7.9 s after it was heard last"),
            "{story:?}"
        );

        let story = silence(&format!("fed-line-{name}"), true, back);
        let likely = story.why(Certainty::Likely);
        assert!(likely.contains("the cable or its adapter; which"), "{story:?}");
        assert!(!likely.contains("or the supply of these drives"), "{story:?}");
    }
}

#[test]
fn a_supply_that_is_likely_is_not_told_as_not_known_with_the_next_line() {
    for is_line in [false, true] {
        let story = silence(&format!("supply-alone-{is_line}"), is_line, command_gone);
        let (likely, open) = (story.why(Certainty::Likely), story.why(Certainty::NotKnown));
        assert!(likely.contains("its supply was away"), "{story:?}");
        assert!(!open.contains("which, the line does not show"), "{story:?}");
        assert!(!likely.contains("cable"), "{story:?}");
    }
}

#[test]
fn a_drive_that_stood_or_may_start_by_itself_or_was_not_heard_again_says_nothing_of_its_supply() {
    let backs: [(&str, Returns); 4] = [
        ("stood", |night| {
            night.event(306_000, "connected", "connected: ready", heard("ready", "bus"));
        }),
        ("terminals", |night| {
            night.event(306_000, "connected", "connected: running", heard("running", "terminals"));
        }),
        ("began to run", |night| {
            night.event(306_000, "connected", "connected: running", heard("running", "bus"));
            let body = json!({ "from": "ready", "to": "running", "cause": { "by": "found" } });
            night.event(306_000, "state_changed", "state changed: ready to running", Some(body));
        }),
        ("never", |_| {}),
    ];
    for (name, back) in backs {
        let story = silence(&format!("open-{name}"), false, back);
        assert_eq!(story.why(Certainty::Likely), "", "{name}: {story:?}");
        assert!(story.why(Certainty::NotKnown).contains("its supply, its branch of the cable"), "{story:?}");
        let is_told = story.why(Certainty::Seen).contains("heard again");
        assert_eq!(is_told, name != "never", "{story:?}");
    }
}

#[test]
fn what_a_drive_showed_before_a_kill_is_known_though_its_values_were_lost() {
    let mut night = Written::begin("kill-known");
    let body = json!({ "from": "ready", "to": "running", "cause": { "by": "command", "commander": "anna" } });
    night.event(203_000, "state_changed", "state changed: ready to running", Some(body));
    night.killed_until(217_000);
    night.event(217_300, "connected", "connected: fault", heard("fault", "bus"));
    let found = fault(false, true).map(|body| serde_json::from_str(&body).unwrap());
    night.event(217_300, "tripped", "tripped, found so: 9 OCF: overcurrent", found);
    let story = night.told(217_000);
    let open = story.why(Certainty::NotKnown);
    assert!(open.contains("within the 14.3 s from this moment on"), "{story:?}");
    let began = story.why.iter().find(|one| one.text.contains("within the")).unwrap();
    assert_eq!(began.time_unix_ms, Some(super::NIGHT_MS + 203_000), "{story:?}");
}

#[test]
fn a_motor_that_stands_behind_a_stop_at_the_drive_is_told_by_that_stop() {
    let text = "output blocked: the STOP key of the drive decides instead";
    for cause in [json!({ "by": "drive" }), json!({ "by": "policy", "policy": "output_blocked" })] {
        let mut night = Written::begin("stop-key");
        night.event(300_000, "output_blocked", text, None);
        let by_policy = json!({ "cause": { "by": "policy", "policy": "output_blocked" } });
        night.event(300_400, "command", "command: withdrawal of the run command", Some(by_policy));
        let body = json!({ "from": "running", "to": "ready", "cause": cause });
        night.event(300_400, "state_changed", "state changed: running to ready", Some(body));
        let story = night.told(303_000);
        assert!(story.about.as_ref().unwrap().text.contains("running to ready"), "{story:?}");
        let told = format!("{}\n{}", story.why(Certainty::Seen), story.course());
        assert!(!told.contains("by its policy") && !told.contains("ready (by this program"), "{story:?}");
        assert!(story.why(Certainty::Said).contains("stopped at the drive"), "{story:?}");
        assert!(story.why(Certainty::Said).contains("the STOP key"), "{story:?}");
    }
}

#[test]
fn a_word_that_went_while_the_drive_was_heard_may_have_gone_by_a_power_cycle_between_two_polls() {
    for is_heard in [true, false] {
        let mut night = Written::begin(&format!("word-{is_heard}"));
        let spans: &[(i64, i64)] = if is_heard { &[(0, 400)] } else { &[(0, 290), (300, 400)] };
        night.heard_between(spans);
        let text =
            "command overridden: another word, or a power cycle, that took the place of the run command";
        night.event(300_000, "command_overridden", text, None);
        let story = night.told(300_000);
        assert!(!story.why(Certainty::Likely).contains("no power cycle"), "{story:?}");
        let open = story.why(Certainty::NotKnown);
        assert_eq!(open.contains("away for less than two polls"), is_heard, "{story:?}");
    }
}

#[test]
fn a_run_command_that_went_is_told_by_what_became_of_its_reference_and_not_by_that_it_was_heard() {
    // What a drive shows that was off, what another master leaves that writes both or only stops it: no drive is fed again, and answers,
    // within a second.
    for (name, reference, apart, headline, told, not) in [
        (
            "supply",
            Some(0.0),
            6_000,
            "its run command went, likely with its supply",
            "its supply was away",
            "was not away",
        ),
        ("both", Some(0.0), 600, "command overridden", "", "its supply was"),
        (
            "word",
            Some(30.0),
            600,
            "its run command went by another word",
            "another word was written to it",
            "its supply was away",
        ),
        ("untold", None, 600, "command overridden", "", "its supply was"),
    ] {
        let mut night = Written::begin(&format!("word-{name}"));
        night.heard_between(&[(0, 400)]);
        let text =
            "command overridden: another word, or a power cycle, that took the place of the run command";
        night.event(300_000, "command_overridden", text, None);
        if let Some(reference) = reference {
            let body = json!({ "reference_before_hz": 30.0, "reference_hz": reference, "unread_ms": apart });
            night.event(300_010, "command_gone", "its run command went", Some(body));
        }
        let story = night.told(300_000);
        let likely = story.why(Certainty::Likely);
        assert!(likely.contains(told) && !likely.contains(not), "{name}: {story:?}");
        assert!(story.about.as_ref().unwrap().text.starts_with(headline), "{story:?}");
        let open = story.why(Certainty::NotKnown);
        assert_eq!(open.contains("away for less than two polls"), reference.is_none(), "{story:?}");
        assert_eq!(open.contains("the reference that it shows is 0"), name == "both", "{story:?}");
    }
}

#[test]
fn a_loss_of_two_seconds_is_told_with_the_run_command_that_went_in_it() {
    let mut night = Written::begin("short-loss-gone");
    night.heard_between(&[(0, 400)]);
    night.event(299_000, "lost", "lost for 1.9 s: no answer", Some(json!({ "silent_for_ms": 1_900 })));
    night.event(301_000, "connected", "connected: disabled", heard("disabled", "bus"));
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(301_000, "command_overridden", text, None);
    let story = night.told(301_000);
    assert!(
        story.why(Certainty::Seen).contains("nothing had been heard of it before, for 3.9 s"),
        "{story:?}"
    );
    assert!(story.why(Certainty::Likely).contains("its supply was away"), "{story:?}");
}

#[test]
fn a_motor_that_its_stop_key_has_stopped_is_told_so_by_the_drive() {
    let mut night = Written::begin("key");
    night.heard_between(&[(0, 400)]);
    night.stops(300_000);
    night.event(300_005, "stop_key", "stopped by the STOP key of the drive", None);
    let story = night.told(300_000);
    assert!(story.why(Certainty::Said).contains("stopped by the STOP key"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("another master"), "{story:?}");
}

#[test]
fn a_silence_in_which_this_program_stood_still_is_told_as_its_own() {
    let mut night = Written::begin("frozen");
    night.heard_between(&[(0, 290), (306, 400)]);
    for drive in ["pump 1", "pump 2"] {
        let body = json!({ "silent_for_ms": 15_300 });
        night.kept(Kind::Event, Some(drive), 305_300, "lost", "lost for 15.3 s", Some(body));
    }
    let body = json!({ "since_unix_ms": super::NIGHT_MS + 290_300 });
    let text = "this program stood still for 15.0 s until now: it asked nobody and saw nothing in that time";
    night.kept(Kind::History, None, 305_310, "stood_still", text, Some(body));
    let story = night.told(305_300);
    assert!(story.why(Certainty::Seen).contains("stood still for 15.0 s"), "{story:?}");
    assert!(!story.why(Certainty::Seen).contains("fell silent"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "", "{story:?}");
}

#[test]
fn a_drive_that_answers_by_exceptions_has_no_cable_to_look_at() {
    let mut night = Written::begin("by-exceptions");
    night.heard_between(&[(0, 290), (300, 400)]);
    let text = "lost for 3.4 s: slave 2, reading register 3201 (0C81h): exception 06h, the drive is busy";
    night.event(293_400, "lost", text, Some(json!({ "silent_for_ms": 3_400 })));
    night.event(300_000, "connected", "connected: running", heard("running", "bus"));
    let story = night.told(293_400);
    assert!(story.why(Certainty::Said).contains("it answered, by exceptions"), "{story:?}");
    assert!(!story.why(Certainty::Likely).contains("cable"), "{story:?}");
}

#[test]
fn an_hour_over_which_the_clock_was_set_is_told_as_one_that_was_not() {
    let mut night = Written::begin("no-such-hour");
    night.heard_between(&[(0, 290)]);
    let (from, to) = (super::NIGHT_MS + 290_000, super::NIGHT_MS + 290_000 + 3_600_000);
    let body = json!({ "from_unix_ms": from, "to_unix_ms": to });
    night.kept(
        Kind::History,
        None,
        3_890_000,
        "clock_stepped",
        "the clock was set forward by 3600.0 s",
        Some(body),
    );
    let story = night.told(700_000);
    assert!(story.why(Certainty::Seen).contains("there was no such time"), "{story:?}");
    assert_eq!(story.why[0].time_unix_ms, Some(to));
}

#[test]
fn a_reference_that_stayed_through_a_silence_speaks_against_its_supply() {
    let story = silence("silent-word", false, |night| {
        command_gone(night);
        let body = json!({ "reference_before_hz": 30.0, "reference_hz": 30.0, "unread_ms": 7_900 });
        night.event(306_010, "command_gone", "its run command went", Some(body));
    });
    let likely = story.why(Certainty::Likely);
    assert!(
        likely.contains("its supply was not away") && !likely.contains("its supply was away"),
        "{story:?}"
    );
    assert!(likely.contains("its own branch of the cable"), "{story:?}");
}
