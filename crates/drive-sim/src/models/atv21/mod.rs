//! The simulated Altivar 21, from the drive's side ("Altivar 21 Modbus, guide d'exploitation", 10/2009).
//!
//! What the manual leaves open is decided here, and only here: a lone word of a block does not exist (exception 02), an
//! empty place of the read block reads 0 and one of the write block takes anything, a broadcast does not feed the
//! time-out, F603 = 4 coasts, an emergency stop coasts, preset speed n is n times 5 Hz, F856 counts poles, one count of
//! energy is 0.01 kWh at rated power, FA01 and FA13 hold whichever was written last, 100 % is what is on the plate.

mod control;
mod monitor;
#[cfg(test)]
mod tests;

use std::{collections::BTreeMap, time::Duration};

use drive_atv21::{FAULTS, ROWS, blocks, registers as map};
use drive_core::registers::Storage;

use crate::{
    Bank, Block, Cast, Exception, Model, Motor, Nameplate, Observation, Panel, Rules, Surroundings, Watchdog,
    identification,
};

/// What is around it.
const SURROUNDINGS: Surroundings =
    Surroundings { family: "atv21", trips: FAULTS, rows: ROWS, ..Surroundings::NONE };

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
/// How long the reaction by DC injection brakes.
const TRIP_BRAKING: Duration = Duration::from_secs(1);
/// The rated current of the motor in tenths of an ampere, for 0.75 kW at 200 V.
const RATED_CURRENT: u32 = 40;
/// The rated power in 0.01 kW.
const RATED_POWER: u32 = 75;

