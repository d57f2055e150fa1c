//! The options by name, as configurations and command lines write them.

use std::time::Duration;

use drive_atv21::Authority;

use super::{OptionError, Options};
use crate::Family;

/// One option by its name.
#[derive(Debug, Clone, Copy)]
pub struct OptionEntry {
    /// Its name.
    pub name: &'static str,
    /// The family that has it.
    pub family: Family,
    /// The texts that are values of it.
    pub value: &'static str,
    /// What it says of the drive, and its default.
    pub meaning: &'static str,
    /// Sets it from a text; `None`: the text is no value of it.
    pub(super) set: fn(&mut Options, &str) -> Option<()>,
}

impl OptionEntry {
    /// The option of this name.
    ///
    /// # Errors
    /// [`OptionError::Unknown`], with the names that there are.
    pub fn find(name: &str) -> Result<&'static Self, OptionError> {
        let found = OPTIONS.iter().find(|entry| entry.name == name.trim());
        found.ok_or_else(|| OptionError::Unknown(name.to_owned()))
    }
}

const NUMBER: &str = "a number up to 65535, or hexadecimal such as 01CAh";
const WORD: &str = "the number of a word such as 458 or 01CAh";
const WORD_OR_NONE: &str = "the number of a word such as 451 or 01C3h, or none";
const MASK: &str = "a mask such as 0800h, or none";

/// Every option of every family.
pub const OPTIONS: &[OptionEntry] = &[
    OptionEntry {
        name: "authority",
        family: Family::Atv21,
        value: "priority or settings",
        meaning: "by what right the bus commands: its priority bits (default), or the drive's settings CMOD = 2 and FMOD = 4 alone",
        set: |options, text| authority(text).map(|value| options.authority = Some(value)),
    },
    OptionEntry {
        name: "fault-reset-function",
        family: Family::Omron3g3ev,
        value: NUMBER,
        meaning: "the number of \"fault reset\" in n06 to n08, from the drive's user manual; without it a fault cannot be reset",
        set: |options, text| word(text).map(|value| options.fault_reset_function = Some(value)),
    },
    OptionEntry {
        name: "saves",
        family: Family::Omron3g3ev,
        value: "a whole number",
        meaning: "how often its EEPROM was saved before; counted on from there (default 0)",
        set: |options, text| text.parse().ok().map(|value| options.saves = Some(value)),
    },
    OptionEntry {
        name: "status-word",
        family: Family::Atv58,
        value: WORD,
        meaning: "the word of the status register ETA (default 458)",
        set: |options, text| word(text).map(|value| options.map_mut().status = value),
    },
    OptionEntry {
        name: "output-frequency-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the output frequency in 0.1 Hz (default 451)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().output_frequency = value),
    },
    OptionEntry {
        name: "reference-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the reference before the ramp in 0.1 Hz (default 450)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().reference = value),
    },
    OptionEntry {
        name: "current-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the motor current in 0.1 A (default 453)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().current = value),
    },
    OptionEntry {
        name: "line-voltage-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the line voltage in 0.1 V (default 454)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().line_voltage = value),
    },
    OptionEntry {
        name: "motor-thermal-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the motor's thermal state in percent (default 455)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().motor_thermal = value),
    },
    OptionEntry {
        name: "drive-thermal-word",
        family: Family::Atv58,
        value: WORD_OR_NONE,
        meaning: "the word of the drive's thermal state in percent (default 456)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().drive_thermal = value),
    },
    OptionEntry {
        name: "speed-limits",
        family: Family::Atv58,
        value: "two words such as 251,250, or none",
        meaning: "the words of the low and the high speed in 0.1 Hz (default 251,250)",
        set: |options, text| or_none(text, two_words).map(|value| options.map_mut().speed_limits = value),
    },
    OptionEntry {
        name: "reference-counts-per-hertz",
        family: Family::Atv58,
        value: "a number from 1 to 65535",
        meaning: "counts of the reference W401 that are one hertz (default 10)",
        set: |options, text| {
            word(text)
                .filter(|&value| value > 0)
                .map(|value| options.map_mut().reference_counts_per_hertz = value)
        },
    },
    OptionEntry {
        name: "ramp-stop",
        family: Family::Atv58,
        value: "a control word such as 0007h, or none",
        meaning: "the control word that stops along the ramp (default 0007h)",
        set: |options, text| or_none(text, word).map(|value| options.map_mut().ramp_stop = value),
    },
    OptionEntry {
        name: "reverse-command",
        family: Family::Atv58,
        value: MASK,
        meaning: "the bit of CMD that turns the motor in reverse (default 0800h)",
        set: |options, text| mask(text).map(|value| options.map_mut().reverse_command = value),
    },
    OptionEntry {
        name: "reverse-status",
        family: Family::Atv58,
        value: MASK,
        meaning: "the bit of ETA that is 1 in reverse (default 8000h)",
        set: |options, text| mask(text).map(|value| options.map_mut().reverse_status = value),
    },
    OptionEntry {
        name: "alarm-status",
        family: Family::Atv58,
        value: MASK,
        meaning: "the bit of ETA that is 1 while there is an alarm (default 0080h)",
        set: |options, text| mask(text).map(|value| options.map_mut().alarm = value),
    },
    OptionEntry {
        name: "remote-status",
        family: Family::Atv58,
        value: MASK,
        meaning: "the bit of ETA that is 1 while the line commands (default 0200h)",
        set: |options, text| mask(text).map(|value| options.map_mut().remote = value),
    },
    OptionEntry {
        name: "at-reference-status",
        family: Family::Atv58,
        value: MASK,
        meaning: "the bit of ETA that is 1 at the reference (default 0400h)",
        set: |options, text| mask(text).map(|value| options.map_mut().at_reference = value),
    },
    OptionEntry {
        name: "read-only-function",
        family: Family::Atv58,
        value: "3 or 4",
        meaning: "the function that reads the words which the drive alone writes (default 3)",
        set: |options, text| ["3", "4"].contains(&text).then(|| options.map_mut().input_words = text == "4"),
    },
    OptionEntry {
        name: "message-watch",
        family: Family::Atv58,
        value: "a time such as 10s or 1500ms",
        meaning: "the time without a message that the card allows (default 10s)",
        set: |options, text| time(text).map(|value| options.map_mut().message_watch = value),
    },
];

