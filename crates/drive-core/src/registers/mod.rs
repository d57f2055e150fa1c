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
//!     TLS: ReadWrite(11701, "tLS", "low speed operating time", RamUntilSaved, Unit::scaled("s", 1), Range::Within(0, 9999), Factory::Value(0), Elsewhere, "BBV51701 p. 28");
//! }
//!
//! assert_eq!(ROWS.len(), 2);
//! assert_eq!(TLS.row().unit.show(30), "3.0 s");
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
//! Nor does writing a register that can only be read, because [`Calls::write`](crate::Calls::write) takes
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

mod guard;
mod limits;
mod relations;
mod restoring;
mod row;
mod space;
mod unit;

use std::{fmt, marker::PhantomData};

pub use crate::access::{self, Access};
pub use guard::refuse_commands;
pub use limits::{Allows, Exceeded, Limit};
pub use relations::{Holds, Relation};
pub use restoring::{Change, Part, Restoring, Scaled, Step, in_order};
pub use row::{Choice, Confidence, Factory, NoFactory, Range, Row, Storage, Written};
pub use space::{Place, Space};
pub use unit::{Form, Unit};

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

/// Declares the registers of a family: a typed constant for each row, its address as a plain constant of the same name in
/// a module `address`, and a slice of all rows.
///
/// A row is `CONSTANT: Access(address, mnemonic, name, Storage, unit, range, factory, Confidence, source);` with the
/// variants of [`Access`](crate::registers::Access), [`Storage`](crate::registers::Storage) and
/// [`Confidence`](crate::registers::Confidence) by their bare names. See the [module](mod@crate::registers) for examples.
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
                    space: $crate::registers::Space::HoldingRegister,
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

        /// The addresses of the registers by their names, for patterns.
        #[allow(unused_imports, unreachable_pub, dead_code)]
        $visibility mod address {
            use super::*;

            $(
                #[doc = concat!("`", $code, "`, ", $name, ".")]
                pub const $constant: u16 = $address;
            )*
        }

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
    fn an_address_is_a_pattern() {
        let name = |address| match address {
            address::RFR => "rFr",
            address::SLL => "SLL",
            _ => "?",
        };
        assert_eq!([3_202, 7_010, 3].map(name), ["rFr", "SLL", "?"]);
    }

    #[test]
    fn a_row_is_found_by_mnemonic_decimal_or_hexadecimal_address() {
        for text in ["rFr", "RFR", "3202", "W3202", "0C82h", "0x0C82"] {
            assert_eq!(Row::find(ROWS, text), Some(RFR.row()), "{text}");
        }
        for text in ["rF", "3203", "0xrFr", ""] {
            assert_eq!(Row::find(ROWS, text), None, "{text}");
        }
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
    fn points_of_a_full_scale_are_shown_in_its_unit_and_read_back() {
        // BBV51701 p. 19: 32767 points are 600 Hz.
        let unit = Unit::points("Hz", 2, 600).signed();
        for (word, text) in [
            (0, "0.00 Hz"),
            (1_638, "29.99 Hz"),
            (0x7FFF, "600.00 Hz"),
            (1_638_u16.wrapping_neg(), "-29.99 Hz"),
        ] {
            assert_eq!((unit.show(word).as_str(), unit.read(text)), (text, Some(word)));
        }
        assert_eq!(unit.read("601"), None);
    }

    #[test]
    fn a_word_of_which_the_sign_is_not_printed_is_a_number_only_where_it_would_be_the_same_with_one() {
        let unit = Unit::scaled("%", 0).sign_not_printed();
        let shown = [0, 0x7FFF, 0x8000, 0xFFFF].map(|word| unit.show(word));
        assert_eq!(shown, ["0 %", "32767 %", "8000h", "FFFFh"]);
    }

    #[test]
    fn a_listed_value_is_shown_with_its_meaning_and_read_by_its_mnemonic() {
        assert_eq!(SLL.row().show(1), "1 YES (freewheel)");
        assert_eq!(SLL.row().read("YES"), Some(1));
        assert!(!SLL.row().range.allows(2));
    }
}
