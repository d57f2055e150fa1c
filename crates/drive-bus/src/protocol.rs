//! Which protocol a line speaks, and everything that follows from that.

mod text;
pub(crate) mod time;

use std::time::Duration;

use drive_core::serial::{CharacterFormat, SerialSettings};

pub use self::text::ProtocolError;
#[cfg(feature = "ascii")]
use crate::exchange::ascii;
#[cfg(feature = "ascii")]
pub use crate::exchange::ascii::AsciiSettings;
#[cfg(feature = "tcp")]
use crate::exchange::mbap;
#[cfg(feature = "unitelway")]
use crate::exchange::unitelway;
use crate::exchange::{Machine, echo::Echo, rtu};
#[cfg(feature = "unitelway")]
pub use drive_unitelway::{NetworkHeader, UniTelwaySettings};

/// The last address that a slave on a line can have; the rest is reserved (MODBUS over Serial Line V1.02 p. 7).
const LAST_ON_A_LINE: u8 = 247;

/// The protocol of a line. Families never see which one it is. Those whose feature is not compiled in do not exist.
///
/// ```
/// use drive_bus::{LineConfig, Protocol};
/// use drive_core::SerialSettings;
///
/// let ascii: Protocol = "ascii".parse()?;
/// let config = LineConfig { protocol: ascii, ..LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT) };
/// assert!(config.protocol.is_ascii() && config.protocol.is_paced());
/// assert_eq!(Protocol::default().to_string(), "rtu");
/// # Ok::<(), drive_bus::protocol::ProtocolError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Protocol {
    /// Modbus RTU.
    #[default]
    Rtu,
    /// Modbus TCP: no characters and no silences, a transaction number in each frame, and 255 units. Feature `tcp`.
    #[cfg(feature = "tcp")]
    Tcp,
    /// Modbus ASCII. Feature `ascii`.
    #[cfg(feature = "ascii")]
    Ascii(AsciiSettings),
    /// UNI-TELWAY. Feature `unitelway`.
    #[cfg(feature = "unitelway")]
    UniTelway(UniTelwaySettings),
}

impl Protocol {
    /// Its name, without its settings.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Rtu => "rtu",
            #[cfg(feature = "tcp")]
            Self::Tcp => "tcp",
            #[cfg(feature = "ascii")]
            Self::Ascii(_) => "ascii",
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => "unitelway",
        }
    }

    /// The machine of its exchanges, on a line with these settings.
    pub(crate) fn machine(self, serial: SerialSettings, chunk_gap: Duration, echo: Echo) -> Box<dyn Machine> {
        match self {
            Self::Rtu => Box::new(rtu::Rtu::new(serial, chunk_gap, echo)),
            #[cfg(feature = "tcp")]
            Self::Tcp => Box::new(mbap::Mbap::new()),
            #[cfg(feature = "ascii")]
            Self::Ascii(settings) => Box::new(ascii::Ascii::new(serial, settings, echo)),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(settings) => Box::new(unitelway::UniTelway::new(serial, settings, chunk_gap)),
        }
    }

    /// Whether its frames are characters on a line, which take time and need silences between them. Modbus TCP has none.
    #[must_use]
    pub const fn is_paced(&self) -> bool {
        match self {
            #[cfg(feature = "tcp")]
            Self::Tcp => false,
            _ => true,
        }
    }

    /// Whether it is Modbus ASCII.
    #[must_use]
    pub const fn is_ascii(&self) -> bool {
        match self {
            #[cfg(feature = "ascii")]
            Self::Ascii(_) => true,
            _ => false,
        }
    }

    /// The silence before any request: t3.5 in RTU. The other protocols need none to tell frames apart; a slave needs it
    /// to let go of the line, and gets a character's time in ASCII and its own silence in UNI-TELWAY.
    #[must_use]
    pub const fn silence(&self, serial: SerialSettings) -> Duration {
        match self {
            Self::Rtu => serial.t3_5(),
            #[cfg(feature = "tcp")]
            Self::Tcp => Duration::ZERO,
            #[cfg(feature = "ascii")]
            Self::Ascii(_) => serial.bits(serial.format().bits()),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(settings) => serial.bits(settings.silence_bits),
        }
    }

    /// What an exchange takes besides the times that the slave needs: the characters of request and answer with PDUs of
    /// these lengths, all that goes with them, and the silences.
    #[must_use]
    pub fn exchange_time(&self, serial: SerialSettings, request: usize, answer: usize) -> Duration {
        let silences = match self {
            // Ours are a request, two polls and an acknowledgement.
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => 4,
            _ => 1,
        };
        self.characters(serial, self.request_len(request) + self.answer_len(answer))
            + self.silence(serial) * silences
    }

    /// What a request takes with the silence before it.
    #[must_use]
    pub fn request_time(&self, serial: SerialSettings, request: usize) -> Duration {
        self.characters(serial, self.request_len(request)) + self.silence(serial)
    }

    /// The time that so many characters of its frames take.
    fn characters(&self, serial: SerialSettings, characters: usize) -> Duration {
        if self.is_paced() { serial.characters(characters) } else { Duration::ZERO }
    }

    /// How often the slave speaks in one exchange.
    #[must_use]
    pub const fn turns(&self) -> u32 {
        match self {
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => 3,
            _ => 1,
        }
    }

    /// How many characters the frame of a request with a PDU of this length has.
    pub(crate) const fn request_len(&self, pdu: usize) -> usize {
        match self {
            Self::Rtu => pdu + rtu::OVERHEAD,
            #[cfg(feature = "tcp")]
            Self::Tcp => pdu + mbap::HEADER,
            #[cfg(feature = "ascii")]
            Self::Ascii(_) => ascii::len(pdu),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => drive_unitelway::request_len(pdu),
        }
    }

    /// How many characters come and go from the end of the request until the answer with a PDU of this length has come.
    pub(crate) const fn answer_len(&self, pdu: usize) -> usize {
        match self {
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => drive_unitelway::reply_len(pdu),
            _ => self.request_len(pdu),
        }
    }

    /// How long an exchange may go on after the time of its answer is over, because something is still coming in.
    pub(crate) fn overtime(&self, serial: SerialSettings, chunk_gap: Duration) -> Duration {
        match self {
            Self::Rtu => rtu::overtime(serial, chunk_gap),
            #[cfg(feature = "ascii")]
            Self::Ascii(settings) => ascii::overtime(serial, *settings),
            #[cfg(any(feature = "tcp", feature = "unitelway"))]
            _ => Duration::ZERO,
        }
    }

    /// Whether an answer may equal its request, so that an adapter may have to be asked for its echo.
    pub(crate) const fn asks_for_echo(&self) -> bool {
        match self {
            #[cfg(feature = "tcp")]
            Self::Tcp => false,
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) => false,
            _ => true,
        }
    }

    /// The last address that a slave can have. Gateways use those behind 247 for themselves.
    pub(crate) const fn last_address(&self) -> u8 {
        if self.is_paced() { LAST_ON_A_LINE } else { u8::MAX }
    }

    /// Whether the protocol can be spoken with these characters.
    ///
    /// # Errors
    /// [`ProtocolMismatch`] when it cannot.
    pub fn check(&self, serial: SerialSettings) -> Result<(), ProtocolMismatch> {
        let format = serial.format();
        match self {
            Self::Rtu if format.data_bits() != 8 => Err(ProtocolMismatch::Rtu(format)),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(_) if format != CharacterFormat::F8O1 => Err(ProtocolMismatch::UniTelway(format)),
            #[cfg(feature = "unitelway")]
            Self::UniTelway(settings) if !settings.is_category() => {
                Err(ProtocolMismatch::Category(settings.category))
            }
            _ => Ok(()),
        }
    }
}

