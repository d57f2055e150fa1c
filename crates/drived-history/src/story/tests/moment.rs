//! How a drive was a moment before, by its readings of nights that somebody had staged.

use serde_json::json;

use super::{Certainty, NIGHT_MS, Says as _, Story, Written};
use crate::{
    quantity::{Quantity, Set},
    tracker::Tracker,
};

/// As the file has them: the places of their words.
const READY: i64 = 2;
const RUNNING: i64 = 3;
const STOPPING: i64 = 4;
const FAULT: i64 = 7;

impl Written {
    /// What its readings showed: state and output, each from its moment on, read every half second until the end.
    pub(super) fn read(&mut self, shown: &[(i64, i64, i64)], end: i64) {
        let mut tracker = Tracker::default();
        for (place, (from, state, output)) in shown.iter().enumerate() {
            let until = shown.get(place + 1).map_or(end, |next| next.0);
            for at in (*from..until).step_by(500) {
                let values = [(Quantity::STATE, *state), (Quantity::OUTPUT_FREQUENCY, *output)];
                self.shown(Set::Status, tracker.see(at, 3_000, &values).unwrap());
            }
        }
    }

    /// Its torque, every ten seconds.
    fn torque(&mut self, readings: &[(i64, i64)]) {
        let mut tracker = Tracker::default();
        for (at, count) in readings {
            self.shown(Set::Measurements, tracker.see(*at, 30_000, &[(Quantity::TORQUE, *count)]).unwrap());
        }
    }
}

fn before(story: &Story) -> String {
    story.before.iter().map(|one| one.text.clone()).collect::<Vec<_>>().join("\n")
}

/// A fan at the end of its ramp: read as stopping from 303.216 s on, with 0.08 Hz at 306.708 s, and as ready at 307.216 s.
#[test]
fn a_motor_that_came_to_stand_was_stopping_a_moment_before() {
    let mut night = Written::begin("moment-ramp");
    let ramp = [
        (200_216, RUNNING, 3_000),
        (303_216, STOPPING, 2_806),
        (304_216, STOPPING, 1_500),
        (306_708, STOPPING, 8),
        (307_216, READY, 0),
    ];
    night.read(&ramp, 340_000);
    night.changed(303_299, "running", "stopping", "drive");
    night.changed(307_287, "stopping", "ready", "drive");
    let story = night.told(307_000);
    assert!(story.about.as_ref().unwrap().text.contains("stopping to ready"), "{story:?}");
    assert!(before(&story).starts_with("stopping, output 0.08 Hz"), "{:?}", story.before);
}

/// A pump whose reference another master had written: 21.40 Hz, then 15.00 Hz, told at 315.858 s with 12.00 Hz.
#[test]
fn an_output_that_was_falling_is_told_as_it_was_read_last_and_how_it_was_before_that_as_that() {
    let mut night = Written::begin("moment-falling");
    let fall = [
        (200_295, RUNNING, 3_000),
        (314_795, RUNNING, 2_140),
        (315_274, RUNNING, 1_500),
        (315_800, RUNNING, 1_200),
    ];
    night.read(&fall, 340_000);
    night.event(
        315_858,
        "reference_taken",
        "reference taken: a reference that another master has written",
        None,
    );
    let story = night.told(316_000);
    assert!(story.before[0].text.starts_with("running, output 15.00 Hz"), "{:?}", story.before);
    assert!(story.before[0].text.contains("as the poll before showed it"), "{:?}", story.before);
    let first = &story.before[1];
    assert!(
        first.text.starts_with("before its output was read lower: running, output 30.00 Hz"),
        "{first:?}"
    );
    assert_eq!(first.time_unix_ms, Some(NIGHT_MS + 314_795), "{first:?}");
}

