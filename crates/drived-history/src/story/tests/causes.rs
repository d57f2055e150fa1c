//! What each cause needs as its evidence: with it it is told, and without it it is not.

use serde_json::{Value, json};

use super::{Certainty, Says as _, Written};
use crate::{
    quantity::{Quantity, Set},
    record::Kind,
    tracker::Tracker,
    write::inbox::{Batch, Shown},
};

/// What an older program told of whatever followed its own act.
fn by_policy(policy: &str, from: &str, to: &str) -> Option<Value> {
    Some(json!({ "from": from, "to": to, "cause": { "by": "policy", "policy": policy } }))
}

#[test]
fn what_an_old_record_tells_as_a_policys_doing_is_believed_of_what_that_can_do() {
    let mut night = Written::begin("old-record");
    night.event(300_000, "tripped", "tripped: 16 OHF: drive overheating", None);
    night.event(300_100, "command", "command: withdrawal of the run command", by_policy("tripped", "", ""));
    night.event(320_000, "fault_cleared", "fault cleared", by_policy("tripped", "fault", "ready"));
    let story = night.told(320_000);
    assert!(!story.why(Certainty::Seen).contains("by its policy"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("nobody here asked for it"), "{story:?}");
    assert!(!story.course().contains("fault cleared (by this program"), "{story:?}");

    let mut night = Written::begin("old-release");
    night.event(300_000, "output_blocked", "output blocked: a stop that the bus has not ordered", None);
    night.event(300_100, "command", "command: withdrawal", by_policy("output_blocked", "", ""));
    let text = "state changed: disabled to ready";
    night.event(305_400, "state_changed", text, by_policy("output_blocked", "disabled", "ready"));
    let story = night.told(305_400);
    assert!(!story.course().contains("disabled to ready (by this program"), "{story:?}");

    let mut night = Written::begin("policy");
    night.event(300_000, "command", "command: stop by ramp by on loss", by_policy("on_loss", "", ""));
    let text = "state changed: running to quick stop";
    night.event(300_100, "state_changed", text, by_policy("on_loss", "running", "quick_stop"));
    let story = night.told(300_000);
    assert!(story.why(Certainty::Seen).contains("by its policy: on loss"), "{story:?}");
}

#[test]
fn a_policys_doing_is_told_with_what_it_acted_upon() {
    let mut night = Written::begin("acted-upon");
    night.event(300_000, "reference_taken", "reference taken: a limit of the drive", None);
    let text = "state changed: running to ready";
    night.event(301_500, "state_changed", text, by_policy("reference_taken", "running", "ready"));
    let story = night.told(304_000);
    assert!(story.about.as_ref().unwrap().text.contains("running to ready"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("acted upon this: reference taken: a limit"), "{story:?}");
}

#[test]
fn a_supply_that_was_away_is_likely_only_of_a_drive_that_was_silent() {
    for is_silent in [true, false] {
        let mut night = Written::begin(&format!("supply-{is_silent}"));
        let mut tracker = Tracker::default();
        for second in (250..340).filter(|second| !is_silent || !(290..300).contains(second)) {
            night.shown(Set::Status, tracker.see(second * 1_000, 3_000, &[(Quantity::STATE, 3)]).unwrap());
        }
        if is_silent {
            night.event(
                292_000,
                "lost",
                "lost for 2.0 s: no answer",
                Some(json!({ "silent_for_ms": 2_000 })),
            );
        }
        let text = "command overridden: another word, or a power cycle, took the place of the run command";
        night.event(300_100, "command_overridden", text, None);
        let story = night.told(299_500);
        let about = &story.about.as_ref().unwrap().text;
        let told =
            if is_silent { "its run command went, likely with its supply" } else { "command overridden" };
        assert!(about.starts_with(told), "{story:?}");
        assert_eq!(story.why(Certainty::Likely).contains("its supply was away"), is_silent, "{story:?}");
    }
}

#[test]
fn two_trips_are_told_as_of_one_cause_by_what_they_say_and_when_and_never_by_chance() {
    let told = |name: &str, own: &str, other: &str, after: i64| {
        let mut night = Written::begin(name);
        night.event(300_000, "tripped", own, None);
        night.kept(Kind::Event, Some("pump 2"), 300_000 + after, "tripped", other, None);
        night.told(300_000)
    };
    let (heat, current) = ("tripped: 16 OHF: drive overheating", "tripped: 0 OC: overcurrent");
    // BBV51701 and I528 of OMRON: what both drives show when the mains go.
    let (low, mains) = ("tripped: 22 USF: line supply undervoltage", "tripped: 12 UV1: loss of the mains");
    for (name, own, other, after) in [
        ("unlike", heat, current, 4_000),
        ("unlike-at-once", heat, current, 100),
        ("late", low, mains, 4_000),
    ] {
        let story = told(name, own, other, after);
        assert_eq!(story.why(Certainty::Likely), "", "{name}: {story:?}");
        let open = story.why(Certainty::NotKnown);
        assert!(
            open.contains("pump 2: tripped: ") && open.contains("nothing shows that one cause"),
            "{open}"
        );
    }
    for (name, own, other) in [("supply", low, mains), ("same", current, current)] {
        let story = told(name, own, other, 900);
        assert!(story.why(Certainty::Likely).contains("pump 2 tripped within 2 s"), "{name}: {story:?}");
    }
    // Four at once are not there by chance, whatever each of them says.
    let mut night = Written::begin("many");
    night.event(300_000, "tripped", heat, None);
    for (drive, text) in [("pump 2", current), ("pump 3", low), ("pump 4", mains)] {
        night.kept(Kind::Event, Some(drive), 301_000, "tripped", text, None);
    }
    let story = night.told(300_000);
    assert!(story.why(Certainty::Likely).contains("pump 2, pump 3, pump 4 tripped"), "{story:?}");
}

#[test]
fn a_time_at_low_speed_is_likely_only_behind_a_setpoint_and_with_inputs_that_stayed() {
    let text = "output blocked: a stop at the drive, by an input, a key, or after tLS at low speed";
    for (name, is_asked, inputs, is_likely) in [
        ("slow", true, [16, 16], true),
        ("no-setpoint", false, [16, 16], false),
        ("input", true, [16, 0], false),
    ] {
        let mut night = Written::begin(name);
        night.slow_set(Quantity::INPUTS, &[(290_000, inputs[0]), (296_000, inputs[0]), (304_000, inputs[1])]);
        if is_asked {
            night.asked(297_000, "setpoint", "setpoint 10.00 Hz by bert from http: confirmed");
        }
        night.event(300_000, "output_blocked", text, None);
        let story = night.told(300_000);
        let likely = story.why(Certainty::Likely);
        assert_eq!(likely.contains("its time at low speed was over"), is_likely, "{name}: {story:?}");
        assert_eq!(likely.contains("an input"), inputs[0] != inputs[1], "{name}: {story:?}");
    }
}

#[test]
fn a_load_that_rose_is_told_by_the_current_where_nothing_is_recorded() {
    let quiet = |name: &str, amperes: i64, hertz: i64| {
        let mut night = Written::begin(name);
        let mut tracker = Tracker::default();
        for second in 290..330 {
            let (current, output) = if second < 301 { (12, 3_000) } else { (amperes, hertz) };
            let values =
                [(Quantity::STATE, 3), (Quantity::OUTPUT_FREQUENCY, output), (Quantity::CURRENT, current)];
            let seen = tracker.see(second * 1_000, 3_000, &values).unwrap();
            night.shown(Set::Status, seen);
        }
        night.told(300_000)
    };
    let load = quiet("load", 103, 3_000);
    assert!(load.about.as_ref().is_some_and(|about| about.text.contains("its current went")), "{load:?}");
    assert!(!load.why(Certainty::Seen).contains("nothing happened"), "{load:?}");
    assert!(load.why(Certainty::Seen).contains("its current went from 1.2 to 10.3 A"), "{load:?}");
    assert!(load.why(Certainty::Likely).contains("the load of its motor rose"), "{load:?}");
    let slower = quiet("slower", 40, 1_000);
    assert!(slower.why(Certainty::Seen).contains("its output went from 30.00 to 10.00 Hz"), "{slower:?}");
    assert!(!slower.why(Certainty::Likely).contains("load"), "{slower:?}");
    let calm = quiet("calm", 13, 3_001);
    assert!(!calm.why(Certainty::Seen).contains("went from"), "{calm:?}");
}

impl Written {
    pub(super) fn shown(&mut self, set: Set, seen: crate::tracker::Seen) {
        let at = super::on_wall(seen.at);
        let shown = vec![Shown { drive: "pump 1".into(), set, seen }];
        self.archive.take(Batch { shown, ..Batch::default() }, at);
    }

    pub(super) fn slow_set(&mut self, quantity: Quantity, read: &[(i64, i64)]) {
        let mut tracker = Tracker::default();
        for (at, count) in read {
            let seen = tracker.see(*at, 20_000, &[(quantity, *count)]).unwrap();
            self.shown(Set::Measurements, seen);
        }
    }
}
