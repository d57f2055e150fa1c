//! What a drive of a fleet is told: its name, how often it is asked, how long its commands may take, its policies.

use std::time::Duration;

use drive_core::{Current, Identity, Lack, Percent, Reaction, StopMode, Watchdog};

use crate::limits::FrequencyLimits;

/// Settings of one drive.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct DriveSettings {
    /// Its name, unique in the fleet.
    pub name: String,
    /// Whether anything is ever written to it. `false`: it is only read, and every command is refused, stops included
    /// (rule 11).
    #[cfg_attr(feature = "serde", serde(default))]
    pub control: bool,
    /// Who may command it. Anybody may stop it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub commanders: Commanders,
    /// How often it is asked.
    #[cfg_attr(feature = "serde", serde(default))]
    pub periods: Periods,
    /// How long its commands may take.
    #[cfg_attr(feature = "serde", serde(default))]
    pub times: Times,
    /// Which setpoints it may be given.
    #[cfg_attr(feature = "serde", serde(default))]
    pub limits: FrequencyLimits,
    /// Measured values that are worth an event.
    #[cfg_attr(feature = "serde", serde(default))]
    pub alarms: Alarms,
    /// Its communication watchdog; `None`: the fleet leaves it alone.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub watchdog: Option<WatchdogContract>,
    /// What happens to it when the fleet shuts down.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_exit: OnExit,
    /// What happens at the shut-down to a motor that turns and that the fleet has not started.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_exit_adopted: OnExitAdopted,
    /// What happens at the shut-down to the watchdog that the fleet has armed.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_exit_watchdog: OnExitWatchdog,
    /// What happens to it when it is lost.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_loss: OnLoss,
    /// What happens to it after a trip.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_fault: OnFault,
    /// What happens to it when somebody else takes control of it while it runs by our command.
    #[cfg_attr(feature = "serde", serde(default))]
    pub on_control_taken: OnControlTaken,
    /// The settings of the drive by which it may start again by itself, by their mnemonics, such as `Atr`. A start of a
    /// drive that has another such setting active is refused.
    #[cfg_attr(feature = "serde", serde(default))]
    pub accept_self_restart: Vec<String>,
    /// What a run command of this side may lack for a while and then act again by itself, such as `output` where a guard cuts the
    /// output and gives it back. Anything else that keeps it from acting has it withdrawn.
    #[cfg_attr(feature = "serde", serde(default))]
    pub accept_resume: Vec<Lack>,
    /// How long the motor coasts at the most when its output is cut, as its owner knows; `None`: nobody knows, and a motor that
    /// was cut may coast until it is driven again.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "coast_ms",
            default,
            skip_serializing_if = "Option::is_none",
            with = "drive_core::serialize::maybe_ms"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
    pub coast: Option<Duration>,
    /// What it said it was, from an earlier run; `None`: what it says first is remembered.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub identity: Option<Identity>,
    /// What an earlier run found of its communication watchdog, armed it over, and did not live to put back.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub watchdog_before: Option<WatchdogBefore>,
}

