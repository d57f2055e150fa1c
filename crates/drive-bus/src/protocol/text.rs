//! A protocol and its settings as a text: the name, and behind it what differs from the default.

use std::{fmt, str::FromStr, time::Duration};

use super::{AsciiSettings, NetworkHeader, Protocol, UniTelwaySettings};

/// Milliseconds that a setting can have: longer ones are somebody's mistake.
const LONGEST: u64 = 60_000;
const NUMBER: &str = "a whole number";
const TIME: &str = "a time such as 150ms or 2s, at most 60s";
const HEADER: &str = "simplified, standard, or five bytes such as 00FE000000";
const CHARACTER: &str = "a character such as 0Ah";

/// A text that is no protocol.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProtocolError {
    /// No protocol has this name.
    #[error("{0:?} is not a protocol: expected rtu, ascii or unitelway")]
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

/// One setting of the protocol whose settings are an `S`.
struct Setting<S> {
    name: &'static str,
    expected: &'static str,
    set: fn(&mut S, &str) -> Option<()>,
    say: fn(&S) -> String,
}

const ASCII: &[Setting<AsciiSettings>] = &[
    Setting {
        name: "character-gap",
        expected: TIME,
        set: |settings, text| time(text).map(|value| settings.character_gap = value),
        say: |settings| said(settings.character_gap),
    },
    Setting {
        name: "delimiter",
        expected: CHARACTER,
        set: |settings, text| {
            let digits = text.strip_suffix(['h', 'H'])?;
            let value = u8::from_str_radix(digits, 16).ok()?;
            (value.is_ascii() && value != b':').then(|| settings.delimiter = value)
        },
        say: |settings| format!("{:02X}h", settings.delimiter),
    },
];

const UNI_TELWAY: &[Setting<UniTelwaySettings>] = &[
    Setting {
        name: "header",
        expected: HEADER,
        set: |settings, text| header(text).map(|value| settings.header = value),
        say: |settings| match settings.header {
            NetworkHeader::Simplified => "simplified".to_owned(),
            NetworkHeader::Standard { network, station, gate, extensions: [first, second] } => {
                format!("{network:02X}{station:02X}{gate:02X}{first:02X}{second:02X}")
            }
        },
    },
    Setting {
        name: "category",
        expected: "a category from 0 to 7",
        set: |settings, text| {
            settings.category = text.parse().ok()?;
            settings.is_category().then_some(())
        },
        say: |settings| settings.category.to_string(),
    },
    Setting {
        name: "turnaround-bits",
        expected: NUMBER,
        set: |settings, text| text.parse::<u16>().ok().map(|value| settings.turnaround_bits = value.into()),
        say: |settings| settings.turnaround_bits.to_string(),
    },
    Setting {
        name: "link-timeout",
        expected: TIME,
        set: |settings, text| time(text).map(|value| settings.link_timeout = value),
        say: |settings| said(settings.link_timeout),
    },
    Setting {
        name: "poll-pause",
        expected: TIME,
        set: |settings, text| time(text).map(|value| settings.poll_pause = value),
        say: |settings| said(settings.poll_pause),
    },
    Setting {
        name: "repeats",
        expected: NUMBER,
        set: |settings, text| text.parse::<u8>().ok().map(|value| settings.repeats = value.into()),
        say: |settings| settings.repeats.to_string(),
    },
    Setting {
        name: "busy-timeout",
        expected: TIME,
        set: |settings, text| time(text).map(|value| settings.busy_timeout = value),
        say: |settings| said(settings.busy_timeout),
    },
];

/// It is written `NAME[,SETTING=VALUE]...` with the settings that differ from the default.
impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Rtu => Ok(()),
            Self::Ascii(settings) => write(f, ASCII, settings),
            Self::UniTelway(settings) => write(f, UNI_TELWAY, settings),
        }
    }
}

impl FromStr for Protocol {
    type Err = ProtocolError;

