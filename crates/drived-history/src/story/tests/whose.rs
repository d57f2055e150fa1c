//! Whose doing something was told to be, and was not, in nights that an outsider had staged.

use serde_json::json;

use super::{Certainty, Says as _, Written};
use crate::record::Kind;

const BOB: &str = "ramp stop by bob from socket uid 0: confirmed";

impl Written {
    /// Bob asks for a stop at 300 s, and the drive stands with the bit of its STOP key set (BBV51701 p. 21, ETA bit 14).
    fn stops_by_key(&mut self) {
        self.event(300_005, "stop_key", "stopped by the STOP key of the drive", None);
        let cause = json!({ "by": "command", "commander": "bob", "door": "socket uid 0" });
        let body = json!({ "from": "running", "to": "disabled", "cause": cause });
        self.event(300_005, "state_changed", "state changed: running to disabled", Some(body));
    }
}

/// The key was pressed first, and 0.1 s later bob asked for a ramp.
#[test]
fn what_the_stop_key_did_as_the_drive_says_itself_is_not_told_as_somebody_elses_doing() {
    let mut night = Written::begin("whose-key");
    night.asked(299_970, "stop", BOB);
    night.stops_by_key();
    let story = night.told(300_000);
    assert!(story.why(Certainty::Said).contains("STOP key"), "{story:?}");
    assert!(!story.why(Certainty::Seen).contains("bob asked for it"), "{story:?}");
    let open = story.why(Certainty::NotKnown);
    assert!(open.contains("a stop was asked for here too: ramp stop by bob"), "{story:?}");
    assert!(!story.course().contains("disabled (by bob"), "{story:?}");
}

/// Its withdrawal found no run command: a word of another master had taken it.
#[test]
fn a_withdrawal_that_found_nothing_to_be_done_has_ended_no_run() {
    let mut night = Written::begin("whose-nothing");
    let by_policy = json!({ "by": "policy", "policy": "control_taken" });
    let text = "command overridden: another run command, which took the place of the one that was given";
    night.event(299_000, "command_overridden", text, None);
    let text = "command: withdrawal of the run command by control taken: nothing to be done: no run command of this side stood any more";
    night.event(299_600, "command", text, Some(json!({ "cause": by_policy })));
    let body = json!({ "from": "stopping", "to": "ready", "cause": by_policy });
    night.event(300_000, "state_changed", "state changed: stopping to ready", Some(body));
    let story = night.told(300_000);
    let all = format!("{}\n{}", story.why(Certainty::Seen), story.course());
    assert!(!all.contains("ready (by this program"), "{story:?}");
    assert!(!all.contains("this program withdrew") && !all.contains("by its policy: "), "{story:?}");
}

/// The drive's cable was off: what bob was told was that his stop is not confirmed. It was, when the drive was back.
#[test]
fn a_stop_that_is_told_as_unconfirmed_is_not_told_as_confirmed_beside_it() {
    let mut night = Written::begin("whose-unconfirmed");
    let late = json!({ "outcome": "confirmed", "took_ms": 9_984 });
    night.kept(Kind::Command, Some("pump 1"), 298_000, "stop", BOB, Some(late));
    night.event(300_000, "stop_unconfirmed", "stop unconfirmed since 2.0 s", None);
    let story = night.told(300_000);
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("the stop was asked for here: ramp stop by bob from socket uid 0"), "{story:?}");
    let all = format!("{seen}\n{}", story.course());
    assert!(all.contains("uid 0: confirmed 10.0 s later"), "{story:?}");
    assert_eq!(
        all.matches(": confirmed").count(),
        all.matches(": confirmed 10.0 s later").count(),
        "{story:?}"
    );
}

/// An Altivar 58 gives a code that its manual does not list, behind a silence that was longer than its watchdog's time.
#[test]
fn a_code_that_nobody_knows_is_not_told_as_that_of_the_watchdog() {
    let mut night = Written::begin("whose-code");
    let text = "tripped, found so after 19.9 s without a message: 9 ?: a code that the manual does not list";
    let body =
        json!({ "fault": { "code": 9, "by_watchdog": false, "watchdog_after_ms": 19_900, "found": true } });
    night.event(300_000, "tripped", text, Some(body));
    let story = night.told(300_000);
    let open = story.why(Certainty::NotKnown);
    assert!(open.contains("whether that tripped it, its code does not say"), "{story:?}");
    let said = story.why(Certainty::Said);
    assert!(
        said.contains("and not what that means") && !said.contains("says what it tripped by"),
        "{story:?}"
    );
}

/// Its values are read every half second, and are not written yet.
#[test]
fn what_is_not_written_yet_is_told_as_that() {
    let mut night = Written::begin("whose-early");
    night.event(339_000, "tripped", "tripped: 9 OCF: overcurrent", None);
    let story = night.told(339_000);
    assert!(!story.why(Certainty::NotKnown).contains("below"), "{story:?}");
}

/// An input had cut the output (BBV51701 p. 41, nSt); a tenth of a second later bob, who saw it, asked for a ramp.
#[test]
fn what_is_off_at_once_behind_a_ramp_that_was_asked_for_is_told_as_open() {
    for (to, is_open) in [("disabled", true), ("stopping", false)] {
        let mut night = Written::begin(&format!("whose-quick-{to}"));
        night.asked(299_970, "stop", BOB);
        let cause = json!({ "by": "command", "commander": "bob", "door": "socket uid 0" });
        let body = json!({ "from": "running", "to": to, "cause": cause });
        night.event(300_006, "state_changed", &format!("state changed: running to {to}"), Some(body));
        let story = night.told(300_000);
        assert_eq!(story.why(Certainty::NotKnown).contains("which no ramp does"), is_open, "{story:?}");
    }
}

/// The adapter was off for eight seconds; another master zeroed the pump meanwhile, and the other drive came back running.
#[test]
fn what_feeds_several_was_not_away_where_one_of_them_ran_on() {
    for (state, is_told) in [("running", false), ("ready", true)] {
        let mut night = Written::begin(&format!("whose-mains-{state}"));
        night.heard_between(&[(0, 297), (306, 400)]);
        let lost = || Some(json!({ "silent_for_ms": 3_000 }));
        night.event(300_000, "lost", "lost for 3.0 s: off-line", lost());
        night.kept(Kind::Event, Some("pump 2"), 300_100, "lost", "lost for 3.0 s: off-line", lost());
        let shown = |state: &str| Some(json!({ "status": { "state": state, "control": "bus" } }));
        night.event(306_000, "connected", "connected", shown("ready"));
        night.kept(Kind::Event, Some("pump 2"), 306_100, "connected", "connected", shown(state));
        let text =
            "command overridden: another word, or a power cycle, that took the place of the run command";
        night.event(306_010, "command_overridden", text, None);
        let story = night.told(306_000);
        assert!(story.why(Certainty::Seen).contains("pump 2 fell silent with it"), "{story:?}");
        assert_eq!(story.why(Certainty::Likely).contains("such as the mains"), is_told, "{story:?}");
    }
}
