//! What a fleet knows of a drive: [`Snapshot`], with the time of each value and a verdict on its age.

#[cfg(feature = "serde")]
mod json;

use std::{
    borrow::Cow,
    collections::VecDeque,
    sync::Arc,
    time::{Duration, SystemTime},
};

use drive_core::{
    Control, Error, Fault, Faults, Frequency, Identity, Lease, Measurements, Motion, Refusal, SelfRestart,
    Setpoint, Status, StopMode, Watchdog,
};
use tokio::time::Instant;

use crate::{
    concern::ConcernKind,
    exceeded::Limit,
    outcome::{LastSeen, Refused},
};

/// How far the output may be from a setpoint that it has reached by its frequency alone.
pub(crate) const NEAR: Frequency = Frequency::from_centihertz(50);
/// The same where the drive itself says that it is at its reference: its slip compensation moves the output.
const NEAR_WITH_SLIP: Frequency = Frequency::from_hertz(3);

/// A value and when it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(transparent))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Timed<T> {
    /// The value.
    pub value: Arc<T>,
    /// When the exchange that brought it ended on the line; of several the first.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub at: Instant,
}

/// When a value was read, as it says itself, or else now.
fn stamp(at: &mut Option<Instant>, now: Instant) -> Instant {
    *at.insert(at.map_or(now, |at| at.min(now)))
}

impl Timed<Measurements> {
    pub(crate) fn new(mut measurements: Measurements, now: Instant) -> Self {
        let at = stamp(&mut measurements.at, now);
        Self { value: Arc::new(measurements), at }
    }
}

impl<T> Timed<T> {
    /// How old it is at `now`.
    #[must_use]
    pub fn age(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.at)
    }
}

impl Timed<Status> {
    pub(crate) fn new(mut status: Status, now: Instant) -> Self {
        let at = stamp(&mut status.at, now);
        Self { value: Arc::new(status), at }
    }

    pub(crate) fn seen(&self, now: Instant) -> LastSeen {
        LastSeen { status: Arc::clone(&self.value), age: self.age(now) }
    }
}

/// Whether a drive answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Link {
    /// It has not answered yet.
    #[default]
    Connecting,
    /// It answers.
    Connected,
    /// It has answered and does not any more.
    Lost,
}

drive_core::named! { Link {
    Connecting => "connecting",
    Connected => "connected",
    Lost => "lost",
} }

/// The verdict on a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Freshness {
    /// The drive answers and the status is young enough.
    #[cfg_attr(feature = "serde", serde(rename = "good"))]
    Fresh,
    /// The status is older than the settings allow, or the drive does not answer.
    Stale,
    /// There has been no status yet.
    #[cfg_attr(feature = "serde", serde(rename = "missing"))]
    Never,
}

drive_core::named! { Freshness {
    Fresh => "good",
    Stale => "stale",
    Never => "missing",
} }

/// What is known of which drive it is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "check", rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum IdentityCheck {
    /// Not asked since it was connected.
    #[default]
    Unchecked,
    /// It is the one that is remembered.
    Same(Arc<Identity>),
    /// The family cannot say what it is.
    CannotSay,
    /// It is another one. Motion is refused until somebody accepts that.
    Changed {
        /// What is remembered.
        remembered: Arc<Identity>,
        /// What it says now.
        #[cfg_attr(feature = "serde", serde(flatten))]
        found: Arc<Identity>,
    },
    /// It is none of the family that it is configured as. It is read, and stopped when that is asked for; nothing else is
    /// written to it.
    OtherFamily {
        /// What it is, and which family fits.
        it_is: Cow<'static, str>,
        /// What it says.
        #[cfg_attr(feature = "serde", serde(flatten))]
        found: Arc<Identity>,
    },
}

/// What is known of the drive's communication watchdog.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "check", rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum WatchdogCheck {
    /// The settings have no contract for it. As it was found it is fed all the same.
    NoContract {
        /// As it was found; `None` where it has not been read, or cannot be.
        #[cfg_attr(feature = "serde", serde(flatten, deserialize_with = "json::watchdog"))]
        found: Option<Watchdog>,
    },
    /// Not read since the drive was connected.
    Unchecked,
    /// It is set otherwise and the motor turns, so it is set up at the next standstill.
    WaitsForStandstill(Watchdog),
    /// It is as the contract says.
    Verified(Watchdog),
    /// It cannot be brought to what the contract says.
    Broken(
        #[cfg_attr(feature = "serde", serde(with = "json::why"))]
        #[cfg_attr(feature = "schemars", schemars(with = "json::Why"))]
        String,
    ),
}

