#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod channels;
mod command;
mod diagnosis;
mod faults;
mod parameters;
pub mod registers;
mod setpoint;
mod settings;
mod status;
pub mod words;

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Class, Direction, Drive, ExceptionMeaning, Faults, Identity, Lifetimes,
    Measurements, Port, Reaction, Registers, Result, Row, SerialSettings, Setpoint, SlaveAddress, Status,
    StopMode, Stopped, Watchdog, Written, drivecom, serial::CharacterFormat,
};

pub use crate::{
    faults::{FAULTS, PastFault, WARNINGS},
    registers::ROWS,
};
use crate::{registers::ETA, settings::Known, words::ControlWord};

/// What an Altivar 312 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    key: "atv312",
    name: "Schneider Altivar 312",
    functions: &[0x03, 0x06, 0x10, 0x2B],
    read_words: 29,
    write_words: 27,
    highest_address: 247,
    speeds: &[4_800, 9_600, 19_200],
    formats: &[CharacterFormat::F8O1, CharacterFormat::F8E1, CharacterFormat::F8N1, CharacterFormat::F8N2],
    factory: SerialSettings::MODBUS_DEFAULT,
    stop_modes: &StopMode::ALL,
    speed_setpoint: true,
    frequency_step: "0.1 Hz (with CMI bit 9: 600/32767 Hz)",
    fault_reset: "CMD bit 7, rising edge",
    watchdog: Some(parameters::WATCHDOG),
    identification: Some("function 43/14, and NCV, VCAL, INV, UdP, TSP"),
    release: true,
    persist: Some("CMI bit 1"),
    broadcast_stops: &[StopMode::Fast, StopMode::Freewheel],
    fault_history: 4,
    turnaround: Duration::ZERO,
    status_exchanges: 1,
    measurement_exchanges: 6,
};

/// An Altivar 312 behind a port. See [`Drive`] for what its methods promise, and the crate's page for what is special
/// about this family.
#[derive(Debug)]
pub struct Atv312<P> {
    registers: Registers<P>,
    known: Known,
    /// The control word that the drive was last seen to hold; `None` when that is not known.
    command: Option<ControlWord>,
    /// Whether a parameter was changed since the last save.
    unsaved: bool,
    saves: u32,
}

impl<P: Port> Atv312<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every register of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, exception_meaning),
            known: Known::default(),
            command: None,
            unsaved: false,
            saves: 0,
        }
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }
}

#[async_trait]
impl<P: Port> Drive for Atv312<P> {
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
        self.known = Known::default();
        self.command = None;
    }

    /// W3201 to W3207 in one exchange. The first after [`forget`](Self::forget) reads `CMI` before, whose bit 9 tells
    /// what a count of the output frequency is, and afterwards the settings on which a stop along the ramp depends, so
    /// that a later [`stop`](Self::stop) is one write and waits for no reading: 2 exchanges, 11 at access level L3.
    async fn status(&mut self) -> Result<Status> {
        let status = self.fast_status(Class::Status).await?;
        // The status is good without them; a stop reads what is still missing.
        let _ = self.control_settings(Class::Status).await;
        Ok(status)
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        drivecom::start(self, direction, ControlWord::run(direction).bits()).await
    }

    /// [`StopMode::Ramp`] is 100Fh where `Stt` makes that a ramp. [`StopMode::Fast`] is 400Fh where it is known to act
    /// and the quick stop 0002h otherwise. [`StopMode::Freewheel`] is 0000h. [`StopMode::DcInjection`] is 200Fh where
    /// `LAC` or `dCI` allow it. Where these settings cannot be read, ramp and DC injection are the quick stop too.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await.map(|status| Stopped::by(mode, status))
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        drivecom::reset_fault(self).await
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.read_identity().await
    }

    /// Gives the command channel to the terminals, at access level L3. **An input of the terminals that asks for a run
    /// then starts the motor**, unless `tCt` waits for a transition.
    async fn release(&mut self) -> Result<Status> {
        self.give_control_back().await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(ETA).await.map(|_| ())
    }

    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// Sets `ttO` and `SLL`, with the motor stopped, and clears the NTO bit. The drive is left in "switch on disabled"
    /// when one of the two was changed.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.set_watchdog(timeout, reaction).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// Writing a register that is written only with the motor stopped returns the drive to "switch on disabled"
    /// (p. 11); it is refused while the motor runs.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    async fn persist(&mut self) -> Result<u32> {
        self.save_parameters().await
    }

    fn assume_changed(&mut self) {
        self.unsaved = true;
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let (register, value) = command::broadcast_word(mode)?;
        Some(BroadcastWrite { function: 0x06, register: register.address(), value })
    }
}

/// What an exception means (BBV52816 p. 15; for function 43, p. 14). Which code answers a parameter that is refused while
/// the motor runs is not printed.
#[must_use]
pub const fn exception_meaning(function: u8, code: u8) -> ExceptionMeaning {
    match (function, code) {
        // Only 1 and 2 are printed for it.
        (0x2B, 3..) => ExceptionMeaning::Unknown,
        _ => ExceptionMeaning::standard(code),
    }
}
