//! What a word means as a number, and how a person reads and writes it.

use crate::units::{read_decimal, write_decimal};

/// What a raw word means as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Unit {
    /// The unit's symbol, empty for a plain count.
    pub symbol: &'static str,
    /// Decimals of the printed value: 1 means that one count is 0.1 of the unit.
    pub decimals: u8,
    /// Whether the word is a signed 16-bit number.
    pub signed: bool,
    /// How the word is shown.
    pub form: Form,
}

/// How a word is shown and read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// As a decimal number in the unit.
    Number,
    /// As bits, in hexadecimal.
    Bits,
    /// As the number of a listed value.
    Code,
    /// As a decimal number in the unit, of which 32767 points are so many: "resolution 32767 points = 600 Hz".
    Points(u16),
    /// As a decimal number in the unit below 8000h, and above as bits: whether the word has a sign is not printed.
    SignNotPrinted,
}

/// How many points a full scale has.
const POINTS: i64 = 32_767;

impl Unit {
    /// A plain count.
    pub const COUNT: Self = Self::scaled("", 0);
    /// A word of bits.
    pub const BITS: Self = Self { form: Form::Bits, ..Self::COUNT };
    /// The number of a listed value.
    pub const CODE: Self = Self { form: Form::Code, ..Self::COUNT };

    /// A number with `decimals` places in the unit `symbol`.
    #[must_use]
    pub const fn scaled(symbol: &'static str, decimals: u8) -> Self {
        Self { symbol, decimals, signed: false, form: Form::Number }
    }

    /// The same for a signed word.
    #[must_use]
    pub const fn signed(self) -> Self {
        Self { signed: true, ..self }
    }

    /// The same for a word of which the manual does not say whether it has a sign.
    #[must_use]
    pub const fn sign_not_printed(self) -> Self {
        Self { form: Form::SignNotPrinted, ..self }
    }

    /// Whether a word is shown as a number.
    #[must_use]
    pub const fn is_number(self, word: u16) -> bool {
        match self.form {
            Form::Number | Form::Points(_) => true,
            Form::SignNotPrinted => word < 0x8000,
            Form::Bits | Form::Code => false,
        }
    }

    /// A number with `decimals` places in the unit `symbol`, of which 32767 counts are `full`.
    #[must_use]
    pub const fn points(symbol: &'static str, decimals: u8, full: u16) -> Self {
        Self { form: Form::Points(full), ..Self::scaled(symbol, decimals) }
    }

    /// The word as the number that it stands for, as it is shown: in steps of its last decimal.
    #[must_use]
    pub fn shown(self, word: u16) -> i64 {
        let number = i64::from(self.number(word));
        match self.form {
            Form::Points(full) => {
                let whole = number * i64::from(full) * 10_i64.pow(self.decimals.into());
                (whole + whole.signum() * POINTS / 2) / POINTS
            }
            Form::Number | Form::SignNotPrinted | Form::Bits | Form::Code => number,
        }
    }

    /// The word as the number it stands for, in counts.
    #[must_use]
    pub const fn number(self, word: u16) -> i32 {
        if self.signed { word as i16 as i32 } else { word as i32 }
    }

    /// The word as a person reads it: `50.0 Hz`, `0627h`.
    #[must_use]
    pub fn show(self, word: u16) -> String {
        let mut text = String::new();
        if self.form == Form::Bits || self.form == Form::SignNotPrinted && !self.is_number(word) {
            return format!("{word:04X}h");
        }
        // Writing into a String does not fail.
        let _ = write_decimal(&mut text, self.shown(word), self.decimals);
        if !self.symbol.is_empty() {
            text.push(' ');
            text.push_str(self.symbol);
        }
        text
    }

    /// The word that a person's text means: a number with at most the unit's decimals, with or without its symbol,
    /// or a hexadecimal word as `0627h` or `0x0627`. `None` when it is neither or does not fit a word.
    #[must_use]
    pub fn read(self, text: &str) -> Option<u16> {
        let text = text.trim();
        let hexadecimal = text.strip_prefix("0x").or_else(|| text.strip_suffix(['h', 'H']));
        if let Some(digits) = hexadecimal
            && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
        {
            return u16::from_str_radix(digits, 16).ok();
        }
        let number = read_decimal(text.strip_suffix(self.symbol).unwrap_or(text).trim_end(), self.decimals)?;
        let number = match self.form {
            Form::Points(full) if full > 0 => {
                let full = i64::from(full) * 10_i64.pow(self.decimals.into());
                let whole = number.checked_mul(POINTS)?;
                (whole + whole.signum() * full / 2) / full
            }
            Form::Points(_) | Form::Number | Form::SignNotPrinted | Form::Bits | Form::Code => number,
        };
        if self.signed {
            i16::try_from(number).ok().map(i16::cast_unsigned)
        } else {
            u16::try_from(number).ok()
        }
    }
}
