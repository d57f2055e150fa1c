//! The simulated Altivar 21, from the drive's side ("Altivar 21 Modbus, guide d'exploitation", 10/2009).
//!
//! What the manual leaves open and a driver could trip over is a switch ([`Surroundings::switches`]). The rest is decided
//! here, and only here: a lone word of a block does not exist (exception 02), an empty place of the read block reads 0 and
//! one of the write block takes anything, a broadcast does not feed the time-out, an emergency stop coasts, preset speed n
//! is n times 5 Hz, one count of energy is 0.01 kWh at rated power, 100 % is what is on the plate, inputs F, R and RES run
//! forward, in reverse and reset, the answer to a new address still comes from the old one.

mod control;
mod inputs;
mod model;
mod monitor;
mod switches;
#[cfg(test)]
mod tests;
mod trips;

use std::{collections::BTreeMap, time::Duration};

use drive_atv21::{FAULTS, ROWS, blocks, registers::address as at};
use drive_core::Frequency;

use self::{
    inputs::{ANALOG_INPUTS, TERMINALS, function},
    switches::{Readings, SWITCHES},
};
use crate::{Bank, Exception, Motor, Nameplate, Rules, Surroundings, Watchdog};

/// What is around it.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "atv21",
    terminals: TERMINALS,
    analog_inputs: ANALOG_INPUTS,
    switches: SWITCHES,
    trips: FAULTS,
    rows: ROWS,
};

const RULES: Rules = Rules {
    read_holding: 5,
    read_input: 0,
    write_single: true,
    write_multiple: 2,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::from_millis(5),
};

/// The drive does not communicate while it starts up (VF-S15 manual E6581913 p. 7).
const POWER_UP: Duration = Duration::from_secs(1);
/// A reset of a trip takes longer (LinuxCNC vfs11_vfd).
const RESTART: Duration = Duration::from_secs(2);
/// FH, to which a reference may go and the ramps count, in hundredths of a hertz; its address is not published.
const MAXIMUM_FREQUENCY: u16 = 8_000;
/// Fault E.
const EMERGENCY: u16 = 17;
/// Fault Err5.
const TIME_OUT: u16 = 24;
/// Fault UP1.
const UNDERVOLTAGE: u16 = 30;
/// The rated current of the motor in tenths of an ampere, for 0.75 kW at 200 V.
const RATED_CURRENT: u32 = 40;
/// The rated power in 0.01 kW.
const RATED_POWER: u32 = 75;
/// An ATV21H075M3X, with a motor of its size.
#[derive(Debug, Clone)]
pub struct Atv21 {
    bank: Bank,
    /// What function 43/14 says it is.
    reference: &'static str,
    /// LL, in hundredths of a hertz, and whether its PI regulator decides: no manual of this drive gives their addresses.
    lower_limit: u16,
    regulated: bool,
    readings: Readings,
    /// The slots that were configured at the last reset.
    read_slots: [u16; 5],
    write_slots: [u16; 2],
    motor: Motor,
    watchdog: Watchdog,
    trip: Option<u16>,
    /// Until a drive that tries again by itself does so.
    retry: Option<Duration>,
    /// What FD01 and the other words were when it tripped.
    frozen: BTreeMap<u16, u16>,
    /// Monitored words that a test has set: they show that instead of what the drive would compute.
    pinned: BTreeMap<u16, u16>,
    /// LOC/REM: the keypad has control.
    local: bool,
    keypad_runs: bool,
    keypad_reverse: bool,
    keypad_reference: u16,
    /// Whether the order in FA00 is in force: not after somebody at the keypad interfered, until it is written anew.
    heeds: bool,
    /// ST = ON.
    released: bool,
    /// Functions 52 or 53 run the motor by themselves.
    forced_run: bool,
    /// Inputs that were closed at the start and may not run the motor before they were open.
    stale: u16,
    /// FA13 was written after FA01.
    speed_is_newest: bool,
    /// The control has a supply, and the power circuit has one.
    powered: bool,
    supplied: bool,
    starting: Duration,
    restart: Duration,
    powered_for: Duration,
    /// The running time at the last energy reset.
    energy_base: Duration,
}

impl Default for Atv21 {
    fn default() -> Self {
        Self::new()
    }
}