/// An ATV21H075M3X, with a motor of its size.
#[derive(Debug, Clone)]
pub struct Atv21 {
    bank: Bank,
    /// The slots that were configured at the last reset.
    read_slots: [u16; 5],
    write_slots: [u16; 2],
    motor: Motor,
    watchdog: Watchdog,
    trip: Option<u16>,
    /// What FD01 and the other words were when it tripped.
    frozen: BTreeMap<u16, u16>,
    /// Monitored words that a test has set: they show that instead of what the drive would compute.
    pinned: BTreeMap<u16, u16>,
    /// LOC/REM: the keypad has control.
    local: bool,
    /// Whether the order in FA00 is in force: not after somebody at the machine interfered, until it is written anew.
    heeds: bool,
    speed_is_reference: bool,
    run_until_standstill: bool,
    starting: Duration,
    restart: Duration,
    powered: Duration,
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
            (map::DECELERATION.address(), 100),
            (map::ACCELERATION_2.address(), 100),
            (map::DECELERATION_2.address(), 100),
            (map::UPPER_LIMIT.address(), 5_000),
            (map::MOTOR_POLES.address(), 4),
            (map::SECOND_REFERENCE.address(), 2),
            (map::INPUT_R_FUNCTION.address(), control::R_IS_REVERSE),
            (map::MODEL_CODE.address(), 4),
            (map::RATED_CURRENT.address(), 40),
            (map::RATED_VOLTAGE.address(), 2_000),
        ] {
            bank.set_factory(register, value);
        }
        let mut drive = Self {
            bank,
            read_slots: [0; 5],
            write_slots: [0; 2],
            motor: Motor::new(Nameplate::light(RATED_CURRENT)),
            watchdog: Watchdog::default(),
            trip: None,
            frozen: BTreeMap::new(),
            pinned: BTreeMap::new(),
            local: false,
            heeds: true,
            speed_is_reference: false,
            run_until_standstill: false,
            starting: Duration::ZERO,
            restart: RESTART,
            powered: Duration::ZERO,
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

    /// The same drive, whose FD01 shows "run" until the motor stands and not only while it is ordered: the manual can
    /// be read both ways.
    #[must_use]
    pub fn running_until_standstill(mut self) -> Self {
        self.run_until_standstill = true;
        self
    }

    /// The same drive with its indirect blocks set up as in the manual's examples, and in effect.
    #[must_use]
    pub fn with_blocks(mut self) -> Self {
        for (address, slot) in (0x0875..).zip(1..=5).chain([(0x0870, 1), (0x0871, 3)]) {
            self.bank.set_factory(address, slot);
        }
        self.start_up(Duration::ZERO);
        self
    }

    /// What happens at power-up and when a trip was reset: the control registers fall back to 0, the block
    /// configuration and the protocol settings take effect.
    fn start_up(&mut self, duration: Duration) {
        for row in ROWS.iter().filter(|row| row.storage == Storage::Volatile && row.access.is_writable()) {
            self.bank.set(row.address, 0);
        }
        self.read_slots = [0x0875, 0x0876, 0x0877, 0x0878, 0x0879].map(|slot| self.bank.value(slot));
        self.write_slots = [0x0870, 0x0871].map(|slot| self.bank.value(slot));
        self.trip = None;
        self.heeds = true;
        self.starting = duration;
        self.watchdog.rest();
        self.set_time_out();
    }

    fn set_time_out(&mut self) {
        let seconds = self.bank.value(map::TIME_OUT.address());
        self.watchdog.set_timeout((seconds > 0).then(|| Duration::from_secs(seconds.into())));
    }

    fn trip_with(&mut self, code: u16) {
        if self.trip.is_some() {
            return;
        }
        self.freeze();
        let history = [0xFE10, 0xFE11, 0xFE12].map(|address| self.bank.value(address));
        for (address, code) in (0xFE10..).zip([code].into_iter().chain(history)) {
            self.bank.set(address, code);
        }
        self.trip = Some(code);
        match (code, self.bank.value(map::TIME_OUT_REACTION.address())) {
            (TIME_OUT, 1) => self.motor.ramp_to_rest(self.ramps().deceleration),
            (TIME_OUT, 2) => self.motor.brake(control::BRAKING_CURRENT, Some(TRIP_BRAKING)),
            _ => self.motor.freewheel(),
        }
    }

    /// Whether a register would take a value, without writing it.
    fn check(&self, address: u16, value: u16) -> Result<(), Exception> {
        self.bank.check(address, value, !self.motor.is_fed())?;
        if address == map::FREQUENCY_REFERENCE.address() && value > MAXIMUM_FREQUENCY {
            return Err(Exception::ILLEGAL_VALUE);
        }
        Ok(())
    }

    fn take(&mut self, address: u16, value: u16) -> Result<(), Exception> {
        self.check(address, value)?;
        self.bank.write(address, value, !self.motor.is_fed())?;
        match address {
            0xFA00 => {
                self.heeds = true;
                self.command(value);
            }
            0xFA01 => self.speed_is_reference = false,
            0xFA13 => self.speed_is_reference = true,
            0xFA20 if value & 0x0002 != 0 => self.energy_base = self.motor.fed_for(),
            0x0803 => self.set_time_out(),
            _ => {}
        }
        self.obey();
        Ok(())
    }
}

