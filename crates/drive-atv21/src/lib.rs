//! Schneider Altivar 21 over Modbus RTU.
//!
//! Written from "Altivar 21 Modbus, guide d'exploitation", 10/2009; what is not from there says so. The drive has no
//! DRIVECOM state chart: one command word (FA00) orders, one status word (FD01) tells. It reads exactly one word per
//! request, but for one configurable block of five ([`blocks`]).
//!
//! ```no_run
//! use drive_atv21::Atv21;
//! use drive_core::{Direction, Drive, Frequency, Port, SlaveAddress};
//!
//! # async fn example(port: impl Port) -> Result<(), Box<dyn std::error::Error>> {
//! let mut fan = Atv21::new(port, SlaveAddress::try_from(1)?);
//! fan.set_setpoint(Frequency::from_hertz(35).into()).await?;
//! println!("{}", fan.start(Direction::Forward).await?);
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

pub mod blocks;
mod command;
mod faults;
mod in_effect;
mod model;
mod reading;
pub mod registers;
mod setpoint;
mod settings;
mod status;
mod words;

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Class, Command, Direction, Drive, Error, ExceptionMeaning, Faults,
    Frequency, Identity, Lifetimes, Measurements, Port, Reaction, Refusal, Registers, Result, Row,
    SerialSettings, Setpoint, SlaveAddress, Status, StopMode, Stopped, Watchdog, WatchdogCapability, Written,
    registers::refuse_commands, serial::CharacterFormat,
};

use crate::{blocks::WriteSlot, in_effect::ReadBlock};
pub use crate::{
    faults::{ALARMS, FAULTS},
    model::{Enclosure, MODELS, ModelEntry, VoltageClass},
    reading::LastTrip,
    registers::ROWS,
    settings::StallLevel,
    words::{
        Alarms, CommandSource, CommandWord, CommandWord2, LogicInputs, LogicOutputs, MaintenanceAlarms,
        ReferenceSource, StatusWord, StatusWord2, StatusWord3,
    },
};

/// What an Altivar 21 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    key: "atv21",
    name: "Schneider Altivar 21",
    functions: &[0x03, 0x06, 0x10, 0x2B],
    read_words: 5,
    blocks: &[],
    write_words: 2,
    highest_address: 247,
    stations: 31,
    speeds: &[9_600, 19_200],
    // The manual names the parity and no number of stop bits; without parity Modbus has two and many masters send one.
    formats: &[CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1, CharacterFormat::F8N2],
    factory: SerialSettings::MODBUS_DEFAULT,
    stop_modes: &[StopMode::Ramp, StopMode::Freewheel, StopMode::DcInjection],
    speed_setpoint: true,
    frequency_step: "0.01 Hz",
    fault_reset: "FA00 bit 13",
    watchdog: Some(WatchdogCapability {
        min: Duration::from_secs(1),
        max: WATCHDOG_LONGEST,
        step: Duration::from_secs(1),
        reactions: &[Reaction::Ignore, Reaction::Freewheel, Reaction::Ramp, Reaction::DcInjection],
        settable: true,
    }),
    identification: Some("function 43/14; FB05, FB72"),
    release: true,
    persist: None,
    broadcast_stops: &[StopMode::Ramp, StopMode::Freewheel, StopMode::DcInjection],
    fault_history: 4,
    turnaround: Duration::ZERO,
    // One where the read block is used; it never is from the first status on.
    status_exchanges: 4,
    measurement_exchanges: reading::SLOW_SET.len() as u8,
};

const WATCHDOG_LONGEST: Duration = Duration::from_secs(100);

/// By what right the bus commands the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Authority {
    /// By the priority bits 14 and 15 of FA00: commands and reference of the bus count whatever CMOD and FMOD say,
    /// until [`release`](Drive::release), a fault reset or a power cycle.
    #[default]
    Priority,
    /// By the settings CMOD = 2 and FMOD = 4 alone; the priority bits stay 0, and a command to a drive that is set
    /// otherwise does nothing.
    Settings,
}

/// What is known of the write block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WriteBlock {
    /// Nobody says that what is configured is in effect.
    Unused,
    /// Its owner says so; what is configured was not read yet.
    Promised,
    /// Its owner says so, and this is configured.
    Read([WriteSlot; 2]),
}

/// An Altivar 21.
///
/// # Who commands
/// A drive in its factory setting listens to its terminals (CMOD = 0, FMOD = 1). By default ([`Authority::Priority`])
/// `start` and `stop` take the command over by the priority bits, and [`release`](Drive::release) gives it back.
/// `start` refuses while the keypad holds the drive (LOC/REM) and while somebody else runs the motor.
///
/// # Stop modes
/// `Ramp`, `Freewheel` and `DcInjection`. Freewheel and DC injection are levels: they stay in force until the next
/// command, so end an injection by a ramp stop, or the motor is heated at rest. The drive's emergency stop is not a
/// stop mode, because it trips the drive: [`emergency_stop`](Self::emergency_stop).
#[derive(Debug)]
pub struct Atv21<P> {
    registers: Registers<P>,
    authority: Authority,
    selections: CommandWord,
    read_block: ReadBlock,
    write_block: WriteBlock,
    upper_limit: Option<Frequency>,
    eeprom_writes: u32,
}

