//! What a line gives and what a drive wants of it.

use std::time::Duration;

use drive_bus::{LineConfig, Protocol};
use drive_core::{Capabilities, SerialSettings, WatchdogCapability};

use crate::{settings::Periods, watchdog::WatchdogContract};

/// Words that an exchange is counted with of which a family does not say how long it is.
const WORDS: usize = 8;
/// Bytes of a request without what its protocol puts round it, and of an answer besides its words.
const REQUEST: usize = 5;
const ANSWER: usize = 2;
/// Bytes of the answer to a frame for a watchdog: a word that is read, or what a loop-back has carried.
const FED: usize = 5;

/// What a line gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineBudget {
    /// Speed and format; `None` for Modbus TCP, which takes no time for characters and keeps no silences.
    pub serial: Option<SerialSettings>,
    /// What is spoken with these characters.
    pub protocol: Protocol,
    /// The usual time from a request to its answer.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "response_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub response: Duration,
    /// What an adapter's pauses inside answers add to each, where the configuration says that it makes longer ones than adapters usually do.
    #[cfg_attr(feature = "serde", serde(rename = "pause_ns", with = "drive_core::serialize::duration_ns"))]
    pub pause: Duration,
    /// How long the line waits for an answer that does not come.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "response_timeout_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub response_timeout: Duration,
    /// The silence after a broadcast.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "broadcast_turnaround_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub broadcast_turnaround: Duration,
    /// The extra silence before a request to another slave than the last.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "slave_change_gap_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub slave_change_gap: Duration,
    /// After how many unanswered requests the line counts a slave as off-line.
    pub offline_after: u32,
    /// How many segments the line has: 1, and one more behind each repeater.
    pub segments: u8,
}

impl LineBudget {
    /// What a line of this configuration gives when its slaves answer within 10 ms.
    #[must_use]
    pub const fn of(config: &LineConfig) -> Self {
        Self {
            serial: if config.protocol.is_paced() { Some(config.serial) } else { None },
            protocol: config.protocol,
            response: Duration::from_millis(10),
            pause: if config.chunk_gap.as_nanos() > LineConfig::USUAL_CHUNK_GAP.as_nanos() {
                config.chunk_gap
            } else {
                Duration::ZERO
            },
            response_timeout: config.response_timeout,
            broadcast_turnaround: config.broadcast_pause,
            slave_change_gap: config.slave_change_gap,
            offline_after: config.offline_after,
            segments: 1,
        }
    }

    /// One exchange that reads eight words, with the silences that belong to it; what an exchange of a stop or of measurements is
    /// counted as.
    #[must_use]
    pub fn read_slot(&self) -> Duration {
        self.slot(ANSWER + 2 * WORDS)
    }

    /// The exchanges of one status of such a drive.
    #[must_use]
    pub fn status_slot(&self, capabilities: &Capabilities) -> Duration {
        let answer = |words: u16| ANSWER + 2 * usize::from(words);
        let more = self.slot(answer(capabilities.status_words)).saturating_sub(self.slot(answer(0)));
        self.slot(answer(0)) * u32::from(capabilities.status_exchanges.max(1)) + more
    }

    /// A frame for a watchdog, and its answer.
    #[must_use]
    pub fn fed_slot(&self) -> Duration {
        self.slot(FED)
    }

    /// A request of the usual length and an answer with so many bytes, with the silences that belong to them.
    fn slot(&self, answer: usize) -> Duration {
        self.serial.map_or(self.response, |serial| {
            let wire = self.protocol.exchange_time(serial, REQUEST, answer);
            wire + (self.response + self.pause) * self.protocol.turns() + self.slave_change_gap
        })
    }

    /// An exchange that brings no answer.
    #[must_use]
    pub fn lost_slot(&self) -> Duration {
        let wire = self.serial.map_or(Duration::ZERO, |serial| {
            self.protocol.request_time(serial, REQUEST) + self.slave_change_gap
        });
        wire + self.response_timeout
    }

    /// What a drive's own pause after its answers adds to each exchange when there is no other drive to serve in it.
    pub(super) fn idle_pause(&self, capabilities: &Capabilities) -> Duration {
        self.serial.map_or(Duration::ZERO, |serial| {
            capabilities.turnaround.saturating_sub(self.protocol.silence(serial))
        })
    }
}

/// What a drive wants of its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Demand {
    /// Its name.
    pub drive: String,
    /// What its family can do.
    pub capabilities: &'static Capabilities,
    /// The communication watchdog of this drive on its line, see
    /// [`Drive::watchdog_capability`](drive_core::Drive::watchdog_capability).
    pub watchdog_capability: Option<WatchdogCapability>,
    /// How often it is asked.
    pub periods: Periods,
    /// Its watchdog, where the settings have a contract for it. A watchdog that the bus cannot set has to be fed in any
    /// case.
    pub watchdog: Option<WatchdogContract>,
}

impl Demand {
    /// The time of the watchdog that has to be fed: that of the settings, or the one that the drive has anyway.
    #[must_use]
    pub fn watchdog_timeout(&self) -> Option<Duration> {
        self.watchdog.map(|contract| contract.timeout).or_else(|| self.watchdog_capability?.fixed())
    }

    /// The longer of the times from one status to the next.
    pub(super) fn period(&self) -> Duration {
        self.periods.running.max(self.periods.rest)
    }

    /// How long a status that is due may wait: until the next is due or the one before it is too old.
    pub(super) fn patience(&self) -> Duration {
        let next = self.periods.running.min(self.periods.rest);
        self.periods.max_age.saturating_sub(self.period()).min(next)
    }
}
