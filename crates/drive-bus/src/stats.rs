//! What a line counts, always: per slave, per class, for the line as a whole.

mod histogram;
#[cfg(feature = "serde")]
mod json;
mod slave;
mod spread;

use std::{collections::BTreeMap, time::Duration};

use drive_core::Class;

pub use histogram::Histogram;
pub use slave::{Outcomes, SlaveStats};
pub use spread::{BOUNDS, Spread};

/// What the line knows of one class.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct ClassStats {
    /// Requests sent for the first time.
    pub sent: u64,
    /// From the call to the first bit on the line.
    pub wait: Histogram,
    /// The same by fixed bounds.
    pub waits: Spread,
}

/// What is known of the gateway between a connection and its drives, see [`Gateway`](crate::Gateway).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FarEndStats {
    /// Questions in vain that it may still be at.
    pub owed: usize,
    /// How many requests it serves at once, as far as was seen.
    pub at_once: usize,
    /// It was seen, or is set, that it serves no more.
    pub no_more: bool,
    /// How long it waits for a drive that does not answer.
    #[cfg_attr(feature = "serde", serde(rename = "wait_ns", with = "drive_core::serialize::duration_ns"))]
    pub wait: Duration,
    /// Where that is from.
    pub wait_is: WaitIs,
    /// Questions that were asked in vain.
    pub in_vain: u64,
    /// Whether it serves a second connection, over which a stop goes past what the first waits for.
    pub second: SecondConnection,
    /// How many stops were answered over that.
    pub stops_over_second: u64,
}

/// Whether a far end serves a second connection of this line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum SecondConnection {
    /// None was needed yet, or none is to be opened.
    Unused,
    /// It was answered over it.
    Granted,
    /// It is not granted, for this reason, and was given up.
    GivenUp(#[cfg_attr(feature = "serde", serde(deserialize_with = "drive_core::serialize::kept"))] Word),
}

/// A reason of this crate's. Derived code that reads it must not take its lifetime for that of what is read, which it does where
/// it sees the reference.
type Word = &'static str;

/// How it is known how long a gateway waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum WaitIs {
    /// Nobody knows: [`Gateway::ASSUMED_WAIT`](crate::Gateway::ASSUMED_WAIT).
    Assumed,
    /// As configured.
    Set,
    /// As it was seen to wait last.
    Seen,
}

/// What a line has counted since it was opened.
///
/// ```
/// use drive_bus::{Line, LineConfig};
/// use drive_core::{Class, SerialSettings};
/// # use tokio_modbus::client::{Context, Reader};
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let stream = plant.in_memory();
/// let line = Line::over(stream, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
/// # let mut drive: Context = line.slave(1).into();
/// # drive.read_holding_registers(3201, 1).await??;
/// let stats = line.stats();
/// for (slave, told) in &stats.slaves {
///     println!("{slave}: {} answers, {:?} p99", told.outcomes.answered, told.response.quantile(990));
/// }
/// assert_eq!(stats.class(Class::Status).sent, 1);
/// assert_eq!((stats.foreign, stats.noise_bytes), (0, 0), "nobody else is on this line");
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct Stats {
    /// Since when, as a duration.
    #[cfg_attr(feature = "serde", serde(rename = "elapsed_ns", with = "drive_core::serialize::duration_ns"))]
    pub elapsed: Duration,
    /// Time in which the line was needed: the characters of requests and answers, the silences that the protocol and
    /// the slaves want, and the slaves' own time to answer. What is missing to `elapsed` was idle or lost to the host.
    #[cfg_attr(feature = "serde", serde(rename = "busy_ns", with = "drive_core::serialize::duration_ns"))]
    pub busy: Duration,
    /// Per slave, those that were asked.
    pub slaves: BTreeMap<u8, SlaveStats>,
    /// Per class, the most urgent first, as [`Class::ALL`].
    #[cfg_attr(feature = "serde", serde(with = "json::classes"))]
    pub classes: [ClassStats; 5],
    /// The silence kept before each request, from the end of the last activity to the write.
    pub silence: Histogram,
    /// How much later than allowed each request was written while one was waiting: what the host costs.
    pub lag: Histogram,
    /// Intact frames of somebody else, or of a slave that nobody had asked.
    pub foreign: u64,
    /// Bytes that made no frame.
    pub noise_bytes: u64,
    /// Requests that the adapter gave back.
    pub echoes: u64,
    /// Whether the adapter echoes, as far as is known.
    pub echoing: bool,
    /// Calls that ended because the line was never quiet.
    pub never_quiet: u64,
    /// Broadcasts sent.
    pub broadcasts: u64,
    /// How often the port was opened, and lost.
    pub opened: u64,
    /// How often the port was lost.
    pub lost: u64,
    /// The gateway, where there may be one.
    pub far_end: Option<FarEndStats>,
    /// Why the port was lost or cannot be opened; `None` while it is open, and before that is known.
    pub away: Option<String>,
    /// Requests that wait now.
    pub queued: usize,
    /// The longest wait of a Stop until its first bit, while the line goes on as it has: with the response times that it
    /// has learned, the longest exchange that was asked, and foreign frames and damage only where there were any. Beside
    /// it stands [`LineConfig::worst_case_stop`](crate::LineConfig::worst_case_stop), which holds whatever happens.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "worst_case_stop_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub worst_case_stop: Duration,
}

