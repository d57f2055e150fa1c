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
mod control;
mod drive;
mod faults;
mod in_effect;
mod intent;
mod model;
mod proof;
mod reading;
mod refusals;
pub mod registers;
mod release;
mod restoring;
mod setpoint;
mod settings;
mod status;
mod trip;
mod words;

use std::time::Duration;

use drive_core::{
    Absent, Capabilities, Command, Error, ExceptionMeaning, Frequency, Identity, Port, Quantity, Reaction,
    Recognised, Refusal, Registers, Result, SlaveAddress, Status, StopMode, Watch, WatchdogCapability,
    serial::CharacterFormat,
};

use crate::{blocks::WriteSlot, in_effect::ReadBlock, proof::Proof};
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
    rows: ROWS,
    restoring: restoring::RESTORING,
    functions: &[0x03, 0x06, 0x10, 0x2B],
    read_words: 5,
    write_words: 2,
    // The manual names the parity and no number of stop bits; without parity Modbus has two and many masters send one.
    formats: &[CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1, CharacterFormat::F8N2],
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
        wears: true,
    }),
    // Err5.
    communication_fault: Some(24),
    identification: Some("function 43/14; FB05, FB72"),
    release: true,
    broadcast_stops: &[StopMode::Ramp, StopMode::Freewheel, StopMode::DcInjection],
    fault_history: 4,
    // Two where the read block is used; it never is from the first status on.
    status_exchanges: 4,
    status_words: 4,
    statuses_per_turn: proof::STATUSES_PER_TURN,
    stop_exchanges: 7,
    measurement_exchanges: reading::SLOW_SET.len() as u8 + 1,
    quantities: &[
        Quantity::OutputFrequency,
        Quantity::CurrentShare,
        Quantity::Speed,
        Quantity::Torque,
        Quantity::InputPower,
        Quantity::OutputPower,
        Quantity::RunningTime,
        Quantity::PoweredTime,
    ],
    ..Capabilities::least("atv21", "Schneider Altivar 21")
};

const WATCHDOG_LONGEST: Duration = Duration::from_secs(100);

/// By what right the bus commands the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Authority {
    /// By the priority bits 14 and 15 of FA00: commands and reference of the bus count whatever CMOD and FMOD say,
    /// until [`release`](drive_core::Drive::release), a fault reset or a power cycle.
    #[default]
    Priority,
    /// By the settings CMOD = 2 and FMOD = 4 alone. No priority bit is set, but by a stop: of a drive that was never read,
    /// or whose motor somebody else runs. One that is set stays.
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
/// `start` and `stop` take the command over by the priority bits, and [`release`](drive_core::Drive::release) gives it
/// back. `start` refuses while the keypad holds the drive (LOC/REM) and while somebody else runs the motor, and sees in FE45
/// and FE46 that the bus decides before it writes a run command. `stop` takes the command from whoever runs the motor.
///
/// # Stop modes
/// `Ramp`, `Freewheel` and `DcInjection`. Freewheel and DC injection are levels: they stay in force until the next
/// command, so end an injection by a ramp stop, or the motor is heated at rest. The drive's emergency stop is not a
/// stop mode, because it trips the drive: [`emergency_stop`](Self::emergency_stop). A fast stop is one by ramp.
#[derive(Debug)]
pub struct Atv21<P> {
    registers: Registers<P>,
    watch: Watch,
    proof: Proof,
    absent: Absent,
    /// CMOD and FMOD, where the drive has them; `None`: not read.
    modes: Option<[Option<u16>; 2]>,
    /// Whether it has said that it is an Altivar 21; `None`: it was not asked.
    kind: Option<Recognised>,
    /// What it has said of itself by 43/14.
    named: Option<Identity>,
    authority: Authority,
    /// What its owner has chosen; `None`: what the drive holds is kept.
    selections: Option<CommandWord>,
    /// FA00 as it was last read or written: what the next stop keeps of it. `None`: not known.
    held: Option<CommandWord>,
    /// What FD01 and FE45 showed when FA00 was last read for a status.
    shown: Option<(StatusWord, CommandSource)>,
    /// FA01 and FA13 before the first setpoint of this value.
    references: Option<[u16; 2]>,
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
            watch: Watch::every(proof::STATUSES_PER_TURN),
            proof: Proof::default(),
            absent: Absent::default(),
            modes: None,
            kind: None,
            named: None,
            authority: Authority::default(),
            selections: None,
            held: None,
            shown: None,
            references: None,
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
    /// Without a choice a start keeps motor, PID control and ramp as the drive holds them; a stop always does.
    pub fn select(&mut self, selections: CommandWord) {
        self.selections = Some(selections.intersection(CommandWord::SELECTIONS));
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

    /// Refuses to write to a drive that says that it is another one, which it is asked once.
    async fn check_own(&mut self, command: Command) -> Result<()> {
        if self.kind.is_none() {
            self.recognise_itself().await?;
        }
        match self.kind {
            Some(Recognised::NotMine { it_is }) => Err(self.refused(command, Refusal::AnotherDrive(it_is))),
            _ => Ok(()),
        }
    }

    /// Refuses a start of a drive that says that it is another one, or another than before: it is asked before each.
    async fn check_itself(&mut self, command: Command) -> Result<()> {
        let was_asked = self.named.is_some();
        self.check_own(command).await?;
        if was_asked && let Some(reason) = self.ask_name().await?.refuses_start(&mut self.named) {
            return Err(self.refused(command, reason));
        }
        Ok(())
    }

    const fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    fn not_confirmed(&self, command: Command, status: Status, because: Option<Refusal>) -> Error {
        Error::NotConfirmed { slave: self.registers.slave(), command, status: Box::new(status), because }
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
