//! What a family of drives can do, as data: for choosing, for checking a configuration, for the README's table.

use std::{fmt, time::Duration};

use crate::{
    address::SlaveAddress,
    quantity::Quantity,
    registers::{Restoring, Row, Scaled},
    serial::{CharacterFormat, SerialSettings},
    setpoint::StopMode,
    status::Status,
    turns::STATUSES_PER_TURN,
};

/// What a family can do. What stands here the drive does; what does not is
/// [`Error::Unsupported`](crate::Error::Unsupported), never a silent no-op.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Capabilities {
    /// The name that configurations use, such as `atv312`.
    pub key: &'static str,
    /// The vendor's name, such as `Schneider Altivar 312`.
    pub name: &'static str,
    /// The serial protocols that it speaks, by the names that configurations use: `rtu`, `ascii`, `unitelway`.
    pub protocols: &'static [&'static str],
    /// The Modbus functions it answers.
    pub functions: &'static [u8],
    /// Words that one read may ask for.
    pub read_words: u16,
    /// Every register that the manual lists.
    pub rows: &'static [Row],
    /// Whether one read may take any of the [`rows`](Self::rows) that stand in a row, up to [`read_words`](Self::read_words).
    /// Where an answer must differ from one that may still come, a read takes some more of them along. Not where each read
    /// has its own fixed form, or where what stands behind it is not known.
    pub reads_across: bool,
    /// Registers whose unit another register chooses.
    pub scaled: &'static [Scaled],
    /// What of its registers a backup keeps, and the order in which a restore writes it.
    pub restoring: Restoring,
    /// Words that one write (function 16) may carry.
    pub write_words: u16,
    /// The highest slave address it can have; the lowest is 1.
    pub highest_address: u8,
    /// How many stations its manual allows on one segment; 31, which is what RS-485 carries besides the master, where it
    /// prints none.
    pub stations: u8,
    /// The speeds it can be set to, in bit/s.
    pub speeds: &'static [u32],
    /// The character formats it can be set to.
    pub formats: &'static [CharacterFormat],
    /// Its factory setting, or a usual setting where the manual prints none.
    pub factory: SerialSettings,
    /// The stop modes it has.
    pub stop_modes: &'static [StopMode],
    /// Whether it takes a setpoint in rpm besides one in hertz.
    pub speed_setpoint: bool,
    /// Takes a setpoint in percent, where it is set up to count so.
    pub share_setpoint: bool,
    /// The smallest step of a frequency setpoint as the manual prints it.
    pub frequency_step: &'static str,
    /// How a fault is reset over the bus.
    pub fault_reset: &'static str,
    /// Its communication watchdog, where it has one that the bus can read or set.
    pub watchdog: Option<WatchdogCapability>,
    /// The code by which it says that it tripped because its communication watchdog ran out: that of
    /// [`Status::fault_code`](crate::Status::fault_code) and of [`Fault::code`](crate::Fault::code). `None` where its manual
    /// names none.
    pub communication_fault: Option<u16>,
    /// Where its status says that its STOP key has stopped the motor; `None` where its manual names no such bit.
    pub stop_key: Option<StatusBit>,
    /// How it says what it is, where it does.
    pub identification: Option<&'static str>,
    /// Whether control can be given back to the panel or the terminals over the bus.
    pub release: bool,
    /// How parameters are saved to EEPROM over the bus, where that is a command of its own.
    pub persist: Option<&'static str>,
    /// Stop modes that can be sent to all slaves at once.
    pub broadcast_stops: &'static [StopMode],
    /// The fault history's length.
    pub fault_history: u8,
    /// The silence that a slave of this family needs after its answer before the next request, above t3.5.
    pub turnaround: Duration,
    /// The setting by which it waits before it answers, where it has one.
    pub answer_delay: Option<AnswerDelay>,
    /// Exchanges of one [`Drive::status`](crate::Drive::status) of a drive that stands or runs, at the most, once what is
    /// read only once is known: what a plan counts, whatever is configured in the drive. One that is stopping or has
    /// tripped may take one more.
    pub status_exchanges: u8,
    /// Words that these exchanges read, all together.
    pub status_words: u16,
    /// Behind how many statuses of a drive with a run command of this side there may be one more exchange that proves it, see
    /// [`Drive::status`](crate::Drive::status); 0: never.
    pub statuses_per_turn: u16,
    /// Exchanges of one [`Drive::stop`](crate::Drive::stop) of a drive that runs and obeys, from its first word until it is
    /// confirmed, at the most.
    pub stop_exchanges: u8,
    /// Exchanges of one [`Drive::measurements`](crate::Drive::measurements).
    pub measurement_exchanges: u8,
    /// The values that a drive of it can show, whatever a single drive or its configuration holds back: who announces values
    /// before a drive was seen announces these. One that stands here may be missing in a drive; one that does not is never there.
    pub quantities: &'static [Quantity],
}

