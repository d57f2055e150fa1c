//! The registers that the drive computes (p. 17–26).

use drive_atv312::words::{ExtendedControl, ExtendedStatus1, ExtendedStatus3, LogicIo};

use super::{Atv312, CMD, CMI, LFR, LFRD, PISP, settings};
use crate::models::drivecom::{profile_code, rpm, word};

/// Line voltage in tenths of a volt.
const LINE_VOLTAGE: u16 = 4_000;
/// `ETI` bit 0: the EEPROM is being written.
const EEPROM_BUSY: u16 = 1 << 0;
/// `ETI` bit 1: parameters are checked for consistency.
const CONSISTENCY_CHECK: u16 = 1 << 1;
/// Thermal state from which motor and drive warn, in percent.
const THERMAL_ALARM: u16 = 100;

impl Atv312 {
    /// A register that the drive computes; `None` for one that is kept.
    pub(super) fn computed(&self, address: u16) -> Option<u16> {
        let motor = self.drive.motor();
        let output = motor.output_frequency();
        let target = self.drive.target();
        Some(match address {
            3201 | 8603 => self.drive.eta(),
            3202 => word(settings::counts(output, self.cmi())),
            3203 => word(target.abs() / 10),
            3204 => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            // Torque and power have no sign here (p. 21).
            3205 => word(motor.torque().abs()),
            3206 => self.eti(),
            3207 => LINE_VOLTAGE,
            3209 | 9630 => motor.thermal_state(),
            3210 => self.hottest,
            3211 => word(motor.power().abs()),
            3231 => {
                let hours = motor.fed_for().saturating_sub(self.time_base).as_secs() / 3_600;
                u16::try_from(hours).unwrap_or(u16::MAX)
            }
            3250 => self.lrs1(),
            3252 => self.lrs3(),
            5240 => self.iolr(),
            7121 => self.fault(0).0,
            7201..=7204 => self.fault(usize::from(address - 7200)).0,
            7211..=7214 => self.fault(usize::from(address - 7210)).1,
            8521 => self.bank.value(LFR),
            8531 => self.bank.value(PISP),
            8541 => self.bank.value(CMI),
            8601 => self.bank.value(CMD),
            8604 if self.is_high_resolution() => word(settings::counts(output, self.cmi())),
            8604 => word(rpm(output)),
            8605 => word(rpm(target)),
            8606 => profile_code(self.fault(0).0),
            // LSP and HSP once more, in rpm.
            8607 => word(rpm(i32::from(self.bank.value(3105)) * 10)),
            8609 => word(rpm(i32::from(self.bank.value(3104)) * 10)),
            8608 | 8610 => 0,
            8631 => self.bank.value(LFRD),
            12002 => self.customer_speed() as u16,
            12003 => (self.customer_speed() >> 16) as u16,
            _ => return None,
        })
    }

    fn is_high_resolution(&self) -> bool {
        self.cmi().contains(ExtendedControl::HIGH_RESOLUTION)
    }

    /// `ETI`: what chart and motor say, and what belongs to the memory.
    fn eti(&self) -> u16 {
        let busy = if self.saving.is_some() { EEPROM_BUSY } else { 0 };
        let unchecked = self.cmi().contains(ExtendedControl::NO_CONSISTENCY_CHECK);
        let checked = if unchecked { 0 } else { CONSISTENCY_CHECK };
        // The remote terminal commands where LCC says so, at L1 and L2 (p. 22, 38).
        let terminal = self.bank.value(64003) == 1 && self.bank.value(3006) != settings::L3;
        self.drive.eti() | busy | checked | u16::from(terminal) << 13
    }

    fn lrs1(&self) -> u16 {
        let motor = self.drive.motor();
        let output = motor.output_frequency().unsigned_abs();
        let hot = motor.thermal_state() >= THERMAL_ALARM;
        let mut bits = ExtendedStatus1::empty();
        bits.set(ExtendedStatus1::FAULT, self.drive.present_fault().is_some());
        bits.set(ExtendedStatus1::MOTOR_RUNNING, motor.is_fed());
        bits.set(ExtendedStatus1::FREQUENCY_THRESHOLD, output > u32::from(self.bank.value(11003)) * 10);
        bits.set(ExtendedStatus1::HIGH_SPEED, output >= self.drive.settings().high_speed && motor.is_fed());
        bits.set(ExtendedStatus1::CURRENT_THRESHOLD, motor.current() > u32::from(self.bank.value(11001)));
        bits.set(ExtendedStatus1::REFERENCE_REACHED, motor.is_at_target());
        bits.set(ExtendedStatus1::MOTOR_THERMAL_ALARM, hot);
        bits.set(ExtendedStatus1::DRIVE_THERMAL_ALARM, hot);
        bits.set(ExtendedStatus1::BRAKE_RELEASED, self.bank.value(10001) != 0 && motor.is_fed());
        bits.bits()
    }

    fn lrs3(&self) -> u16 {
        let command = self.bank.value(CMD);
        let mut bits = ExtendedStatus3::MOTOR_1;
        bits.set(ExtendedStatus3::REFERENCE_2, settings::by_reference_2(&self.bank, command));
        bits.set(ExtendedStatus3::COMMAND_2, settings::by_command_2(&self.bank, command));
        bits.set(ExtendedStatus3::RAMPS_2, settings::second_ramps(&self.bank, command));
        bits.bits()
    }

    /// The inputs as they are, the outputs as they were written or as their function has them: relay R1 is energised
    /// without a fault (p. 34).
    fn iolr(&self) -> u16 {
        let mut bits = LogicIo::from_bits_retain(self.bank.value(5240));
        if self.bank.value(5001) == 1 {
            bits.set(LogicIo::R1, self.drive.present_fault().is_none());
        }
        bits.bits()
    }

    /// Code and state of a remembered fault, the latest first.
    fn fault(&self, index: usize) -> (u16, u16) {
        self.drive.faults().nth(index).map_or((0, 0), |fault| (fault.code, fault.status))
    }

    /// `rFr` × `SdS` (p. 22, 28), both in tenths.
    fn customer_speed(&self) -> u32 {
        let tenths = self.drive.motor().output_frequency() / 10;
        (tenths * i32::from(self.bank.value(12001)) / 100).cast_unsigned()
    }
}