/// Settings that a protocol cannot have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProtocolMismatch {
    /// Bytes do not fit into the characters.
    #[error("Modbus RTU needs characters of 8 data bits, not {0}; 7 are for Modbus ASCII")]
    Rtu(CharacterFormat),
    /// Modbus TCP has no characters.
    #[cfg(all(feature = "serial", feature = "tcp"))]
    #[error("Modbus TCP is for connections, not for a serial port")]
    Tcp,
    /// Modbus TCP is a connection of two, which nobody else hears.
    #[error("Modbus TCP cannot be listened to: expected a serial port or RTU over TCP")]
    NoLine,
    /// UNI-TELWAY has one format.
    #[cfg(feature = "unitelway")]
    #[error("UNI-TELWAY needs the format 8O1, not {0}")]
    UniTelway(CharacterFormat),
    /// Requests have categories from 0 to 7.
    #[cfg(feature = "unitelway")]
    #[error("{0} is no category of a UNI-TE request: expected 0 to 7")]
    Category(u8),
}

#[cfg(all(test, feature = "ascii", feature = "unitelway"))]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_takes_what_its_characters_and_silences_take() {
        let time = |protocol: &str, serial: SerialSettings| {
            protocol.parse::<Protocol>().unwrap().exchange_time(serial, 5, 18).as_micros()
        };
        let even = SerialSettings::MODBUS_DEFAULT;
        // FC03 × 8: 8 + 21 characters of 11 bits and 3.5 of silence, at 19200.
        assert_eq!(time("rtu", even), (8 + 21) * 11 * 1_000_000 / 19_200 + 2_005);
        let seven = SerialSettings::new(19_200, CharacterFormat::F7E1).unwrap();
        // 17 + 43 characters of 10 bits and one of silence.
        assert_eq!(time("ascii", seven), (17 + 43 + 1) * 10 * 1_000_000 / 19_200);
        let odd = SerialSettings::new(19_200, CharacterFormat::F8O1).unwrap();
        // 20 characters, ACK, 3, 29, ACK, 3, EOT, and four times 10 bits.
        let said = 20 + 1 + 3 + 29 + 1 + 3 + 1;
        assert_eq!(time("unitelway", odd), (said * 11 + 4 * 10) * 1_000_000 / 19_200);
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