/// The names of all options, for an error.
pub(super) fn names() -> String {
    join(|_| true)
}

/// The names of a family's options, for an error.
pub(super) fn names_of(family: Family) -> String {
    join(|entry| entry.family == family)
}

fn join(which: impl Fn(&OptionEntry) -> bool) -> String {
    let names: Vec<&str> = OPTIONS.iter().filter(|entry| which(entry)).map(|entry| entry.name).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn authority(text: &str) -> Option<Authority> {
    match text {
        "priority" => Some(Authority::Priority),
        "settings" => Some(Authority::Settings),
        _ => None,
    }
}

fn word(text: &str) -> Option<u16> {
    match text.strip_suffix(['h', 'H']) {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn two_words(text: &str) -> Option<(u16, u16)> {
    let (low, high) = text.split_once(',')?;
    Some((word(low.trim())?, word(high.trim())?))
}

fn or_none<T>(text: &str, read: fn(&str) -> Option<T>) -> Option<Option<T>> {
    if text == "none" { Some(None) } else { read(text).map(Some) }
}

/// A mask of 0 stands for a bit that the drive does not have.
fn mask(text: &str) -> Option<u16> {
    or_none(text, word).map(Option::unwrap_or_default)
}

fn time(text: &str) -> Option<Duration> {
    let (number, unit): (_, fn(u64) -> Duration) = match text.strip_suffix("ms") {
        Some(number) => (number, Duration::from_millis),
        None => (text.strip_suffix('s')?, Duration::from_secs),
    };
    number.trim_end().parse().ok().map(|number: u32| unit(number.into()))
}
