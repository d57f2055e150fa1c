//! The arithmetic of a line: whether its drives can be asked as often as their settings say, whether their watchdogs
//! are fed, and how long a stop of all takes. Pure: it follows from the settings alone.

use std::{fmt, time::Duration};

use drive_bus::{Endpoint, LineConfig, Protocol};
use drive_core::{Capabilities, SerialSettings};

use crate::{
    settings::{Periods, WatchdogContract},
    supervisor::checks::{FEED_PART, fixed_watchdog},
};

/// Words that an exchange of a status or of measurements is reckoned with.
const WORDS: usize = 8;
/// Bytes of a request without what its protocol puts round it, and of an answer besides its words.
const REQUEST: usize = 5;
const ANSWER: usize = 2;
/// Exchanges of a stop besides its status: the ways down the state chart.
const STOP_EXCHANGES: u32 = 3;

/// What a line gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineBudget {
    /// Speed and format; `None` for Modbus TCP, which takes no time for characters and keeps no silences.
    pub serial: Option<SerialSettings>,
    /// What is spoken with these characters.
    pub protocol: Protocol,
    /// The usual time from a request to its answer.
    pub response: Duration,
    /// How long the line waits for an answer that does not come.
    pub response_timeout: Duration,
    /// The silence after a broadcast.
    pub broadcast_turnaround: Duration,
    /// After how many unanswered requests the line counts a slave as off-line.
    pub offline_after: u32,
}

impl LineBudget {
    /// What a line of this configuration gives when its slaves answer within 10 ms.
    #[must_use]
    pub const fn of(config: &LineConfig) -> Self {
        Self {
            serial: match config.endpoint {
                Endpoint::ModbusTcp(_) => None,
                _ => Some(config.serial),
            },
            protocol: config.protocol,
            response: Duration::from_millis(10),
            response_timeout: config.response_timeout,
            broadcast_turnaround: config.broadcast_turnaround,
            offline_after: config.offline_after,
        }
    }

    /// One exchange that reads.
    fn read_slot(&self) -> Duration {
        self.serial.map_or(self.response, |serial| {
            let wire = self.protocol.exchange_time(serial, REQUEST, ANSWER + 2 * WORDS);
            wire + self.response * self.protocol.turns()
        })
    }

    /// An exchange that brings no answer.
    fn lost_slot(&self) -> Duration {
        let wire = self.serial.map_or(Duration::ZERO, |serial| self.protocol.request_time(serial, REQUEST));
        wire + self.response_timeout
    }
}

/// What a drive wants of its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Demand {
    /// Its name.
    pub drive: String,
    /// What its family can do.
    pub capabilities: &'static Capabilities,
    /// How often it is asked.
    pub periods: Periods,
    /// Its watchdog, where the settings have a contract for it. A watchdog that the bus cannot set has to be fed in any
    /// case.
    pub watchdog: Option<WatchdogContract>,
}

impl Demand {
    /// The time within which it has to hear something.
    fn feed_within(&self) -> Option<Duration> {
        self.watchdog.map(|contract| contract.timeout).or_else(|| fixed_watchdog(self.capabilities))
    }
}

/// What a line will be like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinePlan {
    /// One status of every drive, one after the other.
    pub sweep: Duration,
    /// The share of the line that the polls take while every drive runs, in millionths.
    pub utilisation_ppm: u64,
    /// From the last frame that a drive heard to the next, at the latest: half of the shortest watchdog's time, one
    /// lost answer, and a frame for every watched drive. `None` without watchdogs.
    pub feed_gap: Option<Duration>,
    budget: LineBudget,
    drives: u32,
    status_exchanges: u32,
}

impl LinePlan {
    /// How long it takes at the most until every living drive of the line has confirmed a stop that all were given,
    /// with so many mute drives among them; the motors then still need their ramps.
    #[must_use]
    pub fn stop_all(&self, mute: u32) -> Duration {
        let exchanges = self.drives.saturating_mul(STOP_EXCHANGES).saturating_add(self.status_exchanges);
        let lost = mute.saturating_mul(self.budget.offline_after.max(1));
        self.budget.lost_slot()
            + self.budget.broadcast_turnaround
            + self.budget.read_slot().saturating_mul(exchanges)
            + self.budget.lost_slot().saturating_mul(lost)
    }
}

/// Why a plan does not work, with the arithmetic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanProblem {
    /// The polls want more than the line has.
    Overloaded {
        /// One status of every drive.
        sweep: Duration,
        /// How many drives.
        drives: usize,
        /// What the polls want, in millionths of the line.
        utilisation_ppm: u64,
    },
    /// A watchdog would run out.
    Starved {
        /// The drive.
        drive: String,
        /// The watchdog's time.
        timeout: Duration,
        /// The half after which the drive is given a frame of its own.
        feed_after: Duration,
        /// One answer that does not come.
        lost: Duration,
        /// A frame for every watched drive.
        frames: Duration,
        /// How many watched drives.
        watched: usize,
    },
}

impl fmt::Display for PlanProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Overloaded { sweep, drives, utilisation_ppm } => write!(
                f,
                "one status of {drives} drives takes {sweep:?} and the polls want {}.{} % of the line: lengthen the \
                 periods, raise the speed, or share the drives among lines",
                utilisation_ppm / 10_000,
                utilisation_ppm / 1_000 % 10,
            ),
            Self::Starved { drive, timeout, feed_after, lost, frames, watched } => write!(
                f,
                "the watchdog of {drive} is {timeout:?}, and it might hear nothing for {:?}: {feed_after:?} until it \
                 gets a frame of its own, {lost:?} for one answer that does not come, {frames:?} for a frame to each of \
                 {watched} watched drives; set it to {:?} or more, shorten the response timeout, or raise the speed",
                *feed_after + *lost + *frames,
                (*lost + *frames) * FEED_PART,
            ),
        }
    }
}

