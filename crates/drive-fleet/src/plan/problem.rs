//! Why a plan does not work.

use std::{fmt, time::Duration};

use super::Feed;
use crate::supervisor::checks::FEED_PART;

/// Why a plan does not work, with the arithmetic.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum PlanProblem {
    /// More drives than one of them allows on a segment.
    Stations {
        /// The drive that allows the fewest.
        drive: String,
        /// What it is.
        #[cfg_attr(feature = "serde", serde(deserialize_with = "drive_core::serialize::kept"))]
        family: Word,
        /// How many it allows.
        most: u8,
        /// How many drives the line has.
        drives: usize,
        /// On how many segments they are.
        segments: u8,
    },
    /// The polls want more than the line has.
    Overloaded {
        /// One status of every drive.
        #[cfg_attr(
            feature = "serde",
            serde(rename = "sweep_ns", with = "drive_core::serialize::duration_ns")
        )]
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
        /// How long it might hear nothing.
        feed: Feed,
    },
    /// A value would be too old before the next one comes, and a drive that answers would count as lost.
    Stale {
        /// The drive.
        drive: String,
        /// From one status to the next.
        #[cfg_attr(
            feature = "serde",
            serde(rename = "period_ns", with = "drive_core::serialize::duration_ns")
        )]
        period: Duration,
        /// What a status may have to wait for the others.
        #[cfg_attr(
            feature = "serde",
            serde(rename = "wait_ns", with = "drive_core::serialize::duration_ns")
        )]
        wait: Duration,
        /// The oldest status that counts as fresh.
        #[cfg_attr(
            feature = "serde",
            serde(rename = "max_age_ns", with = "drive_core::serialize::duration_ns")
        )]
        max_age: Duration,
    },
}

/// A family's name. Derived code that reads it must not take its lifetime for that of what is read, which it does where it sees the
/// reference.
type Word = &'static str;

impl fmt::Display for PlanProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stations { drive, family, most, drives, segments } => write!(
                f,
                "{drives} drives on {segments} {}: {drive} is of the family {family}, which allows {most} stations on each; share the \
                 drives among lines, or say how many segments the line has behind repeaters",
                if *segments == 1 { "segment" } else { "segments" },
            ),
            Self::Overloaded { sweep, drives, utilisation_ppm } => write!(
                f,
                "one status of {drives} drives takes {} and the polls want {}.{} % of the line: lengthen the periods, \
                 raise the speed, or share the drives among lines",
                Short(*sweep),
                utilisation_ppm / 10_000,
                utilisation_ppm / 1_000 % 10,
            ),
            Self::Starved { drive, feed } => write!(
                f,
                "the watchdog of {drive} is {}, and it might hear nothing for {}: {} until it gets a frame of its own, \
                 {} for {}, {} for a frame to each of {} watched drives; set it to {} or more, \
                 shorten the response timeout, or raise the speed",
                Short(feed.timeout),
                Short(feed.heard_within()),
                Short(feed.after),
                Short(feed.lost),
                Answers(feed.lost_answers),
                Short(feed.frames),
                feed.watched,
                Short(feed.lost.saturating_add(feed.frames).saturating_mul(FEED_PART)),
            ),
            Self::Stale { drive, period, wait, max_age } => write!(
                f,
                "a status of {drive} may be {} old before the next one comes, {} of the period and {} of waiting for \
                 the other drives, and from {} on the drive counts as lost: lengthen max_age, shorten the period, or \
                 raise the speed",
                Short(period.saturating_add(*wait)),
                Short(*period),
                Short(*wait),
                Short(*max_age),
            ),
        }
    }
}

impl std::error::Error for PlanProblem {}

/// A time in whole milliseconds, rounded up, as a person writes it.
struct Short(Duration);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let millis = u64::try_from(self.0.as_nanos().div_ceil(1_000_000)).unwrap_or(u64::MAX);
        write!(f, "{:?}", Duration::from_millis(millis))
    }
}

/// How many answers are lost.
struct Answers(u32);

impl fmt::Display for Answers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            1 => f.write_str("one answer that does not come"),
            several => write!(f, "{several} answers that do not come"),
        }
    }
}