/// A bit of a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StatusBit {
    /// The word that it is in, among [`Status::raw`](crate::Status::raw).
    pub address: u16,
    /// The bit, as a mask.
    pub mask: u16,
    /// Where the manual says so.
    pub source: &'static str,
}

impl StatusBit {
    /// Whether it is 1 in a status; `None` where that has not its word.
    #[must_use]
    pub fn is_set(&self, status: &Status) -> Option<bool> {
        status.raw(self.address).map(|word| word & self.mask != 0)
    }
}

/// A setting by which a drive waits before it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct AnswerDelay {
    /// The manual's mnemonic of its register, which counts milliseconds.
    pub code: &'static str,
    /// What it can be set to at the most.
    pub longest: Duration,
    /// Bits of the line that a drive waits besides.
    pub bits: u32,
    /// Where the manual says so.
    pub source: &'static str,
}

impl AnswerDelay {
    /// How long a drive may take before it answers, on this line, whose register holds so many milliseconds; as long as it can be
    /// where that is not known.
    #[must_use]
    pub fn of(&self, serial: SerialSettings, milliseconds: Option<u16>) -> Duration {
        let set =
            milliseconds.map_or(self.longest, |milliseconds| Duration::from_millis(milliseconds.into()));
        serial.bits(self.bits) + set
    }
}

impl Capabilities {
    /// A family that does the least: functions 03 and 06, one word at a time, addresses up to 247, 9600 and 19200 bit/s, 8E1,
    /// a stop along the ramp, one exchange of eight words for a status and one for the measurements; nothing else. That it
    /// might show any value is the one thing that is taken for given. A family of your own says
    /// what is different and ends with `..Capabilities::least(…)`, so that what is added here later breaks nothing:
    ///
    /// ```
    /// use drive_core::{Capabilities, StopMode};
    ///
    /// pub const CAPABILITIES: Capabilities = Capabilities {
    ///     functions: &[0x03, 0x06, 0x10],
    ///     read_words: 8,
    ///     stop_modes: &[StopMode::Ramp, StopMode::Freewheel],
    ///     ..Capabilities::least("fan1", "Somebody's fan drive")
    /// };
    /// # assert_eq!(CAPABILITIES.highest_address, 247);
    /// ```
    #[must_use]
    pub const fn least(key: &'static str, name: &'static str) -> Self {
        Self {
            key,
            name,
            protocols: &["rtu"],
            functions: &[0x03, 0x06],
            read_words: 1,
            rows: &[],
            reads_across: false,
            scaled: &[],
            restoring: Restoring::NONE,
            write_words: 1,
            highest_address: 247,
            stations: 31,
            speeds: &[9_600, 19_200],
            formats: &[CharacterFormat::F8E1],
            factory: SerialSettings::MODBUS_DEFAULT,
            stop_modes: &[StopMode::Ramp],
            speed_setpoint: false,
            share_setpoint: false,
            frequency_step: "0.1 Hz",
            fault_reset: "as its manual says",
            watchdog: None,
            communication_fault: None,
            stop_key: None,
            identification: None,
            release: false,
            persist: None,
            broadcast_stops: &[],
            fault_history: 0,
            turnaround: Duration::ZERO,
            answer_delay: None,
            status_exchanges: 1,
            status_words: 8,
            statuses_per_turn: STATUSES_PER_TURN,
            stop_exchanges: 4,
            measurement_exchanges: 1,
            quantities: Quantity::ALL,
        }
    }

