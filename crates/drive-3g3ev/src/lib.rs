#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod blocks;
pub mod broadcast;
mod command;
mod eeprom;
mod faults;
mod frequency;
mod reading;
pub mod registers;
mod reset;
mod setpoint;
mod settings;
mod status;
pub mod words;

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Class, Direction, Drive, ExceptionMeaning, Faults, Lifetimes, Measurements,
    Port, Reaction, Registers, Result, Row, SerialSettings, Setpoint, SlaveAddress, Status, StopMode,
    Stopped, Watchdog, WatchdogCapability, Written, serial::CharacterFormat,
};

pub use crate::{
    eeprom::EEPROM_LIFE,
    faults::{FAULTS, WARNINGS},
    frequency::FrequencyUnit,
    registers::ROWS,
};
use crate::{eeprom::Eeprom, registers::COMMAND, settings::Settings, words::Command};

/// The time without a message after which n40 = 0 trips (VS-606V7 manual p. 10, 38; the 3G3EV's own does not print it).
pub const TIME_OVER: Duration = Duration::from_secs(2);

/// What loop-backs carry: the data of the manual's sample (§4.1.2).
const LOOP_BACK: u16 = 0xA537;

/// What a 3G3EV can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    key: "3g3ev",
    name: "Omron 3G3EV",
    functions: &[0x03, 0x08, 0x10],
    read_words: 8,
    blocks: ROWS,
    write_words: 8,
    highest_address: 31,
    stations: 31,
    speeds: &[2_400, 4_800, 9_600, 19_200],
    formats: &[CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1],
    factory: match SerialSettings::new(9_600, CharacterFormat::F8E1) {
        Ok(settings) => settings,
        Err(_) => SerialSettings::MODBUS_DEFAULT,
    },
    stop_modes: &[StopMode::Ramp],
    speed_setpoint: false,
    frequency_step: "0.1 Hz",
    fault_reset: "the input of n06 to n08 that is set to fault reset, where the number for it is given",
    watchdog: Some(WatchdogCapability {
        min: TIME_OVER,
        max: TIME_OVER,
        step: TIME_OVER,
        reactions: &[Reaction::Ignore, Reaction::Trip],
        settable: false,
    }),
    identification: None,
    release: false,
    persist: Some("ENTER, a write to 0900h"),
    broadcast_stops: &[StopMode::Ramp],
    fault_history: 0,
    turnaround: turnaround(2_400),
    status_exchanges: 2,
    measurement_exchanges: 2,
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

/// A 3G3EV behind a port. See [`Drive`] for what its methods promise.
///
/// It runs over any [`Port`]:
///
/// ```no_run
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// use drive_3g3ev::Drive3g3ev;
/// use drive_core::{Direction, Drive, Frequency, StopMode};
/// # let context: tokio_modbus::client::Context = unimplemented!();
///
/// let mut drive = Drive3g3ev::new(context, 1.try_into()?);
/// drive.set_setpoint(Frequency::from_hertz(60).into()).await?;
/// drive.start(Direction::Forward).await?;
/// drive.stop(StopMode::Ramp).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Drive3g3ev<P> {
    registers: Registers<P>,
    settings: Settings,
    eeprom: Eeprom,
    /// The number of "fault reset" in n06 to n08, as its owner gave it.
    fault_reset: Option<u16>,
    /// The word in 0001h as this value last saw it there; `None` when that is not known.
    command: Option<Command>,
    /// Whether the drive has refused to read its reserved registers along.
    skips_reserved: bool,
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
            settings: Settings::default(),
            eeprom: Eeprom::default(),
            fault_reset: None,
            command: None,
            skips_reserved: false,
        }
    }

    /// This drive with the number that stands for "fault reset" in its parameters n06 to n08, so that
    /// [`reset_faults`](Drive::reset_faults) can find the input that carries it.
    ///
    /// There is no default: the communication manual does not list the functions of the inputs, and the wrong number
    /// would pulse another input, which may be one that moves the motor. Take the number from the drive's user manual.
    #[must_use]
    pub fn with_fault_reset_function(self, number: u16) -> Self {
        Self { fault_reset: Some(number), ..self }
    }

    /// This drive with the number of saves to its EEPROM that it has already had, so that
    /// [`persist`](Drive::persist) counts on from there to the [`EEPROM_LIFE`].
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

