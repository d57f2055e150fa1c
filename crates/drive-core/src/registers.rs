//! Register tables: one register, one row, with its source; typed constants made from the same rows.
//!
//! A family lists its registers once with [`registers!`](crate::registers!). The rows serve the drive, its
//! simulator and the program's parameter commands, so the three cannot disagree.
//!
//! ```
//! use drive_core::registers;
//!
//! registers! {
//!     /// The registers of a drive with two of them.
//!     pub const ROWS;
//!
//!     ETA: Read(3201, "ETA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
//!     ACC: ReadWrite(9001, "ACC", "acceleration", RamUntilSaved, Unit::scaled("s", 1), Range::Within(1, 32_760), Factory::Value(30), Elsewhere, "BBV51701 p. 38");
//! }
//!
//! assert_eq!(ROWS.len(), 2);
//! assert_eq!(ACC.row().unit.show(30), "3.0 s");
//! ```
//!
//! Two rows with one address do not compile:
//!
//! ```compile_fail
//! use drive_core::registers;
//!
//! registers! {
//!     /// Twice the same address.
//!     pub const ROWS;
//!
//!     ETA: Read(3201, "ETA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "p. 21");
//!     ETB: Read(3201, "ETB", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "p. 21");
//! }
//! ```
//!
//! Nor does writing a register that can only be read, because [`Registers::write`](crate::Registers::write) takes
//! a `Register<impl Writable>`:
//!
//! ```compile_fail
//! use drive_core::{registers, registers::{Register, access::Writable}};
//!
//! registers! {
//!     /// One register.
//!     pub const ROWS;
//!
//!     ETA: Read(3201, "ETA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "p. 21");
//! }
//!
//! fn write(_: Register<impl Writable>) {}
//! write(ETA);
//! ```

use std::{fmt, marker::PhantomData};

use crate::units::{read_decimal, write_decimal};

/// Who may write a register, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Read,
    /// Read, and written at any time.
    ReadWrite,
    /// Read, and written only while the motor is stopped.
    WriteStopped,
    /// Written only; reading it is an error.
    Write,
}

impl Access {
    /// Whether the register can be read.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Self::Write)
    }

    /// Whether the register can be written at all.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        !matches!(self, Self::Read)
    }
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Read => "R",
            Self::ReadWrite => "R/W",
            Self::WriteStopped => "R/WS",
            Self::Write => "W",
        })
    }
}

/// The access kinds as types, so that the compiler refuses to write what can only be read.
pub mod access {
    use super::Access;

    /// An access kind.
    pub trait Kind {
        /// The same as a value.
        const ACCESS: Access;
    }
    /// A kind that can be read.
    pub trait Readable: Kind {}
    /// A kind that can be written.
    pub trait Writable: Kind {}

    /// Read only.
    #[derive(Debug, Clone, Copy)]
    pub struct Read;
    /// Read, and written at any time.
    #[derive(Debug, Clone, Copy)]
    pub struct ReadWrite;
    /// Read, and written only while the motor is stopped.
    #[derive(Debug, Clone, Copy)]
    pub struct WriteStopped;
    /// Written only.
    #[derive(Debug, Clone, Copy)]
    pub struct Write;

    impl Kind for Read {
        const ACCESS: Access = Access::Read;
    }
    impl Kind for ReadWrite {
        const ACCESS: Access = Access::ReadWrite;
    }
    impl Kind for WriteStopped {
        const ACCESS: Access = Access::WriteStopped;
    }
    impl Kind for Write {
        const ACCESS: Access = Access::Write;
    }
    impl Readable for Read {}
    impl Readable for ReadWrite {}
    impl Readable for WriteStopped {}
    impl Writable for ReadWrite {}
    impl Writable for WriteStopped {}
    impl Writable for Write {}
}

/// Where a written value lives, and so what a power cycle and a write cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Storage {
    /// Lost at power-off: commands, references, monitored values.
    Volatile,
    /// Taken at once in RAM and lost at power-off, unless the drive is told to save its parameters to EEPROM.
    RamUntilSaved,
    /// Each write goes to EEPROM, whose life is counted in writes.
    Eeprom,
    /// The manual does not say; treat each write as one to EEPROM.
    Unknown,
}

impl fmt::Display for Storage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Volatile => "RAM",
            Self::RamUntilSaved => "RAM until saved",
            Self::Eeprom => "EEPROM",
            Self::Unknown => "unknown",
        })
    }
}

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
}

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

    /// The word as the number it stands for, in the unit's smallest step.
    #[must_use]
    pub const fn number(self, word: u16) -> i32 {
        if self.signed { word as i16 as i32 } else { word as i32 }
    }

    /// The word as a person reads it: `50.0 Hz`, `0627h`.
    #[must_use]
    pub fn show(self, word: u16) -> String {
        let mut text = String::new();
        if self.form == Form::Bits {
            return format!("{word:04X}h");
        }
        // Writing into a String does not fail.
        let _ = write_decimal(&mut text, i64::from(self.number(word)), self.decimals);
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
        if self.signed {
            i16::try_from(number).ok().map(i16::cast_unsigned)
        } else {
            u16::try_from(number).ok()
        }
    }
}