    /// The register that chooses the unit of this one, if one does.
    #[must_use]
    pub fn scaled_by(&self, address: u16) -> Option<&'static Row> {
        let scaled = self.scaled.iter().find(|scaled| scaled.registers.contains(&address))?;
        self.rows.iter().find(|row| row.place() == scaled.by.into())
    }

    /// A row with the unit that it has where the register that chooses it holds what `held` says; as it stands in the map
    /// where no other register chooses, or what that holds is not known.
    #[must_use]
    pub fn in_units(&self, row: &Row, held: impl Fn(u16) -> Option<u16>) -> Row {
        let scaled = self.scaled.iter().find(|scaled| scaled.registers.contains(&row.address));
        let unit = scaled.and_then(|scaled| {
            let word = held(scaled.by)?;
            scaled.units.iter().find(|(of, _)| *of == word & scaled.mask).map(|(_, unit)| *unit)
        });
        Row { unit: unit.unwrap_or(row.unit), ..*row }
    }

    /// How many words a read of `count` words from `first` on may take along at its end.
    #[must_use]
    pub fn spare_words(&self, first: u16, count: u16) -> u8 {
        let is_readable = |address: u16| {
            self.rows.iter().any(|row| row.place() == address.into() && row.access.is_readable())
        };
        let behind =
            (1..=self.read_words.saturating_sub(count)).take(usize::from(u8::MAX)).take_while(|more| {
                first.checked_add(count - 1).and_then(|last| last.checked_add(*more)).is_some_and(is_readable)
            });
        if count == 0 || !self.reads_across { 0 } else { behind.count() as u8 }
    }

    /// Checks that a drive of this family can have this address on a line with these settings.
    ///
    /// # Errors
    /// [`LineMismatch`] with what the family can have instead.
    pub fn check_line(&self, slave: SlaveAddress, settings: SerialSettings) -> Result<(), LineMismatch> {
        if slave.number() > self.highest_address {
            return Err(LineMismatch::Address { family: self.name, slave, highest: self.highest_address });
        }
        if !self.speeds.contains(&settings.baud()) {
            return Err(LineMismatch::Speed {
                family: self.name,
                baud: settings.baud(),
                speeds: self.speeds,
            });
        }
        if !self.formats.contains(&settings.format()) {
            return Err(LineMismatch::Format {
                family: self.name,
                format: settings.format(),
                formats: self.formats,
            });
        }
        Ok(())
    }
}

/// What a family's communication watchdog can be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct WatchdogCapability {
    /// The shortest time.
    pub min: Duration,
    /// The longest time.
    pub max: Duration,
    /// The step of the time.
    pub step: Duration,
    /// What the drive can do when it runs out.
    pub reactions: &'static [Reaction],
    /// Whether the bus can set it, or only read it.
    pub settable: bool,
    /// Whether each write of its setting goes to an EEPROM, which wears.
    pub wears: bool,
}

impl WatchdogCapability {
    /// The time of a watchdog that the bus cannot set: the drive has it whether anybody wants it or not, and has to be fed.
    #[must_use]
    pub const fn fixed(&self) -> Option<Duration> {
        if self.settable { None } else { Some(self.max) }
    }
}

/// What a drive does when its communication watchdog runs out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Reaction {
    /// Nothing: the watchdog is off.
    Ignore,
    /// It trips and the motor coasts.
    Freewheel,
    /// It trips and stops along the ramp.
    Ramp,
    /// It trips and stops along the short ramp.
    Fast,
    /// It trips and stops by DC injection.
    DcInjection,
    /// It trips. How the motor stops is not in its manual.
    Trip,
    /// A value that the manual does not explain.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Unknown(u16),
}

impl fmt::Display for Reaction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ignore => f.write_str("nothing"),
            Self::Freewheel => f.write_str("freewheel"),
            Self::Ramp => f.write_str("ramp stop"),
            Self::Fast => f.write_str("fast stop"),
            Self::DcInjection => f.write_str("DC injection"),
            Self::Trip => f.write_str("trip (how the motor stops is not in the manual)"),
            Self::Unknown(value) => write!(f, "unknown ({value})"),
        }
    }
}

/// A drive's communication watchdog as it is set now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Watchdog {
    /// The time without a message after which it acts; `None`: it is off.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "time_ms",
            default,
            skip_serializing_if = "Option::is_none",
            with = "crate::serialize::maybe_ms"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
    pub timeout: Option<Duration>,
    /// What it does then; `None` where the drive does not tell.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub reaction: Option<Reaction>,
}

/// A drive that cannot live on this line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LineMismatch {
    /// The address.
    #[error("address {slave}: {family} has addresses 1 to {highest}")]
    Address {
        /// The family's name.
        family: &'static str,
        /// The address that was asked for.
        slave: SlaveAddress,
        /// The highest it can have.
        highest: u8,
    },
    /// The speed.
    #[error("{baud} bit/s: {family} has {}", speeds.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))]
    Speed {
        /// The family's name.
        family: &'static str,
        /// The speed that was asked for.
        baud: u32,
        /// The speeds it can have.
        speeds: &'static [u32],
    },
    /// The character format.
    #[error("format {format}: {family} has {}", formats.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))]
    Format {
        /// The family's name.
        family: &'static str,
        /// The format that was asked for.
        format: CharacterFormat,
        /// The formats it can have.
        formats: &'static [CharacterFormat],
    },
}