    /// `NAME[,SETTING=VALUE]...`; what is not said has its default.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (name, settings) = text.split_once(',').map_or((text, None), |(name, rest)| (name, Some(rest)));
        match name.trim().to_ascii_lowercase().as_str() {
            "rtu" => read::<()>("rtu", &[], settings).map(|()| Self::Rtu),
            "ascii" => read("ascii", ASCII, settings).map(Self::Ascii),
            "unitelway" | "uni-telway" => read("unitelway", UNI_TELWAY, settings).map(Self::UniTelway),
            _ => Err(ProtocolError::Unknown(name.to_owned())),
        }
    }
}

fn write<S: Default>(f: &mut fmt::Formatter<'_>, settings: &[Setting<S>], value: &S) -> fmt::Result {
    let default = S::default();
    for setting in settings {
        let said = (setting.say)(value);
        if said != (setting.say)(&default) {
            write!(f, ",{}={said}", setting.name)?;
        }
    }
    Ok(())
}

fn read<S: Default>(
    protocol: &'static str,
    settings: &[Setting<S>],
    text: Option<&str>,
) -> Result<S, ProtocolError> {
    let mut value = S::default();
    for said in text.into_iter().flat_map(|text| text.split(',')) {
        let unknown = || ProtocolError::Setting { protocol, setting: said.to_owned() };
        let (name, text) = said.split_once('=').ok_or_else(unknown)?;
        let setting = settings.iter().find(|setting| setting.name == name.trim()).ok_or_else(unknown)?;
        (setting.set)(&mut value, text.trim()).ok_or_else(|| ProtocolError::Value {
            setting: setting.name,
            value: text.to_owned(),
            expected: setting.expected,
        })?;
    }
    Ok(value)
}

fn names(protocol: &str) -> String {
    let names: Vec<&str> = match protocol {
        "ascii" => ASCII.iter().map(|setting| setting.name).collect(),
        "unitelway" => UNI_TELWAY.iter().map(|setting| setting.name).collect(),
        _ => vec!["none"],
    };
    names.join(", ")
}

fn header(text: &str) -> Option<NetworkHeader> {
    match text {
        "simplified" => Some(NetworkHeader::Simplified),
        "standard" => Some(NetworkHeader::default()),
        digits if digits.len() == 10 && digits.bytes().all(|digit| digit.is_ascii_hexdigit()) => {
            let [_, _, _, network, station, gate, first, second] =
                u64::from_str_radix(digits, 16).ok()?.to_be_bytes();
            Some(NetworkHeader::Standard { network, station, gate, extensions: [first, second] })
        }
        _ => None,
    }
}

fn time(text: &str) -> Option<Duration> {
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1),
        None => (text.strip_suffix('s')?, 1_000),
    };
    let millis = number.trim_end().parse::<u32>().ok().map(|number| u64::from(number) * unit)?;
    (millis <= LONGEST).then(|| Duration::from_millis(millis))
}

fn said(time: Duration) -> String {
    let millis = time.as_millis();
    if millis >= 1_000 && millis.is_multiple_of(1_000) {
        format!("{}s", millis / 1_000)
    } else {
        format!("{millis}ms")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_protocol_reads_back_as_it_is_written() {
        for text in [
            "rtu",
            "ascii",
            "ascii,character-gap=5s,delimiter=23h",
            "unitelway",
            "unitelway,header=simplified,category=0,link-timeout=200ms",
            "unitelway,header=0102030405,turnaround-bits=20,poll-pause=15ms,repeats=3,busy-timeout=2s",
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
            turnaround_bits: 2,
            link_timeout: Duration::from_millis(3),
            poll_pause: Duration::from_millis(4),
            repeats: 5,
            busy_timeout: Duration::from_millis(6),
        };
        let written = Protocol::UniTelway(settings).to_string();
        assert_eq!(written.split(',').count(), 1 + UNI_TELWAY.len(), "{written}");
        assert_eq!(written.parse(), Ok(Protocol::UniTelway(settings)));
    }

    #[test]
    fn what_is_no_setting_or_no_value_of_it_is_refused_with_what_was_expected() {
        for (text, reason) in [
            ("modbus", "expected rtu, ascii or unitelway"),
            ("rtu,header=simplified", "not a setting of rtu: expected NAME=VALUE with one of none"),
            ("ascii,header=simplified", "one of character-gap, delimiter"),
            ("unitelway,simplified", "one of header, category, turnaround-bits, link-timeout"),
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
