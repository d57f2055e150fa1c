//! What a drive of a fleet is told: its name, how often it is asked, how long its commands may take, its policies.

use std::time::Duration;

use drive_core::{Current, Identity, Lack, Lease, Percent, StopMode};

use crate::{
    eeprom::EepromLedger,
    limits::FrequencyLimits,
    stop_order::StopOrder,
    watchdog::{WatchdogBefore, WatchdogContract},
};

/// Declares the settings of a drive, each once: what it is, its type, and what serde has to know beside that. What nobody has
/// set is the default of its type. What is known of it besides is no setting.
macro_rules! settings {
    (
        $(#[$of_all:meta])*
        pub struct $name:ident { $($(#[$of_one:meta])* pub $setting:ident: $type:ty,)* }
        known besides { $($(#[$of_kept:meta])* pub $kept:ident: $type_kept:ty,)* }
    ) => {
        $(#[$of_all])*
        #[derive(Debug, Clone, PartialEq, Eq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
        #[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
        pub struct $name {
            /// Its name, unique in the fleet.
            pub name: String,
            $($(#[$of_one])* #[cfg_attr(feature = "serde", serde(default))] pub $setting: $type,)*
            $($(#[$of_kept])* #[cfg_attr(feature = "serde", serde(skip))] pub $kept: $type_kept,)*
        }

        impl $name {
            /// Settings of a drive that is only read.
            #[must_use]
            pub fn watched(name: impl Into<String>) -> Self {
                Self {
                    name: name.into(),
                    $($setting: <$type>::default(),)*
                    $($kept: <$type_kept>::default(),)*
                }
            }

            /// The names of the settings that others have otherwise.
            pub(crate) fn differ(&self, other: &Self) -> Vec<&'static str> {
                let pairs = [$((stringify!($setting), self.$setting != other.$setting)),*];
                pairs.into_iter().filter_map(|(name, differs)| differs.then_some(name)).collect()
            }
        }
    };
}

settings! {
    /// Settings of one drive.
    ///
    /// ```
    /// use drive_core::{Frequency, Reaction, StopMode};
    /// use drive_fleet::{DriveSettings, FrequencyLimits, OnLoss, WatchdogContract};
    /// use std::time::Duration;
    ///
    /// let pump = DriveSettings {
    ///     limits: FrequencyLimits { high: Some(Frequency::from_hertz(45)), ..FrequencyLimits::default() },
    ///     watchdog: Some(WatchdogContract { timeout: Duration::from_secs(5), reaction: Reaction::Ramp }),
    ///     on_loss: OnLoss::Stop(StopMode::Ramp),
    ///     ..DriveSettings::controlled("pump 1")
    /// };
    /// assert!(pump.control && pump.limits.check().is_ok());
    /// assert!(!DriveSettings::watched("meter").control, "it is only read");
    /// ```
    pub struct DriveSettings {
        /// Whether anything is ever written to it. `false`: it is only read, and every command is refused, stops included
        /// (rule 11).
        pub control: bool,
        /// Who may command it. Anybody may stop it.
        pub commanders: Commanders,
        /// How often it is asked.
        pub periods: Periods,
        /// How long its commands may take.
        pub times: Times,
        /// Which setpoints it may be given.
        pub limits: FrequencyLimits,
        /// Measured values that are worth an event.
        pub alarms: Alarms,
        /// Its communication watchdog; `None`: the fleet leaves it alone.
        #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
        pub watchdog: Option<WatchdogContract>,
        /// What happens to it when the fleet shuts down.
        pub on_exit: OnExit,
        /// What happens at the shut-down to a motor that turns and that the fleet has not started.
        pub on_exit_adopted: OnExitAdopted,
        /// What happens at the shut-down to the watchdog that the fleet has armed.
        pub on_exit_watchdog: OnExitWatchdog,
        /// What happens to it when it is lost.
        pub on_loss: OnLoss,
        /// What happens to it after a trip.
        pub on_fault: OnFault,
        /// What happens to it when somebody else takes control of it while it runs by our command.
        pub on_control_taken: OnControlTaken,
        /// The settings of the drive by which it may start again by itself, by their mnemonics, such as `Atr`. A start of a
        /// drive that has another such setting active is refused.
        pub accept_self_restart: Vec<String>,
        /// What a run command of this side may lack for a while and then act again by itself, such as `output` where a guard
        /// cuts the output and gives it back. Anything else that keeps it from acting has it withdrawn.
        pub accept_resume: Vec<Lack>,
        /// How long the motor coasts at the most when its output is cut, as its owner knows; `None`: nobody knows, and a motor
        /// that was cut may coast until it is driven again.
        #[cfg_attr(
            feature = "serde",
            serde(
                rename = "coast_ms",
                skip_serializing_if = "Option::is_none",
                with = "drive_core::serialize::maybe_ms"
            )
        )]
        #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
        pub coast: Option<Duration>,
        /// How long direct current takes to bring the motor to rest, as its owner knows, up to
        /// [`INJECTION_AT_MOST`](drive_core::INJECTION_AT_MOST); `None`: nobody knows, and
        /// [`INJECTION_TIME`](drive_core::INJECTION_TIME) counts.
        #[cfg_attr(
            feature = "serde",
            serde(
                rename = "injection_ms",
                skip_serializing_if = "Option::is_none",
                with = "drive_core::serialize::maybe_ms"
            )
        )]
        #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
        pub injection: Option<Duration>,
    }
    known besides {
        /// What it said it was; `None`: what it says first is remembered.
        pub identity: Option<Identity>,
        /// What was found of its communication watchdog before it was armed, where nobody lived to put that back.
        pub watchdog_before: Option<WatchdogBefore>,
        /// The run command that may still stand in the drive, and the stop that was not confirmed.
        pub run_before: Option<RunRecord>,
        /// What earlier runs have written to its EEPROM.
        pub eeprom_before: Option<EepromLedger>,
    }
}

/// What one run has left of a drive to whoever goes on with it, such as a fleet that takes it up again on another line
/// ([`DriveHandle::left`](crate::DriveHandle::left)).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Left {
    /// What the drive said it was.
    pub identity: Option<Identity>,
    /// The watchdog that was found, where it was armed and not put back.
    pub watchdog: Option<WatchdogBefore>,
    /// The run command that may still stand in the drive, and the stop that was not confirmed.
    pub run: Option<RunRecord>,
    /// What was written to its EEPROM.
    pub eeprom: Option<EepromLedger>,
}

impl DriveSettings {
    /// These settings, for a drive of which a run before has left this. What the settings say themselves of its identity counts.
    #[must_use]
    pub fn after(self, left: Left) -> Self {
        let Left { identity, watchdog, run, eeprom } = left;
        Self {
            identity: self.identity.clone().or(identity),
            watchdog_before: watchdog,
            run_before: run,
            eeprom_before: eeprom,
            ..self
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
///
/// ```
/// use drive_fleet::Commanders;
///
/// let commanders = Commanders::Only(vec!["SCADA".to_owned()]);
/// assert!(commanders.allow("SCADA") && !commanders.allow("laptop"));
/// assert!(Commanders::default().allow("laptop"));
/// ```
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

/// Declares times, each once: what it is, its name in JSON, and its default in milliseconds.
macro_rules! times {
    ($(#[$of_all:meta])* pub struct $name:ident { $($(#[$of_one:meta])* pub $time:ident as $json:literal: $default:literal,)* }) => {
        $(#[$of_all])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(
            feature = "serde",
            derive(serde::Serialize, serde::Deserialize),
            serde(default, deny_unknown_fields)
        )]
        #[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
        pub struct $name {
            $(
                $(#[$of_one])*
                #[doc = concat!("\n\nUnless it is said otherwise: ", $default, " ms.")]
                #[cfg_attr(
                    feature = "serde",
                    serde(rename = $json, with = "drive_core::serialize::duration_ms")
                )]
                #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
                pub $time: Duration,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($time: Duration::from_millis($default)),* }
            }
        }

        impl $name {
            /// Each with its name.
            pub(crate) fn named(&self) -> Vec<(&'static str, Duration)> {
                vec![$((stringify!($time), self.$time)),*]
            }
        }
    };
}

times! {
    /// How often a drive is asked.
    pub struct Periods {
        /// The fast set while it runs or has to confirm something.
        pub running as "running_ms": 500,
        /// The fast set while it stands.
        pub rest as "rest_ms": 1_000,
        /// The slow set; zero: never.
        pub slow as "slow_ms": 10_000,
        /// The oldest status that still counts as fresh. A drive without a valid status for longer is lost.
        pub max_age as "max_age_ms": 3_000,
    }
}

times! {
    /// How long the commands of a drive may take.
    pub struct Times {
        /// From the call until it is sent; what is not sent by then never is (rule 2). A start that has begun by then, for which its drive was
        /// asked something, or that waits for others of its line that start, goes on for 2 s at the most.
        pub lifetime as "lifetime_ms": 1_000,
        /// From sending until the drive's words show that it took effect: run command in force, fault gone, and where an
        /// answer was lost the time to find out. An Altivar 21 is deaf for 2 s after a reset.
        pub effect as "effect_ms": 5_000,
        /// From then until the reference is reached.
        pub reference as "reference_ms": 60_000,
        /// From a stop until standstill.
        pub standstill as "standstill_ms": 60_000,
        /// How long a stop may go without a confirmation before it raises an alarm.
        pub stop_alarm as "stop_alarm_ms": 2_000,
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

/// A run command of this side, or a stop that it has given and not seen confirmed, for whoever keeps it beyond the life of the program
/// ([`RunKept`](crate::RunKept)) and gives it to the next as [`run_before`](DriveSettings::run_before): a program that was killed has
/// stopped nothing, and ends no direct current that it has asked for.
///
/// The run command is ours again only where the drive says that it is the same one and its own words show that this very run command
/// stands. Else somebody else has started the motor. Where a [`stop`](Self::stop) was given and not confirmed, whoever has started the
/// motor, the same drive is stopped by it as soon as it has said that it is the same.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RunRecord {
    /// Which drive it was, as [`Identity`] is displayed; `None` where it does not say.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub identity: Option<String>,
    /// The run command; `None`: none of this side stands, and a stop is to be given.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub lease: Option<Lease>,
    /// How the stop that was given, and not confirmed, was to stop it; `None`: it may go on.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub stop: Option<StopMode>,
    /// For how long direct current was to be held by that stop, where somebody has said so.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "injection_ms",
            default,
            skip_serializing_if = "Option::is_none",
            with = "drive_core::serialize::maybe_ms"
        )
    )]
    pub injection: Option<Duration>,
}

impl RunRecord {
    /// What there is to keep of a drive; `None`: nothing.
    pub(crate) fn of(
        identity: impl FnOnce() -> Option<String>,
        lease: Option<Lease>,
        stop: Option<StopOrder>,
    ) -> Option<Self> {
        let is_any = lease.is_some() || crate::mutant!("stop-kept-with-a-run-alone", stop.is_some(), false);
        let record = || Self { identity: identity(), lease, stop: None, injection: None };
        is_any.then(|| record().stopped_by(stop))
    }

    /// The same, to be stopped so.
    pub(crate) fn stopped_by(self, stop: Option<StopOrder>) -> Self {
        Self { stop: stop.map(|stop| stop.mode), injection: stop.and_then(StopOrder::injects_for), ..self }
    }

    /// The stop that is to be given.
    pub(crate) fn stop_order(&self) -> Option<StopOrder> {
        self.stop.map(|mode| StopOrder { mode, injection: self.injection })
    }
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
    /// It is stopped as soon as it can be reached, whatever it does then, where there was no status for
    /// [`max_age`](Periods::max_age): its line may have called it off-line sooner.
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
    /// trip waits for somebody, and each of a drive whose manual names no code for that of its watchdog (Altivar 58).
    ResetWatchdogTrip,
}