impl DriveSettings {
    /// The names of the settings that others have otherwise.
    pub(crate) fn differ(&self, other: &Self) -> Vec<&'static str> {
        let pairs = [
            ("control", self.control != other.control),
            ("commanders", self.commanders != other.commanders),
            ("periods", self.periods != other.periods),
            ("times", self.times != other.times),
            ("limits", self.limits != other.limits),
            ("alarms", self.alarms != other.alarms),
            ("watchdog", self.watchdog != other.watchdog),
            ("on_exit", self.on_exit != other.on_exit),
            ("on_exit_adopted", self.on_exit_adopted != other.on_exit_adopted),
            ("on_exit_watchdog", self.on_exit_watchdog != other.on_exit_watchdog),
            ("on_loss", self.on_loss != other.on_loss),
            ("on_fault", self.on_fault != other.on_fault),
            ("accept_resume", self.accept_resume != other.accept_resume),
            ("coast", self.coast != other.coast),
            ("on_control_taken", self.on_control_taken != other.on_control_taken),
            ("accept_self_restart", self.accept_self_restart != other.accept_self_restart),
        ];
        pairs.into_iter().filter_map(|(name, differs)| differs.then_some(name)).collect()
    }

    /// Settings of a drive that is only read.
    #[must_use]
    pub fn watched(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            control: false,
            commanders: Commanders::Anyone,
            periods: Periods::default(),
            times: Times::default(),
            limits: FrequencyLimits::default(),
            alarms: Alarms::default(),
            watchdog: None,
            on_exit: OnExit::default(),
            on_exit_adopted: OnExitAdopted::default(),
            on_exit_watchdog: OnExitWatchdog::default(),
            on_loss: OnLoss::default(),
            on_fault: OnFault::default(),
            on_control_taken: OnControlTaken::default(),
            accept_self_restart: Vec::new(),
            accept_resume: Vec::new(),
            coast: None,
            identity: None,
            watchdog_before: None,
        }
    }

    /// Settings of a drive that is also commanded.
    #[must_use]
    pub fn controlled(name: impl Into<String>) -> Self {
        Self { control: true, ..Self::watched(name) }
    }
}

/// Who may command a drive. Commands carry the name that
/// [`DriveHandle::commanded_by`](crate::DriveHandle::commanded_by) gave them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Commanders {
    /// Whoever holds a handle.
    #[default]
    Anyone,
    /// Those who are named here.
    Only(Vec<String>),
}

impl Commanders {
    /// Whether a commander may command.
    #[must_use]
    pub fn allow(&self, commander: &str) -> bool {
        match self {
            Self::Anyone => true,
            Self::Only(names) => names.iter().any(|name| name == commander),
        }
    }
}

/// How often a drive is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Periods {
    /// The fast set while it runs or has to confirm something.
    #[cfg_attr(feature = "serde", serde(rename = "running_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub running: Duration,
    /// The fast set while it stands.
    #[cfg_attr(feature = "serde", serde(rename = "rest_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub rest: Duration,
    /// The slow set; zero: never.
    #[cfg_attr(feature = "serde", serde(rename = "slow_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub slow: Duration,
    /// The oldest status that still counts as fresh. A drive without a valid status for longer is lost.
    #[cfg_attr(feature = "serde", serde(rename = "max_age_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub max_age: Duration,
}

impl Default for Periods {
    /// 0.5 s running, 1 s at rest, 10 s for the slow set, stale after 3 s.
    fn default() -> Self {
        Self {
            running: Duration::from_millis(500),
            rest: Duration::from_secs(1),
            slow: Duration::from_secs(10),
            max_age: Duration::from_secs(3),
        }
    }
}

/// How long the commands of a drive may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Times {
    /// From the call until it is sent; what is not sent by then never is (rule 2).
    #[cfg_attr(
        feature = "serde",
        serde(rename = "lifetime_ms", with = "drive_core::serialize::duration_ms")
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub lifetime: Duration,
    /// From sending until the drive's words show that it took effect: run command in force, fault gone, and where an
    /// answer was lost the time to find out.
    #[cfg_attr(feature = "serde", serde(rename = "effect_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub effect: Duration,
    /// From then until the reference is reached.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "reference_ms", with = "drive_core::serialize::duration_ms")
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub reference: Duration,
    /// From a stop until standstill.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "standstill_ms", with = "drive_core::serialize::duration_ms")
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub standstill: Duration,
    /// How long a stop may go without a confirmation before it raises an alarm.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "stop_alarm_ms", with = "drive_core::serialize::duration_ms")
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub stop_alarm: Duration,
}

impl Default for Times {
    /// 1 s until sent, 5 s until in effect (an Altivar 21 is deaf for 2 s after a reset), 60 s to reach the reference and to stand still, an alarm after 2 s.
    fn default() -> Self {
        Self {
            lifetime: Duration::from_secs(1),
            effect: Duration::from_secs(5),
            reference: Duration::from_secs(60),
            standstill: Duration::from_secs(60),
            stop_alarm: Duration::from_secs(2),
        }
    }
}