impl WatchdogCheck {
    /// Whether motion may be asked for.
    pub(crate) const fn allows_motion(&self) -> bool {
        matches!(self, Self::NoContract { .. } | Self::Verified(_))
    }
}

/// A stop that is not confirmed yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct PendingStop {
    /// By which mode: the one that was asked for, or the one that took its place.
    pub mode: StopMode,
    /// Since when.
    #[cfg_attr(feature = "serde", serde(rename = "since_ms", with = "drive_core::serialize::age_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub since: Instant,
    /// In how many attempts it was sent, or may have been, that which is under way included. Each writes the stop anew, several times a
    /// second, for as long as the drive does not show it: on the wire it was more often.
    pub attempts: u32,
    /// Whether the drive has shown that no run command is in force; what is missing then is standstill.
    pub taken: bool,
    /// Whether it has gone without a confirmation for so long that it is an alarm.
    pub alarm: bool,
    /// How often a run command has come behind it: the drive had taken it, was seen all the while, and drives the motor again.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_none"))]
    pub undone: u32,
}

#[cfg(feature = "serde")]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives a reference")]
const fn is_none(times: &u32) -> bool {
    *times == 0
}

impl PendingStop {
    /// How it was sent, in words.
    #[must_use]
    pub fn sent(&self) -> String {
        match self.attempts {
            0 => "not sent yet".to_owned(),
            1 => "sent in 1 attempt".to_owned(),
            attempts => format!("sent in {attempts} attempts"),
        }
    }

    /// How often a run command has come behind it since it was seen so before.
    #[must_use]
    pub const fn undone_since(&self, before: &Self) -> u32 {
        self.undone.saturating_sub(before.undone)
    }
}

/// An output that is not at its setpoint, and comes no nearer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OffSetpoint {
    /// As this fleet gave it, and the drive confirmed it; else what the drive tells as the reference that it follows.
    pub setpoint: Frequency,
    /// Whether this fleet gave it: behind a lost line, or a restart of the program, it knows of none.
    pub is_given: bool,
    /// As the drive tells it.
    pub output: Frequency,
}

impl OffSetpoint {
    /// By a status: further than what the compensation of slip makes of it.
    pub(crate) fn of(setpoint: Option<Setpoint>, is_given: bool, status: &Status) -> Option<Self> {
        let (Some(Setpoint::Frequency(setpoint)), Some(output)) = (setpoint, status.output_frequency) else {
            return None;
        };
        let is_off = output.centihertz().abs_diff(setpoint.centihertz()) > NEAR_WITH_SLIP.centihertz();
        is_off.then_some(Self { setpoint, is_given, output })
    }
}

/// A trip, with the statuses around it: the freeze-frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trip {
    /// When it was seen.
    pub at: Instant,
    /// When it was seen, by the wall's clock as that stood then.
    pub wall: SystemTime,
    /// Whether it was found so when the drive was seen first or again: it tripped at some time before.
    pub found: bool,
    /// The last status before it; `None` when the drive was already tripped when it was first seen.
    pub before: Option<Timed<Status>>,
    /// The first status that shows it.
    pub status: Timed<Status>,
    /// What the drive said last about its faults, as soon as that has been read: while it is tripped it is asked again, for another fault may
    /// come in the place of the first.
    pub faults: Option<Arc<Faults>>,
    /// Whether it tripped by its communication watchdog: its own code says so. Where its manual names none for that it is not known.
    pub by_watchdog: bool,
    /// For how long the drive had not been heard then, where that is longer than its watchdog waits and its code does not say that it
    /// tripped by another thing; `None` also where it was already tripped when it was first seen.
    pub watchdog_after: Option<Duration>,
}

