//! What was told as certain and was not so, in nights that somebody had staged who knew what he did: each as his diary has it.

use serde_json::json;

use super::{Certainty, Says as _, Story, Written};
use crate::{
    quantity::{Quantity, Set},
    record::Kind,
    tracker::Tracker,
};

/// As the file has them: the places of their words.
const READY: i64 = 2;
const RUNNING: i64 = 3;
const FAULT: i64 = 7;
const BUS: i64 = 0;
const TERMINALS: i64 = 1;
const PANEL: i64 = 2;

const OVERRIDDEN: &str = "command overridden: another word, or a power cycle, that took the place of the run command, decides instead: start it again if it is to run";

impl Written {
    /// Its status is read every half second from 250 to 340 s, and shows this.
    fn status(&mut self, shown: impl Fn(i64) -> Vec<(Quantity, i64)>) {
        let mut tracker = Tracker::default();
        for at in (500..680).map(|half| half * 500) {
            self.shown(Set::Status, tracker.see(at, 3_000, &shown(at)).unwrap());
        }
    }

    /// It runs at 30 Hz, and from a moment on it shows these outputs, and then 0, with which it is ready.
    fn ramps_down(&mut self, from: i64, outputs: &[i64]) {
        let outputs = outputs.to_vec();
        self.status(|at| {
            let place = usize::try_from((at - from).div_euclid(500));
            let output = place.map_or(3_000, |place| outputs.get(place).copied().unwrap_or_default());
            let state = if output > 0 { RUNNING } else { READY };
            vec![(Quantity::STATE, state), (Quantity::OUTPUT_FREQUENCY, output)]
        });
    }
}

fn everything(story: &Story) -> String {
    let about = story.about.as_ref().map(|about| about.text.clone()).unwrap_or_default();
    let why: Vec<&str> = story.why.iter().map(|one| &*one.text).collect();
    format!("{about}\n{}\n{}", why.join("\n"), story.course())
}

/// Another master wrote the run command to 0 at 296.0 s; the drive told it when it stood.
#[test]
fn a_run_command_that_went_with_a_motor_that_ramps_down_went_before_that_ramp() {
    let mut night = Written::begin("certain-ramp");
    night.ramps_down(296_500, &[2_280, 1_260, 290]);
    let text = "its run command went between two readings that lie 0.5 s apart, and its reference stayed at 30.00 Hz";
    let body = json!({ "reference_before_hz": 30.0, "reference_hz": 30.0, "unread_ms": 500 });
    night.event(298_001, "command_gone", text, Some(body));
    night.stops(298_002);
    night.event(298_002, "command_overridden", OVERRIDDEN, None);
    let story = night.told(298_000);
    assert!(!everything(&story).contains("between two readings"), "{story:?}");
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("its output had been falling from 30.00 Hz for 1.5 s"), "{story:?}");
    assert!(seen.contains("its reference stayed at 30.00 Hz"), "{story:?}");
    assert!(story.why(Certainty::Likely).contains("another word was written to it"), "{story:?}");
    assert!(story.before[0].text.starts_with("running, output 2.90 Hz"), "{:?}", story.before);
    assert!(story.before[1].text.contains("read lower: running, output 30.00 Hz"), "{:?}", story.before);
    let about = story.about.unwrap();
    assert_eq!(about.certainty, Certainty::Likely, "{about:?}");
    assert_eq!(about.text, "its run command went by another word that was written to it");
}

/// Another master wrote OFF1 and a setpoint; this program withdrew its run command 2.6 s later, from a motor that came to a standstill.
#[test]
fn a_run_that_was_ending_was_not_ended_by_what_this_program_did_upon_it() {
    for at in [300_500, 302_600] {
        let mut night = Written::begin(&format!("certain-policy-{at}"));
        night.ramps_down(300_500, &[2_335, 1_800, 1_200, 600]);
        night.event(300_502, "reference_taken", "reference taken: another setpoint than was given", None);
        let by_policy = json!({ "cause": { "by": "policy", "policy": "reference_taken" } });
        night.event(302_600, "command", "command: withdrawal of the run command", Some(by_policy));
        let body = json!({ "from": "running", "to": "ready", "cause": { "by": "policy", "policy": "reference_taken" } });
        night.event(302_601, "state_changed", "state changed: running to ready", Some(body));
        let story = night.told(at);
        let seen = format!("{}\n{}", story.why(Certainty::Seen), story.course());
        assert!(!seen.contains("by its policy: ") && !seen.contains("ready (by this program"), "{story:?}");
        let open = story.why(Certainty::NotKnown);
        assert!(open.contains("this program withdrew its run command"), "{story:?}");
        assert!(open.contains("whether that or what had begun before it ended the run"), "{story:?}");
    }
}

