//! What the capabilities claim, against the simulated twin.

use std::time::Duration;

use drive_core::{Direction, Error, ErrorKind, Frequency, Percent, Reaction, Speed, State, StopMode};

use tokio::time::Instant;

use super::{Contract, is_given};
use crate::rig::Rig;

const REACTIONS: [Reaction; 6] = [
    Reaction::Ignore,
    Reaction::Freewheel,
    Reaction::Ramp,
    Reaction::Fast,
    Reaction::DcInjection,
    Reaction::Trip,
];

/// Whether an attempt was `Unsupported`; any other outcome shows that the family has it.
fn is_unsupported<T>(outcome: Result<T, Error>) -> bool {
    outcome.is_err_and(|error| error.kind() == ErrorKind::Unsupported)
}

impl Contract {
    /// What the family claims it does, and what it does not claim is `Unsupported`.
    pub async fn does_what_it_claims(&self) {
        let (mut rig, claims, name) = (self.rig(), self.capabilities, self.name());
        let by_hertz = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
        assert!(is_given(&by_hertz), "{name}: every family takes hertz: {by_hertz:?}");
        let by_speed = rig.drive.set_setpoint(Speed::from_rpm(900).into()).await;
        assert_eq!(is_unsupported(by_speed), !claims.speed_setpoint, "{name}: a setpoint in rpm");
        // Whoever takes one takes it where it is set up to count so.
        let by_share = rig.drive.set_setpoint(Percent::from_percent(50).into()).await;
        assert!(is_unsupported(by_share) || claims.share_setpoint, "{name}: a setpoint in percent");
        let says = claims.identification.is_some() && !self.identifies_elsewhere;
        assert_eq!(is_unsupported(rig.drive.identify().await), !says, "{name}");
        assert_eq!(is_unsupported(rig.drive.persist().await), claims.persist.is_none(), "{name}: saving");
        for mode in StopMode::ALL {
            let lacks = !claims.stop_modes.contains(&mode);
            let stopped = rig.drive.stop(mode).await.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(!lacks || stopped.mode != mode, "{name}: a stop by {mode}");
            assert_eq!(stopped.instead.is_some(), stopped.mode != mode, "{name}: {stopped}");
            let write = rig.drive.broadcast_stop(mode);
            assert_eq!(write.is_some(), claims.broadcast_stops.contains(&mode), "{name}: {mode} to all");
            assert!(write.is_none_or(|write| claims.functions.contains(&write.function)), "{name}");
        }
        rig.drive.stop(StopMode::Ramp).await.expect("every family has a ramp");
        rig.until_standstill().await;
        assert_eq!(is_unsupported(rig.drive.release().await), !claims.release, "{name}: giving control back");
        for request in rig.machine.received() {
            let Some(function) = request.pdu.first() else { continue };
            let asks_what_it_is = self.identifies_elsewhere && *function == 0x2B;
            assert!(
                claims.functions.contains(function) || asks_what_it_is,
                "{name}: function {function:02X}h"
            );
        }
    }

    /// The watchdog that the family claims is the one that it has.
    pub async fn has_the_watchdog_that_it_claims(&self) {
        let (mut rig, name) = (self.rig(), self.name());
        let Some(claims) = self.capabilities.watchdog else {
            assert!(is_unsupported(rig.drive.watchdog().await), "{name}");
            assert!(is_unsupported(rig.drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await));
            return;
        };
        rig.drive.watchdog().await.expect("it is known");
        for reaction in REACTIONS {
            let lacks = is_unsupported(rig.drive.arm_watchdog(claims.max, reaction).await);
            assert_eq!(lacks, !claims.reactions.contains(&reaction), "{name}: {reaction}");
        }
        let reaction = claims.reactions.iter().copied().find(|reaction| *reaction != Reaction::Ignore);
        let Some(reaction) = reaction else { return };
        for timeout in [claims.max + claims.step, claims.min / 2] {
            let error = rig.drive.arm_watchdog(timeout, reaction).await.expect_err("it cannot keep it");
            assert!(matches!(error, Error::WatchdogTime { .. }), "{name}: {error}");
        }
        for timeout in [claims.min, claims.max] {
            let armed = rig.drive.arm_watchdog(timeout, reaction).await.expect("it can keep it");
            assert_eq!((armed.timeout, armed.reaction), (Some(timeout), Some(reaction)), "{name}");
        }
    }

