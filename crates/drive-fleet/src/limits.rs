//! Which setpoints a drive may be given: pure checks. A setpoint is refused, never clamped.

use std::{fmt, time::Duration};

use drive_core::{Frequency, Setpoint};
use tokio::time::Instant;

/// Limits of the setpoints that a fleet gives to a drive, besides the drive's own.
///
/// ```
/// use drive_core::Frequency;
/// use drive_fleet::{Band, FrequencyLimits};
///
/// let limits = FrequencyLimits {
///     low: Some(Frequency::from_hertz(20)),
///     high: Some(Frequency::from_hertz(50)),
///     // The frame resonates between 31 and 34 Hz.
///     forbidden: vec![Band { low: Frequency::from_hertz(31), high: Frequency::from_hertz(34) }],
///     ..FrequencyLimits::default()
/// };
/// assert!(limits.check().is_ok());
/// let wrong = FrequencyLimits { high: Some(Frequency::from_hertz(10)), ..limits };
/// println!("{}", wrong.check().unwrap_err());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct FrequencyLimits {
    /// The lowest.
    #[cfg_attr(feature = "serde", serde(rename = "low_hz", skip_serializing_if = "Option::is_none"))]
    pub low: Option<Frequency>,
    /// The highest.
    #[cfg_attr(feature = "serde", serde(rename = "high_hz", skip_serializing_if = "Option::is_none"))]
    pub high: Option<Frequency>,
    /// Frequencies that the machine must not be held at, such as resonances.
    #[cfg_attr(feature = "serde", serde(rename = "forbidden_hz"))]
    pub forbidden: Vec<Band>,
    /// The largest change per second while the motor turns.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "change_hz_per_second", skip_serializing_if = "Option::is_none")
    )]
    pub change_per_second: Option<Frequency>,
}

/// A forbidden band. Its edges are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "(Frequency, Frequency)", into = "(Frequency, Frequency)")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Band {
    /// The lower edge.
    pub low: Frequency,
    /// The upper edge.
    pub high: Frequency,
}

impl From<(Frequency, Frequency)> for Band {
    fn from((low, high): (Frequency, Frequency)) -> Self {
        Self { low, high }
    }
}

impl From<Band> for (Frequency, Frequency) {
    fn from(band: Band) -> Self {
        (band.low, band.high)
    }
}

/// Why a setpoint is not given to a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LimitProblem {
    /// Below the lowest or above the highest.
    Outside {
        /// What was asked for.
        asked: Frequency,
        /// The lowest that is allowed.
        low: Option<Frequency>,
        /// The highest that is allowed.
        high: Option<Frequency>,
    },
    /// Inside a forbidden band.
    Forbidden {
        /// What was asked for.
        asked: Frequency,
        /// The band.
        band: Band,
    },
    /// Too far from the last setpoint for the time since.
    TooFast {
        /// What was asked for.
        asked: Frequency,
        /// The lowest that is allowed now, by the other limits too; above the highest where nothing is.
        low: Frequency,
        /// The highest that is allowed now, by the other limits too.
        high: Frequency,
    },
    /// The limits are in hertz and the setpoint in rpm: it cannot be checked.
    NotInHertz,
    /// The drive would start at a setpoint that this fleet has not given it: it cannot be checked.
    UnknownSetpoint,
}

impl fmt::Display for LimitProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outside { asked, low, high } => {
                write!(f, "{asked} is outside the limits ")?;
                match (low, high) {
                    (Some(low), Some(high)) => write!(f, "{low} to {high}"),
                    (Some(low), None) => write!(f, "from {low}"),
                    (None, Some(high)) => write!(f, "up to {high}"),
                    (None, None) => f.write_str("of this drive"),
                }
            }
            Self::Forbidden { asked, band } => {
                write!(f, "{asked} is in the forbidden band {} to {}", band.low, band.high)
            }
            Self::TooFast { asked, low, high } => {
                write!(f, "{asked} is too far from the last setpoint: ")?;
                match low <= high {
                    true => write!(f, "{low} to {high} is allowed now"),
                    false => f.write_str("nothing within the limits is near enough yet"),
                }
            }
            Self::NotInHertz => f.write_str("the limits are in hertz, give the setpoint in hertz"),
            Self::UnknownSetpoint => f.write_str("the drive has limits: give the setpoint with the start"),
        }
    }
}