/// Reckons a line with its drives.
///
/// # Errors
/// [`PlanProblem`] when it cannot work.
pub fn plan(budget: LineBudget, drives: &[Demand]) -> Result<LinePlan, PlanProblem> {
    let read = budget.read_slot();
    let status = |demand: &Demand| read * u32::from(demand.capabilities.status_exchanges.max(1));
    let share = |time: Duration, period: Duration| {
        let ppm = (time.as_nanos() * 1_000_000).checked_div(period.as_nanos()).unwrap_or(u128::MAX);
        u64::try_from(ppm).unwrap_or(u64::MAX)
    };
    let sweep = drives.iter().map(status).sum();
    let utilisation_ppm = drives.iter().fold(0_u64, |sum, demand| {
        let fast = |period: Duration| {
            // A watchdog that wants to hear more often than it is polled gets frames of its own between two polls.
            let fed = demand.feed_within().map(|timeout| timeout / FEED_PART);
            let frames = fed.and_then(|fed| period.as_nanos().div_ceil(fed.as_nanos().max(1)).checked_sub(1));
            let frames = frames.and_then(|frames| u32::try_from(frames).ok()).unwrap_or_default();
            share(status(demand).saturating_add(read.saturating_mul(frames)), period)
        };
        let slow = read * u32::from(demand.capabilities.measurement_exchanges.max(1));
        let slow = if demand.periods.slow.is_zero() { 0 } else { share(slow, demand.periods.slow) };
        sum.saturating_add(fast(demand.periods.running).max(fast(demand.periods.rest))).saturating_add(slow)
    });
    let watched = drives.iter().filter(|demand| demand.feed_within().is_some()).count();
    let frames = read.saturating_mul(u32::try_from(watched).unwrap_or(u32::MAX));
    let lost = budget.lost_slot();
    let shortest = drives
        .iter()
        .filter_map(|demand| demand.feed_within().map(|timeout| (timeout, demand)))
        .min_by_key(|(timeout, _)| *timeout);
    let feed_gap = shortest.map(|(timeout, _)| timeout / FEED_PART + lost + frames);
    if let (Some((timeout, demand)), Some(gap)) = (shortest, feed_gap)
        && gap > timeout
    {
        let drive = demand.drive.clone();
        return Err(PlanProblem::Starved {
            drive,
            timeout,
            feed_after: timeout / FEED_PART,
            lost,
            frames,
            watched,
        });
    }
    if utilisation_ppm > 1_000_000 {
        return Err(PlanProblem::Overloaded { sweep, drives: drives.len(), utilisation_ppm });
    }
    Ok(LinePlan {
        sweep,
        utilisation_ppm,
        feed_gap,
        budget,
        drives: u32::try_from(drives.len()).unwrap_or(u32::MAX),
        status_exchanges: drives
            .iter()
            .map(|demand| u32::from(demand.capabilities.status_exchanges))
            .fold(0, u32::saturating_add),
    })
}

#[cfg(test)]
mod tests {
    use drive_core::Reaction;

    use super::*;
    use crate::testing::CAPABILITIES;

    const MS: Duration = Duration::from_millis(1);

    fn budget() -> LineBudget {
        LineBudget::of(&LineConfig::stream(SerialSettings::MODBUS_DEFAULT))
    }

    fn drives(count: usize, running: Duration, watchdog: Option<Duration>) -> Vec<Demand> {
        let watchdog = watchdog.map(|timeout| WatchdogContract { timeout, reaction: Reaction::Ramp });
        let periods = Periods { running, rest: 2 * running, ..Periods::default() };
        let demand = |number: usize| Demand {
            drive: format!("pump {number}"),
            capabilities: &CAPABILITIES,
            periods,
            watchdog,
        };
        (1..=count).map(demand).collect()
    }

    #[test]
    fn a_line_that_cannot_keep_its_periods_is_refused_with_the_arithmetic() {
        assert!(plan(budget(), &drives(31, 1_000 * MS, None)).is_ok());
        let problem = plan(budget(), &drives(31, 500 * MS, None)).unwrap_err();
        assert!(problem.to_string().starts_with("one status of 31 drives takes 8"), "{problem}");
    }

    #[test]
    fn a_watchdog_that_cannot_be_fed_is_refused_and_the_time_that_it_names_is_taken() {
        let problem = plan(budget(), &drives(31, 1_000 * MS, Some(1_000 * MS))).unwrap_err();
        let PlanProblem::Starved { lost, frames, .. } = &problem else { panic!("{problem}") };
        assert!(problem.to_string().contains("the watchdog of pump 1 is 1s"), "{problem}");
        let named = (*lost + *frames) * 2;
        assert!(plan(budget(), &drives(31, 1_000 * MS, Some(named))).is_ok());
        assert!(plan(budget(), &drives(31, 1_000 * MS, Some(named - MS))).is_err());
    }

    #[test]
    fn mute_drives_lengthen_the_stop_of_all_by_their_lost_answers_only() {
        let plan = plan(budget(), &drives(31, 1_000 * MS, None)).unwrap();
        let lost = plan.stop_all(3) - plan.stop_all(0);
        assert_eq!(lost, budget().lost_slot() * 9);
    }
}
