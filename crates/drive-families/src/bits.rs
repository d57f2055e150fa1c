//! The bits of the families' words by name, for whoever puts a word into words.

use bitflags::Flags;
use drive_3g3ev::words as omron;
use drive_atv28::words::LogicIo as Atv28Io;
use drive_atv312::words as atv312;
use drive_drivecom as drivecom;

use crate::Family;

/// A bit of a word and what it says when it is 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Bit {
    /// The bit, as a mask.
    pub mask: u16,
    /// Its name in the sources, such as `NO_QUICK_STOP`.
    pub name: &'static str,
}

impl Family {
    /// The bits of the register at `address` that the manual names, the lowest first; none for a number.
    ///
    /// ```
    /// # use drive_families::Family;
    /// let bits = Family::ATV312.bits(3201);
    /// assert_eq!((bits[0].mask, bits[0].name), (1, "READY"));
    /// ```
    #[must_use]
    pub fn bits(self, address: u16) -> Vec<Bit> {
        (self.0.bits)(address)
    }
}

pub(crate) fn of_atv28(address: u16) -> Vec<Bit> {
    match address {
        400 | 601 => named::<drivecom::ControlWord>(),
        458 | 602 => named::<drivecom::StatusWord>(),
        459 => named::<drivecom::ExtendedStatus>(),
        478 => named::<Atv28Io>(),
        _ => Vec::new(),
    }
}

/// What else its words hold is not public.
pub(crate) fn of_atv58(address: u16) -> Vec<Bit> {
    if address == 400 { named::<drivecom::ControlWord>() } else { Vec::new() }
}

pub(crate) fn of_atv21(address: u16) -> Vec<Bit> {
    match address {
        0xFA00 => named::<drive_atv21::CommandWord>(),
        0xFA20 => named::<drive_atv21::CommandWord2>(),
        0xFD01 | 0xFE01 => named::<drive_atv21::StatusWord>(),
        0xFD42 | 0xFE42 => named::<drive_atv21::StatusWord2>(),
        0xFD49 | 0xFE49 => named::<drive_atv21::StatusWord3>(),
        0xFC91 => named::<drive_atv21::Alarms>(),
        0xFE79 => named::<drive_atv21::MaintenanceAlarms>(),
        0xFD06 | 0xFE06 => named::<drive_atv21::LogicInputs>(),
        0xFD07 | 0xFE07 => named::<drive_atv21::LogicOutputs>(),
        _ => Vec::new(),
    }
}

pub(crate) fn of_atv312(address: u16) -> Vec<Bit> {
    match address {
        8501 | 8601 => named::<drivecom::ControlWord>(),
        8504 | 8541 | 8542 => named::<atv312::ExtendedControl>(),
        3201 | 8603 => named::<drivecom::StatusWord>(),
        3206 => named::<drivecom::ExtendedStatus>(),
        3250 => named::<atv312::ExtendedStatus1>(),
        3252 => named::<atv312::ExtendedStatus3>(),
        5240 => named::<atv312::LogicIo>(),
        7211..=7214 => named::<atv312::FaultState>(),
        _ => Vec::new(),
    }
}

pub(crate) fn of_3g3ev(address: u16) -> Vec<Bit> {
    match address {
        0x01 => named::<omron::Command>(),
        0x09 => named::<omron::Outputs>(),
        0x20 => named::<omron::Signals>(),
        0x21 => named::<omron::Errors>(),
        0x22 => named::<omron::LinkState>(),
        0x2C => named::<omron::DriveState>(),
        0x3D => named::<omron::LinkError>(),
        _ => Vec::new(),
    }
}

fn named<W: Flags<Bits = u16>>() -> Vec<Bit> {
    let bits = W::FLAGS.iter().map(|flag| Bit { mask: flag.value().bits(), name: flag.name() });
    bits.filter(|bit| bit.mask.is_power_of_two()).collect()
}

#[cfg(test)]
mod tests {
    use drive_core::registers::Form;

    use super::*;

    #[test]
    fn only_words_of_bits_of_the_families_own_registers_have_names_of_bits() {
        for family in Family::BUILT_IN {
            let rows = family.capabilities().rows;
            let mut named = 0;
            for address in 0..=u16::MAX {
                let bits = family.bits(address);
                if bits.is_empty() {
                    continue;
                }
                named += 1;
                let row = rows.iter().find(|row| row.place() == address.into());
                assert!(row.is_some_and(|row| row.unit.form == Form::Bits), "{family}: {address}");
                assert!(bits.is_sorted_by_key(|bit| bit.mask), "{family}: {address}");
            }
            assert!(named > 0, "{family}");
        }
    }
}