/// A setpoint and when it was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Given {
    pub(crate) setpoint: Setpoint,
    pub(crate) at: Instant,
}

impl FrequencyLimits {
    /// Whether nothing is limited.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.low.is_none()
            && self.high.is_none()
            && self.forbidden.is_empty()
            && self.change_per_second.is_none()
    }

    /// Whether limits and bands contradict themselves; then the text says how.
    ///
    /// # Errors
    /// One sentence for the person who wrote them.
    pub fn check(&self) -> Result<(), String> {
        if let (Some(low), Some(high)) = (self.low, self.high)
            && low > high
        {
            return Err(format!("the lowest frequency {low} is above the highest {high}"));
        }
        if let Some(band) = self.forbidden.iter().find(|band| band.low >= band.high) {
            return Err(format!("the forbidden band {} to {} is empty", band.low, band.high));
        }
        if let Some(high) = self.high {
            let low = self.low.unwrap_or(Frequency::ZERO);
            let edges =
                self.forbidden.iter().map(|band| band.high).filter(|edge| (low..=high).contains(edge));
            let is_forbidden =
                |asked: Frequency| self.forbidden.iter().any(|band| band.low < asked && asked < band.high);
            if edges.chain([low]).all(is_forbidden) {
                return Err(format!("the forbidden bands leave nothing of {low} to {high}"));
            }
        }
        if self.change_per_second == Some(Frequency::ZERO) {
            return Err("a change of 0.00 Hz per second forbids every setpoint".to_owned());
        }
        Ok(())
    }

    /// Checks a setpoint. `last` is what the drive was given before, if the motor turns at it.
    pub(crate) fn allow(
        &self,
        now: Instant,
        setpoint: Setpoint,
        last: Option<Given>,
    ) -> Result<(), LimitProblem> {
        if self.is_empty() {
            return Ok(());
        }
        let Setpoint::Frequency(asked) = setpoint else { return Err(LimitProblem::NotInHertz) };
        if self.low.is_some_and(|low| asked < low) || self.high.is_some_and(|high| asked > high) {
            return Err(LimitProblem::Outside { asked, low: self.low, high: self.high });
        }
        if let Some(&band) = self.forbidden.iter().find(|band| band.low < asked && asked < band.high) {
            return Err(LimitProblem::Forbidden { asked, band });
        }
        let (Some(rate), Some(Given { setpoint: Setpoint::Frequency(from), at })) =
            (self.change_per_second, last)
        else {
            return Ok(());
        };
        let step = change(rate, now.saturating_duration_since(at));
        let low = Frequency::from_centihertz(from.centihertz().saturating_sub(step));
        let high = Frequency::from_centihertz(from.centihertz().saturating_add(step));
        if (low..=high).contains(&asked) {
            return Ok(());
        }
        let (low, high) = self.allowed_of(low, high);
        Err(LimitProblem::TooFast { asked, low, high })
    }

    /// What the other limits leave of a range, from its lowest to its highest; nothing where that is above this.
    fn allowed_of(&self, low: Frequency, high: Frequency) -> (Frequency, Frequency) {
        let mut low = self.low.map_or(low, |lowest| low.max(lowest));
        let mut high = self.high.map_or(high, |highest| high.min(highest));
        let band_of =
            |asked: Frequency| self.forbidden.iter().find(|band| band.low < asked && asked < band.high);
        while let Some(band) = band_of(low) {
            low = band.high;
        }
        while let Some(band) = band_of(high) {
            high = band.low;
        }
        (low, high)
    }
}