impl Trip {
    /// What it tripped by: the first of the faults that it said, or the code alone while they have not been read.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        let said = self.faults.as_deref().and_then(|faults| faults.present.first()).copied();
        said.or_else(|| self.status.value.fault_code.map(|code| Fault { code, entry: None }))
    }
}

/// What was counted for a drive since the fleet started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Counters {
    /// Statuses that were due.
    pub polls: u64,
    /// Statuses that came.
    pub answered: u64,
    /// Statuses that did not come before the next was due.
    pub missed: u64,
    /// Answers that did not come, and those that were no good.
    pub failures: u64,
    /// How often it was lost.
    pub lost: u64,
    /// Trips; not one that stood when the program saw the drive for the first time.
    pub trips: u64,
    /// Saves to EEPROM that were asked for here.
    pub saves: u64,
}

/// What a fleet knows of a drive at one moment.
///
/// ```
/// use drive_fleet::{Freshness, Link};
/// use tokio::time::Instant;
/// # use std::time::Duration;
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let settings = drive_core::SerialSettings::MODBUS_DEFAULT;
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(settings));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let line = drive_bus::Line::over(plant.in_memory(), drive_bus::LineConfig::stream(settings));
/// # let fleet = drive_fleet::Fleet::builder()
/// #     .line("north", line)
/// #     .drive("north", 1, drive_fleet::DriveSettings::controlled("pump 1"), |port, slave| {
/// #         Box::new(drive_atv312::Atv312::new(port, slave))
/// #     })
/// #     .start()?;
/// # let pump = fleet.drive("pump 1").ok_or("no such pump")?;
/// let seen = pump.wait_until(|seen| seen.link == Link::Connected).await;
/// // A value counts only while it is fresh.
/// assert_eq!(seen.freshness(Instant::now()), Freshness::Fresh);
/// let status = seen.fresh_status(Instant::now()).ok_or("it is old")?;
/// assert!(status.is_undriven() && !seen.started_here());
///
/// machine.mute();
/// let seen = pump.wait_until(|seen| seen.link == Link::Lost).await;
/// let concerns = seen.concerns(Instant::now());
/// assert_eq!(concerns[0].kind.word(), "lost");
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Snapshot {
    /// The drive's name.
    pub name: Arc<str>,
    /// Whether it answers.
    pub link: Link,
    /// What went wrong last since its last status; `None` where nothing did.
    pub error: Option<Error>,
    /// The fast set.
    pub status: Option<Timed<Status>>,
    /// Whether a second, different answer has withdrawn the fast set: it counts for nothing any more.
    pub retracted: bool,
    /// The slow set.
    pub measurements: Option<Timed<Measurements>>,
    /// The setpoint that this fleet gave it last and it confirmed, as long as nothing else is known.
    pub setpoint: Option<Setpoint>,
    /// Which drive it is.
    pub identity: IdentityCheck,
    /// Its communication watchdog.
    pub watchdog: WatchdogCheck,
    /// Which settings start its motor again by themselves; `None` where they have not been read yet.
    pub self_restarts: Option<Arc<[SelfRestart]>>,
    /// Whether the settings of this fleet accept all of them.
    pub restarts_accepted: bool,
    /// Who has taken control from this bus, until it is back.
    pub control_taken: Option<Control>,
    /// Why the run command of this side still stands though somebody else has control.
    pub run_command_stands: Option<Error>,
    /// The measured values that are above their limits.
    pub exceeded: Vec<Limit>,
    /// What is set up otherwise in it than its words are taken for, as it was read last.
    pub unmet: Option<Refusal>,
    /// That its output is not at the setpoint that it says it is at.
    pub off_setpoint: Option<OffSetpoint>,
    /// How often its EEPROM was written today, where that is more often than it lasts.
    pub eeprom_worn: Option<u32>,
    /// A stop that is not confirmed yet.
    pub stop: Option<PendingStop>,
    /// The run command of this side that stands in the drive, or may: the motor may turn, now or later, because of it.
    pub lease: Option<Lease>,
    /// What keeps it from acting, as the last status has it.
    pub suspended: Option<Refusal>,
    /// Why a start would be refused, whoever asks for it and whatever the setpoint; `None` when it would be sent.
    pub start_refused: Option<Refused>,
    /// The last trips, the newest last.
    pub trips: Arc<VecDeque<Trip>>,
    /// Counters.
    pub counters: Counters,
    /// Since when something [troubles](Self::concerns) it, of what does not say so itself.
    pub since: Vec<(ConcernKind, Instant)>,
    /// The age beyond which a status is stale.
    pub max_age: Duration,
    /// The age beyond which measurements are stale.
    pub measurements_max_age: Duration,
}

