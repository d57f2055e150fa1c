//! One drive.

use drive_core::Setpoint;
use drive_fleet::{
    Commanders, Counters, DriveHandle, DriveSettings, IdentityCheck, Snapshot, Trip, WatchdogCheck,
};
use schemars::JsonSchema;
use serde::Serialize;
use tokio::time::Instant;

use super::{
    MeasurementsView, Quality, StatusView,
    status::{RawView, SetpointView, hertz},
    word,
};
use crate::json::{milliseconds, unix};

/// A drive as it is known at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(crate) struct DriveView {
    pub(crate) name: String,
    pub(crate) line: String,
    pub(crate) slave: u8,
    /// The family, such as `atv312`.
    pub(crate) family: &'static str,
    /// Whether it may be commanded at all.
    pub(crate) control: bool,
    /// Who may command it; absent where everybody who may command may.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) commanders: Option<Vec<String>>,
    pub(crate) link: Link,
    /// What went wrong last since its last status.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) error: Option<String>,
    pub(crate) status: StatusView,
    pub(crate) measurements: MeasurementsView,
    /// The setpoint that it was given last and confirmed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) setpoint: Option<SetpointView>,
    /// Whether the output has reached that setpoint; absent where nothing fresh is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reached: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) limits: Option<LimitsView>,
    /// The present fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fault: Option<TripView>,
    /// A stop that is not confirmed yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) stop: Option<StopView>,
    /// Whether it was started from here and has not been seen to stand since.
    pub(crate) started_here: bool,
    /// The settings by which its motor starts again by itself, by their mnemonics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) starts_by_itself: Option<Vec<&'static str>>,
    pub(crate) identity: IdentityView,
    pub(crate) watchdog: WatchdogView,
    /// Why a start would be refused now; absent when it would be sent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) start_refused: Option<String>,
    pub(crate) counters: CountersView,
}

impl DriveView {
    /// A drive of a line as it is at `now`.
    pub(crate) fn of(line: &str, drive: &DriveHandle, now: Instant) -> Self {
        let (snapshot, settings) = (&*drive.snapshot(), drive.settings());
        let status = StatusView::of(snapshot, now);
        let is_good = status.quality == Quality::Good;
        Self {
            name: snapshot.name.to_string(),
            line: line.to_owned(),
            slave: drive.slave().number(),
            family: drive.capabilities().key,
            control: settings.control,
            commanders: match &settings.commanders {
                Commanders::Anyone => None,
                Commanders::Only(names) => Some(names.clone()),
            },
            link: snapshot.link.into(),
            error: snapshot.error.as_ref().map(ToString::to_string),
            measurements: MeasurementsView::of(snapshot, settings.periods.slow, now),
            setpoint: snapshot.setpoint.map(SetpointView::from),
            reached: snapshot.setpoint.filter(|_| is_good).and_then(|setpoint| reached(snapshot, setpoint)),
            limits: LimitsView::of(settings),
            fault: TripView::present(snapshot, now),
            stop: snapshot.stop.map(|stop| StopView {
                mode: word(stop.mode),
                since_ms: milliseconds(now.saturating_duration_since(stop.since)),
                attempts: stop.attempts,
                taken: stop.taken,
            }),
            started_here: snapshot.started_here,
            starts_by_itself: snapshot
                .self_restarts
                .as_ref()
                .map(|all| all.iter().map(|restart| restart.code).collect()),
            identity: IdentityView::from(&snapshot.identity),
            watchdog: WatchdogView::from(&snapshot.watchdog),
            start_refused: match &snapshot.start_refused {
                None if !is_good => Some("its status is too old".to_owned()),
                refused => refused.as_ref().map(ToString::to_string),
            },
            counters: CountersView::from(snapshot.counters),
            status,
        }
    }
}

fn reached(snapshot: &Snapshot, setpoint: Setpoint) -> Option<bool> {
    let status = &snapshot.status.as_ref()?.value;
    Some(drive_fleet::has_reached(Some(setpoint), status))
}

/// Whether a drive answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Link {
    /// It has not answered yet.
    Connecting,
    Connected,
    /// It has answered and does not any more.
    Lost,
}

impl From<drive_fleet::Link> for Link {
    fn from(link: drive_fleet::Link) -> Self {
        match link {
            drive_fleet::Link::Connecting => Self::Connecting,
            drive_fleet::Link::Connected => Self::Connected,
            drive_fleet::Link::Lost => Self::Lost,
        }
    }
}

/// Which setpoints it may be given, besides the drive's own limits.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(crate) struct LimitsView {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) low_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) high_hz: Option<f64>,
    /// Bands that the machine must not be held at, lower and upper edge.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) forbidden_hz: Vec<[f64; 2]>,
    /// The largest change per second while the motor turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) change_hz_per_second: Option<f64>,
}

impl LimitsView {
    fn of(settings: &DriveSettings) -> Option<Self> {
        let limits = &settings.limits;
        (!limits.is_empty()).then(|| Self {
            low_hz: limits.low.map(hertz),
            high_hz: limits.high.map(hertz),
            forbidden_hz: limits.forbidden.iter().map(|band| [hertz(band.low), hertz(band.high)]).collect(),
            change_hz_per_second: limits.change_per_second.map(hertz),
        })
    }
}

