//! What every family does alike, through `dyn Drive`: one story, told once, lived by each of them.

use std::time::Duration;

use drive_bus::{
    Protocol,
    protocol::{AsciiSettings, NetworkHeader, UniTelwaySettings},
};
use drive_core::{
    Command, Direction, Error, ErrorKind, Frequency, Reaction, Refusal, SerialSettings, State, StopMode,
    serial::CharacterFormat,
};
use drive_families::Family;
use support::{drives, rig::Rig};

const SETPOINT: Frequency = Frequency::from_hertz(30);

#[tokio::test(start_paused = true)]
async fn an_altivar_21_starts_reverses_stops_trips_and_recovers() {
    lives_the_story(Family::Atv21).await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_28_starts_reverses_stops_trips_and_recovers() {
    lives_the_story(Family::Atv28).await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_starts_reverses_stops_trips_and_recovers() {
    lives_the_story(Family::Atv58).await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_lives_the_same_story_in_modbus_ascii() {
    for format in [CharacterFormat::F7E1, CharacterFormat::F8O1] {
        let settings = SerialSettings::new(9_600, format).expect("it is a speed of the card");
        live(
            Rig::speaking(Family::Atv58, Protocol::Ascii(AsciiSettings::default()), settings),
            Family::Atv58,
        )
        .await;
    }
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_lives_the_same_story_on_uni_telway() {
    let settings = Family::Atv58.capabilities().factory;
    for header in [NetworkHeader::default(), NetworkHeader::Simplified] {
        let protocol = Protocol::UniTelway(UniTelwaySettings { header, ..UniTelwaySettings::default() });
        live(Rig::speaking(Family::Atv58, protocol, settings), Family::Atv58).await;
    }
}

#[tokio::test(start_paused = true)]
async fn an_altivar_312_starts_reverses_stops_trips_and_recovers() {
    lives_the_story(Family::Atv312).await;
}

#[tokio::test(start_paused = true)]
async fn a_3g3ev_starts_reverses_stops_trips_and_recovers() {
    lives_the_story(Family::Omron3g3ev).await;
}

async fn lives_the_story(family: Family) {
    live(Rig::new(family), family).await;
}

async fn live(mut rig: Rig, family: Family) {
    nothing_moves_at_first(&mut rig).await;
    it_starts_and_reaches_its_reference(&mut rig).await;
    it_reverses(&mut rig).await;
    it_stops_by_each_mode_that_it_claims_and_by_another_for_the_rest(&mut rig).await;
    it_trips_says_why_and_stays_still_after_the_reset(&mut rig, family).await;
    its_watchdog_stops_it_when_the_cable_is_cut(&mut rig, family).await;
    it_gives_control_back_or_says_that_it_cannot(&mut rig).await;
    assert_eq!(rig.simulated.violations(), [], "{family} kept the rules of the line");
}

async fn nothing_moves_at_first(rig: &mut Rig) {
    let status = rig.drive.status().await.expect("it answers");
    assert!(status.is_standstill(), "{status}");
    rig.drive.measurements().await.expect("it measures");
    assert_eq!(rig.drive.faults().await.expect("it tells its faults").present, []);
    assert!(!rig.machine.observe().running, "reading moves nothing");
}

async fn it_starts_and_reaches_its_reference(rig: &mut Rig) {
    rig.drive.set_setpoint(SETPOINT.into()).await.expect("30 Hz is within its limits");
    assert!(!rig.machine.observe().running, "a setpoint is no start");
    let status = rig.drive.start(Direction::Forward).await.expect("it starts");
    assert_eq!(status.state, State::Running);
    let status = rig.until_at(SETPOINT).await;
    assert_eq!(status.direction, Some(Direction::Forward));
    assert_eq!(rig.machine.observe().output_frequency, 3_000);
}

async fn it_reverses(rig: &mut Rig) {
    let status = rig.drive.start(Direction::Reverse).await.expect("it turns round");
    assert_eq!(status.state, State::Running);
    rig.until("reverse at the reference", |status| {
        status.direction == Some(Direction::Reverse) && status.output_frequency == Some(SETPOINT)
    })
    .await;
    assert_eq!(rig.machine.observe().output_frequency, -3_000);
}

async fn it_stops_by_each_mode_that_it_claims_and_by_another_for_the_rest(rig: &mut Rig) {
    for mode in StopMode::ALL {
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("before {mode}: {error}"));
        rig.until_at(SETPOINT).await;
        let claimed = rig.drive.capabilities().stop_modes.contains(&mode);
        let stopped = match rig.drive.stop(mode).await {
            Ok(stopped) => stopped,
            Err(error) => {
                assert!(!claimed && error.kind() == ErrorKind::Unsupported, "{mode}: {error}");
                rig.drive.stop(StopMode::Ramp).await.expect("every family has a ramp")
            }
        };
        assert!(stopped.mode != mode || claimed, "{stopped}");
        assert_ne!(stopped.status.state, State::Running, "{mode}");
        if stopped.mode == StopMode::DcInjection {
            // Some drives inject for as long as they are told to.
            rig.until("no output", |status| status.output_frequency == Some(Frequency::ZERO)).await;
            rig.drive.stop(StopMode::Ramp).await.expect("it ends the injection");
        }
        rig.until_standstill().await;
        assert!(!rig.machine.observe().running, "{mode}");
        // What coasts turns on without an output; the next start is from rest.
        rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    }
}

async fn it_trips_says_why_and_stays_still_after_the_reset(rig: &mut Rig, family: Family) {
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_at(SETPOINT).await;
    let code = drives::a_trip(family);
    rig.machine.trip(code);
    rig.until("the trip", |status| status.state == State::Fault).await;

    let faults = rig.drive.faults().await.expect("it tells its faults");
    let present: Vec<u16> = faults.present.iter().map(|fault| fault.code).collect();
    assert_eq!(present, [code]);

    let refused = rig.drive.start(Direction::Forward).await.expect_err("it has tripped");
    assert!(
        matches!(
            refused,
            Error::Refused { command: Command::Start(_), reason: Refusal::Fault(_) | Refusal::Tripped, .. }
        ),
        "{refused}"
    );

    rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    drives::reset(family, &mut rig.drive).await;
    rig.until("no fault", |status| !status.is_fault()).await;
    rig.poll_for(Duration::from_secs(5)).await;
    assert!(!rig.machine.observe().running, "a reset is no start");
    // A reset may take the reference with it.
    rig.drive.set_setpoint(SETPOINT.into()).await.expect("30 Hz is within its limits");
    rig.drive.start(Direction::Forward).await.expect("it starts again when it is told to");
    rig.until_at(SETPOINT).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_standstill().await;
}

async fn its_watchdog_stops_it_when_the_cable_is_cut(rig: &mut Rig, family: Family) {
    let Some(watchdog) = rig.drive.capabilities().watchdog else {
        let refused = rig.drive.watchdog().await.expect_err("the manual has none");
        assert_eq!(refused.kind(), ErrorKind::Unsupported);
        return;
    };
    if watchdog.settable {
        let time = watchdog.min.max(Duration::from_secs(2));
        let reaction = watchdog.reactions.iter().copied().find(|reaction| *reaction != Reaction::Ignore);
        let armed =
            rig.drive.arm_watchdog(time, reaction.expect("it reacts")).await.expect("it can be armed");
        assert_eq!((armed.timeout, armed.reaction), (Some(time), reaction));
    } else {
        let own = rig.drive.watchdog_capability().expect("it has one");
        assert_eq!(rig.drive.watchdog().await.expect("it is known").timeout, Some(own.max));
    }
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_at(SETPOINT).await;

    rig.machine.mute();
    rig.machine.wait_until(|machine| machine.trip.is_some() && !machine.running).await;
    rig.machine.unmute();

    rig.until("the trip by the watchdog", |status| status.state == State::Fault).await;
    let faults = rig.drive.faults().await.expect("it tells its faults");
    let present: Vec<u16> = faults.present.iter().map(|fault| fault.code).collect();
    assert_eq!(present, drives::communication_trips(family));
    rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    drives::reset(family, &mut rig.drive).await;
    rig.until("no fault", |status| !status.is_fault()).await;
    rig.poll_for(Duration::from_secs(5)).await;
    assert!(!rig.machine.observe().running, "nothing restarts by itself");
}

async fn it_gives_control_back_or_says_that_it_cannot(rig: &mut Rig) {
    let released = rig.drive.release().await;
    match released {
        Ok(_) => assert!(rig.drive.capabilities().release),
        Err(error) => {
            assert!(!rig.drive.capabilities().release, "{error}");
            assert_eq!(error.kind(), ErrorKind::Unsupported);
        }
    }
}
