//! Whether the motor turns: [`Motion`], a claim with its evidence (rule 12), and [`Shaft`], which follows it from status to
//! status.

use std::time::Duration;

use tokio::time::Instant;

use crate::units::Frequency;

/// What is known of the shaft. No output is not standstill: a motor whose output was cut coasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Motion {
    /// The drive turns it: a run command acts.
    Driven,
    /// The drive brings it down, along a ramp, a quick stop or by injection.
    Braking,
    /// It stands, and the drive holds it there by direct current.
    Held,
    /// The output was cut while it turned, and nothing tells when it has come to rest.
    Coasting,
    /// The drive brought it down to no output, or has shown no output since it was first seen, or its coast time is over.
    AtRest,
    /// The words do not tell.
    #[default]
    NotKnown,
}

crate::named! { Motion {
    Driven => "driven",
    Braking => "braking",
    Held => "held by injection",
    Coasting => "output off, the shaft may coast",
    AtRest => "at rest",
    NotKnown => "not known",
} }

impl Motion {
    /// Whether nothing is known of it.
    #[must_use]
    pub const fn is_not_known(&self) -> bool {
        matches!(self, Self::NotKnown)
    }

    /// Whether the drive gives the motor no torque and none is to be expected: at rest, or coasting.
    #[must_use]
    pub const fn is_undriven(self) -> bool {
        matches!(self, Self::AtRest | Self::Coasting)
    }
}

/// What one status shows of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Output {
    /// A run command acts.
    Driven,
    /// The motor is brought down, at this output.
    Braking(Frequency),
    /// Direct current is injected. Until the motor stands this brakes it.
    Injection,
    /// There is no output, and the drive has not cut it by itself: a ramp has ended.
    None,
    /// The output is cut: freewheel, a blocked output, a trip, no mains.
    Cut,
    /// The words do not tell.
    NotKnown,
}

/// The shaft behind the output, from status to status. Pure: time is an argument.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shaft {
    /// The last output that was seen, while the motor may turn by it.
    output: Option<Frequency>,
    /// Since when it coasts.
    coasts_since: Option<Instant>,
    /// Since when direct current flows.
    injected_since: Option<Instant>,
    /// How long the motor coasts at the most, where its owner says so.
    coast_time: Option<Duration>,
    /// How long an injection takes to bring it to rest.
    injection_time: Option<Duration>,
}

impl Shaft {
    /// A shaft that was never seen to turn.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            output: None,
            coasts_since: None,
            injected_since: None,
            coast_time: None,
            injection_time: None,
        }
    }

    /// How long it coasts at the most, as its owner says; `None`: nobody knows.
    pub const fn set_coast_time(&mut self, time: Option<Duration>) {
        self.coast_time = time;
    }

    /// How long an injection takes to bring it to rest; `None`: nobody knows.
    pub const fn set_injection_time(&mut self, time: Option<Duration>) {
        self.injection_time = time;
    }

    /// What a status shows at `at`, with the output frequency that the drive tells.
    pub fn see(&mut self, at: Instant, shown: Output, frequency: Option<Frequency>) -> Motion {
        let turns = frequency.is_some_and(|frequency| frequency != Frequency::ZERO);
        match shown {
            Output::NotKnown => Motion::NotKnown,
            Output::Driven | Output::Braking(_) => {
                self.output = match shown {
                    Output::Braking(at) => Some(at),
                    // A motor that is driven turns, or is about to.
                    _ => frequency.or(self.output).or(Some(Frequency::ZERO)),
                };
                (self.coasts_since, self.injected_since) = (None, None);
                if shown == Output::Driven { Motion::Driven } else { Motion::Braking }
            }
            Output::Injection => {
                let since = *self.injected_since.get_or_insert(at);
                let turned = self.output.is_some_and(|output| output != Frequency::ZERO)
                    || self.coasts_since.is_some();
                let over =
                    self.injection_time.is_some_and(|time| at.saturating_duration_since(since) >= time);
                if turned && !over { Motion::Braking } else { Motion::Held }
            }
            Output::None | Output::Cut if turns => {
                // It tells an output all the same: it comes down.
                self.output = frequency;
                Motion::Braking
            }
            Output::None | Output::Cut => self.without_output(at, shown),
        }
    }

    fn without_output(&mut self, at: Instant, shown: Output) -> Motion {
        if let Some(since) = self.injected_since.take() {
            // What was injected for long enough stands; else it coasts on.
            let over = self.injection_time.is_some_and(|time| at.saturating_duration_since(since) >= time);
            let turned = self.output.take().is_some_and(|output| output != Frequency::ZERO);
            self.coasts_since = (turned && !over).then_some(at);
        }
        let turned = self.output.take().is_some_and(|output| output != Frequency::ZERO);
        if turned && shown == Output::Cut {
            self.coasts_since = Some(at);
        }
        let Some(since) = self.coasts_since else { return Motion::AtRest };
        if self.coast_time.is_some_and(|time| at.saturating_duration_since(since) >= time) {
            self.coasts_since = None;
            return Motion::AtRest;
        }
        Motion::Coasting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIFTY: Option<Frequency> = Some(Frequency::from_hertz(50));

    #[tokio::test(start_paused = true)]
    async fn an_output_that_was_cut_leaves_a_shaft_that_coasts_until_its_owner_says_it_rests() {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        let after = |seconds| begun + Duration::from_secs(seconds);
        assert_eq!(shaft.see(begun, Output::None, None), Motion::AtRest);
        assert_eq!(shaft.see(after(1), Output::Driven, FIFTY), Motion::Driven);
        assert_eq!(shaft.see(after(2), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        assert_eq!(shaft.see(after(90), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        shaft.set_coast_time(Some(Duration::from_secs(60)));
        assert_eq!(shaft.see(after(91), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn a_ramp_that_has_ended_leaves_a_shaft_at_rest() {
        let (mut shaft, now) = (Shaft::new(), Instant::now());
        assert_eq!(shaft.see(now, Output::Braking(Frequency::from_hertz(3)), None), Motion::Braking);
        assert_eq!(shaft.see(now, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn an_injection_that_was_ended_too_early_leaves_a_shaft_that_coasts() {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        shaft.set_injection_time(Some(Duration::from_secs(2)));
        shaft.see(begun, Output::Driven, FIFTY);
        assert_eq!(shaft.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Braking);
        let early = begun + Duration::from_millis(20);
        let mut ended = shaft;
        assert_eq!(ended.see(early, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
        let late = begun + Duration::from_secs(2);
        assert_eq!(shaft.see(late, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
        assert_eq!(shaft.see(late, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }
}
