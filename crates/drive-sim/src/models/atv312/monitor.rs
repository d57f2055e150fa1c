//! The registers that the drive computes (p. 17–26).

use drive_atv312::{
    registers::address::*,
    words::{ExtendedControl, ExtendedStatus1, ExtendedStatus3, LogicIo},
};

use super::{Atv312, INPUTS, settings};
use crate::models::drivecom::{profile_code, rpm, word};

/// Line voltage in tenths of a volt.
const LINE_VOLTAGE: u16 = 4_000;
/// `ETI` bit 0: the EEPROM is being written.
const EEPROM_BUSY: u16 = 1 << 0;
/// `ETI` bit 1: parameters are checked for consistency.
const CONSISTENCY_CHECK: u16 = 1 << 1;
/// `ETI` bit 4.
const MOTOR_RUNNING: u16 = 1 << 4;
/// Thermal state from which motor and drive warn, in percent.
const THERMAL_ALARM: u16 = 100;

impl Atv312 {
    /// A register that the drive computes; `None` for one that is kept.
    pub(super) fn computed(&self, address: u16) -> Option<u16> {
        let motor = self.drive.motor();
        let output = motor.output_frequency();
        let target = self.drive.target();
        Some(match address {
            ETA | ETAD => self.drive.eta(),
            RFR => word(settings::counts(output, self.cmi())),
            FRH => word(target.abs() / 10),
            LCR => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            // Torque and power have no sign here (p. 21).
            OTR => word(motor.torque().abs()),
            ETI => self.eti(),
            ULN if !self.around.motor_supply => 0,
            ULN => LINE_VOLTAGE,
            AI1C => word(self.around.analog(1)),
            AI2C => word(self.around.analog(2)),
            AI3C => word(self.around.analog(3) * 2),
            // What a count is worth is not printed; 1 % here (p. 23).
            AIV1 => word(self.around.analog(4) / 100),
            THD | THR => motor.thermal_state(),
            TDM => self.hottest,
            OPR => word(motor.power().abs()),
            RTH => {
                let hours = motor.fed_for().saturating_sub(self.time_base).as_secs() / 3_600;
                u16::try_from(hours).unwrap_or(u16::MAX)
            }
            LRS1 => self.lrs1(),
            LRS3 => self.lrs3(),
            IOLR => self.iolr(),
            LFT => self.fault(0).0,
            DP1..=DP4 => self.fault(usize::from(address - DP1 + 1)).0,
            EP1..=EP4 => self.fault(usize::from(address - EP1 + 1)).1,
            LFR1 => self.bank.value(LFR),
            PIR1 => self.bank.value(PISP),
            CMI1 => self.bank.value(CMI),
            CMDD => self.bank.value(CMD),
            RFRD if self.is_high_resolution() => word(settings::counts(output, self.cmi())),
            RFRD => word(rpm(output)),
            FRHD => word(rpm(target)),
            ERRD => profile_code(self.fault(0).0),
            // LSP and HSP once more, in rpm.
            SMIL => word(rpm(i32::from(self.bank.value(LSP)) * 10)),
            SMAL => word(rpm(i32::from(self.bank.value(HSP)) * 10)),
            SMIL_HIGH | SMAL_HIGH => 0,
            LFD1 => self.bank.value(LFRD),
            USPL => self.customer_speed() as u16,
            USPH => (self.customer_speed() >> 16) as u16,
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
        self.drive.eti() | busy | checked
    }

    fn lrs1(&self) -> u16 {
        let motor = self.drive.motor();
        let output = motor.output_frequency().unsigned_abs();
        let hot = motor.thermal_state() >= THERMAL_ALARM;
        let mut bits = ExtendedStatus1::empty();
        bits.set(ExtendedStatus1::FAULT, self.drive.present_fault().is_some());
        bits.set(ExtendedStatus1::MOTOR_RUNNING, self.drive.eti() & MOTOR_RUNNING != 0);
        bits.set(ExtendedStatus1::FREQUENCY_THRESHOLD, output > u32::from(self.bank.value(FTD)) * 10);
        bits.set(ExtendedStatus1::HIGH_SPEED, output >= self.drive.settings().high_speed && motor.is_fed());
        bits.set(ExtendedStatus1::CURRENT_THRESHOLD, motor.current() > u32::from(self.bank.value(CTD)));
        bits.set(ExtendedStatus1::REFERENCE_REACHED, motor.is_at_target());
        bits.set(ExtendedStatus1::MOTOR_THERMAL_ALARM, hot);
        bits.set(ExtendedStatus1::DRIVE_THERMAL_ALARM, hot);
        bits.set(ExtendedStatus1::SIGNAL_LOST, self.routing().is_signal_lost());
        bits.set(ExtendedStatus1::BRAKE_RELEASED, self.bank.value(BLC) != 0 && motor.is_fed());
        bits.bits()
    }

    fn lrs3(&self) -> u16 {
        let routing = self.routing();
        let motor_2 = routing.function(CHP);
        let mut bits = ExtendedStatus3::empty();
        bits.set(ExtendedStatus3::REFERENCE_2, routing.by_reference_2());
        bits.set(ExtendedStatus3::COMMAND_2, routing.by_command_2());
        bits.set(ExtendedStatus3::RAMPS_2, routing.second_ramps());
        bits.set(ExtendedStatus3::CURRENT_LIMIT_2, routing.function(LC2));
        bits.set(ExtendedStatus3::MOTOR_1, !motor_2);
        bits.set(ExtendedStatus3::MOTOR_2, motor_2);
        bits.bits()
    }

    /// The inputs as they are, the outputs as they were written or as their function has them: relay R1 is energised
    /// without a fault (p. 34), and during an automatic restart (p. 51).
    fn iolr(&self) -> u16 {
        let mut bits =
            LogicIo::from_bits_retain(self.bank.value(IOLR) & !INPUTS | self.around.inputs & INPUTS);
        if self.bank.value(R1) == 1 {
            bits.set(LogicIo::R1, self.drive.present_fault().is_none() || self.drive.is_restarting());
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
        (tenths * i32::from(self.bank.value(SDS)) / 100).cast_unsigned()
    }
}
