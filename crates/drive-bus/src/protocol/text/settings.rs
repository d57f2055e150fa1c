//! The settings of a protocol as a text: each with its name, its values, and how they are said.

use std::fmt;

use super::ProtocolError;
#[cfg(feature = "ascii")]
use crate::protocol::AsciiSettings;
use crate::protocol::time;
#[cfg(feature = "unitelway")]
use crate::protocol::{NetworkHeader, UniTelwaySettings};

#[cfg(feature = "unitelway")]
const NUMBER: &str = "a whole number";
const TIME: &str = "a time such as 150ms or 2s, at most 60s";
#[cfg(feature = "unitelway")]
const HEADER: &str = "simplified, standard, or five bytes such as 00FE000000";
#[cfg(feature = "ascii")]
const CHARACTER: &str = "a character such as 0Ah";

/// One setting of the protocol whose settings are an `S`.
pub(super) struct Setting<S> {
    pub(super) name: &'static str,
    expected: &'static str,
    set: fn(&mut S, &str) -> Option<()>,
    say: fn(&S) -> String,
}

#[cfg(feature = "ascii")]
pub(super) const ASCII: &[Setting<AsciiSettings>] = &[
    Setting {
        name: "character-gap",
        expected: TIME,
        set: |settings, text| time::read(text).map(|value| settings.character_gap = value),
        say: |settings| time::said(settings.character_gap),
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

#[cfg(feature = "unitelway")]
pub(super) const UNI_TELWAY: &[Setting<UniTelwaySettings>] = &[
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
        name: "silence-bits",
        expected: NUMBER,
        set: |settings, text| text.parse::<u16>().ok().map(|value| settings.silence_bits = value.into()),
        say: |settings| settings.silence_bits.to_string(),
    },
    Setting {
        name: "link-timeout",
        expected: TIME,
        set: |settings, text| time::read(text).map(|value| settings.link_timeout = value),
        say: |settings| time::said(settings.link_timeout),
    },
    Setting {
        name: "poll-pause",
        expected: TIME,
        set: |settings, text| time::read(text).map(|value| settings.poll_pause = value),
        say: |settings| time::said(settings.poll_pause),
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
        set: |settings, text| time::read(text).map(|value| settings.busy_timeout = value),
        say: |settings| time::said(settings.busy_timeout),
    },
];

/// What differs from the default.
pub(super) fn write<S: Default>(
    f: &mut fmt::Formatter<'_>,
    settings: &[Setting<S>],
    value: &S,
) -> fmt::Result {
    let default = S::default();
    for setting in settings {
        let said = (setting.say)(value);
        if said != (setting.say)(&default) {
            write!(f, ",{}={said}", setting.name)?;
        }
    }
    Ok(())
}

/// The settings of a text; what it does not say has its default.
pub(super) fn read<S: Default>(
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

#[cfg(feature = "unitelway")]
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
