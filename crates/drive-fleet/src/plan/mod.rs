//! The arithmetic of a line: whether its drives can be asked as often as their settings say, how old their values
//! become, whether their watchdogs are fed, and how long a stop of all takes. Pure: it follows from the settings alone.

mod budget;
mod problem;

use std::time::Duration;

pub use self::{
    budget::{Demand, LineBudget},
    problem::PlanProblem,
};
use crate::supervisor::checks::FEED_PART;

/// A whole line, in millionths.
const WHOLE_PPM: u64 = 1_000_000;
/// What the line gives to the probes of so many dead drives at the most, in millionths: by `share` and `LONG` of drive-bus's
/// `master/probing.rs` 5 % with ten of them, and less than 10 % with twenty and more.
const fn probes_ppm(dead: usize) -> u64 {
    match dead {
        0 => 0,
        1..=10 => 50_000,
        _ => 100_000,
    }
}
/// What the line gives to its lowest class, to which the measurements belong, even when there is no room: every
/// twentieth turn, in millionths.
const BACKGROUND_PPM: u64 = 50_000;
/// What the line gives to the commands of a group at the least, in millionths.
const COMMANDS_PPM: u64 = 100_000;

/// What a line will be like.
///
/// ```
/// use drive_bus::LineConfig;
/// use drive_core::SerialSettings;
/// use drive_fleet::{Demand, LineBudget, Periods, plan};
/// use std::time::Duration;
///
/// let budget = LineBudget::of(&LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
/// let demand = |number| Demand {
///     drive: format!("pump {number}"),
///     capabilities: &drive_atv312::CAPABILITIES,
///     watchdog_capability: drive_atv312::CAPABILITIES.watchdog,
///     periods: Periods { running: Duration::from_secs(1), rest: Duration::from_secs(1), ..Periods::default() },
///     watchdog: None,
/// };
/// let ten: Vec<_> = (1..=10).map(demand).collect();
/// let planned = plan(budget, &ten)?;
/// assert!(!planned.is_overloaded() && planned.status_age(Duration::from_secs(1)) < Duration::from_secs(3));
///
/// // Forty are more than a segment carries, and the problem says so in words.
/// let forty: Vec<_> = (1..=40).map(demand).collect();
/// assert!(plan(budget, &forty).unwrap_err().to_string().contains("stations"));
/// # Ok::<(), drive_fleet::PlanProblem>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LinePlan {
    /// One status of every living drive, one after the other, with what proves their run commands and with the frames that their
    /// watchdogs get between two of them, and what the probes of dead ones take meanwhile.
    #[cfg_attr(feature = "serde", serde(rename = "sweep_ns", with = "drive_core::serialize::duration_ns"))]
    pub sweep: Duration,
    /// The share of the line that the polls and the watchdogs take while every drive runs, and the probes of dead ones,
    /// in millionths. It is more than a million where they want more than the line has.
    pub utilisation_ppm: u64,
    /// From the last frame that the drive with the shortest watchdog heard to the next, at the latest. `None` without
    /// watchdogs.
    #[cfg_attr(feature = "serde", serde(rename = "feed_gap_ns", with = "drive_core::serialize::maybe_ns"))]
    pub feed_gap: Option<Duration>,
    budget: LineBudget,
    drives: u32,
    dead: u32,
    watched: u32,
    /// Exchanges of the stops of all, each from its first word until it is confirmed.
    stop_exchanges: u32,
    /// The statuses of every drive alone, one after the other, and the probes of dead ones.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "statuses_ns", with = "drive_core::serialize::duration_ns")
    )]
    statuses: Duration,
    /// The measurements of every drive, one after the other.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "slow_sweep_ns", with = "drive_core::serialize::duration_ns")
    )]
    slow_sweep: Duration,
    /// What the measurements leave of the line, in millionths.
    slow_ppm: u64,
    /// The share of the line with which every status comes before the next is due and is fresh until then, in
    /// millionths.
    fresh_ppm: u64,
    /// The share of the line that the frames take which the watchdogs get between two polls, in millionths.
    fed_ppm: u64,
}

impl LinePlan {
    /// Whether the polls want more than the line has. Then they fall behind, and no age has a limit.
    #[must_use]
    pub const fn is_overloaded(&self) -> bool {
        self.utilisation_ppm > WHOLE_PPM
    }

    /// The share of the line that is left for commands, in millionths.
    #[must_use]
    pub const fn left_ppm(&self) -> u64 {
        WHOLE_PPM.saturating_sub(self.utilisation_ppm)
    }