#[async_trait]
impl<P: Port> Drive for Drive3g3ev<P> {
    fn slave(&self) -> SlaveAddress {
        self.registers.slave()
    }

    fn capabilities(&self) -> &'static Capabilities {
        &CAPABILITIES
    }

    fn rows(&self) -> &'static [Row] {
        ROWS
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        &mut self.registers.lifetimes
    }

    fn forget(&mut self) {
        self.settings = Settings::default();
        self.command = None;
        self.skips_reserved = false;
    }

    /// Two exchanges, and one more for n39 the first time, or for 0001h while RUN stands after a stop.
    /// `output_frequency` is `None` when n39 counts it in percent.
    async fn status(&mut self) -> Result<Status> {
        self.read_status(Class::Status).await
    }

    /// Two exchanges, and one more for n39 the first time. The reference is `None` when n39 counts it in percent.
    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    /// Three exchanges. The alarms are the bits of 0020h, 0022h, 002Ch and 003Dh that tell one.
    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.start_motor(direction).await
    }

    /// Stops by a run command of 0, the only stop that the manual has: the motor stops in the way that the drive is
    /// set to. It is confirmed by what 0001h holds, and written again where a run command has come after it.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await.map(|status| Stopped::by(mode, status))
    }

    /// Two exchanges: the confirmation of function 10h does not say the value, so it is read back. The first one also
    /// reads n02 and n39.
    ///
    /// # Errors
    /// Also [`Refused`](drive_core::Error::Refused) when n02 takes the reference elsewhere or n39 was changed and the
    /// drive not switched off since, and [`Unsupported`](drive_core::Error::Unsupported) when n39 counts in percent: of
    /// a frequency for which the manual names no register. [`set_reference_share`](Self::set_reference_share) takes
    /// percents then.
    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    /// Pulses the input that carries "fault reset"; the run command is 0 in the same word, so that the motor does not
    /// start. Nothing is written to a drive that shows no fault.
    ///
    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) when the number for "fault reset" is not given, see
    /// [`with_fault_reset_function`](Self::with_fault_reset_function), or none of n06 to n08 holds it. The manual's
    /// only reset that needs no input goes to all drives of the line: [`broadcast::fault_reset`].
    async fn reset_faults(&mut self) -> Result<Status> {
        self.pulse_fault_reset().await
    }

    /// A loop-back by function 08; any frame feeds the time-over detection.
    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).echo(LOOP_BACK).await
    }

    /// n40. The reaction of a detection is [`Reaction::Trip`].
    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// Checks that n40 already is as asked: 2 s with [`Reaction::Trip`], or any time with [`Reaction::Ignore`] for off.
    /// It writes nothing, because a changed n40 acts after the next power-up only (§2.1, note 3).
    ///
    /// # Errors
    /// Also [`Refused`](drive_core::Error::Refused) when n40 is set otherwise, with the way to change it.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.check_watchdog(timeout, reaction).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) for 0001h, 0002h and 0900h, which have methods of their
    /// own, and exception 22h ([`ExceptionMeaning::NotNow`]) for a constant while the motor runs.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    /// ENTER. The EEPROM takes 100 000 of them ([`EEPROM_LIFE`]); what this value has sent counts, also when its
    /// outcome is unknown, and [`with_saves`](Self::with_saves) adds what came before.
    ///
    /// # Errors
    /// [`Refusal::NothingToSave`](drive_core::Refusal::NothingToSave) when this value has changed no parameter since
    /// its last save, [`Refusal::EepromLife`](drive_core::Refusal::EepromLife) when the count has reached the limit.
    async fn persist(&mut self) -> Result<u32> {
        self.enter().await
    }

    fn assume_changed(&mut self) {
        self.assume_unsaved();
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        CAPABILITIES.broadcast_stops.contains(&mode).then(broadcast::stop)
    }
}

/// The write to 0001h that every drive of a line takes.
const fn broadcast_command(value: u16) -> BroadcastWrite {
    BroadcastWrite { function: 0x10, register: COMMAND.address(), value }
}