/// Another master cleared the bit by which the bus commands (ATV21 FA00 bit 15): the terminals command, and no run command of anybody stands.
#[test]
fn where_the_terminals_command_no_other_run_command_of_a_master_is_told() {
    let mut night = Written::begin("certain-terminals");
    night.status(|at| {
        let control = if (260_000..300_000).contains(&at) { BUS } else { TERMINALS };
        vec![(Quantity::STATE, if at < 300_000 { RUNNING } else { 4 }), (Quantity::CONTROL, control)]
    });
    night.changed(300_001, "running", "stopping", "drive");
    night.event(300_001, "control_taken", "control taken by terminals", None);
    let text = "command overridden: another run command, which took the place of the one that was given, decides instead: see which master has given it, and stop the motor unless it is to run";
    night.event(300_001, "command_overridden", text, None);
    let story = night.told(299_500);
    assert!(!everything(&story).contains("another run command"), "{story:?}");
    let about = &story.about.as_ref().unwrap().text;
    assert!(about.starts_with("command overridden") && about.contains("terminals"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("another master"), "{story:?}");
}

/// Somebody gave the panel back.
#[test]
fn control_that_falls_back_to_where_it_was_before_was_taken_by_nobody() {
    let mut night = Written::begin("certain-released");
    night.status(|at| {
        let control = if (260_000..300_000).contains(&at) { PANEL } else { TERMINALS };
        vec![(Quantity::STATE, READY), (Quantity::CONTROL, control)]
    });
    night.event(300_001, "control_taken", "control taken by terminals", None);
    let story = night.told(299_500);
    assert!(!everything(&story).contains("control taken"), "{story:?}");
    let about = &story.about.as_ref().unwrap().text;
    assert_eq!(about, "commanded by terminals again, as before, and by panel no longer", "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("given up"), "{story:?}");
    // Who takes the panel takes it.
    let mut taken = Written::begin("certain-taken");
    taken.status(|at| {
        let control = if at < 300_000 { TERMINALS } else { PANEL };
        vec![(Quantity::STATE, READY), (Quantity::CONTROL, control)]
    });
    taken.event(300_001, "control_taken", "control taken by panel", None);
    let story = taken.told(299_500);
    assert!(story.why(Certainty::Said).contains("control taken by panel"), "{story:?}");
}

/// An input reset the drive, which empties its run command too.
#[test]
fn a_reset_by_an_input_is_told_as_a_reset_and_not_as_control_that_was_taken() {
    let mut night = Written::begin("certain-reset");
    night.status(|at| {
        let control = if (260_000..300_000).contains(&at) { BUS } else { TERMINALS };
        let state = if at < 290_000 {
            RUNNING
        } else if at < 300_000 {
            FAULT
        } else {
            READY
        };
        vec![(Quantity::STATE, state), (Quantity::CONTROL, control)]
    });
    night.event(290_001, "tripped", "tripped: 16 OH: overheat", None);
    night.changed(300_001, "fault", "ready", "drive");
    night.event(300_001, "fault_cleared", "fault cleared", Some(json!({ "cause": { "by": "drive" } })));
    night.event(300_001, "control_taken", "control taken by terminals", None);
    let story = night.told(299_500);
    assert_eq!(story.about.as_ref().unwrap().text, "fault cleared", "{story:?}");
    assert!(story.why(Certainty::Seen).contains("nobody here asked for it"), "{story:?}");
    assert!(!everything(&story).contains("control taken"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("which of its inputs and keys"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("its terminals, another master"), "{story:?}");
}

/// The panel was taken at 300.0 s, and its STOP key pressed a second and a half later.
#[test]
fn who_asks_for_the_second_of_a_stop_is_told_of_the_stop_and_not_of_what_was_before_it() {
    let mut night = Written::begin("certain-second");
    night.heard_for(900);
    night.event(300_244, "control_taken", "control taken by local", None);
    night.stops(301_703);
    night.event(301_704, "stop_key", "stopped by the STOP key of the drive", None);
    let story = night.told(301_000);
    assert_eq!(story.about.as_ref().unwrap().text, "state changed: running to ready", "{story:?}");
    assert!(story.why(Certainty::Said).contains("the STOP key"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("control taken by local"), "{story:?}");
}

/// The clock was set forward by an hour two tenths of a second behind the moment.
#[test]
fn a_clock_that_was_set_with_the_moment_is_told_with_it() {
    let mut night = Written::begin("certain-clock");
    night.heard_between(&[(0, 290)]);
    let (from, to) = (super::NIGHT_MS + 290_200, super::NIGHT_MS + 290_200 + 3_600_000);
    let body = json!({ "from_unix_ms": from, "to_unix_ms": to });
    let text = "the clock was set forward by 3600.0 s";
    night.kept(Kind::History, None, 3_890_200, "clock_stepped", text, Some(body));
    let story = night.told(290_000);
    assert!(story.why(Certainty::Seen).contains(text), "{story:?}");
}

#[test]
fn a_drive_that_answered_by_exceptions_or_damaged_was_read_again_and_not_heard_again() {
    for (name, text) in [
        ("busy", "lost for 3.0 s: slave 2, reading register 3201 (0C81h): exception 06h, the drive is busy"),
        ("damaged", "lost for 3.0 s: slave 5, reading register 64769 (FD01h): the answer was damaged (CRC)"),
    ] {
        let mut night = Written::begin(&format!("certain-{name}"));
        night.heard_between(&[(0, 297), (306, 400)]);
        night.event(300_000, "lost", text, Some(json!({ "silent_for_ms": 3_000 })));
        night.event(306_000, "connected", "connected: running", None);
        let told = everything(&night.told(297_000));
        assert!(!told.contains("heard again") && !told.contains("heard last"), "{told}");
        assert!(told.contains("its status was read again 9.0 s after it was read last"), "{told}");
    }
}

#[test]
fn what_came_seconds_behind_the_moment_that_is_asked_for_is_told_with_how_much_later_it_came() {
    let told = |at: i64| {
        let mut night = Written::begin("certain-seconds-later");
        night.status(|at| vec![(Quantity::STATE, if at < 309_000 { RUNNING } else { FAULT })]);
        night.event(309_040, "tripped", "tripped: 17 OLF: motor overload", None);
        night.told(at)
    };
    let later = "nothing is recorded of it at the moment that was asked for: this is the next, ";
    let story = told(301_000);
    assert!(story.about.as_ref().unwrap().text.contains("OLF"), "{story:?}");
    assert!(story.why[0].text.starts_with(&format!("{later}8.0 s later")), "{story:?}");
    // As exactly as a clock is read and a drive is polled it is then, and the minute is what it is asked as.
    for at in [307_000, 300_000] {
        let story = told(at);
        assert!(story.why.iter().all(|why| !why.text.starts_with(later)), "{at}: {story:?}");
    }
}

/// The load rose 3.3 s later, and the trip came 10 s behind that.
#[test]
fn a_moment_before_something_is_told_as_one_at_which_nothing_happened() {
    let mut night = Written::begin("certain-later");
    night.status(|at| {
        let state = if at < 315_000 { RUNNING } else { FAULT };
        let output = if at < 315_000 { 3_000 } else { 0 };
        let current = if at < 305_500 { 12 } else { 64 };
        vec![(Quantity::STATE, state), (Quantity::OUTPUT_FREQUENCY, output), (Quantity::CURRENT, current)]
    });
    night.event(315_040, "tripped", "tripped: 17 OLF: motor overload", None);
    let story = night.told(302_000);
    assert_eq!(story.about, None, "{story:?}");
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("nothing happened to it then that is recorded"), "{story:?}");
    assert!(!seen.contains("its output went"), "{story:?}");
    assert!(seen.contains("3.5 s after it its current went from 1.2 to 6.4 A"), "{story:?}");
}

/// The simulator was off from 300.0 to 307.0 s; then another drive stood at the address.
#[test]
fn a_port_that_is_back_is_told_so_and_not_as_why_a_drive_is_still_not_heard() {
    let night = |name: &str| {
        let mut night = Written::begin(name);
        night.heard_between(&[(0, 300)]);
        let lost = || Some(json!({ "silent_for_ms": 900 }));
        let text = "lost for 0.9 s: slave 2, reading register 3201 (0C81h): the line is down (there is no serial port)";
        night.event(300_900, "lost", text, lost());
        let detail = "there is no serial port";
        let text = format!("the port of the line is away, none of its drives can be reached: {detail}");
        let body = || Some(json!({ "kind": "line_away", "detail": detail }));
        night.kept(Kind::Alarm, None, 300_906, "unacknowledged", &text, body());
        night.kept(Kind::Event, Some("pump 2"), 307_800, "connected", "connected: ready", None);
        night.event(307_840, "other_family", "other family: an Altivar 21: the family atv21 fits", None);
        night.kept(Kind::Alarm, None, 309_700, "over", &text, body());
        night
    };
    let then = night("certain-port").told(300_500);
    let seen = then.why(Certainty::Seen);
    assert!(seen.contains("the port of the line was away"), "{then:?}");
    assert!(seen.contains("it was there again 7.8 s after that drive was read last"), "{then:?}");
    let later = night("certain-port-back").told(327_000);
    assert!(later.about.as_ref().unwrap().text.starts_with("other family"), "{later:?}");
    assert!(!later.why(Certainty::Seen).contains("the port of the line was away"), "{later:?}");
}

/// Another master stopped the motor and started it again; the panel did the same of another drive, and an input reset a third.
#[test]
fn a_minute_with_several_events_tells_all_of_them_in_their_order_and_the_end_of_the_program_last() {
    let mut night = Written::begin("certain-several");
    night.heard_for(900);
    night.event(303_671, "command_overridden", OVERRIDDEN, None);
    night.changed(322_137, "disabled", "running", "drive");
    night.asked(340_000, "setpoint", "setpoint 12.50 Hz by hmi from mqtt: confirmed");
    let by_exit =
        json!({ "from": "running", "to": "stopping", "cause": { "by": "policy", "policy": "exit" } });
    night.event(350_000, "state_changed", "state changed: running to stopping", Some(by_exit));
    let story = night.told(300_000);
    assert!(story.about.as_ref().unwrap().text.starts_with("command overridden"), "{story:?}");
    let seen = story.why(Certainty::Seen);
    let places: Vec<_> = [
        "18.5 s later: state changed: disabled to running",
        "36.3 s later: setpoint 12.50 Hz by hmi",
        "46.3 s later: state changed: running to stopping",
    ]
    .map(|text| seen.find(text))
    .to_vec();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?} {story:?}");
}

#[test]
fn the_end_of_the_program_hides_nothing_that_somebody_asked_for() {
    let mut night = Written::begin("certain-exit");
    night.heard_for(900);
    night.asked(303_000, "setpoint", "setpoint 12.50 Hz by hmi from mqtt: confirmed");
    let by_exit =
        json!({ "from": "running", "to": "stopping", "cause": { "by": "policy", "policy": "exit" } });
    night.event(339_000, "state_changed", "state changed: running to stopping", Some(by_exit));
    let story = night.told(300_000);
    assert!(story.about.as_ref().unwrap().text.starts_with("setpoint 12.50 Hz by hmi"), "{story:?}");
}

/// STOP ALL: the state of a drive by profile is read before the fleet's answer is.
#[test]
fn a_stop_of_all_that_came_before_it_leaves_no_four_others_open() {
    let mut night = Written::begin("certain-stop-all");
    night.heard_for(900);
    night.asked(303_002, "stop", "ramp stop of all 7 drives by anonymous from http: confirmed");
    night.changed(303_409, "running", "stopping", "drive");
    night.changed(304_868, "stopping", "ready", "command");
    let story = night.told(303_000);
    let story_at = story.about.as_ref().unwrap();
    assert!(story_at.text.contains("running to stopping"), "{story:?}");
    assert!(story.why(Certainty::Likely).contains("ramp stop of all 7 drives by anonymous"), "{story:?}");
    assert!(story.why(Certainty::Seen).contains("what followed was done for bert"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).contains("which of them it was is not known"), "{story:?}");
}

/// `panel`, who may only stop, asked over MQTT for a start.
#[test]
fn a_start_that_the_broker_s_face_refused_is_told_to_who_asks_for_its_drive_and_no_other() {
    for (drive, is_told) in [("pump 1", true), ("pump 11", false)] {
        let mut night = Written::begin(&format!("certain-refused-{is_told}"));
        night.heard_for(900);
        let text = format!("{drive}: start by panel from mqtt: refused: panel has no right to operate");
        night.kept(Kind::Notice, None, 300_205, "command_refused", &text, None);
        let story = night.told(300_000);
        let about = story.about.as_ref().map(|about| &*about.text);
        assert_eq!(about, is_told.then_some(&*text), "{story:?}");
        assert_eq!(story.course().contains("by panel from mqtt"), is_told, "{story:?}");
    }
}