/// How far a setpoint may move at `rate` in `elapsed`, in hundredths of a hertz.
fn change(rate: Frequency, elapsed: Duration) -> u32 {
    let step = u128::from(rate.centihertz()) * elapsed.as_millis() / 1_000;
    u32::try_from(step).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn hertz(hertz: u16) -> Frequency {
        Frequency::from_hertz(hertz)
    }

    fn limits() -> FrequencyLimits {
        FrequencyLimits {
            low: Some(hertz(10)),
            high: Some(hertz(50)),
            forbidden: vec![Band { low: hertz(20), high: hertz(22) }],
            change_per_second: Some(hertz(5)),
        }
    }

    #[test]
    fn a_setpoint_outside_the_limits_or_inside_a_band_is_refused_and_its_edges_are_allowed() {
        let now = Instant::now();
        for (asked, allowed) in
            [(9, false), (10, true), (20, true), (21, false), (22, true), (50, true), (51, false)]
        {
            assert_eq!(limits().allow(now, hertz(asked).into(), None).is_ok(), allowed, "{asked} Hz");
        }
    }

    #[test]
    fn a_setpoint_that_changes_too_fast_is_refused_until_its_time_has_come() {
        let at = Instant::now();
        let last = Some(Given { setpoint: hertz(30).into(), at });
        let asked = hertz(40).into();
        let second = Duration::from_secs(1);
        assert_eq!(
            limits().allow(at + second, asked, last),
            Err(LimitProblem::TooFast { asked: hertz(40), low: hertz(25), high: hertz(35) })
        );
        assert_eq!(limits().allow(at + 2 * second, asked, last), Ok(()));
    }

    #[test]
    fn what_is_told_to_be_allowed_now_would_be_accepted_now() {
        let (at, second) = (Instant::now(), Duration::from_secs(1));
        // From 10 to 50 Hz, but 20 to 22 Hz, by 5 Hz a second.
        for (last, asked, expected) in [
            (48, 40, (43, 50)),
            (12, 18, (10, 17)),
            (16, 30, (11, 20)),
            (26, 40, (22, 31)),
            (50, 10, (45, 50)),
        ] {
            let last = Some(Given { setpoint: hertz(last).into(), at });
            let told = limits().allow(at + second, hertz(asked).into(), last);
            let (low, high) = (hertz(expected.0), hertz(expected.1));
            assert_eq!(told, Err(LimitProblem::TooFast { asked: hertz(asked), low, high }));
            for edge in [low, high] {
                assert_eq!(limits().allow(at + second, edge.into(), last), Ok(()), "{edge}");
            }
        }
        // Limits that were set since: what is near enough is above them.
        let last = Some(Given { setpoint: hertz(60).into(), at });
        let told = limits().allow(at + second, hertz(40).into(), last).unwrap_err().to_string();
        assert_eq!(
            told,
            "40.00 Hz is too far from the last setpoint: nothing within the limits is near enough yet"
        );
    }

    #[test]
    fn a_setpoint_in_rpm_is_refused_where_the_limits_are_in_hertz() {
        let asked = drive_core::Speed::from_rpm(1_500).into();
        assert_eq!(limits().allow(Instant::now(), asked, None), Err(LimitProblem::NotInHertz));
        assert_eq!(FrequencyLimits::default().allow(Instant::now(), asked, None), Ok(()));
    }

    #[test]
    fn limits_that_contradict_themselves_are_found() {
        assert_eq!(limits().check(), Ok(()));
        for broken in [
            FrequencyLimits { low: Some(hertz(60)), ..limits() },
            FrequencyLimits { forbidden: vec![Band { low: hertz(22), high: hertz(20) }], ..limits() },
            FrequencyLimits { change_per_second: Some(Frequency::ZERO), ..limits() },
        ] {
            assert!(broken.check().is_err(), "{broken:?}");
        }
    }
}
