//! Whether the program stood still, as in a machine that was paused: what it reads behind that may have lain in a socket all the while.
//! And whether the wall's clock was set back, behind which what was sent before looks younger than it is.

use std::{
    sync::{Mutex, PoisonError, Weak},
    time::{Duration, Instant as Steady, SystemTime},
};

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::Inner;

/// Between two beats.
const BEAT: Duration = Duration::from_millis(250);
/// A program that has not beaten for so long stood still. A busy machine does not keep it from one for so long.
const STOOD: Duration = Duration::from_millis(1_500);
/// Within this, what had come meanwhile is read.
const BEHIND: Duration = Duration::from_millis(500);

/// A clock that goes slower for a while, so as not to be set, loses less between two beats.
const STEP: Duration = Duration::from_millis(100);
/// Longer than a message lies in a broker that goes on.
const LIES: Duration = Duration::from_secs(60);

/// The beats of the program.
pub(super) struct Pulse(Mutex<Beats>);

struct Beats {
    wall: Wall,
    last: Instant,
    /// From when to when it stood still last.
    stood: Option<(Instant, Instant)>,
}

impl Pulse {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Beats { wall: Wall::new(), last: Instant::now(), stood: None }))
    }

    fn beat(&self) {
        let mut beats = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        beats.wall.look((SystemTime::now(), Steady::now()));
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

    /// By how much the wall's clock was set back lately: by so much more may whatever says when it was sent be old.
    pub(super) fn set_back(&self) -> Duration {
        let mut beats = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        beats.wall.look((SystemTime::now(), Steady::now()))
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

/// The wall's clock beside one that nobody sets.
struct Wall {
    last: (SystemTime, Steady),
    /// When it was set back, and by how much, lately.
    back: Option<(Steady, Duration)>,
}

impl Wall {
    fn new() -> Self {
        Self { last: (SystemTime::now(), Steady::now()), back: None }
    }

    /// Looks at both, and tells by how much it was set back lately, all steps together.
    fn look(&mut self, now: (SystemTime, Steady)) -> Duration {
        self.back.take_if(|(at, _)| now.1 > *at + LIES);
        let expected = self.last.0 + now.1.saturating_duration_since(self.last.1);
        let by = expected.duration_since(now.0).unwrap_or_default();
        let so_far = self.back.map_or(Duration::ZERO, |(_, by)| by);
        if by >= STEP {
            tracing::warn!(
                "the clock of this computer was set back by {:.1} s: what says when it was sent is taken to be older by that for a minute",
                by.as_secs_f64()
            );
            self.back = Some((now.1, so_far + by));
        }
        self.last = now;
        self.back.map_or(Duration::ZERO, |(_, by)| by)
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

    #[test]
    fn a_clock_that_is_set_back_is_known_for_a_minute_and_one_that_is_set_forward_or_goes_slower_is_none() {
        let mut wall = super::Wall::new();
        let (mut time, mut steady) = wall.last;
        let mut pass = |wall: &mut super::Wall, all: u64, shown: i64| {
            steady += Duration::from_millis(all);
            let by = Duration::from_millis(shown.unsigned_abs());
            time = if shown < 0 { time - by } else { time + by };
            wall.look((time, steady))
        };
        assert_eq!(pass(&mut wall, 250, 250), Duration::ZERO);
        assert_eq!(pass(&mut wall, 250, 240), Duration::ZERO, "it goes slower");
        assert_eq!(pass(&mut wall, 250, 3_600_000), Duration::ZERO, "it is set forward");
        assert_eq!(pass(&mut wall, 250, -4_750), Duration::from_secs(5));
        assert_eq!(pass(&mut wall, 30_000, 30_000), Duration::from_secs(5));
        assert_eq!(pass(&mut wall, 250, -750), Duration::from_secs(6), "both together");
        assert_eq!(pass(&mut wall, 60_001, 60_001), Duration::ZERO);
    }

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
        let told = test.plant.command(&caller, start(), LIFETIME.time()).await.unwrap();
        assert_eq!(told.outcome, OutcomeWord::Expired, "{told:?}");
        sleep(Duration::from_secs(2)).await;
        advance(Duration::from_secs(2)).await;
        test.plant.begin(&caller, asked(Action::Stop(StopMode::Ramp.into()))).unwrap();
        assert!(matches!(test.plant.begin(&caller, start()), Err(Rejected::Stopped(_))));
        sleep(Duration::from_secs(20)).await;
        assert!(!test.machines[0].observe().running);
        let told = test.plant.command(&caller, start(), LIFETIME.time()).await.unwrap();
        assert_ne!(told.outcome, OutcomeWord::Expired, "a moment later it is as ever: {told:?}");
    }
}