/// A pump that tripped by overload: 165 % from 314.467 s on, the trip told at 315.182 s, and the next reading of torque at 324.710 s.
#[test]
fn torque_that_is_read_rarely_is_told_with_when_it_was_read_and_not_of_a_motor_that_stands_meanwhile() {
    let night = |name: &str| {
        let mut night = Written::begin(name);
        night.read(&[(200_100, RUNNING, 3_000), (315_100, FAULT, 0)], 400_000);
        night.torque(&[(294_400, 500), (304_400, 500), (314_467, 16_500), (324_710, 0), (334_700, 0)]);
        night.event(315_182, "tripped", "tripped: 17 OLF: motor overload", None);
        night
    };
    let trip = before(&night("moment-torque").told(315_000));
    assert!(trip.starts_with("running, output 30.00 Hz"), "{trip}");
    assert!(
        trip.contains("torque 165.00 % (5.00 at the least in the minute before; read 0.6 s before that)"),
        "{trip}"
    );
    for at in [320_000, 323_000] {
        let story = night(&format!("moment-torque-{at}")).told(at);
        assert!(before(&story).starts_with("fault, output 0.00 Hz"), "{:?}", story.before);
        assert!(!before(&story).contains("torque"), "{:?}", story.before);
        let everything = format!("{story:?}");
        assert!(!everything.contains("the load of its motor"), "{story:?}");
        assert!(!everything.contains("its torque went"), "{story:?}");
    }
}

/// A fan that was read in fault from 326.882 s on, and told as tripped 1.6 s later.
#[test]
fn state_and_output_of_a_trip_that_was_told_late_are_of_one_reading() {
    let mut night = Written::begin("moment-late-trip");
    night.read(&[(200_382, RUNNING, 3_000), (326_882, FAULT, 0)], 400_000);
    night.event(328_465, "tripped", "tripped: OL1: inverter overload", None);
    let story = night.told(328_000);
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz"), "{:?}", story.before);
    assert!(
        story.before[0].text.contains("what is told was read 1.6 s before it was told"),
        "{:?}",
        story.before
    );
}

/// A fan of which one reading had 0.00 Hz and running, and the next one its fault.
#[test]
fn a_reading_of_an_output_that_was_off_already_is_told_with_how_it_was_before_that() {
    let mut night = Written::begin("moment-off-already");
    night.read(&[(200_340, RUNNING, 3_000), (326_840, RUNNING, 0), (328_187, FAULT, 0)], 400_000);
    night.event(328_465, "tripped", "tripped: OL1: inverter overload", None);
    let story = night.told(328_000);
    assert!(story.before[0].text.starts_with("running, output 0.00 Hz"), "{:?}", story.before);
    let first = story.before.get(1).expect("how it was when its output was on");
    assert!(
        first.text.starts_with("before its output was read lower: running, output 30.00 Hz"),
        "{first:?}"
    );
    assert_eq!(first.time_unix_ms, Some(NIGHT_MS + 326_840), "{first:?}");
}

/// A pump without supply for 1.5 s: lost for 1.9 s at 374.586 s, heard again at 375.668 s.
fn without_supply_for_a_moment(name: &str) -> Written {
    let mut night = Written::begin(name);
    let mut tracker = Tracker::default();
    for at in (200_170..373_000).step_by(500).chain((375_600..400_000).step_by(500)) {
        let (state, output) = if at < 374_000 { (RUNNING, 3_000) } else { (READY, 0) };
        let values = [(Quantity::STATE, state), (Quantity::OUTPUT_FREQUENCY, output)];
        night.shown(Set::Status, tracker.see(at, 3_000, &values).unwrap());
    }
    let body = json!({ "silent_for_ms": 1_900 });
    night.event(374_586, "lost", "lost for 1.9 s: the slave is off-line", Some(body));
    night.event(375_668, "connected", "connected: ready", None);
    let body = json!({ "from": "running", "to": "ready", "cause": { "by": "found" } });
    night.event(375_668, "state_changed", "state changed: running to ready", Some(body));
    let text = "command overridden: another word, or a power cycle, that took the place of the run command";
    night.event(375_668, "command_overridden", text, None);
    night
}

#[test]
fn what_was_read_before_a_short_silence_is_not_told_as_of_the_poll_before() {
    let story = without_supply_for_a_moment("moment-short").told(375_600);
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz"), "{:?}", story.before);
    assert!(story.before[0].text.ends_with("(as it was read last, 3.0 s before)"), "{:?}", story.before);
    assert_eq!(story.before[0].time_unix_ms, Some(NIGHT_MS + 372_686), "{:?}", story.before);
}

#[test]
fn a_run_command_that_went_with_its_supply_is_told_so_beside_another_moment_too() {
    let story = without_supply_for_a_moment("moment-beside").told(390_500);
    let likely = story.why(Certainty::Likely);
    assert!(
        likely.contains("next before it, 14.8 s away: its run command went, likely with its supply"),
        "{story:?}"
    );
    assert!(!format!("{:?}", story.why).contains("another word, or a power cycle"), "{story:?}");
}