/// Measured values above which an event is raised. None of them stops anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Alarms {
    /// The motor current.
    #[cfg_attr(feature = "serde", serde(rename = "current_a", skip_serializing_if = "Option::is_none"))]
    pub current: Option<Current>,
    /// The thermal state of the drive.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "drive_thermal_percent", skip_serializing_if = "Option::is_none")
    )]
    pub drive_thermal: Option<Percent>,
    /// The thermal state of the motor.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "motor_thermal_percent", skip_serializing_if = "Option::is_none")
    )]
    pub motor_thermal: Option<Percent>,
}

/// The drive's own communication watchdog, as it has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct WatchdogContract {
    /// The time without a message after which it acts.
    #[cfg_attr(feature = "serde", serde(rename = "time_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub timeout: Duration,
    /// What it does then.
    pub reaction: Reaction,
}

/// What a drive's communication watchdog was before it was armed. Whoever keeps it beyond the life of the program, from
/// [`WatchdogVerified`](crate::EventKind::WatchdogVerified), gives it to the next as
/// [`watchdog_before`](DriveSettings::watchdog_before): a program that was killed cannot put it back itself.
///
/// It is put back only where the drive says that it is the same one and still has the watchdog that was set.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct WatchdogBefore {
    /// Which drive it was, as [`Identity`] is displayed.
    pub identity: String,
    /// What was set.
    pub set: Watchdog,
    /// What was found, and is to be put back.
    pub found: Watchdog,
}

/// What happens to a drive when the fleet shuts down (rule 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnExit {
    /// It is stopped if this fleet started it, and left as it is otherwise.
    Stop(StopMode),
    /// As [`Stop`](Self::Stop), and at standstill control is given back to the panel or the terminals.
    Release(StopMode),
    /// It is left as it is, unless a stop of it is under way: that is repeated until it is confirmed. Its own watchdog
    /// acts, if it is armed.
    Leave,
}

impl Default for OnExit {
    fn default() -> Self {
        Self::Stop(StopMode::Ramp)
    }
}

/// What happens at the shut-down to a motor that turns and that the fleet has not started, where [`OnExit`] is not to leave it
/// or to release it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnExitAdopted {
    /// It is left turning, and that is an alarm.
    #[default]
    Report,
    /// It is stopped as well.
    Stop(StopMode),
    /// It is left turning.
    Leave,
}

/// What happens at the shut-down to the watchdog of a drive that stands. One that stays armed trips the drive as soon as
/// nobody speaks to it any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnExitWatchdog {
    /// It is put back to what was found, unless that writes to an EEPROM
    /// ([`WatchdogCapability::wears`](drive_core::WatchdogCapability::wears)).
    #[default]
    RestoreInRam,
    /// It is put back to what was found, also through an EEPROM.
    Restore,
    /// It stays armed.
    Leave,
}

/// What happens to a drive that was lost. While it is lost nothing reaches it; this is for its return.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnLoss {
    /// An event; its state is adopted when it returns.
    #[default]
    Report,
    /// It is stopped as soon as it can be reached, whatever it does then.
    Stop(StopMode),
}

/// What happens to a drive that runs by our command when its panel, its terminals or another bus take control of it (rule 5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnControlTaken {
    /// Our run command is withdrawn, so that nothing starts by it when control is given back. Where the family has no word
    /// for that it is an alarm; and a drive that has control back before it is withdrawn is stopped along its ramp.
    #[default]
    Withdraw,
    /// An event; the run command stands.
    Report,
}

/// What happens to a drive after a trip. It never starts again by itself (rule 5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum OnFault {
    /// An event; somebody resets it.
    #[default]
    Report,
    /// The trip of its communication watchdog after a lost line is reset, once, when the line is back. Every other
    /// trip waits for somebody.
    ResetWatchdogTrip,
}