    /// How long the commands of a group leave a line to the rest after one that took this time. So the polls and the frames for
    /// the watchdogs keep the share with which none is missed, and on a line with watchdogs one half at least; the commands keep a
    /// tenth at least, or they would never come to an end.
    pub(crate) fn rest_after(&self, command: Duration) -> Duration {
        let fed = if self.feed_gap.is_some() { WHOLE_PPM / 2 } else { 0 };
        let rest = self.fresh_ppm.saturating_add(self.fed_ppm).max(fed).min(WHOLE_PPM - COMMANDS_PPM);
        stretched(command, WHOLE_PPM - rest).saturating_sub(command)
    }

    /// How old a status that is asked for at this period is at the most when the next one comes. Commands go first and
    /// come on top.
    #[must_use]
    pub fn status_age(&self, period: Duration) -> Duration {
        period.saturating_add(self.status_wait())
    }

    /// What a status waits for the others: all of them come first, the frames that watchdogs want meanwhile, and what the line gives
    /// to the measurements.
    fn status_wait(&self) -> Duration {
        self.statuses_with(self.fed_ppm)
    }

    /// The statuses of all, on a line that gives so much, in millionths, to more urgent ones, and what it must to the measurements.
    fn statuses_with(&self, urgent_ppm: u64) -> Duration {
        let background = if self.slow_sweep.is_zero() { 0 } else { BACKGROUND_PPM };
        stretched(self.statuses, (WHOLE_PPM - background).saturating_sub(urgent_ppm).max(1))
    }

    /// How old measurements that are asked for at this period are at the most when the next come: those of all the other
    /// drives come first, with what the statuses leave of the line.
    #[must_use]
    pub fn measurements_age(&self, period: Duration) -> Duration {
        let left = self.left_ppm().saturating_add(self.slow_ppm).max(BACKGROUND_PPM);
        period.saturating_add(stretched(self.slow_sweep, left.min(WHOLE_PPM)))
    }

    /// How a drive whose watchdog has this time is fed.
    #[must_use]
    pub fn feed(&self, timeout: Duration) -> Feed {
        // Each dead drive may cost an answer while the line has not yet found out that it is dead.
        let lost_answers = self.dead.max(1);
        Feed {
            timeout,
            after: timeout / FEED_PART,
            lost_answers,
            lost: self.budget.lost_slot().saturating_mul(lost_answers),
            frames: self.budget.read_slot().saturating_mul(self.watched),
            watched: self.watched,
        }
    }

    /// How long it takes at the most until every living drive of the line has confirmed a stop that all were given,
    /// with so many mute drives among them; the motors then still need their ramps.
    #[must_use]
    pub fn stop_all(&self, mute: u32) -> Duration {
        let lost = mute.saturating_mul(self.budget.offline_after.max(1));
        // A plan that was read may say anything.
        let all = self.budget.read_slot().saturating_mul(self.stop_exchanges);
        let lost = self.budget.lost_slot().saturating_mul(lost);
        let before = self.budget.lost_slot().saturating_add(self.budget.broadcast_turnaround);
        before.saturating_add(all).saturating_add(lost)
    }
}

/// How a watchdog is fed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Feed {
    /// The watchdog's time.
    #[cfg_attr(feature = "serde", serde(rename = "timeout_ns", with = "drive_core::serialize::duration_ns"))]
    pub timeout: Duration,
    /// The part of it after which the drive is given a frame of its own.
    #[cfg_attr(feature = "serde", serde(rename = "after_ns", with = "drive_core::serialize::duration_ns"))]
    pub after: Duration,
    /// How many answers of other drives may fail to come just then.
    pub lost_answers: u32,
    /// The time that they take.
    #[cfg_attr(feature = "serde", serde(rename = "lost_ns", with = "drive_core::serialize::duration_ns"))]
    pub lost: Duration,
    /// A frame for every watched drive.
    #[cfg_attr(feature = "serde", serde(rename = "frames_ns", with = "drive_core::serialize::duration_ns"))]
    pub frames: Duration,
    /// How many watched drives.
    pub watched: u32,
}

impl Feed {
    /// From the last frame that the drive heard to the next, at the latest.
    #[must_use]
    pub fn heard_within(&self) -> Duration {
        self.after.saturating_add(self.lost).saturating_add(self.frames)
    }

    /// Whether the drive hears something before its watchdog runs out.
    #[must_use]
    pub fn is_in_time(&self) -> bool {
        self.heard_within() <= self.timeout
    }
}

/// Plans a line with its drives.
///
/// # Errors
/// [`PlanProblem`] when it cannot work.
pub fn plan(budget: LineBudget, drives: &[Demand]) -> Result<LinePlan, PlanProblem> {
    let Forecast { plan, problem } = forecast(budget, drives, 0);
    problem.map_or(Ok(plan), Err)
}