/// A trip: what the drive says of it, and what it showed around it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(crate) struct TripView {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) code: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mnemonic: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) meaning: Option<&'static str>,
    /// What to do first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) remedy: Option<&'static str>,
    /// Whether its communication watchdog must have tripped it.
    pub(crate) by_watchdog: bool,
    /// When it was seen.
    pub(crate) time_unix_ms: u64,
    /// The last status before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) before: Option<StatusView>,
    /// The first status that shows it.
    pub(crate) at_trip: StatusView,
}

impl TripView {
    fn present(snapshot: &Snapshot, now: Instant) -> Option<Self> {
        let is_tripped = snapshot.status.as_ref().is_some_and(|status| status.value.is_fault());
        snapshot.trips.back().filter(|_| is_tripped).map(|trip| Self::of(trip, now))
    }

    pub(crate) fn of(trip: &Trip, now: Instant) -> Self {
        let fault = trip.faults.as_ref().and_then(|faults| faults.present.first());
        let entry = fault.and_then(|fault| fault.entry);
        Self {
            code: fault.map(|fault| fault.code).or(trip.status.value.fault_code),
            mnemonic: entry.map(|entry| entry.mnemonic),
            meaning: entry.map(|entry| entry.meaning),
            remedy: entry.map(|entry| entry.remedy),
            by_watchdog: trip.by_watchdog,
            time_unix_ms: unix(trip.at),
            before: trip.before.as_ref().map(|before| StatusView::past(before, now)),
            at_trip: StatusView::past(&trip.status, now),
        }
    }
}

/// A stop that is not confirmed yet.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct StopView {
    pub(crate) mode: String,
    pub(crate) since_ms: u64,
    /// How often it was sent, or may have been.
    pub(crate) attempts: u32,
    /// Whether the drive has shown that no run command is in force; what is missing then is standstill.
    pub(crate) taken: bool,
}

/// Which drive it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct IdentityView {
    pub(crate) check: IdentityWord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) vendor: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) model: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) firmware: Option<String>,
    /// Words that tell one model from another.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) codes: Vec<RawView>,
}

/// What is known of which drive it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum IdentityWord {
    /// Not asked since it was connected.
    Unchecked,
    /// It is the one that is remembered.
    Same,
    /// The family cannot say what it is.
    CannotSay,
    /// It is another one. Motion is refused.
    Changed,
}

impl From<&IdentityCheck> for IdentityView {
    fn from(check: &IdentityCheck) -> Self {
        let (check, identity) = match check {
            IdentityCheck::Unchecked => (IdentityWord::Unchecked, None),
            IdentityCheck::Same(identity) => (IdentityWord::Same, Some(identity)),
            IdentityCheck::CannotSay => (IdentityWord::CannotSay, None),
            IdentityCheck::Changed { found, .. } => (IdentityWord::Changed, Some(found)),
        };
        Self {
            check,
            vendor: identity.and_then(|identity| identity.vendor.clone()),
            model: identity.and_then(|identity| identity.model.clone()),
            firmware: identity.and_then(|identity| identity.version.clone()),
            codes: identity.iter().flat_map(|identity| identity.codes.iter().map(RawView::from)).collect(),
        }
    }
}

/// The drive's communication watchdog.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct WatchdogView {
    pub(crate) check: WatchdogWord,
    /// The time without a message after which it acts; absent when it is off or not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) time_ms: Option<u64>,
    /// What it does then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reaction: Option<String>,
    /// Why it cannot be brought to what the contract says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) why: Option<String>,
}

/// What is known of a drive's communication watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum WatchdogWord {
    /// The settings have no contract for it.
    NoContract,
    /// Not read since the drive was connected.
    Unchecked,
    /// It is set otherwise and the motor turns: it is set up at the next standstill.
    WaitsForStandstill,
    /// It is as the contract says.
    Verified,
    /// It cannot be brought to what the contract says.
    Broken,
}

impl From<&WatchdogCheck> for WatchdogView {
    fn from(check: &WatchdogCheck) -> Self {
        let (check, set, why) = match check {
            WatchdogCheck::NoContract { found } => (WatchdogWord::NoContract, found.as_ref(), None),
            WatchdogCheck::Unchecked => (WatchdogWord::Unchecked, None, None),
            WatchdogCheck::WaitsForStandstill(set) => (WatchdogWord::WaitsForStandstill, Some(set), None),
            WatchdogCheck::Verified(set) => (WatchdogWord::Verified, Some(set), None),
            WatchdogCheck::Broken(why) => (WatchdogWord::Broken, None, Some(why.clone())),
        };
        Self {
            check,
            time_ms: set.and_then(|set| set.timeout).map(milliseconds),
            reaction: set.and_then(|set| set.reaction).map(|reaction| reaction.to_string()),
            why,
        }
    }
}

/// What was counted for the drive since the program started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct CountersView {
    pub(crate) polls: u64,
    pub(crate) answered: u64,
    pub(crate) missed: u64,
    pub(crate) failures: u64,
    pub(crate) lost: u64,
    pub(crate) trips: u64,
    /// Saves to EEPROM that were asked for here.
    pub(crate) saves: u64,
}

impl From<Counters> for CountersView {
    fn from(counters: Counters) -> Self {
        let Counters { polls, answered, missed, failures, lost, trips, saves, .. } = counters;
        Self { polls, answered, missed, failures, lost, trips, saves }
    }
}
