#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod command;
mod faults;
mod lists;
mod parameters;
pub mod registers;
mod status;
pub mod words;

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Capabilities, Class, Direction, Drive, ExceptionMeaning, Fault, Faults, Identity,
    Lifetimes, Measurements, Percent, Port, RawWord, Registers, Result, Row, SerialSettings, Setpoint,
    SlaveAddress, Speed, Status, StopMode, Stopped, Voltage, Written,
    drivecom::{self, Drivecom, StatusWords},
    registers::{Register, access::Readable},
    serial::CharacterFormat,
};

pub use crate::{faults::FAULTS, faults::WARNINGS, registers::ROWS};
use crate::{
    registers::{DP1, DP2, DP3, DP4, ETA, INV, IOLR, OPR, OTR, RFRD, RTH},
    status::{FIRST_BLOCK, FastWords, SECOND_BLOCK},
    words::{ControlWord, ExtendedStatus},
};

/// What an Altivar 28 can do.
pub const CAPABILITIES: Capabilities = Capabilities {
    key: "atv28",
    name: "Schneider Altivar 28",
    functions: &[0x03, 0x06, 0x10],
    read_words: 7,
    write_words: 7,
    highest_address: 31,
    speeds: &[9_600, 19_200],
    formats: &[CharacterFormat::F8N1],
    factory: match SerialSettings::new(19_200, CharacterFormat::F8N1) {
        Ok(settings) => settings,
        Err(_) => SerialSettings::MODBUS_DEFAULT,
    },
    stop_modes: &StopMode::ALL,
    speed_setpoint: true,
    frequency_step: "0.1 Hz",
    fault_reset: "CMD bit 7, rising edge",
    watchdog: None,
    identification: Some("nominal current INV (W555)"),
    release: false,
    persist: None,
    broadcast_stops: &[StopMode::Fast, StopMode::Freewheel],
    fault_history: 4,
    turnaround: Duration::ZERO,
    status_exchanges: 2,
    measurement_exchanges: 6,
};

/// An Altivar 28 behind a port. See [`Drive`] for what its methods promise.
#[derive(Debug)]
pub struct Atv28<P> {
    registers: Registers<P>,
    limits: parameters::Limits,
    /// The control word that the drive was last seen to hold; `None` when that is not known.
    command: Option<ControlWord>,
}

impl<P: Port> Atv28<P> {
    /// What the family can do.
    pub const CAPABILITIES: Capabilities = CAPABILITIES;
    /// Every register of the family.
    pub const ROWS: &[Row] = ROWS;

    /// The drive with this address. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress) -> Self {
        Self {
            registers: Registers::new(port, slave, &CAPABILITIES, meaning),
            limits: parameters::Limits::default(),
            command: None,
        }
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.registers.into_port()
    }

    /// Reads the fast set, in two exchanges: seven words are the most that one carries.
    async fn fast_words(&mut self, class: Class) -> Result<FastWords> {
        let mut calls = self.registers.at(class);
        let first = calls.read_array(FIRST_BLOCK.0).await?;
        let second = calls.read_array(SECOND_BLOCK.0).await?;
        Ok(FastWords::of(first, second))
    }
}

/// The exceptions of the manual's last section.
const fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    ExceptionMeaning::standard(code)
}

#[async_trait]
impl<P: Port> Drive for Atv28<P> {
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
        self.limits = parameters::Limits::default();
        self.command = None;
    }

    async fn status(&mut self) -> Result<Status> {
        self.read_status(Class::Status).await
    }

    /// Six exchanges: W450 to W456 in one, and the five others one by one, because what stands between them is not
    /// known.
    async fn measurements(&mut self) -> Result<Measurements> {
        let mut calls = self.registers.at(Class::Background);
        let block = calls.read_array(FIRST_BLOCK.0).await?;
        let [frh, _, _, _, uln, thr, thd] = block;
        let mut raw: Vec<_> = FastWords::first_block(&block);
        let iolr = keep(&mut raw, IOLR, calls.read(IOLR).await?);
        let otr = keep(&mut raw, OTR, calls.read(OTR).await?);
        let opr = keep(&mut raw, OPR, calls.read(OPR).await?);
        let rth = keep(&mut raw, RTH, calls.read(RTH).await?);
        let rfrd = keep(&mut raw, RFRD, calls.read(RFRD).await?);
        Ok(Measurements {
            reference: Some(drive_core::Frequency::from_decihertz(frh).into()),
            speed: Some(Speed::from_rpm(u32::from(rfrd.cast_signed().unsigned_abs()))),
            line_voltage: Some(Voltage::from_decivolts(u32::from(uln))),
            torque: Some(Percent::from_percent(otr.cast_signed())),
            power_share: Some(Percent::from_percent(opr.cast_signed())),
            drive_thermal: Some(percent(thd)),
            motor_thermal: Some(percent(thr)),
            running_time: Some(Duration::from_secs(u64::from(rth) * 3_600)),
            inputs: Some(iolr & words::LogicIo::INPUTS.bits()),
            outputs: Some(iolr & words::LogicIo::OUTPUTS.bits()),
            raw,
            ..Measurements::default()
        })
    }

    async fn faults(&mut self) -> Result<Faults> {
        let mut calls = self.registers.at(Class::Background);
        let [lft, eta, eti, _] = calls.read_array(SECOND_BLOCK.0).await?;
        let mut history = Vec::new();
        for register in [DP1, DP2, DP3, DP4] {
            let code = calls.read(register).await?;
            if code != 0 {
                history.push(Fault::lookup(FAULTS, code));
            }
        }
        let state = StatusWords::new(eta, eti);
        let tripped = state.is_tripped();
        let warnings = WARNINGS.iter().filter(|entry| eti >> entry.code & 1 == 1);
        Ok(Faults {
            present: tripped.then(|| Fault::lookup(FAULTS, lft)).into_iter().collect(),
            history,
            warnings: warnings.map(|entry| Fault { code: entry.code, entry: Some(entry) }).collect(),
            reset_allowed: tripped.then(|| state.eti.contains(ExtendedStatus::RESET_AUTHORISED)),
        })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.start_motor(direction).await
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await.map(|status| Stopped::by(mode, status))
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        drivecom::reset_fault(self).await
    }

    /// The drive does not say what it is; its nominal current tells one rating from another.
    async fn identify(&mut self) -> Result<Identity> {
        let value = self.registers.at(Class::Background).read(INV).await?;
        let codes = vec![RawWord { address: INV.address(), code: INV.row().code, value }];
        Ok(Identity { codes, ..Identity::default() })
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(ETA).await.map(drop)
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        command::broadcast(mode)
    }
}

fn percent(word: u16) -> Percent {
    Percent::from_hundredths(i32::from(word) * 100)
}

/// Keeps the raw word of a register and returns it.
fn keep(raw: &mut Vec<RawWord>, register: Register<impl Readable>, value: u16) -> u16 {
    raw.push(RawWord { address: register.address(), code: register.row().code, value });
    value
}