    /// The history of faults is as long as the family claims.
    pub async fn has_the_history_that_it_claims(&self) {
        let (mut rig, length) = (self.rig(), usize::from(self.capabilities.fault_history));
        let Some(trip) = self.trip else { return };
        // A reset takes command from nobody: a drive whose terminals command from power-up on is told first.
        rig.drive.stop(StopMode::Ramp).await.expect("it takes a stop");
        for _ in 0..length + 2 {
            rig.machine.trip(trip);
            reset(&mut rig).await;
        }
        let faults = rig.drive.faults().await.expect("it tells its faults");
        assert_eq!(faults.history.len(), length, "{}", self.name());
        assert_eq!(faults.present, [], "{}", self.name());
    }

    /// A drive that stands or runs takes as many exchanges as are claimed.
    pub async fn takes_the_exchanges_that_it_claims(&self) {
        let (mut rig, claims, name) = (self.rig(), self.capabilities, self.name());
        let claimed = (u64::from(claims.status_exchanges), u64::from(claims.measurement_exchanges));
        // Settings that are read once, some of them behind a status.
        let status = rig.drive.status().await.expect("it answers");
        rig.drive.self_restarts().await.expect("it tells them");
        assert_ne!(status.state, State::Unknown, "{name}");
        rig.drive.measurements().await.expect("it measures");
        assert_eq!(exchanges(&mut rig).await, claimed, "{name} stands: of a status, of the measurements");
        let given = rig.drive.set_setpoint(Frequency::from_hertz(25).into()).await;
        assert!(is_given(&given), "{name}: it takes 25 Hz: {given:?}");
        rig.drive.start(Direction::Forward).await.expect("it starts");
        rig.until_at(Frequency::from_hertz(25)).await;
        // What only a turning motor shows is looked for once.
        rig.drive.measurements().await.expect("it measures");
        assert_eq!(exchanges(&mut rig).await, claimed, "{name} runs: of a status, of the measurements");
        let words = words_of_a_status(&mut rig).await;
        assert!(words <= usize::from(claims.status_words), "{name}: a status of {words} words");
        let before = rig.machine.all_requests();
        rig.drive.stop(StopMode::Ramp).await.expect("every family has a ramp");
        let stop = rig.machine.all_requests() - before;
        assert!(stop <= u64::from(claims.stop_exchanges), "{name}: {stop} exchanges of a stop");
    }
}

/// The words that a status reads, of several statuses the fewest.
async fn words_of_a_status(rig: &mut Rig) -> usize {
    let mut least = usize::MAX;
    for _ in 0..3 {
        let since = Instant::now();
        rig.drive.status().await.expect("it answers");
        let count = |pdu: &[u8]| match pdu {
            [0x03 | 0x04, _, _, high, low] => usize::from(u16::from_be_bytes([*high, *low])),
            _ => 0,
        };
        least = least.min(rig.machine.received_since(since).iter().map(|request| count(&request.pdu)).sum());
    }
    least
}

/// Exchanges of one status and of the measurements. What proves a run command takes turns: of some statuses the least counts.
async fn exchanges(rig: &mut Rig) -> (u64, u64) {
    let mut least = u64::MAX;
    for _ in 0..3 {
        let before = rig.machine.all_requests();
        rig.drive.status().await.expect("it answers");
        least = least.min(rig.machine.all_requests() - before);
    }
    let between = rig.machine.all_requests();
    rig.drive.measurements().await.expect("it measures");
    (least, rig.machine.all_requests() - between)
}

/// Resets the present fault. Some drives do not communicate for a while after it, so that nothing can confirm it yet.
pub(super) async fn reset(rig: &mut Rig) {
    match rig.drive.reset_faults().await {
        Ok(status) => assert!(!status.is_fault(), "{status}"),
        Err(error) => {
            let unheard = [ErrorKind::NoAnswer, ErrorKind::OutcomeUnknown, ErrorKind::NotSent];
            assert!(unheard.contains(&error.kind()), "{error}");
        }
    }
    rig.until("no fault", |status| !status.is_fault()).await;
}
