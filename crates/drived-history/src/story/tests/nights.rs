//! On a simulated plant in virtual time.

use std::time::Duration;

use drive_core::StopMode;
use drive_sim::Panel;
use drived_plant::plant::commands::{Action, Target};
use tokio::time::sleep;

use super::{Certainty, Night, Says as _, Story};

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_by_what_the_drive_says_and_what_brought_it_there_is_left_open() {
    let night = Night::begin(2).await;
    let at = night.now();
    // OBF, overbraking: BBV51701, fault code 18.
    night.plant.machines[0].trip(18);
    let story = night.asked("trip", "pump 1", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("tripped"), "{story:?}");
    assert!(story.why(Certainty::Said).contains("ObF"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("load, mains, wiring, setting"), "{story:?}");
    assert!(story.before[0].text.starts_with("running, output 30.00 Hz, setpoint 30.00 Hz"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "", "nothing else was tripped");
    let neighbour = tell_nothing_of(&story, "pump 2");
    assert!(neighbour, "the other pump ran on: {story:?}");
    let of_trip: Vec<&str> =
        story.course.iter().map(|told| &*told.text).filter(|told| told.contains("tripped")).collect();
    let [trip, withdrawal] = &of_trip[..] else { panic!("each fact is told once: {of_trip:?}") };
    let told = "tripped: 18 ObF: DC bus overvoltage (state changed: running to fault) [ETA 0627h to 0208h";
    assert!(trip.starts_with(told) && withdrawal.starts_with("command: withdrawal"), "{of_trip:?}");
    assert!(!story.course().contains("trip explained"), "{story:?}");
    assert_eq!(story.about.unwrap().text, "tripped: 18 ObF: DC bus overvoltage");
}

fn tell_nothing_of(story: &Story, drive: &str) -> bool {
    !story.course().contains(drive)
}

#[tokio::test(start_paused = true)]
async fn one_silent_drive_is_told_as_that_and_its_neighbours_speak_for_the_line() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines[0].mute();
    let story = night.asked("one", "pump 1", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("lost"), "{story:?}");
    let seen = story.why(Certainty::Seen);
    assert!(seen.contains("no other drive of its line is recorded as fallen silent within"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("its supply"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "");
}

#[tokio::test(start_paused = true)]
async fn a_cut_line_is_told_as_what_its_drives_share_and_never_as_one_of_them() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines.iter().for_each(drive_sim::SimSlave::mute);
    let story = night.asked("line", "pump 2", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("lost"), "{story:?}");
    assert!(
        story.why(Certainty::Seen).contains("pump 1, pump 3 of its line fell silent with it"),
        "{story:?}"
    );
    assert!(story.why(Certainty::Likely).contains("the cable, its adapter, or the supply"), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_somebody_asked_for_is_told_with_who_and_through_which_door() {
    let night = Night::begin(2).await;
    let at = night.now();
    let stop = Action::Stop(StopMode::Ramp.into());
    night.ask("anna", "http 10.0.0.7", Target::Drive("pump 1".to_owned()), stop).await;
    let story = night.asked("asked", "pump 1", at).await;
    let why = story.why(Certainty::Seen);
    assert!(
        why.contains("anna") && story.course().contains("by anna from http 10.0.0.7: confirmed"),
        "{story:?}"
    );
    assert_eq!(story.why(Certainty::Likely), "");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_nobody_here_stopped_is_told_so_and_who_did_is_not_guessed() {
    let night = Night::begin(2).await;
    let at = night.now();
    night.plant.machines[0].panel(Panel::Stop);
    let story = night.asked("panel", "pump 1", at).await;
    let sure = format!("{}\n{}", story.why(Certainty::Seen), story.why(Certainty::Said));
    assert!(!sure.contains("operator asked"), "{story:?}");
    assert!(!story.why(Certainty::NotKnown).is_empty(), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn two_drives_that_trip_together_have_one_cause_as_likely_and_not_as_certain() {
    let night = Night::begin(3).await;
    let at = night.now();
    night.plant.machines[0].trip(18);
    night.plant.machines[1].trip(18);
    let story = night.asked("two", "pump 1", at).await;
    assert!(story.why(Certainty::Likely).contains("pump 2 tripped within 2 s"), "{story:?}");
    assert!(!story.why(Certainty::Seen).contains("mains"), "{story:?}");
}

#[tokio::test(start_paused = true)]
async fn a_quiet_night_is_told_as_quiet_with_the_share_that_is_known() {
    let night = Night::begin(1).await;
    sleep(Duration::from_secs(1_800)).await;
    let at = night.now();
    sleep(Duration::from_secs(600)).await;
    let story = night.asked("quiet", "pump 1", at).await;
    assert_eq!((story.about, story.course), (None, Vec::new()));
    assert!(story.not_known.last().unwrap().text.contains("100 % of the"), "{:?}", story.not_known);
}

#[tokio::test(start_paused = true)]
async fn a_reference_that_another_master_wrote_is_told_as_the_drive_shows_it_and_nobody_is_named() {
    let night = Night::begin(1).await;
    let at = night.now();
    // LFr, 8502, in tenths of a hertz: BBV51701.
    night.plant.machines[0].written_by_another(8_502, 180).unwrap();
    let story = night.asked("reference", "pump 1", at).await;
    assert!(story.about.as_ref().unwrap().text.starts_with("reference taken"), "{story:?}");
    assert!(story.why(Certainty::Said).contains("another master has written"), "{story:?}");
    assert!(
        !story.why(Certainty::NotKnown).is_empty() && story.why(Certainty::Likely).is_empty(),
        "{story:?}"
    );
}