impl Snapshot {
    /// Whether a run command of this side stands in the drive, or may.
    #[must_use]
    pub const fn started_here(&self) -> bool {
        self.lease.is_some()
    }

    /// The verdict on the status at `now`.
    #[must_use]
    pub fn freshness(&self, now: Instant) -> Freshness {
        match self.judge(self.status.as_ref().map(|status| status.age(now)), self.max_age) {
            Freshness::Fresh if self.retracted => Freshness::Stale,
            judged => judged,
        }
    }

    /// The verdict on the measurements at `now`.
    #[must_use]
    pub fn measurements_freshness(&self, now: Instant) -> Freshness {
        let age = self.measurements.as_ref().map(|measurements| measurements.age(now));
        self.judge(age, self.measurements_max_age)
    }

    fn judge(&self, age: Option<Duration>, max_age: Duration) -> Freshness {
        match age {
            None => Freshness::Never,
            Some(age) if self.link == Link::Connected && age <= max_age => Freshness::Fresh,
            Some(_) => Freshness::Stale,
        }
    }

    /// The codes of the faults that stand in a drive that has tripped, as far as it has told them.
    pub(crate) fn present_faults(&self) -> Vec<u16> {
        let said = self.present_trip().and_then(|trip| trip.faults.as_deref());
        let said: Vec<u16> =
            said.into_iter().flat_map(|said| &said.present).map(|fault| fault.code).collect();
        let shown = || self.status.as_ref().and_then(|status| status.value.fault_code);
        if said.is_empty() { shown().into_iter().collect() } else { said }
    }

    /// Whether the drive tells the reference that its motor follows, with its status or with its measurements.
    pub(crate) fn tells_reference(&self) -> bool {
        self.status.as_ref().is_some_and(|status| status.value.reference.is_some())
            || self.measurements.as_ref().is_some_and(|measured| measured.value.reference.is_some())
    }

    /// Whether the output has reached the setpoint; `None` where none is known, or no status that is fresh at `now`.
    #[must_use]
    pub fn has_reached_setpoint(&self, now: Instant) -> Option<bool> {
        let (status, _) = self.fresh_status(now).zip(self.setpoint)?;
        Some(has_reached(self.setpoint, status))
    }

    /// Why a start would be refused at `now`, when the status may have grown old since this was taken.
    #[must_use]
    pub fn start_refused(&self, now: Instant) -> Option<&Refused> {
        let stale = (self.freshness(now) != Freshness::Fresh).then_some(&Refused::Stale);
        self.start_refused.as_ref().or(stale)
    }

    /// The trip that the last status still shows.
    #[must_use]
    pub fn present_trip(&self) -> Option<&Trip> {
        self.trips.back().filter(|_| self.status.as_ref().is_some_and(|status| status.value.is_fault()))
    }

    /// The status, if it is fresh at `now`.
    #[must_use]
    pub fn fresh_status(&self, now: Instant) -> Option<&Status> {
        match self.freshness(now) {
            Freshness::Fresh => self.status.as_ref().map(|status| &*status.value),
            Freshness::Stale | Freshness::Never => None,
        }
    }
}

/// Whether a status shows that the output has reached a setpoint; without a setpoint, whether the drive says so itself.
#[must_use]
pub fn has_reached(setpoint: Option<Setpoint>, status: &Status) -> bool {
    // An output that is cut or comes down may pass the setpoint, and is at none.
    if status.motion != Motion::Driven || status.at_reference == Some(false) {
        return false;
    }
    let near = if status.at_reference.is_some() { NEAR_WITH_SLIP } else { NEAR };
    match (setpoint, status.output_frequency) {
        (Some(Setpoint::Frequency(setpoint)), Some(output)) => {
            output.centihertz().abs_diff(setpoint.centihertz()) <= near.centihertz()
        }
        _ => status.at_reference == Some(true),
    }
}
