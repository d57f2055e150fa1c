//! The indirect blocks (Altivar 21 Modbus §6.3, §7.5, §7.8): up to five monitored words in one read and two control
//! words in one write, chosen by the parameters F875 to F879, F870 and F871.
//!
//! Everything else the Altivar 21 reads and writes one word at a time.

use drive_core::{
    RawWord,
    registers::{Register, access::Read},
};

use crate::registers as map;

/// Where a read of the block starts on the wire.
pub const READ_BLOCK: u16 = 0x1875;
/// Where a write of the block starts on the wire.
pub const WRITE_BLOCK: u16 = 0x1870;

/// What one word of the read block holds (F875 to F879).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ReadSlot {
    /// Nothing. What the drive sends in this place is not said and not used.
    #[default]
    None,
    /// The status word FD01.
    StatusWord,
    /// The output frequency FD00.
    OutputFrequency,
    /// The output current FE03.
    OutputCurrent,
    /// The output voltage FE05.
    OutputVoltage,
    /// The alarms FC91.
    Alarms,
    /// The PID feedback FE22.
    PidFeedback,
    /// The logic inputs FD06.
    LogicInputs,
    /// The logic outputs FD07.
    LogicOutputs,
    /// The analog input VIA, FE35.
    AnalogInputVia,
    /// The analog input VIB, FE36.
    AnalogInputVib,
    /// The output speed FE90.
    OutputSpeed,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl ReadSlot {
    /// Everything that a place can hold.
    pub(crate) const CHOICES: [Self; 11] = [
        Self::StatusWord,
        Self::OutputFrequency,
        Self::OutputCurrent,
        Self::OutputVoltage,
        Self::Alarms,
        Self::PidFeedback,
        Self::LogicInputs,
        Self::LogicOutputs,
        Self::AnalogInputVia,
        Self::AnalogInputVib,
        Self::OutputSpeed,
    ];

    /// The number that stands in F875 to F879.
    #[must_use]
    pub const fn number(self) -> u16 {
        match self {
            Self::None => 0,
            Self::StatusWord => 1,
            Self::OutputFrequency => 2,
            Self::OutputCurrent => 3,
            Self::OutputVoltage => 4,
            Self::Alarms => 5,
            Self::PidFeedback => 6,
            Self::LogicInputs => 7,
            Self::LogicOutputs => 8,
            Self::AnalogInputVia => 9,
            Self::AnalogInputVib => 10,
            Self::OutputSpeed => 11,
            Self::Unknown(number) => number,
        }
    }

    /// The register that stands in this place of the block, if it is known.
    pub(crate) const fn register(self) -> Option<Register<Read>> {
        Some(match self {
            Self::None | Self::Unknown(_) => return None,
            Self::StatusWord => map::STATUS_WORD,
            Self::OutputFrequency => map::OUTPUT_FREQUENCY,
            Self::OutputCurrent => map::OUTPUT_CURRENT,
            Self::OutputVoltage => map::OUTPUT_VOLTAGE,
            Self::Alarms => map::ALARM_CODE,
            Self::PidFeedback => map::PID_FEEDBACK,
            Self::LogicInputs => map::LOGIC_INPUTS,
            Self::LogicOutputs => map::LOGIC_OUTPUTS,
            Self::AnalogInputVia => map::ANALOG_INPUT_VIA,
            Self::AnalogInputVib => map::ANALOG_INPUT_VIB,
            Self::OutputSpeed => map::OUTPUT_SPEED,
        })
    }
}

impl From<u16> for ReadSlot {
    fn from(number: u16) -> Self {
        if number == 0 {
            return Self::None;
        }
        let listed = Self::CHOICES.into_iter().find(|slot| slot.number() == number);
        listed.unwrap_or(Self::Unknown(number))
    }
}

