//! Which protocol a serial line speaks.

use std::{fmt, str::FromStr};

use drive_core::serial::{CharacterFormat, SerialSettings};

pub use crate::exchange::{
    ascii::AsciiSettings,
    unitelway::{NetworkHeader, UniTelwaySettings},
};

/// The protocol of a serial line. Families never see which one it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Protocol {
    /// Modbus RTU.
    #[default]
    Rtu,
    /// Modbus ASCII, see [`ascii`](crate::exchange::ascii).
    Ascii(AsciiSettings),
    /// UNI-TELWAY, see [`unitelway`](crate::exchange::unitelway).
    UniTelway(UniTelwaySettings),
}

impl Protocol {
    /// Whether the protocol can be spoken with these characters.
    ///
    /// # Errors
    /// [`ProtocolMismatch`] when it cannot.
    pub fn check(&self, serial: SerialSettings) -> Result<(), ProtocolMismatch> {
        let format = serial.format();
        match self {
            Self::Rtu if format.data_bits() != 8 => Err(ProtocolMismatch::Rtu(format)),
            Self::UniTelway(_) if format != CharacterFormat::F8O1 => Err(ProtocolMismatch::UniTelway(format)),
            Self::UniTelway(settings) if !settings.is_category() => {
                Err(ProtocolMismatch::Category(settings.category))
            }
            _ => Ok(()),
        }
    }
}

/// Settings that a protocol cannot have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ProtocolMismatch {
    /// Bytes do not fit into the characters.
    #[error("Modbus RTU needs characters of 8 data bits, not {0}; 7 are for Modbus ASCII")]
    Rtu(CharacterFormat),
    /// UNI-TELWAY has one format.
    #[error("UNI-TELWAY needs the format 8O1, not {0}")]
    UniTelway(CharacterFormat),
    /// Requests have categories from 0 to 7.
    #[error("{0} is no category of a UNI-TE request: expected 0 to 7")]
    Category(u8),
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rtu => "rtu",
            Self::Ascii(_) => "ascii",
            Self::UniTelway(_) => "unitelway",
        })
    }
}

/// A text that is no protocol.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a protocol: expected rtu, ascii or unitelway")]
pub struct ProtocolError(String);

impl FromStr for Protocol {
    type Err = ProtocolError;

    /// The protocol of this name with its default settings.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.to_ascii_lowercase().as_str() {
            "rtu" => Ok(Self::Rtu),
            "ascii" => Ok(Self::Ascii(AsciiSettings::default())),
            "unitelway" | "uni-telway" => Ok(Self::UniTelway(UniTelwaySettings::default())),
            _ => Err(ProtocolError(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_protocol_reads_back_as_it_is_written() {
        for text in ["rtu", "ascii", "unitelway"] {
            assert_eq!(text.parse::<Protocol>().unwrap().to_string(), text);
        }
        assert!("modbus".parse::<Protocol>().is_err());
    }

    #[test]
    fn each_protocol_has_the_formats_of_the_card() {
        let check = |protocol: &str, format: &str| {
            let serial = SerialSettings::new(9_600, format.parse().unwrap()).unwrap();
            protocol.parse::<Protocol>().unwrap().check(serial)
        };
        for format in ["7O1", "7E1", "7O2", "7E2", "8O1", "8E1", "8N1", "8N2"] {
            let seven = format.starts_with('7');
            assert_eq!(check("ascii", format), Ok(()));
            assert_eq!(check("rtu", format).is_err(), seven, "{format}");
            assert_eq!(check("unitelway", format).is_err(), format != "8O1", "{format}");
        }
    }
}
