//! A protocol and its settings as a text: the name, and behind it what differs from the default.

#[cfg(any(feature = "ascii", feature = "unitelway"))]
mod settings;

use std::{fmt, str::FromStr};

use super::Protocol;

/// What the protocols of a serial line are called here.
const NAMES: &[&str] = &[
    "rtu",
    #[cfg(feature = "ascii")]
    "ascii",
    #[cfg(feature = "unitelway")]
    "unitelway",
];

/// A text that is no protocol.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// No protocol has this name.
    #[error("{0:?} is not a protocol: expected {expected}", expected = or(NAMES))]
    Unknown(String),
    /// The protocol has no such setting.
    #[error("{setting:?} is not a setting of {protocol}: expected NAME=VALUE with one of {names}", names = names(protocol))]
    Setting {
        /// The protocol.
        protocol: &'static str,
        /// What was said.
        setting: String,
    },
    /// The setting cannot have this value.
    #[error("{setting}={value:?}: expected {expected}")]
    Value {
        /// The setting.
        setting: &'static str,
        /// What was said.
        value: String,
        /// What can be said.
        expected: &'static str,
    },
}

/// It is written `NAME[,SETTING=VALUE]...` with the settings that differ from the default.
impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            #[cfg(feature = "ascii")]
            Self::Ascii(settings) => settings::write(f, settings::ASCII, settings),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(settings) => settings::write(f, settings::UNI_TELWAY, settings),
            _ => Ok(()),
        }
    }
}

#[cfg(feature = "serde")]
drive_core::written_as_text!(Protocol);

impl FromStr for Protocol {
    type Err = ProtocolError;

    /// `NAME[,SETTING=VALUE]...` of what a serial line can speak; what is not said has its default. Modbus TCP is chosen
    /// by the address of its server.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (name, said) = text.split_once(',').map_or((text, None), |(name, rest)| (name, Some(rest)));
        match name.trim().to_ascii_lowercase().as_str() {
            "rtu" => match said {
                None => Ok(Self::Rtu),
                Some(said) => Err(ProtocolError::Setting { protocol: "rtu", setting: said.to_owned() }),
            },
            #[cfg(feature = "ascii")]
            "ascii" => settings::read("ascii", settings::ASCII, said).map(Self::Ascii),
            #[cfg(feature = "unitelway")]
            "unitelway" | "uni-telway" => {
                settings::read("unitelway", settings::UNI_TELWAY, said).map(Self::UniTelway)
            }
            _ => Err(ProtocolError::Unknown(name.to_owned())),
        }
    }
}

/// The names as an English list.
fn or(names: &[&str]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

fn names(protocol: &str) -> String {
    let names: Vec<&str> = match protocol {
        #[cfg(feature = "ascii")]
        "ascii" => settings::ASCII.iter().map(|setting| setting.name).collect(),
        #[cfg(feature = "unitelway")]
        "unitelway" => settings::UNI_TELWAY.iter().map(|setting| setting.name).collect(),
        _ => vec!["none"],
    };
    names.join(", ")
}

#[cfg(all(test, feature = "ascii", feature = "unitelway"))]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::protocol::{NetworkHeader, UniTelwaySettings};

    #[test]
    fn a_protocol_reads_back_as_it_is_written() {
        for text in [
            "rtu",
            "ascii",
            "ascii,character-gap=5s,delimiter=23h",
            "unitelway",
            "unitelway,header=simplified,category=0,link-timeout=200ms",
            "unitelway,header=0102030405,silence-bits=20,poll-pause=15ms,repeats=3,busy-timeout=2s",
        ] {
            assert_eq!(text.parse::<Protocol>().unwrap().to_string(), text);
        }
        assert_eq!("UNI-TELWAY,header=standard".parse::<Protocol>().unwrap().to_string(), "unitelway");
    }

    #[test]
    fn every_setting_is_told_when_it_differs() {
        let settings = UniTelwaySettings {
            header: NetworkHeader::Simplified,
            category: 1,
            silence_bits: 2,
            link_timeout: Duration::from_millis(3),
            poll_pause: Duration::from_millis(4),
            repeats: 5,
            busy_timeout: Duration::from_millis(6),
        };
        let written = Protocol::UniTelway(settings).to_string();
        assert_eq!(written.split(',').count(), 1 + settings::UNI_TELWAY.len(), "{written}");
        assert_eq!(written.parse(), Ok(Protocol::UniTelway(settings)));
    }

    #[test]
    fn what_is_no_setting_or_no_value_of_it_is_refused_with_what_was_expected() {
        for (text, reason) in [
            ("modbus", "expected rtu, ascii or unitelway"),
            ("rtu,header=simplified", "not a setting of rtu: expected NAME=VALUE with one of none"),
            ("ascii,header=simplified", "one of character-gap, delimiter"),
            ("unitelway,simplified", "one of header, category, silence-bits, link-timeout"),
            ("unitelway,", "\"\" is not a setting"),
            ("unitelway,header=short", "simplified, standard"),
            ("unitelway,header=00FE0000", "simplified, standard"),
            ("unitelway,category=8", "0 to 7"),
            ("unitelway,link-timeout=200", "150ms"),
            ("unitelway,link-timeout=61s", "at most 60s"),
            ("unitelway,repeats=-1", "a whole number"),
            ("ascii,delimiter=:", "0Ah"),
            ("ascii,delimiter=3Ah", "0Ah"),
        ] {
            let error = text.parse::<Protocol>().unwrap_err().to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
