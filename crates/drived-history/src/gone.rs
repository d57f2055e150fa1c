//! A run command of this side that went, as a fact: [`Gone`], with what became of the reference. It has no clock of its own.
//!
//! A drive that was switched off has lost both: its run command and its reference are 0 when its supply is there again. Who writes another
//! run command leaves the reference as it was, unless he writes that too.

use std::{fmt, time::Duration};

use drive_core::{Frequency, Lack, Refusal, Verdict};
use drive_fleet::Snapshot;
use serde::Serialize;
use tokio::time::Instant;

/// What two readings of a drive show between which its run command went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Went {
    /// As the earlier reading showed it.
    #[serde(rename = "reference_before_hz")]
    reference_before: Frequency,
    /// As the later one does.
    #[serde(rename = "reference_hz")]
    reference: Frequency,
    /// How far they lie apart: in that time nobody here looked at it.
    unread_ms: u64,
    /// For how long its output had been falling then: some drives show only when they stand that their run command went.
    #[serde(skip_serializing_if = "Option::is_none")]
    falling_ms: Option<u64>,
}

impl fmt::Display for Went {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { reference_before, reference, unread_ms, falling_ms } = self;
        let seconds = |ms: u64| Duration::from_millis(ms).as_secs_f64();
        match falling_ms {
            Some(falling) => write!(
                f,
                "its run command was gone when that was read, its output had been falling for {:.1} s, and its reference ",
                seconds(*falling)
            ),
            None => write!(
                f,
                "its run command went between two readings that lie {:.1} s apart, and its reference ",
                seconds(*unread_ms)
            ),
        }?;
        match *reference {
            Frequency::ZERO => write!(f, "with it: from {reference_before} to 0"),
            stayed if stayed == *reference_before => write!(f, "stayed at {stayed}"),
            now => write!(f, "went from {reference_before} to {now}"),
        }
    }
}

/// Follows the run command of one drive.
#[derive(Debug, Default)]
pub(crate) struct Gone {
    /// How it was read last with a run command of this side.
    ran: Option<Ran>,
}

#[derive(Debug, Clone, Copy)]
struct Ran {
    at: Instant,
    reference: Frequency,
    output: Option<Frequency>,
    /// Where its output was when it had not fallen yet, and when that was.
    level: (Instant, Option<Frequency>),
}

impl Gone {
    /// Looks at what is known of the drive now; gives what is to be told, once for each run command that went.
    pub(crate) fn look(&mut self, snapshot: &Snapshot) -> Option<Went> {
        let status = snapshot.status.as_ref().filter(|_| !snapshot.retracted)?;
        let reference = status.value.reference?;
        let overridden = matches!(
            status.value.verdict,
            Some(Verdict::NotInForce { lacks: Lack::Command, because: Refusal::Overridden { .. } })
        );
        if overridden {
            let is_earlier = |ran: &Ran| ran.at < status.at && ran.reference != Frequency::ZERO;
            let ran = self.ran.take().filter(is_earlier)?;
            let since = |at: Instant| {
                let apart = status.at.saturating_duration_since(at);
                u64::try_from(apart.as_millis()).unwrap_or(u64::MAX)
            };
            // By more than a load that comes and goes.
            let has_fallen = ran
                .output
                .zip(ran.level.1)
                .is_some_and(|(now, level)| now.centihertz() / 9 < level.centihertz() / 10);
            let falling_ms = has_fallen.then(|| since(ran.level.0));
            return Some(Went {
                reference_before: ran.reference,
                reference,
                unread_ms: since(ran.at),
                falling_ms,
            });
        }
        let output = status.value.output_frequency;
        let fell = |before: &Ran| before.output.zip(output).is_some_and(|(before, now)| now < before);
        let level = self.ran.filter(fell).map_or((status.at, output), |ran| ran.level);
        self.ran = snapshot.started_here().then_some(Ran { at: status.at, reference, output, level });
        None
    }
}

#[cfg(test)]
mod tests {
    use drived_config::rights::{Caller, Rights};
    use drived_plant::plant::{
        commands::{Action, LIFETIME, Request, Target},
        testing::TestPlant,
    };
    use std::sync::Arc;

    use drive_core::Direction;
    use drive_fleet::Until;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_run_command_that_went_is_told_once_with_what_became_of_its_reference() {
        let test = TestPlant::of(1).await;
        let hertz = Frequency::from_hertz;
        let action = Action::Start {
            direction: Direction::Forward,
            setpoint: Some(hertz(30).into()),
            until: Until::default(),
        };
        let target = Target::Drive("pump 1".to_owned());
        let request =
            Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived: Instant::now() };
        let caller = Caller::new("operator", "page", Rights::ALL);
        let _ = test.plant.command(&caller, request, Duration::from_secs(10)).await;
        let drive = test.plant.fleet().drive("pump 1").unwrap();
        let running = drive.wait_until(Snapshot::started_here).await;
        let shown = |after_ms: u64, output: Frequency, is_gone: bool| {
            let mut seen = Snapshot::clone(&running);
            let status = seen.status.as_mut().unwrap();
            status.at += Duration::from_millis(after_ms);
            let value = Arc::make_mut(&mut status.value);
            value.reference = Some(output);
            let because = Refusal::Overridden { by: "another word", remedy: "see" };
            value.verdict =
                Some(if is_gone { Verdict::lacks(Lack::Command, because) } else { Verdict::InForce });
            seen
        };
        let told = |seen: [Snapshot; 3]| {
            let mut gone = Gone::default();
            seen.map(|seen| gone.look(&seen).map(|went| went.to_string()))
        };
        let powered =
            [shown(0, hertz(30), false), shown(1_600, hertz(0), true), shown(2_000, hertz(0), true)];
        let text = "its run command went between two readings that lie 1.6 s apart, and its reference with it: from 30.00 Hz to 0";
        assert_eq!(told(powered), [None, Some(text.to_owned()), None]);
        let stopped =
            [shown(0, hertz(30), false), shown(500, hertz(30), false), shown(1_000, hertz(30), true)];
        let text = "its run command went between two readings that lie 0.5 s apart, and its reference stayed at 30.00 Hz";
        assert_eq!(told(stopped), [None, None, Some(text.to_owned())]);
        // A drive whose state runs on until its motor stands: belt 1, whose output fell by 10 Hz from each reading to the next.
        let ramped = [(0, 30), (500, 22), (1_000, 12), (1_500, 3), (2_000, 0)].map(|(after, output)| {
            let mut seen = shown(after, hertz(30), after == 2_000);
            Arc::make_mut(&mut seen.status.as_mut().unwrap().value).output_frequency = Some(hertz(output));
            seen
        });
        let mut gone = Gone::default();
        let said: Vec<String> = ramped.iter().filter_map(|seen| Some(gone.look(seen)?.to_string())).collect();
        let text = "its run command was gone when that was read, its output had been falling for 2.0 s, and its reference stayed at 30.00 Hz";
        assert_eq!(said, [text]);
        // A reference of zero tells nothing: it was that before.
        let slow = [shown(0, hertz(0), false), shown(500, hertz(0), true), shown(1_000, hertz(0), true)];
        assert_eq!(told(slow), [None, None, None]);
    }
}