impl<P: Port> Atv21<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;

    /// The drive with this address behind this port. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, meaning),
            authority: Authority::default(),
            selections: CommandWord::empty(),
            read_block: ReadBlock::default(),
            write_block: WriteBlock::Unused,
            upper_limit: None,
            eeprom_writes: 0,
        }
    }

    /// The same drive, commanded by another right.
    #[must_use]
    pub fn with_authority(mut self, authority: Authority) -> Self {
        self.authority = authority;
        self
    }

    /// The same drive, whose [`start_at`](Self::start_at) may write command and reference in one exchange, where F870 and
    /// F871 hold them.
    ///
    /// It is a promise that the drive was reset or switched off since F870 and F871 were last changed. Nobody but its
    /// owner can know: the drive tells what is configured, not what is in effect, and a trial would write a reference
    /// into a command word. A change of these parameters through this value ends the promise.
    #[must_use]
    pub fn with_write_block(mut self) -> Self {
        self.write_block = WriteBlock::Promised;
        self
    }

    /// Chooses preset speed, motor, PID control and ramp for the commands that follow: the bits of
    /// [`CommandWord::SELECTIONS`], others are left out. Nothing is sent. A chosen preset speed overrides the setpoint.
    pub fn select(&mut self, selections: CommandWord) {
        self.selections = selections.intersection(CommandWord::SELECTIONS);
    }

    /// How many parameters this value has written to EEPROM.
    #[must_use]
    pub const fn eeprom_writes(&self) -> u32 {
        self.eeprom_writes
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }

    const fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    fn not_confirmed(&self, command: Command, status: Status) -> Error {
        Error::NotConfirmed {
            slave: self.registers.slave(),
            command,
            status: Box::new(status),
            because: None,
        }
    }
}

/// What an exception means (Altivar 21 Modbus §7.10, p. 26).
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    match code {
        1 => ExceptionMeaning::NoSuchFunction,
        2 => ExceptionMeaning::NoSuchRegister,
        3 => ExceptionMeaning::ValueRefused,
        4 => ExceptionMeaning::NotNow,
        _ => ExceptionMeaning::Unknown,
    }
}

#[async_trait]
impl<P: Port> Drive for Atv21<P> {
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
        self.forget_blocks();
        self.upper_limit = None;
    }

    /// Reads the fast set: from the block of the drive, in one exchange, where it is known to hold FD01, FD00 and FE03;
    /// else the words one by one, with FE45 for who commands.
    ///
    /// What is configured for the block is in effect only if the drive was reset since, and no register tells that. So
    /// the first status with a turning motor also reads the block and every register that it could hold: the block is
    /// used from then on when nothing but what is configured explains its words. A trip ends that.
    ///
    /// [`Status::control`] is `None` when a block is read and the drive is not local: the block cannot tell.
    /// [`Status::at_reference`] and [`Status::fault_code`] are always `None`: no word of the fast set tells them.
    async fn status(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Status).await?;
        self.look_at_block(&status).await;
        Ok(status)
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    /// Reads FC90, FE10 to FE13 (the newest first) and FC91, one by one.
    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.start_motor(direction, None).await
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await.map(|status| Stopped::by(mode, status))
    }

    /// Writes FA01 in steps of 0.01 Hz, up to the drive's UL, or FA13 in rpm, up to 24000: how F856 counts the
    /// motor's poles is not in the manual, so a speed is not compared with UL, and the drive limits it.
    ///
    /// A setpoint that cannot have an effect because a preset speed overrides every reference (FE46 = 255) is refused.
    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.write_setpoint(setpoint).await
    }

    /// Sends FA00 bit 13 once, then a word without it, and reads until the drive shows no fault.
    ///
    /// A drive that was reset starts up again and does not answer for about 2 s. When it answers nothing at all after
    /// the reset, the error is of the kind [`OutcomeUnknown`](drive_core::ErrorKind::OutcomeUnknown): read the status
    /// 2 s later. The reset also clears FA00 and with it the priorities: terminals that command by CMOD do so again.
    async fn reset_faults(&mut self) -> Result<Status> {
        self.reset_trip().await
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.read_identity().await
    }

    /// Clears FA00 and with it the priorities: CMOD and FMOD decide again. **A run command that waits at the terminals
    /// then starts the motor.** Refused when CMOD = 2, because the command stays with the bus then.
    async fn release(&mut self) -> Result<Status> {
        self.give_control_back().await
    }

    /// Reads FD01: the family has no shorter exchange.
    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(registers::STATUS_WORD).await.map(drop)
    }

    /// Reads F803 and F603.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// Writes F603, then F803, each to EEPROM and only where it differs. For [`Reaction::Ignore`] F803 is set to 0,
    /// and the time does not matter.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.write_watchdog(timeout, reaction).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) for FA00, FA20, FA01 and FA13, which have methods of their
    /// own.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &settings::COMMANDS)?;
        self.change_parameter(row, word, Command::WriteParameter(row.address)).await
    }

    async fn persist(&mut self) -> Result<u32> {
        Err(Error::Unsupported {
            what: "saving parameters",
            reason: "the drive stores each parameter in EEPROM when it is written",
        })
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let value = self.stop_word(mode).ok()?.bits();
        Some(BroadcastWrite { function: 0x06, register: registers::COMMAND_WORD.address(), value })
    }
}