/// What one word of the write block sets (F870, F871).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WriteSlot {
    /// Nothing. With nothing in F870 the drive refuses the block.
    #[default]
    None,
    /// The command word FA00.
    CommandWord,
    /// The command word 2, FA20.
    CommandWord2,
    /// The frequency reference FA01.
    FrequencyReference,
    /// The logic outputs FA50.
    LogicOutputs,
    /// The analog output FA51.
    AnalogOutput,
    /// The speed reference FA13.
    SpeedReference,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl WriteSlot {
    const LISTED: [Self; 7] = [
        Self::None,
        Self::CommandWord,
        Self::CommandWord2,
        Self::FrequencyReference,
        Self::LogicOutputs,
        Self::AnalogOutput,
        Self::SpeedReference,
    ];

    /// The number that stands in F870 and F871.
    #[must_use]
    pub const fn number(self) -> u16 {
        match self {
            Self::None => 0,
            Self::CommandWord => 1,
            Self::CommandWord2 => 2,
            Self::FrequencyReference => 3,
            Self::LogicOutputs => 4,
            Self::AnalogOutput => 5,
            Self::SpeedReference => 6,
            Self::Unknown(number) => number,
        }
    }
}

impl From<u16> for WriteSlot {
    fn from(number: u16) -> Self {
        let listed = Self::LISTED.into_iter().find(|slot| slot.number() == number);
        listed.unwrap_or(Self::Unknown(number))
    }
}

/// What both blocks hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Blocks {
    /// F875 to F879.
    pub read: [ReadSlot; 5],
    /// F870 and F871.
    pub write: [WriteSlot; 2],
}

impl Blocks {
    /// The set-up that this crate uses best, and that the manual has as its example: a status in one exchange, and a
    /// start at a frequency in one write.
    pub const STANDARD: Self = Self {
        read: [
            ReadSlot::StatusWord,
            ReadSlot::OutputFrequency,
            ReadSlot::OutputCurrent,
            ReadSlot::OutputVoltage,
            ReadSlot::Alarms,
        ],
        write: [WriteSlot::CommandWord, WriteSlot::FrequencyReference],
    };
}

/// Words to ask for so that every place that holds something is read; the drive takes 2 to 5.
pub(crate) fn read_count(slots: &[ReadSlot]) -> u16 {
    let places = (1..).zip(slots);
    let last = places.filter(|(_, slot)| slot.register().is_some()).map(|(place, _)| place).max();
    last.unwrap_or(0).max(2)
}

/// The words of an answer, with their addresses.
pub(crate) fn words(slots: &[ReadSlot], answer: &[u16]) -> Vec<RawWord> {
    let word = |(slot, &value): (&ReadSlot, &u16)| {
        let register = slot.register()?;
        Some(RawWord { address: register.address(), code: register.row().code, value })
    };
    slots.iter().zip(answer).filter_map(word).collect()
}

/// The two words of a write that sets command and frequency reference at once, where the block is set up so.
pub(crate) const fn command_and_reference(
    slots: [WriteSlot; 2],
    command: u16,
    reference: u16,
) -> Option<[u16; 2]> {
    match slots {
        [WriteSlot::CommandWord, WriteSlot::FrequencyReference] => Some([command, reference]),
        [WriteSlot::FrequencyReference, WriteSlot::CommandWord] => Some([reference, command]),
        _ => None,
    }
}

/// What setting up the blocks has cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[must_use = "a changed set-up takes effect only after the drive was reset"]
pub struct BlockSetUp {
    /// Parameters that were written, each to EEPROM; those that were right already were not.
    pub writes: u32,
    /// Whether the drive must be reset or switched off and on before the blocks hold what was written.
    pub needs_reset: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_holds_nothing_is_skipped_and_its_word_not_used() {
        let slots = [
            ReadSlot::OutputCurrent,
            ReadSlot::None,
            ReadSlot::Unknown(99),
            ReadSlot::StatusWord,
            ReadSlot::None,
        ];
        assert_eq!(read_count(&slots), 4);
        let held = words(&slots, &[1, 2, 3, 4]);
        assert_eq!(
            held.iter().map(|word| (word.address, word.value)).collect::<Vec<_>>(),
            [(0xFE03, 1), (0xFD01, 4)]
        );
    }

    #[test]
    fn command_and_reference_go_to_their_own_places() {
        let swapped = [WriteSlot::FrequencyReference, WriteSlot::CommandWord];
        let words = |slots| command_and_reference(slots, 0xC400, 6_000);
        assert_eq!(words(Blocks::STANDARD.write), Some([0xC400, 6_000]));
        assert_eq!(words(swapped), Some([6_000, 0xC400]));
        assert_eq!(words(Blocks::default().write), None);
    }
}
