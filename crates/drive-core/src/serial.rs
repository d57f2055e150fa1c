//! The character on the wire: format, speed, and the silences that follow from them.

use std::{fmt, str::FromStr, time::Duration};

/// Parity of a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parity {
    /// No parity bit.
    None,
    /// Even parity.
    Even,
    /// Odd parity.
    Odd,
}

/// Data bits, parity and stop bits of a character, written as the manuals write it: `8E1`, `7O2`, `8N1`.
///
/// ```
/// use drive_core::serial::CharacterFormat;
///
/// assert_eq!("8E1".parse(), Ok(CharacterFormat::F8E1));
/// assert_eq!(CharacterFormat::F8E1.bits(), 11, "with its start bit");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CharacterFormat {
    data_bits: u8,
    parity: Parity,
    stop_bits: u8,
}

impl CharacterFormat {
    /// 8 data bits, even parity, 1 stop bit: Modbus' own default.
    pub const F8E1: Self = Self::new(8, Parity::Even, 1);
    /// 8 data bits, odd parity, 1 stop bit.
    pub const F8O1: Self = Self::new(8, Parity::Odd, 1);
    /// 8 data bits, no parity, 1 stop bit.
    pub const F8N1: Self = Self::new(8, Parity::None, 1);
    /// 8 data bits, no parity, 2 stop bits.
    pub const F8N2: Self = Self::new(8, Parity::None, 2);
    /// 7 data bits, even parity, 1 stop bit.
    pub const F7E1: Self = Self::new(7, Parity::Even, 1);
    /// 7 data bits, odd parity, 1 stop bit.
    pub const F7O1: Self = Self::new(7, Parity::Odd, 1);
    /// 7 data bits, even parity, 2 stop bits.
    pub const F7E2: Self = Self::new(7, Parity::Even, 2);
    /// 7 data bits, odd parity, 2 stop bits.
    pub const F7O2: Self = Self::new(7, Parity::Odd, 2);

    const fn new(data_bits: u8, parity: Parity, stop_bits: u8) -> Self {
        Self { data_bits, parity, stop_bits }
    }

    /// Data bits, 7 or 8.
    #[must_use]
    pub const fn data_bits(self) -> u8 {
        self.data_bits
    }

    /// Parity.
    #[must_use]
    pub const fn parity(self) -> Parity {
        self.parity
    }

    /// Stop bits, 1 or 2.
    #[must_use]
    pub const fn stop_bits(self) -> u8 {
        self.stop_bits
    }

    /// Bits that one character takes on the wire, start bit included.
    #[must_use]
    pub const fn bits(self) -> u32 {
        let parity = match self.parity {
            Parity::None => 0,
            Parity::Even | Parity::Odd => 1,
        };
        1 + self.data_bits as u32 + parity + self.stop_bits as u32
    }
}

impl fmt::Display for CharacterFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parity = match self.parity {
            Parity::None => 'N',
            Parity::Even => 'E',
            Parity::Odd => 'O',
        };
        write!(f, "{}{parity}{}", self.data_bits, self.stop_bits)
    }
}

/// A text that is no character format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a character format: expected 7 or 8, then N, E or O, then 1 or 2, as in 8E1")]
pub struct CharacterFormatError(String);

impl FromStr for CharacterFormat {
    type Err = CharacterFormatError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = || CharacterFormatError(text.to_owned());
        let &[data, parity, stop] = text.as_bytes() else { return Err(error()) };
        let data_bits = match data {
            b'7' => 7,
            b'8' => 8,
            _ => return Err(error()),
        };
        let parity = match parity.to_ascii_uppercase() {
            b'N' => Parity::None,
            b'E' => Parity::Even,
            b'O' => Parity::Odd,
            _ => return Err(error()),
        };
        let stop_bits = match stop {
            b'1' => 1,
            b'2' => 2,
            _ => return Err(error()),
        };
        Ok(Self { data_bits, parity, stop_bits })
    }
}

/// Speed and character format of a serial line.
///
/// ```
/// use drive_core::SerialSettings;
///
/// let settings: SerialSettings = "9600 8N1".parse()?;
/// // Ten bits a character: the silence between two frames is 3.5 of them.
/// assert_eq!(settings.characters(8).as_micros(), 8_333);
/// assert_eq!(settings.t3_5().as_micros(), 3_645);
/// assert_eq!(SerialSettings::default().to_string(), "19200 8E1");
/// # Ok::<(), drive_core::serial::SerialSettingsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SerialSettings {
    baud: u32,
    format: CharacterFormat,
}

/// A speed that no serial line of this kind has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} bit/s is not a serial speed: expected 300 to 1000000, usually 9600, 19200, 38400 or 115200")]
pub struct BaudError(u32);

impl SerialSettings {
    /// 19200 bit/s, 8E1: the default of Modbus and of most drives here.
    pub const MODBUS_DEFAULT: Self = Self { baud: 19_200, format: CharacterFormat::F8E1 };

    /// Settings of a line.
    ///
    /// # Errors
    /// [`BaudError`] when the speed is outside 300 to 1 000 000 bit/s.
    pub const fn new(baud: u32, format: CharacterFormat) -> Result<Self, BaudError> {
        if baud < 300 || baud > 1_000_000 {
            return Err(BaudError(baud));
        }
        Ok(Self { baud, format })
    }

