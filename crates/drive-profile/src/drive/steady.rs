//! An output that does not come down while the status word is that of a motor at rest: something that the word does not tell of runs it,
//! such as its terminals.

use drive_core::{Frequency, State};
use tokio::time::{Duration, Instant};

use super::falling::has_fallen;

/// How long an output has to go down no more. At a tenth of a hertz a count the slowest ramp of which it is not mistaken takes 1500 s from
/// 50 Hz.
const HELD_FOR: Duration = Duration::from_secs(3);

/// What is below it is none: the offset of a register that never reads quite 0.
const LEAST: Frequency = Frequency::from_centihertz(100);

/// The lowest output since the status word said that nothing runs, and since when it is that.
#[derive(Debug, Default)]
pub(super) struct Steady(Option<(Frequency, Instant)>);

impl Steady {
    /// The state by a status word and an output that belong together, of a motor that no run command of this side runs.
    pub(super) fn see(&mut self, state: State, output: Option<Frequency>) -> State {
        let says_rest = matches!(state, State::Ready | State::Disabled | State::NotReady);
        let Some(output) = output.filter(|output| says_rest && *output >= LEAST) else {
            self.0 = None;
            return state;
        };
        let (least, since) = *self.0.get_or_insert_with(|| (output, Instant::now()));
        if output < least {
            self.0 = Some((output, Instant::now()));
            return state;
        }
        let is_driven = has_fallen(least, Some(output)) || since.elapsed() >= HELD_FOR;
        if is_driven { State::Running } else { state }
    }

    /// What was seen proves nothing any more.
    pub(super) fn forget(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use tokio::time::sleep;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn an_output_that_holds_or_rises_in_a_state_of_rest_is_a_motor_that_runs_and_one_that_comes_down_is_none()
     {
        let mut steady = Steady::default();
        let mut see = |centihertz| steady.see(State::Ready, Some(Frequency::from_centihertz(centihertz)));
        assert_eq!((see(2_000), see(2_000)), (State::Ready, State::Ready));
        sleep(HELD_FOR).await;
        assert_eq!((see(2_000), see(2_010)), (State::Running, State::Running));
        for centihertz in (100..2_000).rev().step_by(10) {
            assert_eq!(see(centihertz), State::Ready, "{centihertz}: it comes down");
            sleep(Duration::from_millis(2_900)).await;
        }
        assert_eq!((see(500), see(50)), (State::Running, State::Ready), "it rises, and is gone");
        assert_eq!(steady.see(State::Fault, Some(Frequency::from_hertz(20))), State::Fault);
    }
}
