//! An output that leaves its setpoint without a command of here, as a fact: [`Departure`]. It has no clock of its own.

use std::fmt;

use drive_core::{Frequency, Motion, Setpoint};
use drive_fleet::{Snapshot, has_reached};
use serde::Serialize;
use tokio::time::Instant;

use std::time::Duration;

/// Shorter than this is no departure: a load that comes and goes.
const LASTS: Duration = Duration::from_secs(2);

/// What an output left, and where it was then.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Left {
    setpoint: Setpoint,
    #[serde(skip_serializing_if = "Option::is_none")]
    output_frequency: Option<Frequency>,
}

impl fmt::Display for Left {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "output left its setpoint of {} without a command of here", self.setpoint)?;
        match self.output_frequency {
            Some(output) => write!(f, ": it is at {output}"),
            None => Ok(()),
        }
    }
}

/// Follows the output of one drive.
#[derive(Debug, Default)]
pub(crate) struct Departure {
    /// The setpoint that the output had reached.
    reached: Option<Setpoint>,
    since: Option<Instant>,
    is_told: bool,
}

impl Departure {
    /// Looks at what is known of the drive now; gives what is to be told, once for each time that the output leaves.
    pub(crate) fn look(&mut self, snapshot: &Snapshot) -> Option<Left> {
        let status = snapshot.status.as_ref().filter(|_| !snapshot.retracted)?;
        let runs = status.value.motion == Motion::Driven && snapshot.stop.is_none();
        let setpoint = snapshot.setpoint.filter(|_| runs);
        if setpoint.is_none() || setpoint != self.reached {
            *self = Self::default();
        }
        let setpoint = setpoint?;
        if has_reached(Some(setpoint), &status.value) {
            *self = Self { reached: Some(setpoint), ..Self::default() };
            return None;
        }
        self.reached?;
        let since = *self.since.get_or_insert(status.at);
        if self.is_told || status.at.saturating_duration_since(since) < LASTS {
            return None;
        }
        self.is_told = true;
        Some(Left { setpoint, output_frequency: status.value.output_frequency })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use drive_core::Direction;
    use drive_fleet::Until;
    use drived_config::rights::{Caller, Rights};
    use drived_plant::plant::{
        commands::{Action, LIFETIME, Request, Target},
        testing::TestPlant,
    };

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn an_output_that_leaves_its_setpoint_is_told_once_and_one_that_was_given_another_is_not() {
        let test = TestPlant::of(1).await;
        let hertz = Frequency::from_hertz;
        let (lifetime, arrived) = (LIFETIME, Instant::now());
        let action = Action::Start {
            direction: Direction::Forward,
            setpoint: Some(hertz(30).into()),
            until: Until::default(),
        };
        let target = Target::Drive("pump 1".to_owned());
        let request = Request { id: None, target, action, expects: None, lifetime, arrived };
        let caller = Caller::new("operator", "page", Rights::ALL);
        let _ = test.plant.command(&caller, request, Duration::from_secs(10)).await;
        let drive = test.plant.fleet().drive("pump 1").unwrap();
        let is_there = |seen: &Snapshot| {
            seen.status.as_ref().is_some_and(|status| has_reached(seen.setpoint, &status.value))
        };
        let running = drive.wait_until(is_there).await;
        let shown = |second: u64, output: u16, setpoint: u16| {
            let mut seen = Snapshot::clone(&running);
            let status = seen.status.as_mut().unwrap();
            status.at += Duration::from_secs(second);
            let value = Arc::make_mut(&mut status.value);
            value.output_frequency = Some(hertz(output));
            value.at_reference = Some(output == setpoint);
            seen.setpoint = Some(hertz(setpoint).into());
            seen
        };
        let mut departure = Departure::default();
        let mut told = |seen: Snapshot| departure.look(&seen).map(|left| left.to_string());
        assert_eq!(told(shown(0, 18, 30)), None, "it has never been there");
        assert_eq!(told(shown(1, 30, 30)), None);
        assert_eq!(
            (told(shown(2, 18, 30)), told(shown(3, 30, 30))),
            (None, None),
            "a load that came and went"
        );
        assert_eq!((told(shown(4, 18, 30)), told(shown(5, 18, 30))), (None, None));
        let text = "output left its setpoint of 30.00 Hz without a command of here: it is at 17.00 Hz";
        assert_eq!(told(shown(6, 17, 30)), Some(text.to_owned()));
        assert_eq!(told(shown(9, 17, 30)), None, "once");
        assert_eq!((told(shown(10, 30, 30)), told(shown(11, 30, 40))), (None, None));
        assert_eq!(told(shown(19, 30, 40)), None, "it was given another one, and is on its way");
    }
}