    /// Speed in bit/s.
    #[must_use]
    pub const fn baud(self) -> u32 {
        self.baud
    }

    /// Character format.
    #[must_use]
    pub const fn format(self) -> CharacterFormat {
        self.format
    }

    /// The time `bits` bits take on the wire, rounded up to the next nanosecond.
    #[must_use]
    pub const fn bits(self, bits: u32) -> Duration {
        Duration::from_nanos((bits as u64 * 1_000_000_000).div_ceil(self.baud as u64))
    }

    /// The time `characters` characters take on the wire.
    #[must_use]
    pub fn characters(self, characters: usize) -> Duration {
        let bits = characters as u64 * u64::from(self.format.bits());
        Duration::from_nanos(bits.saturating_mul(1_000_000_000).div_ceil(u64::from(self.baud)))
    }

    /// t3.5, the silence between two RTU frames: 3.5 characters of the real character length, and a fixed 1.75 ms
    /// above 19200 bit/s (MODBUS over Serial Line V1.02, p. 13).
    #[must_use]
    pub const fn t3_5(self) -> Duration {
        if self.baud > 19_200 {
            return Duration::from_micros(1_750);
        }
        Duration::from_nanos((self.format.bits() as u64 * 7 * 1_000_000_000).div_ceil(2 * self.baud as u64))
    }
}

impl Default for SerialSettings {
    fn default() -> Self {
        Self::MODBUS_DEFAULT
    }
}

impl fmt::Display for SerialSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.baud, self.format)
    }
}

/// A text that is no setting of a serial line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SerialSettingsError {
    /// It is not a speed and a character format.
    #[error("{0:?} is not a speed in bit/s and a character format, as in 19200 8E1")]
    Form(String),
    /// No serial line of this kind has the speed.
    #[error(transparent)]
    Baud(#[from] BaudError),
    /// The character format is none.
    #[error(transparent)]
    Format(#[from] CharacterFormatError),
}

/// Reads speed and character format, such as `19200 8E1`.
impl FromStr for SerialSettings {
    type Err = SerialSettingsError;

    fn from_str(text: &str) -> Result<Self, SerialSettingsError> {
        let form = || SerialSettingsError::Form(text.to_owned());
        let (baud, format) = text.trim().split_once(' ').ok_or_else(form)?;
        let baud = baud.parse().map_err(|_| form())?;
        Ok(Self::new(baud, format.trim_start().parse()?)?)
    }
}

#[cfg(feature = "serde")]
crate::written_as_text!(CharacterFormat, SerialSettings);

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "serde")]
    #[test]
    fn settings_are_written_as_their_text_and_what_is_none_is_named() {
        let settings: SerialSettings = serde_json::from_str("\"9600 8N2\"").unwrap();
        assert_eq!(serde_json::to_string(&settings).unwrap(), "\"9600 8N2\"");
        assert_eq!(serde_json::to_string(&settings.format()).unwrap(), "\"8N2\"");
        let error = serde_json::from_str::<SerialSettings>("\"5 8E1\"").unwrap_err().to_string();
        assert!(error.starts_with("5 bit/s is not a serial speed"), "{error}");
        assert!(serde_json::from_str::<SerialSettings>("19200").is_err());
    }

    #[test]
    fn t3_5_follows_the_real_character_length_up_to_19200_and_is_fixed_above() {
        let t3_5 = |baud, format| SerialSettings::new(baud, format).unwrap().t3_5().as_micros();
        assert_eq!(t3_5(2_400, CharacterFormat::F8E1), 16_041);
        assert_eq!(t3_5(9_600, CharacterFormat::F8N1), 3_645);
        assert_eq!(t3_5(19_200, CharacterFormat::F8E1), 2_005);
        assert_eq!(t3_5(38_400, CharacterFormat::F8E1), 1_750);
    }

    #[test]
    fn a_format_reads_back_as_it_is_written() {
        for text in ["7O1", "7E1", "7O2", "7E2", "8O1", "8E1", "8N1", "8N2"] {
            assert_eq!(text.parse::<CharacterFormat>().unwrap().to_string(), text);
        }
        for text in ["", "8", "9N1", "8X1", "8N3", "8N1x"] {
            assert!(text.parse::<CharacterFormat>().is_err(), "{text}");
        }
    }

    #[test]
    fn settings_read_back_as_they_are_written() {
        for text in ["19200 8E1", "9600 8N2", "300 7O1"] {
            assert_eq!(text.parse::<SerialSettings>().unwrap().to_string(), text);
        }
        for (text, says) in [
            ("19200", "is not a speed in bit/s and a character format"),
            ("fast 8E1", "is not a speed in bit/s"),
            ("19200 9E1", "is not a character format"),
            ("5 8E1", "5 bit/s is not a serial speed"),
        ] {
            let error = text.parse::<SerialSettings>().unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn an_impossible_speed_is_refused() {
        assert!(SerialSettings::new(0, CharacterFormat::F8E1).is_err());
        assert!(SerialSettings::new(u32::MAX, CharacterFormat::F8E1).is_err());
    }
}