/// One value of a list-type register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Choice {
    /// The word.
    pub value: u16,
    /// The manual's mnemonic, as the keypad shows it.
    pub code: &'static str,
    /// What it means.
    pub meaning: &'static str,
}

impl Choice {
    /// A value of a list.
    #[must_use]
    pub const fn new(value: u16, code: &'static str, meaning: &'static str) -> Self {
        Self { value, code, meaning }
    }
}

/// Which words a register takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Range {
    /// The manual gives no range (bit words, monitored values).
    Any,
    /// From and to, in counts.
    Within(i32, i32),
    /// Only the values of a list.
    OneOf(&'static [Choice]),
    /// The values of a list, or a number from and to.
    OneOfOr(&'static [Choice], i32, i32),
    /// From and to in counts as far as they are fixed, and the rest of the rule in words ("LSP to tFr"): the drive
    /// itself judges.
    Described(i32, i32, &'static str),
}

impl Range {
    /// Whether `number` can be taken at all. For [`Range::Described`] the drive has the last word.
    #[must_use]
    pub fn allows(self, number: i32) -> bool {
        let listed = |choices: &[Choice]| choices.iter().any(|choice| i32::from(choice.value) == number);
        match self {
            Self::Any => true,
            Self::Within(min, max) | Self::Described(min, max, _) => (min..=max).contains(&number),
            Self::OneOf(choices) => listed(choices),
            Self::OneOfOr(choices, min, max) => listed(choices) || (min..=max).contains(&number),
        }
    }

    /// The listed values, if there are any.
    #[must_use]
    pub const fn choices(self) -> &'static [Choice] {
        match self {
            Self::OneOf(choices) | Self::OneOfOr(choices, _, _) => choices,
            Self::Any | Self::Within(..) | Self::Described(..) => &[],
        }
    }
}

/// The factory setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Factory {
    /// There is none (monitored values), or the manual prints none.
    None,
    /// The word.
    Value(u16),
    /// A rule in words ("0.7 In").
    Described(&'static str),
}

/// How sure a fact is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Confidence {
    /// Printed in the drive's communication manual.
    Manual,
    /// Not there, but confirmed by another public document or by a program used in production.
    Elsewhere,
}

/// One register: everything that is known of it, and from where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Row {
    /// The address on the wire.
    pub address: u16,
    /// The manual's mnemonic.
    pub code: &'static str,
    /// What it is, in plain English.
    pub name: &'static str,
    /// Who may write it.
    pub access: Access,
    /// Where a written value lives.
    pub storage: Storage,
    /// What a count means.
    pub unit: Unit,
    /// Which values it takes.
    pub range: Range,
    /// The factory setting.
    pub factory: Factory,
    /// How sure the row is.
    pub confidence: Confidence,
    /// Document and page or section.
    pub source: &'static str,
}

impl Row {
    /// The listed value that `word` stands for, if the register has a list and the word is on it.
    #[must_use]
    pub fn choice(&self, word: u16) -> Option<&'static Choice> {
        self.range.choices().iter().find(|choice| choice.value == word)
    }

    /// The word as a person reads it, with the meaning of a listed value.
    #[must_use]
    pub fn show(&self, word: u16) -> String {
        match self.choice(word) {
            Some(choice) if choice.meaning.is_empty() => format!("{word} {}", choice.code),
            Some(choice) => format!("{word} {} ({})", choice.code, choice.meaning),
            None => self.unit.show(word),
        }
    }

    /// The word that a person's text means for this register: a number in its unit, a hexadecimal word, or the
    /// mnemonic of a listed value. `None` when it is none of them.
    #[must_use]
    pub fn read(&self, text: &str) -> Option<u16> {
        let text = text.trim();
        let listed = self.range.choices().iter().find(|choice| choice.code == text);
        listed.map(|choice| choice.value).or_else(|| self.unit.read(text))
    }

    /// The row whose mnemonic or decimal or hexadecimal address is `text`.
    #[must_use]
    pub fn find(rows: &'static [Self], text: &str) -> Option<&'static Self> {
        let by_code = rows.iter().find(|row| row.code == text);
        by_code.or_else(|| {
            let address = match text.strip_suffix(['h', 'H']) {
                Some(digits) => u16::from_str_radix(digits, 16).ok()?,
                None => text.strip_prefix('W').unwrap_or(text).parse().ok()?,
            };
            rows.iter().find(|row| row.address == address)
        })
    }
}