impl Model for Atv21 {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &RULES
    }

    fn check_read(&self, block: Block) -> Result<(), Exception> {
        let in_block = (blocks::READ_BLOCK..blocks::READ_BLOCK + 5).contains(&block.first);
        match block.quantity {
            1 if in_block => Err(Exception::ILLEGAL_ADDRESS),
            1 => Ok(()),
            _ if block.first == blocks::READ_BLOCK => Ok(()),
            _ => Err(Exception::ILLEGAL_VALUE),
        }
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let place = address.checked_sub(blocks::READ_BLOCK).map(usize::from);
        if let Some(&slot) = place.and_then(|place| self.read_slots.get(place)) {
            return Ok(monitor::in_slot(slot).map_or(0, |address| self.value(address)));
        }
        self.bank.read(address)?;
        Ok(self.value(address))
    }

    fn check_write(&self, block: Block, values: &[u16], _: Cast) -> Result<(), Exception> {
        let in_block = (blocks::WRITE_BLOCK..blocks::WRITE_BLOCK + 2).contains(&block.first);
        match block.quantity {
            1 if in_block => Err(Exception::ILLEGAL_ADDRESS),
            1 => Ok(()),
            2 if block.first == blocks::WRITE_BLOCK && values.len() == 2 => {
                if self.write_slots.first() == Some(&0) {
                    return Err(Exception::FAILURE);
                }
                let targets = self.write_slots.iter().map(|&slot| written_by(slot));
                let set = targets.zip(values).filter_map(|(target, &value)| target.map(|at| (at, value)));
                set.into_iter().try_for_each(|(address, value)| self.check(address, value))
            }
            _ => Err(Exception::ILLEGAL_VALUE),
        }
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        // The words of the block come one after the other.
        let place = address.checked_sub(blocks::WRITE_BLOCK).map(usize::from);
        match place.and_then(|place| self.write_slots.get(place)) {
            Some(&slot) => written_by(slot).map_or(Ok(()), |address| self.take(address, value)),
            None => self.take(address, value),
        }
    }

    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        match *request {
            [0x2B, 0x0E, code @ 1..=3, 0x00] => {
                Ok(identification(code, 0x01, &["Telemecanique", "ATV21H075M3X", "0201"]))
            }
            [0x2B, 0x0E, ..] => Err(Exception::ILLEGAL_VALUE),
            _ => Err(Exception::ILLEGAL_FUNCTION),
        }
    }

    fn frame_seen(&mut self, cast: Cast) {
        if cast == Cast::Unicast {
            self.watchdog.feed();
        }
    }

    fn listens(&self) -> bool {
        self.starting.is_zero()
    }

    fn advance(&mut self, elapsed: Duration) {
        let mut left = elapsed;
        while !left.is_zero() {
            let piece = self.watchdog.remaining().map_or(left, |remaining| remaining.min(left));
            self.motor.advance(piece);
            self.powered = self.powered.saturating_add(piece);
            self.starting = self.starting.saturating_sub(piece);
            if self.watchdog.advance(piece) {
                self.trip_with(TIME_OUT);
            }
            left = left.saturating_sub(piece);
        }
    }

    fn power(&mut self, on: bool) {
        self.motor.freewheel();
        if !on {
            self.watchdog = Watchdog::default();
            return;
        }
        self.bank.power_cycle();
        self.pinned.clear();
        self.local = false;
        self.start_up(POWER_UP);
    }

    fn trip(&mut self, code: u16) {
        self.trip_with(code);
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => self.local = true,
            Panel::ReleaseControl => self.local = false,
            Panel::Stop | Panel::Run | Panel::Reset | Panel::Reference(_) => {}
        }
        // Whatever the bus had ordered does not come back by itself.
        self.heeds = false;
        self.obey();
    }

    fn observe(&self) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: self.target(),
            current: self.motor.current(),
            trip: self.trip,
            local: self.local,
            eeprom_writes: self.bank.eeprom_writes(),
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|_| self.value(address))
    }

    /// A monitored word that the drive computes keeps showing what is set here until the next power cycle.
    fn poke(&mut self, address: u16, value: u16) -> bool {
        if self.computed(address).is_some() {
            self.pinned.insert(address, value);
            return true;
        }
        let kept = self.bank.row(address).is_some_and(|row| row.storage == Storage::Eeprom);
        let found = if kept { self.bank.set_for_good(address, value) } else { self.bank.set(address, value) };
        self.set_time_out();
        self.obey();
        found
    }
}

/// The register that a word of the write block sets (F870, F871).
const fn written_by(slot: u16) -> Option<u16> {
    match slot {
        1 => Some(0xFA00),
        2 => Some(0xFA20),
        3 => Some(0xFA01),
        4 => Some(0xFA50),
        5 => Some(0xFA51),
        6 => Some(0xFA13),
        _ => None,
    }
}