/// What a line would be like, and why it would not work, if it would not.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Forecast {
    /// The figures, also of a line that cannot work.
    pub plan: LinePlan,
    /// Why it cannot work.
    pub problem: Option<PlanProblem>,
}

/// Plans a line on which so many of the drives are dead. Those that ask least of the line are taken for dead: whoever
/// dies leaves it with no more to do.
#[must_use]
pub fn forecast(budget: LineBudget, drives: &[Demand], dead: usize) -> Forecast {
    let alone = drives.len() == 1;
    let all = drives.iter().map(|demand| status_of(budget, demand, alone)).sum();
    let mut living: Vec<(&Demand, Load)> =
        drives.iter().map(|demand| (demand, Load::of(budget, demand, alone, all))).collect();
    living.sort_by_key(|(_, load)| load.status_ppm.saturating_add(load.slow_ppm));
    living.drain(..dead.min(living.len()));

    let probes = probes_ppm(dead);
    let sum =
        |of: fn(&Load) -> u64| living.iter().fold(probes, |sum, (_, load)| sum.saturating_add(of(load)));
    let slow_ppm = sum(|load| load.slow_ppm) - probes;
    let exchanges = living.iter().map(|(demand, _)| u32::from(demand.capabilities.stop_exchanges));
    let plan = LinePlan {
        sweep: stretched(living.iter().map(|(_, load)| load.status + load.fed).sum(), WHOLE_PPM - probes),
        utilisation_ppm: sum(|load| load.status_ppm).saturating_add(slow_ppm),
        feed_gap: None,
        budget,
        drives: count(living.len()),
        dead: count(dead),
        watched: count(living.iter().filter(|(demand, _)| demand.watchdog_timeout().is_some()).count()),
        stop_exchanges: exchanges.fold(0, u32::saturating_add),
        statuses: stretched(living.iter().map(|(_, load)| load.status).sum(), WHOLE_PPM - probes),
        slow_sweep: living.iter().map(|(_, load)| load.slow).sum(),
        slow_ppm,
        fresh_ppm: 0,
        fed_ppm: sum(|load| load.fed_ppm) - probes,
    };
    let patience = living.iter().map(|(demand, _)| demand.patience()).min();
    let fresh_ppm = patience.map_or(0, |patience| share(plan.statuses_with(0), patience));
    let plan = LinePlan { fresh_ppm, ..plan };
    let shortest = living
        .iter()
        .filter_map(|(demand, _)| Some((demand.watchdog_timeout()?, *demand)))
        .min_by_key(|(timeout, _)| *timeout);
    let feed = shortest.map(|(timeout, demand)| (plan.feed(timeout), demand));
    let plan = LinePlan { feed_gap: feed.map(|(feed, _)| feed.heard_within()), ..plan };
    let starved = feed
        .filter(|(feed, _)| !feed.is_in_time())
        .map(|(feed, demand)| PlanProblem::Starved { drive: demand.drive.clone(), feed });
    let problem = crowded(budget, drives).or(starved).or_else(|| overloaded(&plan)).or_else(|| {
        // In the order in which they were given.
        let is_living = |demand: &&Demand| living.iter().any(|(living, _)| std::ptr::eq(*living, *demand));
        drives.iter().filter(is_living).find_map(|demand| stale(&plan, demand))
    });
    Forecast { plan, problem }
}

/// Whether there are more stations on a segment than its drives allow, the drives shared evenly among the segments.
fn crowded(budget: LineBudget, drives: &[Demand]) -> Option<PlanProblem> {
    let strictest = drives.iter().min_by_key(|demand| demand.capabilities.stations)?;
    let (most, segments) = (strictest.capabilities.stations, budget.segments.max(1));
    let fits = drives.len() <= usize::from(most) * usize::from(segments);
    (budget.serial.is_some() && !fits).then(|| PlanProblem::Stations {
        drive: strictest.drive.clone(),
        family: strictest.capabilities.name,
        most,
        drives: drives.len(),
        segments,
    })
}

fn overloaded(plan: &LinePlan) -> Option<PlanProblem> {
    plan.is_overloaded().then_some(PlanProblem::Overloaded {
        sweep: plan.sweep,
        drives: plan.drives as usize,
        utilisation_ppm: plan.utilisation_ppm,
    })
}

fn stale(plan: &LinePlan, demand: &Demand) -> Option<PlanProblem> {
    let (period, max_age) = (demand.period(), demand.periods.max_age);
    (plan.status_age(period) > max_age).then(|| PlanProblem::Stale {
        drive: demand.drive.clone(),
        period,
        wait: plan.status_wait(),
        max_age,
    })
}