/// A register with its access in its type.
pub struct Register<A> {
    row: &'static Row,
    access: PhantomData<fn() -> A>,
}

impl<A: access::Kind> Register<A> {
    /// Made by [`registers!`](crate::registers!).
    #[doc(hidden)]
    #[must_use]
    pub const fn new(row: &'static Row) -> Self {
        Self { row, access: PhantomData }
    }

    /// Everything that is known of it.
    #[must_use]
    pub const fn row(self) -> &'static Row {
        self.row
    }

    /// The address on the wire.
    #[must_use]
    pub const fn address(self) -> u16 {
        self.row.address
    }
}

impl<A> Clone for Register<A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A> Copy for Register<A> {}

impl<A> fmt::Debug for Register<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.row.code, self.row.address)
    }
}

/// Fails the build when two rows have one address. Called by [`registers!`](crate::registers!).
#[doc(hidden)]
pub const fn assert_addresses_differ(rows: &[Row]) {
    let mut left = 0;
    while left < rows.len() {
        let mut right = left + 1;
        while right < rows.len() {
            assert!(rows[left].address != rows[right].address, "two rows have one address");
            right += 1;
        }
        left += 1;
    }
}

/// Declares the registers of a family: a typed constant for each row, and a slice of all rows.
///
/// A row is `CONSTANT: Access(address, mnemonic, name, Storage, unit, range, factory, Confidence, source);` with the
/// variants of [`Access`](crate::registers::Access), [`Storage`](crate::registers::Storage) and
/// [`Confidence`](crate::registers::Confidence) by their bare names. See the [module](crate::registers) for examples.
#[macro_export]
macro_rules! registers {
    (
        $(#[$rows_meta:meta])*
        $visibility:vis const $rows:ident;
        $(
            $(#[$meta:meta])*
            $constant:ident: $access:ident(
                $address:expr, $code:expr, $name:expr, $storage:ident, $unit:expr, $range:expr, $factory:expr,
                $confidence:ident, $source:expr $(,)?
            );
        )*
    ) => {
        $(
            #[doc = concat!("`", $code, "`, ", $name, " (", $source, ").")]
            $(#[$meta])*
            $visibility const $constant: $crate::registers::Register<$crate::registers::access::$access> = {
                #[allow(unused_imports)]
                use $crate::registers::{Factory, Range, Unit};
                $crate::registers::Register::new(&$crate::registers::Row {
                    address: $address,
                    code: $code,
                    name: $name,
                    access: $crate::registers::Access::$access,
                    storage: $crate::registers::Storage::$storage,
                    unit: $unit,
                    range: $range,
                    factory: $factory,
                    confidence: $crate::registers::Confidence::$confidence,
                    source: $source,
                })
            };
        )*

        $(#[$rows_meta])*
        $visibility const $rows: &[$crate::registers::Row] = &[$(*$constant.row()),*];

        const _: () = $crate::registers::assert_addresses_differ($rows);
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &[Choice] = &[Choice::new(0, "nO", "ignored"), Choice::new(1, "YES", "freewheel")];

    registers! {
        /// Rows for these tests.
        pub(crate) const ROWS;

        RFR: Read(3202, "rFr", "output frequency", Volatile, Unit::scaled("Hz", 1).signed(), Range::Any, Factory::None, Elsewhere, "p. 21");
        SLL: WriteStopped(7010, "SLL", "reaction to SLF", RamUntilSaved, Unit::CODE, Range::OneOf(LIST), Factory::Value(1), Elsewhere, "p. 53");
    }

    #[test]
    fn a_row_is_found_by_mnemonic_decimal_or_hexadecimal_address() {
        for text in ["rFr", "3202", "W3202", "0C82h"] {
            assert_eq!(Row::find(ROWS, text), Some(RFR.row()), "{text}");
        }
        assert_eq!(Row::find(ROWS, "RFR"), None);
    }

    #[test]
    fn a_word_is_shown_in_its_unit_and_read_back() {
        let unit = RFR.row().unit;
        assert_eq!(unit.show(0xFE0C), "-50.0 Hz");
        for text in ["-50", "-50.0", "-50.0 Hz", "-50.0Hz", "FE0Ch", "0xFE0C"] {
            assert_eq!(unit.read(text), Some(0xFE0C), "{text}");
        }
        for text in ["50.05", "4000", "Hz", "", "h", "0x", "12345h"] {
            assert_eq!(unit.read(text), None, "{text}");
        }
    }

    #[test]
    fn a_listed_value_is_shown_with_its_meaning_and_read_by_its_mnemonic() {
        assert_eq!(SLL.row().show(1), "1 YES (freewheel)");
        assert_eq!(SLL.row().read("YES"), Some(1));
        assert!(!SLL.row().range.allows(2));
    }
}
