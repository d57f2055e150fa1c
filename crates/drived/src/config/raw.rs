//! The file as it is written: every key, before the keys are seen together.

use std::{collections::BTreeMap, path::PathBuf};

use drive_core::StopMode;
use serde::Deserialize;
use toml::Spanned;

use super::{
    doors::{HttpEntry, SocketEntry},
    gateway::GatewayEntry,
    groups::Entries,
    mqtt::MqttEntry,
    values::{
        AdoptedPolicy, BandValue, CurrentValue, ExitPolicy, FaultPolicy, FrequencyValue, LackValue,
        LossPolicy, OptionValue, Parsed, PercentValue, ReactionValue, TakenPolicy, WatchdogPolicy,
    },
};
use crate::{drive_spec::DriveSpec, duration::Time, line_spec::LineSpec};

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// How often a snapshot of every drive is printed; 0: never.
    pub(super) snapshots: Option<Spanned<Parsed<Time>>>,
    /// How long the exit may take.
    pub(super) shutdown: Option<Spanned<Parsed<Time>>>,
    pub(super) socket: Option<SocketEntry>,
    /// The folder of what is kept.
    pub(super) state: Option<PathBuf>,
    /// The file of the tokens.
    pub(super) tokens: Option<PathBuf>,
    /// The file of the audit log.
    pub(super) audit: Option<PathBuf>,
    /// The file that keeps what each watchdog was before it was armed.
    pub(super) watchdogs: Option<PathBuf>,
    /// What holds for every drive that does not say otherwise.
    pub(super) defaults: Option<DriveEntry>,
    #[serde(default)]
    pub(super) lines: BTreeMap<Spanned<String>, LineEntry>,
    #[serde(default)]
    pub(super) groups: Entries,
    pub(super) http: Option<HttpEntry>,
    pub(super) mqtt: Option<MqttEntry>,
    #[serde(default)]
    pub(super) gateways: Vec<Spanned<GatewayEntry>>,
    #[serde(default)]
    pub(super) drives: Vec<Spanned<DriveEntry>>,
}

/// `[lines.NAME]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LineEntry {
    /// As `--line` has it.
    pub(super) port: Spanned<Parsed<LineSpec>>,
    pub(super) response_timeout: Option<Spanned<Parsed<Time>>>,
    pub(super) response: Option<Spanned<Parsed<Time>>>,
    pub(super) slave_change_gap: Option<Parsed<Time>>,
    pub(super) low_latency: Option<bool>,
    pub(super) segments: Option<Spanned<u8>>,
}

/// `[[drives]]`, and `[defaults]` without the first three.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveEntry {
    pub(super) line: Option<Spanned<String>>,
    pub(super) drive: Option<Spanned<Parsed<DriveSpec>>>,
    pub(super) name: Option<Spanned<String>>,
    pub(super) control: Option<bool>,
    pub(super) commanders: Option<Spanned<Vec<String>>>,
    pub(super) running: Option<Spanned<Parsed<Time>>>,
    pub(super) rest: Option<Spanned<Parsed<Time>>>,
    pub(super) slow: Option<Spanned<Parsed<Time>>>,
    pub(super) max_age: Option<Spanned<Parsed<Time>>>,
    pub(super) watchdog: Option<Spanned<WatchdogEntry>>,
    pub(super) frequency: Option<Spanned<FrequencyEntry>>,
    pub(super) alarms: Option<AlarmEntry>,
    pub(super) stop_mode: Option<Spanned<Parsed<StopMode>>>,
    pub(super) on_exit: Option<Spanned<Parsed<ExitPolicy>>>,
    pub(super) on_exit_adopted: Option<Spanned<Parsed<AdoptedPolicy>>>,
    pub(super) on_exit_watchdog: Option<Spanned<Parsed<WatchdogPolicy>>>,
    pub(super) on_loss: Option<Spanned<Parsed<LossPolicy>>>,
    pub(super) on_fault: Option<Spanned<Parsed<FaultPolicy>>>,
    pub(super) on_control_taken: Option<Spanned<Parsed<TakenPolicy>>>,
    pub(super) accept_self_restart: Option<Spanned<Vec<String>>>,
    pub(super) accept_resume: Option<Spanned<Vec<Parsed<LackValue>>>>,
    /// How long the motor coasts at the most when its output is cut.
    pub(super) coast: Option<Spanned<Parsed<Time>>>,
    /// As `--option` has them.
    #[serde(default)]
    pub(super) options: BTreeMap<Spanned<String>, Spanned<OptionValue>>,
}

impl DriveEntry {
    /// Whether it says how often a drive is asked.
    pub(super) fn has_periods(&self) -> bool {
        [&self.running, &self.rest, &self.slow, &self.max_age].into_iter().any(Option::is_some)
    }
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WatchdogEntry {
    pub(super) time: Parsed<Time>,
    pub(super) reaction: Parsed<ReactionValue>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrequencyEntry {
    pub(super) low: Option<FrequencyValue>,
    pub(super) high: Option<FrequencyValue>,
    #[serde(default)]
    pub(super) forbidden: Vec<BandValue>,
    pub(super) change_per_second: Option<FrequencyValue>,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlarmEntry {
    pub(super) current: Option<CurrentValue>,
    pub(super) drive_thermal: Option<PercentValue>,
    pub(super) motor_thermal: Option<PercentValue>,
}
