//! Whether the program stood still, as in a machine that was paused: what it reads behind that may have lain in a socket all the while.

use std::{
    sync::{Mutex, PoisonError, Weak},
    time::Duration,
};

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::Inner;

/// Between two beats.
const BEAT: Duration = Duration::from_millis(250);
/// A program that has not beaten for so long stood still. A busy machine does not keep it from one for so long.
const STOOD: Duration = Duration::from_millis(1_500);
/// Within this, what had come meanwhile is read.
const BEHIND: Duration = Duration::from_millis(500);

/// The beats of the program.
pub(super) struct Pulse(Mutex<Beats>);

struct Beats {
    last: Instant,
    /// From when to when it stood still last.
    stood: Option<(Instant, Instant)>,
}

impl Pulse {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Beats { last: Instant::now(), stood: None }))
    }

    fn beat(&self) {
        let mut beats = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        if now > beats.last + STOOD {
            beats.stood = Some((beats.last, now));
            let stood = now - beats.last;
            tracing::warn!(
                "this program stood still for {:.1} s: what was asked meanwhile is not begun",
                stood.as_secs_f64()
            );
        }
        beats.last = now;
    }

    /// When what was read at this moment was asked at the earliest.
    pub(super) fn asked_after(&self, read: Instant) -> Instant {
        let beats = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match beats.stood {
            _ if read > beats.last + STOOD => beats.last,
            Some((since, until)) if since < read && read < until + BEHIND => since,
            _ => read,
        }
    }
}

/// Beats for as long as anybody holds the plant.
pub(super) async fn beat(plant: Weak<Inner>) {
    let mut beats = interval(BEAT);
    beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        beats.tick().await;
        let Some(plant) = plant.upgrade() else { return };
        plant.pulse.beat();
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, StopMode};
    use drive_fleet::Until;
    use tokio::time::{Duration, Instant, advance, sleep};

    use crate::plant::{
        commands::{Action, LIFETIME, OutcomeWord, Rejected, Request, Target},
        testing::TestPlant,
    };
    use drived_config::rights::{Caller, Rights};

    #[tokio::test(start_paused = true)]
    async fn what_was_asked_while_the_program_stood_still_is_not_begun_and_least_of_all_behind_a_stop() {
        let test = TestPlant::of(1).await;
        let caller = Caller::new("operator", "socket", Rights::ALL);
        let asked = |action| {
            let target = Target::Drive("pump 1".to_owned());
            Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived: Instant::now() }
        };
        let start = || {
            asked(Action::Start { direction: Direction::Forward, setpoint: None, until: Until::default() })
        };
        sleep(super::BEAT * 8).await;
        // As a process that is stopped: no timer of it runs meanwhile.
        advance(Duration::from_secs(2)).await;
        let told = test.plant.command(&caller, start(), LIFETIME).await.unwrap();
        assert_eq!(told.outcome, OutcomeWord::Expired, "{told:?}");
        sleep(Duration::from_secs(2)).await;
        advance(Duration::from_secs(2)).await;
        test.plant.begin(&caller, asked(Action::Stop(StopMode::Ramp.into()))).unwrap();
        assert!(matches!(test.plant.begin(&caller, start()), Err(Rejected::Stopped(_))));
        sleep(Duration::from_secs(20)).await;
        assert!(!test.machines[0].observe().running);
        let told = test.plant.command(&caller, start(), LIFETIME).await.unwrap();
        assert_ne!(told.outcome, OutcomeWord::Expired, "a moment later it is as ever: {told:?}");
    }
}