/// What one drive takes of its line.
#[derive(Debug, Clone, Copy)]
struct Load {
    /// One status, with its part of what proves a run command.
    status: Duration,
    /// The frames for the watchdog between two of them, at the most.
    fed: Duration,
    /// One slow set; nothing where it is never asked for.
    slow: Duration,
    /// The share of the statuses and of the frames for the watchdog, in millionths.
    status_ppm: u64,
    /// That of the frames alone.
    fed_ppm: u64,
    /// The share of the slow set, in millionths.
    slow_ppm: u64,
}

impl Load {
    fn of(budget: LineBudget, demand: &Demand, alone: bool, all: Duration) -> Self {
        let pause = pause_of(budget, demand, alone);
        let status = status_of(budget, demand, alone);
        let late_by = |late: Duration, period: Duration| {
            let after = demand.watchdog_timeout().map(|timeout| timeout / FEED_PART);
            let ppm = after.map_or(0, |after| frames_ppm(period, after, status, late));
            times_ppm(budget.fed_slot() + pause, ppm)
        };
        let fed = |period: Duration| late_by(Duration::ZERO, period);
        let fast = |period: Duration| share(status.saturating_add(fed(period)), period);
        // Where it has to wait for the statuses of all others a frame more may come.
        let most = |period: Duration| late_by(all.saturating_sub(status), period);
        let slow = match demand.periods.slow.is_zero() {
            true => Duration::ZERO,
            false => {
                (budget.read_slot() + pause) * u32::from(demand.capabilities.measurement_exchanges.max(1))
            }
        };
        let of_either = [demand.periods.running, demand.periods.rest];
        Self {
            status,
            fed: of_either.map(most).into_iter().max().unwrap_or_default(),
            slow,
            status_ppm: of_either.map(fast).into_iter().max().unwrap_or(0),
            fed_ppm: of_either.map(|at| share(fed(at), at)).into_iter().max().unwrap_or(0),
            slow_ppm: if slow.is_zero() { 0 } else { share(slow, demand.periods.slow) },
        }
    }
}

/// What a drive's own pause adds to each of its exchanges.
fn pause_of(budget: LineBudget, demand: &Demand, alone: bool) -> Duration {
    if alone { budget.idle_pause(demand.capabilities) } else { Duration::ZERO }
}

/// One status of a drive, with its part of the exchange that proves a run command behind every so many, which is as long as those
/// of a status.
fn status_of(budget: LineBudget, demand: &Demand, alone: bool) -> Duration {
    let (capabilities, pause) = (demand.capabilities, pause_of(budget, demand, alone));
    let exchanges = u32::from(capabilities.status_exchanges.max(1));
    let status = budget.status_slot(capabilities) + pause * exchanges;
    let turn = (status / exchanges).checked_div(u32::from(capabilities.statuses_per_turn));
    status + turn.unwrap_or_default()
}

/// The frames that a watchdog gets between two statuses, on average at the most and in millionths: one whenever the drive has
/// heard nothing for the time `after`. So many fit into the period besides the status, and as many begin as a status that is `late`
/// at some times and not at others leaves them the time. A drive that is polled more often gets none.
fn frames_ppm(period: Duration, after: Duration, status: Duration, late: Duration) -> u64 {
    if period < after {
        return 0;
    }
    let left = period.saturating_sub(status);
    let begun = (left + late).as_nanos().checked_div(after.as_nanos()).unwrap_or(u128::MAX);
    let begun = u64::try_from(begun).unwrap_or(u64::MAX).saturating_mul(WHOLE_PPM);
    share(left, after).min(begun)
}

/// Something so many millionths of a time.
fn times_ppm(time: Duration, ppm: u64) -> Duration {
    let nanos = time.as_nanos().saturating_mul(u128::from(ppm)) / u128::from(WHOLE_PPM);
    Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
}

/// The part of a period that something takes, in millionths.
fn share(time: Duration, period: Duration) -> u64 {
    let ppm = (time.as_nanos() * u128::from(WHOLE_PPM)).checked_div(period.as_nanos()).unwrap_or(u128::MAX);
    u64::try_from(ppm).unwrap_or(u64::MAX)
}

/// What something takes that gets so many millionths of the line; not none.
fn stretched(time: Duration, ppm: u64) -> Duration {
    let nanos = (time.as_nanos() * u128::from(WHOLE_PPM)).checked_div(u128::from(ppm)).unwrap_or(u128::MAX);
    Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests;
