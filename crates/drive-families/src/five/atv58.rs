//! Schneider Altivar 58 with its communication card: where the card's manual is silent, its owner says which word is what.

use drive_atv58::{Atv58, Atv58Map, CAPABILITIES};
#[cfg(feature = "sim")]
use drive_sim::models;

#[cfg(feature = "sim")]
use crate::twin::Twin;
use crate::{
    bits,
    definition::Definition,
    options::{OptionEntry, Options},
    texts::{MASK, WORD, WORD_OR_NONE, mask, or_none, time, two_words, word},
};

pub(crate) const DEFINITION: &Definition = &{
    let definition = Definition::new(&CAPABILITIES, &|port, slave, options| {
        Box::new(Atv58::with_map(port, slave, map(options)))
    })
    .with_options(OPTIONS)
    .with_bits(&bits::of_atv58);
    #[cfg(feature = "sim")]
    let definition = definition.with_twin(TWIN);
    definition
};

/// Its simulated twin, with a code for an overcurrent or an overload, which a reset clears.
#[cfg(feature = "sim")]
const TWIN: Twin = Twin::new(&|_| Box::new(models::atv58::Atv58::new())).tripping(5);

/// The options, each once: its name, its values, what it says and its default, and what it sets.
macro_rules! words {
    ($($name:literal, $value:expr, $meaning:literal, |$map:ident, $text:ident| $set:expr;)*) => {
        const OPTIONS: &[OptionEntry] = &[$(OptionEntry::new($name, $value, $meaning, &|$text| {
            let $map = &mut Atv58Map::default();
            let set: Option<()> = $set;
            set.is_some()
        })),*];

        fn map(options: &Options) -> Atv58Map {
            let mut all = Atv58Map::default();
            $(if let Some($text) = options.get($name) {
                let $map = &mut all;
                // What is no value was refused when it was set.
                let _: Option<()> = $set;
            })*
            all
        }
    };
}

words! {
    "status-word", WORD, "the word of the status register ETA (default 458)",
        |map, text| word(text).map(|value| map.status = value);
    "output-frequency-word", WORD_OR_NONE, "the word of the output frequency in 0.1 Hz (default 451)",
        |map, text| or_none(text, word).map(|value| map.output_frequency = value);
    "reference-word", WORD_OR_NONE, "the word of the reference before the ramp in 0.1 Hz (default 450)",
        |map, text| or_none(text, word).map(|value| map.reference = value);
    "current-word", WORD_OR_NONE, "the word of the motor current in 0.1 A (default 453)",
        |map, text| or_none(text, word).map(|value| map.current = value);
    "line-voltage-word", WORD_OR_NONE, "the word of the line voltage in 0.1 V (default 454)",
        |map, text| or_none(text, word).map(|value| map.line_voltage = value);
    "motor-thermal-word", WORD_OR_NONE, "the word of the motor's thermal state in percent (default 455)",
        |map, text| or_none(text, word).map(|value| map.motor_thermal = value);
    "drive-thermal-word", WORD_OR_NONE, "the word of the drive's thermal state in percent (default 456)",
        |map, text| or_none(text, word).map(|value| map.drive_thermal = value);
    "speed-limits", "two words such as 251,250, or none", "the words of the low and the high speed in 0.1 Hz (default 251,250)",
        |map, text| or_none(text, two_words).map(|value| map.speed_limits = value);
    "reference-counts-per-hertz", "a number from 1 to 65535", "counts of the reference W401 that are one hertz (default 10)",
        |map, text| word(text).filter(|&value| value > 0).map(|value| map.reference_counts_per_hertz = value);
    "ramp-stop", "a control word such as 0007h, or none", "the control word that stops along the ramp (default 0007h)",
        |map, text| or_none(text, word).map(|value| map.ramp_stop = value);
    "reverse-command", MASK, "the bit of CMD that turns the motor in reverse (default 0800h)",
        |map, text| mask(text).map(|value| map.reverse_command = value);
    "reverse-status", MASK, "the bit of ETA that is 1 in reverse (default 8000h)",
        |map, text| mask(text).map(|value| map.reverse_status = value);
    "alarm-status", MASK, "the bit of ETA that is 1 while there is an alarm (default 0080h)",
        |map, text| mask(text).map(|value| map.alarm = value);
    "remote-status", MASK, "the bit of ETA that is 1 while the line commands (default 0200h)",
        |map, text| mask(text).map(|value| map.remote = value);
    "at-reference-status", MASK, "the bit of ETA that is 1 at the reference (default 0400h)",
        |map, text| mask(text).map(|value| map.at_reference = value);
    "read-only-function", "3 or 4", "the function that reads the words which the drive alone writes (default 3)",
        |map, text| ["3", "4"].contains(&text).then(|| map.input_words = text == "4");
    "message-watch", "a time such as 10s or 1500ms", "the time without a message that the card allows (default 10s)",
        |map, text| time(text).map(|value| map.message_watch = value);
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn words_of_the_altivar_58_are_given_one_by_one() {
        let mut options = Options::default();
        for (name, text) in [
            ("status-word", "1CBh"),
            ("reverse-command", "none"),
            ("speed-limits", "251, 249"),
            ("message-watch", "1500ms"),
        ] {
            options.set(name, text).unwrap();
        }
        let expected = Atv58Map {
            status: 0x01CB,
            reverse_command: 0,
            speed_limits: Some((251, 249)),
            message_watch: Duration::from_millis(1_500),
            ..Atv58Map::default()
        };
        assert_eq!(map(&options), expected);
    }

    #[test]
    fn every_option_changes_what_it_names() {
        for entry in OPTIONS {
            let text = match entry.name {
                "speed-limits" => "1,2",
                "message-watch" => "1s",
                "read-only-function" => "4",
                _ => "007Bh",
            };
            let mut options = Options::default();
            options.set(entry.name, text).unwrap();
            assert_ne!(map(&options), Atv58Map::default(), "{}", entry.name);
        }
    }
}