impl Atv21 {
    /// A drive in its factory setting, started up.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for (register, value) in [
            (at::DECELERATION, 100),
            (at::ACCELERATION_2, 100),
            (at::DECELERATION_2, 100),
            (at::UPPER_LIMIT, 5_000),
            (at::MOTOR_POLES, 4),
            (at::SECOND_REFERENCE, 2),
            (at::INPUT_F_FUNCTION, function::FORWARD),
            (at::INPUT_R_FUNCTION, function::REVERSE),
            (at::INPUT_RES_FUNCTION, function::RESET),
            (at::MODEL_CODE, 4),
            (at::RATED_CURRENT, 40),
            (at::RATED_VOLTAGE, 2_000),
        ] {
            bank.set_factory(register, value);
        }
        let mut drive = Self {
            bank,
            reference: "ATV21H075M3X",
            lower_limit: 0,
            regulated: false,
            readings: Readings::default(),
            read_slots: [0; 5],
            write_slots: [0; 2],
            motor: Motor::new(Nameplate::light(RATED_CURRENT)),
            watchdog: Watchdog::default(),
            trip: None,
            retry: None,
            frozen: BTreeMap::new(),
            pinned: BTreeMap::new(),
            local: false,
            keypad_runs: false,
            keypad_reverse: false,
            keypad_reference: 0,
            heeds: true,
            released: true,
            forced_run: false,
            stale: 0,
            speed_is_newest: false,
            powered: true,
            supplied: true,
            starting: Duration::ZERO,
            restart: RESTART,
            powered_for: Duration::ZERO,
            energy_base: Duration::ZERO,
        };
        drive.start_up(Duration::ZERO);
        drive
    }

    /// The same drive, mute for another time after the reset of a trip. The usual time is 2 s.
    #[must_use]
    pub fn restarting_in(mut self, restart: Duration) -> Self {
        self.restart = restart;
        self
    }

    /// The same drive, which says by function 43/14 that it is another one.
    #[must_use]
    pub fn identified_as(mut self, reference: &'static str) -> Self {
        self.reference = reference;
        self
    }

    /// The same drive with its lower limit LL set at the keypad: it turns no slower while a run is ordered, and FE02 shows the
    /// reference as it was given.
    #[must_use]
    pub fn with_lower_limit(mut self, limit: Frequency) -> Self {
        self.lower_limit = u16::try_from(limit.centihertz()).unwrap_or(u16::MAX);
        self
    }

    /// The same drive with its PI regulator switched on at the keypad and a feedback that stays at 0: it turns as fast as it
    /// may, unless bit 5 of FA00 switches the regulator off (§8.4 p. 31).
    #[must_use]
    pub fn regulated(mut self) -> Self {
        self.regulated = true;
        self
    }

    /// The same drive, whose FD01 shows "run" until the motor stands and not only while it is ordered: the manual can
    /// be read both ways.
    #[must_use]
    pub fn running_until_standstill(mut self) -> Self {
        self.readings.run_until_standstill = true;
        self
    }

    /// The same drive with its indirect blocks set up as in the manual's examples, and in effect.
    #[must_use]
    pub fn with_blocks(mut self) -> Self {
        for (address, slot) in
            (at::READ_SLOT_1..).zip(1..=5).chain([(at::WRITE_SLOT_1, 1), (at::WRITE_SLOT_2, 3)])
        {
            self.bank.set_factory(address, slot);
        }
        self.start_up(Duration::ZERO);
        self
    }

    /// The register that a write goes to: one of the block's own, or the one that its place stands for. `None` for an
    /// empty place.
    fn target_of(&self, address: u16) -> Option<u16> {
        let place = address.checked_sub(blocks::WRITE_BLOCK).map(usize::from);
        match place.and_then(|place| self.write_slots.get(place)) {
            Some(&slot) => written_by(slot),
            None => Some(address),
        }
    }

    fn take(&mut self, address: u16, value: u16) -> Result<(), Exception> {
        self.bank.write(address, value, !self.motor.is_fed())?;
        match address {
            at::COMMAND_WORD => {
                self.heeds = true;
                self.command(value);
            }
            at::FREQUENCY_REFERENCE => self.speed_is_newest = false,
            at::SPEED_REFERENCE => self.speed_is_newest = true,
            at::COMMAND_WORD_2 if value & 0x0002 != 0 => self.energy_base = self.motor.fed_for(),
            at::TIME_OUT => self.set_time_out(),
            _ => {}
        }
        self.follow();
        Ok(())
    }

    /// Follows whatever has changed.
    fn follow(&mut self) {
        self.look_at_inputs();
        self.obey();
    }
}

/// The register that a word of the write block sets (F870, F871).
const fn written_by(slot: u16) -> Option<u16> {
    Some(match slot {
        1 => at::COMMAND_WORD,
        2 => at::COMMAND_WORD_2,
        3 => at::FREQUENCY_REFERENCE,
        4 => at::LOGIC_OUTPUT_COMMAND,
        5 => at::ANALOG_OUTPUT_COMMAND,
        6 => at::SPEED_REFERENCE,
        _ => return None,
    })
}
