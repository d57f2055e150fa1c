//! Stops of drives that somebody else commands too.

use std::sync::Arc;

use drive_core::{Direction, Frequency, StopMode};
use drive_fleet::{DriveSettings, Until};
use drive_sim::SimSlave;

use super::*;
use crate::plant::{
    commands::LIFETIME,
    revisions::{Next, Subject, data_of},
    testing::TestPlant,
};
use drived_config::rights::Rights;

const SECOND: Duration = Duration::from_secs(1);

async fn stop(plant: &Plant, target: Target) -> Arc<CommandView> {
    let action = Action::Stop(StopMode::Ramp.into());
    command(plant, target, action).await
}

async fn command(plant: &Plant, target: Target, action: Action) -> Arc<CommandView> {
    let (caller, arrived) = (Caller::new("page", "page", Rights::ALL), Instant::now());
    let request = Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived };
    plant.command(&caller, request, 40 * SECOND).await.unwrap()
}

/// Another master climbs the chart and starts the motor (BBV51701, "CMD").
fn start_by_another(machine: &SimSlave) {
    for word in [0x0006, 0x0007, 0x000F] {
        machine.written_by_another(8_501, word).unwrap();
    }
}

/// Three drives, the last of which is only watched; another master has given that one a setpoint (LFR) of 25 Hz.
async fn one_is_watched() -> TestPlant {
    let plant = TestPlant::with(3, |name| match name.as_str() {
        "pump 3" => DriveSettings::watched(name),
        _ => DriveSettings::controlled(name),
    })
    .await;
    plant.machines[2].written_by_another(8_502, 250).unwrap();
    plant
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_is_not_confirmed_while_a_motor_turns_that_is_only_watched() {
    let test = one_is_watched().await;
    let refused = |told: &CommandView| {
        let several = told.several.as_ref().unwrap();
        (told.outcome, several.confirmed, several.refused, several.drives[2].outcome)
    };
    for target in [Target::All, Target::Group("pumps".to_owned())] {
        start_by_another(&test.machines[2]);
        sleep(5 * SECOND).await;
        let told = stop(&test.plant, target.clone()).await;
        assert_eq!(refused(&told), (OutcomeWord::Refused, 2, 1, OutcomeWord::Refused), "{target:?}");
        assert!(test.machines[2].observe().running, "it is not written to");
        // Whoever commands it stops it. It stands, and needs no stop.
        test.machines[2].written_by_another(8_501, 0x0007).unwrap();
        sleep(20 * SECOND).await;
        let told = stop(&test.plant, target.clone()).await;
        assert_eq!(refused(&told), (OutcomeWord::Confirmed, 2, 1, OutcomeWord::Nothing), "{target:?}");
        assert_eq!(told.several.as_ref().unwrap().drives[2].reason.as_deref(), Some("read_only"));
    }
    // And one of which nothing is known any more may turn.
    test.machines[2].mute();
    sleep(20 * SECOND).await;
    assert_eq!(stop(&test.plant, Target::All).await.outcome, OutcomeWord::Refused);
}

#[tokio::test(start_paused = true)]
async fn where_all_are_only_watched_and_stand_there_is_nothing_to_stop() {
    let test = TestPlant::with(2, DriveSettings::watched).await;
    let outcome = async || stop(&test.plant, Target::All).await.outcome;
    assert_eq!(outcome().await, OutcomeWord::Nothing);
    test.machines[0].written_by_another(8_502, 250).unwrap();
    start_by_another(&test.machines[0]);
    sleep(5 * SECOND).await;
    assert_eq!(outcome().await, OutcomeWord::Refused);
    let named = stop(&test.plant, Target::Drive("pump 2".to_owned())).await;
    assert_eq!(named.outcome, OutcomeWord::Refused, "who names it is told that it is not stopped from here");
}

#[tokio::test(start_paused = true)]
async fn a_run_command_that_comes_behind_a_stop_is_told_and_stands_in_its_outcome() {
    let mut test = TestPlant::of(2).await;
    // What another master writes they do not follow.
    drop(std::mem::take(&mut test.witnesses));
    let setpoint = Some(Frequency::from_hertz(20).into());
    let start = Action::Start { direction: Direction::Forward, setpoint, until: Until::AtReference };
    for (target, times) in [(Target::Drive("pump 1".to_owned()), 1), (Target::All, 2)] {
        let started = command(&test.plant, Target::Drive("pump 1".to_owned()), start).await;
        assert_eq!(started.outcome, OutcomeWord::Confirmed);
        let machine = test.machines[0].clone();
        tokio::spawn(async move {
            for _ in 0..times {
                sleep(SECOND).await;
                start_by_another(&machine);
            }
        });
        let told = stop(&test.plant, target.clone()).await;
        let told = told.several.as_ref().map_or(&told, |several| &several.drives[0]);
        assert_eq!((told.outcome, told.restarts), (OutcomeWord::Confirmed, Some(times)), "{target:?}");
        assert!(told.text.as_deref().is_some_and(|text| text.contains("a run command")), "{told:?}");
        assert!(!test.machines[0].observe().running, "{target:?}");
    }
    let again = stop(&test.plant, Target::All).await;
    assert_eq!(again.several.as_ref().unwrap().drives[0].restarts, None, "it is of that stop alone");
}

/// It is open, and its end is told under the same id: until then nothing of it is new.
#[tokio::test(start_paused = true)]
async fn the_outcome_of_a_stop_that_is_not_confirmed_is_told_once() {
    let test = TestPlant::of(1).await;
    let mut reader = test.plant.revisions().reader(None);
    test.machines[0].mute();
    let told = stop(&test.plant, Target::Drive("pump 1".to_owned())).await;
    assert!(told.open && told.outcome != OutcomeWord::Pending, "{told:?}");
    let (mut outcomes, until) = (Vec::new(), Instant::now() + SECOND);
    while let Ok(Next::Frames(frames)) = timeout_at(until, test.plant.revisions().next(&mut reader)).await {
        let commands = frames.iter().filter_map(|frame| data_of(frame, Subject::Command));
        outcomes
            .extend(commands.map(|(_, data)| serde_json::from_slice::<CommandView>(data).unwrap().outcome));
    }
    assert_eq!(outcomes, [OutcomeWord::Pending, told.outcome]);
}
