//! Stops that ended by something else than the stop.

use std::time::Duration;

use drive_core::StopMode;
use drived_plant::plant::commands::{Action, Target};
use tokio::time::sleep;

use super::{Certainty, Night, Says as _, Written};

#[tokio::test(start_paused = true)]
async fn a_stop_that_ended_by_a_trip_is_not_told_as_one_that_the_drive_carried_out() {
    let night = Night::begin(1).await;
    let at = night.now();
    let stop = Action::Stop(StopMode::Ramp.into());
    let trips = async {
        sleep(Duration::from_millis(700)).await;
        // OBF, overbraking: BBV51701, fault code 18.
        night.plant.machines[0].trip(18);
    };
    tokio::join!(night.ask("anna", "http 10.0.0.7", Target::Drive("pump 1".to_owned()), stop), trips);
    let story = night.asked("stop-trip", "pump 1", at).await;
    let course = story.course();
    assert!(course.contains("its output was off by the trip, and not by the stop"), "{course}");
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("the output was off by the trip, and not by the stop"), "{story:?}");
}

#[test]
fn who_asks_for_a_stop_is_told_that_a_trip_was_quicker_and_of_no_trip_that_was_over() {
    for is_over in [false, true] {
        let mut night = Written::begin(&format!("stop-quicker-{is_over}"));
        night.heard_for(900);
        night.asked(300_000, "stop", "ramp stop by anna from http 10.0.0.7: confirmed");
        let at = if is_over { 100_000 } else { 300_900 };
        night.changed(at, "stopping", "fault", "drive");
        night.event(at, "tripped", "tripped: 18 ObF: DC bus overvoltage", None);
        if is_over {
            night.event(150_000, "fault_cleared", "fault cleared", None);
        }
        night.event(300_900, "stop_confirmed", "stop confirmed: output off, the shaft may coast", None);
        let story = night.told(if is_over { 300_000 } else { 296_500 });
        let told = format!("{}\n{}", story.why(Certainty::Seen), story.course());
        assert_eq!(told.contains("and not by the stop"), !is_over, "{story:?}");
    }
}
