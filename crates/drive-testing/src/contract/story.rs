//! One story, told once, lived by every family against its simulated twin.

use std::time::Duration;

use drive_core::{
    Command, Direction, Error, ErrorKind, Frequency, Motion, Reaction, Refusal, State, Status, StopMode,
};

use super::{Contract, claims::reset, is_given};
use crate::rig::Rig;

const SETPOINT: Frequency = Frequency::from_hertz(30);
const OTHER: Frequency = Frequency::from_hertz(25);

impl Contract {
    /// It starts, reaches its reference, reverses, stops by each mode, trips, is reset and stays still, is stopped by its
    /// watchdog when the cable is cut, and gives control back; and the rules of the line are kept.
    pub async fn lives_the_story(&self) {
        self.lives_the_story_on(self.rig()).await;
    }

    /// The same on a line of another kind.
    pub async fn lives_the_story_on(&self, mut rig: Rig) {
        nothing_moves_at_first(&mut rig).await;
        it_starts_and_reaches_its_reference(&mut rig).await;
        it_reverses(&mut rig).await;
        it_stops_by_each_mode_that_it_claims_and_by_another_for_the_rest(&mut rig).await;
        if let Some(trip) = self.trip {
            it_trips_says_why_and_stays_still_after_the_reset(&mut rig, trip).await;
        }
        its_watchdog_stops_it_when_the_cable_is_cut(&mut rig, self.watchdog_trips).await;
        it_gives_control_back_or_says_that_it_cannot(&mut rig).await;
        assert_eq!(rig.simulated.violations(), [], "{} kept the rules of the line", self.name());
    }
}

async fn nothing_moves_at_first(rig: &mut Rig) {
    let status = rig.drive.status().await.expect("it answers");
    // Of a motor that was not seen before, not every drive tells whether it coasts.
    assert!(status.is_undriven(), "{status}");
    rig.drive.measurements().await.expect("it measures");
    let faults = rig.drive.faults().await.expect("it tells its faults");
    assert_eq!((faults.tripped, faults.present), (false, vec![]));
    assert!(!rig.machine.observe().running, "reading moves nothing");
}

async fn it_starts_and_reaches_its_reference(rig: &mut Rig) {
    give(rig).await;
    assert!(!rig.machine.observe().running, "a setpoint is no start");
    let status = rig.drive.start(Direction::Forward).await.expect("it starts");
    assert_eq!(status.state, State::Running);
    let status = rig.until_at(SETPOINT).await;
    assert_eq!(status.direction, Some(Direction::Forward));
    assert_eq!(rig.machine.observe().output_frequency, 3_000);
}

/// Gives it its setpoint.
async fn give(rig: &mut Rig) {
    let given = rig.drive.set_setpoint(SETPOINT.into()).await;
    assert!(is_given(&given), "30 Hz is within its limits: {given:?}");
}

async fn it_reverses(rig: &mut Rig) {
    let status = rig.drive.start(Direction::Reverse).await.expect("it turns round");
    assert_eq!(status.state, State::Running);
    rig.until_machine("it turns the other way", |machine| machine.output_frequency < 0).await;
    let status = rig.until_at(SETPOINT).await;
    assert_eq!(status.direction, Some(Direction::Reverse));
    assert_eq!(rig.machine.observe().output_frequency, -3_000);
    // A setpoint says how fast, and never which way.
    let given = rig.drive.set_setpoint(OTHER.into()).await;
    assert!(is_given(&given), "25 Hz is within its limits: {given:?}");
    rig.until_machine("it turns the same way as fast as it was given", |machine| {
        machine.output_frequency == -2_500
    })
    .await;
}

async fn it_stops_by_each_mode_that_it_claims_and_by_another_for_the_rest(rig: &mut Rig) {
    give(rig).await;
    for mode in StopMode::ALL {
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("before {mode}: {error}"));
        rig.until_at(SETPOINT).await;
        let claimed = rig.drive.capabilities().stop_modes.contains(&mode);
        let stopped = rig.drive.stop(mode).await.unwrap_or_else(|error| panic!("{mode}: {error}"));
        assert!(stopped.mode != mode || claimed, "{stopped}");
        assert_ne!(stopped.status.state, State::Running, "{mode}");
        if stopped.mode == StopMode::DcInjection {
            // Some drives inject for as long as they are told to.
            rig.until("the motor is held", Status::is_standstill).await;
            rig.drive.stop(StopMode::Ramp).await.expect("it ends the injection");
        }
        // Of a motor whose output was cut nobody knows when it stands.
        rig.until("no drive", |status| status.is_standstill() || status.motion == Motion::Coasting).await;
        assert!(!rig.machine.observe().running, "{mode}");
        // What coasts turns on without an output; the next start is from rest.
        rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    }
}

async fn it_trips_says_why_and_stays_still_after_the_reset(rig: &mut Rig, trip: u16) {
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_at(SETPOINT).await;
    rig.machine.trip(trip);
    rig.until("the trip", |status| status.state == State::Fault).await;

    let faults = rig.drive.faults().await.expect("it tells its faults");
    let present: Vec<u16> = faults.present.iter().map(|fault| fault.code).collect();
    assert_eq!((faults.tripped, &present[..]), (true, &[trip][..]));

    let refused = rig.drive.start(Direction::Forward).await.expect_err("it has tripped");
    assert!(
        matches!(
            refused,
            Error::Refused { command: Command::Start(_), reason: Refusal::Fault(_) | Refusal::Tripped, .. }
        ),
        "{refused}"
    );

    rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    reset(rig).await;
    rig.poll_for(Duration::from_secs(5)).await;
    assert!(!rig.machine.observe().running, "a reset is no start");
    // A reset may take the reference with it.
    give(rig).await;
    rig.drive.start(Direction::Forward).await.expect("it starts again when it is told to");
    rig.until_at(SETPOINT).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_standstill().await;
}

async fn its_watchdog_stops_it_when_the_cable_is_cut(rig: &mut Rig, trips: &[u16]) {
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
    assert_eq!(present, trips);
    rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
    reset(rig).await;
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
