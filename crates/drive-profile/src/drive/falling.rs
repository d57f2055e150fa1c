//! An output on its way down, by two looks at it.

use drive_core::{Frequency, State, Status};
use tokio::time::{Duration, Instant};

/// How far an output has to fall to be on its way down: more than the few counts by which that of many drives flickers. A ramp that
/// falls less in the time that a command has to show (200 s from 50 Hz) is seen by its end, and not by its beginning.
const FALL: Frequency = Frequency::from_centihertz(50);

/// How long an output that came down by a stop of this side has to go down no more, to be one that a start holds: at a tenth of a hertz
/// a count a ramp of 200 s shows every 0.4 s.
const HELD_FOR: Duration = Duration::from_secs(1);

/// Whether the output goes down below what it is to be, since the first look. One that only follows a lower setpoint ends there.
pub(super) fn comes_down(status: &Status, first: Option<Frequency>) -> bool {
    let Some(output) = status.output_frequency else { return false };
    let below = status.reference.is_none_or(|reference| has_fallen(output, Some(reference)));
    below && has_fallen(output, first) && status.state == State::Running
}

/// Whether an output that may come down goes down no more: it has risen, or has had no lower one for [`HELD_FOR`].
pub(super) fn holds(output: Frequency, lowest: &mut Option<(Frequency, Instant)>) -> bool {
    match *lowest {
        Some((least, since)) if output >= least => {
            has_fallen(least, Some(output)) || since.elapsed() >= HELD_FOR
        }
        _ => {
            *lowest = Some((output, Instant::now()));
            false
        }
    }
}

/// Whether an output is so far below another that it is no flicker of its register.
pub(super) fn has_fallen(output: Frequency, from: Option<Frequency>) -> bool {
    from.is_some_and(|from| {
        output.centihertz().checked_add(FALL.centihertz()).is_some_and(|least| least <= from.centihertz())
    })
}

#[cfg(test)]
mod tests {
    use tokio::time::sleep;

    use super::*;

    #[test]
    fn an_output_that_only_follows_a_lower_setpoint_is_no_stop() {
        let hertz = |hertz| Some(Frequency::from_hertz(hertz));
        let shown = |output, reference| Status {
            state: State::Running,
            output_frequency: hertz(output),
            reference,
            ..Status::default()
        };
        assert!(!comes_down(&shown(35, hertz(20)), hertz(40)), "on its way to 20 Hz");
        assert!(comes_down(&shown(19, hertz(20)), hertz(40)));
        assert!(!comes_down(&shown(40, hertz(50)), hertz(40)), "it holds its speed");
        assert!(!comes_down(&shown(39, hertz(50)), None), "one look tells nothing");
    }

    #[tokio::test(start_paused = true)]
    async fn an_output_that_comes_down_is_held_once_it_rises_or_stands_for_a_while() {
        let mut lowest = None;
        let mut look = |centihertz| holds(Frequency::from_centihertz(centihertz), &mut lowest);
        assert!(!look(3_000) && !look(2_900) && !look(2_900) && !look(2_910), "a flicker is no rise");
        assert!(look(2_950), "it rises");
        assert!(!look(2_890), "and comes down again");
        sleep(HELD_FOR).await;
        assert!(look(2_890), "it stands");
        assert!(!look(2_880));
    }

    #[test]
    fn an_output_that_flickers_by_a_count_is_no_stop() {
        let first = Some(Frequency::from_hertz(40));
        for (output, falls) in [(3_999, false), (3_990, false), (3_951, false), (3_950, true)] {
            let output = Frequency::from_centihertz(output);
            let status =
                Status { state: State::Running, output_frequency: Some(output), ..Status::default() };
            assert_eq!(comes_down(&status, first), falls, "{output}");
            assert_eq!(has_fallen(output, first), falls, "{output}");
        }
    }
}
