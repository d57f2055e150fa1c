#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod blocks;
pub mod broadcast;
mod command;
mod drive;
mod eeprom;
mod faults;
mod frequency;
mod intent;
mod proof;
mod reading;
mod refusals;
pub mod registers;
mod reset;
mod restoring;
mod setpoint;
mod settings;
mod status;
pub mod words;

use std::time::Duration;

use drive_core::{
    Absent, AnswerDelay, BroadcastWrite, Capabilities, Control, Direction, ExceptionMeaning, Port, Quantity,
    Reaction, Registers, Row, SerialSettings, SlaveAddress, StopMode, Watch, WatchdogCapability,
    serial::CharacterFormat,
};

pub use crate::{
    eeprom::EEPROM_LIFE,
    faults::{FAULTS, WARNINGS},
    frequency::FrequencyUnit,
    registers::ROWS,
};
use crate::{eeprom::Eeprom, proof::Proof, registers::COMMAND, settings::Settings, words::Command};

/// The time without a message after which n40 = 0 trips (VS-606V7 manual p. 10, 38; the 3G3EV's own does not print it).
pub const TIME_OVER: Duration = Duration::from_secs(2);

/// What a 3G3EV can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    functions: &[0x03, 0x08, 0x10],
    read_words: 8,
    rows: ROWS,
    reads_across: true,
    restoring: restoring::RESTORING,
    write_words: 8,
    highest_address: 31,
    speeds: &[2_400, 4_800, 9_600, 19_200],
    formats: &[CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1],
    factory: match SerialSettings::new(9_600, CharacterFormat::F8E1) {
        Ok(settings) => settings,
        Err(_) => SerialSettings::MODBUS_DEFAULT,
    },
    fault_reset: "the input of n06 to n08 that is set to fault reset, where the number for it is given",
    watchdog: Some(WatchdogCapability {
        min: TIME_OVER,
        max: TIME_OVER,
        step: TIME_OVER,
        reactions: &[Reaction::Ignore, Reaction::Trip],
        settable: false,
        wears: false,
    }),
    // BUS, bit E of 0021h.
    communication_fault: Some(0xE),
    share_setpoint: true,
    persist: Some("ENTER, a write to 0900h"),
    broadcast_stops: &[StopMode::Ramp],
    turnaround: turnaround(2_400),
    answer_delay: Some(AnswerDelay {
        code: "n65",
        longest: Duration::from_millis(40),
        bits: 24,
        source: "§2.1, p. 6",
    }),
    status_exchanges: 2,
    status_words: 9,
    statuses_per_turn: proof::STATUSES_PER_TURN,
    // RUN may stand until the motor does: a second look, of three exchanges, shows that its output goes down.
    stop_exchanges: 7,
    measurement_exchanges: 2,
    quantities: &[
        Quantity::OutputFrequency,
        Quantity::Current,
        Quantity::OutputVoltage,
        Quantity::DcBusVoltage,
    ],
    ..Capabilities::least("3g3ev", "Omron 3G3EV")
};

/// The silence that the drive needs between its answer and the next request at a speed in bit/s: 24 bits and 10 ms
/// (VS-606V7 manual p. 92; the drawing of §3.3 is missing). [`CAPABILITIES`] holds the longest, that of 2400 bit/s; a
/// line whose speed is known may use this instead.
///
/// ```
/// use std::time::Duration;
///
/// assert_eq!(drive_3g3ev::turnaround(9_600), Duration::from_micros(12_500));
/// assert_eq!(drive_3g3ev::CAPABILITIES.turnaround, Duration::from_millis(20));
/// ```
#[must_use]
pub const fn turnaround(baud: u32) -> Duration {
    let baud = if baud == 0 { 1 } else { baud as u64 };
    Duration::from_nanos((24 * 1_000_000_000_u64).div_ceil(baud) + 10_000_000)
}

/// A 3G3EV behind a port. See [`Drive`](drive_core::Drive) for what its methods promise.
///
/// It runs over any [`Port`]:
///
/// ```no_run
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// use drive_3g3ev::Drive3g3ev;
/// use drive_core::{Direction, Drive, Frequency, StopMode};
/// # let port: drive_core::Reconnecting<fn() -> std::future::Ready<std::io::Result<drive_core::tokio_modbus::client::Context>>> = unimplemented!();
///
/// let mut drive = Drive3g3ev::new(port, 1.try_into()?);
/// drive.set_setpoint(Frequency::from_hertz(60).into()).await?;
/// drive.start(Direction::Forward).await?;
/// drive.stop(StopMode::Ramp).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Drive3g3ev<P> {
    registers: Registers<P>,
    watch: Watch,
    proof: Proof,
    settings: Settings,
    eeprom: Eeprom,
    /// The number of "fault reset" in n06 to n08, as its owner gave it.
    fault_reset: Option<u16>,
    /// The word in 0001h as this value last saw it there; `None` when that is not known.
    command: Option<Command>,
    /// Whether the drive ran, in which direction, and who commanded it, when 0001h was last read for a status.
    shown: Option<(bool, Option<Direction>, Option<Control>)>,
    /// What this drive does not have, reserved registers among them.
    absent: Absent,
}

impl<P: Port> Drive3g3ev<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every register of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, meaning),
            watch: Watch::every(proof::STATUSES_PER_TURN),
            proof: Proof::default(),
            settings: Settings::default(),
            eeprom: Eeprom::default(),
            fault_reset: None,
            command: None,
            shown: None,
            absent: Absent::default(),
        }
    }

    /// This drive with the number that stands for "fault reset" in its parameters n06 to n08, so that
    /// [`reset_faults`](drive_core::Drive::reset_faults) can find the input that carries it.
    ///
    /// There is no default: the communication manual does not list the functions of the inputs, and the wrong number
    /// would pulse another input, which may be one that moves the motor. Take the number from the drive's user manual.
    #[must_use]
    pub fn with_fault_reset_function(self, number: u16) -> Self {
        Self { fault_reset: Some(number), ..self }
    }

    /// This drive with the number of saves to its EEPROM that it has already had, so that
    /// [`persist`](drive_core::Drive::persist) counts on from there to the [`EEPROM_LIFE`].
    #[must_use]
    pub fn with_saves(self, saves: u32) -> Self {
        Self { eeprom: Eeprom::after(saves), ..self }
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }
}

/// The errors of §4.4. 21h is a value outside its range; 22h a constant written while the motor runs or in undervoltage,
/// or one that can only be read.
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    match code {
        0x01 => ExceptionMeaning::NoSuchFunction,
        0x02 => ExceptionMeaning::NoSuchRegister,
        0x03 | 0x21 => ExceptionMeaning::ValueRefused,
        0x22 => ExceptionMeaning::NotNow,
        _ => ExceptionMeaning::Unknown,
    }
}

/// The write to 0001h that every drive of a line takes.
const fn broadcast_command(value: u16) -> BroadcastWrite {
    BroadcastWrite { function: 0x10, register: COMMAND.address(), value }
}