/// How it begins why a port is opened anew that is there, and on which nobody answers.
pub(crate) const NOTHING_HEARD: &str = "nothing was heard";

impl Stats {
    /// Why the port is not there; `None`: it is. One that is only opened anew because nobody answers is there: what is seen then is a
    /// silence, and no port that is away.
    #[must_use]
    pub fn port_away(&self) -> Option<&str> {
        let why = self.away.as_deref().unwrap_or("it is opened");
        (self.opened <= self.lost && !why.starts_with(NOTHING_HEARD)).then_some(why)
    }

    /// The same, where that is known: a port that is opened for the first time is not away yet.
    #[must_use]
    pub fn port_known_away(&self) -> Option<&str> {
        self.port_away().filter(|_| self.away.is_some())
    }

    /// Whether everything that came as an answer came sooner than the configured speed can carry it, so that nothing was taken
    /// for one: three times at least, and nothing else. The far end is faster then than it is said to be, an adapter without a
    /// UART or a program, and [`far_end_paces`](crate::LineConfig::far_end_paces) is to be `Some(false)`; or the speed is set
    /// too low.
    #[must_use]
    pub fn is_faster_than_configured(&self) -> bool {
        let early: u64 = self.slaves.values().map(|slave| slave.early).sum();
        let in_time: u64 =
            self.slaves.values().map(|slave| slave.outcomes.answered + slave.outcomes.exceptions).sum();
        early >= 3 && in_time == 0
    }

    /// One class.
    #[must_use]
    pub fn class(&self, class: Class) -> &ClassStats {
        let [stop, command, keep_alive, status, background] = &self.classes;
        match class {
            Class::Stop => stop,
            Class::Command => command,
            Class::KeepAlive => keep_alive,
            Class::Status => status,
            Class::Background => background,
        }
    }

    pub(crate) fn class_mut(&mut self, class: Class) -> &mut ClassStats {
        let [stop, command, keep_alive, status, background] = &mut self.classes;
        match class {
            Class::Stop => stop,
            Class::Command => command,
            Class::KeepAlive => keep_alive,
            Class::Status => status,
            Class::Background => background,
        }
    }

    /// `busy` by `elapsed`, in millionths.
    #[must_use]
    pub fn utilisation_ppm(&self) -> u32 {
        let ppm = (self.busy.as_nanos() * 1_000_000).checked_div(self.elapsed.as_nanos()).unwrap_or_default();
        u32::try_from(ppm).unwrap_or(u32::MAX)
    }
}
